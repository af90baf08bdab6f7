//! A wavefront technique of a host's own: its kernels begin and scatter walks, and the engine's walker follows them.

use std::f64::consts::PI;
use std::sync::Arc;

use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::types::GatheredLight;
use clerestory::gpu::{Category, ComputePipeline, DeviceKind, Gpu, Recorder};
use clerestory::scene::{Material, Medium, Scene};
use clerestory::transport::{GpuScene, surface_spec};
use clerestory::walk::{
    Bounce, Turnover, WalkKey, WalkOptions, WalkStages, Walker, WaveBuffers, WaveNeeds, WaveSet, stage_barrier,
};
use clerestory::{Error, Result};
use clerestory_tests::render::{cuboid, floor, upload};
use clerestory_tests::shaders::{walk_sky_light, walk_start};
use clerestory_tests::with_gpu;
use glam::Vec3;

/// Points of the row on the floor, m.
const POINTS: [f64; 4] = [0.0, 0.5, 1.0, 1.5];
/// Walks of each.
const WALKS: u32 = 1 << 14;
/// Half a side of the square ceiling, and how high it is, m.
const CEILING: [f64; 2] = [0.75, 1.0];
const ALBEDO: f64 = 0.5;

/// What of a host's technique the walker calls.
struct Ambient<'a> {
    scene: &'a GpuScene,
    start: &'a ComputePipeline<walk_start::Kernel>,
    scatter: &'a ComputePipeline<walk_sky_light::Kernel>,
    key: WalkKey,
    walks: u32,
}

