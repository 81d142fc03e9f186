//! Materials with delta lobes: laws of optics, and scenes in which every sample has a known value.

use crate::support::{no_messages, vulkan};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::vulkan::{DeviceScene, Tuning, VulkanEstimator};
use rootn::estimator::{Cell, Estimator};
use rootn::math::{Rgb, Vec3};
use rootn::sampling::Key;
use rootn::sampling::strategy::{Directions, Preset};
use rootn::scene::Bsdf;
use rootn::scene::format::{Options, load};
use rootn::scene::material::Scattered;
use std::sync::Arc;

/// Which lobe word 2 chooses.
const REFLECT: [u32; 4] = [0; 4];
const TRANSMIT: [u32; 4] = [0, 0, u32::MAX, 0];

fn from_angle(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(sin * 0.6, sin * 0.8, cos)
}

fn glass(eta: f32) -> Bsdf {
    Bsdf::Dielectric { eta, reflectance: Rgb::ONE, transmittance: Rgb::ONE }
}

fn drawn(material: Bsdf, wo: Vec3, words: [u32; 4]) -> Scattered {
    material.sample(&[], Directions::Bsdf, wo, words).unwrap()
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 2e-6 * b.abs().max(1.0)
}

#[test]
fn glass_obeys_snell_and_fresnel() {
    for eta in [1.5f32, 1.0 / 1.5, 1.33, 2.419, 1.0] {
        // At normal incidence.
        assert!(close(drawn(glass(eta), Vec3::Z, REFLECT).pdf, ((eta - 1.0) / (eta + 1.0)).powi(2)) || eta == 1.0);
        for degrees in (1..90).map(|d| d as f32) {
            let wo = from_angle(degrees);
            let sin = degrees.to_radians().sin() / eta;
            let there = drawn(glass(eta), wo, TRANSMIT);
            if sin > 1.0 {
                assert!(there.wi.z > 0.0 && there.pdf == 1.0 && there.value == Rgb::ONE, "{eta} {degrees}");
                continue;
            }
            // Snell: in the plane of incidence, on the other side.
            assert!(there.wi.z < 0.0 && close(there.wi.length(), 1.0), "{eta} {degrees}: {there:?}");
            assert!((there.wi.truncate() + wo.truncate() / eta).length() < 1e-6);
            assert!(there.delta && there.eta == eta);
            // Power is kept: R + T = 1, where T is the share of radiance times η².
            let r = if eta == 1.0 { 0.0 } else { drawn(glass(eta), wo, REFLECT).value.x };
            assert!(close(r + there.value.x * eta * eta, 1.0), "{eta} {degrees}");
            // Reciprocity: the same share the other way (Stokes).
            let back = drawn(glass(1.0 / eta), -there.wi, TRANSMIT);
            assert!((back.wi + wo).length() < 2e-4, "{eta} {degrees}: {back:?}");
            assert!((back.pdf - there.pdf).abs() < 2e-3 * there.pdf, "{eta} {degrees}");
        }
    }
    // At Brewster's angle only half of the light, that across the plane, is reflected: ½ ((η² − 1)/(η² + 1))².
    let brewster = drawn(glass(1.5), from_angle(1.5f32.atan().to_degrees()), REFLECT);
    assert!(close(brewster.pdf, 0.5 * (1.25f32 / 3.25).powi(2)), "{brewster:?}");
    // All light at grazing angles, none behind.
    assert!(drawn(glass(1.5), Vec3::new(1.0, 0.0, 1e-6).normalize(), REFLECT).pdf > 0.9999);
    assert!(glass(1.5).sample(&[], Directions::Bsdf, -Vec3::Z, REFLECT).is_none());
    // A pane: light goes straight on; all reflections inside add up to 2R/(1 + R).
    let pane = Bsdf::ThinDielectric { eta: 1.5, reflectance: Rgb::ONE, transmittance: Rgb::ONE };
    let (off, on) = (drawn(pane, Vec3::Z, REFLECT), drawn(pane, Vec3::Z, TRANSMIT));
    assert!(close(off.pdf, 0.08 / 1.04) && close(off.pdf + on.value.x, 1.0) && on.wi == -Vec3::Z && on.eta == 1.0);
}

