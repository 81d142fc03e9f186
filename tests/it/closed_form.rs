//! Scenes whose radiance is known in closed form, for every preset, heuristic and way of light sampling.
//!
//! Samples are added until the relative standard error is at most 0.1 %; the mean must then lie within four standard
//! errors of the formula. A cell that does not is measured once more, with other random numbers and four times the
//! samples: chance alone then fails with the square of its probability, a wrong renderer as before. Where an estimator has
//! no variance at all, rounding is what is left. All scenes are grey.

use crate::support::{level, seed};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimate, Estimator};
use rootn::math::Vec3;
use rootn::moments::Moments;
use rootn::record::Dependence;
use rootn::sampling::Sequence;
use rootn::sampling::rng::{Key, Role};
use rootn::sampling::strategy::{Heuristic, LightChoice, Lights, Preset, Strategy};
use rootn::scene::light::Beam;
use rootn::scene::{Bsdf, Camera, EnvironmentMap, Geometry, Light, Material, Scene, Shape, Triangle};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

/// Largest relative standard error.
const PRECISION: f64 = 1e-3;
/// Standard errors that the mean may be away from the formula.
const SIGMAS: f64 = 4.0;
/// What rounding in f32 may add, relative.
const ROUNDING: f64 = 1e-6;
/// Pixels per side of the film; all see the same radiance.
const FILM: u32 = 8;
/// Samples per pixel after which a cell has failed to reach its precision.
const MOST: u64 = 1 << 22;

/// A scene and the radiance that every pixel sees.
struct Form {
    name: String,
    scene: Scene,
    exact: f64,
    /// False where uniform directions have infinite variance: each bounce multiplies the throughput by 2ρ cos θ, the mean
    /// of whose square is 4ρ²/3, and paths are unbounded.
    uniform: bool,
}

/// Scene under construction. Material 1 has albedo `rho`.
struct Builder(Scene);

fn scene(rho: f32, depth: Option<u32>, roulette: u32) -> Builder {
    let materials = vec![Material::BLACK, Bsdf::Diffuse { reflectance: Vec3::splat(rho) }.into()];
    let mut scene = Scene { materials, ..Scene::default() };
    scene.depth.max = depth;
    scene.depth.roulette = roulette;
    scene.film.size = [FILM; 2];
    scene.film.crop_size = [FILM; 2];
    Builder(scene)
}

impl Builder {
    /// A surface whose front has a material and emits.
    fn add(mut self, geometry: Geometry, front: u32, radiance: f32) -> Self {
        let s = &mut self.0;
        let shape = s.shapes.len() as u32;
        let light = (radiance > 0.0).then_some(s.lights.len() as u32);
        if light.is_some() {
            s.lights.push(Light::Area { shape, radiance: Vec3::splat(radiance) });
        }
        s.shapes.push(Shape { geometry, front, back: 0, light, axes: Default::default(), name: String::new() });
        self
    }

    /// Triangles of the next shape.
    fn triangles(&mut self, triangles: &[[Vec3; 3]]) -> std::ops::Range<u32> {
        let s = &mut self.0;
        let start = s.triangles.len() as u32;
        for corners in triangles {
            let v = s.positions.len() as u32;
            s.positions.extend(corners);
            s.normals.extend([Vec3::ZERO; 3]);
            s.triangles.push(Triangle { vertices: [v, v + 1, v + 2], shape: s.shapes.len() as u32 });
        }
        start..s.triangles.len() as u32
    }

    fn rectangle(mut self, corner: Vec3, edge_u: Vec3, edge_v: Vec3, front: u32, radiance: f32) -> Self {
        let [a, b, c, d] = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
        let range = self.triangles(&[[a, b, c], [a, c, d]]);
        self.add(Geometry::Rectangle { range, corner, edge_u, edge_v }, front, radiance)
    }

