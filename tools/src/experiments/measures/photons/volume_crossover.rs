//! Where photons' collisions and where their ways are the better sight of light in fog: the variance of both by the density of the medium and the width of kernels, and of planes, which have none.
//!
//! The order is published by J. Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", ACM TOG 33(4), 2014, with SmallUPBP; by B. Bitterli and W. Jarosz,
//! "Beyond Points and Beams", ACM TOG 36(4), 2017, with Tungsten; and on GPUs by N. Moonen and A. Jalba, "Efficient Hardware Acceleration of Robust Volumetric Light Transport Simulation", CGF 42(6), 2023,
//! with GPUUPBP (github.com/nolmoonen/gpuupbp). Variances are those between pictures of independent photons under kernels that do not shrink, so that what
//! kernels blur is no part of them.

use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::render::Renderer;
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};

use crate::agreement::spread;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;
use crate::experiments::measures::pictures::{finished, mean_picture};
use crate::experiments::plot::Curve;
use crate::timing::timed;

/// Light whose last two scatterings are in the fog, which all three see in their own way.
const PATHS: &str = "L.*VVE";
/// Scattering coefficients of the fog in a box of 0.55 m, 1/m; a tenth of each is absorbed.
const SCATTERING: [f64; 5] = [0.5, 2.0, 8.0, 32.0, 128.0];
const SMOKE_SCATTERING: [f64; 2] = [0.5, 128.0];
const ABSORBED: f64 = 0.1;
/// Radii of kernels, m.
const RADII: [f32; 3] = [0.008, 0.002, 0.032];
const SMOKE_RADII: usize = 1;
/// Pixels a side, photons of a pass, and passes of a picture.
const FULL: (u32, u32, u32) = (32, 1 << 12, 8);
const SMOKE: (u32, u32, u32) = (8, 1 << 10, 2);
/// Turns, and pictures in each.
const TURNS: usize = 5;
const PICTURES: u32 = 2;
/// Standard errors to each side of an interval.
const MARGIN: f64 = 2.0;
/// Kernels are narrow beside the mean free path up to this share of it, and wide from that one on.
const NARROW: f64 = 0.02;
const WIDE: f64 = 0.5;

rows! {
    /// A density and a width of kernels.
    struct Row = "Variance by density and width of kernels" by [sigma_t, radius] {
        sigma_t: f64 = "σₜ (1/m)",
        radius: f64 = "radius of kernels (m)",
        free_paths: f64 = "radius over mean free path",
        collisions: Measured = "relative variance of collisions",
        collisions_met: f64 = "k, collisions",
        collisions_seconds: Measured = "seconds of a picture, collisions",
        beams: Measured = "relative variance of beams",
        beams_met: f64 = "k, beams",
        beams_seconds: Measured = "seconds of a picture, beams",
        ratio: Measured = "variance of beams over collisions, at equal photons",
        in_time: Measured = "variance of beams over collisions, at equal time",
        planes: Measured = "variance of planes over beams, at equal photons",
        planes_in_time: Measured = "variance of planes over beams, at equal time",
    }
}
rows! {
    /// A ratio's line.
    struct Crossing = "Where collisions and beams vary alike" by [at] {
        at: String = "at equal",
        free_paths: f64 = "radius over mean free path",
        exponent: f64 = "power of it with which the ratio of variances grows",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
}

impl Row {
    /// The ratio, with no interval where pictures do not tell both variances: where few photons bring nearly all of the light.
    fn known_ratio(&self) -> Measured {
        if self.collisions.low > 0.0 && self.beams.low > 0.0 {
            self.ratio
        } else {
            Measured::within(self.ratio.value, f64::INFINITY)
        }
    }
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "beams vary less than collisions where kernels are narrow beside the mean free path: ratio",
        Bound::AtMost(1.0),
        |row: &Row| row.ratio,
    )
    .among(|row| row.free_paths <= NARROW)
    .because("narrow is a fiftieth of the mean free path"),
    Criterion::each(
        "beams vary more than collisions where the medium is dense beside kernels: ratio",
        Bound::AtLeast(1.0),
        |row: &Row| row.known_ratio(),
    )
    .among(|row| row.free_paths >= WIDE)
    .because("dense is a radius of half the mean free path or more; rows whose variances are as uncertain as they are large say nothing"),
    Criterion::each(
        "planes have at most 0.35 of the variance of beams under narrow kernels: ratio",
        Bound::AtMost(0.35),
        |row: &Row| row.planes,
    )
    .among(|row| row.free_paths <= NARROW)
    .because("the ratio published for planes, at equal photons"),
];

/// An estimate's pictures.
struct Seen {
    /// Relative variance of a picture, with its standard error.
    variance: [f64; 2],
    /// Seconds of a picture, with their standard error.
    seconds: [f64; 2],
    /// Kernels, or planes, that a ray meets.
    met: f64,
}

