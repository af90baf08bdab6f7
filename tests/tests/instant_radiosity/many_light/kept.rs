//! Virtual lights that are kept from frame to frame: counts of what is new to the light, powers against closed forms, and means over seeds against the path tracer.

use std::sync::Arc;

use super::*;
use clerestory::transport::GpuScene;
use glam::DAffine3;

pub(super) fn kept() -> ManyLightSettings {
    ManyLightSettings {
        placement: Placement::Incremental,
        renewed: 4,
        ..exact()
    }
}

pub(super) fn point(position: Vec3) -> LightKind {
    LightKind::Point {
        position,
        intensity: Vec3::splat((20.0 * 0.25 / PI) as f32),
    }
}

pub(super) fn spot(position: Vec3, direction: Vec3) -> LightKind {
    LightKind::Spot {
        position,
        direction,
        intensity: Vec3::splat(5.0),
        inner: 0.4,
        outer: 0.7,
    }
}

/// A scene with these lights alone.
pub(super) fn lit_by(mut scene: Scene, lights: &[LightKind]) -> Scene {
    scene.lights.clear();
    for kind in lights {
        scene.add_light("lamp", *kind);
    }
    scene
}

fn closed_box() -> Scene {
    builtin("builtin:furnace-box?rho=0.5&emission=0")
}

/// A rendering whose lamps and objects move.
pub(super) struct Moving<'a> {
    gpu: &'a Gpu,
    /// Its first camera is looked through in the next frame.
    pub scene: Scene,
    on_device: Arc<GpuScene>,
    pub renderer: ManyLight,
}

impl<'a> Moving<'a> {
    pub fn new(gpu: &'a Gpu, scene: Scene, size: [u32; 2], settings: ManyLightSettings) -> Self {
        let on_device = upload(gpu, &scene);
        let renderer = ManyLight::new(gpu, Arc::clone(&on_device), &scene.cameras[0], size, settings);
        let renderer = renderer.unwrap_or_else(|error| panic!("{}: {error}", scene.name));
        Self {
            gpu,
            scene,
            on_device,
            renderer,
        }
    }

    /// A frame with the first lamp there: its radiance, and by how much renewed lights, rays to lights and maps have become more.
    pub fn frame(&mut self, lamp: LightKind) -> (Vec<f32>, [u64; 3]) {
        let counts = |renderer: &ManyLight| {
            let counts = renderer.counts();
            [counts.renewed, counts.sight_rays, counts.maps]
        };
        let before = counts(&self.renderer);
        self.on_device
            .move_light(self.gpu, 0, &lamp)
            .expect("a light that moves");
        self.renderer.set_camera(&self.scene.cameras[0]).expect("a camera");
        let [radiance, _] = advance(&mut self.renderer, 1);
        let after = counts(&self.renderer);
        (radiance, [0, 1, 2].map(|i| after[i] - before[i]))
    }

    /// Puts an object to another place, for what is drawn and for rays.
    pub fn put(&self, object: usize, to: DVec3) {
        let to = DAffine3::from_translation(to);
        let moved = self.on_device.move_object(self.gpu, &self.scene, object, to);
        moved.expect("a place in the scene");
        self.on_device.refit_index(self.gpu).expect("a wide index");
    }

    fn places(&self) -> BTreeSet<[u32; 3]> {
        let lights = self.renderer.lights().expect("lights");
        lights
            .iter()
            .map(|light| light.position.to_array().map(f32::to_bits))
            .collect()
    }

    fn power(&self) -> f64 {
        let lights = self.renderer.lights().expect("lights");
        lights.iter().map(|light| f64::from(light.power.y)).sum()
    }
}

/// Whether a segment comes through the slab of the hall.
fn meets_slab(from: Vec3, to: Vec3) -> bool {
    let margin = Vec3::splat(1e-3);
    let (lower, upper) = (Vec3::new(-0.4, 0.9, -0.4) + margin, Vec3::new(0.3, 1.0, 0.4) - margin);
    let (a, b) = ((lower - from) / (to - from), (upper - from) / (to - from));
    let (enters, leaves) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(1.0));
    enters < leaves
}

