//! Measures: numbers that experiments take of functions and kernels, with the error of each before its speed.

mod absorption;
mod alpha;
mod automatic_choice;
mod barriers;
mod clock;
mod coupled;
mod energy;
mod errors;
mod formats;
mod inputs;
mod multiscatter;
mod offset;
mod path_sets;
mod phase;
mod pictures;
mod profile;
mod shading_normals;
mod sphere;
mod sum;
mod tangent;
mod triangle;
mod wide;

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
    /// Whether it opens the device.
    pub needs_device: bool,
    /// Takes the measure. Errors and counts are deterministic; times are not.
    pub run: fn(&Context<'_>) -> Result<Vec<Table>>,
}

const fn on_host(name: &'static str, run: fn(&Context<'_>) -> Result<Vec<Table>>) -> Measure {
    Measure {
        name,
        needs_device: false,
        run,
    }
}

const fn on_device(name: &'static str, run: fn(&Context<'_>) -> Result<Vec<Table>>) -> Measure {
    Measure {
        name,
        needs_device: true,
        run,
    }
}

/// All measures.
pub const MEASURES: &[Measure] = &[
    on_device("absorption", absorption::measure),
    on_device("alpha", alpha::measure),
    on_device("automatic-choice", automatic_choice::measure),
    on_device("barriers", barriers::measure),
    on_host("coupled reflection", coupled::measure),
    on_host("multiple scattering", multiscatter::measure),
    on_host("offsets", offset::measure),
    on_device("path sets", path_sets::measure),
    on_host("phase functions", phase::measure),
    on_host("picture formats", formats::measure),
    on_device("profile", profile::measure),
    on_host("shading normals", shading_normals::measure),
    on_host("spheres", sphere::measure),
    on_host("sums", sum::measure),
    on_host("tangents", tangent::measure),
    on_host("triangles", triangle::measure),
];

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

#[cfg(test)]
mod tests {
    use super::*;

    fn check(measure: &Measure, tables: &[Table]) {
        assert!(!tables.is_empty(), "{}", measure.name);
        for table in tables {
            assert_eq!(table.fault(), None, "{}: {}", measure.name, table.title);
        }
    }

    fn run_all(needs_device: bool, gpu: &dyn Fn() -> Result<Gpu>) {
        let context = Context { smoke: true, gpu };
        for measure in MEASURES.iter().filter(|measure| measure.needs_device == needs_device) {
            match (measure.run)(&context) {
                Ok(tables) => check(measure, &tables),
                Err(error) => panic!("{}: {error}", measure.name),
            }
        }
    }

    #[test]
    fn measures_of_functions_give_sound_tables_without_a_device() {
        run_all(false, &|| Err(Error::setting("device", "none", "is not to be opened")));
    }

    #[test]
    fn measures_of_kernels_give_sound_tables() {
        run_all(true, &|| Gpu::headless(&clerestory::gpu::GpuOptions::default()));
    }

    #[test]
    fn every_measure_has_an_experiment() {
        for measure in MEASURES {
            let of = |name: &str| {
                crate::experiments::find(name).is_ok_and(|found| found.measure.as_deref() == Some(measure.name))
            };
            assert!(crate::experiments::names().any(of), "{}", measure.name);
        }
    }
}
