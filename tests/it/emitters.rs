//! Spot and directional lights and environment maps: values against Mitsuba 3.9.1 (scalar_rgb), densities by chi-square.

use crate::chi2::Chi2;
use crate::support::level;
use crate::warps::words;
use glam::DVec3;
use rootn::math::{Rgb, Vec3};
use rootn::sampling::strategy::{LightChoice, Lights};
use rootn::scene::format::Options;
use rootn::scene::format::mitsuba::load;
use rootn::scene::light::{Beam, LightSampler, LightTarget};
use rootn::scene::{EnvironmentMap, Light, Material, Scene};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// A scene around which a map shines.
pub(crate) fn mapped(map: EnvironmentMap) -> Scene {
    Scene {
        materials: vec![Material::BLACK],
        lights: vec![Light::EnvironmentMap],
        environment_map: Some(Arc::new(map)),
        ..Scene::default()
    }
}

/// Columns × rows of texels that differ, some of them black and one bright.
pub(crate) fn patterned(width: u32, height: u32, axes: [Vec3; 3]) -> EnvironmentMap {
    let texel = |i: u32| match i % 7 {
        0 | 1 => Rgb::ZERO,
        2 => Rgb::splat(0.1),
        k => Rgb::new(k as f32, (i * i % 5) as f32, 0.5),
    };
    let mut texels: Vec<Rgb> = (0..width * height).map(texel).collect();
    texels[(height / 3 * width + width / 2) as usize] = Rgb::splat(50.0);
    EnvironmentMap::new(width, texels, axes).unwrap()
}

/// A scene file beside a picture of 5 × 4 texels: (1 + x + 10y, (x² + y) mod 7, xy/2).
fn with_picture(emitters: &str, change: impl Fn(usize, &mut Vec<f32>)) -> rootn::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    let mut pfm = b"PF\n5 4\n-1.0\n".to_vec();
    // From the bottom up.
    for i in 0..20 {
        let (x, y) = (i % 5, 3 - i / 5);
        let mut texel = vec![(1 + x + 10 * y) as f32, ((x * x + y) % 7) as f32, 0.5 * (x * y) as f32];
        change(5 * y + x, &mut texel);
        texel.iter().for_each(|v| pfm.extend(v.to_le_bytes()));
    }
    std::fs::write(folder.path().join("sky.pfm"), pfm).unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!("<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'/>{emitters}</scene>");
    std::fs::write(&path, text).unwrap();
    load(&path, &Options::default())
}

fn sky(inside: &str) -> String {
    format!("<emitter type='envmap'><string name='filename' value='sky.pfm'/>{inside}</emitter>")
}

#[test]
fn environment_maps_agree_with_mitsuba() {
    let directions = [
        [0.3, 0.5, -0.8],
        [-0.7, 0.1, 0.2],
        [0.1, -0.9, 0.05],
        [0.0, 0.2, 1.0],
        [1e-3, 0.99, 1e-3],
        [-0.5, -0.3, -0.6],
    ];
    let rotated = "<rotate x='1' angle='70'/><rotate y='1' angle='30'/>";
    let cases: [(&str, [[f32; 3]; 6]); 3] = [
        (
            "",
            [
                [23.60386, 2.846785, 0.8531879],
                [35.449993, 6.7392926, 4.148022],
                [61.877464, 7.008841, 3.2248144],
                [32.230022, 10.623003, 2.6230023],
                [4.7771873, 4.252716, 1.8691786e-3],
                [46.89839, 7.7004104, 7.303028],
            ],
        ),
        (
            rotated,
            [
                [38.93197, 3.922886, 0.23400682],
                [42.29021, 7.344756, 5.7217474],
                [40.571205, 11.13368, 3.3715687],
                [18.197071, 5.0036435, 1.5457709],
                [29.304478, 4.3294454, 2.329238],
                [65.19845, 9.692055, 8.933529],
            ],
        ),
        (
            "<scale x='-1'/>",
            [
                [28.171867, 5.130789, 3.1243854],
                [31.335848, 4.68222, 1.3305616],
                [65.40161, 8.770926, 8.303094],
                [32.230022, 10.623003, 2.6230023],
                [7.277977, 5.502796, 3.6718554e-3],
                [39.109814, 3.8061204, 0.09779284],
            ],
        ),
    ];
    for (transform, expected) in cases {
        let inside = format!("<float name='scale' value='2'/><transform name='to_world'>{transform}</transform>");
        let scene = with_picture(&sky(&inside), |_, _| ()).unwrap();
        assert!(scene.warnings.is_empty() && scene.sources.iter().any(|s| s.ends_with("sky.pfm")));
        let map = scene.environment_map.unwrap();
        for (d, expected) in directions.into_iter().zip(expected) {
            // Any length will do. Mitsuba's arc cosine has lost digits near the pole.
            let tolerance = if d[1] == 0.99 { 2e-4 } else { 3e-5 };
            let (found, expected) = (map.lookup(3.0 * Vec3::from(d)).0, Rgb::from(expected));
            assert!(
                ((found - expected).abs() / (1.0 + expected)).max_element() < tolerance,
                "{transform} {d:?}: {found}"
            );
        }
    }
    // Through the poles and the seam the map is continuous.
    let map = with_picture(&sky(""), |_, _| ()).unwrap().environment_map.unwrap();
    for d in [Vec3::Y, Vec3::NEG_Y, Vec3::new(0.0, 0.0, -1.0), Vec3::Z, Vec3::new(1e-30, 1.0, -1e-30)] {
        let (value, pdf) = map.lookup(d);
        assert!(value.is_finite() && pdf > 0.0 && pdf.is_finite(), "{d}: {value} {pdf}");
    }
}

