//! BSDFs and colours.

use super::super::spectrum::{Role, Spectrum};
use super::value::Value;
use super::{Builder, Node};
use crate::error::{Error, Place, Result};
use crate::math::Rgb;
use crate::scene::Material;
use glam::DVec3;

impl Builder {
    /// Materials of front and back that a BSDF stands for.
    pub(super) fn surface(&mut self, index: usize) -> Result<[u32; 2]> {
        if let Some(&known) = self.surfaces.get(&index) {
            return Ok(known);
        }
        let node = &self.tree.nodes[index];
        let surface = match node.plugin.as_str() {
            "diffuse" => [self.diffuse(index)?, 0],
            "twosided" => {
                let nested = node.children.iter().map(|c| self.tree.resolve(c)).collect::<Result<Vec<_>>>()?;
                if nested.is_empty() || nested.len() > 2 || nested.iter().any(|&i| self.tree.nodes[i].tag != "bsdf") {
                    return Err(node.error("needs one or two BSDFs inside, and nothing else"));
                }
                let mut sides = [0; 2];
                for (k, side) in sides.iter_mut().enumerate() {
                    let inner = nested[k.min(nested.len() - 1)];
                    if self.tree.nodes[inner].plugin != "diffuse" {
                        let inner = &self.tree.nodes[inner];
                        return Err(inner.unsupported(&inner.plugin, "diffuse (inside twosided)"));
                    }
                    *side = self.surface(inner)?[0];
                }
                self.finish(index, &[]);
                sides
            }
            other => return Err(node.unsupported(other, "diffuse, twosided")),
        };
        self.surfaces.insert(index, surface);
        Ok(surface)
    }

    fn diffuse(&mut self, index: usize) -> Result<u32> {
        let reflectance = self.reflectance(index)?;
        self.finish(index, &[]);
        Ok(self.add_material(Material::Diffuse { reflectance }))
    }

    /// The material of shapes that name none: Mitsuba's diffuse with reflectance 0.5, black on emitters.
    pub(super) fn default_surface(&mut self, emits: bool) -> [u32; 2] {
        if emits {
            return [0, 0];
        }
        let index = match self.default_surface {
            Some(index) => index,
            None => self.add_material(Material::Diffuse { reflectance: Rgb::splat(0.5) }),
        };
        self.default_surface = Some(index);
        [index, 0]
    }

    fn add_material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// The reflectance of a diffuse BSDF.
    fn reflectance(&mut self, index: usize) -> Result<Rgb> {
        let color = self.color(&self.tree.nodes[index], "reflectance")?;
        let Some((value, place)) = color else { return Ok(Rgb::splat(0.5)) };
        let rgb = to_rgb(&value, Role::Reflectance);
        let sound =
            matches!(&value, Value::Spectrum(Spectrum::List(l)) if l.iter().all(|p| (0.0..=1.0).contains(&p.1)));
        self.in_gamut(rgb, rgb.clamp(Rgb::ZERO, Rgb::ONE), sound, place, "reflectance", "in [0, 1]")
    }

    /// The radiance or intensity of an emitter; Mitsuba's default is 1.
    pub(super) fn emission(&mut self, index: usize, name: &str) -> Result<Rgb> {
        let color = self.color(&self.tree.nodes[index], name)?;
        let Some((value, place)) = color else { return Ok(Rgb::ONE) };
        let rgb = to_rgb(&value, Role::Emission);
        let sound = match &value {
            Value::Spectrum(Spectrum::List(list)) => list.iter().all(|p| p.1 >= 0.0),
            Value::Spectrum(Spectrum::Blackbody { .. }) => true,
            _ => false,
        };
        self.in_gamut(rgb, rgb.clamp(Rgb::ZERO, Rgb::MAX), sound, place, name, "finite and at least 0")
    }

    /// Values as they are, if they are in their range. RGB cannot show every spectrum that is: such colours are taken
    /// as the nearest ones in range, as Mitsuba does, with a warning.
    fn in_gamut(&mut self, rgb: Rgb, bounded: Rgb, sound: bool, place: Place, name: &str, range: &str) -> Result<Rgb> {
        if rgb == bounded {
            return Ok(rgb);
        }
        if !sound || !rgb.is_finite() {
            return Err(Error::input(place, format!("{name} {rgb}; each channel must be {range}")));
        }
        self.scene
            .warnings
            .push(format!("{place}: the spectrum is out of the gamut of RGB, {rgb}; taken as {bounded}"));
        Ok(bounded)
    }

    /// A colour property: a value, or an object inside that is named so.
    fn color(&self, node: &Node, name: &str) -> Result<Option<(Value, Place)>> {
        if let Some(property) = node.properties.iter().find(|p| p.name == name) {
            let is_color = |v: &Value| match v {
                Value::Float(_) | Value::Rgb(_) | Value::Spectrum(_) => Some(v.clone()),
                Value::Integer(i) => Some(Value::Float(*i as f64)),
                _ => None,
            };
            return Ok(node.get(name, "rgb, spectrum or float", is_color)?.map(|v| (v, property.place.clone())));
        }
        let mut color = None;
        for child in &node.children {
            let inner = &self.tree.nodes[self.tree.resolve(child)?];
            if child.name.as_deref() != Some(name) {
                return Err(inner.error(format!("has no place in {}", node.title())));
            }
            color = Some((self.spectrum_plugin(inner)?, inner.place.clone()));
        }
        Ok(color)
    }

    /// `<spectrum type=…>`.
    fn spectrum_plugin(&self, node: &Node) -> Result<Value> {
        let allowed = "a colour: rgb, float, spectrum, or spectrum of type uniform, d65, blackbody";
        match (node.tag.as_str(), node.plugin.as_str()) {
            ("spectrum", "uniform") => Ok(Value::Float(node.float("value")?.unwrap_or(1.0))),
            ("spectrum", "d65") => Ok(Value::Float(node.float("scale")?.unwrap_or(1.0))),
            ("spectrum", "blackbody") => {
                let temperature = node.float("temperature")?;
                let temperature = temperature.filter(|&t| t > 0.0);
                let temperature = temperature.ok_or_else(|| node.error("needs a `temperature` above 0 (kelvin)"))?;
                let range = [node.float("wavelength_min")?, node.float("wavelength_max")?];
                let range = [range[0].unwrap_or(f64::NEG_INFINITY), range[1].unwrap_or(f64::INFINITY)];
                Ok(Value::Spectrum(Spectrum::Blackbody { temperature, range }))
            }
            (_, other) => Err(node.unsupported(other, allowed)),
        }
    }
}

fn to_rgb(value: &Value, role: Role) -> Rgb {
    match value {
        Value::Float(v) => DVec3::splat(*v).as_vec3(),
        Value::Rgb(v) => v.as_vec3(),
        Value::Spectrum(spectrum) => spectrum.to_rgb(role),
        // `color` lets nothing else through.
        _ => Rgb::NAN,
    }
}
