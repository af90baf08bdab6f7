//! Rough spheres beside Cycles: the default's height-correlated masking, which Mitsuba lacks, and the compensation of metals.
//!
//! Oracle: pictures by Cycles, which shares no code with this engine. Its distribution `GGX` scatters once under height-correlated masking, so that
//! pictures agree within their noise, and those with separable masking must not: else the test could not fail. `MULTI_GGX` compensates by another
//! method, which leaves albedos comparable and lobes not. Where no Python with Blender is found nothing is measured, and the table says so; a
//! Python that is named but has no Blender is an error. Scenes and pictures go to the experiment's folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clerestory::film::png::{self, Rgb8};
use clerestory::film::z_test::{SIGNIFICANCE, Verdict};
use clerestory::film::{Picture, ToneMap, ZTest, z_test};
use clerestory::gpu::Gpu;
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::transport::random::SamplerKind;
use clerestory::{Error, Result};

use crate::agreement::{BLOCK, block_means, mean_squared_z};
use crate::cycles::scenes::{DISC, Source, Sphere, Substance};
use crate::cycles::{Distribution, PYTHON_VARIABLE, Peer, Rendered, Request, cycles_version, export};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::maps::sphere::sheet;
use crate::experiments::table::Table;

/// How to get what is missing.
const INSTALL: &str = "To measure: `python3.11 -m venv ~/cycles && ~/cycles/bin/pip install bpy==5.0.1`, then \
                       `CLERESTORY_CYCLES_PYTHON=~/cycles/bin/python`; tools/cycles/README.md has the details.";

/// What would have to be there.
const CYCLES: &str = "Cycles";

/// Pixels along a side.
const SIZE: u32 = 64;
const SMOKE_SIZE: u32 = 32;
/// Cycles' passes: their variance is known well enough from 100 on.
const PASSES: u32 = 128;
const SMOKE_PASSES: u32 = 32;
/// Samples per pixel in each; ours are as many in all.
const SAMPLES: u32 = 8;
/// First seed of Cycles' passes, which count on from it, and of ours.
const SEED: u32 = 11;
/// Tests of a run, each of values and of blocks, for which chance together is that of one: an alarm in a hundred runs.
const TESTS: f64 = 2.0 * 28.0;
/// From here on forms of masking differ by more than the noise of such pictures: at 0.3 by a thousandth at most angles.
const TOLD_APART_FROM: f64 = 0.6;
/// The picture of the page.
const SHOWN: &str = "spheres.png";

/// Ours, and what of Cycles' stands beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// One scattering, height-correlated.
    Correlated,
    /// One scattering, separable.
    Separable,
    /// As by default.
    Compensated,
}

impl Form {
    const ALL: [Self; 3] = [Self::Correlated, Self::Separable, Self::Compensated];

    fn name(self) -> &'static str {
        match self {
            Self::Correlated => "height-correlated masking",
            Self::Separable => "separable masking",
            Self::Compensated => "with compensation",
        }
    }

    fn beside(self) -> Distribution {
        match self {
            Self::Correlated | Self::Separable => Distribution::Ggx,
            Self::Compensated => Distribution::MultiGgx,
        }
    }
}

