//! What is kept of a run: how it was run, and the rows that it found.

use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use clerestory::{Error, Result};

use crate::experiments::findings::Findings;
use crate::experiments::results::Results;
use crate::experiments::{Experiment, Kind, measures, series, sweep_criteria};
use crate::{json_file, machine};

/// The file of an experiment's folder that all others are made of.
pub const FILE: &str = "found.json";
/// What errors call it.
const KIND: &str = "results";
const SECONDS_OF_A_DAY: u64 = 86_400;

/// How an experiment was run.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The command.
    pub command: String,
    /// How long it took.
    pub seconds: f64,
    /// Year, month and day, in UTC.
    pub date: String,
    /// The commit's short name, with `+` where the tree had changes; empty where it is not known.
    pub commit: String,
    /// The processor and its threads.
    pub machine: String,
    /// Load averages when it began and when it ended, where the system tells.
    pub load: [String; 2],
    /// The Vulkan device and its driver; empty where none was opened.
    pub device: String,
}

impl Run {
    /// A run that begins now: without device, and with the load of now at its end too.
    pub fn begin(command: String) -> Self {
        let load = || machine::load().unwrap_or_else(|| "unknown".into());
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            command,
            seconds: 0.0,
            date: date(since.as_secs() / SECONDS_OF_A_DAY),
            commit: commit(),
            machine: format!("{}, {} threads", machine::processor(), machine::threads()),
            load: [load(), load()],
            device: String::new(),
        }
    }

    /// The same, ended.
    #[must_use]
    pub fn end(mut self, seconds: f64, device: String) -> Self {
        self.load[1] = machine::load().unwrap_or_else(|| "unknown".into());
        Self {
            seconds,
            device,
            ..self
        }
    }
}

/// The civil date of a day since 1970. Source: E. M. Reingold and N. Dershowitz, *Calendrical Calculations*, 2018: 400 years have 146,097 days.
fn date(days: u64) -> String {
    let is_leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let (mut year, mut left) = (1970, days);
    loop {
        let length = if is_leap(year) { 366 } else { 365 };
        if left < length {
            break;
        }
        left -= length;
        year += 1;
    }
    let february = if is_leap(year) { 29 } else { 28 };
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30] {
        if left < length {
            break;
        }
        left -= length;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", left + 1)
}

/// The commit of the working folder.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let Some(name) = git(&["rev-parse", "--short", "HEAD"]) else {
        return String::new();
    };
    // Results themselves, and pages that quote them, are no change of what was run.
    let places = [".", ":!results", ":!*.md"];
    let changes = git(&[&["status", "--porcelain", "--untracked-files=no", "--"][..], &places].concat());
    let mark = if changes.is_none_or(|changes| changes.is_empty()) {
        ""
    } else {
        "+"
    };
    name + mark
}

/// A run with what it found.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// How it was run.
    pub run: Run,
    /// Rows of a measure, or [`Results`] of a sweep.
    pub found: serde_json::Value,
}

impl Stored {
    /// What an experiment's folder holds; `None` where it was not run.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Setting`] where the file is of another form.
    pub fn read(folder: &Path) -> Result<Option<Self>> {
        json_file::read(&folder.join(FILE), KIND)
    }

    /// The text of its file.
    ///
    /// # Errors
    /// [`Error::Setting`] for what JSON cannot hold.
    pub fn text(&self) -> Result<String> {
        let text = serde_json::to_string(self);
        let text = text.map_err(|cause| json_file::malformed(Path::new(FILE), KIND, &cause))?;
        Ok(text + "\n")
    }
}

/// What an experiment found; its criteria alone where it was not run.
///
/// # Errors
/// [`Error::Setting`] where the rows are those of another form of the experiment.
pub fn findings(experiment: &Experiment, stored: Option<&Stored>) -> Result<Findings> {
    match (experiment.kind()?, stored) {
        (Kind::Measure(name), None) => Ok((measures::find(name)?.declared)()),
        (Kind::Measure(name), Some(stored)) => (measures::find(name)?.read)(&stored.found.to_string()),
        (Kind::Sweep(_), None) => Ok(sweep_criteria::declared(experiment)),
        (Kind::Sweep(sweep), Some(stored)) => {
            let results = Results::deserialize(&stored.found)
                .map_err(|cause| json_file::malformed(Path::new(&experiment.name), KIND, &cause))?;
            if results.sweep != *sweep {
                let cause = "are of other pictures than the experiment's now: run it again";
                return Err(Error::setting("results", &experiment.name, cause));
            }
            Ok(sweep_criteria::findings(experiment, &results, &series::of(&results)))
        }
    }
}

use serde::Deserialize;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_their_dates() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(58), "1970-02-28");
        assert_eq!(date(59), "1970-03-01");
        assert_eq!(date(11_016), "2000-02-29");
        assert_eq!(date(20_454), "2026-01-01");
        assert_eq!(date(20_818), "2026-12-31");
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Stored::read(folder.path()).unwrap(), None);
        let stored = Stored {
            run: Run::begin("clerestory report none".into()).end(1.5, "none".into()),
            found: serde_json::json!([0.1, "NaN", 1e-300]),
        };
        std::fs::write(folder.path().join(FILE), stored.text().unwrap()).unwrap();
        assert_eq!(Stored::read(folder.path()).unwrap(), Some(stored));
        std::fs::write(folder.path().join(FILE), "{\"run\": 1}").unwrap();
        assert!(Stored::read(folder.path()).is_err());
    }
}
