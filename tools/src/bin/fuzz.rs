//! `fuzz`: damaged files through every reader of the engine, and accepted ones through a step of a render; `tools/fuzz` calls it.
//!
//! Exit codes: 0 nothing broke, 1 something did, or the run failed, 2 the command line is wrong.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use clerestory::{Error, Result};
use clerestory_tools::fuzzing::campaign::{self, Campaign, Limits};
use clerestory_tools::fuzzing::readers::READERS;
use clerestory_tools::fuzzing::totals::{Kind, Totals, Way};
use clerestory_tools::fuzzing::worker::{self, Task};
use clerestory_tools::fuzzing::{FOLDER, readers};

/// Damaged files through every reader of the engine
#[derive(Debug, Parser)]
#[command(name = "fuzz")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs for some time, and adds to the totals of earlier runs
    Run(Run),
    /// Reads the files of one folder, as a finding or a kept case has them
    Case(OfCase),
    /// Reads all files that once broke something
    Kept(Place),
    /// Lists the readers
    List,
    #[command(hide = true)]
    Worker(Worker),
}

#[derive(Debug, Args)]
struct Place {
    /// Folder of totals and findings
    #[arg(long, default_value = FOLDER)]
    folder: PathBuf,
}

#[derive(Debug, Args)]
struct Run {
    #[command(flatten)]
    place: Place,
    /// About how long, without the time in which findings are made small
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    minutes: f64,
    /// The seed of all files; one folder has the totals of one seed
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Ends when each reader has had so many files in all runs together
    #[arg(long, value_name = "N")]
    inputs: Option<u32>,
    /// Only this reader, one of those that `list` names; may be given several times
    #[arg(long = "reader", value_name = "NAME", value_parser = reader_name)]
    readers: Vec<String>,
    /// Reads alone: no device is opened
    #[arg(long)]
    no_steps: bool,
}

#[derive(Debug, Args)]
struct OfCase {
    /// Folder with the files, `main…` first
    case: PathBuf,
    /// The reader, one of those that `list` names
    #[arg(long, value_name = "NAME", value_parser = reader_name)]
    reader: String,
    /// Also one step of a render
    #[arg(long)]
    step: bool,
    /// Seconds that it may take
    #[arg(long, default_value_t = Limits::READ.seconds, value_parser = positive)]
    seconds: f64,
    #[command(flatten)]
    place: Place,
}

#[derive(Debug, Args)]
struct Worker {
    #[arg(long)]
    reader: String,
    #[arg(long)]
    seed: u32,
    #[arg(long)]
    from: u32,
    #[arg(long)]
    to: u32,
    #[arg(long)]
    memory: u64,
    #[arg(long)]
    seconds: f64,
    #[arg(long)]
    folder: PathBuf,
    #[arg(long)]
    case: Option<PathBuf>,
    #[arg(long)]
    steps: bool,
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("is not a number above 0".into()),
    }
}

fn reader_name(text: &str) -> std::result::Result<String, String> {
    let reader = readers::by_name(text).map_err(|error| error.to_string())?;
    Ok(reader.name.to_owned())
}

/// A campaign of all readers that reads alone, until something else is said.
fn campaign(folder: PathBuf) -> Result<Campaign> {
    let program = std::env::current_exe().map_err(|error| Error::io("fuzz", error))?;
    Ok(Campaign {
        program,
        folder,
        seed: 1,
        seconds: 0.0,
        inputs: None,
        readers: Vec::new(),
        steps: false,
        limits: Limits::READ,
    })
}

/// Whether nothing broke.
fn run(command: Command) -> Result<bool> {
    match command {
        Command::Run(arguments) => {
            let campaign = Campaign {
                seed: arguments.seed,
                seconds: 60.0 * arguments.minutes,
                inputs: arguments.inputs,
                readers: campaign::readers(&arguments.readers)?,
                steps: !arguments.no_steps,
                ..campaign(arguments.place.folder)?
            };
            let before = Totals::read(&campaign.folder)?.unwrap_or_default();
            let totals = campaign.run(&|words| eprintln!("{words}"))?;
            print(&totals);
            Ok(totals.found() == before.found())
        }
        Command::Case(arguments) => {
            let reader = readers::by_name(&arguments.reader)?;
            let standard = if arguments.step { Limits::STEP } else { Limits::READ };
            let limits = Limits {
                seconds: arguments.seconds,
                ..standard
            };
            let found = campaign(arguments.place.folder)?.alone_in(reader, &arguments.case, arguments.step, &limits)?;
            match &found {
                Some(found) => println!("{}: {}", found.kind.word(), found.words),
                None => println!("breaks nothing"),
            }
            Ok(found.is_none())
        }
        Command::Kept(place) => {
            let broken = campaign(place.folder)?.kept()?;
            for (folder, found) in &broken {
                println!("{}: {}: {}", folder.display(), found.kind.word(), found.words);
            }
            Ok(broken.is_empty())
        }
        Command::List => {
            for reader in READERS {
                println!("{}", reader.name);
            }
            Ok(true)
        }
        Command::Worker(arguments) => {
            let Worker {
                reader,
                seed,
                from,
                to,
                memory,
                seconds,
                folder,
                case,
                steps,
            } = arguments;
            worker::run(&Task {
                reader,
                seed,
                from,
                to,
                steps,
                memory,
                seconds,
                folder,
                case,
            })?;
            Ok(true)
        }
    }
}

fn print(totals: &Totals) {
    let line = |name: &str, way: &Way| {
        let found = [Kind::Panic, Kind::Abort, Kind::Memory, Kind::Time].map(|kind| way.found(kind).to_string());
        println!(
            "{name:<24} {:>9} {:>9} {:>9.0} {:>9.0} {:>9.2} {:>9}",
            way.inputs,
            way.accepted,
            way.inputs as f64 / way.seconds.max(1e-9),
            way.peak as f64 / f64::from(1 << 20),
            way.slowest,
            found.join("/")
        );
    };
    println!(
        "{:<24} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "reader", "files", "accepted", "files/s", "peak MiB", "slowest s", "panics/aborts/memory/time"
    );
    for (name, reader) in &totals.readers {
        if reader.read.inputs > 0 {
            line(name, &reader.read);
        }
        if reader.step.inputs > 0 {
            line(&format!("{name}, a step"), &reader.step);
        }
    }
    let [inputs, stepped] = totals.inputs();
    println!(
        "{inputs} files in {} runs, {stepped} accepted ones through a step, {} broke something",
        totals.runs,
        totals.found()
    );
}

fn main() -> ExitCode {
    match run(Arguments::parse().command) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
