//! Glossy reflections of a map under glossiness that varies from pixel to pixel: one and several boxes of a summed-area table and prefiltered
//! levels against the lobe's own integral; what tables cost, and how exact their numbers are.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.6. Oracle: the sum over all texels in f64, and means of boxes in f64.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::box_lobe::Lobe;
use clerestory::maps::spherical_sat::{SatImage, SatNumbers, SatRange, SphericalSat};
use glam::{DVec3, Vec3, Vec4};

use super::glossy_look_ups::{
    Filtered, Fit, LEAST_ALPHA, LEVELS, LOBES, MAP, SHOWN_NESTED, SHOWN_RINGS, by_lobes, by_one_box, errors, filled,
    filtered_sizes, fits, greatest_step, image, pixels, shown, truth,
};
use super::lobe_errors::{LobeSource, half_angle};
use super::sphere::{Sphere, sheet};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;
use crate::timing::timed;

/// Rows of the map that is reflected, and of those of which tables are timed.
const TEXELS: u32 = 128;
const SIZES: [u32; 4] = [64, 128, 256, 512];
/// Pixels of the sphere along a side.
const SIDE: u32 = 160;
const EYE: DVec3 = DVec3::new(1.0, 0.3, -0.35);
/// Texels along a side of a table, and the document's milliseconds for it.
const STATED: (u32, f64) = (512, 3.3);
const TURNS: usize = 5;
/// Boxes of each size that numbers are judged by.
const BOXES: usize = 500;
/// Lobes with their names.
const KINDS: [(&str, Lobe); 8] = [
    ("GGX α = 0.03", Lobe::Ggx { alpha: 0.03 }),
    ("GGX α = 0.1", Lobe::Ggx { alpha: 0.1 }),
    ("GGX α = 0.2", Lobe::Ggx { alpha: 0.2 }),
    ("GGX α = 0.4", Lobe::Ggx { alpha: 0.4 }),
    ("GGX α = 0.7", Lobe::Ggx { alpha: 0.7 }),
    ("GGX α = 1", Lobe::Ggx { alpha: 1.0 }),
    ("Phong n = 10", Lobe::Phong { exponent: 10.0 }),
    ("Phong n = 100", Lobe::Phong { exponent: 100.0 }),
];
/// Numbers of tables with their names.
const NUMBERS: [(SatNumbers, &str); 3] = [
    (SatNumbers::Float, "32-bit float"),
    (SatNumbers::TwoFloat, "two floats"),
    (SatNumbers::Fixed, INTEGERS),
];
/// The engine's.
const INTEGERS: &str = "64-bit integer";

rows! {
    /// A way to look glossy reflections up.
    struct Reflection = "Glossy reflections of one map" by [look_up] {
        look_up: String = "look-up",
        preparation: Repeats = "preparation (ms)",
        rms: f64 = "RMS error over the mean",
        mean: f64 = "mean error over the mean",
        step: f64 = "greatest step between pixels of a row, over the truth's",
    }
}

rows! {
    /// A lobe by a number of boxes.
    struct Staircase = "RMS error of lobes of boxes over the mean" by [lobe, half, boxes] {
        lobe: String = "lobe",
        half: f64 = "half of it within (degrees)",
        boxes: String = "boxes",
        rms: f64 = "RMS error over the mean",
    }
}

rows! {
    /// A lobe by boxes, and by fewer of their kind.
    struct Halving = "More boxes over fewer of their kind" by [lobe, boxes] {
        lobe: String = "lobe",
        boxes: String = "boxes",
        ratio: f64 = "RMS error over that of fewer boxes",
    }
}

rows! {
    /// A table's numbers.
    struct Numbers = "Numbers of summed-area tables" by [texels, sums, mean_off] {
        texels: String = "texels",
        with_border: String = "texels with border",
        sums: String = "sums",
        mean_off: String = "mean taken off",
        size: f64 = "table (MiB)",
        fill: Repeats = "fill (ms)",
        small: f64 = "greatest relative error of small boxes",
        large: f64 = "greatest relative error of boxes of a tenth",
    }
    beside "document: fill (ms)" = |row| stated_milliseconds(row).into();
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    reflections: Vec<Reflection>,
    lobes: Vec<Staircase>,
    numbers: Vec<Numbers>,
}

