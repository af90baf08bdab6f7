//! What measures a system, and where its figures are: pages of the experiments whose `systems` name it, and of its own command.

use std::sync::LazyLock;

use clerestory::catalogue::Row;
use clerestory_tools::experiments::pages::{FOLDER, PAGE};
use clerestory_tools::experiments::{self, Experiment};

/// Pages of commands that are not experiments: the words that their commands begin with, what they hold, and their files in the folder of results.
const OF_COMMANDS: [(&str, &str, &str); 3] = [
    ("clerestory bench --sort", "Sorted keys per second", "sort.md"),
    (
        "clerestory index",
        "Indexes and rays beside other libraries",
        "index.md",
    ),
    (
        "clerestory agreement",
        "Error and speed beside Mitsuba 3",
        "agreement.md",
    ),
];

/// A page of results.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Page {
    /// What it holds.
    pub name: String,
    /// Its path from the repository's root.
    pub path: String,
}

/// The experiments that measure a row.
pub fn experiments_of(row: &Row) -> Vec<&'static Experiment> {
    static ALL: LazyLock<Vec<Experiment>> = LazyLock::new(|| {
        experiments::names()
            .filter_map(|name| experiments::find(name).ok())
            .collect()
    });
    let names_it = |experiment: &&Experiment| experiment.systems.iter().any(|id| id == row.id);
    ALL.iter().filter(names_it).collect()
}

/// The commands that measure a row: its experiments in one, and its own.
pub fn commands(row: &Row) -> Vec<String> {
    let names: Vec<&str> = experiments_of(row)
        .iter()
        .map(|experiment| experiment.name.as_str())
        .collect();
    let report = (!names.is_empty()).then(|| format!("clerestory report {}", names.join(" ")));
    let own = (!row.experiment.is_empty()).then(|| row.experiment.to_owned());
    report.into_iter().chain(own).collect()
}

/// The pages that hold what these commands measure, in the order of the commands.
pub fn pages(commands: &[String]) -> Vec<Page> {
    let mut all: Vec<Page> = Vec::new();
    for command in commands {
        let found: Vec<Page> = match command.strip_prefix("clerestory report ") {
            Some(names) => names.split_whitespace().filter_map(of_experiment).collect(),
            None => {
                let begins = |(words, ..): &&(&str, &str, &str)| command.starts_with(words);
                let page = OF_COMMANDS.iter().find(begins).map(|(_, name, file)| Page {
                    name: (*name).into(),
                    path: format!("{FOLDER}/{file}"),
                });
                page.into_iter().collect()
            }
        };
        for page in found {
            if !all.contains(&page) {
                all.push(page);
            }
        }
    }
    all
}

fn of_experiment(name: &str) -> Option<Page> {
    let experiment = experiments::find(name).ok()?;
    Some(Page {
        name: experiment.short_title().into(),
        path: format!("{FOLDER}/{}/{PAGE}", experiment.name),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(command: &str) -> Vec<String> {
        pages(&[command.to_owned()]).into_iter().map(|page| page.path).collect()
    }

    #[test]
    fn commands_find_their_pages() {
        assert_eq!(
            paths("clerestory report photon-ring photon-queues"),
            ["results/photon-ring/README.md", "results/photon-queues/README.md"]
        );
        assert_eq!(
            paths("clerestory agreement --scene fog-box,smoke"),
            ["results/agreement.md"]
        );
        assert_eq!(paths("clerestory bench --sort --peers"), ["results/sort.md"]);
        for none in ["clerestory bench", "tools/test", "clerestory report no-such", ""] {
            assert!(paths(none).is_empty(), "{none:?}");
        }
    }

    #[test]
    fn rows_have_the_experiments_that_name_them() {
        let row = clerestory::catalogue::find("CL-LBVH").unwrap();
        let commands = commands(row);
        assert!(commands[0].contains("build-stages"), "{commands:?}");
        assert_eq!(commands[1], row.experiment);
        assert!(pages(&commands).len() > 1, "{commands:?}");
    }
}
