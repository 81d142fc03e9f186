//! Where transport hands its vertices and contributions to. The path tracer adds contributions up itself; a sink sees
//! each one with its tag, for replay, filters and decomposition. [`NoSink`] compiles away.

use crate::math::{Rgb, Vec3};
use serde::Serialize;
use std::fmt;

/// How a contribution was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Via {
    /// The path met an emitter or left the scene towards the environment.
    Emission,
    /// A light was sampled.
    LightSampling,
}

/// A surface vertex of a path.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Vertex {
    /// Edges from the camera.
    pub depth: u32,
    /// Position, world space.
    pub position: Vec3,
    /// Geometric normal, unit length.
    pub normal: Vec3,
    /// Index into [`crate::scene::Scene::shapes`].
    pub shape: u32,
    /// Throughput on arrival.
    pub beta: Rgb,
}

/// The direction drawn at a vertex.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bounce {
    /// Edges from the camera to the vertex.
    pub depth: u32,
    /// Unit direction, world space.
    pub direction: Vec3,
    /// Density over solid angle, sr⁻¹.
    pub pdf: f32,
    /// Probability of going on (Russian roulette).
    pub survival: f32,
    /// Throughput after the bounce.
    pub beta: Rgb,
}

/// Light that a path carries to the camera.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Contribution {
    /// Edges of the whole path.
    pub depth: u32,
    /// How it was found.
    pub via: Via,
    /// Index into [`crate::scene::Scene::lights`]; `None` for the environment.
    pub light: Option<u32>,
    /// Density of direction sampling for the last direction, sr⁻¹; 0 where it cannot find the light.
    pub pdf_direction: f32,
    /// Density of light sampling for it, choice of the light included, sr⁻¹ (a probability for lights without extent); 0 where it cannot.
    pub pdf_light: f32,
    /// Multiple importance sampling weight.
    pub weight: f32,
    /// What is added to the pixel's sample.
    pub value: Rgb,
}

/// Receives what a path tracer finds, in the order of the path.
pub trait Sink {
    /// A surface was met.
    fn vertex(&mut self, _: &Vertex) {}
    /// A direction was drawn there.
    fn bounce(&mut self, _: &Bounce) {}
    /// Light was found.
    fn contribution(&mut self, _: &Contribution) {}
}

/// Ignores everything, at no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSink;

impl Sink for NoSink {}

/// Any sink: one copy of the path tracer serves where speed does not count.
pub(super) struct AnySink<'a>(pub(super) &'a mut dyn Sink);

impl Sink for AnySink<'_> {
    fn vertex(&mut self, v: &Vertex) {
        self.0.vertex(v);
    }
    fn bounce(&mut self, b: &Bounce) {
        self.0.bounce(b);
    }
    fn contribution(&mut self, c: &Contribution) {
        self.0.contribution(c);
    }
}

/// Something that happened along a path.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// See [`Vertex`].
    Vertex(Vertex),
    /// See [`Bounce`].
    Bounce(Bounce),
    /// See [`Contribution`].
    Contribution(Contribution),
}

/// Keeps everything, for replay.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    /// In the order of the path.
    pub events: Vec<Event>,
}

impl Sink for Recorder {
    fn vertex(&mut self, v: &Vertex) {
        self.events.push(Event::Vertex(*v));
    }
    fn bounce(&mut self, b: &Bounce) {
        self.events.push(Event::Bounce(*b));
    }
    fn contribution(&mut self, c: &Contribution) {
        self.events.push(Event::Contribution(*c));
    }
}

/// Three numbers of a vector or colour.
struct Triple(Vec3);

impl fmt::Display for Triple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({:.6}, {:.6}, {:.6})", self.0.x, self.0.y, self.0.z)
    }
}

impl fmt::Display for Recorder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for event in &self.events {
            match event {
                Event::Vertex(v) => writeln!(
                    f,
                    "vertex {}: position {}, normal {}, shape {}, throughput {}",
                    v.depth,
                    Triple(v.position),
                    Triple(v.normal),
                    v.shape,
                    Triple(v.beta)
                )?,
                Event::Bounce(b) => writeln!(
                    f,
                    "  bounce: direction {}, pdf {:.6} 1/sr, survival {:.3}, throughput {}",
                    Triple(b.direction),
                    b.pdf,
                    b.survival,
                    Triple(b.beta)
                )?,
                Event::Contribution(c) => writeln!(
                    f,
                    "  {} at depth {}: light {}, pdf of direction {:.6}, of light {:.6}, weight {:.6}, adds {}",
                    match c.via {
                        Via::Emission => "emission",
                        Via::LightSampling => "light sampling",
                    },
                    c.depth,
                    c.light.map_or("environment".into(), |l| l.to_string()),
                    c.pdf_direction,
                    c.pdf_light,
                    c.weight,
                    Triple(c.value)
                )?,
            }
        }
        Ok(())
    }
}
