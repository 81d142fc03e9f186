//! Parameterizations and textures.

use super::twins::{Answer, Case, Input, Program, Words, of, vector};
use crate::intersection::scene as soup;
use crate::support::{no_messages, vulkan};
use rootn::accel::compact::CompactBvh;
use rootn::accel::{Hit, NO_PRIMITIVE, Parameterization, QuadricMap, SurfacePoint};
use rootn::math::{Mat3, Vec2, Vec3};
use rootn::sampling::Key;
use rootn::scene::texture::{Bitmap, Lookup, PackedTexture, TextureFilter, UvTransform, Wrap};
use rootn::scene::{Geometry, Scene, Shape, Texture};

const TRIANGLES: u32 = 256;

/// Triangles with texture coordinates (every eighth with equal ones), quadrics, and textures of all kinds.
fn world() -> Scene {
    let r = &mut Input::new(Key([0, 2]), 0);
    let triangles: Vec<[Vec3; 3]> = (0..TRIANGLES).map(|_| [r.sphere(), r.sphere(), r.sphere()]).collect();
    let mut scene = soup(&triangles);
    scene.shapes[0].geometry = Geometry::Mesh { range: 0..TRIANGLES, smooth: false, uvs: true };
    for t in 0..TRIANGLES {
        let [a, b, c] = [0; 3].map(|_| Vec2::new(r.between(-2.0, 2.0), r.between(-2.0, 2.0)));
        scene.uvs.extend(if t % 8 == 0 { [a; 3] } else { [a, b, c] });
    }
    for kind in 0..24 {
        let center = r.sphere() * r.size(-3, 3);
        let axes = Mat3::from_cols(r.sphere(), r.sphere(), r.sphere()) * r.size(-3, 3);
        let geometry = match kind % 3 {
            0 => Geometry::Sphere { center, radius: 1.0, flip: false },
            1 => Geometry::Disk { center, u: Vec3::X, v: Vec3::Y },
            _ => Geometry::Cylinder { p0: center, axis: Vec3::Z, radius: 1.0, flip: false },
        };
        scene.shapes.push(Shape { geometry, front: 0, back: 0, light: None, axes, name: String::new() });
    }
    for size in [[1, 1], [2, 3], [7, 5], [64, 32], [1, 9], [300, 1]] {
        for (filter, wrap) in [TextureFilter::Nearest, TextureFilter::Bilinear]
            .into_iter()
            .flat_map(|f| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|w| (f, w)))
        {
            let mut pair = || [r.between(-3.0, 3.0), r.between(-3.0, 3.0)];
            let to_uv = UvTransform { u: pair(), v: pair(), origin: pair() };
            let to_uv = if size[0] == 7 { UvTransform::IDENTITY } else { to_uv };
            let first = scene.texels.len() as u32;
            scene.texels.extend((0..size[0] * size[1]).map(|_| r.sphere().abs()));
            scene.textures.push(Texture::Bitmap(Bitmap { first, size, filter, wrap, to_uv }));
            scene.texels.extend([r.sphere().abs(), r.sphere().abs()]);
            scene.textures.push(Texture::Checkerboard { first: scene.texels.len() as u32 - 2, to_uv });
        }
    }
    scene.attributes = (0..scene.positions.len() as u32 + TRIANGLES).map(|_| r.sphere().abs()).collect();
    scene.textures.push(Texture::VertexAttribute { first: 0, scale: 0.7 });
    scene.textures.push(Texture::FaceAttribute { first: scene.positions.len() as u32, scale: 1.5 });
    scene
}

fn answer(found: Parameterization) -> Answer {
    // Azimuths are sums with 1.
    let answer = Answer::default().sized(0, 1.0, &[found.uv.x]).sized(1, 1.0, &[found.uv.y]);
    answer.vector(2, found.dp_du).vector(5, found.dp_dv)
}

