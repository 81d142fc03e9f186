//! The scene reader: what it accepts and what it makes of it. Figures marked so come from Mitsuba 3.9.1 (scalar_rgb).

use crate::support;
use rootn::math::{Rgb, Vec2, Vec3};
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::format::spectrum::{Role, Spectrum};
use rootn::scene::format::{Options, load, obj, ply};
use rootn::scene::material::Distribution;
use rootn::scene::{Bsdf, Depth, Filter, Geometry, Light, Material, Scene};
use std::path::{Path, PathBuf};

const SENSOR: &str = "<sensor type='perspective'/>";
const LIGHT: &str = "<emitter type='constant'/>";

/// A scene of this content, a sensor and a sky; no files.
fn scene(content: &str) -> Scene {
    read(&format!("{SENSOR}{LIGHT}{content}")).unwrap()
}

/// A scene of this content alone.
fn read(content: &str) -> rootn::Result<Scene> {
    parse_str(&format!("<scene version='3.0.0'>{content}</scene>"), Path::new("scene.xml"), &Options::default())
}

/// Files may be anywhere.
fn outside() -> Options {
    Options { allow_outside: true, ..Options::default() }
}

/// The error's text.
fn refusal(content: &str) -> String {
    read(content).expect_err(content).to_string()
}

fn close(a: Vec3, b: Vec3, tolerance: f32) -> bool {
    (a - b).abs().max_element() <= tolerance
}

/// All files below a folder that end in `.xml`, sorted.
fn xml_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "xml") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn counts(scene: &Scene) -> [usize; 4] {
    [scene.shapes.len(), scene.triangles.len(), scene.materials.len(), scene.lights.len()]
}

/// Every scene of the collection loads, or is refused in one line that names a place in a file.
#[test]
fn shared_scenes_load_or_say_why() {
    let Some(folder) = support::shared("scenes") else { return };
    let mut loaded = 0;
    for file in xml_files(&folder) {
        let name = file.strip_prefix(&folder).unwrap().display().to_string();
        match load(&file, &outside()) {
            Ok(scene) => {
                loaded += 1;
                println!("{name}: {:?}, {} warnings", counts(&scene), scene.warnings.len());
            }
            Err(error) => {
                let message = error.to_string();
                println!("{name}: {}", message.replace(&folder.display().to_string(), "…"));
                assert!(!message.contains('\n') && message.contains(".xml:"), "{message}");
            }
        }
    }
    assert!(loaded >= 90, "{loaded}");
}

/// The scenes that the references are made of: shapes, triangles, materials with the black one, lights.
#[test]
fn reference_scenes_have_the_expected_counts() {
    let Some(folder) = support::shared("scenes") else { return };
    let expected = [
        ("own/baffle.xml", [4, 16, 3, 1]),
        ("own/dragon.xml", [3, 47_798, 3, 2]),
        ("own/lights.xml", [8, 18, 4, 4]),
        ("own/overcast.xml", [5, 2, 5, 2]),
        ("bitterli-cornell-box/mitsuba/scene_v3.xml", [8, 36, 9, 1]),
        ("mitsuba-cbox/cbox-rgb.xml", [8, 38, 6, 1]),
        ("mitsuba-cbox/cbox-spectral.xml", [8, 38, 6, 1]),
    ];
    for (file, expected) in expected {
        let scene = load(&folder.join(file), &outside()).unwrap();
        assert_eq!(counts(&scene), expected, "{file}");
        assert_eq!(scene.warnings, Vec::<String>::new(), "{file}");
    }
    let box_ = load(&folder.join("mitsuba-cbox/cbox-spectral.xml"), &Options::default()).unwrap();
    assert_eq!(box_.sources.len(), 4 + 8);
    assert_eq!((box_.camera.near, box_.camera.far), (10.0, 2800.0));
}

/// Colours of a scene given as spectra. Expected: Mitsuba.
#[test]
fn spectra_agree_with_mitsuba() {
    let Some(folder) = support::shared("scenes") else { return };
    let scene = load(&folder.join("mitsuba-cbox/cbox-spectral.xml"), &Options::default()).unwrap();
    let by_name = |part: &str| {
        let index = (0..scene.shapes.len()).find(|&i| scene.shapes[i].name.contains(part)).unwrap();
        scene.materials[scene.shapes[index].front as usize]
    };
    let expected = [
        ("xml:3:", [0.7763668, 0.77981, 0.7760291]),
        ("xml:11:", [0.735013, 0.7356246, 0.73626435]),
        ("xml:23:", [0.06828254, 0.39776018, 0.08629087]),
        ("xml:27:", [0.49132004, 0.049228106, 0.0509219]),
    ];
    for (shape, rgb) in expected {
        let Some(Bsdf::Diffuse { reflectance }) = by_name(shape).plain() else { panic!("{shape}") };
        assert!(close(reflectance, Rgb::from_array(rgb), 1e-6), "{shape} {reflectance}");
    }
    let Light::Area { radiance, .. } = scene.lights[0] else { panic!() };
    assert!(close(radiance, Rgb::new(20.710836, 10.854634, 2.771152), 3e-6), "{radiance}");
}

