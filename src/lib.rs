//! rootn: how fast does a Monte Carlo estimator converge, is it right, and what does accuracy cost in time?
pub mod accel;
pub mod analysis;
pub mod claim;
pub mod error;
pub mod estimator;
pub mod math;
pub mod moments;
pub mod record;
pub mod run;
pub mod sampling;
pub mod scene;
pub mod stats;

pub use error::{Error, Result};
