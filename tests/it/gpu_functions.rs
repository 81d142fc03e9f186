//! Every GLSL function on the Vulkan device beside its Rust twin, over its domain with the edges.
//!
//! What is made of sums, products and comparisons alone has the same bits everywhere. Vulkan lets quotients be off by 2.5
//! units in the last place and roots by about 3, and takes numbers below the smallest normal one for 0. The third column
//! of the tables says by how many units a function may be off. A unit is one of the largest component of the vector that a
//! number is part of, or of the numbers that it is the difference of. Where last digits of inputs count for more than that
//! (grazing cosines, small triangles far away), a row is `nudged`: a unit then is at least what the result changes by when
//! an input changes by one.

mod maps_and_cameras;
mod scenes;
mod textures;
mod twins;

use self::twins::{Answer, Case, Input, Program, Step, Words, decided, float, of, vector};
use crate::support::{no_messages, vulkan};
use rootn::math::spherical::{self, SphericalRectangle, SphericalTriangle};
use rootn::math::{Frame, Vec3, robust, special, trig, warp};
use rootn::sampling::discrete::Discrete;
use rootn::sampling::rng::{philox4x32, unit_f32};
use rootn::sampling::sequence::{permute, sobol};
use rootn::sampling::strategy::{Directions, Heuristic};
use rootn::sampling::{Draw, Key, Sequence};
use rootn::scene::material::{Coat, Distribution, Microfacets, Transmittance};
use rootn::scene::{Bsdf, Filter};

const DIRECTIONS: [Directions; 3] = [Directions::Uniform, Directions::Cosine, Directions::Bsdf];

/// Where the tables of rough coats begin, in tables of their size: after the Gaussian's quantiles.
const FIRST_TABLE: u32 = 17;

/// Tables of two coats.
fn transmittances() -> Vec<Transmittance> {
    let coat = |distribution, a, eta| Transmittance::new(&Microfacets { distribution, alpha: [a; 2] }, eta);
    vec![coat(Distribution::Ggx, 0.3, 1.5), coat(Distribution::Beckmann, 0.05, 1.33)]
}

/// The material of eighteen words.
fn material(w: &Words) -> Bsdf {
    let (reflectance, second, eta, k) = (w.v(0), w.v(4), w.f(7), w.v(8));
    let distribution = if w.w(11) == 0 { Distribution::Ggx } else { Distribution::Beckmann };
    let facets = Microfacets { distribution, alpha: w.f2(12) };
    let coat = Coat { eta, internal: w.f(16), nonlinear: w.w(15) != 0, specular_weight: w.f(17) };
    let (transmittance, specular) = (second, second);
    match w.w(3) {
        0 => Bsdf::Black,
        1 => Bsdf::Diffuse { reflectance },
        2 => Bsdf::Conductor { eta: second, k, reflectance },
        3 => Bsdf::Dielectric { eta, reflectance, transmittance },
        4 => Bsdf::ThinDielectric { eta, reflectance, transmittance },
        5 => Bsdf::Null,
        6 => Bsdf::RoughConductor { facets, eta: second, k, reflectance },
        7 => Bsdf::RoughDielectric { facets, eta, reflectance, transmittance },
        8 => Bsdf::Plastic { coat, reflectance, specular },
        _ => Bsdf::RoughPlastic { facets, coat, table: w.w(14) - FIRST_TABLE, reflectance, specular },
    }
}

/// A material, how its directions are drawn, and `wo`; two of three are rough.
fn surface(r: &mut Input) {
    let kind = if r.below(3) == 0 { r.below(6) } else { 6 + r.below(4) };
    of("r")(r);
    r.fixed(&[kind]);
    of("rfr2")(r);
    for _ in 0..2 {
        let alpha = r.size(-13, 2).clamp(1e-4, 100.0);
        r.float(alpha);
    }
    let (table, nonlinear) = (FIRST_TABLE + r.below(2), r.below(2));
    r.fixed(&[table, nonlinear]);
    of("uu3d")(r);
}

