//! The catalogue: one row for every system that the engine carries, so that a reader finds where a publication lives in the code.
//!
//! Ids with the prefixes `BG-`, `DP-`, `PM-` and `MET-` are those of the five research documents that the engine follows (visibility and media,
//! photon mapping, metals and reflections); where two documents describe one thing, their rows point at one implementation. Ids with
//! the prefix `CL-` are the engine's own, for published methods outside of those documents. Guarantee: the tests below check that the
//! module, every test and every experiment named here exist.

mod rows;
#[cfg(test)]
mod tests;

use crate::techniques::Bias;
use crate::transport::PathSet;

/// One system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Row {
    /// Unique id with its prefix, such as `BG-3`.
    pub id: &'static str,
    /// What it is.
    pub name: &'static str,
    /// Where it was published.
    pub publication: &'static str,
    /// Its main file, from the repository's root.
    pub module: &'static str,
    /// The light paths of its picture; `None` for what makes no picture by itself.
    pub path_set: Option<PathSet>,
    /// Its bias as an estimator; `None` for what is evaluated, not estimated.
    pub bias: Option<Bias>,
    /// Device features beyond the baseline, by their Vulkan names.
    pub needs: &'static [&'static str],
    /// Its tests as `file::function`, the file from the repository's root.
    pub tests: &'static [&'static str],
    /// The command that measures it, from the repository's root; `None` while there is none.
    pub experiment: Option<&'static str>,
}

/// A row of something exact that runs everywhere and makes no picture by itself.
const fn part(
    id: &'static str,
    name: &'static str,
    publication: &'static str,
    module: &'static str,
    tests: &'static [&'static str],
) -> Row {
    Row {
        id,
        name,
        publication,
        module,
        path_set: None,
        bias: None,
        needs: &[],
        tests,
        experiment: None,
    }
}

/// As [`part`], for estimators without bias.
const fn unbiased(row: Row) -> Row {
    Row {
        bias: Some(Bias::Unbiased),
        ..row
    }
}

/// All rows, ordered by document and id.
pub fn all() -> &'static [Row] {
    rows::ROWS
}