#[test]
fn textures_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_texture.spv"));
    let scene = &world();
    let surfaces = CompactBvh::new(scene).unwrap().surfaces;
    let vertices: Vec<[u32; 3]> = scene.triangles.iter().map(|t| t.vertices).collect();
    let maps: Vec<QuadricMap> = scene.shapes.iter().filter_map(QuadricMap::new).collect();
    let textures: Vec<PackedTexture> = scene.textures.iter().map(PackedTexture::from).collect();
    let addresses: [(usize, &[u32]); 7] = [
        (0, bytemuck::cast_slice(&surfaces)),
        (2, bytemuck::cast_slice(&vertices)),
        (4, bytemuck::cast_slice(&scene.uvs)),
        (6, bytemuck::cast_slice(&maps)),
        (8, bytemuck::cast_slice(&textures)),
        (10, bytemuck::cast_slice(&scene.texels)),
        (12, bytemuck::cast_slice(&scene.attributes)),
    ];
    let program = Program { device: &device, code, tables: &[0; 14], addresses: &addresses };
    let on_triangle = |r: &mut Input| {
        let primitive = r.below(TRIANGLES);
        r.fixed(&[primitive]);
        of("uu")(r);
    };
    let at = |p: Vec3, ng: Vec3, shape: u32| SurfacePoint { p, p_error: Vec3::ZERO, ng, ns: ng, shape, triangle: 0 };
    let triangle = |w: &Words| {
        let hit = Hit { t: 0.0, primitive: w.w(0), u: w.f(1), v: w.f(2) };
        let [a, b, c] = scene.corners(&scene.triangles[w.w(0) as usize]).map(|p| p.as_dvec3());
        let ng = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        answer(scene.parameterization(&hit, &at(Vec3::ZERO, ng, 0)))
    };
    Case::new(0, "parameterization_triangle", 0.0, on_triangle, triangle).check(&program);
    let quadrics = maps.len() as u32;
    let on_quadric = |r: &mut Input| {
        let quadric = r.below(quadrics);
        r.fixed(&[quadric]);
        // In one case of eight on the axis, where there is no azimuth.
        let shape = &scene.shapes[quadric as usize + 1];
        let (Geometry::Sphere { center, .. } | Geometry::Disk { center, .. } | Geometry::Cylinder { p0: center, .. }) =
            shape.geometry
        else {
            panic!("flat")
        };
        let local = if r.below(8) == 0 { Vec3::Z } else { r.sphere() };
        r.vector(center + shape.axes * local);
    };
    let quadric = |w: &Words| {
        let (shape, primitive) = (w.w(0) + 1, TRIANGLES + w.w(0) + 1);
        let hit = Hit { t: 0.0, primitive, u: 0.0, v: 0.0 };
        answer(scene.parameterization(&hit, &at(w.v(1), Vec3::Z, shape)))
    };
    Case::new(1, "parameterization_quadric", 8.0, on_quadric, quadric).check(&program);
    let looked_up = |r: &mut Input| {
        let texture = r.below(textures.len() as u32);
        r.fixed(&[texture]);
        for _ in 0..2 {
            let x = match r.below(8) {
                0 => r.pick(&[0.0, -0.0, 0.5, 1.0, -1.0, 2.0, f32::NAN, f32::INFINITY, f32::MAX, f32::MIN]),
                1 => r.signed(0, 126),
                2 => r.signed(-20, 20),
                _ => r.between(-2.0, 3.0),
            };
            r.float(x);
        }
        let triangle = if r.below(8) == 0 { NO_PRIMITIVE } else { r.below(TRIANGLES) };
        r.fixed(&[triangle]);
        of("uu")(r);
    };
    let evaluated = |w: &Words| {
        let at = Lookup { uv: w.f2(1).into(), triangle: w.w(3), barycentrics: w.f2(4).into() };
        let texture = &scene.textures[w.w(0) as usize];
        let gradient = texture.gradient(scene, at.uv);
        // A slope is as precise as the texels it is a difference of.
        vector(texture.eval(scene, &at)).sized(3, gradient.abs().max_element(), &gradient.to_array())
    };
    Case::new(2, "texture_eval", 0.0, looked_up, evaluated).check(&program);
    no_messages(&device);
}
