//! Whether counts of right and wrong verdicts are what confidences promise.

use crate::claim::{Kind, POWER};
use crate::record::calibration::{Calibration, Forecasts, Outcomes, Verdicts};
use crate::stats::multiple::holm;
use crate::stats::number::percent;
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeSet;

/// Largest variance of the variance, that is about kurtosis / number of samples, up to which intervals are held to their
/// confidence from both sides. Beyond, verdicts may be rarer than promised, but not wrong more often.
pub const TRUSTED: f64 = 5e-4;

/// Largest share of decisions where there is no truth to be found.
pub const UNFOUNDED: f64 = 0.01;

/// Shares within which prediction intervals of 90 % must hold: what their approximations may miss by, and noise. Beside each
/// the fewest trials for which it is asked for; with fewer nothing is.
const FORECASTS: [(u32, [f64; 2]); 2] = [(2000, [0.87, 0.93]), (200, [0.83, 0.96])];

/// In place of a scene: all of them.
pub const ALL: &str = "all scenes";

/// Error probability of all tests of a calibration together.
pub const ERROR: f64 = 0.01;

/// A promise held against counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What is counted.
    pub what: What,
    /// Scene.
    pub scene: String,
    /// The claim, or strategy and wanted error.
    pub subject: String,
    /// How often it happened.
    pub found: u32,
    /// Of so many.
    pub trials: u32,
    /// The promised share.
    pub promised: f64,
    /// Probability of such a count or a worse one if the promise is kept, adjusted for all tests of the calibration (Holm);
    /// `None` where limits on the share decide.
    pub p: Option<f64>,
    /// Whether the promise is kept.
    pub kept: bool,
}

/// What a promise is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Intervals hold the truth just as often as they say.
    Coverage,
    /// Intervals hold the truth at least as often as they say.
    CoverageAtLeast,
    /// Wrong verdicts are at most as frequent as the confidence allows.
    Wrong,
    /// Nothing is decided where there is no truth.
    Unfounded,
    /// At the predicted budget a difference is found at least as often as predicted.
    Power,
    /// One more run needs as many samples as predicted.
    ForecastSpp,
    /// One more run needs as many seconds as predicted.
    ForecastSeconds,
}

impl Outcomes {
    /// Verdicts that are wrong: against the truth or, where there is none, any.
    pub fn wrong(&self, holds: Option<bool>) -> u32 {
        match holds {
            Some(true) => self.refuted,
            Some(false) => self.supported,
            None => self.supported + self.refuted,
        }
    }
}

/// All promises of a calibration, at its largest N.
pub fn checks(c: &Calibration) -> Vec<Check> {
    let mut checks: Vec<Check> = c.verdicts.iter().flat_map(|v| of_verdicts(v, c.repetitions)).collect();
    let tested: Vec<usize> = (0..checks.len()).filter(|&i| checks[i].p.is_some()).collect();
    let adjusted = holm(&tested.iter().filter_map(|&i| checks[i].p).collect::<Vec<_>>());
    for (i, p) in tested.into_iter().zip(adjusted) {
        checks[i].p = Some(p);
        checks[i].kept = p > ERROR;
    }
    if c.repetitions >= FORECASTS[1].0 {
        let each = c.forecasts.iter().flat_map(|f| of_forecasts(&f.scene, &f.subject(), &[f], c.repetitions));
        checks.extend(each);
    } else {
        // Too few of each: how far orders change is a matter of scene and error, and the intervals speak of all.
        for strategy in c.forecasts.iter().map(|f| &f.strategy).collect::<BTreeSet<_>>() {
            let of: Vec<&Forecasts> = c.forecasts.iter().filter(|f| f.strategy == *strategy).collect();
            checks.extend(of_forecasts(ALL, strategy, &of, of.iter().map(|f| f.trials).sum()));
        }
    }
    checks
}

/// With p-values of their own.
fn of_verdicts(v: &Verdicts, repetitions: u32) -> Vec<Check> {
    let Some(last) = v.points.last() else { return Vec::new() };
    let check = |what, found, trials, promised, p| Check {
        what,
        scene: v.scene.clone(),
        subject: v.text.clone(),
        found,
        trials,
        promised,
        p: Some(p),
        kept: true,
    };
    let mut checks = Vec::new();
    let covers = v.truth.is_some() && !v.sequential && last.variance_of_variance.is_some_and(|x| x <= TRUSTED);
    if covers {
        let found = last.holding();
        let rare = at_most(found, repetitions, v.confidence);
        // Strategies take turns in both directions, which only widens intervals of seconds; slopes rest on the smallest N, too,
        // where errors are far from normal.
        let wide = [Kind::CostRatio, Kind::EfficiencyRatio, Kind::Slope].iter().any(|k| k.label() == v.kind);
        checks.push(match wide {
            true => check(What::CoverageAtLeast, found, repetitions, v.confidence, rare),
            false => {
                let p = 2.0 * rare.min(at_least(found, repetitions, v.confidence));
                check(What::Coverage, found, repetitions, v.confidence, p.min(1.0))
            }
        });
    }
    let wrong = last.wrong(v.holds);
    let (what, nominal) = match v.holds {
        Some(_) => (What::Wrong, v.nominal_error),
        None => (What::Unfounded, UNFOUNDED),
    };
    checks.push(check(what, wrong, repetitions, nominal, at_least(wrong, repetitions, nominal)));
    if let Some(power) = &v.power {
        let p = at_most(power.found, power.trials, POWER);
        checks.push(check(What::Power, power.found, power.trials, POWER, p));
    }
    checks
}

impl Forecasts {
    /// What checks call it.
    pub fn subject(&self) -> String {
        format!("{} to {}", self.strategy, percent(self.target))
    }
}

/// Of all of them together, by the limits for so many trials.
fn of_forecasts(scene: &str, subject: &str, all: &[&Forecasts], count: u32) -> Vec<Check> {
    let trials = all.iter().map(|f| f.trials).sum();
    let Some((_, limits)) = FORECASTS.iter().find(|(fewest, _)| count >= *fewest) else { return Vec::new() };
    let check = |what, found: Option<u32>| {
        let found = found?;
        let kept = (limits[0]..=limits[1]).contains(&(f64::from(found) / f64::from(trials)));
        let (scene, subject) = (scene.to_owned(), subject.to_owned());
        Some(Check { what, scene, subject, found, trials, promised: all[0].confidence, p: None, kept })
    };
    let samples = all.iter().map(|f| f.spp_held).sum();
    let seconds = all.iter().map(|f| f.seconds_held).sum();
    [check(What::ForecastSpp, Some(samples)), check(What::ForecastSeconds, seconds)].into_iter().flatten().collect()
}

/// P(X ≤ found), X binomial.
fn at_most(found: u32, trials: u32, p: f64) -> f64 {
    Binomial::new(p, trials.into()).map_or(1.0, |b| b.cdf(found.into()))
}

/// P(X ≥ found).
fn at_least(found: u32, trials: u32, p: f64) -> f64 {
    match found {
        0 => 1.0,
        _ => Binomial::new(p, trials.into()).map_or(1.0, |b| b.sf(u64::from(found) - 1)),
    }
}
