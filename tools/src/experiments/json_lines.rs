//! Files of one line of JSON each, appended as soon as there is one, so that what was interrupted goes on where it stopped.
//!
//! Guarantee: a line that was cut off while it was written is skipped.

use std::io::Write;
use std::path::{Path, PathBuf};

use clerestory::input::read_file;
use clerestory::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Most bytes of a file.
const MOST_BYTES: u64 = 1 << 30;

/// Such a file.
#[derive(Debug)]
pub struct JsonLines {
    path: PathBuf,
    /// Whether the file ends within a line.
    cut_off: bool,
}

impl JsonLines {
    /// Reads what there is, the file and all lines that can be read.
    ///
    /// # Errors
    /// [`Error::Io`] when a file is there and cannot be read.
    pub fn open<T: DeserializeOwned>(path: &Path) -> Result<(Self, Vec<T>)> {
        let text = match read_file(path, MOST_BYTES) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        let file = Self {
            path: path.to_owned(),
            cut_off: !text.is_empty() && !text.ends_with('\n'),
        };
        let lines = text.lines().filter_map(|line| serde_json::from_str(line).ok());
        Ok((file, lines.collect()))
    }

    /// Appends a line, and returns it as it will be read back: text may cost a number its last bit, and results must not depend on when they were made.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn add<T: Serialize + DeserializeOwned>(&mut self, value: &T) -> Result<T> {
        let wrong = |error| Error::io(&self.path, error);
        let line = serde_json::to_string(value).map_err(|cause| wrong(cause.into()))?;
        let read = serde_json::from_str(&line).map_err(|cause| wrong(cause.into()))?;
        let line = if self.cut_off { "\n" } else { "" }.to_owned() + &line + "\n";
        let mut file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .map_err(wrong)?;
        file.write_all(line.as_bytes())
            .and_then(|()| file.sync_data())
            .map_err(wrong)?;
        self.cut_off = false;
        Ok(read)
    }
}
