//! Planar mirrors as a second picture, beside the path tracer's: by how much they are off where a pixel has no edge, and how long they take.
//!
//! Oracle: the path tracer on direct light in a mirror, with its own variance.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Material, Scene};
use clerestory::techniques::preview::{MirrorPlane, PlanarMirror, Preview, PreviewDesc, PreviewShadows};
use clerestory_hard_cases::scenes::quad;
use glam::{DVec3, Vec3};
use serde_json::json;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows};
use crate::experiments::measures::Context;

/// A step of a picture of eight bits.
const STEP: f64 = 1.0 / 255.0;
/// A value is judged where the path tracer knows it to this part of a step.
const KNOWN: f64 = 0.05;
/// Samples along a side of a pixel.
const SAMPLES: u32 = 3;
/// Degrees by which the mirror is turned from the camera.
const TURNS: [f64; 3] = [0.0, 15.0, 30.0];

rows! {
    /// A mirror.
    struct Row = "Planar mirrors beside the path tracer's" by [turned] {
        turned: f64 = "mirror turned by (°)",
        judged: f64 = "values without an edge (%)",
        worst: f64 = "greatest difference of these (1/255)",
        mean: f64 = "mean difference of all (1/255)",
        brightest: f64 = "brightest value",
        drawn: f64 = "time of the drawn picture (ms)",
        traced: f64 = "time of the path tracer's, a sample a pixel (ms)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "they are the path tracer's: greatest difference of values without an edge (1/255)",
        Bound::AtMost(1.0),
        |row: &Row| row.worst.into(),
    ),
    Criterion::each("most values have no edge (%)", Bound::AtLeast(80.0), |row: &Row| {
        row.judged.into()
    }),
];

/// A room before a mirror of reflectance 1 that fills the picture, and the mirror's plane.
fn room(degrees: f64) -> (Scene, MirrorPlane) {
    let mut scene = Scene::default();
    let colors = [[0.8, 0.3, 0.2], [0.2, 0.6, 0.8], [0.7, 0.7, 0.6], [0.6, 0.5, 0.2]];
    let [left, right, floor, back] =
        colors.map(|color| scene.add_material(Material::lambert("paint", Vec3::from_array(color))));
    let v = Vec3::new;
    for (name, material, corners) in [
        (
            "left",
            left,
            [
                v(-3.0, 0.0, -1.0),
                v(-3.0, 0.0, 3.0),
                v(-3.0, 2.5, 3.0),
                v(-3.0, 2.5, -1.0),
            ],
        ),
        (
            "right",
            right,
            [v(3.0, 0.0, 3.0), v(3.0, 0.0, -1.0), v(3.0, 2.5, -1.0), v(3.0, 2.5, 3.0)],
        ),
        (
            "floor",
            floor,
            [
                v(-3.0, 0.0, 3.0),
                v(3.0, 0.0, 3.0),
                v(3.0, 0.0, -1.0),
                v(-3.0, 0.0, -1.0),
            ],
        ),
        (
            "back",
            back,
            [v(3.0, 0.0, 3.0), v(-3.0, 0.0, 3.0), v(-3.0, 2.5, 3.0), v(3.0, 2.5, 3.0)],
        ),
    ] {
        scene.place(quad(name, material, corners));
    }
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::ONE));
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let plane = MirrorPlane {
        point: v(0.0, 1.0, -0.8),
        normal: v(sine as f32, 0.0, cosine as f32),
    };
    let across = plane.normal.cross(Vec3::Y).normalize();
    let corner = |a: f32, b: f32| plane.point + a * across + b * Vec3::Y;
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
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: v(0.3, 1.9, 0.9),
            intensity: v(1.2, 1.1, 1.0),
        },
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(-0.3, 1.2, 1.4),
        plane.point.as_dvec3(),
        DVec3::Y,
        0.5,
    ));
    (scene, plane)
}

fn row(gpu: &Gpu, turned: f64, size: u32, spp: u32) -> Result<Row> {
    let (scene, plane) = room(turned);
    let renderer = Renderer::new(gpu, &scene)?;
    let traced = renderer.render(&RenderOptions {
        technique: Some("path".into()),
        size: [size; 2],
        spp,
        settings: json!({"path_set": "L.SE"}).into(),
        ..RenderOptions::default()
    })?;
    let on_device = renderer.gpu_scene();
    let surfaces = on_device.surfaces();
    let desc = PreviewDesc {
        size: [size; 2],
        samples: SAMPLES,
        lights: 1,
        shadows: Some(PreviewShadows {
            layout: ShadowLayout::Octahedron,
            side: 512,
            width: 0,
            suns: 0,
        }),
        probes: None,
    };
    let mut preview = Preview::new(gpu, on_device, desc)?;
    let mirror = PlanarMirror::new(gpu, on_device, &preview)?;
    let lights: Vec<LightKind> = scene.lights.iter().map(|light| light.kind).collect();
    let mut recorder = gpu.recorder("planar mirror: lights")?;
    preview.record_lights(&mut recorder, &surfaces, &lights)?;
    recorder.submit()?.wait()?;
    let mut milliseconds = 0.0;
    // The first one compiles.
    for _ in 0..2 {
        let mut recorder = gpu.recorder("planar mirror")?;
        mirror.record(
            &mut recorder,
            on_device,
            &surfaces,
            &preview,
            scene.require_camera(None)?,
            &plane,
        )?;
        let timings = recorder.submit()?.wait()?;
        let passes = timings.passes.iter().filter_map(|pass| pass.nanoseconds);
        milliseconds = passes.map(|ns| 1e-6 * ns as f64).sum();
    }
    let picture = mirror.picture()?;
    let found = picture.main_layer()?.values();
    let (expected, variance) = (traced.picture.require("radiance")?, traced.picture.require("variance")?);
    let (mut judged, mut worst, mut sum, mut brightest) = (0usize, 0.0f64, 0.0, 0.0f64);
    for ((found, expected), variance) in found.iter().zip(expected.values()).zip(variance.values()) {
        let gap = f64::from((found - expected).abs()) / STEP;
        sum += gap;
        brightest = brightest.max((*expected).into());
        if f64::from(*variance).sqrt() < KNOWN * STEP {
            judged += 1;
            worst = worst.max(gap);
        }
    }
    Ok(Row {
        turned,
        judged: 100.0 * judged as f64 / found.len().max(1) as f64,
        worst,
        mean: sum / found.len().max(1) as f64,
        brightest,
        drawn: milliseconds,
        traced: 1e3 * traced.report.gpu_seconds / f64::from(spp),
    })
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (size, spp) = context.pick((96, 256), (8, 4));
        let turns = context.first(&TURNS, 1);
        context.each(
            turns,
            |turned| format!("{turned}°"),
            |turned| Ok(vec![row(&gpu, *turned, size, spp)?]),
        )
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "the greatest difference from the path tracer, away from edges (1/255)",
                largest(self, |_| true, |row| row.worst),
            )
            .note("A room of painted walls and a point lamp in a mirror of reflectance 1, 3² samples a pixel. Values are judged where the path tracer's deviation of the mean is below a twentieth of 1/255; edges are in no such pixel.")
    }
}
