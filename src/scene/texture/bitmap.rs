//! Pictures as textures. Row 0 is at v = 0, and texel centres are at half-integers, as in Mitsuba.

use super::UvTransform;
use crate::math::{Rgb, Vec2};

/// A picture as a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bitmap {
    /// Index into [`crate::scene::Scene::texels`] of the first texel; row by row.
    pub first: u32,
    /// Width and height in texels, each from 1 to [`crate::scene::format::picture::LARGEST_SIDE`].
    pub size: [u32; 2],
    /// What is between texel centres.
    pub filter: TextureFilter,
    /// What is outside the unit square.
    pub wrap: Wrap,
    /// From texture coordinates of the surface to the picture's unit square.
    pub to_uv: UvTransform,
}

/// What is between texel centres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// The four nearest, mixed.
    Bilinear,
}

/// What is outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// The picture and its mirror image in turns.
    Mirror,
    /// The texels at the edge.
    Clamp,
}

impl Bitmap {
    /// The colour at `uv`; the texel at (0, 0) where that is not finite.
    pub(super) fn eval(&self, texels: &[Rgb], uv: Vec2) -> Rgb {
        let uv = self.to_uv.apply(uv);
        let bilinear = self.filter == TextureFilter::Bilinear;
        let shift = if bilinear { 0.5 } else { 0.0 };
        let (x, x_weight) = self.texel(uv.x, self.size[0], shift);
        let (y, y_weight) = self.texel(uv.y, self.size[1], shift);
        let mut sum = Rgb::ZERO;
        for tap in 0..if bilinear { 4 } else { 1 } {
            let (right, below) = (tap & 1, tap >> 1);
            let column = self.wrapped(x + right, self.size[0]);
            let row = self.wrapped(y + below, self.size[1]);
            let horizontal = if right == 1 { x_weight } else { 1.0 - x_weight };
            let vertical = if below == 1 { y_weight } else { 1.0 - y_weight };
            let weight = if bilinear { horizontal * vertical } else { 1.0 };
            sum += texels[(self.first + row * self.size[0] + column) as usize] * weight;
        }
        sum
    }

    /// Derivatives of the first channel at `uv`. Unlike Mitsuba's they are right where `to_uv` turns a picture that is not square.
    pub(super) fn gradient(&self, texels: &[Rgb], uv: Vec2) -> Vec2 {
        if self.filter == TextureFilter::Nearest {
            return Vec2::ZERO;
        }
        let uv = self.to_uv.apply(uv);
        let (x, x_weight) = self.texel(uv.x, self.size[0], 0.5);
        let (y, y_weight) = self.texel(uv.y, self.size[1], 0.5);
        let [f00, f10, f01, f11] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, below)| {
            let (column, row) = (self.wrapped(x + right, self.size[0]), self.wrapped(y + below, self.size[1]));
            texels[(self.first + row * self.size[0] + column) as usize].x
        });
        let across = ((f10 - f00) * (1.0 - y_weight) + (f11 - f01) * y_weight) * self.size[0] as f32;
        let down = ((f01 - f00) * (1.0 - x_weight) + (f11 - f10) * x_weight) * self.size[1] as f32;
        let UvTransform { u, v, .. } = self.to_uv;
        Vec2::new(u[0] * across + u[1] * down, v[0] * across + v[1] * down)
    }

    /// The texel at or before a coordinate, −1 to twice the size, and the weight of the one after it. Whole periods are
    /// taken off first, so that no coordinate is too large for an integer.
    fn texel(&self, x: f32, size: u32, shift: f32) -> (i32, f32) {
        let x = if x.is_finite() { x } else { 0.0 };
        let x = match self.wrap {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => x - 2.0 * (0.5 * x).floor(),
            Wrap::Clamp => x.clamp(0.0, 1.0),
        };
        let position = x * size as f32 - shift;
        let texel = position.floor();
        (texel as i32, position - texel)
    }

    /// The texel that stands for one of −1 to 2·size + 1.
    fn wrapped(&self, texel: i32, size: u32) -> u32 {
        let size = size as i32;
        let repeat = self.wrap == Wrap::Repeat;
        let mut i = texel;
        if i < 0 {
            i = if repeat { i + size } else { -1 - i };
        }
        if i >= size {
            i = match self.wrap {
                Wrap::Repeat => i - size,
                Wrap::Mirror => 2 * size - 1 - i,
                Wrap::Clamp => size - 1,
            };
        }
        // One past the second period of the mirror, and one past a period of a single texel.
        i.clamp(0, size - 1) as u32
    }
}
