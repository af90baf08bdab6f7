//! Files that keep what can be made again: read whole and within a bound, written whole, and complained about once.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The bytes of a regular file, `most` at most; `None` where there is no file.
///
/// # Errors
/// Why there is a file, but none that can be read, in words.
pub fn read(path: &Path, most: u64) -> Result<Option<Vec<u8>>, String> {
    let metadata = match std::fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if is_absent(&error) => return Ok(None),
        Err(error) => return Err(error.to_string()),
    };
    // Opening a pipe would wait for somebody to write into it.
    if !metadata.is_file() {
        return Err("is not a regular file".into());
    }
    let too_long = || Err(format!("has more than {most} bytes"));
    if metadata.len() > most {
        return too_long();
    }
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if is_absent(&error) => return Ok(None),
        Err(error) => return Err(error.to_string()),
    };
    let mut bytes = Vec::new();
    // It may grow meanwhile.
    match file.take(most.saturating_add(1)).read_to_end(&mut bytes) {
        Ok(_) if bytes.len() as u64 > most => too_long(),
        Ok(_) => Ok(Some(bytes)),
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

    #[test]
    fn files_are_read_within_their_bound() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept");
        assert_eq!(read(&path, 4), Ok(None));
        std::fs::write(&path, [1, 2, 3, 4]).unwrap();
        assert_eq!(read(&path, 4), Ok(Some(vec![1, 2, 3, 4])));
        assert_eq!(read(&path, 3), Err("has more than 3 bytes".to_owned()));
        assert_eq!(read(&path.join("below a file"), 4), Ok(None));
        assert_eq!(read(folder.path(), 4), Err("is not a regular file".to_owned()));
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
        assert_eq!(read(&path, 4), Err("is not a regular file".to_owned()));
    }

    #[test]
    fn a_file_is_complained_about_once() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let said = [&a, &b, &a, &a].map(|path| complain(path, "it is a test"));
        assert_eq!(said, [true, true, false, false]);
    }
}
