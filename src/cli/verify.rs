use super::print;
use super::run::Settings;
use crate::claim::baseline;
use crate::error::{Error, Place, Result};
use crate::record::{ClaimResult, Record, Verdict, write_atomically};
use crate::report;
use std::path::{Path, PathBuf};

/// Runs experiments and judges their claims; the exit code says how that went: 0 all supported, 1 a claim is refuted, 3 none
/// refuted but one inconclusive.
#[derive(clap::Args)]
pub struct Verify {
    #[command(flatten)]
    settings: Settings,
    /// Judge also whether variance, cost and mean are those of an earlier run, kept in this folder (--save-baseline, or a
    /// former --out).
    #[arg(long, value_name = "DIR")]
    baseline: Option<PathBuf>,
    /// How much variance and seconds per sample may grow over the baseline; means may move by a tenth of it.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.1, requires = "baseline")]
    tolerance: f64,
    /// Keep the records in this folder for later comparison.
    #[arg(long, value_name = "DIR")]
    save_baseline: Option<PathBuf>,
    /// Print Markdown, for the summary page of a CI job.
    #[arg(long)]
    markdown: bool,
}

impl Verify {
    pub(super) fn execute(self) -> Result<()> {
        self.settings.use_threads()?;
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(Error::Usage(format!("--tolerance {}: a positive number is allowed", self.tolerance)));
        }
        let (mut verdicts, mut failed) = (Vec::new(), None);
        for path in &self.settings.experiments {
            match self.verify(path) {
                Ok(record) => {
                    print(&report::verdicts(&record, self.markdown))?;
                    verdicts.extend(record.claims.iter().map(|c| c.verdict));
                }
                Err(e @ Error::Interrupted) => return Err(e),
                // The other experiments are still worth a verdict.
                Err(e) => match failed {
                    None => failed = Some(e),
                    Some(_) => eprintln!("rootn: {e}"),
                },
            }
        }
        let count = |v: Verdict| verdicts.iter().filter(|&&x| x == v).count();
        let (supported, refuted, inconclusive) =
            (count(Verdict::Supported), count(Verdict::Refuted), count(Verdict::Inconclusive));
        print(&format!(
            "{} verdict{}: {supported} supported, {refuted} refuted, {inconclusive} inconclusive\n",
            verdicts.len(),
            if verdicts.len() == 1 { "" } else { "s" }
        ))?;
        match failed {
            Some(e) => Err(e),
            None if refuted > 0 => Err(Error::Refuted(refuted)),
            None if inconclusive > 0 => Err(Error::Inconclusive(inconclusive)),
            None => Ok(()),
        }
    }

    fn verify(&self, path: &Path) -> Result<Record> {
        let (mut record, folder) = self.settings.measure(path)?;
        let compared = self.baseline.as_ref().map(|dir| self.compare(path, &record, dir)).transpose();
        if let Ok(Some(verdicts)) = &compared {
            record.claims.extend_from_slice(verdicts);
            record.save(&folder)?;
        }
        self.settings.report(&record, &folder)?;
        write_atomically(&folder.join("junit.xml"), report::junit(&record).as_bytes())?;
        // A baseline that does not fit takes nothing from what was measured.
        compared?;
        if let Some(dir) = &self.save_baseline {
            record.save(&dir.join(&record.name))?;
        }
        Ok(record)
    }

    fn compare(&self, path: &Path, record: &Record, dir: &Path) -> Result<Vec<ClaimResult>> {
        let folder = dir.join(&record.name);
        let before = Record::load(&folder)?;
        baseline::compare(record, &before, self.tolerance).map_err(|why| {
            let message = format!("the baseline {} cannot be compared: {why}", folder.join("record.json").display());
            Error::input(Place::file(path), message)
        })
    }
}
