//! Indirect light that is blended with that of the frame before: how much less noise there is, and what is left of other frames while the camera moves.
//!
//! Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §2.2.4. Oracles: the closed form √((1 - c)/(1 + c)) of independent
//! frames, and the same frames without a history, of kept lights, which have no noise.

use std::ops::Range;
use std::sync::Arc;

use clerestory::film::{picture, png};
use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings, Placement};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use glam::Vec3;

use super::vpl_incremental::{self, Subject};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::finished;
use crate::experiments::reference::short_name;

const FULL: Form = Form {
    side: 48,
    lights: 512,
    interleave: 16,
    warm: 64,
    frames: 120,
    turns: 6,
    kept: 128,
    steps: 16,
};
const SMOKE: Form = Form {
    side: 12,
    lights: 16,
    interleave: 2,
    warm: 4,
    frames: 6,
    turns: 2,
    kept: 16,
    steps: 3,
};
/// As where lights are kept, and one with much that is hidden.
const SCENES: [(&str, bool, Vec3, Vec3); 3] = [
    vpl_incremental::SCENES[0],
    vpl_incremental::SCENES[1],
    (
        "builtin:conference",
        false,
        Vec3::new(0.35, 0.8, 0.5),
        Vec3::new(0.005, 0.0, 0.0),
    ),
];
/// Greatest confidences, and a history that keeps nothing.
const CONFIDENCES: [f32; 2] = [0.9, 0.95];
const NOTHING: f32 = 1e-6;
/// By how much the camera goes on in a frame, over the diagonal of the box around the scene.
const STEP: f32 = 0.003;
/// Pixels about those that were hidden in which ghosts do not count.
const BAND: usize = 2;
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";
const SHOWN: &str = "vpl-history.png";

/// Pixels along a side, lights, tiles along a side, frames until nothing of the first ones is left, frames of a turn, and turns; kept lights and frames of a camera that moves.
#[derive(Clone, Copy)]
struct Form {
    side: u32,
    lights: u32,
    interleave: u32,
    warm: u32,
    frames: u32,
    turns: usize,
    kept: u32,
    steps: u32,
}

