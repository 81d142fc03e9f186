//! Bump and normal maps. Expected values marked so come from Mitsuba 3.9.1 (scalar_rgb, path, one sample of one pixel).

use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimator};
use rootn::sampling::Key;
use rootn::sampling::strategy::Preset;
use rootn::scene::Scene;
use rootn::scene::format::Options;
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::material::ReliefMap;
use std::path::Path;
use std::sync::Arc;

const DIFFUSE: &str = "<bsdf type='diffuse'><rgb name='reflectance' value='0.8 0.5 0.3'/></bsdf>";
const GLASS: &str = "<bsdf type='roughdielectric'><float name='alpha' value='0.4'/>
    <string name='distribution' value='ggx'/></bsdf>";
const METAL: &str = "<bsdf type='roughconductor'><float name='alpha_u' value='0.1'/><float name='alpha_v' value='0.5'/>
    <string name='distribution' value='ggx'/></bsdf>";
const MIRROR: &str = "<bsdf type='conductor'/>";
const SKY: &str = "<emitter type='constant'/>";
const UNLIT: &str = "<boolean name='use_shadowing_function' value='false'/>";
const UNTURNED: &str = "<boolean name='flip_invalid_normals' value='false'/>";

/// A PFM of one or three channels.
fn picture(path: &Path, size: [usize; 2], channels: usize, values: &[f32]) {
    let kind = if channels == 3 { "PF" } else { "Pf" };
    let mut bytes = format!("{kind}\n{} {}\n-1.0\n", size[0], size[1]).into_bytes();
    // Rows from the bottom up.
    bytes.extend(values.chunks(size[0] * channels).rev().flatten().flat_map(|v| v.to_le_bytes()));
    std::fs::write(path, bytes).unwrap();
}

/// A folder with pictures and a smooth mesh.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    picture(&at("bump.pfm"), [3, 2], 1, &[0.1, 0.4, 0.7, 0.2, 0.3, 0.9]);
    picture(&at("flat.pfm"), [3, 2], 1, &[0.3; 6]);
    picture(&at("ramp.pfm"), [2, 1], 1, &[0.25, 0.75]);
    picture(&at("normal.pfm"), [2, 1], 3, &[0.6, 0.4, 0.9, 0.3, 0.6, 0.8]);
    picture(&at("steep.pfm"), [2, 1], 3, &[0.9, 0.5, 0.6, 0.95, 0.4, 0.55]);
    std::fs::write(
        at("smooth.obj"),
        "v -2 -2 0\nv 2 -2 0.3\nv 2 2 0\nv -2 2 0.2\nvt 0 0\nvt 2 0.2\nvt 2.1 1.5\nvt 0.1 1.4\nvn -0.3 0 1\nvn 0.4 0.1 1\n\
         vn 0 0.5 1\nvn 0.2 -0.6 1\nf 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\n",
    )
    .unwrap();
    folder
}

fn texture(file: &str, more: &str) -> String {
    format!(
        "<texture type='bitmap' name='normalmap'><string name='filename' value='{file}.pfm'/>
         <boolean name='raw' value='true'/><string name='wrap_mode' value='clamp'/>{more}</texture>"
    )
}

fn bump(bsdf: &str, file: &str, scale: f32, more: &str) -> String {
    format!("<bsdf type='bumpmap'><float name='scale' value='{scale}'/>{more}{}{bsdf}</bsdf>", texture(file, ""))
}

fn normal(bsdf: &str, file: &str, more: &str) -> String {
    format!("<bsdf type='normalmap'>{more}{}{bsdf}</bsdf>", texture(file, ""))
}

fn two_sided(bsdf: &str) -> String {
    format!("<bsdf type='twosided'>{bsdf}</bsdf>")
}

fn sun(direction: &str) -> String {
    format!(
        "<emitter type='directional'><vector name='direction' value='{direction}'/><rgb name='irradiance' value='1'/></emitter>"
    )
}

fn read(folder: &Path, content: &str) -> rootn::Result<Scene> {
    parse_str(&format!("<scene version='3.0.0'>{content}</scene>"), &folder.join("scene.xml"), &Options::default())
}

/// The front of `shape` in one pixel that is next to a point, seen from `from`.
fn look(folder: &Path, from: [f32; 3], lights: &str, shape: &str) -> Scene {
    let [x, y, z] = from;
    let target = if x.abs() < 1.0 { 0.3 } else { 0.0 };
    let content = format!(
        "<integrator type='path'><integer name='max_depth' value='2'/></integrator>
         <sensor type='perspective'><float name='fov' value='0.0001'/>
         <transform name='to_world'><lookat origin='{x}, {y}, {z}' target='{target}, 0.2, 0' up='0, 1, 0.01'/></transform>
         <film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/><rfilter type='box'/></film>
         </sensor>{lights}{shape}"
    );
    read(folder, &content).unwrap()
}

