//! BSDFs and colours.

use super::super::shorten;
use super::super::spectrum::{Role, Spectrum};
use super::texture::Use;
use super::value::Value;
use super::{Builder, Node, ior};
use crate::error::{Error, Place, Result, did_you_mean};
use crate::math::Rgb;
use crate::scene::material::{
    Coat, Distribution, LARGEST_INDEX, MIXTURE_DEPTH, Microfacets, ROUGHNESS, Transmittance, depth,
    diffuse_reflectance, diffuse_rough_reflectance,
};
use crate::scene::texture::{Bitmap, Input};
use crate::scene::{Bsdf, Material, Texture};
use glam::DVec3;
use std::ops::RangeInclusive;

const BSDFS: &str = "blendbsdf, bumpmap, conductor, dielectric, diffuse, mask, normalmap, null, plastic, roughconductor, \
                     roughdielectric, roughplastic, thindielectric, twosided";
/// BSDFs inside each other, also by references.
const SURFACE_DEPTH: usize = 50;
/// How Mitsuba samples microfacets has no effect on what is measured.
const QUIET: &[&str] = &["sample_visible"];

impl Builder {
    /// Materials of front and back that a BSDF stands for.
    pub(super) fn surface(&mut self, index: usize) -> Result<[u32; 2]> {
        if let Some(&known) = self.surfaces.get(&index) {
            return Ok(known);
        }
        let node = &self.tree.nodes[index];
        if self.open_surfaces.contains(&index) {
            return Err(node.error("stands inside itself"));
        }
        if self.open_surfaces.len() >= SURFACE_DEPTH {
            return Err(node.error(format!("BSDFs are nested deeper than {SURFACE_DEPTH}")));
        }
        self.open_surfaces.push(index);
        let surface = match node.plugin.as_str() {
            "diffuse" => [self.diffuse(index)?, 0],
            "conductor" | "roughconductor" => [self.conductor(index)?, 0],
            "plastic" | "roughplastic" => [self.plastic(index)?, 0],
            "roughdielectric" => self.rough_dielectric(index)?,
            "dielectric" => self.dielectric(index)?,
            "thindielectric" => self.thin_dielectric(index)?,
            "null" => {
                self.finish(index, &[]);
                [self.add_material(Bsdf::Null); 2]
            }
            "twosided" => self.two_sided(index)?,
            "mask" => self.mask(index)?,
            "blendbsdf" => self.blend(index)?,
            "bumpmap" | "normalmap" => self.relief(index)?,
            other => return Err(node.unsupported(other, BSDFS)),
        };
        self.open_surfaces.pop();
        self.surfaces.insert(index, surface);
        Ok(surface)
    }

    /// The BSDFs inside another one, whose own inputs are called `inputs`.
    fn nested(&mut self, index: usize, count: std::ops::RangeInclusive<usize>, inputs: &[&str]) -> Result<Vec<usize>> {
        let node = &self.tree.nodes[index];
        let mut nested = Vec::new();
        for child in &node.children {
            let inner = self.tree.resolve(child)?;
            match self.tree.nodes[inner].tag.as_str() {
                "bsdf" => nested.push(inner),
                _ if child.name.as_deref().is_some_and(|name| inputs.contains(&name)) => {}
                _ => return Err(self.tree.nodes[inner].error(format!("has no place in {}", node.title()))),
            }
        }
        if !count.contains(&nested.len()) {
            let wanted = if *count.end() == 1 {
                "one BSDF"
            } else if *count.start() == 2 {
                "two BSDFs"
            } else {
                "one or two BSDFs"
            };
            return Err(node.error(format!("needs {wanted} inside, and nothing else")));
        }
        Ok(nested)
    }

    fn two_sided(&mut self, index: usize) -> Result<[u32; 2]> {
        let nested = self.nested(index, 1..=2, &[])?;
        let mut sides = [0; 2];
        for (k, side) in sides.iter_mut().enumerate() {
            let inner = nested[k.min(nested.len() - 1)];
            let [front, back] = self.surface(inner)?;
            if back != 0 {
                return Err(
                    self.tree.nodes[inner].error("has a back or lets light through: it cannot stand inside twosided")
                );
            }
            *side = front;
        }
        self.finish(index, &[]);
        Ok(sides)
    }

    /// Opaque with a probability, else nothing.
    fn mask(&mut self, index: usize) -> Result<[u32; 2]> {
        let nested = self.nested(index, 1..=1, &["opacity"])?;
        let sides = self.surface(nested[0])?;
        let opacity = self.input(index, "opacity", 0.5, &(0.0..=1.0), Use::Scalar)?;
        self.finish(index, &[]);
        let nothing = self.add_material(Bsdf::Null);
        self.mixture(index, opacity, [[nothing; 2], sides])
    }

