//! Statistics applied to estimates: curves, slopes, efficiency, cost, health.

pub mod calibration;
pub mod cost;
pub mod curve;
pub mod efficiency;
pub mod health;
pub mod scene;

pub use efficiency::{efficiency_ratio, variance_ratio};
