//! Pages of results: a folder for each experiment with its page, tables and plots, and a list of all.
//!
//! `found.json` of a folder holds how the experiment was run and its rows. Everything else is made of it, so that a new word, criterion or plot
//! needs no run, and a test can tell whether a page is as old as its experiment. An experiment that was not run has a page too, whose criteria
//! are undecided.

mod list;
mod page;
mod quoted;
mod stored;

use std::path::Path;

use clerestory::atomic;
use clerestory::{Error, Result};

pub use page::{FILE as PAGE, File, files};
pub use quoted::fill;
pub use stored::{Run, Stored, findings};

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

/// Keeps what an experiment found, and writes its page, the list and all quotations.
///
/// # Errors
/// [`Error::Io`], [`Error::Setting`] as [`findings`].
pub fn keep(root: &Path, experiment: &Experiment, stored: &Stored) -> Result<()> {
    let folder = root.join(FOLDER).join(&experiment.name);
    stored.write(&folder)?;
    page::write(&folder, experiment)?;
    list_and_quote(root)
}

/// Writes all pages anew from what is stored.
///
/// # Errors
/// As [`keep`].
pub fn write_all(root: &Path) -> Result<()> {
    for name in super::names() {
        page::write(&root.join(FOLDER).join(name), &super::find(name)?)?;
    }
    list_and_quote(root)
}

fn list_and_quote(root: &Path) -> Result<()> {
    let folder = root.join(FOLDER);
    atomic::write(&folder.join(PAGE), list(root)?.as_bytes())?;
    for (path, old, new) in quotations(root)? {
        if old != new {
            atomic::write(&root.join(path), new.as_bytes())?;
        }
    }
    Ok(())
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
/// [`Error::Io`], and as [`fill`].
pub fn quotations(root: &Path) -> Result<Vec<(&'static str, String, String)>> {
    let there = QUOTING.iter().filter(|(path, _)| root.join(path).exists());
    there
        .map(|(path, link)| {
            let file = root.join(path);
            let old = std::fs::read_to_string(&file).map_err(|error| Error::io(&file, error))?;
            let new = fill(&root.join(FOLDER), &old, link)?;
            Ok((*path, old, new))
        })
        .collect()
}
