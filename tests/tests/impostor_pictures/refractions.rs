//! Refractions by distance impostors.

use std::sync::Arc;

use super::*;
use clerestory::film::Picture;
use clerestory::techniques::impostors::{CaptureBy, ImpostorReflections, ReflectionMethod, ReflectionSettings};
use clerestory::transport::random::SamplerKind;
use clerestory::transport::{GpuScene, PathSet};

const SIZE: u32 = 24;
const SAMPLES: u32 = 256;
const RADIUS: f64 = 0.3;
/// What is seen through the glass lies half in its shadow.
const BEFORE: Vec3 = Vec3::new(-0.2, 0.3, 0.2);
/// What is seen through the glass lies in the light.
const BEYOND: Vec3 = Vec3::new(0.75, 0.7, 0.6);

/// The room with a lamp and the half of a glass sphere that the eye sees, so that the path tracer meets one interface, too.
fn half_sphere(lamp: Vec3) -> Scene {
    let mut scene = room_with(Material::glass("glass", 1.5), B, RADIUS, EYE, 1.2, 1.0);
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: lamp,
            intensity: Vec3::new(1.0, 0.9, 0.8),
        },
    );
    let shell = &mut scene.meshes[SPHERE as usize];
    let towards = (EYE - B).as_vec3();
    let positions = shell.positions.clone();
    let is_seen = |corners: &[u32; 3]| {
        let sum: Vec3 = corners.iter().map(|corner| positions[*corner as usize]).sum();
        (sum / 3.0 - B.as_vec3()).dot(towards) > 0.0
    };
    shell.triangles.retain(is_seen);
    scene
}

fn settings() -> ReflectionSettings {
    ReflectionSettings {
        place: Some([0.1, -0.05, 0.1]),
        steps: 8,
        side: 512,
        capture_samples: 1,
        sampler: SamplerKind::Pcg,
        refracts: true,
        ..ReflectionSettings::default()
    }
}

/// A view of the glass.
struct Glass {
    scene: Scene,
    on_device: Arc<GpuScene>,
    on: Vec<usize>,
    expected: Rendered,
}

impl Glass {
    fn new(gpu: &Gpu, lamp: Vec3) -> Self {
        let scene = half_sphere(lamp);
        let on = pixels_of_sphere(&scene, SIZE, B, RADIUS, true);
        assert!(on.len() > 150, "{}", on.len());
        let json = json!({"path_set": "LE|L.E|L.SE", "sampler": "pcg"});
        Self {
            on_device: Arc::new(GpuScene::new(gpu, &scene).unwrap()),
            expected: rendered_by(&renderer(gpu, &scene), "path", (SIZE, 2048), 6, json),
            scene,
            on,
        }
    }

    fn picture(&self, gpu: &Gpu, settings: ReflectionSettings) -> Picture {
        let (scene, camera) = (self.on_device.clone(), &self.scene.cameras[0]);
        let mut technique = ImpostorReflections::new(gpu, scene, camera, [SIZE; 2], settings).unwrap();
        while technique.step(SAMPLES).unwrap().is_some() {}
        let (picture, non_finite) = technique.picture().unwrap();
        assert_eq!(non_finite.total(), 0);
        // Two rays from each place of the glass: none of an eye's ray is beyond the critical angle.
        let counts = technique.counts();
        assert!(counts.reflections > 2 * u64::from(SAMPLES) * self.on.len() as u64);
        assert!(counts.refractions > u64::from(SAMPLES) * self.on.len() as u64);
        assert!(counts.reflections > counts.refractions);
        assert_eq!(technique.path_set().to_string(), self.expected.report.path_set);
        picture
    }

    /// RMS over the pixels that show the glass, without what the variances of independent samples explain, and the bias.
    fn errors(&self, found: &Picture, name: &str) -> [f64; 2] {
        let values = |picture: &Picture, name: &str| picture.layer(name).unwrap().values().to_vec();
        let mean = |values: &[f32]| {
            let of = self
                .on
                .iter()
                .flat_map(|pixel| values[3 * pixel..3 * pixel + 3].to_vec());
            of.map(f64::from).sum::<f64>() / (3 * self.on.len()) as f64
        };
        let radiance = values(&self.expected.picture, "radiance");
        let [rms, bias] = super::errors(&values(found, "radiance"), &radiance, &self.on);
        let noise = mean(&values(found, "variance")) + mean(&values(&self.expected.picture, "variance"));
        let left = (rms * rms - noise / mean(&radiance).powi(2)).max(0.0).sqrt();
        println!("{name}: RMS {rms:.4}, {left:.4} beyond noise, {bias:+.4}");
        [left, bias]
    }
}

