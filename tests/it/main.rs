//! One test binary; one file per subject.

mod chi2;
mod lights;
mod sampling;
mod spherical;
mod support;
mod warps;
