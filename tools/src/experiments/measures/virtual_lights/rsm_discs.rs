//! Light that discs of reflective shadow maps lose by their radius, in both weightings, against that of all texels.
//!
//! Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. Oracle: virtual lights on the texels of the same views, seen through everything, whose mean is the sum over
//! all texels.

use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::instant_radiosity::Bound;
use clerestory::techniques::instant_radiosity::many_light::{
    Gathering, ManyLight, ManyLightSettings, Placement, Visibility,
};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};

use crate::experiments::findings::{Axes, Bound as Limit, Criterion, Findings, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{finished, mean};
use crate::experiments::reference::short_name;
use crate::timing::median;

/// Two spots, each seen in one view, and a point, whose six views end at the edges of a cube.
const SCENES: [&str; 3] = [
    "builtin:cornell-box?source=spot",
    "builtin:lamp-hall?n=1&source=spot",
    "builtin:cornell-box?source=point",
];
/// Radii over the width of a view; the published one is 0.3, and the last is more than a view's diagonal.
const RADII: [f64; 7] = [0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.5];
/// The same of a smoke run.
const SMOKE_RADII: [f64; 2] = [0.3, 1.5];
const PUBLISHED: f64 = 0.3;
const WHOLE: f64 = 1.5;
const DENSITY: &str = "inverse of the density";
const SQUARED: &str = "published";
const WEIGHTS: [(&str, Gathering); 2] = [(DENSITY, Gathering::Disc), (SQUARED, Gathering::DiscSquared)];
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";

const FULL: Form = Form {
    side: 32,
    frames: 8,
    samples: 512,
    lights: 4096,
};
const SMOKE: Form = Form {
    side: 8,
    frames: 2,
    samples: 64,
    lights: 256,
};
/// Seeds of each; the same of a smoke run.
const SEEDS: [u32; 2] = [5, 2];

#[derive(Clone, Copy)]
struct Form {
    /// Pixels along a side.
    side: u32,
    /// Frames of a picture.
    frames: u32,
    /// Of a disc.
    samples: u32,
    /// Virtual lights of a frame of the oracle.
    lights: u32,
}

rows! {
    /// A radius of discs.
    struct Row = "Light of discs by their radius" by [scene, weight, radius] {
        scene: String = "scene",
        weight: String = "weight",
        radius: f64 = "radius over the width of a view",
        kept: Repeats = "light over that of all texels",
        lost: f64 = "lost (%)",
        grows: Repeats = "light over that of the next smaller disc",
    }
}

/// What was found.
pub type Found = Vec<Row>;

impl Row {
    /// Of a light that has one view.
    fn has_one_view(&self) -> bool {
        self.scene.ends_with("spot")
    }
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "a disc over all of a spot's view has the light of all texels: ratio",
        Limit::Between(0.98, 1.02),
        |row: &Row| (&row.kept).into(),
    )
    .among(|row| row.has_one_view() && row.weight == DENSITY && row.radius == WHOLE),
    Criterion::each(
        "a larger disc has no less light: over that of the next smaller one",
        Limit::AtLeast(0.99),
        |row: &Row| (&row.grows).into(),
    )
    .among(|row| row.weight == DENSITY)
    .because("a hundredth is the noise of so many samples"),
    Criterion::each(
        "discs of the published radius lose light: ratio",
        Limit::AtMost(1.0),
        |row: &Row| (&row.kept).into(),
    )
    .among(|row| row.weight == DENSITY && row.radius == PUBLISHED),
];

/// A rendering of indirect light that comes through everything.
fn rendering(
    gpu: &Gpu,
    (scene, on_device): (&Scene, &Arc<GpuScene>),
    form: Form,
    gathering: Gathering,
    radius: f64,
) -> Result<ManyLight> {
    let settings = ManyLightSettings {
        lights: form.lights,
        placement: Placement::Rsm,
        gathering,
        disc_samples: form.samples,
        disc_radius: radius as f32,
        visibility: Visibility::None,
        interleave: 1,
        filter: false,
        bound: Bound::None,
        path_set: INDIRECT.parse()?,
        ..ManyLightSettings::default()
    };
    let camera = scene.require_camera(None)?;
    ManyLight::new(gpu, Arc::clone(on_device), camera, [form.side; 2], settings)
}

/// Mean of a picture with each of the seeds.
fn brightness(context: &Context<'_>, rendering: &mut ManyLight, frames: u32) -> Result<Repeats> {
    let mut means = Vec::new();
    for seed in 0..context.pick(SEEDS[0], SEEDS[1]) {
        rendering.restart(seed)?;
        means.push(mean(&finished(rendering, frames)?)?);
    }
    Ok(Repeats(means))
}

fn rows_of(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Row>> {
    let form = context.pick(FULL, SMOKE);
    let scene = scene::load(address)?;
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let mean = |gathering, radius| {
        let mut rendering = rendering(gpu, (&scene, &on_device), form, gathering, radius)?;
        brightness(context, &mut rendering, form.frames)
    };
    let all = mean(Gathering::Lights, PUBLISHED)?;
    let mut rows = Vec::new();
    for (weight, gathering) in WEIGHTS {
        let mut smaller: Option<Repeats> = None;
        for radius in context.pick(&RADII[..], &SMOKE_RADII[..]) {
            let found = mean(gathering, *radius)?;
            let kept = found.over(&all);
            rows.push(Row {
                scene: short_name(address).into(),
                weight: weight.into(),
                radius: *radius,
                lost: 100.0 * (1.0 - median(kept.0.clone())),
                kept,
                grows: found.over(smaller.as_ref().unwrap_or(&found)),
            });
            smaller = Some(found);
        }
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let scenes = context.first(&SCENES, 1);
        context.each(
            scenes,
            |address| short_name(address).to_owned(),
            |address| rows_of(context, &gpu, address),
        )
    }

    fn findings(&self) -> Findings {
        let published = self.iter().find(|row| row.weight == DENSITY && row.radius == PUBLISHED);
        Findings::of(self, CRITERIA)
            .headline(
                "light of discs of the published radius over that of all texels, in the Cornell box under a spot",
                published.map(|row| row.kept.measured()),
            )
            .note(format!(
                "{0} × {0} pixels, {1} frames with {2} samples of a disc, over the mean with {3} virtual lights a frame on the same views, which come through everything, too; as many seeds \
                 as there are repeats. A point's views show what lies before them alone, so that discs lose what comes from behind their edges however large they are; places beside a spot's cone are shown beside its view.",
                FULL.side, FULL.frames, FULL.samples, FULL.lights
            ))
            .curves(
                "radius",
                "Light of discs over that of all texels, by their radius",
                Axes::even("radius over the width of a view", "light over that of all texels", 1.2, (6, 0.25)),
                curves(
                    self,
                    |row| format!("{}, {}", row.scene, row.weight),
                    |row| (row.radius, row.kept.measured()),
                ),
            )
    }
}
