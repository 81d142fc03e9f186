use super::print;
use crate::error::Result;

/// Prints the JSON schema (draft 07) of experiment files.
#[derive(clap::Args)]
pub struct Schema {}

impl Schema {
    pub(super) fn execute(self) -> Result<()> {
        print(&crate::experiment::schema())
    }
}
