//! Emitters.

use super::super::picture;
use super::{Builder, Node};
use crate::error::{Error, Place, Result};
use crate::math::{Rgb, Vec3};
use crate::scene::light::Beam;
use crate::scene::{EnvironmentMap, Light};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// All kinds.
pub(super) const LIGHTS: &str = "area, constant, directional, envmap, point, spot";

/// Relative deviation from equal lengths and right angles that counts as rounding.
const AXIS_TOLERANCE: f64 = 1e-3;

impl Builder {
    /// A light that is not part of a shape.
    pub(super) fn light(&mut self, index: usize) -> Result<()> {
        let (light, quiet): (_, &[&str]) = match self.tree.nodes[index].plugin.as_str() {
            "constant" => (Light::Constant { radiance: self.emission(index, "radiance")? }, &["to_world"]),
            "spot" => (self.spot(index)?, &[]),
            "directional" => (self.directional(index)?, &[]),
            "envmap" => (self.environment_map(index)?, &["mis_compensation"]),
            _ => (self.point(index)?, &[]),
        };
        self.scene.lights.push(light);
        self.finish(index, &[quiet, &["sampling_weight"]].concat());
        Ok(())
    }

    /// Adds the light of the shape that comes next.
    pub(super) fn area_light(&mut self, index: usize) -> Result<u32> {
        let radiance = self.emission(index, "radiance")?;
        self.finish(index, &["sampling_weight"]);
        self.scene.lights.push(Light::Area { shape: self.scene.shapes.len() as u32, radiance });
        Ok(self.scene.lights.len() as u32 - 1)
    }

    fn point(&mut self, index: usize) -> Result<Light> {
        let node = &self.tree.nodes[index];
        let position = match (node.vector("position")?, node.transform("to_world")?) {
            (Some(_), Some(_)) => return Err(node.error("found both `position` and `to_world`; give one")),
            (Some(position), None) => position,
            (None, to_world) => to_world.unwrap_or_default().transform_point3(DVec3::ZERO),
        };
        let position = position_of(node, position)?;
        Ok(Light::Point { position, intensity: self.emission(index, "intensity")? })
    }

    /// At the origin, along z.
    fn spot(&mut self, index: usize) -> Result<Light> {
        let node = &self.tree.nodes[index];
        let textured = node.children.iter().any(|c| c.name.as_deref() == Some("texture"));
        if textured || node.properties.iter().any(|p| p.name == "texture") {
            return Err(node.error("`texture` is not supported: only spot lights without a projected image are"));
        }
        let to_world = node.transform("to_world")?.unwrap_or_default();
        let axes = orthonormal(&to_world);
        let [_, _, axis] = axes.ok_or_else(|| node.error("to_world stretches or skews the cone"))?;
        let cutoff = node.float("cutoff_angle")?.unwrap_or(20.0);
        let width = node.float("beam_width")?.unwrap_or(0.75 * cutoff);
        if !(cutoff > 0.0 && cutoff <= 180.0) {
            return Err(node.error(format!("cutoff_angle is {cutoff}; it must be above 0 and at most 180 degrees")));
        }
        if !(0.0..=cutoff).contains(&width) {
            return Err(node.error(format!("beam_width is {width}; allowed: 0 to cutoff_angle ({cutoff} degrees)")));
        }
        let cutoff_radians = cutoff.to_radians() as f32;
        if cutoff_radians == 0.0 {
            return Err(node.error(format!("cutoff_angle {cutoff} is 0 in 32-bit numbers")));
        }
        let beam = Beam { axis: axis.as_vec3(), cutoff: cutoff_radians, width: width.to_radians() as f32 };
        let position = position_of(node, to_world.translation)?;
        Ok(Light::Spot { position, intensity: self.emission(index, "intensity")?, beam })
    }

