//! Textures, texture coordinates and mesh attributes in scene files. Figures marked so come from Mitsuba 3.9.1 (scalar_rgb).

use image::{Rgb as Pixel, RgbImage};
use rootn::math::{Rgb, Vec2};
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::format::{Options, load, obj, ply};
use rootn::scene::texture::{Bitmap, TextureFilter, UvTransform, Wrap};
use rootn::scene::{Geometry, Scene, Texture};
use std::path::Path;

/// A folder with a picture of 3 × 2 pixels, `a.png`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    RgbImage::from_fn(3, 2, |x, y| Pixel([255 * (x as u8 % 2), 255 * y as u8, 0]))
        .save(folder.path().join("a.png"))
        .unwrap();
    folder
}

fn read(folder: &Path, content: &str) -> rootn::Result<Scene> {
    let text =
        format!("<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{content}</scene>");
    parse_str(&text, &folder.join("scene.xml"), &Options::default())
}

/// A sphere whose reflectance is this texture.
fn textured(texture: &str) -> String {
    format!("<shape type='sphere'><bsdf type='diffuse'>{texture}</bsdf></shape>")
}

fn bitmap(properties: &str) -> String {
    textured(&format!(
        "<texture type='bitmap' name='reflectance'><string name='filename' value='a.png'/>{properties}</texture>"
    ))
}

#[test]
fn bitmaps_are_read_and_shared() {
    let folder = folder();
    let turned = "<string name='filter_type' value='nearest'/><string name='wrap_mode' value='mirror'/>
        <transform name='to_uv'><rotate z='1' angle='90'/><scale x='2' y='3'/><translate x='0.1' y='0.2'/></transform>";
    let content = [bitmap(""), bitmap(turned), bitmap("<boolean name='raw' value='true'/>")].concat();
    let scene = read(folder.path(), &content).unwrap();
    let size = [3, 2];
    let plain =
        Bitmap { first: 0, size, filter: TextureFilter::Bilinear, wrap: Wrap::Repeat, to_uv: UvTransform::IDENTITY };
    let [Texture::Bitmap(a), Texture::Bitmap(b), Texture::Bitmap(c)] = scene.textures[..] else { panic!() };
    assert_eq!(a, plain);
    assert_eq!((b.first, b.filter, b.wrap), (0, TextureFilter::Nearest, Wrap::Mirror));
    // Expected: Mitsuba.
    let found = [b.to_uv.u, b.to_uv.v, b.to_uv.origin].map(Vec2::from);
    let expected = [[0.0, 3.0], [-2.0, 0.0], [0.1, 0.2]].map(Vec2::from);
    assert!(found.iter().zip(expected).all(|(f, e)| f.distance(e) < 1e-6), "{found:?}");
    // Raw values are other texels.
    assert_eq!((c.first, scene.texels.len()), (6, 12));
    assert_eq!(scene.texels[..6], [Rgb::ZERO, Rgb::X, Rgb::ZERO, Rgb::Y, Rgb::ONE - Rgb::Z, Rgb::Y]);
    assert!(scene.sources.iter().any(|s| s.ends_with("a.png")));
    scene.validate().unwrap();
}

#[test]
fn bitmaps_of_old_files() {
    let folder = folder();
    let numbers = "<float name='uscale' value='3'/><float name='vscale' value='5'/><float name='uoffset' value='0.25'/>
        <float name='voffset' value='0.5'/><string name='filter_type' value='trilinear'/><float name='gamma' value='2.2'/>";
    let scene = read(folder.path(), &bitmap(numbers)).unwrap();
    let Texture::Bitmap(Bitmap { to_uv, filter, .. }) = scene.textures[0] else { panic!() };
    // Expected: Mitsuba.
    assert_eq!(to_uv, UvTransform { u: [3.0, 0.0], v: [0.0, 5.0], origin: [0.75, 2.5] });
    assert_eq!(filter, TextureFilter::Bilinear);
    let warned = |part: &str| scene.warnings.iter().any(|w| w.contains(part));
    assert!(warned("taken as bilinear") && warned("`gamma` of texture `bitmap` has no effect"), "{:?}", scene.warnings);
    // A gamma of 1 is `raw`.
    let linear = read(folder.path(), &bitmap("<float name='gamma' value='1'/>")).unwrap();
    let raw = read(folder.path(), &bitmap("<boolean name='raw' value='true'/>")).unwrap();
    assert_eq!((linear.texels, linear.warnings), (raw.texels, raw.warnings));
}

