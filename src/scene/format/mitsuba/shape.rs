//! Shapes, and the area lights on them.

use super::super::mesh::{Mesh, Placement};
use super::super::{obj, ply, read, serialized};
use super::{Builder, Node, value};
use crate::error::Result;
use crate::math::{Vec2, Vec3};
use crate::scene::validate::is_sound;
use crate::scene::{Geometry, Shape, Triangle};
use glam::{DAffine3, DMat3, DVec3};
use std::ops::Range;

const SHAPES: &str = "rectangle, cube, sphere, disk, cylinder, obj, ply, serialized, shapegroup, instance";

/// Copies of shapes may be many.
const MOST_SHAPES: usize = 1 << 24;

/// Relative deviation that counts as rounding where a transform must keep circles round.
const ROUND_TOLERANCE: f64 = 1e-4;

/// Where an instance places the shapes of its group.
#[derive(Clone, Copy)]
pub(super) struct Instance {
    to_world: DAffine3,
    /// The node of the instance; `None`: the shape stands by itself.
    node: Option<usize>,
}

impl Builder {
    pub(super) fn shape(&mut self, index: usize) -> Result<()> {
        let node = &self.tree.nodes[index];
        match node.plugin.as_str() {
            "instance" => self.instance(index),
            // Seen only where there are instances of it.
            "shapegroup" => self.group(index).map(drop),
            _ => self.placed(index, Instance { to_world: DAffine3::IDENTITY, node: None }),
        }
    }

    /// Copies of a group's shapes: simple, at the price of memory.
    fn instance(&mut self, index: usize) -> Result<()> {
        let node = &self.tree.nodes[index];
        let mut inside = node.children.iter().map(|c| self.tree.resolve(c));
        let group = match (inside.next().transpose()?, inside.next()) {
            (Some(group), None) if self.tree.nodes[group].plugin == "shapegroup" => group,
            _ => return Err(node.error("needs one shape `shapegroup` inside, and nothing else")),
        };
        let to_world = node.transform("to_world")?.unwrap_or_default();
        for shape in self.group(group)? {
            if self.scene.shapes.len() >= MOST_SHAPES {
                return Err(self.tree.nodes[index].error(format!("instances make more than {MOST_SHAPES} shapes")));
            }
            self.placed(shape, Instance { to_world, node: Some(index) })?;
        }
        self.finish(index, &[]);
        Ok(())
    }

    /// The shapes of a group.
    fn group(&mut self, index: usize) -> Result<Vec<usize>> {
        let node = &self.tree.nodes[index];
        let mut shapes = Vec::new();
        for child in &node.children {
            let shape = self.tree.resolve(child)?;
            let found = &self.tree.nodes[shape];
            if found.tag != "shape" || matches!(found.plugin.as_str(), "instance" | "shapegroup") {
                return Err(found.error("has no place in a shapegroup; allowed: shapes, but no instances and groups"));
            }
            shapes.push(shape);
        }
        self.finish(index, &[]);
        Ok(shapes)
    }

