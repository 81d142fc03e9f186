//! One test binary; one file per subject.

mod bad_input;
mod chi2;
mod intersection;
mod lights;
mod report;
mod sampling;
mod scene_reader;
mod support;
mod warps;
mod waves;
