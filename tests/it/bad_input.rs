//! Broken scenes and meshes: an error that names the place, never a panic, never long. The first tests count: every one
//! of their inputs must be refused. The last ones only ask that whatever comes is read or refused in order.

use crate::support;
use rootn::Error;
use rootn::scene::format::Options;
use rootn::scene::format::mitsuba::{load, parse_str};
use rootn::scene::format::{obj, ply};
use std::path::Path;
use std::time::{Duration, Instant};

/// A sound scene; the hand-made cases replace `@` in it.
const SCENE: &str = "<scene version='3.0.0'>
<default name='r' value='0.5'/>
<integrator type='path'><integer name='max_depth' value='5'/></integrator>
<sensor type='perspective'><float name='fov' value='40'/><film type='hdrfilm'><integer name='width' value='8'/></film></sensor>
<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='$r'/></bsdf>
<shape type='sphere' id='ball'><point name='center' x='1' y='2' z='3'/><ref id='grey'/></shape>
<emitter type='point'><transform name='to_world'><rotate x='1' angle='9'/><scale value='2'/></transform></emitter>
@
</scene>
";
const OBJ: &str = "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3//1 -1//-1\n";
const ASCII: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

/// [`ASCII`] with binary data.
fn binary(big: bool) -> Vec<u8> {
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let header = &ASCII[..ASCII.find("end_header\n").unwrap() + 11];
    let mut bytes = header.replace("ascii", format).into_bytes();
    let mut put = |v: [u8; 4]| bytes.extend(if big { v.into_iter().rev().collect::<Vec<_>>() } else { v.to_vec() });
    for x in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        put(x.to_le_bytes());
    }
    bytes.push(4);
    let mut put = |v: [u8; 4]| bytes.extend(if big { v.into_iter().rev().collect::<Vec<_>>() } else { v.to_vec() });
    (0..4i32).for_each(|i| put(i.to_le_bytes()));
    bytes
}

/// Runs a reader; panics and long runs fail the test. `None` where the input was accepted.
fn refused<T>(what: &str, read: impl FnOnce() -> rootn::Result<T> + std::panic::UnwindSafe) -> Option<Error> {
    let start = Instant::now();
    let result = std::panic::catch_unwind(read).unwrap_or_else(|_| panic!("panic on {what}"));
    assert!(start.elapsed() < Duration::from_secs(2), "{:?} for {what}", start.elapsed());
    result.err()
}

