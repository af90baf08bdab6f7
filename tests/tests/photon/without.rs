//! What a scene lacks is not made: without media nothing of them, without diffuse surfaces no map of surfaces. Passes, allocations, pipelines and their
//! constants are counted, and pictures compared to the bit.

use super::volume::{coloured, lit_box};
use super::*;
use clerestory::gpu::{AllocationInfo, PipelineInfo};
use clerestory::scene::Medium;
use clerestory::techniques::photon_mapping::volume::{VolumeEstimate, VolumeKernel};
use clerestory::techniques::photon_mapping::{GatherCounts, MapQueue};
use clerestory_tests::render::{builtin, point_triangle};
use clerestory_tests::with_gpu;
use std::collections::BTreeSet;

/// All that a picture of two passes takes, and its bits.
#[derive(Debug, PartialEq)]
struct Made {
    bits: Vec<u32>,
    pipelines: Vec<PipelineInfo>,
    /// Names of passes.
    passes: BTreeSet<String>,
    /// By name and size.
    allocations: Vec<AllocationInfo>,
    counts: PassCounts,
}

/// Counts of what is done, without seconds.
#[derive(Debug, PartialEq)]
struct PassCounts {
    emitted: u64,
    records: u64,
    events: u64,
    gather: GatherCounts,
    beams: GatherCounts,
}

fn made(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) -> Made {
    let mut mapper = mapper(gpu, scene, settings);
    let mut passes = BTreeSet::new();
    while let Some(step) = mapper.step(2).unwrap_or_else(|error| panic!("{error}")) {
        let timings = step.timings.into_iter().flat_map(|timings| timings.passes);
        passes.extend(timings.map(|pass| pass.name));
    }
    let mut allocations = gpu.allocations();
    allocations.sort_by(|a, b| (&a.name, a.bytes).cmp(&(&b.name, b.bytes)));
    let counts = mapper.counts();
    Made {
        bits: bits(&advance(&mut mapper, 2)),
        pipelines: mapper.pipelines(),
        passes,
        allocations,
        counts: PassCounts {
            emitted: counts.photons.emitted,
            records: counts.records,
            events: counts.events,
            gather: counts.gather,
            beams: counts.beams,
        },
    }
}

impl Made {
    /// Passes, allocations and shaders whose names have one of these words.
    fn of(&self, words: &[&str]) -> Vec<&str> {
        let passes = self.passes.iter().map(String::as_str);
        let allocations = self.allocations.iter().map(|allocation| allocation.name.as_str());
        let shaders = self.pipelines.iter().map(|pipeline| pipeline.shader);
        let all = passes.chain(allocations).chain(shaders);
        all.filter(|name| words.iter().any(|word| name.contains(word)))
            .collect()
    }

    /// Bytes of the allocations of a name.
    fn bytes_of(&self, name: &str) -> u64 {
        let named = self.allocations.iter().filter(|allocation| allocation.name == name);
        named.map(|allocation| allocation.bytes).sum()
    }

    /// How often a constant of some kernel is not 0.
    fn kernels_with(&self, constant: &str) -> usize {
        let constants = self.pipelines.iter().flat_map(|pipeline| &pipeline.specialization);
        constants
            .filter(|(name, value)| *name == constant && *value != 0)
            .count()
    }
}

/// Few photons.
fn few() -> PhotonSettings {
    PhotonSettings {
        photons: 1 << 8,
        ..settings("all")
    }
}

/// In the names of all that media take.
const OF_MEDIA: [&str; 7] = ["media", "medium", "volume", "event", "beam", "airlight", "plane"];
/// Constants that compile branches of media in.
const BRANCHES: [&str; 3] = ["has_media", "has_grids", "has_homogeneous"];

