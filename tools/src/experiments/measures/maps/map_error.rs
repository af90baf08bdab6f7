//! Error of bilinear look-ups in maps of as many texels each, and of irradiance by them.
//!
//! Oracle: the light field itself, lobes of three widths in random directions, at random directions; the closed form of irradiance under a
//! sky that fades to the horizon.

use clerestory::Result;
use clerestory::film::atomic;
use clerestory::maps::irradiance::IrradianceSource;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DVec3, UVec2};

use crate::experiments::measures::Context;
use crate::experiments::plot::{self, Curve, PlotPoint, Words};
use crate::experiments::table::Table;
use crate::random::Random;

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
/// Concentrations of the lobes, exp(κ(cos − 1)); widths are 1/√κ.
const CONCENTRATIONS: [f64; 3] = [4.0, 64.0, 1024.0];
const LOBES: usize = 32;

/// Lobes: concentration, middle.
fn field() -> Vec<(f64, DVec3)> {
    let mut random = Random::new(11);
    let mut lobes = Vec::new();
    for concentration in CONCENTRATIONS {
        lobes.extend((0..LOBES).map(|_| (concentration, random.direction())));
    }
    lobes
}

fn radiance(field: &[(f64, DVec3)], d: DVec3) -> f64 {
    field.iter().map(|(k, middle)| (k * (middle.dot(d) - 1.0)).exp()).sum()
}

/// The size of a layer that comes closest to a number of texels in all, of even height.
fn size(map: Parametrization, texels: u64) -> UVec2 {
    2 * map.size_for(0.25 * texels as f64)
}

/// A map, the irradiance under what it holds by the normal, and the most that this is.
type Light<'a> = (MapImage, &'a dyn Fn(&DVec3) -> f64, f64);

