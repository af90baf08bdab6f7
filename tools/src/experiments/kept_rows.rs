//! Rows of a measure that are kept, case by case, so that one that was stopped goes on where it was.
//!
//! A case's rows are known by a fingerprint of the program that measured them, the machine, the device with its driver, the table, and the case's place and
//! name; every build starts anew. Guarantees: a line that was cut off while it was written is skipped; a measure that has ended forgets what was kept, so that the next run measures.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clerestory::fingerprint::Fingerprint;
use clerestory::input::read_file;
use clerestory::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::machine;

/// The file's name in the folder of a measure.
const FILE: &str = "kept-rows.jsonl";
/// Most bytes of the file, and of a program.
const MOST_BYTES: u64 = 1 << 30;

/// The rows of a case.
#[derive(serde::Serialize, serde::Deserialize)]
struct Line<R> {
    key: String,
    rows: Vec<R>,
}

/// The file of one measure.
pub struct KeptRows {
    path: PathBuf,
    text: String,
    table: String,
}

impl KeptRows {
    /// Reads what there is of a table that a device, named with its driver, has a part in.
    ///
    /// # Errors
    /// [`Error::Io`] when a file is there and cannot be read.
    pub fn open(folder: &Path, device: &str, table: &str) -> Result<Self> {
        let path = folder.join(FILE);
        let text = match read_file(&path, MOST_BYTES) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        Ok(Self {
            path,
            text,
            table: format!("{}\n{}\n{device}\n{table}", program()?, machine::processor()),
        })
    }

    fn key(&self, place: usize, case: &str) -> String {
        Fingerprint::of(format!("{}\n{place}\n{case}", self.table).as_bytes())
    }

    /// The rows of the case in a place, if they were kept.
    pub fn get<R: DeserializeOwned>(&self, place: usize, case: &str) -> Option<Vec<R>> {
        let key = self.key(place, case);
        let mut lines = self.text.lines().filter(|line| line.contains(&key));
        lines.find_map(|line| Some(serde_json::from_str::<Line<R>>(line).ok()?.rows))
    }

    /// Keeps the rows of a case, and returns them as they will be read back.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn add<R: Serialize + DeserializeOwned>(&self, place: usize, case: &str, rows: Vec<R>) -> Result<Vec<R>> {
        let wrong = |error| Error::io(&self.path, error);
        let key = self.key(place, case);
        let line = serde_json::to_string(&Line { key, rows }).map_err(|cause| wrong(cause.into()))?;
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(wrong)?;
        }
        let mut file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .map_err(wrong)?;
        // A line break on both sides: the last line may have been cut off.
        file.write_all(format!("\n{line}\n").as_bytes())
            .and_then(|()| file.sync_data())
            .map_err(wrong)?;
        let read: Line<R> = serde_json::from_str(&line).map_err(|cause| wrong(cause.into()))?;
        Ok(read.rows)
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
        assert_eq!(open("goals").add(0, "ring", vec![1.5, 2.5]).unwrap(), [1.5, 2.5]);
        open("goals").add(1, "ring", Vec::<f64>::new()).unwrap();
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
        open().add(0, "ring", vec![1.5]).unwrap();
        let path = folder.path().join(FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 4]).unwrap();
        assert_eq!(open().get::<f64>(0, "ring"), None);
        open().add(0, "ring", vec![3.5]).unwrap();
        assert_eq!(open().get(0, "ring"), Some(vec![3.5]));
    }
}