    fn blend(&mut self, index: usize) -> Result<[u32; 2]> {
        let nested = self.nested(index, 2..=2, &["weight"])?;
        let both = [self.surface(nested[0])?, self.surface(nested[1])?];
        let weight = self.input(index, "weight", 0.5, &(0.0..=1.0), Use::Scalar)?;
        self.finish(index, &[]);
        self.mixture(index, weight, both)
    }

    /// Materials of both sides of two surfaces, the second with probability `weight`.
    fn mixture(&mut self, index: usize, weight: Input, [a, b]: [[u32; 2]; 2]) -> Result<[u32; 2]> {
        let mut sides = [0; 2];
        for k in 0..2 {
            sides[k] = match [a[k], b[k]] {
                [0, 0] => 0,
                same if k == 1 && same == [a[0], b[0]] => sides[0],
                materials => self.push_material(Bsdf::Mixture { weight, materials }.into()),
            };
            if depth(&self.scene, sides[k]) > MIXTURE_DEPTH {
                return Err(self.tree.nodes[index].error(format!("masks and blends more than {MIXTURE_DEPTH} deep")));
            }
        }
        Ok(sides)
    }

    fn diffuse(&mut self, index: usize) -> Result<u32> {
        self.only_colours(index, &["reflectance"])?;
        let reflectance = self.factor(index, "reflectance", 0.5)?;
        self.finish(index, &[]);
        Ok(self.push_material(Bsdf::Diffuse { reflectance }.into()))
    }

    fn conductor(&mut self, index: usize) -> Result<u32> {
        self.only_colours(index, &["eta", "k", "specular_reflectance", "alpha", "alpha_u", "alpha_v"])?;
        let node = &self.tree.nodes[index];
        let name = node.string("material")?.unwrap_or_else(|| "none".into());
        let given = [self.index_of(index, "eta")?, self.index_of(index, "k")?];
        let node = &self.tree.nodes[index];
        let [eta, k] = match (name.as_str(), given) {
            ("none", [eta, k]) => [eta.unwrap_or(Rgb::ZERO), k.unwrap_or(Rgb::ONE)],
            (_, [None, None]) => ior::conductor(&name).ok_or_else(|| {
                let names: Vec<_> = ior::conductors().collect();
                let hint = did_you_mean(&name, names.iter().copied());
                let all = names.join(", ");
                node.error(format!("no conductor is called `{}`{hint} (allowed: none, {all})", shorten(&name)))
            })?,
            _ => return Err(node.error("found both `material` and `eta` or `k`; give one")),
        };
        if (0..3).any(|c| eta[c] + k[c] <= 0.0) {
            return Err(node.error(format!("eta {eta} and k {k}; one of them must be above 0 in each channel")));
        }
        let reflectance = self.factor(index, "specular_reflectance", 1.0)?;
        let bsdf = match self.tree.nodes[index].plugin.as_str() {
            "conductor" => Bsdf::Conductor { eta, k, reflectance },
            _ => Bsdf::RoughConductor { facets: self.facets(index)?, eta, k, reflectance },
        };
        self.finish(index, QUIET);
        Ok(self.push_material(bsdf.into()))
    }

    /// Distribution and roughness of microfacets.
    fn facets(&mut self, index: usize) -> Result<Microfacets<Input>> {
        let node = &self.tree.nodes[index];
        let name = node.string("distribution")?.unwrap_or_else(|| "beckmann".into());
        let distribution = match name.as_str() {
            "beckmann" | "phong" => Distribution::Beckmann,
            "ggx" => Distribution::Ggx,
            other => {
                return Err(node.error(format!("distribution is `{}`; allowed: beckmann, ggx", shorten(other))));
            }
        };
        let given = |name: &str| {
            node.properties.iter().any(|p| p.name == name)
                || node.children.iter().any(|c| c.name.as_deref() == Some(name))
        };
        let names = match [given("alpha"), given("alpha_u"), given("alpha_v")] {
            [_, false, false] => ["alpha"; 2],
            [false, true, true] => ["alpha_u", "alpha_v"],
            _ => return Err(node.error("give either `alpha`, or both `alpha_u` and `alpha_v`")),
        };
        let mut alpha = [Input::Value(Rgb::ZERO); 2];
        for (alpha, name) in alpha.iter_mut().zip(names) {
            *alpha = self.input(index, name, 0.1, &(0.0..=*ROUGHNESS.end()), Use::Scalar)?;
            if let Input::Value(value) = alpha
                && value.x < *ROUGHNESS.start()
            {
                let place = self.tree.nodes[index].place.clone();
                self.warn(&place, &format!("roughness {} is taken as {}", value.x, ROUGHNESS.start()));
                *value = Rgb::splat(*ROUGHNESS.start());
            }
        }
        if name == "phong" {
            let place = self.tree.nodes[index].place.clone();
            self.warn(&place, "the distribution `phong` of Mitsuba 0.x is taken as beckmann of the same roughness");
        }
        Ok(Microfacets { distribution, alpha })
    }

