//! Criteria of sweeps: what an experiment's file calls good, as statements about its pictures that are true or false of them, and the one number that a
//! list of experiments shows.
//!
//! ```toml
//! [[criterion]]
//! name = "Sobol' points take less time to equal error"
//! is.speed_up = { of = "Sobol'", over = ["independent", "stratified"], at_least = 1.0 }
//! scenes = ["builtin:cornell-box"]   # default: all; each must hold
//! because = "a tenth of it"          # where a bound is from that no sentence of `about` has
//!
//! [headline]
//! words = "time of independent samples over that of Sobol' points, at equal error"
//! is.speed_up = { of = "Sobol'", over = "independent" }   # without a bound; the mean over the scenes
//! ```
//!
//! One criterion every sweep has and no file states: [`FINITE`], judged first. [`Kind`] has all that can be said of others.
//! Bounds are `at` and `within`, `within` alone (of 0), `at_least`, `at_most`, or `between = [least, most]`.
//! Variants, scenes and budgets that the sweep has not are refused when the file is read.

use clerestory::{Error, Result};
use toml::{Table, Value};

use super::Experiment;
use super::findings::{self, Axes, Bound, Findings, Judged, Measured};
use super::reference::slug;
use super::results::Results;
use super::scene_numbers::Scene;
use super::series::{SceneSeries, Work};
use super::sweep::{Budget, Sweep};
use super::{strip, summary, web_page};

/// The first criterion of every sweep. Errors leave out what is not finite, so that a variant with such pixels would look better than one without.
pub const FINITE: &str = "no sample or pixel is NaN or infinite";

/// A statement about the scenes of a sweep.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepCriterion {
    /// In words.
    pub name: String,
    /// What is judged, and its bound.
    pub is: Is,
    /// Of these scenes alone; of all where it is empty.
    #[serde(default)]
    pub scenes: Vec<String>,
    /// Where the bound is from; empty for a sentence of what the experiment is about.
    #[serde(default)]
    pub because: String,
}

/// The number that a list of experiments shows.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepHeadline {
    /// What it is.
    pub words: String,
    /// What is measured of each scene.
    pub is: Is,
    /// Of these scenes alone; of all where it is empty.
    #[serde(default)]
    pub scenes: Vec<String>,
}

/// What is measured of each scene, and what is wanted of it.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(try_from = "Table")]
pub struct Is {
    /// What is measured.
    pub kind: Kind,
    /// What is wanted; `None` in a headline.
    pub bound: Option<Bound>,
}

/// A variant by name, or several.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(untagged)]
pub enum Names {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

impl Names {
    /// All of them.
    pub fn all(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Several(names) => names,
        }
    }
}

/// What is measured of a scene. `of` with several variants gives a number each, unless it says otherwise.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kind {
    /// The slope of log relative RMSE against log samples, from this budget on.
    Slope {
        /// Variants.
        of: Names,
        /// The least budget that counts.
        from: Option<f64>,
    },
    /// A variant's slope less that of another.
    SlopeBelow {
        /// The variant.
        of: String,
        /// The other.
        below: String,
    },
    /// Seconds of the best variant of `over` over seconds of the best of `of`, to the least error that both sides reach; not a number where one of them
    /// could not render the scene. Seconds are geometric means over the repeats.
    SpeedUp {
        /// The side that is to take less.
        of: Names,
        /// The other.
        over: Names,
    },
    /// Relative MSE over that of another variant.
    Error {
        /// Variants.
        of: Names,
        /// The other.
        over: String,
        /// Default: the greatest.
        budget: Option<f64>,
    },
    /// Seconds over those of another variant.
    Seconds {
        /// Variants.
        of: Names,
        /// The other.
        over: String,
        /// Default: the greatest.
        budget: Option<f64>,
    },
    /// Mean signed error over the reference's mean, at the greatest budget.
    Bias {
        /// Variants.
        of: Names,
    },
    /// The Pareto front of seconds and error over all variants and budgets, one for each repeat, and of these the median, by one of: the share of its
    /// points that some variants have; a setting's rank correlation with seconds; the share of its points where a setting is neither the least nor the
    /// greatest that variants state; without any of them, the value of a setting that most of its points state.
    Front {
        /// Variants whose share is meant.
        of: Option<Names>,
        /// At least this share.
        share: Option<f64>,
        /// A setting.
        setting: Option<String>,
        /// At least this rank correlation.
        rises: Option<f64>,
        /// At least this share inside of the range.
        inside: Option<f64>,
    },
}

