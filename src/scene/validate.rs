//! The checks that make a scene safe to trace: every index in range, every number finite and in its range.

use super::format::picture::LARGEST_SIDE;
use super::texture::Bitmap;
use super::{Camera, Geometry, Light, Material, Projection, Scene, Texture, Triangle};
use crate::math::{Rgb, Vec3};

/// Problems listed before the rest is only counted.
const MOST_PROBLEMS: usize = 20;

impl Scene {
    /// Checks everything that renderers rely on. Call it for scenes that were not made by a reader.
    ///
    /// # Errors
    /// One sentence per problem, at most 20 and then their number.
    pub fn validate(&self) -> Result<(), Vec<String>> {
        let mut problems = Problems::default();
        self.check_counts(&mut problems);
        self.check_film(&mut problems);
        self.check_vertices(&mut problems);
        self.check_triangles(&mut problems);
        self.check_shapes(&mut problems);
        self.check_materials(&mut problems);
        self.check_textures(&mut problems);
        self.check_lights(&mut problems);
        problems.finish()
    }

    /// The corners of a triangle, world space.
    pub fn corners(&self, triangle: &Triangle) -> [Vec3; 3] {
        triangle.vertices.map(|i| self.positions[i as usize])
    }

    /// Number of triangles without area: allowed, but they are never hit.
    pub fn zero_area_triangles(&self) -> usize {
        let flat = |t: &&Triangle| {
            let [a, b, c] = self.corners(t).map(|p| p.as_dvec3());
            (b - a).cross(c - a) == glam::DVec3::ZERO
        };
        self.triangles.iter().filter(flat).count()
    }

    fn check_counts(&self, problems: &mut Problems) {
        if self.shapes.is_empty() && self.lights.is_empty() {
            problems.add("the scene is empty: no shape and no light".into());
        }
        let largest = i32::MAX as usize;
        let counts = [
            (self.triangles.len(), "triangles"),
            (self.positions.len(), "vertices"),
            (self.shapes.len(), "shapes"),
            (self.materials.len(), "materials"),
            (self.lights.len(), "lights"),
            (self.textures.len(), "textures"),
            (self.texels.len(), "texels"),
            (self.attributes.len(), "mesh attributes"),
        ];
        for (count, what) in counts {
            problems.unless(count <= largest, || format!("{count} {what}; at most {largest} fit"));
        }
        let (positions, normals, uvs) = (self.positions.len(), self.normals.len(), self.uvs.len());
        problems
            .unless(uvs == 0 || positions == uvs, || format!("{positions} positions, but {uvs} texture coordinates"));
        problems.unless(positions == normals, || format!("{positions} positions, but {normals} normals"));
        let black = self.materials.first() == Some(&Material::BLACK);
        problems.unless(black, || "material 0 is not black".into());
    }

    fn check_film(&self, problems: &mut Problems) {
        let film = &self.film;
        let inside = (0..2).all(|k| {
            let end = film.crop_offset[k].checked_add(film.crop_size[k]);
            film.crop_size[k] > 0 && end.is_some_and(|e| e <= film.size[k])
        });
        problems.unless(inside, || format!("the crop window is empty or leaves the film: {film:?}"));
        if let Some(problem) = camera_problem(&self.camera) {
            problems.add(problem);
        }
    }

    fn check_vertices(&self, problems: &mut Problems) {
        for (i, p) in self.positions.iter().enumerate() {
            problems.unless(p.is_finite(), || format!("vertex {i} is not finite: {p}"));
        }
        for (i, uv) in self.uvs.iter().enumerate() {
            problems.unless(uv.is_finite(), || format!("texture coordinate {i} is not finite: {uv}"));
        }
        for (i, n) in self.normals.iter().enumerate() {
            problems.unless(*n == Vec3::ZERO || n.is_normalized(), || format!("normal {i} is not of unit length: {n}"));
        }
    }