rows! {
    /// A sphere by both renderers.
    struct Row = "Rough spheres beside Cycles" by [surface, light, roughness, form] {
        surface: String = "surface",
        light: String = "light",
        roughness: f64 = "roughness",
        form: String = "ours",
        beside: String = "Cycles'",
        ours: f64 = "mean radiance, ours",
        theirs: f64 = "Cycles' mean",
        difference: Measured = "ours over Cycles' − 1 (%)",
        block: Option<f64> = "greatest of an 8 × 8 block (%)",
        verdict: String = "verdict",
        agrees: f64 = "agrees: 1, undecided: ½, differs: 0",
        mean_squared_z: f64 = "mean z²",
        worst_z: f64 = "worst z",
        worst_block_z: f64 = "worst z of a block",
        non_finite: u64 = "samples of ours that were not finite",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// Why nothing was measured.
    cause: Option<String>,
    /// Blender's version.
    version: String,
    /// Pixels along a side.
    size: u32,
    /// Samples per pixel, on both sides.
    samples: u32,
    spheres: Vec<Row>,
    /// Whether the run came as far as the spheres of the picture.
    is_shown: bool,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "one scattering under height-correlated masking agrees with Cycles, by values and by blocks; ½ where heavy tails leave it undecided",
        Bound::AtLeast(0.5),
        |row: &Row| row.agrees.into(),
    )
    .among(|row| row.is(Form::Correlated) && row.is_comparable())
    .because("verdicts of the z-test with one false alarm in a hundred runs")
    .needs(CYCLES),
    Criterion::each(
        "separable masking is told apart from Cycles from a roughness of 0.6 on: agrees: 1, undecided: ½, differs: 0",
        Bound::AtMost(0.0),
        |row: &Row| row.agrees.into(),
    )
    .among(|row| row.is(Form::Separable) && row.is_comparable() && row.roughness >= TOLD_APART_FROM)
    .because("a test that could not fail would show nothing")
    .needs(CYCLES),
    Criterion::each(
        "compensated albedos of the white metal are Cycles': ours over Cycles' − 1 (%)",
        Bound::Between(-1.0, 1.0),
        |row: &Row| row.difference,
    )
    .among(|row| row.is_albedo() && row.surface == Substance::WhiteMetal.name())
    .because("half of what an eye sees, by the tables of both")
    .needs(CYCLES),
    Criterion::each(
        "compensated albedos of coloured metals are Cycles': ours over Cycles' − 1 (%)",
        Bound::Between(-2.0, 2.0),
        |row: &Row| row.difference,
    )
    .among(|row| row.is_albedo() && row.surface != Substance::WhiteMetal.name())
    .because("what an eye sees: both methods take the mean of Fresnel's factor for all orders, and share out its powers differently")
    .needs(CYCLES),
    Criterion::each(
        "every sample is finite: those that are not",
        Bound::AtMost(0.0),
        |row: &Row| row.non_finite.into(),
    )
    .needs(CYCLES),
];

impl Row {
    fn is(&self, form: Form) -> bool {
        self.form == form.name()
    }

    /// Whether both renderers mask all light of the picture in the same way: not what went through rough glass.
    fn is_comparable(&self) -> bool {
        self.surface != Substance::Glass.name() || self.light == Source::Sun.name()
    }

    /// Whether its pixels are albedos with compensation.
    fn is_albedo(&self) -> bool {
        self.is(Form::Compensated) && self.light == Source::Sky.name()
    }

    /// A comparison of pictures of so many pixels along a side.
    fn of(sphere: &Sphere, form: Form, ours: &Ours, theirs: &Rendered, size: u32) -> Result<Self> {
        let (a, b) = (&ours.rendered, theirs);
        let alpha = SIGNIFICANCE / TESTS;
        let values = z_test(&a.radiance, &a.variance, &b.radiance, &b.variance, alpha)?;
        let [a_block, a_block_var, b_block, b_block_var] =
            [(&a.radiance, 1), (&a.variance, 2), (&b.radiance, 1), (&b.variance, 2)]
                .map(|(values, power)| block_means(values, size, power));
        let blocks = z_test(&a_block, &a_block_var, &b_block, &b_block_var, alpha)?;
        let [(mean, error), (their_mean, their_error)] = [a, b].map(|picture| disc_mean(picture, size));
        let ratio = mean / their_mean;
        let margin = z_most(TESTS as usize) * ratio * (error / mean).hypot(their_error / their_mean);
        let (agrees, verdict) = verdict(&values, &blocks);
        Ok(Self {
            surface: sphere.substance.name().into(),
            light: sphere.source.name().into(),
            roughness: sphere.roughness,
            form: form.name().into(),
            beside: form.beside().name().into(),
            ours: mean,
            theirs: their_mean,
            difference: Measured::within(100.0 * (ratio - 1.0), 100.0 * margin),
            block: greatest_of_blocks(&a_block, &b_block, size),
            verdict: verdict.into(),
            agrees,
            mean_squared_z: mean_squared_z(&a.radiance, &a.variance, &b.radiance, &b.variance),
            worst_z: values.worst_z,
            worst_block_z: blocks.worst_z,
            non_finite: ours.non_finite,
        })
    }
}

