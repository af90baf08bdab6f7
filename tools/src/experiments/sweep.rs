//! Sweeps: which pictures an experiment renders, and against what it measures them.
//!
//! ```toml
//! title = "Russian roulette: noise and time"
//! about = "Compares two settings. Oracle: a converged reference. Good is the same mean with less error."
//! systems = ["MET-B8"]   # rows of the catalogue
//!
//! [sweep]
//! scenes = ["builtin:cornell-box", "builtin:passage?width=0.1"]   # any scene address or file
//! path_set = "indirect"           # default "all"; the same for every variant and the reference
//! camera = "main"                 # default: each scene's first
//! size = [96, 96]                 # pixels across and down
//! spp = [4, 16, 64]               # samples per pixel, rising; or seconds = [0.1, 0.4, 1.6], time budgets
//! repeats = 5                     # pictures per budget, with seeds of their own; default 5
//! seed = 0                        # of the first repeat; the others follow it; default 0
//! strips = ["from bounce 3"]      # variants whose pictures and differences its page of results keeps; default none
//!
//! [sweep.reference]
//! spp = 4096                      # samples per pixel; 16 times the most of a variant leaves its noise below 1/16 of their MSE
//! technique = "path"              # default
//! settings = { roulette_cap = 0.9 }  # default: the technique's; of its samplers only the independent one, "pcg", is allowed
//!
//! [[sweep.variant]]
//! name = "default"
//!
//! [[sweep.variant]]
//! name = "from bounce 3"
//! technique = "path"              # default
//! settings = { roulette_start = 3 }
//!
//! [sweep.smoke]                   # optional: what `--smoke` takes instead
//! size = [32, 32]
//! spp = [1, 4, 16]
//! repeats = 2
//! reference_spp = 512
//! scenes = ["builtin:cornell-box"]
//!
//! [[criterion]]                   # what is good, judged scene by scene: super::sweep_criteria has all kinds
//! name = "the same mean"
//! is.bias = { of = ["default", "from bounce 3"], within = 0.01 }
//!
//! [shows]                         # what shows each of the rows: a variant, a technique, a scene or a criterion
//! MET-B8 = "from bounce 3"
//!
//! [headline]                      # optional: one number for a list of experiments
//! words = "time of the default over that from bounce 3, at equal error"
//! is.speed_up = { of = "from bounce 3", over = "default" }
//! ```
//!
//! Unknown keys are refused. Settings are the technique's (`clerestory list path`).

use clerestory::techniques::{self, Card};
use clerestory::transport::PathSet;
use clerestory::{Error, Result};
use serde_json::{Map, Value};

/// Pixels of either side at most.
const SIDE_MAX: u32 = 16_384;
/// Repeats at most.
const REPEATS_MAX: u32 = 999;
/// Samples a pixel at most; also what a picture with a time budget asks for.
pub const SPP_MAX: u32 = 1 << 24;
/// Height and width of smoke pictures, unless the file says otherwise.
const SMOKE_SIDE: u32 = 48;
const SMOKE_SPP: [u32; 3] = [2, 8, 32];
const SMOKE_SECONDS: [f64; 2] = [0.05, 0.2];
const SMOKE_REPEATS: u32 = 2;
const SMOKE_REFERENCE_SPP: u32 = 1024;
const DEFAULT_REPEATS: u32 = 5;
/// The sampler whose samples are independent.
const INDEPENDENT: &str = "pcg";
/// The setting by which samples of a pixel share vertices of light subpaths.
const SAMPLES_AT_ONCE: &str = "samples_at_once";

/// What a sweep renders.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Addresses of scenes.
    pub scenes: Vec<String>,
    /// Which light paths all pictures contain, in the text form of [`PathSet`].
    #[serde(default = "all_paths")]
    pub path_set: String,
    /// Camera by name; `None` takes the first of each scene.
    #[serde(default)]
    pub camera: Option<String>,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Budgets in samples per pixel, rising.
    #[serde(default)]
    pub spp: Option<Vec<u32>>,
    /// Budgets in seconds of wall clock, rising.
    #[serde(default)]
    pub seconds: Option<Vec<f64>>,
    /// Pictures of each budget.
    #[serde(default = "default_repeats")]
    pub repeats: u32,
    /// Seed of the first repeat.
    #[serde(default)]
    pub seed: u32,
    /// The converged picture.
    pub reference: ReferencePlan,
    /// Variants whose pictures of the greatest budget the page of results keeps, by name, beside the reference and with signed differences below.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strips: Vec<String>,
    /// What is compared.
    #[serde(rename = "variant")]
    pub variants: Vec<Variant>,
    /// What the smoke form changes.
    #[serde(default)]
    pub smoke: Smoke,
    /// Techniques beyond the engine's own, which variants may name.
    #[serde(skip)]
    pub cards: Cards,
}

