//! Input files: the one door through which bytes come that a scene, a picture to compare or a command names.
//!
//! A scene is written by somebody else, and so are the names in it. Guarantees, whatever it says:
//!
//! - Each file of a scene is opened and read once, however often it is named, and under whatever names a [`Resolver`] finds to be one.
//! - [`AnyFile`] and [`Folder`] read regular files alone: no devices, pipes, sockets or folders, and no more bytes than the file had when it was
//!   opened.
//! - [`InputLimits`] bound a file, all files of a scene together, and the memory that their contents may take once decoded, which is
//!   counted before it is allocated.
//!
//! What a scene may *name* is the resolver's matter. The default, [`AnyFile`], follows every path and link as the operating system does: absolute
//! paths, `..` and links reach every file that the process may read, and parts of it come out again, as bounds, counts or pictures. A
//! host that does not trust its scenes gives a [`Folder`], files in [`Memory`], or a function of its own ([`Callback`]).

mod resolver;

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use resolver::{AnyFile, Callback, Folder, Memory, Resolver};

use crate::{Error, Result};

/// How much a scene may read and decode, in bytes. A host that knows its scenes may raise each of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputLimits {
    /// Most bytes of one file.
    pub file: u64,
    /// Most bytes of all files of a scene together; each counts once.
    pub total: u64,
    /// Bytes that decoded contents (texels, densities, materials) may take whatever the files' size is.
    pub decoded_base: u64,
    /// Bytes that decoded contents may take beyond [`InputLimits::decoded_base`], for each byte that was read.
    pub decoded_per_byte: u64,
}

impl Default for InputLimits {
    /// Files of 2 GiB, 4 GiB in all; 512 MiB decoded, and 128 bytes more for each byte read. Pictures of one colour are compressed to about a
    /// thousandth, so that the allowance is what such ones live on: four textures of 4096² texels.
    fn default() -> Self {
        Self {
            file: 2 << 30,
            total: 4 << 30,
            decoded_base: 512 << 20,
            decoded_per_byte: 128,
        }
    }
}

impl InputLimits {
    /// Bytes that decoded contents of files of `read` bytes in all may take.
    pub fn decoded(&self, read: u64) -> u64 {
        self.decoded_base
            .saturating_add(self.decoded_per_byte.saturating_mul(read))
    }

    /// Whether contents of `wanted` bytes may be decoded from files of `read` bytes in all.
    ///
    /// # Errors
    /// The cause, in words.
    pub(crate) fn check_decoded(&self, wanted: u64, read: u64) -> Result<(), String> {
        let allowed = self.decoded(read);
        if wanted <= allowed {
            return Ok(());
        }
        Err(format!(
            "decoded, takes {wanted} bytes of memory, more than the {allowed} that {read} bytes of files may take"
        ))
    }
}

/// Opens a regular file of at most `most` bytes; also says how many it has.
///
/// # Errors
/// The system's, and [`ErrorKind::InvalidInput`] for what is not a regular file, [`ErrorKind::FileTooLarge`] for one that is too long.
pub fn open_regular(path: &Path, most: u64) -> io::Result<(File, u64)> {
    // Opening alone may wait (a pipe) or act (a device), so that the look comes before; the second look is at what was opened.
    check_regular(&std::fs::metadata(path)?, most)?;
    let file = open_at_once(path)?;
    let length = check_regular(&file.metadata()?, most)?;
    Ok((file, length))
}

fn check_regular(data: &Metadata, most: u64) -> io::Result<u64> {
    if data.is_dir() {
        return Err(refusal("is a folder, not a file"));
    }
    if !data.is_file() {
        return Err(refusal(
            "is not a regular file; devices, pipes and sockets are not read",
        ));
    }
    check_length(data.len(), most)?;
    Ok(data.len())
}

fn check_length(length: u64, most: u64) -> io::Result<()> {
    if length <= most {
        return Ok(());
    }
    let text = format!("has {length} bytes; at most {most} can be read");
    Err(io::Error::new(ErrorKind::FileTooLarge, text))
}

fn refusal(text: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, text)
}

/// Opens for reading without waiting, should the file have become a pipe since it was looked at.
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
fn open_at_once(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    /// `O_NONBLOCK` of these systems; regular files do not look at it.
    const NONBLOCK: i32 = 0o4000;
    OpenOptions::new().read(true).custom_flags(NONBLOCK).open(path)
}

#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
fn open_at_once(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).open(path)
}

/// All bytes of a regular file, as many as it had when it was opened.
pub(crate) fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let (file, length) = open_regular(path, most)?;
    let mut bytes = Vec::new();
    let wanted = usize::try_from(length).map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
    bytes
        .try_reserve_exact(wanted)
        .map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// All bytes of a regular file that is not a scene's: a picture, a file of settings.
