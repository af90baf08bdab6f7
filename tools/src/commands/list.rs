//! `clerestory list`: the techniques, with what they need, their bias and their settings.

use std::process::ExitCode;

use clap::Args;
use clerestory::techniques::{self, Bias, TechniqueInfo};

use crate::failure::Outcome;
use crate::output;

/// Lists the techniques: publication, path set, bias, device needs, settings
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory list
  clerestory list --json | jq '.techniques[].default_settings'
  clerestory render --technique path --settings '{\"roulette_start\": 8}'")]
pub struct Arguments {
    /// Prints JSON
    #[arg(long)]
    json: bool,
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
    default_settings: serde_json::Value,
}

impl From<&TechniqueInfo> for Technique {
    fn from(info: &TechniqueInfo) -> Self {
        Self {
            id: info.id,
            summary: info.summary,
            publication: info.publication,
            path_set: info.path_set.to_string(),
            bias: info.bias,
            needs: info.needs,
            default_settings: (info.default_settings)(),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let techniques: Vec<Technique> = techniques::all().iter().map(Technique::from).collect();
    if arguments.json {
        output::print_json(&serde_json::json!({ "techniques": techniques }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let texts: Vec<String> = techniques.iter().map(text).collect();
    output::print(&texts.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn text(technique: &Technique) -> String {
    let needs = if technique.needs.is_empty() {
        "the engine's baseline".into()
    } else {
        technique.needs.join(", ")
    };
    let bias = match technique.bias {
        Bias::Unbiased => "unbiased".to_owned(),
        Bias::Consistent(cause) => format!("consistent: {cause}"),
        Bias::Biased(cause) => format!("biased: {cause}"),
    };
    format!(
        "{}\n  {}\n  publication  {}\n  path set     {}\n  bias         {bias}\n  needs        {needs}\n  settings     {}\n",
        output::bold(technique.id),
        technique.summary,
        technique.publication,
        technique.path_set,
        technique.default_settings
    )
}
