//! Whole files or none: bytes go to a temporary file beside the target, which then takes the target's name.
//!
//! Guarantees: a reader, or a process that is stopped in between, sees the old file or the complete new one, never a part (POSIX rename).

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::{Error, Result};

/// Writes `bytes` to `path` as a whole. The temporary file's name is unique to this process and call; it is removed on failure.
///
/// # Errors
/// [`Error::Io`] when the path names no file, or the file cannot be written there.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| Error::io(path, std::io::Error::new(ErrorKind::InvalidInput, "names no file")))?;
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(name);
    temporary.push(format!(
        ".{}-{}.tmp",
        std::process::id(),
        CALLS.fetch_add(1, Ordering::Relaxed)
    ));
    let temporary = path.with_file_name(temporary);
    let written = std::fs::File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|cause| {
        // The first failure is the one to report; the temporary file may not even exist.
        let _ = std::fs::remove_file(&temporary);
        Error::io(path, cause)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_the_file_and_leaves_nothing_else() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|e| Error::io("temporary folder", e))?;
        let path = folder.path().join("picture.bin");
        write(&path, b"old")?;
        write(&path, b"new")?;
        assert_eq!(std::fs::read(&path).map_err(|e| Error::io(&path, e))?, b"new");
        let files = std::fs::read_dir(folder.path()).map_err(|e| Error::io(folder.path(), e))?;
        assert_eq!(files.count(), 1);
        assert!(matches!(
            write(&folder.path().join("absent/picture.bin"), b""),
            Err(Error::Io { .. })
        ));
        assert!(matches!(write(Path::new("/"), b""), Err(Error::Io { .. })));
        Ok(())
    }
}
