//! The path tracer on a Vulkan device against that on the CPU: sample by sample, since both draw the same numbers.
//!
//! The comparison is paired. Samples that differ by more than rounding are branches that went the other way (an edge missed by
//! an ulp, roulette at its threshold); they must be rare and balanced. What is bounded is the mean difference, 1e-4 of the
//! image's mean: an unpaired test of the same samples could not see it.

use crate::determinism::cornell;
use crate::effects::rare;
use crate::emitters::patterned;
use crate::support::{no_messages, vulkan};
use crate::waves::scenes;
use rootn::Error;
use rootn::estimator::choice::{Traversal, Which};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::vulkan::{Device, DeviceScene, Tuning, VulkanEstimator};
use rootn::estimator::{Cell, Estimate, Estimator};
use rootn::math::Vec3;
use rootn::moments::{BlockTree, Moments};
use rootn::record::Record;
use rootn::run::{Contender, Options, Plan, PlannedScene, ReferencePlan, Stop, powers_of_two};
use rootn::sampling::strategy::{Directions, Heuristic, LightChoice, Lights, NoRoulette, Preset, Roulette, Technique};
use rootn::sampling::{Key, Sequence, Strategy};
use rootn::scene::light::Beam;
use rootn::scene::{Bsdf, Effects, Geometry, Light, Material, Projection, Scene, format};
use rootn::stats::Metric;
use std::path::Path;
use std::sync::Arc;

/// Film of the compared images, pixels per side.
const FILM: u32 = 64;
/// Single samples per pixel that are compared: 25 · 64² = 102 400.
const RUNS: u32 = 25;
/// Largest mean difference, relative to the image's mean.
const MEAN: f64 = 1e-4;
/// Largest difference of a sample that rounding explains, relative.
const SAMPLE: f64 = 1e-3;
/// Largest share of samples that differ by more.
const FLIPS: f64 = 1e-3;

const TRAVERSALS: [Traversal; 3] = [Traversal::Compute, Traversal::RayQuery, Traversal::RayPipeline];

fn load(path: &Path, size: u32) -> Scene {
    let options = format::Options { allow_outside: true, ..format::Options::sized([size, size]) };
    format::load(path, &options).unwrap()
}

fn cell(run: u32, length: u64) -> Cell {
    Cell { key: Key([0x6770_7500 + run, 0x7465_7374]), length }
}

