//! Frames of rooms with a glossy object by a localised gather: what the map takes once, and what each frame takes.
//!
//! Source of the comparison: L. Szirmay-Kalos, I. Lazányi, "Indirect Diffuse and Glossy Illumination on the GPU", SCCG 2006, whose game with glossy objects runs at 30 frames a second on a GPU of its time.

use std::sync::Arc;
use std::time::Instant;

use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::techniques::localized_gather::{LocalizedGather, LocalizedGatherSettings};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DAffine3, DVec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;

const SCENES: [&str; 6] = [
    "builtin:cornell-box?source=point&sphere=gold",
    "builtin:divider-room?object=gold&roughness=0.4",
    "builtin:box-room?source=point&mirror=no",
    "builtin:game-room?surface=gold&roughness=0.4",
    "builtin:fireballs",
    "builtin:fireballs?bodies=1&shape=knot",
];
/// Pixels, and frames that count, after one that compiles kernels.
const FULL: ([u32; 2], u32) = ([320, 240], 12);
const SMOKE: ([u32; 2], u32) = ([16, 12], 2);
/// Lights along a side of the map's octahedron.
const LIGHTS: [u32; 2] = [8, 16];
/// The camera's way about the vertical through what it looks at in a frame, radians.
const TURN: f64 = 0.03;
/// The pass of gathers.
const GATHER: &str = "localized gather";
/// What the source says of its game.
const PUBLISHED: f64 = 30.0;

rows! {
    /// A scene's frames.
    struct Row = "Frames by a localised gather" by [scene, lights] {
        scene: String = "scene",
        lights: u64 = "lights",
        map: f64 = "map, once (ms)",
        later_steps: u64 = "submissions for the map after the first frame",
        non_finite: u64 = "samples that are not finite",
        gather: Repeats = "gather's share of it (ms)",
        rest: Repeats = "all other passes (ms)",
        all: Repeats = "frame (ms)",
        frames: Repeats = "frames/s",
        worth: f64 = "frames that the map takes the time of",
    }
    beside "source: frames/s" = |_row| Some(PUBLISHED).into();
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the map holds for all frames: submissions for it after the first",
        Bound::AtMost(0.0),
        |row: &Row| (row.later_steps as f64).into(),
    )
    .in_every_form(),
    Criterion::each(
        "all samples are finite: those that are not",
        Bound::AtMost(0.0),
        |row: &Row| (row.non_finite as f64).into(),
    )
    .in_every_form(),
];

/// The camera of a frame.
fn camera_of(camera: &Camera, middle: DVec3, frame: u32) -> Camera {
    let turn = DAffine3::from_translation(middle)
        * DAffine3::from_rotation_y(TURN * f64::from(frame))
        * DAffine3::from_translation(-middle);
    Camera {
        transform: turn * camera.transform,
        ..camera.clone()
    }
}

fn row(gpu: &Gpu, address: &str, lights: u32, (size, count): ([u32; 2], u32)) -> Result<Row> {
    let scene = scene::load(address)?;
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let [lower, upper] = on_device.bounds().map(|corner| corner.as_dvec3());
    let camera = scene.require_camera(None)?;
    let settings = LocalizedGatherSettings {
        lights,
        ..LocalizedGatherSettings::default()
    };
    let mut technique = LocalizedGather::new(gpu, on_device, camera, size, settings)?;
    let capture_steps = |technique: &LocalizedGather| technique.counters().get("capture_steps").copied().unwrap_or(0);
    let (mut map, mut later_steps, mut non_finite) = (0.0, 0, 0);
    let (mut gathers, mut rests, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for frame in 0..=count {
        if frame > 0 {
            technique.set_camera(&camera_of(camera, lower.midpoint(upper), frame))?;
        }
        let (steps, clock) = (capture_steps(&technique), Instant::now());
        let (mut gather, mut rest) = (0.0, 0.0);
        let mut of_map = 0.0;
        loop {
            let (begin, before) = (Instant::now(), capture_steps(&technique));
            let Some(step) = technique.step(1)? else { break };
            if capture_steps(&technique) > before {
                of_map += 1e3 * begin.elapsed().as_secs_f64();
                continue;
            }
            for timings in &step.timings {
                let own = 1e3 * timings.seconds_of(GATHER);
                gather += own;
                rest += 1e3 * timings.seconds() - own;
            }
        }
        non_finite += technique.picture()?.1.total();
        if frame == 0 {
            map = of_map;
            continue;
        }
        later_steps += capture_steps(&technique) - steps;
        all.push(1e3 * clock.elapsed().as_secs_f64());
        gathers.push(gather);
        rests.push(rest);
    }
    let frames: Vec<f64> = all.iter().map(|milliseconds| 1e3 / milliseconds).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    Ok(Row {
        scene: address.into(),
        lights: u64::from(lights) * u64::from(lights),
        map,
        later_steps,
        non_finite,
        gather: Repeats(gathers),
        rest: Repeats(rests),
        all: Repeats(all),
        frames: Repeats(frames),
        worth: map / mean,
    })
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let form = context.pick(FULL, SMOKE);
        let lights = context.first(&LIGHTS, 1);
        let scenes = context.first(&SCENES, 1);
        context.grid(scenes, lights, |scene, lights| row(&gpu, scene, *lights, form))
    }

    fn findings(&self) -> Findings {
        let rates = self.iter().map(|row| row.frames.measured());
        Findings::of(self, CRITERIA)
            .headline("frames per second, geometric mean", geometric_mean(rates))
            .stacked_bars(
                "frame",
                "Milliseconds of a frame, medians",
                self,
                |row| format!("{}, {} lights", row.scene, row.lights),
                &[
                    ("gather", |row: &Row| row.gather.measured().value),
                    ("all other passes", |row: &Row| row.rest.measured().value),
                ],
            )
            .note(format!(
                "{} × {} pixels of one sample each, with shadow rays for direct light; the camera goes around the scene's middle. A frame is wall clock, its passes are times of the device; the map is wall clock, with what compiles its kernels. The source's picture is of 700² pixels, on a GPU of 2004.",
                FULL.0[0], FULL.0[1],
            ))
    }
}
