//! Error of bilinear look-ups in maps of as many texels each, and of irradiance by them.
//!
//! Oracle: the light field itself, lobes of three widths in random directions, at random directions; the closed form of irradiance under a
//! sky that fades to the horizon.

use clerestory::Result;
use clerestory::maps::Parametrization;
use glam::{DVec3, UVec2};
use std::f64::consts::PI;

use super::light_fields::{CONCENTRATIONS, LOBES, LobeField, deviation, errors_of_irradiance, held, irradiance_of_sky};
use super::needs::{need, spread};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;
use crate::experiments::slope::least_squares;
use crate::random::Random;

/// The first is what the others are compared with.
const MAPS: [Parametrization; 8] = [
    Parametrization::Cube,
    Parametrization::EqualArea,
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::OctahedronPerspective { c: 0.5 },
    Parametrization::DualParaboloid,
    Parametrization::LatLong,
    Parametrization::Sphere,
];
/// Budgets of texels from which an exponent is found, the largest ones.
const LARGEST: usize = 3;

rows! {
    /// Look-ups in a map of a number of texels.
    struct LookUps = "Error of bilinear look-ups" by [map, budget] {
        map: String = "map",
        budget: u64 = "budget (texels)",
        size: String = "size of a layer",
        texels: u64 = "texels",
        rms: f64 = "RMS error over the field's deviation",
        worst: f64 = "greatest error over the field's deviation",
    }
}

rows! {
    /// How the error of a map falls.
    struct Fall = "Fall of the error with texels" by [map] {
        map: String = "map",
        exponent: f64 = "power of texels by which the error grows",
        need: Measured = "texels for the cube's error, over the cube's",
    }
}