/// `None`, with the reason printed, where the device lacks the traversal.
fn estimator(scene: &Arc<DeviceScene>, strategy: Strategy, tuning: Tuning) -> Option<VulkanEstimator> {
    match VulkanEstimator::new(Arc::clone(scene), strategy, tuning) {
        Ok(e) => Some(e),
        Err(e @ Error::Unavailable { .. }) => {
            // CI's driver has all of them.
            assert!(std::env::var_os("CI").is_none(), "{e}");
            println!("left out: {e}");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// Single samples of every pixel, per run.
fn samples(estimator: &dyn Estimator, runs: u32) -> Vec<f64> {
    (0..runs).flat_map(|run| estimator.estimate(&cell(run, 1), 1, &mut None).unwrap().field).collect()
}

/// What a paired comparison finds.
#[derive(Debug, Default)]
struct Paired {
    /// Mean difference over the mean, and the same without flips.
    mean: f64,
    without_flips: f64,
    /// Samples, those that differ by more than rounding, and how many of these are larger in the second.
    count: usize,
    flips: usize,
    up: usize,
    /// Samples whose bits differ.
    unequal: usize,
}

impl Paired {
    fn new(first: &[f64], second: &[f64]) -> Self {
        assert_eq!(first.len(), second.len());
        let mut p = Self::default();
        let (mut sum, mut difference, mut small) = (0.0, 0.0, 0.0);
        for (a, b) in first.chunks(3).zip(second.chunks(3)) {
            assert!(a.iter().chain(b).all(|x| x.is_finite()));
            let (grey_a, grey_b): (f64, f64) = (a.iter().sum(), b.iter().sum());
            sum += grey_a;
            difference += grey_b - grey_a;
            p.count += 1;
            p.unequal += usize::from(a != b);
            if a.iter().zip(b).any(|(a, b)| (a - b).abs() > SAMPLE * a.abs().max(b.abs())) {
                p.flips += 1;
                p.up += usize::from(grey_b > grey_a);
            } else {
                small += grey_b - grey_a;
            }
        }
        (p.mean, p.without_flips) = (difference / sum, small / sum);
        p
    }

    /// Flips beyond balance: four standard deviations of a fair coin.
    fn unbalanced(&self) -> bool {
        let (n, up) = (self.flips as f64, self.up as f64);
        (up - n / 2.0).abs() > 2.0 * n.sqrt()
    }

    fn agrees(&self) -> bool {
        self.mean.abs() <= MEAN && self.flips as f64 <= FLIPS * self.count as f64 && !self.unbalanced()
    }

    fn line(&self, name: &str) -> String {
        format!(
            "{name:46} mean difference {:9.1e}, unequal bits {:6} of {}, flips {} ({} up)",
            self.mean, self.unequal, self.count, self.flips, self.up
        )
    }
}

fn name_of(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

/// What is wrong where a scene looks otherwise on the device than on the CPU. Samples that are 5e-4 brighter must look wrong.
fn disagreement(name: &str, scene: &Arc<DeviceScene>, prepared: &Arc<PreparedScene>, preset: Preset) -> Option<String> {
    let strategy = preset.strategy();
    let cpu = samples(&CpuEstimator::new(Arc::clone(prepared), strategy), RUNS);
    let gpu = samples(&estimator(scene, strategy, Tuning::default()).unwrap(), RUNS);
    let paired = Paired::new(&cpu, &gpu);
    let line = paired.line(&format!("{name} · {}", preset.label()));
    println!("{line}");
    let brighter: Vec<f64> = gpu.iter().map(|x| x * (1.0 + 5e-4)).collect();
    assert!(!Paired::new(&cpu, &brighter).agrees(), "{line}: a sabotage of 5e-4 passes");
    (!paired.agrees()).then_some(line)
}

#[test]
fn every_preset_agrees_with_the_cpu() {
    let Some(device) = vulkan() else { return };
    let mut failures = Vec::new();
    for path in scenes() {
        let prepared = Arc::new(PreparedScene::new(load(&path, FILM)).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
        for preset in Preset::ALL {
            failures.extend(disagreement(&name_of(&path), &scene, &prepared, preset));
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    no_messages(&device);
}

/// All values of every axis, each pair of neighbouring axes in all combinations, on a scene with all kinds of lights.
#[test]
fn every_strategy_agrees_with_the_cpu() {
    let Some(device) = vulkan() else { return };
    let prepared = Arc::new(PreparedScene::new(all_lights()).unwrap());
    let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
    let directions = [Directions::Uniform, Directions::Cosine, Directions::Bsdf];
    let lights = [Lights::None, Lights::Area, Lights::SolidAngle];
    let heuristics = [Heuristic::None, Heuristic::Balance, Heuristic::Power, Heuristic::Cutoff, Heuristic::Maximum];
    let sequences = [Sequence::Independent, Sequence::Stratified, Sequence::LatinHypercube, Sequence::Sobol];
    let roulettes = [None, Some(Roulette::Depth(1)), Some(Roulette::Never(NoRoulette::None))];
    let mut failures = Vec::new();
    for (i, heuristic) in heuristics.into_iter().enumerate() {
        for (j, lights) in lights.into_iter().enumerate() {
            for (k, directions) in directions.into_iter().enumerate() {
                let strategy = Strategy {
                    directions,
                    lights,
                    heuristic,
                    light_choice: [LightChoice::Uniform, LightChoice::Power][(i + j + k) % 2],
                    sequence: sequences[(i + 2 * j + k) % 4],
                    roulette: roulettes[(i + j) % 3],
                    technique: [Technique::Path, Technique::Path, Technique::Direct][(i + k) % 3],
                    stream: 0,
                };
                let cpu = samples(&CpuEstimator::new(Arc::clone(&prepared), strategy), 4);
                let gpu = samples(&estimator(&scene, strategy, Tuning::default()).unwrap(), 4);
                let paired = Paired::new(&cpu, &gpu);
                // Fewer samples than in the test above: a flip may move the mean by more than 1e-4.
                if paired.flips > 2 || paired.without_flips.abs() > MEAN {
                    failures.push(paired.line(&strategy.identity()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    no_messages(&device);
}

/// What few scenes call for: an environment map, spot and directional lights through a lens, and an orthographic view of them.
#[test]
fn rare_effects_agree_with_the_cpu() {
    let Some(device) = vulkan() else { return };
    let mut failures = Vec::new();
    let (beam, intensity) = (Beam { axis: -Vec3::Y, cutoff: 0.9, width: 0.3 }, Vec3::new(9.0, 7.0, 5.0));
    for orthographic in [None, Some(false), Some(true)] {
        let mut scene = all_lights();
        scene.lights.retain(|l| !matches!(l, Light::Constant { .. }));
        scene.environment_map = Some(Arc::new(patterned(24, 12, [Vec3::Z, Vec3::Y, Vec3::NEG_X])));
        scene.lights.extend([
            Light::EnvironmentMap,
            Light::Spot { position: Vec3::new(0.0, 3.0, 1.0), intensity, beam },
            Light::Directional { direction: Vec3::new(0.6, -0.8, 0.0), irradiance: Vec3::new(1.0, 2.0, 3.0) },
        ]);
        let (u, v) = (scene.camera.across.normalize(), scene.camera.down.normalize());
        match orthographic {
            Some(true) => scene.camera.projection = Projection::Orthographic { direction: u.cross(v) },
            Some(false) => {
                scene.camera.projection = Projection::ThinLens { radii: [u * 0.2, v * 0.2], inverse_focus: 0.2 };
            }
            None => scene = crate::reliefs::room(FILM),
        }
        scene.validate().unwrap();
        let prepared = Arc::new(PreparedScene::new(scene).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
        for preset in [Preset::Mis, Preset::Sobol].into_iter().take(if orthographic == Some(true) { 1 } else { 2 }) {
            failures.extend(disagreement(&format!("orthographic {orthographic:?}"), &scene, &prepared, preset));
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    no_messages(&device);
}

/// A room with a parallelogram, a mesh, a sphere, a disk, a cylinder, a point and the sky as lights, a smooth mesh in it, seen
/// through a Gaussian filter.
fn all_lights() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("smooth.obj"),
        "v -1 0 0\nv 1 0 0\nv 0 1 0.3\nv 0 -1 0.4\nvn -0.3 0 1\nvn 0.4 0.1 1\nvn 0 0.5 1\nvn 0 -0.6 1\n\
         f 1//1 2//2 3//3\nf 2//2 1//1 4//4\n",
    )
    .unwrap();
    let translate = |x: f32, y: f32, z: f32, s: f32| {
        format!(
            "<transform name=\"to_world\"><scale value=\"{s}\"/><rotate x=\"1\" angle=\"35\"/>\
             <translate x=\"{x}\" y=\"{y}\" z=\"{z}\"/></transform>"
        )
    };
    let emitter = |r: f32, g: f32, b: f32| {
        format!("<emitter type=\"area\"><rgb name=\"radiance\" value=\"{r}, {g}, {b}\"/></emitter>")
    };
    let bsdf = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.7, 0.5, 0.3\"/></bsdf></bsdf>";
    let text = format!(
        "<scene version=\"3.0.0\">\
         <integrator type=\"path\"><integer name=\"max_depth\" value=\"6\"/></integrator>\
         <sensor type=\"perspective\"><float name=\"fov\" value=\"60\"/>\
         <transform name=\"to_world\"><lookat origin=\"0, 0.5, 6\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform>\
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"{FILM}\"/><integer name=\"height\" value=\"{FILM}\"/>\
         <rfilter type=\"gaussian\"/></film></sensor>\
         <shape type=\"rectangle\">{}{bsdf}</shape>\
         <shape type=\"cube\">{}{bsdf}</shape>\
         <shape type=\"sphere\">{}{bsdf}</shape>\
         <shape type=\"obj\"><string name=\"filename\" value=\"smooth.obj\"/>{}{bsdf}</shape>\
         <shape type=\"rectangle\">{}{}</shape>\
         <shape type=\"cube\">{}{}</shape>\
         <shape type=\"sphere\">{}{}</shape>\
         <shape type=\"disk\">{}{}</shape>\
         <shape type=\"cylinder\">{}{}</shape>\
         <emitter type=\"point\"><point name=\"position\" x=\"0.5\" y=\"2\" z=\"2\"/>\
         <rgb name=\"intensity\" value=\"3, 2, 1\"/></emitter>\
         <emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.1, 0.2, 0.3\"/></emitter>\
         </scene>",
        "<transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale value=\"4\"/><translate y=\"-1.5\"/></transform>",
        translate(1.5, -0.8, 0.0, 0.5),
        translate(-1.5, -0.7, 0.5, 0.6),
        translate(0.0, -0.4, 1.5, 0.8),
        translate(0.0, 2.2, 0.0, 0.4),
        emitter(8.0, 7.0, 6.0),
        translate(2.5, 1.2, -1.0, 0.2),
        emitter(2.0, 4.0, 8.0),
        translate(-2.4, 0.9, 0.0, 0.25),
        emitter(9.0, 3.0, 1.0),
        translate(-1.0, 2.0, 1.0, 0.3),
        emitter(1.0, 9.0, 2.0),
        translate(1.0, 1.6, 1.0, 0.3),
        emitter(5.0, 5.0, 9.0),
    );
    let path = folder.path().join("all.xml");
    std::fs::write(&path, text).unwrap();
    format::load(&path, &format::Options::default()).unwrap()
}

fn tree(estimate: &Estimate) -> &[u8] {
    bytemuck::cast_slice(estimate.moments.as_ref().unwrap().nodes())
}

#[test]
fn interruptions_and_sizes_of_dispatches_leave_no_trace() {
    let Some(device) = vulkan() else { return };
    let prepared = Arc::new(PreparedScene::new(load(&cornell(), 13)).unwrap());
    let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
    for preset in [Preset::Mis, Preset::Stratified, Preset::Sobol] {
        let with = |dispatch| {
            let tuning = Tuning { dispatch, ..Tuning::default() };
            estimator(&scene, preset.strategy(), tuning).unwrap()
        };
        let whole = with(None).estimate(&cell(0, 400), 400, &mut None).unwrap();
        for dispatch in [Some(64), Some(100), Some(169 * 3), Some(1 << 20), None] {
            let estimator = with(dispatch);
            for steps in [vec![1, 2, 4, 400], vec![63, 65, 320, 399, 400], vec![64, 128, 400], vec![400]] {
                let mut estimate = None;
                for &n in &steps {
                    estimate = Some(estimator.estimate(&cell(0, 400), n, &mut estimate).unwrap());
                }
                let estimate = estimate.unwrap();
                assert!(tree(&estimate) == tree(&whole), "{preset:?}, {dispatch:?}, {steps:?}");
            }
        }
    }
    no_messages(&device);
}

/// Moments are those of the CPU but for the rounding of f32 in blocks of 64; counts and places of extremes are equal.
#[test]
fn moments_are_those_of_the_cpu() {
    let Some(device) = vulkan() else { return };
    let prepared = Arc::new(PreparedScene::new(load(&cornell(), 16)).unwrap());
    let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
    let strategy = Preset::Mis.strategy();
    let fold = |e: &dyn Estimator, n| e.estimate(&cell(0, n), n, &mut None).unwrap().moments.unwrap().fold();
    for n in [1, 63, 64, 65, 1000] {
        let cpu = fold(&CpuEstimator::new(Arc::clone(&prepared), strategy), n);
        let gpu = fold(&estimator(&scene, strategy, Tuning::default()).unwrap(), n);
        let mut flips = 0;
        for (c, g) in cpu.iter().zip(&gpu) {
            assert_eq!((c.n, c.non_finite), (g.n, g.non_finite));
            if (c.argmax, c.max) != (g.argmax, g.max) {
                flips += 1;
                continue;
            }
            let scale = c.max.abs().max(c.min.abs());
            let close = |a: f64, b: f64, power: i32| (a - b).abs() <= 2e-6 * n as f64 * scale.powi(power);
            assert!((c.mean - g.mean).abs() <= 1e-6 * scale, "{c:?}\n{g:?}");
            assert!(close(c.m2, g.m2, 2) && close(c.m3, g.m3, 3) && close(c.m4, g.m4, 4), "{c:?}\n{g:?}");
        }
        assert!(flips as f64 <= 0.01 * cpu.len() as f64, "n = {n}: {flips} of {} extremes differ", cpu.len());
    }
    no_messages(&device);
}

/// Radiance beyond the range of f32 is counted and located as on the CPU, whatever the size of dispatches.
#[test]
fn samples_beyond_range_are_located() {
    let Some(device) = vulkan() else { return };
    let mut scene = load(&cornell(), 9);
    for light in &mut scene.lights {
        if let Light::Area { radiance, .. } = light {
            *radiance = Vec3::splat(3e38);
        }
    }
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let on_device = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
    let strategy = Preset::Uniform.strategy();
    let cpu = CpuEstimator::new(prepared, strategy).estimate(&cell(0, 150), 150, &mut None).unwrap();
    let expected = cpu.moments.as_ref().unwrap();
    let count = |e: &Estimate| e.moments.as_ref().unwrap().fold().iter().map(|m: &Moments| m.non_finite).sum::<u64>();
    // More than are located.
    assert!(count(&cpu) > 48, "{}", count(&cpu));
    for dispatch in [Some(64), None] {
        let estimator = estimator(&on_device, strategy, Tuning { dispatch, ..Tuning::default() }).unwrap();
        let mut part = Some(estimator.estimate(&cell(0, 150), 70, &mut None).unwrap());
        let gpu = estimator.estimate(&cell(0, 150), 150, &mut part).unwrap();
        assert_eq!(count(&gpu), count(&cpu));
        assert_eq!(gpu.moments.as_ref().unwrap().non_finite(), expected.non_finite());
    }
    no_messages(&device);
}

/// Leaving out what the scene does not call for changes no bit; the time that it saves is printed. All effects on the CPU are
/// in `effects`; here are few scenes, and four kernels of the long variant: a driver takes ten seconds for each.
#[test]
fn specialised_kernels_give_the_bits_of_the_full_one() {
    let Some(device) = vulkan() else { return };
    let mut failures = Vec::new();
    let scenes = [("cornell", load(&cornell(), 32)), ("all lights", all_lights()), ("rare effects", rare(32))];
    for (name, scene) in scenes {
        let effects = Effects::of(&scene, true);
        let called: Vec<&str> = effects.names().collect();
        let short = Effects::SHORT.contains(effects);
        assert_eq!(short, name != "rare effects");
        let prepared = Arc::new(PreparedScene::new(scene).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
        let estimate = |also| {
            let tuning = Tuning { also, ..Tuning::default() };
            let estimator = estimator(&scene, Preset::Mis.strategy(), tuning).unwrap();
            let first = estimator.estimate(&cell(0, 16), 16, &mut None).unwrap();
            let mut seconds: Vec<f64> =
                (0..5).map(|_| estimator.estimate(&cell(0, 16), 16, &mut None).unwrap().seconds).collect();
            seconds.sort_by(f64::total_cmp);
            (first, seconds[2])
        };
        let ((special, fast), (full, slow)) = (estimate(Effects::NONE), estimate(Effects::EVERY));
        println!("{name:12} {:5.2} of the full kernel's time; effects: {}", fast / slow, called.join(", "));
        assert!(special.field.iter().any(|&v| v > 0.0));
        if tree(&special) != tree(&full) {
            failures.push(name.to_owned());
        }
        // What each of the others would cost, as far as the short variant has it.
        let others = Effects::ALL.into_iter().filter(|(e, _)| short && !effects.contains(*e));
        for (effect, what) in others.filter(|(e, _)| name == "cornell" && Effects::SHORT.contains(*e)) {
            let (with, seconds) = estimate(effect);
            println!("             {:5.2} of the time with {what}", fast / seconds);
            if tree(&with) != tree(&special) {
                failures.push(format!("{name} with {what}"));
            }
        }
    }
    assert!(failures.is_empty(), "unequal: {failures:?}");
    no_messages(&device);
}

#[test]
fn traversals_agree() {
    let Some(device) = vulkan() else { return };
    let mut scenes: Vec<(String, Scene)> = scenes().iter().map(|p| (name_of(p), load(p, FILM))).collect();
    scenes.push(("all lights".into(), all_lights()));
    let mut failures = Vec::new();
    for (name, scene) in scenes {
        let prepared = Arc::new(PreparedScene::new(scene).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
        for preset in [Preset::Mis, Preset::Importance] {
            let of = |traversal| {
                let tuning = Tuning { traversal, ..Tuning::default() };
                estimator(&scene, preset.strategy(), tuning).map(|e| samples(&e, RUNS))
            };
            let own = of(Traversal::Compute).unwrap();
            for traversal in [Traversal::RayQuery, Traversal::RayPipeline] {
                let Some(driver) = of(traversal) else { continue };
                let paired = Paired::new(&own, &driver);
                let line = paired.line(&format!("{name} · {} · {}", preset.label(), traversal.label()));
                println!("{line}");
                if !paired.agrees() {
                    failures.push(line);
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    no_messages(&device);
}

/// A closed, white, faceted ball in white light: what comes in has leaked, and every leak counts 1.
fn closed_ball(radius: f32, center: Vec3) -> Scene {
    let mut triangles = octahedron();
    for _ in 0..4 {
        triangles = triangles.iter().flat_map(subdivided).collect();
    }
    let mut scene = Scene {
        materials: vec![Material::BLACK, Bsdf::Diffuse { reflectance: Vec3::ONE }.into()],
        lights: vec![Light::Constant { radiance: Vec3::ONE }],
        ..Scene::default()
    };
    for t in &triangles {
        // Corners shared between triangles are equal to the bit: computed from equal points.
        let first = scene.positions.len() as u32;
        scene.positions.extend(t.map(|p| center + p * radius));
        scene.normals.extend([Vec3::ZERO; 3]);
        scene.triangles.push(rootn::scene::Triangle { vertices: [first, first + 1, first + 2], shape: 0 });
    }
    scene.shapes.push(rootn::scene::Shape {
        geometry: Geometry::Mesh { range: 0..triangles.len() as u32, smooth: false, uvs: false },
        front: 1,
        back: 1,
        light: None,
        axes: Default::default(),
        name: "ball".into(),
    });
    scene.camera.origin = center;
    scene.film.size = [FILM; 2];
    scene.film.crop_size = [FILM; 2];
    scene.depth = rootn::scene::Depth { max: Some(16), roulette: u32::MAX };
    scene
}

fn octahedron() -> Vec<[Vec3; 3]> {
    let sign = |octant: u32, bit: u32| if octant >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|o| [Vec3::X * sign(o, 0), Vec3::Y * sign(o, 1), Vec3::Z * sign(o, 2)]).collect()
}

fn subdivided(t: &[Vec3; 3]) -> Vec<[Vec3; 3]> {
    let [a, b, c] = *t;
    // a + b and b + a are equal.
    let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
    vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// No ray leaves a closed mesh by our own traversal; by the driver's, the rate is what it is, and printed.
#[test]
fn leaks_of_closed_meshes() {
    let Some(device) = vulkan() else { return };
    let runs = 4;
    for (radius, center) in
        [(1.0, Vec3::ZERO), (1e-4, Vec3::ZERO), (1.0, Vec3::new(100.0, 30.0, -70.0)), (1e5, Vec3::ONE)]
    {
        let prepared = Arc::new(PreparedScene::new(closed_ball(radius, center)).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
        for traversal in TRAVERSALS {
            let tuning = Tuning { traversal, ..Tuning::default() };
            let Some(e) = estimator(&scene, Preset::Importance.strategy(), tuning) else { continue };
            let leaks: f64 = (0..runs)
                .flat_map(|run| e.estimate(&cell(run, 16), 16, &mut None).unwrap().field)
                .step_by(3)
                .map(|mean| mean * 16.0)
                .sum();
            let rays = f64::from(runs) * 16.0 * f64::from(FILM * FILM) * 16.0;
            println!(
                "radius {radius:e} at {center}: {:12} {leaks:.0} of {rays:.1e} rays leak, {:.1e}",
                traversal.label(),
                leaks / rays
            );
            assert!(traversal != Traversal::Compute || leaks == 0.0);
        }
    }
    no_messages(&device);
}

/// A device that is lost leaves what was there before, an error that says so, and a run that a new device goes on with.
#[test]
fn a_lost_device_loses_no_samples() {
    if vulkan().is_none() {
        return;
    }
    let prepared = Arc::new(PreparedScene::new(load(&cornell(), 16)).unwrap());
    let strategy = Preset::Mis.strategy();
    let open = || {
        let device = Device::open(&Which::First, true).unwrap();
        let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
        let tuning = Tuning { dispatch: Some(512), ..Tuning::default() };
        (device, estimator(&scene, strategy, tuning).unwrap())
    };
    let (device, whole) = open();
    let whole = whole.estimate(&cell(0, 640), 640, &mut None).unwrap();
    for after in [0, 1, 2, 3, 5] {
        let (lost, estimator) = open();
        let mut kept = Some(estimator.estimate(&cell(0, 640), 128, &mut None).unwrap());
        lost.lose_after(after);
        let error = estimator.estimate(&cell(0, 640), 640, &mut kept).unwrap_err();
        assert!(matches!(error, Error::Device { .. }) && error.exit_code() == 4, "{error}");
        assert!(error.to_string().contains("lost"), "{error}");
        assert_eq!(kept.as_ref().unwrap().abscissa, 128);
        no_messages(&lost);
        let (_, estimator) = open();
        let rest = estimator.estimate(&cell(0, 640), 640, &mut kept).unwrap();
        assert!(tree(&rest) == tree(&whole), "after {after}");
    }
    no_messages(&device);
}

/// The same seen from the harness: what was computed is on disk, and the next run goes on from there to the same record.
#[test]
fn a_run_on_a_lost_device_leaves_its_cells() {
    if vulkan().is_none() {
        return;
    }
    let prepared = Arc::new(PreparedScene::new(load(&cornell(), 8)).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let attempt = |out: &str, lose_after: Option<u64>| {
        let device = Device::open(&Which::First, true).unwrap();
        let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
        let contenders = [Preset::Mis, Preset::Stratified].map(|preset| {
            let strategy = preset.strategy();
            let estimator = Box::new(estimator(&scene, strategy, Tuning::default()).unwrap());
            Contender { name: preset.label().into(), device: "gpu".into(), strategy, estimator }
        });
        let plan = Plan {
            name: "lost".into(),
            question: None,
            experiment: String::new(),
            seed: 1,
            replicates: 3,
            stop: Stop::Never,
            checkpoints: powers_of_two(300),
            metrics: vec![Metric::RelMse],
            targets: vec![0.01],
            probes: Vec::new(),
            log_pixels: false,
            scenes: vec![PlannedScene {
                name: "cornell".into(),
                contenders: contenders.into(),
                reference: ReferencePlan::Exact(0.1),
                max_depth: None,
                rendered: true,
            }],
            claims: Vec::new(),
            devices: Vec::new(),
            warnings: Vec::new(),
        };
        if let Some(n) = lose_after {
            device.lose_after(n);
        }
        let options = Options { out: folder.path().join(out), fresh: false, quiet: true };
        let outcome = rootn::run::run(&plan, &options);
        no_messages(&device);
        outcome
    };
    let (_, whole) = attempt("undisturbed", None).unwrap();
    let (mut lost, mut reused) = (0, 0);
    for submissions in [20, 40, 60, u64::MAX] {
        match attempt("disturbed", Some(submissions)) {
            Ok((_, reuse)) => reused = reuse.reused,
            Err(e) => {
                assert!(matches!(e, Error::Device { .. }), "{e}");
                lost += 1;
            }
        }
    }
    assert!(lost == 3 && reused > 0 && reused < whole.computed, "lost {lost} times, reused {reused}");
    let left = |out: &str| crate::determinism::left(&folder.path().join(out), "lost");
    let write = |out: &str| {
        let record = Record::load(&folder.path().join(out).join("lost")).unwrap();
        rootn::report::write(&record, &folder.path().join(out).join("lost")).unwrap();
    };
    write("undisturbed");
    write("disturbed");
    assert!(left("undisturbed") == left("disturbed"));
}

/// Sample numbers and block numbers beyond 32 bits, in a part of the film: both engines go on from the same made-up state.
#[test]
fn sample_numbers_beyond_32_bits() {
    let Some(device) = vulkan() else { return };
    let mut scene = load(&cornell(), FILM);
    (scene.film.crop_offset, scene.film.crop_size) = ([20, 30], [9, 5]);
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let on_device = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
    let (before, values) = (1u64 << 38, 9 * 5 * 3);
    let state = || {
        let node = Moments { n: before, mean: 0.1, m2: 1e10, min: 0.0, max: 0.0, ..Moments::default() };
        let tree = BlockTree::from_parts(45, 3, before, vec![node; values], Vec::new()).unwrap();
        let field = vec![0.1; values];
        Estimate { field, moments: Some(tree), abscissa: before, seconds: 1.0, wall_seconds: 1.0 }
    };
    for preset in [Preset::Mis, Preset::Stratified, Preset::Sobol] {
        let strategy = preset.strategy();
        let on = |e: &dyn Estimator| {
            let estimate = e.estimate(&cell(0, before + 500), before + 150, &mut Some(state())).unwrap();
            estimate.moments.unwrap()
        };
        let cpu = on(&CpuEstimator::new(Arc::clone(&prepared), strategy));
        let gpu = on(&estimator(&on_device, strategy, Tuning::default()).unwrap());
        assert_eq!(cpu.nodes().len(), 3 * values);
        let mut different = 0;
        for (c, g) in cpu.nodes().iter().zip(gpu.nodes()) {
            assert_eq!((c.n, c.non_finite), (g.n, g.non_finite));
            different += usize::from(c.argmax != g.argmax || (c.mean - g.mean).abs() > 1e-6 * c.max.max(1e-9));
        }
        assert!(different <= 3, "{preset:?}: {different} of {} nodes differ", cpu.nodes().len());
        assert!(cpu.nodes().iter().any(|m| m.argmax > before), "{preset:?}");
    }
    no_messages(&device);
}

/// Buffers may be larger than what one binding can name (128 MiB on lavapipe), and than what moves at a time.
#[test]
fn films_beyond_the_largest_binding() {
    let Some(device) = vulkan() else { return };
    let size = 1024;
    let bytes = u64::from(size * size) * 3 * size_of::<Moments>() as u64;
    assert!(bytes > device.info().max_storage_buffer.min(128 << 20), "{bytes}");
    let prepared = Arc::new(PreparedScene::new(load(&cornell(), size)).unwrap());
    let scene = Arc::new(DeviceScene::new(&device, Arc::clone(&prepared)).unwrap());
    let strategy = Preset::Importance.strategy();
    let cpu = samples(&CpuEstimator::new(prepared, strategy), 1);
    let paired = Paired::new(&cpu, &samples(&estimator(&scene, strategy, Tuning::default()).unwrap(), 1));
    assert!(paired.agrees(), "{}", paired.line("large film"));
    no_messages(&device);
}

/// The layer is there and heard: push constants beyond every limit are reported.
#[test]
fn the_validation_layer_is_heard() {
    if vulkan().is_none() {
        return;
    }
    let device = Device::open(&Which::First, true).unwrap();
    let fold = include_bytes!(concat!(env!("OUT_DIR"), "/fold.spv"));
    // SAFETY: our build made the code; what is wrong is the size.
    drop(unsafe { rootn::estimator::vulkan::kernel::Kernel::new(&device, fold, &[], 1 << 16) });
    let messages = device.messages();
    assert!(messages.iter().any(|m| m.contains("VUID-VkPushConstantRange")), "{messages:?}");
}