    /// A planar polygon as a fan of triangles, emitting on the side from which it runs counter-clockwise.
    fn polygon(mut self, corners: &[Vec3], radiance: f32) -> Self {
        let fan: Vec<[Vec3; 3]> = corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]).collect();
        let range = self.triangles(&fan);
        self.add(Geometry::Mesh { range, smooth: false, uvs: false }, 0, radiance)
    }

    /// An environment map whose y axis is the scene's.
    fn map(mut self, width: u32, texels: &[Vec3]) -> Self {
        let map = EnvironmentMap::new(width, texels.to_vec(), [Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
        self.0.environment_map = Some(Arc::new(map));
        self.light(Light::EnvironmentMap)
    }

    fn light(mut self, light: Light) -> Self {
        self.0.lights.push(light);
        self
    }

    /// All pixels look along one ray. The film has almost no extent: less than an ulp of the direction.
    fn look(mut self, origin: Vec3, at: Vec3) -> Self {
        let corner = at - origin;
        let (a, b) = corner.normalize().any_orthonormal_pair();
        self.0.camera = Camera { origin, corner, across: a * 1e-20, down: b * 1e-20, ..Camera::default() };
        self
    }

    fn form(self, name: impl Into<String>, exact: f64) -> Form {
        Form { name: name.into(), scene: self.0, exact, uniform: true }
    }
}

fn sphere(center: Vec3, radius: f32, flip: bool) -> Geometry {
    Geometry::Sphere { center, radius, flip }
}

/// A disk that faces down.
fn disk_down(center: Vec3, radius: f32) -> Geometry {
    Geometry::Disk { center, u: Vec3::X * radius, v: Vec3::Z * radius }
}

/// A floor y = 0 of albedo `rho`, seen at the origin; light scattered once.
fn floor(rho: f32) -> Builder {
    let floor = Geometry::Disk { center: Vec3::new(1.0, 0.0, -0.5), u: Vec3::X * 9.0, v: Vec3::Z * -9.0 };
    scene(rho, Some(2), u32::MAX).add(floor, 1, 0.0).look(Vec3::new(3.0, 0.4, 2.0), Vec3::ZERO)
}

/// Inside of a closed emitting sphere: L = Le(1−ρᵏ)/(1−ρ) with paths of at most k edges, Le/(1−ρ) unbounded.
/// Geometric series of the rendering equation; pbrt `integrators_test.cpp`.
fn furnace(rho: f32, depth: Option<u32>, roulette: u32) -> Form {
    let (le, r) = (0.25f32, f64::from(rho));
    let sum = (1.0 - depth.map_or(0.0, |k| r.powi(k as i32))) / (1.0 - r);
    let mut b = scene(rho, depth, roulette).add(sphere(Vec3::new(0.5, -1.0, 2.0), 3.0, true), 1, le);
    b.0.camera.origin = Vec3::new(1.0, -0.5, 1.0);
    let length = depth.map_or("unbounded".to_owned(), |k| format!("depth {k}"));
    let form = b.form(format!("furnace rho {rho}, {length}"), f64::from(le) * sum);
    Form { uniform: depth.is_some() || 4.0 * r * r < 3.0, ..form }
}

/// A point light in a sphere: L(x) = (ρ/π)[E₀(x) + (I/R²)ρ/(1−ρ)], E₀ = I cos θ/d²: the indirect part is uniform.
/// Labsphere, integrating sphere theory; for a light at the centre this is (ρ/π)(I/R²)/(1−ρ).
fn point_in_sphere(name: &str, rho: f32, depth: Option<u32>, position: Vec3) -> Form {
    let (radius, intensity) = (2.0f32, 3.0f32);
    let x = Vec3::new(2.0, -1.0, 2.0).normalize() * radius;
    let to = (position - x).as_dvec3();
    let normal = -x.as_dvec3().normalize();
    let (r, i, radius2) = (f64::from(rho), f64::from(intensity), f64::from(radius * radius));
    let direct = i * normal.dot(to) / to.length().powi(3);
    let bounces = depth.map_or(0.0, |k| r.powi(k as i32 - 2));
    let exact = r / PI * (direct + i / radius2 * r * (1.0 - bounces) / (1.0 - r));
    let light = Light::Point { position, intensity: Vec3::splat(intensity) };
    let b = scene(rho, depth, 3).add(sphere(Vec3::ZERO, radius, true), 1, 0.0).light(light);
    b.look(Vec3::new(-0.3, 0.2, 0.5), x).form(name, exact)
}

/// Two concentric spheres, emission E and albedo ρ each: J₁ = E₁ + ρ₁J₂, J₂ = E₂ + ρ₂(F₂₁J₁ + (1−F₂₁)J₂) with
/// F₂₁ = (r₁/r₂)². Radiosity, with the configuration factor of Howell's catalog (concentric spheres).
fn concentric(inner: bool) -> Form {
    let ([r1, r2], [rho1, rho2], [e1, e2]) = ([1.0f32, 2.0], [0.6f32, 0.8], [1.0f32, 0.2]);
    let f = f64::from(r1 * r1) / f64::from(r2 * r2);
    let [p1, p2, e1_, e2_] = [rho1, rho2, e1, e2].map(f64::from);
    let j2 = (e2_ + p2 * f * e1_) / (1.0 - p2 * (f * p1 + 1.0 - f));
    let j1 = e1_ + p1 * j2;
    let mut b = scene(rho1, None, 4);
    b.0.materials.push(Bsdf::Diffuse { reflectance: Vec3::splat(rho2) }.into());
    let b = b.add(sphere(Vec3::ZERO, r1, false), 1, e1).add(sphere(Vec3::ZERO, r2, true), 2, e2);
    let from = Vec3::new(0.0, 1.5, 0.1);
    let at = if inner { Vec3::new(0.1, 0.1, 0.1) } else { Vec3::new(1.0, 2.0, -0.5) };
    let (which, exact) = if inner { ("inner", j1) } else { ("outer", j2) };
    b.look(from, at).form(format!("concentric spheres, {which}"), exact)
}

/// Floor under a parallel disk, its centre over a point at distance a: F = ½[1 − (1+H²−R²)/√(Z²−4R²)], H = h/a, R = r/a,
/// Z = 1+H²+R²; coaxial r²/(r²+h²). L = ρ Le F. Howell's catalog B-13, B-12.
fn disk(offset: f32) -> Form {
    let (rho, le, radius, h) = (0.7f32, 2.0f32, 1.5f32, 0.75f32);
    let [a, r, height] = [offset, radius, h].map(f64::from);
    let factor = if offset == 0.0 {
        r * r / (r * r + height * height)
    } else {
        let (h, r) = (height / a, r / a);
        let z = 1.0 + h * h + r * r;
        0.5 * (1.0 - (1.0 + h * h - r * r) / (z * z - 4.0 * r * r).sqrt())
    };
    let b = floor(rho).add(disk_down(Vec3::new(-offset, h, 0.0), radius), 0, le);
    b.form(format!("floor under disk, offset {offset}"), f64::from(rho) * f64::from(le) * factor)
}

const SPHERE: (Vec3, f32) = (Vec3::new(-0.5, 1.75, 0.25), 1.0);

/// ρ Le (r/d)² cos θ below a sphere that is above the horizon. Howell's catalog.
fn sphere_factor() -> f64 {
    let d = SPHERE.0.as_dvec3();
    f64::from(SPHERE.1).powi(2) / d.length_squared() * d.y / d.length()
}

/// Fraction of the cosine-weighted hemisphere over the origin (normal y) that a polygon above the horizon covers:
/// (1/2π)|Σ γᵢ n·(vᵢ×vᵢ₊₁)/|vᵢ×vᵢ₊₁||, γᵢ the angle between vᵢ and vᵢ₊₁. Lambert 1760; Stark, UUCS-00-012.
fn polygon_factor(corners: &[Vec3]) -> f64 {
    let edge = |i: usize| {
        let (a, b) = (corners[i].as_dvec3(), corners[(i + 1) % corners.len()].as_dvec3());
        a.angle_between(b) * a.cross(b).normalize().y
    };
    ((0..corners.len()).map(edge).sum::<f64>() / (2.0 * PI)).abs()
}

/// Point under the corner of a parallel rectangle a × b at height h:
/// F = (1/2π)[A/√(1+A²)·atan(B/√(1+A²)) + B/√(1+B²)·atan(A/√(1+B²))], A = a/h, B = b/h. Howell's catalog B-4.
fn corner_factor(a: f64, b: f64, h: f64) -> f64 {
    let (a, b) = (a / h, b / h);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI)
}