#[test]
fn checkerboards_are_read() {
    let folder = folder();
    let content = [
        textured("<texture type='checkerboard' name='reflectance'/>"),
        textured(
            "<texture type='checkerboard' name='reflectance'><rgb name='color0' value='0.1 0.2 0.3'/>
             <float name='color1' value='0.9'/><transform name='to_uv'><scale value='4'/></transform></texture>",
        ),
    ];
    let scene = read(folder.path(), &content.concat()).unwrap();
    let four = UvTransform { u: [4.0, 0.0], v: [0.0, 4.0], origin: [0.0, 0.0] };
    let boards = [(0, UvTransform::IDENTITY), (2, four)].map(|(first, to_uv)| Texture::Checkerboard { first, to_uv });
    assert_eq!(scene.textures, boards);
    assert_eq!(scene.texels, [Rgb::splat(0.4), Rgb::splat(0.2), Rgb::new(0.1, 0.2, 0.3), Rgb::splat(0.9)]);
}

/// A texture that several materials refer to is one.
#[test]
fn textures_by_reference() {
    let folder = folder();
    let content = "<texture type='checkerboard' id='board'/><bsdf type='diffuse' id='a'><ref id='board' name='reflectance'/></bsdf>
        <bsdf type='diffuse' id='b'><ref id='board' name='reflectance'/></bsdf>
        <shape type='cube'><ref id='a'/></shape><shape type='cube'><ref id='b'/></shape>";
    assert_eq!(read(folder.path(), content).unwrap().textures.len(), 1);
}

