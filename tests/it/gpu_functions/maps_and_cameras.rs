//! Environment maps and cameras.

use super::twins::{Answer, Case, Input, Program, Words, decided, of, vector};
use crate::emitters::{mapped, patterned};
use crate::support::{no_messages, vulkan};
use rootn::math::Vec3;
use rootn::sampling::strategy::{LightChoice, Lights};
use rootn::scene::light::{LightSampler, LightTarget};
use rootn::scene::{Camera, Light, Projection};

#[test]
fn environment_maps_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_light.spv"));
    let axes = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.8, -0.6, 0.0), Vec3::Z];
    for (width, height) in [(2, 3), (13, 8), (640, 321)] {
        let scene = &mut mapped(patterned(width, height, axes));
        scene.lights.push(Light::Directional { direction: Vec3::Y, irradiance: Vec3::ONE });
        let (map, sampler) =
            (scene.environment_map.as_ref().unwrap(), &LightSampler::new(scene, Lights::Area, LightChoice::Power));
        let (host, frame, (rows, columns)) = (sampler.tables(), map.frame(), map.thresholds());
        let mut tables = [0; 40];
        (tables[12], tables[13]) = (host.entries.len() as u32, host.environment_pdf.to_bits());
        for (k, axis) in [frame.s, frame.t, frame.n].into_iter().enumerate() {
            (0..3).for_each(|c| tables[20 + 3 * k + c] = axis[c].to_bits());
        }
        (tables[29], tables[30]) = (map.width(), map.bands().len() as u32);
        let addresses: [(usize, &[u32]); 6] = [
            (0, bytemuck::cast_slice(&host.entries)),
            (2, &host.choice[..]),
            (32, bytemuck::cast_slice(map.texels())),
            (34, bytemuck::cast_slice(map.bands())),
            (36, rows),
            (38, &columns[..]),
        ];
        let program = Program { device: &device, code, tables: &tables, addresses: &addresses };
        let name = |what| format!("{what}, {width} × {height}");
        let drawn = |r: &mut Input| {
            r.vector(Vec3::ZERO);
            of("wwww")(r);
            r.fixed(&[1]);
        };
        let sampled = |w: &Words| {
            decided(sampler.sample(scene, w.v(0), w.w4(3)), |a, s| {
                assert!(matches!(s.to, LightTarget::Direction));
                let a = a.bits(1, &[1]).vector(5, s.wi).vector(8, s.emitted);
                a.floats(11, &[s.pdf]).bits(12, &[u32::from(s.delta), u32::MAX]).sized(15, 1.0, &[0.0])
            })
        };
        let escaped = |w: &Words| {
            let (radiance, pdf) = sampler.escape(scene, Vec3::ZERO, w.v(0));
            vector(radiance).floats(3, &[pdf])
        };
        let case = Case::new(0, name("environment_map_sample"), 96.0, drawn, sampled);
        case.nudged().hidden().inputs(1 << 16).check(&program);
        // A direction of any length; which cell it is in is not told.
        let case = Case::new(2, name("environment_map_lookup"), 96.0, of("d"), escaped);
        case.nudged().hidden().inputs(1 << 16).check(&program);
    }
    no_messages(&device);
}

#[test]
fn cameras_equal_their_twins() {
    let Some(device) = vulkan() else { return };
    let code = include_bytes!(concat!(env!("OUT_DIR"), "/test_light.spv"));
    let rays = |w: &Words| {
        let projection = match w.w(0) {
            0 => Projection::Pinhole,
            1 => Projection::ThinLens { radii: [w.v(7), w.v(10)], inverse_focus: w.f(13) },
            _ => Projection::Orthographic { direction: w.v(7) },
        };
        let (near, zero) = (w.f(14), Vec3::ZERO);
        let (origin, corner) = (w.v(1), w.v(4));
        let camera = Camera { origin, corner, across: zero, down: zero, near, far: 2.0 * near, projection };
        let ray = camera.ray([0.5, 0.5], w.f2(15));
        let sizes = origin.abs().max_element()
            + corner.length() * (1.0 + near)
            + (w.v(7).length() + w.v(10).length()) * (1.0 + w.f(13)) * (1.0 + near);
        let a = Answer::default().sized(0, sizes, &ray.origin.to_array());
        a.sized(3, sizes, &ray.direction.to_array()).floats(6, &[ray.t_max])
    };
    let program = Program { device: &device, code, tables: &[0; 40], addresses: &[] };
    Case::new(3, "camera rays", 8.0, of("3ldddffuu"), rays).check(&program);
    no_messages(&device);
}
