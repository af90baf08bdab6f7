//! A folder that a command fills with files of many names.

use std::path::{Path, PathBuf};

use super::{Inputs, New, Outputs, Overwriting, Written};
use crate::failure::Outcome;
use crate::output;

/// A file of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFile {
    /// Its name, or its way from the folder.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

impl NamedFile {
    /// A file of that name.
    pub fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self {
            name: name.into(),
            bytes: bytes.into(),
        }
    }
}

/// A folder with the plan of its files.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    plan: Outputs,
}

impl OutputFolder {
    /// As [`Outputs::plan`], of files of the folder; some may be left out when they are written.
    pub fn plan(folder: &Path, names: &[impl AsRef<Path>], inputs: &Inputs, overwriting: Overwriting) -> Outcome<Self> {
        let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
        Ok(Self {
            folder: folder.to_owned(),
            plan: Outputs::plan(&paths, inputs, overwriting.overwrite)?,
        })
    }

    /// As [`OutputFolder::plan`], of a folder whose files are known to be this program's.
    pub fn of_ours(
        folder: &Path,
        names: &[impl AsRef<Path>],
        inputs: &Inputs,
        overwriting: Overwriting,
    ) -> Outcome<Self> {
        let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
        Ok(Self {
            folder: folder.to_owned(),
            plan: Outputs::of_ours(&paths, inputs, overwriting.overwrite)?,
        })
    }

    /// As [`Outputs::write`], of files that the plan names, and of others that were not there when it was made. Says so.
    pub fn write(&self, files: &[NamedFile]) -> Written {
        let paths: Vec<PathBuf> = files.iter().map(|file| self.folder.join(&file.name)).collect();
        let files = paths.iter().zip(files);
        let files: Vec<New> = files
            .map(|(path, file)| New {
                path,
                bytes: &file.bytes,
            })
            .collect();
        let written = self.plan.write_files(&files, || None);
        if written.paths == paths {
            output::note(&format!("wrote {}", self.folder.display()));
        } else {
            output::note(&format!("wrote {}", written.names()));
        }
        written
    }
}
