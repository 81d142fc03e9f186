//! Bump and normal maps: a material seen in a bent frame.
//!
//! Semantics of Mitsuba 3.9: directions on different sides of the bent and the unbent normal scatter nothing; normals that face
//! away from the viewer are turned about the unbent one (Schüssler et al. 2017); what is left is attenuated near the
//! terminator (Estevez, Lecocq and Stein, "A microfacet-based shadowing function to solve the bump terminator problem", Ray
//! Tracing Gems, 2019). The Vulkan twin is `shaders/scene/material/relief.glsl`.

use crate::accel::{Parameterization, SurfacePoint};
use crate::math::{Frame, Vec3};
use crate::scene::Scene;
use crate::scene::texture::{Input, Lookup};

/// Bends the frame of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// What bends it.
    pub map: ReliefMap,
    /// Whether the side with this material sees the front's relief from within: bumps are dents there. Otherwise each side has
    /// bumps of its own.
    pub inward: bool,
    /// Whether normals that face away from the viewer are turned about the unbent one.
    pub flips: bool,
    /// Whether light is attenuated near the terminator.
    pub shadows: bool,
}

/// What bends the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReliefMap {
    /// Heights above the surface.
    Bump {
        /// Index into [`Scene::textures`] of the heights (all channels the same), scene units per `scale`.
        texture: u32,
        /// Factor of the heights.
        scale: f32,
    },
    /// Normals n in the shading frame (x along ∂p/∂u), as colours (n + 1)/2.
    Normal(Input),
}

/// What remains of a relief at a point, besides the bent frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bent {
    /// The unbent shading normal on the side of the path.
    normal: Vec3,
    /// Squared roughness of the microfacets whose masking attenuates light; 0 = none does.
    alpha2: f32,
}

impl Relief {
    /// The texture that it looks up.
    pub fn texture(&self) -> Option<u32> {
        match self.map {
            ReliefMap::Bump { texture, .. } | ReliefMap::Normal(Input::Texture(texture)) => Some(texture),
            ReliefMap::Normal(Input::Value(_)) => None,
        }
    }

    /// The bent normal for a path that arrives from the unit direction `wo`, on its side of the surface unless it sees the
    /// relief from behind. `frame`: n = the shading normal on the side of the path, s along ∂p/∂u. `None` where it is flat.
    #[inline(never)]
    pub(crate) fn bend(
        &self,
        scene: &Scene,
        (lookup, surface): (&Lookup, &Parameterization),
        at: &SurfacePoint,
        frame: &Frame,
        wo: Vec3,
    ) -> Option<(Vec3, Bent)> {
        // Along s, t and the normal: y keeps its direction where the normal is turned.
        let t = at.ns.cross(frame.s);
        let mut local = match self.map {
            ReliefMap::Normal(ref normal) => normal.eval(scene, lookup) * 2.0 - 1.0,
            ReliefMap::Bump { texture, scale } => {
                let g = scene.textures[texture as usize].gradient(scene, lookup.uv) * scale;
                let [du, dv] = [surface.dp_du, surface.dp_dv].map(|d| [frame.s.dot(d), t.dot(d)]);
                // (du, g.x) × (dv, g.y)
                let n = Vec3::new(du[1] * g.y - g.x * dv[1], g.x * dv[0] - du[0] * g.y, du[0] * dv[1] - du[1] * dv[0]);
                let outward = (frame.s * n.x + t * n.y + at.ns * n.z).dot(at.ng);
                if outward < 0.0 { -n } else { n }
            }
        };
        if local.x == 0.0 && local.y == 0.0 && local.z >= 0.0 {
            return None;
        }
        if self.inward {
            local = Vec3::new(-local.x, -local.y, local.z);
        }
        let (tilt, up) = (frame.s * local.x + t * local.y, frame.n * local.z);
        let faces_away = wo.dot(tilt + up) <= 0.0;
        let n = (if self.flips && faces_away { up - tilt } else { tilt + up }).try_normalize()?;
        let cos2 = n.dot(frame.n) * n.dot(frame.n);
        let alpha2 = if self.shadows { (0.125 * ((1.0 - cos2).max(0.0) / cos2)).min(1.0) } else { 0.0 };
        Some((n, Bent { normal: frame.n, alpha2 }))
    }
}

impl Bent {
    /// What light from `wi` is multiplied by; `cos`: between it and the bent normal.
    pub(crate) fn factor(&self, wi: Vec3, cos: f32) -> f32 {
        let unbent = self.normal.dot(wi);
        if !((cos > 0.0 && unbent > 0.0) || (cos < 0.0 && unbent < 0.0)) {
            return 0.0;
        }
        if self.alpha2 == 0.0 {
            return 1.0;
        }
        let cos2 = unbent * unbent;
        let c = cos2.sqrt();
        2.0 * c / (c + (cos2 + self.alpha2 * (1.0 - cos2).max(0.0)).sqrt())
    }
}
