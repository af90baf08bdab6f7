//! The files of an experiment's results.

use std::path::Path;

use clerestory::film::png;
use clerestory_tools::experiments::findings::Findings;
use clerestory_tools::experiments::reference::slug;
use clerestory_tools::experiments::results::Results;
use clerestory_tools::experiments::series::{self, Work};
use clerestory_tools::experiments::strip::{self, Strip};
use clerestory_tools::experiments::{Experiment, summary, sweep_criteria, web_page};

use crate::failure::Outcome;
use crate::outputs::NamedFile;
use crate::{output, pictures};

/// The files of every experiment's folder that others could have, too. The first one says that the folder is an experiment's, and is written before the
/// others.
const NAMES: [&str; 5] = [
    "report.json",
    "report.md",
    "measurements.csv",
    "index.html",
    "rows.json",
];
/// Folders in an experiment's folder.
const PLOTS: &str = "plots";
const STRIPS: &str = "strips";

/// What a run may write into an experiment's folder: the files with fixed names, and of the tables, plots and pictures that it numbers or names those that are there.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = NAMES.map(str::to_owned).to_vec();
    names.extend(numbered_and_drawn(folder));
    for inner in [PLOTS, STRIPS] {
        let drawn = numbered_and_drawn(&folder.join(inner));
        names.extend(drawn.into_iter().map(|name| format!("{inner}/{name}")));
    }
    names
}

/// Tables by number, plots and pictures in a folder.
pub fn numbered_and_drawn(folder: &Path) -> Vec<String> {
    let is_one = |name: &str| {
        let path = Path::new(name);
        match pictures::extension(path).as_str() {
            "svg" | "png" => true,
            "csv" => path
                .file_stem()
                .is_some_and(|stem| stem.to_string_lossy().parse::<u32>().is_ok()),
            _ => false,
        }
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| is_one(name)).collect();
    names.sort();
    names
}

/// The page of what a measure found, with the verdicts first, and all files: page, JSON, a CSV for each table, plots and rows.
pub fn measure(experiment: &Experiment, findings: &Findings, rows: &str) -> Outcome<(String, Vec<NamedFile>)> {
    let mut files = vec![NamedFile::new(
        "report.json",
        output::json_text("report.json", findings)?,
    )];
    let Findings { tables, plots, .. } = findings;
    let mut page = format!(
        "# {}: {}\n\n{}{}\n",
        experiment.name,
        experiment.title,
        verdicts_first(findings),
        experiment.about
    );
    files.push(NamedFile::new("rows.json", rows));
    for plot in plots {
        files.extend(plot.svg()?.map(|svg| NamedFile::new(plot.file.clone(), svg)));
    }
    for (index, table) in tables.iter().enumerate() {
        page += &format!("\n{}", table.markdown());
        files.push(NamedFile::new(format!("{}.csv", index + 1), table.csv()));
    }
    files.push(NamedFile::new("report.md", page.clone()));
    Ok((page, files))
}

/// Verdicts and the one number, with an empty line after; nothing of a measure without any.
fn verdicts_first(findings: &Findings) -> String {
    match findings.summary() {
        text if text.is_empty() => text,
        text => text + "\n",
    }
}

/// The Markdown of a sweep's verdicts, facts and tables, and all files: page, Markdown, JSON, CSV, plots and picture strips.
pub fn sweep(experiment: &Experiment, results: &Results) -> Outcome<(String, Vec<NamedFile>)> {
    let scenes = series::of(results);
    let findings = sweep_criteria::findings(experiment, results, &scenes);
    let made: clerestory::Result<Vec<Option<Strip>>> = results.scenes.iter().map(strip::of).collect();
    let made = made?;
    let document = serde_json::json!({
        "verdicts": findings.verdicts,
        "headline": findings.headline,
        "results": results,
        "statistics": scenes,
    });
    let mut files = vec![NamedFile::new(
        "report.json",
        output::json_text("report.json", &document)?,
    )];
    for (scene, strip) in scenes.iter().zip(&made) {
        let name = slug(&scene.address);
        for work in Work::ALL {
            let svg = web_page::plot_of(scene, work)?;
            files.extend(svg.map(|svg| NamedFile::new(format!("{PLOTS}/{name}-{}.svg", work.word()), svg)));
        }
        if let Some(strip) = strip {
            let strip = png::to_bytes(&strip.composed(), &name)?;
            files.push(NamedFile::new(format!("{STRIPS}/{name}.png"), strip));
        }
    }
    for scene in &results.scenes {
        if let Some(kept) = strip::kept(scene, &results.sweep.strips)? {
            let file = strip::file(scene);
            let picture = png::to_bytes(&kept.of_differences(), &file)?;
            files.push(NamedFile::new(file, picture));
        }
    }
    let verdicts = verdicts_first(&findings);
    let text = summary::markdown(results, &scenes);
    let page = format!(
        "# {}: {}\n\n{verdicts}{}\n\n{text}",
        results.experiment, results.title, results.about
    );
    files.push(NamedFile::new("report.md", page));
    files.push(NamedFile::new("measurements.csv", summary::measurements(results).csv()));
    // Last, so that a page that is there has all that stands beside it.
    files.push(NamedFile::new(
        "index.html",
        web_page::html(results, &scenes, &findings, &made)?,
    ));
    Ok((verdicts + &text, files))
}
