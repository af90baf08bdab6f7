//! `clerestory list`: the techniques with what they need, their bias and their settings, and the catalogue of the engine's systems.

use std::process::ExitCode;

use clap::Args;
use clerestory::catalogue::{self, Row};
use clerestory::settings::SettingInfo;
use clerestory::techniques::{self, Bias, Card};

use crate::failure::{Failure, Outcome};
use crate::output::{self, Table};

/// Lists the techniques and the catalogue of systems: publication, path set, bias, needs, tests
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory list
  clerestory list BG-3                 one system, with its module and tests
  clerestory list path                 one technique, with the meaning, range, unit and default of each setting
  clerestory list --markdown > docs/catalogue.md
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
}

/// A technique as it is printed.
#[derive(serde::Serialize)]
struct Technique {
    id: &'static str,
    summary: &'static str,
    publication: &'static str,
    path_set: String,
    bias: Bias,
    needs: &'static [&'static str],
    settings: Vec<SettingInfo>,
    default_settings: serde_json::Value,
}

impl From<&Card> for Technique {
    fn from(info: &Card) -> Self {
        Self {
            id: info.id,
            summary: info.summary,
            publication: info.publication,
            path_set: info.path_set.to_string(),
            bias: info.bias,
            needs: info.needs,
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
        let mut table = Table::new(&["id", "module", "bias", "tests", "system"], &[1, 2, 4]);
        for row in rows {
            let bias = row.bias.map_or("-", |bias| bias_text(bias).0);
            table.row([row.id, row.module, bias, &row.tests.len().to_string(), row.name].map(str::to_owned));
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

fn bias_line(bias: Bias) -> String {
    match bias_text(bias) {
        (word, "") => word.into(),
        (word, cause) => format!("{word}: {cause}"),
    }
}

fn row_text(row: &Row) -> String {
    block(
        row.id,
        &[
            ("system", row.name.into()),
            ("publication", row.publication.into()),
            ("module", row.module.into()),
            ("path set", row.path_set.map(|set| set.to_string()).unwrap_or_default()),
            ("bias", row.bias.map(bias_line).unwrap_or_default()),
            ("needs", needs_text(row.needs)),
            ("tests", row.tests.join("\n               ")),
            ("experiment", row.experiment.into()),
        ],
    )
}

fn text(technique: &Technique) -> String {
    block(
        technique.id,
        &[
            ("technique", technique.summary.into()),
            ("publication", technique.publication.into()),
            ("path set", technique.path_set.clone()),
            ("bias", bias_line(technique.bias)),
            ("needs", needs_text(technique.needs)),
            ("settings", technique.default_settings.to_string()),
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
