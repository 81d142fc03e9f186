//! What asks a scene: lights, triangles, quadrics, surface points and the rays between them.

use super::twins::{Answer, Case, Input, Program, Words, decided, float, of, vector};
use crate::intersection::scene as soup;
use crate::lights::{lit, mesh, rectangle};
use crate::support::{no_messages, vulkan};
use rootn::accel::brute::Brute;
use rootn::accel::compact::CompactBvh;
use rootn::accel::{Endpoint, Hit, Intersect, NO_PRIMITIVE, Ray, SurfacePoint, leave, segment};
use rootn::math::{Vec3, warp};
use rootn::sampling::Key;
use rootn::sampling::strategy::{LightChoice, Lights};
use rootn::scene::light::{Beam, LightSample, LightSampler, LightTarget};
use rootn::scene::{Geometry, Light, Scene, Shape};

/// Scales of scenes, and how far from the origin they lie in units of it.
const PLACES: [(f32, f32); 3] = [(1.0, 0.0), (1.0 / 8192.0, 0.0), (8192.0, 10.0)];

/// A scene with lights of all kinds around `center`.
fn lights_around(center: Vec3, s: f32) -> Scene {
    let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * s;
    let at = |x: f32, y: f32, z: f32| center + v(x, y, z);
    let sphere = |center, radius: f32, flip| Geometry::Sphere { center, radius: radius * s, flip };
    let cylinder = |p0, axis, radius: f32, flip| Geometry::Cylinder { p0, axis, radius: radius * s, flip };
    let mut scene = lit(vec![
        rectangle(at(-0.6, 2.0, -0.4), v(1.2, 0.0, 0.0), v(0.0, 0.0, 0.8)),
        rectangle(at(2.0, -0.5, -0.6), v(0.2, 0.1, 1.1), v(0.0, 1.0, 0.3)),
        sphere(at(-2.2, 0.3, 0.5), 0.6, false),
        sphere(at(0.0, 0.1, 0.0), 6.0, true),
        Geometry::Disk { center: at(0.0, -2.0, 0.0), u: v(0.9, 0.0, 0.1), v: v(0.1, 0.0, -0.8) },
        cylinder(at(0.8, 0.2, 2.2), v(-1.2, 0.3, 0.2), 0.3, false),
        cylinder(at(0.0, -4.0, 0.0), v(0.0, 8.0, 0.5), 4.5, true),
    ]);
    let flat = [at(0.0, 0.0, -2.5), v(0.5, 0.0, 0.0), v(1.0, 0.0, 0.0)];
    let wide = [at(-1.0, -1.0, -2.0), v(1.5, 0.0, 0.1), v(0.2, 1.3, 0.0)];
    let small = [at(0.6, -0.8, -2.2), v(0.08, 0.01, 0.0), v(0.0, 0.09, 0.02)];
    mesh(&mut scene, &[wide, flat, small]);
    let intensity = Vec3::new(1.0, 2.0, 3.0) * s * s;
    let beam = Beam { axis: Vec3::new(-0.6, 0.0, 0.8), cutoff: 1.9, width: 0.7 };
    scene.lights.extend([
        Light::Point { position: at(1.0, 1.5, 1.0), intensity },
        Light::Constant { radiance: Vec3::X },
        Light::Spot { position: at(0.5, -0.2, -0.6), intensity, beam },
        Light::Directional { direction: Vec3::new(0.48, -0.6, 0.64), irradiance: Vec3::new(3.0, 2.0, 1.0) },
    ]);
    scene
}