/// The error must be about the input, in one line, and name the file (and, if asked for, a line of it).
fn check(what: &str, error: Option<Error>, file: &str, with_line: bool) -> String {
    let error = error.unwrap_or_else(|| panic!("accepted: {what}"));
    let Error::Input { place, message } = &error else { panic!("{error} for {what}") };
    assert!(place.file.ends_with(file), "{error} for {what}");
    assert!(!with_line || place.line > 0, "no line: {error} for {what}");
    assert!(!message.is_empty() && !error.to_string().contains('\n') && message.len() < 1500, "{error} for {what}");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

fn xml(text: &str) -> Option<Error> {
    refused(text, || parse_str(text, Path::new("scene.xml"), &Options::default()))
}

/// What is put into the scene, and a part of the message that must come.
const ELEMENTS: [(&str, &str); 88] = [
    ("<", "not well-formed"),
    ("<shape", "not well-formed"),
    ("<shape type='sphere'>", "not well-formed"),
    ("</shape>", "not well-formed"),
    ("<shape type='sphere' type='cube'/>", "not well-formed"),
    ("<shape type=sphere/>", "not well-formed"),
    ("<shape type='&bad;'/>", "not well-formed"),
    ("\u{0}", "not well-formed"),
    ("<!DOCTYPE scene>", "not well-formed"),
    ("</scene><scene version='3.0.0'>", "not well-formed"),
    ("<shape/>", "lacks the attribute `type`"),
    ("<shape type='teapot'/>", "shape `teapot` is not supported; allowed: rectangle"),
    ("<shape type='sphere' size='3'/>", "unknown attribute `size`"),
    ("<shpae type='sphere'/>", "did you mean <shape>?"),
    ("<scene version='3.0.0'/>", "unknown element <scene>"),
    ("<shape type='sphere' id='ball'/>", "is taken already (scene.xml:6:1)"),
    ("<shape type='sphere'><ref id='gray'/></shape>", "did you mean `grey`?"),
    ("<shape type='sphere'><ref/></shape>", "lacks the attribute `id`"),
    ("<shape type='sphere'><ref id='ball'/></shape>", "not supported in a shape"),
    ("<shape type='sphere'><ref id='grey'/><ref id='grey'/></shape>", "two objects of kind bsdf"),
    ("<shape type='sphere'><float name='radius' value='x'/></shape>", "`x` is not a number"),
    ("<shape type='sphere'><float name='radius' value='nan'/></shape>", "not a finite number"),
    ("<shape type='sphere'><float name='radius' value='1e400'/></shape>", "not a finite number"),
    ("<shape type='sphere'><float name='radius' value=''/></shape>", "is not a number"),
    ("<shape type='sphere'><float name='radius' value='0'/></shape>", "above 0"),
    ("<shape type='sphere'><float name='radius' value='1e-60'/></shape>", "not finite or has no extent"),
    ("<shape type='sphere'><float name='radius' value='1e60'/></shape>", "not finite or has no extent"),
    ("<shape type='sphere'><float name='radius'/></shape>", "lacks the attribute `value`"),
    ("<shape type='sphere'><float value='1'/></shape>", "lacks the attribute `name`"),
    ("<shape type='sphere'><float name='radius' value='1'><float/></float></shape>", "cannot stand inside"),
    ("<shape type='sphere'><float name='radius' value='1'/><float name='radius' value='1'/></shape>", "given twice"),
    ("<shape type='sphere'><string name='radius' value='1'/></shape>", "is a string; a float is wanted"),
    ("<shape type='sphere'><float name='center' value='1'/></shape>", "a point or vector is wanted"),
    ("<shape type='sphere'><point name='center' x='1' value='1'/></shape>", "found both `value` and `x`"),
    ("<shape type='sphere'><point name='center' value='1 2'/></shape>", "one or three are wanted"),
    ("<shape type='cube'><boolean name='flip_normals' value='yes'/></shape>", "allowed: true, false"),
    ("<shape type='cube'><integer name='flip_normals' value='1'/></shape>", "a boolean is wanted"),
    ("<shape type='obj'/>", "lacks the property `filename`"),
    ("<shape type='obj'><string name='filename' value='no.obj'/></shape>", "file `no.obj` not found"),
    ("<shape type='ply'><string name='filename' value='..'/></shape>", "file `..` not found"),
    ("<shape type='cube'><transform/></shape>", "lacks the attribute `name`"),
    ("<shape type='cube'><transform name='to_world'><turn/></transform></shape>", "allowed: translate"),
    ("<shape type='cube'><transform name='to_world'><rotate x='1'/></transform></shape>", "attribute `angle`"),
    ("<shape type='cube'><transform name='to_world'><rotate angle='1'/></transform></shape>", "has no length"),
    ("<shape type='cube'><transform name='to_world'><scale value='0'/></transform></shape>", "singular"),
    ("<shape type='cube'><transform name='to_world'><scale value='1e39'/></transform></shape>", "out of the range"),
    (
        "<shape type='cube'><transform name='to_world'><scale value='1e200'/><scale value='1e200'/></transform></shape>",
        "not finite",
    ),
    ("<shape type='cube'><transform name='to_world'><matrix value='1 2 3'/></transform></shape>", "9 or 16"),
    (
        "<shape type='cube'><transform name='to_world'><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 1 0 0 1'/></transform></shape>",
        "last row",
    ),
    (
        "<shape type='cube'><transform name='to_world'><lookat origin='1 1 1' target='1 1 1'/></transform></shape>",
        "coincide",
    ),
    (
        "<shape type='cube'><transform name='to_world'><lookat origin='0 0 0' target='0 1 0' up='0 1 0'/></transform></shape>",
        "viewing direction",
    ),
    (
        "<shape type='cube'><transform name='to_world'><lookat origin='0 0'  target='0 1 0'/></transform></shape>",
        "three are wanted",
    ),
    (
        "<shape type='cube'><transform name='to_world'><scale><scale/></scale></transform></shape>",
        "nothing may stand inside",
    ),
    ("<translate x='1'/>", "must stand inside <transform>"),
    (
        "<shape type='cube'><bsdf type='velvet'/></shape>",
        "bsdf `velvet` is not supported; allowed: blendbsdf, bumpmap, conductor",
    ),
    (
        "<shape type='cube'><bsdf type='conductor'><string name='material' value='ag'/></bsdf></shape>",
        "no conductor is called `ag`; did you mean `Ag`?",
    ),
    (
        "<shape type='cube'><bsdf type='conductor'><string name='material' value='Ag'/><float name='k' value='1'/></bsdf></shape>",
        "found both `material` and `eta` or `k`",
    ),
    (
        "<shape type='cube'><bsdf type='dielectric'><string name='int_ior' value='plasma'/></bsdf></shape>",
        "`int_ior` names no known dielectric (allowed: vacuum, helium",
    ),
    ("<shape type='cube'><bsdf type='dielectric'><float name='ext_ior' value='0'/></bsdf></shape>", "must be above 0"),
    (
        "<shape type='cube'><bsdf type='twosided'><bsdf type='dielectric'/></bsdf></shape>",
        "it cannot stand inside twosided",
    ),
    ("<shape type='cube'><bsdf type='twosided'/></shape>", "one or two BSDFs"),
    (
        "<shape type='cube'><bsdf type='roughconductor'><string name='distribution' value='as'/></bsdf></shape>",
        "distribution is `as`; allowed: beckmann, ggx",
    ),
    (
        "<shape type='cube'><bsdf type='roughplastic'><float name='alpha' value='-0.1'/></bsdf></shape>",
        "alpha [-0.1, -0.1, -0.1]; each channel must be in [0, 100]",
    ),
    (
        "<shape type='cube'><bsdf type='roughconductor'><float name='alpha_u' value='0.1'/></bsdf></shape>",
        "give either `alpha`, or both `alpha_u` and `alpha_v`",
    ),
    (
        "<shape type='cube'><bsdf type='roughdielectric'><float name='int_ior' value='1'/><float name='ext_ior' \
         value='1'/></bsdf></shape>",
        "must differ",
    ),
    (
        "<bsdf type='twosided' id='me'><ref id='me'/></bsdf><shape type='cube'><ref id='me'/></shape>",
        "bsdf `twosided`: stands inside itself",
    ),
    ("<shape type='cube'><bsdf type='diffuse'><rgb name='reflectance' value='1.1'/></bsdf></shape>", "in [0, 1]"),
    ("<shape type='cube'><bsdf type='diffuse'><rgb name='reflectance' value='1 2'/></bsdf></shape>", "one or three"),
    ("<shape type='cube'><bsdf type='diffuse'><rgb name='reflectance' value='#12345'/></bsdf></shape>", "#ff8000"),
    ("<shape type='cube'><bsdf type='diffuse'><rgb name='reflectance' value='#+12345'/></bsdf></shape>", "#ff8000"),
    ("<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance' value='1 2'/></bsdf></shape>", "pairs"),
    ("<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance' value='400:1'/></bsdf></shape>", "two"),
    (
        "<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance' value='500:1,400:1'/></bsdf></shape>",
        "rise",
    ),
    (
        "<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance' value='400:2,700:2'/></bsdf></shape>",
        "[0, 1]",
    ),
    ("<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance'/></bsdf></shape>", "`value` or `filename`"),
    ("<shape type='cube'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'/></bsdf></shape>", "bitmap"),
    ("<shape type='cube'><emitter type='area'><rgb name='radiance' value='-1'/></emitter></shape>", "at least 0"),
    ("<shape type='cube'><emitter type='area'><rgb name='radiance' value='1e39'/></emitter></shape>", "finite"),
    (
        "<shape type='cube'><emitter type='area'><spectrum name='radiance' type='blackbody'/></emitter></shape>",
        "temperature",
    ),
    ("<shape type='cube'><emitter type='spot'/></shape>", "allowed: area"),
    ("<emitter type='sunsky'/>", "allowed: area, constant, directional, envmap, point, spot"),
    ("<emitter type='constant'/><emitter type='constant'/>", "a second environment"),
    ("<emitter type='point'><point name='position' value='1'/><transform name='to_world'/></emitter>", "give one"),
    ("<emitter type='point'><point name='position' x='1e39' y='0' z='0'/></emitter>", "out of the range"),
    ("<integrator type='path'/>", "a second integrator"),
    ("<default name='' value='1'/>", "empty name"),
    ("<string name='a' value='$nothing'/>", "undefined parameter $nothing (defined: $r)"),
    ("<alias id='no' as='yes'/>", "no object above has the id `no`"),
];

/// References nest without elements that do.
#[test]
fn long_chains_of_bsdfs_are_refused() {
    let link = |i: usize| format!("<bsdf type='twosided' id='b{i}'><ref id='b{}'/></bsdf>", i + 1);
    let chain: String = (0..10_000).map(link).collect();
    let element = chain + "<bsdf type='diffuse' id='b10000'/><shape type='cube'><ref id='b0'/></shape>";
    let message = check("chain", xml(&SCENE.replace('@', &element)), "scene.xml", true);
    assert!(message.contains("nested deeper than 50"), "{message}");
}

#[test]
fn broken_scenes_name_the_place() {
    assert!(xml(&SCENE.replace('@', "")).is_none());
    for (element, expected) in ELEMENTS {
        let text = SCENE.replace('@', element);
        let message = check(element, xml(&text), "scene.xml", true);
        assert!(message.contains(expected), "{element}: {message}");
    }
    for (text, expected) in [
        ("", "not well-formed"),
        ("ply\n", "not well-formed"),
        ("<scene/>", "lacks the attribute `version`"),
        ("<scene version='4.0'/>", "allowed: 0.x to 3.x"),
        ("<scene version=''/>", "allowed: 0.x to 3.x"),
        ("<shape version='3.0.0' type='sphere'/>", "<scene> is wanted"),
        ("<scene version='3.0.0'/>", "no <sensor>"),
        ("<scene version='3.0.0'><sensor type='fisheye'/></scene>", "allowed: perspective"),
        (
            "<scene version='3.0.0'><sensor type='perspective'><film type='specfilm'/></sensor></scene>",
            "allowed: hdrfilm",
        ),
        ("<scene version='3.0.0'><path value='nowhere'/></scene>", "folder `nowhere` not found"),
        ("<scene version='3.0.0'><include filename='nowhere.xml'/></scene>", "file `nowhere.xml` not found"),
        ("<scene version='3.0.0'>\n<bsdf type='a'><path value='.'/></bsdf></scene>", "directly inside <scene>"),
    ] {
        let message = check(text, xml(text), "scene.xml", true);
        assert!(message.contains(expected), "{text}: {message}");
    }
}

/// A scene cut anywhere is refused.
#[test]
fn truncated_scenes_are_refused() {
    let text = SCENE.replace('@', "");
    for end in (0..text.trim_end().len()).step_by(5) {
        check(&text[..end], xml(&text[..end]), "scene.xml", true);
    }
}

/// Deep, wide and growing structures are cut off, not followed.
#[test]
fn bombs_are_defused() {
    let deep = format!("{}{}", "<bsdf type='a'>".repeat(100_000), "</bsdf>".repeat(100_000));
    assert!(check("deep", xml(&SCENE.replace('@', &deep)), "scene.xml", true).contains("nested deeper than 50"));
    let deep = format!("{}{}", "<float name='a' value='1'>".repeat(100_000), "</float>".repeat(100_000));
    check("deep values", xml(&SCENE.replace('@', &deep)), "scene.xml", true);
    let mut growing = "<default name='a0' value='0123456789'/>".to_owned();
    for i in 1..60 {
        growing += &format!("<default name='a{i}' value='${{}}'/>").replace("{}", &format!("a{}$a{}", i - 1, i - 1));
    }
    let message = check("growing", xml(&SCENE.replace('@', &growing)), "scene.xml", true);
    assert!(message.contains("longer than"), "{message}");
    let entities = "<!DOCTYPE a [<!ENTITY a 'x'><!ENTITY b '&a;&a;&a;&a;'>]>";
    check("entities", xml(&format!("{entities}{SCENE}")), "scene.xml", true);
}

#[test]
fn broken_includes_name_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let scene = |inside: &str| format!("<scene version='3.0.0'>\n{inside}\n</scene>");
    write("self.xml", &scene("<include filename='self.xml'/>"));
    write("a.xml", &scene("<include filename='b.xml'/>"));
    write("b.xml", &scene("<include filename='./a.xml'/>"));
    write("broken.xml", &scene("<shape type='cube'>"));
    write("outer.xml", &scene("<include filename='broken.xml'/>"));
    write("twice.xml", &scene("<bsdf type='diffuse' id='x'/><include filename='x.xml'/>"));
    write("x.xml", "<bsdf version='3.0.0' type='diffuse' id='x'/>");
    write("latin.xml", "");
    std::fs::write(folder.path().join("latin.xml"), b"<scene version='3.0.0'>\n<!-- caf\xe9 --></scene>").unwrap();
    for i in 0..30 {
        write(&format!("deep{i}.xml"), &scene(&format!("<include filename='deep{}.xml'/>", i + 1)));
        write(&format!("wide{i}.xml"), &scene(&format!("<include filename='wide{}.xml'/>", i + 1).repeat(4)));
    }
    write("deep30.xml", &scene(""));
    for i in 0..10 {
        write(&format!("broad{i}.xml"), &scene(&format!("<include filename='broad{}.xml'/>", i + 1).repeat(4)));
    }
    write("broad10.xml", &scene(""));
    write("bad.spd", "# nm value\n400 0.5\n500 x\n");
    write("spd.xml", &scene("<bsdf type='diffuse'><spectrum name='reflectance' filename='bad.spd'/></bsdf>"));
    write("mesh.obj", "v 0 0 0\nf 1 2 3\n");
    let sensor = "<sensor type='perspective'/>";
    write("mesh.xml", &scene(&format!("{sensor}<shape type='obj'><string name='filename' value='mesh.obj'/></shape>")));
    for (file, at, expected) in [
        ("self.xml", "self.xml", "includes itself"),
        ("a.xml", "b.xml", "includes itself"),
        ("outer.xml", "broken.xml", "not well-formed"),
        ("twice.xml", "x.xml", "is taken already"),
        ("latin.xml", "latin.xml", "not UTF-8"),
        ("deep0.xml", "deep15.xml", "deeper than 15"),
        ("wide0.xml", "wide15.xml", "deeper than 15"),
        ("broad0.xml", "", "more than 1000 includes"),
        ("spd.xml", "bad.spd", "`x` is not a number"),
        ("mesh.xml", "mesh.obj", "vertex 2 does not exist"),
    ] {
        let path = folder.path().join(file);
        let error = refused(file, || load(&path, &Options::default()));
        let at = if at.is_empty() { "broad9.xml" } else { at };
        let message = check(file, error, at, true);
        assert!(message.contains(expected), "{message}");
    }
    let missing = refused("missing", || load(&folder.path().join("missing.xml"), &Options::default())).unwrap();
    assert!(missing.exit_code() == 4 && missing.to_string().contains("missing.xml"), "{missing}");
    assert!(refused("folder", || load(folder.path(), &Options::default())).unwrap().to_string().contains("directory"));
    let other = rootn::scene::format::load(Path::new("scene.gltf"), &Options::default()).unwrap_err().to_string();
    assert!(other.contains("allowed: .xml"), "{other}");
}

