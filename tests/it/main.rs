//! One test binary; one file per subject.

mod bad_input;
mod scene_reader;
mod support;
