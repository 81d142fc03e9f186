use super::{Command, print};
use crate::error::Result;
use clap::Subcommand;

/// Prints completions for a shell.
#[derive(clap::Args)]
pub struct Completions {
    /// The shell.
    shell: clap_complete::Shell,
}

impl Completions {
    pub(super) fn execute(self) -> Result<()> {
        let mut command = Command::augment_subcommands(clap::Command::new("rootn"));
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut command, "rootn", &mut text);
        print(&String::from_utf8_lossy(&text))
    }
}
