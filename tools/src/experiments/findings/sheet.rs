//! Sheets: typed rows with the columns that a table shows of them.

use super::{Measured, Repeats};
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

/// What can be shown in a cell.
pub trait Shown {
    /// The cell.
    fn cell(&self) -> Cell;
}

impl Shown for String {
    fn cell(&self) -> Cell {
        self.as_str().into()
    }
}

impl Shown for u64 {
    fn cell(&self) -> Cell {
        (*self).into()
    }
}

impl Shown for f64 {
    fn cell(&self) -> Cell {
        (*self).into()
    }
}

impl Shown for Measured {
    fn cell(&self) -> Cell {
        (*self).into()
    }
}

impl Shown for Repeats {
    fn cell(&self) -> Cell {
        self.measured().into()
    }
}

impl<T: Shown> Shown for Option<T> {
    fn cell(&self) -> Cell {
        self.as_ref().map_or_else(|| "none".into(), Shown::cell)
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
            $(#[doc = $head] #[serde(serialize_with = "crate::experiments::findings::json::Field::write", deserialize_with = "crate::experiments::findings::json::Field::read")] pub $field: $type,)*
        }

        impl $crate::experiments::findings::Sheet for $name {
            const TITLE: &'static str = $title;
            const KEYS: &'static [&'static str] = &[$(stringify!($key)),+];

            fn columns() -> Vec<$crate::experiments::findings::Column<Self>> {
                use $crate::experiments::findings::{Column, Shown};
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
    use super::*;

    rows! {
        /// A row of these tests.
        struct Row = "Rates" by [scene, rays] {
            scene: String = "scene",
            index: String = "index",
            rays: u64 = "rays",
            time: Repeats = "time (ms)",
        }
        beside "twice the rays" = |row| (2 * row.rays).into();
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
        assert_eq!(rows[0].label(), "ring, rays 7");
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