fn obj_error(bytes: &[u8]) -> Option<Error> {
    refused(&String::from_utf8_lossy(bytes), || obj::parse(bytes, Path::new("m.obj")))
}

#[test]
fn broken_obj_files_name_the_line() {
    assert!(obj_error(OBJ.as_bytes()).is_none());
    for (statement, expected) in [
        ("v", "needs 3 numbers"),
        ("v 1 2", "needs 3 numbers"),
        ("v 1 2 x", "`x` is not a number"),
        ("v 1 2 nan", "not a finite"),
        ("v 1 inf 2", "not a finite"),
        ("v 1e39 0 0", "not a finite"),
        ("v 1,0 0 0", "is not a number"),
        ("v \u{ff11} 0 0", "is not a number"),
        ("vn 0 0", "needs 3 numbers"),
        ("vn 0 0 -nan", "not a finite"),
        ("vt 0", "needs 2 numbers"),
        ("vt 0 inf", "not a finite"),
        ("f", "without vertices"),
        ("f 1", "at least three"),
        ("f 1 2", "at least three"),
        ("f 1 2 5", "vertex 5 does not exist; 4 are defined"),
        ("f 0 1 2", "vertex 0 does not exist"),
        ("f -5 1 2", "vertex -5 does not exist"),
        ("f 1 2 99999999999999999999", "not a face vertex"),
        ("f 1 2 9223372036854775807", "does not exist"),
        ("f 1 2 -9223372036854775808", "does not exist"),
        ("f 1/2 2/1 3/1", "texture coordinate 2 does not exist"),
        ("f 1//2 2//1 3//1", "normal 2 does not exist"),
        ("f 1//0 2//1 3//1", "normal 0 does not exist"),
        ("f 1//x 2//1 3//1", "not a face vertex"),
        ("f 1/1/1/1 2 3", "too many parts"),
        ("f /1 2 3", "names no vertex"),
        ("f 1.5 2 3", "not a face vertex"),
        ("curv 0 1 1 2", "unknown statement `curv`"),
        ("hello", "unknown statement"),
        ("\u{0}\u{0}", "unknown statement"),
        ("<html>", "unknown statement"),
        (&"y".repeat(100_000), "unknown statement `yyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyy…`"),
    ] {
        let message = check(statement, obj_error(format!("{OBJ}{statement}\n").as_bytes()), "m.obj", true);
        assert!(message.starts_with("m.obj:9: ") && message.contains(expected), "{message}");
    }
    for text in ["", "\n\n", "v 0 0 0\n", "# f 1 2 3", "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3"] {
        let message = check(text, obj_error(text.as_bytes()), "m.obj", false);
        assert!(message.contains("no face"), "{message}");
    }
}