/// The worse of both verdicts, as a number and in a word.
fn verdict(values: &ZTest, blocks: &ZTest) -> (f64, &'static str) {
    let both = [values.verdict, blocks.verdict];
    if both.contains(&Verdict::Different) || !values.passes() {
        (0.0, "differs")
    } else if both.contains(&Verdict::HeavyTails) {
        (0.5, "undecided: heavy tails")
    } else {
        (1.0, "agrees")
    }
}

/// Mean of all channels over the disc that the sphere covers, and its standard deviation; channels of a pixel count as one.
fn disc_mean(picture: &Rendered, size: u32) -> (f64, f64) {
    let half = 0.5 * f64::from(size);
    let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
    let pixels = picture.radiance.chunks_exact(3).zip(picture.variance.chunks_exact(3));
    for (index, (radiance, of_mean)) in (0u32..).zip(pixels) {
        let from_middle = |at: u32| (f64::from(at) + 0.5) / half - 1.0;
        if from_middle(index % size).hypot(from_middle(index / size)) > DISC {
            continue;
        }
        sum += radiance.iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0;
        let deviation = of_mean.iter().map(|value| f64::from(*value).sqrt()).sum::<f64>() / 3.0;
        variance += deviation * deviation;
        count += 1.0;
    }
    (sum / count, f64::sqrt(variance) / count)
}

/// The greatest relative difference of a block's mean, of those blocks that lie in the disc, in %; `None` where none does, or all are black.
fn greatest_of_blocks(ours: &[f32], theirs: &[f32], size: u32) -> Option<f64> {
    let across = size / BLOCK;
    let half = 0.5 * f64::from(size);
    let is_inside = |block: u32| {
        let farthest = |at: u32| [at, at + 1].map(|edge| (f64::from(edge * BLOCK) / half - 1.0).abs());
        let [x, y] = [block % across, block / across].map(|at| farthest(at).into_iter().fold(0.0, f64::max));
        x.hypot(y) <= DISC
    };
    let blocks = (0..).zip(ours.chunks_exact(3).zip(theirs.chunks_exact(3)));
    let sum = |block: &[f32]| block.iter().map(|value| f64::from(*value)).sum::<f64>();
    let differences = blocks
        .filter(|(block, _)| is_inside(*block))
        .map(|(_, (ours, theirs))| (sum(ours), sum(theirs)))
        .filter(|(_, theirs)| *theirs > 0.0)
        .map(|(ours, theirs)| 100.0 * (ours / theirs - 1.0));
    differences.max_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// A picture of ours.
struct Ours {
    rendered: Rendered,
    non_finite: u64,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let named = std::env::var_os(PYTHON_VARIABLE);
        let python = named.clone().map_or_else(|| "python3".into(), PathBuf::from);
        match cycles_version(&python) {
            Err(cause) => without_cycles(cause, named.is_some()),
            Ok(version) => {
                context.watch.note(&format!("Cycles of Blender {version}"));
                let (spheres, is_shown) = spheres(context, &(context.gpu)()?, &python)?;
                Ok(Self {
                    cause: None,
                    version,
                    size: context.pick(SIZE, SMOKE_SIZE),
                    samples: context.pick(PASSES, SMOKE_PASSES) * SAMPLES,
                    spheres,
                    is_shown,
                })
            }
        }
    }

    fn findings(&self) -> Findings {
        if let Some(cause) = &self.cause {
            return Findings::from(vec![not_measured(cause)]).judged(&self.spheres, CRITERIA);
        }
        let found = Findings::of(&self.spheres, CRITERIA).headline(
            "spheres of one scattering that agree with Cycles' within noise (%)",
            agreeing(&self.spheres),
        );
        let found = if self.is_shown {
            found.picture(
                SHOWN,
                "Gold under a sun by this engine, above, and by Cycles, below: once scattered from smooth to rough, then with compensation.",
            )
        } else {
            found
        };
        found.note(format!(
            "Cycles of Blender {}, {size} × {size} pixels, {} samples per pixel on both sides. Spheres of flat faces. Under the sky, of radiance 1, a \
             pixel is the albedo towards the eye; means are over a disc that the sphere covers, with all channels, and so are the blocks. Under the sun, \
             from the side, glass shows light reflected once alone. Light that goes through rough glass is masked separably here and height-correlated \
             there, whatever the setting: glass under the sky is shown, not judged. So are compensated lobes under the sun: ours has a lobe of its own \
             for what scattered more than once, Cycles scales the one of single scattering.",
            self.version,
            self.samples,
            size = self.size,
        ))
    }
}

