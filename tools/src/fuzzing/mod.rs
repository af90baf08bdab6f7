//! Fuzzing: files that this module has made and then damaged go through every reader of the engine, and those that are accepted through one
//! step of a render.
//!
//! - `seeds`: small sound files, made by the engine itself or written here. `tools/fuzzing/` keeps files that once broke something.
//! - [`mutation`]: damages them: bits, bytes, blocks, chunks, lengths, numbers in text, words of a dictionary, parts of other files. Half of
//!   the files get sums and lengths that fit again, so that readers go on behind them.
//! - [`readers`]: what takes the files.
//! - [`worker`]: reads many of them in a process of its own, whose memory is bounded. Before each file it says which one it begins, so that
//!   whoever runs it knows the culprit when it dies or does not end.
//! - [`campaign`]: runs workers, goes on behind each culprit, makes what was found small and keeps it.
//! - [`totals`]: what all runs have done together, by reader.
//!
//! The file number `i` of a reader and a seed is the same on every machine. Nothing here judges time beyond one generous limit.

pub mod campaign;
pub mod case;
mod kept;
mod layout;
pub mod mutation;
pub mod readers;
mod seeds;
pub mod totals;
pub mod worker;

use std::path::{Path, PathBuf};

/// Where runs keep totals and what they find, from the repository's root.
pub const FOLDER: &str = "out/fuzzing";

/// The folder of files that once broke something, each in a folder named as its reader and what it broke.
pub fn kept_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzzing")
}