/// Cards of a host's own techniques.
#[derive(Debug, Clone, Default)]
pub struct Cards(pub Vec<&'static Card>);

impl PartialEq for Cards {
    fn eq(&self, other: &Self) -> bool {
        let ids = |cards: &Self| cards.0.iter().map(|card| card.id).collect::<Vec<_>>();
        ids(self) == ids(other)
    }
}

/// How references are made.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePlan {
    /// Samples a pixel.
    pub spp: u32,
    /// The technique; it must be unbiased.
    #[serde(default = "path_technique")]
    pub technique: String,
    /// Its settings.
    #[serde(default)]
    pub settings: Map<String, Value>,
}

/// A technique with settings.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// What tables and plots call it.
    pub name: String,
    /// The technique's id.
    #[serde(default = "path_technique")]
    pub technique: String,
    /// Its settings, where they differ from the defaults.
    #[serde(default)]
    pub settings: Map<String, Value>,
}

/// What the smoke form takes in place of the sweep's own.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Smoke {
    /// Pixels across and down.
    pub size: Option<[u32; 2]>,
    /// Budgets in samples per pixel.
    pub spp: Option<Vec<u32>>,
    /// Budgets in seconds.
    pub seconds: Option<Vec<f64>>,
    /// Pictures of each budget.
    pub repeats: Option<u32>,
    /// Samples a pixel of the reference.
    pub reference_spp: Option<u32>,
    /// Scenes.
    pub scenes: Option<Vec<String>>,
}

/// When a rendering ends.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After this many samples per pixel.
    Spp(u32),
    /// After about this many seconds of wall clock.
    Seconds(f64),
}

impl Budget {
    /// Its number: samples per pixel or seconds.
    pub fn amount(self) -> f64 {
        match self {
            Self::Spp(spp) => f64::from(spp),
            Self::Seconds(seconds) => seconds,
        }
    }
}

impl std::fmt::Display for Budget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Spp(spp) => write!(f, "{spp} spp"),
            Self::Seconds(seconds) => write!(f, "{seconds} s"),
        }
    }
}

fn all_paths() -> String {
    "all".into()
}

fn path_technique() -> String {
    "path".into()
}

fn default_repeats() -> u32 {
    DEFAULT_REPEATS
}

fn wrong(name: &str, value: impl std::fmt::Display, cause: &str) -> Error {
    Error::setting(format!("sweep.{name}"), value, cause)
}

impl Sweep {
    /// The budgets, rising.
    pub fn budgets(&self) -> Vec<Budget> {
        let spp = self.spp.iter().flatten().map(|spp| Budget::Spp(*spp));
        let seconds = self.seconds.iter().flatten().map(|seconds| Budget::Seconds(*seconds));
        spp.chain(seconds).collect()
    }

