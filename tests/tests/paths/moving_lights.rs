//! Lights that move within a scene on the device: pictures are those of a scene that was made with the light there, to the bit.

use std::collections::BTreeSet;
use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::gpu::shaders::types::SceneLight;
use clerestory::scene::{LightKind, Material, Scene};
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory_tests::render::{builtin, cuboid, finish, upload};
use clerestory_tests::with_gpu;
use glam::{Quat, Vec3};

const SIZE: [u32; 2] = [12, 12];
const SAMPLES: u32 = 2;
const PHOTONS: u32 = 512;

/// The Cornell box under its panel, with lights of every other kind; the first has no power and no record.
fn scene() -> Scene {
    let mut scene = builtin("builtin:cornell-box");
    let middle = Vec3::new(0.278, 0.4, -0.278);
    let point = |intensity| LightKind::Point {
        position: middle,
        intensity,
    };
    scene.add_light("dark", point(Vec3::ZERO));
    scene.add_light("point", point(Vec3::new(0.1, 0.05, 0.02)));
    scene.add_light(
        "spot",
        LightKind::Spot {
            position: middle,
            direction: Vec3::NEG_Y,
            intensity: Vec3::new(0.02, 0.1, 0.3),
            inner: 0.3,
            outer: 0.6,
        },
    );
    scene.add_light(
        "sun",
        LightKind::Directional {
            direction: Vec3::NEG_Z,
            irradiance: Vec3::splat(0.5),
        },
    );
    scene
}

/// What becomes of a light.
type Change<'a> = &'a dyn Fn(&mut LightKind);

/// The same light elsewhere.
fn moved(kind: &LightKind) -> LightKind {
    let (shift, turn) = (Vec3::new(0.12, -0.1, 0.05), Quat::from_rotation_x(0.4));
    let mut kind = *kind;
    match &mut kind {
        LightKind::Point { position, .. } => *position += shift,
        LightKind::Spot {
            position, direction, ..
        } => {
            *position += shift;
            *direction = (turn * *direction).normalize();
        }
        LightKind::Directional { direction, .. } => *direction = (turn * *direction).normalize(),
    }
    kind
}

/// A technique at work: its picture's bits after a restart with this seed.
type Restarted<'a> = Box<dyn FnMut(u32) -> Vec<u32> + 'a>;

fn path_tracer<'a>(gpu: &Gpu, scene: &Arc<GpuScene>, of: &Scene) -> Restarted<'a> {
    let settings = PathTracerSettings::default();
    let mut tracer = PathTracer::new(gpu, Arc::clone(scene), &of.cameras[0], SIZE, settings).unwrap();
    Box::new(move |seed| {
        tracer.restart(seed).unwrap();
        finish(&mut tracer, SAMPLES).bits()
    })
}

fn photon_mapper<'a>(gpu: &Gpu, scene: &Arc<GpuScene>, of: &Scene) -> Restarted<'a> {
    let settings = PhotonSettings {
        photons: PHOTONS,
        ..PhotonSettings::default()
    };
    let mut mapper = PhotonMapper::new(gpu, Arc::clone(scene), &of.cameras[0], SIZE, settings).unwrap();
    Box::new(move |seed| {
        mapper.restart(seed).unwrap();
        while mapper.step(SAMPLES).unwrap().is_some() {}
        let (picture, _) = mapper.picture().unwrap();
        let layers = ["radiance", "variance"].map(|name| picture.layer(name).unwrap());
        layers
            .iter()
            .flat_map(|layer| layer.values())
            .map(|value| value.to_bits())
            .collect()
    })
}

#[test]
fn pictures_are_those_of_a_scene_made_with_the_light_there() {
    with_gpu(|gpu| {
        let before = scene();
        let mut after = before.clone();
        for light in &mut after.lights[1..] {
            light.kind = moved(&light.kind);
        }
        let [moving, made_so] = [&before, &after].map(|scene| upload(gpu, scene));
        let techniques = |scene: &Arc<GpuScene>| [path_tracer(gpu, scene, &before), photon_mapper(gpu, scene, &before)];
        let mut of_moving = techniques(&moving);
        let first = of_moving.each_mut().map(|picture| picture(3));
        for (i, light) in after.lights.iter().enumerate().skip(1) {
            moving.move_light(gpu, i, &light.kind).unwrap();
        }
        let second = of_moving.each_mut().map(|picture| picture(3));
        let expected = techniques(&made_so).each_mut().map(|picture| picture(3));
        assert!(second == expected, "not as if made so");
        assert!((0..2).all(|i| first[i] != second[i]), "nothing has moved");
        // And back, with the seed that a restart brings.
        for (i, light) in before.lights.iter().enumerate().skip(1) {
            moving.move_light(gpu, i, &light.kind).unwrap();
        }
        let other_seed = of_moving.each_mut().map(|picture| picture(4));
        assert!((0..2).all(|i| first[i] != other_seed[i]), "the seed stays");
        assert!(of_moving.each_mut().map(|picture| picture(3)) == first, "not as before");
    });
}

