//! Sheets: typed rows with the columns that a table shows of them.

use crate::experiments::table::{Cell, Table};

/// A column of rows: its head, with the unit, and the cell of a row.
pub struct Column<R> {
    /// The field's name; empty for what stands beside.
    pub field: &'static str,
    /// What it holds, with its unit.
    pub head: &'static str,
    /// A row's cell.
    pub of: fn(&R) -> Cell,
}

/// Rows with their columns; `rows!` writes it.
pub trait Sheet: Sized + 'static {
    /// What the table is called.
    const TITLE: &'static str;

    /// All columns, from left to right.
    fn columns() -> Vec<Column<Self>>;

    /// Fields that tell rows apart.
    const KEYS: &'static [&'static str];

    /// The row's name among others: words and numbers of its keys.
    fn label(&self) -> String {
        let columns = Self::columns();
        let mut words = Vec::new();
        for column in columns.iter().filter(|column| Self::KEYS.contains(&column.field)) {
            words.push(match (column.of)(self) {
                Cell::Text(text) => text,
                number => format!("{} {number}", column.head),
            });
        }
        words.join(", ")
    }

    /// The table of rows with the values of the key `across` as heads of all other columns but keys.
    fn pivoted(rows: &[Self], across: &str) -> Table {
        let columns = Self::columns();
        let Some(across) = columns.iter().find(|column| column.field == across) else {
            return Self::table(rows);
        };
        let is_key = |column: &&Column<Self>| Self::KEYS.contains(&column.field) && column.field != across.field;
        let keys: Vec<_> = columns.iter().filter(is_key).collect();
        let values: Vec<_> = columns
            .iter()
            .filter(|column| !Self::KEYS.contains(&column.field))
            .collect();
        let mut heads: Vec<String> = keys.iter().map(|column| column.head.to_owned()).collect();
        let mut of_across: Vec<Cell> = Vec::new();
        let mut lines: Vec<Vec<Cell>> = Vec::new();
        for row in rows {
            let (at, line) = ((across.of)(row), keys.iter().map(|column| (column.of)(row)).collect());
            if !of_across.contains(&at) {
                of_across.push(at);
            }
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
        for value in &values {
            heads.extend(of_across.iter().map(|at| match values.len() {
                1 => at.to_string(),
                _ => format!("{}: {at}", value.head),
            }));
        }
        let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
        let mut table = Table::new(Self::TITLE, &heads);
        for line in lines {
            let here = |row: &&Self| keys.iter().zip(&line).all(|(column, cell)| (column.of)(row) == *cell);
            let of_line: Vec<&Self> = rows.iter().filter(here).collect();
            let cell = |value: &Column<Self>, at: &Cell| {
                let row = of_line.iter().find(|row| (across.of)(row) == *at);
                row.map_or_else(|| "none".into(), |row| (value.of)(row))
            };
            let cells = values
                .iter()
                .flat_map(|value| of_across.iter().map(|at| cell(value, at)));
            let cells: Vec<Cell> = cells.collect();
            table.row(line.into_iter().chain(cells));
        }
        if let [value] = values.as_slice() {
            table.note(format!("Columns: {}, by {}.", value.head, across.head));
        }
        table
    }

    /// The table of rows.
    fn table(rows: &[Self]) -> Table {
        let columns = Self::columns();
        let heads: Vec<&str> = columns.iter().map(|column| column.head).collect();
        let mut table = Table::new(Self::TITLE, &heads);
        for row in rows {
            table.row(columns.iter().map(|column| (column.of)(row)));
        }
        table
    }
}

/// A struct of rows and its [`Sheet`](super::Sheet) from one list: the keys that tell rows apart, then field, type, head with its unit. Published numbers stand beside as columns that
/// are not stored: `beside "source: head (unit)" = |row| cell;`.
macro_rules! rows {
    (
        $(#[$doc:meta])*
        struct $name:ident = $title:literal by [$($key:ident),+] { $($field:ident: $type:ty = $head:literal,)* }
        $(beside $beside:literal = |$row:ident| $of:expr;)*
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(#[doc = $head] #[serde(serialize_with = "crate::experiments::findings::Field::write", deserialize_with = "crate::experiments::findings::Field::read")] pub $field: $type,)*
        }

        impl $crate::experiments::findings::Sheet for $name {
            const TITLE: &'static str = $title;
            const KEYS: &'static [&'static str] = &[$(stringify!($key)),+];

            fn columns() -> Vec<$crate::experiments::findings::Column<Self>> {
                use $crate::experiments::findings::{Column, Field};
                vec![
                    $(Column { field: stringify!($field), head: $head, of: |row: &Self| row.$field.cell() },)*
                    $(Column { field: "", head: $beside, of: |$row: &Self| $of },)*
                ]
            }
        }
    };
}
pub(crate) use rows;

#[cfg(test)]
mod tests {
    use super::super::Repeats;
    use super::*;

    rows! {
        /// A row of these tests.
        struct Row = "Rates" by [scene, index, rays] {
            scene: String = "scene",
            index: String = "index",
            rays: u64 = "rays",
            time: Repeats = "time (ms)",
        }
        beside "twice the rays" = |row| (2 * row.rays).into();
    }

    #[test]
    fn a_key_becomes_heads() {
        let row = |scene: &str, index: &str, rays| Row {
            scene: scene.into(),
            index: index.into(),
            rays,
            time: Repeats(vec![1.0; 5]),
        };
        let rows = [row("ring", "kd", 7), row("ring", "bvh", 7), row("room", "kd", 9)];
        let table = Row::pivoted(&rows, "index");
        assert_eq!(table.fault(), None);
        let text = table.markdown();
        assert!(
            text.contains("| scene | rays | time (ms): kd | time (ms): bvh |"),
            "{text}"
        );
        assert!(text.contains("| room | 9 | 1.000 | none | 18 | none |"), "{text}");
    }

    #[test]
    fn rows_are_a_table_and_come_back_from_json() {
        let rows = vec![Row {
            scene: "ring".into(),
            index: "kd".into(),
            rays: 7,
            time: Repeats(vec![1.0, 2.0, 3.0, 4.0, 5.0]),
        }];
        let table = Row::table(&rows);
        assert_eq!(table.fault(), None);
        assert!(
            table
                .markdown()
                .contains("| ring | kd | 7 | 3.000 (1.000 … 5.000) | 14 |"),
            "{}",
            table.markdown()
        );
        assert_eq!(rows[0].label(), "ring, kd, rays 7");
        let text = serde_json::to_string(&rows).unwrap();
        assert_eq!(serde_json::from_str::<Vec<Row>>(&text).unwrap(), rows);
        assert!(serde_json::from_str::<Vec<Row>>(&text.replace("rays", "beams")).is_err());
        let broken = Row {
            time: Repeats(vec![f64::NAN, f64::INFINITY]),
            ..rows[0].clone()
        };
        let text = serde_json::to_string(&broken).unwrap();
        let back: Row = serde_json::from_str(&text).unwrap();
        assert!(back.time.0[0].is_nan() && back.time.0[1] == f64::INFINITY, "{text}");
    }
}
