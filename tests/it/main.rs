//! One test binary; one file per subject.

mod report;
mod support;