/// One record goes to the device for each light that moves, and none for a picture.
#[test]
fn a_light_that_moves_is_one_record() {
    const WORDS: usize = size_of::<SceneLight>() / size_of::<u32>();
    with_gpu(|gpu| {
        let before = scene();
        let on_device = upload(gpu, &before);
        let records = || -> Vec<u32> {
            let lights = on_device.scene_set().scene_lights.buffer();
            let words = lights.bytes() as usize / size_of::<u32>();
            gpu.read(lights.view(), words).expect("records of lights")
        };
        let mut known = records();
        assert!(known.len() >= 3 * WORDS);
        let mut moved_records = BTreeSet::new();
        let mut picture = path_tracer(gpu, &on_device, &before);
        for (i, light) in before.lights.iter().enumerate().skip(1) {
            on_device.move_light(gpu, i, &moved(&light.kind)).expect("moves");
            let now = records();
            let changed: Vec<usize> = (0..now.len()).filter(|word| now[*word] != known[*word]).collect();
            let of: BTreeSet<usize> = changed.iter().map(|word| word / WORDS).collect();
            assert_eq!(of.len(), 1, "light {i}: words {changed:?}");
            moved_records.extend(of);
            known = now;
            picture(3);
            assert_eq!(records(), known, "light {i}: a picture wrote lights");
        }
        assert_eq!(moved_records.len(), 3, "{moved_records:?}");
    });
}

/// Photons of a light that has come into a body that absorbs.
#[test]
fn a_light_that_moves_into_a_body_is_inside() {
    with_gpu(|gpu| {
        let mut before = builtin("builtin:cornell-box");
        let tinted = before.add_material(Material {
            attenuation_color: Vec3::new(0.2, 0.5, 0.8),
            attenuation_distance: 0.05,
            ..Material::glass("tinted", 1.5)
        });
        // About the tall block, which shows what its light has lost.
        before.place(cuboid(
            "body",
            tinted,
            Vec3::new(0.2, 0.01, -0.5),
            Vec3::new(0.5, 0.45, -0.2),
        ));
        let light = |y: f32| LightKind::Point {
            position: Vec3::new(0.35, y, -0.35),
            intensity: Vec3::ONE,
        };
        let mut after = before.clone();
        before.add_light("point", light(0.5));
        after.add_light("point", light(0.42));
        let [moving, made_so] = [&before, &after].map(|scene| upload(gpu, scene));
        moving.move_light(gpu, 0, &after.lights[0].kind).expect("moves");
        let [found, expected] = [moving, made_so].map(|scene| photon_mapper(gpu, &scene, &before)(3));
        assert!(found == expected, "not as if made so");
    });
}

#[test]
fn lights_that_cannot_move_are_refused() {
    with_gpu(|gpu| {
        let scene = scene();
        let on_device = upload(gpu, &scene);
        let refusal = |light: usize, change: Change<'_>| {
            let mut kind = scene.lights[light.min(scene.lights.len() - 1)].kind;
            change(&mut kind);
            let result = on_device.move_light(gpu, light, &kind);
            result.err().map(|error| error.to_string()).unwrap_or_default()
        };
        let brighter = |kind: &mut LightKind| {
            if let LightKind::Point { intensity, .. } = kind {
                *intensity *= 1.5;
            }
        };
        let nowhere = |kind: &mut LightKind| {
            if let LightKind::Point { position, .. } = kind {
                position.x = f32::NAN;
            }
        };
        let wider = |kind: &mut LightKind| {
            if let LightKind::Spot { outer, .. } = kind {
                *outer += 0.1;
            }
        };
        let longer = |kind: &mut LightKind| {
            if let LightKind::Directional { direction, .. } = kind {
                *direction *= 2.0;
            }
        };
        let cases: [(usize, Change<'_>, &str); 7] = [
            (0, &|_| {}, "no power"),
            (1, &brighter, "chosen by power"),
            (1, &nowhere, "not finite"),
            (1, &|kind| *kind = scene.lights[2].kind, "another kind"),
            (2, &wider, "chosen by power"),
            (3, &longer, "another length"),
            (4, &|_| {}, "does not exist"),
        ];
        for (light, change, expected) in cases {
            let message = refusal(light, change);
            assert!(
                message.contains(expected),
                "light {light}: {message:?}, not {expected:?}"
            );
        }
        assert_eq!(refusal(1, &|_| {}), "");
    });
}