/// A surface and `wi`: anywhere, near the mirrored direction, or near the refracted one.
fn pair(r: &mut Input) {
    surface(r);
    let (wo, eta) = (r.words().v(19), r.words().f(7));
    let near = match r.below(3) {
        0 => Vec3::new(-wo.x, -wo.y, wo.z),
        1 => {
            let across = -wo.truncate() / eta;
            across.extend(-(1.0 - across.length_squared()).max(0.01).sqrt())
        }
        _ => Vec3::ZERO,
    };
    let spread = if near == Vec3::ZERO { 1.0 } else { r.size(-12, 0) };
    let wi = (near + r.sphere() * spread).normalize();
    r.vector(wi);
}

fn logarithm(r: &mut Input) {
    let x = r.size(-100, 100);
    r.float(x);
}

/// A surface and the words of a sample.
fn sampled(r: &mut Input) {
    surface(r);
    of("wwww")(r);
}

fn scattered(material: Bsdf, tables: &[Transmittance], directions: u32, wo: Vec3, words: [u32; 4]) -> Answer {
    let sample = material.sample(tables, DIRECTIONS[directions as usize], wo, words);
    decided(sample, |a, s| {
        let a = a.bits(0, &[1 + u32::from(s.wi.z < 0.0)]).bits(8, &[u32::from(s.delta)]);
        a.vector(1, s.wi).floats(4, &[s.pdf]).vector(5, s.value).floats(9, &[s.eta])
    })
}

fn filter(kind: u32, width: f32) -> Filter {
    match kind {
        0 => Filter::Box,
        1 => Filter::Tent { radius: width },
        _ => Filter::Gaussian { stddev: width },
    }
}

/// A corner, two edges and their cross product, seen from near and far, from front and back and along the plane.
fn planar(r: &mut Input) {
    let scale = r.size(-20, 20);
    let (eb, ec) = (r.sphere() * r.size(-2, 1) * scale, r.sphere() * r.size(-2, 1) * scale);
    let (aim, normal) = (r.between(-0.5, 1.5) * eb + r.between(-0.5, 1.5) * ec, eb.cross(ec));
    let (n, away) = (normal.normalize_or(Vec3::X), r.direction());
    let away = if r.below(8) == 0 { away - 0.99 * n * n.dot(away) } else { away };
    let a = -(aim + away * r.size(-4, 6) * scale);
    [a, eb, ec, normal].into_iter().for_each(|v| r.vector(v));
    of("uu")(r);
}

/// A rectangle turned towards the origin.
fn rectangular(r: &mut Input) {
    let (scale, frame) = (r.size(-20, 20), Frame::new(r.direction()));
    let (lx, ly, z) = (r.size(-2, 2) * scale, r.size(-2, 2) * scale, r.size(-4, 3) * scale);
    let a = frame.s * (r.between(-3.0, 2.0) * lx) + frame.t * (r.between(-3.0, 2.0) * ly) - frame.n * z;
    let angle = spherical::parallelogram_solid_angle(a, frame.s * lx, frame.t * ly, frame.n * (lx * ly));
    r.vector(a);
    for (axis, number) in [(frame.s, lx), (frame.t, ly), (frame.n, angle)] {
        r.vector(axis);
        r.float(number);
    }
    of("uu")(r);
}

/// A number and what it is to be clamped to.
fn clamped(r: &mut Input) {
    let (a, b) = (r.signed(-3, 3), r.signed(-3, 3));
    of("n")(r);
    r.float(a.min(b));
    r.float(a.max(b));
}

