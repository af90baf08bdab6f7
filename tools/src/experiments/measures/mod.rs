//! Measures: numbers that experiments take of functions and kernels, with the error of each before its speed; by topic, beside what they
//! share: a clock, sizes of errors, pictures and numbers of twice the precision.

mod clock;
mod context;
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

use clerestory::{Error, Result};

pub use self::context::Context;
use super::findings::{self, Findings, Study};

/// A measure by name.
pub struct Measure {
    /// The name that experiments ask for.
    pub name: &'static str,
    /// Whether it opens the device.
    pub needs_device: bool,
    /// Whether it measures scenes that it is told ([`Context::scenes`]).
    pub takes_scenes: bool,
    /// Takes the measure. Errors and counts are deterministic; times are not.
    pub run: fn(&Context<'_>) -> Result<Run>,
    /// What it says where nothing was run: its criteria.
    pub declared: fn() -> Findings,
}

/// What a measure has found.
#[derive(Debug)]
pub struct Run {
    /// Its rows as JSON; `None` of a measure that keeps tables alone.
    pub rows: Option<String>,
    /// What they say, as they are read back: text may cost a number its last bit, and a verdict must not depend on when it was made.
    pub findings: Findings,
}

/// A measure of rows.
const fn rows<S: Study>(name: &'static str, needs_device: bool) -> Measure {
    Measure {
        name,
        needs_device,
        takes_scenes: false,
        run: |context| {
            let rows = findings::run::<S>(context)?;
            Ok(Run {
                findings: findings::read::<S>(&rows)?,
                rows: Some(rows),
            })
        },
        declared: || S::default().findings(),
    }
}

impl Measure {
    const fn of_any_scenes(mut self) -> Self {
        self.takes_scenes = true;
        self
    }
}

/// A [`Measure`] of one of the two kinds: a module has rows of its type `Found`, or a function `measure` that gives tables.
macro_rules! measure {
    (rows $name:literal, $needs_device:expr, $topic:ident::$module:ident) => {
        rows::<$topic::$module::Found>($name, $needs_device)
    };
    (tables $name:literal, $needs_device:expr, $topic:ident::$module:ident) => {
        Measure {
            name: $name,
            needs_device: $needs_device,
            takes_scenes: false,
            run: |context| {
                let findings = $topic::$module::measure(context)?.into();
                Ok(Run { rows: None, findings })
            },
            declared: Findings::default,
        }
    };
}

/// Whether a measure opens the device, by a word.
macro_rules! needs_device {
    (on_host) => {
        false
    };
    (on_device) => {
        true
    };
}

/// [`MEASURES`], and a test of each measure's quick form, from a line a measure: `where it runs, what it keeps, "name" topic::module`.
macro_rules! measures {
    ($($place:ident $kind:ident $name:literal $topic:ident::$module:ident $(.$also:ident())?;)*) => {
        /// All measures, each called as its experiment and, with underscores, its module in the folder of its topic.
        pub const MEASURES: &[Measure] = &[$(measure!($kind $name, needs_device!($place), $topic::$module)$(.$also())?),*];

        /// A test a measure, so that each has its own time and its own failure.
        #[cfg(test)]
        mod gives_sound_tables {
            $(
                #[test]
                fn $module() {
                    super::tests::check_quick_form($name);
                }
            )*
        }
    };
}

measures! {
    on_device rows "absorption" media::absorption;
    on_device rows "alpha" surfaces::alpha;
    on_device tables "automatic-choice" rendering::automatic_choice;
    on_device tables "barriers" device::barriers;
    on_device tables "build-stages" rays::build_stages;
    on_host tables "compact-map" photon_maps::compact_map;
    on_host tables "compact-rays" photon_maps::compact_rays;
    on_host rows "coupled-reflection" surfaces::coupled_reflection;
    on_device tables "device-model" device::device_model;
    on_host tables "free-flight" media::free_flight;
    on_device tables "kd-caches" kd::kd_caches.of_any_scenes();
    on_device tables "kd-heuristics" kd::kd_heuristics.of_any_scenes();
    on_device tables "kd-or-bvh" kd::kd_or_bvh.of_any_scenes();
    on_host tables "kd-probability" kd::kd_probability;
    on_device tables "kd-rays" kd::kd_rays.of_any_scenes();
    on_device tables "kd-threads" kd::kd_threads.of_any_scenes();
    on_device tables "kd-traversal" kd::kd_traversal.of_any_scenes();
    on_host tables "leaf-sizes" photon_maps::leaf_sizes;
    on_device tables "live-map-pictures" preview::live_map_pictures;
    on_device tables "live-maps" preview::live_maps.of_any_scenes();
    on_host tables "map-borders" maps::map_borders;
    on_host tables "map-choice" maps::map_choice;
    on_device tables "map-construction" photon_maps::map_construction;
    on_host tables "map-density" maps::map_density;
    on_host tables "map-error" maps::map_error;
    on_device tables "map-glossiness" maps::map_glossiness;
    on_host tables "map-levels" maps::map_levels;
    on_host tables "map-quality" photon_maps::map_quality;
    on_device tables "map-rendering" maps::map_rendering;
    on_host rows "merge-example" photon_maps::merge_example;
    on_device tables "mitsuba" rendering::mitsuba;
    on_host rows "multiple-scattering" surfaces::multiple_scattering;
    on_device tables "path-sets" rendering::path_sets;
    on_device tables "persistent-threads" rays::persistent_threads;
    on_host rows "phase-functions" media::phase_functions;
    on_device tables "photon-frame" photons::photon_frame;
    on_device tables "photon-peers" photons::photon_peers;
    on_device tables "photon-queues" photons::photon_queues;
    on_device tables "photon-statistics" photons::photon_statistics;
    on_host tables "picture-formats" rendering::picture_formats;
    on_host rows "ray-offsets" rays::ray_offsets;
    on_host tables "sample-sums" rendering::sample_sums;
    on_device tables "scene-profile" rendering::scene_profile;
    on_device tables "shadow-maps" preview::shadow_maps.of_any_scenes();
    on_host rows "shading-normals" surfaces::shading_normals;
    on_host tables "sphere-tests" rays::sphere_tests;
    on_host rows "tangents" surfaces::tangents;
    on_host tables "tree-quality" rays::tree_quality;
    on_host rows "triangle-tests" rays::triangle_tests;
}

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
    use std::path::Path;