/// Values in every notation. Expected: Mitsuba, but for the notations of 0.x and the black body.
#[test]
fn colours_in_every_notation() {
    let reflectance = |value: &str| {
        let scene = scene(&format!("<shape type='sphere'><bsdf type='diffuse'>{value}</bsdf></shape>"));
        let Some(Bsdf::Diffuse { reflectance }) = scene.materials[1].plain() else { panic!() };
        reflectance
    };
    let radiance = |value: &str| {
        let scene = read(&format!("{SENSOR}<emitter type='constant'>{value}</emitter>")).unwrap();
        let Light::Constant { radiance } = scene.lights[0] else { panic!() };
        radiance
    };
    let expected = [
        ("<spectrum name='reflectance' value='0.4'/>", [0.4, 0.4, 0.4]),
        ("<float name='reflectance' value='0.3'/>", [0.3, 0.3, 0.3]),
        ("<rgb name='reflectance' value='0.3'/>", [0.3, 0.3, 0.3]),
        ("<rgb name='reflectance' value=' 0.1,0.2  0.3 '/>", [0.1, 0.2, 0.3]),
        ("<spectrum name='reflectance' value='400:0.5,700:0.5'/>", [0.497_671, 0.499_878_2, 0.497_454_6]),
        ("<spectrum name='reflectance' value='360:0.5, 830:0.5'/>", [0.499_492_6, 0.499_436_8, 0.499_400_8]),
        ("<spectrum name='reflectance' value='500:1,510:1'/>", [0.0, 0.078_110_8, 0.014_623_2]),
        ("<spectrum name='reflectance' value='100:0.1,200:0.4'/>", [0.0, 0.0, 0.0]),
        ("<rgb name='reflectance' value='#ff8000'/>", [1.0, 128.0 / 255.0, 0.0]),
        ("<srgb name='reflectance' value='#ff8000'/>", [1.0, 0.215_860_5, 0.0]),
        ("<spectrum name='reflectance' value='0.1, 0.2 0.3'/>", [0.1, 0.2, 0.3]),
        ("<spectrum type='uniform' name='reflectance'><float name='value' value='0.3'/></spectrum>", [0.3, 0.3, 0.3]),
        ("", [0.5, 0.5, 0.5]),
    ];
    for (value, rgb) in expected {
        let found = reflectance(value);
        assert!(close(found, Rgb::from_array(rgb), 1e-6), "{value}: {found}");
    }
    let expected = [
        ("<spectrum name='radiance' value='4'/>", [4.819_175_7, 3.793_164, 3.635_664_5]),
        ("<spectrum name='radiance' value='400:5,700:5'/>", [5.998_468, 4.747_602, 4.517_216_7]),
        ("<spectrum name='radiance' value='360:1,830:1'/>", [1.204_883_7, 0.948_228_2, 0.909_266_8]),
        ("<spectrum name='radiance' value='500:1,510:1'/>", [0.0, 0.071_244_1, 0.013_314_2]),
        ("<float name='radiance' value='3'/>", [3.0, 3.0, 3.0]),
        ("<spectrum type='d65' name='radiance'><float name='scale' value='5'/></spectrum>", [5.0, 5.0, 5.0]),
        ("", [1.0, 1.0, 1.0]),
    ];
    for (value, rgb) in expected {
        let found = radiance(value);
        assert!(close(found, Rgb::from_array(rgb), 1e-6), "{value}: {found}");
    }
}

/// What Mitsuba 3 refuses in files of 0.x is read with a warning.
#[test]
fn old_files_are_read_with_warnings() {
    let metal =
        "<bsdf type='roughconductor'><string name='distribution' value='phong'/><float name='alpha' value='0.3'/>
        <spectrum name='eta' value='0.2 0.9 1.1'/><spectrum name='k' value='3.9, 2.4, 2.1'/></bsdf>";
    let scene = scene(&format!("<shape type='sphere'>{metal}</shape>"));
    let Some(Bsdf::RoughConductor { facets, eta, k, .. }) = scene.materials[1].plain() else { panic!() };
    assert_eq!((facets.distribution, facets.alpha), (Distribution::Beckmann, [0.3; 2]));
    assert_eq!((eta, k), (Rgb::new(0.2, 0.9, 1.1), Rgb::new(3.9, 2.4, 2.1)));
    let count = |part: &str| scene.warnings.iter().filter(|w| w.contains(part)).count();
    assert_eq!((count("taken as RGB"), count("taken as beckmann")), (2, 1), "{:?}", scene.warnings);
}

/// A black body is the list of its values; the hotter, the bluer and the brighter.
#[test]
fn black_bodies_follow_plancks_law() {
    // 2hc²/λ⁵/(e^{hc/λkT}−1) at 5000 K, in nm.
    let list = |t: f64| {
        let planck = |nm: f64| {
            let x = 1.438_776_877e7 / (nm * t);
            1.191_042_972e20 / nm.powi(5) / x.exp_m1()
        };
        Spectrum::List((300..900).map(|nm| (f64::from(nm), planck(f64::from(nm)))).collect()).to_rgb(Role::Emission)
    };
    let body = |temperature| Spectrum::Blackbody { temperature, range: [0.0, 1e9] }.to_rgb(Role::Emission);
    for t in [1500.0, 5000.0, 12_000.0] {
        let (a, b) = (body(t), list(t));
        assert!((a / b - 1.0).abs().max_element() < 1e-3, "{t} K: {a} {b}");
    }
    assert!(body(12_000.0).z / body(12_000.0).x > body(3000.0).z / body(3000.0).x);
}

const W: [u32; 6] = [64, 48, 0, 0, 64, 48];
const H: [u32; 6] = [48, 64, 0, 0, 48, 64];
/// With a crop window.
const C: [u32; 6] = [64, 48, 10, 20, 30, 15];
const L: &str = "<lookat origin='1,2,3' target='-0.5,0.4,-1' up='0.1,1,0.2'/>";
const MIRRORED: &str = "<scale x='-1'/><lookat origin='1,2,3' target='-0.5,0.4,-1' up='0.1,1,0.2'/>";

