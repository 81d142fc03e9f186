//! Rays per second of the BVH on one thread, beside obvhs' stock traversal (which misses hits; it is the yardstick for
//! speed only). `cargo bench --bench rays`; takes the best of several rounds, since the machine may be busy.

use glam::{Vec3, vec3};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use rootn::accel::bvh::Bvh;
use rootn::accel::simd::Portable;
use rootn::accel::{Intersect, Ray};
use rootn::scene::{Geometry, Scene, Shape, Triangle};
use std::hint::black_box;
use std::time::{Duration, Instant};

fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    ((*state >> 40) as f32) / (1 << 24) as f32
}

fn direction(state: &mut u64) -> Vec3 {
    let z = 1.0 - 2.0 * random(state);
    let phi = std::f32::consts::TAU * random(state);
    let r = (1.0 - z * z).max(0.0).sqrt();
    vec3(r * phi.cos(), r * phi.sin(), z)
}

fn quad(out: &mut Vec<[Vec3; 3]>, o: Vec3, u: Vec3, v: Vec3) {
    out.push([o, o + u, o + u + v]);
    out.push([o, o + u + v, o + v]);
}

fn block(out: &mut Vec<[Vec3; 3]>, o: Vec3, u: Vec3, v: Vec3, w: Vec3) {
    for (a, b, c) in [(u, v, w), (v, w, u), (w, u, v)] {
        quad(out, o, a, b);
        quad(out, o + c, a, b);
    }
}

/// Five walls, a lamp, two turned blocks.
fn cornell() -> Vec<[Vec3; 3]> {
    let mut t = Vec::new();
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let o = Vec3::splat(-1.0);
    quad(&mut t, o, x, z);
    quad(&mut t, o + y, x, z);
    quad(&mut t, o, x, y);
    quad(&mut t, o, y, z);
    quad(&mut t, o + x, y, z);
    quad(&mut t, vec3(-0.25, 0.99, -0.2), Vec3::X * 0.5, Vec3::Z * 0.4);
    block(&mut t, vec3(-0.6, -1.0, -0.6), vec3(0.57, 0.0, 0.17), Vec3::Y * 1.2, vec3(-0.17, 0.0, 0.57));
    block(&mut t, vec3(0.1, -1.0, 0.0), vec3(0.57, 0.0, -0.17), Vec3::Y * 0.6, vec3(0.17, 0.0, 0.57));
    t
}

fn dragon() -> Option<Vec<[Vec3; 3]>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes/stanford-dragon/dragon_vrip_res3.ply");
    let text = std::fs::read_to_string(path).ok()?;
    let (header, body) = text.split_once("end_header\n")?;
    let count = |name: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(name)).and_then(|n| n.trim().parse().ok()).unwrap_or(0)
    };
    let (nv, nf) = (count("element vertex"), count("element face"));
    let mut lines = body.lines();
    let v: Vec<Vec3> = lines
        .by_ref()
        .take(nv)
        .map(|l| Vec3::from_slice(&l.split_whitespace().take(3).map(|x| x.parse().unwrap()).collect::<Vec<_>>()))
        .collect();
    let mut t: Vec<[Vec3; 3]> = lines
        .take(nf)
        .map(|l| {
            let i: Vec<usize> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
            [v[i[1]], v[i[2]], v[i[3]]]
        })
        .collect();
    let (lo, hi) = v.iter().fold((v[0], v[0]), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let (center, size) = ((lo + hi) / 2.0, (hi - lo).max_element());
    for p in t.iter_mut().flatten() {
        *p = (*p - center) / size * 1.6 - Vec3::Y * 0.43;
    }
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let o = Vec3::splat(-1.0);
    for (o, u, v) in [(o, x, z), (o + y, x, z), (o, x, y), (o, y, z), (o + x, y, z)] {
        quad(&mut t, o, u, v);
    }
    Some(t)
}

fn scene(triangles: &[[Vec3; 3]]) -> Scene {
    let n = triangles.len() as u32;
    let geometry = Geometry::Mesh { range: 0..n, smooth: false, uvs: false };
    Scene {
        positions: triangles.iter().flatten().copied().collect(),
        normals: vec![Vec3::ZERO; 3 * triangles.len()],
        triangles: (0..n).map(|i| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], shape: 0 }).collect(),
        shapes: vec![Shape {
            geometry,
            front: 0,
            back: 0,
            light: None,
            axes: Default::default(),
            name: "bench".into(),
        }],
        ..Scene::default()
    }
}

