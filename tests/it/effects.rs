//! What scenes call for and because of which objects, and that leaving out the rest changes no bit.

use crate::command_line::{ends, render};
use crate::determinism::{cornell, experiment};
use image::{Rgb, RgbImage};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimator};
use rootn::sampling::strategy::Preset;
use rootn::sampling::{Key, Role};
use rootn::scene::format::{Options, mitsuba::parse_str};
use rootn::scene::inventory::causes;
use rootn::scene::{Effects, Scene};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

const PINHOLE: &str = "<sensor type='perspective'>";
const SKY: &str = "<emitter type='constant'/>";
const BALL: &str = "<shape type='sphere' id='ball'/>";

/// A ball of a material.
fn ball(bsdf: &str) -> String {
    format!("<shape type='sphere' id='ball'>{bsdf}</shape>")
}

/// An effect, and a scene that calls for it: the start of its sensor, a light, objects. The one that calls is the last.
fn cases() -> Vec<(Effects, &'static str, &'static str, String)> {
    let ggx = "<string name='distribution' value='ggx'/>";
    let rough = |kind: &str, more: &str| ball(&format!("<bsdf type='{kind}'>{more}</bsdf>"));
    let board = "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>";
    let turned = format!("{ggx}<float name='alpha_u' value='0.1'/><float name='alpha_v' value='0.4'/>");
    let blend = "<bsdf type='blendbsdf'><float name='weight' value='0.3'/><bsdf type='conductor'/><bsdf type='diffuse'/></bsdf>";
    let bumpy = "<bsdf type='bumpmap'><texture type='bitmap'><string name='filename' value='sky.png'/>\
                 <boolean name='raw' value='true'/></texture><bsdf type='diffuse'/></bsdf>";
    let smooth = "<shape type='obj' id='ball'><string name='filename' value='smooth.obj'/></shape>";
    let lamp = "<transform name='to_world'><translate z='1.5'/></transform>\
                <emitter type='area'><rgb name='radiance' value='3'/></emitter>";
    let lamp = format!("<shape type='rectangle' id='ball'>{lamp}</shape>");
    let map = "<emitter type='envmap'><string name='filename' value='sky.png'/></emitter>";
    let spot = "<emitter type='spot'><float name='intensity' value='40'/><transform name='to_world'>\
                <lookat origin='0, 2, 4' target='0, 0, 0' up='0, 1, 0'/></transform></emitter>";
    let sun = "<emitter type='directional'><vector name='direction' x='1' y='-1' z='-2'/></emitter>";
    let lens = "<sensor type='thinlens'><float name='aperture_radius' value='0.1'/>\
                <float name='focus_distance' value='4'/>";
    vec![
        (Effects::TRIANGLES, PINHOLE, SKY, "<shape type='cube' id='ball'/>".into()),
        (Effects::QUADRICS, PINHOLE, SKY, BALL.into()),
        (Effects::SMOOTH_NORMALS, PINHOLE, SKY, smooth.into()),
        (Effects::EMITTING_SURFACES, PINHOLE, "", lamp),
        (Effects::ENVIRONMENT, PINHOLE, SKY, BALL.into()),
        (Effects::SAMPLED_LIGHTS, PINHOLE, SKY, BALL.into()),
        (Effects::DIFFUSE, PINHOLE, SKY, BALL.into()),
        (Effects::CONDUCTORS, PINHOLE, SKY, rough("conductor", "")),
        (Effects::DIELECTRICS, PINHOLE, SKY, rough("dielectric", "")),
        (Effects::THIN_DIELECTRICS, PINHOLE, SKY, rough("thindielectric", "")),
        (Effects::NULL, PINHOLE, SKY, rough("null", "")),
        (Effects::TEXTURES, PINHOLE, SKY, ball(board)),
        (Effects::TANGENTS, PINHOLE, SKY, rough("roughconductor", &turned)),
        (Effects::RELIEFS, PINHOLE, SKY, ball(bumpy)),
        (Effects::MIXTURES, PINHOLE, SKY, ball(blend)),
        (Effects::ENVIRONMENT_MAP, PINHOLE, map, BALL.into()),
        (Effects::LENS, lens, SKY, BALL.into()),
        (Effects::ORTHOGRAPHIC, "<sensor type='orthographic'>", SKY, BALL.into()),
        (Effects::ROUGH_CONDUCTORS, PINHOLE, SKY, rough("roughconductor", ggx)),
        (Effects::ROUGH_DIELECTRICS, PINHOLE, SKY, rough("roughdielectric", ggx)),
        (Effects::PLASTICS, PINHOLE, SKY, rough("plastic", "")),
        (Effects::ROUGH_PLASTICS, PINHOLE, SKY, rough("roughplastic", ggx)),
        (Effects::BECKMANN, PINHOLE, SKY, rough("roughconductor", "")),
        (Effects::SPOTS, PINHOLE, spot, BALL.into()),
        (Effects::DIRECTIONAL, PINHOLE, sun, BALL.into()),
    ]
}

