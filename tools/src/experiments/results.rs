//! What a sweep found: its facts, measurements and pictures, before any statistics.

use clerestory::film::{Picture, ToneMap};
use serde_json::Value;

use super::measurement::Measurement;
use super::sweep::{Budget, Sweep};

/// Everything about one run of a sweep.
#[derive(Debug, Clone, serde::Serialize)]
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
#[derive(Debug, Clone, serde::Serialize)]
pub struct SceneResults {
    /// Its address.
    pub address: String,
    /// Triangles of all its instances.
    pub triangles: u64,
    /// The reference's file.
    pub reference: String,
    /// Pixels for the reader: exposure and curve of shown pictures and of FLIP.
    pub tone: ToneMap,
    /// The reference itself.
    #[serde(skip)]
    pub reference_picture: Picture,
    /// By variant, in the sweep's order.
    pub variants: Vec<VariantResults>,
}

/// What was found of a variant in one scene.
#[derive(Debug, Clone, serde::Serialize)]
pub struct VariantResults {
    /// Its name.
    pub name: String,
    /// The technique's id.
    pub technique: String,
    /// All of its settings.
    pub settings: Value,
    /// The slope that is expected, if one is.
    pub expected_slope: Option<f64>,
    /// Why it could not render the scene.
    pub refused: Option<String>,
    /// By budget, rising; those without any measurement are left out.
    pub points: Vec<Point>,
    /// Its picture of the first seed and greatest budget.
    #[serde(skip)]
    pub picture: Option<Picture>,
}

/// All repeats of one budget.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Point {
    /// What was allowed.
    pub budget: Budget,
    /// By seed, in order.
    pub measurements: Vec<Measurement>,
}
