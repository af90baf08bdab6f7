//! Which map to take: storage, density and error of look-ups of every parametrization, in one plot, with a verdict from its numbers.
//!
//! Oracle: the environments at random directions, and exact solid angles of texels.

use clerestory::Result;
use clerestory::film::atomic;
use clerestory::maps::Parametrization;
use clerestory::maps::statistics::DensityStatistics;
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
/// Budgets of which needs are told, the largest ones.
const BUDGETS: usize = 3;
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
    map.size_for(share * texels as f64)
}

/// Texels for the whole sphere.
fn texels(map: Parametrization, size: UVec2) -> f64 {
    let share = map.solid_angle() / (4.0 * std::f64::consts::PI);
    f64::from(size.element_product() * map.layers()) / share
}

/// Squares of errors, values, squares of values and their number.
type Sums = [f64; 4];

/// RMS errors over the deviation, of all turns together and of each.
#[derive(Debug, Clone, PartialEq)]
struct Errors {
    all: f64,
    by_turn: Vec<f64>,
}

impl Errors {
    fn of(turns: &[Sums]) -> Self {
        let error = |[squares, values, value_squares, count]: Sums| {
            let deviation = (value_squares / count - (values / count).powi(2)).sqrt();
            (squares / count).sqrt() / deviation
        };
        let add = |a: Sums, b: &Sums| -> Sums { std::array::from_fn(|i| a[i] + b[i]) };
        Self {
            all: error(turns.iter().fold([0.0; 4], add)),
            by_turn: turns.iter().copied().map(error).collect(),
        }
    }
}

/// RMS error of look-ups over the environment's deviation, by environment.
fn errors(map: Parametrization, size: UVec2, environments: &[Environment], directions: &[DVec3]) -> Vec<Errors> {
    type ByTurn = [Sums; TURNS as usize];
    let turns: Vec<DMat3> = (0..TURNS).map(turn).collect();
    let of = |d: &DVec3| -> Vec<ByTurn> {
        let Some(taps) = map.taps(size, *d) else {
            return vec![ByTurn::default(); environments.len()];
        };
        let held: Vec<(f64, DVec3)> = taps
            .iter()
            .filter(|tap| tap.weight > 0.0)
            // The texel of a rim whose centre is outside of the disc holds what is at the rim.
            .map(|tap| (tap.weight, map.texel_direction(size, tap.texel).unwrap_or(*d)))
            .collect();
        let sums = |environment: &Environment| {
            let mut sums = ByTurn::default();
            for (sums, turn) in sums.iter_mut().zip(&turns) {
                let value = |d: DVec3| (environment.radiance)(*turn * d);
                let right = value(*d);
                let found: f64 = held.iter().map(|(weight, centre)| weight * value(*centre)).sum();
                *sums = [(found - right).powi(2), right, right * right, 1.0];
            }
            sums
        };
        environments.iter().map(sums).collect()
    };
    // In order, so that sums do not depend on the number of threads.
    let all: Vec<Vec<ByTurn>> = directions.par_iter().map(of).collect();
    (0..environments.len())
        .map(|at| {
            let mut sums = ByTurn::default();
            for one in &all {
                let terms = sums.as_flattened_mut().iter_mut().zip(one[at].as_flattened());
                terms.for_each(|(sum, more)| *sum += more);
            }
            Errors::of(&sums)
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

/// Texels for the cube's error over the cube's.
#[derive(Debug, Clone)]
struct Need {
    all: f64,
    /// Least and greatest over the turns.
    turns: [f64; 2],
}

/// What a map needs and costs.
struct Found {
    map: Parametrization,
    density: DensityStatistics,
    /// Texels and errors, by environment and budget.
    curves: Vec<Vec<(f64, Errors)>>,
    /// By budget, the largest last, and environment.
    needs: Vec<Vec<Need>>,
}

impl Found {
    /// Geometric mean over environments, by budget.
    fn means(&self) -> Vec<f64> {
        let mean = |needs: &Vec<Need>| {
            let logarithms: f64 = needs.iter().map(|need| need.all.ln()).sum();
            (logarithms / needs.len() as f64).exp()
        };
        self.needs.iter().map(mean).collect()
    }

    /// In one environment, by budget.
    fn needs_in(&self, environment: usize) -> Vec<f64> {
        self.needs.iter().map(|needs| needs[environment].all).collect()
    }

    fn plain_curve(&self, environment: usize) -> Vec<(f64, f64)> {
        let plain = |(texels, errors): &(f64, Errors)| (*texels, errors.all);
        self.curves[environment].iter().map(plain).collect()
    }

    /// One rectangle that holds all directions and no unused texel.
    fn is_one_rectangle(&self) -> bool {
        self.map.layers() == 1 && !self.map.is_disc()
    }
}

/// By how much an error falls when texels double, as a power: from the last two budgets of a curve.
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

fn needs(curve: &[(f64, Errors)], other: &[(f64, Errors)]) -> Need {
    let of = |pick: &dyn Fn(&Errors) -> f64| {
        let [curve, other] = [curve, other].map(|curve| {
            let points = curve.iter().map(|(texels, errors)| (*texels, pick(errors)));
            points.collect::<Vec<_>>()
        });
        need(&curve, &other)
    };
    let turns = (0..TURNS as usize).map(|turn| of(&|errors| errors.by_turn[turn]));
    Need {
        all: of(&|errors| errors.all),
        turns: turns.fold([f64::INFINITY, 0.0], |[low, high], need| {
            [low.min(need), high.max(need)]
        }),
    }
}

fn measured(context: &Context<'_>, environments: &[Environment]) -> Vec<Found> {
    let (powers, count): (Vec<u32>, u32) = if context.smoke {
        (vec![6, 8, 10], 300)
    } else {
        (vec![10, 12, 14, 16, 18], 40_000)
    };
    let mut random = Random::new(61);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    let mut all: Vec<Found> = Vec::new();
    for (done, map) in MAPS.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&name(*map), done, MAPS.len());
        let mut curves = vec![Vec::new(); environments.len()];
        for power in &powers {
            let size = size(*map, 1 << power);
            let errors = errors(*map, size, environments, &directions);
            for (curve, errors) in curves.iter_mut().zip(errors) {
                curve.push((texels(*map, size), errors));
            }
        }
        let rows = if context.smoke { 16 } else { DENSITY_ROWS };
        all.push(Found {
            map: *map,
            density: map.density_statistics(UVec2::new(rows * map.aspect(), rows)),
            curves,
            needs: Vec::new(),
        });
    }
    let of_first = all.first().map_or_else(Vec::new, |first| first.curves.clone());
    let judged = BUDGETS.min(powers.len() - 1);
    for found in &mut all {
        let at = |end: usize| {
            let pairs = found.curves.iter().zip(&of_first);
            pairs
                .map(|(curve, other)| needs(&curve[..end], &other[..end]))
                .collect()
        };
        found.needs = (powers.len() + 1 - judged..=powers.len()).map(at).collect();
    }
    all
}

/// Values of the budgets, from the least to the greatest.
fn across(values: &[f64]) -> String {
    let [low, high] = range(values).map(|value| Cell::from(value).to_string());
    if low == high { low } else { format!("{low} … {high}") }
}

fn range(values: &[f64]) -> [f64; 2] {
    let widen = |[low, high]: [f64; 2], value: &f64| [low.min(*value), high.max(*value)];
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], widen)
}

