//! Which files a scene may name: those that a resolver finds.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::{check_length, read_regular, refusal};
use crate::{Error, Result};

/// Finds and reads the files that a scene names.
///
/// Paths are those of the scene's own file and what it names joined to that file's folder; they are not cleaned: `models/../x.bin` is possible.
/// The errors' words become part of the scene's error; [`ErrorKind::NotFound`] says that there is no such file, which is no error for what
/// a scene may have but need not (a sidecar beside a model).
pub trait Resolver: Send + Sync {
    /// The one name of the file behind a path: equal for all paths of one file, which is read once. By default the path without `.` and, as far as
    /// they can be resolved by the text, `..`.
    ///
    /// # Errors
    /// When there is no such file, or the scene may not read it.
    fn find(&self, path: &Path) -> io::Result<PathBuf> {
        Ok(plain(path))
    }

    /// The bytes of a file that [`Resolver::find`] has found.
    ///
    /// # Errors
    /// When it cannot be read or has more than `most` bytes; this is known before they are in memory.
    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>>;
}

/// A path without `.`, and without `..` behind a name. Leading `..` stay.
fn plain(path: &Path) -> PathBuf {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::CurDir, _) | (Component::ParentDir, Some(Component::RootDir)) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => _ = parts.pop(),
            _ => parts.push(part),
        }
    }
    parts.iter().collect()
}

/// Every regular file that the process may read: absolute paths, `..` and links are followed. The default.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnyFile;

impl Resolver for AnyFile {
    fn find(&self, path: &Path) -> io::Result<PathBuf> {
        path.canonicalize()
    }

    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>> {
        read_regular(file, most).map(Arc::new)
    }
}

/// The regular files below one folder. Relative paths begin there; absolute paths, `..` and links that leave it are refused.
///
/// Links are looked at before the file is opened: whoever can change the folder meanwhile can lead out of it.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The files below `root`.
    ///
    /// # Errors
    /// [`Error::Io`] when it is not a folder.
    pub fn new(root: impl AsRef<Path>) -> Result<Self> {
        let given = root.as_ref();
        let root = given.canonicalize().map_err(|cause| Error::io(given, cause))?;
        if !root.is_dir() {
            return Err(Error::io(given, refusal("is not a folder")));
        }
        Ok(Self { root })
    }
}

impl Resolver for Folder {
    fn find(&self, path: &Path) -> io::Result<PathBuf> {
        let outside = || {
            let text = format!(
                "lies outside the folder {} that scenes are read from",
                self.root.display()
            );
            io::Error::new(ErrorKind::PermissionDenied, text)
        };
        // By the text first, so that a scene does not learn which files are outside.
        let joined = plain(&self.root.join(path));
        if !joined.starts_with(&self.root) {
            return Err(outside());
        }
        let found = joined.canonicalize()?;
        if found.starts_with(&self.root) {
            Ok(found)
        } else {
            Err(outside())
        }
    }

    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>> {
        read_regular(file, most).map(Arc::new)
    }
}

/// Files in memory by their paths, as of an archive that a host has unpacked.
///
/// ```
/// use std::sync::Arc;
///
/// use clerestory::input::Memory;
/// use clerestory::scene::{LoadOptions, load_with};
///
/// # fn main() -> clerestory::Result<()> {
/// let mut files = Memory::default();
/// files
///     .add("models/a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")
///     .add("models/a.mtl", "newmtl red\nKd 1 0 0\n");
/// let options = LoadOptions {
///     resolver: Arc::new(files),
///     ..LoadOptions::default()
/// };
/// // What the model names is looked for beside it.
/// let loaded = load_with("models/a.obj", &options)?;
/// assert_eq!(loaded.files.len(), 2);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Arc<Vec<u8>>>,
}

impl Memory {
    /// Adds a file, or replaces that of the same path. The path is taken without `.` and `..`.
    pub fn add(&mut self, path: impl AsRef<Path>, bytes: impl Into<Vec<u8>>) -> &mut Self {
        self.files.insert(plain(path.as_ref()), Arc::new(bytes.into()));
        self
    }
}

