//! One test binary; one file per subject.

mod agreement;
mod chi2;
mod intersection;
mod lights;
mod report;
mod sampling;
mod support;
mod warps;
