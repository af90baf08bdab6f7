//! What three channels, and each form of the Fresnel factor in them, lose of metals' spectra, beside what they cost; indices of metals over wavelengths.
//!
//! Oracle: the same picture in 41 bins of wavelengths, whose sum a test holds to a closed form. The scene is a half pipe of the metal under a white sky, seen from above: each ray is
//! reflected once or more often, from normal to grazing incidence, and comes to the same radiance, so that pictures have no noise but that of pixels' places, which is common to all.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::render::RenderOptions;
use clerestory::scene::FresnelForm;
use clerestory::scene::metals::bins::Bins;
use clerestory::techniques::PathTracerSettings;
use clerestory::transport::fresnel::curve::FresnelCurve;
use clerestory::transport::fresnel::extinction::{wave_envelope, wave_field};
use glam::DVec3;

use super::spectral_ways::{ASPECT, GREY, Way, bins_name, spectrum_of};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

/// The engine's nine metals.
const METALS: [&str; 9] = [
    "copper",
    "gold",
    "silver",
    "aluminium",
    "iron",
    "chromium",
    "titanium",
    "nickel",
    "cobalt",
];
/// Bins of the oracle.
const ORACLE: u32 = 41;
/// Evaluations of an invocation whose time is taken.
const CHAIN: u32 = 64;
const TURNS: usize = 9;
const PICTURE: &str = "troughs.png";

rows! {
    /// A way to make a metal's picture.
    struct Row = "Spectral errors of metals, and their cost" by [metal, way] {
        metal: String = "metal",
        way: String = "way",
        pictures: u64 = "pictures",
        cost: Repeats = "evaluations of a Fresnel factor for all pictures (ns)",
        error: f64 = "RMS error over the mean (%)",
        worst: f64 = "greatest error of a pixel's channel",
        red: f64 = "mean error, red",
        green: f64 = "mean error, green",
        blue: f64 = "mean error, blue",
        over_channels: Option<f64> = "RMS error over that of the exact factor in channels",
    }
}

rows! {
    /// A metal at a wavelength.
    struct Index = "Indices of metals" by [metal, wavelength] {
        metal: String = "metal",
        wavelength: f64 = "wavelength (nm)",
        n: f64 = "n",
        k: f64 = "k",
    }
}

rows! {
    /// A metal at an end of the range that a doctoral thesis on metals and reflections on graphics hardware names.
    struct End = "Fall of two metals' n from 430 to 705 nm" by [metal, wavelength] {
        metal: String = "metal",
        wavelength: f64 = "wavelength (nm)",
        n: f64 = "n",
        published: f64 = "published n",
    }
}

