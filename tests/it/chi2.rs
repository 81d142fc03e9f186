//! Pearson's chi-square test of samplers against their densities.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A sampler of points in a rectangle and the density it claims.
pub(crate) struct Chi2<S, D> {
    /// Lower and upper end of both axes.
    pub(crate) domain: [[f64; 2]; 2],
    /// Samples drawn.
    pub(crate) samples: u64,
    /// Draws sample number i; `None` = it has no value.
    pub(crate) sample: S,
    /// Density over the rectangle; whatever it lacks to 1 is the probability of `None`.
    pub(crate) density: D,
}

/// Cells per axis: odd and coprime, so that symmetries do not hide in the grid.
const CELLS: [usize; 2] = [21, 13];
/// Midpoint nodes per cell and axis.
const NODES: usize = 12;
/// Cells that expect fewer samples are pooled.
const POOLED: f64 = 5.0;
/// What rounding may move a sample out of the rectangle, and what quadrature may miss of the mass.
const SLACK: f64 = 1e-3;

impl<S: FnMut(u64) -> Option<[f64; 2]>, D: Fn([f64; 2]) -> f64> Chi2<S, D> {
    /// Integral of the density over each cell.
    fn masses(&self) -> Vec<f64> {
        let [[x0, x1], [y0, y1]] = self.domain;
        let (nx, ny) = (CELLS[0] * NODES, CELLS[1] * NODES);
        let (dx, dy) = ((x1 - x0) / nx as f64, (y1 - y0) / ny as f64);
        let mut masses = vec![0.0; CELLS[0] * CELLS[1]];
        for j in 0..ny {
            for i in 0..nx {
                let at = [x0 + (i as f64 + 0.5) * dx, y0 + (j as f64 + 0.5) * dy];
                masses[(j / NODES) * CELLS[0] + i / NODES] += (self.density)(at) * dx * dy;
            }
        }
        masses
    }

    /// Integral of the density.
    pub(crate) fn mass(&self) -> f64 {
        self.masses().iter().sum()
    }

    /// The p-value; 0 if a sample is not finite, lies outside or where the density is 0, or the density is no density.
    pub(crate) fn p_value(mut self) -> f64 {
        let mut expected = self.masses();
        let mass: f64 = expected.iter().sum();
        if !expected.iter().all(|m| *m >= 0.0 && m.is_finite()) || mass > 1.0 + SLACK {
            return 0.0;
        }
        let mut counts = vec![0u64; expected.len() + 1];
        for i in 0..self.samples {
            let Some(at) = (self.sample)(i) else {
                counts[expected.len()] += 1;
                continue;
            };
            let mut cell = 0;
            for (axis, stride) in [(1, CELLS[0]), (0, 1)] {
                let [low, high] = self.domain[axis];
                let part = (at[axis] - low) / (high - low);
                if !(-SLACK..=1.0 + SLACK).contains(&part) {
                    return 0.0;
                }
                cell += stride * ((part * CELLS[axis] as f64) as usize).min(CELLS[axis] - 1);
            }
            counts[cell] += 1;
        }
        // Missing mass within the quadrature's error belongs to nobody.
        expected.push(if 1.0 - mass < SLACK { 0.0 } else { 1.0 - mass });
        let expected: Vec<f64> = expected.iter().map(|m| m * self.samples as f64).collect();
        let p = pearson(&counts, &expected);
        // The share of values alone has one degree of freedom and sees more than it does among all cells.
        let (none, missing) = (counts[counts.len() - 1], expected[expected.len() - 1]);
        let all = self.samples;
        if missing < POOLED { p } else { 2.0 * p.min(pearson(&[none, all - none], &[missing, all as f64 - missing])) }
    }
}

/// p-value of counts against expected counts, small cells pooled. 0 if there are counts where none are expected.
pub(crate) fn pearson(counts: &[u64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0);
    let mut pool = (0.0, 0.0);
    let mut add = |count: f64, expected: f64| {
        statistic += (count - expected).powi(2) / expected;
        cells += 1;
    };
    for (&count, &expected) in counts.iter().zip(expected) {
        if count > 0 && expected <= 0.0 {
            return 0.0;
        }
        if expected >= POOLED {
            add(count as f64, expected);
        } else {
            pool = (pool.0 + count as f64, pool.1 + expected);
        }
    }
    if pool.1 >= POOLED {
        add(pool.0, pool.1);
    }
    assert!(cells >= 2, "nothing to compare");
    let p = ChiSquared::new(f64::from(cells - 1)).unwrap().sf(statistic);
    if p.is_finite() { p } else { 0.0 }
}
