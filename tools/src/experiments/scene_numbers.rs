//! Numbers of a scene that criteria judge, each in the interval by the jackknife over the repeats ([`super::jackknife`]), whose seeds are common to all
//! variants, and by the noise of the reference, which all repeats share; of seconds alone and of fronts, in that of what each repeat gives by itself.
//!
//! What a variant has no number for, since it could not render the scene or its error has no logarithm, is not a number, which no bound holds.

use super::equal_error::{self, Cost, Reading};
use super::findings::{Measured, Repeats};
use super::jackknife::{self, mean_without};
use super::measurement::Measurement;
use super::pareto;
use super::reference::short_name;
use super::results::{Point, SceneResults, VariantResults};
use super::series::fall;
use super::slope::{at_most, stands_out};
use super::sweep::Sweep;
use super::sweep_criteria::{Kind, OnFront};

/// A scene with the sweep that it is of.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// What was rendered.
    pub sweep: &'a Sweep,
    /// What was found.
    pub results: &'a SceneResults,
}

impl<'a> Scene<'a> {
    /// What is measured, with the name of its row.
    pub fn numbers(&self, kind: &Kind) -> Vec<(String, Measured)> {
        let each = |of: &[String], number: &dyn Fn(&str) -> Option<Measured>| {
            let named = |name: &String| (of.len() > 1).then(|| name.clone());
            of.iter()
                .map(|name| (named(name), number(name)))
                .collect::<Vec<(Option<String>, Option<Measured>)>>()
        };
        let found = match kind {
            Kind::Slope { of, from } => each(of.all(), &|name| self.slope(name, from.unwrap_or(0.0))),
            Kind::SlopeBelow { of, below } => vec![(None, self.slope_below(of, below))],
            Kind::SpeedUp { of, over } => vec![(None, self.speed_up(of.all(), over.all()))],
            Kind::Error { of, over, budget } => each(of.all(), &|name| self.error(name, over, *budget)),
            Kind::Seconds { of, over, budget } => each(of.all(), &|name| self.seconds(name, over, *budget)),
            Kind::Bias { of } => each(of.all(), &|name| self.bias(name)),
            Kind::Front { .. } => vec![(None, kind.on_front().and_then(|on| self.front(on)))],
        };
        let address = &self.results.address;
        let address = short_name(address);
        let row = |(name, number): (Option<String>, Option<Measured>)| {
            let label = name.map_or_else(|| format!("`{address}`"), |name| format!("`{address}`, {name}"));
            (label, number.unwrap_or(Measured::exact(f64::NAN)))
        };
        found.into_iter().map(row).collect()
    }

    /// How many pixels and samples of all pictures are not finite, with the name of the row; `None` without pictures. A pixel that its picture's error
    /// leaves out counts in both of a measurement's numbers.
    pub fn not_finite(&self) -> Option<(String, Measured)> {
        let points = self.results.variants.iter().flat_map(|variant| &variant.points);
        let mut measurements = points.flat_map(|point| &point.measurements).peekable();
        measurements.peek()?;
        let count: u64 = measurements.map(|one| one.non_finite + one.error.skipped).sum();
        Some((format!("`{}`", short_name(&self.results.address)), count.into()))
    }

