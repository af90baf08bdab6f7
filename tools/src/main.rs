//! The command line program of the Clerestory rendering engine.

mod commands;
mod failure;
mod options;
mod output;
mod pictures;
mod statistics;
mod stop;

use std::process::ExitCode;

fn main() -> ExitCode {
    commands::main()
}
