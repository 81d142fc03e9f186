//! Rays against triangles and quadrics: no leak, no self-hit, and a BVH that gives the bits of the brute-force loop.

use glam::{Vec3, vec3};
use rayon::prelude::*;
use rootn::accel::brute::Brute;
use rootn::accel::bvh::Bvh;
use rootn::accel::simd::Portable;
use rootn::accel::{Hit, Intersect, Ray, SurfacePoint, leave, segment};
use rootn::scene::{Geometry, Scene, Shape, Triangle};

/// xorshift64*: plain uniform numbers, fast.
struct Random(u64);

impl Random {
    fn new(test: &str, stream: usize) -> Self {
        Self((crate::support::seed(test) ^ (stream as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)) | 1)
    }
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }
    fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 33) as usize % n
    }
    /// In the cube [−1, 1]³.
    fn cube(&mut self) -> Vec3 {
        vec3(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
    /// On the unit sphere.
    fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if (1e-2..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// Triangles without shared vertices as one mesh.
pub(crate) fn scene(triangles: &[[Vec3; 3]]) -> Scene {
    let n = triangles.len() as u32;
    let geometry = Geometry::Mesh { range: 0..n, smooth: false, uvs: false };
    Scene {
        positions: triangles.iter().flatten().copied().collect(),
        normals: vec![Vec3::ZERO; 3 * triangles.len()],
        triangles: (0..n).map(|i| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], shape: 0 }).collect(),
        shapes: vec![Shape { geometry, front: 0, back: 0, light: None, axes: Default::default(), name: "test".into() }],
        ..Scene::default()
    }
}

/// An icosahedron whose faces are split into four `levels` times, vertices on the unit sphere.
fn icosphere(levels: u32) -> Vec<[Vec3; 3]> {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let v = [
        vec3(-1.0, g, 0.0),
        vec3(1.0, g, 0.0),
        vec3(-1.0, -g, 0.0),
        vec3(1.0, -g, 0.0),
        vec3(0.0, -1.0, g),
        vec3(0.0, 1.0, g),
        vec3(0.0, -1.0, -g),
        vec3(0.0, 1.0, -g),
        vec3(g, 0.0, -1.0),
        vec3(g, 0.0, 1.0),
        vec3(-g, 0.0, -1.0),
        vec3(-g, 0.0, 1.0),
    ]
    .map(Vec3::normalize);
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut triangles: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(|i: usize| v[i])).collect();
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let m = |p: Vec3, q: Vec3| ((p + q) / 2.0).normalize();
                let (ab, bc, ca) = (m(a, b), m(b, c), m(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

/// A closed cube [−1, 1]³ with n² squares per face; the corners are exact, so that faces share their vertices.
fn cube(n: usize) -> Vec<[Vec3; 3]> {
    let at = |i: usize| 2.0 * i as f32 / n as f32 - 1.0;
    let mut out = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let p = |i: usize, j: usize| {
                let mut p = Vec3::splat(side);
                p[(axis + 1) % 3] = at(i);
                p[(axis + 2) % 3] = at(j);
                p
            };
            for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
                out.push([p(i, j), p(i + 1, j), p(i + 1, j + 1)]);
                out.push([p(i, j), p(i + 1, j + 1), p(i, j + 1)]);
            }
        }
    }
    out
}

/// A flat grid of n² squares with z = 0 over [0, n]².
fn grid(n: usize) -> Vec<[Vec3; 3]> {
    let p = |i: usize, j: usize| vec3(i as f32, j as f32, 0.0);
    (0..n * n)
        .map(|k| (k / n, k % n))
        .flat_map(|(i, j)| [[p(i, j), p(i + 1, j), p(i + 1, j + 1)], [p(i, j), p(i + 1, j + 1), p(i, j + 1)]])
        .collect()
}

fn moved(triangles: &[[Vec3; 3]], scale: f32, offset: Vec3) -> Vec<[Vec3; 3]> {
    triangles.iter().map(|t| t.map(|p| p * scale + offset)).collect()
}

fn forever(origin: Vec3, direction: Vec3) -> Ray {
    Ray::new(origin, direction, f32::INFINITY)
}

