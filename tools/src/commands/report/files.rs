//! The files of an experiment's results, each written as a whole or not at all.

use std::path::Path;

use clerestory::Error;
use clerestory::atomic;
use clerestory::film::png;
use clerestory_tools::experiments::findings::Findings;
use clerestory_tools::experiments::reference::slug;
use clerestory_tools::experiments::results::Results;
use clerestory_tools::experiments::series::{self, Work};
use clerestory_tools::experiments::strip::{self, Strip};
use clerestory_tools::experiments::{Experiment, summary, sweep_criteria, web_page};

use crate::failure::Outcome;
use crate::output;

/// The files at the top of every experiment's folder that others could have, too. The first one says that the folder is an experiment's, and is written before
/// the others.
pub const NAMES: [&str; 4] = ["report.json", "report.md", "measurements.csv", "index.html"];

fn write(path: &Path, text: &str) -> Outcome {
    Ok(atomic::write(path, text.as_bytes())?)
}

fn make(folder: &Path) -> Outcome {
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error).into())
}

/// Writes what a measure found: a page with the verdicts first, JSON, a CSV for each table, plots and rows. Returns the page.
pub fn measure(folder: &Path, experiment: &Experiment, findings: &Findings, rows: &str) -> Outcome<String> {
    make(folder)?;
    write(
        &folder.join("report.json"),
        &output::json_text("report.json", findings)?,
    )?;
    let Findings { tables, plots, .. } = findings;
    let mut page = format!(
        "# {}: {}\n\n{}{}\n",
        experiment.name,
        experiment.title,
        verdicts_first(findings),
        experiment.about
    );
    for plot in plots {
        if let Some(svg) = plot.svg()? {
            write(&folder.join(&plot.file), &svg)?;
        }
    }
    for (index, table) in tables.iter().enumerate() {
        page += &format!("\n{}", table.markdown());
        write(&folder.join(format!("{}.csv", index + 1)), &table.csv())?;
    }
    write(&folder.join("report.md"), &page)?;
    write(&folder.join("rows.json"), rows)?;
    Ok(page)
}

/// Verdicts and the one number, with an empty line after; nothing of a measure without any.
fn verdicts_first(findings: &Findings) -> String {
    match findings.summary() {
        text if text.is_empty() => text,
        text => text + "\n",
    }
}

/// Writes everything of a sweep: page, Markdown, JSON, CSV, plots and picture strips. Returns the Markdown of verdicts, facts and tables.
pub fn sweep(folder: &Path, experiment: &Experiment, results: &Results) -> Outcome<String> {
    let (plots, strips) = (folder.join("plots"), folder.join("strips"));
    for folder in [folder, &plots, &strips] {
        make(folder)?;
    }
    let scenes = series::of(results);
    let findings = sweep_criteria::findings(experiment, results, &scenes);
    let made: clerestory::Result<Vec<Option<Strip>>> = results.scenes.iter().map(strip::of).collect();
    let made = made?;
    for (scene, strip) in scenes.iter().zip(&made) {
        let name = slug(&scene.address);
        for work in Work::ALL {
            if let Some(svg) = web_page::plot_of(scene, work)? {
                write(&plots.join(format!("{name}-{}.svg", work.word())), &svg)?;
            }
        }
        if let Some(strip) = strip {
            png::write(strips.join(format!("{name}.png")), &strip.composed())?;
        }
    }
    let verdicts = verdicts_first(&findings);
    let text = summary::markdown(results, &scenes);
    let page = format!(
        "# {}: {}\n\n{verdicts}{}\n\n{text}",
        results.experiment, results.title, results.about
    );
    let document = serde_json::json!({
        "verdicts": findings.verdicts,
        "headline": findings.headline,
        "results": results,
        "statistics": scenes,
    });
    write(
        &folder.join("report.json"),
        &output::json_text("report.json", &document)?,
    )?;
    write(&folder.join("report.md"), &page)?;
    write(&folder.join("measurements.csv"), &summary::measurements(results).csv())?;
    // Last, so that a page that is there has all that stands beside it.
    write(
        &folder.join("index.html"),
        &web_page::html(results, &scenes, &findings, &made)?,
    )?;
    Ok(verdicts + &text)
}