fn polygons() -> Vec<Form> {
    let (rho, le) = (0.7f32, 2.0f32);
    let scale = f64::from(rho) * f64::from(le);
    // Tilted: both edges climb. The order makes it face the floor.
    let (corner, u, v) = (Vec3::new(-1.0, 0.5, -1.0), Vec3::new(2.5, 0.5, 0.25), Vec3::new(0.25, 0.75, 2.0));
    let quad = [corner, corner + u, corner + u + v, corner + v];
    let triangle = [Vec3::new(-1.5, 0.75, -1.0), Vec3::new(1.25, 0.5, -1.5), Vec3::new(0.25, 1.0, 1.75)];
    let pentagon = [[-1.0, -1.0], [1.0, -1.25], [1.5, 0.5], [0.25, 1.5], [-1.25, 0.75]];
    let pentagon = pentagon.map(|[x, z]| Vec3::new(x, 0.75, z));
    let (a, b, h) = (1.5f32, 1.25f32, 0.5f32);
    let point = Vec3::new(1.5, 2.0, -1.0);
    let many = rho / std::f32::consts::PI * 5.0 * point.y / point.length().powi(3);
    vec![
        floor(rho).rectangle(corner, u, v, 0, le).form("floor under tilted quad", scale * polygon_factor(&quad)),
        floor(rho).polygon(&triangle, le).form("floor under triangle", scale * polygon_factor(&triangle)),
        floor(rho).polygon(&pentagon, le).form("floor under pentagon mesh", scale * polygon_factor(&pentagon)),
        floor(rho)
            .rectangle(Vec3::Y * h, Vec3::X * a, Vec3::Z * b, 0, le)
            .form("rectangle, corner above", scale * corner_factor(a.into(), b.into(), h.into())),
        // Lights of several kinds add up: choosing among them, by power or evenly, must not show.
        floor(rho)
            .add(sphere(SPHERE.0, SPHERE.1, false), 0, le)
            .polygon(&[Vec3::new(1.0, 0.5, -1.0), Vec3::new(1.5, 0.5, 0.5), Vec3::new(1.0, 1.75, 0.5)], 3.0 * le)
            .light(Light::Point { position: point, intensity: Vec3::splat(5.0) })
            .form("sphere, triangle and point", 0.0)
            .with(
                scale * sphere_factor()
                    + 3.0
                        * scale
                        * polygon_factor(&[
                            Vec3::new(1.0, 0.5, -1.0),
                            Vec3::new(1.5, 0.5, 0.5),
                            Vec3::new(1.0, 1.75, 0.5),
                        ])
                    + f64::from(many),
            ),
    ]
}

