//! Which map to take: storage, density and error of look-ups of every parametrization, in one plot, with a verdict from its numbers.
//!
//! Oracle: the environments at random directions, and exact solid angles of texels.

use clerestory::film::atomic;
use clerestory::maps::Parametrization;
use clerestory::maps::statistics::DensityStatistics;
use clerestory::{Error, Result};
use glam::{DMat3, DVec3, UVec2};
use rayon::prelude::*;

use super::choice_plot::{self, Bars, Panel, Subject};
use super::environments::{self, Environment};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::random::Random;

/// All maps, the perspective family by its members of the document; the first is what the others are compared with.
const MAPS: [Parametrization; 12] = [
    Parametrization::Cube,
    Parametrization::EqualArea,
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::OctahedronPerspective {
        c: std::f64::consts::FRAC_1_SQRT_2,
    },
    Parametrization::OctahedronPerspective {
        c: std::f64::consts::SQRT_2,
    },
    Parametrization::OctahedronPerspective { c: 0.5 },
    Parametrization::OctahedronPerspective { c: 2.0 },
    Parametrization::DualParaboloid,
    Parametrization::LatLong,
    Parametrization::Sphere,
    Parametrization::Nusselt,
];

/// Turns of each environment, over which squares of errors are averaged: features lie elsewhere on the maps.
const TURNS: u32 = 6;
/// Rows of the maps of which densities are taken.
const DENSITY_ROWS: u32 = 256;
/// Least ratio of solid angles of maps without poles.
const FINEST: f64 = 0.1;
/// Maps whose need of texels differs by less than this factor are as good as each other.
const ALIKE: f64 = 1.1;

