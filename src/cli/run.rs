use super::{Transport, print, use_threads};
use crate::error::{Error, Result};
use crate::estimator::choice::{DeviceRequest, Traversal};
use crate::experiment::Experiment;
use crate::record::Record;
use crate::run::{Options, Plan};
use crate::{experiment, report};
use std::path::{Path, PathBuf};

/// Runs experiments and writes their reports.
#[derive(clap::Args)]
pub struct Run {
    #[command(flatten)]
    settings: Settings,
    /// Print the record as JSON instead of tables.
    #[arg(long)]
    json: bool,
}

/// What `run` and `verify` share.
#[derive(clap::Args)]
pub(super) struct Settings {
    /// Experiment files (TOML).
    #[arg(required = true)]
    pub(super) experiments: Vec<PathBuf>,
    /// Folder for results: DIR/<experiment>/ and DIR/cells/.
    #[arg(long, value_name = "DIR", default_value = "reports")]
    pub(super) out: PathBuf,
    /// Recompute everything instead of reusing stored samples.
    #[arg(long)]
    fresh: bool,
    /// Change a value of the experiment file, for example budget.spp=512.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Worker threads; default: one per core.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Where to render: auto, cpu, vulkan, vulkan:NAME or vulkan:INDEX (see `rootn devices`).
    #[arg(long, value_name = "DEVICE", default_value_t)]
    device: DeviceRequest,
    /// How rays find what they meet on a Vulkan device.
    #[arg(long, value_enum, default_value_t)]
    traversal: Traversal,
    /// Let scenes read files outside their own folders.
    #[arg(long)]
    allow_outside: bool,
    #[command(flatten)]
    transport: Transport,
    /// No progress and no notes on stderr.
    #[arg(long)]
    quiet: bool,
}

impl Settings {
    /// To be called once, before anything is run.
    pub(super) fn use_threads(&self) -> Result<()> {
        use_threads(self.threads)
    }

    /// Reads an experiment file and plans what it says.
    pub(super) fn plan(&self, path: &Path) -> Result<(Experiment, Plan<'static>)> {
        let (mut parsed, text) = experiment::load::load(path, &self.overrides)?;
        parsed.allow_outside = self.allow_outside;
        self.transport.apply(&mut parsed);
        let plan = experiment::plan::plan(&parsed, path, text, &self.device, self.traversal)?;
        if !self.quiet {
            plan.devices.iter().for_each(|d| eprintln!("device: {}, because {}", d.name, d.reason));
        }
        Ok((parsed, plan))
    }

    /// How to run.
    pub(super) fn options(&self) -> Options {
        Options { out: self.out.clone(), fresh: self.fresh, quiet: self.quiet }
    }

    /// Runs one experiment; its record and images are in the folder then, the report not yet.
    pub(super) fn measure(&self, path: &Path) -> Result<(Record, PathBuf)> {
        let (_, plan) = self.plan(path)?;
        let (record, reuse) = crate::run::run(&plan, &self.options()).inspect_err(|e| {
            if matches!(e, Error::Device { .. }) {
                eprintln!("rootn: everything computed so far is kept, the same command continues");
            }
        })?;
        if !self.quiet {
            eprintln!("{} checkpoints computed, {} reused", reuse.computed, reuse.reused);
        }
        let folder = self.out.join(&record.name);
        Ok((record, folder))
    }

    /// Writes the report of a record into its folder.
    pub(super) fn report(&self, record: &Record, folder: &Path) -> Result<()> {
        report::write(record, folder)?;
        if !self.quiet {
            eprintln!("report: {}", folder.join("report.html").display());
        }
        Ok(())
    }
}

impl Run {
    pub(super) fn execute(self) -> Result<()> {
        self.settings.use_threads()?;
        for path in &self.settings.experiments {
            let (record, folder) = self.settings.measure(path)?;
            self.settings.report(&record, &folder)?;
            match self.json {
                true => print(&(serde_json::to_string_pretty(&record).expect("plain data") + "\n"))?,
                false => print(&report::console(&record))?,
            }
        }
        Ok(())
    }
}