#[test]
fn broken_environment_maps_are_refused() {
    let negative = |i: usize, t: &mut Vec<f32>| {
        if i == 7 || i == 11 {
            t[1] = -0.25;
        }
    };
    let scene = with_picture(&sky(""), negative).unwrap();
    assert_eq!(scene.environment_map.as_ref().unwrap().texels()[7].y, 0.0);
    let warning = scene.warnings.join("\n");
    assert!(warning.contains("2 texels of") && warning.contains("are negative; taken as 0"), "{warning}");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let error = with_picture(&sky(""), |i, t| {
            if i == 13 {
                t[2] = bad
            }
        })
        .unwrap_err()
        .to_string();
        assert!(error.contains("sky.pfm: texel (3, 2) is") && error.contains("scene.xml:1:"), "{error}");
    }
    let huge = with_picture(&sky("<float name='scale' value='1e38'/>"), |_, _| ()).unwrap_err().to_string();
    assert!(huge.contains("must be finite"), "{huge}");
    for (inside, expected) in [
        ("<float name='scale' value='-1'/>", "scale is -1; it must be at least 0"),
        ("<transform name='to_world'><scale x='2'/></transform>", "stretches or skews"),
        ("<transform name='to_world'><matrix value='1 0.3 0  0 1 0  0 0 1'/></transform>", "stretches or skews"),
        ("<transform name='to_world'><scale value='0'/></transform>", "stretches or skews"),
        ("<texture type='bitmap'/>", "has no place in emitter `envmap`"),
    ] {
        let error = with_picture(&sky(inside), |_, _| ()).unwrap_err().to_string();
        assert!(error.contains("scene.xml:1:") && error.contains(expected), "{error}");
    }
    let twice = with_picture(&format!("{}<emitter type='constant'/>", sky("")), |_, _| ()).unwrap_err().to_string();
    assert!(twice.contains("a second environment"), "{twice}");
    let texels = |n| vec![Rgb::ONE; n];
    for (width, n) in [(0, 0), (1, 3), (2, 4), (3, 10), (1 << 16, 3 << 16)] {
        assert!(EnvironmentMap::new(width, texels(n), AXES).is_err(), "{width} columns, {n} texels");
    }
    assert!(EnvironmentMap::new(2, vec![Rgb::NEG_ONE; 6], AXES).unwrap_err().contains("texel (0, 0)"));
}

