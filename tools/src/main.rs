//! The command line program of the Clerestory rendering engine.

mod commands;
mod failure;
mod frame_report;
mod options;
mod output;
mod outputs;
mod pictures;
mod stop;

use std::process::ExitCode;

fn main() -> ExitCode {
    commands::main()
}