#[test]
fn metals_obey_fresnel() {
    let metal = |eta: f32, k: f32| Bsdf::Conductor { eta: Rgb::splat(eta), k: Rgb::splat(k), reflectance: Rgb::ONE };
    let value = |m: Bsdf, degrees: f32| drawn(m, from_angle(degrees), REFLECT).value.x;
    // ((η − 1)² + k²)/((η + 1)² + k²)
    for (eta, k) in [(0.2f32, 3.9f32), (1.5, 7.0), (2.0, 0.5)] {
        let exact = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!(close(value(metal(eta, k), 0.0), exact), "{eta} {k}");
    }
    for degrees in (0..90).map(|d| d as f32) {
        assert_eq!(value(metal(0.0, 1.0), degrees), 1.0, "a perfect mirror");
        // Without absorption it is a dielectric.
        let glass = drawn(glass(1.5), from_angle(degrees), REFLECT).pdf;
        assert!((value(metal(1.5, 0.0), degrees) - glass).abs() < 1e-5, "{degrees}");
        assert!((0.0..=1.0).contains(&value(metal(1.0, 0.0), degrees)));
    }
    let s = drawn(metal(0.2, 3.9), from_angle(40.0), REFLECT);
    assert!(s.delta && s.pdf == 1.0 && s.wi == from_angle(40.0) * Vec3::new(-1.0, -1.0, 1.0));
}

/// Lossless things in white light from everywhere cannot be seen: every sample is 1, on the CPU and on the device.
#[test]
fn lossless_things_vanish_in_white_light() {
    let (folder, device) = (tempfile::tempdir().unwrap(), vulkan());
    let bsdfs = [
        r#"<bsdf type="dielectric"/>"#,
        r#"<bsdf type="dielectric"><float name="int_ior" value="1"/><float name="ext_ior" value="1.5"/></bsdf>"#,
        r#"<bsdf type="thindielectric"/>"#,
        r#"<bsdf type="conductor"/>"#,
        r#"<bsdf type="twosided"><bsdf type="conductor"><string name="material" value="none"/></bsdf></bsdf>"#,
        r#"<bsdf type="null"/>"#,
    ];
    for (i, bsdf) in bsdfs.iter().enumerate() {
        for (shape, name) in [("", "sphere"), (r#"<boolean name="face_normals" value="true"/>"#, "cube")] {
            let file = folder.path().join(format!("{name}{i}.xml"));
            let scene = format!(
                r#"<scene version="3.0.0"><integrator type="path"><integer name="rr_depth" value="1000000"/></integrator>
                <sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
                <lookat origin="1, 2, 4" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
                <emitter type="constant"/><shape type="{name}">{shape}{bsdf}</shape></scene>"#
            );
            std::fs::write(&file, scene).unwrap();
            let scene = load(&file, &Options::sized([16, 16])).unwrap();
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
            let prepared = Arc::new(PreparedScene::new(scene).unwrap());
            let strategy = Preset::Mis.strategy();
            let cell = Cell { key: Key([1, 2]), length: 32 };
            let mut estimators: Vec<Box<dyn Estimator>> = vec![Box::new(CpuEstimator::new(prepared.clone(), strategy))];
            if let Some(device) = &device {
                let scene = Arc::new(DeviceScene::new(device, prepared).unwrap());
                estimators.push(Box::new(VulkanEstimator::new(scene, strategy, Tuning::default()).unwrap()));
            }
            for estimator in estimators {
                let estimate = estimator.estimate(&cell, 32, &mut None).unwrap();
                let worst = estimate.field.iter().map(|v| (v - 1.0).abs()).fold(0.0, f64::max);
                assert!(worst < 2e-5, "{bsdf}, {name}, {}: {worst}", estimator.identity());
            }
        }
    }
    device.iter().for_each(|d| no_messages(d));
}
