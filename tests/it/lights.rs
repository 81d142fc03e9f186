//! Light sampling: densities by chi-square on the light's own surface, `sample` against `pdf`, solid angles, extremes.

use crate::chi2::Chi2;
use crate::support::level;
use crate::warps::{sphere_point, sphere_vector, words};
use glam::{DVec3, Vec3Swizzles as _};
use rootn::accel::{NO_PRIMITIVE, SurfacePoint};
use rootn::math::{Frame, Vec3};
use rootn::sampling::rng::unit_f32;
use rootn::sampling::strategy::{LightChoice, Lights};
use rootn::scene::light::{self, LightSample, LightSampler, LightTarget};
use rootn::scene::shape::{Geometry, Shape};
use rootn::scene::{Light, Material, Scene, Triangle};
use std::f64::consts::{PI, TAU};

const SAMPLES: u64 = 60_000;
const BOTH: [Lights; 2] = [Lights::Area, Lights::SolidAngle];

/// A scene with these surfaces as lights of radiance 1. Rectangles and triangles come with their mesh.
pub(crate) fn lit(shapes: Vec<Geometry>) -> Scene {
    let mut scene = Scene { materials: vec![Material::BLACK], ..Scene::default() };
    for geometry in shapes {
        let shape = scene.shapes.len() as u32;
        scene.shapes.push(Shape {
            geometry,
            front: 0,
            back: 0,
            light: Some(shape),
            axes: Default::default(),
            name: String::new(),
        });
        scene.lights.push(Light::Area { shape, radiance: Vec3::ONE });
    }
    scene
}

/// Adds triangles (vertex, two edges) as one mesh light.
pub(crate) fn mesh(scene: &mut Scene, triangles: &[[Vec3; 3]]) {
    let (shape, start) = (scene.shapes.len() as u32, scene.triangles.len() as u32);
    for &[a, eb, ec] in triangles {
        let v = scene.positions.len() as u32;
        scene.positions.extend([a, a + eb, a + ec]);
        scene.triangles.push(Triangle { vertices: [v, v + 1, v + 2], shape });
    }
    let geometry = Geometry::Mesh { range: start..scene.triangles.len() as u32, smooth: false, uvs: false };
    scene.shapes.push(Shape {
        geometry,
        front: 0,
        back: 0,
        light: Some(scene.lights.len() as u32),
        axes: Default::default(),
        name: String::new(),
    });
    scene.lights.push(Light::Area { shape, radiance: Vec3::ONE });
}

pub(crate) fn rectangle(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Geometry {
    Geometry::Rectangle { range: 0..0, corner, edge_u, edge_v }
}

/// The sampled point as a surface point.
fn surface(s: &LightSample, shape: u32) -> SurfacePoint {
    let LightTarget::Point(at) = s.to else { panic!("no point") };
    SurfacePoint { p: at.p, p_error: at.p_error, ng: at.ng, ns: at.ng, shape, triangle: at.triangle }
}

/// One light seen from one point, parametrised by the unit square.
struct View<'a> {
    name: String,
    scene: &'a Scene,
    p: Vec3,
    /// Point of the surface, its normal, and area per unit of the square.
    point: Box<dyn Fn([f64; 2]) -> (DVec3, DVec3, f64) + 'a>,
    /// The square's point of a surface point.
    invert: Box<dyn Fn(DVec3) -> [f64; 2] + 'a>,
}