/// No light, no ray, no map and no pass is new while lamps stand still, and the same frame has the same bits.
#[test]
fn still_lamps_keep_all_lights_and_their_maps() {
    with_gpu(|gpu| {
        let lamp = point(Vec3::new(0.5, 1.7, 0.2));
        for visibility in [Visibility::Rays, Visibility::Maps, Visibility::Imperfect] {
            let settings = ManyLightSettings {
                visibility,
                map_side: 8,
                map_points: 64,
                ..kept()
            };
            let mut moving = Moving::new(gpu, lit_by(hall(), &[lamp]), [16, 8], settings);
            let (first, [renewed, rays, maps]) = moving.frame(lamp);
            assert_eq!((renewed, rays), (64, 0), "{visibility:?}");
            let landed = moving.renderer.lights().expect("lights").len() as u64;
            assert!(landed > 32 && landed < 64, "some directions leave the hall: {landed}");
            assert_eq!(maps, if visibility == Visibility::Rays { 0 } else { landed });
            let (places, passes) = (moving.places(), moving.renderer.counts().passes);
            let (again, new) = moving.frame(lamp);
            assert_eq!(new, [0; 3], "{visibility:?}");
            assert!(bits(&again) == bits(&first), "{visibility:?}");
            advance(&mut moving.renderer, 5);
            let counts = moving.renderer.counts();
            assert_eq!((counts.renewed, counts.sight_rays, counts.maps), (64, 0, maps));
            // Surfaces, split, direct light, gather, merge, film.
            assert_eq!(counts.passes - passes, 6 * 5, "{visibility:?}");
            assert_eq!(moving.places(), places);
        }
    });
}

/// As many as the quota are new in a frame at most, all that are left are seen, and shares of the power stay whole; once the lamp stands, all is settled after as many frames as lights take.
#[test]
fn moved_lamps_renew_no_more_than_the_quota() {
    with_gpu(|gpu| {
        let at = |step: u32| Vec3::new(0.5 - 0.08 * step as f32, 1.7 - 0.05 * step as f32, 0.2);
        let settings = ManyLightSettings {
            visibility: Visibility::Maps,
            map_side: 8,
            ..kept()
        };
        let mut moving = Moving::new(gpu, lit_by(hall(), &[point(at(0))]), [4; 2], settings);
        moving.frame(point(at(0)));
        let mut known = moving.places();
        let mut all_new = 0;
        for step in 1..16 {
            let (_, [renewed, rays, maps]) = moving.frame(point(at(step)));
            let places = moving.places();
            let new = places.difference(&known).count() as u64;
            assert!(
                new <= renewed && renewed <= 4 && maps <= renewed,
                "{step}: {new} {renewed} {maps}"
            );
            assert!(rays > 32 && rays <= 64, "{rays}");
            for light in moving.renderer.lights().expect("lights") {
                assert!(!meets_slab(at(step), light.position), "{step}: {light:?}");
            }
            all_new += renewed;
            known = places;
        }
        assert!(all_new > 4, "the slab hides some: {all_new}");
        let mut frames = 0;
        while moving.frame(point(at(15))).1[0] > 0 {
            frames += 1;
            assert!(frames <= 16, "no end");
        }
        assert_eq!(moving.frame(point(at(15))).1, [0; 3]);
    });
}

/// A spot that turns about sees none of its lights any more: they come back by the quota, and from the first frame on have all of its power.
#[test]
fn lamps_that_jump_lose_what_they_do_not_see() {
    with_gpu(|gpu| {
        let [up, down] = [Vec3::Y, Vec3::NEG_Y].map(|direction| spot(Vec3::ZERO, direction));
        let mut moving = Moving::new(gpu, lit_by(closed_box(), &[up]), [4; 2], kept());
        moving.frame(up);
        let power = moving.power();
        for frame in 1..=16 {
            let (_, [renewed, rays, _]) = moving.frame(down);
            assert_eq!((renewed, rays), (4, 0), "outside of the cone nothing is asked");
            let lights = moving.renderer.lights().expect("lights");
            assert_eq!(lights.len(), 4 * frame);
            assert!(lights.iter().all(|light| light.position.y < 0.0));
            assert!((moving.power() / power - 1.0).abs() < 1e-5);
        }
    });
}

