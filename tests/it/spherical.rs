//! Solid angles and spherical warps of triangles, parallelograms and rectangles at every size.

use glam::DVec3;
use rootn::math::Vec3;
use rootn::math::spherical::{SphericalRectangle, SphericalTriangle, parallelogram_solid_angle, triangle_solid_angle};
use rootn::sampling::rng::unit_f32;

/// Solid angle of a triangle in f64, by L'Huilier's theorem: another formula than the code's.
fn l_huilier(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let side = |p: DVec3, q: DVec3| 2.0 * (0.5 * p.normalize().distance(q.normalize())).asin();
    let (x, y, z) = (side(a, b), side(b, c), side(c, a));
    let s = (x + y + z) / 2.0;
    let tan = |x: f64| (x / 2.0).tan().max(0.0);
    4.0 * (tan(s) * tan(s - x) * tan(s - y) * tan(s - z)).sqrt().atan()
}

/// Solid angles from 10⁻¹² to 2π, and points inside the light at both ends of the unit square.
#[test]
fn solid_angles_are_precise_at_every_size() {
    let ends = [0, 1, 1 << 8, 1 << 31, u32::MAX - 255, u32::MAX];
    let mut seen = [f64::INFINITY, 0.0];
    for exponent in -24..=12 {
        let scale = 2f32.powi(exponent);
        for (i, height) in [1.0f32, 0.1, 0.01].into_iter().enumerate() {
            let (a, eb, ec) = (Vec3::new(-0.4, height / scale, -0.3) * scale, Vec3::Z * scale, Vec3::X * scale);
            let normal = ec.cross(eb);
            let omega = triangle_solid_angle(a, ec, eb, normal);
            let (da, db, dc) = (a.as_dvec3(), (a + eb).as_dvec3(), (a + ec).as_dvec3());
            // L'Huilier's differences lose digits of thin and small triangles: leave those to the flat limit.
            let exact = if scale > 1e-4 * height {
                l_huilier(da, db, dc)
            } else {
                let centre = (da + db + dc) / 3.0;
                0.5 * f64::from(scale).powi(2) * centre.y / centre.length().powi(3)
            };
            seen = [seen[0].min(exact), seen[1].max(exact)];
            assert!(
                (f64::from(omega) / exact - 1.0).abs() < 1e-4,
                "scale {scale}, height {i}: {omega:e} for {exact:e}"
            );
            // The diagonal cuts a parallelogram into this triangle and another one.
            let both = omega + triangle_solid_angle(a + ec, eb, eb - ec, normal);
            let whole = parallelogram_solid_angle(a, ec, eb, normal);
            assert!((whole / both - 1.0).abs() < 1e-5, "scale {scale}, height {i}: {whole:e} for {both:e}");
            let triangle = SphericalTriangle::new(a, ec, eb, normal).unwrap();
            for u in ends.iter().flat_map(|&x| ends.map(|y| [unit_f32(x), unit_f32(y)])) {
                let [b, c] = triangle.sample(u);
                assert!(b >= 0.0 && c >= 0.0 && b + c <= 1.0 + 2.0 * f32::EPSILON, "{b} {c} at scale {scale}");
            }
        }
    }
    assert!(seen[0] < 1e-12 && seen[1] > 6.2, "{seen:?}");
}

/// inverse(sample(u)) = u for spherical triangles and rectangles.
#[test]
fn inverses_undo_spherical_warps() {
    let lattice = (1..32).flat_map(|i| (1..32).map(move |j| [i, j].map(|k| k as f32 / 32.0)));
    for u in lattice {
        for scale in [1e-6f32, 1e-3, 0.3, 1.0, 10.0] {
            let a = Vec3::new(-0.3 * scale, 1.0, -0.4 * scale) + Vec3::new(0.5, 0.0, 0.2);
            let (eb, ec) = (Vec3::X * scale, Vec3::new(0.3, 0.0, 0.9) * scale);
            let t = SphericalTriangle::new(a, eb, ec, eb.cross(ec)).unwrap();
            let back = t.invert(t.sample(u));
            let error = (back[0] - u[0]).abs().max((back[1] - u[1]).abs());
            assert!(error < 1e-5, "triangle of size {scale}: {u:?} came back as {back:?}");
            let (x, z) = (Vec3::X, Vec3::Z);
            let omega = parallelogram_solid_angle(a, x * scale, z * scale, x.cross(z) * scale * scale);
            let Some(r) = SphericalRectangle::new(a, (x, scale), (z, scale), -Vec3::Y, omega) else {
                assert!(scale < 0.1, "a rectangle of size {scale} is well conditioned");
                continue;
            };
            let back = r.invert(r.sample(u));
            let error = (back[0] - u[0]).abs().max((back[1] - u[1]).abs());
            assert!(error < 5e-4, "rectangle of size {scale}: {u:?} came back as {back:?}");
        }
    }
}
