//! Findings: what an experiment found, as typed rows, and all that a page says of it: tables, verdicts, plots, one number for a list.
//!
//! Rows are kept as JSON, and everything else is a function of them: a page can be written anew without a run, and criteria are there before one
//! (judged over no rows, they are "not run").

mod criterion;
pub(crate) mod json;
mod measured;
mod sheet;

pub use criterion::{Bound, Criterion, Judged, Verdict};
pub use measured::{Measured, Repeats};
pub(crate) use sheet::rows;
pub use sheet::{Column, Sheet, Shown};

use clerestory::{Error, Result};

use super::measures::Context;
use super::table::Table;

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
#[derive(Debug, Clone, PartialEq)]
pub struct Headline {
    /// What it is, with its unit.
    pub words: &'static str,
    /// The number.
    pub found: Measured,
}

/// All that a page says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// The number for a list of experiments; `None` where nothing was run.
    pub headline: Option<Headline>,
    /// Criteria with their verdicts.
    pub verdicts: Vec<Judged>,
    /// Tables, in the order of the page.
    pub tables: Vec<Table>,
}

impl Findings {
    /// A table of all columns, and verdicts.
    pub fn of<R: Sheet>(rows: &[R], criteria: &[Criterion<R>]) -> Self {
        Self {
            tables: if rows.is_empty() {
                Vec::new()
            } else {
                vec![R::table(rows)]
            },
            ..Self::default()
        }
        .judged(rows, criteria)
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
    pub fn headline(self, words: &'static str, found: Option<Measured>) -> Self {
        Self {
            headline: found.map(|found| Headline { words, found }),
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

    /// Tables and verdicts one after the other; the first headline.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.headline = self.headline.or(other.headline);
        self.verdicts.extend(other.verdicts);
        self.tables.extend(other.tables);
        self
    }

    /// The same of a smoke run, which decides only what holds in every form.
    #[must_use]
    pub fn of_smoke_run(mut self) -> Self {
        self.verdicts = self.verdicts.into_iter().map(Judged::of_smoke_run).collect();
        self
    }

    /// A line for each verdict, and one for the headline, as Markdown; empty without any.
    pub fn summary(&self) -> String {
        let mut text: String = self.verdicts.iter().map(|judged| format!("- {judged}\n")).collect();
        if let Some(Headline { words, found }) = &self.headline {
            if !text.is_empty() {
                text.push('\n');
            }
            text += &format!("In one number: {words}: {}.\n", super::table::Cell::from(*found));
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
    let values = rows.iter().filter(|row| among(row)).map(of);
    let worse = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    values.reduce(worse).map(Measured::exact)
}
