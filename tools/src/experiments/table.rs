//! Tables of measured numbers, as text, Markdown, CSV and JSON.

use super::findings::Measured;

/// A cell of a [`Table`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A count, exact.
    Count(u64),
    /// A measured number.
    Number(f64),
    /// A measured number with its interval.
    Interval(Measured),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<Measured> for Cell {
    /// An exact number is shown without an interval.
    fn from(found: Measured) -> Self {
        if found.is_exact() {
            Self::Number(found.value)
        } else {
            Self::Interval(found)
        }
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    /// What is not there is named so.
    fn from(value: Option<T>) -> Self {
        value.map_or_else(|| "none".into(), Into::into)
    }
}

impl std::fmt::Display for Cell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(number) if *number == 0.0 => f.write_str("0"),
            Self::Number(number) if (1e-3..1e5).contains(&number.abs()) => {
                // Four digits that count.
                let digits = (3.0 - number.abs().log10().floor()).max(0.0) as usize;
                write!(f, "{number:.digits$}")
            }
            Self::Number(number) => write!(f, "{number:.3e}"),
            Self::Interval(Measured { value, low, high }) if low.is_finite() && high.is_finite() => {
                let [value, low, high] = [value, low, high].map(|number| Self::Number(*number));
                write!(f, "{value} ({low} … {high})")
            }
            Self::Interval(Measured { value, .. }) => write!(f, "{} (no interval)", Self::Number(*value)),
        }
    }
}

/// Measured numbers with heads that name their units.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Table {
    /// What the numbers are.
    pub title: String,
    /// What each column holds, with its unit.
    pub heads: Vec<String>,
    /// The rows, each as long as the heads.
    pub rows: Vec<Vec<Cell>>,
    /// What a reader must know to judge the numbers.
    pub notes: Vec<String>,
    /// Too long for a page of results, which names its file instead.
    #[serde(skip)]
    pub is_long: bool,
}

impl Table {
    /// A table without rows.
    pub fn new(title: impl Into<String>, heads: &[&str]) -> Self {
        Self {
            title: title.into(),
            heads: heads.iter().map(|head| (*head).to_owned()).collect(),
            rows: Vec::new(),
            notes: Vec::new(),
            is_long: false,
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Adds a note.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// What is wrong with the table: no rows, a row that is not as long as the heads, a number that is not finite.
    pub fn fault(&self) -> Option<String> {
        if self.rows.is_empty() {
            return Some("has no rows".into());
        }
        self.rows.iter().enumerate().find_map(|(index, row)| {
            if row.len() != self.heads.len() {
                return Some(format!(
                    "row {index} has {} cells for {} heads",
                    row.len(),
                    self.heads.len()
                ));
            }
            let bad = |cell: &Cell| match cell {
                Cell::Number(number) => !number.is_finite(),
                Cell::Interval(found) => !found.value.is_finite(),
                Cell::Text(_) | Cell::Count(_) => false,
            };
            let column = row.iter().position(bad)?;
            Some(format!("row {index}, {}: {}", self.heads[column], row[column]))
        })
    }

    /// The same with some columns alone, in their order and without notes; `None` where one of them is missing.
    pub fn columns(&self, heads: &[&str]) -> Option<Self> {
        let place = |head: &&str| self.heads.iter().position(|own| own == head);
        let places: Vec<usize> = heads.iter().map(place).collect::<Option<_>>()?;
        let mut table = Self::new(self.title.as_str(), heads);
        for row in &self.rows {
            table.row(places.iter().filter_map(|place| row.get(*place).cloned()));
        }
        Some(table)
    }

    /// As Markdown below a heading of the second level.
    pub fn markdown(&self) -> String {
        let mut text = format!("## {}\n\n{}", self.title, self.grid());
        for note in &self.notes {
            text.push_str(&format!("\n{note}\n"));
        }
        text
    }

    /// As Markdown without title and notes.
    pub fn grid(&self) -> String {
        let mut text = format!("| {} |\n|", self.heads.join(" | "));
        for (column, _) in self.heads.iter().enumerate() {
            let words = self
                .rows
                .iter()
                .all(|row| matches!(row.get(column), Some(Cell::Text(_))));
            text.push_str(if words { "---|" } else { "---:|" });
        }
        text.push('\n');
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(|cell| cell.to_string().replace('|', "\\|")).collect();
            text.push_str(&format!("| {} |\n", cells.join(" | ")));
        }
        text
    }

    /// As comma-separated values, all digits of every number.
    pub fn csv(&self) -> String {
        let quote = |text: &str| {
            if text.contains([',', '"', '\n']) {
                format!("\"{}\"", text.replace('"', "\"\""))
            } else {
                text.to_owned()
            }
        };
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        // Intervals get columns of their own.
        let spans = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.any(|cell| matches!(cell, Cell::Interval(_)))
        };
        let spans: Vec<bool> = (0..self.heads.len()).map(spans).collect();
        let heads = self.heads.iter().zip(&spans).flat_map(|(head, spans)| {
            let ends: &[&str] = if *spans { &["", ", least", ", greatest"] } else { &[""] };
            ends.iter().map(move |end| quote(&format!("{head}{end}")))
        });
        let mut text = line(heads.collect());
        for row in &self.rows {
            let cells = row.iter().zip(&spans).flat_map(|(cell, spans)| {
                let number = |number: f64| format!("{number:e}");
                match cell {
                    Cell::Interval(Measured { value, low, high }) => vec![number(*value), number(*low), number(*high)],
                    exact => {
                        let text = match exact {
                            Cell::Text(words) => quote(words),
                            Cell::Count(count) => count.to_string(),
                            Cell::Number(value) | Cell::Interval(Measured { value, .. }) => number(*value),
                        };
                        // Exact cells beside intervals are their own ends.
                        vec![text; if *spans { 3 } else { 1 }]
                    }
                }
            });
            text += &line(cells.collect());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_hold_the_numbers() {
        let mut table = Table::new("Errors", &["what", "error (ulp)", "rays"]);
        table.row(["a, b".into(), 0.012345.into(), 7_u64.into()]);
        table.note("A note.");
        let text = table.markdown();
        assert!(
            text.contains("| a, b | 0.01235 | 7 |") && text.contains("|---|---:|---:|"),
            "{text}"
        );
        assert!(text.ends_with("\nA note.\n"));
        assert_eq!(table.csv(), "what,error (ulp),rays\n\"a, b\",1.2345e-2,7\n");
        assert_eq!(table.fault(), None);
        table.row(["b".into(), f64::NAN.into(), 7_u64.into()]);
        assert_eq!(table.fault().as_deref(), Some("row 1, error (ulp): NaN"));
        table.rows[1].pop();
        assert!(table.fault().is_some_and(|fault| fault.contains("2 cells for 3 heads")));
        assert!(Table::new("Empty", &["a"]).fault().is_some());
        let mut table = Table::new("Times", &["what", "time"]);
        table.row(["a".into(), Measured::within(2.0, 0.5).into()]);
        table.row(["b".into(), 3.0.into()]);
        assert_eq!(
            table.csv(),
            "what,time,\"time, least\",\"time, greatest\"\na,2e0,1.5e0,2.5e0\nb,3e0,3e0,3e0\n"
        );
        assert_eq!(Cell::Number(1234.5).to_string(), "1234");
        assert_eq!(Cell::Number(-0.5).to_string(), "-0.5000");
        assert_eq!(Cell::Number(1e-9).to_string(), "1.000e-9");
    }
}