impl WalkStages for Ambient<'_> {
    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        let push = walk_start::Push {
            first: [POINTS[0] as f32, 0.5, 0.0],
            walks: self.walks,
            along: [(POINTS[1] - POINTS[0]) as f32, 0.0, 0.0],
            // The same words, generated in the crate of either kernel.
            key: bytemuck::cast(self.key),
            direction: [0.0, -1.0, 0.0],
        };
        recorder.pass("sky light: start", |pass| {
            let groups = [self.start.groups_for(self.walks), 1, 1];
            pass.dispatch(self.start, &[wave], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let [lower, upper] = self.scene.bounds();
        let push = walk_sky_light::Push {
            scene_lower: lower.to_array(),
            scene_upper: upper.to_array(),
            // The same words, generated in the crate of either kernel.
            key: bytemuck::cast(self.key),
        };
        recorder.pass("sky light: scatter", |pass| {
            let scene = self.scene.scene_set();
            pass.dispatch_indirect(self.scatter, &[&bounce.wave, &scene], &push, bounce.places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_waiting(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        bounce.record_shadow(recorder)
    }
}

/// A floor under a square ceiling.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::lambert("grey", Vec3::splat(ALBEDO as f32)));
    scene.place(floor("floor", material, 20.0, 0.0));
    scene.place(floor("ceiling", material, CEILING[0] as f32, CEILING[1] as f32));
    scene
}

/// The share of a cosine-weighted hemisphere about the vertical at x on the floor that the ceiling fills: the form factor of a parallel rectangle, by its
/// corners (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3).
fn occlusion(x: f64) -> f64 {
    let [half, height] = CEILING;
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI)
    };
    corner(half - x, half) - corner(-half - x, half) - corner(half - x, -half) + corner(-half - x, -half)
}

/// A layer of fog high above the ceiling: extinction in 1/m, between two heights, m.
const FOG: [f64; 3] = [0.4, 2.0, 4.0];

/// Half a side of it, m; and rays that go up as steeply as this leave it at its top.
const FOG_SIDE: f32 = 60.0;
const STEEP: f64 = 0.1;

/// The same floor and ceiling below the fog.
fn scene_with_fog() -> Scene {
    let mut scene = scene();
    scene.media.push(Medium {
        sigma_a: Vec3::splat(FOG[0] as f32),
        ..Medium::default()
    });
    let boundary = scene.add_material(Material {
        boundary: true,
        interior: Some(0),
        ..Material::default()
    });
    let [low, high] = [FOG[1], FOG[2]].map(|height| height as f32);
    let corner = |side: f32, height| Vec3::new(side, height, side);
    scene.place(cuboid("fog", boundary, corner(-FOG_SIDE, low), corner(FOG_SIDE, high)));
    scene
}

/// What the walks of the host's technique gather, whose numbers were counted, with so many bounces per submission.
fn gather(gpu: &Gpu, scene: &Arc<GpuScene>, bounces: usize) -> Vec<[f32; 3]> {
    let start = gpu.compute_pipeline::<walk_start::Kernel>(&Default::default()).unwrap();
    let has_media = scene.profile().media.any();
    let spec = surface_spec!(walk_sky_light, scene, {
        has_alpha: false,
        has_media,
        ..Default::default()
    });
    let scatter = gpu.compute_pipeline::<walk_sky_light::Kernel>(&spec).unwrap();
    let walks = WALKS * POINTS.len() as u32;
    let needs = WaveNeeds {
        waiting: true,
        media: has_media,
        airlight: false,
    };
    let buffers = WaveBuffers::new(gpu, walks, needs).unwrap();
    let options = WalkOptions {
        name: "sky light",
        bounces,
        ..WalkOptions::default()
    };
    let mut walker = Walker::new(gpu, Arc::clone(scene), buffers, options).unwrap();
    let key = WalkKey {
        first_sequence: 0,
        first_index: 0,
        indices: WALKS,
        seed: 11,
    };
    let mut stages = Ambient {
        scene,
        start: &start,
        scatter: &scatter,
        key,
        walks,
    };
    let walked = walker.run(key, walks, &mut stages).unwrap();
    // Each meets the floor, sends a shadow ray, and goes on once.
    assert_eq!((walked.rays, walked.waited), (2 * u64::from(walks), u64::from(walks)));
    assert_eq!(walked.stalls, 0);
    let passes = walked.timings.iter().map(|timings| timings.count("sky light: shadow"));
    let expected: &[usize] = if bounces == 1 { &[1, 1] } else { &[4] };
    // Other devices are given less at first.
    if gpu.caps().kind == DeviceKind::Cpu {
        assert_eq!(passes.collect::<Vec<_>>(), expected);
    }
    let gathered = gpu.read::<GatheredLight>(walker.buffers().gathered(), walks as usize);
    let refused = walker.run(key, walks + 1, &mut stages).unwrap_err();
    assert!(matches!(&refused, Error::Setting { .. }), "{refused}");
    // The memory is that of the wave that was begun last.
    let mut given_up = walker.begin(key, walks).unwrap();
    let mut last = walker.begin(key, walks).unwrap();
    let refused = walker.advance(&mut given_up, &mut stages).unwrap_err();
    assert!(matches!(&refused, Error::Setting { .. }), "{refused}");
    walker.advance(&mut last, &mut stages).unwrap();
    gathered.unwrap().iter().map(|light| light.radiance).collect()
}

#[test]
fn walks_of_the_hosts_own_gather_ambient_light_as_the_form_factor_has_it() {
    with_gpu(|gpu| {
        let scene = upload(gpu, &scene());
        // One bounce a submission, and all in one.
        let seen = [1, 4].map(|bounces| gather(gpu, &scene, bounces));
        assert!(seen[0] == seen[1], "submissions show");
        for (x, walks) in POINTS.iter().zip(seen[0].chunks(WALKS as usize)) {
            // Any hit and closest hit must agree on every walk.
            assert!(
                walks
                    .iter()
                    .all(|w| w[0] == w[1] && (w[0] == 0.0 || w[0] == ALBEDO as f32))
            );
            let open = walks.iter().filter(|w| w[0] > 0.0).count() as f64 / walks.len() as f64;
            let expected = 1.0 - occlusion(*x);
            let deviation = (expected * (1.0 - expected) / walks.len() as f64).sqrt();
            // Four points, each beyond 4.9 deviations once in a million.
            let z = (open - expected) / deviation;
            assert!(z.abs() < 4.9, "at {x} m {open} is open instead of {expected}, z {z}");
        }
    });
}

#[test]
fn shadow_rays_of_the_hosts_own_are_weakened_by_fog() {
    with_gpu(|gpu| {
        let seen = gather(gpu, &upload(gpu, &scene_with_fog()), 1);
        let mut open = 0;
        for walk in &seen {
            let [light, free, up] = walk.map(f64::from);
            if free > 0.0 && up > STEEP {
                open += 1;
                let expected = ALBEDO * (-FOG[0] * (FOG[2] - FOG[1]) / up).exp();
                // Exponents of up to eight, of distances to the rounding of f32.
                assert!(
                    (light - expected).abs() <= 1e-4 * expected,
                    "{light} instead of {expected}"
                );
            } else {
                let most = if free > 0.0 { ALBEDO } else { 0.0 };
                assert!((0.0..=most).contains(&light), "{light} of {most}");
            }
        }
        assert!(open > seen.len() / 2, "{open} of {} are open", seen.len());
    });
}

#[test]
fn memory_that_lacks_what_walks_need_is_refused() {
    with_gpu(|gpu| {
        let [clear, fogged] = [scene(), scene_with_fog()].map(|scene| upload(gpu, &scene));
        let make = |scene: &Arc<GpuScene>, shadows, [waiting, media, airlight]: [bool; 3]| {
            let needs = WaveNeeds {
                waiting,
                media,
                airlight,
            };
            let options = WalkOptions {
                shadows,
                ..WalkOptions::default()
            };
            let buffers = WaveBuffers::new(gpu, 64, needs).unwrap();
            assert_eq!(buffers.needs(), needs);
            Walker::new(gpu, Arc::clone(scene), buffers, options)
        };
        let refused = [
            (&fogged, true, [true, false, false], "media"),
            (&fogged, false, [false, false, false], "media"),
            (&clear, true, [false, false, false], "waiting"),
            (&fogged, true, [false, true, false], "waiting"),
            (&fogged, false, [false, true, true], "waiting"),
        ];
        for (scene, shadows, needs, at_fault) in refused {
            match make(scene, shadows, needs).err() {
                Some(Error::Setting { name, cause, .. }) => assert_eq!(name, at_fault, "{cause}"),
                other => panic!("{needs:?}: {other:?}"),
            }
        }
        for (scene, shadows, needs) in [
            (&clear, false, [false, false, false]),
            (&clear, true, [true, false, false]),
            (&fogged, true, [true, true, true]),
        ] {
            make(scene, shadows, needs).unwrap();
        }
    });
}

#[test]
fn walks_that_a_full_wave_cannot_take_are_refused() {
    with_gpu(|gpu| {
        let scene = upload(gpu, &scene());
        let needs = WaveNeeds {
            waiting: true,
            media: false,
            airlight: false,
        };
        let key = WalkKey {
            first_sequence: 0,
            first_index: 0,
            indices: 64,
            seed: 11,
        };
        let walker = |buffers| Walker::new(gpu, Arc::clone(&scene), buffers, WalkOptions::default()).unwrap();
        let expect = |refused: clerestory::Result<()>, setting: &str, words: &str| match refused.err() {
            Some(Error::Setting { name, cause, .. }) => {
                assert!(name == setting && cause.contains(words), "{name}: {cause}")
            }
            other => panic!("{words}: {other:?}"),
        };
        let mut plain = walker(WaveBuffers::new(gpu, 64, needs).unwrap());
        expect(plain.begin_full(key).map(drop), "wave", "a turnover");
        let mut whole = plain.begin(key, 32).unwrap();
        expect(plain.refill(&mut whole, 1), "walks", "begin_full");
        let mut buffers = WaveBuffers::new(gpu, 64, needs).unwrap();
        let format = vk::Format::R32G32B32A32_UINT;
        buffers.number_by(gpu.storage_texels("numbers", Category::Work, format, 64).unwrap());
        buffers.refill_by(Turnover::new(gpu, 64).unwrap());
        let mut kept_full = walker(buffers);
        let mut whole = kept_full.begin(key, 32).unwrap();
        expect(kept_full.refill(&mut whole, 1), "walks", "between two bounces");
        let mut full = kept_full.begin_full(key).unwrap();
        expect(kept_full.refill(&mut full, 65), "walks", "64 free slots");
        kept_full.refill(&mut full, 60).unwrap();
        expect(kept_full.refill(&mut full, 5), "walks", "4 free slots");
    });
}