impl View<'_> {
    /// p-value with a density `factor` times the sampler's own, over the square. `cosine`: false leaves it out (sabotage).
    fn p_value(&self, test: &str, lights: Lights, factor: f64, cosine: bool) -> f64 {
        let sampler = LightSampler::new(self.scene, lights, LightChoice::Power);
        let density = |at: [f64; 2]| {
            let (q, n, jacobian) = (self.point)(at);
            let to = q - self.p.as_dvec3();
            let wi = to.normalize();
            let cos = -wi.dot(n);
            if cos <= 0.0 {
                return 0.0;
            }
            let (q, ng) = (q.as_vec3(), n.as_vec3());
            let hit = SurfacePoint { p: q, p_error: Vec3::ZERO, ng, ns: ng, shape: 0, triangle: NO_PRIMITIVE };
            let pdf = f64::from(sampler.pdf(self.scene, self.p, wi.as_vec3(), &hit, 0));
            let cos = if cosine { cos } else { 1.0 };
            factor * pdf * cos / to.length_squared() * jacobian
        };
        let sample = |i| {
            let s = sampler.sample(self.scene, self.p, words(test, i))?;
            let hit = surface(&s, 0);
            assert!(s.wi.is_normalized() && s.pdf.is_finite() && s.pdf > 0.0, "{}: {s:?}", self.name);
            let pdf = sampler.pdf(self.scene, self.p, s.wi, &hit, 0);
            assert!((pdf / s.pdf - 1.0).abs() < 1e-5, "{}: sample says {}, pdf says {pdf}", self.name, s.pdf);
            Some((self.invert)(hit.p.as_dvec3()))
        };
        let mut test = Chi2 { domain: [[0.0, 1.0]; 2], samples: SAMPLES, sample, density };
        // Where most samples show their back, 2 % of the others are 8 standard errors.
        let mass = test.mass() / factor;
        test.samples += (160_000.0 * ((1.0 - mass) / mass).clamp(0.0, 6.0)) as u64;
        test.p_value()
    }

    /// The sampler passes, its sabotaged twins do not.
    fn check(&self, test: &str, techniques: &[Lights]) {
        for &lights in techniques {
            let p = self.p_value(test, lights, 1.0, true);
            assert!(p > level(test), "{} by {lights:?}: p = {p:e}", self.name);
            for (what, factor, cosine) in
                [("2 % less", 0.98, true), ("2 % more", 1.02, true), ("no cosine", 1.0, false)]
            {
                let p = self.p_value(test, lights, factor, cosine);
                assert!(p < level(test), "{} by {lights:?}, {what}: p = {p:e}", self.name);
            }
        }
    }
}

fn parallelogram<'a>(name: &str, scene: &'a Scene, p: Vec3) -> View<'a> {
    let Geometry::Rectangle { corner, edge_u, edge_v, .. } = scene.shapes[0].geometry else { panic!() };
    let (c, u, v) = (corner.as_dvec3(), edge_u.as_dvec3(), edge_v.as_dvec3());
    let n = u.cross(v);
    View {
        name: format!("{name}, from {p}"),
        scene,
        p,
        point: Box::new(move |[s, t]| (c + s * u + t * v, n.normalize(), n.length())),
        invert: Box::new(move |q| {
            let d = q - c;
            [d.cross(v).dot(n) / n.length_squared(), u.cross(d).dot(n) / n.length_squared()]
        }),
    }
}

#[test]
fn rectangles_follow_their_densities() {
    const TEST: &str = "rectangles";
    // Downwards, around the origin, with sides of 1 and 0.6.
    let unit = |scale: f32, shear: f32| {
        let (u, v) = (Vec3::new(0.0, 0.0, 0.6) * scale, Vec3::new(-1.0, 0.0, 0.0) * scale);
        lit(vec![rectangle(Vec3::new(0.5, 0.0, -0.3) * scale, u, v + shear * u)])
    };
    for (name, scene) in [("rectangle", unit(1.0, 0.0)), ("parallelogram", unit(1.0, 0.8))] {
        // Below, aside, almost in its plane, far, near.
        for p in [[0.1, -1.0, 0.2], [2.0, -1.0, 1.5], [1.5, -0.01, 0.4], [30.0, -40.0, 5.0], [0.1, -0.1, 0.05]] {
            parallelogram(name, &scene, Vec3::from(p)).check(TEST, &BOTH);
        }
    }
    for (scale, shear) in [(3e-5, 0.0), (3e-5, 0.8)] {
        parallelogram("10⁻⁹ sr", &unit(scale, shear), Vec3::new(0.3, -0.8, 0.2)).check(TEST, &BOTH);
    }
    // So near that the light fills the hemisphere: directions instead of points.
    for shear in [0.0f32, 0.8] {
        let scene = unit(1.0, shear);
        let view = parallelogram("hemisphere", &scene, Vec3::new(0.1, -1e-3, 0.05));
        let sampler = LightSampler::new(&scene, Lights::SolidAngle, LightChoice::Power);
        for (factor, sound) in [(1.0, true), (0.98, false), (1.02, false)] {
            let sample = |i| {
                let wi = sampler.sample(&scene, view.p, words(TEST, i)).unwrap().wi;
                Some(sphere_point(Vec3::new(wi.x, wi.z, wi.y)))
            };
            let density = |at: [f64; 2]| {
                let wi = sphere_vector(at).as_dvec3().xzy();
                let q = view.p.as_dvec3() + wi * (1e-3 / wi.y);
                let inside = (view.invert)(q).into_iter().all(|s| (0.0..=1.0).contains(&s));
                let ng = Vec3::NEG_Y;
                let hit =
                    SurfacePoint { p: q.as_vec3(), p_error: Vec3::ZERO, ng, ns: ng, shape: 0, triangle: NO_PRIMITIVE };
                let pdf = f64::from(sampler.pdf(&scene, view.p, wi.as_vec3(), &hit, 0));
                if inside { factor * TAU * pdf } else { 0.0 }
            };
            let p = Chi2 { domain: [[0.0, 1.0]; 2], samples: SAMPLES, sample, density }.p_value();
            assert_eq!(p > level(TEST), sound, "shear {shear}, factor {factor}: p = {p:e}");
        }
    }
    // From behind nothing is sampled.
    let scene = unit(1.0, 0.0);
    for lights in [Lights::Area, Lights::SolidAngle] {
        let sampler = LightSampler::new(&scene, lights, LightChoice::Power);
        assert!((0..100).all(|i| sampler.sample(&scene, Vec3::Y, words(TEST, i)).is_none()));
    }
}

