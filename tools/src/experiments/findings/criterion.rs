//! Criteria: what an experiment calls good, as statements about its rows that are true or false of them, made before it runs.

use super::{Measured, Sheet};
use crate::experiments::table::Cell;

/// Below it, exact whole numbers are written with all digits.
const LARGEST_COUNT: f64 = 1e12;

/// What is wanted of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// This or less.
    AtMost(f64),
    /// This or more.
    AtLeast(f64),
    /// No less than the first, no more than the second.
    Between(f64, f64),
}

impl Bound {
    /// By how much a number misses it; 0 or less where it does not.
    fn missed_by(self, value: f64) -> f64 {
        match self {
            _ if value.is_nan() => f64::INFINITY,
            Self::AtMost(most) => value - most,
            Self::AtLeast(least) => least - value,
            Self::Between(least, most) => (least - value).max(value - most),
        }
    }

    /// Whether an interval lies within it, on the other side of it, or on both.
    fn holds(self, found: &Measured) -> Option<bool> {
        if [found.value, found.low, found.high].iter().any(|value| value.is_nan()) {
            return Some(false);
        }
        let ends = [found.low, found.high].map(|end| self.missed_by(end) <= 0.0);
        match (self, ends) {
            (_, [true, true]) => Some(true),
            (Self::AtMost(_), [true, false]) | (Self::AtLeast(_), [false, true]) => None,
            (Self::Between(least, most), _) if found.low <= most && found.high >= least => None,
            _ => Some(false),
        }
    }
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::AtMost(most) => write!(f, "at most {}", shortest(most)),
            Self::AtLeast(least) => write!(f, "at least {}", shortest(least)),
            Self::Between(least, most) => write!(f, "{} to {}", shortest(least), shortest(most)),
        }
    }
}

/// A number that was chosen: no more digits than it has, four of those that are computed.
fn shortest(value: f64) -> String {
    let (chosen, computed) = (value.to_string(), Cell::Number(value).to_string());
    if chosen.len() < computed.len() {
        chosen
    } else {
        computed
    }
    .replace('-', "−")
}

/// An exact number: a whole one as counts are written.
fn number(value: f64) -> Cell {
    if value >= 0.0 && value.fract() == 0.0 && value < LARGEST_COUNT {
        Cell::Count(value as u64)
    } else {
        Cell::Number(value)
    }
}

/// A statement about rows that is true or false of them; a constant of its experiment.
pub struct Criterion<R: 'static> {
    name: &'static str,
    bound: Bound,
    because: &'static str,
    in_every_form: bool,
    needs: &'static str,
    among: fn(&R) -> bool,
    of: Of<R>,
}

/// What of rows is judged.
enum Of<R: 'static> {
    /// A number of each row.
    Each(fn(&R) -> Measured),
    /// One number of all rows; `None` where they have none.
    All(fn(&[&R]) -> Option<Measured>),
}

impl<R: Sheet> Criterion<R> {
    /// Of a number of each row; the worst row speaks for all.
    pub const fn each(name: &'static str, bound: Bound, of: fn(&R) -> Measured) -> Self {
        Self::new(name, bound, Of::Each(of))
    }

    /// Of one number of all rows, `None` where they have none.
    pub const fn all(name: &'static str, bound: Bound, of: fn(&[&R]) -> Option<Measured>) -> Self {
        Self::new(name, bound, Of::All(of))
    }

    const fn new(name: &'static str, bound: Bound, of: Of<R>) -> Self {
        Self {
            name,
            bound,
            because: "",
            in_every_form: false,
            needs: "",
            among: |_| true,
            of,
        }
    }

    /// Of these rows alone.
    #[must_use]
    pub const fn among(self, rows: fn(&R) -> bool) -> Self {
        Self { among: rows, ..self }
    }

    /// Where the bound is from, unless the experiment's own sentence has it.
    #[must_use]
    pub const fn because(self, why: &'static str) -> Self {
        Self { because: why, ..self }
    }

    /// Holds of the few inputs of a smoke run too.
    #[must_use]
    pub const fn in_every_form(self) -> Self {
        Self {
            in_every_form: true,
            ..self
        }
    }

    /// Only where this is there; without rows, a verdict names it.
    #[must_use]
    pub const fn needs(self, what: &'static str) -> Self {
        Self { needs: what, ..self }
    }