/// Over (columns, rows) of cells, in which the density is dω = sin θ dφ dθ times that over directions.
#[test]
fn environment_maps_follow_their_density() {
    const TEST: &str = "environment maps";
    const SAMPLES: u64 = 200_000;
    let axes = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.8, -0.6, 0.0), Vec3::Z];
    // As many cells as the test has: the density jumps at their edges. And fewer.
    for (width, height) in [(21, 14), (3, 14), (7, 3)] {
        let map = patterned(width, height, axes);
        let (columns, rows) = (f64::from(width), f64::from(height - 1));
        let [x, y, z] = axes.map(|a| a.as_dvec3());
        let at = |wi: Vec3| {
            let d = wi.as_dvec3();
            let d = DVec3::new(d.dot(x), d.dot(y), d.dot(z));
            let column = (d.x.atan2(-d.z) / TAU * columns - 0.5).rem_euclid(columns);
            [column, d.x.hypot(d.z).atan2(d.y) / PI * rows]
        };
        let direction = |[column, row]: [f64; 2]| {
            let (phi, theta) = ((column + 0.5) / columns * TAU, row / rows * PI);
            let d = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            (x * d.x + y * d.y + z * d.z).as_vec3()
        };
        let cell = TAU / columns * PI / rows;
        for (factor, sine, sound) in [(1.0, true, true), (0.98, true, false), (1.02, true, false), (1.0, false, false)]
        {
            let sample = |i| {
                let (wi, pdf) = map.sample(words(TEST, i));
                assert!(wi.is_normalized() && pdf > 0.0 && pdf.is_finite(), "{wi} {pdf}");
                Some(at(wi))
            };
            let density = |p: [f64; 2]| {
                let sine = if sine { (p[1] / rows * PI).sin() } else { 2.0 / PI };
                factor * f64::from(map.lookup(direction(p)).1) * sine * cell
            };
            let p = Chi2 { domain: [[0.0, columns], [0.0, rows]], samples: SAMPLES, sample, density }.p_value();
            assert_eq!(p > level(TEST), sound, "{width} × {height}, factor {factor}, sine {sine}: p = {p:e}");
        }
    }
}

/// The sampler's density is the lookup's, no word gives a NaN, and every cell with light can be drawn.
#[test]
fn samples_of_maps_have_their_densities() {
    let ends = [0, 255, 1 << 31, u32::MAX];
    for (width, height) in [(2, 3), (5, 4), (64, 33), (513, 257)] {
        let map = patterned(width, height, AXES);
        let scene = mapped(map.clone());
        let sampler = LightSampler::new(&scene, Lights::Area, LightChoice::Power);
        let mut rounded = 0;
        for i in 0..4096u32 {
            let w = if i < 64 { [0, 2, 4, 0].map(|s| ends[(i >> s & 3) as usize]) } else { words("maps", i.into()) };
            let s = sampler.sample(&scene, Vec3::ZERO, w).unwrap();
            assert!(matches!(s.to, LightTarget::Direction) && !s.delta && s.choice_pdf == 1.0);
            assert!(s.wi.is_normalized() && s.emitted.is_finite() && s.pdf > 0.0, "{s:?}");
            let (radiance, pdf) = map.lookup(s.wi);
            assert_eq!((radiance, pdf), (s.emitted, sampler.pdf_environment(s.wi)));
            // On the edge of a cell rounding may take the neighbour's.
            rounded += u32::from(pdf != s.pdf);
        }
        assert!(rounded < 80, "{width} × {height}: {rounded} samples have another density than the lookup");
        let directions = (0..10_000)
            .map(|i| words("maps", i))
            .map(|w| rootn::math::warp::sample_uniform_sphere([0, 1].map(|k| rootn::sampling::rng::unit_f32(w[k]))));
        for d in directions {
            let (radiance, pdf) = map.lookup(d);
            assert!(pdf > 0.0 || radiance == Rgb::ZERO, "{d}: {radiance} is never drawn");
        }
    }
    // Black maps are no lights, but still there.
    let black = mapped(EnvironmentMap::new(2, vec![Rgb::ZERO; 6], AXES).unwrap());
    assert!(LightSampler::new(&black, Lights::Area, LightChoice::Uniform).is_empty());
    let none = LightSampler::new(&mapped(patterned(4, 4, AXES)), Lights::None, LightChoice::Power);
    assert!(none.is_empty() && none.pdf_environment(Vec3::Y) == 0.0);
}

