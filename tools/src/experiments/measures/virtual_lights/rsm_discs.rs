//! Light that discs of reflective shadow maps lose by their radius, in both weightings, against that of all texels.
//!
//! Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. Oracle: virtual lights on the texels of the same views, seen through everything, whose mean is the sum over
//! all texels.

use std::sync::Arc;

use clerestory::film::picture;
use clerestory::film::png;
use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::gpu::Gpu;
use clerestory::raster::reflective::{rsm_disc_place, rsm_disc_weight, rsm_radical_inverse};
use clerestory::scene::Scene;
use clerestory::techniques::instant_radiosity::Bound;
use clerestory::techniques::instant_radiosity::many_light::{
    Gathering, ManyLight, ManyLightSettings, Placement, Visibility,
};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::DVec2;

use crate::experiments::findings::{Axes, Bound as Limit, Criterion, Findings, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Panel, finished, mean, tiled};
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
/// A disc's samples with their weights, and the light that discs of the published radius gather.
const DISC: &str = "disc.png";
const GATHERED: &str = "gathered.png";
/// Pixels along a side of either; the same of a smoke run.
const SHOWN_SIDE: [u32; 2] = [256, 32];
/// Samples of a disc that is shown, as many as published, and the frames of what they gather.
const SHOWN_SAMPLES: u32 = 400;
const SHOWN_FRAMES: u32 = 4;
/// Width over the panel's of the mark of a sample with the mean weight.
const MARK: f64 = 0.025;
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

/// The samples of a disc, each as a mark whose area is its weight.
fn disc_shown(side: u32, squared: bool) -> Panel {
    let (width, radius) = (f64::from(side), 0.5 * f64::from(side));
    let disc = std::f64::consts::PI * radius * radius;
    let mut panel: Panel = vec![[0; 3]; (side * side) as usize];
    for number in 0..SHOWN_SAMPLES {
        let along = (f64::from(number) + 0.5) / f64::from(SHOWN_SAMPLES);
        let point = DVec2::new(along, rsm_radical_inverse(number, 2));
        let middle = DVec2::splat(radius) + (1.0 - MARK) * rsm_disc_place(point, radius);
        let half = 0.5 * MARK * width * (rsm_disc_weight(along, radius, squared) / disc).sqrt();
        for (i, color) in panel.iter_mut().enumerate() {
            let pixel = DVec2::new((i % side as usize) as f64, (i / side as usize) as f64) + 0.5;
            if (pixel - middle).length() < half {
                *color = [255; 3];
            }
        }
    }
    panel
}

fn write_pictures(context: &Context<'_>, gpu: &Gpu) -> Result<()> {
    let side = context.pick(SHOWN_SIDE[0], SHOWN_SIDE[1]);
    let discs = [false, true].map(|squared| disc_shown(side, squared));
    context.picture(DISC, &tiled([side; 2], 1, &[Vec::from(discs)]));
    let scene = scene::load(SCENES[0])?;
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let form = Form {
        side,
        samples: SHOWN_SAMPLES,
        ..context.pick(FULL, SMOKE)
    };
    let mut rendering = rendering(gpu, (&scene, &on_device), form, Gathering::Disc, PUBLISHED)?;
    let gathered = finished(&mut rendering, SHOWN_FRAMES)?;
    let tone = ToneMap {
        exposure: 0.0,
        curve: ToneCurve::Photographic,
    };
    let radiance = gathered.require(picture::RADIANCE)?;
    context.picture(GATHERED, &png::tone_mapped(radiance, side, &tone));
    Ok(())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        write_pictures(context, &gpu)?;
        let scenes = context.first(&SCENES, 1);
        context.each(
            scenes,
            |address| short_name(address).to_owned(),
            |address| rows_of(context, &gpu, address),
        )
    }

    fn findings(&self) -> Findings {
        let published = self.iter().find(|row| row.weight == DENSITY && row.radius == PUBLISHED);
        let found = Findings::of(self, CRITERIA)
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
            );
        if self.is_empty() {
            return found;
        }
        found
            .picture(
                DISC,
                "400 samples of a disc, each as large as its weight: by the inverse of the density, and as published. They lie denser in the middle, and have more weight outside.",
            )
            .picture(
                GATHERED,
                "The Cornell box under a spot: what discs of the published radius gather of the light that is scattered once more.",
            )
    }
}