    /// The technique of that id: of [`Sweep::cards`], else the engine's.
    ///
    /// # Errors
    /// [`Error::Setting`] for one that there is not.
    pub fn card(&self, id: &str) -> Result<&'static Card> {
        match self.cards.0.iter().find(|card| card.id == id) {
            Some(card) => Ok(card),
            None => techniques::by_id(id),
        }
    }

    /// The seeds of the repeats.
    pub fn seeds(&self) -> impl Iterator<Item = u32> {
        let first = self.seed;
        (0..self.repeats).map(move |repeat| first.wrapping_add(repeat))
    }

    /// The smallest form.
    pub fn smoke_form(&self) -> Self {
        let smoke = &self.smoke;
        let in_spp = smoke.spp.is_some() || (smoke.seconds.is_none() && self.spp.is_some());
        Self {
            scenes: smoke.scenes.clone().unwrap_or_else(|| self.scenes.clone()),
            size: smoke.size.unwrap_or(self.size.map(|side| side.min(SMOKE_SIDE))),
            spp: in_spp.then(|| smoke.spp.clone().unwrap_or(SMOKE_SPP.to_vec())),
            seconds: (!in_spp).then(|| smoke.seconds.clone().unwrap_or(SMOKE_SECONDS.to_vec())),
            repeats: smoke.repeats.unwrap_or(SMOKE_REPEATS),
            reference: ReferencePlan {
                spp: smoke.reference_spp.unwrap_or(SMOKE_REFERENCE_SPP),
                ..self.reference.clone()
            },
            ..self.clone()
        }
    }

    /// Refuses what cannot be rendered or compared.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the key.
    pub fn check(&self) -> Result<()> {
        self.path_set.parse::<PathSet>()?;
        if self.scenes.is_empty() {
            return Err(wrong("scenes", "[]", "needs at least one"));
        }
        if self.size.iter().any(|side| !(1..=SIDE_MAX).contains(side)) {
            return Err(wrong("size", format!("{:?}", self.size), "sides are 1 … 16384 pixels"));
        }
        let budgets = match (&self.spp, &self.seconds) {
            (Some(spp), None) => spp.iter().map(|spp| f64::from(*spp)).collect::<Vec<_>>(),
            (None, Some(seconds)) => seconds.clone(),
            _ => return Err(wrong("spp", "seconds", "exactly one of spp and seconds is wanted")),
        };
        let shown = format!("{budgets:?}");
        let sound = budgets
            .iter()
            .all(|budget| *budget > 0.0 && *budget <= f64::from(SPP_MAX));
        if budgets.is_empty() || !sound || !budgets.is_sorted_by(|a, b| a < b) {
            return Err(wrong("spp", shown, "needs rising budgets above 0"));
        }
        if !(1..=REPEATS_MAX).contains(&self.repeats) {
            return Err(wrong("repeats", self.repeats, "is not in 1 … 999"));
        }
        if !(2..=SPP_MAX).contains(&self.reference.spp) {
            return Err(wrong("reference.spp", self.reference.spp, "is not in 2 … 16777216"));
        }
        if self.variants.is_empty() {
            return Err(wrong("variant", "[]", "needs at least one [[sweep.variant]]"));
        }
        for (index, variant) in self.variants.iter().enumerate() {
            let earlier = &self.variants[..index];
            if variant.name.is_empty() || earlier.iter().any(|other| other.name == variant.name) {
                return Err(wrong("variant.name", &variant.name, "is empty or there twice"));
            }
            self.allowed(
                &variant.technique,
                &self.settings(&variant.technique, &variant.settings)?,
            )?;
        }
        let is_variant = |name: &&String| self.variants.iter().any(|variant| variant.name == **name);
        if let Some(name) = self.strips.iter().find(|name| !is_variant(name)) {
            return Err(wrong("strips", name, "is no variant of the sweep"));
        }
        let reference = self.reference_settings()?;
        self.allowed(&self.reference.technique, &reference)?;
        if let Some(sampler) = reference.get("sampler").filter(|sampler| **sampler != INDEPENDENT) {
            return Err(wrong(
                "reference.settings.sampler",
                sampler,
                "makes samples that depend on each other: the variance layer, which counts them as independent, would overestimate the \
                 reference's variance, and too much would be subtracted from every error; wanted is \"pcg\"",
            ));
        }
        if let Some(samples) = reference.get(SAMPLES_AT_ONCE).filter(|samples| **samples != 1) {
            return Err(wrong(
                "reference.settings.samples_at_once",
                samples,
                "lets samples of a pixel share vertices, whose noise the variance layer lacks: too little would be subtracted from every error; wanted is 1",
            ));
        }
        Ok(())
    }

    /// Refuses settings that the technique refuses, whatever the scene.
    fn allowed(&self, technique: &str, settings: &Value) -> Result<()> {
        self.card(technique)?.settings.check(settings)
    }

    /// All settings of a technique: its defaults, changed by those given and by the path set.
    ///
    /// # Errors
    /// [`Error::Setting`] for a technique or setting that there is not, and for a path set that the technique cannot be restricted to.
    pub fn settings(&self, technique: &str, given: &Map<String, Value>) -> Result<Value> {
        let info = self.card(technique)?;
        let mut settings = match info.settings.defaults() {
            Value::Object(settings) => settings,
            _ => Map::new(),
        };
        let path_set = self.path_set.parse::<PathSet>()?;
        for (name, value) in given {
            if !settings.contains_key(name) || name == "path_set" {
                let known: Vec<&str> = settings.keys().map(String::as_str).collect();
                let cause = if name == "path_set" {
                    "stands beside the scenes, since all pictures must contain the same paths".to_owned()
                } else {
                    format!("is no setting of technique {technique}; there is: {}", known.join(", "))
                };
                return Err(Error::setting("sweep.variant.settings", name, cause));
            }
            settings.insert(name.clone(), value.clone());
        }
        if settings.contains_key("path_set") {
            settings.insert("path_set".into(), Value::String(path_set.to_string()));
        } else if path_set != info.path_set {
            let cause = format!("technique {technique} has the paths {} and no others", info.path_set);
            return Err(wrong("path_set", &self.path_set, &cause));
        }
        Ok(Value::Object(settings))
    }

    /// All settings of the reference. Where its technique has a choice of samplers and the file makes none, samples are independent, and where
    /// samples of a pixel may share vertices they do not: only then is the variance layer, which counts samples, the variance of the mean.
    ///
    /// # Errors
    /// As [`Sweep::settings`].
    pub fn reference_settings(&self) -> Result<Value> {
        let mut given = self.reference.settings.clone();
        let info = self.card(&self.reference.technique)?;
        if info.settings.has("sampler") {
            given
                .entry("sampler")
                .or_insert_with(|| Value::String(INDEPENDENT.into()));
        }
        if info.settings.has(SAMPLES_AT_ONCE) {
            given.entry(SAMPLES_AT_ONCE).or_insert_with(|| 1.into());
        }
        self.settings(&self.reference.technique, &given)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "scenes = [\"builtin:ring\"]\nsize = [96, 64]\nspp = [4, 16]\nreference = { spp = 1024 }\n\
                        [[variant]]\nname = \"a\"\nsettings = { sampler = \"pcg\" }\n[[variant]]\nname = \"b\"\n";

    fn changed(from: &str, to: &str) -> std::result::Result<Sweep, String> {
        assert!(TEXT.contains(from), "{from}");
        let sweep: Sweep = toml::from_str(&TEXT.replace(from, to)).map_err(|e| e.to_string())?;
        sweep.check().map_err(|e| e.to_string())?;
        Ok(sweep)
    }

    #[test]
    fn defaults_and_settings_are_filled_in() {
        let sweep = changed("4, 16", "4, 16, 64").unwrap();
        assert_eq!((sweep.repeats, sweep.seed, sweep.path_set.as_str()), (5, 0, "all"));
        assert_eq!(sweep.budgets(), [4, 16, 64].map(Budget::Spp));
        assert_eq!(sweep.seeds().collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        let settings = |index: usize| {
            let variant = &sweep.variants[index];
            sweep.settings(&variant.technique, &variant.settings).unwrap()
        };
        assert_eq!(
            (&settings(0)["sampler"], &settings(1)["sampler"]),
            (&"pcg".into(), &"sobol".into())
        );
        assert_eq!(settings(0)["path_set"], "all");
        assert_eq!(sweep.reference_settings().unwrap()["sampler"], "pcg");
        let joined = changed("spp = 1024", "spp = 1024, technique = \"bdpt\"").unwrap();
        assert_eq!(joined.reference_settings().unwrap()["samples_at_once"], 1);
    }

    #[test]
    fn mistakes_are_refused_by_name() {
        for (from, to, word) in [
            ("[\"builtin:ring\"]", "[]", "scenes"),
            ("[96, 64]", "[0, 64]", "size"),
            ("[4, 16]", "[16, 4]", "rising"),
            ("[4, 16]", "[]", "rising"),
            ("spp = [4, 16]", "spp = [4]\nseconds = [1.0]", "exactly one"),
            ("spp = [4, 16]", "spp = [4]\nrepeats = 0", "repeats"),
            ("spp = [4, 16]", "spp = [4]\npath_set = \"nonsense\"", "path set"),
            ("spp = [4, 16]", "spp = [4]\nrepeat = 3", "repeat"),
            ("sampler =", "smapler =", "roulette_start"),
            ("sampler =", "path_set =", "the same paths"),
            ("\"pcg\"", "\"dice\"", "dice"),
            ("name = \"b\"", "name = \"a\"", "twice"),
            ("name = \"b\"", "name = \"b\"\ntechnique = \"magic\"", "magic"),
            ("1024", "1", "reference.spp"),
            ("spp = [4, 16]", "spp = [4]\nstrips = [\"c\"]", "no variant"),
            (
                "spp = 1024",
                "spp = 1024, settings = { sampler = \"sobol\" }",
                "overestimate the reference's variance",
            ),
            (
                "spp = 1024",
                "spp = 1024, technique = \"bdpt\", settings = { samples_at_once = 8 }",
                "the variance layer lacks",
            ),
        ] {
            let message = changed(from, to).unwrap_err();
            assert!(message.contains(word), "{to}: {message}");
        }
    }

    #[test]
    fn the_smoke_form_is_small_and_keeps_what_is_compared() {
        let sweep = changed("[4, 16]", "[4, 16, 64, 256]").unwrap();
        let smoke = sweep.smoke_form();
        smoke.check().unwrap();
        assert_eq!((smoke.size, smoke.repeats, smoke.reference.spp), ([48, 48], 2, 1024));
        assert_eq!((&smoke.variants, &smoke.scenes), (&sweep.variants, &sweep.scenes));
        let timed = changed("spp = [4, 16]", "seconds = [0.5, 2.0]").unwrap().smoke_form();
        timed.check().unwrap();
        assert_eq!((timed.spp, timed.seconds), (None, Some(vec![0.05, 0.2])));
    }
}
