//! Warps, filters and direction samplers: density by chi-square, inverse, end points; trigonometry.

use crate::chi2::Chi2;
use crate::support::{level, seed};
use rootn::math::trig::{atan2, sin_cos_eighth, sin_cos_turns};
use rootn::math::{Vec2, Vec3, warp};
use rootn::sampling::Key;
use rootn::sampling::rng::{philox4x32, unit_f32};
use rootn::sampling::strategy::Directions;
use rootn::scene::material::Scattered;
use rootn::scene::{Bsdf, Filter};
use std::f64::consts::{PI, TAU};

const SAMPLES: u64 = 250_000;
const ONE_MINUS: f32 = 1.0 - f32::EPSILON / 2.0;

/// Four words of sample i of a test.
pub(crate) fn words(test: &str, i: u64) -> [u32; 4] {
    let s = seed(test);
    philox4x32([i as u32, 0, 0, 0], Key([s as u32, (s >> 32) as u32]))
}

fn unit(w: [u32; 4]) -> [f32; 2] {
    [unit_f32(w[0]), unit_f32(w[1])]
}

/// A direction as (z, turns), in which dω = 2π dz dturns.
pub(crate) fn sphere_point(v: Vec3) -> [f64; 2] {
    let t = f64::from(v.y).atan2(f64::from(v.x)) / TAU;
    [f64::from(v.z), if t < 0.0 { t + 1.0 } else { t }]
}

pub(crate) fn sphere_vector(at: [f64; 2]) -> Vec3 {
    let r = (1.0 - at[0] * at[0]).sqrt();
    Vec3::new((r * (TAU * at[1]).cos()) as f32, (r * (TAU * at[1]).sin()) as f32, at[0] as f32)
}

/// p-value of a direction sampler against its density over the sphere.
fn sphere(test: &str, sample: impl Fn([f32; 2]) -> Option<Vec3>, pdf: impl Fn(Vec3) -> f32) -> f64 {
    Chi2 {
        domain: [[-1.0, 1.0], [0.0, 1.0]],
        samples: SAMPLES,
        sample: |i| sample(unit(words(test, i))).map(sphere_point),
        density: |at: [f64; 2]| TAU * f64::from(pdf(sphere_vector(at))),
    }
    .p_value()
}

/// p-value of a sampler of the plane.
fn plane(test: &str, half: f64, sample: impl Fn([f32; 2]) -> Vec2, pdf: impl Fn(Vec2) -> f32) -> f64 {
    Chi2 {
        domain: [[-half, half], [-half, half]],
        samples: SAMPLES,
        sample: |i| Some(sample(unit(words(test, i))).to_array().map(f64::from)),
        density: |at: [f64; 2]| f64::from(pdf(Vec2::new(at[0] as f32, at[1] as f32))),
    }
    .p_value()
}

/// 1 in the upper half, else 0.
fn upper(v: Vec3) -> f32 {
    f32::from(u8::from(v.z > 0.0))
}

fn accept(test: &str, what: &str, p: f64) {
    assert!(p > level(test), "{test}, {what}: p = {p:e}");
}

fn reject(test: &str, what: &str, p: f64) {
    assert!(p < level(test), "{test}: {what} must be rejected, p = {p:e}");
}