/// What of a front is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OnFront<'a> {
    /// The share of variants.
    Share(&'a [String]),
    /// A setting's rank correlation.
    Rises(&'a str),
    /// The share inside of a setting's range.
    Inside(&'a str),
    /// What most points have.
    Most(&'a str),
}

impl Kind {
    /// What of a front; `None` of another kind and for terms that do not belong together.
    pub fn on_front(&self) -> Option<OnFront<'_>> {
        let Self::Front {
            of,
            share,
            setting,
            rises,
            inside,
        } = self
        else {
            return None;
        };
        match (of, setting, share, rises, inside) {
            (Some(of), None, _, None, None) => Some(OnFront::Share(of.all())),
            (None, Some(setting), None, Some(_), None) => Some(OnFront::Rises(setting)),
            (None, Some(setting), None, None, Some(_)) => Some(OnFront::Inside(setting)),
            (None, Some(setting), None, None, None) => Some(OnFront::Most(setting)),
            _ => None,
        }
    }

    /// The least that a front's own words ask for.
    fn least(&self) -> Option<f64> {
        match self {
            Self::Front {
                share, rises, inside, ..
            } => share.or(*rises).or(*inside),
            _ => None,
        }
    }

    /// All variants that it names.
    fn variants(&self) -> Vec<&String> {
        match self {
            Self::Slope { of, .. } | Self::Bias { of } => of.all().iter().collect(),
            Self::SlopeBelow { of, below } => vec![of, below],
            Self::SpeedUp { of, over } => of.all().iter().chain(over.all()).collect(),
            Self::Error { of, over, .. } | Self::Seconds { of, over, .. } => of.all().iter().chain([over]).collect(),
            Self::Front { of, .. } => of.iter().flat_map(Names::all).collect(),
        }
    }

    /// Whether it is a number above 0 that scenes differ in by factors.
    fn is_ratio(&self) -> bool {
        match self {
            Self::SpeedUp { .. } | Self::Error { .. } | Self::Seconds { .. } => true,
            Self::Slope { .. } | Self::SlopeBelow { .. } | Self::Bias { .. } => false,
            Self::Front { .. } => matches!(self.on_front(), Some(OnFront::Most(_))),
        }
    }
}

/// The bounds as they are written.
#[derive(Debug, Default, serde::Deserialize)]
#[serde(default)]
struct Bounds {
    at: Option<f64>,
    within: Option<f64>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    between: Option<[f64; 2]>,
}

const BOUNDS: [&str; 5] = ["at", "within", "at_least", "at_most", "between"];

impl Bounds {
    fn bound(self) -> std::result::Result<Option<Bound>, String> {
        let Self {
            at,
            within,
            at_least,
            at_most,
            between,
        } = self;
        let bound = match (at, within, at_least, at_most, between) {
            (None, None, None, None, None) => return Ok(None),
            (at, Some(within), None, None, None) => {
                Bound::Between(at.unwrap_or(0.0) - within, at.unwrap_or(0.0) + within)
            }
            (None, None, Some(least), None, None) => Bound::AtLeast(least),
            (None, None, None, Some(most), None) => Bound::AtMost(most),
            (None, None, None, None, Some([least, most])) => Bound::Between(least, most),
            _ => return Err(ONE_BOUND.into()),
        };
        let sound = match bound {
            Bound::AtLeast(end) | Bound::AtMost(end) => end.is_finite(),
            Bound::Between(least, most) => least.is_finite() && most.is_finite() && least <= most,
        };
        if sound {
            Ok(Some(bound))
        } else {
            Err(format!("needs finite bounds, the least first, and has {bound}"))
        }
    }
}

const ONE_BOUND: &str = "needs one bound: at and within, within, at_least, at_most, or between";

impl TryFrom<Table> for Is {
    type Error = String;

    fn try_from(table: Table) -> std::result::Result<Self, String> {
        let mut kinds = table.into_iter();
        let (Some((kind, Value::Table(mut terms))), None) = (kinds.next(), kinds.next()) else {
            return Err(
                "needs one kind with its terms, as in is.slope = { of = \"…\", at = -0.5, within = 0.05 }".into(),
            );
        };
        let bounds: Table = BOUNDS
            .iter()
            .filter_map(|key| Some(((*key).to_owned(), terms.remove(*key)?)))
            .collect();
        let told = |cause: toml::de::Error| format!("is.{kind}: {}", cause.message());
        let bound = Value::Table(bounds).try_into::<Bounds>().map_err(told)?.bound()?;
        let named: Table = [(kind.clone(), Value::Table(terms))].into_iter().collect();
        let parsed: Kind = Value::Table(named).try_into().map_err(told)?;
        if matches!(parsed, Kind::Front { .. }) && parsed.on_front().is_none() {
            return Err("is.front: needs of, or setting with rises, with inside, or alone".into());
        }
        let bound = match (bound, parsed.least()) {
            (Some(_), Some(_)) => return Err(ONE_BOUND.into()),
            (bound, least) => bound.or(least.map(Bound::AtLeast)),
        };
        Ok(Self { kind: parsed, bound })
    }
}

fn wrong(name: &str, value: impl std::fmt::Display, cause: impl Into<String>) -> Error {
    Error::setting(format!("criterion.{name}"), value, cause.into())
}

impl Is {
    /// Refuses what a sweep has not; `name` is the criterion's.
    fn check(&self, name: &str, scenes: &[String], sweep: &Sweep) -> Result<()> {
        for scene in scenes {
            if !sweep.scenes.contains(scene) {
                return Err(wrong(name, scene, "is no scene of the sweep"));
            }
        }
        for variant in self.kind.variants() {
            if !sweep.variants.iter().any(|known| known.name == *variant) {
                let known: Vec<&str> = sweep.variants.iter().map(|variant| variant.name.as_str()).collect();
                let cause = format!("is no variant of the sweep; there is: {}", known.join("; "));
                return Err(wrong(name, variant, cause));
            }
        }
        let lists: Vec<&Names> = match &self.kind {
            Kind::Slope { of, .. } | Kind::Bias { of } | Kind::Error { of, .. } | Kind::Seconds { of, .. } => vec![of],
            Kind::SpeedUp { of, over } => vec![of, over],
            Kind::SlopeBelow { .. } => Vec::new(),
            Kind::Front { of, .. } => of.iter().collect(),
        };
        if lists.iter().any(|names| names.all().is_empty()) {
            return Err(wrong(name, "[]", "names no variant"));
        }
        let budgets = || sweep.budgets().into_iter().map(Budget::amount);
        match &self.kind {
            Kind::Slope { from: Some(from), .. } if budgets().filter(|budget| budget >= from).count() < 2 => {
                Err(wrong(name, from, "leaves fewer than two budgets"))
            }
            Kind::Slope { from: Some(budget), .. }
            | Kind::Error {
                budget: Some(budget), ..
            }
            | Kind::Seconds {
                budget: Some(budget), ..
            } if !budgets().any(|known| known == *budget) => Err(wrong(name, budget, "is no budget of the sweep")),
            Kind::Front {
                setting: Some(setting), ..
            } if !sweep
                .variants
                .iter()
                .any(|one| one.settings.get(setting).is_some_and(serde_json::Value::is_number)) =>
            {
                Err(wrong(name, setting, "is a setting that no variant states as a number"))
            }
            _ => Ok(()),
        }
    }
}

/// Refuses criteria and a headline that do not fit the sweep.
///
/// # Errors
/// [`Error::Setting`] that names the criterion and what is wrong with it.
pub fn check(criteria: &[SweepCriterion], headline: Option<&SweepHeadline>, sweep: &Sweep) -> Result<()> {
    for (index, criterion) in criteria.iter().enumerate() {
        let SweepCriterion { name, is, scenes, .. } = criterion;
        if name.is_empty() || name == FINITE || criteria[..index].iter().any(|other| other.name == *name) {
            return Err(wrong(name, name, "is empty or there twice"));
        }
        if is.bound.is_none() {
            return Err(wrong(name, "is", ONE_BOUND));
        }
        is.check(name, scenes, sweep)?;
    }
    if let Some(SweepHeadline { words, is, scenes }) = headline {
        if is.bound.is_some() {
            return Err(wrong(words, "is", "has a bound, which a headline has not"));
        }
        is.check(words, scenes, sweep)?;
    }
    Ok(())
}

/// Numbers of the scenes that are meant, of all where none is named.
fn rows(is: &Is, meant: &[String], scenes: &[Scene<'_>]) -> Vec<(String, Measured)> {
    let meant = |scene: &&Scene<'_>| meant.is_empty() || meant.contains(&scene.results.address);
    scenes
        .iter()
        .filter(meant)
        .flat_map(|scene| scene.numbers(&is.kind))
        .collect()
}

/// The verdict on [`FINITE`], which smoke pictures have to hold too.
fn finite(scenes: &[Scene<'_>]) -> Judged {
    let because = "errors leave them out";
    let counts = scenes.iter().filter_map(Scene::not_finite);
    Judged {
        in_every_form: true,
        ..findings::judge(FINITE, Bound::AtMost(0.0), because, counts)
    }
}

fn verdicts(experiment: &Experiment, scenes: &[Scene<'_>]) -> Vec<Judged> {
    let judged = experiment.criteria.iter().filter_map(|criterion| {
        let SweepCriterion {
            name,
            is,
            scenes: meant,
            because,
        } = criterion;
        Some(findings::judge(name, is.bound?, because, rows(is, meant, scenes)))
    });
    std::iter::once(finite(scenes)).chain(judged).collect()
}

/// The mean of numbers, in the interval of that of their ends; `None` of none.
fn mean(all: &[Measured]) -> Option<Measured> {
    let of = |end: fn(&Measured) -> f64| all.iter().map(end).sum::<f64>() / all.len() as f64;
    (!all.is_empty()).then(|| Measured {
        value: of(|one| one.value),
        low: of(|one| one.low),
        high: of(|one| one.high),
    })
}

/// What a sweep found: verdicts, the headline, tables, and error against time of each scene. What an interruption has left undone decides nothing, and a
/// smoke run no criterion.
pub fn findings(experiment: &Experiment, results: &Results, scenes: &[SceneSeries]) -> Findings {
    let measured: Vec<Scene<'_>> = if results.interrupted {
        Vec::new()
    } else {
        let all = results.scenes.iter();
        all.map(|scene| Scene {
            sweep: &results.sweep,
            results: scene,
        })
        .collect()
    };
    let mut found = Findings {
        verdicts: verdicts(experiment, &measured),
        tables: std::iter::once(summary::overview(scenes))
            .chain(scenes.iter().map(summary::budgets))
            .collect(),
        facts: summary::method(results),
        ..Findings::default()
    };
    if let Some(SweepHeadline { words, is, scenes }) = &experiment.headline {
        let numbers: Vec<Measured> = rows(is, scenes, &measured).into_iter().map(|row| row.1).collect();
        found = found.headline(
            words.as_str(),
            if is.kind.is_ratio() {
                findings::geometric_mean(numbers)
            } else {
                mean(&numbers)
            },
        );
    }
    for (scene, of_scene) in scenes.iter().zip(&results.scenes) {
        let axes = Axes::falling(Work::Seconds.label(), web_page::ERROR);
        let curves = web_page::curves_of(scene, Work::Seconds);
        found = found.curves(&format!("{}-time", slug(&scene.address)), &scene.address, axes, curves);
        if let Some(words) = strip::words(of_scene, &results.sweep.strips) {
            found = found.picture(&strip::file(of_scene), &words);
        }
    }
    if results.smoke { found.of_smoke_run() } else { found }
}

/// Verdicts of a sweep that was not run.
pub fn declared(experiment: &Experiment) -> Findings {
    Findings {
        verdicts: verdicts(experiment, &[]),
        ..Findings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::Verdict;
    use super::super::scene_numbers::tests::made_up_sweep;
    use super::super::series;
    use super::super::summary::tests::made_up_results;
    use super::*;

    fn parsed(is: &str) -> std::result::Result<SweepCriterion, String> {
        toml::from_str(&format!("name = \"n\"\nis.{is}\n")).map_err(|error| error.to_string())
    }

    #[test]
    fn bounds_are_read_as_they_are_written() {
        for (written, expected) in [
            ("at = -0.5, within = 0.25", Bound::Between(-0.75, -0.25)),
            ("within = 0.01", Bound::Between(-0.01, 0.01)),
            ("at_least = 1", Bound::AtLeast(1.0)),
            ("at_most = 0.5", Bound::AtMost(0.5)),
            ("between = [0.5, 2]", Bound::Between(0.5, 2.0)),
        ] {
            let found = parsed(&format!("slope = {{ of = \"a\", {written} }}")).unwrap();
            assert_eq!(found.is.bound, Some(expected), "{written}");
        }
        let found = parsed("front = { setting = \"photons\", rises = 0.5 }").unwrap();
        assert_eq!(found.is.bound, Some(Bound::AtLeast(0.5)));
        assert_eq!(found.is.kind.on_front(), Some(OnFront::Rises("photons")));
    }

    #[test]
    fn mistakes_are_refused_by_name() {
        let sweep = made_up_sweep();
        let message = |is: &str, scenes: &[&str]| {
            let mut criterion = match parsed(is) {
                Ok(criterion) => criterion,
                Err(message) => return message,
            };
            criterion.scenes = scenes.iter().map(|scene| (*scene).to_owned()).collect();
            check(&[criterion], None, &sweep).map_or_else(|error| error.to_string(), |()| String::new())
        };
        for (is, word) in [
            ("slope = { of = \"a\", at = -0.5, within = 0.05 }", ""),
            ("slope = { of = \"d\", at_most = 0 }", "d is no variant"),
            (
                "speed_up = { of = [\"a\"], over = [\"b\", \"d\"], at_least = 1 }",
                "is no variant",
            ),
            ("speed_up = { of = [], over = \"b\", at_least = 1 }", "names no variant"),
            ("slope = { of = \"a\" }", "needs one bound"),
            ("slope = { of = \"a\", at = -0.5 }", "needs one bound"),
            ("slope = { of = \"a\", at_most = 0, at_least = 0 }", "needs one bound"),
            ("slope = { of = \"a\", between = [1, 0] }", "the least first"),
            ("slope = { of = \"a\", at_most = inf }", "finite"),
            (
                "slope = { of = \"a\", from = 64, at_most = 0 }",
                "fewer than two budgets",
            ),
            ("slope = { of = \"a\", from = 5, at_most = 0 }", "is no budget"),
            ("slope = { of = \"a\", over = \"b\", at_most = 0 }", "over"),
            ("error = { of = \"a\", at_most = 1 }", "over"),
            (
                "error = { of = \"a\", over = \"b\", budget = 5, at_most = 1 }",
                "is no budget",
            ),
            ("noise = { of = \"a\", at_most = 1 }", "noise"),
            ("front = { setting = \"spread\", inside = 0.5 }", "no variant states"),
            ("front = { setting = \"photons\", of = \"a\", share = 0.5 }", "is.front"),
            (
                "front = { setting = \"photons\", inside = 0.5, at_most = 1 }",
                "needs one bound",
            ),
            ("front = { setting = \"photons\" }", "needs one bound"),
            ("front = { of = \"a\", share = 0.5 }", ""),
        ] {
            let message = message(is, &[]);
            assert!(
                message.contains(word) && message.is_empty() == word.is_empty(),
                "{is}: {message}"
            );
        }
        let elsewhere = message("slope = { of = \"a\", at_most = 0 }", &["builtin:nowhere"]);
        assert!(
            elsewhere.contains("builtin:nowhere") && elsewhere.contains("is no scene"),
            "{elsewhere}"
        );
        let twice = parsed("slope = { of = \"a\", at_most = 0 }").unwrap();
        let twice = check(&[twice.clone(), twice], None, &sweep).unwrap_err().to_string();
        assert!(twice.contains("there twice"), "{twice}");
        let bounded = SweepHeadline {
            words: "w".into(),
            is: parsed("slope = { of = \"a\", at_most = 0 }").unwrap().is,
            scenes: Vec::new(),
        };
        assert!(
            check(&[], Some(&bounded), &sweep)
                .unwrap_err()
                .to_string()
                .contains("which a headline has not")
        );
    }

    /// Two variants of slope −½, the second twice as fast.
    const EXPERIMENT: &str = "title = \"t\"\nabout = \"a\"\nsystems = []\n[sweep]\nscenes = [\"builtin:ring\", \"builtin:cornell-box\"]\n\
        size = [2, 1]\nspp = [4, 16, 64]\nrepeats = 3\nreference = { spp = 1024 }\n[[sweep.variant]]\nname = \"slow\"\n\
        [[sweep.variant]]\nname = '<fast> & \"good\"'\n\
        [[criterion]]\nname = \"twice\"\nis.speed_up = { of = '<fast> & \"good\"', over = \"slow\", at_least = 1.9 }\n\
        [[criterion]]\nname = \"falls\"\nis.slope = { of = [\"slow\", '<fast> & \"good\"'], at = -0.6, within = 0.05 }\nbecause = \"why\"\n\
        [[criterion]]\nname = \"elsewhere\"\nis.bias = { of = \"slow\", within = 0.1 }\nscenes = [\"builtin:cornell-box\"]\n\
        [headline]\nwords = \"w\"\nis.speed_up = { of = '<fast> & \"good\"', over = \"slow\" }\n";

    #[test]
    fn verdicts_are_of_scenes_and_their_variants() {
        let experiment = super::super::parse("x", EXPERIMENT).unwrap();
        let mut results = made_up_results();
        results.smoke = false;
        let scenes = series::of(&results);
        let found = findings(&experiment, &results, &scenes);
        let verdicts: Vec<&Verdict> = found.verdicts.iter().map(|judged| &judged.verdict).collect();
        assert!(
            matches!(verdicts[..], [Verdict::Holds, Verdict::Holds, Verdict::Fails { by }, Verdict::NotRun] if (by - 0.05).abs() < 1e-9),
            "{verdicts:?}"
        );
        let falls = &found.verdicts[2];
        assert_eq!((falls.rows, falls.failing, falls.because.as_str()), (2, 2, "why"));
        assert!(falls.worst.starts_with("`ring`, "), "{}", falls.worst);
        let headline = found.headline.as_ref().unwrap();
        assert!(headline.words == "w" && (headline.found.value - 2.0).abs() < 1e-9);
        assert_eq!((found.tables.len(), found.plots.len()), (2, 1));

        results.smoke = true;
        let smoke = findings(&experiment, &results, &scenes).verdicts;
        assert_eq!(
            smoke
                .iter()
                .filter(|judged| judged.verdict == Verdict::SmokeForm)
                .count(),
            2
        );
        let not_run = |found: &Findings| {
            let verdicts = found.verdicts.iter();
            found.headline.is_none() && verdicts.filter(|judged| judged.verdict == Verdict::NotRun).count() == 4
        };
        results.interrupted = true;
        assert!(not_run(&findings(&experiment, &results, &scenes)));
        let declared = declared(&experiment);
        assert!(not_run(&declared) && declared.tables.is_empty());
        assert!(
            declared.summary().contains("falls: required: −0.65 to −0.5500 (why)"),
            "{}",
            declared.summary()
        );
    }

    #[test]
    fn what_is_not_finite_fails_before_all_else() {
        let experiment = super::super::parse("x", EXPERIMENT).unwrap();
        let mut results = made_up_results();
        let first = |results: &Results| {
            let found = findings(&experiment, results, &series::of(results));
            (found.verdicts[0].clone(), found.facts)
        };
        let (judged, _) = first(&results);
        assert_eq!((judged.name.as_str(), &judged.verdict), (FINITE, &Verdict::Holds));
        let one = &mut results.scenes[0].variants[1].points[0].measurements[0];
        (one.error.skipped, one.non_finite) = (3, 2);
        assert!(results.smoke, "smoke pictures are judged too");
        let (judged, facts) = first(&results);
        assert_eq!(
            (judged.verdict, judged.worst.as_str()),
            (Verdict::Fails { by: 5.0 }, "`ring`")
        );
        assert!(facts.iter().any(|fact| fact.contains("3 pixels left out")), "{facts:?}");
        let twice = EXPERIMENT.replace("\"twice\"", &format!("\"{FINITE}\""));
        assert!(super::super::parse("x", &twice).is_err());
    }

    #[test]
    fn results_that_were_read_back_say_the_same() {
        let experiment = super::super::parse("x", EXPERIMENT).unwrap();
        let mut results = made_up_results();
        results.sweep.strips = vec!["slow".into()];
        let text = serde_json::to_string(&results).unwrap();
        let read: Results = serde_json::from_str(&text).unwrap();
        assert_eq!(text, serde_json::to_string(&read).unwrap());
        assert!(!text.contains("kernels") && read.scenes[0].reference_picture.is_none());
        let of = |results: &Results| findings(&experiment, results, &series::of(results));
        let found = of(&results);
        assert!(found.plots.len() == 2 && found.plots[1].is_file());
        assert_eq!(found, of(&read));
        let older = text.replacen("\"smoke\"", "\"expected_slope\":null,\"smoke\"", 1);
        assert!(serde_json::from_str::<Results>(&older).is_err());
    }
}
