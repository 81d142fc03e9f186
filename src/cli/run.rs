use super::{print, use_threads};
use crate::error::{Error, Result};
use crate::estimator::choice::{DeviceRequest, Traversal};
use crate::run::Options;
use crate::{experiment, report};
use std::path::PathBuf;

/// Runs an experiment and writes its report.
#[derive(clap::Args)]
pub struct Run {
    /// Experiment files (TOML).
    #[arg(required = true)]
    experiments: Vec<PathBuf>,
    /// Folder for results: DIR/<experiment>/ and DIR/cells/.
    #[arg(long, value_name = "DIR", default_value = "reports")]
    out: PathBuf,
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
    /// Print the record as JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// No progress and no notes on stderr.
    #[arg(long)]
    quiet: bool,
}

impl Run {
    pub(super) fn execute(self) -> Result<()> {
        use_threads(self.threads)?;
        for path in &self.experiments {
            let (parsed, text) = experiment::load::load(path, &self.overrides)?;
            let plan = experiment::plan::plan(&parsed, path, text, &self.device, self.traversal)?;
            if !self.quiet {
                plan.devices.iter().for_each(|d| eprintln!("device: {}, because {}", d.name, d.reason));
            }
            let options = Options { out: self.out.clone(), fresh: self.fresh, quiet: self.quiet };
            let (record, reuse) = crate::run::run(&plan, &options).inspect_err(|e| {
                if matches!(e, Error::Device { .. }) {
                    eprintln!("rootn: everything computed so far is kept, the same command continues");
                }
            })?;
            let folder = self.out.join(&record.name);
            report::write(&record, &folder)?;
            if self.json {
                print(&(serde_json::to_string_pretty(&record).expect("plain data") + "\n"))?;
            } else {
                print(&report::console(&record))?;
            }
            if !self.quiet {
                eprintln!("{} checkpoints computed, {} reused", reuse.computed, reuse.reused);
                eprintln!("report: {}", folder.join("report.html").display());
            }
        }
        Ok(())
    }
}
