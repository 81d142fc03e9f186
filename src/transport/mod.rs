//! Light transport: techniques, and the sinks that their contributions go to.

pub mod heckbert;
pub mod path;
mod shading;
pub mod sink;
mod wave;

pub use path::PathTracer;
pub use sink::{Contribution, NoSink, Sink, Vertex, Via};
pub use wave::WAVE;
