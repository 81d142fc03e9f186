//! Agreement with Mitsuba 3: every preset on every scene of ../shared/references, and renderers with small faults that
//! the same test rejects.
//!
//! The statistic is the difference of the images' weighted means, ours − reference, in percent of the reference's. Weights
//! are 1/(m + m½), m the reference's mean over a tile and m½ the median of those: lights seen directly, which have no noise,
//! do not outweigh the rest, and the reference's noise hardly enters its own weights. Pixels are independent in ours (each has its own random numbers, whatever the
//! sequence) and in the reference (box filter), so variances add over pixels: ours from replicates, which covers dependent
//! samples and the correlation of channels; the reference's from its standard errors, with its channels taken as fully
//! correlated (an upper bound). Degrees of freedom by Welch and Satterthwaite.
//!
//! Two things are asserted of each pair: the difference is not significant, and a bias of the stated size would have
//! been (with probability 0.9). Presets without light sampling need up to 24 576 samples per pixel for that, interiors 8192 even
//! with it; where it is more than 512 (with light sampling 1535), the test takes a sixteenth and accepts four times the bias,
//! unless ROOTN_SLOW is set (about twenty minutes). `mis` is also compared tile by tile, so that errors that cancel over the image are seen.

use crate::support::{level, seed};
use rootn::accel::{Intersect as _, Ray, leave};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimate, Estimator, Shape, estimate_by_samples};
use rootn::math::{Frame, Rgb, warp};
use rootn::record::Dependence;
use rootn::record::image::read_exr;
use rootn::sampling::dimension::{Decision, group};
use rootn::sampling::rng::{Key, Role, unit_f32};
use rootn::sampling::strategy::{Lights, Preset};
use rootn::sampling::{Draw, Sequence};
use rootn::scene::format::{Options, load};
use rootn::scene::light::{emitted, environment};
use rootn::scene::{Bsdf, Filter, Geometry, Scene};
use rootn::stats::interval::{median, student_t};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A reference, its scene below ../shared/scenes, and samples per pixel for the presets in the order of [`Preset::ALL`]; 0: not
/// compared, as it would take too many.
struct Case {
    name: &'static str,
    scene: &'static str,
    spp: [u64; 7],
}

/// What the scene of Veach MIS leaves open.
const PARAMETERS: [(&str, &str, &str); 1] = [("bitterli-veach-mis", "integrator", "path")];

const CASES: [Case; 12] = [
    Case {
        name: "bitterli-cornell-box",
        scene: "bitterli-cornell-box/mitsuba/scene_v3.xml",
        spp: [1440, 800, 800, 64, 64, 192, 64],
    },
    Case { name: "mitsuba-cbox", scene: "mitsuba-cbox/cbox-rgb.xml", spp: [1920, 1120, 1120, 64, 64, 448, 64] },
    Case { name: "own-lights", scene: "own/lights.xml", spp: [24576, 15360, 15360, 64, 64, 512, 64] },
    Case { name: "own-baffle", scene: "own/baffle.xml", spp: [5632, 1024, 1024, 80, 80, 1408, 80] },
    Case { name: "own-overcast", scene: "own/overcast.xml", spp: [64, 64, 64, 64, 64, 384, 64] },
    Case { name: "own-dragon", scene: "own/dragon.xml", spp: [384, 240, 240, 64, 64, 896, 64] },
    Case { name: "bitterli-veach-mis", scene: "bitterli-veach-mis/mitsuba/scene.xml", spp: [0, 0, 0, 0, 0, 10240, 0] },
    Case { name: "mitsuba-tutorials-cbox", scene: "mitsuba-tutorials/cbox.xml", spp: [0, 0, 0, 0, 0, 2048, 256] },
    Case { name: "mitsuba-matpreview", scene: "mitsuba-matpreview/matpreview.xml", spp: [0, 0, 0, 0, 0, 512, 0] },
    Case {
        name: "bitterli-staircase2",
        scene: "bitterli-staircase2/mitsuba/scene_m3.xml",
        spp: [0, 0, 0, 0, 0, 2048, 0],
    },
    Case {
        name: "bitterli-classroom",
        scene: "bitterli-classroom/mitsuba/scene_v3_ply_altenv.xml",
        spp: [0, 0, 0, 0, 0, 4096, 0],
    },
    Case {
        name: "bitterli-veach-ajar",
        scene: "bitterli-veach-ajar/mitsuba/scene_ply.xml",
        spp: [0, 0, 0, 0, 0, 14336, 0],
    },
];