/// A corner, a point of an edge, or an inner point of one of the triangles.
fn target(r: &mut Random, triangles: &[[Vec3; 3]]) -> Vec3 {
    let t = &triangles[r.below(triangles.len())];
    match r.below(4) {
        0 => t[r.below(3)],
        1 | 2 => {
            let i = r.below(3);
            t[i].lerp(t[(i + 1) % 3], r.unit())
        }
        _ => t[0].lerp(t[1], r.unit()).lerp(t[2], r.unit()),
    }
}

/// Möller & Trumbore 1997 in f32, the test that is not watertight.
fn moeller_trumbore(ray: &Ray, t: &[Vec3; 3]) -> bool {
    let (e1, e2) = (t[1] - t[0], t[2] - t[0]);
    let p = ray.direction.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = ray.origin - t[0];
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = ray.direction.dot(q) * inverse;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(q) * inverse >= 0.0
}

/// The slab test without any padding.
fn unpadded_slabs(ray: &Ray, t: &[Vec3; 3]) -> bool {
    let (lo, hi) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let rcp = 1.0 / ray.direction;
    let (a, b) = ((lo - ray.origin) * rcp, (hi - ray.origin) * rcp);
    a.min(b).max_element().max(0.0) <= a.max(b).min_element()
}

const SCALES: [f32; 5] = [1e-5, 1e-2, 1.0, 1e3, 1e7];

/// Rays from inside a closed mesh all hit it; so do rays from outside that are aimed at points well inside its outline.
#[test]
fn closed_meshes_leak_no_ray() {
    const RAYS: usize = 200_000;
    let (mut traced, mut leaks) = (0, 0);
    for (k, mesh) in [icosphere(2), icosphere(5), cube(1), cube(37)].iter().enumerate() {
        for (i, scale) in SCALES.into_iter().enumerate() {
            for (j, radii) in [0.0, 1e2, 1e5].into_iter().enumerate() {
                let offset = vec3(0.61, -0.53, 0.59) * radii * scale;
                let triangles = moved(mesh, scale, offset);
                let bvh = Bvh::new(&scene(&triangles)).unwrap();
                leaks += (0..RAYS)
                    .into_par_iter()
                    .filter(|n| {
                        let r = &mut Random::new("leaks", n + RAYS * (i + 5 * (j + 3 * k)));
                        let aim = target(r, &triangles);
                        let outward = (aim - offset).normalize();
                        let ray = match r.below(4) {
                            0 => forever(r.cube() * 0.5 * scale + offset, r.direction()),
                            // The outline of a sphere seen from 3 radii is at cos = 1/3; cubes only from inside.
                            1 if k < 2 => {
                                let from = (outward + 0.5 * r.direction()).normalize() * 3.0 * scale + offset;
                                forever(from, aim - from)
                            }
                            _ => {
                                let from = r.cube() * 0.5 * scale + offset;
                                forever(from, aim - from)
                            }
                        };
                        bvh.closest(&ray).is_none() || !bvh.occluded(&ray)
                    })
                    .count();
                traced += RAYS;
            }
        }
    }
    assert_eq!(leaks, 0, "of {traced} rays");
}

/// The twin of the test above: on the same kind of rays Möller–Trumbore leaks.
#[test]
fn moeller_trumbore_leaks() {
    let triangles = icosphere(2);
    let leaks = (0..200_000)
        .into_par_iter()
        .filter(|&n| {
            let r = &mut Random::new("moeller", n);
            let aim = target(r, &triangles);
            let from = r.cube() * 0.5;
            let ray = forever(from, aim - from);
            !triangles.iter().any(|t| moeller_trumbore(&ray, t))
        })
        .count();
    assert!(leaks > 100, "{leaks} leaks: the rays above are too easy");
}

/// A kind of scene and of rays for the comparison with brute force.
struct Kind {
    name: &'static str,
    triangles: Vec<[Vec3; 3]>,
    ray: fn(&mut Random, &[[Vec3; 3]]) -> Ray,
}

fn aimed(r: &mut Random, triangles: &[[Vec3; 3]]) -> Ray {
    let aim = target(r, triangles);
    let from = r.cube() * 2.0;
    forever(from, if r.below(2) == 0 { r.direction() } else { aim - from })
}