    fn check_triangles(&self, problems: &mut Problems) {
        for (i, t) in self.triangles.iter().enumerate() {
            let in_range = t.vertices.iter().all(|&v| (v as usize) < self.positions.len());
            problems.unless(in_range, || format!("triangle {i} names a vertex that is not there: {:?}", t.vertices));
            problems.unless((t.shape as usize) < self.shapes.len(), || format!("triangle {i} names shape {}", t.shape));
        }
    }

    fn check_shapes(&self, problems: &mut Problems) {
        let mut next = 0;
        for (i, shape) in self.shapes.iter().enumerate() {
            let name = &shape.name;
            for side in [shape.front, shape.back] {
                let there = (side as usize) < self.materials.len();
                problems.unless(there, || format!("shape `{name}` names material {side}"));
            }
            if let Some(light) = shape.light {
                let back = self.lights.get(light as usize);
                let mutual = matches!(back, Some(Light::Area { shape, .. }) if *shape as usize == i);
                problems.unless(mutual, || format!("shape `{name}` names light {light}, which is not its own"));
            }
            if let Geometry::Mesh { range, .. } | Geometry::Rectangle { range, .. } = &shape.geometry {
                let own = self.triangles.get(range.start as usize..range.end as usize);
                let own = own.is_some_and(|t| t.iter().all(|t| t.shape as usize == i)) && range.start == next;
                problems.unless(own, || format!("shape `{name}` has the triangles {range:?}, which are not its own"));
                next = range.end;
            }
            problems.unless(is_sound(&shape.geometry), || {
                format!("shape `{name}` is not finite or has no extent: {:?}", shape.geometry)
            });
        }
        let count = self.triangles.len();
        problems.unless(next as usize == count, || format!("{count} triangles, of which shapes name {next}"));
    }

    fn check_materials(&self, problems: &mut Problems) {
        for (i, material) in self.materials.iter().enumerate() {
            material.problems(i as u32, self).into_iter().for_each(|p| problems.add(p));
        }
    }

    fn check_textures(&self, problems: &mut Problems) {
        for (i, texture) in self.textures.iter().enumerate() {
            let (first, count, all) = match *texture {
                Texture::Bitmap(Bitmap { first, size: [width, height], .. }) => {
                    let sizes = 1..=LARGEST_SIDE;
                    let allowed = sizes.contains(&width) && sizes.contains(&height);
                    problems.unless(allowed, || format!("texture {i} has {width} × {height} texels"));
                    (first, width as usize * height as usize, &self.texels)
                }
                Texture::Checkerboard { first, .. } => (first, 2, &self.texels),
                Texture::VertexAttribute { first, .. } => (first, self.positions.len(), &self.attributes),
                Texture::FaceAttribute { first, .. } => (first, self.triangles.len(), &self.attributes),
            };
            let there = first as usize + count <= all.len();
            problems
                .unless(there, || format!("texture {i} has {count} colours from {first} on; there are {}", all.len()));
        }
        let finite = self.texels.iter().chain(&self.attributes).all(|c| c.is_finite());
        problems.unless(finite, || "a colour of a texture is not finite".into());
    }

    fn check_lights(&self, problems: &mut Problems) {
        let valid = |c: &Rgb| c.is_finite() && c.min_element() >= 0.0;
        let mut environments = 0;
        for (i, light) in self.lights.iter().enumerate() {
            match light {
                Light::Area { shape, radiance } => {
                    let mutual = self.shapes.get(*shape as usize).is_some_and(|s| s.light == Some(i as u32));
                    problems.unless(mutual, || format!("light {i} names shape {shape}, which does not name it"));
                    problems.unless(valid(radiance), || format!("light {i}: radiance {radiance}"));
                }
                Light::Point { position, intensity } => {
                    problems.unless(position.is_finite(), || format!("light {i} is not finite: {position}"));
                    problems.unless(valid(intensity), || format!("light {i}: intensity {intensity}"));
                }
                Light::Spot { position, intensity, beam } => {
                    let turned = beam.axis.is_normalized() && beam.cutoff > 0.0 && beam.cutoff <= std::f32::consts::PI;
                    let sound = position.is_finite() && turned && (0.0..=beam.cutoff).contains(&beam.width);
                    problems.unless(sound, || format!("light {i} is no spot: at {position}, {beam:?}"));
                    problems.unless(valid(intensity), || format!("light {i}: intensity {intensity}"));
                }
                Light::Directional { direction, irradiance } => {
                    problems.unless(direction.is_normalized(), || format!("light {i}: direction {direction}"));
                    problems.unless(valid(irradiance), || format!("light {i}: irradiance {irradiance}"));
                }
                Light::EnvironmentMap => {
                    environments += 1;
                    problems.unless(self.environment_map.is_some(), || {
                        format!("light {i}: the environment map is missing")
                    });
                }
                Light::Constant { radiance } => {
                    environments += 1;
                    problems.unless(valid(radiance), || format!("light {i}: radiance {radiance}"));
                }
            }
        }
        let shines = self.lights.contains(&Light::EnvironmentMap);
        problems.unless(shines || self.environment_map.is_none(), || "no light is the environment map".into());
        problems.unless(environments <= 1, || format!("{environments} environments; at most one is allowed"));
    }
}