#[test]
fn triangles_follow_their_densities() {
    const TEST: &str = "triangles";
    for scale in [1.0f32, 4e-5] {
        let mut scene = lit(vec![]);
        let [a, eb, ec] = [[-0.3, 0.0, -0.2], [0.9, 0.0, 0.1], [0.2, 0.0, 0.7]].map(|v| Vec3::from(v) * scale);
        mesh(&mut scene, &[[a, ec, eb]]);
        let (a, eb, ec) = (a.as_dvec3(), ec.as_dvec3(), eb.as_dvec3());
        let normal = eb.cross(ec);
        let views = [[0.1, 1.0, 0.2], [2.0, 1.0, 1.5], [1.5, 0.02, 0.4], [30.0, 40.0, 5.0], [0.1, 0.1, 0.05]];
        for p in views.map(Vec3::from).into_iter().filter(|p| scale == 1.0 || p.y == 1.0) {
            View {
                name: format!("triangle of size {scale}, from {p}"),
                scene: &scene,
                p: if normal.y > 0.0 { p } else { Vec3::new(p.x, -p.y, p.z) },
                // Weight of b; weight of c as part of what is left.
                point: Box::new(|[b, part]| {
                    (a + b * eb + (1.0 - b) * part * ec, normal.normalize(), normal.length() * (1.0 - b))
                }),
                invert: Box::new(|q| {
                    let (d, n2) = (q - a, normal.length_squared());
                    let b = d.cross(ec).dot(normal) / n2;
                    [b, eb.cross(d).dot(normal) / n2 / (1.0 - b)]
                }),
            }
            .check(TEST, &BOTH);
        }
    }
}