    /// The verdict on rows, as [`judge`].
    pub fn judge(&self, rows: &[R]) -> Judged {
        let rows: Vec<&R> = rows.iter().filter(|row| (self.among)(row)).collect();
        let found: Vec<(String, Measured)> = match self.of {
            Of::Each(of) => rows.iter().map(|row| (row.label(), of(row))).collect(),
            Of::All(of) => of(&rows).map(|found| (String::new(), found)).into_iter().collect(),
        };
        let mut judged = judge(self.name, self.bound, self.because, found);
        judged.in_every_form = self.in_every_form;
        if judged.verdict == Verdict::NotRun && !self.needs.is_empty() {
            judged.verdict = Verdict::Needs(self.needs.into());
        }
        judged
    }
}

/// The verdict on numbers, each with the name of its row. Each holds where its whole interval is within the bound, fails where none of it is, and is
/// undecided between; all hold where each does, and fail where one fails.
pub fn judge(name: &str, bound: Bound, because: &str, found: impl IntoIterator<Item = (String, Measured)>) -> Judged {
    let mut judged = Judged {
        name: name.into(),
        bound,
        because: because.into(),
        in_every_form: false,
        verdict: Verdict::NotRun,
        found: None,
        rows: 0,
        failing: 0,
        noisy: 0,
        worst: String::new(),
    };
    // Rows that fail come before those that noise decides, and these before those that hold.
    let mut most = (0, f64::NEG_INFINITY);
    for (label, found) in found {
        judged.rows += 1;
        let rank = match bound.holds(&found) {
            Some(true) => 0,
            Some(false) => {
                judged.failing += 1;
                2
            }
            None => {
                judged.noisy += 1;
                1
            }
        };
        let missed = (rank, bound.missed_by(found.value));
        if missed > most || judged.found.is_none() {
            most = missed;
            judged.found = Some(found);
            judged.worst = label;
        }
    }
    judged.verdict = match (judged.rows, judged.failing, judged.noisy) {
        (0, ..) => Verdict::NotRun,
        (_, 0, 0) => Verdict::Holds,
        (_, 0, _) => Verdict::Noise,
        _ => Verdict::Fails { by: most.1.max(0.0) },
    };
    judged
}

/// How a criterion came out.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it was wanted.
    Holds,
    /// Not as it was wanted, by so much at the worst row.
    Fails {
        /// In the unit of the number that is judged.
        by: f64,
    },
    /// Undecided: the intervals of some rows lie on both sides of the bound, and none fails.
    Noise,
    /// Undecided: there are no rows.
    NotRun,
    /// Undecided: there are no rows, for which this is needed.
    Needs(String),
    /// Undecided: a smoke run has too few inputs.
    SmokeForm,
}

/// A criterion with what was found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judged {
    /// The statement.
    pub name: String,
    /// What is wanted, in words.
    #[serde(serialize_with = "in_words")]
    pub bound: Bound,
    /// Where the bound is from; empty for the experiment's own sentence.
    pub because: String,
    /// Whether it holds of smoke runs too.
    pub in_every_form: bool,
    /// The verdict.
    pub verdict: Verdict,
    /// The worst row's number.
    pub found: Option<Measured>,
    /// Rows that were judged.
    pub rows: usize,
    /// Rows of these that fail.
    pub failing: usize,
    /// Rows of these whose interval lies on both sides of the bound.
    pub noisy: usize,
    /// The worst row's name.
    pub worst: String,
}

fn in_words<S: serde::Serializer>(bound: &Bound, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(bound)
}

impl Judged {
    /// The same of a smoke run, which decides only what holds in every form.
    #[must_use]
    pub fn of_smoke_run(self) -> Self {
        let verdict = match self.verdict {
            Verdict::NotRun | Verdict::Needs(_) => return self,
            _ if self.in_every_form => return self,
            _ => Verdict::SmokeForm,
        };
        Self { verdict, ..self }
    }
}

