//! What may be wrong with a material.

use super::super::Scene;
use super::super::texture::Input;
use super::{Bsdf, Coat, LARGEST_INDEX, MIXTURE_DEPTH, Material, Microfacets, ROUGHNESS, Relief, ReliefMap};
use crate::math::Rgb;

impl Material {
    /// Sentences about material number `own` of a scene.
    pub(in crate::scene) fn problems(&self, own: u32, scene: &Scene) -> Vec<String> {
        let mut found = Vec::new();
        let mut unless = |fine: bool, problem: String| {
            if !fine {
                found.push(format!("material {own}: {problem}"));
            }
        };
        let outside = |input: &Input| match input {
            Input::Value(c) => !c.to_array().iter().all(|c| (0.0..=1.0).contains(c)),
            Input::Texture(_) => false,
        };
        let missing = |input: &Input| matches!(input, Input::Texture(t) if *t as usize >= scene.textures.len());
        unless(!self.bsdf.any(outside, |_| false), "a reflectance or transmittance is not in [0, 1]".into());
        let relief = self.relief.and_then(|r| r.texture()).map(Input::Texture);
        unless(
            !self.bsdf.any(missing, missing) && !relief.iter().any(missing),
            "names a texture that is not there".into(),
        );
        let layered = matches!(self.bsdf, Bsdf::Mixture { .. });
        unless(self.relief.is_none() || !layered, "a mixture has a relief; what it is made of may have one".into());
        if let Some(Relief { map: ReliefMap::Bump { scale, .. }, .. }) = self.relief {
            unless(scale.is_finite(), format!("the scale {scale} of a bump map is not finite"));
        }
        let sound = |eta: f32| (1.0 / LARGEST_INDEX..=LARGEST_INDEX).contains(&eta);
        let index = match &self.bsdf {
            Bsdf::Conductor { eta, k, .. } | Bsdf::RoughConductor { eta, k, .. } => {
                let sound = |c: f32| (0.0..=LARGEST_INDEX).contains(&c);
                Some(((0..3).all(|c| sound(eta[c]) && sound(k[c]) && eta[c] + k[c] > 0.0), format!("{eta} + i {k}")))
            }
            Bsdf::Dielectric { eta, .. } | Bsdf::ThinDielectric { eta, .. } | Bsdf::RoughDielectric { eta, .. } => {
                Some((sound(*eta), eta.to_string()))
            }
            Bsdf::Plastic { coat, .. } | Bsdf::RoughPlastic { coat, .. } => {
                let Coat { eta, internal, specular_weight, .. } = *coat;
                let shares = (0.0..1.0).contains(&internal) && (0.0..=1.0).contains(&specular_weight);
                unless(shares, format!("the coat reflects {internal} inside, its weight is {specular_weight}"));
                Some((sound(eta), eta.to_string()))
            }
            Bsdf::Mixture { weight, materials } => {
                unless(!outside(weight), format!("the weight {weight:?} is not in [0, 1]"));
                unless(materials.iter().all(|m| *m < own), format!("is mixed of {materials:?}, which come later"));
                unless(depth(scene, own) <= MIXTURE_DEPTH, format!("mixtures more than {MIXTURE_DEPTH} deep"));
                None
            }
            Bsdf::Black | Bsdf::Null | Bsdf::Diffuse { .. } => None,
        };
        if let Some((sound, found)) = index {
            unless(sound, format!("the index of refraction {found} is not above 0 and up to {LARGEST_INDEX}"));
        }
        if let Bsdf::RoughPlastic { table, .. } = self.bsdf {
            unless((table as usize) < scene.transmittances.len(), format!("names table {table}"));
        }
        if let Some(Microfacets { alpha, .. }) = self.bsdf.facets() {
            let rough = |input: &Input| match input {
                Input::Value(Rgb { x, .. }) => ROUGHNESS.contains(x),
                Input::Texture(_) => true,
            };
            unless(alpha.iter().all(rough), format!("roughness {alpha:?} is not in {ROUGHNESS:?}"));
        }
        found
    }
}

/// Mixtures inside each other, from material `own` on; those that name later ones are refused elsewhere.
pub(in crate::scene) fn depth(scene: &Scene, own: u32) -> usize {
    match scene.materials.get(own as usize).map(|m| m.bsdf) {
        Some(Bsdf::Mixture { materials, .. }) => {
            1 + materials.iter().filter(|m| **m < own).map(|m| depth(scene, *m)).max().unwrap_or(0)
        }
        _ => 0,
    }
}
