//! What a sweep found: its facts, measurements and pictures, before any statistics. Written as JSON and read back it is the same without the
//! pictures.

use clerestory::film::{Picture, ToneMap};
use serde_json::Value;

use super::measurement::Measurement;
use super::sweep::{Budget, Sweep};

/// Everything about one run of a sweep.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// The experiment's name.
    pub experiment: String,
    /// What it shows.
    pub title: String,
    /// What is compared with which oracle, on which inputs, and what counts as good.
    pub about: String,
    /// Rows of the catalogue that it measures.
    pub systems: Vec<String>,
    /// Whether this is the smallest form.
    pub smoke: bool,
    /// What was rendered.
    pub sweep: Sweep,
    /// The engine's version.
    pub engine_version: String,
    /// The device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Processor and threads.
    pub machine: String,
    /// Load average when it began, where the system tells.
    pub load: Option<String>,
    /// Whether it was stopped before all pictures were there.
    pub interrupted: bool,
    /// Pictures measured now.
    pub measured: usize,
    /// Pictures found from earlier runs.
    pub found: usize,
    /// By scene, in the sweep's order.
    pub scenes: Vec<SceneResults>,
}

/// What was found of one scene.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneResults {
    /// Its address.
    pub address: String,
    /// Triangles of all its instances.
    pub triangles: u64,
    /// Name of the reference's file, in the folder of references.
    pub reference: String,
    /// Pixels for the reader: exposure and curve of shown pictures and of FLIP.
    pub tone: ToneMap,
    /// Standard error of the reference's mean, over that mean.
    pub reference_error_of_mean: f64,
    /// The reference itself; `None` of results that were read back.
    #[serde(skip)]
    pub reference_picture: Option<Picture>,
    /// By variant, in the sweep's order.
    pub variants: Vec<VariantResults>,
}

/// What was found of a variant in one scene.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VariantResults {
    /// Its name.
    pub name: String,
    /// The technique's id.
    pub technique: String,
    /// All of its settings.
    pub settings: Value,
    /// Why it could not render the scene.
    pub refused: Option<String>,
    /// By budget, rising; those without any measurement are left out.
    pub points: Vec<Point>,
    /// Its picture of the first seed and greatest budget.
    #[serde(skip)]
    pub picture: Option<Picture>,
}

/// All repeats of one budget.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// What was allowed.
    pub budget: Budget,
    /// By seed, in order; without the kernels and settings, which [`Measurement::within_results`] leaves out.
    pub measurements: Vec<Measurement>,
}
