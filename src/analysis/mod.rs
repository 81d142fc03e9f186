//! Statistics applied to estimates: curves, slopes, efficiency, cost.

pub mod curve;
pub mod efficiency;
pub mod scene;

pub use efficiency::{efficiency_ratio, variance_ratio};
