//! Figures in other pages: blocks that name experiments, between which their lines are written from the results.
//!
//! ```text
//! <!-- results: photon-or-path, absorption -->
//! <!-- end of results -->
//! ```

use std::path::Path;

use clerestory::{Error, Result};

use super::list;
use crate::experiments;

const BEGIN: &str = "<!-- results: ";
const BEGIN_END: &str = " -->";
const END: &str = "<!-- end of results -->";

/// A page with all of its blocks filled; `link` is the way from it to the results.
///
/// # Errors
/// [`Error::Setting`] where a block has no end or names no experiment; as [`findings`](super::findings).
pub fn fill(root: &Path, text: &str, link: &str) -> Result<String> {
    let mut filled = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(BEGIN) {
        let unsound = |cause: &str| Error::setting("block of results", rest[at..].lines().next().unwrap_or(""), cause);
        let after = &rest[at + BEGIN.len()..];
        let (names, after) = after
            .split_once(BEGIN_END)
            .ok_or_else(|| unsound("has no end of its mark"))?;
        let end = after.find(END).ok_or_else(|| unsound("has no end"))?;
        filled += &rest[..at];
        filled += &format!("{BEGIN}{names}{BEGIN_END}\n");
        for name in names.split(',').map(str::trim) {
            filled += &(list::line(root, &experiments::find(name)?, link)? + "\n");
        }
        filled += END;
        rest = &after[end + END.len()..];
    }
    Ok(filled + rest)
}

#[cfg(test)]
mod tests {
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
}