/// Greatest errors of irradiance for random normals: by the function and by texels of one direction each.
fn irradiance(context: &Context<'_>) -> Result<Table> {
    let (budgets, count): (&[u64], u32) = if context.smoke {
        (&[256], 5)
    } else {
        (&[256, 1024, 4096, 16384], 100)
    };
    let mut random = Random::new(13);
    let normals: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    // ∫ over the half spaces about z and about the normal.
    let of_sky = |n: &DVec3| {
        let gamma = n.z.clamp(-1.0, 1.0).acos();
        2.0 / 3.0 * ((std::f64::consts::PI - gamma) * gamma.cos() + gamma.sin())
    };
    let mut table = Table::new(
        "Error of irradiance",
        &[
            "map",
            "texels",
            "constant radiance: greatest error over π",
            "by texels' middles",
            "sky: greatest error over 2π/3",
            "by texels' middles",
        ],
    );
    for (done, map) in MAPS.into_iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&format!("irradiance of {map}"), done, MAPS.len());
        for budget in budgets {
            let size = size(map, *budget);
            let sky = |d: DVec3| d.z.max(0.0);
            let held = |of: &(dyn Fn(DVec3) -> f64 + Sync)| {
                MapImage::from_fn(map, size, |texel| {
                    // At the rim of a disc, the texel's point next to the middle.
                    let [lower, upper] = texel.bounds(size);
                    let uv = glam::DVec2::splat(0.5).clamp(lower, upper);
                    let inside = clerestory::maps::MapPoint { layer: texel.layer, uv };
                    let d = map.texel_direction(size, texel).or_else(|| map.decode(inside));
                    DVec3::splat(d.map_or(0.0, of))
                })
            };
            let mut row = vec![
                map.to_string().into(),
                u64::from(size.element_product() * map.layers()).into(),
            ];
            let constant = |_: &DVec3| std::f64::consts::PI;
            let lights: [Light<'_>; 2] = [
                (held(&|_| 1.0)?, &constant, std::f64::consts::PI),
                (held(&sky)?, &of_sky, 2.0 * std::f64::consts::PI / 3.0),
            ];
            for (image, right, most) in &lights {
                let source = IrradianceSource::new(image);
                let parts: Vec<(DVec3, f64)> = map
                    .texels(size)
                    .filter_map(|texel| {
                        let angle = map.texel_solid_angle(size, texel);
                        let d = map.texel_direction(size, texel)?;
                        Some((d, angle * f64::from(image.at(texel).x)))
                    })
                    .collect();
                let mut worst = [0.0f64; 2];
                for n in &normals {
                    let exact = source.irradiance(*n).unwrap_or_default().x;
                    let middles: f64 = parts.iter().map(|(d, light)| light * n.dot(*d).max(0.0)).sum();
                    for (worst, found) in worst.iter_mut().zip([exact, middles]) {
                        *worst = worst.max((found - right(n)).abs() / most);
                    }
                }
                row.extend(worst.map(Into::into));
            }
            table.row(row);
        }
    }
    table.note(format!(
        "{count} random normals. Texels hold the light at their centres, which for the sky is an error of its own; constant radiance shows that of the integral alone. By middles each \
         texel counts with its exact solid angle and one direction, as prefiltered maps on the device do."
    ));
    Ok(table)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (budgets, count) = if context.smoke {
        (10..=12, 300)
    } else {
        (10..=18, 40_000)
    };
    let budgets: Vec<u64> = budgets.step_by(2).map(|power| 1u64 << power).collect();
    let field = field();
    let mut random = Random::new(12);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    let exact: Vec<f64> = directions.iter().map(|d| radiance(&field, *d)).collect();
    let mean = exact.iter().sum::<f64>() / f64::from(count);
    let spread = (exact.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / f64::from(count)).sqrt();
    let mut table = Table::new(
        "Error of bilinear look-ups",
        &[
            "map",
            "budget (texels)",
            "size of a layer",
            "texels",
            "RMS error over the field's deviation",
            "greatest error over it",
            "RMS error × texels over that of the first",
        ],
    );
    let mut curves: Vec<Curve> = Vec::new();
    let mut first = vec![f64::NAN; budgets.len()];
    for (done, map) in MAPS.into_iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&format!("look-ups of {map}"), done, MAPS.len());
        let mut points = Vec::new();
        for (at, budget) in budgets.iter().enumerate() {
            let size = size(map, *budget);
            let texels = f64::from(size.element_product() * map.layers());
            let (mut squares, mut worst) = (0.0, 0.0f64);
            for (d, value) in directions.iter().zip(&exact) {
                let taps = map.taps(size, *d);
                let taps = taps.iter().flatten().filter(|tap| tap.weight > 0.0);
                // The texel of a rim whose centre is outside of the disc holds what is at the rim.
                let held = taps.map(|tap| {
                    let centre = map.texel_direction(size, tap.texel).unwrap_or(*d);
                    tap.weight * radiance(&field, centre)
                });
                let error = held.sum::<f64>() - value;
                squares += error * error;
                worst = worst.max(error.abs());
            }
            let rms = (squares / f64::from(count)).sqrt() / spread;
            if first[at].is_nan() {
                first[at] = rms * texels;
            }
            points.push(PlotPoint {
                x: texels,
                y: rms,
                y_range: [rms; 2],
                ringed: false,
            });
            table.row([
                map.to_string().into(),
                (*budget).into(),
                format!("{} × {}", size.x, size.y).into(),
                (texels as u64).into(),
                rms.into(),
                (worst / spread).into(),
                (rms * texels / first[at]).into(),
            ]);
        }
        curves.push(Curve {
            name: map.to_string(),
            points,
        });
    }
    table.note(format!(
        "The field: {LOBES} lobes each of widths {}, in random directions, the same for all maps; {count} uniform directions. Texels hold \
         the field at their centres; borders are those of each map. All texels of a layer count, those outside of discs as well. \
         The last column is how many times the texels of the first map give as small an error, where errors fall as one over the texels. Plot beside this table: `error.svg`.",
        CONCENTRATIONS.map(|k| format!("{:.2}", 1.0 / k.sqrt())).join(", "),
    ));
    let words = Words {
        title: "Bilinear look-ups of a light field",
        x: "texels, unused ones included",
        y: "RMS error over the field's deviation",
    };
    if let Some(svg) = plot::log_log(words, &curves)? {
        atomic::write(&context.file("error.svg")?, svg.as_bytes())?;
    }
    Ok(vec![table, irradiance(context)?])
}
