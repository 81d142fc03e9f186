use super::print;
use crate::error::Result;
use crate::record::Record;
use crate::report;
use std::path::PathBuf;

/// Writes tables, plots and pages of a finished run again, from its record.
#[derive(clap::Args)]
pub struct Report {
    /// Folder that holds record.json.
    folder: PathBuf,
}

impl Report {
    pub(super) fn execute(self) -> Result<()> {
        let record = Record::load(&self.folder)?;
        report::write(&record, &self.folder)?;
        print(&report::console(&record))
    }
}
