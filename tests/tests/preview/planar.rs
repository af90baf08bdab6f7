//! Planar mirrors against the path tracer's, and planes that are none.

use std::sync::Arc;

use clerestory::Error;
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Material, Projection, Scene};
use clerestory::techniques::preview::{MirrorPlane, PlanarMirror, Preview, PreviewDesc, PreviewShadows};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::{cuboid, quad};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};
use serde_json::json;

const SIZE: u32 = 48;
/// The mirror, aslant before a room.
const PLANE: MirrorPlane = MirrorPlane {
    point: Vec3::new(0.2, 1.0, -0.8),
    normal: Vec3::new(0.25, 0.1, 1.0),
};

/// A room of coloured walls, a lamp, a mirror of reflectance 1 that fills the picture, and blocks behind its plane, which must not be seen in it.
fn room(projection: Projection) -> Scene {
    let mut scene = Scene::default();
    let colors = [[0.8, 0.3, 0.2], [0.2, 0.6, 0.8], [0.7, 0.7, 0.6], [0.6, 0.5, 0.2]];
    let mut paint = |color: [f32; 3]| scene.add_material(Material::lambert("paint", Vec3::from_array(color)));
    let [left, right, floor, back] = colors.map(&mut paint);
    let v = Vec3::new;
    scene.place(quad(
        "left",
        left,
        [
            v(-2.0, 0.0, -3.0),
            v(-2.0, 0.0, 3.0),
            v(-2.0, 2.5, 3.0),
            v(-2.0, 2.5, -3.0),
        ],
    ));
    scene.place(quad(
        "right",
        right,
        [v(2.0, 0.0, 3.0), v(2.0, 0.0, -3.0), v(2.0, 2.5, -3.0), v(2.0, 2.5, 3.0)],
    ));
    scene.place(quad(
        "floor",
        floor,
        [
            v(-2.0, 0.0, 3.0),
            v(2.0, 0.0, 3.0),
            v(2.0, 0.0, -3.0),
            v(-2.0, 0.0, -3.0),
        ],
    ));
    scene.place(quad(
        "back",
        back,
        [v(2.0, 0.0, 3.0), v(-2.0, 0.0, 3.0), v(-2.0, 2.5, 3.0), v(2.0, 2.5, 3.0)],
    ));
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::ONE));
    let normal = PLANE.normal.normalize();
    let across = normal.cross(Vec3::Y).normalize();
    let up = across.cross(normal);
    let corner = |a: f32, b: f32| PLANE.point + a * across + b * up;
    scene.place(quad(
        "mirror",
        mirror,
        [
            corner(-0.9, -0.9),
            corner(0.9, -0.9),
            corner(0.9, 0.9),
            corner(-0.9, 0.9),
        ],
    ));
    for x in [-1.0, 0.0, 1.0] {
        scene.place(cuboid("behind", right, v(x - 0.3, 0.2, -2.6), v(x + 0.3, 1.8, -2.0)));
    }
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: v(0.3, 1.9, 0.9),
            intensity: v(3.6, 3.3, 3.0),
        },
    );
    scene.cameras.push(Camera {
        projection,
        ..Camera::look_at(
            "main",
            DVec3::new(-0.5, 1.3, 1.2),
            PLANE.point.as_dvec3(),
            DVec3::Y,
            1.0,
        )
    });
    scene
}