impl Form {
    fn with(self, exact: f64) -> Self {
        Self { exact, ..self }
    }
}

/// A convex object in constant light: ρL₀ everywhere, as nothing shadows it (rendering equation; mitsuba2 issue 82).
fn convex(name: &str, geometry: Geometry, at: Vec3) -> Form {
    let (rho, l0) = (0.5f32, 0.8f32);
    let mut b = scene(rho, Some(3), u32::MAX).add(geometry, 1, 0.0);
    // A map that is white everywhere is no different.
    b = match name.contains("map") {
        true => b.map(5, &[Vec3::splat(l0); 20]),
        false => b.light(Light::Constant { radiance: Vec3::splat(l0) }),
    };
    b.look(Vec3::new(1.0, 4.0, 2.0), at).form(name, f64::from(rho) * f64::from(l0))
}

/// White surfaces that light each other in a white map, with every path followed: L₀ everywhere.
fn white_furnace() -> Form {
    let l0 = 0.8f32;
    let b = scene(1.0, None, u32::MAX)
        .add(sphere(Vec3::new(0.0, 1.0, 0.0), 1.0, false), 1, 0.0)
        .add(sphere(Vec3::new(1.5, 0.75, 0.5), 0.5, false), 1, 0.0)
        .map(5, &[Vec3::splat(l0); 20]);
    let form = b.look(Vec3::new(1.0, 4.0, 2.0), Vec3::new(0.8, 1.2, 0.55)).form("white furnace in a map", l0.into());
    Form { uniform: false, ..form }
}

