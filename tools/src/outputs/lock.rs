//! Of several processes with the same output only one writes at a time.

use std::fs::OpenOptions;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clerestory::atomic;
use clerestory::fingerprint::Fingerprint;

/// The right to write the files of one name, until it is dropped: a file that only one process can make.
pub(super) struct Lock {
    path: PathBuf,
    /// What stands in the file: nobody else's lock has it.
    token: String,
}

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
        let token = format!("{:016x}", atomic::random());
        let begun = Instant::now();
        loop {
            match OpenOptions::new().write(true).create_new(true).open(&lock) {
                Ok(mut file) => {
                    return match file.write_all(token.as_bytes()) {
                        Ok(()) => Ok(Self { path: lock, token }),
                        Err(cause) => {
                            // The first failure is the one to report.
                            let _ = std::fs::remove_file(&lock);
                            Err(cause)
                        }
                    };
                }
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
                        Self::take_away(&lock);
                    }
                    std::thread::sleep(Self::PAUSE);
                }
            }
        }
    }

    /// Takes a stale lock away. Another process may have done so, and have made its own, since it was looked at: it is set aside first, looked at
    /// again, and put back if it is not stale.
    fn take_away(lock: &Path) {
        let aside = lock.with_extension(format!("{:016x}.old", atomic::random()));
        if std::fs::rename(lock, &aside).is_err() {
            return;
        }
        if !is_older(&aside, Self::STALE) {
            // Where a third process has its own by now, both write, as without a lock.
            let _ = std::fs::hard_link(&aside, lock);
        }
        let _ = std::fs::remove_file(&aside);
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // One that took so long that it was taken for stale may be another process's by now. A lock that stays is taken for stale after a while.
        if std::fs::read(&self.path).is_ok_and(|found| found == self.token.as_bytes()) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn is_older(path: &Path, age: Duration) -> bool {
    let changed = path.symlink_metadata().and_then(|found| found.modified()).ok();
    changed.is_some_and(|time| time.elapsed().is_ok_and(|elapsed| elapsed > age))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn a_lock_left_behind_is_taken_for_stale() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.exr");
        let lock = Lock::of(&path)?;
        assert!(lock.path.exists() && !is_older(&lock.path, Lock::STALE));
        // Somebody who found another one to be stale does not take this one away.
        Lock::take_away(&lock.path);
        assert_eq!(std::fs::read(&lock.path)?, lock.token.as_bytes());
        let long_ago = SystemTime::now() - 2 * Lock::STALE;
        OpenOptions::new()
            .write(true)
            .open(&lock.path)?
            .set_modified(long_ago)?;
        assert!(is_older(&lock.path, Lock::STALE));
        let other = Lock::of(&path.with_extension("png"))?;
        assert_eq!(other.path, lock.path);
        // Nor does the one that was too slow take away what is another's by now.
        drop(lock);
        assert_eq!(std::fs::read(&other.path)?, other.token.as_bytes());
        drop(other);
        assert_eq!(std::fs::read_dir(folder.path())?.count(), 0);
        Ok(())
    }
}
