//! Rough materials and coats: sampling, reciprocity, energy.

use crate::chi2::Chi2;
use crate::support::level;
use crate::warps::{sphere_point, sphere_vector, words};
use rootn::math::{Rgb, Vec3};
use rootn::sampling::strategy::Directions;
use rootn::scene::Bsdf;
use rootn::scene::material::{
    Coat, Distribution, Evaluated, Microfacets, Scattered, Transmittance, diffuse_reflectance,
    diffuse_rough_reflectance,
};

const DISTRIBUTIONS: [Distribution; 2] = [Distribution::Ggx, Distribution::Beckmann];
const ALL: [Directions; 3] = [Directions::Uniform, Directions::Cosine, Directions::Bsdf];

fn facets(distribution: Distribution, x: f32, y: f32) -> Microfacets {
    Microfacets { distribution, alpha: [x, y] }
}

/// Every microfacet is a perfect mirror.
fn mirrors(facets: Microfacets) -> Bsdf {
    Bsdf::RoughConductor { facets, eta: Rgb::ZERO, k: Rgb::ONE, reflectance: Rgb::ONE }
}

fn glass(facets: Microfacets, eta: f32) -> Bsdf {
    Bsdf::RoughDielectric { facets, eta, reflectance: Rgb::ONE, transmittance: Rgb::ONE }
}

fn plastic(eta: f32, reflectance: f32, nonlinear: bool) -> Bsdf {
    let coat = Coat { eta, internal: diffuse_reflectance(1.0 / eta), nonlinear, specular_weight: 0.6 };
    Bsdf::Plastic { coat, reflectance: Rgb::splat(reflectance), specular: Rgb::ONE }
}

/// With its table.
fn rough_plastic(facets: Microfacets, eta: f32, reflectance: f32) -> (Bsdf, [Transmittance; 1]) {
    let internal = diffuse_rough_reflectance(&facets, 1.0 / eta);
    let coat = Coat { eta, internal, nonlinear: false, specular_weight: 0.6 };
    let reflectance = Rgb::splat(reflectance);
    let table = Transmittance::new(&facets, eta);
    (Bsdf::RoughPlastic { facets, coat, table: 0, reflectance, specular: Rgb::ONE }, [table])
}

fn from_angle(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(sin * 0.6, sin * 0.8, cos)
}

/// Reflection at microfacets of any roughness, in slopes over roughness: cells then follow the highlight.
#[test]
fn visible_normals_follow_their_density() {
    const TEST: &str = "visible normals";
    for distribution in DISTRIBUTIONS {
        for [x, y] in [[1e-3, 1e-3], [3e-3, 0.01], [0.01, 0.01]] {
            for degrees in [0.0, 40.0, 80.0] {
                let (m, wo) = (mirrors(facets(distribution, x, y)), from_angle(degrees));
                let p = |factor: f64| {
                    Chi2 {
                        domain: [[-4.0, 4.0], [-4.0, 4.0]],
                        samples: 250_000,
                        sample: |i| {
                            let s = m.sample(&[], Directions::Bsdf, wo, words(TEST, i))?;
                            let h = (wo + s.wi).as_dvec3();
                            let at = [-h.x / h.z / f64::from(x), -h.y / h.z / f64::from(y)];
                            at.iter().all(|a| a.abs() <= 4.0).then_some(at)
                        },
                        density: |[a, b]: [f64; 2]| {
                            let h = glam::DVec3::new(-a * f64::from(x), -b * f64::from(y), 1.0).normalize();
                            let wo = wo.as_dvec3();
                            let wi = (2.0 * wo.dot(h) * h - wo).as_vec3();
                            let pdf = f64::from(m.eval(&[], Directions::Bsdf, wo.as_vec3(), wi).pdf);
                            factor * pdf * 4.0 * wo.dot(h) * h.z.powi(3) * f64::from(x * y)
                        },
                    }
                    .p_value()
                };
                let (right, wrong) = (p(1.0), p(1.02));
                println!("{distribution:?}, {x}, {y}, {degrees}°: p = {right:e} {wrong:e}");
                assert!(wrong < level(TEST), "{distribution:?}, {x}, {y}, {degrees}°: 2 % off, p = {wrong:e}");
            }
        }
    }
}

