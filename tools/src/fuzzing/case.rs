//! A case: the files that a reader is given together.

use std::path::{Path, PathBuf};

use clerestory::transport::random::pcg3d;
use clerestory::{Error, Result};
use glam::UVec3;

/// A file of a case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Whether it is left as it is.
    pub fixed: bool,
}

/// The files that a reader is given together; the first is the one that it opens.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Case {
    /// At least one.
    pub files: Vec<File>,
}

impl Case {
    /// A case of one file.
    pub fn of(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self::default().with(name, bytes)
    }

    /// The same with a file more.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.push(File {
            name: name.into(),
            bytes: bytes.into(),
            fixed: false,
        });
        self
    }

    /// The same with a file more that is left as it is.
    #[must_use]
    pub fn with_fixed(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self = self.with(name, bytes);
        if let Some(last) = self.files.last_mut() {
            last.fixed = true;
        }
        self
    }

    /// The bytes of the first file.
    pub fn main(&self) -> &[u8] {
        self.files.first().map_or(&[], |file| &file.bytes)
    }

    /// The name of the first file.
    pub fn name(&self) -> &str {
        self.files.first().map_or("", |file| &file.name)
    }

    /// Bytes of all files.
    pub fn size(&self) -> usize {
        self.files.iter().map(|file| file.bytes.len()).sum()
    }

    /// Writes the files into a folder that is there; the path of the first.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<PathBuf> {
        for file in &self.files {
            let path = folder.join(&file.name);
            std::fs::write(&path, &file.bytes).map_err(|error| Error::io(&path, error))?;
        }
        Ok(folder.join(self.name()))
    }

    /// The files of a folder, in the order of their names, but for a `README.md`; the first is the one whose name begins with `main`, if there is
    /// one.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read(folder: &Path) -> Result<Self> {
        let wrong = |error| Error::io(folder, error);
        let mut case = Self::default();
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(wrong)? {
            paths.push(entry.map_err(wrong)?.path());
        }
        paths.sort();
        for path in paths {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name != README {
                let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, error))?;
                case = case.with(&name, bytes);
            }
        }
        case.files.sort_by_key(|file| !file.name.starts_with("main"));
        Ok(case)
    }
}

/// The file of a kept case that says what it broke.
pub const README: &str = "README.md";

/// Random numbers of one case, the same on every machine: the engine's hash of its number, of the draw and of the key of its reader and seed.
#[derive(Debug, Clone)]
pub struct Stream {
    number: u32,
    key: u32,
    drawn: u32,
}

impl Stream {
    /// Of a case.
    pub fn new(seed: u32, reader: &str, number: u32) -> Self {
        let key = reader
            .bytes()
            .fold(seed, |key, byte| pcg3d(UVec3::new(key, byte.into(), 1)).x);
        Self { number, key, drawn: 0 }
    }

    /// 32 random bits.
    pub fn word(&mut self) -> u32 {
        let word = pcg3d(UVec3::new(self.number, self.drawn, self.key)).x;
        self.drawn += 1;
        word
    }

    /// A number below `end`; 0 where that is 0.
    pub fn below(&mut self, end: usize) -> usize {
        ((u64::from(self.word()) * end as u64) >> 32) as usize
    }

    /// True once in `times`.
    pub fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// One of them; `None` of none.
    pub fn pick<'a, T>(&mut self, all: &'a [T]) -> Option<&'a T> {
        all.get(self.below(all.len()))
    }

    /// A part of so many bytes: its beginning and its end, at most `longest` apart.
    pub fn part(&mut self, length: usize, longest: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        let end = start + self.below(longest.min(length - start) + 1);
        start..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_of_their_reader_seed_and_number() {
        let words = |seed, reader, number| {
            let mut stream = Stream::new(seed, reader, number);
            [0; 4].map(|_| stream.word())
        };
        let first = words(1, "PLY", 5);
        assert_eq!(first, words(1, "PLY", 5));
        for other in [words(2, "PLY", 5), words(1, "OBJ", 5), words(1, "PLY", 6)] {
            assert_ne!(first, other);
        }
        let mut stream = Stream::new(1, "PLY", 0);
        for length in [0, 1, 7, 100] {
            for _ in 0..50 {
                let part = stream.part(length, 16);
                assert!(part.start <= part.end && part.end <= length && part.len() <= 16);
            }
        }
        assert_eq!((stream.below(0), stream.below(1)), (0, 0));
        assert_eq!(stream.pick::<u8>(&[]), None);
    }

    #[test]
    fn cases_are_written_and_read() {
        let folder = tempfile::tempdir().unwrap();
        let case = Case::of("main.obj", "v 0 0 0\n").with("a.mtl", "newmtl a\n");
        assert_eq!(case.write(folder.path()).unwrap(), folder.path().join("main.obj"));
        std::fs::write(folder.path().join(README), "words").unwrap();
        assert_eq!(Case::read(folder.path()).unwrap(), case);
        assert_eq!((case.name(), case.main().len(), case.size()), ("main.obj", 8, 17));
        assert!(case.with_fixed("b", "").files[2].fixed);
    }
}
