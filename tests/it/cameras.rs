//! Thin-lens and orthographic cameras: rays against Mitsuba 3.9.1 (scalar_rgb) and against geometry.

use rootn::accel::Ray;
use rootn::math::{Vec3, warp};
use rootn::sampling::dimension::{Decision, group};
use rootn::scene::format::Options;
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::{Camera, Projection, Scene};
use std::path::Path;

/// A film of 30 × 20 pixels, of which 12 × 10 from (6, 4) on are rendered.
const FILM: &str = "<film type='hdrfilm'><integer name='width' value='30'/><integer name='height' value='20'/>
    <integer name='crop_width' value='12'/><integer name='crop_height' value='10'/>
    <integer name='crop_offset_x' value='6'/><integer name='crop_offset_y' value='4'/></film>";
const LOOK: &str = "<lookat origin='1 2 3' target='0.5 0 0' up='0 1 0'/>";
const CLIP: &str = "<float name='near_clip' value='0.1'/><float name='far_clip' value='20'/>";

fn read(plugin: &str, transform: &str, properties: &str) -> rootn::Result<Scene> {
    let text = format!(
        "<scene version='3.0.0'><emitter type='constant'/>\n<sensor type='{plugin}'>{properties}
         <transform name='to_world'>{transform}</transform>{FILM}</sensor></scene>"
    );
    parse_str(&text, Path::new("scene.xml"), &Options::default())
}

/// The ray of a position in the rendered part.
fn ray(scene: &Scene, [x, y]: [f32; 2], lens: [f32; 2]) -> Ray {
    scene.camera.ray([(6.0 + 12.0 * x) / 30.0, (4.0 + 10.0 * y) / 20.0], lens)
}

/// Position, lens position, origin, direction, length.
type Expected = ([f32; 2], [f32; 2], [f32; 3], [f32; 3], f32);

#[test]
fn lens_and_parallel_rays_agree_with_mitsuba() {
    let lens = "<float name='aperture_radius' value='0.25'/><float name='fov' value='50'/>";
    let focused = format!("{lens}{CLIP}<float name='focus_distance' value='3'/>");
    let scaled = format!("<scale x='2' y='2' z='3'/>{LOOK}");
    let cases: [(&str, &str, &str, [Expected; 2]); 2] = [
        (
            "thinlens",
            LOOK,
            &focused,
            [
                (
                    [0.25, 0.75],
                    [0.5, 0.5],
                    [0.968_286_6, 1.941_159_6, 2.923_177_2],
                    [-0.311_429_9, -0.577_821, -0.754_409_85],
                    20.264_467,
                ),
                (
                    [0.9, 0.1],
                    [0.9, 0.3],
                    [0.820_875_94, 1.896_225_7, 2.977_701_7],
                    [-0.036_906_35, -0.389_294_68, -0.920_373_5],
                    20.358_002,
                ),
            ],
        ),
        (
            "orthographic",
            &scaled,
            CLIP,
            [
                (
                    [0.25, 0.75],
                    [0.5, 0.5],
                    [0.187_742_22, 1.668_061, 2.992_663_6],
                    [-0.137_360_57, -0.549_442_3, -0.824_163_4],
                    19.9,
                ),
                (
                    [0.9, 0.1],
                    [0.9, 0.3],
                    [1.135_307_7, 2.392_188_5, 2.351_984_5],
                    [-0.137_360_57, -0.549_442_3, -0.824_163_4],
                    19.9,
                ),
            ],
        ),
    ];
    for (plugin, transform, properties, rays) in cases {
        let scene = read(plugin, transform, properties).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        for (position, lens, origin, direction, length) in rays {
            let r = ray(&scene, position, lens);
            let (origin, direction) = (Vec3::from(origin), Vec3::from(direction));
            let name = format!("{plugin} {position:?}: {r:?}");
            assert!((r.origin - origin).abs().max_element() < 2e-6, "{name}");
            assert!((r.direction.normalize() - direction).abs().max_element() < 1e-6, "{name}");
            assert!((r.t_max * r.direction.length() / length - 1.0).abs() < 1e-5, "{name}");
        }
    }
    // Mitsuba's focus lies at its far clip by default.
    let scene = read("thinlens", LOOK, lens).unwrap();
    let direction = ray(&scene, [0.9, 0.1], [0.9, 0.3]).direction.normalize();
    assert!((direction - Vec3::new(-0.094_901_2, -0.413_952_68, -0.905_338)).abs().max_element() < 1e-6, "{direction}");
}