#[test]
fn spheres_follow_their_densities() {
    const TEST: &str = "spheres";
    for (radius, distance) in [(1.0f32, 3.0f32), (1.0, 1.05), (1.8e-5, 1.0), (1e-3, 50.0), (5.0, 5.5)] {
        let scene = lit(vec![Geometry::Sphere { center: Vec3::ZERO, radius, flip: false }]);
        let axis = Vec3::new(0.48, 0.6, 0.64);
        let frame = Frame::new(axis);
        let (s, t, n) = (frame.s.as_dvec3(), frame.t.as_dvec3(), frame.n.as_dvec3());
        let r = f64::from(radius);
        // Drawn by area, too few points of a near sphere are on its front to see 2 %.
        // Chord from the point below p as part of that to the horizon; turns.
        let p = distance * axis;
        let low = r / p.as_dvec3().length();
        View {
            name: format!("sphere of radius {radius} at {distance}"),
            scene: &scene,
            p,
            point: Box::new(move |[x, turn]| {
                let z = 1.0 - (1.0 - low) * x * x;
                let w = (1.0 - z * z).sqrt();
                let normal = w * (TAU * turn).cos() * s + w * (TAU * turn).sin() * t + z * n;
                (r * normal, normal, 2.0 * TAU * r * r * (1.0 - low) * x)
            }),
            invert: Box::new(move |q| {
                let turn = q.dot(t).atan2(q.dot(s)) / TAU;
                let side = q.dot(s).hypot(q.dot(t)) / q.length();
                // Near the pole from the sine, which keeps its digits.
                let height = side * side / (1.0 + (1.0 - side * side).max(0.0).sqrt());
                let height = if q.dot(n) > 0.0 { height } else { 1.0 - q.dot(n) / q.length() };
                [(height / (1.0 - low)).sqrt(), if turn < 0.0 { turn + 1.0 } else { turn }]
            }),
        }
        .check(TEST, if distance < 1.2 * radius { &BOTH[1..] } else { &BOTH });
    }
    // Close to the surface the cone is almost a hemisphere: directions instead of points.
    for (height, sound) in [(1.0, true), (0.98, false), (1.02, false)] {
        let scene = lit(vec![Geometry::Sphere { center: Vec3::ZERO, radius: 1.0, flip: false }]);
        let p = Vec3::new(0.0, 0.0, 1.0001);
        let z = f64::from(p.z);
        let cone = height * (1.0 - ((z - 1.0) * (z + 1.0)).sqrt() / z);
        let sampler = LightSampler::new(&scene, Lights::SolidAngle, LightChoice::Power);
        let sample = |i| sampler.sample(&scene, p, words(TEST, i)).map(|s| sphere_point(-s.wi));
        let hit = SurfacePoint {
            p: Vec3::Z,
            p_error: Vec3::ZERO,
            ng: Vec3::Z,
            ns: Vec3::Z,
            shape: 0,
            triangle: NO_PRIMITIVE,
        };
        let density = |_: [f64; 2]| TAU * f64::from(sampler.pdf(&scene, p, -Vec3::Z, &hit, 0));
        let p = Chi2 { domain: [[1.0 - cone, 1.0], [0.0, 1.0]], samples: SAMPLES, sample, density }.p_value();
        assert_eq!(p > level(TEST), sound, "height {height}: p = {p:e}");
    }
    // From inside and from the surface the front is out of sight; a flipped sphere is seen from everywhere within.
    for (p, flip, seen) in
        [(0.5, false, false), (1.0, false, false), (0.5, true, true), (1.0, true, true), (0.0, true, true)]
    {
        let scene = lit(vec![Geometry::Sphere { center: Vec3::ZERO, radius: 1.0, flip }]);
        for lights in [Lights::Area, Lights::SolidAngle] {
            let sampler = LightSampler::new(&scene, lights, LightChoice::Uniform);
            let drawn = (0..1000).filter_map(|i| sampler.sample(&scene, Vec3::new(0.0, 0.0, p), words(TEST, i)));
            assert_eq!(
                drawn.map(|s| assert!(s.pdf > 0.0 && s.wi.is_finite())).count() > 990,
                seen,
                "{p} {flip} {lights:?}"
            );
        }
    }
}

#[test]
fn disks_and_cylinders_follow_their_densities() {
    const TEST: &str = "disks and cylinders";
    let (u, v) = (Vec3::new(0.8, 0.1, 0.0), Vec3::new(0.2, 0.0, 0.5));
    let scene = lit(vec![Geometry::Disk { center: Vec3::new(0.1, 0.2, 0.3), u, v }]);
    let (c, u, v) = (DVec3::new(0.1, 0.2, 0.3), u.as_dvec3(), v.as_dvec3());
    let n = u.cross(v);
    let below = c + 0.9 * n.normalize() + 0.4 * u;
    let disk = View {
        name: "disk".into(),
        scene: &scene,
        p: below.as_vec3(),
        point: Box::new(move |[r, t]| {
            (c + r * (TAU * t).cos() * u + r * (TAU * t).sin() * v, n.normalize(), TAU * r * n.length())
        }),
        invert: Box::new(move |q| {
            let d = q - c;
            let (x, y) = (d.cross(v).dot(n) / n.length_squared(), u.cross(d).dot(n) / n.length_squared());
            let t = y.atan2(x) / TAU;
            [x.hypot(y), if t < 0.0 { t + 1.0 } else { t }]
        }),
    };
    disk.check(TEST, &BOTH);
    for flip in [false, true] {
        let (p0, axis, radius) = (Vec3::new(0.1, -0.4, 0.2), Vec3::new(0.3, 1.2, -0.4), 0.25f32);
        let scene = lit(vec![Geometry::Cylinder { p0, axis, radius, flip }]);
        let frame = Frame::new(axis.normalize());
        let (s, t) = (frame.s.as_dvec3(), frame.t.as_dvec3());
        let (o, a, r) = (p0.as_dvec3(), axis.as_dvec3(), f64::from(radius));
        let inside = o + 0.4 * a + 0.3 * r * s;
        let outside = o + 0.4 * a - 4.0 * r * s;
        // From outside the square holds the turns of the visible part: the density jumps at its edge.
        let first = if flip { 0.0 } else { 0.5 - 0.25f64.acos() / TAU };
        let view = View {
            name: format!("cylinder, flip {flip}"),
            scene: &scene,
            p: if flip { inside } else { outside }.as_vec3(),
            point: Box::new(move |[h, part]| {
                let turn = first + part * (1.0 - 2.0 * first);
                let n = (TAU * turn).cos() * s + (TAU * turn).sin() * t;
                let jacobian = TAU * r * a.length() * (1.0 - 2.0 * first);
                (o + h * a + r * n, if flip { -n } else { n }, jacobian)
            }),
            invert: Box::new(move |q| {
                let d = q - o;
                let turn = d.dot(t).atan2(d.dot(s)) / TAU;
                let turn = if turn < 0.0 { turn + 1.0 } else { turn };
                [d.dot(a) / a.length_squared(), (turn - first) / (1.0 - 2.0 * first)]
            }),
        };
        view.check(TEST, &BOTH);
    }
}

