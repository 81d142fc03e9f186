//! Rays against triangles and quadrics: no leak, no self-hit, and a BVH that gives the bits of the brute-force loop.

use glam::{Vec3, vec3};
use rayon::prelude::*;
use rootn::accel::brute::Brute;
use rootn::accel::bvh::Bvh;
use rootn::accel::{Intersect, Ray};
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
fn scene(triangles: &[[Vec3; 3]]) -> Scene {
    let n = triangles.len() as u32;
    let geometry = Geometry::Mesh { range: 0..n, smooth: false };
    Scene {
        positions: triangles.iter().flatten().copied().collect(),
        normals: vec![Vec3::ZERO; 3 * triangles.len()],
        triangles: (0..n).map(|i| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], shape: 0 }).collect(),
        shapes: vec![Shape { geometry, front: 0, back: 0, light: None, name: "test".into() }],
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

#[test]
fn sanity() {
    let s = scene(&icosphere(3));
    let (bvh, brute) = (Bvh::new(&s).unwrap(), Brute::new(&s).unwrap());
    let bad = (0..100_000)
        .into_par_iter()
        .filter(|&i| {
            let mut r = Random::new("sanity", i);
            let ray = Ray { origin: r.cube() * 0.5, direction: r.direction(), t_max: f32::INFINITY };
            let (a, b) = (bvh.closest(&ray), brute.closest(&ray));
            a.is_none() || a != b || !bvh.occluded(&ray)
        })
        .count();
    assert_eq!(bad, 0);
}
