//! Lights in the order of what they might bring: how many carry how much (by `vpl_shares`), what it costs to leave the others out, and how long an order may be kept.
//!
//! Oracle: what all lights bring. Source of what this follows: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics
//! hardware, figures 6.4 to 6.8 and 6.10 to 6.13, and figures that were computed elsewhere for the same box.

use std::time::Instant;

use clerestory::Result;
use clerestory::techniques::instant_radiosity::selection::{
    KeptOrder, Resorting, above_threshold, gather_in_order, order_by_potential,
};
use clerestory::transport::environment::luminance;
use glam::DVec3;

use super::vpl_order_shown::{errors_shown, inverted, light_shown, plots, sorts_shown};
use super::vpl_shares::{self, Curve, Pixels, Rank, Share};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Panel, tiled};
use crate::timing::median;

/// Pixels across and down; the same of a smoke run.
const SIZE: [[u32; 2]; 2] = [[96, 60], [24, 15]];
/// Walks and seeds whose shares are found.
const WALKS: [(u32, u32); 4] = [(20, 0), (20, 1), (20, 2), (80, 3)];
/// Of the mean potential of a point's lights: the threshold of `MET-V3`.
const THRESHOLD: f64 = 0.2;
/// Panels of errors, and of points that were sorted.
const SHOWN: &str = "vpl-order.png";
/// Light by all lights, and by two shares of the potential.
const LIGHT: &str = "light.png";
/// Errors of both shares by how often lights are sorted.
const GRID: &str = "errors.png";
/// Pixels along a side that show one.
const ENLARGED: u32 = 3;
/// The share of points that a panel of light shows below white.
const BELOW_WHITE: f64 = 0.99;
const TURNS: usize = 11;