/// Independent runs that each preset's samples are split into.
const REPLICATES: u32 = 8;
/// Tiles per row and column.
const TILES: usize = 16;
/// From so many samples per pixel on, of presets with light sampling three times as many, only a part is taken unless
/// ROOTN_SLOW is set.
const QUICK: u64 = 512;
/// Probability with which a bias of the stated size would be seen.
const POWER: f64 = 0.9;
/// Largest detectable bias, as a share of the mean, of `mis` and of the others.
const BOUNDS: [f64; 2] = [0.005, 0.02];

/// A reference image and the scene as it was rendered.
struct Reference {
    scene: Scene,
    /// Interleaved R, G, B.
    mean: Vec<f64>,
    std_error: Vec<f64>,
    batches: f64,
    /// Tile of every pixel.
    tile: Vec<usize>,
    /// Weight of every tile.
    weight: Vec<f64>,
}

/// ../shared, or `None` (with the reason printed) where it is absent. CI must have it.
fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    if path.join("references").is_dir() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is not there", path.display());
    println!("skipped: {} is not there", path.display());
    None
}

impl Reference {
    fn load(shared: &Path, case: &Case) -> Self {
        let path = shared.join("references").join(case.name);
        let json = std::fs::read_to_string(path.with_extension("json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let number = |key: &str| json[key].as_u64().unwrap_or_else(|| panic!("{}: no `{key}`", case.name));
        let size = [number("width") as u32, number("height") as u32];
        let file = shared.join("scenes").join(case.scene);
        let own = PARAMETERS.iter().filter(|p| p.0 == case.name);
        let parameters: Vec<_> = own.map(|p| (p.1.to_owned(), p.2.to_owned())).collect();
        let options = Options { parameters, allow_outside: true, ..Options::sized(size) };
        let mut scene = load(&file, &options).unwrap();
        assert_eq!(json["filter"], "box");
        scene.film.filter = Filter::Box;
        scene.depth.max = Some(number("max_depth") as u32);
        scene.depth.roulette = u32::MAX;
        let image = read_exr(&path.with_extension("exr")).unwrap();
        let [width, height] = size.map(|n| n as usize);
        assert_eq!([image.width, image.height], [width, height]);
        let values = |layer: Option<(usize, Vec<f32>)>| -> Vec<f64> {
            let (channels, values) = layer.expect("mean and standard error");
            assert_eq!(channels, 3);
            values.into_iter().map(f64::from).collect()
        };
        let (mean, std_error) = (values(image.layer("")), values(image.std_error()));
        let tile = |i: usize| (i / width * TILES / height) * TILES + i % width * TILES / width;
        let tile: Vec<usize> = (0..width * height).map(tile).collect();
        let mut sums = vec![(0.0, 0.0); TILES * TILES];
        for (rgb, &t) in mean.chunks(3).zip(&tile) {
            sums[t].0 += rgb.iter().sum::<f64>();
            sums[t].1 += 3.0;
        }
        let means: Vec<f64> = sums.iter().map(|(sum, n)| sum / n).collect();
        let weight = means.iter().map(|m| 1.0 / (m + median(&means))).collect();
        Self { scene, mean, std_error, batches: number("batches") as f64, tile, weight }
    }

    /// Ours − reference, weighted, over the pixels of one tile or of the image.
    fn compare(&self, ours: &[Vec<f64>], only: Option<usize>) -> Difference {
        let (n, mut d) = (ours.len() as f64, Difference::default());
        let mut spread = 0.0;
        for (p, &tile) in self.tile.iter().enumerate().filter(|t| only.is_none_or(|o| o == *t.1)) {
            let sum = |field: &[f64]| field[3 * p..][..3].iter().sum::<f64>();
            let w = self.weight[tile];
            let mean = ours.iter().map(|f| sum(f)).sum::<f64>() / n;
            let own = ours.iter().map(|f| (sum(f) - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
            let reference = sum(&self.std_error).powi(2);
            d.mean += w * sum(&self.mean);
            d.difference += w * (mean - sum(&self.mean));
            d.variance += w * w * (own + reference);
            d.reference_variance += w * w * reference;
            spread += w.powi(4) * (own * own / (n - 1.0) + reference * reference / (self.batches - 1.0));
        }
        d.degrees = d.variance * d.variance / spread;
        d
    }

    /// Tile by tile: Σ z² over tiles, z the normal quantile of each tile's t; its p-value.
    fn tiles_p_value(&self, ours: &[Vec<f64>]) -> f64 {
        let normal = Normal::standard();
        let (mut statistic, mut count) = (0.0, 0);
        for tile in 0..self.weight.len() {
            let d = self.compare(ours, Some(tile));
            if d.variance > 0.0 {
                statistic += normal.inverse_cdf((0.5 * d.p_value()).max(1e-300)).powi(2);
                count += 1;
            } else {
                // A tile full of light, seen without noise: it differs by rounding only.
                assert!(d.difference.abs() <= 1e-5 * d.mean, "tile {tile}: {d:?}");
            }
        }
        ChiSquared::new(f64::from(count)).unwrap().sf(statistic)
    }
}

/// A weighted difference of images.
#[derive(Debug, Default)]
struct Difference {
    /// Weighted sum of the reference.
    mean: f64,
    difference: f64,
    variance: f64,
    /// The reference's part of the variance.
    reference_variance: f64,
    degrees: f64,
}

impl Difference {
    fn relative(&self) -> f64 {
        self.difference / self.mean
    }

    fn std_error(&self) -> f64 {
        self.variance.sqrt() / self.mean
    }

    /// Two-sided.
    fn p_value(&self) -> f64 {
        let t = StudentsT::new(0.0, 1.0, self.degrees).unwrap();
        2.0 * t.sf((self.difference / self.variance.sqrt()).abs())
    }

    /// The bias that is significant at `level` with probability [`POWER`], as a share of the mean.
    fn detectable(&self, level: f64) -> f64 {
        (student_t(1.0 - level, self.degrees) + student_t(2.0 * POWER - 1.0, self.degrees)) * self.std_error()
    }
}

/// Images of independent runs.
fn render(estimator: &impl Estimator, seed: u64, replicates: u32, spp: u64) -> Vec<Vec<f64>> {
    let run = |replicate| {
        let cell = Cell { key: Key::new(seed, Role::Run, &estimator.identity(), replicate), length: spp };
        let estimate = estimator.estimate(&cell, spp, &mut None).unwrap();
        assert_eq!(estimate.moments.unwrap().fold().iter().map(|m| m.non_finite).sum::<u64>(), 0);
        estimate.field
    };
    (0..replicates).map(run).collect()
}

fn by_preset(scene: &Arc<PreparedScene>, preset: Preset, spp: u64) -> Vec<Vec<f64>> {
    let estimator = CpuEstimator::new(scene.clone(), preset.strategy());
    render(&estimator, seed("agreement"), REPLICATES, spp.div_ceil(REPLICATES.into()))
}

const HEADER: &str =
    "scene                 preset       spp   difference %  std error %  of it ref %  detectable %         p  seconds";

fn line(scene: &str, what: &str, spp: u64, d: &Difference, level: f64, start: Instant) -> String {
    format!(
        "{scene:21} {what:10} {spp:5} {:14.4} {:12.4} {:12.4} {:13.3} {:9.2e} {:8.1}",
        100.0 * d.relative(),
        100.0 * d.std_error(),
        100.0 * d.reference_variance.sqrt() / d.mean,
        100.0 * d.detectable(level),
        d.p_value(),
        start.elapsed().as_secs_f64()
    )
}

#[test]
fn presets_agree_with_mitsuba() {
    let Some(shared) = shared() else { return };
    let (level, slow) = (level("agreement"), std::env::var_os("ROOTN_SLOW").is_some());
    println!("level {level:.2e}, power {POWER}\n{HEADER}");
    let mut failures = Vec::new();
    for case in &CASES {
        let reference = Reference::load(&shared, case);
        let scene = Arc::new(PreparedScene::new(reference.scene.clone()).unwrap());
        for (preset, spp) in Preset::ALL.into_iter().zip(case.spp).filter(|p| p.1 > 0) {
            let start = Instant::now();
            let bound = BOUNDS[usize::from(preset != Preset::Mis)];
            let many = if preset.strategy().lights == Lights::None { QUICK } else { 3 * QUICK };
            let quick = !slow && spp >= many;
            let (spp, bound) = if quick { (spp / 16, 4.0 * bound) } else { (spp, bound) };
            let ours = by_preset(&scene, preset, spp);
            let d = reference.compare(&ours, None);
            let line = line(case.name, preset.label(), spp, &d, level, start);
            println!("{line}");
            // Negated, so that NaN fails.
            if !(d.p_value() > level) || !(d.detectable(level) <= bound) {
                failures.push(line);
            }
            // Caustics: the means of few samples of a tile are far from normal, and that of eight runs is not, either.
            if preset == Preset::Mis && !quick && case.name != "mitsuba-tutorials-cbox" {
                let p = reference.tiles_p_value(&ours);
                println!("{:21} {:10} {:>69.2e}", case.name, "mis, tiles", p);
                if !(p > level) {
                    failures.push(format!("{} mis, tiles: p = {p:e}", case.name));
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{HEADER}\n{}", failures.join("\n"));
}

/// The same test on the Cornell box for renderers that are wrong by a little.
struct Judge {
    reference: Reference,
    level: f64,
}

impl Judge {
    fn new(shared: &Path) -> Self {
        Self { reference: Reference::load(shared, &CASES[0]), level: level("agreement") }
    }

    fn rejects(&self, what: &str, ours: &[Vec<f64>]) -> bool {
        let d = self.reference.compare(ours, None);
        println!("{what}: {:.3} % ± {:.3} %, p = {:.1e}", 100.0 * d.relative(), 100.0 * d.std_error(), d.p_value());
        !(d.p_value() > self.level)
    }

    /// `mis` on a changed scene.
    fn rejects_scene(&self, what: &str, change: impl Fn(&mut Scene)) -> bool {
        let mut scene = self.reference.scene.clone();
        change(&mut scene);
        let scene = Arc::new(PreparedScene::new(scene).unwrap());
        self.rejects(what, &by_preset(&scene, Preset::Mis, CASES[0].spp[5]))
    }
}

/// Scales a rectangle's area about its centre.
fn scale_light(scene: &mut Scene, factor: f32) {
    let side = factor.sqrt();
    let light = scene.shapes.iter_mut().find(|s| s.light.is_some()).expect("a light");
    let Geometry::Rectangle { range, corner, edge_u, edge_v } = &mut light.geometry else { panic!("not a rectangle") };
    let center = *corner + 0.5 * (*edge_u + *edge_v);
    *corner = center + (*corner - center) * side;
    *edge_u *= side;
    *edge_v *= side;
    let mut own: Vec<u32> =
        scene.triangles[range.start as usize..range.end as usize].iter().flat_map(|t| t.vertices).collect();
    own.sort_unstable();
    own.dedup();
    for v in own {
        let p = &mut scene.positions[v as usize];
        *p = center + (*p - center) * side;
    }
}

#[test]
fn small_faults_are_rejected() {
    let Some(shared) = shared() else { return };
    let judge = Judge::new(&shared);
    for factor in [0.99f32, 1.01] {
        let albedo = |scene: &mut Scene| {
            for material in &mut scene.materials {
                if let Some(Bsdf::Diffuse { reflectance }) = material.plain() {
                    *material = Bsdf::Diffuse { reflectance: reflectance * factor }.into();
                }
            }
        };
        assert!(judge.rejects_scene(&format!("albedo × {factor}"), albedo));
        assert!(judge.rejects_scene(&format!("light area × {factor}"), |scene| scale_light(scene, factor)));
    }
    let scene = Arc::new(PreparedScene::new(judge.reference.scene.clone()).unwrap());
    let naive = |cosine| render(&Naive { scene: scene.clone(), cosine }, seed("agreement"), REPLICATES, 16);
    assert!(judge.rejects("cosine missing", &naive(false)));
    assert!(!judge.rejects("cosine there", &naive(true)));
}

/// Two percent more and less in neighbouring tiles cancels over the image; tile by tile it is seen.
#[test]
fn cancelling_faults_are_rejected() {
    let Some(shared) = shared() else { return };
    let judge = Judge::new(&shared);
    let scene = Arc::new(PreparedScene::new(judge.reference.scene.clone()).unwrap());
    let mut ours = by_preset(&scene, Preset::Mis, CASES[0].spp[5]);
    for field in &mut ours {
        for (rgb, &tile) in field.chunks_mut(3).zip(&judge.reference.tile) {
            let sign = if (tile / TILES + tile % TILES).is_multiple_of(2) { 1.0 } else { -1.0 };
            rgb.iter_mut().for_each(|x| *x *= 1.0 + 0.02 * sign);
        }
    }
    let p = judge.reference.tiles_p_value(&ours);
    println!("tiles: p = {p:e}");
    assert!(p < judge.level);
    assert!(!judge.rejects("image", &ours));
}

/// The textbook: uniform directions, no light sampling, area lights only. With the cosine or, as a fault, without.
struct Naive {
    scene: Arc<PreparedScene>,
    cosine: bool,
}

impl Naive {
    fn sample(&self, draw: &Draw) -> Rgb {
        let (scene, bvh) = (&self.scene.scene, self.scene.bvh());
        let words = |vertex| draw.words(group(vertex, Decision::Direction)).map(unit_f32);
        let [width, height] = scene.film.size;
        let [u, v, ..] = words(0);
        let (s, t) = ((draw.pixel % width) as f32 + u, (draw.pixel / width) as f32 + v);
        let camera = &scene.camera;
        let direction = camera.corner + camera.across * (s / width as f32) + camera.down * (t / height as f32);
        let mut ray = Ray::new(camera.origin, direction, f32::INFINITY);
        let (mut total, mut beta) = (Rgb::ZERO, Rgb::ONE);
        for depth in 1.. {
            let Some(hit) = bvh.closest(&ray) else { return total + beta * environment(scene) };
            let at = scene.surface_point(&ray, &hit);
            let wo = -ray.direction.normalize();
            let shape = &scene.shapes[at.shape as usize];
            if shape.light.is_some() {
                total += beta * emitted(scene, &at, wo);
            }
            let (material, normal) = if at.ns.dot(wo) > 0.0 { (shape.front, at.ns) } else { (shape.back, -at.ns) };
            let Some(Bsdf::Diffuse { reflectance }) = scene.materials[material as usize].plain() else { break };
            if scene.depth.max.is_some_and(|max| depth >= max) {
                break;
            }
            let [u, v, ..] = words(depth);
            let wi = warp::sample_uniform_hemisphere([u, v]);
            // ρ/π · cos θ over the density 1/2π.
            beta *= 2.0 * reflectance * if self.cosine { wi.z } else { 1.0 };
            ray = leave(&at, Frame::new(normal).to_world(wi));
        }
        total
    }
}

impl Estimator for Naive {
    fn shape(&self) -> Shape {
        let [width, height] = self.scene.scene.film.size.map(|n| n as usize);
        Shape { width, height, channels: 3 }
    }

    fn identity(&self) -> String {
        format!("naive, cosine {}", self.cosine)
    }

    fn dependence(&self) -> Dependence {
        Dependence::Independent
    }

    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> rootn::Result<Estimate> {
        Ok(estimate_by_samples(self.shape(), Sequence::Independent, cell, checkpoint, previous, |draw, out| {
            let c = self.sample(draw);
            out.copy_from_slice(&[c.x.into(), c.y.into(), c.z.into()]);
        }))
    }
}