/// The power that arrives in a closed box is the lamps', whatever has moved.
#[test]
fn kept_lights_have_all_of_the_power() {
    with_gpu(|gpu| {
        let place = |i: u32| Vec3::new(0.1 * i as f32 - 0.3, 0.2, 0.05 * i as f32);
        let turned = |i: u32| spot(place(i), Vec3::new(0.1 * i as f32, 1.0, 0.3).normalize());
        let pointed = |i: u32| point(place(i));
        let other = LightKind::Point {
            position: Vec3::splat(-0.5),
            intensity: Vec3::splat(0.2),
        };
        let power_of = |kind: &LightKind| clerestory::transport::lights::light_power(kind, 0.0).y;
        type Way<'a> = &'a dyn Fn(u32) -> LightKind;
        let ways: [(Way<'_>, &[LightKind]); 3] = [(&pointed, &[]), (&turned, &[]), (&turned, &[other])];
        for (way, others) in ways {
            let lights = [&[way(0)][..], others].concat();
            let expected: f64 = lights.iter().map(power_of).sum();
            let mut moving = Moving::new(gpu, lit_by(closed_box(), &lights), [4; 2], kept());
            for step in 0..6 {
                moving.frame(way(step));
                let found = moving.power();
                assert!((found / expected - 1.0).abs() < 1e-5, "{step}: {found} W of {expected}");
            }
        }
    });
}

/// Walks of the same random numbers land near where they landed in the frame before: under a lamp that goes on by small steps, pictures change far less than those of new walks.
#[test]
fn the_same_walks_change_less_from_frame_to_frame() {
    const FRAMES: u32 = 10;
    with_gpu(|gpu| {
        let at = |step: u32| point(Vec3::new(0.5 - 0.01 * step as f32, 1.7, 0.2));
        let settings = ManyLightSettings {
            interleave: 1,
            ..of(INDIRECT, exact())
        };
        let mut moving = Moving::new(gpu, lit_by(hall(), &[at(0)]), SIZE, settings);
        let mut change = |seed_of: fn(u32) -> u32| {
            let mut pictures = Vec::new();
            for step in 0..FRAMES {
                moving.renderer.restart(seed_of(step)).expect("a seed");
                pictures.push(moving.frame(at(step)).0);
            }
            let squares = pictures.windows(2).map(|pair| rmse(&pair[1], &pair[0]).powi(2));
            squares.sum::<f64>() / f64::from(FRAMES - 1)
        };
        let (same, new) = (change(|_| 5), change(|step| 5 + step));
        println!("mean squared change {same} with the same walks, {new} with new ones");
        assert!(same > 0.0 && same < 0.5 * new, "{same} {new}");
    });
}

/// Every picture, of so many frames, is of another seed, and so independent of the others.
pub(super) fn seeds(gpu: &Gpu, scene: &Scene, settings: &ManyLightSettings, each: u32, count: u32) -> Passes {
    let mut renderer = frames(gpu, scene, SIZE, settings);
    let pictures: Vec<Vec<f32>> = (0..count)
        .map(|seed| {
            renderer.restart(100 + seed).expect("another seed");
            let [radiance, _] = advance(&mut renderer, each);
            radiance
        })
        .collect();
    let n = f64::from(count);
    let mean_at = |i: usize| pictures.iter().map(|picture| f64::from(picture[i])).sum::<f64>() / n;
    let variance_at = |i: usize| {
        let mean = mean_at(i);
        let squares: f64 = pictures
            .iter()
            .map(|picture| (f64::from(picture[i]) - mean).powi(2))
            .sum();
        squares / (n * (n - 1.0))
    };
    let values = 0..pictures[0].len();
    Passes {
        radiance: values.clone().map(|i| mean_at(i) as f32).collect(),
        variance: values.map(|i| variance_at(i) as f32).collect(),
        means: [0, 1, 2].map(|channel| pictures.iter().map(|picture| mean(picture, channel)).collect()),
        counts: PassCounts::default(),
    }
}

/// By the z-test with Šidák's correction over pixels, and Student's t over seeds for the mean: exact of a point, with all lights at all pixels and in tiles; of a spot
/// up to 2 %, for what light changes over cells at the rim.
#[test]
fn means_over_seeds_are_the_path_tracers() {
    with_gpu(|gpu| {
        let lamp = Vec3::new(0.2, 0.4, 0.1);
        let by_point = lit_by(hall(), &[point(Vec3::new(0.5, 1.7, 0.2))]);
        let by_spot = lit_by(hall(), &[spot(lamp, Vec3::Y)]);
        for (scene, interleave, bias) in [(&by_point, 1, 0.0), (&by_point, 4, 0.0), (&by_spot, 1, 0.02)] {
            let reference = traced_set(gpu, scene, 2048, INDIRECT);
            let settings = ManyLightSettings {
                interleave,
                ..of(INDIRECT, kept())
            };
            let found = seeds(gpu, scene, &settings, 1, 64);
            found.expect_same_as(&format!("{interleave} tiles a side"), &reference, bias);
        }
    });
}

#[test]
fn kept_lights_do_not_depend_on_how_work_is_shared_out() {
    with_gpu(|gpu| {
        let at = |step: u32| point(Vec3::new(0.5 - 0.2 * step as f32, 1.7, 0.2));
        for visibility in [Visibility::Rays, Visibility::Maps, Visibility::Imperfect] {
            let base = of_odd_sizes(visibility, kept());
            let all = |settings: ManyLightSettings| -> Vec<Vec<u32>> {
                let mut moving = Moving::new(gpu, lit_by(hall(), &[at(0)]), [13, 7], settings);
                (0..4).map(|step| bits(&moving.frame(at(step)).0)).collect()
            };
            let whole = all(base.clone());
            assert!(whole[1] != whole[0]);
            // Without a map for each all of them are drawn anew.
            let parted = ManyLightSettings {
                lights_at_once: 3,
                maps_at_once: 7,
                ..base.clone()
            };
            assert!(all(parted) == whole, "{visibility:?}");
            // Another seed, and the first one again.
            let mut moving = Moving::new(gpu, lit_by(hall(), &[at(0)]), [13, 7], base);
            assert!(bits(&moving.frame(at(0)).0) == whole[0]);
            moving.renderer.restart(6).expect("another seed");
            assert!(bits(&advance(&mut moving.renderer, 1)[0]) != whole[0]);
            moving.renderer.restart(5).expect("the first seed");
            assert!(bits(&advance(&mut moving.renderer, 1)[0]) == whole[0]);
        }
    });
}

#[test]
fn other_lights_are_refused() {
    with_gpu(|gpu| {
        let refusal = |scene: &Scene, settings: ManyLightSettings| {
            let found = ManyLight::new(gpu, upload(gpu, scene), &scene.cameras[0], [4; 2], settings);
            found.err().map(|error| error.to_string()).unwrap_or_default()
        };
        let all = refusal(&furnished(), kept());
        assert!(all.contains("has an area") && all.contains("environment"), "{all}");
        let parallel = LightKind::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Vec3::ONE,
        };
        assert!(refusal(&lit_by(hall(), &[parallel]), kept()).contains("parallel"));
        let few = ManyLightSettings { lights: 2, ..kept() };
        let lamps = [0.1, 0.2, 0.3].map(|x| point(Vec3::new(x, 1.5, 0.0)));
        assert!(refusal(&lit_by(hall(), &lamps), few).contains("lamps"));
        let many = ManyLightSettings { lights: 5000, ..kept() };
        assert!(refusal(&hall(), many).contains("4096"));
        // Where nothing of virtual lights is shown nothing is kept.
        assert_eq!(refusal(&furnished(), of(UP_TO_ONCE, kept())), "");
        // All directions leave, or none has power.
        let away = lit_by(hall(), &[spot(Vec3::new(0.0, 2.5, 0.0), Vec3::Y)]);
        let mut renderer = frames(gpu, &away, [13, 7], &of(INDIRECT, kept()));
        assert!(advance(&mut renderer, 2)[0].iter().all(|value| *value == 0.0));
        assert_eq!((renderer.counts().lights, renderer.counts().connections), (0, 0));
    });
}
