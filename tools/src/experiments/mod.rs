//! Experiments: what `clerestory report NAME` runs. Each is a file of `tools/experiments/`, named as the spec names it.
//!
//! An experiment *measures* numbers (a table of a [`measures::Measure`]: errors, counts and speeds of functions and kernels).

pub mod measures;
pub mod table;

use clerestory::{Error, Result};

/// The files of `tools/experiments/`: name and text.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/experiments.rs"));

/// An experiment as its file describes it.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// The file's name without its ending.
    #[serde(skip)]
    pub name: String,
    /// What it shows, in one line.
    pub title: String,
    /// Ids of the catalogue's rows that it measures.
    pub systems: Vec<String>,
    /// The measure that it runs, by its name.
    pub measure: String,
}

/// The names of all experiments, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// The experiment of that name.
///
/// # Errors
/// [`Error::Setting`] when there is none, or when its file is not sound.
pub fn find(name: &str) -> Result<Experiment> {
    let (name, text) = FILES
        .iter()
        .find(|(known, _)| known.eq_ignore_ascii_case(name))
        .ok_or_else(|| {
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
    measures::find(&experiment.measure)?;
    Ok(Experiment {
        name: name.to_owned(),
        ..experiment
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_sound_and_names_rows_of_the_catalogue() {
        for name in names() {
            let experiment = find(name).unwrap();
            assert!(!experiment.title.is_empty() && !experiment.systems.is_empty(), "{name}");
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
}
