//! The registry as a page of Markdown: every case with its picture, and the table of verdicts.

use clerestory::techniques;

use crate::run::WAY_ROUND;
use crate::{HardCase, Outcome, Subject, Verdict};

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
        })
        + &case.documented_walks.map_or(String::new(), |text| {
            format!("\n- Degrades where light comes by walks from the lights: {text}")
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
        "# Stability\n\nHow every technique with each of its samplers, and in media with each of its estimates of light there, every ray index and the scattering functions (`lobes`, in f64) take the \
         hard cases. Written by `clerestory stability --markdown`, measured on {device}. Each cell has the figure that came nearest \
         to its bound: *measured* of *allowed*. **degrades** is what is documented, **refused** what a technique says beforehand that it cannot \
         model, `–` stands where a case does not concern a subject. `clerestory stability CASE --json` has the \
         reasons too.\n\n| case | {} |\n|---|{}\n",
        subjects.join(" | "),
        "---|".repeat(subjects.len()),
    );
    for (case, outcomes) in rows {
        page += &format!("| {} |", link(case));
        for outcome in outcomes {
            page += &match outcome {
                None => " – |".to_owned(),
                Some(outcome) => format!(" {} |", cell(outcome)),
            };
        }
        page.push('\n');
    }
    page += &promises();
    let remarks = remarks(rows);
    if !remarks.is_empty() {
        page += "\n## What does not pass, and what to do\n";
        page += &remarks;
    }
    page += "\n## The cases\n";
    for (case, _) in rows {
        page += "\n";
        page += &case_section(case, pictured(case));
    }
    page
}

/// What each technique is held to where a case says no more: by its id, since samplers change nothing of it.
pub fn promises() -> String {
    let mut text = "\n## What techniques are held to\n\n\
        Where a case allows more, it says so below; what a cell calls *allowed* is both, and the noise.\n\n"
        .to_owned();
    for card in techniques::all() {
        let subject = Subject::Technique {
            info: card,
            sampler: None,
            volume: None,
        };
        text += &format!("- {}: {}\n", card.id, subject.promise().unwrap_or_default());
    }
    text
}

/// A link to a case's section.
fn link(case: &HardCase) -> String {
    format!("[{name}](#{name})", name = case.name)
}

/// A text with what it is said of.
type Remark = (String, Vec<String>);

/// Adds what a text is said of; each text stands once.
fn add(remarks: &mut Vec<Remark>, text: String, said_of: String) {
    match remarks.iter_mut().find(|(known, _)| *known == text) {
        Some((_, all)) => all.push(said_of),
        None => remarks.push((text, vec![said_of])),
    }
}

/// What is said of outcomes that do not pass. What is documented stands in the sections of the cases, which are only named.
fn remarks(rows: &[Row<'_>]) -> String {
    let (mut degraded, mut refused, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for (case, outcomes) in rows {
        for outcome in outcomes.iter().flatten() {
            let Some(reason) = outcome.reason.as_deref() else {
                continue;
            };
            let documented = [case.documented, case.documented_bias, case.documented_walks].contains(&Some(reason));
            if outcome.verdict == Verdict::Refused {
                for reason in reason.trim_end_matches(WAY_ROUND).split("; ") {
                    add(&mut refused, format!("{}: {reason}", outcome.subject), link(case));
                }
            } else if documented {
                add(&mut degraded, link(case), outcome.subject.clone());
            } else {
                add(&mut others, format!("{}: {reason}", outcome.subject), link(case));
            }
        }
    }
    let mut text = String::new();
    for (text_of, cases) in others {
        text += &format!("\n- {text_of} ({})", cases.join(", "));
    }
    if !text.is_empty() {
        text.push('\n');
    }
    if !degraded.is_empty() {
        text += "\nThese degrade; the section of each case below says how, and what to do:\n\n";
        for (case, subjects) in degraded {
            text += &format!("- {case}: {}\n", subjects.join(", "));
        }
    }
    if !refused.is_empty() {
        text += "\nThese are refused; choose another technique or change the scene:\n\n";
        for (reason, cases) in refused {
            text += &format!("- {reason} ({})\n", cases.join(", "));
        }
    }
    text
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
