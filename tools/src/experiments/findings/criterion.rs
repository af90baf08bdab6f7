//! Criteria: what an experiment calls good, as statements about its rows that are true or false of them, made before it runs.

use super::{Measured, Sheet};

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
        let number = |value: f64| crate::experiments::table::Cell::Number(value);
        match *self {
            Self::AtMost(most) => write!(f, "at most {}", number(most)),
            Self::AtLeast(least) => write!(f, "at least {}", number(least)),
            Self::Between(least, most) => write!(f, "{} to {}", number(least), number(most)),
        }
    }
}

/// A statement about rows that is true or false of them; a constant of its experiment.
pub struct Criterion<R: 'static> {
    name: &'static str,
    bound: Bound,
    because: &'static str,
    in_every_form: bool,
    among: fn(&R) -> bool,
    of: fn(&R) -> Measured,
}

impl<R: Sheet> Criterion<R> {
    /// Of a number of each row; the worst row speaks for all.
    pub const fn each(name: &'static str, bound: Bound, of: fn(&R) -> Measured) -> Self {
        Self {
            name,
            bound,
            because: "",
            in_every_form: false,
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

    /// The verdict on rows. Each holds where its whole interval is within the bound, fails where none of it is, and is undecided between; all hold
    /// where each does, and fail where one fails.
    pub fn judge(&self, rows: &[R]) -> Judged {
        let mut judged = Judged {
            name: self.name,
            bound: self.bound,
            because: self.because,
            in_every_form: self.in_every_form,
            verdict: Verdict::NotRun,
            found: None,
            rows: 0,
            failing: 0,
            noisy: 0,
            worst: String::new(),
        };
        // Rows that fail come before those that noise decides, and these before those that hold.
        let mut most = (0, f64::NEG_INFINITY);
        for row in rows.iter().filter(|row| (self.among)(row)) {
            let found = (self.of)(row);
            judged.rows += 1;
            let rank = match self.bound.holds(&found) {
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
            let missed = (rank, self.bound.missed_by(found.value));
            if missed > most || judged.found.is_none() {
                most = missed;
                judged.found = Some(found);
                judged.worst = row.label();
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
}

/// How a criterion came out.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
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
    /// Undecided: a smoke run has too few inputs.
    SmokeForm,
}

/// A criterion with what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The statement.
    pub name: &'static str,
    /// What is wanted.
    pub bound: Bound,
    /// Where the bound is from; empty for the experiment's own sentence.
    pub because: &'static str,
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

impl Judged {
    /// The same of a smoke run, which decides only what holds in every form.
    #[must_use]
    pub fn of_smoke_run(self) -> Self {
        let verdict = match self.verdict {
            Verdict::NotRun => Verdict::NotRun,
            verdict if self.in_every_form => verdict,
            _ => Verdict::SmokeForm,
        };
        Self { verdict, ..self }
    }
}

impl std::fmt::Display for Judged {
    /// A line of a page: "**fails by 0.12**: name: 1.12 where at most 1 is wanted, in 3 of 28 rows; worst: `conference`".
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        use crate::experiments::table::Cell;
        match self.verdict {
            Verdict::Holds => write!(f, "**holds**")?,
            Verdict::Fails { by } if by.is_finite() => write!(f, "**fails** by {}", Cell::Number(by))?,
            Verdict::Fails { .. } => write!(f, "**fails**")?,
            Verdict::Noise => write!(f, "**undecided**, noise")?,
            Verdict::NotRun => write!(f, "**undecided**, not run")?,
            Verdict::SmokeForm => write!(f, "**undecided**, a smoke run")?,
        }
        write!(f, ": {}", self.name)?;
        match self.found {
            Some(found) => write!(f, ": {} where {} is wanted", Cell::from(found), self.bound)?,
            None => write!(f, ": {} is wanted", self.bound)?,
        }
        match (self.failing, self.noisy) {
            (0, 0) if self.rows > 0 => write!(f, ", {} rows", self.rows)?,
            (0, 0) => {}
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
