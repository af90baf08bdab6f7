//! `clerestory list`: the techniques with where their code, kernels, tests and results are, and the catalogue of the engine's systems.

mod results;

use std::process::ExitCode;

use clap::Args;
use clerestory::catalogue::{self, Cite, Row};
use clerestory::settings::SettingInfo;
use clerestory::techniques::{self, Bias, Card};

use crate::failure::{Failure, Outcome};
use crate::output::{self, Table};

/// Lists the techniques and the catalogue of systems: what they cannot do, and where code, kernels, tests and results are
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory list
  clerestory list BG-3                 one system, with its sources, code, shaders, tests and results
  clerestory list path                 one technique, with the meaning, range, unit and default of each setting
  clerestory list --markdown > docs/catalogue.md
  clerestory list --sources > third_party_notes/sources.md
  clerestory list --json | jq '.techniques[].default_settings'
  clerestory render --technique path --settings '{\"roulette_start\": 8}'")]
pub struct Arguments {
    /// Only this technique or system, by its id
    id: Option<String>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    /// Prints the catalogue as a page of Markdown
    #[arg(long, conflicts_with_all = ["id", "json"])]
    markdown: bool,
    /// Prints the sources that the catalogue cites, as a page of Markdown
    #[arg(long, conflicts_with_all = ["id", "json", "markdown"])]
    sources: bool,
}

/// A technique as it is printed.
#[derive(serde::Serialize)]
struct Technique {
    id: &'static str,
    summary: &'static str,
    path_set: String,
    bias: Bias,
    needs: &'static [&'static str],
    /// Its row of the catalogue; that of its code, tests and so on.
    row: Option<&'static Row>,
    /// The folder of its code.
    code: &'static str,
    /// The parts of `RESULTS.md` that its experiments wrote.
    results: Vec<&'static str>,
    settings: Vec<SettingInfo>,
    default_settings: serde_json::Value,
}

