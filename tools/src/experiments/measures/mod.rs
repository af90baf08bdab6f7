//! Measures: numbers that experiments take of functions and kernels, with the error of each before its speed.

use clerestory::gpu::Gpu;
use clerestory::{Error, Result};

use super::table::Table;

/// What a measure is given.
pub struct Context<'a> {
    /// Few inputs, for a quick look.
    pub smoke: bool,
    /// Opens the device, for measures that need one.
    pub gpu: &'a dyn Fn() -> Result<Gpu>,
}

/// A measure by name.
pub struct Measure {
    /// The name that experiments ask for.
    pub name: &'static str,
    /// Takes the measure. Errors and counts are deterministic; times are not.
    pub run: fn(&Context<'_>) -> Result<Vec<Table>>,
}

/// All measures.
pub const MEASURES: &[Measure] = &[];

/// The measure of that name.
///
/// # Errors
/// [`Error::Setting`] when there is none.
pub fn find(name: &str) -> Result<&'static Measure> {
    MEASURES.iter().find(|measure| measure.name == name).ok_or_else(|| {
        let known: Vec<_> = MEASURES.iter().map(|measure| measure.name).collect();
        Error::setting("measure", name, format!("is not known; there is: {}", known.join(", ")))
    })
}
