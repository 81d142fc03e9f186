//! Samples and rays per second on every device and by every traversal: `cargo bench --bench gpu`. With `-- large` also a mesh
//! of ten million triangles. Devices: the CPU engine, and the best Vulkan device or `ROOTN_TEST_DEVICE=INDEX`.
//! Medians of five rounds of about half a second each, set-up apart; GPU times are kernel times, by timestamps.

use rootn::estimator::choice::{Traversal, Which};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::vulkan::{Device, DeviceScene, Tuning, VulkanEstimator};
use rootn::estimator::{Cell, Estimate, Estimator};
use rootn::math::Vec3;
use rootn::sampling::strategy::Preset;
use rootn::sampling::{Draw, Key, Sequence};
use rootn::scene::{Bsdf, Geometry, Light, Material, Scene, Shape, Triangle};
use rootn::transport::sink::Bounce;
use rootn::transport::{Contribution, Sink, Vertex};
use std::sync::Arc;
use std::time::Instant;

/// Film of the measured scenes.
const FILM: [u32; 2] = [256, 256];

fn cell(n: u64) -> Cell {
    Cell { key: Key([1, 2]), length: n }
}

/// Median seconds per sample, of five rounds of about half a second each.
fn seconds_per_sample(estimator: &dyn Estimator) -> f64 {
    let pixels = estimator.shape().pixels() as f64;
    let run = |n: u64| estimator.estimate(&cell(n), n, &mut None).unwrap().seconds / n as f64;
    // The first round is for warming up, the next for choosing the number of samples.
    run(1);
    let n = ((0.5 / run(4)) as u64).clamp(1, 4096);
    let mut rounds: Vec<f64> = (0..5).map(|_| run(n)).collect();
    rounds.sort_by(f64::total_cmp);
    rounds[2] / pixels
}

/// Counts the rays of paths without light sampling: one to each vertex, and one that escapes or is not followed.
#[derive(Default)]
struct Rays(u64);

impl Sink for Rays {
    fn vertex(&mut self, _: &Vertex) {}
    fn contribution(&mut self, _: &Contribution) {}
    fn bounce(&mut self, _: &Bounce) {
        self.0 += 1;
    }
}

/// Rays per sample of `importance`.
fn rays_per_sample(prepared: &Arc<PreparedScene>) -> f64 {
    let estimator = CpuEstimator::new(Arc::clone(prepared), Preset::Importance.strategy());
    let mut rays = Rays::default();
    let pixels = estimator.shape().pixels() as u32;
    let count = 4096;
    for i in 0..count {
        let pixel = (i * 16) % pixels;
        let draw = Draw { key: Key([1, 2]), pixel, sample: u64::from(i), length: 1, sequence: Sequence::Independent };
        estimator.sample_with(&draw, &mut rays);
    }
    1.0 + rays.0 as f64 / f64::from(count)
}

/// An empty scene with a camera, and one diffuse material of number 1.
fn empty() -> Scene {
    let mut scene = Scene {
        materials: vec![Material::BLACK, Bsdf::Diffuse { reflectance: Vec3::splat(0.7) }.into()],
        ..Scene::default()
    };
    scene.film.size = FILM;
    scene.film.crop_size = FILM;
    scene.depth.max = Some(8);
    scene.camera.origin = Vec3::new(0.0, 1.2, 3.0);
    scene.camera.corner = Vec3::new(-0.7, 0.4, -1.0);
    scene.camera.across = Vec3::X * 1.4;
    scene.camera.down = Vec3::new(0.0, -1.3, -0.3);
    scene
}

fn add(scene: &mut Scene, geometry: Geometry, radiance: f32) {
    let shape = scene.shapes.len() as u32;
    let light = (radiance > 0.0).then_some(scene.lights.len() as u32);
    if light.is_some() {
        scene.lights.push(Light::Area { shape, radiance: Vec3::splat(radiance) });
    }
    scene.shapes.push(Shape { geometry, front: 1, back: 1, light, axes: Default::default(), name: String::new() });
}