/// Sensor properties, film, transform, and the ray directions at (0, 0), (1, 0), (0, 1), (0.3, 0.6) of the crop window:
/// Mitsuba's.
#[rustfmt::skip]
#[allow(clippy::type_complexity, reason = "a table")]
const CAMERAS: [(&str, [u32; 6], &str, [[f32; 3]; 4]); 19] = [
    ("<float name='fov' value='50'/>", W, L, [[-0.69199336, -0.009887339, -0.7218361], [0.06486012, -0.030454032, -0.99742955], [-0.6330227, -0.575586, -0.51767063], [-0.48761922, -0.40352744, -0.7742049]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='y'/>", W, L, [[-0.756695, 0.08026392, -0.6488223], [0.16557889, 0.05520214, -0.9846504], [-0.68483555, -0.60907567, -0.40003377], [-0.53478515, -0.4172287, -0.734796]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='diagonal'/>", W, L, [[-0.64034003, -0.071873195, -0.7647215], [-0.0051697725, -0.08913327, -0.9960063], [-0.5908504, -0.54662156, -0.59338075], [-0.4577474, -0.39433658, -0.7968475]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='smaller'/>", W, L, [[-0.756695, 0.08026392, -0.6488223], [0.16557889, 0.05520214, -0.9846504], [-0.68483555, -0.60907567, -0.40003377], [-0.53478515, -0.4172287, -0.734796]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='larger'/>", W, L, [[-0.69199336, -0.009887339, -0.7218361], [0.06486012, -0.030454032, -0.99742955], [-0.6330227, -0.575586, -0.51767063], [-0.48761922, -0.40352744, -0.7742049]]),
    ("", W, L, [[-0.6234349, -0.09075536, -0.77659017], [-0.02662945, -0.1069729, -0.9939052], [-0.5769345, -0.5368286, -0.61559856], [-0.44892412, -0.3915509, -0.80321544]]),
    ("<string name='focal_length' value='35mm'/>", W, L, [[-0.70558524, 0.007699147, -0.7085832], [0.08461342, -0.013773635, -0.9963186], [-0.6440165, -0.5829229, -0.49542266], [-0.49641684, -0.40616086, -0.7672052]]),
    ("<float name='fov' value='50'/><float name='principal_point_offset_x' value='0.1'/><float name='principal_point_offset_y' value='-0.2'/>", W, L, [[-0.6191237, 0.09974917, -0.7789325], [0.11959134, 0.0748927, -0.98999435], [-0.60561556, -0.49427977, -0.62363243], [-0.42040056, -0.2809772, -0.862737]]),
    ("<float name='fov' value='50'/>", C, L, [[-0.6043701, -0.27382088, -0.7481703], [-0.22311363, -0.29664028, -0.9285606], [-0.5782902, -0.4637229, -0.67122376], [-0.4896692, -0.40583518, -0.7717006]]),
    ("<float name='fov' value='50'/><float name='principal_point_offset_x' value='0.1'/><float name='principal_point_offset_y' value='-0.2'/>", C, L, [[-0.5377688, -0.15262456, -0.8291625], [-0.14512403, -0.1638833, -0.9757465], [-0.52681446, -0.35490745, -0.7723388], [-0.42280537, -0.2835918, -0.86070395]]),
    ("<float name='fov' value='50'/>", W, MIRRORED, [[0.06486017, -0.030454012, -0.99742955], [-0.69199336, -0.00988736, -0.7218362], [0.1238308, -0.59615266, -0.79326403], [-0.14395526, -0.41286612, -0.89934343]]),
    ("<float name='fov' value='50'/>", W, "<lookat origin='1,2,3' target='-0.5,0.4,-1'/>", [[-0.024093801, 0.05487299, -0.99820256], [0.025416985, -0.69804615, -0.7156015], [-0.5935795, 0.09200609, -0.7994987], [-0.39836857, -0.16882621, -0.9015544]]),
    ("<float name='fov' value='50'/>", W, "<matrix value='-1 0 0 0 0 1 0 1 0 0 -1 6.8 0 0 0 1'/>", [[-0.40286535, 0.30214903, -0.8639476], [0.40286532, 0.30214903, -0.86394763], [-0.40286535, -0.30214897, -0.8639476], [-0.18292879, -0.06859827, -0.98073006]]),
    ("<float name='fov' value='50'/>", W, "<matrix value='-1 0 0 0 1 0 0 0 -1'/>", [[-0.40286535, 0.30214903, -0.8639476], [0.40286532, 0.30214903, -0.86394763], [-0.40286535, -0.30214897, -0.8639476], [-0.18292879, -0.06859827, -0.98073006]]),
    ("<float name='fov' value='50'/>", H, L, [[-0.6533873, 0.19202119, -0.73226565], [0.038318098, 0.17322484, -0.98413664], [-0.5575748, -0.7270984, -0.40054753], [-0.47997886, -0.45118588, -0.752364]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='smaller'/>", H, L, [[-0.6533873, 0.19202119, -0.73226565], [0.038318098, 0.17322484, -0.98413664], [-0.5575748, -0.7270984, -0.40054753], [-0.47997886, -0.45118588, -0.752364]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='larger'/>", H, L, [[-0.6072151, 0.08182496, -0.7903129], [-0.039574962, 0.06639996, -0.9970079], [-0.52858764, -0.67244, -0.5180922], [-0.44487894, -0.428459, -0.7864513]]),
    ("<float name='fov' value='50'/><string name='fov_axis' value='diagonal'/>", H, L, [[-0.569192, 0.005094045, -0.8221889], [-0.092814334, -0.007851011, -0.9956525], [-0.50320584, -0.6279038, -0.59373456], [-0.4228541, -0.41399777, -0.806102]]),
    ("<float name='fov' value='50'/>", W, "<rotate x='0.6' y='0.8' angle='73'/><translate x='1' z='-2'/><rotate y='1' angle='-20'/>", [[0.8843849, -0.13370274, 0.44719893], [0.2593127, -0.4073785, 0.87567097], [0.8100972, -0.5840581, 0.051171854], [0.7404628, -0.5517153, 0.3838296]]),
];

#[test]
fn camera_rays_agree_with_mitsuba() {
    for (properties, film, transform, directions) in CAMERAS {
        let names = ["width", "height", "crop_offset_x", "crop_offset_y", "crop_width", "crop_height"];
        let film_xml: String =
            names.iter().zip(film).map(|(n, v)| format!("<integer name='{n}' value='{v}'/>")).collect();
        let scene = read(&format!(
            "{LIGHT}<sensor type='perspective'>{properties}<transform name='to_world'>{transform}</transform>
             <film type='hdrfilm'>{film_xml}</film></sensor>"
        ));
        let (camera, read_film) = scene.map(|s| (s.camera, s.film)).unwrap();
        assert_eq!(read_film.crop_offset, [film[2], film[3]]);
        for ((x, y), expected) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.6)].into_iter().zip(directions) {
            let s = (film[2] as f32 + x * film[4] as f32) / film[0] as f32;
            let t = (film[3] as f32 + y * film[5] as f32) / film[1] as f32;
            let direction = (camera.corner + camera.across * s + camera.down * t).normalize();
            let expected = Vec3::from_array(expected);
            assert!(close(direction, expected, 5e-7), "{properties} {transform} ({x}, {y}): {direction} {expected}");
        }
    }
}

#[test]
fn cameras_that_make_no_sense_are_refused() {
    let sensor = |inside: &str| refusal(&format!("{LIGHT}\n<sensor type='perspective'>{inside}</sensor>"));
    for (inside, expected) in [
        ("<float name='fov' value='190'/>", "below 180"),
        ("<float name='fov' value='0'/>", "above 0"),
        ("<float name='fov' value='50'/><float name='focal_length' value='50'/>", "both `fov` and `focal_length`"),
        ("<float name='fov' value='50'/><string name='fov_axis' value='z'/>", "allowed: x, y, diagonal"),
        ("<transform name='to_world'><scale x='2'/></transform>", "unequally"),
        ("<float name='near_clip' value='2'/><float name='far_clip' value='1'/>", "0 ≤ near < far is wanted"),
        ("<film type='hdrfilm'><integer name='width' value='0'/></film>", "width is 0; allowed: 1 to 65536"),
        ("<film type='hdrfilm'><integer name='crop_offset_x' value='9'/></film>", "leaves the film"),
        ("<film type='hdrfilm'><rfilter type='mitchell'/></film>", "allowed: box, tent, gaussian"),
        ("<film type='hdrfilm'><rfilter type='tent'><float name='radius' value='-1'/></rfilter></film>", "above 0"),
        ("<string name='focal_length' value='long'/>", "is not a number"),
    ] {
        let message = sensor(inside);
        assert!(message.starts_with("scene.xml:2:") && message.contains(expected), "{message}");
    }
    // A uniform scale changes nothing that is seen.
    let plain = scene("").camera;
    let scaled =
        format!("{LIGHT}<sensor type='perspective'><transform name='to_world'><scale value='3'/></transform></sensor>");
    assert_eq!(read(&scaled).unwrap().camera, plain);
}

#[test]
fn films_and_filters() {
    let film = |inside: &str| {
        read(&format!("{LIGHT}<sensor type='perspective'><film type='hdrfilm'>{inside}</film></sensor>")).unwrap().film
    };
    assert_eq!(film("").size, [768, 576]);
    assert_eq!(film("").filter, Filter::Gaussian { stddev: 0.5 });
    assert_eq!(scene("").film.filter, Filter::Gaussian { stddev: 0.5 });
    assert_eq!(film("<rfilter type='box'/>").filter, Filter::Box);
    assert_eq!(film("<rfilter type='tent'/>").filter, Filter::Tent { radius: 1.0 });
    let wide = "<rfilter type='gaussian'><float name='stddev' value='0.7'/></rfilter>";
    assert_eq!(film(wide).filter, Filter::Gaussian { stddev: 0.7 });
}

#[test]
fn integrators_give_depths() {
    let depth = |integrator: &str| read(&format!("{SENSOR}{LIGHT}{integrator}")).map(|s| s.depth);
    let default = Depth { max: None, roulette: 5 };
    assert_eq!(depth("").unwrap(), default);
    assert_eq!(depth("<integrator type='path'/>").unwrap(), default);
    assert_eq!(depth("<integrator type='path'><integer name='max_depth' value='-1'/></integrator>").unwrap(), default);
    let both = "<integer name='max_depth' value='7'/><integer name='rr_depth' value='9'/>";
    let expected = Depth { max: Some(7), roulette: 9 };
    assert_eq!(depth(&format!("<integrator type='volpath'>{both}</integrator>")).unwrap(), expected);
    let nested = format!("<integrator type='moment'><integrator type='path'>{both}</integrator></integrator>");
    assert_eq!(depth(&nested).unwrap(), expected);
    assert_eq!(depth("<integrator type='direct'/>").unwrap().max, Some(2));
    for (wrong, expected) in [
        ("<integrator type='bdpt'/>", "integrator `bdpt` is not supported; allowed: path, volpath"),
        ("<integrator type='path'><integer name='max_depth' value='-2'/></integrator>", "-1 (no limit) or at least 0"),
        ("<integrator type='path'><integer name='rr_depth' value='0'/></integrator>", "at least 1"),
        ("<integrator type='path'><boolean name='hide_emitters' value='true'/></integrator>", "hide_emitters"),
        ("<integrator type='path'/><integrator type='path'/>", "a second integrator"),
        ("<integrator type='aov'><integrator type='moment'/></integrator>", "no usable integrator"),
    ] {
        let message = depth(wrong).unwrap_err().to_string();
        assert!(message.starts_with("scene.xml:1:") && message.contains(expected), "{message}");
    }
}

/// Which side is the front, under mirrors, turns and flips. Expected: the sign of z (cylinder, sphere: outwards) of
/// Mitsuba's shading normal, by which it takes sides.
#[test]
fn fronts_agree_with_mitsuba() {
    let transforms = [
        "",
        "<scale z='-1'/>",
        "<scale x='-1'/><translate x='0.5'/>",
        "<rotate x='1' angle='180'/>",
        "<scale value='-1'/>",
    ];
    for (kind, fronts) in [
        ("rectangle", [1, -1, 1, -1, -1]),
        ("disk", [1, -1, 1, -1, -1]),
        ("cube", [1, 1, 1, 1, 1]),
        ("sphere", [1, -1, -1, 1, -1]),
        ("cylinder", [1, 1, 1, 1, 1]),
    ] {
        for (transform, front) in transforms.iter().zip(fronts) {
            for (flip, sign) in [(false, 1), (true, -1)] {
                let text = format!(
                    "<shape type='{kind}'><boolean name='flip_normals' value='{flip}'/>
                     <transform name='to_world'>{transform}</transform></shape>"
                );
                let scene = scene(&text);
                assert_eq!(front_of(&scene), front * sign, "{text}");
            }
        }
    }
}

/// 1 or -1: the front of the only shape, as in [`fronts_agree_with_mitsuba`].
fn front_of(scene: &Scene) -> i32 {
    let triangle = |i: usize| {
        let [a, b, c] = scene.corners(&scene.triangles[i]);
        ((b - a).cross(c - a), (a + b + c) / 3.0)
    };
    let sign = match scene.shapes[0].geometry {
        Geometry::Rectangle { edge_u, edge_v, .. } => {
            let normal = edge_u.cross(edge_v);
            assert!(triangle(0).0.dot(normal) > 0.0 && triangle(1).0.dot(normal) > 0.0);
            normal.z
        }
        Geometry::Disk { u, v, .. } => u.cross(v).z,
        Geometry::Sphere { flip, .. } | Geometry::Cylinder { flip, .. } => {
            if flip {
                -1.0
            } else {
                1.0
            }
        }
        Geometry::Mesh { .. } => {
            let middle = scene.positions.iter().sum::<Vec3>() / scene.positions.len() as f32;
            let outwards: Vec<bool> = (0..12).map(|i| triangle(i).0.dot(triangle(i).1 - middle) > 0.0).collect();
            assert!(outwards.iter().all(|&o| o == outwards[0]), "{outwards:?}");
            if outwards[0] { 1.0 } else { -1.0 }
        }
    };
    if sign > 0.0 { 1 } else { -1 }
}

/// Meshes: the same for files with and without normals. Expected: Mitsuba.
#[test]
fn mesh_fronts_agree_with_mitsuba() {
    let folder = tempfile::tempdir().unwrap();
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let write = |name: &str, rest: &str| std::fs::write(folder.path().join(name), format!("{vertices}{rest}")).unwrap();
    write("plain.obj", "f 1 2 3\n");
    write("up.obj", "vn 0 0 1\nf 1//1 2//1 3//1\n");
    write("down.obj", "vn 0 0 -1\nf 1//1 2//1 3//1\n");
    for (file, face_normals, front, mirrored) in [
        ("plain", false, 1.0, -1.0),
        ("plain", true, 1.0, -1.0),
        ("up", false, 1.0, 1.0),
        ("up", true, 1.0, -1.0),
        ("down", false, -1.0, -1.0),
        ("down", true, 1.0, -1.0),
    ] {
        for (transform, front) in [("", front), ("<scale x='-1'/>", mirrored)] {
            for (flip, sign) in [(false, 1.0), (true, -1.0)] {
                let text = format!(
                    "<scene version='3.0.0'>{SENSOR}{LIGHT}<shape type='obj'><string name='filename' value='{file}.obj'/>
                     <boolean name='face_normals' value='{face_normals}'/><boolean name='flip_normals' value='{flip}'/>
                     <transform name='to_world'>{transform}</transform></shape></scene>"
                );
                let scene = parse_str(&text, &folder.path().join("scene.xml"), &Options::default()).unwrap();
                let [a, b, c] = scene.corners(&scene.triangles[0]);
                assert_eq!((b - a).cross(c - a).z, front * sign, "{text}");
                // One facet: its vertex normals say nothing new.
                assert_eq!(scene.normals[0], Vec3::ZERO, "{text}");
            }
        }
    }
}

const PYRAMID: &str =
    "v 0 0 0\nv 2 0 0\nv 2 1 0.3\nv 0 1 0\nv 0.6 0.4 1.5\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 4 3 2 1\n";

/// Positions and computed normals of a pyramid under a skewing transform. Expected: Mitsuba.
#[test]
fn vertex_normals_agree_with_mitsuba() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), PYRAMID).unwrap();
    let text = format!(
        "<scene version='3.0.0'>{SENSOR}{LIGHT}<shape type='obj'><string name='filename' value='mesh.obj'/>
         <transform name='to_world'><scale x='1' y='2' z='0.5'/><rotate y='1' angle='40'/></transform></shape></scene>"
    );
    let place = folder.path().join("scene.xml");
    let scene = parse_str(&text, &place, &Options::default()).unwrap();
    let triangles: Vec<_> = scene.triangles.iter().map(|t| t.vertices).collect();
    assert_eq!(triangles, [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [4, 3, 1], [4, 1, 0]]);
    let positions = [
        [0.0, 0.0, 0.0],
        [1.532_088_9, 0.0, -1.285_575_3],
        [0.941_717_4, 0.8, 0.188_860_7],
        [1.628_507, 2.0, -1.170_668_6],
        [0.0, 2.0, 0.0],
    ];
    let normals = [
        [-0.659_762_3, -0.709_955, 0.246_328_5],
        [0.452_326_8, -0.650_592_3, -0.610_024_9],
        [0.477_008_4, -0.101_995_9, 0.872_960_3],
        [0.521_272_5, 0.691_698_2, -0.499_828_6],
        [-0.620_385_3, 0.742_572_2, 0.252_405_7],
    ];
    for i in 0..5 {
        assert!(close(scene.positions[i], Vec3::from_array(positions[i]), 3e-7), "{i}: {}", scene.positions[i]);
        assert!(close(scene.normals[i], Vec3::from_array(normals[i]), 5e-7), "{i}: {}", scene.normals[i]);
    }
    let mesh = "v 0 0 0\nv 2 0 0\nv 2 1 0.3\nvn 0 0 1\nvn 1 0 1\nvn 0 -1 2\nf 1//1 2//2 3//3\n";
    std::fs::write(folder.path().join("mesh.obj"), mesh).unwrap();
    let scene = parse_str(&text, &place, &Options::default()).unwrap();
    let normals =
        [[0.642_787_6, 0.0, 0.766_044_4], [0.917_512_2, 0.0, 0.397_707_6], [0.637_823_9, -0.124_034_7, 0.760_128_9]];
    for (found, expected) in scene.normals.iter().zip(normals) {
        assert!(close(*found, Vec3::from_array(expected), 5e-7), "{found}");
    }
    assert!(matches!(scene.shapes[0].geometry, Geometry::Mesh { smooth: true, .. }));
}