    fn plastic(&mut self, index: usize) -> Result<u32> {
        self.only_colours(index, &["diffuse_reflectance", "specular_reflectance", "alpha", "alpha_u", "alpha_v"])?;
        let eta = self.relative_index(index, "polypropylene")?;
        let reflectance = self.factor(index, "diffuse_reflectance", 0.5)?;
        let specular = self.factor(index, "specular_reflectance", 1.0)?;
        let nonlinear = self.tree.nodes[index].boolean("nonlinear")?.unwrap_or(false);
        let (d, s) = (self.mean(&reflectance), self.mean(&specular));
        let specular_weight = if d + s > 0.0 { s / (d + s) } else { 1.0 };
        let coat = |internal| Coat { eta, internal, nonlinear, specular_weight };
        let bsdf = if self.tree.nodes[index].plugin == "plastic" {
            Bsdf::Plastic { coat: coat(diffuse_reflectance(1.0 / eta)), reflectance, specular }
        } else {
            let facets = self.facets(index)?;
            let [Input::Value(x), Input::Value(y)] = facets.alpha else {
                return Err(self.tree.nodes[index].error("the roughness of this plugin cannot be a texture"));
            };
            let constant = Microfacets { distribution: facets.distribution, alpha: [x.x, y.x] };
            let coat = coat(diffuse_rough_reflectance(&constant, 1.0 / eta));
            let table = self.scene.transmittances.len() as u32;
            self.scene.transmittances.push(Transmittance::new(&constant, eta));
            Bsdf::RoughPlastic { facets, coat, table, reflectance, specular }
        };
        self.finish(index, QUIET);
        Ok(self.push_material(bsdf.into()))
    }

    /// The mean of an input over its colours and texels; that of mesh attributes is not known yet.
    fn mean(&self, input: &Input) -> f32 {
        let colors = match *input {
            Input::Value(ref value) => std::slice::from_ref(value),
            Input::Texture(index) => match self.scene.textures[index as usize] {
                Texture::Bitmap(Bitmap { first, size: [w, h], .. }) => {
                    &self.scene.texels[first as usize..][..w as usize * h as usize]
                }
                Texture::Checkerboard { first, .. } => &self.scene.texels[first as usize..][..2],
                Texture::VertexAttribute { .. } | Texture::FaceAttribute { .. } => return 0.5,
            },
        };
        let sum: f64 = colors.iter().map(|c| f64::from(c.element_sum()) / 3.0).sum();
        (sum / colors.len() as f64) as f32
    }

    /// Materials seen from outside and from inside.
    fn rough_dielectric(&mut self, index: usize) -> Result<[u32; 2]> {
        let facets = self.facets(index)?;
        let (eta, reflectance, transmittance) = self.interface(index)?;
        if eta == 1.0 {
            return Err(self.tree.nodes[index].error("the indices of refraction inside and outside must differ"));
        }
        let side = |eta| Bsdf::RoughDielectric { facets, eta, reflectance, transmittance }.into();
        Ok([self.push_material(side(eta)), self.push_material(side(1.0 / eta))])
    }

    /// Materials seen from outside and from inside.
    fn dielectric(&mut self, index: usize) -> Result<[u32; 2]> {
        let (eta, reflectance, transmittance) = self.interface(index)?;
        let side = |eta| Bsdf::Dielectric { eta, reflectance, transmittance }.into();
        Ok([self.push_material(side(eta)), self.push_material(side(1.0 / eta))])
    }

    fn thin_dielectric(&mut self, index: usize) -> Result<[u32; 2]> {
        let (eta, reflectance, transmittance) = self.interface(index)?;
        Ok([self.push_material(Bsdf::ThinDielectric { eta, reflectance, transmittance }.into()); 2])
    }

    /// Relative index of refraction and factors of reflection and transmission of a smooth dielectric.
    fn interface(&mut self, index: usize) -> Result<(f32, Input, Input)> {
        self.only_colours(index, &["specular_reflectance", "specular_transmittance", "alpha", "alpha_u", "alpha_v"])?;
        let eta = self.relative_index(index, "bk7")?;
        let reflectance = self.factor(index, "specular_reflectance", 1.0)?;
        let transmittance = self.factor(index, "specular_transmittance", 1.0)?;
        self.finish(index, QUIET);
        Ok((eta, reflectance, transmittance))
    }