/// Along an axis (zeros of either sign, or tiny), from points of the grid's lattice as often as not.
fn axis_aligned(r: &mut Random, triangles: &[[Vec3; 3]]) -> Ray {
    let small = [0.0, -0.0, 1e-45, -1e-38, 1e-20, -1e-7];
    let mut d = vec3(small[r.below(6)], small[r.below(6)], small[r.below(6)]);
    d[r.below(3)] = if r.below(2) == 0 { 1.0 } else { -1.0 };
    let aim = target(r, triangles);
    forever(aim - d * [0.0, 1.0, 3.5, 100.0][r.below(4)], d)
}

fn kinds() -> Vec<Kind> {
    let r = &mut Random::new("kinds", 0);
    const N: usize = 20_000;
    let soup = (0..N)
        .map(|_| {
            let c = r.cube();
            let size = 0.3 * r.unit().powi(3);
            [c + r.cube() * size, c + r.cube() * size, c + r.cube() * size]
        })
        .collect::<Vec<_>>();
    let slivers = (0..N)
        .map(|_| {
            let (a, b) = (r.cube(), r.cube());
            [a, b, a.lerp(b, r.unit()) + r.cube() * 10f32.powf(-2.0 - 7.0 * r.unit())]
        })
        .collect();
    let mut degenerate: Vec<[Vec3; 3]> = (0..N / 4)
        .map(|i| {
            let [a, b, c] = soup[i];
            match r.below(4) {
                0 => [a, a, b],
                1 => [a, b, a.lerp(b, 0.5)],
                2 => [a, a, a],
                _ => [a, b, c],
            }
        })
        .collect();
    degenerate.extend_from_within(..);
    degenerate.extend(vec![soup[0]; N / 4]);
    degenerate.extend(soup[..N / 4].iter().map(|&[a, b, c]| [c, b, a]));
    vec![
        Kind { name: "soup", triangles: soup, ray: aimed },
        Kind { name: "icosphere", triangles: icosphere(5), ray: aimed },
        Kind { name: "grid", triangles: grid(100), ray: axis_aligned },
        Kind { name: "cube", triangles: cube(57), ray: axis_aligned },
        Kind { name: "slivers", triangles: slivers, ray: aimed },
        Kind { name: "degenerate and duplicate", triangles: degenerate, ray: aimed },
    ]
}

/// Bit for bit, for whole rays and for segments that end before, on and after the hit, with AVX2 and without.
#[test]
fn bvh_equals_brute_force() {
    for Kind { name, triangles, ray } in kinds() {
        let s = scene(&triangles);
        let (bvh, brute) = (Bvh::new(&s).unwrap(), Brute::new(&s).unwrap());
        let same = |ray: &Ray| {
            let expected = brute.closest(ray);
            let bits = |h: &Option<Hit>| h.map(|h| (h.t.to_bits(), h.primitive, h.u.to_bits(), h.v.to_bits()));
            let equal = bits(&bvh.closest(ray)) == bits(&expected)
                && bits(&bvh.closest_with(Portable, ray)) == bits(&expected)
                && bvh.occluded(ray) == expected.is_some()
                && bvh.occluded_with(Portable, ray) == expected.is_some();
            (equal, expected)
        };
        let rays = 50_000;
        let hits = (0..rays / 2)
            .into_par_iter()
            .map(|n| {
                let r = &mut Random::new(name, n);
                let ray = ray(r, &triangles);
                let (equal, hit) = same(&ray);
                assert!(equal, "{name}: {ray:?}");
                let Some(hit) = hit else { return 0 };
                let t_max = [hit.t, hit.t.next_up(), hit.t.next_down(), hit.t * r.unit(), hit.t * 1.5][r.below(5)];
                let segment = Ray { t_max, ..ray };
                let (equal, end) = same(&segment);
                assert!(equal, "{name}: {segment:?}");
                assert!(end.is_none_or(|e| e.t < t_max), "{name}: {segment:?} {end:?}");
                1
            })
            .sum::<usize>();
        assert!(hits > rays / 20, "{name}: only {hits} hits");
    }
}

