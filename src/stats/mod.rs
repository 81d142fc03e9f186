//! Intervals and tests; metrics with their definitions.

pub mod bootstrap;
pub mod interval;
pub mod metric;
pub mod multiple;
pub(crate) mod number;
pub mod power;
pub mod sequential;
pub mod tail;
pub mod test;

pub use interval::{jackknife, mean_interval, student_t};
pub use metric::Metric;
