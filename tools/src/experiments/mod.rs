//! Experiments: what `clerestory report NAME` runs. Each is a file of `tools/experiments/`, named as the experiment is called.
//!
//! An experiment does one of two things:
//! - it *measures* numbers: `measure = "name"`, tables of a [`measures::Measure`] (errors, counts and speeds of functions and kernels);
//! - it *sweeps*: `[sweep]`, pictures of scenes by techniques and settings with growing budgets, their errors against converged
//!   references, plots, slopes and strips. [`sweep`] describes the format with an example.

pub mod bars;
pub mod equal_error;
pub mod findings;
pub mod fingerprint;
pub mod jackknife;
pub mod json_lines;
pub mod kept_rows;
pub mod legend;
pub mod lines;
pub mod measurement;
pub mod measures;
pub mod pages;
pub mod pareto;
pub mod plot;
pub mod reference;
pub mod render_sweep;
pub mod results;
pub mod scene_numbers;
pub mod series;
pub mod slope;
pub mod strip;
pub mod summary;
pub mod sweep;
pub mod sweep_criteria;
pub mod table;
pub mod unbiased;
pub mod watch;
pub mod web_page;

use std::collections::BTreeMap;
use std::path::Path;

use clerestory::input::read_text;
use clerestory::{Error, Result};

use self::sweep::Sweep;
use self::sweep_criteria::{SweepCriterion, SweepHeadline};

/// The files of `tools/experiments/`: name and text.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/experiments.rs"));

/// Most bytes of a file that describes one.
const MOST_BYTES: u64 = 1 << 20;

/// An experiment as its file describes it.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// The file's name without its ending.
    #[serde(skip)]
    pub name: String,
    /// What it shows, in one line.
    pub title: String,
    /// What is compared with which oracle, on which inputs, and what counts as good: two or three sentences.
    pub about: String,
    /// Why criteria fail; a page has it below its verdicts.
    #[serde(default)]
    pub causes: String,
    /// Ids of the catalogue's rows that it measures.
    pub systems: Vec<String>,
    /// What shows each of them, by its id: the name of a criterion, a column, what stands in one; of a sweep a criterion, a variant, a technique
    /// or a scene.
    #[serde(default)]
    pub shows: BTreeMap<String, String>,
    /// Other names that it is found by: its numbers in the document that the comparison comes from.
    #[serde(default)]
    pub aliases: Vec<String>,
    measure: Option<String>,
    sweep: Option<Sweep>,
    /// What is good of a sweep. Measures have theirs in code.
    #[serde(default, rename = "criterion")]
    pub criteria: Vec<SweepCriterion>,
    /// The number of a sweep that a list of experiments shows.
    #[serde(default)]
    pub headline: Option<SweepHeadline>,
}

/// What an experiment does.
#[derive(Debug, Clone, Copy)]
pub enum Kind<'a> {
    /// Runs the measure of this name.
    Measure(&'a str),
    /// Renders a sweep.
    Sweep(&'a Sweep),
}

impl Experiment {
    /// The title up to its colon, for lists.
    pub fn short_title(&self) -> &str {
        self.title.split(':').next().unwrap_or(&self.name)
    }

    /// The first sentence of what it is about.
    pub fn about_in_short(&self) -> &str {
        self.about.find(". ").map_or(&self.about, |end| &self.about[..=end])
    }

    /// What it does.
    ///
    /// # Errors
    /// [`Error::Setting`] when the file has neither `measure` nor `[sweep]`, or both.
    pub fn kind(&self) -> Result<Kind<'_>> {
        match (&self.measure, &self.sweep) {
            (Some(measure), None) => Ok(Kind::Measure(measure)),
            (None, Some(sweep)) => Ok(Kind::Sweep(sweep)),
            _ => Err(Error::setting(
                "experiment",
                &self.name,
                "needs exactly one of measure = \"…\" and [sweep]",
            )),
        }
    }
}

