//! Running moments of samples: push, merge, fields of them, and the files that keep them.

pub mod cell;
#[cfg(target_arch = "x86_64")]
mod leaf;
pub mod tree;

pub use tree::{BATCH, BLOCK, BlockTree};

/// Central moments of one value's samples, with extremes. Non-finite samples and samples beyond the range of f32 are
/// counted apart and do not enter the rest.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Moments {
    /// Number of samples that count.
    pub n: u64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Σ (x − mean)².
    pub m2: f64,
    /// Σ (x − mean)³.
    pub m3: f64,
    /// Σ (x − mean)⁴.
    pub m4: f64,
    /// Smallest sample; +∞ when n = 0.
    pub min: f64,
    /// Largest sample; −∞ when n = 0.
    pub max: f64,
    /// Index of the largest sample (the first, if several).
    pub argmax: u64,
    /// Samples that were not finite or beyond the range of f32.
    pub non_finite: u64,
    /// Samples that were exactly 0, among those that count.
    pub zeros: u64,
}

impl Default for Moments {
    fn default() -> Self {
        Self {
            n: 0,
            mean: 0.0,
            m2: 0.0,
            m3: 0.0,
            m4: 0.0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            argmax: 0,
            non_finite: 0,
            zeros: 0,
        }
    }
}

/// 1/n for the leaf sizes, so that a push does not divide.
static RECIPROCAL: [f64; BLOCK as usize + 1] = {
    let mut r = [0.0; BLOCK as usize + 1];
    let mut n = 1;
    while n < r.len() {
        r[n] = 1.0 / n as f64;
        n += 1;
    }
    r
};

#[inline(always)]
fn reciprocal(n: u64) -> f64 {
    RECIPROCAL.get(n as usize).copied().unwrap_or_else(|| 1.0 / n as f64)
}

/// Whether a sample counts: NaN passes no comparison.
#[inline(always)]
fn counts(x: f64) -> bool {
    x.abs() <= f64::from(f32::MAX)
}

impl Moments {
    /// Adds sample number `index`. Welford's update with third and fourth moments; Pébay, SAND2008-6212, §2.1.
    #[inline(always)]
    pub fn push(&mut self, x: f64, index: u64) {
        if !counts(x) {
            self.non_finite += 1;
            return;
        }
        let before = self.n as f64;
        self.n += 1;
        let n = self.n as f64;
        let delta = x - self.mean;
        let dn = delta * reciprocal(self.n);
        let dn2 = dn * dn;
        let t = delta * dn * before;
        self.mean += dn;
        self.m4 += t * dn2 * (n * n - 3.0 * n + 3.0) + 6.0 * dn2 * self.m2 - 4.0 * dn * self.m3;
        self.m3 += t * dn * (n - 2.0) - 3.0 * dn * self.m2;
        self.m2 += t;
        self.zeros += u64::from(x == 0.0);
        self.min = if x < self.min { x } else { self.min };
        if x > self.max {
            self.max = x;
            self.argmax = index;
        }
    }

    /// The moments of both sets of samples, `self` the earlier one. Pébay, SAND2008-6212, eqs. 2.1–2.4 (Chan et al. for M2).
    #[must_use]
    pub fn merge(&self, later: &Self) -> Self {
        let non_finite = self.non_finite + later.non_finite;
        if later.n == 0 {
            return Self { non_finite, ..*self };
        }
        if self.n == 0 {
            return Self { non_finite, ..*later };
        }
        let (na, nb) = (self.n as f64, later.n as f64);
        let n = na + nb;
        let (fa, fb) = (na / n, nb / n);
        let d = later.mean - self.mean;
        let d2 = d * d;
        let m2 = self.m2 + later.m2 + d2 * na * fb;
        let m3 = self.m3 + later.m3 + d * d2 * na * fb * (fa - fb) + 3.0 * d * (fa * later.m2 - fb * self.m2);
        let m4 = self.m4
            + later.m4
            + d2 * d2 * na * fb * (fa * fa - fa * fb + fb * fb)
            + 6.0 * d2 * (fa * fa * later.m2 + fb * fb * self.m2)
            + 4.0 * d * (fa * later.m3 - fb * self.m3);
        let later_max = later.max > self.max;
        Self {
            n: self.n + later.n,
            mean: self.mean + d * fb,
            m2,
            m3,
            m4,
            min: if later.min < self.min { later.min } else { self.min },
            max: if later_max { later.max } else { self.max },
            argmax: if later_max { later.argmax } else { self.argmax },
            non_finite,
            zeros: self.zeros + later.zeros,
        }
    }

    /// Unbiased per-sample variance S²/(n−1); `None` for n < 2.
    pub fn sample_variance(&self) -> Option<f64> {
        (self.n >= 2).then(|| self.m2 / (self.n - 1) as f64)
    }
}

/// Moments of a plain list, in its order.
impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut m = Self::default();
        values.into_iter().enumerate().for_each(|(i, x)| m.push(x, i as u64));
        m
    }
}