    /// Index of refraction inside over that outside.
    fn relative_index(&self, index: usize, inside: &str) -> Result<f32> {
        let node = &self.tree.nodes[index];
        let of = |name: &str, default: &str| -> Result<f64> {
            let value = node.get(name, "a number above 0 or the name of a material", |v| match v {
                Value::Float(x) => Some(Some(*x)),
                Value::Integer(i) => Some(Some(*i as f64)),
                Value::String(s) => Some(ior::dielectric(s)),
                _ => None,
            })?;
            let Some(known) = value.unwrap_or_else(|| ior::dielectric(default)) else {
                let all = ior::dielectrics().collect::<Vec<_>>().join(", ");
                return Err(node.error(format!("`{name}` names no known dielectric (allowed: {all}, or a number)")));
            };
            match known > 0.0 && known.is_finite() {
                true => Ok(known),
                false => Err(node.error(format!("`{name}` is {known}; it must be above 0"))),
            }
        };
        let eta = (of("int_ior", inside)? / of("ext_ior", "air")?) as f32;
        let allowed = 1.0 / LARGEST_INDEX..=LARGEST_INDEX;
        if !allowed.contains(&eta) {
            let (low, high) = allowed.into_inner();
            return Err(
                node.error(format!("the ratio of indices of refraction is {eta}; allowed: {low:e} to {high:e}"))
            );
        }
        Ok(eta)
    }

    /// A conductor's η or k.
    fn index_of(&mut self, index: usize, name: &str) -> Result<Option<Rgb>> {
        let Some((value, place)) = self.color(&self.tree.nodes[index], name)? else { return Ok(None) };
        let rgb = to_rgb(&value, Role::Reflectance);
        let sound = matches!(&value, Value::Spectrum(Spectrum::List(l)) if l.iter().all(|p| p.1 >= 0.0));
        self.in_gamut(rgb, rgb.clamp(Rgb::ZERO, Rgb::splat(LARGEST_INDEX)), sound, place, name, "in [0, 1e6]").map(Some)
    }

    /// Refuses objects inside a BSDF or emitter that stand for none of these properties.
    pub(super) fn only_colours(&self, index: usize, names: &[&str]) -> Result<()> {
        let node = &self.tree.nodes[index];
        for child in &node.children {
            if !child.name.as_deref().is_some_and(|name| names.contains(&name)) {
                let inner = &self.tree.nodes[self.tree.resolve(child)?];
                return Err(inner.error(format!("has no place in {}", node.title())));
            }
        }
        Ok(())
    }

    /// The material of shapes that name none: Mitsuba's diffuse with reflectance 0.5, black on emitters.
    pub(super) fn default_surface(&mut self, emits: bool) -> [u32; 2] {
        if emits {
            return [0, 0];
        }
        let index = match self.default_surface {
            Some(index) => index,
            None => self.add_material(Bsdf::Diffuse { reflectance: Rgb::splat(0.5) }),
        };
        self.default_surface = Some(index);
        [index, 0]
    }

    /// A material that is the same everywhere.
    fn add_material(&mut self, bsdf: Bsdf) -> u32 {
        self.push_material(bsdf.into())
    }

    pub(super) fn push_material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// The share of light that is reflected or let through.
    fn factor(&mut self, index: usize, name: &str, default: f32) -> Result<Input> {
        self.input(index, name, default, &(0.0..=1.0), Use::Color)
    }

    /// A colour that is the same everywhere, in `range`.
    pub(super) fn value(&mut self, index: usize, name: &str, default: f32, range: &RangeInclusive<f32>) -> Result<Rgb> {
        let (low, high) = (*range.start(), *range.end());
        let color = self.color(&self.tree.nodes[index], name)?;
        let Some((value, place)) = color else { return Ok(Rgb::splat(default)) };
        let rgb = to_rgb(&value, Role::Reflectance);
        let inside = |v: f64| (f64::from(low)..=f64::from(high)).contains(&v);
        let sound = matches!(&value, Value::Spectrum(Spectrum::List(l)) if l.iter().all(|p| inside(p.1)));
        let bounded = rgb.clamp(Rgb::splat(low), Rgb::splat(high));
        self.in_gamut(rgb, bounded, sound, place, name, &format!("in [{low}, {high}]"))
    }

    /// The radiance or intensity of an emitter; Mitsuba's default is 1.
    pub(super) fn emission(&mut self, index: usize, name: &str) -> Result<Rgb> {
        self.only_colours(index, &[name])?;
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
        let Some(child) = node.children.iter().rfind(|c| c.name.as_deref() == Some(name)) else { return Ok(None) };
        let inner = &self.tree.nodes[self.tree.resolve(child)?];
        Ok(Some((self.spectrum_plugin(inner)?, inner.place.clone())))
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
