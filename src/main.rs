//! The `rootn` command.

use clap::Parser;
use rootn::cli::Command;
use std::process::ExitCode;

/// How fast does a Monte Carlo estimator converge, is it right, and what does accuracy cost in time?
#[derive(Parser)]
#[command(name = "rootn", version, arg_required_else_help = true, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match Arguments::parse().command.execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("rootn: {e}");
            ExitCode::from(e.exit_code())
        }
    }
}