/// Where no border of a shadow is seen through the glass, both kinds of maps are right. Where what is seen lies half in the glass's own shadow, radiance at texels' middles puts its border off by up to half a texel: the error falls with texels, and is
/// below the bound with 1024 of a map by rays. A drawn map has the borders of its shadow maps besides, and comes there with finer ones.
#[test]
fn glass_shows_what_the_path_tracer_shows_behind_one_interface() {
    with_gpu(|gpu| {
        const BOUND: f64 = 0.03;
        let [border, lit] = [BEFORE, BEYOND].map(|lamp| Glass::new(gpu, lamp));
        let of = |glass: &Glass, name: &str, settings: ReflectionSettings| {
            let found = glass.picture(gpu, settings);
            glass.errors(&found, name)
        };
        let by = |capture: CaptureBy, side: u32, shadow_side: u32| ReflectionSettings {
            capture,
            side,
            shadow_side,
            ..settings()
        };
        let (rays, raster) = (CaptureBy::Rays, CaptureBy::Raster);
        for (name, capture) in [("lit, by rays", rays), ("lit, drawn", raster)] {
            let [off, bias] = of(&lit, name, by(capture, 512, 1024));
            assert!(off < BOUND && bias.abs() < 0.01, "{name}: {off} {bias}");
        }
        let [coarse, _] = of(&border, "border, by rays", by(rays, 512, 1024));
        let [traced, bias] = of(&border, "border, by rays of more texels", by(rays, 1024, 1024));
        assert!(traced < BOUND && bias.abs() < 0.01, "{traced} {bias}");
        assert!(traced < 0.6 * coarse && coarse < 0.08, "{traced} {coarse}");
        let [drawn, bias] = of(&border, "border, drawn", by(raster, 512, 1024));
        assert!(drawn < 0.08 && bias.abs() < 0.015, "{drawn} {bias}");
        let [fine, bias] = of(&border, "border, drawn with finer shadows", by(raster, 2048, 4096));
        assert!(fine < BOUND && bias.abs() < 0.01, "{fine} {bias}");
        let classical = ReflectionSettings {
            method: ReflectionMethod::Classical,
            ..by(rays, 512, 1024)
        };
        let [without, _] = of(&border, "border, without distances", classical);
        assert!(without > 10.0 * coarse, "{without} {coarse}");
    });
}

/// Settings of pictures that are held to the path tracer's, with a map of some side.
fn held(side: u32) -> Value {
    json!({"refracts": true, "capture": "rays", "side": side, "capture_samples": 1, "steps": 8, "sampler": "pcg"})
}

/// A picture by the card's settings, and its error and bias over all pixels.
fn held_to_rays(gpu: &Gpu, scene: &Scene, side: u32) -> (Rendered, [f64; 2]) {
    let renderer = renderer(gpu, scene);
    let found = rendered(&renderer, "impostor", SIZE, SAMPLES, held(side));
    let expected = traced(&renderer, &found, SIZE, 1024);
    assert_eq!(found.report.path_set, PathSet::DIRECT_AND_MIRRORED.to_string());
    let all: Vec<usize> = (0..(SIZE * SIZE) as usize).collect();
    let [off, bias] = errors_beyond_noise(&found, &expected, &all);
    println!("{}: {off:.4}, bias {bias:+.4}", scene.name);
    (found, [off, bias])
}

/// A pane of thin glass before the lamp's half of the room, by the card's setting: what lies behind it, and what it mirrors. One without a layer mirrors nothing, and shows what lies behind it all the same.
#[test]
fn a_pane_shows_what_lies_behind_it() {
    with_gpu(|gpu| {
        let bare = Material {
            specular: 0.0,
            ..thin_glass()
        };
        for (glass, rays) in [(thin_glass(), 2), (bare, 1)] {
            let (found, [off, bias]) = held_to_rays(gpu, &panes_of(glass, &[0.4]), 512);
            assert!(off < 0.03 && bias.abs() < 0.01, "{rays}: {off} {bias}");
            // So many rays from each place, one of them refracted.
            let all = u64::from(SAMPLES * SIZE * SIZE);
            let counts = ["reflections", "refractions"].map(|name| found.report.counters[name]);
            assert_eq!(counts, [rays * all, all]);
        }
    });
}