///
/// # Errors
/// [`Error::Io`] when it cannot be read, is not a regular file or has more than `most` bytes.
pub fn read_file(path: &Path, most: u64) -> Result<Vec<u8>> {
    read_regular(path, most).map_err(|cause| Error::io(path, cause))
}

/// As [`read_file`], for text in UTF-8.
///
/// # Errors
/// As [`read_file`], and for what is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String> {
    text_of(read_file(path, most)?).map_err(|cause| Error::io(path, cause))
}

fn text_of(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|_| io::Error::new(ErrorKind::InvalidData, "is not UTF-8"))
}

/// A file that a scene has read.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct InputFile {
    /// What [`Resolver::find`] has found: by default the absolute path without links.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
}

/// The files of one scene while it is read: what was read, and what is counted against the limits.
pub struct InputFiles<'o> {
    resolver: &'o dyn Resolver,
    limits: InputLimits,
    state: RefCell<State>,
}

/// A file's bytes; of what cannot be read the kind and the words, so that it is not tried again.
type Opened = Result<Arc<Vec<u8>>, (ErrorKind, String)>;

#[derive(Default)]
struct State {
    known: HashMap<PathBuf, Opened>,
    list: Vec<InputFile>,
    /// Bytes of files and of what was given in memory.
    read: u64,
    /// Bytes of decoded contents that stay.
    kept: u64,
}

impl<'o> InputFiles<'o> {
    /// No file read yet.
    pub fn new(resolver: &'o dyn Resolver, limits: InputLimits) -> Self {
        Self {
            resolver,
            limits,
            state: RefCell::default(),
        }
    }