rows! {
    /// Irradiance by a map of a number of texels.
    struct Lit = "Error of irradiance" by [map, texels] {
        map: String = "map",
        texels: u64 = "texels",
        even: f64 = "constant radiance: greatest error over π",
        even_middles: f64 = "constant radiance, by texels' middles",
        sky: f64 = "sky: greatest error over 2π/3",
        sky_middles: f64 = "sky, by texels' middles",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    look_ups: Vec<LookUps>,
    irradiance: Vec<Lit>,
}

const CRITERIA: &[Criterion<Fall>] = &[
    Criterion::each(
        "the error falls as one over the texels: its exponent",
        Bound::Between(-1.1, -0.9),
        |row: &Fall| row.exponent.into(),
    )
    .among(|row| !row.is_of_the_sphere_map())
    .because("a tenth tells −1 from the −¾ of a light with a kink in it"),
    Criterion::each(
        "it does not in the sphere map: its exponent",
        Bound::AtLeast(-0.9),
        |row: &Fall| row.exponent.into(),
    )
    .among(Fall::is_of_the_sphere_map)
    .because("a tenth from −1"),
];
const OF_IRRADIANCE: &[Criterion<Lit>] = &[Criterion::each(
    "constant radiance is integrated: the greatest error over π",
    Bound::AtMost(3e-4),
    |row: &Lit| row.even.into(),
)
.because("what `clerestory::maps::irradiance` states of the map of the greatest shear")];

impl Fall {
    fn is_of_the_sphere_map(&self) -> bool {
        self.map == Parametrization::Sphere.to_string()
    }
}

/// What a map needs at each of the last budgets.
fn need_by_budget(curve: &[(f64, f64)], other: &[(f64, f64)]) -> Measured {
    let first = (curve.len() + 1).saturating_sub(LARGEST).max(2);
    let needs: Vec<f64> = (first..=curve.len())
        .map(|end| need(&curve[..end], &other[..end.min(other.len())]))
        .collect();
    spread(&needs)
}

/// How errors fall, by the last budgets of each map.
fn falls(look_ups: &[LookUps]) -> Vec<Fall> {
    let curve = |map: &Parametrization| -> Vec<(f64, f64)> {
        let rows = look_ups.iter().filter(|row| row.map == map.to_string());
        rows.map(|row| (row.texels as f64, row.rms)).collect()
    };
    let of_first = curve(&MAPS[0]);
    let curves = MAPS.iter().map(|map| (map, curve(map)));
    curves
        .filter(|(_, curve)| !curve.is_empty())
        .map(|(map, curve)| {
            let last = curve.iter().rev().take(LARGEST);
            let logarithms: Vec<(f64, f64)> = last.map(|(texels, error)| (texels.ln(), error.ln())).collect();
            Fall {
                map: map.to_string(),
                exponent: least_squares(&logarithms).unwrap_or(f64::NAN),
                need: need_by_budget(&curve, &of_first),
            }
        })
        .collect()
}

/// The size of a layer that comes closest to a number of texels in all, of even height.
fn size(map: Parametrization, texels: u64) -> UVec2 {
    2 * map.size_for(0.25 * texels as f64)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (budgets, count): (&[u64], u32) = context.pick(
            (&[1 << 10, 1 << 12, 1 << 14, 1 << 16, 1 << 18], 40_000),
            (&[1 << 10, 1 << 12], 300),
        );
        let field = LobeField::new(11);
        let mut random = Random::new(12);
        let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
        let right: Vec<f64> = directions.iter().map(|d| field.radiance(*d)).collect();
        let spread = deviation(&right);
        let look_ups = context.grid(&MAPS, budgets, |map, budget| {
            let size = size(*map, *budget);
            let (mut squares, mut worst) = (0.0, 0.0f64);
            for (d, right) in directions.iter().zip(&right) {
                let error = field.error(*map, size, *d, *right);
                squares += error * error;
                worst = greatest([worst, error.abs()]);
            }
            Ok(LookUps {
                map: map.to_string(),
                budget: *budget,
                size: format!("{} × {}", size.x, size.y),
                texels: u64::from(size.element_product() * map.layers()),
                rms: (squares / f64::from(count)).sqrt() / spread,
                worst: worst / spread,
            })
        })?;
        Ok(Self {
            look_ups,
            irradiance: irradiance(context)?,
        })
    }

    fn findings(&self) -> Findings {
        let falls = falls(&self.look_ups);
        let octahedron = Parametrization::OctahedronQuadratic.to_string();
        let need = falls.iter().find(|fall| fall.map == octahedron).map(|fall| fall.need);
        let widths = CONCENTRATIONS.map(|k| format!("{:.2}", 1.0 / k.sqrt())).join(", ");
        Findings::of(&falls, CRITERIA)
            .headline(
                "texels of the octahedron map for the cube's error, over the cube's, in this one field: geometric mean of the largest budgets \
                 (least … greatest)",
                need,
            )
            .curves(
                "error",
                "Bilinear look-ups of a light field",
                Axes::falling("texels, unused ones included", "RMS error over the field's deviation"),
                curves(
                    &self.look_ups,
                    |row| row.map.clone(),
                    |row| (row.texels as f64, row.rms.into()),
                ),
            )
            .note(format!(
                "Exponents by the {LARGEST} largest budgets; texels for the cube's error at each of these by its slope there: geometric mean, least … \
                 greatest. They are those of this field; `map-choice` has others."
            ))
            .and(Findings::of(&self.look_ups, &[]))
            .note(format!(
                "The field: {LOBES} lobes each of widths {widths}, in random directions, the same for all maps; looked up in uniform directions. \
                 Texels hold the field at their centres; borders are those of each map. All texels of a layer count, those outside of discs too."
            ))
            .and(Findings::of(&self.irradiance, OF_IRRADIANCE))
            .note(
                "Random normals. Texels hold the light at their centres, which for the sky is an error of its own; constant radiance shows that \
                 of the integral alone. By middles each texel counts with its exact solid angle and one direction, as prefiltered maps on the \
                 device do.",
            )
    }
}

/// Greatest errors of irradiance for random normals.
fn irradiance(context: &Context<'_>) -> Result<Vec<Lit>> {
    let (budgets, count): (&[u64], u32) = context.pick((&[1 << 8, 1 << 10, 1 << 12, 1 << 14], 100), (&[1 << 8], 5));
    let mut random = Random::new(13);
    let normals: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    context.grid(&MAPS, budgets, |map, budget| {
        let size = size(*map, *budget);
        let (constant, sky) = (held(*map, size, |_| 1.0)?, held(*map, size, |d| d.z.max(0.0))?);
        let of_constant = errors_of_irradiance(&constant, &normals, |_| PI);
        let of_sky = errors_of_irradiance(&sky, &normals, irradiance_of_sky);
        let [even, even_middles] = of_constant.map(|error| error / PI);
        let [sky, sky_middles] = of_sky.map(|error| error / (2.0 * PI / 3.0));
        Ok(Lit {
            map: map.to_string(),
            texels: u64::from(size.element_product() * map.layers()),
            even,
            even_middles,
            sky,
            sky_middles,
        })
    })
}