#[test]
fn lights_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_light.spv"));
    let modes = [(1, Lights::Area), (2, Lights::SolidAngle)];
    for ((s, away), (mode, lights)) in PLACES.into_iter().flat_map(|place| modes.map(|mode| (place, mode))) {
        let center = Vec3::new(1.0, -0.5, 0.25) * s * away;
        let scene = &lights_around(center, s);
        let sampler = &LightSampler::new(scene, lights, LightChoice::Uniform);
        let (host, surfaces) = (sampler.tables(), CompactBvh::new(scene).unwrap().surfaces);
        let place = move |r: &mut Input| center + r.direction() * r.size(-4, 1) * s;
        // Words 0, 1 and 3 place a sample, word 2 picks the light.
        let drawn = move |r: &mut Input| {
            let p = place(r);
            r.sized(p, s);
            of("ww")(r);
            let choice = r.word();
            r.fixed(&[choice]);
            of("w")(r);
            r.fixed(&[mode]);
        };
        let sampled = |w: &Words| {
            decided(sampler.sample(scene, w.v(0), w.w4(3)), |a, x| {
                let (direction, to) = match x.to {
                    LightTarget::Direction => (1, Endpoint::free(Vec3::ZERO)),
                    LightTarget::Point(at) => (0, at),
                };
                let a = a.bits(1, &[direction]).vector(2, to.p).vector(5, x.wi).vector(8, x.emitted);
                let half = if lights == Lights::Area { to.triangle } else { 0 };
                let a = a.floats(11, &[x.pdf]).bits(12, &[u32::from(x.delta), half]);
                a.floats(14, &[to.p_error.max_element()]).sized(15, 1.0, &[to.ng.dot(x.wi)])
            })
        };
        // Mostly points that the sampler draws.
        let met = move |r: &mut Input| {
            let (p, words) = (place(r), [r.word(), r.word(), r.word(), r.word()]);
            let free = (r.direction(), Endpoint::free(place(r)), r.below(scene.shapes.len() as u32));
            let (wi, at, shape) = match sampler.sample(scene, p, words) {
                Some(LightSample { to: LightTarget::Point(at), wi, light, .. }) => match scene.lights[light as usize] {
                    Light::Area { shape, .. } => (wi, at, shape),
                    _ => free,
                },
                _ => free,
            };
            r.sized(p, s);
            r.vector(wi);
            r.fixed(&[mode]);
            r.sized(at.p, s);
            r.vector(at.ng);
            r.fixed(&[shape, at.triangle]);
        };
        let density = |w: &Words| {
            let (p, p_error, ng, shape, triangle) = (w.v(7), Vec3::ZERO, w.v(10), w.w(13), w.w(14));
            let hit = SurfacePoint { p, p_error, ng, ns: ng, shape, triangle };
            float(sampler.pdf(scene, w.v(0), w.v(3), &hit, triangle))
        };
        let mut tables = [0; 40];
        (tables[12], tables[13]) = (host.entries.len() as u32, host.environment_pdf.to_bits());
        let addresses: [(usize, &[u32]); 7] = [
            (0, bytemuck::cast_slice(&host.entries)),
            (2, &host.choice[..]),
            (4, &host.of_shape[..]),
            (6, &host.drawn_triangles[..]),
            (8, &host.drawn_first[..]),
            (10, bytemuck::cast_slice(&host.densities)),
            (16, bytemuck::cast_slice(&surfaces)),
        ];
        let program = Program { device: &device, code, tables: &tables, addresses: &addresses };
        let name = |what| format!("{what}, {lights:?}, scale {s}");
        // Which half of a parallelogram, which parametrisation, and whether a cosine is positive.
        Case::new(0, name("light_sampler_sample"), 96.0, drawn, sampled)
            .nudged()
            .hidden()
            .inputs(1 << 16)
            .check(&program);
        Case::new(1, name("light_sampler_pdf"), 32.0, met, density).nudged().hidden().inputs(1 << 16).check(&program);
    }
    no_messages(&device);
}

/// A box around a scene as the shaders' tables have it, and room for addresses.
fn boxed(lo: Vec3, hi: Vec3) -> [u32; 14] {
    let mut tables = [0; 14];
    for axis in 0..3 {
        (tables[2 + axis], tables[5 + axis]) = (lo[axis].to_bits(), hi[axis].to_bits());
    }
    tables
}

/// Infinite, or around or at a distance where something is hit.
fn end(r: &mut Input, t: f32) -> f32 {
    match r.below(4) {
        0 if t > 0.0 => t,
        1 if t > 0.0 => t * r.between(0.5, 1.5),
        _ => f32::INFINITY,
    }
}

