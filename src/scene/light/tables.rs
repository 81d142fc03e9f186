//! The lights as GPUs draw them: the sampler's tables as plain memory, in the layout of `shaders/scene/scene.glsl`.

use super::area::Emitter;
use super::choice::{Kind, LightSampler};
use bytemuck::{Pod, Zeroable};

/// One outcome of the choice; fields that a kind has no use for are 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LightEntry {
    radiance: [f32; 3],
    kind: u32,
    a: [f32; 3],
    density: f32,
    u: [f32; 3],
    start: u32,
    v: [f32; 3],
    radius: f32,
    w: [f32; 3],
    flip: u32,
    n: [f32; 3],
    rectangular: u32,
    first_drawn: u32,
    drawn: u32,
    first_density: u32,
    triangles: u32,
}

/// All tables of a [`LightSampler`].
#[derive(Clone, Debug, Default)]
pub struct LightTables {
    /// Outcomes of the choice.
    pub entries: Vec<LightEntry>,
    /// Smallest word of each outcome.
    pub choice: Vec<u32>,
    /// Outcome of each shape; `u32::MAX` = none.
    pub of_shape: Vec<u32>,
    /// Meshes: the scene's index of each triangle that has an area …
    pub drawn_triangles: Vec<u32>,
    /// … and the smallest word of its choice.
    pub drawn_first: Vec<u32>,
    /// Meshes: of each triangle its probability, and that over its area.
    pub densities: Vec<[f32; 2]>,
    /// Density of any direction to a constant environment, sr⁻¹; probability of the choice of an environment map.
    pub environment_pdf: f32,
    /// Bit per kind of light that occurs.
    pub kinds: u32,
}

impl LightSampler {
    /// The tables for a GPU.
    pub fn tables(&self) -> LightTables {
        let mut tables = LightTables {
            choice: self.choice.thresholds().to_vec(),
            of_shape: self.of_shape.clone(),
            environment_pdf: self.environment_pdf,
            ..LightTables::default()
        };
        for entry in &self.entries {
            let mut e = LightEntry { radiance: entry.radiance.into(), ..LightEntry::zeroed() };
            match &entry.kind {
                Kind::Environment => e.kind = 0,
                Kind::Point(position) => (e.kind, e.a) = (1, (*position).into()),
                Kind::Spot(position, beam) => {
                    (e.kind, e.a, e.w) = (7, (*position).into(), beam.axis.into());
                    (e.radius, e.density) = (beam.cutoff, beam.width);
                }
                Kind::Directional(wi) => (e.kind, e.w) = (8, (*wi).into()),
                Kind::EnvironmentMap(_) => e.kind = 9,
                Kind::Area(emitter) => tables.add_emitter(&mut e, emitter),
            }
            tables.kinds |= 1 << e.kind;
            tables.entries.push(e);
        }
        tables
    }
}

impl LightTables {
    fn add_emitter(&mut self, e: &mut LightEntry, emitter: &Emitter) {
        match emitter {
            Emitter::Parallelogram(p) => {
                (e.kind, e.start, e.density) = (2, p.patch.start, p.patch.density.0);
                (e.a, e.u, e.v) = (p.patch.corner.into(), p.patch.u.into(), p.patch.v.into());
                (e.w, e.n) = (p.patch.ng.into(), p.normal.into());
                e.rectangular = u32::from(p.sides.is_some());
            }
            Emitter::Mesh(m) => {
                (e.kind, e.start) = (3, m.start);
                (e.first_drawn, e.drawn) = (self.drawn_triangles.len() as u32, m.triangles.len() as u32);
                (e.first_density, e.triangles) = (self.densities.len() as u32, m.densities.len() as u32);
                self.drawn_triangles.extend(&m.triangles);
                self.drawn_first.extend(m.choice.thresholds());
                self.densities.extend(m.densities.iter().map(|d| [d.0.0, d.1.0]));
            }
            Emitter::Sphere { center, radius, flip } => {
                (e.kind, e.a, e.radius, e.flip) = (4, (*center).into(), *radius, u32::from(*flip));
                e.density = super::area::sphere_density(*radius).0;
            }
            Emitter::Disk { center, u, v, ng, density } => {
                (e.kind, e.a, e.u, e.v) = (5, (*center).into(), (*u).into(), (*v).into());
                (e.w, e.density) = ((*ng).into(), density.0);
            }
            Emitter::Cylinder { p0, axis, frame, radius, flip, density } => {
                (e.kind, e.a, e.u, e.radius) = (6, (*p0).into(), (*axis).into(), *radius);
                (e.v, e.w) = (frame.s.into(), frame.t.into());
                (e.flip, e.density) = (u32::from(*flip), density.0);
            }
        }
    }
}
