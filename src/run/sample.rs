//! Sampling one cell in slices, so that progress is seen and Ctrl-C is heard.

use crate::error::Result;
use crate::estimator::{Cell, Estimate, Estimator, interrupted};
use crate::moments::BLOCK;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// Longest stretch of sampling between looks at the interrupt flag.
const SLICE: Duration = Duration::from_secs(2);

/// Samples a cell up to `n` per value, or until interrupted (second part of the result): about two seconds at a time. Takes
/// `current`; after an error it holds all that was sampled before.
pub fn sample(
    estimator: &dyn Estimator,
    cell: &Cell,
    n: u64,
    current: &mut Option<Estimate>,
    bar: &ProgressBar,
) -> Result<(Estimate, bool)> {
    let pixels = estimator.shape().pixels() as u64;
    if let Some(done) = current.take_if(|e| e.abscissa >= n) {
        return Ok((done, false));
    }
    loop {
        let before = current.as_ref().map_or(0, |e| e.abscissa);
        let estimate = estimator.estimate(cell, next_step(current.as_ref(), n), current)?;
        bar.inc((estimate.abscissa - before).saturating_mul(pixels));
        *current = None;
        let interrupted = interrupted();
        if interrupted || estimate.abscissa >= n {
            return Ok((estimate, interrupted));
        }
        *current = Some(estimate);
    }
}

/// A bar on stderr with rate and time left; hidden where stderr is no terminal, or on request.
pub fn progress_bar(samples: u64, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::new(samples);
    if quiet {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let style = "{spinner} {msg:32} {bar:30} {percent:>3} %  {per_sec} samples/s  {eta} left";
    bar.set_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// The next N to sample to: at most about [`SLICE`] ahead at the speed so far, in whole blocks.
fn next_step(current: Option<&Estimate>, n: u64) -> u64 {
    let done = current.map_or(0, |e| e.abscissa);
    let ahead = match current {
        Some(e) if e.seconds > 0.0 && e.abscissa > 0 => (SLICE.as_secs_f64() * e.abscissa as f64 / e.seconds) as u64,
        _ => BLOCK,
    };
    n.min((done + ahead.max(1)).next_multiple_of(BLOCK))
}
