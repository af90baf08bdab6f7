//! A page of results of which a command writes a part.

use std::path::{Path, PathBuf};

use clerestory_tools::page::Block;

use super::{Inputs, New, Outputs, Overwriting, Written, check_old, probe, refuse_input};
use crate::failure::{Failure, Outcome};
use crate::{output, pictures};

/// A page whose measured part will be replaced while all else stays: a Markdown file that the command reads and writes.
#[derive(Debug)]
pub struct OutputPage(PathBuf);

impl OutputPage {
    /// Checks it, and makes it an input, since the rest of it is read: files that are planned after it cannot take its place.
    pub fn plan(page: Option<&Path>, inputs: &mut Inputs, overwriting: Overwriting) -> Outcome<Option<Self>> {
        let Some(page) = page else {
            return Ok(None);
        };
        refuse_input(page, inputs)?;
        if pictures::extension(page) != "md" {
            return Err(Failure::usage(format!(
                "--page {}: pages are .md files",
                page.display()
            )));
        }
        // Whoever wrote it: only the marked part is replaced.
        check_old(page, overwriting.overwrite, || Ok(true))?;
        probe(page)?;
        inputs.add_place(page);
        Ok(Some(Self(page.to_owned())))
    }

    /// Writes the part into the page as it is now, and says so.
    pub fn write(&self, block: Block<'_>, text: &str) -> Written {
        let page = block.in_page(&self.0, text);
        let written = match &page {
            Ok(page) => {
                let overwriting = Outputs {
                    files: Vec::new(),
                    overwrite: true,
                };
                let file = New {
                    path: &self.0,
                    bytes: page.as_bytes(),
                };
                overwriting.write_files(&[file], || None)
            }
            Err(cause) => {
                let file = New {
                    path: &self.0,
                    bytes: text.as_bytes(),
                };
                super::write_aside(&[file], cause)
            }
        };
        output::note(&format!("wrote {}", written.names()));
        written
    }
}
