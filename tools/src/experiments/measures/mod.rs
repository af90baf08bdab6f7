//! Measures: numbers that experiments take of functions and kernels, with the error of each before its speed; by topic, beside what they
//! share: a clock, sizes of errors, pictures and numbers of twice the precision.

mod clock;
mod context;
mod device;
pub(super) mod errors;
mod files;
mod impostors;
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
mod virtual_lights;
mod wide;

use clerestory::{Error, Result};

pub use self::context::Context;
use super::findings::{self, Findings, Study};

/// What criteria need: hits to the bit of the host's.
const EXACT_DIVISION: &str = "a device with exact division, such as the software driver";
/// What criteria need: times that are not those of the host's threads.
const MEMORY_OF_ITS_OWN: &str = "a GPU with memory of its own";

/// A measure by name.
pub struct Measure {
    /// The name that experiments ask for.
    pub name: &'static str,
    /// Whether it opens the device.
    pub needs_device: bool,
    /// Whether it measures scenes that it is told ([`Context::scenes`]).
    pub takes_scenes: bool,
    /// Takes the measure, and gives its rows as JSON. Errors and counts are deterministic; times are not.
    pub run: fn(&Context<'_>) -> Result<String>,
    /// What such rows say. A verdict must not depend on when it was made: it is always of rows that were read.
    pub read: fn(&str) -> Result<Findings>,
    /// What it says where nothing was run: its criteria.
    pub declared: fn() -> Findings,
}

/// A measure of a module's rows.
const fn of<S: Study>(name: &'static str, needs_device: bool) -> Measure {
    Measure {
        name,
        needs_device,
        takes_scenes: false,
        run: findings::run::<S>,
        read: findings::read::<S>,
        declared: || S::default().findings(),
    }
}

impl Measure {
    const fn of_any_scenes(mut self) -> Self {
        self.takes_scenes = true;
        self
    }
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

/// [`MEASURES`], and a test of each measure's quick form, from a line a measure: `where it runs, "name" topic::module`.
macro_rules! measures {
    ($($place:ident $name:literal $topic:ident::$module:ident $(.$also:ident())?;)*) => {
        /// All measures, each called as its experiment and, with underscores, its module in the folder of its topic.
        pub const MEASURES: &[Measure] = &[$(of::<$topic::$module::Found>($name, needs_device!($place))$(.$also())?),*];

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
    on_device "absorption" media::absorption;
    on_device "adaptive-choice" rendering::adaptive_choice;
    on_device "alpha" surfaces::alpha;
    on_device "automatic-choice" rendering::automatic_choice;
    on_device "barriers" device::barriers;
    on_device "bdpt-peers" rendering::bdpt_peers;
    on_device "beam-estimate" photons::beam_estimate;
    on_device "build-stages" rays::build_stages;
    on_host "camera-footprints" rays::camera_footprints;
    on_device "compact-map" photon_maps::compact_map;
    on_host "compact-rays" photon_maps::compact_rays;
    on_host "convolved-maps" impostors::convolved_maps;
    on_host "coupled-reflection" surfaces::coupled_reflection;
    on_device "cycles" rendering::cycles;
    on_device "deferred-stages" virtual_lights::deferred_stages;
    on_device "device-model" device::device_model;
    on_device "fog-peers" rendering::fog_peers;
    on_host "free-flight" media::free_flight;
    on_device "fresnel-cost" surfaces::fresnel_cost;
    on_host "fresnel-dielectric" surfaces::fresnel_dielectric;
    on_device "fresnel-forms" surfaces::fresnel_forms;
    on_host "fresnel-seam" surfaces::fresnel_seam;
    on_host "fresnel-stripes" surfaces::fresnel_stripes;
    on_host "fuzzing" files::fuzzing;
    on_device "gather-counts" impostors::gather_counts;
    on_device "gather-frame" impostors::gather_frame;
    on_device "gather-glossy" impostors::gather_glossy;
    on_device "gather-places" impostors::gather_places;
    on_device "gather-table" impostors::gather_table;
    on_device "gather-terms" impostors::gather_terms;
    on_device "imperfect-maps" preview::imperfect_maps;
    on_device "impostor-methods" impostors::impostor_methods;
    on_device "impostor-motion" impostors::impostor_motion;
    on_host "impostor-occlusion" impostors::impostor_occlusion;
    on_host "impostor-roots" impostors::impostor_roots;
    on_device "impostor-trace" impostors::impostor_trace;
    on_device "kd-caches" kd::kd_caches.of_any_scenes();
    on_device "kd-heuristics" kd::kd_heuristics.of_any_scenes();
    on_device "kd-hosts" kd::kd_hosts.of_any_scenes();
    on_device "kd-maps" photon_maps::kd_maps;
    on_device "kd-or-bvh" kd::kd_or_bvh.of_any_scenes();
    on_host "kd-probability" kd::kd_probability;
    on_device "kd-rays" kd::kd_rays.of_any_scenes();
    on_device "kd-threads" kd::kd_threads.of_any_scenes();
    on_device "kd-traversal" kd::kd_traversal.of_any_scenes();
    on_device "leaf-sizes" photon_maps::leaf_sizes;
    on_host "light-choice" rendering::light_choice;
    on_device "live-map-pictures" preview::live_map_pictures;
    on_device "live-maps" preview::live_maps.of_any_scenes();
    on_host "map-borders" maps::map_borders;
    on_host "map-choice" maps::map_choice;
    on_device "many-lamps" rendering::many_lamps;
    on_device "map-construction" photon_maps::map_construction;
    on_host "map-density" maps::map_density;
    on_host "map-error" maps::map_error;
    on_device "map-glossiness" maps::map_glossiness;
    on_host "map-levels" maps::map_levels;
    on_device "map-quality" photon_maps::map_quality;
    on_device "map-rendering" maps::map_rendering;
    on_host "merge-example" photon_maps::merge_example;
    on_device "metal-agreement" rendering::metal_agreement;
    on_device "metal-looks" surfaces::metal_looks;
    on_device "metal-spectra" surfaces::metal_spectra;
    on_host "microfacet-parts" surfaces::microfacet_parts;
    on_device "mitsuba" rendering::mitsuba;
    on_host "multiple-scattering" surfaces::multiple_scattering;
    on_device "parallel-blocks" device::parallel_blocks;
    on_host "path-differentials" photons::path_differentials;
    on_device "path-sets" rendering::path_sets;
    on_device "path-stages" rendering::path_stages;
    on_device "persistent-threads" rays::persistent_threads;
    on_host "phase-functions" media::phase_functions;
    on_device "photon-defaults" photons::photon_defaults;
    on_device "photon-frame" photons::photon_frame;
    on_device "photon-peers" photons::photon_peers;
    on_device "photon-queues" photons::photon_queues;
    on_device "photon-statistics" photons::photon_statistics;
    on_host "picture-formats" rendering::picture_formats;
    on_device "planar-mirrors" preview::planar_mirrors;
    on_device "previous-reflections" impostors::previous_reflections;
    on_host "random-numbers" photons::random_numbers;
    on_device "ray-engine" rays::ray_engine;
    on_host "ray-offsets" rays::ray_offsets;
    on_device "reflection-maps" preview::reflection_maps;
    on_device "rsm-discs" virtual_lights::rsm_discs;
    on_host "sample-sums" rendering::sample_sums;
    on_device "scene-profile" rendering::scene_profile;
    on_device "shadow-maps" preview::shadow_maps.of_any_scenes();
    on_host "shading-normals" surfaces::shading_normals;
    on_host "sphere-tests" rays::sphere_tests;
    on_device "stops" rendering::stops;
    on_host "tangents" surfaces::tangents;
    on_device "technique-choice" rendering::technique_choice;
    on_host "tree-quality" rays::tree_quality;
    on_host "triangle-tests" rays::triangle_tests;
    on_host "virtual-images" impostors::virtual_images;
    on_device "upsampling" preview::upsampling;
    on_device "view-shadows" preview::view_shadows;
    on_host "volume-bands" media::volume_bands;
    on_device "volume-bandwidths" photons::volume_bandwidths;
    on_device "volume-choice" photons::volume_choice;
    on_device "volume-crossover" photons::volume_crossover;
    on_device "volume-dampening" photons::volume_dampening;
    on_device "volume-frame" photons::volume_frame;
    on_device "volume-peers" photons::volume_peers;
    on_device "volume-scenes" photons::volume_scenes;
    on_device "volume-queues" photons::volume_queues;
    on_device "volume-transmittance" photons::volume_transmittance;
    on_device "vpl-history" virtual_lights::vpl_history;
    on_device "vpl-incremental" virtual_lights::vpl_incremental;
    on_host "vpl-order" virtual_lights::vpl_order;
    on_device "vpl-potential" virtual_lights::vpl_potential;
    on_device "vpl-sight" virtual_lights::vpl_sight;
    on_host "vpl-spikes" virtual_lights::vpl_spikes;
    on_host "vpl-walks" virtual_lights::vpl_walks;
    on_host "vpl-warp" preview::vpl_warp;
    on_device "walk-agreement" rendering::walk_agreement;
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

    use super::super::findings::{Judged, Verdict};
    use super::super::watch::Unwatched;
    use super::*;

    /// Criteria for rows that no smoke run has, since they take too long.
    const OF_LONG_RUNS: [&str; 23] = [
        "the gather is linear in its lights: time per light with 1024 over that with 256",
        "by the published lobe RMS errors are the published ones, exponent 50: relative difference (%)",
        "by the published lobe five terms have the published RMS errors, exponent 50: relative difference (%)",
        "pilots take at most a quarter of the time of each picture where it is above five seconds: the largest share",
        "95 of 100 footprints of 256 pixels a side are within 5 %: their relative error",
        "the automatic size is within 3 % of the best by time, on scenes that judge it: best / this",
        "it is so on scenes that judge it: time of share 1/8 over that of 1/16, geometric mean",
        "time is linear in the number of words above 10⁵: exponent",
        "beside the middle four texels a side are ahead of the map at its place: RMS over its",
        "1,000 imperfect maps are ten times as fast as exact ones at 100,000 triangles: ratio of times",
        "silver is brighter than iron: mean over its",
        "silver by Hagemann's constants is warmer than chromium: red over blue",
        "sixteen bins: the greatest error of a pixel's channel",
        "sixteen bins bring what channels lose: RMS error over that of channels",
        "hundreds of triangles take an index: passes over index",
        "more texels with the surfaces' own angles are nearer: RMS of sixteen over that of eight",
        "in the middle the gather of sixteen is no worse than the map: RMS over its",
        "channels lose copper's edge where it is met more than once: the greatest error",
        "channels keep metals without an edge: the greatest error",
        "Schlick's curve without k has the wrong colour: the greatest error for copper",
        "chromium is not: red over blue",
        "shares of low-discrepancy points err half as much as independent ones at most",
        "Halton points have half the variance of independent ones at most",
    ];

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
        let rows = (measure.run)(&context).unwrap_or_else(|error| panic!("{name}: {error}"));
        let findings = (measure.read)(&rows).unwrap().of_smoke_run();
        check_what_shows_rows(name, &findings);
        assert!(!findings.tables.is_empty(), "{name}");
        for table in findings.tables {
            assert_eq!(table.fault(), None, "{name}: {}", table.title);
        }
        let is_sound = |judged: &Judged| match judged.verdict {
            Verdict::NotRun => OF_LONG_RUNS.contains(&judged.name.as_str()),
            // A list that excuses what is judged would excuse it when it is no longer.
            _ if OF_LONG_RUNS.contains(&judged.name.as_str()) => false,
            Verdict::Needs(_) => true,
            Verdict::Holds => judged.in_every_form,
            _ => judged.verdict == Verdict::SmokeForm && !judged.in_every_form,
        };
        let unsound = findings.verdicts.iter().filter(|judged| !is_sound(judged));
        let unsound: Vec<String> = unsound.map(|judged| judged.to_string()).collect();
        assert!(unsound.is_empty(), "{name}: {unsound:#?}");
    }

    /// What the experiment says to show a row of the catalogue must be there, and a row that a table names must be one that it measures.
    fn check_what_shows_rows(name: &str, findings: &Findings) {
        let experiment = crate::experiments::find(name).unwrap();
        for (id, words) in &experiment.shows {
            assert!(
                findings.has(words),
                "{name}: nothing is called \"{words}\", which is to show {id}"
            );
        }
        let measured = |id: &str| experiment.systems.iter().any(|system| system == id);
        for row in clerestory::catalogue::all() {
            assert!(
                !findings.has(row.id) || measured(row.id),
                "{name} measures {} and does not say so",
                row.id
            );
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