/// A ray and a triangle inside the box of half width 8s. One in four lies on a lattice, and the ray runs along an axis
/// through corners and edges: exact whatever the precision of quotients.
fn crossed(r: &mut Input, s: f32) {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let (v, aim, direction, distance) = if r.below(4) == 0 {
        let mut point = || Vec3::from_array([0; 3].map(|_| r.below(9) as f32 - 4.0)) * s;
        let v = [point(), point(), point()];
        let aims =
            [v[0], v[1], v[2], (v[0] + v[1]) * 0.5, (v[1] + v[2]) * 0.5, (v[0] + v[1] + v[1] + v[2]) * 0.25, point()];
        (v, r.pick(&aims), r.pick(&axes), r.pick(&[0.0, s, 4.0 * s]))
    } else {
        let (c, size) = (r.sphere() * r.between(0.0, 4.0) * s, r.size(-6, 1) * s);
        let v = [r.sphere(), r.sphere(), r.sphere()].map(|x| c + x * size);
        let inside = warp::sample_uniform_triangle([r.between(0.0, 1.0), r.between(0.0, 1.0)]);
        let [b, c] = if r.below(4) == 0 { [r.between(-0.5, 1.5), r.between(-0.5, 1.5)] } else { inside };
        (v, v[0] + b * (v[1] - v[0]) + c * (v[2] - v[0]), r.direction(), r.size(-12, 3) * s)
    };
    let (from, speed) = (aim - direction * distance, 2f32.powi(r.below(7) as i32 - 3) * s);
    let t_max = end(r, distance / speed);
    r.sized(from, distance);
    r.vector(direction * speed);
    let ends = [r.below(16), r.below(16)].map(|end| if end == 0 { 0 } else { NO_PRIMITIVE });
    r.fixed(&[t_max.to_bits(), ends[0], ends[1]]);
    v.into_iter().for_each(|v| r.fixed(&v.to_array().map(f32::to_bits)));
    r.fixed(&[0, t_max.next_down().to_bits()]);
}

#[test]
fn triangles_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_intersection.spv"));
    for (s, _) in PLACES {
        let (lo, hi) = (Vec3::splat(-8.0 * s), Vec3::splat(8.0 * s));
        let hit = |w: &Words| {
            // A triangle without area makes the scene as large as the box.
            let scene = soup(&[[w.v(9), w.v(12), w.v(15)], [lo, hi, hi]]);
            let ray = Ray { from: w.w(7), to: w.w(8), ..Ray::new(w.v(0), w.v(3), w.f(6)) };
            Brute::new(&scene).unwrap().closest(&ray)
        };
        let closest = |w: &Words| decided(hit(w), |a, h| a.floats(1, &[h.t]).sized(2, 1.0, &[h.u, h.v]));
        let any = |w: &Words| decided(hit(w), |a, _| a);
        let program = Program { device: &device, code, tables: &boxed(lo, hi), addresses: &[] };
        let make = |r: &mut Input| crossed(r, s);
        let name = |what| format!("{what}, scale {s}");
        Case::new(0, name("triangle_closest"), 64.0, make, closest).nudged().inputs(1 << 16).check(&program);
        Case::new(1, name("triangle_any"), 0.0, make, any).check(&program);
    }
    no_messages(&device);
}