/// Best of seven rounds, in Mrays/s.
fn best(rays: &[Ray], mut trace: impl FnMut(&Ray) -> bool) -> f64 {
    (0..7)
        .map(|_| {
            let start = Instant::now();
            black_box(rays.iter().filter(|r| trace(r)).count());
            rays.len() as f64 / start.elapsed().as_secs_f64() / 1e6
        })
        .fold(0.0, f64::max)
}

fn report(name: &str, triangles: &[[Vec3; 3]]) {
    let s = scene(triangles);
    let start = Instant::now();
    let bvh = Bvh::new(&s).unwrap();
    println!("{name}: {} triangles, built in {:.1} ms", triangles.len(), start.elapsed().as_secs_f64() * 1e3);
    let mut state = 7;
    let n = 300_000;
    let primary: Vec<Ray> = (0..n)
        .map(|i| {
            let (x, y) = ((i % 548) as f32 / 274.0 - 1.0, (i / 548) as f32 / 274.0 - 1.0);
            Ray::new(vec3(0.0, 0.0, 3.8), vec3(x * 0.35, -y * 0.35, -1.0), f32::INFINITY)
        })
        .collect();
    let diffuse: Vec<Ray> = primary
        .iter()
        .cycle()
        .take(4 * n)
        .filter_map(|r| bvh.closest(r).map(|h| (r, h)))
        .map(|(r, h)| {
            let p = s.surface_point(r, &h);
            let n = if p.ng.dot(r.direction) > 0.0 { -p.ng } else { p.ng };
            rootn::accel::leave(&p, (n * 1.001 + direction(&mut state)).normalize())
        })
        .take(n)
        .collect();
    let shadow: Vec<Ray> = diffuse
        .iter()
        .map(|r| {
            let light = vec3(-0.25 + 0.5 * random(&mut state), 0.98, -0.2 + 0.4 * random(&mut state));
            Ray { t_max: 1.0, direction: light - r.origin, ..*r }
        })
        .collect();
    let uniform: Vec<Ray> = (0..n)
        .map(|_| {
            let o = vec3(random(&mut state), random(&mut state), random(&mut state)) * 1.98 - 0.99;
            Ray::new(o, direction(&mut state), f32::INFINITY)
        })
        .collect();
    let stock: Vec<_> = triangles
        .iter()
        .map(|t| obvhs::triangle::Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() })
        .collect();
    let cw = build_cwbvh_from_tris(&stock, BvhBuildParams::medium_build(), &mut Duration::default());
    let stock: Vec<_> = cw.primitive_indices.iter().map(|&i| stock[i as usize]).collect();
    for (kind, rays) in [("primary", &primary), ("diffuse", &diffuse), ("uniform", &uniform)] {
        let ours = best(rays, |r| bvh.closest(r).is_some());
        let portable = best(rays, |r| bvh.closest_with(Portable, r).is_some());
        let theirs = best(rays, |r| {
            let mut hit = RayHit::none();
            let ray = obvhs::ray::Ray::new_inf(r.origin.into(), r.direction.into());
            cw.ray_traverse(ray, &mut hit, |ray, i| stock[i].intersect(ray))
        });
        println!("  closest {kind}: {ours:.2} Mrays/s (portable {portable:.2}, obvhs {theirs:.2})");
    }
    let ours = best(&shadow, |r| bvh.occluded(r));
    let theirs = best(&shadow, |r| {
        let ray = obvhs::ray::Ray::new(r.origin.into(), r.direction.into(), 0.0, 1.0);
        !cw.ray_traverse_miss(ray, |ray, i| stock[i].intersect(ray))
    });
    println!("  occluded shadow: {ours:.2} Mrays/s (obvhs {theirs:.2})");
}

fn main() {
    report("cornell", &cornell());
    match dragon() {
        Some(t) => report("dragon in a box", &t),
        None => println!("dragon: skipped, ../shared/scenes is absent"),
    }
}
