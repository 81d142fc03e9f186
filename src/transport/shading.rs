//! What a path finds at a surface: the BSDF of one layer there, and the frame that it is in.

use crate::accel::{Hit, SurfacePoint};
use crate::math::{Frame, Vec3};
use crate::sampling::rng::happens;
use crate::scene::material::Bent;
use crate::scene::texture::Lookup;
use crate::scene::{Bsdf, Scene};

/// Of material `material` at `at`, where `hit` is, seen from `wo`, on the side of the shading normal `normal`. `words` choose
/// among layers.
#[inline(never)]
pub(super) fn shade(
    scene: &Scene,
    mut material: u32,
    (hit, at): (&Hit, &SurfacePoint),
    [normal, wo]: [Vec3; 2],
    words: [u32; 4],
) -> (Bsdf, Frame, Option<Bent>) {
    let surface = scene.parameterization(hit, at);
    let lookup = Lookup { uv: surface.uv, triangle: at.triangle, barycentrics: [hit.u, hit.v].into() };
    let mut words = words.into_iter();
    loop {
        let Some(layer) = scene.materials.get(material as usize) else {
            return (Bsdf::Black, Frame::new(normal), None);
        };
        match (layer.bsdf.at(scene, &lookup), words.next()) {
            (Bsdf::Mixture { weight, materials }, Some(word)) => {
                material = materials[usize::from(happens(word, weight))]
            }
            (bsdf, _) => {
                let frame = frame_along(normal, surface.dp_du);
                let bent = layer.relief.and_then(|r| r.bend(scene, (&lookup, &surface), at, &frame, wo));
                let Some((n, bent)) = bent else {
                    return (bsdf, if bsdf.is_anisotropic() { frame } else { Frame::new(normal) }, None);
                };
                // The relief is seen from behind: one-sided materials are black there.
                let bsdf = if n.dot(wo) > 0.0 { bsdf } else { Bsdf::Black };
                return (bsdf, frame_along(n, frame.s), Some(bent));
            }
        }
    }
}

/// The frame around a normal whose x axis is as near to `along` as can be; any, where that is zero or parallel to the normal.
fn frame_along(n: Vec3, along: Vec3) -> Frame {
    match (along - n * n.dot(along)).try_normalize() {
        Some(s) => Frame { s, t: n.cross(s), n },
        None => Frame::new(n),
    }
}
