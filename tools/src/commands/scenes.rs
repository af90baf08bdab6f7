//! `clerestory scenes`: the generated scenes and what can be set in them.

use std::process::ExitCode;

use clap::Args;
use clerestory::scene::builtin::{self, Entry};

use crate::failure::{Failure, Outcome};
use crate::output::{self, Table};

/// Lists the generated scenes with their parameters
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory scenes                  every scene
  clerestory scenes ring             one scene
  clerestory render 'builtin:cornell-box?sphere=glass&light=2'   (quotes keep the shell from reading ? and &)")]
pub struct Arguments {
    /// Only this scene
    name: Option<String>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let all = builtin::catalogue();
    let wanted: Vec<&Entry> = match &arguments.name {
        None => all.iter().collect(),
        Some(name) => {
            let name = name.strip_prefix(builtin::PREFIX).unwrap_or(name);
            let names: Vec<_> = all.iter().map(|entry| entry.name).collect();
            let entry = all.iter().find(|entry| entry.name == name).ok_or_else(|| {
                Failure::usage(format!("no generated scene is called {name:?}"))
                    .hint(format!("there are: {}", names.join(", ")))
            })?;
            vec![entry]
        }
    };
    if arguments.json {
        output::print_json(&wanted)?;
        return Ok(ExitCode::SUCCESS);
    }
    let texts: Vec<String> = wanted.into_iter().map(text).collect();
    output::print(&texts.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn text(entry: &Entry) -> String {
    let mut text = format!(
        "{}\n  {}\n",
        output::bold(&format!("{}{}", builtin::PREFIX, entry.name)),
        entry.summary
    );
    if entry.parameters.is_empty() {
        return text;
    }
    let mut table = Table::new(&["  parameter", "default", "allowed", "meaning"], &[1, 2, 3]);
    for parameter in entry.parameters {
        table.row([
            format!("  {}", parameter.name),
            parameter.default.to_owned(),
            parameter.range.to_string(),
            parameter.meaning.to_owned(),
        ]);
    }
    text += &table.text();
    text
}