/// The mirror's picture by rasterization.
fn drawn(gpu: &Gpu, scene: &Scene, samples: u32) -> Vec<f32> {
    let on_device = GpuScene::new(gpu, scene).unwrap();
    let surfaces = on_device.surfaces();
    let desc = PreviewDesc {
        size: [SIZE; 2],
        samples,
        lights: 1,
        shadows: Some(PreviewShadows {
            layout: ShadowLayout::Octahedron,
            side: 512,
            width: 0,
            suns: 0,
        }),
        probes: None,
    };
    let mut preview = Preview::new(gpu, &on_device, desc).unwrap();
    let mirror = PlanarMirror::new(gpu, &on_device, &preview).unwrap();
    assert!(mirror.bytes() > u64::from(12 * SIZE * SIZE * samples * samples));
    let lights: Vec<LightKind> = scene.lights.iter().map(|light| light.kind).collect();
    let mut recorder = gpu.recorder("planar mirror").unwrap();
    preview.record_lights(&mut recorder, &surfaces, &lights).unwrap();
    mirror
        .record(
            &mut recorder,
            &on_device,
            &surfaces,
            &preview,
            &scene.cameras[0],
            &PLANE,
        )
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    mirror.picture().unwrap().main_layer().unwrap().values().to_vec()
}

/// Values of a mirror's picture.
pub fn mirrored_values(gpu: &Gpu) -> Vec<f32> {
    drawn(gpu, &room(Projection::Perspective { fov_y: 0.5 }), 1)
}

/// To 1/255 in all pixels that have no edge in them: by the path tracer's own variance, at most a twentieth of that.
#[test]
fn a_planar_mirror_is_the_path_tracers() {
    with_gpu(|gpu| {
        for projection in [
            Projection::Perspective { fov_y: 0.5 },
            Projection::Orthographic { half_height: 0.4 },
        ] {
            let scene = room(projection);
            let traced = Renderer::new(gpu, &scene)
                .unwrap()
                .render(&RenderOptions {
                    technique: Some("path".into()),
                    size: [SIZE; 2],
                    spp: 512,
                    settings: json!({"path_set": "L.SE"}).into(),
                    ..RenderOptions::default()
                })
                .unwrap();
            let layer = |name: &str| traced.picture.layer(name).unwrap().values();
            let (expected, variance) = (layer("radiance"), layer("variance"));
            let found = drawn(gpu, &scene, 3);
            let (mut judged, mut worst, mut greatest) = (0, 0.0f32, 0.0f32);
            for ((found, expected), variance) in found.iter().zip(expected).zip(variance) {
                greatest = greatest.max(*expected);
                if variance.sqrt() < 1.0 / 255.0 / 20.0 {
                    judged += 1;
                    worst = worst.max((found - expected).abs());
                }
            }
            println!("{projection:?}: {judged} values are off by {worst} at most, the greatest is {greatest}");
            assert!(judged > 3 * SIZE * SIZE * 8 / 10, "{judged}");
            assert!((0.2..2.0).contains(&greatest), "{greatest}");
            assert!(worst < 1.0 / 255.0, "{projection:?}: {worst}");
        }
    });
}

#[test]
fn planes_that_cannot_be_are_refused() {
    with_gpu(|gpu| {
        let scene = room(Projection::Perspective { fov_y: 0.5 });
        let on_device = Arc::new(GpuScene::new(gpu, &scene).unwrap());
        let surfaces = on_device.surfaces();
        let desc = PreviewDesc {
            size: [8; 2],
            samples: 1,
            lights: 1,
            shadows: None,
            probes: None,
        };
        let preview = Preview::new(gpu, &on_device, desc).unwrap();
        let mirror = PlanarMirror::new(gpu, &on_device, &preview).unwrap();
        let eye = scene.cameras[0].transform.translation.as_vec3();
        for (point, normal, words) in [
            (Vec3::ZERO, Vec3::ZERO, "no direction"),
            (Vec3::ZERO, Vec3::NAN, "no direction"),
            (Vec3::NAN, Vec3::Y, "not finite"),
            (eye, Vec3::Y, "in which the camera lies"),
        ] {
            let mut recorder = gpu.recorder("planar mirror").unwrap();
            let plane = MirrorPlane { point, normal };
            let error = mirror
                .record(
                    &mut recorder,
                    &on_device,
                    &surfaces,
                    &preview,
                    &scene.cameras[0],
                    &plane,
                )
                .unwrap_err();
            assert!(
                matches!(&error, Error::Setting { .. }) && error.to_string().contains(words),
                "{error}"
            );
        }
    });
}