#[test]
fn environments_follow_their_density() {
    const TEST: &str = "environments";
    let mut scene = lit(vec![]);
    scene.lights = vec![Light::Constant { radiance: Vec3::ONE }, Light::Constant { radiance: Vec3::X }];
    assert_eq!(light::environment(&scene), Vec3::new(2.0, 1.0, 1.0));
    let sampler = LightSampler::new(&scene, Lights::Area, LightChoice::Power);
    for (factor, sound) in [(1.0, true), (0.98, false), (1.02, false)] {
        let sample = |i| {
            let s = sampler.sample(&scene, Vec3::ZERO, words(TEST, i)).unwrap();
            assert!(s.emitted == Vec3::new(2.0, 1.0, 1.0) && s.pdf == sampler.pdf_environment(s.wi));
            Some(sphere_point(s.wi))
        };
        let density = |_: [f64; 2]| factor * TAU * f64::from(sampler.pdf_environment(Vec3::Z));
        let p = Chi2 { domain: [[-1.0, 1.0], [0.0, 1.0]], samples: SAMPLES, sample, density }.p_value();
        assert_eq!(p > level(TEST), sound, "factor {factor}: p = {p:e}");
    }
    let none = LightSampler::new(&scene, Lights::None, LightChoice::Power);
    assert!(none.is_empty() && none.sample(&scene, Vec3::ZERO, [0; 4]).is_none());
    assert_eq!(none.pdf_environment(Vec3::Z), 0.0);
}