/// Density, and value where it is drawn, of materials with their tables.
fn follows(test: &str, name: &str, material: &Bsdf, tables: &[Transmittance], wo: Vec3) {
    for directions in ALL {
        let p = |factor: f64| {
            Chi2 {
                domain: [[-1.0, 1.0], [0.0, 1.0]],
                samples: 250_000,
                sample: |i| {
                    let s = material.sample(tables, directions, wo, words(test, i)).filter(|s| !s.delta)?;
                    Some(sphere_point(s.wi))
                },
                density: |at: [f64; 2]| {
                    let pdf = material.eval(tables, directions, wo, sphere_vector(at)).pdf;
                    factor * std::f64::consts::TAU * f64::from(pdf)
                },
            }
            .p_value()
        };
        let (right, wrong) = (p(1.0), p(1.03));
        println!("{name}, {directions:?}, {wo}: p = {right:e} {wrong:e}");
        assert!(wrong < level(test), "{name}, {directions:?}, {wo}: 3 % off, p = {wrong:e}");
        for i in 0..1000 {
            let Some(s) = material.sample(tables, directions, wo, words(test, i)) else { continue };
            let Scattered { wi, pdf, value, delta, .. } = s;
            assert!((wi.length() - 1.0).abs() < 1e-5 && pdf > 0.0 && value.is_finite(), "{name}: {s:?}");
            assert!(delta || Evaluated { value, pdf } == material.eval(tables, directions, wo, wi), "{name}");
        }
    }
}

#[test]
fn glass_and_plastics_follow_their_densities() {
    const TEST: &str = "glass and plastics";
    for degrees in [20.0, 75.0] {
        let wo = from_angle(degrees);
        for distribution in DISTRIBUTIONS {
            let rough = facets(distribution, 0.4, 0.3);
            println!("{distribution:?}");
            follows(TEST, "mirrors", &mirrors(rough), &[], wo);
            follows(TEST, "glass", &glass(rough, 1.5), &[], wo);
            follows(TEST, "glass from inside", &glass(rough, 1.0 / 1.5), &[], wo);
            let (material, tables) = rough_plastic(rough, 1.5, 0.5);
            follows(TEST, "rough plastic", &material, &tables, wo);
        }
        follows(TEST, "plastic", &plastic(1.5, 0.5, false), &[], wo);
    }
}

/// f(wo, wi) = f(wi, wo); through an interface over the squared indices (Veach 1997, §5.2).
#[test]
fn rough_materials_are_reciprocal() {
    for distribution in DISTRIBUTIONS {
        let rough = facets(distribution, 0.5, 0.2);
        let (coated, tables) = rough_plastic(rough, 1.5, 0.5);
        let mut lit = [0; 2];
        for i in 0..2000 {
            let [a, b] = [0, 1].map(|k| {
                let w = words("reciprocity", 2 * i + k);
                rootn::math::warp::sample_uniform_sphere([w[0], w[1]].map(rootn::sampling::rng::unit_f32))
            });
            let (wo, wi) = (Vec3::new(a.x, a.y, a.z.abs().max(0.01)).normalize(), b);
            let f = |m: &Bsdf, wo: Vec3, wi: Vec3| m.eval(&tables, Directions::Bsdf, wo, wi).value.x / wi.z.abs();
            let within = |bound: f32, a: f32, b: f32| (a - b).abs() <= bound * a.abs().max(b.abs()) + 1e-12;
            let close = |a: f32, b: f32| within(2e-4, a, b);
            if wi.z > 0.0 {
                for m in [mirrors(rough), glass(rough, 1.5), plastic(1.5, 0.5, true), coated] {
                    assert!(close(f(&m, wo, wi), f(&m, wi, wo)), "{m:?}: {wo} {wi}");
                    lit[0] += usize::from(f(&m, wo, wi) > 0.0);
                }
            } else {
                // From the other side, z is the other way round.
                let flip = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
                let (there, back) = (f(&glass(rough, 1.5), wo, wi), f(&glass(rough, 1.0 / 1.5), flip(wi), flip(wo)));
                // Where both nearly graze, the half vector is a small difference.
                assert!(within(2e-2, there * 1.5 * 1.5, back), "{wo} {wi}: {there} {back}");
                lit[1] += usize::from(there > 0.0);
            }
        }
        assert!(lit[0] > 1000 && lit[1] > 100, "{lit:?}");
    }
}