#[test]
fn directions_follow_their_densities() {
    const TEST: &str = "directions";
    let hemisphere = |v: Vec3| upper(v) * warp::uniform_hemisphere_pdf();
    let cosine = |v: Vec3| warp::cosine_hemisphere_pdf(v.z);
    accept(TEST, "hemisphere", sphere(TEST, |u| Some(warp::sample_uniform_hemisphere(u)), hemisphere));
    accept(TEST, "sphere", sphere(TEST, |u| Some(warp::sample_uniform_sphere(u)), |_| warp::uniform_sphere_pdf()));
    accept(TEST, "cosine", sphere(TEST, |u| Some(warp::sample_cosine_hemisphere(u)), cosine));
    let sample = |u| Some(warp::sample_cosine_hemisphere(u));
    reject(TEST, "density 2 % low", sphere(TEST, sample, |v| 0.98 * cosine(v)));
    reject(TEST, "density 2 % high", sphere(TEST, sample, |v| 1.02 * cosine(v)));
    reject(TEST, "a missing cosine", sphere(TEST, sample, hemisphere));
    let clamped = |u: [f32; 2]| Some(warp::sample_uniform_sphere([u[0].clamp(0.06, 0.94), u[1]]));
    reject(TEST, "clamped samples", sphere(TEST, clamped, |_| warp::uniform_sphere_pdf()));
    let half = |u: [f32; 2]| Some(warp::sample_uniform_sphere([u[0], 0.98 * u[1]]));
    reject(TEST, "a gap of 2 % in azimuth", sphere(TEST, half, |_| warp::uniform_sphere_pdf()));
    let nan = |u: [f32; 2]| Some(if u[0] < 1e-4 { Vec3::NAN } else { warp::sample_uniform_sphere(u) });
    reject(TEST, "one NaN in 10⁴", sphere(TEST, nan, |_| warp::uniform_sphere_pdf()));
}

#[test]
fn cones_follow_their_densities() {
    const TEST: &str = "cones";
    for height in [1e-10f32, 1e-4, 0.1, 1.0, 1.7] {
        let p = |share: f32| {
            Chi2 {
                // Height in units of the cone's, turns: dω = 2π·height.
                domain: [[0.0, 1.0], [0.0, 1.0]],
                samples: SAMPLES,
                sample: |i| {
                    let v = warp::sample_uniform_cone(unit(words(TEST, i)), share * height).as_dvec3();
                    let r2 = v.x * v.x + v.y * v.y;
                    let h = if v.z > 0.0 { r2 / (1.0 + (1.0 - r2).max(0.0).sqrt()) } else { 1.0 - v.z };
                    let t = v.y.atan2(v.x) / TAU;
                    Some([h / f64::from(height), if t < 0.0 { t + 1.0 } else { t }])
                },
                density: |_| TAU * f64::from(height) * f64::from(warp::uniform_cone_pdf(height)),
            }
            .p_value()
        };
        accept(TEST, "cone", p(1.0));
        reject(TEST, "a cone 2 % too low", p(0.98));
    }
}

#[test]
fn planar_warps_follow_their_densities() {
    const TEST: &str = "planar";
    let disk = |at: [f64; 2]| [at[0] * (TAU * at[1]).cos(), at[0] * (TAU * at[1]).sin()];
    let polar = |sample: &dyn Fn([f32; 2]) -> Vec2| {
        Chi2 {
            domain: [[0.0, 1.0], [0.0, 1.0]],
            samples: SAMPLES,
            sample: |i| {
                let d = sample(unit(words(TEST, i))).as_dvec2();
                let t = d.y.atan2(d.x) / TAU;
                Some([d.length(), if t < 0.0 { t + 1.0 } else { t }])
            },
            density: |at: [f64; 2]| {
                let [x, y] = disk(at);
                TAU * x.hypot(y) * f64::from(warp::uniform_disk_pdf())
            },
        }
        .p_value()
    };
    accept(TEST, "disk", polar(&warp::sample_uniform_disk));
    let skewed = |u: [f32; 2]| warp::sample_uniform_disk(u) * u[0].powf(0.05);
    reject(TEST, "a disk drawn to its centre", polar(&skewed));
    let triangle = |sample: &dyn Fn([f32; 2]) -> [f32; 2]| {
        Chi2 {
            // Weight of vertex 1, and weight of vertex 2 as part of what is left.
            domain: [[0.0, 1.0], [0.0, 1.0]],
            samples: SAMPLES,
            sample: |i| {
                let [b, c] = sample(unit(words(TEST, i))).map(f64::from);
                Some([b, c / (1.0 - b)])
            },
            density: |at: [f64; 2]| (1.0 - at[0]) * f64::from(warp::uniform_triangle_pdf()),
        }
        .p_value()
    };
    accept(TEST, "triangle", triangle(&warp::sample_uniform_triangle));
    reject(TEST, "the triangle without its root", triangle(&|u| [u[0], u[1] * (1.0 - u[0])]));
}

