//! One test binary; one file per subject.

mod agreement;
mod bad_input;
mod cameras;
mod cells;
mod chi2;
mod claims;
mod closed_form;
mod command_line;
mod determinism;
mod effects;
mod emitters;
mod experiment_file;
mod explain;
mod golden;
#[cfg(feature = "vulkan")]
mod gpu;
#[cfg(feature = "vulkan")]
mod gpu_functions;
mod harness;
mod integrals;
mod intersection;
mod lights;
#[cfg(feature = "vulkan")]
mod materials;
mod metrics;
mod microfacets;
mod moments;
mod pictures;
mod planted;
mod reliefs;
mod report;
mod sampling;
mod scene_reader;
mod serialized;
mod spherical;
mod statistics;
mod stats;
mod support;
mod texture_reader;
mod textures;
mod warps;
mod waves;
