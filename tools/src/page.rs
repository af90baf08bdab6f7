//! Pages of results whose measured parts are replaced by the commands that measure them, while all other text stays.

use std::path::Path;

use clerestory::input::read_text;
use clerestory::{Error, Result};

/// Most bytes of a page.
const MOST_BYTES: u64 = 1 << 26;

/// A measured part of a page, between two marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block<'a> {
    /// What it holds; unique within a page.
    pub name: &'a str,
    /// The command that writes it.
    pub command: &'a str,
}

impl Block<'_> {
    /// The page with what stands between the marks replaced, or with it appended with a heading; a page that is not there begins.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn in_page(&self, path: &Path, text: &str) -> Result<String> {
        let old = match read_text(path, MOST_BYTES) {
            Ok(old) => old,
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                "# Results\n\nMeasured, not promised: every table says on what machine and driver, and how to repeat it.\n"
                    .to_owned()
            }
            Err(error) => return Err(error),
        };
        let begin_mark = format!("<!-- begin: {}, written by ", self.name);
        let end_mark = format!("<!-- end: {} -->", self.name);
        let marked = format!("{begin_mark}{} -->\n\n{}\n\n{end_mark}", self.command, text.trim_end());
        // Found by the name alone: what is measured by another command since is still the same part.
        let begin = old.find(&begin_mark);
        let end = begin.and_then(|begin| Some(begin + old[begin..].find(&end_mark)? + end_mark.len()));
        Ok(match (begin, end) {
            (Some(begin), Some(end)) => format!("{}{marked}{}", &old[..begin], &old[end..]),
            _ => {
                let (first, rest) = self.name.split_at(1);
                let heading = format!("{}{rest}: `{}`", first.to_uppercase(), self.command);
                format!("{}\n\n## {heading}\n\n{marked}\n", old.trim_end())
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_marked_part_is_replaced() -> std::result::Result<(), Box<dyn std::error::Error>> {
        let block = |name| Block { name, command: "test" };
        let write =
            |block: Block<'_>, path: &Path, text: &str| -> std::result::Result<(), Box<dyn std::error::Error>> {
                Ok(std::fs::write(path, block.in_page(path, text)?)?)
            };
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("results.md");
        write(block("one"), &path, "first\n")?;
        let made = std::fs::read_to_string(&path)?;
        assert!(made.starts_with("# Results") && made.contains("## One: `test`") && made.contains("first"));
        std::fs::write(&path, format!("before\n{made}after\n"))?;
        write(block("two"), &path, "other\n")?;
        write(block("one"), &path, "second\n")?;
        let text = std::fs::read_to_string(&path)?;
        assert!(text.starts_with("before\n") && text.contains("after\n"), "{text}");
        assert!(text.contains("second") && text.contains("other"), "{text}");
        assert!(
            !text.contains("first") && text.matches("begin: one").count() == 1,
            "{text}"
        );
        let by_another = Block {
            name: "one",
            command: "test --other",
        };
        write(by_another, &path, "third\n")?;
        let text = std::fs::read_to_string(&path)?;
        assert!(
            !text.contains("second") && text.matches("begin: one").count() == 1 && text.contains("third"),
            "{text}"
        );
        Ok(())
    }
}