fn choice(all: &[Found], environments: &[Environment]) -> Table {
    let names: Vec<String> = environments
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
        "budget (texels)",
    ];
    for name in &names {
        heads.extend([name.as_str(), "least of the turns", "greatest"]);
    }
    heads.push("geometric mean");
    let mut table = Table::new("Which map to take", &heads);
    for found in all {
        let means = found.means();
        for (budget, (needs, mean)) in found.needs.iter().zip(&means).enumerate() {
            let curve = &found.curves[0];
            let at = curve.len() - found.needs.len() + budget;
            let mut row: Vec<Cell> = vec![
                name(found.map).into(),
                u64::from(found.map.layers()).into(),
                (100.0 * (1.0 - found.map.coverage())).into(),
                found.density.rms.into(),
                found.density.min_ratio.into(),
                found.density.max_ratio.into(),
                curve[at].0.into(),
            ];
            row.extend(
                needs
                    .iter()
                    .flat_map(|need| [need.all, need.turns[0], need.turns[1]].map(Cell::from)),
            );
            row.push((*mean).into());
            table.row(row);
        }
    }
    let abouts: Vec<String> = environments
        .iter()
        .map(|environment| format!("{}: {}", environment.name, environment.about))
        .collect();
    table.note(format!(
        "Need of texels: times as many texels in all, unused ones included, as the cube map has at a budget, for its error; from the errors there and \
         the cube's slope from the budget before, for all turns together and for the least and the greatest of them. Environments ({}), each in {TURNS} \
         turns, are held by their values at the centres of texels and looked up bilinearly over all seams at random directions. Where the map folds, \
         smooth light has a kink in it, which costs a quarter of the power by which errors fall, so that needs depend on the budget. Nusselt's map is \
         judged over its hemisphere with half of the texels. Ratios: solid angle of texels over the mean, {DENSITY_ROWS} rows a layer. A verdict holds \
         for the budgets of this table: for what is so at each of them. Plot beside this table: `choice.svg`.",
        abouts.join("; "),
    ));
    for line in verdict(all, environments) {
        table.note(line);
    }
    table
}