/// Rays start on a disk, meet in the plane in focus and spread as far as similar triangles say; without a radius they are the
/// pinhole's.
#[test]
fn lenses_obey_the_geometry_of_thin_lenses() {
    let (radius, focus) = (0.25f32, 3.0f32);
    let lens = |radius| {
        let focus = format!("<float name='focus_distance' value='{focus}'/>");
        read("thinlens", LOOK, &format!("<float name='aperture_radius' value='{radius}'/>{focus}")).unwrap()
    };
    let (sharp, scene) = (lens(0.0), lens(radius));
    let forward = (Vec3::new(0.5, 0.0, 0.0) - Vec3::new(1.0, 2.0, 3.0)).normalize();
    let mut mean = Vec3::ZERO;
    for i in 0..1024u32 {
        let u = [i % 32, i / 32].map(|k| (k as f32 + 0.5) / 32.0);
        let position = [0.3, 0.8];
        let (r, pinhole) = (ray(&scene, position, u), ray(&sharp, position, u));
        assert_eq!(pinhole.origin, sharp.camera.origin);
        let offset = r.origin - pinhole.origin;
        assert!(offset.length() <= radius * 1.000_001 && offset.dot(forward).abs() < 1e-6);
        let at = warp::sample_uniform_disk(u).length() * radius;
        assert!((offset.length() - at).abs() < 1e-6);
        // Directions have unit length along the optical axis.
        assert!((r.direction.dot(forward) - 1.0).abs() < 1e-6);
        for depth in [0.5, focus, 10.0] {
            let apart = (r.origin + r.direction * depth) - (pinhole.origin + pinhole.direction * depth);
            assert!((apart - offset * (1.0 - depth / focus)).length() < 5e-6, "at {depth}: {apart}");
        }
        mean += offset / 1024.0;
    }
    assert!(mean.length() < 0.01 * radius, "{mean}");
    let pinhole = read("perspective", LOOK, "").unwrap().camera;
    assert_eq!(Camera { projection: Projection::Pinhole, ..scene.camera }, pinhole);
    // What the lens draws is drawn by nothing else, and no other number moved for it.
    let others = (0..9).flat_map(|v| [group(v, Decision::Direction), group(v + 1, Decision::Light)]);
    assert!(others.into_iter().all(|g| g != group(0, Decision::Lens)));
    assert_eq!([group(0, Decision::Direction), group(3, Decision::Direction), group(3, Decision::Light)], [0, 6, 7]);
}

#[test]
fn lenses_that_make_no_sense_are_refused() {
    let lens = |focus: &str| {
        format!("<float name='aperture_radius' value='0.1'/><float name='focus_distance' value='{focus}'/>")
    };
    for (plugin, transform, properties, expected) in [
        ("thinlens", LOOK, String::new(), "lacks the property `aperture_radius`"),
        ("thinlens", LOOK, "<float name='aperture_radius' value='-1'/>".into(), "aperture_radius is -1"),
        ("thinlens", LOOK, "<float name='aperture_radius' value='1e60'/>".into(), "not finite"),
        ("thinlens", LOOK, lens("0"), "focus_distance is 0; it must be above 0"),
        ("thinlens", LOOK, lens("1e-60"), "must be finite"),
        ("thinlens", "<scale x='2'/>", lens("1"), "unequally"),
        ("orthographic", "<scale x='0'/>", String::new(), "no extent"),
        ("orthographic", "<scale z='0'/>", String::new(), "takes the z axis to nothing"),
        ("orthographic", "<scale x='1e60'/>", String::new(), "not finite"),
        ("orthographic", LOOK, "<float name='far_clip' value='-1'/>".into(), "0 ≤ near < far is wanted"),
        ("fisheye", LOOK, String::new(), "allowed: perspective, thinlens, orthographic"),
    ] {
        let message = read(plugin, transform, &properties).expect_err(expected).to_string();
        assert!(message.starts_with("scene.xml:2:1: ") && message.contains(expected), "{message}");
    }
    let wide = read("orthographic", LOOK, "<float name='fov' value='50'/>").unwrap();
    assert!(wide.warnings[0].contains("`fov` of sensor `orthographic` has no effect"), "{:?}", wide.warnings);
}