/// Directions with negative zeros (obvhs' stock traversal misses all of these).
#[test]
fn negative_zero_directions_hit() {
    for mesh in [icosphere(3), cube(4)] {
        let bvh = Bvh::new(&scene(&mesh)).unwrap();
        for signs in 0..64 {
            let mut d = [0, 1, 2].map(|a| if signs >> a & 1 == 1 { -0.0f32 } else { 0.0 });
            d[signs as usize / 8 % 3] = if signs >= 32 { -1.0 } else { 1.0 };
            for origin in [Vec3::ZERO, vec3(-0.0, 0.0, -0.0), vec3(0.25, 0.125, -0.5)] {
                let ray = forever(origin, d.into());
                assert!(bvh.closest(&ray).is_some_and(|h| h.t > 0.1 && h.t < 2.0), "{ray:?}");
            }
        }
    }
}

/// No floor on t: a wall 9e-5, 1e-20 or one denormal away is hit, at that distance; a wall behind is not.
#[test]
fn near_walls_are_hit() {
    let quad = [[vec3(-1.0, 0.0, -1.0), vec3(1.0, 0.0, -1.0), vec3(1.0, 0.0, 1.0)]];
    let bvh = Bvh::new(&scene(&quad)).unwrap();
    for gap in [9e-5, 1e-7, 1e-20, 1e-38, 1e-44] {
        for d in [vec3(0.0, -1.0, 0.0), vec3(0.3, -0.8, -0.2)] {
            let start = vec3(0.4, gap, -0.3);
            let hit = bvh.closest(&forever(start, d)).expect("the wall");
            let exact = -gap / d.y;
            assert!(
                (hit.t - exact).abs() <= 2.0 * exact.next_up() * f32::EPSILON + f32::MIN_POSITIVE,
                "{hit:?} {exact}"
            );
            assert!(bvh.closest(&forever(start, -d)).is_none());
            assert!(bvh.closest(&forever(vec3(start.x, -gap, start.z), d)).is_none());
        }
    }
}