/// What is wrong with a camera.
pub(super) fn camera_problem(camera: &Camera) -> Option<String> {
    let Camera { origin, corner, across, down, near, far, projection } = *camera;
    // What the film must not be parallel to, and further vectors.
    let (axis, [u, v], focus) = match projection {
        Projection::Pinhole => (corner, [Vec3::ZERO; 2], 0.0),
        Projection::ThinLens { radii, inverse_focus } => (corner, radii, inverse_focus),
        Projection::Orthographic { direction } => (direction, [Vec3::ZERO; 2], 0.0),
    };
    if ![origin, corner, across, down, axis, u, v].iter().all(|v| v.is_finite()) {
        Some(format!("the camera is not finite in 32-bit numbers: {camera:?}"))
    } else if across.as_dvec3().cross(down.as_dvec3()).dot(axis.as_dvec3()) == 0.0 {
        Some(format!("the camera's film has no extent, or is seen edge-on: {camera:?}"))
    } else if !(near >= 0.0 && near < far) {
        Some(format!("near is {near} and far is {far}; 0 ≤ near < far is wanted"))
    } else if !(focus >= 0.0 && focus.is_finite()) {
        Some(format!("one over the focus distance is {focus}; it must be finite and at least 0"))
    } else {
        None
    }
}

/// Whether a surface is finite and has the extent that its kind needs.
pub(super) fn is_sound(geometry: &Geometry) -> bool {
    let finite = |v: &[Vec3]| v.iter().all(|v| v.is_finite());
    let positive = |r: f32| r.is_finite() && r > 0.0;
    match *geometry {
        Geometry::Mesh { ref range, .. } => !range.is_empty(),
        Geometry::Rectangle { ref range, corner, edge_u, edge_v } => {
            range.len() == 2 && finite(&[corner, edge_u, edge_v]) && spans(edge_u, edge_v)
        }
        Geometry::Sphere { center, radius, .. } => center.is_finite() && positive(radius),
        Geometry::Disk { center, u, v } => finite(&[center, u, v]) && spans(u, v),
        Geometry::Cylinder { p0, axis, radius, .. } => finite(&[p0, axis]) && axis != Vec3::ZERO && positive(radius),
    }
}

/// Whether two edges span an area.
fn spans(u: Vec3, v: Vec3) -> bool {
    u.as_dvec3().cross(v.as_dvec3()) != glam::DVec3::ZERO
}

#[derive(Default)]
struct Problems {
    list: Vec<String>,
    more: usize,
}

impl Problems {
    fn unless(&mut self, fine: bool, problem: impl FnOnce() -> String) {
        if !fine {
            self.add(problem());
        }
    }

    fn add(&mut self, problem: String) {
        if self.list.len() < MOST_PROBLEMS { self.list.push(problem) } else { self.more += 1 }
    }

    fn finish(mut self) -> Result<(), Vec<String>> {
        if self.more > 0 {
            self.list.push(format!("and {} more", self.more));
        }
        if self.list.is_empty() { Ok(()) } else { Err(self.list) }
    }
}
