//! Virtual lights and bidirectional paths against the path tracer on the same light paths: value by value, in their means, and in how their errors fall.
//!
//! Oracle: the path tracer's pictures of many samples. All samples are independent (PCG) and no two of a pixel share walks of the same pass, so that the variance of a pixel is that of its
//! mean; pixels of a pass share them, so that means have their errors from repeats with seeds of their own.

use clerestory::film::Picture;
use clerestory::film::picture::VARIANCE;
use clerestory::film::z_test::{SIGNIFICANCE, sidak_threshold, z_test};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::settings::Settings;
use clerestory::techniques::bidirectional::BidirectionalSettings;
use clerestory::techniques::instant_radiosity::{Bound as EdgeBound, Selection, VirtualLightSettings};
use clerestory::transport::random::SamplerKind;
use clerestory::{Result, scene};
use serde_json::json;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::jackknife::{self, mean_without};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::experiments::slope::Fit;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

/// Rooms, halls and closed forms, with lamps, points, spots, suns and skies, and walks of a pass of virtual lights: more where few of them come to what is seen. None has light that a path from
/// the eye cannot find.
const SCENES: [(&str, u32); 12] = [
    (SPHERE, WALKS),
    ("builtin:cornell-box", WALKS),
    ("builtin:cornell-box?source=point", WALKS),
    ("builtin:cornell-box?source=spot", WALKS),
    ("builtin:cornell-box?sphere=gold&boxes=tall", WALKS),
    ("builtin:furnace-box?rho=0.5", WALKS),
    ("builtin:sphere-light?rho=0.7&light=area&radius=0.3", WALKS),
    ("builtin:passage", 8 * WALKS),
    ("builtin:box-room", WALKS),
    ("builtin:shaded-lamp", WALKS),
    ("builtin:atrium", WALKS),
    ("builtin:conference", WALKS),
];
/// Where no virtual light is nearer than another to what it lights, so that none needs a bound.
const SPHERE: &str = "builtin:sphere-light?rho=0.5&frequency=12";
/// Scenes of a smoke run.
const FEW_SCENES: usize = 1;

/// What virtual lights light, and what bidirectional paths do but for lamps in view, whose outlines are rare and bright in pixels that they barely touch.
const PATHS: [&str; 2] = ["!L.*S[DG]S*E", "bounces=1.."];
/// Lamps in view: means are those of the pixels that see them, or none, all over.
const LAMPS: &str = "emitted";
/// Walks of a pass of virtual lights, unless the scene says otherwise. Pixels share them, so that more of them do more for means than more pixels.
const WALKS: u32 = 512;
/// Bounds of the geometry term over the one that is chosen by area and walks, three decades.
const BOUNDS: [(&str, f64); 3] = [
    ("virtual lights, a bound of 0.03", 0.03),
    ("virtual lights, the default bound", 1.0),
    ("virtual lights, a bound of 30", 30.0),
];
const UNBOUNDED: &str = "virtual lights, no bound";
const CUTS: &str = "virtual lights, cuts of 16";
const BIDIRECTIONAL: &str = "bidirectional paths";

const FULL: Form = Form {
    sides: [16, 64],
    repeats: 32,
    reference: [65_536, 16_384],
    lamps: 256,
    budgets: &[1, 4, 16],
};
const SMOKE: Form = Form {
    sides: [8, 8],
    repeats: 2,
    reference: [256, 256],
    lamps: 16,
    budgets: &[1, 4],
};
/// The reference's seed; pictures have those after it.
const SEED: u32 = 1;

#[derive(Clone, Copy)]
struct Form {
    /// Pixels along a side, by [`PATHS`].
    sides: [u32; 2],
    /// Pictures of each budget.
    repeats: u32,
    /// Samples per pixel of references, by [`PATHS`], and of the pictures that say where lamps are in view.
    reference: [u32; 2],
    lamps: u32,
    /// Samples per pixel.
    budgets: &'static [u32],
}

