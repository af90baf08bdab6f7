//! Rows of a measure that are kept, case by case, so that one that was stopped goes on where it was.
//!
//! A case's rows are known by a fingerprint of the program that measured them, the machine, the device with its driver, the table, and the case's place and
//! name; every build starts anew. A measure that has ended forgets what was kept, so that the next run measures.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use clerestory::fingerprint::Fingerprint;
use clerestory::input::read_file;
use clerestory::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::json_lines::JsonLines;
use crate::machine;

/// The file's name in the folder of a measure.
const FILE: &str = "kept-rows.jsonl";
/// Most bytes of a program.
const MOST_BYTES: u64 = 1 << 30;

/// The rows of a case, of whatever table.
#[derive(serde::Serialize, serde::Deserialize)]
struct Line {
    key: String,
    rows: Value,
}

/// The file of one measure.
pub struct KeptRows {
    file: JsonLines,
    known: BTreeMap<String, Value>,
    table: String,
}

impl KeptRows {
    /// Reads what there is of a table that a device, named with its driver, has a part in; the folder is made.
    ///
    /// # Errors
    /// [`Error::Io`] when a file is there and cannot be read, or the folder cannot be made.
    pub fn open(folder: &Path, device: &str, table: &str) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let (file, lines) = JsonLines::open(&folder.join(FILE))?;
        Ok(Self {
            file,
            known: lines.into_iter().map(|line: Line| (line.key, line.rows)).collect(),
            table: format!("{}\n{}\n{device}\n{table}", program()?, machine::processor()),
        })
    }

    fn key(&self, place: usize, case: &str) -> String {
        Fingerprint::of(format!("{}\n{place}\n{case}", self.table).as_bytes())
    }

    /// The rows of the case in a place, if they were kept.
    pub fn get<R: DeserializeOwned>(&self, place: usize, case: &str) -> Option<Vec<R>> {
        let rows = self.known.get(&self.key(place, case))?;
        serde_json::from_value(rows.clone()).ok()
    }

    /// Keeps the rows of a case, and returns them as they will be read back.
    ///
    /// # Errors
    /// As [`JsonLines::add`].
    pub fn add<R: Serialize + DeserializeOwned>(&mut self, place: usize, case: &str, rows: &[R]) -> Result<Vec<R>> {
        let unkept = |cause: serde_json::Error| Error::setting("rows", case, cause.to_string());
        let line = Line {
            key: self.key(place, case),
            rows: serde_json::to_value(rows).map_err(unkept)?,
        };
        let read = self.file.add(&line)?;
        serde_json::from_value(read.rows).map_err(unkept)
    }
}

/// Forgets the rows of a measure that has ended.
///
/// # Errors
/// [`Error::Io`].
pub fn forget(folder: &Path) -> Result<()> {
    let path = folder.join(FILE);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(&path, error)),
        _ => Ok(()),
    }
}

/// The fingerprint of the program that runs.
fn program() -> Result<&'static str> {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    if let Some(known) = PROGRAM.get() {
        return Ok(known);
    }
    let path = std::env::current_exe().map_err(|error| Error::io("this program", error))?;
    let print = Fingerprint::of(&read_file(&path, MOST_BYTES)?);
    Ok(PROGRAM.get_or_init(|| print))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_again_by_their_case_and_forgotten_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let open = |table: &str| KeptRows::open(folder.path(), "lavapipe", table).unwrap();
        assert_eq!(open("goals").add(0, "ring", &[1.5, 2.5]).unwrap(), [1.5, 2.5]);
        open("goals").add(1, "ring", &[] as &[f64]).unwrap();
        assert_eq!(open("goals").get(0, "ring"), Some(vec![1.5, 2.5]));
        assert_eq!(open("goals").get(1, "ring"), Some(Vec::<f64>::new()));
        for (table, place, case) in [("goals", 2, "ring"), ("goals", 0, "room"), ("contests", 0, "ring")] {
            assert_eq!(open(table).get::<f64>(place, case), None, "{table} {place} {case}");
        }
        let elsewhere = KeptRows::open(folder.path(), "another", "goals").unwrap();
        assert_eq!(elsewhere.get::<f64>(0, "ring"), None);
        forget(folder.path()).unwrap();
        assert_eq!(open("goals").get::<f64>(0, "ring"), None);
        forget(folder.path()).unwrap();
    }

    #[test]
    fn a_line_that_was_cut_off_is_skipped() {
        let folder = tempfile::tempdir().unwrap();
        let open = || KeptRows::open(folder.path(), "lavapipe", "goals").unwrap();
        open().add(0, "ring", &[1.5]).unwrap();
        let path = folder.path().join(FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 4]).unwrap();
        assert_eq!(open().get::<f64>(0, "ring"), None);
        open().add(0, "ring", &[3.5]).unwrap();
        assert_eq!(open().get(0, "ring"), Some(vec![3.5]));
    }
}
