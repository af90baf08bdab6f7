//! Measures: numbers that experiments take of functions and kernels, with the error of each before its speed; by topic, beside what they
//! share: a clock, sizes of errors, pictures and numbers of twice the precision.

mod clock;
mod device;
mod errors;
mod kd;
mod maps;
mod media;
mod photon_maps;
mod photons;
mod pictures;
mod preview;
mod rays;
mod rendering;
mod surfaces;
mod wide;

use std::path::{Path, PathBuf};

use clerestory::gpu::Gpu;
use clerestory::{Error, Result};

use super::table::Table;
use super::watch::Watch;

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
}

/// A measure by name.
pub struct Measure {
    /// The name that experiments ask for.
    pub name: &'static str,
    /// Whether it opens the device.
    pub needs_device: bool,
    /// Whether it measures scenes that it is told ([`Context::scenes`]).
    pub takes_scenes: bool,
    /// Takes the measure. Errors and counts are deterministic; times are not.
    pub run: fn(&Context<'_>) -> Result<Vec<Table>>,
}

const fn on_host(name: &'static str, run: fn(&Context<'_>) -> Result<Vec<Table>>) -> Measure {
    Measure {
        name,
        needs_device: false,
        takes_scenes: false,
        run,
    }
}

const fn on_device(name: &'static str, run: fn(&Context<'_>) -> Result<Vec<Table>>) -> Measure {
    Measure {
        name,
        needs_device: true,
        takes_scenes: false,
        run,
    }
}

impl Measure {
    const fn of_any_scenes(mut self) -> Self {
        self.takes_scenes = true;
        self
    }
}

/// All measures, each called as its experiment and, with underscores, its module in the folder of its topic.
pub const MEASURES: &[Measure] = &[
    on_device("absorption", media::absorption::measure),
    on_device("alpha", surfaces::alpha::measure),
    on_device("automatic-choice", rendering::automatic_choice::measure),
    on_device("barriers", device::barriers::measure),
    on_device("build-stages", rays::build_stages::measure),
    on_host("compact-map", photon_maps::compact_map::measure),
    on_host("compact-rays", photon_maps::compact_rays::measure),
    on_host("coupled-reflection", surfaces::coupled_reflection::measure),
    on_device("device-model", device::device_model::measure),
    on_host("free-flight", media::free_flight::measure),
    on_device("kd-caches", kd::kd_caches::measure).of_any_scenes(),
    on_device("kd-heuristics", kd::kd_heuristics::measure).of_any_scenes(),
    on_device("kd-or-bvh", kd::kd_or_bvh::measure).of_any_scenes(),
    on_host("kd-probability", kd::kd_probability::measure),
    on_device("kd-rays", kd::kd_rays::measure).of_any_scenes(),
    on_device("kd-threads", kd::kd_threads::measure).of_any_scenes(),
    on_device("kd-traversal", kd::kd_traversal::measure).of_any_scenes(),
    on_host("leaf-sizes", photon_maps::leaf_sizes::measure),
    on_device("live-maps", preview::live_maps::measure).of_any_scenes(),
    on_host("map-borders", maps::map_borders::measure),
    on_host("map-choice", maps::map_choice::measure),
    on_device("map-construction", photon_maps::map_construction::measure),
    on_host("map-density", maps::map_density::measure),
    on_host("map-error", maps::map_error::measure),
    on_device("map-glossiness", maps::map_glossiness::measure),
    on_host("map-levels", maps::map_levels::measure),
    on_host("map-quality", photon_maps::map_quality::measure),
    on_device("map-rendering", maps::map_rendering::measure),
    on_host("merge-example", photon_maps::merge_example::measure),
    on_device("mitsuba", rendering::mitsuba::measure),
    on_host("multiple-scattering", surfaces::multiple_scattering::measure),
    on_device("path-sets", rendering::path_sets::measure),
    on_device("persistent-threads", rays::persistent_threads::measure),
    on_host("phase-functions", media::phase_functions::measure),
    on_device("photon-frame", photons::photon_frame::measure),
    on_device("photon-peers", photons::photon_peers::measure),
    on_device("photon-queues", photons::photon_queues::measure),
    on_device("photon-statistics", photons::photon_statistics::measure),
    on_host("picture-formats", rendering::picture_formats::measure),
    on_device("preview-picture", preview::preview_picture::measure),
    on_host("ray-offsets", rays::ray_offsets::measure),
    on_host("sample-sums", rendering::sample_sums::measure),
    on_device("scene-profile", rendering::scene_profile::measure),
    on_device("shadow-maps", preview::shadow_maps::measure).of_any_scenes(),
    on_host("shading-normals", surfaces::shading_normals::measure),
    on_host("sphere-tests", rays::sphere_tests::measure),
    on_host("tangents", surfaces::tangents::measure),
    on_host("tree-quality", rays::tree_quality::measure),
    on_host("triangle-tests", rays::triangle_tests::measure),
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
    use super::super::watch::Unwatched;
    use super::*;

    fn check(measure: &Measure, tables: &[Table]) {
        assert!(!tables.is_empty(), "{}", measure.name);
        for table in tables {
            assert_eq!(table.fault(), None, "{}: {}", measure.name, table.title);
        }
    }

    fn run_all(needs_device: bool, gpu: &dyn Fn() -> Result<Gpu>) {
        let folder = tempfile::tempdir().unwrap();
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu,
            folder: folder.path(),
            watch: &Unwatched,
        };
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
    fn experiment_measure_and_module_have_one_name() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/experiments/measures");
        for measure in MEASURES {
            let experiment = crate::experiments::find(measure.name).unwrap();
            assert_eq!(experiment.measure.as_deref(), Some(measure.name));
            let module = format!("{}.rs", measure.name.replace('-', "_"));
            let topics = std::fs::read_dir(&folder).unwrap();
            let mut places = topics.map(|topic| topic.unwrap().path().join(&module));
            assert!(places.any(|place| place.is_file()), "no {module}");
        }
        for name in crate::experiments::names() {
            if let Some(measure) = crate::experiments::find(name).unwrap().measure {
                assert_eq!(measure, name);
            }
        }
    }
}