/// A floor under lights that are far away or narrow: L = (ρ/π)E, with the irradiance E cos θ of a directional light, I cos θ/d²
/// on the axis of a spot light, and the integral of a map's radiance times cos θ.
fn far_or_narrow() -> Vec<Form> {
    let (rho, strength) = (0.7f32, 3.0f32);
    let (r, e) = (f64::from(rho), f64::from(strength));
    let direction = Vec3::new(0.3, -0.8, 0.5).normalize();
    let directional = Light::Directional { direction, irradiance: Vec3::splat(strength) };
    let position = Vec3::new(0.6, 1.5, -0.4);
    let beam = Beam { axis: -position.normalize(), cutoff: 0.2, width: 0.1 };
    let spot = Light::Spot { position, intensity: Vec3::splat(strength), beam };
    let at = f64::from(position.y) / f64::from(position.length()).powi(3);
    // Bright at one side above the horizon, dark below it, and without the symmetry of its grid.
    let (width, rows) = (7, 6);
    let texel = |i: u32| if i == 17 { 20.0 } else { [0.0, 1.0, 0.25, 2.0][(i % 4) as usize] };
    let texels: Vec<Vec3> = (0..width * rows).map(|i| Vec3::splat(texel(i))).collect();
    vec![
        floor(rho).light(directional).form("directional light", r / PI * e * -f64::from(direction.y)),
        floor(rho).light(spot).form("spot light on its axis", r / PI * e * at),
        floor(rho).map(width, &texels).form("environment map", r / PI * crate::emitters::irradiance(width, &texels)),
    ]
}

fn forms() -> Vec<Form> {
    let rhos = [0.5, 0.9, 0.99];
    let mut forms: Vec<Form> = rhos.map(|rho| furnace(rho, Some(4), u32::MAX)).into();
    // Late roulette where paths are long: it still ends them, and 0.1 % stays affordable.
    forms.extend([(0.5, 1), (0.9, 30), (0.99, 500)].map(|(rho, roulette)| furnace(rho, None, roulette)));
    forms.push(point_in_sphere("point at centre, depth 5", 0.5, Some(5), Vec3::ZERO));
    forms.push(point_in_sphere("point at centre", 0.5, None, Vec3::ZERO));
    forms.push(point_in_sphere("point in sphere", 0.6, None, Vec3::new(-0.5, 0.9, 0.4)));
    forms.extend([true, false].map(concentric));
    forms.extend([0.0, 1.0].map(disk));
    let (rho, le) = (0.7f32, 2.0f32);
    let under = floor(rho).add(sphere(SPHERE.0, SPHERE.1, false), 0, le);
    forms.push(under.form("floor under sphere", f64::from(rho) * f64::from(le) * sphere_factor()));
    forms.extend(polygons());
    let ball = sphere(Vec3::new(0.25, 0.5, -0.5), 1.5, false);
    forms.push(convex("ball in constant light", ball, Vec3::new(0.5, 0.75, 0.0)));
    let plate = Geometry::Disk { center: Vec3::ZERO, u: Vec3::X * 2.0, v: Vec3::Z * -3.0 };
    forms.push(convex(
        "ball in a white map",
        sphere(Vec3::new(0.25, 0.5, -0.5), 1.5, false),
        Vec3::new(0.5, 0.75, 0.0),
    ));
    forms.push(white_furnace());
    forms.extend(far_or_narrow());
    forms.push(convex("plate in constant light", plate, Vec3::new(0.5, 0.0, 0.25)));
    forms
}

/// All presets; `mis` with every other heuristic, light sampling, choice and sequence.
fn strategies() -> Vec<(String, Strategy)> {
    let mis = Preset::Mis.strategy();
    let mut all: Vec<(String, Strategy)> = Preset::ALL.iter().map(|p| (p.label().to_owned(), p.strategy())).collect();
    for heuristic in [Heuristic::Balance, Heuristic::Cutoff, Heuristic::Maximum] {
        all.push((format!("mis {heuristic:?}").to_lowercase(), Strategy { heuristic, ..mis }));
    }
    all.push(("mis solid-angle".into(), Strategy { lights: Lights::SolidAngle, ..mis }));
    all.push(("light solid-angle".into(), Strategy { lights: Lights::SolidAngle, ..Preset::Light.strategy() }));
    all.push(("mis even choice".into(), Strategy { light_choice: LightChoice::Uniform, ..mis }));
    all.push(("mis hypercube".into(), Strategy { sequence: Sequence::LatinHypercube, ..mis }));
    all
}

