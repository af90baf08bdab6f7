//! The catalogue: one row for every system that the engine carries, so that a reader finds where a publication lives in the code.
//!
//! Ids with the prefixes `BG-`, `DP-`, `OEM-`, `PM-` and `MET-` are those of the five research documents that the engine follows (visibility
//! and media, photon mapping, metals and reflections); where two documents describe one thing, their rows point at one implementation. Ids with
//! the prefix `CL-` are the engine's own, for published methods outside of those documents. Guarantee: the tests below check that the
//! module, every test and every row's experiment exist, and that `docs/catalogue.md` is [`markdown`].

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
    /// The command that measures it, from the repository's root.
    pub experiment: &'static str,
}

/// A row of something exact that runs everywhere and makes no picture by itself; [`measured`] adds its experiment.
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
        experiment: "",
    }
}

/// As [`part`], for estimators without bias.
const fn unbiased(row: Row) -> Row {
    Row {
        bias: Some(Bias::Unbiased),
        ..row
    }
}

/// As [`part`], with the command that measures it.
const fn measured(command: &'static str, row: Row) -> Row {
    Row {
        experiment: command,
        ..row
    }
}

/// The catalogue as a page of Markdown.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Catalogue\n\nWhere each publication lives in the code. Written by `clerestory list --markdown`; `clerestory list ID` also names \
         the tests of a system.\n\n| id | system | publication | module | bias | path set | needs | tests | measured by |\n\
         |---|---|---|---|---|---|---|---:|---|\n",
    );
    for row in all() {
        let bias = match row.bias {
            None => "–".to_owned(),
            Some(Bias::Unbiased) => "unbiased".to_owned(),
            Some(Bias::Consistent(cause)) => format!("consistent: {cause}"),
            Some(Bias::Biased(cause)) => format!("biased: {cause}"),
        };
        let path_set = row.path_set.map_or("–".to_owned(), |set| set.to_string());
        let needs = if row.needs.is_empty() {
            "baseline".to_owned()
        } else {
            row.needs.join(", ")
        };
        page += &format!(
            "| {} | {} | {} | [{}](../{}) | {bias} | {path_set} | {needs} | {} | `{}` |\n",
            row.id,
            row.name,
            row.publication,
            row.module.trim_start_matches("engine/src/"),
            row.module,
            row.tests.len(),
            row.experiment,
        );
    }
    page
}

/// All rows, ordered by document and id.
pub fn all() -> &'static [Row] {
    &rows::ROWS
}