    fn variant(&self, name: &str) -> Option<&'a VariantResults> {
        self.results.variants.iter().find(|variant| variant.name == name)
    }

    /// That of a budget, else of the greatest.
    fn point(&self, variant: &str, budget: Option<f64>) -> Option<&'a Point> {
        let wanted = budget.or_else(|| Some(self.sweep.budgets().last()?.amount()))?;
        let mut points = self.variant(variant)?.points.iter();
        points.find(|point| point.budget.amount() == wanted)
    }

    fn slope(&self, variant: &str, from: f64) -> Option<Measured> {
        let fit = fall(self.variant(variant)?, from)?;
        Some(jackknife::measured(fit.without.len(), fit.by_reference, |left_out| {
            left_out.map_or(fit.value, |repeat| fit.without[repeat])
        }))
    }

    fn slope_below(&self, of: &str, below: &str) -> Option<Measured> {
        let (a, b) = (fall(self.variant(of)?, 0.0)?, fall(self.variant(below)?, 0.0)?);
        let differences: Vec<f64> = a.without.iter().zip(&b.without).map(|(a, b)| a - b).collect();
        let (of_all, by_reference) = (a.value - b.value, a.by_reference - b.by_reference);
        Some(jackknife::measured(differences.len(), by_reference, |left_out| {
            left_out.map_or(of_all, |repeat| differences[repeat])
        }))
    }

    /// Each replicate has the best variants of its own, all at the error that both sides reach with all repeats. A cost that is only bounded leaves one end
    /// of the ratio open. `None` where one of the variants could not render the scene: a side that lacks one is not the side that is meant.
    fn speed_up(&self, of: &[String], over: &[String]) -> Option<Measured> {
        let side = |names: &[String]| -> Option<Vec<Curve<'a>>> {
            names.iter().map(|name| Curve::of(self.variant(name)?)).collect()
        };
        let (of, over) = (side(of)?, side(over)?);
        let points = || of.iter().chain(&over).flat_map(|curve| curve.points);
        let repeats = points().map(|point| point.measurements.len()).min()?;
        let by_reference = points().map(reference_error).fold(0.0, f64::max);
        let least = |side: &[Curve<'_>]| side.iter().filter_map(Curve::least).reduce(f64::min);
        let target = least(&of)?.max(least(&over)?);
        let (of, over) = (Side::of(&of, target)?, Side::of(&over, target)?);
        let logarithm =
            |left_out: Option<usize>, added: f64| (over.cost(left_out, added) / of.cost(left_out, added)).ln();
        let shared = logarithm(None, by_reference) - logarithm(None, 0.0);
        let found = jackknife::measured(repeats, shared, |left_out| logarithm(left_out, 0.0));
        let Measured { value, low, high } = exponential(found);
        Some(Measured {
            value,
            low: if over.is_at_most { 0.0 } else { low },
            high: if of.is_at_most { f64::INFINITY } else { high },
        })
    }

    fn error(&self, of: &str, over: &str, budget: Option<f64>) -> Option<Measured> {
        let points = [self.point(of, budget)?, self.point(over, budget)?];
        let by_reference = points.map(reference_error).into_iter().fold(0.0, f64::max);
        let [a, b] = points.map(relative_mse);
        Some(ratio(&a, &b, by_reference))
    }

    fn seconds(&self, of: &str, over: &str, budget: Option<f64>) -> Option<Measured> {
        let [a, b] = [self.point(of, budget)?, self.point(over, budget)?];
        let seconds = |point| Repeats(values(point, |one| one.seconds));
        Some(seconds(a).over(&seconds(b)).measured())
    }

    fn bias(&self, variant: &str) -> Option<Measured> {
        let point = self.point(variant, None)?;
        let biases = values(point, |one| one.relative_bias.unwrap_or(f64::NAN));
        let mean = |left_out| mean_without(&biases, left_out);
        Some(jackknife::measured(
            biases.len(),
            self.results.reference_error_of_mean,
            mean,
        ))
    }

    /// A front has no deviation: each repeat has one of its own, and what is measured is the median.
    fn front(&self, on: OnFront<'_>) -> Option<Measured> {
        let points: Vec<(usize, &Point)> = self
            .results
            .variants
            .iter()
            .enumerate()
            .flat_map(|(variant, results)| results.points.iter().map(move |point| (variant, point)))
            .collect();
        let repeats = points.iter().map(|(_, point)| point.measurements.len()).min()?;
        let of_repeat = |repeat: usize| {
            // An MSE that noise has brought below 0 has no root and is the least there is.
            let at: Vec<(f64, f64)> = points
                .iter()
                .map(|(_, point)| &point.measurements[repeat])
                .map(|one| (one.seconds, one.error.relative_mse))
                .collect();
            let on_front = pareto::front(&at).into_iter().zip(&points).zip(&at);
            let on_front = on_front.filter(|((on_front, _), _)| *on_front);
            self.along(
                on,
                &on_front.map(|((_, point), at)| (point.0, at.0)).collect::<Vec<_>>(),
            )
        };
        Some((0..repeats).map(of_repeat).collect::<Repeats>().measured())
    }

    /// Of a front's points, each a variant with its seconds.
    fn along(&self, on: OnFront<'_>, points: &[(usize, f64)]) -> f64 {
        let share = |counts: &dyn Fn(usize) -> bool| {
            points.iter().filter(|(variant, _)| counts(*variant)).count() as f64 / points.len() as f64
        };
        match on {
            OnFront::Share(names) => share(&|variant| names.contains(&self.sweep.variants[variant].name)),
            OnFront::Rises(setting) => {
                let stated = points
                    .iter()
                    .filter_map(|(variant, seconds)| Some((*seconds, self.stated(*variant, setting)?)));
                pareto::rank_correlation(&stated.collect::<Vec<_>>())
            }
            OnFront::Inside(setting) => {
                let all = (0..self.sweep.variants.len()).filter_map(|variant| self.stated(variant, setting));
                let (least, most) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
                    (least.min(value), most.max(value))
                });
                let inside = |value: f64| least < value && value < most;
                share(&|variant| self.stated(variant, setting).is_some_and(inside))
            }
            OnFront::Most(setting) => {
                let mut stated: Vec<f64> = points
                    .iter()
                    .filter_map(|(variant, _)| self.stated(*variant, setting))
                    .collect();
                stated.sort_by(f64::total_cmp);
                // Of as many points the least value, which comes first.
                let counts = stated.chunk_by(|a, b| a == b).map(|equal| (equal[0], equal.len()));
                let more = |most: (f64, usize), next: (f64, usize)| if next.1 > most.1 { next } else { most };
                counts.reduce(more).map_or(f64::NAN, |most| most.0)
            }
        }
    }

    /// A setting where the experiment states it: defaults need not matter to a variant.
    fn stated(&self, variant: usize, setting: &str) -> Option<f64> {
        self.sweep.variants[variant].settings.get(setting)?.as_f64()
    }
}

