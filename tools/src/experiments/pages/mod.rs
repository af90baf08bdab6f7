//! Pages of results: a folder for each experiment with its page, tables and plots, and a list of all.
//!
//! `found.json` of a folder holds how the experiment was run and its rows. Everything else is made of it, so that a new word, criterion or plot
//! needs no run, and a test can tell whether a page is as old as its experiment. An experiment that was not run has a page too, whose criteria
//! are undecided.

mod list;
mod page;
mod quoted;
mod stored;

use std::path::{Path, PathBuf};

use clerestory::Result;
use clerestory::input::read_text;

pub use page::{FILE as PAGE, File, files};
pub use quoted::fill;
pub use stored::{FILE as FOUND, Run, Stored, findings};

use super::Experiment;

/// The folder of results, from the repository's root.
pub const FOLDER: &str = "results";
/// Pages elsewhere that quote results, and the way from each to them.
const QUOTING: [(&str, &str); 4] = [
    ("README.md", FOLDER),
    ("docs/choosing.md", "../results"),
    ("docs/reference.md", "../results"),
    ("docs/gallery.md", "../results"),
];

/// Most bytes of a page.
const MOST_BYTES: u64 = 1 << 26;

/// A file of the results, or a page that quotes them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// Where it is.
    pub path: PathBuf,
    /// What it holds.
    pub text: String,
}

/// Whether the folder of results is one that was made here: by how its list begins, or by what one of the experiments found.
pub fn are_ours(root: &Path) -> bool {
    let folder = root.join(FOLDER);
    read_text(&folder.join(PAGE), MOST_BYTES).is_ok_and(|list| list.starts_with(list::MARK))
        || super::names().any(|name| Stored::read(&folder.join(name)).is_ok_and(|stored| stored.is_some()))
}

/// The files that hold and show what an experiment found, of its folder of results: first what all others are made of.
///
/// # Errors
/// As [`files`].
pub fn of_run(experiment: &Experiment, stored: &Stored) -> Result<Vec<File>> {
    let mut all = vec![File {
        name: FOUND.into(),
        text: stored.text()?,
    }];
    all.extend(files(experiment, Some(stored))?);
    Ok(all)
}

/// All pages as they would be made now of what is stored, those that quote results included.
///
/// # Errors
/// As [`files`].
pub fn all(root: &Path) -> Result<Vec<Page>> {
    let mut all = Vec::new();
    for name in super::names() {
        let folder = root.join(FOLDER).join(name);
        for File { name, text } in files(&super::find(name)?, Stored::read(&folder)?.as_ref())? {
            let path = folder.join(name);
            all.push(Page { path, text });
        }
    }
    all.extend(summaries(root)?);
    Ok(all)
}

/// The list, and the pages elsewhere whose quotations have changed.
///
/// # Errors
/// As [`findings`].
pub fn summaries(root: &Path) -> Result<Vec<Page>> {
    let mut all = vec![Page {
        path: root.join(FOLDER).join(PAGE),
        text: list(root)?,
    }];
    let changed = quotations(root)?.into_iter().filter(|(_, old, new)| old != new);
    all.extend(changed.map(|(path, _, text)| Page {
        path: root.join(path),
        text,
    }));
    Ok(all)
}

/// The pages of results and elsewhere that every run writes.
pub fn summary_paths(root: &Path) -> Vec<PathBuf> {
    let quoting = QUOTING
        .iter()
        .map(|(path, _)| root.join(path))
        .filter(|path| path.exists());
    std::iter::once(root.join(FOLDER).join(PAGE)).chain(quoting).collect()
}

/// The list of all experiments as it would be written now.
///
/// # Errors
/// As [`findings`].
pub fn list(root: &Path) -> Result<String> {
    list::of_all(&root.join(FOLDER))
}

/// Pages that quote results and are there, as they are and as they would be written now.
///
/// # Errors
/// [`clerestory::Error::Io`], and as [`fill`].
pub fn quotations(root: &Path) -> Result<Vec<(&'static str, String, String)>> {
    let there = QUOTING.iter().filter(|(path, _)| root.join(path).exists());
    there
        .map(|(path, link)| {
            let file = root.join(path);
            let old = read_text(&file, MOST_BYTES)?;
            let new = fill(&root.join(FOLDER), &old, link)?;
            Ok((*path, old, new))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_known_by_their_list_or_by_what_was_found() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join(FOLDER).join("alpha");
        std::fs::create_dir_all(&folder).unwrap();
        assert!(!are_ours(root.path()));
        let list_file = root.path().join(FOLDER).join(PAGE);
        std::fs::write(&list_file, "# Results\n\nOf somebody's.\n").unwrap();
        assert!(!are_ours(root.path()));
        std::fs::write(folder.join(FOUND), "{}").unwrap();
        assert!(!are_ours(root.path()));
        let stored = Stored {
            run: Run::begin("clerestory report alpha --results".into()),
            found: serde_json::json!([]),
        };
        std::fs::write(folder.join(FOUND), stored.text().unwrap()).unwrap();
        assert!(are_ours(root.path()));
        std::fs::remove_file(folder.join(FOUND)).unwrap();
        std::fs::write(&list_file, list(root.path()).unwrap()).unwrap();
        assert!(are_ours(root.path()));
    }
}