const OF_REFLECTIONS: &[Criterion<Reflection>] = &[Criterion::each(
    "glossiness without steps: the greatest step between pixels over that of the lobe's integral",
    Bound::AtMost(1.5),
    |row: &Reflection| row.step.into(),
)
.among(|row| [SHOWN_NESTED, SHOWN_RINGS].iter().any(|fit| row.look_up == fit.name()))
.because("of four steps of a staircase each; half of a step more is not seen beside the picture's own")];
const OF_LOBES: &[Criterion<Halving>] = &[Criterion::each(
    "errors fall with the number of boxes: each over that of fewer",
    Bound::AtMost(1.0),
    |row: &Halving| row.ratio.into(),
)];
const OF_NUMBERS: &[Criterion<Numbers>] = &[Criterion::each(
    "small boxes beside a sun are as exact as large ones: their error over that of boxes of a tenth",
    Bound::AtMost(2.0),
    |row: &Numbers| (row.small / row.large).into(),
)
.among(|row| row.sums == INTEGERS)
.because("one bit")];

/// The document's time for a table of that size, on its device.
fn stated_milliseconds(row: &Numbers) -> Option<f64> {
    (row.texels == squared(STATED.0)).then_some(STATED.1)
}

fn squared(rows: u32) -> String {
    format!("{rows} × {rows}")
}

/// Wall-clock seconds of a call.
fn seconds(function: impl FnOnce() -> Result<()>) -> Result<f64> {
    let (result, seconds) = timed(function);
    result.map(|()| seconds)
}

/// A mirror sphere by all look-ups, which are compared with the truth, and their pictures.
fn reflections(context: &Context<'_>, gpu: &Gpu) -> Result<Vec<Reflection>> {
    let (rows, side) = context.pick((TEXELS, SIDE), (64, 24));
    let source = image(rows)?;
    let pixels = pixels(&Sphere::new(EYE, side));
    let right = truth(&source, &pixels);
    let device = filled(gpu, &source, rows / 2)?;
    let table = SphericalSat::new(gpu, &device, SatNumbers::Fixed, SatRange::of(&source, true))?;
    let plain = filled(gpu, &source, 1)?;
    let levels = Filtered::new(gpu, rows)?;
    let times = context.in_turns(TURNS, 2, |contender| match contender {
        0 => seconds(|| table.fill(&device)),
        _ => seconds(|| levels.fill(gpu, &plain)),
    })?;
    let [fill, filter] = [0, 1].map(|contender: usize| Repeats(times[contender].clone()).scaled(1e3));
    let mut row = vec![shown(side, &pixels, &right)?];
    let reflection = |look_up: String, preparation: &Repeats, values: &[Vec3]| {
        let [rms, mean] = errors(values, &right);
        Reflection {
            look_up,
            preparation: preparation.clone(),
            rms,
            mean,
            step: greatest_step(&pixels, values) / greatest_step(&pixels, &right),
        }
    };
    let one = by_one_box(&table, &source, &pixels)?;
    let mut all = vec![reflection("one box of the lobe's variance".into(), &fill, &one)];
    for fit in fits() {
        let values = by_lobes(&table, &pixels, fit)?;
        all.push(reflection(fit.name(), &fill, &values));
        if [SHOWN_NESTED, SHOWN_RINGS].contains(&fit) {
            row.push(shown(side, &pixels, &values)?);
        }
    }
    let by_levels = levels.look_up(&pixels)?;
    all.push(reflection("prefiltered levels".into(), &filter, &by_levels));
    row.push(shown(side, &pixels, &by_levels)?);
    context.picture("glossiness.png", &sheet(&[row]));
    Ok(all)
}

/// Errors of lobes by number of boxes.
fn lobes(context: &Context<'_>) -> Result<Vec<Staircase>> {
    let (rows, count) = context.pick((TEXELS, 1500), (48, 40));
    let source = LobeSource::new(image(rows)?)?;
    let mut random = Random::new(23);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    context.each(
        context.first(&KINDS, 2),
        |(name, _)| (*name).to_owned(),
        |(name, lobe)| {
            let half = half_angle(*lobe).to_degrees();
            let staircase = |(boxes, rms): (String, f64)| Staircase {
                lobe: (*name).into(),
                half,
                boxes,
                rms,
            };
            Ok(source.errors(*lobe, &directions)?.into_iter().map(staircase).collect())
        },
    )
}

/// Lobes by boxes over those by fewer of their kind.
fn halvings(lobes: &[Staircase]) -> Vec<Halving> {
    let halving = |(row, fit): (&Staircase, Fit)| {
        let fewer = fit.with_fewer()?.name();
        let fewer = lobes
            .iter()
            .find(|other| other.lobe == row.lobe && other.boxes == fewer)?;
        Some(Halving {
            lobe: row.lobe.clone(),
            boxes: row.boxes.clone(),
            ratio: row.rms / fewer.rms,
        })
    };
    let with_fits = lobes
        .iter()
        .filter_map(|row| Some((row, fits().find(|fit| fit.name() == row.boxes)?)));
    with_fits.filter_map(halving).collect()
}