fn values(point: &Point, of: impl Fn(&Measurement) -> f64) -> Vec<f64> {
    point.measurements.iter().map(of).collect()
}

fn relative_mse(point: &Point) -> Vec<f64> {
    values(point, |one| one.error.relative_mse)
}

/// The standard error that the reference's noise gives a budget's relative MSE.
fn reference_error(point: &Point) -> f64 {
    let errors = point.measurements.iter().map(|one| one.error.reference_relative_error);
    errors.fold(0.0, f64::max)
}

fn exponential(logarithm: Measured) -> Measured {
    Measured {
        value: logarithm.value.exp(),
        low: logarithm.low.exp(),
        high: logarithm.high.exp(),
    }
}

/// The ratio of the means of repeats' MSEs, whose reference gives both the same error with this standard error. Where one of them is lost in noise it has
/// no logarithm: from the least to the greatest ratio of what both may be.
fn ratio(a: &[f64], b: &[f64], by_reference: f64) -> Measured {
    let repeats = a.len().min(b.len());
    let (a, b) = (&a[..repeats], &b[..repeats]);
    let [mean_a, mean_b] = [a, b].map(|mse| mean_without(mse, None));
    let known = [a, b].map(|mse| stands_out(mse, by_reference));
    if known == [true; 2] {
        let shared = by_reference * (1.0 / mean_a - 1.0 / mean_b);
        let logarithm = |left_out| (mean_without(a, left_out) / mean_without(b, left_out)).ln();
        return exponential(jackknife::measured(repeats, shared, logarithm));
    }
    let [a, b] = [a, b].map(|mse| jackknife::measured(repeats, by_reference, |left_out| mean_without(mse, left_out)));
    let over = |a: f64, b: f64| if b > 0.0 { a.max(0.0) / b } else { f64::INFINITY };
    Measured {
        // Of what is below the noise, the most that it may be.
        value: over(a.value, if known[1] { b.value } else { b.high }),
        low: over(a.low, b.high),
        high: over(a.high, b.low),
    }
}

