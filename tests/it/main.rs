//! One test binary; one file per subject.

mod intersection;
mod support;