/// The names of all experiments, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// The experiment of that name or alias, in letters of either case, or the one that a file `….toml` describes.
///
/// # Errors
/// [`Error::Setting`] when there is none, or when its file is not sound; [`Error::Io`] when a named file cannot be read.
pub fn find(name: &str) -> Result<Experiment> {
    let path = Path::new(name);
    if path.extension().is_some_and(|ending| ending == "toml") {
        let text = read_text(path, MOST_BYTES)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        return parse(&stem, &text);
    }
    let by_alias = || {
        let mut all = FILES.iter().filter_map(|(known, text)| parse(known, text).ok());
        all.find(|experiment| {
            let mut aliases = experiment.aliases.iter();
            aliases.any(|alias| alias.eq_ignore_ascii_case(name))
        })
    };
    let named = FILES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
    if named.is_none()
        && let Some(experiment) = by_alias()
    {
        return Ok(experiment);
    }
    let (name, text) = named.ok_or_else(|| {
        let known: Vec<_> = names().collect();
        Error::setting(
            "experiment",
            name,
            format!("is not known; there is: {}", known.join(", ")),
        )
    })?;
    parse(name, text)
}

fn parse(name: &str, text: &str) -> Result<Experiment> {
    let experiment: Experiment =
        toml::from_str(text).map_err(|cause| Error::setting("experiment", name, cause.to_string()))?;
    let experiment = Experiment {
        name: name.to_owned(),
        ..experiment
    };
    let (criteria, headline) = (&experiment.criteria, experiment.headline.as_ref());
    match experiment.kind()? {
        Kind::Measure(measure) => {
            measures::find(measure)?;
            if !criteria.is_empty() || headline.is_some() {
                let cause = "is a measure, whose criteria and headline stand in its code";
                return Err(Error::setting("experiment", name, cause));
            }
        }
        Kind::Sweep(sweep) => {
            sweep.check()?;
            sweep_criteria::check(criteria, headline, sweep)?;
        }
    }
    Ok(experiment)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_file_is_sound_and_names_rows_of_the_catalogue() {
        for name in names() {
            let experiment = find(name).unwrap();
            assert!(!experiment.systems.is_empty(), "{name}");
            assert!(experiment.title.starts_with(char::is_uppercase), "{name}");
            let (about, sentences) = (&experiment.about, experiment.about.matches(". ").count() + 1);
            assert!((2..=3).contains(&sentences) && about.ends_with('.'), "{name}: {about}");
            assert!(!about.contains(['\n', '\\']), "{name}: {about}");
            assert!(about.starts_with(experiment.about_in_short()) && experiment.about_in_short().ends_with('.'));
            for alias in &experiment.aliases {
                assert_eq!(find(&alias.to_lowercase()).unwrap().name, name, "{alias}");
            }
            for id in &experiment.systems {
                assert!(
                    clerestory::catalogue::all().iter().any(|row| row.id == id),
                    "{name}: the catalogue has no {id}"
                );
            }
        }
        assert!(
            find("no such experiment")
                .unwrap_err()
                .to_string()
                .contains("is not known")
        );
    }

    /// Of measures the tests of their quick forms look at what is there.
    #[test]
    fn each_row_is_shown_by_something() {
        for experiment in names().map(|name| find(name).unwrap()) {
            let name = &experiment.name;
            let shown: BTreeSet<&String> = experiment.shows.keys().collect();
            let named: BTreeSet<&String> = experiment.systems.iter().collect();
            assert_eq!(shown, named, "{name}");
            assert_eq!(named.len(), experiment.systems.len(), "{name} names a row twice");
            let Kind::Sweep(sweep) = experiment.kind().unwrap() else {
                continue;
            };
            for (id, words) in &experiment.shows {
                let by_variant = |variant: &sweep::Variant| variant.name == *words || variant.technique == *words;
                let by_criterion = |criterion: &SweepCriterion| criterion.name == *words;
                assert!(
                    sweep.variants.iter().any(by_variant)
                        || sweep.scenes.contains(words)
                        || experiment.criteria.iter().any(by_criterion),
                    "{name}: nothing is called \"{words}\", which is to show {id}"
                );
            }
        }
    }

    #[test]
    fn each_has_a_short_title_of_its_own() {
        let mut titles: Vec<String> = names()
            .map(|name| find(name).unwrap().short_title().to_owned())
            .collect();
        let all = titles.len();
        titles.sort();
        titles.dedup();
        assert_eq!(titles.len(), all, "{titles:?}");
    }

    #[test]
    fn every_sweep_says_what_is_good_of_it() {
        for experiment in names().map(|name| find(name).unwrap()) {
            let name = &experiment.name;
            if let Kind::Sweep(sweep) = experiment.kind().unwrap() {
                assert!(
                    !experiment.criteria.is_empty() && experiment.headline.is_some(),
                    "{name}"
                );
                assert!(sweep.repeats >= 4, "{name}: intervals of fewer repeats decide nothing");
                let declared = sweep_criteria::declared(&experiment);
                // One more, which all sweeps have.
                assert_eq!(declared.verdicts.len(), 1 + experiment.criteria.len(), "{name}");
                let not_run = |judged: &findings::Judged| judged.verdict == findings::Verdict::NotRun;
                assert!(declared.verdicts.iter().all(not_run), "{name}");
            }
        }
    }

    #[test]
    fn an_experiment_is_of_exactly_one_kind() {
        let refused = |text: &str| parse("x", text).unwrap_err().to_string();
        assert!(refused("title = \"t\"\nabout = \"a\"\nsystems = []\n").contains("exactly one"));
        assert!(
            refused("title = \"t\"\nabout = \"a\"\nsystems = []\nmeasure = \"no such\"\n").contains("is not known")
        );
        assert!(refused("title = \"t\"\nsystems = []\nmeasure = \"alpha\"\n").contains("about"));
        let with_headline = "title = \"t\"\nabout = \"a\"\nsystems = []\nmeasure = \"alpha\"\n[headline]\nwords = \"w\"\nis.bias.of = \"x\"\n";
        assert!(refused(with_headline).contains("in its code"));
        assert!(refused("title = \"t\"\nabout = \"a\"\nsystems = []\ncolour = 1\n").contains("colour"));
    }

    #[test]
    fn a_file_is_an_experiment_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let text = "title = \"t\"\nabout = \"a\"\nsystems = []\n[sweep]\nscenes = [\"builtin:cornell-box\"]\nsize = [8, 8]\nspp = [1, 2]\n\
                    reference = { spp = 64 }\n[[sweep.variant]]\nname = \"path\"\n";
        std::fs::write(&path, text).unwrap();
        let experiment = find(path.to_str().unwrap()).unwrap();
        assert_eq!(experiment.name, "mine");
        assert!(matches!(experiment.kind(), Ok(Kind::Sweep(_))));
        assert!(find(folder.path().join("none.toml").to_str().unwrap()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn experiments_are_read_from_regular_files_of_bounded_length_alone() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).display().to_string();
        std::os::unix::fs::symlink("/dev/zero", at("endless.toml")).unwrap();
        let pipe = std::process::Command::new("mkfifo")
            .arg(at("pipe.toml"))
            .status()
            .unwrap();
        assert!(pipe.success());
        for name in ["endless.toml", "pipe.toml"] {
            let refusal = find(&at(name)).unwrap_err().to_string();
            assert!(refusal.contains("not a regular file"), "{refusal}");
        }
        let long = std::fs::File::create(at("long.toml")).unwrap();
        long.set_len(MOST_BYTES + 1).unwrap();
        assert!(find(&at("long.toml")).unwrap_err().to_string().contains("at most"));
    }
}
