//! The page of an experiment and the files beside it: verdicts first, then a plot, tables and how it was run.

use clerestory::Result;

use super::stored::{Stored, findings};
use crate::experiments::Experiment;
use crate::experiments::findings::Findings;

/// The page's file; the folder's page where folders are shown.
pub const FILE: &str = "README.md";

/// A file of an experiment's folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub text: String,
}

/// All files that are made of what an experiment found.
///
/// # Errors
/// As [`findings`], and [`clerestory::Error::Io`] where a plot cannot be drawn.
pub fn files(experiment: &Experiment, stored: Option<&Stored>) -> Result<Vec<File>> {
    let found = findings(experiment, stored)?;
    let mut files = Vec::new();
    for (index, table) in found.tables.iter().enumerate() {
        files.push(File {
            name: format!("{}.csv", index + 1),
            text: table.csv(),
        });
    }
    let mut shown = Vec::new();
    for plot in &found.plots {
        if let Some(text) = plot.svg()? {
            files.push(File {
                name: plot.file.clone(),
                text,
            });
        } else if !plot.is_file() {
            continue;
        }
        shown.push(format!("![{}]({})\n", plot.words.replace(['[', ']'], ""), plot.file));
    }
    files.push(File {
        name: FILE.into(),
        text: page(experiment, stored, &found, &shown),
    });
    Ok(files)
}

fn page(experiment: &Experiment, stored: Option<&Stored>, found: &Findings, shown: &[String]) -> String {
    let mut parts = vec![format!("# {}\n", experiment.title), found.summary()];
    if !experiment.causes.is_empty() {
        parts.push(experiment.causes.trim_end().to_owned() + "\n");
    }
    parts.extend(shown.first().cloned());
    parts.push(experiment.about.trim_end().to_owned() + "\n");
    for (index, table) in found.tables.iter().enumerate() {
        let file = format!("{}.csv", index + 1);
        parts.push(if table.is_long {
            format!("## {}\n\n{} rows: [`{file}`]({file}).\n", table.title, table.rows.len())
        } else {
            table.markdown()
        });
    }
    parts.extend(shown.iter().skip(1).cloned());
    let systems = &experiment.systems;
    parts.push(format!(
        "Rows of the [catalogue](../../docs/catalogue.md) that it measures: {}. `clerestory list {}` names code, kernels, tests and sources.\n",
        systems.join(", "),
        systems[0]
    ));
    parts.push(match stored {
        Some(stored) => how_it_was_run(stored, &found.facts),
        None => format!(
            "## How to run it\n\nIt was not run. The command is `clerestory report {} --results`.\n",
            experiment.name
        ),
    });
    parts.retain(|part| !part.is_empty());
    parts.join("\n")
}

fn how_it_was_run(Stored { run, .. }: &Stored, facts: &[String]) -> String {
    let device = if run.device.is_empty() { "none" } else { &run.device };
    let commit = if run.commit.is_empty() { "unknown" } else { &run.commit };
    let note = if run.commit.ends_with('+') {
        ", with changes"
    } else {
        ""
    };
    let commit = commit.trim_end_matches('+');
    let facts: String = facts.iter().map(|fact| format!("\n- {fact}")).collect();
    let facts = if facts.is_empty() { facts } else { facts + "\n" };
    format!(
        "## How it was run\n\n`{}` took {:.0} seconds on {}, at commit {commit}{note}. Machine: {}, load average {} when it began and {} when it ended. \
         Vulkan device: {device}. Numbers in brackets are the ends of intervals; all digits are in the CSV files, all rows in `{}`.\n{facts}",
        run.command,
        run.seconds,
        run.date,
        run.machine,
        run.load[0],
        run.load[1],
        super::stored::FILE,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::find;

    #[test]
    fn causes_of_a_measure_stand_between_its_verdicts_and_what_it_is_about() {
        const CAUSE: &str = "Rays are few.";
        let experiment = Experiment {
            causes: CAUSE.into(),
            ..find("alpha").unwrap()
        };
        let all = files(&experiment, None).unwrap();
        let page = &all.iter().find(|file| file.name == FILE).unwrap().text;
        let place = |words: &str| page.find(words).unwrap();
        let causes = place(CAUSE);
        assert!(
            place("**undecided**") < causes && causes < place(experiment.about_in_short()),
            "{page}"
        );
    }
}