/// Seconds and relative RMSE of a variant by rising budget.
struct Curve<'a> {
    points: &'a [Point],
    /// Of each budget whose error is lost in noise, the most that its MSE may be.
    lost: Vec<Option<f64>>,
    of_all: Vec<(f64, f64)>,
}

impl<'a> Curve<'a> {
    /// `None` of a variant that could not render the scene.
    fn of(variant: &'a VariantResults) -> Option<Self> {
        if variant.refused.is_some() || variant.points.is_empty() {
            return None;
        }
        let lost = |point: &Point| {
            let (mse, by_reference) = (relative_mse(point), reference_error(point));
            (!stands_out(&mse, by_reference)).then(|| at_most(&mse, by_reference))
        };
        let mut curve = Self {
            points: &variant.points,
            lost: variant.points.iter().map(lost).collect(),
            of_all: Vec::new(),
        };
        curve.of_all = curve.at(None, 0.0);
        Some(curve)
    }

    /// Without one of the repeats, with so much added to every MSE; geometric means of seconds, since the jackknife fails for medians. A budget that is
    /// lost in noise has the most that its error may be: what is read off beside it is the most that the error may cost.
    fn at(&self, left_out: Option<usize>, added: f64) -> Vec<(f64, f64)> {
        let of_budget = |(point, lost): (&Point, &Option<f64>)| {
            let seconds = mean_without(&values(point, |one| one.seconds.ln()), left_out).exp();
            let mse = lost.unwrap_or_else(|| mean_without(&relative_mse(point), left_out) + added);
            (seconds, mse.sqrt())
        };
        self.points.iter().zip(&self.lost).map(of_budget).collect()
    }

    fn least(&self) -> Option<f64> {
        self.of_all.iter().map(|point| point.1).reduce(f64::min)
    }
}

/// The variants of a side that reach an error.
struct Side<'a> {
    readings: Vec<(&'a Curve<'a>, Reading)>,
    error: f64,
    /// Whether one of the side may have reached it earlier: below its least budget, or beside one that is lost in noise.
    is_at_most: bool,
}

