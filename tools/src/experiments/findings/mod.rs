//! Findings: what an experiment found, as typed rows, and all that a page says of it: tables, verdicts, plots, one number for a list.
//!
//! Rows are kept as JSON, and everything else is a function of them: a page can be written anew without a run, and criteria are there before one
//! (judged over no rows, they are "not run").

mod criterion;
mod field;
mod measured;
mod plots;
mod sheet;

pub use criterion::{Bound, Criterion, Judged, Verdict, judge};
pub use field::Field;
pub use measured::{Measured, Repeats, change, geometric_mean, z_most};
pub use plots::{Axes, Part, Plot, curves};
pub(crate) use sheet::rows;
pub use sheet::{Column, Sheet};

use clerestory::{Error, Result};

use super::measures::Context;
use super::measures::errors::greatest;
use super::plot::Curve;
use super::table::{Cell, Table};

/// An experiment of rows.
pub trait Study: Default + serde::Serialize + serde::de::DeserializeOwned {
    /// Takes the measure. Errors and counts are deterministic; times are not.
    ///
    /// # Errors
    /// Whatever the measured functions return.
    fn measure(context: &Context<'_>) -> Result<Self>;

    /// What these rows say; of none, where nothing was run, the criteria alone.
    fn findings(&self) -> Findings;
}

/// One number that a reader wants to know first.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Headline {
    /// What it is, with its unit.
    pub words: String,
    /// The number.
    pub found: Measured,
}

/// All that a page says.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Findings {
    /// The number for a list of experiments; `None` where nothing was run.
    pub headline: Option<Headline>,
    /// Criteria with their verdicts.
    pub verdicts: Vec<Judged>,
    /// Plots and pictures, the one for the page's top first.
    #[serde(skip)]
    pub plots: Vec<Plot>,
    /// Tables, in the order of the page.
    pub tables: Vec<Table>,
    /// How it was measured, besides what each run says of itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub facts: Vec<String>,
}

impl Findings {
    /// A table of all columns, and verdicts.
    pub fn of<R: Sheet>(rows: &[R], criteria: &[Criterion<R>]) -> Self {
        Self::tabled(rows, R::table, criteria)
    }

    /// As [`Findings::of`], with the values of one field as heads: a line for each of the other keys, in the order in which they appear.
    pub fn pivoted<R: Sheet>(rows: &[R], across: &str, criteria: &[Criterion<R>]) -> Self {
        Self::tabled(rows, |rows| R::pivoted(rows, across), criteria)
    }

    fn tabled<R: Sheet>(rows: &[R], table: impl Fn(&[R]) -> Table, criteria: &[Criterion<R>]) -> Self {
        let table = (!rows.is_empty()).then(|| table(rows));
        Self::from(Vec::from_iter(table)).judged(rows, criteria)
    }

    /// The same with verdicts on rows that stand in no table of their own.
    #[must_use]
    pub fn judged<R: Sheet>(mut self, rows: &[R], criteria: &[Criterion<R>]) -> Self {
        self.verdicts
            .extend(criteria.iter().map(|criterion| criterion.judge(rows)));
        self
    }

    /// The same with the number that a reader wants to know first.
    #[must_use]
    pub fn headline(self, words: impl Into<String>, found: Option<Measured>) -> Self {
        Self {
            headline: found.map(|found| Headline {
                words: words.into(),
                found,
            }),
            ..self
        }
    }

