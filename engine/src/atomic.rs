//! Whole files or none: bytes go to a temporary file beside the target, which then takes the target's name.
//!
//! Guarantees: a reader, or a process that is stopped in between, sees the old file or the complete new one, never a part (POSIX rename). Temporary
//! files have random names, are made anew and are never opened through a link, so that nobody who may write to the folder can lead them
//! to another file. What is replaced keeps its mode, and its owner where the system lets it. Folders, devices and pipes are never replaced.
//! Not kept: hard links, of which only the named one gets the new contents.

use std::fs::{File, Metadata, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Links that are followed from a name before it counts as one that ends nowhere.
const MAX_LINKS: usize = 40;

/// Random names that are tried for a temporary file; each is taken by chance once in 2⁶⁴ times the number of files.
const TRIES: usize = 8;

/// Writes `bytes` to `path` as a whole. A link is followed: the file at its end is replaced, the link stays.
///
/// # Errors
/// [`Error::Io`] when the path names no file, or something that is not a regular file, or the file cannot be written there. Nothing is
/// changed then.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let written = end_of_links(path).and_then(|end| replace_at(&end, bytes));
    written.map_err(|cause| Error::io(path, cause))
}

/// As [`write()`], for names that a program chose by itself, such as those of caches: a link is replaced, not followed, since nobody who asked
/// for the file has put it there.
///
/// # Errors
/// As [`write()`].
pub fn write_unlinked(path: &Path, bytes: &[u8]) -> Result<()> {
    replace_at(path, bytes).map_err(|cause| Error::io(path, cause))
}

/// Writes a file that is not there yet; of several processes that want the same name, one gets it.
///
/// # Errors
/// [`Error::Io`], of the kind `AlreadyExists` when anything of that name, a link included, is there. No part of the file stays.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let claimed = OpenOptions::new().write(true).create_new(true).open(path);
    let written = claimed.and_then(|claim| {
        drop(claim);
        replace_at(path, bytes).inspect_err(|_| {
            // The first failure is the one to report.
            let _ = std::fs::remove_file(path);
        })
    });
    written.map_err(|cause| Error::io(path, cause))
}

/// Finds out whether [`write()`] could write there now, by a temporary file that is removed again. The old file is not touched.
///
/// # Errors
/// As [`write()`].
pub fn probe(path: &Path) -> Result<()> {
    let probed = end_of_links(path).and_then(|end| {
        let old = regular(&end)?;
        let (temporary, file) = temporary_beside(&end, old.is_some())?;
        drop(file);
        std::fs::remove_file(temporary)
    });
    probed.map_err(|cause| Error::io(path, cause))
}

/// The path that a path stands for when its last part is followed through links, also to files that are not there yet.
///
/// # Errors
/// Those of the system, and too many links, as of a ring of them.
pub fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut end = path.to_owned();
    for _ in 0..MAX_LINKS {
        match end.symlink_metadata() {
            Ok(found) if found.is_symlink() => {
                let to = std::fs::read_link(&end)?;
                // An absolute path takes the place of all before it.
                end = end.parent().unwrap_or(Path::new("")).join(to);
            }
            _ => return Ok(end),
        }
    }
    Err(io::Error::other("is a link that ends nowhere"))
}

fn replace_at(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let old = regular(path)?;
    within_size_limit(bytes.len() as u64)?;
    let (temporary, mut file) = temporary_beside(path, old.is_some())?;
    let filled = file.write_all(bytes).and_then(|()| match &old {
        Some(old) => keep_owner_and_mode(&file, old),
        None => Ok(()),
    });
    let filled = filled.and_then(|()| file.sync_all());
    drop(file);
    filled
        .and_then(|()| std::fs::rename(&temporary, path))
        .inspect_err(|_| {
            // The first failure is the one to report.
            let _ = std::fs::remove_file(&temporary);
        })
}

/// The regular file of this name, if there is one; a link counts as none.
fn regular(path: &Path) -> io::Result<Option<Metadata>> {
    match path.symlink_metadata() {
        Ok(found) if found.is_file() => Ok(Some(found)),
        Ok(found) if found.is_symlink() => Ok(None),
        Ok(found) if found.is_dir() => Err(io::Error::new(ErrorKind::IsADirectory, "is a folder")),
        Ok(_) => Err(io::Error::new(ErrorKind::InvalidInput, "is not a regular file")),
        Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(None),
        Err(cause) => Err(cause),
    }
}

/// A new file in the folder of `path`; nobody else may open it where it is `private`.
fn temporary_beside(path: &Path, private: bool) -> io::Result<(PathBuf, File)> {
    if path.file_name().is_none() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "names no file"));
    }
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    if private {
        hide(&mut options);
    }
    for _ in 0..TRIES {
        let temporary = path.with_file_name(temporary_name());
        match options.open(&temporary) {
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {}
            opened => return opened.map(|file| (temporary, file)),
        }
    }
    Err(io::Error::new(
        ErrorKind::AlreadyExists,
        "has no free name for a temporary file beside it",
    ))
}

/// 64 bits that other users of the machine cannot guess: the standard library seeds its hash tables with random numbers of the system.
pub fn random() -> u64 {
    RandomState::new().hash_one(0u8)
}

fn temporary_name() -> String {
    format!(".clerestory-{:016x}.tmp", random())
}

#[cfg(unix)]
fn hide(options: &mut OpenOptions) {
    use std::os::unix::fs::OpenOptionsExt;
    options.mode(0o600);
}