#[test]
fn spot_and_directional_lights_agree_with_mitsuba() {
    let look = "<transform name='to_world'><lookat origin='1 2 3' target='0 0 0.5' up='0 1 0'/></transform>";
    let intensity = "<rgb name='intensity' value='3 2 1'/>";
    let points = [[0.0, 0.0, 0.5], [1.5, 0.2, 0.3], [1.8, 0.2, 0.1], [1.0, 0.2, 0.6], [3.0, 0.0, 0.0], [2.0, 3.0, 3.5]];
    let wide = "<float name='cutoff_angle' value='150'/><float name='beam_width' value='5'/>";
    for (angles, expected) in [
        ("<float name='cutoff_angle' value='30'/>", [0.266_666_68, 0.127_511_58, 0.0, 0.333_333_37, 0.0, 0.0]),
        ("", [0.266_666_68, 0.0, 0.0, 0.170_977, 0.0, 0.0]),
        (wide, [0.266_666_68, 0.236_906_96, 0.199_870_93, 0.304_746_36, 0.125_828_25, 0.021_666_68]),
    ] {
        let scene =
            with_picture(&format!("<emitter type='spot'>{look}{intensity}{angles}</emitter>"), |_, _| ()).unwrap();
        let sampler = LightSampler::new(&scene, Lights::None, LightChoice::Power);
        for (p, expected) in points.into_iter().zip(expected) {
            let found = sampler.sample(&scene, Vec3::from(p), [0; 4]);
            assert_eq!(found.is_some(), expected > 0.0, "{angles} {p:?}");
            let Some(s) = found else { continue };
            assert!(s.delta && s.pdf == 1.0 && (s.emitted.x / expected - 1.0).abs() < 3e-5, "{angles} {p:?}: {s:?}");
            assert!(s.wi.dot((Vec3::new(1.0, 2.0, 3.0) - Vec3::from(p)).normalize()) > 0.999_999);
            assert!((s.emitted.z * 3.0 / s.emitted.x - 1.0).abs() < 1e-6);
        }
    }
    let to = Vec3::new(-0.43643582, 0.87287164, -0.21821791);
    for (given, expected) in [
        ("<vector name='direction' x='1' y='-2' z='0.5'/>", to),
        ("<transform name='to_world'><lookat origin='0 0 0' target='1 -2 0.5' up='0 1 0'/></transform>", to),
        ("", Vec3::NEG_Z),
    ] {
        let text = format!("<emitter type='directional'>{given}<rgb name='irradiance' value='3 2 1'/></emitter>");
        let scene = with_picture(&text, |_, _| ()).unwrap();
        let sampler = LightSampler::new(&scene, Lights::None, LightChoice::Power);
        let s = sampler.sample(&scene, Vec3::new(7.0, 8.0, 9.0), [1; 4]).unwrap();
        assert!(s.delta && s.pdf == 1.0 && s.emitted == Rgb::new(3.0, 2.0, 1.0), "{s:?}");
        assert!(matches!(s.to, LightTarget::Direction) && (s.wi - expected).length() < 1e-6, "{given}: {}", s.wi);
    }
}

#[test]
fn spots_and_directions_that_make_no_sense_are_refused() {
    for (emitter, expected) in [
        ("<emitter type='spot'><float name='cutoff_angle' value='0'/></emitter>", "above 0 and at most 180"),
        ("<emitter type='spot'><float name='cutoff_angle' value='200'/></emitter>", "above 0 and at most 180"),
        ("<emitter type='spot'><float name='cutoff_angle' value='1e-60'/></emitter>", "is 0 in 32-bit numbers"),
        ("<emitter type='spot'><float name='beam_width' value='21'/></emitter>", "allowed: 0 to cutoff_angle (20"),
        ("<emitter type='spot'><float name='beam_width' value='-1'/></emitter>", "allowed: 0 to cutoff_angle"),
        ("<emitter type='spot'><texture name='texture' type='bitmap'/></emitter>", "`texture` is not supported"),
        ("<emitter type='spot'><string name='texture' value='a.png'/></emitter>", "`texture` is not supported"),
        ("<emitter type='spot'><rgb name='intensity' value='-1'/></emitter>", "finite and at least 0"),
        ("<emitter type='spot'><transform name='to_world'><scale x='3'/></transform></emitter>", "stretches or skews"),
        ("<emitter type='spot'><transform name='to_world'><translate x='1e60'/></transform></emitter>", "32-bit"),
        ("<emitter type='directional'><vector name='direction' value='0'/></emitter>", "has no length"),
        (
            "<emitter type='directional'><vector name='direction' value='1'/><transform name='to_world'/></emitter>",
            "found both `direction` and `to_world`",
        ),
        ("<emitter type='sunsky'/>", "allowed: area, constant, directional, envmap, point, spot"),
        ("<emitter type='envmap'/>", "lacks the property `filename`"),
        ("<emitter type='envmap'><string name='filename' value='no.hdr'/></emitter>", "file `no.hdr` not found"),
        ("<emitter type='envmap'><string name='filename' value='scene.xml'/></emitter>", "not a picture"),
    ] {
        let error = with_picture(emitter, |_, _| ()).unwrap_err().to_string();
        assert!(error.contains("scene.xml:1:") && error.contains(expected), "{error}");
    }
}