fn rectangle(bsdf: &str) -> String {
    format!(
        "<shape type='rectangle'><transform name='to_world'><scale x='2' y='1.5'/><rotate x='0.6' z='0.8' angle='20'/>
         </transform>{bsdf}</shape>"
    )
}

/// Means over the samples of every pixel.
fn means(scene: Scene, spp: u64) -> Vec<f64> {
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let cell = Cell { key: Key([1, 2]), length: spp };
    CpuEstimator::new(prepared, Preset::Mis.strategy()).estimate(&cell, spp, &mut None).unwrap().field
}

/// Of what is seen from where, in what light, with Mitsuba's value.
type Case = (&'static str, String, String, [f32; 3], [f64; 3]);

fn cases() -> Vec<Case> {
    let (up, down, left) = (sun("-0.4, 0.3, -1"), sun("-0.4, 0.3, 1"), sun("1.2, 0.3, -1"));
    let (above, below, right) = ([0.3, 0.2, 5.0], [0.3, 0.2, -5.0], [4.0, 0.2, 1.0]);
    let leftmost = [-4.0, 0.2, 1.2];
    let (up, sky) = (|| up.clone(), || SKY.to_owned());
    let (down, left) = (|| down.clone(), || left.clone());
    let mask = format!("<bsdf type='mask'><float name='opacity' value='1'/>{DIFFUSE}</bsdf>");
    let turned = "<transform name='to_uv'><scale x='0.5' y='0.7'/><translate x='0.1' y='0.2'/></transform>";
    let scaled =
        format!("<bsdf type='bumpmap'><float name='scale' value='2'/>{}{DIFFUSE}</bsdf>", texture("bump", turned));
    let mesh = |bsdf: &str| format!("<shape type='obj'><string name='filename' value='smooth.obj'/>{bsdf}</shape>");
    let ball = |bsdf: &str| format!("<shape type='sphere'>{bsdf}</shape>");
    let r = |bsdf: &str| rectangle(bsdf);
    let (d, steep) = (DIFFUSE, |bsdf: &str, more: &str| rectangle(&normal(bsdf, "steep", more)));
    vec![
        ("bump", r(&bump(d, "bump", 1.0, "")), up(), above, [0.199783, 0.124864, 0.0749186]),
        ("bump, no shadows", r(&bump(d, "bump", 1.0, UNLIT)), up(), above, [0.199886, 0.124928, 0.0749571]),
        ("bump × 3", r(&bump(d, "bump", 3.0, "")), up(), above, [0.107231, 0.0670194, 0.0402116]),
        ("bump × 30", r(&bump(d, "bump", 30.0, "")), left(), above, [0.161815, 0.101134, 0.0606805]),
        ("bump, to_uv", r(&scaled), up(), above, [0.226502, 0.141564, 0.0849382]),
        ("normal", r(&normal(d, "normal", "")), up(), above, [0.201733, 0.126083, 0.0756497]),
        ("normal, no shadows", r(&normal(d, "normal", UNLIT)), up(), above, [0.201818, 0.126136, 0.0756818]),
        ("steep, from the right", steep(d, ""), up(), right, [0.114097, 0.0713108, 0.0427865]),
        ("steep, from the left", steep(d, ""), left(), leftmost, [0.171949, 0.107468, 0.064481]),
        ("steep, from the left, not turned", steep(d, UNTURNED), left(), leftmost, [0.0; 3]),
        (
            "two-sided bump from behind",
            r(&two_sided(&bump(d, "bump", 3.0, ""))),
            down(),
            below,
            [0.0899743, 0.0562339, 0.0337404],
        ),
        (
            "bump of two-sided from behind",
            r(&bump(&two_sided(d), "bump", 3.0, "")),
            down(),
            below,
            [0.187317, 0.117073, 0.0702439],
        ),
        (
            "two-sided normal from behind",
            r(&two_sided(&normal(d, "normal", ""))),
            down(),
            below,
            [0.164459, 0.102787, 0.0616722],
        ),
        (
            "normal of two-sided from behind",
            r(&normal(&two_sided(d), "normal", "")),
            down(),
            below,
            [0.227305, 0.142066, 0.0852395],
        ),
        ("glass, reflected", r(&normal(GLASS, "normal", "")), up(), above, [0.00482496; 3]),
        ("glass, refracted", r(&normal(GLASS, "normal", "")), down(), above, [0.0526339; 3]),
        ("glass from behind, refracted", r(&normal(GLASS, "normal", "")), up(), below, [0.379213; 3]),
        ("glass from behind, reflected", r(&bump(GLASS, "bump", 3.0, "")), down(), below, [0.00227153; 3]),
        // Mitsuba's metal in the frame along ∂p/∂u. Its bump map (unlike its normal map) takes the world coordinates of ∂p/∂u
        // for local ones: 0.000958493.
        ("anisotropic metal", r(&bump(METAL, "bump", 2.0, "")), up(), above, [0.000783359; 3]),
        ("anisotropic metal, normal", r(&normal(METAL, "normal", "")), up(), above, [0.00391469; 3]),
        ("masked", r(&bump(&mask, "bump", 3.0, "")), up(), above, [0.107231, 0.0670194, 0.0402116]),
        ("mirror and sky", r(&normal(MIRROR, "normal", "")), sky(), above, [0.998382; 3]),
        ("mirror and sky, steep, from the right", steep(MIRROR, ""), sky(), right, [0.0951641; 3]),
        ("mirror and sky, steep, from the left", steep(MIRROR, ""), sky(), leftmost, [0.172566; 3]),
        ("nothing and sky", r(&normal("<bsdf type='null'/>", "normal", "")), sky(), above, [0.999854; 3]),
        ("smooth mesh, bump", mesh(&bump(d, "bump", 3.0, "")), up(), above, [0.190075, 0.118797, 0.0712781]),
        ("smooth mesh, normal", mesh(&normal(d, "normal", "")), up(), above, [0.0523901, 0.0327438, 0.0196463]),
        (
            "smooth mesh, two-sided bump from behind",
            mesh(&two_sided(&bump(d, "bump", 3.0, ""))),
            down(),
            below,
            [0.246747, 0.154217, 0.0925303],
        ),
        ("sphere, bump", ball(&bump(d, "bump", 3.0, "")), up(), above, [0.22611, 0.141319, 0.0847914]),
        ("sphere, normal", ball(&normal(d, "normal", "")), up(), above, [0.176659, 0.110412, 0.066247]),
    ]
}

#[test]
fn reliefs_look_as_in_mitsuba() {
    let folder = folder();
    let mut failures = Vec::new();
    for (name, shape, lights, from, expected) in cases() {
        let found = means(look(folder.path(), from, &lights, &shape), 1);
        let far = found.iter().zip(expected).any(|(f, e)| (f - e).abs() > 1e-4 * e.max(1e-2));
        println!("{name:42} {found:?}, Mitsuba {expected:?}");
        if far {
            failures.push(name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// Heights 0.25 and 0.75 at the centres of two texels: dh/du = 1 between them, where ∂p/∂u = 4. A plane of that slope, and one
/// with the normal of a normal map, in parallel light: L = ρ/π n·l, times 2/(1 + √(1 + α² tan²θ)), α² = tan²(n)/8.
#[test]
fn slopes_are_those_of_tilted_planes() {
    let folder = folder();
    let l = glam::DVec3::new(0.4, -0.3, 1.0).normalize();
    for scale in [-6.0, -1.0, 0.5, 2.0] {
        for shadows in [false, true] {
            let more = if shadows { "" } else { UNLIT };
            let slope = f64::from(scale) / 4.0;
            let normals = "<rgb name='normalmap' value='0.75 0.5 0.9'/>".to_owned() + more;
            let bumpy = (bump(DIFFUSE, "ramp", scale, more), glam::DVec3::new(-slope, 0.0, 1.0));
            let normal = (format!("<bsdf type='normalmap'>{normals}{DIFFUSE}</bsdf>"), glam::DVec3::new(0.5, 0.0, 0.8));
            for (bsdf, n) in [bumpy, normal] {
                let shape = format!(
                    "<shape type='rectangle'><transform name='to_world'><scale x='2'/></transform>{bsdf}</shape>"
                );
                let found = means(look(folder.path(), [0.3, 0.2, 5.0], &sun("-0.4, 0.3, -1"), &shape), 1);
                let n = n.normalize();
                let tan2 = |z: f64| 1.0 / (z * z) - 1.0;
                let alpha2 = if shadows { (tan2(n.z) / 8.0).min(1.0) } else { 0.0 };
                let shadow = 2.0 / (1.0 + (1.0 + alpha2 * tan2(l.z)).sqrt());
                let exact = 0.8 / std::f64::consts::PI * n.dot(l).max(0.0) * shadow;
                assert!((found[0] - exact).abs() < 1e-5 * exact.max(0.01), "{scale} {shadows}: {} {exact}", found[0]);
            }
        }
    }
}

/// A room of bent materials under the sky and a lamp.
#[cfg(feature = "vulkan")]
pub(crate) fn room(film: u32) -> Scene {
    let folder = folder();
    let at = |x: f32, y: f32| {
        format!("<transform name='to_world'><scale value='0.8'/><translate x='{x}' y='{y}' z='0.8'/></transform>")
    };
    let ball = |x, y, bsdf: &str| format!("<shape type='sphere'>{}{bsdf}</shape>", at(x, y));
    let blend = format!("<bsdf type='blendbsdf'><float name='weight' value='0.4'/>{DIFFUSE}{METAL}</bsdf>");
    let content = format!(
        "<integrator type='path'><integer name='max_depth' value='6'/></integrator>
         <sensor type='perspective'><float name='fov' value='50'/>
         <transform name='to_world'><lookat origin='0, -6, 4' target='0, 0, 0' up='0, 0, 1'/></transform>
         <film type='hdrfilm'><integer name='width' value='{film}'/><integer name='height' value='{film}'/></film></sensor>
         <emitter type='constant'><rgb name='radiance' value='0.3 0.4 0.5'/></emitter>
         <shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/><translate z='4'/></transform>
         <emitter type='area'><rgb name='radiance' value='9 8 7'/></emitter></shape>
         <shape type='obj'><string name='filename' value='smooth.obj'/>
         <transform name='to_world'><scale value='2'/></transform>{}</shape>{}{}{}{}{}",
        bump(DIFFUSE, "bump", 4.0, ""),
        ball(-1.5, -1.0, &bump(METAL, "bump", 0.5, "")),
        ball(0.0, -1.0, &normal(GLASS, "normal", "")),
        ball(1.5, -1.0, &two_sided(&bump(&blend, "bump", 1.0, UNLIT))),
        ball(-0.8, 0.6, &normal("<bsdf type='dielectric'/>", "steep", "")),
        ball(0.8, 0.6, &normal(MIRROR, "steep", UNTURNED)),
    );
    read(folder.path(), &content).unwrap()
}

/// Flat maps leave every bit as it is.
#[test]
fn flat_reliefs_change_nothing() {
    let folder = folder();
    let flat = |bsdf: &str| bump(bsdf, "flat", 30.0, "");
    let straight =
        |bsdf: &str| format!("<bsdf type='normalmap'><rgb name='normalmap' value='0.5 0.5 1'/>{bsdf}</bsdf>");
    let smooth = |bsdf: &str| {
        let lights = format!("{SKY}{}", sun("-0.4, 0.3, -1"));
        let shape = format!("<shape type='obj'><string name='filename' value='smooth.obj'/>{bsdf}</shape>");
        means(look(folder.path(), [0.3, 0.2, 5.0], &lights, &shape), 64)
    };
    for bsdf in [DIFFUSE, GLASS, METAL, MIRROR, &two_sided(DIFFUSE)] {
        let plain = smooth(bsdf);
        assert_eq!(plain, smooth(&flat(bsdf)), "{bsdf}");
        assert_eq!(plain, smooth(&straight(bsdf)), "{bsdf}");
    }
}

#[test]
fn what_is_no_relief_is_refused() {
    let folder = folder();
    image::GrayImage::new(2, 2).save(folder.path().join("grey.png")).unwrap();
    let scene = |bsdf: &str| {
        let content = format!("<sensor type='perspective'/>{SKY}<shape type='sphere'>{bsdf}</shape>");
        read(folder.path(), &content)
    };
    let inner = bump(DIFFUSE, "bump", 1.0, "");
    for (bsdf, message) in [
        (format!("<bsdf type='bumpmap'>{DIFFUSE}</bsdf>"), "needs a texture inside"),
        (format!("<bsdf type='bumpmap'>{}</bsdf>", texture("bump", "")), "needs a BSDF inside"),
        (format!("<bsdf type='bumpmap'>{DIFFUSE}{DIFFUSE}</bsdf>"), "one BSDF and one texture"),
        (format!("<bsdf type='bumpmap'><texture type='checkerboard'/>{DIFFUSE}</bsdf>"), "has no slopes"),
        (format!("<bsdf type='normalmap'>{DIFFUSE}</bsdf>"), "named `normalmap`"),
        (normal(DIFFUSE, "bump", ""), "has one channel"),
        (normal(&inner, "normal", ""), "a relief inside another one"),
    ] {
        let error = scene(&bsdf).unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("scene.xml:1:"), "{error}");
    }
    // As Mitsuba 0.x has it.
    let wrapped = bump(DIFFUSE, "bump", 2.0, "")
        .replace("<texture", "<texture type='scale'><float name='scale' value='3'/><texture");
    let wrapped = scene(&wrapped.replace("</texture>", "</texture></texture>")).unwrap();
    let scales = wrapped.materials.iter().filter_map(|m| m.relief).map(|r| r.map);
    assert!(
        scales.eq([ReliefMap::Bump { texture: 0, scale: 6.0 }]) && wrapped.warnings.len() == 1,
        "{:?}",
        wrapped.warnings
    );
    let decoded = normal(DIFFUSE, "normal", "").replace("normal.pfm", "grey.png").replace("true", "false");
    assert!(scene(&decoded).unwrap_err().to_string().contains("one channel"));
}
