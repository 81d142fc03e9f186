//! Environment maps: radiance by direction from an image in latitude and longitude.
//!
//! Lookup as in Mitsuba 3 (`envmap`): local y is up; the polar angle θ from it runs down the image, row 0 and the last row lie at
//! the poles; the azimuth is φ = atan2(x, −z), and column i lies at (i + ½)/width turns; values in between are bilinear in
//! (φ, θ). Sampling: a cell between four texels by its mean luminance times its solid angle, then uniform in (φ, cos θ), so
//! the density is constant in a cell.

use crate::math::rgb::luminance;
use crate::math::trig::{atan2, sin_cos_turns};
use crate::math::{Frame, Rgb, Vec3};
use crate::sampling::discrete::Discrete;
use crate::sampling::rng::unit_f32;
use std::f32::consts::FRAC_1_PI;
use std::f64::consts::{PI, TAU};

/// Longest side in texels.
const LARGEST_SIDE: u32 = 1 << 15;

/// The cells between two rows of texels.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Band {
    /// Upper edge: 1 − cos θ, or 1 + cos θ in the lower half (precise near both poles) …
    start: f32,
    /// … and from there to the lower edge.
    span: f32,
    /// Density of a direction in the band, sr⁻¹, but for the choice of the column.
    density: f32,
}

/// An image around the scene, infinitely far away.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    /// Images of the local axes in world space; may be left-handed.
    frame: Frame,
    /// Columns of texels, and of cells.
    width: u32,
    /// Rows of texels, W m⁻² sr⁻¹.
    texels: Vec<Rgb>,
    /// Rows of cells: one less than those of texels.
    bands: Vec<Band>,
    /// Which band …
    rows: Discrete,
    /// … and which of its cells.
    columns: Vec<Discrete>,
    mean: Rgb,
}

impl EnvironmentMap {
    /// A map of `width` columns of `texels` (row by row from the pole +y, W m⁻² sr⁻¹, finite and at least 0).
    /// `axes`: images of the local x, y and z axes in world space, orthonormal.
    ///
    /// # Errors
    /// A sentence where the texels are too few or too many, or no radiance.
    pub fn new(width: u32, texels: Vec<Rgb>, axes: [Vec3; 3]) -> Result<Self, String> {
        let height = texels.len() / width.max(1) as usize;
        if width < 2 || height < 3 || width as usize * height != texels.len() {
            return Err(format!("{} texels in {width} columns; at least 2 × 3 are needed", texels.len()));
        }
        if width > LARGEST_SIDE || height > LARGEST_SIDE as usize {
            return Err(format!("{width} × {height} texels; at most {LARGEST_SIDE} per side are allowed"));
        }
        let sound = |c: &Rgb| c.is_finite() && c.min_element() >= 0.0;
        if let Some(i) = texels.iter().position(|c| !sound(c)) {
            let (x, y, width) = (i % width as usize, i / width as usize, width as usize);
            return Err(format!("texel ({x}, {y}) is {}, which is no radiance", texels[y * width + x]));
        }
        let [s, t, n] = axes;
        let (bands, columns) = (Vec::new(), Vec::new());
        let (frame, rows, mean) = (Frame { s, t, n }, Discrete::default(), Rgb::ZERO);
        let mut map = Self { frame, width, texels, bands, rows, columns, mean };
        map.make_tables(height - 1);
        Ok(map)
    }

    /// Distributions and the mean.
    fn make_tables(&mut self, rows: usize) {
        // 1 − cos θ of the edge below j bands from a pole.
        let height = |j: usize| 2.0 * (j as f64 * PI / (2 * rows) as f64).sin().powi(2);
        let mut weights = Vec::new();
        let mut mean = glam::DVec3::ZERO;
        for j in 0..rows {
            let [start, end] = if is_lower(j, rows) { [rows - j, rows - j - 1] } else { [j, j + 1] }.map(height);
            let (start, span) = (start as f32, (end - start) as f32);
            let cells: Vec<_> = (0..self.width as usize).map(|i| self.cell_mean(i, j)).collect();
            let cell_weights: Vec<f64> = cells.iter().map(|c| f64::from(span.abs()) * c.1).collect();
            mean += cells.iter().map(|c| c.0).sum::<glam::DVec3>() * f64::from(span.abs());
            weights.push(cell_weights.iter().sum());
            self.columns.push(distribution(cell_weights));
            self.bands.push(Band { start, span, density: 0.0 });
        }
        self.rows = distribution(weights);
        self.mean = (mean / f64::from(2 * self.width)).as_vec3();
        for (j, band) in self.bands.iter_mut().enumerate() {
            let cell = TAU / f64::from(self.width) * f64::from(band.span.abs());
            band.density = (f64::from(self.rows.pmf(j)) / cell) as f32;
        }
    }

