//! Measurements that are kept: one line of JSON each, appended as soon as it is made, so that an interrupted report goes on where it stopped.
//!
//! A measurement is known by its key, a fingerprint of all that it depends on: scene, picture, technique and settings, budget, seed,
//! reference, engine version, machine, device and driver. It holds the fingerprints of the kernels that made it and counts only while the build
//! still has them. Titles and the names of variants are not part of the key.
//! Guarantees: a line that was cut off while it was written is skipped; later lines replace earlier ones of the same key.

use std::collections::BTreeMap;
use std::path::Path;

use clerestory::Result;
use serde_json::Value;

use super::fingerprint;
use super::json_lines::JsonLines;
use super::sweep::Budget;
use super::unbiased::UnbiasedError;

/// One picture's cost and error.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Measurement {
    /// Fingerprint of all that it depends on but the kernels.
    pub key: String,
    /// Fingerprints of the kernels, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub kernels: BTreeMap<String, String>,
    /// The scene's address.
    pub scene: String,
    /// The technique's id.
    pub technique: String,
    /// All of its settings.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub settings: Value,
    /// What was allowed.
    pub budget: Budget,
    /// Seed.
    pub seed: u32,
    /// Mean number of samples per pixel.
    pub samples: f64,
    /// Seconds of wall clock, after a picture that warms the driver's cache.
    pub seconds: f64,
    /// Seconds by the device's timestamps; 0 where it has none.
    pub gpu_seconds: f64,
    /// Work units by name, exact.
    pub counters: BTreeMap<String, u64>,
    /// Errors without the reference's noise.
    #[serde(flatten)]
    pub error: UnbiasedError,
    /// Mean signed error over the reference's mean; `None` against black.
    pub relative_bias: Option<f64>,
    /// Mean FLIP error at the scene's exposure.
    pub flip: f64,
    /// The 99.9 % quantile of the absolute error.
    pub quantile_999: f64,
    /// Pixels of the picture that are not finite, and samples that were left out for it.
    pub non_finite: u64,
    /// When it was made, ISO 8601 in UTC.
    pub time: String,
}

impl Measurement {
    /// Without what is the same of all measurements of a variant, or large and of no use but to the store: settings and kernels.
    #[must_use]
    pub fn within_results(self) -> Self {
        Self {
            kernels: BTreeMap::new(),
            settings: Value::Null,
            ..self
        }
    }

    /// A counter, 0 where the technique has none of that name.
    pub fn count(&self, name: &str) -> f64 {
        self.counters.get(name).copied().unwrap_or(0) as f64
    }
}

/// The file of measurements of one experiment.
#[derive(Debug)]
pub struct Store {
    file: JsonLines,
    known: BTreeMap<String, Measurement>,
}

impl Store {
    /// Reads what there is.
    ///
    /// # Errors
    /// As [`JsonLines::open`].
    pub fn open(path: &Path) -> Result<Self> {
        let (file, lines) = JsonLines::open(path)?;
        let known = lines.into_iter().map(|one: Measurement| (one.key.clone(), one));
        Ok(Self {
            file,
            known: known.collect(),
        })
    }

    /// The measurement of that key, if the kernels that made it are still the build's.
    pub fn get(&self, key: &str) -> Option<&Measurement> {
        self.known
            .get(key)
            .filter(|one| fingerprint::kernels_are_current(&one.kernels))
    }

    /// Keeps a measurement, in the file first, and returns it as it will be read back.
    ///
    /// # Errors
    /// As [`JsonLines::add`].
    pub fn add(&mut self, measurement: &Measurement) -> Result<Measurement> {
        let read = self.file.add(measurement)?;
        self.known.insert(read.key.clone(), read.clone());
        Ok(read)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A measurement that no machine has made.
    pub(in super::super) fn made_up(key: &str, budget: Budget, seed: u32, seconds: f64, mse: f64) -> Measurement {
        Measurement {
            key: key.into(),
            kernels: BTreeMap::new(),
            scene: "builtin:ring".into(),
            technique: "path".into(),
            settings: Value::Null,
            budget,
            seed,
            samples: match budget {
                Budget::Spp(spp) => f64::from(spp),
                Budget::Seconds(seconds) => 100.0 * seconds,
            },
            seconds,
            gpu_seconds: 0.0,
            counters: BTreeMap::from([("rays".into(), (1e6 * seconds) as u64)]),
            error: UnbiasedError {
                mse,
                relative_mse: 2.0 * mse,
                reference_mse: 1e-6,
                reference_relative_mse: 2e-6,
                reference_error: 1e-9,
                reference_relative_error: 2e-9,
                skipped: 0,
            },
            relative_bias: Some(1e-3),
            flip: 0.1,
            quantile_999: 1.0,
            non_finite: 0,
            time: "2026-01-01T00:00:00Z".into(),
        }
    }

    #[test]
    fn what_was_kept_is_found_and_a_line_cut_off_is_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("measurements.jsonl");
        let one = |key: &str, seconds| made_up(key, Budget::Spp(4), 0, seconds, 0.25);
        let mut store = Store::open(&path).unwrap();
        store.add(&one("a", 0.5)).unwrap();
        store.add(&one("b", 1.5)).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 20]).unwrap();
        let mut store = Store::open(&path).unwrap();
        assert_eq!(store.get("a"), Some(&one("a", 0.5)));
        assert_eq!(store.get("b"), None);
        store.add(&one("c", 2.5)).unwrap();
        store.add(&one("a", 3.5)).unwrap();
        let store = Store::open(&path).unwrap();
        assert_eq!(store.get("a").map(|one| one.seconds), Some(3.5));
        assert_eq!(store.get("c").map(|one| one.seconds), Some(2.5));
    }

    #[test]
    fn measurements_by_other_kernels_do_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open(&folder.path().join("measurements.jsonl")).unwrap();
        let mut old = made_up("a", Budget::Seconds(0.5), 0, 0.5, 0.25);
        old.kernels = BTreeMap::from([("gone.comp".into(), "0".into())]);
        store.add(&old).unwrap();
        assert_eq!(store.get("a"), None);
    }
}