    fn placed(&mut self, index: usize, instance: Instance) -> Result<()> {
        let node = &self.tree.nodes[index];
        let own = node.transform("to_world")?.unwrap_or_default();
        // An instance keeps the front where its shape has it.
        let mirrored = instance.to_world.matrix3.determinant() < 0.0;
        let place = Placement {
            to_world: instance.to_world * own,
            face_normals: node.boolean("face_normals")?.unwrap_or(false),
            flip_normals: node.boolean("flip_normals")?.unwrap_or(false),
            flip_tex_coords: match node.plugin.as_str() {
                plugin @ ("obj" | "ply") => node.boolean("flip_tex_coords")?.unwrap_or(plugin == "obj"),
                _ => false,
            },
        };
        let determinant = place.to_world.matrix3.determinant();
        if determinant == 0.0 || !place.to_world.inverse().is_finite() {
            return Err(node.error("to_world is singular: it flattens the shape"));
        }
        let flat = |geometry| (geometry, DMat3::IDENTITY);
        let mut attributes = Vec::new();
        let (geometry, axes) = match node.plugin.as_str() {
            "rectangle" => flat(self.rectangle(&place)),
            "disk" => disk(&place),
            "sphere" => sphere(node, &place, own.matrix3.determinant() < 0.0)?,
            "cylinder" => cylinder(node, &place)?,
            "cube" => flat(self.mesh(index, cube(), Placement { face_normals: true, ..place }, determinant < 0.0)?),
            "obj" | "ply" | "serialized" => {
                let mesh = self.mesh_file(index, instance.node.is_some())?;
                attributes.extend(mesh.attributes.iter().map(|a| a.name.clone()));
                // Elsewhere the normals say where the front is.
                let turn = mirrored && (place.face_normals || mesh.normals.is_empty());
                flat(self.mesh(index, mesh, place, turn)?)
            }
            other => return Err(node.unsupported(other, SHAPES)),
        };
        if !is_sound(&geometry) {
            let message = format!("is not finite or has no extent in 32-bit numbers: {geometry:?}");
            return Err(self.tree.nodes[index].error(message));
        }
        let (surface, emitter) = self.attachments(index)?;
        if let (Some(_), Some(emitter)) = (instance.node, emitter) {
            return Err(self.tree.nodes[emitter].error("shapes inside a shapegroup cannot emit"));
        }
        if let Some(surface) = surface {
            self.check_attributes(index, surface, &attributes)?;
        }
        let [front, back] = match surface {
            Some(surface) => self.surface(surface)?,
            None => self.default_surface(emitter.is_some()),
        };
        let light = emitter.map(|emitter| self.area_light(emitter)).transpose()?;
        let node = &self.tree.nodes[index];
        let name_of = |node: &Node| node.id.clone().unwrap_or_else(|| format!("{} ({})", node.plugin, node.place));
        let name = match instance.node {
            Some(outer) => format!("{} in {}", name_of(node), name_of(&self.tree.nodes[outer])),
            None => name_of(node),
        };
        self.scene.shapes.push(Shape { geometry, front, back, light, axes: axes.as_mat3(), name });
        self.finish(index, &["silhouette_sampling_weight"]);
        Ok(())
    }

    /// The BSDF and the emitter inside a shape.
    fn attachments(&self, index: usize) -> Result<(Option<usize>, Option<usize>)> {
        let node = &self.tree.nodes[index];
        let (mut surface, mut emitter) = (None, None);
        for child in &node.children {
            let inner = self.tree.resolve(child)?;
            let found = &self.tree.nodes[inner];
            let slot = match (found.tag.as_str(), found.plugin.as_str()) {
                ("bsdf", _) => &mut surface,
                ("emitter", "area") => &mut emitter,
                ("emitter", other) => return Err(found.unsupported(other, "area (inside a shape)")),
                _ => return Err(found.error("not supported in a shape; allowed: a bsdf, an emitter `area`")),
            };
            if slot.replace(inner).is_some() {
                return Err(node.error(format!("has two objects of kind {}", found.tag)));
            }
        }
        Ok((surface, emitter))
    }

    /// `again`: other instances will ask for the same mesh.
    fn mesh_file(&mut self, index: usize, again: bool) -> Result<Mesh> {
        if let Some(known) = self.meshes.get(&index) {
            return Ok(known.clone());
        }
        let node = &self.tree.nodes[index];
        let name = node.string("filename")?.ok_or_else(|| node.error("lacks the property `filename`"))?;
        let path = self.tree.find_file(&name, &node.place)?;
        let bytes = read(&path)?;
        let mesh = match node.plugin.as_str() {
            "obj" => obj::parse(&bytes, &path)?,
            "ply" => ply::parse(&bytes, &path)?,
            _ => {
                let number = node.integer("shape_index")?.unwrap_or(0);
                let number = u32::try_from(number);
                let number = number.map_err(|_| node.error("shape_index must be at least 0 and fit 32 bits"))?;
                serialized::parse(&bytes, number, &path)?
            }
        };
        self.tree.add_source(&path);
        if again {
            self.meshes.insert(index, mesh.clone());
        }
        Ok(mesh)
    }

