//! The commands, one file each. stdout = data, stderr = progress and messages.

mod calibrate;
mod completions;
#[cfg(feature = "vulkan")]
mod devices;
mod explain;
mod render;
mod replay;
mod report;
mod run;
mod schema;
mod verify;

use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::sampling::strategy::Technique;

/// A command of `rootn`.
#[derive(clap::Subcommand)]
pub enum Command {
    /// Run an experiment and write its report.
    Run(run::Run),
    /// Run experiments and judge their claims.
    Verify(verify::Verify),
    /// Repeat experiments whose truth is known and count how often verdicts, intervals and forecasts are right.
    Calibrate(calibrate::Calibrate),
    /// Render one image with its statistics.
    Render(render::Render),
    /// Say what scenes call for, what is left out, what they hold and what they cost.
    Explain(explain::Explain),
    /// Write the report of a finished run again.
    Report(report::Report),
    /// Trace one sample again and print its path vertex by vertex.
    Replay(replay::Replay),
    /// List the GPUs that can render, and which one would be taken.
    #[cfg(feature = "vulkan")]
    Devices(devices::Devices),
    /// Print the JSON schema of experiment files.
    Schema(schema::Schema),
    /// Print shell completions.
    Completions(completions::Completions),
}

impl Command {
    /// Executes the command.
    pub fn execute(self) -> Result<()> {
        // The first Ctrl-C asks for a checkpoint; a second one ends the process at once.
        let mut asked = false;
        let handler = ctrlc::set_handler(move || {
            if asked {
                std::process::exit(130);
            }
            asked = true;
            eprintln!("\nstopping at the next checkpoint (press Ctrl-C again to stop at once)");
            crate::estimator::interrupt();
        });
        handler.map_err(|e| Error::Usage(format!("cannot listen for Ctrl-C: {e}")))?;
        match self {
            Self::Run(c) => c.execute(),
            Self::Verify(c) => c.execute(),
            Self::Calibrate(c) => c.execute(),
            Self::Render(c) => c.execute(),
            Self::Explain(c) => c.execute(),
            Self::Report(c) => c.execute(),
            Self::Replay(c) => c.execute(),
            #[cfg(feature = "vulkan")]
            Self::Devices(c) => c.execute(),
            Self::Schema(c) => c.execute(),
            Self::Completions(c) => c.execute(),
        }
    }
}

/// What is traced, and by which code: flags that `render`, `replay`, `run` and `verify` share.
#[derive(clap::Args)]
struct Transport {
    /// Trace only this transport, whatever else says: direct = emission and light scattered once.
    #[arg(long, value_enum, value_name = "TRANSPORT")]
    only: Option<Technique>,
    /// Leave out nothing that scenes do not call for: the same samples, for measuring what leaving out saves.
    #[arg(long)]
    all_effects: bool,
}

impl Transport {
    /// Has the experiment run like that.
    fn apply(&self, experiment: &mut Experiment) {
        (experiment.only, experiment.all_effects) = (self.only, self.all_effects);
    }
}

/// Limits the worker threads of the whole process.
fn use_threads(threads: Option<usize>) -> Result<()> {
    let Some(n) = threads else { return Ok(()) };
    if !(1..=1024).contains(&n) {
        return Err(Error::Usage(format!("--threads {n}: 1 to 1024 are allowed")));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build_global();
    pool.map_err(|e| Error::Usage(format!("--threads {n}: {e}")))
}

/// Parses `name=value`.
fn parameter(text: &str) -> std::result::Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// Prints to stdout; a closed pipe (`rootn … | head`) ends the output, not the program.
fn print(text: &str) -> Result<()> {
    use std::io::Write;
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
    }
}
