use super::print;
use super::run::Settings;
use crate::analysis::calibration::checks;
use crate::error::{Error, Place, Result};
use crate::{report, run};
use std::path::Path;

/// Repeats experiments that have a [calibration] with fresh random numbers, and counts how often verdicts, intervals and
/// forecasts are right. The exit code is 1 where a promise is broken.
#[derive(clap::Args)]
pub struct Calibrate {
    #[command(flatten)]
    settings: Settings,
}

impl Calibrate {
    pub(super) fn execute(self) -> Result<()> {
        self.settings.use_threads()?;
        let mut broken = 0;
        for path in &self.settings.experiments {
            broken += self.calibrate(path)?;
        }
        match broken {
            0 => Ok(()),
            broken => Err(Error::Broken(broken)),
        }
    }

    /// Number of promises broken.
    fn calibrate(&self, path: &Path) -> Result<usize> {
        let (experiment, plan) = self.settings.plan(path)?;
        let Some(calibration) = experiment.calibration else {
            let message = "no [calibration]; `repetitions` there says how often the experiment is repeated";
            return Err(Error::input(Place::file(path), message));
        };
        let done = run::calibrate(&plan, calibration.repetitions, &self.settings.options()).inspect_err(|e| {
            if matches!(e, Error::Interrupted) {
                eprintln!("rootn: of a calibration only references are kept");
            }
        })?;
        let checks = checks(&done);
        if checks.is_empty() {
            let message = "nothing to be counted: no [[claim]], and no forecasts of `targets` with 200 trials or more";
            return Err(Error::input(Place::file(path), message));
        }
        report::write_calibration(&done, &checks, &self.settings.out)?;
        print(&report::calibration_table(&done, &checks))?;
        Ok(checks.iter().filter(|c| !c.kept).count())
    }
}