#[cfg(not(unix))]
fn hide(_: &mut OpenOptions) {}

#[cfg(unix)]
fn keep_owner_and_mode(file: &File, old: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    const MODE: u32 = 0o777;
    let new = file.metadata()?;
    if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
        // Only root may give files away; what anybody else writes is theirs.
        let _ = fchown(file, Some(old.uid()), Some(old.gid()));
    }
    let mode = old.mode() & MODE;
    if new.mode() & MODE == mode {
        return Ok(());
    }
    file.set_permissions(std::fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn keep_owner_and_mode(_: &File, _: &Metadata) -> io::Result<()> {
    Ok(())
}

/// Refuses what exceeds the process's limit on the size of files: beyond it the system would end the program in the middle of the file.
fn within_size_limit(bytes: u64) -> io::Result<()> {
    match size_limit() {
        Some(limit) if bytes > limit => {
            let cause = format!("would have {bytes} bytes; files of this process may have {limit} (ulimit -f)");
            Err(io::Error::new(ErrorKind::FileTooLarge, cause))
        }
        _ => Ok(()),
    }
}

/// In bytes; `None` without a limit, and where the system does not tell (others than Linux).
fn size_limit() -> Option<u64> {
    size_limit_in(&std::fs::read_to_string("/proc/self/limits").ok()?)
}

fn size_limit_in(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max file size"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    type Tested = std::result::Result<(), Box<dyn std::error::Error>>;

    fn entries(folder: &Path) -> io::Result<usize> {
        Ok(std::fs::read_dir(folder)?.count())
    }

    #[test]
    fn replaces_the_file_and_leaves_nothing_else() -> Tested {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("picture.bin");
        probe(&path)?;
        assert_eq!(entries(folder.path())?, 0);
        write(&path, b"old")?;
        write(&path, b"new")?;
        probe(&path)?;
        assert_eq!(std::fs::read(&path)?, b"new");
        assert_eq!(entries(folder.path())?, 1);
        let absent = folder.path().join("absent/picture.bin");
        for wrong in [absent.as_path(), Path::new("/"), folder.path()] {
            assert!(
                matches!(write(wrong, b""), Err(Error::Io { .. })),
                "{}",
                wrong.display()
            );
            assert!(matches!(probe(wrong), Err(Error::Io { .. })), "{}", wrong.display());
        }
        assert_eq!(entries(folder.path())?, 1);
        Ok(())
    }

    #[test]
    fn a_new_file_takes_nobodys_place() -> Tested {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("picture.bin");
        write_new(&path, b"first")?;
        let taken = write_new(&path, b"second");
        assert!(matches!(taken, Err(Error::Io { source, .. }) if source.kind() == ErrorKind::AlreadyExists));
        assert_eq!(std::fs::read(&path)?, b"first");
        assert_eq!(entries(folder.path())?, 1);
        Ok(())
    }

    #[test]
    fn temporary_files_have_names_of_their_own() -> Tested {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("picture.bin");
        let names: std::collections::BTreeSet<PathBuf> = (0..50)
            .map(|_| temporary_beside(&path, false).map(|(name, _)| name))
            .collect::<io::Result<_>>()?;
        assert_eq!((names.len(), entries(folder.path())?), (50, 50));
        // Nothing that another process can find out takes part in them.
        let known = std::process::id().to_string();
        assert!(names.iter().any(|name| !name.to_string_lossy().contains(&known)));
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn modes_and_links_stay() -> Tested {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("disk"))?;
        let (link, file) = (at("link.bin"), at("disk/file.bin"));
        // A relative link, to what is not there yet.
        symlink("disk/file.bin", &link)?;
        write(&link, b"old")?;
        for mode in [0o600u32, 0o640, 0o666] {
            std::fs::set_permissions(&file, std::fs::Permissions::from_mode(mode))?;
            write(&link, &mode.to_le_bytes())?;
            assert!(link.symlink_metadata()?.is_symlink());
            assert_eq!(file.metadata()?.mode() & 0o777, mode);
            assert_eq!(std::fs::read(&file)?, mode.to_le_bytes());
        }
        assert_eq!(entries(&at("disk"))?, 1);
        write_unlinked(&link, b"cache")?;
        assert!(link.symlink_metadata()?.is_file());
        assert_eq!(std::fs::read(&file)?, 0o666u32.to_le_bytes());

        symlink(at("ring"), at("ring"))?;
        symlink("/dev/null", at("device"))?;
        for wrong in ["ring", "device"] {
            assert!(
                write(&at(wrong), b"new").is_err() && probe(&at(wrong)).is_err(),
                "{wrong}"
            );
            assert!(at(wrong).symlink_metadata()?.is_symlink());
            let taken = write_new(&at(wrong), b"new");
            assert!(matches!(taken, Err(Error::Io { source, .. }) if source.kind() == ErrorKind::AlreadyExists));
        }
        assert!(!Path::new("/dev/null").metadata()?.is_file());
        Ok(())
    }

    #[test]
    fn limits_are_read_as_the_system_writes_them() {
        let with = |limit: &str| {
            format!("Limit          Soft Limit     Hard Limit  Units\nMax file size  {limit}  unlimited   bytes\n")
        };
        assert_eq!(size_limit_in(&with("4096")), Some(4096));
        assert_eq!(size_limit_in(&with("unlimited")), None);
        assert_eq!(size_limit_in(""), None);
    }
}