#[test]
fn spheres_and_cylinders_are_placed() {
    let place = "<transform name='to_world'><scale value='2'/><rotate x='1' angle='90'/><translate x='1'/></transform>";
    let ball = scene(&format!(
        "<shape type='sphere'><float name='radius' value='0.5'/><point name='center' x='1' y='2' z='3'/>{place}</shape>"
    ));
    let Geometry::Sphere { center, radius, flip } = ball.shapes[0].geometry else { panic!() };
    assert!(close(center, Vec3::new(3.0, -6.0, 4.0), 1e-6) && radius == 1.0 && !flip, "{center} {radius}");
    let pipe = scene(&format!(
        "<shape type='cylinder'><point name='p0' value='1,0,0'/><point name='p1' x='1' y='3' z='0'/>
         <float name='radius' value='0.5'/>{place}</shape>"
    ));
    let Geometry::Cylinder { p0, axis, radius, flip } = pipe.shapes[0].geometry else { panic!() };
    assert!(close(p0, Vec3::new(3.0, 0.0, 0.0), 1e-6) && close(axis, Vec3::new(0.0, 0.0, 6.0), 1e-6), "{p0} {axis}");
    assert!(radius == 1.0 && !flip);
    for (shape, expected) in [
        ("sphere'><transform name='to_world'><scale x='2'/></transform>", "ellipsoid"),
        ("sphere'><float name='radius' value='-1'/>", "radius is -1"),
        ("cylinder'><transform name='to_world'><scale x='2'/></transform>", "elliptic"),
        ("cylinder'><transform name='to_world'><matrix value='1 0 1 0 1 0 0 0 1'/></transform>", "oblique"),
        ("cylinder'><point name='p1' x='0' y='0' z='0'/>", "coincide"),
        ("rectangle'><transform name='to_world'><scale x='0'/></transform>", "singular"),
    ] {
        let message = refusal(&format!("{SENSOR}{LIGHT}\n<shape type='{shape}</shape>"));
        assert!(message.starts_with("scene.xml:2:1: shape") && message.contains(expected), "{message}");
    }
}