/// An estimate of the radiance.
struct Mean {
    mean: f64,
    std_error: f64,
    samples: u64,
}

impl Mean {
    /// Whether the formula lies within [`SIGMAS`] standard errors.
    fn agrees(&self, exact: f64) -> bool {
        (self.mean - exact).abs() <= SIGMAS * self.std_error + ROUNDING * exact
    }
}

/// Samples until the relative standard error is at most `precision`. `role` chooses the random numbers.
fn measure(estimator: &dyn Estimator, precision: f64, role: Role) -> Mean {
    let key = Key::new(seed("closed forms"), role, &estimator.identity(), 0);
    let mut previous: Option<Estimate> = None;
    let mut spp = 64;
    loop {
        let mut kept = previous.take().filter(|_| estimator.progressive());
        let estimate = estimator.estimate(&Cell { key, length: spp }, spp, &mut kept).unwrap();
        let mean = mean(&estimate, estimator.dependence());
        let relative = mean.std_error / mean.mean;
        if relative <= precision {
            return mean;
        }
        assert!(spp < MOST, "relative standard error {relative:e} after {spp} samples per pixel");
        // The variance's own noise: a tenth more than it says, and not more than eightfold at once.
        let growth = (1.1 * (relative / precision).powi(2)).clamp(1.1, 8.0);
        spp = MOST.min((spp as f64 * growth) as u64);
        previous = Some(estimate);
    }
}

/// Mean over pixels; its standard error from all samples where they are independent, else from the pixels.
fn mean(estimate: &Estimate, dependence: Dependence) -> Mean {
    let moments = estimate.moments.as_ref().unwrap().fold();
    assert!(moments.iter().all(|m| m.non_finite == 0));
    assert!(estimate.field.chunks(3).all(|c| c[0] == c[1] && c[1] == c[2]), "a grey scene has colours");
    let grey = moments.iter().step_by(3);
    let all = grey.clone().fold(Moments::default(), |all, m| all.merge(m));
    let spread: Moments = match dependence {
        Dependence::Independent => all,
        _ => grey.map(|m| m.mean).collect(),
    };
    let std_error = (spread.sample_variance().unwrap() / spread.n as f64).sqrt();
    Mean { mean: all.mean, std_error, samples: all.n }
}