/// The solid angle that a beam's falloff stands for, against its sum.
#[test]
fn beams_have_their_flux() {
    for (cutoff, width) in [(0.35, 0.26), (3.1, 0.0), (1.0, 1.0), (1e-4, 5e-5)] {
        let beam = Beam { axis: Vec3::Z, cutoff: cutoff as f32, width: width as f32 };
        let steps = 100_000;
        let ring = |i: i32| {
            let theta = (f64::from(i) + 0.5) / f64::from(steps) * cutoff;
            let w = DVec3::new(theta.sin(), 0.0, theta.cos()).as_vec3();
            TAU * theta.sin() * cutoff / f64::from(steps) * f64::from(beam.falloff(w))
        };
        let sum: f64 = (0..steps).map(ring).sum();
        assert!((beam.solid_angle() / sum - 1.0).abs() < 1e-4, "{cutoff} {width}: {} {sum}", beam.solid_angle());
        assert!(beam.falloff(Vec3::Z) == 1.0 && beam.falloff(Vec3::NEG_Z) == 0.0);
    }
}

/// The choice among lights follows their flux.
#[test]
fn choices_follow_fluxes() {
    let mut scene = mapped(EnvironmentMap::new(4, vec![Rgb::splat(0.25); 12], AXES).unwrap());
    let beam = Beam { axis: Vec3::X, cutoff: 1.5, width: 0.5 };
    scene.lights.push(Light::Spot { position: Vec3::ZERO, intensity: Rgb::splat(2.0), beam });
    scene.lights.push(Light::Directional { direction: Vec3::Y, irradiance: Rgb::splat(3.0) });
    // No surfaces: R = 1.
    let fluxes = [4.0 * PI * PI * 0.25, 2.0 * beam.solid_angle(), 3.0 * PI];
    let total: f64 = fluxes.iter().sum();
    let sampler = LightSampler::new(&scene, Lights::Area, LightChoice::Power);
    let mut seen = [false; 3];
    for i in 0..200 {
        let Some(s) = sampler.sample(&scene, Vec3::new(1.0, 0.1, 0.0), words("fluxes", i)) else { continue };
        assert!((f64::from(s.choice_pdf) * total / fluxes[s.light as usize] - 1.0).abs() < 1e-5, "{s:?}");
        assert_eq!(s.delta, s.light > 0);
        seen[s.light as usize] = true;
    }
    assert_eq!(seen, [true; 3]);
}

/// What a horizontal surface gets from a map with vertical y: the row means, linear in θ, times cos θ, by quadrature.
pub(crate) fn irradiance(width: u32, texels: &[Rgb]) -> f64 {
    let row = |j: usize| -> f64 {
        let row = &texels[j * width as usize..][..width as usize];
        row.iter().map(|c| f64::from(c.x)).sum::<f64>() / f64::from(width)
    };
    let rows = texels.len() / width as usize - 1;
    let steps = 100_000;
    let ring = |i: i32| {
        let theta = (f64::from(i) + 0.5) / f64::from(steps) * FRAC_PI_2;
        let at = theta / PI * rows as f64;
        let (j, t) = (at as usize, at.fract());
        ((1.0 - t) * row(j) + t * row(j + 1)) * TAU * theta.sin() * theta.cos() * FRAC_PI_2 / f64::from(steps)
    };
    (0..steps).map(ring).sum()
}
