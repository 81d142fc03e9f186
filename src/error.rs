//! The one error type: where, what was found, what is allowed.

use std::fmt;
use std::path::{Path, PathBuf};

/// Result with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// A position in an input file. `line` and `column` count from 1; 0 = unknown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// File as the user named it.
    pub file: PathBuf,
    /// Line, from 1; 0 = not known (binary data: see the message for a byte offset).
    pub line: u32,
    /// Column, from 1; 0 = not known.
    pub column: u32,
}

impl Place {
    /// The file as a whole.
    pub fn file(file: impl AsRef<Path>) -> Self {
        Self { file: file.as_ref().to_owned(), line: 0, column: 0 }
    }

    /// A line of a file, counted from 1.
    pub fn line(file: impl AsRef<Path>, line: u32) -> Self {
        Self { file: file.as_ref().to_owned(), line, column: 0 }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
            if self.column > 0 {
                write!(f, ":{}", self.column)?;
            }
        }
        Ok(())
    }
}

/// Everything that can go wrong for a reason outside this program.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Input that can be read but not accepted (scene, mesh, experiment, command line). Exit code 2.
    #[error("{place}: {message}")]
    Input {
        /// Where.
        place: Place,
        /// What was found and what is allowed.
        message: String,
    },
    /// A request that makes no sense as given (command line, strategy, estimator). Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Something asked for that is not there on this machine or in this build. Exit code 2.
    #[error("{what} is unavailable, because {reason}")]
    Unavailable {
        /// What was asked for.
        what: String,
        /// Why it cannot be had.
        reason: String,
    },
    /// Reading or writing failed. Exit code 4.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// One of our own files (cell, record, image) is damaged or not ours. Exit code 4.
    #[error("{}: {message}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found and what was expected.
        message: String,
    },
    /// A device failed while it computed. Exit code 4.
    #[error("{device}: {message}")]
    Device {
        /// The device.
        device: String,
        /// What happened.
        message: String,
    },
    /// Claims were refuted. Exit code 1.
    #[error("{0} refuted")]
    Refuted(usize),
    /// Promises of the tool were broken. Exit code 1.
    #[error("{0} promises broken")]
    Broken(usize),
    /// No claim was refuted, but some could not be decided. Exit code 3.
    #[error("none refuted, but {0} inconclusive")]
    Inconclusive(usize),
    /// Stopped by the user after a checkpoint was written. Exit code 130.
    #[error("interrupted; everything computed so far is kept, the same command continues")]
    Interrupted,
}

impl Error {
    /// An input error at a place.
    pub fn input(place: Place, message: impl Into<String>) -> Self {
        Self::Input { place, message: message.into() }
    }

    /// An input/output error on a path.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_owned(), source }
    }

    /// A damaged file of ours.
    pub fn damaged(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Damaged { path: path.as_ref().to_owned(), message: message.into() }
    }

    /// Something asked for that cannot be had, and why.
    pub fn unavailable(what: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Unavailable { what: what.into(), reason: reason.into() }
    }

    /// The process exit code that stands for this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } | Self::Usage(_) | Self::Unavailable { .. } => 2,
            Self::Io { .. } | Self::Damaged { .. } | Self::Device { .. } => 4,
            Self::Refuted(_) | Self::Broken(_) => 1,
            Self::Inconclusive(_) => 3,
            Self::Interrupted => 130,
        }
    }
}

/// The candidate most like `found`, for "did you mean": smallest edit distance, at most a third of its length.
pub fn suggestion<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|c| (edit_distance(found, c), c))
        .filter(|&(d, c)| d <= c.len().max(found.len()).div_ceil(3))
        .min_by_key(|&(d, _)| d)
        .map(|(_, c)| c)
}

/// What to add to a message about an unknown name: the candidate most like it, or nothing.
pub(crate) fn did_you_mean<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    suggestion(found, candidates).map_or(String::new(), |s| format!("; did you mean `{s}`?"))
}

/// Levenshtein distance in bytes, upper and lower case being the same.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let next = (diagonal + usize::from(!x.eq_ignore_ascii_case(y))).min(row[j] + 1).min(row[j + 1] + 1);
            diagonal = std::mem::replace(&mut row[j + 1], next);
        }
    }
    row[b.len()]
}
