//! One test binary; one file per subject.

mod bad_input;
mod cells;
mod chi2;
mod command_line;
mod determinism;
mod experiment_file;
mod harness;
mod integrals;
mod intersection;
mod lights;
mod metrics;
mod moments;
mod report;
mod sampling;
mod scene_reader;
mod spherical;
mod stats;
mod support;
mod warps;
