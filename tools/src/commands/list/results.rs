//! Where the figures of an experiment are kept: the parts of `RESULTS.md` that its command wrote.

use clerestory_tools::experiments;

/// The page of results as it was when the program was built.
const PAGE: &str = include_str!("../../../../RESULTS.md");

/// Parts that `clerestory report` writes without being told names, which have heads of their own, and their experiments.
const WITHOUT_NAMES: [(&str, &str); 2] = [
    ("Error against time", "error-against-time"),
    ("Error against time in media", "error-in-media"),
];

/// The parts of the page that hold what a row's command measures, by their heads.
pub fn parts(command: &str) -> Vec<&'static str> {
    let heads = PAGE.lines().filter_map(|line| line.strip_prefix("## "));
    let heads = heads.filter_map(|head| head.strip_suffix('`')?.split_once(": `"));
    heads
        .filter(|(part, written_by)| holds(part, written_by, command))
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

    #[test]
    fn commands_find_their_parts() {
        assert_eq!(parts("clerestory report error-against-time"), ["Error against time"]);
        assert_eq!(
            parts("clerestory report error-in-media"),
            ["Error against time in media"]
        );
        assert_eq!(parts("clerestory report photon-ring photon-queues").len(), 2);
        assert_eq!(
            parts("clerestory agreement --scene fog-box,smoke"),
            ["Error and speed beside Mitsuba 3"]
        );
        assert_eq!(
            parts("clerestory bench --sort"),
            parts("clerestory bench --sort --peers")
        );
        for none in ["clerestory bench", "tools/test", "clerestory report no-such", ""] {
            assert!(parts(none).is_empty(), "{none:?}");
        }
    }
}