rows! {
    /// A place inside a material with n = 1.2, at 400 nm.
    struct Wave = "Waves inside a material" by [extinction, depth] {
        extinction: f64 = "k",
        depth: f64 = "depth (nm)",
        field: f64 = "field",
        envelope: f64 = "envelope",
        published: Option<f64> = "published envelope",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    errors: Vec<Row>,
    indices: Vec<Index>,
    ends: Vec<End>,
    waves: Vec<Wave>,
}

/// Forms whose pictures stand beside that in all bins.
const SHOWN: [FresnelForm; 3] = [FresnelForm::Exact, FresnelForm::Schlick, FresnelForm::Rescaled];
/// The exact factor in channels: what the engine does unless it is told otherwise.
const CHANNELS: &str = "exact";

const OF_ERRORS: &[Criterion<Row>] = &[
    Criterion::each(
        "eight bins: the greatest error of a pixel's channel",
        Bound::AtMost(0.03),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.way == bins_name(8))
    .because("four reflections at normal incidence are off by 0.021"),
    Criterion::each(
        "sixteen bins: the greatest error of a pixel's channel",
        Bound::AtMost(0.006),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.way == bins_name(16))
    .because("four reflections at normal incidence are off by 0.003"),
    Criterion::each(
        "a metal of one index has no error in channels and in bins",
        Bound::AtMost(1e-5),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.metal == GREY && (row.way == CHANNELS || row.way.ends_with("bins")))
    .in_every_form(),
    Criterion::each(
        "channels lose copper's edge where it is met more than once: the greatest error",
        Bound::AtLeast(0.04),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.metal == "copper" && row.way == CHANNELS)
    .because("two reflections at normal incidence are off by 0.043 in red"),
    Criterion::each(
        "channels keep metals without an edge: the greatest error",
        Bound::AtMost(0.006),
        |row: &Row| row.worst.into(),
    )
    .among(|row| !["copper", "gold", GREY].contains(&row.metal.as_str()) && row.way == CHANNELS)
    .because("four reflections at normal incidence are off by 0.0034 at most"),
    Criterion::each(
        "sixteen bins bring what channels lose: RMS error over that of channels",
        Bound::AtMost(0.2),
        |row: &Row| row.over_channels.unwrap_or(f64::INFINITY).into(),
    )
    .among(|row| ["copper", "gold"].contains(&row.metal.as_str()) && row.way == bins_name(16)),
    Criterion::each(
        "Schlick's curve without k has the wrong colour: the greatest error for copper",
        Bound::AtLeast(0.3),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.metal == "copper" && row.way == FresnelForm::Schlick.name())
    .because("its green and blue reflect 0.6 and 0.5, where the curve has next to nothing"),
];
const OF_ENDS: &[Criterion<End>] = &[Criterion::each(
    "n of gold falls from 1.45 to 0.13 and that of copper from 1.25 to 0.21: difference from these",
    Bound::AtMost(5e-3),
    |row: &End| (row.n - row.published).abs().into(),
)
.because("half of the last published digit")
.in_every_form()];
const OF_WAVES: &[Criterion<Wave>] = &[Criterion::each(
    "envelopes are the published ones: their difference",
    Bound::AtMost(5e-4),
    |row: &Wave| (row.envelope - row.published.unwrap_or(f64::NAN)).abs().into(),
)
.among(|row| row.published.is_some())
.in_every_form()];

/// The error of a way against the oracle's pixels, without its cost.
fn row(metal: &str, way: Way, cost: Repeats, pixels: &[DVec3], oracle: &[DVec3]) -> Row {
    let count = oracle.len().max(1) as f64;
    let differences: Vec<DVec3> = pixels
        .iter()
        .zip(oracle)
        .map(|(pixel, oracle)| *pixel - *oracle)
        .collect();
    let mean = oracle.iter().copied().sum::<DVec3>().element_sum() / (3.0 * count);
    let square: f64 = differences.iter().map(|gap| gap.length_squared()).sum::<f64>() / (3.0 * count);
    let bias = differences.iter().copied().sum::<DVec3>() / count;
    Row {
        metal: metal.into(),
        way: way.name(),
        pictures: way.pictures().into(),
        cost,
        error: 100.0 * square.sqrt() / mean,
        worst: differences
            .iter()
            .fold(0.0, |worst, gap| worst.max(gap.abs().max_element())),
        red: bias.x,
        green: bias.y,
        blue: bias.z,
        over_channels: None,
    }
}

fn ends() -> Result<Vec<End>> {
    const PUBLISHED: [(&str, f64, f64); 4] = [
        ("gold", 430.0, 1.45),
        ("gold", 705.0, 0.13),
        ("copper", 430.0, 1.25),
        ("copper", 705.0, 0.21),
    ];
    let of = |(metal, wavelength, published): (&str, f64, f64)| {
        let [n, _] = spectrum_of(metal)?.at(wavelength);
        Ok(End {
            metal: metal.into(),
            wavelength,
            n,
            published,
        })
    };
    PUBLISHED.into_iter().map(of).collect()
}

fn waves(steps: u32) -> Vec<Wave> {
    const PUBLISHED: [(f64, f64, f64); 4] = [
        (0.1, 100.0, 0.855),
        (0.1, 1000.0, 0.208),
        (0.5, 100.0, 0.456),
        (0.5, 400.0, 0.0432),
    ];
    let at = |k: f64, i: u32| {
        let depth = 1000.0 * f64::from(i) / f64::from(steps);
        let published = PUBLISHED.iter().find(|(of, place, _)| *of == k && *place == depth);
        Wave {
            extinction: k,
            depth,
            field: wave_field(1.2, k, 400.0, depth),
            envelope: wave_envelope(k, 400.0, depth),
            published: published.map(|(.., envelope)| *envelope),
        }
    };
    [0.0, 0.1, 0.5]
        .into_iter()
        .flat_map(|k| (0..=steps).map(move |i| at(k, i)))
        .collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let forms = context.pick(FresnelForm::ALL.to_vec(), vec![FresnelForm::Exact, FresnelForm::Table]);
        let counts = context.pick(vec![8, 12, 16, 24], vec![8]);
        let oracle = Way::Bins(context.pick(ORACLE, 12));
        let ways: Vec<Way> = (forms.iter().map(|form| Way::Channels(*form)))
            .chain([Way::Colors, Way::Wavelengths])
            .chain(counts.into_iter().map(Way::Bins))
            .collect();
        let metals: Vec<&str> = context
            .pick(METALS.to_vec(), vec![])
            .into_iter()
            .chain([GREY])
            .collect();
        let width = context.pick(64, ASPECT);
        let options = RenderOptions {
            size: [width, width / ASPECT],
            spp: context.pick(16, 1),
            settings: PathTracerSettings {
                // Without roulette: paths end in the sky.
                roulette_start: 64,
                ..PathTracerSettings::default()
            }
            .into(),
            ..RenderOptions::default()
        };
        let costs = costs(context, &gpu, &ways)?;
        let mut shown = Vec::new();
        let errors = context.each(
            &metals,
            |metal| (*metal).into(),
            |metal| {
                let spectrum = spectrum_of(metal)?;
                let truth = oracle.picture(&gpu, &spectrum, &options)?;
                let mut rows = Vec::with_capacity(ways.len());
                shown.push(truth.clone());
                for (way, cost) in ways.iter().zip(&costs) {
                    let pixels = way.picture(&gpu, &spectrum, &options)?;
                    let cost = cost.scaled(f64::from(way.pictures()));
                    rows.push(row(metal, *way, cost, &pixels, &truth));
                    if matches!(way, Way::Channels(form) if SHOWN.contains(form)) {
                        shown.push(pixels);
                    }
                }
                let of_channels = rows.iter().find(|row| row.way == CHANNELS).map_or(0.0, |row| row.error);
                for row in &mut rows {
                    row.over_channels = (of_channels > 0.0).then(|| row.error / of_channels);
                }
                Ok(rows)
            },
        )?;
        let squares: Vec<Vec<DVec3>> = shown.iter().map(|pixels| square(pixels, width)).collect();
        let columns = 1 + forms.iter().filter(|form| SHOWN.contains(form)).count() as u32;
        context.picture(PICTURE, &sheet(&squares, width, columns));
        let mut indices = Vec::new();
        for metal in context.first(&METALS, 2) {
            let spectrum = spectrum_of(metal)?;
            for wavelength in Bins::new(context.pick(ORACLE, 8))?.wavelengths() {
                let [n, k] = spectrum.at(*wavelength);
                indices.push(Index {
                    metal: (*metal).into(),
                    wavelength: *wavelength,
                    n,
                    k,
                });
            }
        }
        Ok(Self {
            errors,
            indices,
            ends: ends()?,
            waves: waves(context.pick(50, 10)),
        })
    }

    fn findings(&self) -> Findings {
        let drawn: Vec<Row> = self
            .errors
            .iter()
            .filter(|row| row.error > 0.0 && row.metal != GREY)
            .cloned()
            .collect();
        let is_channels = |row: &Row| row.way == CHANNELS && row.metal != GREY;
        let findings = Findings::of(&self.errors, OF_ERRORS)
            .headline(
                "the greatest error of a metal in channels (RMS over the mean, %)",
                largest(&self.errors, is_channels, |row| row.error),
            )
            .note(
                "Channels are means of n and k over what red, green and blue are sensitive to; ways without a number of bins are in channels, but for the three wavelengths 700, 550 and \
                 435 nm. Reflectance and edge tint are those of the channels' n and k, in single precision, by the simplified factor. The table holds the exact factor times the \
                 simplified geometric term, and the cost is that of a look-up of this product. Errors are those of the picture in 41 bins, white being 1, over all pixels of a half pipe seen from above. The cost is that of three bands' Fresnel factor on the device in a chain of 64, times \
                 the number of pictures; all else that a picture takes is multiplied alike.",
            )
            .and(Findings::of(&self.indices, &[]).long())
            .and(Findings::of(&self.ends, OF_ENDS))
            .and(Findings::of(&self.waves, OF_WAVES).long())
            .curves(
                "error-and-cost",
                "Spectral error and cost of every metal and form",
                Axes::rates("Fresnel factors of all pictures (ns)", "RMS error over the mean (%)"),
                curves(&drawn, |row| row.metal.clone(), |row| (row.cost.measured().value, row.error.into())),
            )
            .curves(
                "n-and-k",
                "Indices of metals from 400 to 700 nm",
                Axes::rates("n", "k"),
                curves(&self.indices, |row| row.metal.clone(), |row| (row.n, row.k.into())),
            )
            .curves(
                "n",
                "Real part of the index over wavelengths",
                Axes::rates("wavelength (nm)", "n"),
                curves(&self.indices, |row| row.metal.clone(), |row| (row.wavelength, row.n.into())),
            )
            .curves(
                "k",
                "Extinction over wavelengths",
                Axes::rates("wavelength (nm)", "k"),
                curves(&self.indices, |row| row.metal.clone(), |row| (row.wavelength, row.k.into())),
            )
            .curves(
                "envelopes",
                "Amplitude of waves inside a material at 400 nm",
                Axes::even("depth (nm)", "envelope", 1.0, (10, 100.0)),
                curves(&self.waves, |row| format!("k = {}", row.extinction), |row| (row.depth, row.envelope.into())),
            );
        if self.errors.is_empty() {
            return findings;
        }
        findings.picture(
            PICTURE,
            "Half pipes of each metal from above: in 41 bins, by the exact factor, by Schlick's curve, by the rescaled one",
        )
    }
}

/// Seconds, in nanoseconds, of an evaluation of three bands by each way's form.
fn costs(context: &Context<'_>, gpu: &Gpu, ways: &[Way]) -> Result<Vec<Repeats>> {
    let count = context.pick(1 << 16, 1 << 8);
    let ior = spectrum_of("gold")?.channels();
    let kernels: Vec<FresnelCurve> = ways
        .iter()
        .map(|way| FresnelCurve::new(gpu, way.curve(), &ior, CHAIN))
        .collect::<Result<_>>()?;
    let evaluations = f64::from(count) * f64::from(CHAIN);
    let times = context.in_turns(TURNS, kernels.len(), |i| {
        Ok(1e9 * kernels[i].run(gpu, count)?.1 / evaluations)
    })?;
    Ok(times.into_iter().map(Repeats).collect())
}

/// A picture's first row as a square of stripes.
fn square(pixels: &[DVec3], side: u32) -> Vec<DVec3> {
    let row = pixels.get(..side as usize).unwrap_or(pixels);
    row.iter()
        .copied()
        .cycle()
        .take(side as usize * side as usize)
        .collect()
}