fn ply_error(bytes: &[u8]) -> Option<Error> {
    refused(&String::from_utf8_lossy(&bytes[..bytes.len().min(500)]), || ply::parse(bytes, Path::new("m.ply")))
}

#[test]
fn broken_ply_files_name_the_place() {
    for bytes in [ASCII.as_bytes(), &binary(false), &binary(true)] {
        assert!(ply_error(bytes).is_none());
    }
    for (from, to, expected) in [
        ("ply\n", "", "the first line is not `ply`"),
        ("ply\n", "plyx\n", "the first line is not `ply`"),
        ("ascii", "binary", "allowed: ascii"),
        ("1.0", "2.0", "cannot read"),
        ("format ascii 1.0\n", "", "no `format"),
        ("end_header", "end", "cannot read"),
        ("element face 1", "element face", "cannot read"),
        ("element face 1", "element face x", "`x` is not a count"),
        ("element face 1", "element face -1", "`-1` is not a count"),
        ("element face 1", "element face 4294967295", "data for at most"),
        ("element vertex 4", "element vertex 4000000000", "data for at most"),
        ("element vertex 4", "element vertex 18446744073709551615", "data for at most"),
        ("element vertex 4", "element vertex 18446744073709551616", "not a count"),
        ("element vertex 4", "element vertex 5", "ends too early"),
        ("element vertex 4", "element vertex 3", "face 0 has no vertices"),
        ("element vertex 4", "element vertex 4\nproperty list uchar int n", "ends too early"),
        ("element face 1", "element face 2", "ends too early"),
        ("element face 1", "element face 0", "no faces"),
        ("element face 1", "element vertex 1", "a second element"),
        ("element face 1", "element strip 1", "no faces"),
        ("element vertex 4\n", "", "before the first element"),
        ("property float x\n", "", "lacks a property x, y or z"),
        ("property float x", "property float w", "lacks a property x, y or z"),
        ("property float x", "property list uchar float x", "lacks a property x, y or z"),
        ("property float x", "property real x", "unknown type `real`"),
        ("property float x", "property float", "a property is"),
        ("property float x", "property float x y", "a property is"),
        ("list uchar int", "list float int", "integer type"),
        ("list uchar int", "list uchar float", "integer type"),
        ("vertex_indices", "indices", "lacks a list `vertex_indices`"),
        ("list uchar int vertex_indices", "int vertex_indices", "lacks a list `vertex_indices`"),
        ("4 0 1 2 3", "3 0 1 4", "names vertex 4"),
        ("4 0 1 2 3", "3 0 1 -1", "names vertex -1"),
        ("4 0 1 2 3", "3 0 1 1.5", "names vertex 1.5"),
        ("4 0 1 2 3", "3 0 1 99999999999", "names vertex 99999999999"),
        ("4 0 1 2 3", "2 0 1", "at least three"),
        ("4 0 1 2 3", "0", "no vertices"),
        ("4 0 1 2 3", "-4 0 1 2 3", "a list of length -4"),
        ("4 0 1 2 3", "255 0 1 2 3", "a list of length 255"),
        ("4 0 1 2 3", "nan 0 1 2 3", "a list of length NaN"),
        ("4 0 1 2 3", "4 0 1 2", "ends too early"),
        ("1 1 0", "1 nan 0", "vertex 2 is not finite"),
        ("1 1 0", "1 1e39 0", "vertex 2 is not finite"),
        ("1 1 0", "1 one 0", "`one` is not a number"),
        ("1 1 0", "1 \u{0} 0", "is not a number"),
    ] {
        assert!(ASCII.contains(from));
        let text = ASCII.replacen(from, to, 1);
        let message = check(to, ply_error(text.as_bytes()), "m.ply", true);
        assert!(message.contains(expected), "{from} -> {to}: {message}");
    }
}

