//! Totals: what all runs have done together, by reader, kept in a file.

use std::collections::BTreeMap;
use std::path::Path;

use clerestory::Result;

use crate::json_file;

/// How a file broke something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A panic.
    Panic,
    /// The process died: an abort, a signal, a stack that was too small, a device that was lost.
    Abort,
    /// More memory than an input may take.
    Memory,
    /// More time than an input may take.
    Time,
}

impl Kind {
    /// One word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::Abort => "abort",
            Self::Memory => "memory",
            Self::Time => "time",
        }
    }
}

/// What was done on one way: reading alone, or with a step on a device.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Way {
    /// The number of the next file.
    pub next: u32,
    /// Files that were read.
    pub inputs: u64,
    /// Files that were accepted.
    pub accepted: u64,
    /// Wall-clock seconds, with the starts of processes.
    pub seconds: f64,
    /// Seconds of the slowest file.
    pub slowest: f64,
    /// Most bytes that a file took beyond what its process had; 0 where the system does not tell.
    pub peak: u64,
    /// Files that broke something, by how.
    pub found: BTreeMap<Kind, u64>,
}

impl Way {
    /// How many files broke something in this way.
    pub fn found(&self, kind: Kind) -> u64 {
        self.found.get(&kind).copied().unwrap_or(0)
    }
}

/// What was done with a reader.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OfReader {
    /// Read.
    pub read: Way,
    /// Read, and what was accepted put through one step.
    pub step: Way,
}

/// What all runs of a seed have done.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Totals {
    /// The seed of all files.
    pub seed: u32,
    /// Runs.
    pub runs: u64,
    /// By reader.
    pub readers: BTreeMap<String, OfReader>,
}

/// The file in the folder of a run.
pub const FILE: &str = "totals.json";
/// What errors call it.
const KIND: &str = "totals";

impl Totals {
    /// Those of a folder; none yet of a folder without.
    ///
    /// # Errors
    /// [`Error::Io`](clerestory::Error::Io); [`Error::Setting`](clerestory::Error::Setting) where the file is of another form.
    pub fn read(folder: &Path) -> Result<Option<Self>> {
        json_file::read(&folder.join(FILE), KIND)
    }

    /// Writes them into a folder, which is made.
    ///
    /// # Errors
    /// [`Error::Io`](clerestory::Error::Io).
    pub fn write(&self, folder: &Path) -> Result<()> {
        json_file::write(&folder.join(FILE), KIND, serde_json::to_string_pretty(self))
    }

    /// Files that broke something.
    pub fn found(&self) -> u64 {
        let ways = self.readers.values().flat_map(|reader| [&reader.read, &reader.step]);
        ways.flat_map(|way| way.found.values()).sum()
    }

    /// Files that were read, and accepted ones that went through a step.
    pub fn inputs(&self) -> [u64; 2] {
        let sum = |of: fn(&OfReader) -> u64| self.readers.values().map(of).sum();
        [sum(|reader| reader.read.inputs), sum(|reader| reader.step.accepted)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_are_written_read_and_summed() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("fuzzing");
        assert_eq!(Totals::read(&inside).unwrap(), None);
        let mut totals = Totals {
            seed: 4,
            ..Totals::default()
        };
        let reader = totals.readers.entry("PLY".into()).or_default();
        reader.read.inputs = 30;
        reader.step.accepted = 5;
        *reader.step.found.entry(Kind::Memory).or_default() += 2;
        totals.write(&inside).unwrap();
        let read = Totals::read(&inside).unwrap();
        assert_eq!(read.as_ref(), Some(&totals));
        assert_eq!((totals.found(), totals.inputs()), (2, [30, 5]));
        std::fs::write(inside.join(FILE), "{").unwrap();
        assert!(Totals::read(&inside).is_err());
    }
}
