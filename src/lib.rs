//! rootn: how fast does a Monte Carlo estimator converge, is it right, and what does accuracy cost in time?
pub mod accel;
pub mod error;
pub mod math;
pub mod record;
pub mod report;
pub mod sampling;
pub mod scene;

pub use error::{Error, Result};