/// The share of comparable spheres of one scattering that agree, in %.
fn agreeing(spheres: &[Row]) -> Option<Measured> {
    let judged = spheres
        .iter()
        .filter(|row| row.is(Form::Correlated) && row.is_comparable());
    let all: Vec<f64> = judged.map(|row| if row.agrees == 1.0 { 100.0 } else { 0.0 }).collect();
    (!all.is_empty()).then(|| Measured::exact(all.iter().sum::<f64>() / all.len() as f64))
}

/// Every sphere in every form, and whether the picture of the page was written.
fn spheres(context: &Context<'_>, gpu: &Gpu, python: &Path) -> Result<(Vec<Row>, bool)> {
    let all = if context.smoke {
        vec![
            Sphere::new(Substance::WhiteMetal, Source::Sky, 1.0)?,
            Sphere::new(Substance::Gold, Source::Sky, 1.0)?,
        ]
    } else {
        Sphere::all()?
    };
    let folder = context.folder.join("scenes");
    let peer = Peer::new(python, &folder)?;
    let mut shown = Shown::default();
    let rows = context.each(&all, Sphere::name, |sphere| {
        compare(context, gpu, &peer, &folder, sphere, &mut shown)
    })?;
    let is_shown = !shown.once[0].is_empty();
    if is_shown {
        context.picture(SHOWN, &sheet(&shown.rows()));
    }
    Ok((rows, is_shown))
}

/// All forms of a sphere; those that are there when somebody asks to stop.
fn compare(
    context: &Context<'_>,
    gpu: &Gpu,
    peer: &Peer,
    folder: &Path,
    sphere: &Sphere,
    shown: &mut Shown,
) -> Result<Vec<Row>> {
    let size = context.pick(SIZE, SMOKE_SIZE);
    let passes = context.pick(PASSES, SMOKE_PASSES);
    let prefix = folder.join(sphere.name());
    let file = folder.join(format!("{}-scene.json", sphere.name()));
    export(&sphere.scene, "", [size; 2], sphere.bounces, &file)?;
    let scene = Arc::new(GpuScene::new(gpu, &sphere.scene)?);
    let mut of_distribution: Option<(Distribution, Rendered)> = None;
    let mut rows = Vec::new();
    for form in Form::ALL {
        // Glass is not compensated.
        if form == Form::Compensated && sphere.substance == Substance::Glass {
            continue;
        }
        let beside = form.beside();
        if of_distribution.as_ref().is_none_or(|(there, _)| *there != beside) {
            let request = Request {
                scene: &file,
                prefix: &prefix,
                distribution: beside,
                passes,
                samples: SAMPLES,
                seed: SEED,
            };
            of_distribution = peer.render(&request, context.watch)?.map(|rendered| (beside, rendered));
        }
        let Some((_, theirs)) = &of_distribution else { break };
        let ours = render(gpu, &scene, sphere, form, size, passes * SAMPLES)?;
        shown.add(sphere, form, [&ours.rendered, theirs], size)?;
        rows.push(Row::of(sphere, form, &ours, theirs, size)?);
    }
    Ok(rows)
}

