//! One test binary; one file per subject.

mod chi2;
mod lights;
mod sampling;
mod support;
mod warps;
