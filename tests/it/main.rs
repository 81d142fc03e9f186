//! One test binary; one file per subject.

mod chi2;
mod sampling;
mod support;
mod warps;