/// Meshes cut anywhere are refused; binary ones with the byte offset.
#[test]
fn truncated_meshes_are_refused() {
    for bytes in [binary(false), binary(true)] {
        for end in 0..bytes.len() {
            let message = check(&end.to_string(), ply_error(&bytes[..end]), "m.ply", false);
            assert!(
                message.contains("m.ply:") && (message.contains("byte ") || message.starts_with("m.ply:1"))
                    || end < 200
            );
        }
        let mut nan = bytes.clone();
        let at = bytes.len() - 17 - 12;
        nan[at..at + 4].fill(0xff);
        let message = check("nan", ply_error(&nan), "m.ply", false);
        assert!(message.contains("byte ") && message.contains("vertex 3 is not finite"), "{message}");
    }
    for end in 0..ASCII.trim_end().len() {
        check(&end.to_string(), ply_error(&ASCII.as_bytes()[..end]), "m.ply", true);
    }
    for end in 0..OBJ.find("3//1").unwrap() {
        check(&end.to_string(), obj_error(&OBJ.as_bytes()[..end]), "m.obj", false);
    }
}

/// Whatever comes is read or refused in order; most of it is refused.
#[test]
fn mutated_input_is_survived() {
    let seed = support::seed("mutated_input_is_survived");
    let mut refusals = [0; 5];
    let scene = SCENE.replace('@', "<shape type='disk'><bsdf type='twosided'><ref id='grey'/></bsdf></shape>");
    for bytes in support::mutations(scene.as_bytes(), seed).take(4000) {
        let text = String::from_utf8_lossy(&bytes);
        if let Some(error) = xml(&text) {
            check(&text, Some(error), "scene.xml", true);
            refusals[0] += 1;
        }
    }
    for (i, original) in [ASCII.as_bytes().to_owned(), binary(false), binary(true), OBJ.into()].iter().enumerate() {
        for bytes in support::mutations(original, seed).take(4000) {
            let (error, file) = if i < 3 { (ply_error(&bytes), "m.ply") } else { (obj_error(&bytes), "m.obj") };
            if let Some(error) = error {
                check(&String::from_utf8_lossy(&bytes), Some(error), file, false);
                refusals[i + 1] += 1;
            }
        }
    }
    println!("refused of 4000 each: {refusals:?}");
    assert!(refusals.iter().all(|&r| r > 1000 && r < 4000), "{refusals:?}");
}