/// Tables of all numbers of a map of so many rows, which are filled in turns.
fn numbers(context: &Context<'_>, gpu: &Gpu, rows: u32) -> Result<Vec<Numbers>> {
    let source = image(rows)?;
    let border = rows / 4;
    let device = filled(gpu, &source, border)?;
    let exact = SatImage::new(&source, border)?;
    let mut random = Random::new(19);
    let mut query = || {
        let d = random.direction().as_vec3();
        [1.0 / f64::from(rows), 0.05].map(|half| d.extend(half as f32))
    };
    let asked: Vec<Vec4> = (0..BOXES).flat_map(|_| query()).collect();
    let forms: Vec<_> = NUMBERS.iter().flat_map(|form| [(form, false), (form, true)]).collect();
    let tables: Vec<SphericalSat> = forms
        .iter()
        .map(|((kind, _), subtract)| SphericalSat::new(gpu, &device, *kind, SatRange::of(&source, *subtract)))
        .collect::<Result<_>>()?;
    let times = context.in_turns(TURNS, tables.len(), |table| seconds(|| tables[table].fill(&device)))?;
    let row = |form: &(SatNumbers, &str), subtract: bool, table: &SphericalSat, times: Vec<f64>| {
        let mut worst = [0.0f64; 2];
        for (i, (query, value)) in asked.iter().zip(&table.look_up(&asked)?).enumerate() {
            let off = MAP.encode(query.truncate().as_dvec3()).map(|at| {
                let right = exact.sat_mean(at.uv, query.w.into());
                ((value.as_dvec3() - right) / right).abs().to_array()
            });
            let off = off.map_or(f64::NAN, greatest);
            worst[i % 2] = greatest([worst[i % 2], off]);
        }
        let tile = f64::from(rows + 2 * border + 1);
        Ok(Numbers {
            texels: squared(rows),
            with_border: squared(rows + 2 * border),
            sums: form.1.into(),
            mean_off: (if subtract { "yes" } else { "no" }).into(),
            size: tile * tile * 32.0 / f64::from(1 << 20),
            fill: Repeats(times).scaled(1e3),
            small: worst[0],
            large: worst[1],
        })
    };
    let filled = forms.iter().zip(&tables).zip(times);
    filled
        .map(|(((form, subtract), table), times)| row(form, *subtract, table, times))
        .collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        context.watch.begin("reflections of a sphere", 0, 1);
        Ok(Self {
            reflections: reflections(context, &gpu)?,
            lobes: lobes(context)?,
            numbers: context.each(
                context.first(&SIZES, 1),
                |rows| format!("tables of {rows}² texels"),
                |rows| numbers(context, &gpu, *rows),
            )?,
        })
    }

    fn findings(&self) -> Findings {
        let four = self.reflections.iter().find(|row| row.look_up == SHOWN_NESTED.name());
        let found = Findings::of(&self.reflections, OF_REFLECTIONS).headline(
            "RMS error of four boxes about one middle over the mean (%)",
            four.map(|row| Measured::exact(100.0 * row.rms)),
        );
        let found = if self.reflections.is_empty() {
            found
        } else {
            found.picture(
                "glossiness.png",
                "Truth, four boxes about one middle, four steps in rings, prefiltered levels.",
            )
        };
        found
            .note(format!(
                "A mirror sphere whose roughness √α grows from left to right (α from {LEAST_ALPHA} to 1) in an octahedron map of {TEXELS} × {TEXELS} \
                 texels with a sun. Truth is the sum of the GGX lobe with n = v = r over all texels at each pixel; all look-ups stand for that lobe, \
                 and their error is that of the boxes and of mixing two of {LEVELS} filtered maps, octahedra of {}, to the lobe that is nearest. One \
                 box holds the solid angle over which an even mean has the lobe's variance; several are the staircase nearest to the lobe, of {LOBES} \
                 lobes even in roughness the nearest. The border is half the map. Times are by wall clock, with submission; all boxes need one table.",
                filtered_sizes(TEXELS)
            ))
            .and(Findings::pivoted(&self.lobes, "boxes", &[]).judged(&halvings(&self.lobes), OF_LOBES))
            .note(format!(
                "At uniform directions in the same environment, on {TEXELS} × {TEXELS} texels; f64 throughout. Truth is the lobe's sum over all texels, \
                 each by its middle. Caps are round on the sphere and as large as the boxes: their error is that of the staircase alone, and what boxes \
                 have beyond it is that they are squares of the map. A border as wide as the map holds every box."
            ))
            .and(Findings::of(&self.numbers, OF_NUMBERS))
            .note(format!(
                "The same scene; errors against tables in f64, of {BOXES} boxes two texels wide and {BOXES} a tenth of the map wide. All keep eight bytes \
                 per channel. Places in the map are f32 and off by a few 10⁻⁷ of it, which the sun's edges turn into the error that is left. The \
                 document's time is of its device; here an invocation sums a line, which suits the software driver and not many lanes."
            ))
    }
}