impl std::fmt::Display for Judged {
    /// A line of a page: "**fails by 0.12**: name: 1.12 where at most 1 is wanted, in 3 of 28 rows; worst: `conference`".
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.verdict {
            Verdict::Holds => write!(f, "**holds**")?,
            Verdict::Fails { by } if by.is_finite() => write!(f, "**fails** by {}", number(*by))?,
            Verdict::Fails { .. } => write!(f, "**fails**")?,
            Verdict::Noise => write!(f, "**undecided**, noise")?,
            Verdict::NotRun => write!(f, "**undecided**, not run")?,
            Verdict::Needs(what) => write!(f, "**undecided**, needs {what}")?,
            Verdict::SmokeForm => write!(f, "**undecided**, a smoke run")?,
        }
        write!(f, ": {}", self.name)?;
        match self.found {
            Some(found) if found.is_exact() => write!(f, ": {}; required: {}", number(found.value), self.bound)?,
            Some(found) => write!(f, ": {}; required: {}", Cell::from(found), self.bound)?,
            None => write!(f, ": required: {}", self.bound)?,
        }
        match (self.failing, self.noisy) {
            (0, 0) if self.rows > 1 => write!(f, ", {} rows", self.rows)?,
            (0, 0) => {}
            _ if self.rows == 1 => {}
            (0, noisy) => write!(f, ", noise decides {noisy} of {} rows", self.rows)?,
            (failing, _) => write!(f, ", in {failing} of {} rows", self.rows)?,
        }
        if !self.worst.is_empty() && self.rows > 1 && self.verdict != Verdict::Holds {
            write!(f, "; worst: {}", self.worst)?;
        }
        if !self.because.is_empty() {
            write!(f, " ({})", self.because)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Repeats, rows};
    use super::*;

    rows! {
        /// A row of these tests.
        struct Row = "Rows" by [name] {
            name: String = "name",
            time: Repeats = "time (ms)",
        }
    }

    fn row(name: &str, times: &[f64]) -> Row {
        Row {
            name: name.into(),
            time: Repeats(times.to_vec()),
        }
    }

    const FAST: Criterion<Row> = Criterion::each("fast", Bound::AtMost(2.0), |row: &Row| (&row.time).into());

    #[test]
    fn one_row_that_fails_decides_and_noise_does_not() {
        let (fast, slow) = (row("fast", &[1.0; 5]), row("slow", &[3.0; 5]));
        let noisy = row("noisy", &[1.0, 1.5, 2.5, 3.0, 1.0]);
        let verdict = |rows: &[Row]| FAST.judge(rows).verdict;
        assert_eq!(verdict(&[]), Verdict::NotRun);
        assert_eq!(verdict(std::slice::from_ref(&fast)), Verdict::Holds);
        assert_eq!(verdict(&[fast.clone(), noisy.clone()]), Verdict::Noise);
        let judged = FAST.judge(&[fast, slow, noisy]);
        assert_eq!(judged.verdict, Verdict::Fails { by: 1.0 });
        assert_eq!((judged.rows, judged.failing, judged.noisy), (3, 1, 1));
        let wide = row("wide", &[1.0, 2.0, 5.0, 9.0, 9.0]);
        assert_eq!(FAST.judge(&[wide, row("slow", &[2.5; 5])]).worst, "slow");
        let text = judged.to_string();
        assert!(
            text.starts_with("**fails** by 1") && text.ends_with("in 1 of 3 rows; worst: slow"),
            "{text}"
        );
    }

    #[test]
    fn few_repeats_and_numbers_that_are_none_hold_nothing() {
        assert_eq!(FAST.judge(&[row("few", &[1.0; 4])]).verdict, Verdict::Noise);
        let nan = FAST.judge(&[row("nan", &[f64::NAN; 5])]);
        assert_eq!(nan.verdict, Verdict::Fails { by: f64::INFINITY });
    }

    #[test]
    fn smoke_runs_decide_what_holds_in_every_form() {
        let rows = [row("fast", &[1.0; 5])];
        assert_eq!(FAST.judge(&rows).of_smoke_run().verdict, Verdict::SmokeForm);
        assert_eq!(FAST.in_every_form().judge(&rows).of_smoke_run().verdict, Verdict::Holds);
        assert_eq!(FAST.judge(&[]).of_smoke_run().verdict, Verdict::NotRun);
    }

    #[test]
    fn bounds_have_two_sides() {
        let between = Bound::Between(-1.0, 1.0);
        let of = |low, high| Measured {
            value: 0.5 * (low + high),
            low,
            high,
        };
        assert_eq!(between.holds(&of(-0.5, 0.5)), Some(true));
        assert_eq!(between.holds(&of(0.5, 1.5)), None);
        assert_eq!(between.holds(&of(-2.0, 2.0)), None);
        assert_eq!(between.holds(&of(1.5, 2.0)), Some(false));
        assert_eq!(Bound::AtLeast(1.0).holds(&of(0.5, 1.5)), None);
        assert_eq!(Bound::AtLeast(1.0).holds(&of(0.0, 0.5)), Some(false));
        assert_eq!(Bound::AtMost(0.0).holds(&Measured::exact(0.0)), Some(true));
    }
}