    /// Adds a mesh in object space. `turn`: its winding is to be turned first.
    fn mesh(&mut self, index: usize, mesh: Mesh, placement: Placement, turn: bool) -> Result<Geometry> {
        let placement = Placement { flip_normals: placement.flip_normals != turn, ..placement };
        let mesh = mesh.place(&placement);
        let node = &self.tree.nodes[index];
        if !mesh.positions.iter().all(|p| p.is_finite()) {
            return Err(node.error("to_world takes vertices out of the range of 32-bit numbers"));
        }
        let fits = |a: usize, b: usize, each: usize| (a + b) * each <= i32::MAX as usize;
        if !fits(self.scene.triangles.len(), mesh.triangles.len(), 3)
            || !fits(self.scene.positions.len(), mesh.positions.len(), 1)
        {
            return Err(
                node.error("the scene, with copies for instances, has more than 2³¹ vertices or indices of them")
            );
        }
        let (smooth, uvs) = (!mesh.normals.is_empty(), !mesh.uvs.is_empty());
        Ok(Geometry::Mesh { range: self.triangles(mesh), smooth, uvs })
    }

    /// Appends vertices and triangles for the shape that comes next.
    fn triangles(&mut self, mesh: Mesh) -> Range<u32> {
        let (first, base) = (self.scene.triangles.len() as u32, self.scene.positions.len() as u32);
        self.keep_attributes(mesh.attributes, base, first);
        let scene = &mut self.scene;
        let shape = scene.shapes.len() as u32;
        scene.positions.extend(mesh.positions);
        scene.normals.extend(mesh.normals);
        scene.normals.resize(scene.positions.len(), Vec3::ZERO);
        scene.uvs.extend(mesh.uvs);
        scene.uvs.resize(scene.positions.len(), Vec2::ZERO);
        scene.triangles.extend(mesh.triangles.iter().map(|t| Triangle { vertices: t.map(|i| i + base), shape }));
        first..scene.triangles.len() as u32
    }

    /// The square [−1, 1]² × {0}, whose front is z > 0.
    fn rectangle(&mut self, place: &Placement) -> Geometry {
        let point = |x, y| place.to_world.transform_point3(DVec3::new(x, y, 0.0));
        let corner = point(-1.0, -1.0);
        let [u, v] = front_edges(place, point(1.0, -1.0) - corner, point(-1.0, 1.0) - corner);
        let positions = [corner, corner + u, corner + u + v, corner + v];
        // As in object space, whichever way round the edges are.
        let inverse = place.to_world.inverse();
        let uvs = positions.map(|p| ((inverse.transform_point3(p).truncate() + 1.0) / 2.0).round().as_vec2()).to_vec();
        let positions = positions.map(|p| p.as_vec3()).to_vec();
        let range = self.triangles(Mesh { positions, uvs, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() });
        Geometry::Rectangle { range, corner: corner.as_vec3(), edge_u: u.as_vec3(), edge_v: v.as_vec3() }
    }
}

/// The unit disk around the origin, whose front is z > 0.
fn disk(place: &Placement) -> (Geometry, DMat3) {
    let axes = place.to_world.matrix3;
    let [u, v] = front_edges(place, axes.x_axis, axes.y_axis);
    let center = place.to_world.translation.as_vec3();
    (Geometry::Disk { center, u: u.as_vec3(), v: v.as_vec3() }, axes)
}

