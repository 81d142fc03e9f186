//! One test binary; one file per subject.

mod agreement;
mod chi2;
mod closed_form;
mod intersection;
mod lights;
mod report;
mod sampling;
mod support;
mod warps;