/// Steps apply in document order, each in world space.
#[test]
fn transforms_compose_in_document_order() {
    let corner = |steps: &str| {
        let text = format!("<shape type='rectangle'><transform name='to_world'>{steps}</transform></shape>");
        let Geometry::Rectangle { corner, .. } = scene(&text).shapes[0].geometry else { panic!() };
        corner
    };
    for (steps, expected) in [
        ("", [-1.0, -1.0, 0.0]),
        ("<translate x='5'/><scale value='2'/>", [8.0, -2.0, 0.0]),
        ("<scale value='2'/><translate x='5'/>", [3.0, -2.0, 0.0]),
        ("<scale value='2, 3 4'/>", [-2.0, -3.0, 0.0]),
        ("<rotate z='1' angle='90'/><translate value='0 0 7'/>", [1.0, -1.0, 7.0]),
        ("<matrix value='1 0 0 9  0 2 0 8  0 0 1 7  0 0 0 1'/>", [8.0, 6.0, 7.0]),
        ("<matrix value='0 2 0  1 0 0  0 0 1'/>", [-2.0, -1.0, 0.0]),
        ("<lookat origin='1 2 3' target='1 2 9' up='0 1 0'/>", [0.0, 1.0, 3.0]),
    ] {
        let found = corner(steps);
        assert!(close(found, Vec3::from_array(expected), 1e-6), "{steps}: {found}");
    }
}