/// A folder with what the scenes read.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    RgbImage::from_fn(8, 4, |x, y| Rgb([30 * x as u8, 60 * y as u8, 99])).save(folder.path().join("sky.png")).unwrap();
    let smooth = "v -1 0 0\nv 1 0 0\nv 0 1 0.3\nv 0 -1 0.4\nvn -0.3 0 1\nvn 0.4 0.1 1\nvn 0 0.5 1\nvn 0 -0.6 1\n\
                  f 1//1 2//2 3//3\nf 2//2 1//1 4//4\n";
    std::fs::write(folder.path().join("smooth.obj"), smooth).unwrap();
    folder
}

fn scene(folder: &Path, sensor: &str, objects: &str, size: u32) -> Scene {
    let text = format!(
        "<scene version='3.0.0'>\
         <integrator type='path'><integer name='max_depth' value='5'/></integrator>\
         {sensor}<transform name='to_world'><lookat origin='0.3, 0.5, 5' target='0, 0, 0' up='0, 1, 0'/></transform>\
         <film type='hdrfilm'><integer name='width' value='{size}'/><integer name='height' value='{size}'/></film></sensor>\
         {objects}</scene>"
    );
    parse_str(&text, &folder.join("scene.xml"), &Options::default()).unwrap()
}

/// Textures, rough metal and a spot light in one scene: all that takes the long variant of the kernels, and little else.
#[cfg(feature = "vulkan")]
pub(crate) fn rare(size: u32) -> Scene {
    let wanted = [Effects::TEXTURES, Effects::ROUGH_CONDUCTORS, Effects::SPOTS];
    let chosen = cases().into_iter().filter(|(e, ..)| wanted.contains(e));
    let moved = |i: usize, (_, _, light, object): (Effects, &str, &str, String)| {
        let to = format!("<transform name='to_world'><translate x='{}'/></transform></shape>", i as f32 - 1.0);
        let light = if light == SKY { "" } else { light };
        format!(
            "{light}{}",
            object.replace("</shape>", &to).replace("'ball'", &format!("'ball {i}'")).replace(BALL, "")
        )
    };
    let objects: String = chosen.enumerate().map(|(i, case)| moved(i, case)).collect();
    scene(folder().path(), PINHOLE, &format!("{SKY}{objects}"), size)
}

/// Every effect has a scene that calls for it, because of an object that is named, and one that does not; in all of them the
/// general code gives the bits of the special one.
#[test]
fn leaving_out_changes_no_bit() {
    let folder = folder();
    let cases = cases();
    assert_eq!(cases.iter().map(|c| c.0).collect::<Vec<_>>(), Effects::ALL.map(|(e, _)| e));
    let mut lacking = BTreeSet::new();
    for (effect, sensor, light, object) in &cases {
        let scene = scene(folder.path(), sensor, &format!("{light}{object}"), 8);
        let effects = Effects::of(&scene, true);
        let called = causes(&scene, true);
        let name = called.iter().find(|c| c.effect == *effect).map(|c| c.name);
        assert!(effects.contains(*effect) && name.is_some(), "{effect:?}: {effects:?}");
        assert_eq!(called.iter().fold(Effects::NONE, |all, c| all.with(c.effect)), effects);
        assert!(called.iter().flat_map(|c| &c.objects).all(|o| !o.is_empty() && !o.contains("no shape")), "{called:?}");
        let because = &called.iter().find(|c| c.effect == *effect).unwrap().objects;
        let expected = match *effect {
            Effects::LENS => "thin lens camera",
            Effects::ORTHOGRAPHIC => "orthographic camera",
            Effects::ENVIRONMENT | Effects::SAMPLED_LIGHTS => "constant environment",
            Effects::ENVIRONMENT_MAP => "environment map",
            Effects::SPOTS => "spot light 0",
            Effects::DIRECTIONAL => "directional light 0",
            _ => "ball",
        };
        assert_eq!(because[..], [expected]);
        let prepared = Arc::new(PreparedScene::new(scene).unwrap());
        for preset in [Preset::Mis, Preset::Importance] {
            let own = Effects::of(&prepared.scene, preset == Preset::Mis);
            lacking.extend(own.left_out().names());
            let estimator = || CpuEstimator::new(Arc::clone(&prepared), preset.strategy());
            let (special, general) = (estimator(), estimator().with_all_effects());
            assert_ne!(special.identity(), general.identity());
            let cell = Cell { key: Key::new(1, Role::Run, "effects", 0), length: 70 };
            let of = |e: &CpuEstimator| e.estimate(&cell, 70, &mut None).unwrap();
            let (a, b) = (of(&special), of(&general));
            let bytes = |e: &rootn::estimator::Estimate| {
                bytemuck::cast_slice::<_, u8>(e.moments.as_ref().unwrap().nodes()).to_vec()
            };
            assert!(bytes(&a) == bytes(&b), "{name:?}, {preset:?}");
            // Lights without extent are not found by directions.
            let dark = preset == Preset::Importance && a.field.iter().all(|&v| v == 0.0);
            assert!(dark || a.field.iter().any(|&v| v > 0.0), "{name:?}");
        }
    }
    assert_eq!(lacking.len(), Effects::ALL.len(), "{lacking:?}");
    assert_eq!(Effects::EVERY.names().count(), Effects::ALL.len());
    assert_eq!(Effects::EVERY.left_out(), Effects::NONE);
}