fn math(tables: &[Transmittance]) -> Vec<Case<'_>> {
    let two = |x: [f32; 2]| Answer::default().floats(0, &x);
    // Differences of numbers up to this.
    let part = |size: f32, x: &[f32]| Answer::default().sized(0, size, x);
    // Height and azimuth of a direction are precise on their own.
    let lifted = |v: Vec3| Answer::default().floats(0, &[v.x, v.y]).floats(2, &[v.z]);
    let solid_angle = spherical::triangle_solid_angle;
    let solid_angle_of_four = spherical::parallelogram_solid_angle;
    vec![
        Case::new(0, "sin_cos_eighth", 0.0, of("e"), move |w| two(trig::sin_cos_eighth(w.f(0)).into())),
        Case::new(1, "sin_cos_turns", 0.0, of("u"), move |w| two(trig::sin_cos_turns(w.f(0)).into())),
        Case::new(2, "atan2", 8.0, of("ss"), |w| float(trig::atan2(w.f(0), w.f(1)))),
        Case::new(3, "frame_to_world", 8.0, of("dv"), |w| vector(Frame::new(w.v(0)).to_world(w.v(3)))),
        Case::new(4, "frame_to_local", 8.0, of("dv"), |w| vector(Frame::new(w.v(0)).to_local(w.v(3)))),
        Case::new(5, "gamma", 4.0, of("9"), |w| float(robust::gamma(w.w(0)))),
        Case::new(6, "offset_origin", 0.0, of("pd"), |w| vector(robust::offset_origin(w.v(0), w.v(3), w.v(6), w.v(9)))),
        Case::new(7, "sample_uniform_hemisphere", 8.0, of("uu"), move |w| {
            lifted(warp::sample_uniform_hemisphere(w.f2(0)))
        }),
        Case::new(8, "uniform_hemisphere_pdf", 0.0, of(""), |_| float(warp::uniform_hemisphere_pdf())),
        Case::new(9, "sample_uniform_sphere", 8.0, of("uu"), move |w| lifted(warp::sample_uniform_sphere(w.f2(0)))),
        Case::new(10, "uniform_sphere_pdf", 0.0, of(""), |_| float(warp::uniform_sphere_pdf())),
        Case::new(11, "sample_uniform_disk", 8.0, of("uu"), move |w| two(warp::sample_uniform_disk(w.f2(0)).into())),
        Case::new(12, "uniform_disk_pdf", 0.0, of(""), |_| float(warp::uniform_disk_pdf())),
        Case::new(13, "sample_cosine_hemisphere", 8.0, of("uu"), move |w| {
            lifted(warp::sample_cosine_hemisphere(w.f2(0)))
        }),
        Case::new(14, "cosine_hemisphere_pdf", 0.0, of("n"), |w| float(warp::cosine_hemisphere_pdf(w.f(0)))),
        Case::new(15, "sample_uniform_cone", 8.0, of("uuc"), move |w| {
            lifted(warp::sample_uniform_cone(w.f2(0), w.f(2)))
        }),
        Case::new(16, "uniform_cone_pdf", 4.0, of("c"), |w| float(warp::uniform_cone_pdf(w.f(0)))),
        Case::new(17, "sample_uniform_triangle", 0.0, of("uu"), move |w| two(warp::sample_uniform_triangle(w.f2(0)))),
        Case::new(18, "uniform_triangle_pdf", 0.0, of(""), |_| float(warp::uniform_triangle_pdf())),
        Case::new(19, "sample_tent", 8.0, of("u"), move |w| part(1.0, &[warp::sample_tent(w.f(0))])),
        Case::new(20, "tent_pdf", 0.0, of("n"), |w| float(warp::tent_pdf(w.f(0)))),
        // Linear in a root, in 1024 steps.
        Case::new(21, "sample_gaussian", 16.0, of("u"), move |w| part(1.0, &[warp::sample_gaussian(w.f(0))])),
        // Dozens of quotients and roots from here on.
        Case::new(22, "triangle_solid_angle", 96.0, planar, move |w| {
            float(solid_angle(w.v(0), w.v(3), w.v(6), w.v(9)))
        })
        .nudged(),
        Case::new(23, "parallelogram_solid_angle", 96.0, planar, move |w| {
            float(solid_angle_of_four(w.v(0), w.v(3), w.v(6), w.v(9)))
        })
        .nudged(),
        Case::new(24, "spherical triangle", 128.0, planar, |w| {
            let triangle = SphericalTriangle::new(w.v(0), w.v(3), w.v(6), w.v(9));
            decided(triangle, |a, t| a.floats(1, &[t.solid_angle]).sized(2, 1.0, &t.sample(w.f2(12))))
        })
        .nudged()
        // Seen edge-on from within, the last u ends an arc of half a turn, and rounding moves the point along it.
        .hidden(),
        // Made of solid angles up to 2π, whose roundings count relative to its own.
        Case::new(25, "spherical rectangle", 192.0, rectangular, |w| {
            let (x, y) = ((w.v(3), w.f(6)), (w.v(7), w.f(10)));
            let rectangle = SphericalRectangle::new(w.v(0), x, y, w.v(11), w.f(14));
            decided(rectangle, |a, r| a.sized(1, 1.0 / w.f(14), &r.sample(w.f2(15))))
        })
        .nudged(),
        Case::new(26, "exp_neg", 8.0, of("s"), |w| float(special::exp_neg(w.f(0)))),
        Case::new(27, "ln", 8.0, logarithm, |w| float(special::ln(w.f(0)))),
        Case::new(28, "erf", 8.0, of("s"), |w| {
            Answer::default().sized(0, 0.0, &[special::erf(w.f(0)), special::erfcx(w.f(0).abs())])
        }),
        Case::new(29, "erf_inv", 8.0, of("u"), |w| float(special::erf_inv(w.f(0)))),
        Case::new(30, "material_eval", 64.0, pair, |w| {
            let e = material(w).eval(tables, DIRECTIONS[w.w(18) as usize], w.v(19), w.v(22));
            vector(e.value).floats(3, &[e.pdf])
        })
        .nudged(),
        Case::new(31, "material_sample", 64.0, sampled, |w| scattered(material(w), tables, w.w(18), w.v(19), w.w4(22)))
            .nudged(),
        Case::new(32, "dot3", 0.0, of("vv"), |w| float(w.v(0).dot(w.v(3)))),
        Case::new(33, "cross3", 0.0, of("vv"), |w| vector(w.v(0).cross(w.v(3)))),
        Case::new(34, "length3", 4.0, of("l"), |w| float(w.v(0).length())),
        Case::new(35, "normalize3", 8.0, of("l"), |w| vector(w.v(0).normalize())),
        Case::new(36, "try_normalize3", 8.0, of("h"), |w| decided(w.v(0).try_normalize(), |a, v| a.vector(1, v))),
        Case::new(37, "normalize_or3", 8.0, of("hd"), |w| vector(w.v(0).normalize_or(w.v(3)))),
        Case::new(38, "minima and maxima", 0.0, of("nnn"), |w| {
            let (a, b, v) = (w.f(0), w.f(1), w.v(0));
            let answers = [a.min(b), a.max(b), v.min_element(), v.max_element()];
            (0..4).fold(Answer::default(), |all, k| all.floats(k, &answers[k..=k]))
        }),
        Case::new(39, "clamp1", 0.0, clamped, |w| float(w.f(0).clamp(w.f(1), w.f(2)))),
        Case::new(40, "filter_sample", 16.0, of("3fuu"), move |w| {
            part(w.f(1), &filter(w.w(0), w.f(1)).sample(w.f2(2)).to_array())
        }),
    ]
}

