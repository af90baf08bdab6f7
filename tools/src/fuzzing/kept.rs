//! Files that once broke something: `READER/WHAT/` with the files of a case, `main…` first.

use std::path::{Path, PathBuf};

use clerestory::{Error, Result};

use super::readers::{READERS, Reader};

/// The name of a reader's folder.
pub fn folder_of(reader: &Reader) -> String {
    reader.name.replace(' ', "-")
}

/// The folders of all cases below a folder, each with its reader.
///
/// # Errors
/// [`Error::Io`]; [`Error::Setting`] for a folder that is no reader's.
pub fn cases(root: &Path) -> Result<Vec<(&'static Reader, PathBuf)>> {
    let mut cases = Vec::new();
    for folder in folders(root)? {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let reader = READERS.iter().find(|reader| folder_of(reader) == name);
        let reader = reader.ok_or_else(|| Error::setting("reader", name, "is none, but has kept files"))?;
        cases.extend(folders(&folder)?.into_iter().map(|folder| (reader, folder)));
    }
    Ok(cases)
}

/// The folders in a folder, by name.
fn folders(root: &Path) -> Result<Vec<PathBuf>> {
    let wrong = |error| Error::io(root, error);
    let mut all = Vec::new();
    for entry in std::fs::read_dir(root).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.is_dir() {
            all.push(path);
        }
    }
    all.sort();
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzzing::case::Case;
    use crate::fuzzing::kept_folder;

    #[test]
    fn kept_files_are_few_small_and_of_readers() {
        let cases = cases(&kept_folder()).unwrap();
        assert!(!cases.is_empty());
        let sizes = cases.iter().map(|(_, folder)| Case::read(folder).unwrap().size());
        assert!(sizes.sum::<usize>() < 32 << 10);
    }
}