impl From<&Card> for Technique {
    fn from(info: &Card) -> Self {
        let row = catalogue::row_of(info);
        Self {
            id: info.id,
            summary: info.summary,
            path_set: info.path_set.to_string(),
            bias: info.bias,
            needs: info.needs,
            row,
            code: row.map_or("", folder),
            results: row.map(|row| results::parts(row.experiment)).unwrap_or_default(),
            settings: info.settings.infos(),
            default_settings: info.settings.defaults(),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.markdown {
        output::print(&catalogue::markdown())?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.sources {
        output::print(&catalogue::sources_markdown())?;
        return Ok(ExitCode::SUCCESS);
    }
    let wanted = |id: &str| {
        arguments
            .id
            .as_deref()
            .is_none_or(|wanted| wanted.eq_ignore_ascii_case(id))
    };
    let techniques = techniques::all().iter().filter(|technique| wanted(technique.id));
    let techniques: Vec<Technique> = techniques.map(Technique::from).collect();
    let rows: Vec<&Row> = catalogue::all().iter().filter(|row| wanted(row.id)).collect();
    if techniques.is_empty() && rows.is_empty() {
        let id = arguments.id.as_deref().unwrap_or_default();
        return Err(Failure::usage(format!("no technique or system is called {id:?}"))
            .hint("`clerestory list` shows all of them"));
    }
    if arguments.json {
        output::print_json(&serde_json::json!({ "techniques": techniques, "catalogue": rows }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut texts: Vec<String> = techniques.iter().map(text).collect();
    if arguments.id.is_some() {
        texts.extend(techniques.iter().map(settings_table));
        texts.extend(rows.into_iter().map(row_text));
    } else {
        // What is longest comes last: lines that a narrow terminal breaks stay readable.
        let mut table = Table::new(
            &["id", "role", "module", "bias", "tests", "system: limits"],
            &[1, 2, 3, 5],
        );
        for row in rows {
            let bias = row.bias.map_or("-", |bias| bias_text(bias).0);
            table.row([
                row.id.to_owned(),
                row.role.to_string(),
                row.module.to_owned(),
                bias.to_owned(),
                row.tests.len().to_string(),
                format!("{}: {}", row.name, row.limits),
            ]);
        }
        texts.push(table.text());
    }
    output::print(&texts.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// A word for the bias, and its cause.
fn bias_text(bias: Bias) -> (&'static str, &'static str) {
    match bias {
        Bias::Unbiased => ("unbiased", ""),
        Bias::Consistent(cause) => ("consistent", cause),
        Bias::Biased(cause) => ("biased", cause),
    }
}

fn needs_text(needs: &[&str]) -> String {
    if needs.is_empty() {
        "the engine's baseline".into()
    } else {
        needs.join(", ")
    }
}

/// Lines `  name  value` below a head.
fn block(id: &str, facts: &[(&str, String)]) -> String {
    let mut text = output::bold(id) + "\n";
    for (name, value) in facts.iter().filter(|(_, value)| !value.is_empty()) {
        text += &format!("  {name:<11}  {value}\n");
    }
    text
}

/// Lines below each other in a [`block`].
fn lines(values: impl IntoIterator<Item = String>) -> String {
    values.into_iter().collect::<Vec<_>>().join("\n               ")
}

/// A row's folder, with its slash.
fn folder(row: &'static Row) -> &'static str {
    row.module.rfind('/').map_or("", |end| &row.module[..=end])
}

fn cite_text(cite: &Cite) -> String {
    match cite.place {
        "" => cite.source.to_string(),
        place => format!("{}: {place}", cite.source),
    }
}

/// Where the figures are that a command measures.
fn results_text(parts: &[&str]) -> String {
    if parts.is_empty() {
        "none kept: the experiment prints them".into()
    } else {
        lines(parts.iter().map(|part| format!("RESULTS.md, \"{part}\"")))
    }
}

/// The files of tests, each with how many there are.
fn test_files(tests: &[&str]) -> String {
    let mut files: Vec<(&str, usize)> = Vec::new();
    for file in tests.iter().filter_map(|test| test.split("::").next()) {
        match files.iter_mut().find(|(known, _)| *known == file) {
            Some((_, count)) => *count += 1,
            None => files.push((file, 1)),
        }
    }
    lines(files.iter().map(|(file, count)| format!("{file} ({count})")))
}

fn parts_text(id: &str) -> String {
    let parts: Vec<&str> = catalogue::parts_of(id).map(|row| row.id).collect();
    parts.join(", ")
}

fn row_text(row: &Row) -> String {
    let owned = |texts: &[&str]| lines(texts.iter().map(|text| (*text).to_owned()));
    let sources = if row.sources.is_empty() {
        "the engine's own".into()
    } else {
        lines(row.sources.iter().map(cite_text))
    };
    block(
        row.id,
        &[
            ("system", row.name.into()),
            ("role", row.role.to_string()),
            ("limits", row.limits.into()),
            ("bias", row.bias.map(|bias| bias.to_string()).unwrap_or_default()),
            ("path set", row.path_set.unwrap_or_default().into()),
            ("needs", needs_text(row.needs)),
            ("module", row.module.into()),
            ("shaders", owned(row.shaders)),
            ("tests", owned(row.tests)),
            ("experiment", row.experiment.into()),
            ("results", results_text(&results::parts(row.experiment))),
            ("sources", sources),
            ("parts", parts_text(row.id)),
        ],
    )
}

fn text(technique: &Technique) -> String {
    let names: Vec<&str> = technique.settings.iter().map(|setting| setting.name).collect();
    let of_row = |text: &dyn Fn(&'static Row) -> String| technique.row.map(text).unwrap_or_default();
    block(
        technique.id,
        &[
            ("technique", technique.summary.into()),
            ("limits", of_row(&|row| row.limits.into())),
            ("bias", technique.bias.to_string()),
            ("path set", technique.path_set.clone()),
            ("needs", needs_text(technique.needs)),
            ("code", technique.code.into()),
            (
                "kernels",
                of_row(&|row| lines(row.shaders.iter().map(|text| (*text).to_owned()))),
            ),
            (
                "settings",
                format!("{}; `clerestory list {}` explains them", names.join(", "), technique.id),
            ),
            ("tests", of_row(&|row| test_files(row.tests))),
            ("experiment", of_row(&|row| row.experiment.into())),
            ("results", results_text(&technique.results)),
            (
                "row, parts",
                of_row(&|row| format!("{}; {}", row.id, parts_text(row.id))),
            ),
        ],
    )
}

/// What each setting means.
fn settings_table(technique: &Technique) -> String {
    let mut table = Table::new(&["setting", "default", "unit", "range", "meaning"], &[1, 2, 3, 4]);
    for setting in &technique.settings {
        table.row([
            setting.name.to_owned(),
            setting.default.to_string(),
            if setting.unit.is_empty() { "-" } else { setting.unit }.to_owned(),
            setting.range.clone(),
            setting.meaning.clone(),
        ]);
    }
    table.text()
}