#[test]
fn filters_follow_their_densities() {
    const TEST: &str = "filters";
    for (filter, reach) in [
        (Filter::Box, 0.5),
        (Filter::Tent { radius: 1.0 }, 1.0),
        (Filter::Tent { radius: 2.5 }, 2.5),
        (Filter::Gaussian { stddev: 0.5 }, 2.0),
        (Filter::Gaussian { stddev: 2.0 }, 8.0),
    ] {
        let pdf = |x| filter.pdf(x);
        accept(TEST, &format!("{filter:?}"), plane(TEST, reach, |u| filter.sample(u), pdf));
        let shrunk = |u| 0.98 * filter.sample(u);
        reject(TEST, &format!("{filter:?} 2 % too narrow"), plane(TEST, reach, shrunk, pdf));
    }
    // The moments of the lowered Gaussian in closed form: the cut matters in the fourth digit.
    let n = 1 << 20;
    let variance = (0..n).map(|i| f64::from(warp::sample_gaussian((i as f32 + 0.5) / n as f32)).powi(2)).sum::<f64>()
        / f64::from(n);
    let (e, erf) = ((-8f64).exp(), statrs::function::erf::erf(8f64.sqrt()));
    let norm = (PI / 2.0).sqrt() * erf - 4.0 * e;
    let exact = ((PI / 2.0).sqrt() * erf - 4.0 * e - 64.0 / 3.0 * e) / norm;
    assert!((variance - exact).abs() < 2e-5, "{variance} instead of {exact}");
}

#[test]
fn diffuse_samples_follow_their_densities() {
    const TEST: &str = "diffuse";
    let material = Bsdf::Diffuse { reflectance: Vec3::new(0.2, 0.5, 0.9) };
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for directions in [Directions::Uniform, Directions::Cosine, Directions::Bsdf] {
        let p = |factor: f32| {
            Chi2 {
                domain: [[-1.0, 1.0], [0.0, 1.0]],
                samples: SAMPLES,
                sample: |i| material.sample(&[], directions, wo, words(TEST, i)).map(|s| sphere_point(s.wi)),
                density: |at: [f64; 2]| {
                    TAU * f64::from(factor * material.eval(&[], directions, wo, sphere_vector(at)).pdf)
                },
            }
            .p_value()
        };
        accept(TEST, &format!("{directions:?}"), p(1.0));
        reject(TEST, "density 2 % off", p(1.02));
        for i in 0..100 {
            let Scattered { wi, pdf, value, delta, eta } =
                material.sample(&[], directions, wo, words(TEST, i)).unwrap();
            let evaluated = material.eval(&[], directions, wo, wi);
            assert_eq!((pdf, value), (evaluated.pdf, evaluated.value));
            assert!(!delta && eta == 1.0);
            let albedo = evaluated.value / (wi.z / std::f32::consts::PI);
            assert!((albedo - Vec3::new(0.2, 0.5, 0.9)).abs().max_element() < 1e-6);
        }
        // No words put a sample on the horizon, where its density would be 0.
        for w in [[0; 4], [u32::MAX; 4], [0, u32::MAX, 0, 0], [0, 1 << 31, 0, 0], [1 << 31; 4]] {
            let Scattered { wi, pdf, .. } = material.sample(&[], directions, wo, w).unwrap();
            assert!(wi.z > 0.0 && wi.is_normalized() && pdf > 0.0);
        }
        assert!(Bsdf::Black.sample(&[], directions, wo, [1; 4]).is_none());
        assert_eq!(material.eval(&[], directions, wo, -wo).pdf, 0.0);
    }
    assert_eq!(material.eval(&[], Directions::Bsdf, wo, -wo).value, Vec3::ZERO);
}