/// Ours, by independent samples, of which the variance of a pixel's mean is known.
fn render(gpu: &Gpu, scene: &Arc<GpuScene>, sphere: &Sphere, form: Form, size: u32, samples: u32) -> Result<Ours> {
    let settings = PathTracerSettings {
        path_set: sphere.path_set.parse()?,
        sampler: SamplerKind::Pcg,
        seed: SEED,
        multiple_scattering: form == Form::Compensated,
        separable_masking: form == Form::Separable,
        ..PathTracerSettings::default()
    };
    let camera = sphere.scene.require_camera(None)?;
    let mut tracer = PathTracer::new(gpu, scene.clone(), camera, [size; 2], settings)?;
    tracer.render(samples)?;
    let (picture, non_finite) = tracer.picture()?;
    let values = |name| Ok::<_, Error>(picture.require(name)?.values().to_vec());
    Ok(Ours {
        rendered: Rendered {
            radiance: values("radiance")?,
            variance: values("variance")?,
        },
        non_finite: non_finite.total(),
    })
}

/// Pictures for the page: ours and Cycles' of gold under the sun, or of a smoke run's gold.
#[derive(Default)]
struct Shown {
    once: [Vec<Rgb8>; 2],
    compensated: [Vec<Rgb8>; 2],
}

impl Shown {
    fn add(&mut self, sphere: &Sphere, form: Form, both: [&Rendered; 2], size: u32) -> Result<()> {
        let kept = match form {
            Form::Correlated => &mut self.once,
            Form::Compensated => &mut self.compensated,
            Form::Separable => return Ok(()),
        };
        if sphere.substance != Substance::Gold || (sphere.source == Source::Sky && size == SIZE) {
            return Ok(());
        }
        for (row, rendered) in kept.iter_mut().zip(both) {
            let picture = Picture::from_radiance(size, size, rendered.radiance.clone())?;
            row.push(png::tone_mapped(picture.main_layer()?, size, &ToneMap::default()));
        }
        Ok(())
    }

    fn rows(self) -> Vec<Vec<Rgb8>> {
        let both = self.once.into_iter().zip(self.compensated);
        both.map(|(once, compensated)| once.into_iter().chain(compensated).collect())
            .collect()
    }
}

/// What follows from a Python without Blender: an error where somebody named that Python.
fn without_cycles(cause: Error, is_named: bool) -> Result<Found> {
    if is_named {
        return Err(cause);
    }
    Ok(Found {
        cause: Some(cause.to_string()),
        ..Found::default()
    })
}