impl Seen {
    fn variance(&self) -> Measured {
        Measured::within(self.variance[0], MARGIN * self.variance[1])
    }

    fn seconds(&self) -> Measured {
        Measured::within(self.seconds[0], MARGIN * self.seconds[1])
    }

    /// Its variance over another one's, at equal photons.
    fn over(&self, other: &Self) -> Measured {
        let parts = [self, other].map(|one| one.variance);
        ratio(&[parts])
    }

    /// Its variance over another one's, at equal time: both fall with one over photons.
    fn over_in_time(&self, other: &Self) -> Measured {
        ratio(&[
            [self, other].map(|one| one.variance),
            [self, other].map(|one| one.seconds),
        ])
    }
}

/// The product of ratios of numbers with their standard errors.
fn ratio(pairs: &[[[f64; 2]; 2]]) -> Measured {
    let value: f64 = pairs.iter().map(|[[a, _], [b, _]]| a / b).product();
    let numbers = pairs.as_flattened().iter();
    let relative = numbers.map(|[number, error]| (error / number).powi(2)).sum::<f64>();
    Measured::within(value, MARGIN * value * relative.sqrt())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let densities = context.pick::<&[f64]>(&SCATTERING, &SMOKE_SCATTERING);
        let name = |scattering: &f64| format!("σₛ = {scattering}/m");
        let rows = context.each_kept(&gpu, densities, name, |scattering| rows_of(context, &gpu, *scattering))?;
        Ok(Self { rows })
    }

    fn findings(&self) -> Findings {
        let axes = Axes::rates("radius over mean free path", "variance of beams over collisions");
        let by_photons = crossing("photons", &self.rows, |row| row.ratio);
        let by_time = crossing("time", &self.rows, |row| row.in_time);
        let at_equal_photons = by_photons.as_ref().map(|found| Measured::exact(found.free_paths));
        let crossings: Vec<Crossing> = [by_photons, by_time].into_iter().flatten().collect();
        let mut lines = by_free_paths(&self.rows, |row| row.ratio, "at equal photons");
        lines.extend(by_free_paths(&self.rows, |row| row.in_time, "at equal time"));
        Findings::of(&self.rows, CRITERIA)
            .headline(
                "radius of kernels over the mean free path at which collisions and beams vary alike at equal photons",
                at_equal_photons,
            )
            .curves(
                "crossover",
                "Variance of beams over that of collisions",
                axes,
                lines,
            )
            .note(format!(
                "{0} × {0} pixels, {1} passes of {2} photons; {TURNS} turns of {PICTURES} pictures, whose spread is the variance, over the square of their common mean. Light whose last two \
                 scatterings are in the fog, under kernels of one radius that do not shrink.",
                FULL.0, FULL.2, FULL.1,
            ))
            .and(Findings::of(&crossings, &[]))
            .note(
                "By a line through the logarithms of all rows. A way is met wherever a ray passes within the radius, in which its weight is one over the width of the strip, and a collision within a disk, \
                 whose weight is one over its area, and only where a photon collides: the ratio of variances goes with the radius over the mean free path, whatever the density by itself. In dense media a way \
                 is long beside where its light is, and most of what rays meet of it is dim. That is the order that Křivánek et al. 2014 (SmallUPBP) and Bitterli and Jarosz 2017 (Tungsten) publish; what differs is the price of a way beside that of a \
                 collision, for which the second line stands.",
            )
    }
}

/// A ratio's curve.
fn by_free_paths(rows: &[Row], of: fn(&Row) -> Measured, name: &str) -> Vec<Curve> {
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| a.free_paths.total_cmp(&b.free_paths));
    curves(&sorted, |_| name.to_owned(), |row| (row.free_paths, of(row)))
}

/// The place where a ratio's line, a power of the radius over the mean free path, is 1; `None` where rows give no line.
fn crossing(at: &str, rows: &[Row], of: fn(&Row) -> Measured) -> Option<Crossing> {
    let points: Vec<[f64; 2]> = rows
        .iter()
        .map(|row| [row.free_paths.ln(), of(row).value.ln()])
        .filter(|point| point.iter().all(|value| value.is_finite()))
        .collect();
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(of).sum::<f64>() / count;
    let [x, y] = [mean(&|point| point[0]), mean(&|point| point[1])];
    let exponent = mean(&|point| (point[0] - x) * (point[1] - y)) / mean(&|point| (point[0] - x) * (point[0] - x));
    let free_paths = (x - y / exponent).exp();
    (exponent > 0.0 && free_paths.is_finite()).then(|| Crossing {
        at: at.into(),
        free_paths,
        exponent,
    })
}

