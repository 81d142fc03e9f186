//! Serialized meshes, groups of shapes and their instances. Sides and frames are those of Mitsuba 3.9.1.

use crate::support::{mutations, seed, shared};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rootn::accel::brute::Brute;
use rootn::accel::{Intersect, Ray};
use rootn::math::{Vec2, Vec3};
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::format::{Options, load, serialized};
use rootn::scene::{Geometry, Scene};
use std::io::Write;
use std::path::Path;

const NORMALS: u32 = 1;
const UVS: u32 = 2;
const COLORS: u32 = 8;
const DOUBLE: u32 = 0x2000;

const POSITIONS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 1.0, 0.0];

fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// What is compressed: a mesh of four vertices that are `shift` away from where the first ones are, and two triangles.
fn content(version: u16, flags: u32, shift: f32, counts: [u64; 2]) -> Vec<u8> {
    let mut bytes = flags.to_le_bytes().to_vec();
    if version == 4 {
        bytes.extend(b"a mesh\0");
    }
    bytes.extend(counts.iter().flat_map(|c| c.to_le_bytes()));
    let mut put = |v: f32| match flags & DOUBLE {
        0 => bytes.extend(v.to_le_bytes()),
        _ => bytes.extend(f64::from(v).to_le_bytes()),
    };
    POSITIONS.iter().for_each(|p| put(p + shift));
    for (flag, values) in [(NORMALS, [0.0, 0.0, -2.0].repeat(4)), (UVS, vec![0.25; 8]), (COLORS, vec![0.5; 12])] {
        values.iter().filter(|_| flags & flag != 0).for_each(|v| put(*v));
    }
    bytes.extend([0u32, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

/// A file of these meshes.
fn file(version: u16, contents: &[Vec<u8>]) -> Vec<u8> {
    let (mut bytes, mut starts) = (Vec::new(), Vec::new());
    for content in contents {
        starts.push(bytes.len() as u64);
        bytes.extend([0x1c, 0x04, version as u8, 0]);
        bytes.extend(compressed(content));
    }
    for start in &starts {
        bytes.extend(&start.to_le_bytes()[..if version == 4 { 8 } else { 4 }]);
    }
    bytes.extend((contents.len() as u32).to_le_bytes());
    bytes
}

#[test]
fn every_version_and_content_is_read() {
    let expected: Vec<Vec3> = POSITIONS.chunks(3).map(Vec3::from_slice).collect();
    for version in [3, 4] {
        for flags in [0, NORMALS, UVS, COLORS, NORMALS | UVS | COLORS].into_iter().flat_map(|f| [f, f | DOUBLE]) {
            let bytes = file(version, &[0.0, 2.0, 5.0].map(|shift| content(version, flags, shift, [4, 2])));
            for (index, shift) in [(0, 0.0), (1, 2.0), (2, 5.0)] {
                let mesh = serialized::parse(&bytes, index, Path::new("m.serialized")).unwrap();
                assert!(mesh.positions.iter().zip(&expected).all(|(p, e)| *p == e + shift), "{version} {flags:#x}");
                assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
                assert_eq!(mesh.normals, vec![Vec3::Z * -2.0; if flags & NORMALS == 0 { 0 } else { 4 }]);
                assert_eq!(mesh.uvs, vec![Vec2::splat(0.25); if flags & UVS == 0 { 0 } else { 4 }]);
            }
        }
    }
}

#[test]
fn broken_serialized_files_are_refused() {
    let good = |counts| content(4, 0, 0.0, counts);
    let one = |content: Vec<u8>| file(4, &[content]);
    let nan = {
        let mut bytes = good([4, 2]);
        bytes[4 + 7 + 16..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        bytes
    };
    let index = {
        let mut bytes = good([4, 2]);
        let end = bytes.len();
        bytes[end - 4..].copy_from_slice(&4u32.to_le_bytes());
        bytes
    };
    let list = |count: u32| {
        let mut bytes = one(good([4, 2]));
        let end = bytes.len();
        bytes[end - 4..].copy_from_slice(&count.to_le_bytes());
        bytes
    };
    let far = {
        let mut bytes = file(4, &[good([4, 2]), good([4, 2])]);
        let end = bytes.len();
        bytes[end - 12..end - 4].copy_from_slice(&u64::MAX.to_le_bytes());
        bytes
    };
    let whole = one(good([4, 2]));
    let replaced = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    for (bytes, number, message) in [
        (Vec::new(), 0, "too short"),
        (replaced(0, 0), 0, "starts with 0x0400"),
        (replaced(2, 5), 0, "version 5"),
        (replaced(4, 0), 0, "damaged or incomplete"),
        (whole[..40].to_vec(), 0, "damaged or incomplete"),
        (whole.clone(), 1, "shape_index is 1; the file has 1 meshes"),
        (list(1 << 30), 1, "longer than the file"),
        (far, 1, "starts at byte 18446744073709551615"),
        (one(good([1 << 40, 2])), 0, "1099511627776 vertices; at most"),
        (one(good([4, u64::MAX])), 0, "triangles; at most"),
        (one(good([1 << 30, 1 << 30])), 0, "more than the file can hold"),
        (one(good([5, 2])), 0, "damaged or incomplete"),
        (one(good([4, 0])), 0, "no triangles"),
        (one(nan), 0, "not finite"),
        (one(index), 0, "names vertex 4; the mesh has 4"),
    ] {
        let error = serialized::parse(&bytes, number, Path::new("m.serialized")).unwrap_err().to_string();
        assert!(error.starts_with("m.serialized") && error.contains(message), "{error}");
    }
    // Any bytes are a mesh or an error.
    let two = file(3, &[content(3, NORMALS | UVS, 0.0, [4, 2]), content(3, DOUBLE, 1.0, [4, 2])]);
    for bytes in mutations(&two, seed("broken serialized files")).take(3000) {
        for index in 0..2 {
            drop(serialized::parse(&bytes, index, Path::new("m.serialized")));
        }
    }
}

fn read(folder: &Path, shapes: &str) -> rootn::Result<Scene> {
    let text = format!("<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{shapes}</scene>");
    parse_str(&text, &folder.join("scene.xml"), &Options::default())
}

#[test]
fn serialized_shapes_are_those_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = file(4, &[content(4, 0, 0.0, [4, 2]), content(4, UVS, 3.0, [4, 2])]);
    std::fs::write(folder.path().join("m.serialized"), bytes).unwrap();
    let shape =
        |more: &str| format!("<shape type='serialized'><string name='filename' value='m.serialized'/>{more}</shape>");
    let faces = "<integer name='shape_index' value='1'/><boolean name='face_normals' value='true'/>";
    let scene = read(folder.path(), &(shape("") + &shape(faces))).unwrap();
    let Geometry::Mesh { smooth: true, uvs: false, .. } = scene.shapes[0].geometry else { panic!() };
    let Geometry::Mesh { smooth: false, uvs: true, .. } = scene.shapes[1].geometry else { panic!() };
    assert_eq!((scene.positions[0], scene.positions[4]), (Vec3::ZERO, Vec3::splat(3.0)));
    for (index, message) in [(-1, "shape_index must be at least 0"), (2, "shape_index is 2; the file has 2 meshes")] {
        let more = format!("<integer name='shape_index' value='{index}'/>");
        let error = read(folder.path(), &shape(&more)).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    let Some(scenes) = shared("scenes/mitsuba-matpreview") else { return };
    let scene = load(&scenes.join("matpreview.xml"), &Options::default()).unwrap();
    println!("matpreview: {} shapes, {} triangles", scene.shapes.len(), scene.triangles.len());
    assert!(scene.triangles.len() > 10_000);
}

const MIRROR: &str = "<transform name='to_world'><scale x='-1'/></transform>";

/// An instance is where the product of both transforms says, with the front where the shape has it: also in a mirror, where
/// shapes may turn inside out that are not in a group.
#[test]
fn instances_are_placed_copies() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("t.obj"), "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nf 1 2 3\n").unwrap();
    let smooth = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";
    std::fs::write(folder.path().join("tn.obj"), smooth).unwrap();
    let mesh = |name: &str, more: &str| {
        format!("<shape type='obj'><string name='filename' value='{name}.obj'/>{more}%</shape>")
    };
    let faces = "<boolean name='face_normals' value='true'/>";
    let simple = |plugin: &str| format!("<shape type='{plugin}'>%</shape>");
    // Front in a mirrored instance, plain and mirrored itself (Mitsuba).
    let cases = [
        (mesh("t", ""), 1.0, -1.0),
        (mesh("t", faces), 1.0, -1.0),
        (mesh("tn", ""), 1.0, 1.0),
        (simple("rectangle"), 1.0, 1.0),
        (simple("disk"), 1.0, 1.0),
        (simple("cube"), 1.0, 1.0),
        (simple("sphere"), 1.0, -1.0),
    ];
    for (shape, plain, mirrored) in cases {
        for (own, expected) in [("", plain), (MIRROR, mirrored)] {
            let group = format!("<shape type='shapegroup' id='g'>{}</shape>", shape.replace('%', own));
            let scene = read(folder.path(), &format!("{group}<shape type='instance'><ref id='g'/>{MIRROR}</shape>"));
            let scene = scene.unwrap();
            let brute = Brute::new(&scene).unwrap();
            // Downwards, next to the diagonal.
            let x = if own.is_empty() { -0.5 } else { 0.5 };
            let ray = Ray::new(Vec3::new(x, -0.6, 5.0), Vec3::NEG_Z, f32::INFINITY);
            let hit = brute.closest(&ray).unwrap();
            let ns = scene.surface_point(&ray, &hit).ns;
            assert_eq!(ns.z.signum(), expected, "{shape} {own}");
        }
    }
}

#[test]
fn instances_share_what_is_in_their_group() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let group = "<shape type='shapegroup' id='g'>
        <shape type='obj' id='leaf'><string name='filename' value='t.obj'/>
        <transform name='to_world'><scale value='2'/></transform><bsdf type='conductor'/></shape>
        <shape type='sphere'><point name='center' x='1'/></shape></shape>";
    let at = |id: &str, x: f32| {
        format!(
            "<shape type='instance' id='{id}'><ref id='g'/><transform name='to_world'><translate x='{x}'/></transform></shape>"
        )
    };
    let scene = read(folder.path(), &format!("{group}{}{}", at("a", 10.0), at("b", 20.0))).unwrap();
    assert_eq!(scene.shapes.iter().filter(|s| s.name.starts_with("leaf in ")).count(), 2);
    assert_eq!((scene.shapes.len(), scene.triangles.len(), scene.materials.len()), (4, 2, 3));
    assert_eq!(scene.positions[3..], [[20.0, 0.0, 0.0], [22.0, 0.0, 0.0], [20.0, 2.0, 0.0]].map(Vec3::from));
    let Geometry::Sphere { center, .. } = scene.shapes[3].geometry else { panic!() };
    assert_eq!(center, Vec3::X * 21.0);
    assert_eq!(scene.shapes[0].front, scene.shapes[2].front);
    // Nothing of a group is seen by itself.
    assert_eq!(read(folder.path(), group).unwrap().shapes.len(), 0);
    let lit = "<shape type='sphere'><emitter type='area'/></shape>";
    for (shapes, message) in [
        (format!("<shape type='shapegroup' id='g'>{lit}</shape>{}", at("a", 0.0)), "inside a shapegroup cannot emit"),
        ("<shape type='shapegroup'><bsdf type='diffuse'/></shape>".into(), "has no place in a shapegroup"),
        (format!("{group}<shape type='shapegroup'>{}</shape>", at("a", 0.0)), "has no place in a shapegroup"),
        ("<shape type='instance'/>".into(), "needs one shape `shapegroup`"),
        ("<shape type='instance'><shape type='sphere'/></shape>".into(), "needs one shape `shapegroup`"),
        (format!("{group}<shape type='instance'><ref id='g'/><ref id='g'/></shape>"), "needs one shape `shapegroup`"),
        (
            format!(
                "{group}<shape type='instance'><ref id='g'/><transform name='to_world'><scale x='0'/></transform></shape>"
            ),
            "singular",
        ),
        (
            format!(
                "{group}<shape type='instance'><ref id='g'/><transform name='to_world'><scale x='2'/></transform></shape>"
            ),
            "ellipsoid",
        ),
    ] {
        let error = read(folder.path(), &shapes).unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("scene.xml:"), "{error}");
    }
}
