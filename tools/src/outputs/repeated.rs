//! Files that are written again and again while a command works.

use super::{Outputs, Planned};
use crate::failure::{Failure, Outcome};

/// Outputs that grow: what a run has found so far, so that one that is cut short leaves it.
#[derive(Debug)]
pub struct Repeated {
    plan: Outputs,
    /// Why they are not where they should be.
    moved: Option<Failure>,
    /// Why the last ones are nowhere.
    lost: Option<Failure>,
}

impl Repeated {
    /// These files.
    pub fn new(plan: Outputs) -> Self {
        Self {
            plan,
            moved: None,
            lost: None,
        }
    }

    /// As [`Outputs::write`]; where the first ones went, the next ones go. A failure does not end the work: [`Repeated::check`] says it.
    pub fn write(&mut self, contents: &[Vec<u8>]) {
        let written = self.plan.write(contents, || None);
        self.lost = None;
        if written.paths.len() < contents.len() {
            self.lost = written.failure;
            return;
        }
        self.plan.files = written.paths.iter().map(|path| Planned::now(path)).collect();
        self.moved = written.failure.or(self.moved.take());
    }

    /// Fails where the last files are not where they should be.
    pub fn check(self) -> Outcome {
        self.lost.or(self.moved).map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Inputs;
    use super::*;

    #[test]
    fn what_has_no_place_grows_in_the_temporary_folder() -> std::result::Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("new/a.json");
        let plan = || Outputs::one(&path, &Inputs::default(), false).map_err(|failure| failure.message);
        let mut grows = Repeated::new(plan()?);
        grows.write(&[b"1".to_vec()]);
        grows.write(&[b"12".to_vec()]);
        assert_eq!(std::fs::read(&path)?, b"12");
        assert!(grows.check().is_ok() && std::fs::read_dir(folder.path().join("new"))?.count() == 1);
        std::fs::remove_dir_all(folder.path().join("new"))?;

        let mut moved = Repeated::new(plan()?);
        std::fs::write(folder.path().join("new"), "a file in place of the folder")?;
        moved.write(&[b"1".to_vec()]);
        let kept = moved.plan.files[0].path.clone();
        moved.write(&[b"12".to_vec()]);
        assert_eq!(
            (&moved.plan.files[0].path, std::fs::read(&kept)?),
            (&kept, b"12".to_vec())
        );
        let hint = moved.check().err().and_then(|failure| failure.hint).unwrap_or_default();
        let inside = kept.parent().ok_or("no folder")?;
        assert!(hint.contains(&inside.display().to_string()), "{hint}");
        std::fs::remove_dir_all(inside)?;
        Ok(())
    }
}