/// Several lights of all kinds: the choice follows the power, its probability is in the density, point lights stay with `None`.
#[test]
fn choices_follow_powers() {
    let sphere = Geometry::Sphere { center: Vec3::new(0.0, 3.0, 0.0), radius: 0.5, flip: false };
    let mut scene = lit(vec![rectangle(Vec3::Y, Vec3::X, Vec3::Z), sphere]);
    // Area 2 and 1; the second is seen with twice the probability by `Uniform` over area.
    let mesh_triangles = [
        [Vec3::new(0.0, -2.0, 0.0), 2.0 * Vec3::Z, 2.0 * Vec3::X],
        [Vec3::new(-5.0, -2.0, 0.0), Vec3::Z, 2.0 * Vec3::X],
    ];
    mesh(&mut scene, &mesh_triangles);
    scene.lights.push(Light::Point { position: Vec3::new(0.0, 0.0, 4.0), intensity: Vec3::splat(2.0) });
    scene.lights.push(Light::Constant { radiance: Vec3::splat(0.01) });
    scene.lights.push(Light::Area { shape: 0, radiance: Vec3::ZERO });
    let radius2 = (Vec3::new(-5.0, -2.0, -0.5).distance_squared(Vec3::new(2.0, 3.5, 2.0)) / 4.0) as f64;
    let powers = [PI, PI * PI, 3.0 * PI, 8.0 * PI, 0.04 * PI * PI * radius2];
    let total: f64 = powers.iter().sum();
    for (choice, lights) in [(LightChoice::Power, Lights::SolidAngle), (LightChoice::Uniform, Lights::Area)] {
        let sampler = LightSampler::new(&scene, lights, choice);
        let mut seen = [false; 5];
        for i in 0..2000 {
            let p = Vec3::new(0.3, 0.2, 0.3);
            let Some(s) = sampler.sample(&scene, p, words("choices", i)) else { continue };
            let exact = if choice == LightChoice::Power { powers[s.light as usize] / total } else { 0.2 };
            assert!((f64::from(s.choice_pdf) / exact - 1.0).abs() < 1e-5, "light {}", s.light);
            seen[s.light as usize] = true;
            match (s.light, s.to) {
                (0..=2, LightTarget::Point(at)) => {
                    let hit = surface(&s, s.light);
                    let primitive = u32::from(s.light == 2 && at.p.x < -1.0);
                    let pdf = sampler.pdf(&scene, p, s.wi, &hit, primitive);
                    assert!((pdf / s.pdf - 1.0).abs() < 1e-5);
                    assert_eq!(light::emitted(&scene, &hit, -s.wi), Vec3::ONE);
                    assert_eq!(light::emitted(&scene, &hit, s.wi), Vec3::ZERO);
                }
                (3, LightTarget::Point(at)) => {
                    let d2 = at.p.distance_squared(p);
                    assert!(s.delta && s.pdf == s.choice_pdf && (s.emitted.x * d2 - 2.0).abs() < 1e-5);
                }
                (4, LightTarget::Direction) => assert_eq!(s.pdf, sampler.pdf_environment(s.wi)),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(seen, [true; 5], "{choice:?}");
    }
    let sampler = LightSampler::new(&scene, Lights::None, LightChoice::Power);
    assert!((0..100).all(|i| sampler.sample(&scene, Vec3::ZERO, words("choices", i)).unwrap().light == 3));
}

/// No words and no place give a NaN; the point lies on the light.
#[test]
fn extremes_stay_finite() {
    let ends = [0, 255, 1 << 31, u32::MAX];
    for scale in [1e-12f32, 1e-5, 1.0, 1e5, 1e12] {
        let s = |v: [f32; 3]| Vec3::from(v) * scale;
        let geometries = [
            rectangle(s([0.0, 1.0, 0.0]), s([1.0, 0.0, 0.0]), s([0.0, 0.0, 1.0])),
            Geometry::Sphere { center: s([0.0, 1.0, 0.0]), radius: 0.5 * scale, flip: false },
            Geometry::Disk { center: s([0.0, 1.0, 0.0]), u: s([1.0, 0.0, 0.0]), v: s([0.0, 0.0, 1.0]) },
            Geometry::Cylinder { p0: s([0.0, 1.0, 0.0]), axis: s([0.0, 1.0, 0.0]), radius: 0.5 * scale, flip: false },
        ];
        for geometry in geometries {
            let scene = lit(vec![geometry]);
            for lights in [Lights::Area, Lights::SolidAngle] {
                let sampler = LightSampler::new(&scene, lights, LightChoice::Power);
                // Among them corners, edges, the centre, points of the plane and of the surface.
                let places = [
                    [0., 0., 0.],
                    [0., 1., 0.],
                    [1., 1., 1.],
                    [0.5, 1., 0.],
                    [2., 1., 2.],
                    [0., 1.5, 0.],
                    [1e6, 2., 3.],
                ];
                for p in places.map(s) {
                    for i in 0..256 {
                        let w = [i & 3, (i >> 2) & 3, (i >> 4) & 3, i >> 6].map(|k| ends[k as usize]);
                        let Some(x) = sampler.sample(&scene, p, w) else { continue };
                        let hit = surface(&x, 0);
                        let name = format!("{:?} {lights:?} from {p}: {x:?}", scene.shapes[0].geometry);
                        assert!(x.wi.is_normalized() && hit.p.is_finite() && x.pdf > 0.0, "{name}");
                        assert!(
                            hit.p_error.is_finite() && hit.p_error.max_element() <= 1e-5 * scale.max(hit.p.length()),
                            "{name}"
                        );
                        if let (Geometry::Rectangle { corner, edge_u, edge_v, .. }, Lights::Area) =
                            (&scene.shapes[0].geometry, lights)
                        {
                            let [s, t] = [w[0], w[1]].map(|w| f64::from(unit_f32(w)));
                            let exact = corner.as_dvec3() + s * edge_u.as_dvec3() + t * edge_v.as_dvec3();
                            assert!((hit.p.as_dvec3() - exact).abs().cmple(hit.p_error.as_dvec3()).all(), "{name}");
                        }
                        assert!(!sampler.pdf(&scene, p, x.wi, &hit, 0).is_nan(), "{name}");
                    }
                }
            }
        }
    }
}