rows! {
    /// Frames of new walks with one confidence, whatever changes.
    struct Noise = "Noise of still pictures" by [scene, confidence] {
        scene: String = "scene",
        confidence: String = "confidence",
        formula: f64 = "√((1 − c)/(1 + c))",
        noise: Repeats = "noise over that without a history",
        over: Repeats = "noise over the closed form",
    }
}
rows! {
    /// Frames of kept lights under a camera that moves.
    struct Ghosts = "What is left of other frames while the camera moves" by [scene] {
        scene: String = "scene",
        counted: f64 = "share of the pixels beyond two of what was hidden",
        confidence: f64 = "mean confidence there",
        energy: f64 = "energy of ghosts there over that of the light, worst frame",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    noise: Vec<Noise>,
    ghosts: Vec<Ghosts>,
}

const OF_NOISE: &[Criterion<Noise>] = &[Criterion::each(
    "noise is that of the closed form within 5 %: ratio",
    Bound::Between(0.95, 1.05),
    |row: &Noise| row.over.measured(),
)];

const OF_GHOSTS: &[Criterion<Ghosts>] = &[Criterion::each(
    "beyond two pixels about what was hidden ghosts have a hundredth of the energy at most: the share",
    Bound::AtMost(0.01),
    |row: &Ghosts| row.energy.into(),
)];

fn renderer(
    gpu: &Gpu,
    scene: &Arc<GpuScene>,
    subject: &Subject,
    settings: ManyLightSettings,
    side: u32,
) -> Result<ManyLight> {
    ManyLight::new(gpu, Arc::clone(scene), &subject.scene.cameras[0], [side; 2], settings)
}

/// A frame that begins a picture.
fn frame(renderer: &mut ManyLight, camera: &Camera) -> Result<Vec<f32>> {
    renderer.set_camera(camera)?;
    let picture = finished(renderer, 1)?;
    Ok(picture.require(picture::RADIANCE)?.values().to_vec())
}

/// Frames of one rendering, as sums that tell of their noise.
#[derive(Default)]
struct Sums {
    /// Of all frames, by value.
    all: Vec<f64>,
    /// Of the frames of each turn, by value, and of their squares.
    turns: Vec<[Vec<f64>; 2]>,
}

impl Sums {
    fn add(&mut self, radiance: &[f32], turn: Option<usize>) {
        self.all.resize(radiance.len(), 0.0);
        let turn = turn.map(|turn| {
            while self.turns.len() <= turn {
                self.turns.push([vec![0.0; radiance.len()], vec![0.0; radiance.len()]]);
            }
            &mut self.turns[turn]
        });
        let values = radiance.iter().map(|value| f64::from(*value));
        self.all
            .iter_mut()
            .zip(values.clone())
            .for_each(|(sum, value)| *sum += value);
        if let Some([sums, squares]) = turn {
            for (i, value) in values.enumerate() {
                sums[i] += value;
                squares[i] += value * value;
            }
        }
    }

    /// Squared deviation from these means in each turn, of a frame's value, the mean over the picture.
    fn deviations(&self, means: &[f64], frames: f64) -> Vec<f64> {
        let of_turn = |[sums, squares]: &[Vec<f64>; 2]| {
            let of = |i: usize| squares[i] / frames - 2.0 * means[i] * sums[i] / frames + means[i] * means[i];
            (0..means.len()).map(of).sum::<f64>() / means.len() as f64
        };
        self.turns.iter().map(of_turn).collect()
    }
}

/// The mean of all frames without a history knows each of these: by n frames deviations from it are less by a share 1/n of the variance of a frame, for frames with
/// a history as for those without, and the share is added.
fn noise_of_scene(gpu: &Gpu, subject: &Subject, scene: &Arc<GpuScene>, name: &str, form: Form) -> Result<Vec<Noise>> {
    let of = |history| {
        let settings = ManyLightSettings {
            lights: form.lights,
            interleave: form.interleave,
            filter: false,
            history,
            history_position: 0.0,
            history_normal: 0.0,
            history_light: 0.0,
            history_bound: 0.0,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        renderer(gpu, scene, subject, settings, form.side)
    };
    let mut renderers = [of(NOTHING)?, of(CONFIDENCES[0])?, of(CONFIDENCES[1])?];
    let mut sums: [Sums; 3] = Default::default();
    let all = form.warm + form.frames * form.turns as u32;
    for number in 0..all {
        let turn = number
            .checked_sub(form.warm)
            .map(|number| (number / form.frames) as usize);
        for (renderer, sums) in renderers.iter_mut().zip(&mut sums) {
            let radiance = frame(renderer, &subject.scene.cameras[0])?;
            sums.add(&radiance, turn);
        }
    }
    let n = f64::from(all);
    let means: Vec<f64> = sums[0].all.iter().map(|sum| sum / n).collect();
    let [without, with @ ..] = sums.map(|sums| sums.deviations(&means, form.frames.into()));
    let mean = without.iter().sum::<f64>() / without.len() as f64;
    let missing = mean / (n - 1.0);
    let rows = CONFIDENCES.iter().zip(with).map(|(c, with)| {
        let formula = ((1.0 - f64::from(*c)) / (1.0 + f64::from(*c))).sqrt();
        let pairs = with.iter().zip(&without);
        let ratios: Vec<f64> = pairs
            .map(|(with, without)| ((with + missing) / (without + missing)).sqrt())
            .collect();
        Noise {
            scene: name.into(),
            confidence: format!("{c:.2}"),
            formula,
            over: Repeats(ratios.iter().map(|ratio| ratio / formula).collect()),
            noise: Repeats(ratios),
        }
    });
    Ok(rows.collect())
}

/// Whether a pixel and those about it have a confidence.
fn is_beyond(confidence: &[f32], side: usize, [x, y]: [usize; 2]) -> bool {
    let around = |i: usize| -> Range<usize> { i.saturating_sub(BAND)..(i + BAND + 1).min(side) };
    around(y).all(|y| around(x).all(|x| confidence[y * side + x] > 0.0))
}

fn ghosts_of_scene(
    context: &Context<'_>,
    gpu: &Gpu,
    subject: &Subject,
    scene: &Arc<GpuScene>,
    (name, shows): (&str, bool),
    form: Form,
) -> Result<Ghosts> {
    let of = |history| {
        let settings = ManyLightSettings {
            lights: form.kept,
            placement: Placement::Incremental,
            interleave: 1,
            history,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        renderer(gpu, scene, subject, settings, form.side)
    };
    let (mut with, mut without) = (of(CONFIDENCES[1])?, of(0.0)?);
    let mut camera = subject.scene.cameras[0].clone();
    let aside = camera.transform.matrix3.x_axis.normalize_or_zero();
    let by = aside * f64::from(STEP * subject.size.length());
    let side = form.side as usize;
    let mut row = Ghosts {
        scene: name.into(),
        ..Ghosts::default()
    };
    let mut judged = 0.0;
    for number in 0..=form.steps {
        let (found, truth) = (frame(&mut with, &camera)?, frame(&mut without, &camera)?);
        camera.transform.translation += by;
        // The first frame has none before it.
        if number == 0 {
            continue;
        }
        let confidence = with.confidence()?;
        let (mut counted, mut confident, mut ghosts, mut energy) = (0u64, 0.0, 0.0, 0.0);
        for (i, (found, truth)) in found.chunks_exact(3).zip(truth.chunks_exact(3)).enumerate() {
            if !is_beyond(&confidence, side, [i % side, i / side]) {
                continue;
            }
            counted += 1;
            confident += f64::from(confidence[i]);
            for (found, truth) in found.iter().zip(truth) {
                ghosts += f64::from(found - truth).powi(2);
                energy += f64::from(*truth).powi(2);
            }
        }
        let share = counted as f64 / confidence.len() as f64;
        row.counted += share;
        if counted > 0 && energy > 0.0 {
            judged += 1.0;
            row.confidence += confident / counted as f64;
            row.energy = row.energy.max(ghosts / energy);
        }
        if shows && number == form.steps {
            context.picture(SHOWN, &png::false_color(&confidence, form.side, CONFIDENCES[1])?);
        }
    }
    if judged == 0.0 {
        return Err(Error::setting(
            "scene",
            name,
            "has no pixel that a history is judged at",
        ));
    }
    row.counted /= f64::from(form.steps);
    row.confidence /= judged;
    Ok(row)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let form = context.pick(FULL, SMOKE);
        let mut ghosts = Vec::new();
        let of_scene = |case: &(&str, bool, Vec3, Vec3)| {
            let subject = Subject::new(*case)?;
            let scene = Arc::new(GpuScene::new(&gpu, &subject.scene)?);
            let name = short_name(case.0).to_owned();
            let shows = !context.smoke && ghosts.is_empty();
            ghosts.push(ghosts_of_scene(
                context,
                &gpu,
                &subject,
                &scene,
                (name.as_str(), shows),
                form,
            )?);
            noise_of_scene(&gpu, &subject, &scene, &name, form)
        };
        let noise = context.each(
            context.first(&SCENES, 1),
            |(address, ..)| short_name(address).to_owned(),
            of_scene,
        )?;
        Ok(Self { noise, ghosts })
    }

    fn findings(&self) -> Findings {
        let strongest = format!("{:.2}", CONFIDENCES[1]);
        let most = self.noise.iter().filter(|row| row.confidence == strongest);
        let of_noise = Findings::of(&self.noise, OF_NOISE)
            .headline(
                "noise with a confidence of 0.95 over that without a history, geometric mean of three scenes",
                geometric_mean(most.map(|row| row.noise.measured())),
            )
            .note(format!(
                "{0} × {0} pixels, {1} new walks a frame in {2} by {2} tiles without a filter, one confidence whatever changes; {3} frames after {4} first ones are a turn, of {5}. \
                 Noise is the root of the squared deviation from the mean of all frames, the mean over the picture.",
                FULL.side, FULL.lights, FULL.interleave, FULL.frames, FULL.warm, FULL.turns,
            ));
        let ghosts = Findings::of(&self.ghosts, OF_GHOSTS).note(format!(
            "{0} × {0} pixels, {1} kept lights at all pixels, whose frames have no noise, with the defaults and a greatest confidence of 0.95; in each of {2} frames the camera goes aside by {3} of the scene's diagonal.",
            FULL.side, FULL.kept, FULL.steps, STEP,
        ));
        let all = of_noise.and(ghosts);
        if self.ghosts.is_empty() {
            return all;
        }
        all.picture(
            SHOWN,
            "The confidence of the last frame in the Cornell box, under a camera that goes to the right: bright where light is that of frames before, black where it was hidden.",
        )
    }
}
