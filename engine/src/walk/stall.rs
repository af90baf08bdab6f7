//! Waves that stand: rays that a quota stops again and again without a bounce being finished.

use crate::{Error, Result};

/// Loop iterations that a ray may take in all before a walker gives up, since no index of 2²⁸ triangles has as many: submissions in a row
/// that end without finishing a bounce advance every stopped ray by a whole quota each.
const RAY_ITERATIONS_MAX: u64 = 1 << 31;

/// Counts what rays have taken since a bounce was finished last.
pub(super) struct StallWatch {
    quota: u64,
    iterations: u64,
}

impl StallWatch {
    pub fn new(quota: u32) -> Self {
        Self {
            quota: u64::from(quota),
            iterations: 0,
        }
    }

    /// After each submission: whether it went on with stopped rays and finished no bounce.
    ///
    /// # Errors
    /// [`Error::Overflow`] should the index have rays that never end.
    pub fn submitted(&mut self, stands: bool) -> Result<()> {
        self.iterations = if stands { self.iterations + self.quota } else { 0 };
        if self.iterations <= RAY_ITERATIONS_MAX {
            return Ok(());
        }
        Err(Error::Overflow {
            kernel: "walk/extend".into(),
            what: "iterations of a ray".into(),
            needed: self.iterations,
            capacity: RAY_ITERATIONS_MAX,
            instead: "rebuild the index".into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_that_never_end_are_given_up_and_those_that_get_on_are_not() {
        let mut watch = StallWatch::new(1 << 30);
        for stands in [true, true, false, true, true] {
            watch.submitted(stands).expect("below the limit");
        }
        let error = watch.submitted(true).expect_err("three quotas in a row").to_string();
        assert!(error.contains("iterations of a ray"), "{error}");
    }
}
