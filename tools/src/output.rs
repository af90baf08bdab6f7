//! What the program prints: plain text in a pipe, colour on a terminal only, and no complaint when nobody is listening any more.
//!
//! Guarantees: no control character but the line feed reaches a pipe, whatever a scene file calls its parts.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::time::Duration;

use clerestory::Error;
use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Outcome;

/// Where a text goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Standard output.
    Output,
    /// Error output.
    Error,
}

impl Stream {
    fn colored(self) -> bool {
        let terminal = match self {
            Self::Output => std::io::stdout().is_terminal(),
            Self::Error => std::io::stderr().is_terminal(),
        };
        terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
    }
}

/// Prints to standard output. A reader that has gone (`| head`) is not an error.
pub fn print(text: &str) -> Outcome {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(cause) if cause.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", cause).into()),
        _ => Ok(()),
    }
}

/// Prints a value as indented JSON to standard output.
pub fn print_json(value: &impl serde::Serialize) -> Outcome {
    print(&(json_text("standard output", value)? + "\n"))
}

/// A value as indented JSON; `name` is for errors.
pub fn json_text(name: &str, value: &impl serde::Serialize) -> Outcome<String> {
    serde_json::to_string_pretty(value).map_err(|cause| Error::io(name, cause.into()).into())
}

/// Prints a line to the error output.
pub fn note(line: &str) {
    // A closed error output leaves nobody to tell.
    let _ = writeln!(std::io::stderr().lock(), "{}", one_line(line));
}

/// Prints a table to the error output.
pub fn explain(text: &str) {
    // A closed error output leaves nobody to tell.
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Prints a warning to the error output.
pub fn warn(line: &str) {
    let _ = writeln!(
        std::io::stderr().lock(),
        "{} {}",
        style("33", "warning:", Stream::Error),
        one_line(line)
    );
}

/// The text on one line and without control characters.
pub fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Red on a terminal.
pub fn red(text: &str, stream: Stream) -> String {
    style("1;31", text, stream)
}

/// Bold on a terminal.
pub fn bold(text: &str) -> String {
    style("1", text, Stream::Output)
}

fn style(code: &str, text: &str, stream: Stream) -> String {
    if stream.colored() {
        format!("\x1b[{code}m{text}\x1b[0m")
    } else {
        text.to_owned()
    }
}

/// Between two pictures of a bar.
pub const TICK: Duration = Duration::from_millis(120);

/// A progress bar, which shows itself only where the error output is a terminal.
pub fn bar(length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    match ProgressStyle::with_template("{spinner} {wide_bar} {percent:>3} %  {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// Rows of text in columns; the first column is flush left, numbers are flush right.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
    left: Vec<usize>,
}

impl Table {
    /// A table with its heads; columns in `left` are flush left besides the first.
    pub fn new(heads: &[&str], left: &[usize]) -> Self {
        Self {
            rows: vec![heads.iter().map(|head| (*head).to_owned()).collect()],
            left: left.to_vec(),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().map(|cell| one_line(&cell)).collect());
    }

    /// The text, with bold heads on a terminal.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for (index, row) in self.rows.iter().enumerate() {
            let mut line = String::new();
            for (column, cell) in row.iter().enumerate() {
                let width = widths[column];
                let gap = if column == 0 { "" } else { "  " };
                // Writing to a string cannot fail.
                let _ = if column == 0 || self.left.contains(&column) {
                    write!(line, "{gap}{cell:<width$}")
                } else {
                    write!(line, "{gap}{cell:>width$}")
                };
            }
            let line = line.trim_end();
            text += &if index == 0 { bold(line) } else { line.to_owned() };
            text.push('\n');
        }
        text
    }
}

/// A number with a metric prefix and three significant digits: `12.3 M`.
pub fn metric(value: f64) -> String {
    let scaled = [(1e9, "G"), (1e6, "M"), (1e3, "k")];
    match scaled.iter().find(|(scale, _)| value.abs() >= *scale) {
        Some((scale, prefix)) => format!("{} {prefix}", three_digits(value / scale)),
        None => format!("{} ", three_digits(value)),
    }
}

fn three_digits(value: f64) -> String {
    match value.abs() {
        v if v >= 99.95 => format!("{value:.0}"),
        v if v >= 9.995 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// Bytes with a binary prefix.
pub fn bytes(count: u64) -> String {
    const UNITS: [&str; 4] = ["B", "KiB", "MiB", "GiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    let number = if unit == 0 {
        count.to_string()
    } else {
        three_digits(value)
    };
    format!("{number} {}", UNITS[unit])
}
