//! Which map to take: storage, density and error of look-ups of every parametrization, in one plot, with verdicts from its numbers.
//!
//! Oracle: the environments at random directions, and exact solid angles of texels.

use clerestory::Result;
use clerestory::maps::Parametrization;
use glam::{DVec3, UVec2};

use super::choice::{ALIKE, best, sign};
use super::choice_plot::{self, Bars, Panel, Subject};
use super::environment_look_ups::{Errors, MAPS, TURNS, errors, name, size, texels};
use super::environments::{self, Environment, LIGHTS};
use super::needs::{need, spread};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;

/// Budgets of which needs are told, the largest ones.
const BUDGETS: usize = 3;
/// Rows of the maps of which densities are taken.
const DENSITY_ROWS: u32 = 256;
/// Least ratio of solid angles of maps without poles.
const FINEST: f64 = 0.1;
/// In place of an environment: their geometric mean.
const TOGETHER: &str = "geometric mean";
const CUBE_OR_OCTAHEDRON: &str = "cube or octahedron";
const ONE_RECTANGLE: &str = "one rectangle for an atlas, a summed-area table or a border of its own";

rows! {
    /// A map.
    struct Storage = "Storage and density" by [map] {
        map: String = "map",
        layers: u64 = "layers",
        unused: f64 = "unused texels (%)",
        rms: f64 = "RMS of relative density − 1",
        least: f64 = "least ratio of solid angles",
        greatest: f64 = "greatest ratio of solid angles",
        shear: f64 = "greatest shear",
    }
}

rows! {
    /// Look-ups in a map of an environment.
    struct LookUps = "Error of look-ups over the environment's deviation" by [map, environment, budget] {
        map: String = "map",
        environment: String = "environment",
        budget: u64 = "budget (texels of the sphere)",
        texels: f64 = "texels of the sphere",
        error: f64 = "RMS error, all turns",
        turns: Repeats = "RMS error by turn",
    }
}

rows! {
    /// What a map needs.
    struct Need = "Texels for the cube's error, over the cube's" by [map, budget, environment] {
        map: String = "map",
        budget: u64 = "budget (texels of the sphere)",
        environment: String = "environment",
        need: Measured = "texels for the cube's error, over the cube's",
    }
}

rows! {
    /// A question of the choice.
    struct Verdict = "Verdicts" by [question] {
        question: String = "question",
        answer: String = "answer that holds",
        answers: u64 = "maps that it names",
    }
}

/// What a map needs, also by each turn.
struct Needed {
    row: Need,
    by_turn: Vec<f64>,
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    maps: Vec<Storage>,
    look_ups: Vec<LookUps>,
}

const CRITERIA: &[Criterion<Verdict>] = &[
    Criterion::each(
        "cube or octahedron is decided at every budget and turn: answers",
        Bound::AtLeast(1.0),
        |row: &Verdict| row.answers.into(),
    )
    .among(|row| row.question == CUBE_OR_OCTAHEDRON)
    .because("needs on one side of a tenth more or less than the cube's, or within it, bear one answer"),
    Criterion::each(
        "one rectangle is decided at every budget and turn: maps",
        Bound::AtLeast(1.0),
        |row: &Verdict| row.answers.into(),
    )
    .among(|row| row.question == ONE_RECTANGLE)
    .because("a map within a tenth of the least at each of them, by all turns together and by each"),
];

const OF_NEEDS: &[Criterion<Need>] = &[Criterion::each(
    "the octahedron needs as many texels as the cube in every environment and at every budget: times the cube's",
    Bound::Between(1.0 / ALIKE, ALIKE),
    |row: &Need| row.need,
)
.among(Need::is_of_the_octahedron)
.because("a tenth more or less counts as one; intervals are least … greatest of the turns")];

impl Need {
    /// Whether it is the square octahedron's in one environment.
    fn is_of_the_octahedron(&self) -> bool {
        self.map == name(Parametrization::OctahedronQuadratic) && self.environment != TOGETHER
    }
}

/// The geometric mean of needs; not a number of none.
fn mean_need(needs: &[f64]) -> f64 {
    geometric_mean(needs.iter().map(|need| (*need).into())).map_or(f64::NAN, |mean| mean.value)
}

/// A number of all turns, least … greatest of each; not a number where one of these is none.
fn measured(all: f64, turns: &[f64]) -> Measured {
    Measured {
        value: all,
        low: -greatest(turns.iter().map(|need| -need)),
        high: greatest(turns.iter().copied()),
    }
}