/// A room of six walls that emit their colours, half full of water: a body whose surface is its only interface. The eye looks at it from a place.
fn pool(eye: DVec3, attenuation_distance: f32) -> Scene {
    let mut scene = Scene {
        name: format!("pool from {}, attenuation in {attenuation_distance} m", eye.y),
        ..Scene::default()
    };
    walls(&mut scene, 1.0);
    for wall in &mut scene.materials {
        wall.unlit = true;
    }
    let water = scene.add_material(Material {
        attenuation_color: Vec3::new(0.7, 0.4, 0.2),
        attenuation_distance,
        ..Material::glass("water", 1.33)
    });
    let at = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    scene.place(quad(
        "water",
        water,
        [at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)],
    ));
    scene
        .cameras
        .push(Camera::look_at("main", eye, DVec3::new(0.2, 0.0, 0.1), DVec3::Y, 0.6));
    scene
}

/// From above water absorbs along the refracted ray alone; from within along the eye's own way, beyond the critical angle of what is mirrored, too. As clear water it would be half as bright again and more. Without distances there is nothing to absorb along.
#[test]
fn what_is_seen_in_a_pool_is_absorbed_on_the_way() {
    with_gpu(|gpu| {
        for eye in [DVec3::new(-0.5, 0.7, -0.4), DVec3::new(-0.2, -0.7, -0.2)] {
            let (found, [off, bias]) = held_to_rays(gpu, &pool(eye, 0.6), 1024);
            assert!(off < 0.03 && bias.abs() < 0.01, "{off} {bias}");
            let clear = rendered(&renderer(gpu, &pool(eye, 1e6)), "impostor", SIZE, 16, held(64));
            let [clear, found] = [&clear, &found].map(|rendered| layer(rendered, "radiance").iter().sum::<f32>());
            assert!(clear > 1.5 * found, "{clear} {found}");
        }
        let scene = pool(EYE, 0.6);
        let on_device = Arc::new(GpuScene::new(gpu, &scene).unwrap());
        let classical = ReflectionSettings {
            method: ReflectionMethod::Classical,
            ..settings()
        };
        let error = ImpostorReflections::new(gpu, on_device, &scene.cameras[0], [8; 2], classical).err();
        let error = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("method") && error.contains("absorb"), "{error}");
    });
}

fn thin_glass() -> Material {
    Material {
        thickness: 0.0,
        ..Material::glass("pane", 1.5)
    }
}

/// The room with a lamp behind panes of thin glass across the view, at places along x.
pub(super) fn panes(at: &[f32]) -> Scene {
    panes_of(thin_glass(), at)
}

/// The same of some glass; panes of solid glass have their sides towards -x.
fn panes_of(glass: Material, at: &[f32]) -> Scene {
    let mut scene = Scene {
        name: "panes".into(),
        ..Scene::default()
    };
    walls(&mut scene, 1.0);
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: BEYOND,
            intensity: Vec3::new(1.0, 0.9, 0.8),
        },
    );
    let glass = scene.add_material(glass);
    for x in at {
        scene.place(quad("pane", glass, pane(|y, z| Vec3::new(*x, y, z))));
    }
    scene
        .cameras
        .push(Camera::look_at("main", EYE, DVec3::X, DVec3::Y, 0.4));
    scene
}

/// Corners of a pane of 1.6 m.
fn pane(corner: impl Fn(f32, f32) -> Vec3) -> [Vec3; 4] {
    [
        corner(-0.8, -0.8),
        corner(-0.8, 0.8),
        corner(0.8, 0.8),
        corner(0.8, -0.8),
    ]
}