/// Share of power that leaves: the mean of value over density, with its standard error. Refracted radiance counts times η².
fn albedo(test: &str, material: &Bsdf, tables: &[Transmittance], wo: Vec3) -> (f64, f64) {
    let n = 200_000;
    let mut moments = rootn::moments::Moments::default();
    for i in 0..n {
        let s = material.sample(tables, Directions::Bsdf, wo, words(test, i));
        moments.push(s.map_or(0.0, |s| f64::from(s.value.x / s.pdf * s.eta * s.eta)), i);
    }
    (moments.mean, (moments.sample_variance().unwrap() / n as f64).sqrt())
}

#[test]
fn lossless_coats_and_interfaces_keep_their_energy() {
    const TEST: &str = "energy";
    for degrees in [0.0, 30.0, 60.0, 80.0, 88.0] {
        let wo = from_angle(degrees);
        // A white base under a smooth coat sends all light back.
        for eta in [1.2, 1.5, 2.4] {
            let (mean, error) = albedo(TEST, &plastic(eta, 1.0, false), &[], wo);
            assert!((mean - 1.0).abs() < 5.0 * error + 1e-4, "η = {eta}, {degrees}°: {mean} ± {error}");
        }
        for distribution in DISTRIBUTIONS {
            // Hardly rough: as smooth ones, but for the last degrees. Rougher: light is lost between the microfacets, none made.
            let (mean, error) = albedo(TEST, &mirrors(facets(distribution, 1e-3, 1e-3)), &[], wo);
            assert!((mean - 1.0).abs() < 5.0 * error + 1e-3, "{distribution:?} mirror, {degrees}°: {mean} ± {error}");
            for eta in [1.5, 1.0 / 1.5] {
                let (mean, error) = albedo(TEST, &glass(facets(distribution, 1e-3, 1e-3), eta), &[], wo);
                assert!(
                    (mean - 1.0).abs() < 5.0 * error + 1e-3,
                    "{distribution:?} glass, {degrees}°: {mean} ± {error}"
                );
            }
            for a in [0.1, 0.5, 1.0, 3.0] {
                let rough = facets(distribution, a, a);
                let (coated, tables) = rough_plastic(rough, 1.5, 1.0);
                for (material, tables) in [(mirrors(rough), &[][..]), (glass(rough, 1.5), &[]), (coated, &tables)] {
                    let (mean, error) = albedo(TEST, &material, tables, wo);
                    // The coat's model counts what is lost between microfacets as passed: a little more than all comes back.
                    let most = if matches!(material, Bsdf::RoughPlastic { .. }) { 1.02 } else { 1.0 };
                    assert!(mean < most + 5.0 * error && mean > 0.01, "{material:?}, {degrees}°: {mean} ± {error}");
                }
            }
        }
    }
}

/// GGX at α = 1 with F = 1 and separable shadowing: D = 1/π, G₁(μ) = 2μ/(1 + μ), so f = G₁(μo) G₁(μi)/(4π μo μi) and
/// E(μ) = ∫ f μi dωi = 2/(1 + μ) ∫ μi/(1 + μi) dμi = 2(1 − ln 2)/(1 + μ).
#[test]
fn ggx_at_roughness_one_has_its_closed_form() {
    let material = mirrors(facets(Distribution::Ggx, 1.0, 1.0));
    for degrees in [0.0, 45.0, 80.0] {
        let wo = from_angle(degrees);
        let exact = 2.0 * (1.0 - std::f64::consts::LN_2) / (1.0 + f64::from(wo.z));
        let (mean, error) = albedo("alpha one", &material, &[], wo);
        assert!(
            (mean - exact).abs() < 5.0 * error && error < 3e-3 * exact,
            "{degrees}°: {mean} ± {error}, not {exact}"
        );
        assert!((mean - 1.02 * exact).abs() > 5.0 * error, "2 % more must be seen");
    }
}