    /// The same with a note below its last table.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        if let Some(table) = self.tables.last_mut() {
            table.note(note);
        }
        self
    }

    /// The same with the last table for a file alone.
    #[must_use]
    pub fn long(mut self) -> Self {
        if let Some(table) = self.tables.last_mut() {
            table.is_long = true;
        }
        self
    }

    /// The same with curves; `name` is that of the file, without its ending.
    #[must_use]
    pub fn curves(self, name: &str, title: &str, axes: Axes, curves: Vec<Curve>) -> Self {
        self.plot(Plot::curves(name, title, axes, curves))
    }

    /// The same with a bar for each row: its group and its name, and its length.
    #[must_use]
    pub fn bars<R>(
        self,
        name: &str,
        title: &str,
        rows: &[R],
        names: impl Fn(&R) -> [String; 2],
        of: impl Fn(&R) -> Measured,
    ) -> Self {
        self.plot(Plot::bars(name, title, rows, names, of))
    }

    /// The same with a bar for each row, in parts.
    #[must_use]
    pub fn stacked_bars<R>(
        self,
        name: &str,
        title: &str,
        rows: &[R],
        names: impl Fn(&R) -> String,
        parts: &[Part<'_, R>],
    ) -> Self {
        self.plot(Plot::stacked_bars(name, title, rows, names, parts))
    }

    /// The same with an SVG that a study draws of its rows itself.
    #[must_use]
    pub fn drawing(self, file: &str, title: &str, svg: String) -> Self {
        self.plot(Plot::drawing(file, title, svg))
    }

    /// The same with a picture that the run wrote to [`Context::file`]. Of no run, it has none: call it where there are rows.
    #[must_use]
    pub fn picture(self, file: &str, words: &str) -> Self {
        self.plot(Plot::picture(file, words))
    }

    fn plot(mut self, plot: Plot) -> Self {
        self.plots.push(plot);
        self
    }

    /// Tables, plots and verdicts one after the other; the first headline.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.headline = self.headline.or(other.headline);
        self.verdicts.extend(other.verdicts);
        self.plots.extend(other.plots);
        self.tables.extend(other.tables);
        self.facts.extend(other.facts);
        self
    }

    /// The same of a smoke run, which decides only what holds in every form.
    #[must_use]
    pub fn of_smoke_run(mut self) -> Self {
        self.verdicts = self.verdicts.into_iter().map(Judged::of_smoke_run).collect();
        self
    }

    /// Whether a criterion, a column or a cell of words is called so.
    pub fn has(&self, words: &str) -> bool {
        let cell = Cell::from(words);
        // Heads of several values for each key name both.
        let is_head = |head: &String| head == words || head.rsplit_once(": ").is_some_and(|(_, key)| key == words);
        let in_table = |table: &Table| {
            let mut cells = table.rows.iter().flatten();
            table.heads.iter().any(is_head) || cells.any(|other| *other == cell)
        };
        self.verdicts.iter().any(|judged| judged.name == words) || self.tables.iter().any(in_table)
    }

    /// A line for each verdict, and one for the headline, as Markdown; empty without any.
    pub fn summary(&self) -> String {
        let mut text: String = self.verdicts.iter().map(|judged| format!("- {judged}\n")).collect();
        if let Some(Headline { words, found }) = &self.headline {
            if !text.is_empty() {
                text.push('\n');
            }
            text += &format!("In one number: {words}: {}.\n", Cell::from(*found));
        }
        text
    }
}

impl From<Vec<Table>> for Findings {
    fn from(tables: Vec<Table>) -> Self {
        Self {
            tables,
            ..Self::default()
        }
    }
}

/// Runs a study: its rows as JSON.
///
/// # Errors
/// As [`Study::measure`].
pub fn run<S: Study>(context: &Context<'_>) -> Result<String> {
    serde_json::to_string(&S::measure(context)?).map_err(|cause| unreadable("written", &cause))
}

/// What rows say that a run has written.
///
/// # Errors
/// [`Error::Setting`] where they are those of another form of the experiment.
pub fn read<S: Study>(rows: &str) -> Result<Findings> {
    let found: S = serde_json::from_str(rows).map_err(|cause| unreadable("read", &cause))?;
    Ok(found.findings())
}

fn unreadable(what: &str, cause: &serde_json::Error) -> Error {
    Error::setting("rows", what, cause.to_string())
}

/// The sum of counts of some rows; `None` of no rows.
pub fn total<R>(rows: &[R], among: fn(&R) -> bool, of: fn(&R) -> u64) -> Option<Measured> {
    let mut counts = rows.iter().filter(|row| among(row)).map(of).peekable();
    counts.peek()?;
    Some(counts.sum::<u64>().into())
}

/// The worst of some rows' numbers; `None` of no rows.
pub fn largest<R>(rows: &[R], among: fn(&R) -> bool, of: fn(&R) -> f64) -> Option<Measured> {
    let mut values = rows.iter().filter(|row| among(row)).map(of).peekable();
    values.peek()?;
    Some(greatest(values).into())
}