/// A waving ground of 2·side² triangles under a small sun and a sky.
fn ground(side: u32) -> Scene {
    let mut scene = empty();
    let height = |x: f32, z: f32| 0.1 * (7.0 * x).sin() * (5.0 * z).cos() + 0.01 * (90.0 * x).sin() * (110.0 * z).sin();
    for j in 0..=side {
        for i in 0..=side {
            let (x, z) = (4.0 * i as f32 / side as f32 - 2.0, 4.0 * j as f32 / side as f32 - 2.0);
            scene.positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    scene.normals = vec![Vec3::ZERO; scene.positions.len()];
    let at = |i: u32, j: u32| j * (side + 1) + i;
    for j in 0..side {
        for i in 0..side {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            scene.triangles.push(Triangle { vertices: [a, b, c], shape: 0 });
            scene.triangles.push(Triangle { vertices: [a, c, d], shape: 0 });
        }
    }
    add(&mut scene, Geometry::Mesh { range: 0..2 * side * side, smooth: false, uvs: false }, 0.0);
    add(&mut scene, Geometry::Sphere { center: Vec3::new(2.0, 4.0, 1.0), radius: 0.3, flip: false }, 40.0);
    scene.lights.push(Light::Constant { radiance: Vec3::splat(0.5) });
    scene
}

/// Four balls of light from small and bright to large and dim above a floor and in front of a wall, after Veach 1997, fig. 9.2.
fn balls() -> Scene {
    let mut scene = empty();
    for (center, u, v) in [(Vec3::ZERO, Vec3::X, -Vec3::Z), (Vec3::new(0.0, 1.0, -2.0), Vec3::X, Vec3::Y)] {
        add(&mut scene, Geometry::Disk { center, u: u * 6.0, v: v * 6.0 }, 0.0);
    }
    for (i, radius) in [0.02f32, 0.06, 0.18, 0.5].into_iter().enumerate() {
        let center = Vec3::new(-1.5 + i as f32, 1.0, -1.0);
        add(&mut scene, Geometry::Sphere { center, radius, flip: false }, 1.0 / (radius * radius));
    }
    scene
}

fn cornell(size: [u32; 2]) -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/scenes/cornell-box.xml");
    let mut scene = rootn::scene::format::load(path.as_ref(), &rootn::scene::format::Options::sized(size)).unwrap();
    scene.depth.max = Some(8);
    scene
}

fn row(scene: &str, engine: &str, setup: f64, mis: f64, importance: f64, rays: f64) {
    println!("| {scene} | {engine} | {setup:.2} | {:.3} | {:.3} |", 1e-6 / mis, 1e-6 * rays / importance);
}

fn measure(name: &str, scene: Scene, device: Option<&Arc<Device>>) {
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let rays = rays_per_sample(&prepared);
    let of = |preset: Preset| CpuEstimator::new(Arc::clone(&prepared), preset.strategy());
    let cpu = [Preset::Mis, Preset::Importance].map(|p| seconds_per_sample(&of(p)));
    row(name, "cpu", of(Preset::Mis).setup_seconds(), cpu[0], cpu[1], rays);
    let Some(device) = device else { return };
    let scene = Arc::new(DeviceScene::new(device, prepared).unwrap());
    for traversal in [Traversal::Compute, Traversal::RayQuery, Traversal::RayPipeline] {
        let tuning = Tuning { traversal, ..Tuning::default() };
        let estimators =
            [Preset::Mis, Preset::Importance].map(|p| VulkanEstimator::new(Arc::clone(&scene), p.strategy(), tuning));
        match estimators {
            [Ok(mis), Ok(importance)] => {
                let seconds = [seconds_per_sample(&mis), seconds_per_sample(&importance)];
                row(name, traversal.label(), mis.setup_seconds(), seconds[0], seconds[1], rays);
            }
            [Err(e), _] | [_, Err(e)] => println!("| {name} | {} | {e} | | |", traversal.label()),
        }
    }
}

/// √relMSE that the samples' own variances predict.
fn error(estimate: &Estimate) -> f64 {
    let moments = estimate.moments.as_ref().unwrap().fold();
    let term = |m: &rootn::moments::Moments| m.sample_variance().unwrap() / m.n as f64 / (m.mean * m.mean + 0.01);
    (moments.iter().map(term).sum::<f64>() / moments.len() as f64).sqrt()
}

/// Seconds to a wanted error at 854 × 480, with independent samples and MIS.
fn cost(engine: &str, estimator: &dyn Estimator) {
    let pilot = estimator.estimate(&cell(32), 32, &mut None).unwrap();
    for target in [0.05, 0.01] {
        let n = (32.0 * (error(&pilot) / target).powi(2)).ceil() as u64;
        let pace = pilot.seconds / 32.0;
        if pace * n as f64 > 60.0 {
            println!("| {engine} | {} % | {n} | {:.1} (from 32 spp) | |", 100.0 * target, pace * n as f64);
            continue;
        }
        let start = Instant::now();
        let estimate = estimator.estimate(&cell(n), n, &mut None).unwrap();
        println!(
            "| {engine} | {} % | {n} | {:.3} | {:.3} |",
            100.0 * target,
            estimate.seconds,
            start.elapsed().as_secs_f64()
        );
    }
}

fn main() {
    let large = std::env::args().any(|a| a == "large");
    let which = std::env::var("ROOTN_TEST_DEVICE").ok().and_then(|v| v.parse().ok()).map_or(Which::First, Which::Index);
    let device = Device::open(&which, false);
    match &device {
        Ok(d) => println!("{}, {}\n", d.info().name, d.info().driver),
        Err(e) => println!("{e}\n"),
    }
    let device = device.ok();
    println!("| scene | engine | set-up (s) | mis (million samples/s) | importance (million rays/s) |");
    println!("| --- | --- | --- | --- | --- |");
    measure("Cornell box", cornell(FILM), device.as_ref());
    measure("balls of light", balls(), device.as_ref());
    measure("1 M triangles", ground(707), device.as_ref());
    if large {
        measure("10 M triangles", ground(2236), device.as_ref());
    }
    println!("\nCornell box, 854 × 480, mis with independent samples:\n");
    println!("| engine | √relMSE | spp | seconds of sampling | wall clock (s) |");
    println!("| --- | --- | --- | --- | --- |");
    let prepared = Arc::new(PreparedScene::new(cornell([854, 480])).unwrap());
    cost("cpu", &CpuEstimator::new(Arc::clone(&prepared), Preset::Mis.strategy()));
    let Some(device) = device else { return };
    let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
    for traversal in [Traversal::Compute, Traversal::RayQuery, Traversal::RayPipeline] {
        let tuning = Tuning { traversal, ..Tuning::default() };
        if let Ok(estimator) = VulkanEstimator::new(Arc::clone(&scene), Preset::Mis.strategy(), tuning) {
            cost(traversal.label(), &estimator);
        }
    }
}