#[test]
fn materials_and_lights_are_shared_and_sided() {
    let both = scene(
        "<shape type='sphere'><ref id='two'/></shape>
         <bsdf type='twosided' id='two'><bsdf type='diffuse' id='a'><rgb name='reflectance' value='0.1'/></bsdf>
           <bsdf type='diffuse'><rgb name='reflectance' value='0.2'/></bsdf></bsdf>
         <shape type='sphere'><ref id='two'/></shape>
         <shape type='sphere'><bsdf type='twosided'><ref id='a'/></bsdf></shape>
         <shape type='sphere'><ref id='a'/></shape>
         <shape type='sphere'/>
         <shape type='sphere' id='lamp'><emitter type='area'><rgb name='radiance' value='5 6 7'/></emitter></shape>",
    );
    let sides: Vec<_> = both.shapes.iter().map(|s| [s.front, s.back]).collect();
    assert_eq!(sides, [[1, 2], [1, 2], [1, 1], [1, 0], [3, 0], [0, 0]]);
    let diffuse = |v| Material::from(Bsdf::Diffuse { reflectance: Rgb::splat(v) });
    assert_eq!(both.materials, [Material::BLACK, diffuse(0.1), diffuse(0.2), diffuse(0.5)]);
    assert_eq!(both.lights[1], Light::Area { shape: 5, radiance: Rgb::new(5.0, 6.0, 7.0) });
    assert_eq!((both.shapes[5].light, both.shapes[5].name.as_str()), (Some(1), "lamp"));
    assert_eq!(both.shapes[0].name, "sphere (scene.xml:1:78)");

    let points =
        "<emitter type='point'><point name='position' x='1' y='2' z='3'/><rgb name='intensity' value='4'/></emitter>
        <emitter type='point'><transform name='to_world'><translate x='9'/></transform></emitter>";
    let expected = [
        Light::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity: Rgb::splat(4.0) },
        Light::Point { position: Vec3::new(9.0, 0.0, 0.0), intensity: Rgb::ONE },
    ];
    assert_eq!(read(&format!("{SENSOR}{points}")).unwrap().lights, expected);
}

#[test]
fn parameters_are_put_in() {
    let text = format!(
        "<scene version='3.0.0'><default name='r' value='0.25'/><default name='radius' value='2'/>
         <default name='kind' value='sphere'/>{SENSOR}{LIGHT}
         <shape type='$kind' id='cost\\$5'><float name='radius' value='$radius'/><bsdf type='diffuse'>
         <rgb name='reflectance' value='$r,0.5,$r'/></bsdf></shape></scene>"
    );
    let read = |parameters: &[(&str, &str)]| {
        let owned: Vec<_> = parameters.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
        parse_str(&text, Path::new("scene.xml"), &Options { parameters: owned, ..Options::default() })
    };
    let radius = |scene: &Scene| match scene.shapes[0].geometry {
        Geometry::Sphere { radius, .. } => radius,
        _ => panic!(),
    };
    let scene = read(&[]).unwrap();
    assert_eq!((radius(&scene), scene.shapes[0].name.as_str()), (2.0, "cost$5"));
    assert_eq!(scene.materials[1].plain(), Some(Bsdf::Diffuse { reflectance: Rgb::new(0.25, 0.5, 0.25) }));
    assert_eq!(radius(&read(&[("radius", "3.5")]).unwrap()), 3.5);
    let message = read(&[("radios", "3.5")]).unwrap_err().to_string();
    assert_eq!(
        message,
        "scene.xml: the scene has no parameter `radios`; did you mean `radius`? (it has: r, radius, kind)"
    );
    let message = refusal("\n<default name='a' value='1'/><shape type='$b'/>");
    assert_eq!(message, "scene.xml:2:30: undefined parameter $b (defined: $a)");
}