    /// `direction` is where the light goes; without it, the image of z.
    fn directional(&mut self, index: usize) -> Result<Light> {
        let node = &self.tree.nodes[index];
        let along = match (node.vector("direction")?, node.transform("to_world")?) {
            (Some(_), Some(_)) => return Err(node.error("found both `direction` and `to_world`; give one")),
            (Some(direction), None) => direction,
            (None, to_world) => to_world.unwrap_or_default().transform_vector3(DVec3::Z),
        };
        let direction = along.try_normalize().ok_or_else(|| node.error("the direction has no length"))?;
        let irradiance = self.emission(index, "irradiance")?;
        Ok(Light::Directional { direction: direction.as_vec3(), irradiance })
    }

    /// A picture in latitude and longitude. Negative texels, which filters leave behind, count as 0.
    fn environment_map(&mut self, index: usize) -> Result<Light> {
        self.only_colours(index, &[])?;
        let node = &self.tree.nodes[index];
        let to_world = node.transform("to_world")?.unwrap_or_default();
        let axes = orthonormal(&to_world).ok_or_else(|| node.error("to_world stretches or skews directions"))?;
        let scale = node.float("scale")?.unwrap_or(1.0);
        if !(scale >= 0.0 && scale <= f64::from(f32::MAX)) {
            return Err(node.error(format!("scale is {scale}; it must be at least 0")));
        }
        let name = node.string("filename")?.ok_or_else(|| node.error("lacks the property `filename`"))?;
        let (path, place) = (self.tree.find_file(&name, &node.place)?, node.place.clone());
        let picture = picture::load(&path, &place)?;
        self.tree.add_source(&path);
        let (mut texels, width) = (picture.texels, picture.width);
        let mut negative = 0;
        for (i, texel) in texels.iter_mut().enumerate() {
            negative += usize::from(texel.min_element() < 0.0);
            let scaled = texel.max(Rgb::ZERO) * scale as f32;
            if !(texel.is_finite() && scaled.is_finite()) {
                let (x, y) = (i as u32 % width, i as u32 / width);
                let message = format!("texel ({x}, {y}) is {texel}; radiance must be finite (wanted by {place})");
                return Err(Error::input(Place::file(&path), message));
            }
            *texel = scaled;
        }
        if negative > 0 {
            self.warn(&place, &format!("{negative} texels of `{}` are negative; taken as 0", path.display()));
        }
        let map = EnvironmentMap::new(width, texels, axes.map(|a| a.as_vec3()));
        let map = map.map_err(|message| Error::input(Place::file(&path), format!("{message} (wanted by {place})")))?;
        self.scene.environment_map = Some(Arc::new(map));
        Ok(Light::EnvironmentMap)
    }
}

/// A position in 32-bit numbers.
fn position_of(node: &Node, position: DVec3) -> Result<Vec3> {
    let single = position.as_vec3();
    if single.is_finite() {
        return Ok(single);
    }
    Err(node.error(format!("position {position} is out of the range of 32-bit numbers")))
}

/// Images of the axes under a rotation, perhaps with reflections and a uniform scale; `None` if it is none.
fn orthonormal(to_world: &DAffine3) -> Option<[DVec3; 3]> {
    let DMat3 { x_axis, y_axis, z_axis } = to_world.matrix3;
    let scale = z_axis.length();
    let even = |v: DVec3| (v.length() / scale - 1.0).abs() <= AXIS_TOLERANCE;
    let upright = |a: DVec3, b: DVec3| a.dot(b).abs() <= AXIS_TOLERANCE * scale * scale;
    let fine =
        even(x_axis) && even(y_axis) && upright(x_axis, y_axis) && upright(y_axis, z_axis) && upright(z_axis, x_axis);
    // What rounding left is taken off.
    let z = z_axis.try_normalize().filter(|_| fine)?;
    let x = (x_axis - z * z.dot(x_axis)).try_normalize()?;
    let y = (y_axis - z * z.dot(y_axis) - x * x.dot(y_axis)).try_normalize()?;
    Some([x, y, z])
}