/// A map's name in tables and plots.
fn name(map: Parametrization) -> String {
    match map {
        Parametrization::OctahedronPerspective { c } => format!("octahedron c = {c:.3}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .into(),
        Parametrization::Nusselt => "nusselt (half)".into(),
        other => other.to_string(),
    }
}

/// The size of a layer that comes closest to a number of texels for the whole sphere.
fn size(map: Parametrization, texels: u64) -> UVec2 {
    let share = map.solid_angle() / (4.0 * std::f64::consts::PI);
    let rows = (share * texels as f64 / f64::from(map.layers() * map.aspect())).sqrt();
    let height = rows.round().max(2.0) as u32;
    UVec2::new(height * map.aspect(), height)
}

/// Texels for the whole sphere.
fn texels(map: Parametrization, size: UVec2) -> f64 {
    let share = map.solid_angle() / (4.0 * std::f64::consts::PI);
    f64::from(size.element_product() * map.layers()) / share
}

/// RMS error of look-ups over the environment's deviation, by environment.
fn errors(map: Parametrization, size: UVec2, environments: &[Environment], directions: &[DVec3]) -> Vec<f64> {
    // Squares of errors, values and squares of values.
    type Sums = [f64; 4];
    let turns: Vec<DMat3> = (0..TURNS).map(turn).collect();
    let of = |d: &DVec3| -> Vec<Sums> {
        let Some(taps) = map.taps(size, *d) else {
            return vec![[0.0; 4]; environments.len()];
        };
        let held: Vec<(f64, DVec3)> = taps
            .iter()
            .filter(|tap| tap.weight > 0.0)
            // The texel of a rim whose centre is outside of the disc holds what is at the rim.
            .map(|tap| (tap.weight, map.texel_direction(size, tap.texel).unwrap_or(*d)))
            .collect();
        let sums = |environment: &Environment| {
            let mut sums = [0.0; 4];
            for turn in &turns {
                let value = |d: DVec3| (environment.radiance)(*turn * d);
                let right = value(*d);
                let found: f64 = held.iter().map(|(weight, centre)| weight * value(*centre)).sum();
                let more = [(found - right).powi(2), right, right * right, 1.0];
                sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            }
            sums
        };
        environments.iter().map(sums).collect()
    };
    // In order, so that sums do not depend on the number of threads.
    let all: Vec<Vec<Sums>> = directions.par_iter().map(of).collect();
    (0..environments.len())
        .map(|at| {
            let mut sums = [0.0; 4];
            for one in &all {
                sums.iter_mut().zip(one[at]).for_each(|(sum, more)| *sum += more);
            }
            let [squares, values, value_squares, count] = sums;
            let deviation = (value_squares / count - (values / count).powi(2)).sqrt();
            (squares / count).sqrt() / deviation
        })
        .collect()
}

/// A turn that leads no axis to one.
fn turn(number: u32) -> DMat3 {
    let mut random = Random::new(60 + number);
    let (z, other) = (random.direction(), random.direction());
    let x = z.cross(other).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// What a map needs and costs.
struct Found {
    map: Parametrization,
    density: DensityStatistics,
    /// Texels and error, by environment and budget.
    curves: Vec<Vec<(f64, f64)>>,
    /// Texels for the cube's error over the cube's, at the largest budget, by environment.
    needs: Vec<f64>,
}

impl Found {
    /// Geometric mean over environments.
    fn need(&self) -> f64 {
        let logarithms: f64 = self.needs.iter().map(|need| need.ln()).sum();
        (logarithms / self.needs.len() as f64).exp()
    }

    /// One rectangle that holds all directions and no unused texel.
    fn is_one_rectangle(&self) -> bool {
        self.map.layers() == 1 && !self.map.is_disc()
    }
}

/// By how much an error falls when texels double, as a power: from the last two budgets.
fn slope(curve: &[(f64, f64)]) -> f64 {
    match curve {
        [.., (a, before), (b, after)] => -(after / before).ln() / (b / a).ln(),
        _ => f64::NAN,
    }
}

/// Times as many texels as another map has, for an error like its.
fn need(curve: &[(f64, f64)], other: &[(f64, f64)]) -> f64 {
    match (curve.last(), other.last()) {
        (Some((texels, error)), Some((of_other, error_of_other))) => {
            texels / of_other * (error / error_of_other).powf(1.0 / slope(other))
        }
        _ => f64::NAN,
    }
}

fn measured(context: &Context<'_>, environments: &[Environment]) -> Vec<Found> {
    let (powers, count): (Vec<u32>, u32) = if context.smoke {
        (vec![8, 10], 300)
    } else {
        (vec![10, 12, 14, 16, 18], 40_000)
    };
    let mut random = Random::new(61);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    let mut all: Vec<Found> = MAPS
        .iter()
        .map(|map| {
            let mut curves = vec![Vec::new(); environments.len()];
            for power in &powers {
                let size = size(*map, 1 << power);
                let errors = errors(*map, size, environments, &directions);
                for (curve, error) in curves.iter_mut().zip(errors) {
                    curve.push((texels(*map, size), error));
                }
            }
            let rows = if context.smoke { 16 } else { DENSITY_ROWS };
            Found {
                map: *map,
                density: map.density_statistics(UVec2::new(rows * map.aspect(), rows)),
                curves,
                needs: Vec::new(),
            }
        })
        .collect();
    let of_first = all.first().map_or_else(Vec::new, |first| first.curves.clone());
    for found in &mut all {
        found.needs = found
            .curves
            .iter()
            .zip(&of_first)
            .map(|(curve, other)| need(curve, other))
            .collect();
    }
    all
}

fn choice(all: &[Found], environments: &[Environment]) -> Table {
    let needs: Vec<String> = environments
        .iter()
        .map(|environment| format!("texels for the cube's error: {}", environment.name))
        .collect();
    let mut heads = vec![
        "map",
        "layers",
        "texels unused (%)",
        "RMS of relative density − 1",
        "least ratio of solid angles",
        "greatest ratio",
    ];
    heads.extend(needs.iter().map(String::as_str));
    heads.push("geometric mean");
    let mut table = Table::new("Which map to take", &heads);
    for found in all {
        let mut row: Vec<Cell> = vec![
            name(found.map).into(),
            u64::from(found.map.layers()).into(),
            (100.0 * (1.0 - found.map.coverage())).into(),
            found.density.rms.into(),
            found.density.min_ratio.into(),
            found.density.max_ratio.into(),
        ];
        row.extend(found.needs.iter().map(|need| Cell::from(*need)));
        row.push(found.need().into());
        table.row(row);
    }
    let abouts: Vec<String> = environments
        .iter()
        .map(|environment| format!("{}: {}", environment.name, environment.about))
        .collect();
    table.note(format!(
        "Need of texels: times as many texels in all, unused ones included, as the cube map has at the largest budget, for its error; from the errors there and \
         the cube's slope. Environments ({}), each in {TURNS} turns, are held by their values at the centres of texels and looked up bilinearly over all \
         seams at random directions. Where the map folds, smooth light has a kink in it, which costs a quarter of the power by which errors fall. Nusselt's map is judged over its hemisphere with half of the texels. Ratios: solid angle of texels over the mean, \
         {DENSITY_ROWS} rows a layer. Plot beside this table: `choice.svg`.",
        abouts.join("; "),
    ));
    for line in verdict(all, environments) {
        table.note(line);
    }
    table
}

/// Names of maps that need at most [`ALIKE`] times the texels of the best among some.
fn best(all: &[Found], among: impl Fn(&Found) -> bool, need: impl Fn(&Found) -> f64) -> (f64, Vec<String>) {
    let mut some: Vec<&Found> = all.iter().filter(|found| among(found)).collect();
    some.sort_by(|a, b| need(a).total_cmp(&need(b)));
    let least = some.first().map_or(f64::NAN, |first| need(first));
    let alike = some.iter().filter(|found| need(found) <= ALIKE * least);
    (least, alike.map(|found| name(found.map)).collect())
}

/// What follows from the numbers, in words.
fn verdict(all: &[Found], environments: &[Environment]) -> Vec<String> {
    // A hemisphere is no choice for the sphere.
    let whole = |found: &Found| found.map != Parametrization::Nusselt;
    let mut lines = Vec::new();
    for (at, environment) in environments.iter().enumerate() {
        let (least, names) = best(all, whole, |found| found.needs[at]);
        let (most, worst) = all
            .iter()
            .filter(|found| whole(found))
            .map(|found| (found.needs[at], name(found.map)))
            .fold((0.0, String::new()), |a, b| if b.0 > a.0 { b } else { a });
        let slope = all.first().map_or(f64::NAN, |first| slope(&first.curves[at]));
        lines.push(format!(
            "Verdict, {}: fewest texels by {} ({least:.2} of the cube's), most by {worst} ({most:.2}); the cube's error falls as texels to the power −{slope:.2}.",
            environment.name,
            names.join(", "),
        ));
    }
    let (least, names) = best(all, whole, Found::need);
    lines.push(format!(
        "Verdict, all together: least by {} ({least:.2} of the cube's texels; all that are within {:.0} % of it).",
        names.join(", "),
        100.0 * (ALIKE - 1.0),
    ));
    let one_rectangle = |found: &Found| whole(found) && found.is_one_rectangle();
    let (least, names) = best(all, one_rectangle, Found::need);
    let even = |found: &Found| one_rectangle(found) && found.density.min_ratio > FINEST;
    let (of_even, without_poles) = best(all, even, Found::need);
    lines.push(format!(
        "Verdict, one rectangle for an atlas, a summed-area table or a border of its own: {} ({least:.2}); where no texel may be finer than \
         {FINEST} of the mean, as at poles, for what is rendered into it or blurred in it: {} ({of_even:.2}).",
        names.join(", "),
        without_poles.join(", "),
    ));
    let even = all
        .iter()
        .filter(|found| whole(found) && found.density.rms < 1e-6)
        .map(|found| (found, name(found.map)));
    for (found, name) in even {
        lines.push(format!(
            "Verdict, even density alone: {name} has texels of one size and needs {:.2} of the cube's texels; its shear is {:.1}.",
            found.need(),
            found.density.anisotropy,
        ));
    }
    let of = |map: Parametrization| all.iter().find(|found| found.map == map);
    if let (Some(cube), Some(octahedron)) = (of(Parametrization::Cube), of(Parametrization::OctahedronQuadratic)) {
        let ratio = octahedron.need() / cube.need();
        let word = if ratio > ALIKE {
            "the cube, where the device filters it"
        } else if ratio < 1.0 / ALIKE {
            "the octahedron"
        } else {
            "either, by what renders and filters it"
        };
        lines.push(format!(
            "Verdict, cube or octahedron: the octahedron needs {ratio:.2} times the cube's texels: {word}."
        ));
    }
    lines
}

fn curves(all: &[Found], environments: &[Environment]) -> Table {
    let mut heads = vec!["map", "texels"];
    heads.extend(environments.iter().map(|environment| environment.name));
    let mut table = Table::new("Error of look-ups over the environment's deviation", &heads);
    for found in all {
        let budgets = found.curves.first().map_or(0, Vec::len);
        for budget in 0..budgets {
            let mut row: Vec<Cell> = vec![name(found.map).into(), found.curves[0][budget].0.into()];
            row.extend(found.curves.iter().map(|curve| Cell::from(curve[budget].1)));
            table.row(row);
        }
    }
    table.long()
}

fn plot(all: &[Found], environments: &[Environment]) -> Result<String> {
    let subjects: Vec<Subject> = all
        .iter()
        .map(|found| Subject {
            name: name(found.map),
            curves: found.curves.clone(),
        })
        .collect();
    let waste = |found: &Found| [0.0, 100.0 * (1.0 - found.map.coverage())];
    let rms = |found: &Found| [0.0, found.density.rms];
    let ratios = |found: &Found| [found.density.min_ratio, found.density.max_ratio];
    let bars = |title, top, mark, of: &dyn Fn(&Found) -> [f64; 2]| Bars {
        title,
        top,
        mark,
        spans: all.iter().map(of).collect(),
    };
    let bars = [
        bars("texels unused (%)", 25.0, None, &waste),
        bars("RMS deviation of texels' solid angles", 1.0, None, &rms),
        bars("least to greatest solid angle over the mean", 3.0, Some(1.0), &ratios),
    ];
    let panels: Vec<Panel<'_>> = environments
        .iter()
        .map(|environment| Panel {
            title: environment.name,
        })
        .collect();
    choice_plot::draw(&bars, &panels, &subjects)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let environments = environments::all()?;
    let all = measured(context, &environments);
    let svg = plot(&all, &environments)?;
    std::fs::create_dir_all(context.folder).map_err(|error| Error::io(context.folder, error))?;
    atomic::write(&context.folder.join("choice.svg"), svg.as_bytes())?;
    Ok(vec![choice(&all, &environments), curves(&all, &environments)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needs_and_slopes_of_power_laws_are_exact() {
        let law = |scale: f64| -> Vec<(f64, f64)> {
            [256.0f64, 1024.0, 4096.0]
                .map(|texels| (texels, scale * texels.powf(-0.5)))
                .to_vec()
        };
        assert!((slope(&law(3.0)) - 0.5).abs() < 1e-12);
        // Twice the error at slope −½ is four times the texels.
        assert!((need(&law(2.0), &law(1.0)) - 4.0).abs() < 1e-12);
        assert!((need(&law(1.0), &law(1.0)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn budgets_are_met_and_names_are_short() {
        for map in MAPS {
            for power in [10, 14, 18] {
                let budget = 1u64 << power;
                let ratio = texels(map, size(map, budget)) / budget as f64;
                // Half a row of the least map.
                assert!((0.9..1.1).contains(&ratio), "{map}: {ratio}");
            }
            assert!(name(map).chars().count() < 24, "{}", name(map));
        }
        assert_eq!(name(MAPS[4]), "octahedron c = 0.707");
        assert_eq!(name(MAPS[7]), "octahedron c = 2");
    }

    /// Bilinear look-ups of smooth light are off by the square of a texel: a quarter with four times the texels. Over folds the map itself has
    /// a kink, where they are off by a texel in a strip as wide: the root of its square over all is the power 3/2.
    #[test]
    fn errors_of_smooth_light_fall_as_the_texels_do() {
        let smooth = [Environment {
            name: "smooth",
            about: "a quadric",
            radiance: Box::new(|d| 1.0 + d.x * d.y + 0.5 * d.z),
        }];
        let mut random = Random::new(62);
        let directions: Vec<DVec3> = (0..2000).map(|_| random.direction()).collect();
        for (map, expected) in [
            (Parametrization::LatLong, 4.0f64),
            (Parametrization::OctahedronQuadratic, 4f64.powf(0.75)),
        ] {
            let at = |power: u32| errors(map, size(map, 1 << power), &smooth, &directions)[0];
            let ratio = at(12) / at(14);
            assert!((ratio / expected - 1.0).abs() < 0.15, "{map}: {ratio}");
        }
    }
}