#[test]
fn includes_aliases_and_search_paths() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("far/away/tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write(
        "parts/grey.xml",
        "<bsdf version='3.0.0' type='diffuse' id='grey'><float name='reflectance' value='$v'/></bsdf>",
    );
    write(
        "parts/all.xml",
        "<scene version='3.0.0'><include filename='parts/grey.xml'/><include filename='more.xml'/></scene>",
    );
    write(
        "parts/more.xml",
        "<scene version='0.6.0'><shape type='obj'><string name='filename' value='tri.obj'/>
        <boolean name='faceNormals' value='true'/><ref id='other'/></shape></scene>",
    );
    write("scene.xml", &format!("<scene version='3.0.0'><default name='v' value='0.3'/><path value='far'/>
        <path value='far/away'/><include filename='parts/all.xml'/><alias id='grey' as='other'/>{SENSOR}{LIGHT}</scene>"));
    let scene = load(&folder.path().join("scene.xml"), &Options::default()).unwrap();
    assert_eq!(counts(&scene), [1, 1, 2, 1]);
    assert_eq!(scene.materials[1].plain(), Some(Bsdf::Diffuse { reflectance: Rgb::splat(0.3) }));
    assert_eq!(scene.normals[0], Vec3::ZERO);
    let names: Vec<_> = scene.sources.iter().map(|p| p.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["scene.xml", "all.xml", "grey.xml", "more.xml", "tri.obj"]);
    assert_eq!(scene.name, "scene");
}

#[test]
fn old_spellings_are_upgraded() {
    let text = "<scene version='0.6.0'><integrator type='path'><integer name='maxDepth' value='3'/>
        <integer name='rrDepth' value='4'/></integrator>
        <sensor type='perspective'><string name='fovAxis' value='y'/><float name='fov' value='40'/>
        <transform name='toWorld'><lookAt origin='0,0,5' target='0,0,0' up='0,1,0'/></transform></sensor>
        <shape type='sphere'><bsdf type='diffuse'><srgb name='diffuseReflectance' value='1 0.5 0'/></bsdf>
        <boolean name='flipNormals' value='true'/></shape><emitter type='constant'/></scene>";
    let scene = parse_str(text, Path::new("scene.xml"), &Options::default()).unwrap();
    assert_eq!(scene.depth, Depth { max: Some(3), roulette: 4 });
    assert_eq!(scene.camera.origin, Vec3::new(0.0, 0.0, 5.0));
    assert!(matches!(scene.shapes[0].geometry, Geometry::Sphere { flip: true, .. }));
    let Some(Bsdf::Diffuse { reflectance }) = scene.materials[1].plain() else { panic!() };
    assert!(close(reflectance, Rgb::new(1.0, 0.214_041_14, 0.0), 1e-6), "{reflectance}");
    assert_eq!(scene.warnings, Vec::<String>::new());
    // In a file of version 3 the old names are unknown.
    let scene = parse_str(&text.replace("0.6.0", "3.0.0"), Path::new("scene.xml"), &Options::default()).unwrap();
    assert_eq!(scene.warnings.len(), 6, "{:?}", scene.warnings);
}

#[test]
fn what_has_no_effect_is_told() {
    let scene = scene(
        "\n<shape type='sphere'><float name='raduis' value='2'/></shape>
         <sensor type='perspective'/><shape type='disk'><transform name='to_world'><rotate x='2' angle='5'/></transform></shape>
         <bsdf type='plastic' id='never used'/>",
    );
    let expected = [
        "scene.xml:3:84: the axis has no unit length; taken as a direction (Mitsuba 3 distorts the scene)",
        "scene.xml:2:22: `raduis` of shape `sphere` has no effect",
        "scene.xml:3:10: only the first sensor counts",
    ];
    assert_eq!(scene.warnings, expected);
    assert!(read(SENSOR).unwrap_err().to_string().contains("the scene is empty"));
    let violet =
        read(&format!("{SENSOR}<emitter type='constant'><spectrum name='radiance' value='400:1,410:1'/></emitter>"));
    let warnings = violet.unwrap().warnings.join("; ");
    assert!(warnings.contains("xml:1:77: the spectrum is out of the gamut of RGB, ["), "{warnings}");
    let dark = read(&format!("{SENSOR}<shape type='sphere'/>")).unwrap();
    assert_eq!(dark.warnings, ["scene.xml:1:1: the scene has no light source"]);
}

#[test]
fn obj_in_all_its_forms() {
    let text = "# comment \\\n mtllib x.mtl\r\n\to name with \u{fc}\nv 0 0 0 1.0\r\nv\t1 0 0 0.5 0.5 0.5\n  v 1 1 0\nv 0 1 \\\n 0\n\
        vt 0.5 2 9\nvn 0 0 2\nvn 0 1 0\ng a b\nusemtl #1\ns off\nf 1 2 3 4\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1 # quad\n\
        f -4/1/1 -3/-1/-2 -2/1/2\nf 1//1 2//1 \\\n3//2\nv 9 9 9";
    let mesh = obj::parse(text.as_bytes(), Path::new("m.obj")).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12], [7, 8, 13]]);
    assert_eq!((mesh.positions.len(), mesh.positions[3]), (14, Vec3::new(0.0, 1.0, 0.0)));
    assert_eq!((mesh.normals[0], mesh.normals[7], mesh.normals[13]), (Vec3::ZERO, Vec3::Z * 2.0, Vec3::Y));
    assert_eq!((mesh.uvs.len(), mesh.uvs[3], mesh.uvs[4]), (14, Vec2::ZERO, Vec2::new(0.5, 2.0)));
    let latin = obj::parse(b"o \xff\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", Path::new("m.obj")).unwrap();
    assert_eq!((latin.triangles.len(), latin.normals.len()), (1, 0));
}

