//! How long renderings take to stop: by a budget of time, and by a request between two steps, on scenes that would never end and on the hard cases.
//!
//! Oracle: the clock of who waits. A rendering before each one that is measured has compiled the kernels.

use std::time::{Duration, Instant};

use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Environment, Scene};
use clerestory::techniques;
use clerestory::{Error, Result};
use clerestory_hard_cases::scenes::{equal_triangles, place_sparse_grid};
use glam::{DVec3, Vec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;

/// Seconds of a rendering, and of one in a smoke run.
const BUDGETS: [f64; 2] = [2.0, 0.2];
/// Pixels along a side.
const SIDES: [u32; 2] = [512, 16];

/// Makes a scene.
type MakeScene = fn() -> Result<Scene>;

/// A scene by its name.
struct Case {
    name: String,
    scene: MakeScene,
}

/// A grid of which next to nothing is dense, under a uniform sky.
fn sparse_grid(density: f32) -> Scene {
    let mut scene = Scene {
        environment: Some(Environment::uniform(Vec3::ONE)),
        ..Scene::default()
    };
    place_sparse_grid(&mut scene, density);
    let (eye, target) = (DVec3::new(0.5, 0.6, 2.5), DVec3::splat(0.5));
    scene.cameras.push(Camera::look_at("main", eye, target, DVec3::Y, 0.8));
    scene
}

/// Scenes that would never end.
const HOSTILE: [(&str, MakeScene); 4] = [
    ("a thousand equal triangles", || Ok(equal_triangles(1000))),
    ("a million equal triangles", || Ok(equal_triangles(1_000_000))),
    ("sparse grid, 10⁴ collisions a way", || Ok(sparse_grid(1e4))),
    ("sparse grid, 10⁶ collisions a way", || Ok(sparse_grid(1e6))),
];

fn cases(context: &Context<'_>) -> Vec<Case> {
    let hostile = HOSTILE.iter().map(|(name, scene)| Case {
        name: (*name).to_owned(),
        scene: *scene,
    });
    let hard = clerestory_hard_cases::all().iter();
    let hard = hard.filter(|case| case.techniques.is_some()).map(|case| Case {
        name: format!("hard case: {}", case.name),
        scene: case.picture,
    });
    hostile.chain(hard).take(context.pick(usize::MAX, 1)).collect()
}

rows! {
    /// A scene by a technique.
    struct Row = "Renderings that are stopped" by [scene, technique] {
        scene: String = "scene",
        technique: String = "technique",
        ended: f64 = "end of a rendering with a budget (s)",
        prepared: f64 = "until the first step (s)",
        longest: f64 = "longest step (s)",
        read: f64 = "picture and report (s)",
        cancelled: f64 = "from a stop request to the picture, at most (s)",
        steps: u64 = "steps",
        least: u64 = "samples of a pixel, at least",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "a budget of 2 s ends within: seconds",
        Bound::AtMost(3.0),
        |row: &Row| row.ended.into(),
    ),
    Criterion::each(
        "a stop request ends within: seconds",
        Bound::AtMost(1.0),
        |row: &Row| row.cancelled.into(),
    ),
    Criterion::each("something is done: steps", Bound::AtLeast(1.0), |row: &Row| {
        row.steps.into()
    })
    .in_every_form(),
];

/// A rendering with a budget, step by step.
fn stopped(renderer: &Renderer, scene: &str, options: &RenderOptions) -> Result<Row> {
    let clock = Instant::now();
    let mut rendering = renderer.start(options)?;
    let prepared = clock.elapsed().as_secs_f64();
    let (mut longest, mut steps) = (0.0f64, 0);
    loop {
        let begin = Instant::now();
        let done = rendering.step()?.is_none();
        longest = longest.max(begin.elapsed().as_secs_f64());
        if done {
            break;
        }
        steps += 1;
    }
    let begin = Instant::now();
    let rendered = rendering.finish()?;
    let read = begin.elapsed().as_secs_f64();
    Ok(Row {
        scene: scene.into(),
        technique: rendered.report.technique,
        ended: clock.elapsed().as_secs_f64(),
        prepared,
        longest,
        read,
        cancelled: prepared.max(longest) + read,
        steps,
        least: rendered.report.samples[0].into(),
    })
}

/// By each technique that takes the scene.
fn of_case(context: &Context<'_>, gpu: &Gpu, case: &Case) -> Result<Vec<Row>> {
    let scene = (case.scene)()?;
    let renderer = Renderer::new(gpu, &scene)?;
    let mut rows = Vec::new();
    for card in techniques::all() {
        let options = RenderOptions {
            technique: Some(card.id.into()),
            size: [context.pick(SIDES[0], SIDES[1]); 2],
            spp: 1 << 20,
            seed: 1,
            time_budget: Some(Duration::from_secs_f64(context.pick(BUDGETS[0], BUDGETS[1]))),
            ..RenderOptions::default()
        };
        // The first one compiles.
        let both = stopped(&renderer, &case.name, &options).and_then(|_| stopped(&renderer, &case.name, &options));
        match both {
            Ok(row) => rows.push(row),
            Err(Error::Unsupported { .. } | Error::MissingFeature { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        context.each(
            &cases(context),
            |case| case.name.clone(),
            |case| of_case(context, &gpu, case),
        )
    }

    fn findings(&self) -> Findings {
        let longest = self.iter().map(|row| row.ended).reduce(f64::max);
        Findings::of(self, CRITERIA)
            .headline("end of the rendering that took longest of those with a budget of 2 s (s)", longest.map(Measured::from))
            .note(
                "Techniques that refuse a scene have no row. A stop request comes at the worst time: when the technique begins to be prepared, or with the longest \
                 step, and the picture is read behind it. Grids of more than 2²⁴ tentative collisions a way are refused before anything is rendered.",
            )
    }
}