#[test]
fn every_strategy_gives_the_closed_form() {
    let chance = 2.0 * StudentsT::new(0.0, 1.0, f64::from(FILM * FILM - 1)).unwrap().sf(SIGMAS);
    assert!(chance * chance < level("closed forms"));
    println!(
        "scene                          strategy              exact         mean  rel. error  std errors    samples  seconds"
    );
    let mut failures = Vec::new();
    for form in forms() {
        let scene = Arc::new(PreparedScene::new(form.scene.clone()).unwrap());
        // The variants differ from presets at one vertex; long paths would only repeat it.
        let strategies = strategies().into_iter().take(if form.scene.depth.max.is_some() { usize::MAX } else { 7 });
        for (name, strategy) in strategies {
            if name == "uniform" && !form.uniform {
                println!("{:30} {name:17} left out: infinite variance", form.name);
                continue;
            }
            let start = Instant::now();
            let estimator = CpuEstimator::new(scene.clone(), strategy);
            let mut m = measure(&estimator, PRECISION, Role::Run);
            if !m.agrees(form.exact) {
                println!("{:30} {name:17} once more: {} ± {}", form.name, m.mean, m.std_error);
                m = measure(&estimator, 0.5 * (m.std_error / m.mean), Role::Reference);
            }
            let line = format!(
                "{:30} {name:17} {:10.7} {:12.7} {:11.1e} {:11.2} {:10} {:8.2}",
                form.name,
                form.exact,
                m.mean,
                m.mean / form.exact - 1.0,
                (m.mean - form.exact) / m.std_error,
                m.samples,
                start.elapsed().as_secs_f64()
            );
            println!("{line}");
            if !m.agrees(form.exact) {
                failures.push(line);
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// The same on a Vulkan device, for a furnace, a point light, a polygonal light and an environment.
#[cfg(feature = "vulkan")]
#[test]
fn the_device_gives_the_closed_form() {
    use rootn::estimator::vulkan::{DeviceScene, Tuning, VulkanEstimator};
    let Some(device) = crate::support::vulkan() else { return };
    let wanted =
        ["furnace rho 0.5, depth 4", "point at centre, depth 5", "floor under sphere", "ball in constant light"];
    let forms: Vec<Form> = forms().into_iter().filter(|f| wanted.contains(&f.name.as_str())).collect();
    assert_eq!(forms.len(), wanted.len());
    for form in forms {
        let prepared = Arc::new(PreparedScene::new(form.scene).unwrap());
        let scene = Arc::new(DeviceScene::new(&device, prepared).unwrap());
        for preset in [Preset::Cosine, Preset::Mis, Preset::Sobol] {
            let estimator = VulkanEstimator::new(Arc::clone(&scene), preset.strategy(), Tuning::default()).unwrap();
            let mut m = measure(&estimator, PRECISION, Role::Run);
            if !m.agrees(form.exact) {
                m = measure(&estimator, 0.5 * (m.std_error / m.mean), Role::Reference);
            }
            println!("{:30} {:8} {:10.7} {:12.7} ± {:.1e}", form.name, preset.label(), form.exact, m.mean, m.std_error);
            assert!(m.agrees(form.exact), "{}, {}: {} ± {}", form.name, preset.label(), m.mean, m.std_error);
        }
    }
    crate::support::no_messages(&device);
}

/// In a furnace with roulette from the first bounce a path survives each bounce with probability ρ and throughput 1: X = Le·K,
/// K geometric. Not only the mean is known, the variance is too: Le²ρ/(1−ρ)². Roulette that keeps white paths too seldom has
/// the same mean and infinite variance.
#[test]
fn roulette_in_white_surroundings_has_the_variance_it_should() {
    let form = furnace(0.99, None, 1);
    let scene = Arc::new(PreparedScene::new(form.scene).unwrap());
    let estimator = CpuEstimator::new(scene, Preset::Cosine.strategy());
    let key = Key::new(seed("closed forms"), Role::Run, "roulette", 0);
    let (spp, rho) = (1024, f64::from(0.99f32));
    let estimate = estimator.estimate(&Cell { key, length: spp }, spp, &mut None).unwrap();
    let all = estimate.moments.unwrap().fold().into_iter().step_by(3).fold(Moments::default(), |a, m| a.merge(&m));
    let exact = rho * form.exact * form.exact;
    let n = all.n as f64;
    let variance = all.sample_variance().unwrap();
    // Fourth central moment of a geometric distribution over its variance squared: 9 + (1−ρ)²/ρ.
    let std_error = ((8.0 + (1.0 - rho).powi(2) / rho) / n).sqrt() * exact;
    println!(
        "variance {variance} ± {std_error}, exact {exact}; mean {} ± {}, exact {}",
        all.mean,
        (exact / n).sqrt(),
        form.exact
    );
    assert!((variance - exact).abs() < SIGMAS * std_error, "variance {variance} ± {std_error}, exact {exact}");
    assert!((all.mean - form.exact).abs() < SIGMAS * (exact / n).sqrt());
}

/// Half a percent of albedo, more or less, is seen in every scene of short paths (long ones multiply it).
#[test]
fn half_a_percent_of_albedo_is_rejected() {
    for form in forms().into_iter().filter(|f| f.scene.depth.max.is_some()) {
        for factor in [0.995, 1.005] {
            let mut scene = form.scene.clone();
            for material in &mut scene.materials {
                if let Some(Bsdf::Diffuse { reflectance }) = material.plain() {
                    *material = Bsdf::Diffuse { reflectance: (reflectance * factor).min(Vec3::ONE) }.into();
                }
            }
            let scene = Arc::new(PreparedScene::new(scene).unwrap());
            let estimator = CpuEstimator::new(scene, Preset::Mis.strategy());
            let m = measure(&estimator, 0.7 * PRECISION, Role::Run);
            assert!(!m.agrees(form.exact), "{}, albedo × {factor}: {} ± {}", form.name, m.mean, m.std_error);
        }
    }
}