rows! {
    /// A technique with its settings in a scene.
    struct Row = "Against the path tracer on the same light paths" by [scene, technique] {
        scene: String = "scene",
        technique: String = "technique",
        accepted: f64 = "accepted share of the values",
        worst_z: f64 = "worst z",
        verdict: String = "z-test",
        passes: bool = "passes",
        difference: Measured = "mean over the path tracer's − 1",
        slope: Option<Measured> = "slope of log RMSE",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("z-tests are passed", Bound::AtLeast(1.0), |row: &Row| row.passes.into())
        .because("the whole family of pictures and values has a false alarm once in a hundred runs, by Šidák"),
    Criterion::each(
        "means are the path tracer's: over it, less 1",
        Bound::Between(-0.005, 0.005),
        |row: &Row| row.difference,
    ),
    Criterion::each(
        "errors fall as those of independent samples: slopes",
        Bound::Between(-0.55, -0.45),
        |row: &Row| row.slope.unwrap_or(Measured::exact(f64::NAN)),
    )
    .among(|row| row.slope.is_some()),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |(address, _): &(&str, u32)| short_name(address).to_owned();
        let rows = context.each_kept(&gpu, context.first(&SCENES, FEW_SCENES), name, |case| {
            of_scene(context, &gpu, *case)
        })?;
        Ok(Self { rows })
    }

    fn findings(&self) -> Findings {
        let worst = self.rows.iter().map(|row| row.difference.value.abs()).reduce(f64::max);
        Findings::of(&self.rows, CRITERIA)
            .headline("greatest difference of a mean, relative", worst.map(Measured::exact))
            .note(
                "Bounds are those of the geometry term over walks / area. z-tests are of the means of all pictures of the most samples. Means are those of pixels without the outline of a lamp. They and \
                 slopes lie within their intervals with a probability of 95 %, by the jackknife over the pictures of a budget. Errors that cannot be told from the reference's own have no slope: in the sphere, where all lights bring \
                 the same, those without a bound.",
            )
    }
}

/// A technique with settings.
struct Variant {
    name: &'static str,
    technique: &'static str,
    /// Which of [`PATHS`].
    paths: usize,
    settings: Settings,
}

/// All of a scene whose surfaces have that area, m².
fn variants((address, walks): (&str, u32), area: f64) -> Vec<Variant> {
    let density = f64::from(walks) / area;
    let lights = |name, bound, bound_value: f64, selection| Variant {
        name,
        technique: "vpl",
        paths: 0,
        settings: VirtualLightSettings {
            walks,
            bound,
            bound_value: bound_value as f32,
            selection,
            cut_size: 16,
            sampler: SamplerKind::Pcg,
            ..VirtualLightSettings::default()
        }
        .into(),
    };
    let bounded = BOUNDS.map(|(name, factor)| lights(name, EdgeBound::Geometry, factor * density, Selection::All));
    let unbounded = (address == SPHERE).then(|| lights(UNBOUNDED, EdgeBound::None, 0.0, Selection::All));
    let bidirectional = Variant {
        name: BIDIRECTIONAL,
        technique: "bdpt",
        paths: 1,
        settings: BidirectionalSettings {
            samples_at_once: 1,
            sampler: SamplerKind::Pcg,
            least_bounces: 1,
            ..BidirectionalSettings::default()
        }
        .into(),
    };
    let cuts = lights(CUTS, EdgeBound::Geometry, density, Selection::Cuts);
    let all = bounded.into_iter().chain(unbounded);
    all.chain([cuts, bidirectional]).collect()
}

/// How many pictures are tested in all: each scene's, and one more in the sphere.
fn family() -> usize {
    SCENES.iter().map(|case| variants(*case, 1.0).len()).sum()
}

fn of_scene(context: &Context<'_>, gpu: &Gpu, case: (&str, u32)) -> Result<Vec<Row>> {
    let (address, _) = case;
    let form = context.pick(FULL, SMOKE);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let picture =
        |technique: &str, paths: usize, settings: &Settings, spp: u32, seed: u32| -> Result<Option<Picture>> {
            let options = RenderOptions {
                technique: Some(technique.into()),
                size: [form.sides[paths]; 2],
                spp,
                seed,
                settings: settings.clone(),
                ..RenderOptions::default()
            };
            let rendered = render(&renderer, &options, context.watch)?;
            Ok(rendered.map(|rendered| rendered.picture))
        };
    let traced = |paths: usize, set: &str, spp: u32| {
        let settings: Settings = json!({ "sampler": "pcg", "path_set": set }).into();
        picture("path", paths, &settings, spp, SEED)
    };
    let mut references = Vec::new();
    for (paths, set) in PATHS.iter().enumerate() {
        let reference = traced(paths, set, form.reference[paths])?;
        let (Some(reference), Some(lamps)) = (reference, traced(paths, LAMPS, form.lamps)?) else {
            return Ok(Vec::new());
        };
        references.push(Reference::new(reference, &lamps)?);
    }
    let mut rows = Vec::new();
    for variant in variants(case, renderer.gpu_scene().surface_area()) {
        let mut pictures = Vec::new();
        for (index, spp) in form.budgets.iter().enumerate() {
            let mut of_budget = Vec::new();
            for repeat in 0..form.repeats {
                let seed = SEED + 1 + index as u32 * form.repeats + repeat;
                let Some(picture) = picture(variant.technique, variant.paths, &variant.settings, *spp, seed)? else {
                    return Ok(Vec::new());
                };
                of_budget.push(picture);
            }
            pictures.push(of_budget);
        }
        rows.push(row(
            address,
            variant.name,
            form.budgets,
            &pictures,
            &references[variant.paths],
        )?);
    }
    Ok(rows)
}