rows! {
    /// A rule by which points take lights.
    struct Row = "Shadow rays and errors by rule" by [rule, share] {
        rule: String = "lights are sorted",
        share: f64 = "share of the potential (%)",
        sorts: f64 = "points at which they are sorted (%)",
        rays: f64 = "shadow rays a point",
        in_vain: f64 = "and with those rolled back",
        of_all: f64 = "rays over those of all lights",
        error: f64 = "mean relative error (%)",
        bias: f64 = "mean relative bias (%)",
        plain: f64 = "error without rescaling (%)",
        time: Repeats = "time (s)",
        speed_up: Repeats = "time of all lights over this",
    }
}
rows! {
    /// A part of the work.
    struct Part = "Where time goes, all lights" by [part] {
        part: String = "part",
        time: Repeats = "time (s)",
        share: Repeats = "of the whole (%)",
        published: f64 = "published share (%)",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    shares: Vec<Share>,
    #[serde(default)]
    ranks: Vec<Rank>,
    curve: Vec<Curve>,
    rules: Vec<Row>,
    parts: Vec<Part>,
    /// Whether pictures of light and of errors were written, too.
    #[serde(default)]
    has_grid: bool,
}

/// By what points choose lights.
#[derive(Clone, Copy, PartialEq)]
enum Rule {
    /// All, as they come.
    All,
    Kept(Resorting),
    Threshold,
    Saturated,
}

const ALL: &str = "never: all lights";
const THRESHOLD_RULE: &str = "never: those above a threshold";
const SATURATED: &str = "at every point, until it is saturated";
const EVERY: &str = "at every point";
const FIFTH: &str = "at every 5th point";
const TENTH: &str = "at every 10th point";

/// Rules, and the shares that they take, %.
const RULES: [(&str, Rule, f64); 18] = [
    (ALL, Rule::All, 100.0),
    (EVERY, Rule::Kept(Resorting::Period(1)), 90.0),
    ("at every 2nd point", Rule::Kept(Resorting::Period(2)), 90.0),
    (FIFTH, Rule::Kept(Resorting::Period(5)), 90.0),
    (TENTH, Rule::Kept(Resorting::Period(10)), 90.0),
    ("at every 20th point", Rule::Kept(Resorting::Period(20)), 90.0),
    ("at every 50th point", Rule::Kept(Resorting::Period(50)), 90.0),
    (EVERY, Rule::Kept(Resorting::Period(1)), 80.0),
    (FIFTH, Rule::Kept(Resorting::Period(5)), 80.0),
    (TENTH, Rule::Kept(Resorting::Period(10)), 80.0),
    ("above 5 % misplaced", Rule::Kept(Resorting::Misplaced(0.05)), 90.0),
    ("above 10 % misplaced", Rule::Kept(Resorting::Misplaced(0.1)), 90.0),
    ("above 20 % misplaced", Rule::Kept(Resorting::Misplaced(0.2)), 90.0),
    ("above 30 % misplaced", Rule::Kept(Resorting::Misplaced(0.3)), 90.0),
    (EVERY, Rule::Kept(Resorting::Period(1)), 95.0),
    (EVERY, Rule::Kept(Resorting::Period(1)), 100.0),
    (THRESHOLD_RULE, Rule::Threshold, 0.0),
    (SATURATED, Rule::Saturated, 100.0),
];
/// Published optima of the period.
pub(super) const PERIODS: [(&str, f64); 6] = [
    (EVERY, 1.0),
    ("at every 2nd point", 2.0),
    (FIFTH, 5.0),
    (TENTH, 10.0),
    ("at every 20th point", 20.0),
    ("at every 50th point", 50.0),
];
/// Limits of misplaced lights, %.
pub(super) const LIMITS: [(&str, f64); 4] = [
    ("above 5 % misplaced", 5.0),
    ("above 10 % misplaced", 10.0),
    ("above 20 % misplaced", 20.0),
    ("above 30 % misplaced", 30.0),
];
/// Rules whose light is shown, and those whose errors are: by share, and by how often lights are sorted.
const LIGHT_OF: [(&str, f64); 3] = [(ALL, 100.0), (EVERY, 90.0), (EVERY, 80.0)];
const GRID_SHARES: [f64; 2] = [90.0, 80.0];
const GRID_RULES: [&str; 3] = [EVERY, FIFTH, TENTH];

impl Row {
    /// Whether it is that rule with that share, %.
    pub(super) fn is(&self, rule: &str, share: f64) -> bool {
        self.rule == rule && self.share == share
    }

    /// Whether some lights are left out, and the others stand for them.
    fn is_rescaled(&self) -> bool {
        self.share > 0.0 && self.share < 100.0
    }

    fn has_limit(&self) -> bool {
        self.rule.ends_with("misplaced")
    }
}

/// The period that takes the least time.
fn best_period(rows: &[&Row]) -> Option<Measured> {
    let time = |rule: &str| {
        let row = rows.iter().find(|row| row.is(rule, 90.0))?;
        Some(median(row.time.0.clone()))
    };
    let mut best: Option<(f64, f64)> = None;
    for (rule, period) in PERIODS {
        let time = time(rule)?;
        if best.is_none_or(|(least, _)| time < least) {
            best = Some((time, period));
        }
    }
    best.map(|(_, period)| period.into())
}

/// Rays, with those rolled back, of the rule with the best limit over those of a period of ten.
fn limit_over_period(rows: &[&Row]) -> Option<Measured> {
    let period = rows.iter().find(|row| row.is(TENTH, 90.0))?;
    let limits = rows.iter().filter(|row| row.has_limit());
    let least = limits.map(|row| row.in_vain).fold(f64::INFINITY, f64::min);
    Some((least / period.rays).into())
}

const OF_RULES: &[Criterion<Row>] = &[
    Criterion::each(
        "90 %, sorted at every point: mean error (%)",
        Bound::Between(1.7, 2.3),
        |row: &Row| row.error.into(),
    )
    .among(|row| row.is(EVERY, 90.0)),
    Criterion::each(
        "80 %, sorted at every point: mean error (%)",
        Bound::Between(3.2, 4.9),
        |row: &Row| row.error.into(),
    )
    .among(|row| row.is(EVERY, 80.0)),
    Criterion::each(
        "90 %, sorted at every point: rays over those of all lights",
        Bound::AtMost(0.75),
        |row: &Row| row.of_all.into(),
    )
    .among(|row| row.is(EVERY, 90.0)),
    Criterion::each(
        "80 %, sorted at every point: rays over those of all lights",
        Bound::AtMost(0.6),
        |row: &Row| row.of_all.into(),
    )
    .among(|row| row.is(EVERY, 80.0)),
    Criterion::each(
        "all lights are taken for all of the potential: mean error (%)",
        Bound::AtMost(1e-10),
        |row: &Row| row.error.into(),
    )
    .among(|row| row.is(EVERY, 100.0))
    .in_every_form(),
    Criterion::each(
        "rescaling errs less: error over that without",
        Bound::AtMost(1.0),
        |row: &Row| (row.error / row.plain).into(),
    )
    .among(Row::is_rescaled)
    .in_every_form(),
    Criterion::all("the best period by time", Bound::Between(5.0, 10.0), best_period),
    Criterion::all(
        "limits are no better than a period of ten: the least of their rays, with those rolled back, over its",
        Bound::AtLeast(1.0),
        limit_over_period,
    ),
    Criterion::each(
        "90 %, sorted at every tenth point: time of all lights over this",
        Bound::AtLeast(1.5),
        |row: &Row| (&row.speed_up).into(),
    )
    .among(|row| row.is(TENTH, 90.0)),
    Criterion::each(
        "80 %, sorted at every tenth point: time of all lights over this",
        Bound::AtLeast(1.9),
        |row: &Row| (&row.speed_up).into(),
    )
    .among(|row| row.is(TENTH, 80.0)),
];

const VISIBILITY: &str = "visibility";
const POTENTIAL: &str = "potential";
const SORT: &str = "sorts at every point, beside it";
const FIFTH_SORT: &str = "sorts at every 5th point, beside it";
/// Points from one that has its lights sorted to the next, of parts that are timed by themselves; none of the first.
const SORTS: [Option<usize>; 3] = [None, Some(1), Some(5)];
const OF_PARTS: &[Criterion<Part>] = &[Criterion::each(
    "most of the time is visibility's: share (%)",
    Bound::AtLeast(50.0),
    |row: &Part| (&row.share).into(),
)
.among(|row| row.part == VISIBILITY)];

/// What a rule brought, by point.
struct Brought {
    plain: Vec<DVec3>,
    rescaled: Vec<DVec3>,
    sorted: Vec<bool>,
    rays: u64,
    in_vain: u64,
    seconds: f64,
}

impl Pixels {
    /// The picture by a rule, from the potential to the last shadow ray.
    fn picture(&self, rule: Rule, share: f64, saturation: f64) -> Brought {
        let mut kept = KeptOrder::new(match rule {
            Rule::Kept(resorting) => resorting,
            _ => Resorting::Period(1),
        });
        let all: Vec<u32> = (0..self.lights.len() as u32).collect();
        let mut brought = Brought {
            plain: Vec::with_capacity(self.points.len()),
            rescaled: Vec::with_capacity(self.points.len()),
            sorted: Vec::with_capacity(self.points.len()),
            rays: 0,
            in_vain: 0,
            seconds: 0.0,
        };
        let (mut potentials, mut keys) = (Vec::new(), Vec::new());
        let clock = Instant::now();
        for point in &self.points {
            self.potentials(point, &mut potentials, &mut keys);
            let sorts = kept.sorts;
            let above;
            let (order, limit) = match rule {
                Rule::All => (&all[..], None),
                Rule::Kept(_) => (kept.next(&keys, share), None),
                Rule::Saturated => (kept.next(&keys, 1.0), Some(saturation)),
                Rule::Threshold => {
                    let mean = keys.iter().sum::<f64>() / keys.len() as f64;
                    above = above_threshold(&keys, THRESHOLD * mean);
                    (&above[..], None)
                }
            };
            let gathered = gather_in_order(&potentials, order, limit, |light| {
                self.unit_box.sees(point, &self.lights[light as usize])
            });
            brought.plain.push(gathered.radiance);
            brought.rescaled.push(match rule {
                Rule::Kept(_) => gathered.rescaled(),
                _ => gathered.radiance,
            });
            brought.rays += u64::from(gathered.rays);
            brought.sorted.push(kept.sorts > sorts);
        }
        brought.seconds = clock.elapsed().as_secs_f64();
        brought.in_vain = kept.rolled_back;
        brought
    }

    /// Seconds of finding the potentials alone, or with sorts at every so many points.
    fn without_rays(&self, sorts: Option<usize>) -> f64 {
        let (mut potentials, mut keys) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        let clock = Instant::now();
        for (i, point) in self.points.iter().enumerate() {
            self.potentials(point, &mut potentials, &mut keys);
            sum += keys.first().copied().unwrap_or(0.0);
            if sorts.is_some_and(|period| i % period == 0) {
                sum += f64::from(order_by_potential(&keys).first().copied().unwrap_or(0));
            }
        }
        let seconds = clock.elapsed().as_secs_f64();
        std::hint::black_box(sum);
        seconds
    }
}

/// Relative error of each point, its sign kept; none of points without light.
fn errors<'a>(found: &'a [DVec3], whole: &'a [DVec3]) -> impl Iterator<Item = f64> + Clone + 'a {
    let pairs = found.iter().zip(whole).filter(|(_, whole)| **whole != DVec3::ZERO);
    pairs.map(|(found, whole)| luminance(*found) / luminance(*whole) - 1.0)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Writes pictures of what rules brought, of the first so many of [`RULES`], where all lights brought `whole`, whose luminances are sorted.
fn write_pictures(context: &Context<'_>, size: [u32; 2], shown: &[Brought], whole: &[DVec3], sorted: &[f64]) {
    let of = |rule: &str, share: f64| {
        let place = RULES
            .iter()
            .position(|(name, _, other)| *name == rule && *other == share);
        place.and_then(|place| shown.get(place))
    };
    let errors_of = |rule: &str, share: f64| of(rule, share).map(|brought| errors_shown(&brought.rescaled, whole));
    let limited = of(LIMITS[0].0, 90.0).map(|brought| sorts_shown(&brought.sorted));
    let row: Option<Vec<Panel>> = [errors_of(EVERY, 90.0), errors_of(TENTH, 80.0), limited]
        .into_iter()
        .collect();
    context.picture(SHOWN, &tiled(size, 1, &[row.unwrap_or_default()]));
    let white = sorted[(BELOW_WHITE * (sorted.len() - 1) as f64) as usize];
    let light: Vec<Panel> = LIGHT_OF
        .into_iter()
        .filter_map(|(rule, share)| Some(light_shown(&of(rule, share)?.rescaled, white)))
        .collect();
    context.picture(LIGHT, &tiled(size, ENLARGED, &[light]));
    let grid = GRID_SHARES.map(|share| -> Vec<Panel> {
        let row = GRID_RULES.into_iter().filter_map(|rule| errors_of(rule, share));
        row.map(inverted).collect()
    });
    context.picture(GRID, &tiled(size, ENLARGED, &grid));
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let size = context.pick(SIZE[0], SIZE[1]);
        let mut found = Self::default();
        for (walks, seed) in context.first(&WALKS, 2) {
            let pixels = Pixels::of(size, *walks, *seed)?;
            let (share, mut curve) = pixels.shares(*walks, *seed);
            found.shares.push(share);
            if *seed == 0 {
                found.curve.append(&mut curve);
                found.ranks = pixels.ranks(*walks, size);
            }
        }
        let pixels = Pixels::of(size, WALKS[0].0, WALKS[0].1)?;
        let all = pixels.picture(Rule::All, 1.0, 0.0);
        let mut sorted: Vec<f64> = all.plain.iter().map(|radiance| luminance(*radiance)).collect();
        sorted.sort_by(f64::total_cmp);
        // Half of the points are saturated.
        let saturation = sorted[sorted.len() / 2];
        let by = |i: usize| pixels.picture(RULES[i].1, RULES[i].2 / 100.0, saturation);
        let times = context.in_turns(TURNS, RULES.len() + SORTS.len(), |i| {
            Ok(match i.checked_sub(RULES.len()) {
                None => by(i).seconds,
                Some(part) => pixels.without_rays(SORTS[part]),
            })
        })?;
        let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
        let n = pixels.points.len() as f64;
        let mut shown = Vec::new();
        for (i, (rule, _, share)) in RULES.iter().enumerate() {
            let brought = by(i);
            found.rules.push(Row {
                rule: (*rule).into(),
                share: *share,
                sorts: 100.0 * brought.sorted.iter().filter(|sorted| **sorted).count() as f64 / n,
                rays: brought.rays as f64 / n,
                in_vain: (brought.rays + brought.in_vain) as f64 / n,
                of_all: brought.rays as f64 / all.rays as f64,
                error: 100.0 * mean(errors(&brought.rescaled, &all.plain).map(f64::abs)),
                bias: 100.0 * mean(errors(&brought.rescaled, &all.plain)),
                plain: 100.0 * mean(errors(&brought.plain, &all.plain).map(f64::abs)),
                time: times[i].clone(),
                speed_up: times[0].over(&times[i]),
            });
            shown.push(brought);
        }
        write_pictures(context, size, &shown, &all.plain, &sorted);
        found.has_grid = true;
        let [potential, with_sorts, with_fifth] = [0, 1, 2].map(|part| &times[RULES.len() + part]);
        let less = |a: &Repeats, b: &Repeats| Repeats(a.0.iter().zip(&b.0).map(|(a, b)| a - b).collect());
        for (part, time, published) in [
            (VISIBILITY, less(&times[0], potential), 85.0),
            (POTENTIAL, potential.clone(), 15.0),
            (SORT, less(with_sorts, potential), 5.0),
            (FIFTH_SORT, less(with_fifth, potential), 1.0),
        ] {
            found.parts.push(Part {
                part: part.into(),
                share: time.over(&times[0]).scaled(100.0),
                time,
                published,
            });
        }
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let rays = self.rules.iter().find(|row| row.is(EVERY, 90.0));
        let rules = Findings::of(&self.rules, OF_RULES).headline(
            "shadow rays for 90 % of the potential over those of all lights",
            rays.map(|row| row.of_all.into()),
        );
        let rules = if self.rules.is_empty() {
            rules
        } else {
            rules.picture(
                SHOWN,
                "Relative errors, white from 20 % on: 90 % of the potential, sorted at every point; 80 %, at every tenth; and the points at which a limit of 5 % has lights sorted.",
            )
        };
        let rules = if self.has_grid {
            rules
                .picture(
                    LIGHT,
                    "All lights, and 90 and 80 % of the potential, sorted at every point.",
                )
                .picture(
                    GRID,
                    "Relative errors, black from 20 % on, of 90 % of the potential above and 80 % below: sorted at every point, at every 5th and at every 10th.",
                )
        } else {
            rules
        };
        let rules = plots(rules, &self.rules).note(
            "The unit box with walks from its lamp, whose own points are lights as in the source, all surfaces by Lambert's law; distances bounded by a tenth of the box. Pixels in rows, \
             from left to right. Rays are those of lights taken that might bring something. The source counts misplaced lights after their shadow rays, and so pays for those that it \
             rolls back; here the potentials alone tell where a point stops, so that none is sent in vain, and limits take fewer rays than periods. Lights are saturated at the median of \
             the picture, a threshold is a fifth of the mean potential of a point's lights; neither is rescaled. Nearly all of the time is that of shadow rays, a fiftieth that of sorting, where \
             the source has a twentieth: a longer period saves next to nothing and sends more rays, so that short ones are the best, and times are bounded by the rays that are left.",
        );
        rules
            .and(vpl_shares::of_shares(&self.shares, &self.curve))
            .and(vpl_shares::of_ranks(&self.ranks))
            .and(Findings::of(&self.parts, OF_PARTS).bars(
                "parts",
                "Where time goes, all lights (%)",
                &self.parts,
                |row| ["all lights".into(), row.part.clone()],
                |row| (&row.share).into(),
            ))
    }
}
