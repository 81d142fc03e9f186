//! Textures and parameterizations. Figures marked so come from Mitsuba 3.9.1 (scalar_rgb).

mod numbers;

use self::numbers::PARAMETERIZATIONS;
use rootn::accel::NO_PRIMITIVE;
use rootn::accel::brute::Brute;
use rootn::accel::{Intersect, Ray};
use rootn::math::{Rgb, Vec2, Vec3};
use rootn::scene::format::Options;
use rootn::scene::format::mitsuba::parse_str;
use rootn::scene::texture::{Bitmap, Input, Lookup, TextureFilter, UvTransform, Wrap};
use rootn::scene::{Scene, Texture};
use std::path::Path;

const FILTERS: [TextureFilter; 2] = [TextureFilter::Nearest, TextureFilter::Bilinear];
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

fn at(u: f32, v: f32) -> Lookup {
    Lookup { uv: Vec2::new(u, v), triangle: NO_PRIMITIVE, barycentrics: Vec2::ZERO }
}

fn bitmap(size: [u32; 2], filter: TextureFilter, wrap: Wrap) -> Texture {
    Texture::Bitmap(Bitmap { first: 0, size, filter, wrap, to_uv: UvTransform::IDENTITY })
}

/// Three columns, two rows, each wrap and filter, inside, at edges and outside. Expected: Mitsuba.
#[test]
fn wraps_and_filters() {
    let texels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.9].map(Rgb::splat).to_vec();
    let scene = Scene { texels, ..Scene::default() };
    let points = [(0.1, 0.1), (0.5, 0.5), (0.9, 0.8), (-0.1, 0.3), (1.1, 1.2), (2.3, -1.4), (-3.7, 5.6)];
    let expected = [
        [0.1, 0.5, 0.9, 0.3, 0.1, 0.4, 0.4],
        [0.1, 0.5, 0.9, 0.1, 0.9, 0.4, 0.1],
        [0.1, 0.5, 0.9, 0.1, 0.9, 0.3, 0.4],
        [0.248, 0.35, 0.746, 0.314, 0.176, 0.35, 0.35],
        [0.1, 0.35, 0.9, 0.13, 0.9, 0.35, 0.23],
        [0.1, 0.35, 0.9, 0.13, 0.9, 0.3, 0.4],
    ];
    let kinds = FILTERS.into_iter().flat_map(|f| WRAPS.map(|w| (f, w)));
    for ((filter, wrap), expected) in kinds.zip(expected) {
        for ((u, v), expected) in points.into_iter().zip(expected) {
            let found = bitmap([3, 2], filter, wrap).eval(&scene, &at(u, v));
            assert!((found - expected).abs().max_element() < 2e-6, "{filter:?} {wrap:?} ({u}, {v}): {found}");
        }
    }
}

/// Any coordinate gives a colour between the smallest and the largest texel: nothing outside the picture is read.
#[test]
fn coordinates_of_any_size() {
    let far = Rgb::splat(1e9);
    for size in [[1, 1], [1, 5], [2, 1], [3, 2], [16_384, 1], [1, 16_384]] {
        let count = (size[0] * size[1]) as usize;
        let texels = [vec![far; 3], vec![Rgb::ONE; count], vec![far; 3]].concat();
        let scene = Scene { texels, ..Scene::default() };
        for (filter, wrap) in FILTERS.into_iter().flat_map(|f| WRAPS.map(|w| (f, w))) {
            let Texture::Bitmap(bitmap) = bitmap(size, filter, wrap) else { unreachable!() };
            let texture = Texture::Bitmap(Bitmap { first: 3, ..bitmap });
            let mut edges = vec![0.0, 1e6, 1e6 + 0.5, 16_777_216.0, 1e10, 1e38, f32::MAX, f32::INFINITY, f32::NAN];
            edges.extend([0.5f32, 1.0, 2.0, 3.0, 4.0, 7.0].into_iter().flat_map(|x| [x.next_down(), x, x.next_up()]));
            edges.extend([f32::MIN_POSITIVE, 1e-45, 1e-10, 1e-7]);
            for (&u, &v) in edges.iter().flat_map(|u| edges.iter().map(move |v| (u, v))) {
                for (u, v) in [(u, v), (-u, v), (u, -v), (-u, -v)] {
                    let found = texture.eval(&scene, &at(u, v));
                    assert!(
                        (found - 1.0).abs().max_element() < 1e-6,
                        "{size:?} {filter:?} {wrap:?} ({u}, {v}): {found}"
                    );
                }
            }
        }
    }
}

/// Expected: Mitsuba.
#[test]
fn checkerboards() {
    let scene = Scene { texels: vec![Rgb::splat(0.7), Rgb::splat(0.1)], ..Scene::default() };
    let board = Texture::Checkerboard { first: 0, to_uv: UvTransform::IDENTITY };
    for (u, v, first) in [
        (0.1, 0.1, true),
        (0.6, 0.1, false),
        (0.1, 0.6, false),
        (0.6, 0.6, true),
        (0.5, 0.1, true),
        (0.5, 0.5, true),
        (-0.1, 0.1, false),
        (1.1, 0.7, false),
        (f32::NAN, f32::INFINITY, true),
    ] {
        let found = board.eval(&scene, &at(u, v));
        assert_eq!(found, Rgb::splat(if first { 0.7 } else { 0.1 }), "({u}, {v})");
    }
    assert_eq!(Input::Value(Rgb::X).eval(&scene, &at(0.0, 0.0)), Rgb::X);
}

/// The parameterization of the point that a ray of a scene with one shape meets.
fn met(shape: &str, origin: Vec3, direction: Vec3) -> [Vec3; 3] {
    let text = format!("<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{shape}</scene>");
    let scene = parse_str(&text, Path::new("scene.xml"), &Options::default()).unwrap();
    let ray = Ray::new(origin, direction, f32::INFINITY);
    let hit = Brute::new(&scene).unwrap().closest(&ray).expect(shape);
    let found = scene.parameterization(&hit, &scene.surface_point(&ray, &hit));
    [found.uv.extend(0.0), found.dp_du, found.dp_dv]
}

/// Texture coordinates and derivatives of every shape, moved, mirrored and turned inside out. Expected: Mitsuba.
#[test]
fn parameterizations_agree_with_mitsuba() {
    for &(shape, origin, direction, expected) in PARAMETERIZATIONS {
        let found = met(shape, origin.into(), direction.into());
        for (found, expected) in found.into_iter().zip(expected) {
            let expected = Vec3::from(expected);
            let tolerance = 2e-5 * expected.abs().max_element().max(1.0);
            assert!((found - expected).abs().max_element() < tolerance, "{shape}: {found} {expected}");
        }
    }
}