#[test]
fn math_and_materials_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_math.spv"));
    let transmittances = transmittances();
    let mut tables = warp::gaussian_quantiles().to_vec();
    tables.resize(FIRST_TABLE as usize * 64, 0.0);
    tables.extend(transmittances.iter().flat_map(|t| (0..64).map(|i| t.at(i as f32 / 63.0))));
    let program = Program { device: &device, code, tables: bytemuck::cast_slice(&tables), addresses: &[] };
    math(&transmittances).iter().for_each(|case| case.check(&program));
    no_messages(&device);
}

/// Key, pixel, sample, length of the run, group.
fn sample(r: &mut Input) {
    const PRIMES: [u64; 8] = [2, 3, 13, 101, 1009, 65_537, 16_777_213, 4_294_967_291];
    of("www")(r);
    let word = u64::from(r.word());
    let length = match r.below(6) {
        0 => 1 << r.below(34),
        1 => r.pick(&PRIMES),
        2 => (1 << 32) + (word << r.below(24)),
        3 => r.pick(&[0, 1, u64::from(u32::MAX), u64::MAX]),
        4 => 1 + word % 10_000,
        _ => word,
    };
    let random = u64::from(r.random()) << 32 | u64::from(r.random());
    let index = match r.below(4) {
        0 => random,
        1 => r.pick(&[0, u64::from(u32::MAX), 1 << 32, u64::MAX]),
        2 => random >> 32,
        _ => random % length.max(1),
    };
    let group = if r.below(4) == 0 { r.word() >> 1 } else { r.below(64) };
    r.fixed(&[index as u32, (index >> 32) as u32, length as u32, (length >> 32) as u32, group]);
}

