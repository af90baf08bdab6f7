//! Files that keep what can be made again: read whole and within a bound, written whole, and complained about once.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::input::read_regular;

/// The bytes of a regular file, `most` at most; `None` where there is no file.
///
/// # Errors
/// Why there is a file, but none that can be read, in words.
pub fn read(path: &Path, most: u64) -> Result<Option<Vec<u8>>, String> {
    match read_regular(path, most) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if is_absent(&error) => Ok(None),
        Err(error) => Err(error.to_string()),
    }
}

fn is_absent(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory)
}

/// Writes a file as a whole: readers see none, the old one or the new one.
///
/// # Errors
/// Why not, in words.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    crate::atomic::write_unlinked(path, bytes).map_err(|error| error.to_string())
}

/// Warns that a file is not used, once for each file in a process. Returns whether it did.
pub fn complain(path: &Path, why: &str) -> bool {
    static SAID: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let is_new = SAID
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .insert(path.to_owned());
    if is_new {
        tracing::warn!("{} is not used and made anew: {why}", path.display());
    }
    is_new
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    /// Whether a file is refused with these words.
    fn is_refused(path: &Path, most: u64, words: &str) -> bool {
        read(path, most).is_err_and(|why| why.contains(words))
    }

    #[test]
    fn files_are_read_within_their_bound() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept");
        assert_eq!(read(&path, 4), Ok(None));
        std::fs::write(&path, [1, 2, 3, 4]).unwrap();
        assert_eq!(read(&path, 4), Ok(Some(vec![1, 2, 3, 4])));
        assert!(is_refused(&path, 3, "has 4 bytes; at most 3"));
        assert_eq!(read(&path.join("below a file"), 4), Ok(None));
        assert!(is_refused(folder.path(), 4, "is a folder"));
        // As long as a terabyte, of which the disk holds nothing.
        let sparse = File::create(&path).and_then(|file| file.set_len(1 << 40));
        if sparse.is_ok() {
            assert!(read(&path, 1 << 20).is_err());
        }
    }

    #[cfg(unix)]
    #[test]
    fn nothing_waits_for_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo");
        assert!(is_refused(&path, 4, "is not a regular file"));
    }

    #[test]
    fn a_file_is_complained_about_once() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let said = [&a, &b, &a, &a].map(|path| complain(path, "it is a test"));
        assert_eq!(said, [true, true, false, false]);
    }
}
