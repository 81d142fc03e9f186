//! Random numbers as pure functions of a sample's identity, the sequences that arrange them, and the strategies that use them.

pub mod dimension;
pub mod discrete;
pub mod heuristic;
pub mod rng;
pub mod sequence;
pub mod strategy;

pub use dimension::Decision;
pub use rng::{Key, Role};
pub use sequence::{Draw, Sequence};
pub use strategy::Strategy;