/// The images of the x and y axes, in the order that makes u × v point to the front: along the image of z as a normal.
fn front_edges(place: &Placement, u: DVec3, v: DVec3) -> [DVec3; 2] {
    let normal = place.to_world.matrix3.inverse().transpose() * DVec3::Z;
    if (u.cross(v).dot(normal) < 0.0) != place.flip_normals { [v, u] } else { [u, v] }
}

/// `turned`: its own transform mirrors it, which turns Mitsuba's spheres inside out.
fn sphere(node: &Node, place: &Placement, turned: bool) -> Result<(Geometry, DMat3)> {
    let axes = place.to_world.matrix3;
    let (x, y, z) = (axes.x_axis, axes.y_axis, axes.z_axis);
    if !(is_round(x, y) && is_round(y, z) && is_round(z, x)) {
        return Err(node.error("to_world makes an ellipsoid; only uniform scales are supported"));
    }
    let unit_radius = radius(node)?;
    let radius = (unit_radius * x.length()) as f32;
    let center = place.to_world.transform_point3(node.vector("center")?.unwrap_or_default());
    let flip = turned != place.flip_normals;
    Ok((Geometry::Sphere { center: center.as_vec3(), radius, flip }, axes * unit_radius))
}

fn cylinder(node: &Node, place: &Placement) -> Result<(Geometry, DMat3)> {
    let p0 = node.vector("p0")?.unwrap_or_default();
    let p1 = node.vector("p1")?.unwrap_or(DVec3::Z);
    let along = (p1 - p0).try_normalize().ok_or_else(|| node.error("p0 and p1 coincide"))?;
    let across = value::tangents(along);
    let image = |v| place.to_world.transform_vector3(v);
    let (u, v, axis) = (image(across[0]), image(across[1]), image(p1 - p0));
    let upright = |v: DVec3| v.dot(axis).abs() <= ROUND_TOLERANCE * v.length() * axis.length();
    if !(is_round(u, v) && upright(u) && upright(v)) {
        return Err(node.error("to_world makes the cylinder elliptic or oblique; that is not supported"));
    }
    let p0 = place.to_world.transform_point3(p0).as_vec3();
    // Unlike for spheres, a mirror does not turn Mitsuba's cylinders inside out.
    let (unit_radius, flip) = (radius(node)?, place.flip_normals);
    let radius = (unit_radius * u.length()) as f32;
    let axes = DMat3::from_cols(u * unit_radius, v * unit_radius, axis);
    Ok((Geometry::Cylinder { p0, axis: axis.as_vec3(), radius, flip }, axes))
}

fn radius(node: &Node) -> Result<f64> {
    match node.float("radius")?.unwrap_or(1.0) {
        r if r > 0.0 => Ok(r),
        r => Err(node.error(format!("radius is {r}; it must be above 0"))),
    }
}

/// Whether two images of unit vectors at a right angle span a circle.
fn is_round(a: DVec3, b: DVec3) -> bool {
    let (la, lb) = (a.length(), b.length());
    (la - lb).abs() <= ROUND_TOLERANCE * la && a.dot(b).abs() <= ROUND_TOLERANCE * la * lb
}

/// The cube [−1, 1]³; four vertices per side, front outwards, with Mitsuba's texture coordinates.
fn cube() -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [-1f32, 1.0] {
            let first = mesh.positions.len() as u32;
            for (s, t) in [(-1f32, -1f32), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut p = Vec3::ZERO;
                p[axis] = sign;
                // Along the next axis and the one after it; the lower side runs the other way round.
                p[(axis + 1) % 3] = s * sign;
                p[(axis + 2) % 3] = t;
                mesh.positions.push(p);
                let [x, y, z] = p.to_array();
                let uv = match axis {
                    0 => [y, -sign * z],
                    1 if sign > 0.0 => [-x, -z],
                    1 => [z, x],
                    _ => [sign * y, x],
                };
                mesh.uvs.push((Vec2::from(uv) + 1.0) / 2.0);
            }
            mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|i| i + first)));
        }
    }
    mesh
}