/// Needs of all maps at the largest budgets, by environment and together.
fn needs(look_ups: &[LookUps]) -> Vec<Needed> {
    let mut all = Vec::new();
    let by_map: Vec<&[LookUps]> = look_ups.chunk_by(|a, b| a.map == b.map).collect();
    let Some(of_first) = by_map.first() else { return all };
    for of_map in &by_map {
        let curves = |rows: &'_ [LookUps]| -> Vec<Vec<LookUps>> {
            let of = |(light, _): &(&str, &str)| rows.iter().filter(|row| row.environment == *light).cloned().collect();
            LIGHTS.iter().map(of).collect()
        };
        let (own, cube) = (curves(of_map), curves(of_first));
        let budgets = own[0].len();
        for end in budgets + 1 - BUDGETS.min(budgets.saturating_sub(1))..=budgets {
            // By environment; of all turns, then of each.
            let of = |error: &dyn Fn(&LookUps) -> f64| -> Vec<f64> {
                let curve = |rows: &[LookUps]| -> Vec<(f64, f64)> {
                    rows[..end].iter().map(|row| (row.texels, error(row))).collect()
                };
                own.iter()
                    .zip(&cube)
                    .map(|(own, cube)| need(&curve(own), &curve(cube)))
                    .collect()
            };
            let together = of(&|row| row.error);
            let turns: Vec<Vec<f64>> = (0..TURNS as usize).map(|turn| of(&|row| row.turns.0[turn])).collect();
            let needed = |environment: &str, all: f64, by_turn: Vec<f64>| Needed {
                row: Need {
                    map: of_map[0].map.clone(),
                    budget: own[0][end - 1].budget,
                    environment: environment.into(),
                    need: measured(all, &by_turn),
                },
                by_turn,
            };
            for (at, (light, _)) in LIGHTS.iter().enumerate() {
                all.push(needed(
                    light,
                    together[at],
                    turns.iter().map(|needs| needs[at]).collect(),
                ));
            }
            let means = turns.iter().map(|needs| mean_need(needs));
            all.push(needed(TOGETHER, mean_need(&together), means.collect()));
        }
    }
    all
}

/// What follows from the numbers.
fn verdicts(maps: &[Storage], needs: &[Needed]) -> Vec<Verdict> {
    if needs.is_empty() {
        return Vec::new();
    }
    let known = |map: &str| MAPS.iter().copied().find(|known| name(*known) == map);
    let in_light = |map: &str, light: &str| -> Vec<&Needed> {
        let is_of_it = |need: &&Needed| need.row.map == map && need.row.environment == light;
        needs.iter().filter(is_of_it).collect()
    };
    let by_all_turns = |need: &Needed| vec![need.row.need.value];
    let by_each_turn = |need: &Needed| [&[need.row.need.value][..], &need.by_turn].concat();
    let fewest = |question: String,
                  light: &str,
                  values: &dyn Fn(&Needed) -> Vec<f64>,
                  among: &dyn Fn(Parametrization, &Storage) -> bool| {
        // A hemisphere is no choice for the sphere.
        let some = maps
            .iter()
            .filter(|row| known(&row.map).is_some_and(|map| map != Parametrization::Nusselt && among(map, row)));
        let values = |map: &str| in_light(map, light).into_iter().flat_map(values).collect();
        let some: Vec<(&str, Vec<f64>)> = some.map(|row| (row.map.as_str(), values(&row.map))).collect();
        let best = best(&some);
        Verdict {
            question,
            answer: if best.is_empty() {
                "none".into()
            } else {
                best.join(", ")
            },
            answers: best.len() as u64,
        }
    };
    let lights = LIGHTS.iter().map(|(light, _)| *light).chain([TOGETHER]);
    let mut all: Vec<Verdict> = lights
        .map(|light| fewest(format!("fewest texels, {light}"), light, &by_all_turns, &|_, _| true))
        .collect();
    // One rectangle that holds all directions and no unused texel.
    let is_rectangle = |map: Parametrization| map.layers() == 1 && !map.is_disc();
    all.push(fewest(ONE_RECTANGLE.into(), TOGETHER, &by_each_turn, &|map, _| {
        is_rectangle(map)
    }));
    all.push(fewest(
        format!("the same where no texel may be finer than {FINEST} of the mean, for what is rendered into it or blurred in it"),
        TOGETHER,
        &by_all_turns,
        &|map, row| is_rectangle(map) && row.least > FINEST,
    ));
    let octahedron = in_light(&name(Parametrization::OctahedronQuadratic), TOGETHER);
    let ends: Vec<f64> = octahedron
        .iter()
        .flat_map(|need| [need.row.need.value, need.row.need.low, need.row.need.high])
        .collect();
    let answer = match sign(&ends) {
        Some(std::cmp::Ordering::Greater) => "the cube, where the device filters it",
        Some(std::cmp::Ordering::Less) => "the octahedron",
        Some(std::cmp::Ordering::Equal) => "either, by what renders and filters it",
        None => "none",
    };
    all.push(Verdict {
        question: CUBE_OR_OCTAHEDRON.into(),
        answer: answer.into(),
        answers: u64::from(sign(&ends).is_some()),
    });
    all
}