/// inverse(sample(u)) = u, and finite results, on a lattice with both ends.
#[test]
fn inverses_undo_warps() {
    let n = 64;
    let lattice =
        (0..=n).flat_map(|i| (0..=n).map(move |j| [i, j].map(|k| (k as f32 / n as f32 + 0.003).min(ONE_MINUS))));
    let ends = [[0.0, 0.0], [ONE_MINUS, 0.0], [0.0, ONE_MINUS], [ONE_MINUS, ONE_MINUS]];
    type Inverse = fn([f32; 2]) -> ([f32; 2], f32);
    let filter = |f: Filter, u| {
        let x = f.sample(u);
        (f.invert(x), x.length())
    };
    let warps: [(&str, Inverse); 7] = [
        ("hemisphere", |u| {
            let v = warp::sample_uniform_hemisphere(u);
            (warp::invert_uniform_hemisphere(v), v.length() - 1.0)
        }),
        ("sphere", |u| {
            let v = warp::sample_uniform_sphere(u);
            (warp::invert_uniform_sphere(v), v.length() - 1.0)
        }),
        ("disk", |u| {
            let v = warp::sample_uniform_disk(u);
            (warp::invert_uniform_disk(v), (v.length() - 1.0).max(0.0))
        }),
        ("cosine", |u| {
            let v = warp::sample_cosine_hemisphere(u);
            (warp::invert_cosine_hemisphere(v), v.length() - 1.0)
        }),
        ("narrow cone", |u| {
            let v = warp::sample_uniform_cone(u, 1e-10);
            (warp::invert_uniform_cone(v, 1e-10), v.length() - 1.0)
        }),
        ("wide cone", |u| {
            let v = warp::sample_uniform_cone(u, 1.9);
            (warp::invert_uniform_cone(v, 1.9), v.length() - 1.0)
        }),
        ("triangle", |u| {
            let b = warp::sample_uniform_triangle(u);
            (warp::invert_uniform_triangle(b), (b[0] + b[1] - 1.0).max(-b[0]).max(-b[1]).max(0.0))
        }),
    ];
    for u in lattice.chain(ends) {
        for (name, warp) in warps {
            let (back, outside) = warp(u);
            assert!(outside.abs() < 4e-7, "{name} of {u:?} leaves its domain by {outside}");
            let error = back.iter().zip(u).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // The azimuth of a pole is free, and at the rim of the disk a full turn is 0.
            if u[0] > 0.0 && u[0] < ONE_MINUS && u[1] < ONE_MINUS {
                assert!(error < 2e-6, "{name}: {u:?} came back as {back:?}");
            }
        }
        for f in [Filter::Box, Filter::Tent { radius: 1.5 }, Filter::Gaussian { stddev: 0.5 }] {
            let (back, length) = filter(f, u);
            let error = back.iter().zip(u).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(error < 2e-6 && length < 3.0, "{f:?}: {u:?} came back as {back:?}");
        }
    }
}

/// Units in the last place between an f32 and the exact value.
fn ulps(got: f32, exact: f64) -> f64 {
    (f64::from(got) - exact).abs() / (f64::from((exact as f32).abs().max(f32::MIN_POSITIVE)) * f64::from(f32::EPSILON))
}

#[test]
fn trigonometry_is_accurate() {
    let mut worst = [0f64; 4];
    for i in 0..=1_000_000 {
        let t = i as f32 / 1_000_000.0;
        let (s, c) = sin_cos_eighth(0.25 * t - 0.125);
        let x = TAU * f64::from(0.25 * t - 0.125);
        worst[0] = worst[0].max(ulps(s, x.sin())).max(ulps(c, x.cos()));
        let (s, c) = sin_cos_turns(t);
        let x = TAU * f64::from(t);
        worst[1] = worst[1].max((f64::from(s) - x.sin()).abs()).max((f64::from(c) - x.cos()).abs());
        worst[2] = worst[2].max(ulps(atan2(t, 1.0), f64::from(t).atan()));
        let (y, x) = (x.sin() as f32, x.cos() as f32);
        worst[3] = worst[3].max((f64::from(atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs());
    }
    assert!(worst[0] < 2.0 && worst[1] < 1.5e-7 && worst[2] < 2.0 && worst[3] < 4e-7, "{worst:?}");
    assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
    assert_eq!((atan2(0.0, -1.0), atan2(1.0, 0.0)), (std::f32::consts::PI, std::f32::consts::FRAC_PI_2));
}
