//! What the stages of paths fetch, counted exactly, and that counting changes nothing.

use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::PathTracerSettings;
use clerestory::techniques::path::PathCounters;
use clerestory::walk::Fetches;
use clerestory_tests::render::{builtin, paths, render};
use clerestory_tests::with_gpu;

/// Bytes of a texel of four words, and of one of a word.
const QUARTER: u64 = 16;
const WORD: u64 = 4;
/// Of [`Fetches::STAGES`].
const EXTEND: usize = 0;
const SHADE: usize = 2;
const SHADOW: usize = 3;

fn counted(gpu: &Gpu, scene: &Scene, settings: &PathTracerSettings) -> PathCounters {
    let count = |count_fetches| {
        let settings = PathTracerSettings {
            count_fetches,
            ..settings.clone()
        };
        render(gpu, scene, [16, 16], 4, &settings)
    };
    let (counted, plain) = (count(true), count(false));
    assert_eq!(counted.bits(), plain.bits(), "counting shows");
    assert_eq!(plain.counters.fetches, Fetches::default());
    counted.counters
}

#[test]
fn stages_fetch_what_is_counted() {
    with_gpu(|gpu| {
        // Every path meets a lamp at once, and ends there.
        let box_of_lamps = builtin("builtin:furnace-box?rho=0.5&emission=0.1");
        for full_waves in [true, false] {
            let settings = PathTracerSettings {
                full_waves,
                ..paths("emitted")
            };
            let counters = counted(gpu, &box_of_lamps, &settings);
            let (rays, fetches) = (counters.extend_rays, counters.fetches);
            assert_eq!((rays, counters.shadow_rays), (16 * 16 * 4, 0));
            // A whole wave begins with a walk in each slot: its queue is not read in the first bounce.
            let slots = u64::from(full_waves);
            // Origin and direction of the ray.
            assert_eq!(fetches.texels[EXTEND], rays * (2 + slots));
            assert_eq!(fetches.bytes[EXTEND], rays * (2 * QUARTER + slots * WORD));
            // Direction and throughput, the hit, the triangle, two quarters of the material, and two cumulative probabilities of the lamp.
            assert_eq!(fetches.texels[SHADE], rays * (2 + 1 + 3 + 2 + 2 + slots));
            assert_eq!(fetches.bytes[SHADE], rays * (8 * QUARTER + 2 * WORD + slots * WORD));
            assert_eq!(fetches.texels[SHADOW], 0);
        }
    });
}

#[test]
fn diffuse_scenes_fetch_few_texels_a_segment() {
    with_gpu(|gpu| {
        let full = PathTracerSettings {
            full_waves: true,
            ..PathTracerSettings::default()
        };
        let counters = counted(gpu, &builtin("builtin:cornell-box"), &full);
        let (rays, fetches) = (counters.extend_rays, counters.fetches);
        let of = |stage: usize| fetches.texels[stage] as f64 / rays as f64;
        println!("{:?} a segment", [EXTEND, SHADE, SHADOW].map(of));
        assert_eq!(fetches.texels[EXTEND], 3 * rays);
        assert_eq!(fetches.texels[SHADOW], 4 * counters.shadow_rays);
        assert_eq!(fetches.bytes[SHADOW], (3 * QUARTER + WORD) * counters.shadow_rays);
        // The queue, two quarters of the path, the hit, three of the triangle and two of the material, the numbers of the sample; of the light its probability, its first quarter, three of its
        // triangle and one of its material: 16, and two more where a lamp is met.
        assert!(of(SHADE) > 12.0 && of(SHADE) < 16.5, "{}", of(SHADE));
    });
}