/// The plot of all maps; none of a part of them.
fn plot(maps: &[Storage], look_ups: &[LookUps]) -> Option<String> {
    if maps.len() < MAPS.len() {
        return None;
    }
    let curve = |map: &str, light: &str| -> Vec<(f64, f64)> {
        let rows = look_ups.iter().filter(|row| row.map == map && row.environment == light);
        rows.map(|row| (row.texels, row.error)).collect()
    };
    let subject = |row: &Storage| Subject {
        name: row.map.clone(),
        curves: LIGHTS.iter().map(|(light, _)| curve(&row.map, light)).collect(),
    };
    let bars = |title, top, mark, of: fn(&Storage) -> [f64; 2]| Bars {
        title,
        top,
        mark,
        spans: maps.iter().map(of).collect(),
    };
    let bars = [
        bars("texels unused (%)", 25.0, None, |row| [0.0, row.unused]),
        bars("RMS deviation of texels' solid angles", 1.0, None, |row| [0.0, row.rms]),
        bars("least to greatest solid angle over the mean", 3.0, Some(1.0), |row| {
            [row.least, row.greatest]
        }),
    ];
    let panels = LIGHTS.map(|(title, _)| Panel { title });
    choice_plot::draw(&bars, &panels, &maps.iter().map(subject).collect::<Vec<_>>()).ok()
}

/// Storage and density of a map.
fn storage(map: Parametrization, rows: u32) -> Storage {
    let density = map.density_statistics(UVec2::new(rows * map.aspect(), rows));
    Storage {
        map: name(map),
        layers: map.layers().into(),
        unused: 100.0 * (1.0 - map.coverage()),
        rms: density.rms,
        least: density.min_ratio,
        greatest: density.max_ratio,
        shear: density.anisotropy,
    }
}

/// Errors of a map in all environments at a budget.
fn look_ups(map: Parametrization, budget: u64, environments: &[Environment], directions: &[DVec3]) -> Vec<LookUps> {
    let size = size(map, budget);
    let errors = errors(map, size, environments, directions);
    let row = |(environment, errors): (&Environment, Errors)| LookUps {
        map: name(map),
        environment: environment.name.into(),
        budget,
        texels: texels(map, size),
        error: errors.all,
        turns: Repeats(errors.by_turn),
    };
    environments.iter().zip(errors).map(row).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let powers: &[u32] = context.pick(&[10, 12, 14, 16, 18], &[6, 8, 10]);
        let count = context.pick(40_000, 300);
        let environments = environments::all()?;
        let mut random = Random::new(61);
        let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
        let mut maps = Vec::new();
        let look_ups = context.each(
            &MAPS,
            |map| name(*map),
            |map| {
                maps.push(storage(*map, context.pick(DENSITY_ROWS, 16)));
                let rows = powers
                    .iter()
                    .flat_map(|power| look_ups(*map, 1 << *power, &environments, &directions));
                Ok(rows.collect())
            },
        )?;
        Ok(Self { maps, look_ups })
    }

    fn findings(&self) -> Findings {
        let needs = needs(&self.look_ups);
        let rows: Vec<Need> = needs.iter().map(|need| need.row.clone()).collect();
        let octahedron = rows.iter().filter(|row| row.is_of_the_octahedron());
        let octahedron: Vec<f64> = octahedron.map(|row| row.need.value).collect();
        let lights = LIGHTS.map(|(name, about)| format!("{name}: {about}")).join("; ");
        let found = Findings::of(&verdicts(&self.maps, &needs), CRITERIA).headline(
            "texels of the octahedron map for the cube's error, over the cube's: geometric mean of all environments and budgets (least … greatest \
             of them)",
            (!octahedron.is_empty()).then(|| spread(&octahedron)),
        );
        let found = match plot(&self.maps, &self.look_ups) {
            Some(svg) => found.drawing("choice.svg", "Storage, density and error of all maps", svg),
            None => found,
        };
        found
            .note(format!(
                "Maps within a factor of {ALIKE} of the least count as one. Answers hold at every budget; those to the choice of cube or octahedron and of one \
                 rectangle hold by each turn too. Nusselt's map, of a hemisphere, is no choice for the sphere."
            ))
            .and(Findings::pivoted(&rows, "environment", OF_NEEDS))
            .note(format!(
                "Times as many texels in all, unused ones included, as the cube map has at a budget, for its error; from the errors there and the \
                 cube's slope from the budget before. Intervals are least … greatest of {TURNS} turns. Environments ({lights}), each in {TURNS} turns, \
                 are held by their values at the centres of texels and looked up bilinearly over all seams at random directions. Where the map folds, \
                 smooth light has a kink in it, which costs a quarter of the power by which errors fall, so that needs depend on the budget. Nusselt's \
                 map is judged over its hemisphere with half of the texels."
            ))
            .and(Findings::of(&self.maps, &[]))
            .note(format!("Ratios: solid angle of texels over the mean, {DENSITY_ROWS} rows a layer."))
            .and(Findings::of(&self.look_ups, &[]).long())
    }
}