impl Resolver for Memory {
    fn find(&self, path: &Path) -> io::Result<PathBuf> {
        let path = plain(path);
        if self.files.contains_key(&path) {
            Ok(path)
        } else {
            Err(io::Error::new(ErrorKind::NotFound, "there is no such file in memory"))
        }
    }

    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>> {
        let bytes = self.files.get(file).ok_or(ErrorKind::NotFound)?;
        check_length(bytes.len() as u64, most)?;
        Ok(Arc::clone(bytes))
    }
}

/// A function of the host's: it gets a path without `.` and `..` as far as the text tells, and the most bytes that the file may have.
pub struct Callback<F> {
    function: F,
}

impl<F: Fn(&Path, u64) -> io::Result<Vec<u8>> + Send + Sync> Callback<F> {
    /// Files by `function`.
    pub fn new(function: F) -> Self {
        Self { function }
    }
}

impl<F> fmt::Debug for Callback<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Callback")
    }
}

impl<F: Fn(&Path, u64) -> io::Result<Vec<u8>> + Send + Sync> Resolver for Callback<F> {
    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>> {
        (self.function)(file, most).map(Arc::new)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{InputFiles, InputLimits};
    use super::*;

    #[test]
    fn paths_are_cleaned_by_their_text() {
        for (path, expected) in [
            ("a/./b", "a/b"),
            ("./a", "a"),
            ("a/../b", "b"),
            ("../a/..", ".."),
            ("a/../../b", "../b"),
        ] {
            assert_eq!(plain(Path::new(path)), Path::new(expected), "{path}");
        }
        #[cfg(unix)]
        assert_eq!(plain(Path::new("/../a//b/..")), Path::new("/a"));
    }

    #[test]
    fn memory_and_functions_answer() {
        let mut memory = Memory::default();
        memory.add("models/a.obj", "v").add("./b.bin", vec![1u8, 2]);
        let read = |path: &str, most| {
            let found = memory.find(Path::new(path))?;
            memory.read(&found, most)
        };
        assert_eq!(*read("models/../b.bin", 2).expect("bytes"), [1, 2]);
        assert_eq!(read("b.bin", 1).expect_err("long").kind(), ErrorKind::FileTooLarge);
        assert_eq!(read("../b.bin", 9).expect_err("outside").kind(), ErrorKind::NotFound);
        let callback = Callback::new(|path, _| Ok(path.display().to_string().into_bytes()));
        let files = InputFiles::new(&callback, InputLimits::default());
        assert_eq!(*files.read(Path::new("x/./y")).expect("bytes"), b"x/y");
    }

    #[test]
    fn a_folder_holds_what_is_in_it_and_nothing_else() {
        let outside = tempfile::tempdir().expect("folder");
        let root = outside.path().join("root");
        std::fs::create_dir_all(root.join("part")).expect("folder");
        std::fs::write(root.join("part/a.bin"), b"in").expect("file");
        std::fs::write(outside.path().join("secret"), b"out").expect("file");
        let folder = Folder::new(&root).expect("folder");
        let read = |path: &Path| folder.read(&folder.find(path)?, 1000);
        for path in [Path::new("part/a.bin"), Path::new("part/../part/./a.bin")] {
            assert_eq!(*read(path).expect("inside"), b"in");
        }
        let absolute = root.canonicalize().expect("root").join("part/a.bin");
        assert_eq!(*read(&absolute).expect("inside"), b"in");
        let refused = |path: &Path| read(path).expect_err("outside").kind();
        for path in ["../secret", "part/../../secret", "../nothing"] {
            assert_eq!(refused(Path::new(path)), ErrorKind::PermissionDenied, "{path}");
        }
        assert_eq!(refused(&outside.path().join("secret")), ErrorKind::PermissionDenied);
        assert_eq!(refused(Path::new("nothing")), ErrorKind::NotFound);
        assert!(Folder::new(root.join("part/a.bin")).is_err());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../secret", root.join("link")).expect("link");
            std::os::unix::fs::symlink("part/a.bin", root.join("inner")).expect("link");
            assert_eq!(refused(Path::new("link")), ErrorKind::PermissionDenied);
            assert_eq!(*read(Path::new("inner")).expect("a link that stays inside"), b"in");
        }
    }
}