#[test]
fn quadrics_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_intersection.spv"));
    for (s, away) in PLACES {
        let c = Vec3::new(0.3, -0.7, 1.0) * s * away;
        let (u, v) = (Vec3::new(0.8, 0.1, -0.3) * s, Vec3::new(0.2, 0.5, 0.9) * s);
        let geometries = [
            Geometry::Sphere { center: c, radius: s, flip: false },
            Geometry::Sphere { center: c, radius: 0.3 * s, flip: true },
            Geometry::Disk { center: c, u, v },
            Geometry::Disk { center: c, u: Vec3::X * s, v: Vec3::Y * s },
            Geometry::Cylinder { p0: c - u, axis: 2.0 * u, radius: 0.7 * s, flip: false },
            Geometry::Cylinder { p0: c, axis: Vec3::Z * s, radius: 0.5 * s, flip: true },
        ];
        for geometry in geometries {
            let name = format!("quadric_intersect, {geometry:?}");
            let shape =
                Shape { geometry, front: 0, back: 0, light: None, axes: Default::default(), name: String::new() };
            let scene = Scene { shapes: vec![shape], ..Scene::default() };
            let (brute, compact) = (Brute::new(&scene).unwrap(), CompactBvh::new(&scene).unwrap());
            let make = |r: &mut Input| {
                let (aim, direction) = (c + r.sphere() * r.between(0.0, 1.3) * s, r.direction());
                let (distance, speed) = (r.size(-12, 4) * s, r.size(-3, 3) * s);
                let t_max = end(r, distance / speed);
                r.sized(aim - direction * distance, distance);
                r.vector(direction * speed);
                r.fixed(&[t_max.to_bits(), 0]);
            };
            let twin = |w: &Words| {
                let ray = Ray::new(w.v(0), w.v(3), w.f(6));
                decided(brute.closest(&ray), |a, hit| {
                    let at = scene.surface_point(&ray, &hit);
                    a.floats(1, &[hit.t]).vector(2, at.p).vector(5, at.ng)
                })
            };
            let [lo, hi] = compact.quadric_tree.bounds.map(Vec3::from);
            let addresses: [(usize, &[u32]); 1] = [(0, bytemuck::cast_slice(&compact.quadrics))];
            let program = Program { device: &device, code, tables: &boxed(lo, hi), addresses: &addresses };
            // In f64, rounded at the end.
            Case::new(2, name, 4.0, make, twin).inputs(1 << 15).check(&program);
        }
    }
    no_messages(&device);
}

#[test]
fn surfaces_and_their_rays_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_intersection.spv"));
    // Vertices have normals on either side, but for those of every eighth triangle.
    let r = &mut Input::new(Key([0, 1]), 0);
    let triangles: Vec<[Vec3; 3]> = (0..512).map(|_| [r.sphere(), r.sphere(), r.sphere()]).collect();
    let mut scene = soup(&triangles);
    scene.shapes[0].geometry = Geometry::Mesh { range: 0..512, smooth: true, uvs: false };
    for (i, [a, b, c]) in triangles.into_iter().enumerate() {
        let n = (b - a).cross(c - a).normalize() * [0.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0][i % 8];
        (0..3).for_each(|k| scene.normals[3 * i + k] = (n + 0.9 * n.length() * r.sphere()).normalize_or_zero());
    }
    let surfaces = CompactBvh::new(&scene).unwrap().surfaces;
    let vertices: Vec<[u32; 3]> = scene.triangles.iter().map(|t| t.vertices).collect();
    let addresses: [(usize, &[u32]); 3] = [
        (8, bytemuck::cast_slice(&surfaces)),
        (10, bytemuck::cast_slice(&vertices)),
        (12, bytemuck::cast_slice(&scene.normals)),
    ];
    let program = Program { device: &device, code, tables: &[0; 14], addresses: &addresses };
    let endpoint =
        |w: &Words, k: usize| Endpoint { p: w.v(k), p_error: w.v(k + 3), ng: w.v(k + 6), triangle: NO_PRIMITIVE };
    let on_triangle = |r: &mut Input| {
        let primitive = r.below(512);
        r.fixed(&[primitive]);
        of("uu")(r);
    };
    let point = |w: &Words| {
        let hit = Hit { t: 0.0, primitive: w.w(0), u: w.f(1), v: w.f(2) };
        let at = scene.surface_point(&Ray::new(Vec3::ZERO, Vec3::X, f32::INFINITY), &hit);
        let answer = Answer::default().vector(0, at.p).vector(3, at.p_error).vector(6, at.ng).vector(9, at.ns);
        answer.bits(12, &[at.shape, at.triangle])
    };
    let between = |w: &Words| {
        let ray = segment(endpoint(w, 0), endpoint(w, 9));
        vector(ray.origin).vector(3, ray.direction)
    };
    Case::new(3, "leave", 0.0, of("pd"), |w| vector(leave(endpoint(w, 0), w.v(9)).origin)).check(&program);
    Case::new(4, "segment", 0.0, of("pp"), between).check(&program);
    Case::new(5, "surface_point_triangle", 8.0, on_triangle, point).check(&program);
    no_messages(&device);
}
