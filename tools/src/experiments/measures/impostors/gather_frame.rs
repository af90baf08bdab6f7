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

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;

const SCENES: [&str; 6] = [
    "builtin:cornell-box?source=point&sphere=gold",
    "builtin:divider-room?object=gold&roughness=0.4",
    "builtin:box-room?source=point&mirror=no",
    "builtin:game-room?surface=gold&roughness=0.4",
    "builtin:fireballs",
    "builtin:fireballs?bodies=1&shape=knot",
];
/// Pixels, and frames that count, after the one with the map.
const FULL: ([u32; 2], u32) = ([320, 240], 12);
const SMOKE: ([u32; 2], u32) = ([16, 12], 2);
/// Lights along a side of the map's octahedron, each twice those before.
const LIGHTS: [u32; 3] = [8, 16, 32];
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
        of_light: Option<Repeats> = "gather's time of a light over that with a quarter of the lights",
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
    Criterion::each(
        "the gather is linear in its lights: time per light with 1024 over that with 256",
        Bound::Between(0.9, 1.1),
        |row: &Row| {
            row.of_light
                .as_ref()
                .map_or(Measured::exact(f64::NAN), Repeats::measured)
        },
    )
    .among(|row| row.lights == 1024),
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

/// Frames by so many lights, milliseconds.
struct Frames {
    lights: u64,
    technique: LocalizedGather,
    map: f64,
    later_steps: u64,
    non_finite: u64,
    gathers: Vec<f64>,
    rests: Vec<f64>,
    all: Vec<f64>,
}

impl Frames {
    fn new(gpu: &Gpu, scene: &Arc<GpuScene>, camera: &Camera, size: [u32; 2], lights: u32) -> Result<Self> {
        let settings = LocalizedGatherSettings {
            lights,
            ..LocalizedGatherSettings::default()
        };
        Ok(Self {
            lights: u64::from(lights) * u64::from(lights),
            technique: LocalizedGather::new(gpu, Arc::clone(scene), camera, size, settings)?,
            map: 0.0,
            later_steps: 0,
            non_finite: 0,
            gathers: Vec::new(),
            rests: Vec::new(),
            all: Vec::new(),
        })
    }

    /// Submissions for the map.
    fn capture_steps(&self) -> u64 {
        self.technique.counters().get("capture_steps").copied().unwrap_or(0)
    }

    /// A sample a pixel, and the map where it is not there yet: the map's time by wall clock, and those of gathers and of all other passes on the device.
    fn render(&mut self) -> Result<[f64; 3]> {
        let (mut map, mut gather, mut rest) = (0.0, 0.0, 0.0);
        loop {
            let (begin, before) = (Instant::now(), self.capture_steps());
            let Some(step) = self.technique.step(1)? else { break };
            if self.capture_steps() > before {
                map += 1e3 * begin.elapsed().as_secs_f64();
                continue;
            }
            for timings in &step.timings {
                let own = 1e3 * timings.seconds_of(GATHER);
                gather += own;
                rest += 1e3 * timings.seconds() - own;
            }
        }
        self.non_finite += self.technique.picture()?.1.total();
        Ok([map, gather, rest])
    }

    /// The map, with a frame that does not count.
    fn begin(&mut self) -> Result<()> {
        [self.map, ..] = self.render()?;
        Ok(())
    }

    /// A frame that counts.
    fn frame(&mut self, camera: &Camera) -> Result<()> {
        self.technique.set_camera(camera)?;
        let (steps, clock) = (self.capture_steps(), Instant::now());
        let [_, gather, rest] = self.render()?;
        self.all.push(1e3 * clock.elapsed().as_secs_f64());
        self.later_steps += self.capture_steps() - steps;
        self.gathers.push(gather);
        self.rests.push(rest);
        Ok(())
    }

    fn row(self, address: &str, of_light: Option<Repeats>) -> Row {
        let frames: Vec<f64> = self.all.iter().map(|milliseconds| 1e3 / milliseconds).collect();
        let mean = self.all.iter().sum::<f64>() / self.all.len().max(1) as f64;
        Row {
            scene: address.into(),
            lights: self.lights,
            map: self.map,
            later_steps: self.later_steps,
            non_finite: self.non_finite,
            gather: Repeats(self.gathers),
            of_light,
            rest: Repeats(self.rests),
            all: Repeats(self.all),
            frames: Repeats(frames),
            worth: self.map / mean,
        }
    }
}

/// Frames of a scene by all numbers of lights, which take turns frame by frame.
fn frames_of(gpu: &Gpu, address: &str, lights: &[u32], (size, count): ([u32; 2], u32)) -> Result<Vec<Row>> {
    let scene = scene::load(address)?;
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let [lower, upper] = on_device.bounds().map(|corner| corner.as_dvec3());
    let camera = scene.require_camera(None)?;
    let mut all = Vec::new();
    for lights in lights {
        // Another one's map and frame have compiled the kernels, which the device keeps.
        if all.is_empty() {
            Frames::new(gpu, &on_device, camera, size, *lights)?.begin()?;
        }
        let mut frames = Frames::new(gpu, &on_device, camera, size, *lights)?;
        frames.begin()?;
        all.push(frames);
    }
    for frame in 1..=count {
        let camera = camera_of(camera, lower.midpoint(upper), frame);
        for frames in &mut all {
            frames.frame(&camera)?;
        }
    }
    let of_lights: Vec<Repeats> = all
        .iter()
        .map(|frames| Repeats(frames.gathers.clone()).scaled(1.0 / frames.lights as f64))
        .collect();
    let over_fewer = |i: usize| i.checked_sub(1).map(|fewer| of_lights[i].over(&of_lights[fewer]));
    let rows = all.into_iter().enumerate();
    Ok(rows.map(|(i, frames)| frames.row(address, over_fewer(i))).collect())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let form = context.pick(FULL, SMOKE);
        let lights = context.first(&LIGHTS, 1);
        let scenes = context.first(&SCENES, 1);
        context.each(
            scenes,
            |scene| (*scene).to_owned(),
            |scene| frames_of(&gpu, scene, lights, form),
        )
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
                "{} × {} pixels of one sample each, with shadow rays for direct light; the camera goes around the scene's middle. Numbers of lights take turns frame by frame. A frame is wall clock, its passes are times of the device; the map is wall clock, after another one's has compiled the kernels. What a point costs besides is shared by its lights, so that no criterion asks of fewer than 256. The source's picture is of 700² pixels, on a GPU of 2004.",
                FULL.0[0], FULL.0[1],
            ))
    }
}