/// All estimates in fog of that density, in turns.
fn rows_of(context: &Context<'_>, gpu: &Gpu, scattering: f64) -> Result<Vec<Row>> {
    let (side, photons, passes) = context.pick(FULL, SMOKE);
    let absorption = ABSORBED * scattering;
    let scene = scene::load(&format!(
        "builtin:fog-box?boxes=none&sigma_a={absorption}&sigma_s={scattering}"
    ))?;
    let renderer = Renderer::new(gpu, &scene)?;
    let camera = scene.require_camera(None)?;
    let radii = context.first(&RADII, SMOKE_RADII);
    let of_radius = |radius: &f32| [(VolumeEstimate::Ray, *radius), (VolumeEstimate::Beams, *radius)];
    // Planes have no kernels.
    let contenders = radii
        .iter()
        .flat_map(of_radius)
        .chain([(VolumeEstimate::Planes, RADII[0])]);
    let mut mappers = Vec::new();
    for (volume, volume_radius) in contenders {
        let settings = PhotonSettings {
            path_set: PATHS.parse()?,
            photons,
            volume,
            volume_radius,
            reduction: 1.0,
            ..PhotonSettings::default()
        };
        let gpu_scene = Arc::clone(renderer.gpu_scene());
        mappers.push(PhotonMapper::new(gpu, gpu_scene, camera, [side; 2], settings)?);
    }
    let mut seed = 0;
    let turns = context.in_turns(TURNS, mappers.len(), |i| {
        let mut turn = Vec::new();
        for _ in 0..PICTURES {
            seed += 1;
            mappers[i].restart(seed)?;
            let (picture, seconds) = timed(|| finished(&mut mappers[i], passes));
            turn.push((picture?.main_layer()?.values().to_vec(), seconds));
        }
        Ok(turn)
    })?;
    let pictures: Vec<Vec<Vec<f32>>> = turns
        .iter()
        .map(|turns| turns.iter().flatten().map(|(picture, _)| picture.clone()).collect())
        .collect();
    let common = mean_picture(pictures.iter().flatten().map(Vec::as_slice));
    let mut seen = Vec::new();
    for ((pictures, turns), mapper) in pictures.iter().zip(&turns).zip(&mappers) {
        let Some(found) = spread::measure(pictures, &common) else {
            return Ok(Vec::new());
        };
        let seconds: Vec<f64> = turns.iter().flatten().map(|(_, seconds)| *seconds).collect();
        let counts = mapper.counts().beams;
        seen.push(Seen {
            variance: [found.relative_mse, found.standard_error],
            seconds: mean_with_error(&seconds),
            met: counts.photons as f64 / counts.queries.max(1) as f64,
        });
    }
    let Some((planes, kernels)) = seen.split_last() else {
        return Ok(Vec::new());
    };
    let sigma_t = absorption + scattering;
    let row = |(radius, [collisions, beams]): (&f32, &[Seen; 2])| {
        let radius = f64::from(*radius);
        Row {
            sigma_t,
            radius,
            free_paths: sigma_t * radius,
            collisions: collisions.variance(),
            collisions_met: collisions.met,
            collisions_seconds: collisions.seconds(),
            beams: beams.variance(),
            beams_met: beams.met,
            beams_seconds: beams.seconds(),
            ratio: beams.over(collisions),
            in_time: beams.over_in_time(collisions),
            planes: planes.over(beams),
            planes_in_time: planes.over_in_time(beams),
        }
    };
    Ok(radii.iter().zip(kernels.as_chunks::<2>().0).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_cross_where_their_power_says() {
        // 4 · x: alike at a quarter.
        let row = |free_paths: f64| Row {
            free_paths,
            ratio: Measured::exact(4.0 * free_paths),
            in_time: Measured::exact(1.0 / free_paths),
            ..Row::default()
        };
        let rows = [row(0.001), row(0.02), row(1.0)];
        let found = crossing("photons", &rows, |row| row.ratio).unwrap();
        assert!((found.free_paths - 0.25).abs() < 1e-12 && (found.exponent - 1.0).abs() < 1e-12);
        // Beams that gain with density cross nothing.
        assert!(crossing("time", &rows, |row| row.in_time).is_none());
        assert!(crossing("photons", &rows[..1], |row| row.ratio).is_none());
        assert!(crossing("photons", &[], |row| row.ratio).is_none());
    }

    #[test]
    fn ratios_at_equal_time_are_those_of_variance_times_seconds() {
        let of = |variance: f64, seconds: f64| Seen {
            variance: [variance, 0.1 * variance],
            seconds: [seconds, 0.0],
            met: 1.0,
        };
        let (beams, collisions) = (of(0.02, 3.0), of(0.04, 1.0));
        assert!((beams.over(&collisions).value - 0.5).abs() < 1e-12);
        let in_time = beams.over_in_time(&collisions);
        assert!((in_time.value - 1.5).abs() < 1e-12);
        assert!((in_time.high - 1.5 - MARGIN * 1.5 * 0.02_f64.sqrt()).abs() < 1e-12);
        assert_eq!(mean_picture([&[1.0, 2.0][..], &[3.0, 4.0]]), [2.0, 3.0]);
    }
}