/// The same mesh in three encodings, with properties of odd types and order, a foreign element and a quadrilateral.
#[test]
fn ply_in_all_its_forms() {
    let header = |format: &str| {
        format!(
            "ply\r\nformat {format} 1.0\ncomment made by hand\nobj_info x\nelement camera 2\nproperty short a\n\
             property list uchar double b\nelement vertex 4\nproperty uchar red\nproperty double z\nproperty float x\n\
             property int8 y\nproperty float nz\nproperty float ny\nproperty float nx\nelement face 2\n\
             property list ushort float weights\nproperty list uint8 uint vertex_index\nproperty char flags\nend_header\n"
        )
    };
    let ascii = header("ascii")
        + "-7 0\n8 2 0.5 1.5\n255 0.25 0 0 1 0 0\n1 0.25 1 0 1 0 0\n1 0.25 1 1 1 0 0 1 0.25\n0 1 1 0 0\n\
           0 4 0 1 2 3 -1\n1 0.5 3 0 1 3 1";
    let expected = ply::parse(ascii.as_bytes(), Path::new("m.ply")).unwrap();
    assert_eq!(expected.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
    assert_eq!((expected.positions[2], expected.normals[3]), (Vec3::new(1.0, 1.0, 0.25), Vec3::Z));
    for big in [false, true] {
        let mut bytes = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |mut value: Vec<u8>| {
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        put((-7i16).to_le_bytes().into());
        put(vec![0]);
        put(8i16.to_le_bytes().into());
        put(vec![2]);
        put(0.5f64.to_le_bytes().into());
        put(1.5f64.to_le_bytes().into());
        for (x, y) in [(0f32, 0i8), (1.0, 0), (1.0, 1), (0.0, 1)] {
            put(vec![255]);
            put(0.25f64.to_le_bytes().into());
            put(x.to_le_bytes().into());
            put(y.to_le_bytes().into());
            for n in [1f32, 0.0, 0.0] {
                put(n.to_le_bytes().into());
            }
        }
        for (weights, list) in [(vec![], vec![0u32, 1, 2, 3]), (vec![0.5f32], vec![0, 1, 3])] {
            put((weights.len() as u16).to_le_bytes().into());
            weights.iter().for_each(|w| put(w.to_le_bytes().into()));
            put(vec![list.len() as u8]);
            list.iter().for_each(|i| put(i.to_le_bytes().into()));
            put(vec![255]);
        }
        assert_eq!(ply::parse(&bytes, Path::new("m.ply")).unwrap(), expected, "big endian: {big}");
    }
}

/// One broken field each: every check of `validate` fires.
#[test]
fn validate_notices_every_broken_field() {
    let sound = scene(
        "<shape type='cube'/><shape type='rectangle'><emitter type='area'/></shape><shape type='sphere'/>
         <shape type='disk'/><shape type='cylinder'/><emitter type='point'/>",
    );
    sound.validate().unwrap();
    type Break = fn(&mut Scene);
    let breaks: [(&str, Break); 27] = [
        ("vertex", |s| s.positions[3].y = f32::NAN),
        ("normal", |s| s.normals[3].y = 0.5),
        ("normals", |s| s.normals.truncate(9)),
        ("names a vertex", |s| s.triangles[2].vertices[1] = 1000),
        ("names shape", |s| s.triangles[2].shape = 99),
        ("not its own", |s| s.triangles[2].shape = 1),
        ("triangles", |s| s.triangles.truncate(13)),
        ("triangles", |s| s.triangles.push(s.triangles[0])),
        ("material", |s| s.shapes[0].front = 77),
        ("material", |s| s.shapes[0].back = 77),
        ("black", |s| s.materials[0] = s.materials[1]),
        ("reflectance", |s| s.materials[1] = Bsdf::Diffuse { reflectance: Rgb::new(0.0, 1.01, 0.0) }.into()),
        ("reflectance", |s| s.materials[1] = Bsdf::Diffuse { reflectance: Rgb::NAN }.into()),
        ("light", |s| s.shapes[1].light = None),
        ("light", |s| s.shapes[2].light = Some(0)),
        ("light", |s| s.shapes[2].light = Some(10)),
        ("radiance", |s| s.lights[0] = Light::Constant { radiance: Rgb::new(0.0, -1.0, 0.0) }),
        ("environments", |s| s.lights[2] = s.lights[0]),
        ("intensity", |s| s.lights[2] = Light::Point { position: Vec3::ZERO, intensity: Rgb::INFINITY }),
        ("not finite", |s| s.lights[2] = Light::Point { position: Vec3::NAN, intensity: Rgb::ONE }),
        ("has no extent", |s| s.shapes[2].geometry = Geometry::Sphere { center: Vec3::ZERO, radius: 0.0, flip: false }),
        ("has no extent", |s| s.shapes[3].geometry = Geometry::Disk { center: Vec3::ZERO, u: Vec3::X, v: Vec3::X }),
        ("has no extent", |s| {
            s.shapes[4].geometry = Geometry::Cylinder { p0: Vec3::ZERO, axis: Vec3::ZERO, radius: 1.0, flip: true };
        }),
        ("crop window", |s| s.film.crop_size = [0, 4]),
        ("crop window", |s| s.film.crop_offset = [u32::MAX, 0]),
        ("camera", |s| s.camera.down = s.camera.across),
        ("near", |s| s.camera.near = f32::INFINITY),
    ];
    for (i, (expected, break_it)) in breaks.into_iter().enumerate() {
        let mut scene = sound.clone();
        break_it(&mut scene);
        let problems = scene.validate().expect_err(&format!("break {i} ({expected})")).join("; ");
        assert!(problems.contains(expected), "{i}: {problems}");
    }
    let mut many = sound.clone();
    many.positions.fill(Vec3::NAN);
    assert_eq!(many.validate().unwrap_err().len(), 21);
    let mut flat = sound;
    flat.positions[1] = flat.positions[0];
    assert_eq!((flat.validate(), flat.zero_area_triangles()), (Ok(()), 1));
}
