//! Lanes: eight rays at once against brute force, and samples that must not depend on what shares their wave.

use crate::support::shared;
use rootn::accel::brute::Brute;
use rootn::accel::bvh::Bvh;
use rootn::accel::simd::{Portable, Registers};
use rootn::accel::{Intersect, NO_PRIMITIVE, Ray, Rays, SurfaceLanes};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimator, estimate_by_samples};
use rootn::math::{LANES, Vec3, Vec3Lanes};
use rootn::sampling::strategy::{Heuristic, LightChoice, Lights, Preset, Roulette, Strategy};
use rootn::sampling::{Key, Role};
use rootn::scene::format::{Options, load};
use rootn::scene::light::{LightSampler, LightSamples, LightTarget};
use rootn::scene::{Geometry, Scene, Shape, Triangle};
use rootn::transport::NoSink;
use std::path::PathBuf;
use std::sync::Arc;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Of the cube [−1, 1]³; every other time on a coarse lattice, so that rays meet edges, corners and planes to the last bit.
    fn point(&mut self) -> Vec3 {
        let p = Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
        if self.unit() < 0.5 { (p * 2.0).round() / 2.0 } else { p }
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f32) as usize
    }
}

fn soup(r: &mut Random, n: usize) -> Scene {
    let mut positions: Vec<Vec3> = Vec::new();
    while positions.len() < 3 * n {
        let [a, b, c, d] = [r.point(), r.point(), r.point(), r.point()];
        // Single triangles, and quadrilaterals cut along either diagonal, wound both ways.
        match r.below(4) {
            0 => positions.extend([a, b, c]),
            1 => positions.extend([a, b, c, a, c, d]),
            2 => positions.extend([b, c, a, d, a, c]),
            _ => positions.extend([a, c, b, c, d, b]),
        }
    }
    positions.truncate(3 * n);
    let n = n as u32;
    Scene {
        normals: vec![Vec3::ZERO; positions.len()],
        positions,
        triangles: (0..n).map(|i| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], shape: 0 }).collect(),
        shapes: vec![Shape {
            geometry: Geometry::Mesh { range: 0..n, smooth: false, uvs: false },
            front: 0,
            back: 0,
            light: None,
            axes: Default::default(),
            name: "soup".into(),
        }],
        ..Scene::default()
    }
}

fn ray(r: &mut Random, triangles: usize) -> Ray {
    let (origin, target) = (r.point(), r.point());
    let direction = if origin == target { Vec3::X } else { target - origin };
    let t_max = [f32::INFINITY, 1.0, 0.5][r.below(3)];
    let mut end = || if r.unit() < 0.5 { r.below(triangles) as u32 } else { NO_PRIMITIVE };
    let (from, to) = (end(), end());
    Ray { from, to, ..Ray::new(origin, direction, t_max) }
}

/// Bit for bit, and lanes that are not live stay out of it.
fn lanes_equal_brute_force(simd: impl Registers) {
    let r = &mut Random(1);
    let (mut hits, mut rays_cast) = (0, 0);
    for round in 0..400 {
        let n = [1, 2, 7, 36, 64, 65][round % 6];
        let scene = soup(r, n);
        let (bvh, brute) = (Bvh::new(&scene).unwrap(), Brute::new(&scene).unwrap());
        for _ in 0..20 {
            let mut rays = Rays::ZERO;
            (0..LANES).for_each(|lane| rays.set(lane, ray(r, n)));
            let live = 1 + r.below(u16::MAX.into()) as u32;
            let found = bvh.closest_lanes(simd, &rays, live);
            let occluded = bvh.occluded_lanes(simd, &rays, live);
            assert_eq!(occluded & !live, 0);
            for lane in (0..LANES).filter(|lane| live >> lane & 1 == 1) {
                let ray = rays.get(lane);
                let expected = brute.closest(&ray);
                assert_eq!(found.get(lane), expected, "{n} triangles, {ray:?}");
                assert_eq!(occluded >> lane & 1 == 1, expected.is_some(), "{n} triangles, {ray:?}");
                if let Some(hit) = expected {
                    assert!(hit.primitive != ray.from && hit.primitive != ray.to, "{ray:?}");
                }
                (hits, rays_cast) = (hits + usize::from(expected.is_some()), rays_cast + 1);
            }
        }
    }
    assert!(hits > rays_cast / 4 && hits < rays_cast, "{hits} of {rays_cast} rays hit");
}

