//! `rootn explain`: what it says of scenes, and how it ends.

use crate::command_line::ends;
use crate::determinism::cornell;
use serde_json::Value;

/// A ball of glass on a diffuse floor under a disk, a point and nothing else.
const GLASS: &str = "<scene version='3.0.0'>\
    <integrator type='path'><integer name='max_depth' value='3'/></integrator>\
    <sensor type='perspective'><film type='hdrfilm'><integer name='width' value='9'/><integer name='height' value='7'/></film></sensor>\
    <shape type='rectangle' id='floor'/>\
    <shape type='sphere' id='ball'><bsdf type='dielectric'/></shape>\
    <shape type='disk' id='lamp'><emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>\
    <emitter type='point'/>\
    <emitter type='point'><boolean name='nonsense' value='true'/></emitter></scene>";

fn words(value: &Value, key: &str) -> Vec<String> {
    value.as_array().unwrap().iter().map(|v| v[key].as_str().unwrap().to_owned()).collect()
}

#[test]
fn what_a_scene_calls_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("glass.xml"), GLASS).unwrap();
    let (stdout, stderr) = ends(here, 0, &["explain", "glass.xml", "--json"]);
    assert!(stderr.is_empty(), "{stderr}");
    let said: Value = serde_json::from_str(&stdout).unwrap();
    let effects = words(&said["effects"], "effect");
    let expected =
        ["triangles", "quadrics", "emitting surfaces", "sampled lights", "diffuse materials", "smooth dielectrics"];
    assert_eq!(effects, expected);
    assert_eq!(said["effects"][5]["because_of"], serde_json::json!(["ball"]));
    assert_eq!(said["left_out"].as_array().unwrap().len() + expected.len(), rootn::scene::Effects::ALL.len());
    assert_eq!((said["kernel"].as_str(), said["cpu"].as_str()), (Some("short"), Some("general")));
    assert_eq!(said["sampled_by_area"], serde_json::json!(["lamp"]));
    assert_eq!(said["film"], serde_json::json!([9, 7]));
    assert_eq!(said["counts"]["triangles"], 2);
    assert_eq!(
        said["counts"]["lights"],
        serde_json::json!([{"kind": "area", "count": 1}, {"kind": "point", "count": 2}])
    );
    assert!(said["bvh_bytes"].as_u64().unwrap() > 100 && said["bytes"]["triangles"].as_u64().unwrap() > 100);
    assert!(said["warnings"][0].as_str().unwrap().contains("nonsense"));
    let classes = ["L E", "L S+ E", "L D E", "L D S+ E", "L S+ D E", "L D (D|S)* D S* E"];
    assert_eq!(words(&said["paths"], "expression"), classes);
    assert_eq!(said["paths"][4]["found"], "directions");
    // For people: within 100 columns, in ASCII but for a few signs, and nothing that steers a terminal.
    let (text, _) = ends(here, 0, &["explain", "glass.xml"]);
    assert!(text.lines().all(|l| l.chars().count() <= 100 && !l.ends_with(' ')), "{text}");
    for part in
        ["glass (glass.xml)", "9 × 7 pixels", "smooth dielectrics", "caustics", "bytes per triangle", "nonsense"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    // Lights without extent behind glass are found by nothing; seen directly there are none.
    let points = GLASS.replace("<emitter type='area'><rgb name='radiance' value='1'/></emitter>", "");
    std::fs::write(here.join("points.xml"), points).unwrap();
    let (stdout, _) = ends(here, 0, &["explain", "points.xml", "--json"]);
    let said: Value = serde_json::from_str(&stdout).unwrap();
    let found: Vec<(String, String)> =
        words(&said["paths"], "expression").into_iter().zip(words(&said["paths"], "found")).collect();
    let expected = [
        ("L D E", "light-sampling"),
        ("L D S+ E", "light-sampling"),
        ("L S+ D E", "nothing"),
        ("L D (D|S)* D S* E", "light-sampling"),
    ];
    assert_eq!(found, expected.map(|(a, b)| (a.to_owned(), b.to_owned())));
}

#[test]
fn several_scenes_and_errors() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let cornell = cornell();
    let cornell = cornell.to_str().unwrap();
    std::fs::write(here.join("glass.xml"), GLASS).unwrap();
    std::fs::write(here.join("bad.xml"), "<scene version='3.0.0'>\n<shape type='tube'/></scene>").unwrap();
    let (table, _) = ends(here, 0, &["explain", cornell, "glass.xml"]);
    assert!(table.contains("cornell-box") && table.contains("smooth dielectrics"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 100), "{table}");
    // The others are said all the same.
    let (table, stderr) = ends(here, 2, &["explain", "bad.xml", cornell]);
    assert!(table.contains("bad") && table.contains("tube") && table.contains("cornell-box"), "{table}");
    assert!(stderr.contains("bad.xml:2"), "{stderr}");
    let (json, _) = ends(here, 4, &["explain", "none.xml", cornell, "--json"]);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert!(json[0]["error"].as_str().unwrap().contains("none.xml") && json[1]["name"] == "cornell-box");
    let (stdout, stderr) = ends(here, 2, &["explain", "bad.xml"]);
    assert!(stdout.is_empty() && stderr.contains("tube"), "{stderr}");
    let picture = ["--width", "7", "--height", "5", "--picture"];
    ends(here, 0, &[&["explain", cornell][..], &picture, &["a.png"]].concat());
    let pixels = image::open(here.join("a.png")).unwrap().into_rgb8();
    assert_eq!(pixels.dimensions(), (7, 5));
    // The wall on the left is red, that on the right green.
    let (left, right) = (pixels[(0, 3)], pixels[(6, 3)]);
    assert!(left[0] > left[1] && right[1] > right[0], "{left:?} {right:?}");
    let (_, stderr) = ends(here, 2, &[&["explain", cornell][..], &picture, &["a.jpg"]].concat());
    assert!(stderr.contains(".png"), "{stderr}");
    let (_, stderr) = ends(here, 2, &["explain", cornell, cornell, "--picture", "a.png"]);
    assert!(stderr.contains("one scene"), "{stderr}");
}