/// Maps that at every budget need at most [`ALIKE`] times the texels of the best among some, with what they need.
fn best(all: &[Found], among: impl Fn(&Found) -> bool, needs: impl Fn(&Found) -> Vec<f64>) -> String {
    let some: Vec<(&Found, Vec<f64>)> = all
        .iter()
        .filter(|found| among(found))
        .map(|found| (found, needs(found)))
        .collect();
    let budgets = some.first().map_or(0, |(_, needs)| needs.len());
    let least = |budget: usize| {
        some.iter()
            .map(|(_, needs)| needs[budget])
            .fold(f64::INFINITY, f64::min)
    };
    let least: Vec<f64> = (0..budgets).map(least).collect();
    let is_best =
        |(_, needs): &&(&Found, Vec<f64>)| needs.iter().zip(&least).all(|(need, least)| *need <= ALIKE * least);
    let names: Vec<String> = some
        .iter()
        .filter(is_best)
        .map(|(found, needs)| format!("{} ({})", name(found.map), across(needs)))
        .collect();
    if names.is_empty() {
        format!("none at every budget (the least needs {})", across(&least))
    } else {
        names.join(", ")
    }
}

/// What of needs is so at every budget: more than the cube's, fewer, or as many; `None` where budgets differ.
fn sign(needs: &[f64]) -> Option<std::cmp::Ordering> {
    let one = |need: &f64| match *need {
        need if need > ALIKE => std::cmp::Ordering::Greater,
        need if need < 1.0 / ALIKE => std::cmp::Ordering::Less,
        _ => std::cmp::Ordering::Equal,
    };
    let first = one(needs.first()?);
    needs.iter().all(|need| one(need) == first).then_some(first)
}

/// What follows from the numbers, in words.
fn verdict(all: &[Found], environments: &[Environment]) -> Vec<String> {
    // A hemisphere is no choice for the sphere.
    let whole = |found: &Found| found.map != Parametrization::Nusselt;
    let mut lines = Vec::new();
    for (at, environment) in environments.iter().enumerate() {
        let slope = all.first().map_or(f64::NAN, |first| slope(&first.plain_curve(at)));
        lines.push(format!(
            "Verdict, {}: fewest texels, of the cube's, by {}; the cube's error falls at the largest budget as texels to the power −{slope:.2}.",
            environment.name,
            best(all, whole, |found| found.needs_in(at)),
        ));
    }
    let percent = 100.0 * (ALIKE - 1.0);
    lines.push(format!(
        "Verdict, all together: fewest by {}; all that are within {percent:.0} % of the least.",
        best(all, whole, Found::means),
    ));
    let one_rectangle = |found: &Found| whole(found) && found.is_one_rectangle();
    let even = |found: &Found| one_rectangle(found) && found.density.min_ratio > FINEST;
    lines.push(format!(
        "Verdict, one rectangle for an atlas, a summed-area table or a border of its own: {}; where no texel may be finer than {FINEST} of the mean, as \
         at poles, for what is rendered into it or blurred in it: {}.",
        best(all, one_rectangle, Found::means),
        best(all, even, Found::means),
    ));
    for found in all.iter().filter(|found| whole(found) && found.density.rms < 1e-6) {
        lines.push(format!(
            "Verdict, even density alone: {} has texels of one size and needs {} of the cube's texels; its shear is {:.1}.",
            name(found.map),
            across(&found.means()),
            found.density.anisotropy,
        ));
    }
    let octahedron = all
        .iter()
        .find(|found| found.map == Parametrization::OctahedronQuadratic);
    if let Some(octahedron) = octahedron {
        let needs = octahedron.means();
        let word = match sign(&needs) {
            Some(std::cmp::Ordering::Greater) => "the cube, where the device filters it",
            Some(std::cmp::Ordering::Less) => "the octahedron",
            Some(std::cmp::Ordering::Equal) => "either, by what renders and filters it",
            None => "no verdict, since it depends on the budget",
        };
        lines.push(format!(
            "Verdict, cube or octahedron: the octahedron needs {} times the cube's texels: {word}.",
            across(&needs),
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
            row.extend(found.curves.iter().map(|curve| Cell::from(curve[budget].1.all)));
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
            curves: (0..environments.len()).map(|at| found.plain_curve(at)).collect(),
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
    if all.len() < MAPS.len() {
        // Stopped: no plot of a part.
        return Ok(vec![curves(&all, &environments)]);
    }
    let svg = plot(&all, &environments)?;
    atomic::write(&context.file("choice.svg")?, svg.as_bytes())?;
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
    fn verdicts_are_those_of_every_budget() {
        use std::cmp::Ordering;
        assert_eq!(sign(&[1.2, 1.5, 1.11]), Some(Ordering::Greater));
        assert_eq!(sign(&[0.8, 0.5]), Some(Ordering::Less));
        assert_eq!(sign(&[1.0, 1.05, 0.95]), Some(Ordering::Equal));
        assert_eq!(sign(&[1.3, 0.8, 0.7]), None);
        assert_eq!(sign(&[]), None);
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
            let at = |power: u32| errors(map, size(map, 1 << power), &smooth, &directions)[0].all;
            let ratio = at(12) / at(14);
            assert!((ratio / expected - 1.0).abs() < 0.15, "{map}: {ratio}");
        }
    }
}
