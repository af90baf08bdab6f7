//! The registry as a page of Markdown: every case with its picture, and the table of verdicts.

use crate::{HardCase, Outcome, Verdict};

/// The page, from the repository's root.
pub const PAGE: &str = "docs/stability.md";
/// The folder of the cases' pictures, `NAME.png` each, from the repository's root.
pub const PICTURES: &str = "docs/hard-cases";

/// The part of the page that describes a case, with its picture where there is one.
pub fn case_section(case: &HardCase, pictured: bool) -> String {
    let documented = case
        .documented
        .map_or(String::new(), |text| format!("\n- Degrades: {text}"))
        + &case.documented_bias.map_or(String::new(), |text| {
            format!("\n- Degrades where pictures have a bias: {text}")
        });
    let picture = if pictured {
        format!("![{name}](hard-cases/{name}.png)\n\n", name = case.name)
    } else {
        String::new()
    };
    format!(
        "### {}\n\n{picture}- Breaks: {}\n- Expected: {}{documented}\n",
        case.name, case.breaks, case.expects,
    )
}

/// A case with its outcomes in the order of the page's subjects, `None` where it does not concern one.
pub type Row<'a> = (&'a HardCase, Vec<Option<Outcome>>);

/// The page. `device` says on what the outcomes were measured, `pictured` which cases have a picture.
pub fn markdown(device: &str, subjects: &[String], rows: &[Row<'_>], pictured: impl Fn(&HardCase) -> bool) -> String {
    let mut page = format!(
        "# Stability\n\nHow every technique with each of its samplers, every ray index and the scattering functions (`lobes`, in f64) take the \
         hard cases. Written by `clerestory stability --markdown`, measured on {device}. Each cell has the figure that came nearest \
         to its bound: *measured* of *allowed*. **degrades** is what is documented, **refused** what a technique says beforehand that it cannot \
         model, `–` stands where a case does not concern a subject. `clerestory stability CASE --json` has the \
         reasons too.\n\n| case | {} |\n|---|{}\n",
        subjects.join(" | "),
        "---|".repeat(subjects.len()),
    );
    // Each with the cases that it is said of.
    let mut reasons: Vec<(&String, &String, Vec<&str>)> = Vec::new();
    for (case, outcomes) in rows {
        page += &format!("| [{name}](#{name}) |", name = case.name);
        for outcome in outcomes {
            page += &match outcome {
                None => " – |".to_owned(),
                Some(outcome) => format!(" {} |", cell(outcome)),
            };
        }
        page.push('\n');
        for outcome in outcomes.iter().flatten() {
            let Some(reason) = &outcome.reason else { continue };
            let said = reasons
                .iter_mut()
                .find(|(subject, known, _)| (*subject, *known) == (&outcome.subject, reason));
            match said {
                Some((_, _, cases)) => cases.push(case.name),
                None => reasons.push((&outcome.subject, reason, vec![case.name])),
            }
        }
    }
    if !reasons.is_empty() {
        page += "\n## What does not pass, and what to do\n\n";
        for (subject, reason, cases) in reasons {
            page += &format!("- {subject}, {}: {reason}\n", cases.join(", "));
        }
    }
    page += "\n## The cases\n";
    for (case, _) in rows {
        page += "\n";
        page += &case_section(case, pictured(case));
    }
    page
}

fn cell(outcome: &Outcome) -> String {
    let word = match outcome.verdict {
        Verdict::Pass => outcome.verdict.word().to_owned(),
        _ => format!("**{}**", outcome.verdict.word()),
    };
    if outcome.measured.is_empty() {
        word
    } else {
        format!("{word}: {}", outcome.measured.replace('|', "\\|"))
    }
}