/// The second side of a thin body is found however far away others refract, and a surface is not taken for its own second interface however far from the origin it is.
#[test]
fn interfaces_are_told_apart_near_and_far() {
    with_gpu(|gpu| {
        let solid = Material::glass("pane", 1.5);
        let mut thin = panes_of(solid, &[0.4, 0.404]);
        // Of the pane 4 mm thick the second side faces the other way, and 100 m behind it there is another one.
        let glass = thin.meshes[SPHERE as usize].material.unwrap();
        thin.meshes[SPHERE as usize + 1]
            .triangles
            .iter_mut()
            .for_each(|corners| corners.swap(1, 2));
        thin.place(quad("pane", glass, pane(|y, z| Vec3::new(100.0, y, z))));
        let options = RenderOptions {
            technique: Some("impostor".into()),
            size: [SIZE; 2],
            spp: 1,
            settings: json!({"refracts": true, "side": 64, "place": [0.0, 0.0, 0.0]}).into(),
            ..RenderOptions::default()
        };
        let error = renderer(gpu, &thin)
            .render(&options)
            .expect_err("two sides")
            .to_string();
        assert!(error.contains("meet a second interface"), "{error}");

        let mut far = panes(&[]);
        let glass = far.materials.len() as u32 - 1;
        far.place(quad(
            "pane",
            glass,
            pane(|y, z| Vec3::new(0.4 + 0.3 * y - 0.2 * z, y, z)),
        ));
        let away = DVec3::new(9000.0, -11000.0, 10000.0);
        for instance in &mut far.instances {
            instance.transform.translation += away;
        }
        far.cameras[0].transform.translation += away;
        let LightKind::Point { position, .. } = &mut far.lights[0].kind else {
            panic!("no lamp");
        };
        *position += away.as_vec3();
        rendered(
            &renderer(gpu, &far),
            "impostor",
            SIZE,
            4,
            json!({"refracts": true, "side": 64}),
        );
    });
}

/// A refusal holds for its camera: whoever goes on regardless gets it again, and another camera begins anew.
#[test]
fn refused_pictures_stay_refused() {
    with_gpu(|gpu| {
        let scene = panes(&[0.4, 0.6]);
        let on_device = Arc::new(GpuScene::new(gpu, &scene).unwrap());
        let settings = ReflectionSettings { side: 64, ..settings() };
        let mut technique = ImpostorReflections::new(gpu, on_device, &scene.cameras[0], [SIZE; 2], settings).unwrap();
        let finish = |technique: &mut ImpostorReflections, samples: u32| -> Result<(), String> {
            while technique.step(samples).map_err(|error| error.to_string())?.is_some() {}
            Ok(())
        };
        // The samples that the wave of the refusal had, and more.
        for samples in [1, 1, 1 << 16, 1] {
            let error = finish(&mut technique, samples).expect_err("refused");
            assert!(error.contains("meet a second interface"), "{error}");
        }
        let away = Camera::look_at("away", EYE, EYE - DVec3::X, DVec3::Y, 0.4);
        technique.set_camera(&away).unwrap();
        finish(&mut technique, 4).unwrap();
        technique.set_camera(&scene.cameras[0]).unwrap();
        assert!(finish(&mut technique, 4).is_err());
    });
}

/// Bodies, and panes one behind the other: the first sample's refracted rays tell. Through one pane and past the other there is nothing to refuse.
#[test]
fn second_interfaces_are_refused() {
    with_gpu(|gpu| {
        let refused = |scene: &Scene, technique: &str, settings: Value| {
            let options = RenderOptions {
                technique: Some(technique.into()),
                size: [SIZE; 2],
                spp: 2,
                settings: settings.into(),
                ..RenderOptions::default()
            };
            let error = renderer(gpu, scene).render(&options).err();
            error
                .unwrap_or_else(|| panic!("{technique}: {}", scene.name))
                .to_string()
        };
        let mut body = room_with(Material::glass("glass", 1.5), B, RADIUS, EYE, 1.2, 1.0);
        lamp(&mut body, 1.0);
        let refracts = || json!({"refracts": true, "side": 64});
        for scene in [&body, &panes(&[0.4, 0.6])] {
            let error = refused(scene, "impostor", refracts());
            assert!(error.contains("refracted rays meet a second interface"), "{error}");
            let error = refused(scene, "impostor", Value::Null);
            assert!(error.contains("without the setting `refracts`"), "{error}");
            // What has no such setting names none.
            let error = refused(scene, "localized-gather", Value::Null);
            assert!(
                error.contains("surfaces transmit light") && !error.contains("`refracts`"),
                "{error}"
            );
        }
        let error = refused(
            &clerestory_tests::render::builtin("builtin:fog-box"),
            "impostor",
            refracts(),
        );
        assert!(error.contains("participating media"), "{error}");
        // One pane alone, though the other is in the scene: it is in the map, as what reflects nothing.
        let settings = json!({"refracts": true, "side": 64, "reflector": 6, "capture": "rays"});
        rendered(&renderer(gpu, &panes(&[0.4, 0.6])), "impostor", SIZE, 2, settings);
    });
}