impl<'a> Side<'a> {
    fn of(curves: &'a [Curve<'a>], error: f64) -> Option<Self> {
        let read = |curve: &'a Curve<'a>| Some((curve, equal_error::read(&curve.of_all, error)?));
        let mut readings = curves.iter().map(read).collect::<Option<Vec<_>>>()?;
        let is_at_most = readings.iter().any(|(curve, reading)| {
            let is_lost = reading.budgets().iter().any(|budget| curve.lost[*budget].is_some());
            is_lost || matches!(reading.cost, Cost::AtMost(_))
        });
        readings.retain(|(_, reading)| !matches!(reading.cost, Cost::Above(_)));
        Some(Self {
            readings,
            error,
            is_at_most,
        })
    }

    /// Seconds of the variant that reaches it first; not a number where one of them has none.
    fn cost(&self, left_out: Option<usize>, added: f64) -> f64 {
        let costs = self
            .readings
            .iter()
            .map(|(curve, reading)| reading.on(&curve.at(left_out, added), self.error));
        let less = |a: f64, b: f64| if a.is_nan() || a < b { a } else { b };
        costs.reduce(less).unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use clerestory::film::ToneMap;
    use serde_json::Value;

    use super::super::measurement::tests::made_up;
    use super::super::sweep::Budget;
    use super::super::sweep_criteria::Is;
    use super::*;

    const TEXT: &str = "scenes = [\"builtin:ring\"]\nsize = [2, 1]\nspp = [4, 16, 64]\nrepeats = 5\nreference = { spp = 1024 }\n\
                        [[variant]]\nname = \"a\"\nsettings = { photons = 1 }\n[[variant]]\nname = \"b\"\nsettings = { photons = 2 }\n\
                        [[variant]]\nname = \"c\"\nsettings = { photons = 3 }\n";

    pub(in super::super) fn made_up_sweep() -> Sweep {
        toml::from_str(TEXT).unwrap()
    }

    /// A variant by seconds and MSE of so many samples and a repeat.
    fn variant(name: &str, repeats: u32, of: impl Fn(f64, u32) -> (f64, f64)) -> VariantResults {
        let point = |spp: u32| Point {
            budget: Budget::Spp(spp),
            measurements: (0..repeats)
                .map(|seed| {
                    let (seconds, mse) = of(f64::from(spp), seed);
                    made_up("", Budget::Spp(spp), seed, seconds, mse)
                })
                .collect(),
        };
        VariantResults {
            name: name.into(),
            technique: "path".into(),
            settings: Value::Null,
            refused: None,
            points: [4, 16, 64].map(point).to_vec(),
            picture: None,
        }
    }

    fn scene(variants: Vec<VariantResults>) -> SceneResults {
        SceneResults {
            address: "builtin:ring".into(),
            triangles: 1,
            reference: "r.exr".into(),
            tone: ToneMap::default(),
            reference_error_of_mean: 1e-4,
            reference_picture: None,
            variants,
        }
    }

    fn numbers(results: &SceneResults, kind: &str) -> Vec<(String, Measured)> {
        let is: toml::Table = toml::from_str(kind).unwrap();
        let sweep = made_up_sweep();
        Scene { sweep: &sweep, results }.numbers(&Is::try_from(is).unwrap().kind)
    }

    fn number(results: &SceneResults, kind: &str) -> Measured {
        let all = numbers(results, kind);
        assert_eq!(all.len(), 1, "{kind}");
        all[0].1
    }

    #[track_caller]
    fn near(found: Measured, value: f64, margin: f64) {
        let ends = [
            found.value - value,
            found.low - value + margin,
            found.high - value - margin,
        ];
        assert!(ends.iter().all(|off| off.abs() < 1e-9), "{found:?}: {value} ± {margin}");
    }

    /// As far as the reference's noise lets it, which is 1e-6 of the MSEs here at most.
    #[track_caller]
    fn nearly(found: Measured, value: f64) {
        let ends = [found.low, found.high].map(|end| (end - value).abs());
        let is_near = (found.value - value).abs() < 1e-9 && ends.iter().all(|off| *off < 1e-5 * value.abs().max(0.1));
        assert!(is_near, "{found:?}: {value}");
    }

    #[test]
    fn exact_power_laws_give_exact_numbers() {
        let results = scene(vec![
            variant("a", 5, |n, _| (0.1 * n, 1.0 / n)),
            variant("b", 5, |n, _| (0.05 * n, 1.0 / n)),
            variant("c", 5, |n, _| (0.1 * n, 4.0 * n.powf(-1.5))),
        ]);
        // Of MSEs of 1/2, 1/8 and 1/32 at work of 4, 16 and 64 an addition changes the slope by (16 − 1) / (2 ln 4).
        let margin = 2.776 * 2e-9 * 7.5 / 4.0f64.ln();
        near(number(&results, "slope = { of = \"a\" }"), -0.5, margin);
        nearly(number(&results, "slope = { of = \"c\", from = 16 }"), -0.75);
        nearly(number(&results, "slope_below = { of = \"c\", below = \"a\" }"), -0.25);
        near(number(&results, "speed_up = { of = \"b\", over = \"a\" }"), 2.0, 0.0);
        // The best of both sides, b and, at an MSE of 1/64, c: after (4 · 64)^(2/3) samples.
        let best = number(&results, "speed_up = { of = [\"a\", \"b\"], over = [\"c\"] }");
        nearly(best, 256.0f64.powf(2.0 / 3.0) / 32.0);
        // MSEs of 1/64 and 1/32, of which the reference may have 2e-9 each.
        let margin = 0.5 * 2.776 * 2e-9 * (64.0 - 32.0);
        near(number(&results, "error = { of = \"c\", over = \"a\" }"), 0.5, margin);
        let margin = 2.0 * 2.776 * 2e-9 * (2.0 - 1.0);
        near(
            number(&results, "error = { of = \"c\", over = \"a\", budget = 4 }"),
            2.0,
            margin,
        );
        near(number(&results, "seconds = { of = \"b\", over = \"a\" }"), 0.5, 0.0);
        // Its repeats agree; the reference is known to 1e-4.
        near(number(&results, "bias = { of = \"a\" }"), 1e-3, 2.776e-4);
        let rows = numbers(&results, "slope = { of = [\"a\", \"b\"] }");
        let labels: Vec<&str> = rows.iter().map(|row| row.0.as_str()).collect();
        assert_eq!(labels, ["`ring`, a", "`ring`, b"]);
    }

    #[test]
    fn what_seeds_have_in_common_leaves_ratios_and_slopes() {
        let by_seed = |seed: u32| 1.0 + 0.2 * f64::from(seed);
        let results = scene(vec![
            variant("a", 5, |n, seed| (n * by_seed(seed), by_seed(seed) / n)),
            variant("b", 5, |n, seed| (0.5 * n * by_seed(seed), 2.0 * by_seed(seed) / n)),
        ]);
        nearly(number(&results, "slope = { of = \"a\" }"), -0.5);
        nearly(number(&results, "slope_below = { of = \"a\", below = \"b\" }"), 0.0);
        let error = number(&results, "error = { of = \"b\", over = \"a\" }");
        assert!(
            (error.value - 2.0).abs() < 1e-9 && error.high - error.low < 1e-6,
            "{error:?}"
        );
        near(number(&results, "seconds = { of = \"b\", over = \"a\" }"), 0.5, 0.0);
        // Twice the error at half the time.
        let speed_up = number(&results, "speed_up = { of = \"b\", over = \"a\" }");
        assert!(
            (speed_up.value - 1.0).abs() < 1e-9 && speed_up.low > 0.99,
            "{speed_up:?}"
        );
    }

    #[test]
    fn two_repeats_give_a_wide_interval_and_one_gives_none() {
        let noisy = |n: f64, seed: u32| (n, [0.9, 1.1][seed as usize] / n);
        let of = |repeats| {
            scene(vec![
                variant("a", repeats, noisy),
                variant("b", repeats, |n, _| (n, 1.0 / n)),
            ])
        };
        let error = number(&of(2), "error = { of = \"a\", over = \"b\" }");
        // The logarithms without one of them are those of 1.1 and 0.9; Student's t of one degree of freedom.
        let margin = 12.706 * 0.5 * (1.1f64 / 0.9).ln();
        assert!((error.value - 1.0).abs() < 1e-12, "{error:?}");
        assert!(
            (error.high.ln() - margin).abs() < 1e-6 && (error.low.ln() + margin).abs() < 1e-6,
            "{error:?}"
        );
        for kind in [
            "error = { of = \"a\", over = \"b\" }",
            "speed_up = { of = \"a\", over = \"b\" }",
            "slope = { of = \"a\" }",
            "bias = { of = \"a\" }",
            "seconds = { of = \"a\", over = \"b\" }",
            "front = { of = \"a\" }",
        ] {
            let one = number(&of(1), kind);
            assert!(
                one.value.is_finite() && one.low <= 0.0 && one.high == f64::INFINITY,
                "{kind}: {one:?}"
            );
        }
    }

    #[test]
    fn a_cost_that_is_only_bounded_leaves_one_end_open() {
        // The error of a is, at its least budget, below the least that b reaches.
        let results = scene(vec![
            variant("a", 5, |n, _| (n, 1e-3 / n)),
            variant("b", 5, |n, _| (n, 1.0 / n)),
        ]);
        let faster = number(&results, "speed_up = { of = \"a\", over = \"b\" }");
        assert!(
            (faster.value - 16.0).abs() < 1e-9 && (faster.low - 16.0).abs() < 1e-4,
            "{faster:?}"
        );
        assert_eq!(faster.high, f64::INFINITY);
        let slower = number(&results, "speed_up = { of = \"b\", over = \"a\" }");
        assert!((slower.high - 1.0 / 16.0).abs() < 1e-6, "{slower:?}");
        assert_eq!(slower.low, 0.0);
    }

    #[test]
    fn the_cost_of_the_last_error_has_noise_to_both_sides() {
        // The last budget defines the error that is compared at; some replicates stay above it.
        let factor = |seed: u32| 1.0 + 0.01 * (f64::from(seed) - 2.0);
        let results = scene(vec![
            variant("a", 5, |n, seed| (n, if n > 16.0 { factor(seed) } else { 1.0 } / n)),
            variant("b", 5, |n, _| (n, 1.0 / n)),
        ]);
        let found = number(&results, "speed_up = { of = \"a\", over = \"b\" }");
        assert!((found.value - 1.0).abs() < 1e-9, "{found:?}");
        // The mean of the factors errs by 0.01 · √(2.5 / 5), the cost of that error as much, a power of −1 by nearly the segment's slope.
        let expected = 2.776 * 0.01 * 0.5f64.sqrt();
        for margin in [found.high.ln(), -found.low.ln()] {
            assert!((margin / expected - 1.0).abs() < 0.02, "{margin}, {expected}");
        }
    }

    #[test]
    fn an_error_lost_in_noise_is_small_but_not_known() {
        let lost = |n: f64, seed: u32| (n, [3e-5, -2e-5, 1e-5, -3e-5, 1e-5][seed as usize] / n * 4.0);
        let results = scene(vec![variant("a", 5, lost), variant("b", 5, |n, _| (n, 1.0 / n))]);
        let small = number(&results, "error = { of = \"a\", over = \"b\" }");
        assert!(small.low == 0.0 && small.high > 0.0 && small.high < 1e-3, "{small:?}");
        let large = number(&results, "error = { of = \"b\", over = \"a\" }");
        assert!(large.low > 1e3 && large.high == f64::INFINITY, "{large:?}");
    }

    #[test]
    fn what_is_not_there_is_not_a_number() {
        let mut refused = variant("b", 5, |n, _| (n, 1.0 / n));
        refused.points.clear();
        let results = scene(vec![variant("a", 5, |n, _| (n, 1.0 / n)), refused]);
        for kind in [
            "slope = { of = \"b\" }",
            "speed_up = { of = \"b\", over = \"a\" }",
            "speed_up = { of = \"a\", over = [\"a\", \"b\"] }",
            "error = { of = \"a\", over = \"b\" }",
            "seconds = { of = \"a\", over = \"b\" }",
            "bias = { of = \"b\" }",
            "slope_below = { of = \"a\", below = \"b\" }",
        ] {
            assert!(number(&results, kind).value.is_nan(), "{kind}");
        }
    }

    #[test]
    fn seconds_to_equal_error_are_geometric_means() {
        let results = scene(vec![
            variant("a", 5, |n, seed| (if seed == 4 { 16.0 * n } else { n }, 1.0 / n)),
            variant("b", 5, |n, _| (n, 1.0 / n)),
        ]);
        let found = number(&results, "speed_up = { of = \"b\", over = \"a\" }");
        assert!((found.value - 16.0f64.powf(0.2)).abs() < 1e-9, "{found:?}");
        // Logarithms of 0, 0, 0, 0 and ln 16 have a deviation of ln 16 / √5, their mean a fifth of ln 16.
        let margin = 2.776 * 0.2 * 16.0f64.ln();
        assert!(((found.high / found.value).ln() - margin).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn each_replicate_has_its_own_best_variant() {
        let results = scene(vec![
            variant("a", 5, |n, seed| (if seed == 4 { 2.0 * n } else { n }, 1.0 / n)),
            variant("b", 5, |n, _| (1.15 * n, 1.0 / n)),
            variant("c", 5, |n, _| (n, 1.0 / n)),
        ]);
        let found = number(&results, "speed_up = { of = \"c\", over = [\"a\", \"b\"] }");
        assert!((found.value - 2.0f64.powf(0.2)).abs() < 1e-9, "{found:?}");
        // Without the slow repeat it is a, without any other, when a takes 2^(1/4), it is b: four times ln 1.15 and once 0.
        let margin = 2.776 * 0.8 * 1.15f64.ln();
        assert!(((found.high / found.value).ln() - margin).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_budget_that_is_lost_in_noise_has_reached_what_it_may_be_at_most() {
        let lost = [3e-3, -2e-3, 1e-3, -3e-3, 1e-3];
        let results = scene(vec![
            variant("a", 5, |n, seed| {
                (n, if n > 16.0 { lost[seed as usize] } else { 1.0 / n })
            }),
            variant("b", 5, |n, _| (n, 1.0 / n)),
        ]);
        // The lost MSE is at most three standard errors, 2 · 3 · √(24e-6 / 4 / 5), below b's least of 1/32: after at most 64 samples, and on a straight
        // line through 1/8 after 16, after 30.7.
        let most = 6.0 * 1.2e-6f64.sqrt();
        let expected = 4.0f64.powf(1.0 - 4.0f64.ln() / (0.125 / most).ln());
        let faster = number(&results, "speed_up = { of = \"a\", over = \"b\" }");
        assert!((faster.value - expected).abs() < 1e-5 && expected > 2.0, "{faster:?}");
        assert!(faster.low > 2.0 && faster.high == f64::INFINITY, "{faster:?}");
        let slower = number(&results, "speed_up = { of = \"b\", over = \"a\" }");
        assert!(slower.low == 0.0 && slower.high < 0.5, "{slower:?}");
    }

    #[test]
    fn each_repeat_has_a_front_of_its_own() {
        let results = scene(vec![
            variant("a", 5, |n, _| (0.01 * n, 100.0 / n)),
            variant("b", 5, |n, _| (1.0 * n, 3.0 / n)),
            variant("c", 5, |n, _| (10.0 * n, 0.3 / n)),
        ]);
        // All nine points: three of a, two of b, one of c, one of b, two of c, by rising seconds.
        near(
            number(&results, "front = { of = [\"c\"], share = 0.5 }"),
            1.0 / 3.0,
            0.0,
        );
        near(
            number(&results, "front = { setting = \"photons\", rises = 0.5 }"),
            0.895_978_670_381_040_7,
            0.0,
        );
        near(
            number(&results, "front = { setting = \"photons\", inside = 0.5 }"),
            1.0 / 3.0,
            0.0,
        );
        near(number(&results, "front = { setting = \"photons\" }"), 1.0, 0.0);
        // One repeat alone takes the least budget of b off the front.
        let mut odd = results.clone();
        odd.variants[1].points[0].measurements[3].error.relative_mse = 1e3;
        let share = number(&odd, "front = { of = \"b\" }");
        assert_eq!([share.value, share.low, share.high], [3.0 / 9.0, 2.0 / 8.0, 3.0 / 9.0]);
        // What noise brings below 0 stays on it.
        let mut low = results.clone();
        for one in &mut low.variants[2].points[2].measurements {
            one.error.relative_mse = -1e-9;
        }
        near(number(&low, "front = { of = \"c\" }"), 1.0 / 3.0, 0.0);
    }
}
