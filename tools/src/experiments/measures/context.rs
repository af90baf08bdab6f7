//! What a measure is given.

use std::path::{Path, PathBuf};

use clerestory::film::png::{self, Rgb8};
use clerestory::gpu::Gpu;
use clerestory::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::experiments::findings::Sheet;
use crate::experiments::kept_rows::KeptRows;
use crate::experiments::watch::Watch;

/// Turns of a smoke run.
const SMOKE_TURNS: usize = 2;

/// What a measure is given.
pub struct Context<'a> {
    /// Few inputs, for a quick look.
    pub smoke: bool,
    /// Addresses of scenes to measure in place of a measure's own, for those that measure scenes; none for its own.
    pub scenes: &'a [String],
    /// Opens the device, for measures that need one.
    pub gpu: &'a dyn Fn() -> Result<Gpu>,
    /// For files beside the tables ([`Context::file`]); it may not be there yet.
    pub folder: &'a Path,
    /// Sees the progress of measures that take long. A measure that is stopped gives the rows that it has.
    pub watch: &'a dyn Watch,
}

impl Context<'_> {
    /// Where a file beside the tables goes; its folder is made.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn file(&self, name: &str) -> Result<PathBuf> {
        std::fs::create_dir_all(self.folder).map_err(|error| Error::io(self.folder, error))?;
        Ok(self.folder.join(name))
    }

    /// Writes a picture beside the tables. What fails is only said, since it must not cost the rows.
    pub fn picture(&self, name: &str, shown: &Rgb8) {
        if let Err(cause) = self.file(name).and_then(|path| png::write(path, shown)) {
            self.watch.note(&format!("a picture is left out: {cause}"));
        }
    }

    /// One of two: in full, or of a smoke run.
    pub fn pick<T>(&self, full: T, smoke: T) -> T {
        if self.smoke { smoke } else { full }
    }

    /// All of them, or the first so many in a smoke run.
    pub fn first<'t, T>(&self, all: &'t [T], smoke: usize) -> &'t [T] {
        self.pick(all, &all[..smoke.min(all.len())])
    }

    /// A row for each variant of each case, until it is stopped; the watch is told of each case.
    ///
    /// # Errors
    /// The first of a cell.
    pub fn grid<C: ToString, V, R>(
        &self,
        cases: &[C],
        variants: &[V],
        mut cell: impl FnMut(&C, &V) -> Result<R>,
    ) -> Result<Vec<R>> {
        self.each(cases, C::to_string, |case| {
            variants.iter().map(|variant| cell(case, variant)).collect()
        })
    }

    /// Rows of each case, until it is stopped; the watch is told of each by its name.
    ///
    /// # Errors
    /// The first of a case.
    pub fn each<C, R>(
        &self,
        cases: &[C],
        name: impl Fn(&C) -> String,
        mut rows: impl FnMut(&C) -> Result<Vec<R>>,
    ) -> Result<Vec<R>> {
        let mut all = Vec::new();
        for (done, case) in cases.iter().enumerate() {
            if self.watch.stopped() {
                break;
            }
            self.watch.begin(&name(case), done, cases.len());
            all.extend(rows(case)?);
        }
        Ok(all)
    }

    /// [`Context::each`] for cases that take minutes on a device: rows of each are kept in the folder as soon as they are there, and a run that follows one that was
    /// stopped begins with the first case that has none. Smoke runs keep nothing.
    ///
    /// # Errors
    /// The first of a case; [`Error::Io`].
    pub fn each_kept<C, R: Sheet + Serialize + DeserializeOwned>(
        &self,
        gpu: &Gpu,
        cases: &[C],
        name: impl Fn(&C) -> String,
        mut rows: impl FnMut(&C) -> Result<Vec<R>>,
    ) -> Result<Vec<R>> {
        if self.smoke {
            return self.each(cases, name, rows);
        }
        let device = format!("{}, {}", gpu.caps().device, gpu.caps().driver);
        let mut kept = KeptRows::open(self.folder, &device, R::TITLE)?;
        let placed: Vec<(usize, String, &C)> = cases
            .iter()
            .enumerate()
            .map(|(i, case)| (i, name(case), case))
            .collect();
        let name = |(_, name, _): &(usize, String, &C)| name.clone();
        self.each(&placed, name, |(place, name, case)| {
            if let Some(known) = kept.get(*place, name) {
                return Ok(known);
            }
            let measured = rows(case)?;
            // A case that was stopped has no rows, or not all of them.
            if self.watch.stopped() {
                return Ok(measured);
            }
            kept.add(*place, name, &measured)
        })
    }

    /// Values of so many contenders that take turns: after a turn that warms up, `turns` turns (two in a smoke run), each begun by the next
    /// contender, so that no place in the turn is anybody's. By contender, in the order of turns.
    ///
    /// # Errors
    /// The first of `once`.
    pub fn in_turns<M>(
        &self,
        turns: usize,
        contenders: usize,
        mut once: impl FnMut(usize) -> Result<M>,
    ) -> Result<Vec<Vec<M>>> {
        let turns = self.pick(turns, SMOKE_TURNS);
        let mut all: Vec<Vec<M>> = (0..contenders).map(|_| Vec::with_capacity(turns)).collect();
        for turn in 0..=turns {
            for place in 0..contenders {
                let contender = (turn + place) % contenders;
                let value = once(contender)?;
                if turn > 0 {
                    all[contender].push(value);
                }
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::watch::Unwatched;

    fn context<'a>(smoke: bool) -> Context<'a> {
        Context {
            smoke,
            scenes: &[],
            gpu: &|| Err(Error::setting("device", "none", "is not to be opened")),
            folder: Path::new(""),
            watch: &Unwatched,
        }
    }

    #[test]
    fn contenders_take_turns_and_each_begins_one() {
        let mut order = Vec::new();
        let mut clock = 0;
        let all = context(false).in_turns(3, 3, |contender| {
            order.push(contender);
            clock += 1;
            Ok(clock)
        });
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 1, 2]);
        // The first turn warms up.
        assert_eq!(all.unwrap(), [vec![6, 8, 10], vec![4, 9, 11], vec![5, 7, 12]]);
        assert_eq!(context(true).in_turns(9, 1, Ok).unwrap(), [vec![0, 0]]);
    }

    #[test]
    fn cases_have_their_rows_in_order() {
        let rows = context(false).each(&[1, 2], i32::to_string, |case| Ok(vec![*case; 2]));
        assert_eq!(rows.unwrap(), [1, 1, 2, 2]);
        let products = context(true).grid(&[1, 2], &[10, 20], |a, b| Ok(a * b));
        assert_eq!(products.unwrap(), [10, 20, 20, 40]);
        assert_eq!(context(true).first(&[1, 2, 3], 2), [1, 2]);
        assert_eq!(context(false).first(&[1, 2, 3], 2), [1, 2, 3]);
    }
}