#[test]
fn broken_textures_are_refused() {
    let folder = folder();
    std::fs::write(folder.path().join("bad.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    std::fs::write(folder.path().join("high.pfm"), [b"Pf 1 1 -1\n".as_slice(), &2f32.to_le_bytes()].concat()).unwrap();
    std::fs::write(folder.path().join("nan.pfm"), [b"Pf 1 1 -1\n".as_slice(), &f32::NAN.to_le_bytes()].concat())
        .unwrap();
    let file = |name: &str| {
        textured(&format!(
            "<texture type='bitmap' name='reflectance'><string name='filename' value='{name}'/></texture>"
        ))
    };
    let checkerboard =
        |inside: &str| textured(&format!("<texture type='checkerboard' name='reflectance'>{inside}</texture>"));
    for (content, part) in [
        (
            textured("<texture type='vertexcolors' name='reflectance'/>"),
            "texture `vertexcolors` is not supported; allowed: bitmap",
        ),
        (textured("<texture type='bitmap' name='reflectance'/>"), "lacks the property `filename`"),
        (textured("<texture type='bitmap' name='reflectence'/>"), "has no place in bsdf `diffuse`"),
        (file("b.png"), "file `b.png` not found"),
        (file("bad.png"), "bad.png: damaged PNG picture"),
        (file("high.pfm"), "reflectance must be in [0, 1] in each channel"),
        (file("nan.pfm"), "pixel (0, 0) of"),
        (bitmap("<string name='filter_type' value='cubic'/>"), "filter_type is `cubic`; allowed: nearest, bilinear"),
        (bitmap("<string name='wrap_mode' value='zero'/>"), "wrap_mode is `zero`; allowed: repeat, mirror, clamp"),
        (bitmap("<float name='raw' value='1'/>"), "a boolean is wanted"),
        (bitmap("<transform name='to_uv'><scale value='1e39'/></transform>"), "out of the range of 32-bit numbers"),
        (bitmap("<texture type='bitmap' name='x'/>"), "has no place in texture `bitmap`"),
        (checkerboard("<float name='color0' value='1.5'/>"), "reflectance must be in [0, 1]"),
        (checkerboard("<texture type='bitmap' name='color0'/>"), "not supported; allowed: a colour"),
        (textured("<texture type='mesh_attribute' name='reflectance'/>"), "lacks the property `name`"),
        (
            textured("<texture type='mesh_attribute' name='reflectance'><string name='name' value='color'/></texture>"),
            "starts neither with vertex_",
        ),
        (
            textured(
                "<texture type='mesh_attribute' name='reflectance'><string name='name' value='face_x'/></texture>",
            ),
            "has no mesh attribute `face_x` for its material (it has: none)",
        ),
    ] {
        let error = read(folder.path(), &content).expect_err(&content).to_string();
        assert!(error.contains(part) && !error.contains('\n'), "{error}\n{content}");
    }
}

#[test]
fn texture_coordinates_of_meshes() {
    let folder = folder();
    let square = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.125\nvt 1 0\nf 1/1 2/2 3\n";
    let mesh = obj::parse(square, Path::new("a.obj")).unwrap();
    assert_eq!(mesh.uvs, [Vec2::new(0.25, 0.125), Vec2::X, Vec2::ZERO]);
    assert!(obj::parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Path::new("a.obj")).unwrap().uvs.is_empty());
    for (bad, part) in
        [("f 1/3 2 3", "texture coordinate 3 does not exist; 2 are defined"), ("vt 1", "needs 2 numbers")]
    {
        let text = [square.as_slice(), bad.as_bytes()].concat();
        let error = obj::parse(&text, Path::new("a.obj")).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.obj:7"), "{error}");
    }
    std::fs::write(folder.path().join("a.obj"), square).unwrap();
    for names in [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float {}\nproperty float z\n\
             property float {}\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0.25 0 0.125\n\
             1 0 1 0 0\n0 1 0 0 0\n3 0 1 2\n",
            names[0], names[1]
        );
        assert_eq!(ply::parse(text.as_bytes(), Path::new("a.ply")).unwrap().uvs, mesh.uvs);
        std::fs::write(folder.path().join("a.ply"), text).unwrap();
    }
    // OBJ files are turned over unless they say otherwise, others only if they do. Expected: Mitsuba.
    for (plugin, flip, v) in [
        ("obj", "", 0.875),
        ("obj", "false", 0.125),
        ("obj", "true", 0.875),
        ("ply", "", 0.125),
        ("ply", "true", 0.875),
    ] {
        let flip =
            if flip.is_empty() { String::new() } else { format!("<boolean name='flip_tex_coords' value='{flip}'/>") };
        let content = format!("<shape type='{plugin}'><string name='filename' value='a.{plugin}'/>{flip}</shape>");
        let scene = read(folder.path(), &format!("<shape type='sphere'/>{content}")).unwrap();
        assert!(matches!(scene.shapes[1].geometry, Geometry::Mesh { uvs: true, .. }));
        assert_eq!(scene.uvs[0], Vec2::new(0.25, v), "{content}");
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
}

/// Names as Mitsuba has them; integers are fractions of the largest, which Mitsuba leaves to the file.
#[test]
fn colours_of_meshes() {
    let folder = folder();
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float heat_x\nproperty float b_0\nproperty float b_1\nproperty float b_2\nelement face 1\n\
        property list uchar int vertex_indices\nproperty float a_r\nproperty float a_g\nproperty float a_b\nend_header\n\
        0 0 0 255 0 51 0.5 7 8 9\n1 0 0 0 255 0 0.25 0 0 0\n1 1 0 0 0 255 1 0 0 0\n0 1 0 0 0 0 0 0 0 0\n4 0 1 2 3 0.1 0.2 0.3\n";
    let mesh = ply::parse(text.as_bytes(), Path::new("a.ply")).unwrap();
    let names: Vec<&str> = mesh.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["vertex_color", "vertex_heat", "vertex_b", "face_a_color"]);
    assert_eq!(mesh.attributes[0].values[0], Rgb::new(1.0, 0.0, 0.2));
    assert_eq!(mesh.attributes[2].values[0], Rgb::new(7.0, 8.0, 9.0));
    let error = ply::parse(text.replace(" 7 8 9", " 7 nan 9").as_bytes(), Path::new("a.ply")).unwrap_err().to_string();
    assert!(error.contains("a.ply:20: a colour of vertex_b is not finite"), "{error}");
    assert_eq!(mesh.attributes[3].values, [Rgb::new(0.1, 0.2, 0.3); 2]);
    std::fs::write(folder.path().join("a.ply"), text).unwrap();
    let shape = |name: &str, scale: &str| {
        format!(
            "<shape type='ply'><string name='filename' value='a.ply'/><bsdf type='diffuse'><texture type='mesh_attribute'
             name='reflectance'><string name='name' value='{name}'/><float name='scale' value='{scale}'/></texture></bsdf></shape>"
        )
    };
    // A cube and a rectangle come first: 28 vertices, 14 triangles.
    let content =
        ["<shape type='cube'/><shape type='rectangle'/>", &shape("face_a_color", "2"), &shape("vertex_heat", "1")];
    let scene = read(folder.path(), &content.concat()).unwrap();
    let (vertices, triangles) = (28 + 4 + 4, 14 + 2 + 2);
    assert_eq!((scene.positions.len(), scene.triangles.len()), (vertices, triangles));
    let expected = [
        Texture::FaceAttribute { first: 0, scale: 2.0 },
        Texture::VertexAttribute { first: triangles as u32, scale: 1.0 },
    ];
    assert_eq!(scene.textures, expected);
    assert_eq!(scene.attributes.len(), triangles + vertices);
    assert_eq!(scene.attributes[14..18], [Rgb::new(0.1, 0.2, 0.3); 4]);
    assert_eq!(scene.attributes[triangles + 28..][..4], [0.5, 0.25, 1.0, 0.0].map(Rgb::splat));
    for (content, part) in [
        (
            shape("vertex_cold", "1"),
            "has no mesh attribute `vertex_cold` for its material (it has: vertex_color, vertex_heat, vertex_b, face_a_color)",
        ),
        (shape("vertex_heat", "3"), "reflectance must be in [0, 1]"),
    ] {
        let error = read(folder.path(), &content).expect_err(&content).to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// What a scene file names must be in its folder or below, unless the caller allows more.
#[test]
fn files_outside_the_folder_need_leave() {
    let folder = folder();
    let inside = folder.path().join("scene");
    std::fs::create_dir(&inside).unwrap();
    let scene = |name: &str| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{}</scene>",
            bitmap("").replace("a.png", name)
        );
        let path = inside.join("scene.xml");
        std::fs::write(&path, text).unwrap();
        path
    };
    let refused = |path: &Path| {
        let error = load(path, &Options::default()).unwrap_err().to_string();
        assert!(error.contains("is outside the scene file's folder; --allow-outside allows it"), "{error}");
        assert!(load(path, &Options { allow_outside: true, ..Options::default() }).is_ok());
    };
    refused(&scene("../a.png"));
    refused(&scene(folder.path().join("a.png").to_str().unwrap()));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../a.png", inside.join("link.png")).unwrap();
        refused(&scene("link.png"));
    }
    std::fs::create_dir(inside.join("textures")).unwrap();
    std::fs::copy(folder.path().join("a.png"), inside.join("textures/b.png")).unwrap();
    assert!(load(&scene("textures/b.png"), &Options::default()).is_ok());
    assert!(load(&scene("textures/../../scene/textures/b.png"), &Options::default()).is_ok());
}
