//! The list of all experiments: a line each with its verdict and the one number that a reader wants to know first.

use std::path::Path;

use clerestory::Result;

use super::stored::{Stored, findings};
use crate::experiments::findings::{Findings, Verdict};
use crate::experiments::table::Cell;
use crate::experiments::{self, Experiment};

/// How every list begins, by which it is known.
pub const MARK: &str = "# Results\n\nEvery experiment with its verdict, made by code";

/// The list's head.
const HEAD: &str = "\
# Results

Every experiment with its verdict, made by code from criteria that were written before the run: a criterion holds where the whole interval of what was \
measured lies within its bound, fails where none of it does, and is undecided between. Of times it is the interval of order statistics that holds the median \
in 93 of 100 runs: among many rows at a bound, some fail by chance. Each page says how it was run. `clerestory report NAME --results` runs an \
experiment and writes its page; `clerestory report --pages` writes all pages anew from what is stored.

| experiment | verdict | in one number | run |
|---|---|---|---|
";

/// The list's end: pages that other commands write.
const TAIL: &str = "
Beside them, not in this list: the [agreement with Mitsuba 3](agreement.md) scene by scene, [ray indexes](index.md), with verdicts of their own, and \
[radix sorts](sort.md) beside those of others.
";

/// The verdict on all criteria in some words; of an experiment that was not run, even what needs another machine is only that.
pub fn verdict(found: &Findings, was_run: bool) -> String {
    if !was_run {
        return "not run".into();
    }
    let count = |is: fn(&Verdict) -> bool| found.verdicts.iter().filter(|judged| is(&judged.verdict)).count();
    let all = found.verdicts.len();
    let holding = count(|verdict| *verdict == Verdict::Holds);
    let failing = count(|verdict| matches!(verdict, Verdict::Fails { .. }));
    let mut words = Vec::new();
    match all {
        0 => return "no criteria".into(),
        _ if holding == all => return format!("**holds** ({all})"),
        _ => {}
    }
    if failing > 0 {
        words.push(format!("**fails** {failing} of {all}"));
    }
    if holding > 0 {
        words.push(format!("holds {holding}"));
    }
    if all > holding + failing {
        words.push(format!("undecided {}", all - holding - failing));
    }
    words.join(", ")
}

/// The headline in words; empty without one.
pub fn headline(found: &Findings) -> String {
    let headline = found.headline.as_ref();
    headline.map_or_else(String::new, |headline| {
        format!("{}: {}", headline.words, Cell::from(headline.found))
    })
}

/// The whole list.
///
/// # Errors
/// As [`findings`].
pub fn of_all(root: &Path) -> Result<String> {
    let mut text = HEAD.to_owned();
    for name in experiments::names() {
        let experiment = experiments::find(name)?;
        let stored = Stored::read(&root.join(name))?;
        let found = findings(&experiment, stored.as_ref())?;
        let verdict = verdict(&found, stored.is_some());
        let date = stored.map_or_else(String::new, |stored| stored.run.date);
        text += &format!(
            "| [{}]({name}/README.md): {} | {} | {} | {date} |\n",
            name,
            experiment.short_title().replace('|', "\\|"),
            verdict,
            headline(&found).replace('|', "\\|"),
        );
    }
    Ok(text + TAIL)
}

/// An experiment's line in a page elsewhere, with the way to its folder.
///
/// # Errors
/// As [`findings`].
pub fn line(root: &Path, experiment: &Experiment, link: &str) -> Result<String> {
    let stored = Stored::read(&root.join(&experiment.name))?;
    let found = findings(experiment, stored.as_ref())?;
    let number = match headline(&found) {
        words if words.is_empty() => words,
        words => format!("; {words}"),
    };
    Ok(format!(
        "- [{}]({link}/{}/README.md): {}{number}",
        experiment.short_title(),
        experiment.name,
        verdict(&found, stored.is_some())
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_known_by_its_beginning() {
        assert!(HEAD.starts_with(MARK));
    }
}