/// Rays from above a flat grid aimed at its inner edges and vertices; the same rays miss when slabs are not padded.
#[test]
fn grid_edges_are_hit_and_need_padding() {
    for n in [64, 500] {
        let triangles = grid(n);
        let bvh = Bvh::new(&scene(&triangles)).unwrap();
        let inner = |r: &mut Random| 1.0 + r.below(n - 1) as f32;
        let (missed, unpadded) = (0..1_000_000)
            .into_par_iter()
            .map(|k| {
                let r = &mut Random::new("grid edges", k);
                let along = inner(r) + if r.below(2) == 0 { 0.0 } else { r.unit() - 0.5 };
                let mut aim = [inner(r), along];
                aim.rotate_left(r.below(2));
                let from = vec3(r.unit(), r.unit(), 0.0) * n as f32 + Vec3::Z * (0.1 + 9.9 * r.unit());
                let ray = forever(from, vec3(aim[0], aim[1], 0.0) - from);
                match bvh.closest(&ray) {
                    None => (1, 0),
                    Some(h) => (0, usize::from(!unpadded_slabs(&ray, &triangles[h.primitive as usize]))),
                }
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        assert_eq!(missed, 0, "grid {n}");
        assert!(unpadded > 100, "grid {n}: {unpadded} rays need the padding: the rays are too easy");
    }
}

/// A direction on the side of `n`, as often as not nearly in the surface.
fn hemisphere(r: &mut Random, n: Vec3) -> Vec3 {
    let d = r.direction();
    let d = if d.dot(n) < 0.0 { -d } else { d };
    let grazing = if r.below(2) == 0 { 10f32.powf(-5.0 * r.unit()) } else { 1.0 };
    let d = (d - n * d.dot(n) * (1.0 - grazing)).normalize();
    if d.dot(n) > 0.0 { d } else { n }
}

/// A shape made of one quadric.
fn quadric(geometry: Geometry) -> Scene {
    let shape = Shape { geometry, front: 0, back: 0, light: None, axes: Default::default(), name: "test".into() };
    Scene { shapes: vec![shape], ..Scene::default() }
}

/// Convex or flat shapes at all scales and offsets (up to 1e3 radii: beyond, f32 has no such spheres), with their size.
fn convex_shapes(n: usize) -> (Scene, Vec3, f32, bool, Vec3) {
    let r = &mut Random::new("shapes", n);
    let scale = SCALES[n / 6 % 5] * (0.5 + r.unit());
    let offset = r.direction() * scale * [0.0, 1.0, 30.0, 1e3][n / 30 % 4];
    let (u, v) = (r.direction() * scale, r.direction() * scale);
    let flat = [2, 3, 4].contains(&(n % 6));
    let s = match n % 6 {
        0 => scene(&moved(&icosphere(2), scale, offset)),
        1 => quadric(Geometry::Sphere { center: offset, radius: scale, flip: false }),
        2 => scene(&[[offset, offset + u, offset + v]]),
        3 => scene(&[[offset, offset + u, offset + u + v], [offset, offset + u + v, offset + v]]),
        4 => quadric(Geometry::Disk { center: offset, u, v: u.cross(v).normalize() * scale }),
        _ => quadric(Geometry::Cylinder { p0: offset - u / 2.0, axis: u, radius: scale * 0.4, flip: false }),
    };
    (s, offset, scale, flat, u + v)
}

/// Rays that leave a flat shape on either side, or a convex one outwards, never find it again.
#[test]
fn leaving_rays_do_not_find_their_own_surface() {
    let found: Vec<[usize; 2]> = (0..360)
        .into_par_iter()
        .map(|n| {
            let (s, offset, scale, flat, diagonal) = convex_shapes(n);
            let bvh = Bvh::new(&s).unwrap();
            let r = &mut Random::new("leave", n);
            let (mut left, mut own) = (0, 0);
            while left < 3000 {
                let from = offset + r.direction() * scale * 3.0;
                let aim = if flat { offset + diagonal * (0.4 * r.unit()) } else { offset + r.cube() * 0.5 * scale };
                let ray = forever(from, aim - from);
                let Some(hit) = bvh.closest(&ray) else {
                    left += 1;
                    continue;
                };
                let p = s.surface_point(&ray, &hit);
                let side = if p.ng.dot(ray.direction) > 0.0 { -p.ng } else { p.ng };
                if !flat && side != p.ng {
                    continue; // the inside of an open cylinder
                }
                let side = if flat && r.below(2) == 0 { -side } else { side };
                let again = leave(&p, hemisphere(r, side));
                own += usize::from(bvh.closest(&again).is_some());
                left += 1;
            }
            [own, n % 6]
        })
        .collect();
    let mut per_shape = [0; 6];
    found.iter().for_each(|[own, shape]| per_shape[*shape] += own);
    assert_eq!(per_shape, [0; 6], "of 180000 rays each");
}

/// Without the offset the same rays do find their surface.
#[test]
fn unmoved_rays_find_their_own_surface() {
    let mut own = 0;
    for n in 0..60 {
        let (s, offset, scale, ..) = convex_shapes(n);
        let bvh = Bvh::new(&s).unwrap();
        let r = &mut Random::new("unmoved", n);
        for _ in 0..200 {
            let from = offset + r.direction() * scale * 3.0;
            let ray = forever(from, offset + r.cube() * 0.3 * scale - from);
            if let Some(hit) = bvh.closest(&ray) {
                let p = s.surface_point(&ray, &hit);
                let side = if p.ng.dot(ray.direction) > 0.0 { -p.ng } else { p.ng };
                own += usize::from(bvh.closest(&forever(p.p, hemisphere(r, side))).is_some());
            }
        }
    }
    assert!(own > 100, "{own}");
}

/// In a convex room every two points of different walls see each other. Left out: points that lie, to within their error,
/// in two walls at once, since f32 may put them behind the other one.
#[test]
fn segments_in_a_convex_room_are_free() {
    let (blocked, corners) = (0..120)
        .into_par_iter()
        .map(|n| {
            let r = &mut Random::new("room", n);
            let scale = SCALES[n / 3 % 5];
            let offset = r.direction() * scale * [0.0, 1.0, 30.0, 1e3][n / 15 % 4];
            let turn = glam::Quat::from_rotation_arc(Vec3::Z, r.direction());
            let room = match n % 3 {
                0 => icosphere(1),
                1 => cube(3),
                _ => cube(2).iter().map(|t| t.map(|p| turn * p)).collect(),
            };
            let room = moved(&room, scale, offset);
            let s = scene(&room);
            let bvh = Bvh::new(&s).unwrap();
            let mut point = || {
                let ray = forever(offset + r.cube() * 0.3 * scale, r.direction());
                s.surface_point(&ray, &bvh.closest(&ray).expect("a wall"))
            };
            let in_corner = |p: &SurfacePoint| {
                room.iter().map(|t| t.map(Vec3::as_dvec3)).any(|[a, b, c]| {
                    let n = (b - a).cross(c - a).normalize();
                    let near = n.dot(p.p.as_dvec3() - a).abs() < 4.0 * n.abs().dot(p.p_error.as_dvec3());
                    near && n.dot(p.ng.as_dvec3()).abs() < 0.999
                })
            };
            let (mut blocked, mut corners) = (0, 0);
            for _ in 0..5000 {
                let (p, q) = (point(), point());
                // One wall: in its own plane there is nothing to see.
                if p.ng.dot(q.ng).abs() < 0.999 && bvh.occluded(&segment(&p, &q)) {
                    let corner = in_corner(&p) || in_corner(&q);
                    corners += usize::from(corner);
                    blocked += usize::from(!corner);
                }
            }
            (blocked, corners)
        })
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    assert!(blocked == 0 && corners < 20, "blocked: {blocked}, in corners {corners}");
}

/// A screen just before either end of a segment, by a few of the error bounds, is found.
#[test]
fn screens_near_the_ends_are_found() {
    let missed: usize = (0..4000)
        .into_par_iter()
        .map(|n| {
            let r = &mut Random::new("screens", n);
            let scale = SCALES[n % 5];
            let offset = r.direction() * scale * [0.0, 1.0, 30.0][n / 5 % 3];
            let (u, v) = (r.direction() * scale, r.direction() * scale);
            let wall = |at: Vec3| [at - u - v, at + 3.0 * u - v, at - u + 3.0 * v];
            let n = u.cross(v).normalize();
            if n.is_nan() || u.cross(v).length() < 0.1 * scale * scale {
                return 0;
            }
            let far = offset + n * scale * 2.0;
            let walls = scene(&[wall(offset), wall(far)]);
            let bvh = Bvh::new(&walls).unwrap();
            let middle = offset + n * scale + (u + v) * 0.3;
            let to = |d: Vec3| {
                let ray = forever(middle, d);
                walls.surface_point(&ray, &bvh.closest(&ray).expect("a wall"))
            };
            let (p, q) = (to(-n + 0.1 * u / scale), to(n + 0.1 * v / scale));
            let free = !bvh.occluded(&segment(&p, &q));
            let gap = 16.0 * (q.p_error.max(p.p_error).max_element() + f32::EPSILON * (q.p - p.p).length());
            let screens = [wall(offset + n * gap), wall(far - n * gap)];
            let all = screens.iter().all(|s| {
                let with = Bvh::new(&scene(&[wall(offset), wall(far), *s])).unwrap();
                with.occluded(&segment(&p, &q))
            });
            usize::from(!free || !all)
        })
        .sum();
    assert_eq!(missed, 0);
}

/// Quadric hits against the plain quadratic formula in f64, where that is well conditioned; points lie on the surface,
/// normals are right, and `flip` turns them.
#[test]
fn quadrics_match_the_closed_form() {
    let hits: usize = (0..60_000)
        .into_par_iter()
        .map(|k| {
            let r = &mut Random::new("quadrics", k);
            let scale = SCALES[k / 3 % 5];
            let c = r.cube() * scale * 3.0;
            let from = c + r.cube() * scale * 4.0;
            let direction = (c + r.cube() * scale - from) * 10f32.powf(4.0 * r.unit() - 2.0);
            let flip = r.below(2) == 0;
            let (u, v) = (r.direction() * scale, r.direction() * scale);
            let geometry = match k % 3 {
                0 => Geometry::Sphere { center: c, radius: scale, flip },
                1 => Geometry::Disk { center: c, u, v },
                _ => Geometry::Cylinder { p0: c, axis: u, radius: scale * 0.5, flip },
            };
            let (o, d, c) = (from.as_dvec3(), direction.as_dvec3(), c.as_dvec3());
            let (u, v, scale) = (u.as_dvec3(), v.as_dvec3(), f64::from(scale));
            // (all t, the implicit function that is 0 on the surface, in units of length)
            let quadratic = |q: glam::DVec3, w: glam::DVec3, radius: f64| {
                let (a, b, c) = (w.dot(w), 2.0 * q.dot(w), q.dot(q) - radius * radius);
                let root = (b * b - 4.0 * a * c).sqrt();
                vec![(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)]
            };
            let axis = u.normalize();
            let across = |x: glam::DVec3| x - axis * x.dot(axis);
            let all: Vec<f64> = match k % 3 {
                0 => quadratic(o - c, d, scale),
                1 => {
                    let n = u.cross(v);
                    let t = n.dot(c - o) / n.dot(d);
                    let q = o + d * t - c;
                    let m = glam::DMat3::from_cols(u, v, n).inverse() * q;
                    if m.x * m.x + m.y * m.y <= 1.0 { vec![t] } else { vec![] }
                }
                _ => quadratic(across(o - c), across(d), scale * 0.5)
                    .into_iter()
                    .filter(|t| (0.0..=u.length()).contains(&(o + d * *t - c).dot(axis)))
                    .collect(),
            };
            let expected = all.into_iter().find(|t| *t >= 0.0);
            let s = quadric(geometry);
            let ray = forever(from, direction);
            let hit = Bvh::new(&s).unwrap().closest(&ray);
            assert_eq!(hit, Brute::new(&s).unwrap().closest(&ray));
            assert_eq!(hit.is_some(), expected.is_some(), "{ray:?} {s:?}");
            let (Some(hit), Some(t)) = (hit, expected) else { return 0 };
            assert!((f64::from(hit.t) - t).abs() <= 1e-7 * t + 1e-9 * scale / d.length(), "{} {t}", hit.t);
            let p = s.surface_point(&ray, &hit);
            let q = p.p.as_dvec3() - c;
            let bound = p.p_error.as_dvec3().dot(p.ng.abs().as_dvec3()) * 1.001;
            let (off, outward) = match k % 3 {
                0 => (q.length() - scale, q),
                1 => (q.dot(u.cross(v).normalize()), u.cross(v)),
                _ => (across(q).length() - scale * 0.5, across(q)),
            };
            assert!(off.abs() <= bound, "{off} {bound}");
            let sign = if flip && k % 3 != 1 { -1.0 } else { 1.0 };
            assert!((p.ng.as_dvec3() * sign).dot(outward.normalize()) > 1.0 - 1e-6);
            1
        })
        .sum();
    assert!(hits > 20_000, "{hits}");
}

/// Spheres seen from up to 1e5 radii: hit or missed by the distance of the ray from the centre, and the surface point lies
/// on the ray although t as f32 is off by many radii's worth of roundings.
#[test]
fn far_spheres_are_exact() {
    let near_miss: usize = (0..60_000)
        .into_par_iter()
        .map(|k| {
            let r = &mut Random::new("far", k);
            let radius = SCALES[k % 5];
            let center = r.cube() * radius * 10.0;
            let distance = 10f32.powf(1.0 + 4.0 * r.unit()) * radius;
            let from = center + r.direction() * distance;
            let direction = center + r.direction() * radius * (1.0 + 0.01 * (r.unit() - 0.5)) - from;
            let s = quadric(Geometry::Sphere { center, radius, flip: false });
            let ray = forever(from, direction);
            let hit = Bvh::new(&s).unwrap().closest(&ray);
            let (o, d, c) = (from.as_dvec3(), direction.as_dvec3().normalize(), center.as_dvec3());
            let off = (c - o).cross(d).length() / f64::from(radius);
            if (off - 1.0).abs() > 1e-9 {
                assert_eq!(hit.is_some(), off < 1.0, "{off} {ray:?} {s:?}");
            }
            if let Some(hit) = hit {
                let p = s.surface_point(&ray, &hit);
                let from_line = (p.p.as_dvec3() - o).cross(d).length();
                assert!(from_line <= f64::from(p.p_error.length()), "{from_line} {}", p.p_error);
            }
            usize::from((off - 1.0).abs() < 1e-3)
        })
        .sum();
    assert!(near_miss > 100, "{near_miss}");
}

/// Nested triangles whose sizes span 45 orders of magnitude make a deep tree.
#[test]
fn deep_trees_equal_brute_force() {
    let nested: Vec<_> = (-300..120)
        .map(|i| {
            let size = 1.3f32.powi(i);
            [vec3(size, 0.0, 0.0), vec3(0.0, size, 0.0), vec3(0.0, 0.0, size)]
        })
        .collect();
    let s = scene(&nested);
    let (bvh, brute) = (Bvh::new(&s).unwrap(), Brute::new(&s).unwrap());
    let mut hits = 0;
    for k in 0..5000 {
        let r = &mut Random::new("deep", k);
        let aim = target(r, &nested);
        let ray = match k % 3 {
            0 => forever(aim * 2.0, -aim),
            1 => forever(Vec3::ZERO, aim),
            _ => forever(aim * 2.0, r.direction()),
        };
        let hit = brute.closest(&ray);
        assert_eq!(bvh.closest(&ray), hit);
        assert_eq!(bvh.occluded(&ray), hit.is_some());
        hits += usize::from(hit.is_some());
    }
    assert!(hits > 3000, "{hits}");
}

/// Rays that break the contract (zero, infinite, NaN) end, and do not panic.
#[test]
fn unlawful_rays_end() {
    let mut s = scene(&icosphere(3));
    s.shapes.extend(quadric(Geometry::Sphere { center: Vec3::ZERO, radius: 0.5, flip: false }).shapes);
    let (bvh, brute) = (Bvh::new(&s).unwrap(), Brute::new(&s).unwrap());
    let odd = [0.0, -0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, 1e-45];
    for k in 0..20_000 {
        let r = &mut Random::new("unlawful", k);
        let mut v = || Vec3::from_array([0; 3].map(|_| odd[r.below(odd.len())]));
        let (origin, direction, t_max) = (v(), v(), v().x);
        let ray = Ray::new(origin, direction, t_max);
        bvh.closest(&ray);
        bvh.occluded(&ray);
        brute.closest(&ray);
    }
}

/// The error bound of triangle points holds: the exact plane is within it.
#[test]
fn triangle_points_lie_within_their_error() {
    (0..200_000).into_par_iter().for_each(|k| {
        let r = &mut Random::new("points", k);
        let scale = SCALES[k % 5];
        let offset = r.direction() * scale * [0.0, 1.0, 1e3][k / 5 % 3];
        let t = [0; 3].map(|_| r.cube() * scale + offset);
        let s = scene(&[t]);
        let (u, v) = (r.unit(), r.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = s.surface_point(&forever(Vec3::ZERO, Vec3::X), &Hit { t: 1.0, primitive: 0, u, v });
        let [a, b, c] = t.map(Vec3::as_dvec3);
        let exact = a + (b - a) * f64::from(u) + (c - a) * f64::from(v);
        let error = (p.p.as_dvec3() - exact).abs();
        assert!(error.cmple(p.p_error.as_dvec3()).all(), "{error} {}", p.p_error);
        assert!(p.ng.as_dvec3().dot((b - a).cross(c - a).normalize()) > 1.0 - 1e-6);
    });
}

/// Many copies of one triangle, and of one point: the tree stays finite, the lowest index wins.
#[test]
fn duplicates_build_and_the_lowest_index_wins() {
    let t = [vec3(-1.0, -1.0, 0.0), vec3(1.0, -1.0, 0.0), vec3(0.0, 1.0, 0.0)];
    let point = [vec3(0.1, 0.1, 0.5); 3];
    for (copies, lowest) in [(vec![t; 3000], 0), ([vec![point; 3000], vec![t; 50]].concat(), 3000)] {
        let s = scene(&copies);
        let ray = forever(vec3(0.1, 0.1, 1.0), vec3(0.0, 0.0, -1.0));
        assert_eq!(Bvh::new(&s).unwrap().closest(&ray).map(|h| h.primitive), Some(lowest));
    }
    let empty = Bvh::new(&Scene::default()).unwrap();
    assert!(empty.closest(&forever(Vec3::ZERO, Vec3::X)).is_none() && !empty.occluded(&forever(Vec3::ZERO, Vec3::X)));
}

/// What cannot be traced is refused, with the shape's name.
#[test]
fn untraceable_coordinates_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, 1e20] {
        let mut s = scene(&icosphere(0));
        s.positions[7].y = bad;
        let message = Bvh::new(&s).err().expect("an error").to_string();
        assert!(message.contains("'test'"), "{message}");
    }
    let mut s = scene(&icosphere(0));
    s.triangles[3].vertices[1] = 1000;
    assert!(Bvh::new(&s).is_err());
}