/// Index, length, seed.
fn permuted(r: &mut Input) {
    let length = match r.below(4) {
        0 => 1 << r.below(32),
        1 => r.pick(&[1, 3, 101, 65_537, 4_294_967_291, u32::MAX]),
        2 => 1 + r.below(1000),
        _ => r.word().max(1),
    };
    let index = r.below(length);
    r.fixed(&[index, length]);
    of("w")(r);
}

/// A heuristic and two densities, often (almost) equal, sometimes 0 or infinite.
fn densities(r: &mut Input) {
    of("5")(r);
    let mut density = || match r.below(16) {
        0 => 0.0,
        1 => f32::INFINITY,
        _ => r.size(-40, 40),
    };
    let (p, q) = (density(), density());
    let q = match r.below(4) {
        0 => p,
        1 => p * r.between(0.998, 1.002),
        2 => p * r.size(-5, 5),
        _ => q,
    };
    r.float(p);
    r.float(q);
}

#[test]
fn sampling_equals_its_twins() {
    const SEQUENCES: [Sequence; 4] =
        [Sequence::Independent, Sequence::Stratified, Sequence::LatinHypercube, Sequence::Sobol];
    const HEURISTICS: [Heuristic; 5] =
        [Heuristic::None, Heuristic::Balance, Heuristic::Power, Heuristic::Cutoff, Heuristic::Maximum];
    let Some(device) = vulkan() else { return };
    let bits = |words: &[u32]| Answer::default().bits(0, words);
    let weights = [vec![1.0], vec![1.0, 2.0, 3.0], vec![1e-30, 1.0, 1e30, 1e-30], vec![0.1; 1000]];
    let tables = weights.map(|w| Discrete::new(&w));
    let firsts = tables.each_ref().map(|t| t.thresholds());
    let offset = |table: usize| firsts[..table].iter().map(|f| f.len()).sum::<usize>() as u32;
    let choice = |r: &mut Input| {
        let table = r.below(4) as usize;
        let edge = r.pick(firsts[table]).wrapping_sub(r.below(2));
        let word = if r.below(2) == 0 { edge } else { r.word() };
        r.fixed(&[0, 0, offset(table), firsts[table].len() as u32]);
        r.put(word, Step::Word);
    };
    let chosen = |w: &Words| {
        let table = (0..4).find(|&t| offset(t) == w.w(2)).expect("a table");
        let outcome = tables[table].pick(w.w(4));
        bits(&[outcome as u32, tables[table].pmf(outcome).to_bits()])
    };
    let weight = |w: &Words| float(HEURISTICS[w.w(0) as usize].weight(w.f(1), w.f(2)));
    let mut cases = vec![
        Case::exact(0, "philox4x32", of("wwwwww"), |w| bits(&philox4x32(w.w4(0), Key([w.w(4), w.w(5)])))),
        Case::exact(1, "unit_f32", of("w"), |w| bits(&[unit_f32(w.w(0)).to_bits()])),
        Case::exact(2, "permute", permuted, |w| bits(&[permute(w.w(0), w.w(1), w.w(2))])),
        Case::exact(7, "sobol", of("w"), |w| bits(&sobol(w.w(0)))),
        Case::exact(8, "discrete", choice, chosen),
        Case::new(9, "heuristic_weight", 12.0, densities, weight),
    ];
    for (number, sequence) in (3..).zip(SEQUENCES) {
        cases.push(Case::exact(number, &format!("{sequence:?}"), sample, move |w| {
            let (key, pixel) = (Key([w.w(0), w.w(1)]), w.w(2));
            bits(&Draw { key, pixel, sample: w.w64(3), length: w.w64(5), sequence }.words(w.w(7)))
        }));
    }
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_sampling.spv"));
    let program = Program { device: &device, code, tables: &firsts.concat(), addresses: &[] };
    cases.iter().for_each(|case| case.check(&program));
    no_messages(&device);
}
