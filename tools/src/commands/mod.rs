//! The command line: one file per command.

mod agreement;
mod bench;
mod compare;
mod index;
mod index_peers;
mod info;
mod list;
mod maps;
mod metal;
mod progress;
mod render;
mod report;
mod scenes;
mod sort_rates;
mod stability;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use clerestory::gpu::ValidationLog;
use tracing_subscriber::EnvFilter;

use crate::failure::{Code, Failure, Outcome};
use crate::options::Global;

/// Renders scenes on Vulkan and says how long each picture took and how wrong it is.
#[derive(Debug, Parser)]
#[command(name = "clerestory", version, max_term_width = 100, after_help = AFTER_HELP)]
struct Program {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  clerestory render                     the Cornell box: out/cornell-box.exr, .png and .json
  clerestory render model.glb --spp 256 --size 1280x720
  clerestory info                       devices, and what each technique needs of them
  clerestory scenes                     generated scenes and their parameters
  clerestory compare picture.exr reference.exr --threshold rmse=1e-3
  clerestory maps sky.hdr sky.exr --to octahedron --size 512
  clerestory metal gold                 its reflectance, and the errors of cheaper forms
  clerestory report --smoke             error against time, in its smallest form

Each command explains itself: clerestory render --help

Compiled pipelines are kept in $XDG_CACHE_HOME/clerestory, else $HOME/.cache/clerestory. A file there is trusted as the driver is: what is \
damaged is made anew, but let nobody else write there.

Exit codes:
  0    done
  1    the run failed: device lost, out of memory, a picture that cannot be read, a file that cannot be written (a picture is then
       kept in the system's folder for temporary files, which the error names)
  2    the command line or a setting asks for the impossible; pictures to compare have different sizes; an output is a file that the
       command reads or, without --overwrite, one that this program did not write
  3    the scene is missing or cannot be read, or the technique cannot render it
  4    pictures differ beyond a --threshold, or renderers beyond their noise; a hard case fails
  5    no Vulkan device, or none that can do it
  130  stopped by Ctrl-C or a request to end, after writing what was there";

#[derive(Debug, Subcommand)]
enum Command {
    Render(Box<render::Arguments>),
    Info(info::Arguments),
    Compare(compare::Arguments),
    Scenes(scenes::Arguments),
    Index(index::Arguments),
    List(list::Arguments),
    Maps(maps::Arguments),
    Metal(metal::Arguments),
    Bench(bench::Arguments),
    Report(report::Arguments),
    Agreement(agreement::Arguments),
    Stability(stability::Arguments),
}

/// Reads the command line, runs the command, reports its failure.
pub fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|fault| {
        let place = fault.location().map(|place| format!(" at {place}")).unwrap_or_default();
        let payload = fault.payload();
        let text = payload.downcast_ref::<&str>().copied();
        let cause = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let cause = cause.unwrap_or("unknown cause");
        Failure {
            code: Code::Run,
            message: format!("fault in the program{place}: {cause}"),
            hint: Some("this is a bug; please report it with the command line".into()),
        }
        .report();
    }));
    std::panic::catch_unwind(start).unwrap_or(Code::Run.into())
}

fn start() -> ExitCode {
    let program = match Program::try_parse() {
        Ok(program) => program,
        Err(error) => {
            // Neither help and version nor a reader that has gone are failures.
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    listen(program.global.verbose);
    match run(&program) {
        Ok(code) => code,
        Err(failure) => {
            failure.report();
            failure.code.into()
        }
    }
}

fn run(program: &Program) -> Outcome<ExitCode> {
    match &program.command {
        Command::Render(arguments) => render::run(arguments),
        Command::Info(arguments) => info::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Scenes(arguments) => scenes::run(arguments),
        Command::Index(arguments) => index::run(arguments),
        Command::List(arguments) => list::run(arguments),
        Command::Maps(arguments) => maps::run(arguments),
        Command::Metal(arguments) => metal::run(arguments),
        Command::Bench(arguments) => bench::run(arguments),
        Command::Report(arguments) => report::run(arguments),
        Command::Agreement(arguments) => agreement::run(arguments),
        Command::Stability(arguments) => stability::run(arguments),
    }
}

/// Sends the engine's log to the error output: warnings, or as much as `-v` or `RUST_LOG` ask for.
fn listen(verbose: u8) {
    let filter = match verbose {
        0 => EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn")),
        1 => EnvFilter::new("info"),
        2 => EnvFilter::new("debug"),
        _ => EnvFilter::new("trace"),
    };
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time()
        .init();
}

/// Errors of the validation layers, which the log has shown, fail the run. Best called after the device is gone.
fn check_validation(log: &ValidationLog) -> Outcome {
    match log.take().iter().filter(|message| message.error).count() {
        0 => Ok(()),
        count => Err(Failure {
            code: Code::Run,
            message: format!("the validation layers found {count} errors"),
            hint: None,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What rows of the catalogue tell readers to type.
    #[test]
    fn command_lines_of_the_catalogue_are_understood() {
        let mut seen = 0;
        for row in clerestory::catalogue::all() {
            let lines = row.settings.iter().chain([&row.experiment]);
            for line in lines.filter(|line| line.starts_with("clerestory ")) {
                let fault = Program::try_parse_from(line.split_whitespace()).err();
                assert!(fault.is_none(), "{}: {line}: {fault:?}", row.id);
                seen += 1;
            }
        }
        assert!(seen > 20, "{seen}");
    }
}