fn not_measured(cause: &str) -> Table {
    let mut table = Table::new("Rough spheres beside Cycles", &["result"]);
    table.row([format!("not measured: bpy is not installed ({cause})").into()]);
    table.note(INSTALL);
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::findings::Verdict as Judgement;

    /// What tells how to get Cycles.
    const README: &str = include_str!("../../../../cycles/README.md");

    /// A picture of one value whose pixels have this deviation.
    fn flat(value: f32, deviation: f32, size: u32) -> Rendered {
        let values = (size * size * 3) as usize;
        Rendered {
            radiance: vec![value; values],
            variance: vec![deviation * deviation; values],
        }
    }

    fn row(source: Source, form: Form, roughness: f64, ours: f32, theirs: f32) -> Row {
        let sphere = Sphere::new(Substance::WhiteMetal, source, roughness).unwrap();
        let ours = Ours {
            rendered: flat(ours, 1e-3, SMOKE_SIZE),
            non_finite: 0,
        };
        Row::of(&sphere, form, &ours, &flat(theirs, 1e-3, SMOKE_SIZE), SMOKE_SIZE).unwrap()
    }

    #[test]
    fn without_cycles_the_table_says_how_to_get_it() {
        let cause = || Error::setting("python", "python3", "has no Blender");
        assert!(without_cycles(cause(), true).is_err());
        let found = without_cycles(cause(), false).unwrap().findings();
        assert_eq!((found.tables.len(), found.tables[0].fault()), (1, None));
        let text = found.tables[0].markdown();
        assert!(
            text.contains("not measured: bpy is not installed") && text.contains("pip install bpy"),
            "{text}"
        );
        let needs = |judgement: &Judgement| matches!(judgement, Judgement::Needs(what) if what == CYCLES);
        assert!(found.verdicts.iter().all(|judged| needs(&judged.verdict)));
    }

    #[test]
    fn the_version_is_that_of_the_instructions() {
        let install = INSTALL.split('`').nth(1).unwrap();
        assert!(README.contains(install), "{install}");
    }

    #[test]
    fn pictures_that_differ_fail_and_separable_ones_that_agree_do_too() {
        let verdicts = |rows: &[Row]| -> Vec<Judgement> {
            CRITERIA.iter().map(|criterion| criterion.judge(rows).verdict).collect()
        };
        let good = [
            row(Source::Sun, Form::Correlated, 0.6, 0.8, 0.8),
            row(Source::Sun, Form::Separable, 0.6, 0.8, 0.81),
            row(Source::Sky, Form::Compensated, 0.6, 1.0, 1.001),
        ];
        let holds = verdicts(&good);
        assert_eq!(
            (&holds[0], &holds[1], &holds[2]),
            (&Judgement::Holds, &Judgement::Holds, &Judgement::Holds)
        );
        assert_eq!(good[1].block.map(f64::signum), Some(-1.0));
        assert!(good[2].difference.low > -0.2 && good[2].difference.high < 0.0);
        let bad = [
            row(Source::Sun, Form::Correlated, 0.6, 0.8, 0.81),
            row(Source::Sun, Form::Separable, 0.6, 0.8, 0.8),
            row(Source::Sky, Form::Compensated, 0.6, 0.98, 1.0),
        ];
        let fails = verdicts(&bad);
        assert!(
            fails[..3]
                .iter()
                .all(|verdict| matches!(verdict, Judgement::Fails { .. })),
            "{fails:?}"
        );
        // A roughness at which both forms are too close to each other decides nothing.
        let smooth = [row(Source::Sun, Form::Separable, 0.3, 0.8, 0.8)];
        assert!(matches!(verdicts(&smooth)[1], Judgement::Needs(_)));
    }

    #[test]
    fn the_disc_holds_pixels_of_the_sphere_alone() {
        // Black in the disc but for one pixel in the middle, 1 outside of it.
        let mut picture = flat(1.0, 0.0, 16);
        for (index, pixel) in (0u32..).zip(picture.radiance.chunks_exact_mut(3)) {
            let [x, y] = [index % 16, index / 16].map(|at| (f64::from(at) + 0.5) / 8.0 - 1.0);
            if x.hypot(y) <= DISC {
                pixel.fill(if index == 8 * 16 + 8 { 3.0 } else { 0.0 });
            }
        }
        let (mean, deviation) = disc_mean(&picture, 16);
        // 112 of 256 pixels: π · 6² is 113.
        assert!((mean - 3.0 / 112.0).abs() < 1e-12 && deviation == 0.0, "{mean}");
        let blocks = |value: f32| vec![value; 8 * 8 * 3];
        assert_eq!(greatest_of_blocks(&blocks(1.5), &blocks(1.0), 64), Some(50.0));
        assert_eq!(greatest_of_blocks(&blocks(1.0), &blocks(0.0), 64), None);
        assert_eq!(greatest_of_blocks(&[1.0; 12], &[1.0; 12], 16), None);
    }
}
