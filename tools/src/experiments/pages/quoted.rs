//! Figures in other pages: blocks that name experiments, between which their lines are written from the results, and blocks that name an experiment and columns of one of its tables.
//!
//! ```text
//! <!-- results: photon-or-path, absorption -->
//! <!-- end of results -->
//! <!-- table: fresnel-cost | form | time on the device (ns) -->
//! <!-- end of table -->
//! ```

use std::path::Path;

use clerestory::{Error, Result};

use super::list;
use super::stored::{Stored, findings};
use crate::experiments;

const BEGIN_END: &str = " -->";

/// A kind of block: what it is called, how its mark begins, and its end.
struct Kind {
    called: &'static str,
    begin: &'static str,
    end: &'static str,
    /// What stands in it, by the results' folder, its mark and the way to the results.
    fill: fn(&Path, &str, &str) -> Result<String>,
}

const RESULTS: Kind = Kind {
    called: "block of results",
    begin: "<!-- results: ",
    end: "<!-- end of results -->",
    fill: |root, names, link| {
        let mut lines = String::new();
        for name in names.split(',').map(str::trim) {
            lines += &(list::line(root, &experiments::find(name)?, link)? + "\n");
        }
        Ok(lines)
    },
};

const TABLE: Kind = Kind {
    called: "block of a table",
    begin: "<!-- table: ",
    end: "<!-- end of table -->",
    fill: |root, words, link| {
        let mut words = words.split('|').map(str::trim);
        let experiment = experiments::find(words.next().unwrap_or_default())?;
        let heads: Vec<&str> = words.collect();
        let stored = Stored::read(&root.join(&experiment.name))?;
        if stored.is_none() {
            return Ok(list::line(root, &experiment, link)? + "\n");
        }
        let found = findings(&experiment, stored.as_ref())?;
        let table = found.tables.iter().find_map(|table| table.columns(&heads));
        let table = table.filter(|_| !heads.is_empty()).ok_or_else(|| {
            let value = format!("{}: {}", experiment.name, heads.join(" | "));
            Error::setting("block of a table", value, "are no columns of one of its tables")
        })?;
        // Markdown takes a table for text where a comment stands right before it.
        Ok(format!("\n{}\n", table.grid()))
    },
};

/// A page with all of its blocks filled; `link` is the way from it to the results.
///
/// # Errors
/// [`Error::Setting`] where a block has no end, names no experiment, or columns that there are not; as [`findings`].
pub fn fill(root: &Path, text: &str, link: &str) -> Result<String> {
    fill_all(&TABLE, root, &fill_all(&RESULTS, root, text, link)?, link)
}

fn fill_all(kind: &Kind, root: &Path, text: &str, link: &str) -> Result<String> {
    let mut filled = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(kind.begin) {
        let unsound = |cause: &str| Error::setting(kind.called, rest[at..].lines().next().unwrap_or(""), cause);
        let after = &rest[at + kind.begin.len()..];
        let (words, after) = after
            .split_once(BEGIN_END)
            .ok_or_else(|| unsound("has no end of its mark"))?;
        let end = after.find(kind.end).ok_or_else(|| unsound("has no end"))?;
        filled += &rest[..at];
        filled += &format!("{}{words}{BEGIN_END}\n", kind.begin);
        filled += &(kind.fill)(root, words, link)?;
        filled += kind.end;
        rest = &after[end + kind.end.len()..];
    }
    Ok(filled + rest)
}

#[cfg(test)]
mod tests {
    use super::super::stored::{FILE, Run};
    use super::*;

    #[test]
    fn blocks_are_filled_again_and_again() {
        let root = Path::new("no such folder");
        let text = "a\n<!-- results: absorption, roulette -->\nold\n<!-- end of results -->\nb\n";
        let filled = fill(root, text, "results").unwrap();
        assert!(
            filled.starts_with("a\n<!-- results: absorption, roulette -->\n- ["),
            "{filled}"
        );
        assert!(filled.contains("](results/roulette/README.md): not run\n"), "{filled}");
        assert!(
            filled.ends_with("<!-- end of results -->\nb\n") && !filled.contains("old"),
            "{filled}"
        );
        assert_eq!(fill(root, &filled, "results").unwrap(), filled);
        assert!(fill(root, "<!-- results: absorption -->", "results").is_err());
        assert!(fill(root, "<!-- results: none such -->\n<!-- end of results -->", "results").is_err());
    }

    #[test]
    fn tables_are_of_the_columns_that_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let block =
            |columns: &str| format!("a\n<!-- table: fresnel-cost | {columns} -->\nold\n<!-- end of table -->\nb\n");
        let not_run = fill(root, &block("form"), "results").unwrap();
        assert!(
            not_run.contains("](results/fresnel-cost/README.md): not run\n"),
            "{not_run}"
        );
        let row = |form: &str, error: f64| {
            serde_json::json!({
                "form": form, "time": [2.0, 2.0], "share": [50.0, 50.0], "published": null, "error": error, "over_faster": null,
            })
        };
        let stored = Stored {
            run: Run::begin("clerestory report fresnel-cost".into()),
            found: serde_json::json!([row("exact", 0.0), row("rescaled-f0", 12.5)]),
        };
        let experiment = root.join("fresnel-cost");
        std::fs::create_dir(&experiment).unwrap();
        std::fs::write(experiment.join(FILE), stored.text().unwrap()).unwrap();
        let error = "greatest error for the tabulated metals (%)";
        let filled = fill(root, &block(&format!("{error} | form")), "results").unwrap();
        let heads = format!(" -->\n\n| {error} | form |\n|---");
        assert!(
            filled.starts_with("a\n<!-- table: fresnel-cost") && filled.contains(&heads),
            "{filled}"
        );
        assert!(
            filled.contains("| 12.50 | rescaled-f0 |\n") && !filled.contains("old"),
            "{filled}"
        );
        assert!(filled.ends_with("|\n\n<!-- end of table -->\nb\n"), "{filled}");
        assert_eq!(fill(root, &filled, "results").unwrap(), filled);
        for wrong in ["form | no such column", ""] {
            let error = fill(root, &block(wrong), "results").unwrap_err().to_string();
            assert!(error.contains("columns"), "{wrong}: {error}");
        }
        assert!(fill(root, "<!-- table: fresnel-cost | form -->", "results").is_err());
    }
}