    /// The bytes of the file behind a path, read at its first use.
    ///
    /// # Errors
    /// The resolver's, and [`ErrorKind::FileTooLarge`] for what is beyond [`InputLimits::file`] or [`InputLimits::total`].
    pub fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
        let file = self.resolver.find(path)?;
        let mut state = self.state.borrow_mut();
        if let Some(known) = state.known.get(&file) {
            return known.clone().map_err(|(kind, words)| io::Error::new(kind, words));
        }
        let left = self.limits.total.saturating_sub(state.read);
        let read = self.resolver.read(&file, self.limits.file.min(left));
        // A host's function may not look at the limit.
        let read = read.and_then(|bytes| {
            check_length(bytes.len() as u64, self.limits.file.min(left))?;
            Ok(bytes)
        });
        let read = read.map_err(|cause| {
            if cause.kind() != ErrorKind::FileTooLarge {
                return cause;
            }
            let text = if left < self.limits.file {
                format!("{cause}; {} bytes were read before it (InputLimits::total)", state.read)
            } else {
                format!("{cause} (InputLimits::file)")
            };
            io::Error::new(ErrorKind::FileTooLarge, text)
        });
        match read {
            Ok(bytes) => {
                let length = bytes.len() as u64;
                state.read += length;
                state.list.push(InputFile {
                    path: file.clone(),
                    bytes: length,
                });
                state.known.insert(file, Ok(Arc::clone(&bytes)));
                Ok(bytes)
            }
            Err(cause) => {
                state.known.insert(file, Err((cause.kind(), cause.to_string())));
                Err(cause)
            }
        }
    }

    /// As [`InputFiles::read`]; `None` where there is no such file.
    ///
    /// # Errors
    /// As [`InputFiles::read`].
    pub fn read_if_there(&self, path: &Path) -> io::Result<Option<Arc<Vec<u8>>>> {
        match self.read(path) {
            Ok(bytes) => Ok(Some(bytes)),
            // A longer name than the system allows is no file's.
            Err(cause) if matches!(cause.kind(), ErrorKind::NotFound | ErrorKind::InvalidFilename) => Ok(None),
            Err(cause) => Err(cause),
        }
    }

    /// Counts bytes that the host gave in memory as if they had been read from a file.
    pub fn count(&self, bytes: u64) {
        let mut state = self.state.borrow_mut();
        state.read = state.read.saturating_add(bytes);
    }

    /// Counts what is about to be decoded: `peak` bytes while it lasts, of which `kept` stay.
    ///
    /// # Errors
    /// The cause, in words, when it is more than [`InputLimits::decoded`] of the bytes read so far; nothing is counted then.
    pub(crate) fn reserve(&self, peak: u64, kept: u64) -> Result<(), String> {
        let mut state = self.state.borrow_mut();
        let wanted = state.kept.saturating_add(peak.max(kept));
        let checked = self.limits.check_decoded(wanted, state.read);
        checked.map_err(|cause| format!("{cause} (InputLimits)"))?;
        state.kept = state.kept.saturating_add(kept);
        Ok(())
    }

    /// The files read, in the order of their first use.
    pub fn files(&self) -> Vec<InputFile> {
        self.state.borrow().list.clone()
    }

    /// Bytes read; each file counts once.
    pub fn bytes_read(&self) -> u64 {
        self.state.borrow().read
    }

    /// Bytes of decoded contents that were counted and stay.
    pub fn bytes_decoded(&self) -> u64 {
        self.state.borrow().kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    const MOST: u64 = 1000;

    /// Answers every path by `length` bytes and counts the calls.
    struct Counting {
        calls: AtomicU64,
        length: usize,
    }

    impl Resolver for Counting {
        fn read(&self, _: &Path, _: u64) -> io::Result<Arc<Vec<u8>>> {
            self.calls.fetch_add(1, Ordering::Relaxed);
            Ok(Arc::new(vec![7; self.length]))
        }
    }

    fn counting(length: usize) -> Counting {
        Counting {
            calls: AtomicU64::new(0),
            length,
        }
    }

    fn small() -> InputLimits {
        InputLimits {
            file: 100,
            total: 250,
            decoded_base: 64,
            decoded_per_byte: 2,
        }
    }

    #[test]
    fn a_file_is_read_once_under_all_its_names() {
        let resolver = counting(100);
        let files = InputFiles::new(&resolver, small());
        for name in ["m/a.bin", "./m/a.bin", "m/x/../a.bin", "m/a.bin"].repeat(1000) {
            assert_eq!(files.read(Path::new(name)).expect("bytes").len(), 100);
        }
        assert_eq!((resolver.calls.load(Ordering::Relaxed), files.bytes_read()), (1, 100));
        let expected = InputFile {
            path: "m/a.bin".into(),
            bytes: 100,
        };
        assert_eq!(files.files(), [expected]);
    }

    #[test]
    fn files_beyond_the_limits_are_refused_even_if_a_host_hands_them_out() {
        let resolver = counting(101);
        let files = InputFiles::new(&resolver, small());
        for _ in 0..3 {
            let error = files.read(Path::new("a")).expect_err("too long");
            assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        }
        assert_eq!((resolver.calls.load(Ordering::Relaxed), files.bytes_read()), (1, 0));
        let resolver = counting(100);
        let files = InputFiles::new(&resolver, small());
        files.read(Path::new("a")).expect("first");
        files.read(Path::new("b")).expect("second");
        let error = files.read(Path::new("c")).expect_err("the third is beyond the total");
        assert!(error.to_string().contains("200 bytes were read before"), "{error}");
    }

    #[test]
    fn decoded_contents_are_a_multiple_of_what_was_read() {
        let resolver = counting(10);
        let files = InputFiles::new(&resolver, small());
        assert!(files.reserve(65, 0).is_err());
        files.reserve(64, 60).expect("within what is free");
        assert!(files.reserve(5, 5).expect_err("no file read").contains("65 bytes"));
        files.read(Path::new("a")).expect("bytes");
        files.reserve(24, 4).expect("two for each byte read");
        assert!(files.reserve(21, 0).is_err());
        files.count(1);
        files.reserve(22, 0).expect("what was given in memory counts");
        assert_eq!(files.bytes_decoded(), 64);
        assert!(files.reserve(u64::MAX, u64::MAX).is_err());
    }

    #[test]
    fn only_regular_files_are_read() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a");
        std::fs::write(&path, [1; 1000]).expect("file");
        assert_eq!(read_file(&path, MOST).expect("bytes").len(), 1000);
        assert!(
            read_file(&path, MOST - 1)
                .expect_err("long")
                .to_string()
                .contains("has 1000 bytes")
        );
        assert!(read_text(&path, MOST).is_ok());
        let refused = |path: &Path, word: &str| {
            let message = read_file(path, MOST).expect_err("refused").to_string();
            assert!(message.contains(word), "{message}");
            let message = AnyFile.read(path, MOST).expect_err("refused").to_string();
            assert!(message.contains(word), "{message}");
        };
        refused(folder.path(), "folder");
        #[cfg(unix)]
        {
            // Reading the first would never end, opening the second would wait for a writer.
            refused(Path::new("/dev/zero"), "regular");
            let pipe = folder.path().join("pipe");
            let made = std::process::Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .expect("mkfifo");
            assert!(made.success());
            refused(&pipe, "regular");
            let socket = folder.path().join("socket");
            let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("socket");
            refused(&socket, "regular");
            let link = folder.path().join("link");
            std::os::unix::fs::symlink("/dev/zero", &link).expect("link");
            refused(&link, "regular");
        }
        std::fs::write(&path, [0xFF]).expect("file");
        assert!(read_text(&path, MOST).is_err());
    }
}