/// The path tracer's picture.
struct Reference {
    picture: Picture,
    /// Of each value, whether its pixel has no outline of a lamp, which would be most of its noise.
    counts: Vec<bool>,
}

impl Reference {
    fn new(picture: Picture, lamps: &Picture) -> Result<Self> {
        let values = lamps.main_layer()?.values().iter();
        let even = |(value, variance): (&f32, &f32)| *variance <= f32::EPSILON * value * value;
        let counts = values.zip(lamps.require(VARIANCE)?.values()).map(even).collect();
        Ok(Self { picture, counts })
    }

    /// The mean of the values that count; 0 of none.
    fn mean(&self, values: &[f32]) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for (value, _) in values.iter().zip(&self.counts).filter(|(_, counts)| **counts) {
            (sum, count) = (sum + f64::from(*value), count + 1);
        }
        sum / f64::from(count.max(1))
    }
}

/// What pictures by budget and repeat say against a reference.
fn row(
    address: &str,
    technique: &str,
    budgets: &[u32],
    pictures: &[Vec<Picture>],
    reference: &Reference,
) -> Result<Row> {
    let picture = &reference.picture;
    let (values, variance) = (picture.main_layer()?.values(), picture.require(VARIANCE)?.values());
    let most = pictures.last().map_or(&[][..], Vec::as_slice);
    let (together, of_together) = mean_of(most)?;
    let alpha = sidak_threshold(SIGNIFICANCE, family());
    let test = z_test(&together, &of_together, values, variance, alpha)?;

    let expected = reference.mean(values);
    let count = reference.counts.iter().filter(|counts| **counts).count().max(1);
    // Channels of a pixel may be one and the same.
    let noise = (3.0 * reference.mean(variance) / count as f64).sqrt();
    let mut differences = Vec::new();
    for repeat in 0..most.len() {
        let (mut sum, mut samples) = (0.0, 0.0);
        for (of_budget, spp) in pictures.iter().zip(budgets) {
            sum += f64::from(*spp) * reference.mean(of_budget[repeat].main_layer()?.values());
            samples += f64::from(*spp);
        }
        differences.push(sum / samples / expected - 1.0);
    }
    let of_differences = |left_out| mean_without(&differences, left_out);

    let mut errors = Vec::new();
    let mut of_reference = 0.0f64;
    for of_budget in pictures {
        let found: Vec<_> = of_budget
            .iter()
            .map(|found| unbiased::measure(found, picture))
            .collect::<Result<_>>()?;
        of_reference = found
            .iter()
            .map(|error| error.reference_error)
            .fold(of_reference, f64::max);
        errors.push(found.iter().map(|error| error.mse).collect());
    }
    let work: Vec<f64> = budgets.iter().map(|spp| f64::from(*spp)).collect();
    let slope = Fit::of(&work, &errors, of_reference).map(|fit| {
        let slope = fit.slope();
        Measured::within(slope.value, jackknife::margin(slope.standard_error, slope.repeats))
    });
    Ok(Row {
        scene: short_name(address).into(),
        technique: technique.into(),
        accepted: test.accepted_fraction,
        worst_z: test.worst_z,
        verdict: test.verdict.to_string(),
        passes: test.passes(),
        difference: jackknife::measured(differences.len(), noise / expected, of_differences),
        slope,
    })
}

/// The mean of independent pictures, and its variance.
fn mean_of(pictures: &[Picture]) -> Result<(Vec<f32>, Vec<f32>)> {
    let count = pictures.len() as f64;
    let mut sums = [const { Vec::<f64>::new() }; 2];
    for picture in pictures {
        let layers = [picture.main_layer()?.values(), picture.require(VARIANCE)?.values()];
        for (sum, values) in sums.iter_mut().zip(layers) {
            sum.resize(values.len(), 0.0);
            sum.iter_mut()
                .zip(values)
                .for_each(|(sum, value)| *sum += f64::from(*value));
        }
    }
    let [values, variances] = sums;
    let scaled = |sums: Vec<f64>, by: f64| sums.into_iter().map(|sum| (sum / by) as f32).collect();
    Ok((scaled(values, count), scaled(variances, count * count)))
}
