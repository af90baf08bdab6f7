//! Values that are kept as JSON files.

use std::io::ErrorKind;
use std::path::Path;

use clerestory::atomic;
use clerestory::input::read_text;
use clerestory::{Error, Result};
use serde::de::DeserializeOwned;

/// Most bytes of such a file.
const MOST_BYTES: u64 = 1 << 28;

/// The value of a file; `None` where there is none. `what` names its kind in errors.
///
/// # Errors
/// [`Error::Io`], and [`Error::Setting`] where the file is of another form.
pub fn read<T: DeserializeOwned>(path: &Path, what: &'static str) -> Result<Option<T>> {
    let text = match read_text(path, MOST_BYTES) {
        Ok(text) => text,
        Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let value = serde_json::from_str(&text);
    value.map(Some).map_err(|cause| malformed(path, what, &cause))
}

/// Writes a value's text, and makes the folder.
///
/// # Errors
/// [`Error::Io`], and [`Error::Setting`] for a value that JSON cannot hold.
pub fn write(path: &Path, what: &'static str, text: serde_json::Result<String>) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    }
    let text = text.map_err(|cause| malformed(path, what, &cause))?;
    atomic::write(path, (text + "\n").as_bytes())
}

/// The error of a value that has not the form of its kind.
pub fn malformed(path: &Path, what: &'static str, cause: &serde_json::Error) -> Error {
    Error::setting(what, path.display().to_string(), cause.to_string())
}