#[test]
fn all_effects_of_commands() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let plain = render(here, &["--spp", "16", "--quiet", "--device", "cpu"]);
    assert_eq!(render(here, &["--spp", "16", "--quiet", "--device", "cpu", "--all-effects"]), plain);
    let scene = cornell();
    let replay = ["replay", scene.to_str().unwrap(), "--pixel", "3,2", "--width", "6", "--height", "5"];
    assert_eq!(ends(here, 0, &replay), ends(here, 0, &[&replay[..], &["--all-effects"]].concat()));
    experiment(here, &scene, 16, "");
    let run = |more: &[&str]| -> Value {
        let fixed = ["run", "small.toml", "--json", "--quiet", "--device", "cpu"];
        serde_json::from_str(&ends(here, 0, &[&fixed[..], more].concat()).0).unwrap()
    };
    let (special, general) = (run(&[]), run(&["--all-effects"]));
    let strategies = |record: &Value| record["scenes"][0]["strategies"].as_array().unwrap().clone();
    for (a, b) in strategies(&special).iter().zip(&strategies(&general)) {
        assert_eq!((a["device"].as_str(), b["device"].as_str()), (Some("cpu"), Some("cpu · all effects")));
        // Seconds are others, so nothing is reused.
        assert_ne!(a["identity"], b["identity"]);
        for (a, b) in a["checkpoints"].as_array().unwrap().iter().zip(b["checkpoints"].as_array().unwrap()) {
            assert_eq!(a["metrics"], b["metrics"]);
        }
    }
    assert_eq!(special["scenes"][0]["reference"]["mean"], general["scenes"][0]["reference"]["mean"]);
}

#[test]
fn only_direct_light() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let only = ["--only", "direct"];
    let image = render(here, &[&["--spp", "1", "--quiet", "--seed", "5", "--device", "cpu"][..], &only].concat());
    let direct = image.layer("").unwrap().1;
    let scene = cornell();
    let scene = scene.to_str().unwrap();
    let mut deepest = 0;
    for pixel in 0..30 {
        let at = format!("{},{}", pixel % 6, pixel / 6);
        let fixed = ["replay", scene, "--pixel", &at, "--width", "6", "--height", "5", "--seed", "5", "--json"];
        let (stdout, _) = ends(here, 0, &[&fixed[..], &only].concat());
        let path: Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!(path["radiance"][0].as_f64().unwrap() as f32, direct[3 * pixel]);
        deepest = deepest.max(stdout.matches("\"Contribution\"").count());
        assert!(!stdout.contains("\"depth\": 3"), "{stdout}");
    }
    let (_, stderr) = ends(here, 2, &["render", scene, "-o", "x.exr", "--only", "indirect"]);
    assert!(stderr.contains("direct"), "{stderr}");
    experiment(here, &cornell(), 16, "");
    let (stdout, _) = ends(here, 0, &["run", "small.toml", "--quiet", "--only", "direct"]);
    for said in
        ["paths of at most 2 edges", "direct light only: mis, stratified, sobol", "Sobol points, direct light only"]
    {
        assert!(stdout.contains(said), "{said}: {stdout}");
    }
    assert!(stdout.contains("--only direct restricts"), "{stdout}");
    let record = std::fs::read_to_string(here.join("reports/small/record.json")).unwrap();
    let record: Value = serde_json::from_str(&record).unwrap();
    let strategies = record["scenes"][0]["strategies"].as_array().unwrap().clone();
    assert!(strategies.iter().all(|s| s["strategy"]["technique"] == "direct"));
    let page = std::fs::read_to_string(here.join("reports/small/report.html")).unwrap();
    assert!(page.contains("direct light only") && page.contains("<td>direct</td>"));
}