#[test]
fn without_media_there_is_no_pass_byte_or_branch_of_them_and_the_same_bits() {
    with_gpu(|gpu| {
        let room = builtin("builtin:cornell-box");
        // A device may keep something that its first picture has needed.
        made(gpu, &room, &few());
        let truth = made(gpu, &room, &few());
        assert!(truth.counts.emitted == 2 << 8 && truth.counts.records > 0 && truth.counts.gather.photons > 0);
        assert_eq!((truth.counts.events, truth.counts.beams), (0, GatherCounts::default()));
        assert_eq!(truth.of(&OF_MEDIA), [""; 0]);
        for constant in BRANCHES {
            assert_eq!(truth.kernels_with(constant), 0, "{constant}");
        }
        // The words are those of media.
        let fog = made(gpu, &builtin("builtin:fog-box"), &few());
        for word in OF_MEDIA.iter().filter(|word| **word != "plane" && **word != "airlight") {
            assert!(!fog.of(&[*word]).is_empty(), "{word}");
        }
        assert!(fog.kernels_with("has_media") > 1 && fog.counts.events > 0);
        // Whatever is asked of media, and with one that is nowhere.
        let mut elsewhere = room.clone();
        elsewhere.media.push(Medium {
            name: "nowhere".into(),
            ..coloured()
        });
        let volumes = [
            VolumeEstimate::March,
            VolumeEstimate::Beams,
            VolumeEstimate::Planes,
            VolumeEstimate::Unified,
        ];
        let asked = volumes.map(|volume| PhotonSettings { volume, ..few() });
        let kernels = [VolumeKernel::Footprint, VolumeKernel::Neighbor].map(|volume_kernel| PhotonSettings {
            volume_kernel,
            volume_radius: 0.3,
            ..few()
        });
        let cases = asked.into_iter().chain(kernels).map(|settings| (&room, settings));
        for (scene, settings) in cases.chain([(&elsewhere, few())]) {
            let found = made(gpu, scene, &settings);
            assert!(found == truth, "{:?}, {:?}", settings.volume, settings.volume_kernel);
        }
    });
}

/// In the names of all that the map of surfaces takes.
const OF_SURFACES: [&str; 6] = [
    "photon: gather",
    "photon_gather",
    "map: records",
    "photon_leaves",
    "photon_leaf_size",
    "photon_queue",
];

#[test]
fn without_diffuse_surfaces_there_is_no_map_of_them_and_the_same_bits() {
    with_gpu(|gpu| {
        // Fog over a mirror; and beside it a triangle without area that would be diffuse, so that the map of surfaces is made, and stays empty.
        let mut mirror = lit_box(coloured());
        mirror.materials[0] = Material::mirror("mirror", Vec3::splat(0.9));
        let mut beside = mirror.clone();
        point_triangle(&mut beside, Material::lambert("grey", Vec3::splat(0.5)), Vec3::ZERO);
        for (queue, query) in [
            (MapQueue::Slots, MapQuery::Single),
            (MapQueue::Compacted, MapQuery::Packet),
        ] {
            let settings = PhotonSettings {
                photons: 1 << 10,
                queue,
                query,
                ..settings("all")
            };
            let lean = made(gpu, &mirror, &settings);
            let full = made(gpu, &beside, &settings);
            let words: Vec<&str> = lean.of(&OF_SURFACES);
            // The queue of rays alone is left.
            let queues = usize::from(queue != MapQueue::Slots);
            assert!(words.iter().all(|name| name.contains("photon_queue")), "{words:?}");
            assert_eq!(words.len(), queues, "{words:?}");
            assert!(full.of(&OF_SURFACES).len() >= 3 + queues, "{:?}", full.of(&OF_SURFACES));
            assert!(lean.bytes_of("photon records") < full.bytes_of("photon records") / 100);
            // The same light.
            assert_eq!(lean.counts, full.counts);
            assert!(lean.counts.events > 100 && lean.counts.beams.photons > 0);
            assert_eq!((lean.counts.records, lean.counts.gather), (0, GatherCounts::default()));
            assert!(lean.bits == full.bits && lean.bits.iter().any(|bits| f32::from_bits(*bits) > 0.0));
        }
        // Without media there is nothing left that photons are for.
        let mut bare = mirror;
        bare.media.clear();
        bare.materials[1] = Material::glass("glass", 1.5);
        let eye = made(gpu, &bare, &few());
        assert_eq!(eye.counts.emitted, 0);
        assert_eq!(eye.of(&["photon"]), [""; 0]);
    });
}

#[test]
fn maps_of_surfaces_are_made_wherever_a_material_may_be_diffuse() {
    with_gpu(|gpu| {
        let metal = || Material::mirror("metal", Vec3::splat(0.9));
        let cases = [
            (metal(), false),
            (
                Material {
                    thickness: 0.0,
                    ..Material::glass("glass", 1.5)
                },
                false,
            ),
            (Material::lambert("black", Vec3::ZERO), false),
            (Material::lambert("blue", Vec3::new(0.0, 0.0, 0.1)), true),
            (
                Material {
                    metallic: 0.99,
                    ..metal()
                },
                true,
            ),
            (
                Material {
                    transmission: 0.5,
                    thickness: 0.0,
                    ..Material::glass("milky", 1.5)
                },
                true,
            ),
        ];
        for (material, has_map) in cases {
            let name = material.name.clone();
            let mut scene = lit_box(coloured());
            scene.materials[0] = material;
            let mapper = mapper(gpu, &scene, &few());
            assert!(mapper.has_map(), "{name}");
            assert_eq!(mapper.has_surface_map(), has_map, "{name}");
        }
    });
}