    /// Mean radiance and luminance of the corners of a cell.
    fn cell_mean(&self, i: usize, j: usize) -> (glam::DVec3, f64) {
        let corners = self.corners(i as u32, j as u32);
        let mean = corners.iter().map(|c| c.as_dvec3()).sum::<glam::DVec3>() / 4.0;
        (mean, corners.iter().map(|&c| f64::from(luminance(c))).sum::<f64>() / 4.0)
    }

    /// Texels around a cell: the upper two, then the lower two.
    #[inline(always)]
    fn corners(&self, i: u32, j: u32) -> [Rgb; 4] {
        let (next, above) = (if i + 1 == self.width { 0 } else { i + 1 }, (j * self.width) as usize);
        let below = above + self.width as usize;
        let (i, next) = (i as usize, next as usize);
        [self.texels[above + i], self.texels[above + next], self.texels[below + i], self.texels[below + next]]
    }

    /// Mean over all directions (by cells), W m⁻² sr⁻¹.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// Radiance that arrives from the world direction `direction` (any length), W m⁻² sr⁻¹, and the density with which
    /// [`Self::sample`] draws it, sr⁻¹.
    #[inline(never)]
    pub fn lookup(&self, direction: Vec3) -> (Rgb, f32) {
        let d = self.frame.to_local(direction);
        let across = (d.x * d.x + d.z * d.z).sqrt();
        let phi = if across > 0.0 { atan2(d.x, -d.z) } else { 0.0 };
        let (width, rows) = (self.width as f32, self.bands.len() as f32);
        let x = phi * (FRAC_1_PI / 2.0) * width - 0.5;
        let x = if x < 0.0 { x + width } else { x };
        let y = atan2(across, d.y) * FRAC_1_PI * rows;
        let (i, j) = ((x as u32).min(self.width - 1), (y as u32).min(self.bands.len() as u32 - 1));
        let (s, t) = (x - i as f32, y - j as f32);
        let [a, b, c, d] = self.corners(i, j);
        let radiance = (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t;
        let j = j as usize;
        (radiance, self.bands[j].density * self.columns[j].pmf(i as usize))
    }

    /// A unit world direction and its density, sr⁻¹. Word 3 picks the band, word 0 the cell in it and the azimuth, word 1 the
    /// polar angle.
    #[inline(never)]
    pub fn sample(&self, words: [u32; 4]) -> (Vec3, f32) {
        let j = self.rows.pick(words[3]);
        let columns = &self.columns[j];
        let i = columns.pick(words[0]);
        let pmf = columns.pmf(i);
        // What is left of the word, in the middle of its unit; the pmf counts units of 2⁻³².
        let part = ((words[0] - columns.thresholds()[i]) as f32 + 0.5) / (pmf * 4_294_967_296.0);
        let turn = (i as f32 + 0.5 + part) / self.width as f32;
        let (sin, cos) = sin_cos_turns(if turn >= 1.0 { turn - 1.0 } else { turn });
        let band = self.bands[j];
        let h = band.start + unit_f32(words[1]) * band.span;
        let across = (h * (2.0 - h)).sqrt();
        let up = if is_lower(j, self.bands.len()) { h - 1.0 } else { 1.0 - h };
        (self.frame.to_world(Vec3::new(sin * across, up, -cos * across)), band.density * pmf)
    }

    /// Columns of texels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Images of the local axes.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// All texels, row by row.
    pub fn texels(&self) -> &[Rgb] {
        &self.texels
    }

    /// Bands of cells from +y down.
    pub fn bands(&self) -> &[Band] {
        &self.bands
    }

    /// Bytes of texels and tables.
    pub fn bytes(&self) -> usize {
        let tables = self.rows.bytes() + self.columns.iter().map(Discrete::bytes).sum::<usize>();
        size_of_val(&self.texels[..]) + size_of_val(&self.bands[..]) + tables
    }

    /// Smallest word of each band, and of each cell of each band.
    pub fn thresholds(&self) -> (&[u32], Vec<u32>) {
        (self.rows.thresholds(), self.columns.iter().flat_map(|c| c.thresholds()).copied().collect())
    }
}

/// Whether a band lies nearer to the pole −y.
#[inline(always)]
fn is_lower(band: usize, bands: usize) -> bool {
    2 * band + 1 > bands
}

/// Outcomes by weight; without any weight they are equally likely.
fn distribution(weights: Vec<f64>) -> Discrete {
    if weights.iter().all(|w| *w == 0.0) { Discrete::new(&vec![1.0; weights.len()]) } else { Discrete::new(&weights) }
}
