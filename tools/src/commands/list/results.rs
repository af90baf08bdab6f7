//! What measures a system, and where its figures are: experiments whose `systems` name it, and the parts of `RESULTS.md` that they and its own
//! command wrote.

use std::sync::LazyLock;

use clerestory::catalogue::Row;
use clerestory_tools::experiments::{self, Experiment};

/// The page of results as it was when the program was built.
const PAGE: &str = include_str!("../../../../RESULTS.md");

/// Parts that commands write without being told names, which have heads of their own, and their experiments.
const WITHOUT_NAMES: [(&str, &str); 3] = [
    ("Error against time", "error-against-time"),
    ("Error against time in media", "error-in-media"),
    ("Error and speed beside Mitsuba 3", "mitsuba"),
];

/// A part of the page of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Part {
    /// What it is called.
    pub name: &'static str,
    /// Its link in the page, as GitHub makes it of the head.
    #[serde(skip)]
    head: &'static str,
}

impl Part {
    /// The anchor of its head: lower case, with hyphens for spaces, without punctuation.
    pub fn anchor(&self) -> String {
        let letters = self.head.chars().filter_map(|c| match c {
            ' ' => Some('-'),
            c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
            _ => None,
        });
        letters.flat_map(char::to_lowercase).collect()
    }
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

/// The parts of the page that hold what these commands measure, in the page's order.
pub fn parts(commands: &[String]) -> Vec<Part> {
    let heads = PAGE.lines().filter_map(|line| line.strip_prefix("## "));
    let heads = heads.filter_map(|head| {
        let (name, written_by) = head.strip_suffix('`')?.split_once(": `")?;
        Some((Part { name, head }, written_by))
    });
    heads
        .filter(|(part, written_by)| commands.iter().any(|command| holds(part.name, written_by, command)))
        .map(|(part, _)| part)
        .collect()
}

/// Whether the part of this name, which `written_by` wrote, holds what `command` measures.
fn holds(part: &str, written_by: &str, command: &str) -> bool {
    if let Some(names) = command.strip_prefix("clerestory report ") {
        // Parts are called as their experiments are, several of which one command writes.
        let mut found = names.split_whitespace().filter_map(|name| experiments::find(name).ok());
        return found.any(|experiment| {
            let own = WITHOUT_NAMES.iter().find(|(_, name)| *name == experiment.name);
            own.map_or(experiment.part(), |(part, _)| part) == part
        });
    }
    let words = |text: &'_ str| -> Vec<String> { text.split_whitespace().map(str::to_owned).collect() };
    let (ours, theirs) = (words(command), words(written_by));
    // `clerestory agreement` holds the scenes that rows name, and `bench --sort --peers` what `bench --sort` measures.
    theirs.len() > 1 && ours.starts_with(&theirs) || ours.len() > 2 && theirs.starts_with(&ours)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(command: &str) -> Vec<&'static str> {
        parts(&[command.to_owned()]).iter().map(|part| part.name).collect()
    }

    #[test]
    fn commands_find_their_parts() {
        assert_eq!(names("clerestory report error-against-time"), ["Error against time"]);
        assert_eq!(
            names("clerestory report error-in-media"),
            ["Error against time in media"]
        );
        assert_eq!(names("clerestory report photon-ring photon-queues").len(), 2);
        for beside_mitsuba in [
            "clerestory agreement --scene fog-box,smoke",
            "clerestory report mitsuba",
        ] {
            assert_eq!(names(beside_mitsuba), ["Error and speed beside Mitsuba 3"]);
        }
        assert_eq!(
            names("clerestory bench --sort"),
            names("clerestory bench --sort --peers")
        );
        for none in ["clerestory bench", "tools/test", "clerestory report no-such", ""] {
            assert!(names(none).is_empty(), "{none:?}");
        }
    }

    #[test]
    fn rows_have_the_experiments_that_name_them() {
        let row = clerestory::catalogue::find("CL-LBVH").unwrap();
        let commands = commands(row);
        assert!(commands[0].contains("build-stages"), "{commands:?}");
        assert_eq!(commands[1], row.experiment);
        assert!(parts(&commands).len() > 1, "{commands:?}");
    }

    #[test]
    fn anchors_are_those_of_the_heads() {
        let part = parts(&["clerestory report build-stages".to_owned()])[0];
        assert_eq!(
            part.anchor(),
            "builds-of-hierarchies-for-rays-by-stage-clerestory-report-build-stages"
        );
    }
}
