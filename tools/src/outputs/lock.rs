//! Of several processes with the same output only one writes at a time.

use std::fs::OpenOptions;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clerestory::film::atomic;
use clerestory::fingerprint::Fingerprint;

/// The right to write the files of one name, until it is dropped: a file that only one process can make.
pub(super) struct Lock(PathBuf);

impl Lock {
    /// A lock this old was left behind by a process that was ended while it wrote.
    const STALE: Duration = Duration::from_secs(60);
    /// Longer than a lock can become without being stale.
    const PATIENCE: Duration = Duration::from_secs(90);
    /// Between two tries.
    const PAUSE: Duration = Duration::from_millis(10);

    /// Waits for it. Files that differ only in their endings share it.
    pub fn of(path: &Path) -> io::Result<Self> {
        let end = atomic::end_of_links(path)?;
        // By a hash: the name with anything added might be too long.
        let print = Fingerprint::of(end.file_stem().unwrap_or_default().as_encoded_bytes());
        let lock = end.with_file_name(format!(".clerestory-{}.lock", &print[..16]));
        let begun = Instant::now();
        loop {
            match OpenOptions::new().write(true).create_new(true).open(&lock) {
                Ok(_) => return Ok(Self(lock)),
                Err(cause) if cause.kind() != ErrorKind::AlreadyExists => return Err(cause),
                Err(_) if begun.elapsed() > Self::PATIENCE => {
                    let cause = format!(
                        "others keep writing it; {} says so, which can be removed if none does",
                        lock.display()
                    );
                    return Err(io::Error::new(ErrorKind::WouldBlock, cause));
                }
                Err(_) => {
                    if is_older(&lock, Self::STALE) {
                        // Another process may have taken it away already.
                        let _ = std::fs::remove_file(&lock);
                    }
                    std::thread::sleep(Self::PAUSE);
                }
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A lock that stays is taken for stale after a while.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn is_older(path: &Path, age: Duration) -> bool {
    let changed = path.symlink_metadata().and_then(|found| found.modified()).ok();
    changed.is_some_and(|time| time.elapsed().is_ok_and(|elapsed| elapsed > age))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::time::SystemTime;

    #[test]
    fn a_lock_left_behind_is_taken_for_stale() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.exr");
        let lock = Lock::of(&path)?;
        assert!(lock.0.exists() && !is_older(&lock.0, Lock::STALE));
        let long_ago = SystemTime::now() - 2 * Lock::STALE;
        File::options().write(true).open(&lock.0)?.set_modified(long_ago)?;
        assert!(is_older(&lock.0, Lock::STALE));
        let other = Lock::of(&path.with_extension("png"))?;
        assert_eq!(other.0, lock.0);
        Ok(())
    }
}