    use clerestory::gpu::Gpu;

    use super::super::findings::Verdict;
    use super::super::watch::Unwatched;
    use super::*;

    /// Takes a measure with few inputs; one of functions alone must not open the device.
    pub(super) fn check_quick_form(name: &str) {
        let measure = find(name).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| {
                assert!(measure.needs_device, "{name} says that it needs no device");
                Gpu::headless(&clerestory::gpu::GpuOptions::default())
            },
            folder: folder.path(),
            watch: &Unwatched,
        };
        let run = (measure.run)(&context).unwrap_or_else(|error| panic!("{name}: {error}"));
        let findings = run.findings.of_smoke_run();
        assert!(!findings.tables.is_empty(), "{name}");
        for table in findings.tables {
            assert_eq!(table.fault(), None, "{name}: {}", table.title);
        }
        for judged in findings.verdicts {
            let sound = match judged.verdict {
                Verdict::Needs(_) => true,
                Verdict::Holds => judged.in_every_form,
                _ => judged.verdict == Verdict::SmokeForm && !judged.in_every_form,
            };
            assert!(sound, "{name}: {judged}");
        }
    }

    #[test]
    fn criteria_are_there_before_a_run() {
        for measure in MEASURES {
            let declared = (measure.declared)();
            let mut names: Vec<&str> = declared.verdicts.iter().map(|judged| judged.name.as_str()).collect();
            assert!(
                declared
                    .verdicts
                    .iter()
                    .all(|judged| matches!(judged.verdict, Verdict::NotRun | Verdict::Needs(_))),
                "{}",
                measure.name
            );
            assert!(
                declared.tables.is_empty() && declared.headline.is_none(),
                "{}",
                measure.name
            );
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), declared.verdicts.len(), "{}", measure.name);
        }
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