#[test]
fn lanes_equal_brute_force_without_instructions() {
    lanes_equal_brute_force(Portable);
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_equal_brute_force_with_avx2() {
    if let Some(avx2) = rootn::accel::simd::Avx2::detect() {
        lanes_equal_brute_force(avx2);
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_equal_brute_force_with_avx512() {
    if let Some(avx512) = rootn::accel::simd::Avx512::detect() {
        lanes_equal_brute_force(avx512);
    }
}

/// Scenes with walls, quadrics, smooth meshes, points and environments as lights.
pub(crate) fn scenes() -> Vec<PathBuf> {
    let mut scenes = vec![PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/scenes/cornell-box.xml"))];
    if let Some(own) = shared("scenes/own") {
        scenes.extend(["lights.xml", "dragon.xml", "overcast.xml", "baffle.xml"].map(|f| own.join(f)));
    }
    scenes
}

/// Surfaces of a packet are those of its rays, one by one: triangles, smooth meshes, quadrics.
fn surfaces_equal_those_of_rays(registers: impl Registers) {
    let r = &mut Random(2);
    for path in scenes() {
        let scene = load(&path, &Options { allow_outside: true, ..Options::sized([7, 5]) }).unwrap();
        let bvh = Bvh::new(&scene).unwrap();
        let mut seen = 0;
        for _ in 0..100 {
            let mut rays = Rays::ZERO;
            for lane in 0..LANES {
                let (s, t) = (r.unit(), r.unit());
                let camera = &scene.camera;
                rays.set(
                    lane,
                    Ray::new(camera.origin, camera.corner + camera.across * s + camera.down * t, f32::INFINITY),
                );
            }
            let hits = bvh.closest_lanes(registers, &rays, (1 << LANES) - 1);
            let mut at = SurfaceLanes::NONE;
            bvh.surface_points(registers, &scene, &rays, &hits, hits.lanes(), &mut at);
            for lane in 0..LANES {
                let Some(hit) = hits.get(lane) else { continue };
                let alone = scene.surface_point(&rays.get(lane), &hit);
                assert_eq!(format!("{:?}", at.get(lane)), format!("{alone:?}"), "{}", path.display());
                let shape = &scene.shapes[alone.shape as usize];
                assert_eq!((at.front[lane], at.back[lane]), (shape.front, shape.back));
                assert_eq!(at.lights >> lane & 1 == 1, shape.light.is_some());
                seen += 1;
            }
        }
        assert!(seen > 100, "{}: {seen} hits", path.display());
    }
}

#[test]
fn surfaces_of_packets_are_those_of_rays() {
    surfaces_equal_those_of_rays(Portable);
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = rootn::accel::simd::Avx512::detect() {
        surfaces_equal_those_of_rays(avx512);
    }
}

/// Light samples of a packet are those of its points, one by one, also at points behind and on the lights.
#[test]
fn light_samples_of_packets_are_those_of_points() {
    let r = &mut Random(3);
    for path in scenes() {
        let scene = load(&path, &Options { allow_outside: true, ..Options::sized([7, 5]) }).unwrap();
        for lights in [Lights::Area, Lights::SolidAngle] {
            let sampler = LightSampler::new(&scene, lights, LightChoice::Power);
            let mut seen = 0;
            for _ in 0..100 {
                let mut p = Vec3Lanes::ZERO;
                (0..LANES).for_each(|lane| p.set(lane, if lane == 0 { scene.camera.origin } else { r.point() }));
                let words = std::array::from_fn(|_| std::array::from_fn(|_| (r.unit() * 4e9) as u32));
                let mut found = LightSamples::NONE;
                sampler.sample_lanes(&scene, &p, &words, (1 << LANES) - 1, &mut found);
                for lane in 0..LANES {
                    let alone = sampler.sample(&scene, p.get(lane), words.map(|w: [u32; LANES]| w[lane]));
                    assert_eq!(found.lanes >> lane & 1 == 1, alone.is_some(), "{}", path.display());
                    let Some(alone) = alone else { continue };
                    let lanes = (found.wi.get(lane), found.emitted.get(lane), found.pdf[lane], found.delta[lane]);
                    assert_eq!(lanes, (alone.wi, alone.emitted, alone.pdf, alone.delta));
                    assert_eq!(found.light[lane], alone.light);
                    if let LightTarget::Point(end) = alone.to {
                        assert_eq!(format!("{:?}", found.to.get(lane)), format!("{end:?}"));
                    }
                    seen += 1;
                }
            }
            assert!(seen > 100, "{}: {seen} samples", path.display());
        }
    }
}

/// What batches of samples leave (of several pixels, with the processor's widest instructions), what the same samples leave one by
/// one with plain ones, and what interrupted batches leave: the same bits.
#[test]
fn samples_do_not_depend_on_their_wave() {
    for path in scenes() {
        let scene = load(&path, &Options { allow_outside: true, ..Options::sized([7, 5]) }).unwrap();
        let prepared = Arc::new(PreparedScene::new(scene).unwrap());
        let more = [
            Strategy { lights: Lights::SolidAngle, ..Preset::Mis.strategy() },
            Strategy { heuristic: Heuristic::Maximum, roulette: Some(Roulette::Depth(2)), ..Preset::Mis.strategy() },
        ];
        let strategies = Preset::ALL.map(Preset::strategy).into_iter().chain(more);
        // Strata are placed in another way where their number is a power of two.
        for (strategy, n) in strategies.flat_map(|s| [(s, 100), (s, 128)]) {
            let estimator = CpuEstimator::new(prepared.clone(), strategy);
            let cell = |seed| Cell { key: Key::new(seed, Role::Run, "waves", 0), length: n };
            let whole = estimator.estimate(&cell(1), n, &mut None).unwrap();
            let one_by_one =
                estimate_by_samples(estimator.shape(), strategy.sequence, &cell(1), n, &mut None, |draw, out| {
                    let c = estimator.sample_with(draw, &mut NoSink);
                    out.copy_from_slice(&[c.x.into(), c.y.into(), c.z.into()]);
                });
            assert!(whole.moments == one_by_one.moments, "{}: {strategy:?}", path.display());
            if estimator.progressive() {
                let part = estimator.estimate(&cell(1), 37, &mut None).unwrap();
                let resumed = estimator.estimate(&cell(1), n, &mut Some(part)).unwrap();
                assert!(whole.moments == resumed.moments, "{}: {strategy:?}", path.display());
            }
            let other = estimator.estimate(&cell(2), n, &mut None).unwrap();
            assert!(whole.moments != other.moments, "{}: the comparison cannot fail", path.display());
        }
    }
}
