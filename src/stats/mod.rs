//! Intervals and tests; metrics with their definitions.

pub mod interval;
pub mod metric;
pub(crate) mod number;

pub use interval::{jackknife, mean_interval, student_t};
pub use metric::Metric;
