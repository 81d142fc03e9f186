//! An experiment repeated with fresh random numbers, in memory: how often its verdicts and forecasts are right.

use super::scene::{Examined, Source, examine, results, turns};
use super::{Options, Plan, PlannedScene, Runner, Stop, powers_of_two, progress_bar};
use crate::analysis::cost::{Curve, PREDICTION};
use crate::analysis::scene::Reference;
use crate::claim::{Claim, Kind};
use crate::error::{Error, Result};
use crate::estimator::{Cell, Estimate, interrupted};
use crate::moments::cell::Checkpoint;
use crate::record::calibration::{Calibration, Forecasts, Outcomes, Power, Verdicts};
use crate::record::{ClaimResult, ReferenceResult, SceneResult, Verdict};
use crate::sampling::{Key, Role, Sequence};
use crate::stats::interval::median;
use rayon::prelude::*;
use std::ops::Range;

/// Repeats a plan so often. Only references are kept on disk.
pub fn calibrate(plan: &Plan<'_>, repetitions: u32, options: &Options) -> Result<Calibration> {
    let mut runner = Runner::new(plan, options);
    runner.bar.finish_and_clear();
    let folder = options.out.join(&plan.name);
    let (mut verdicts, mut forecasts) = (Vec::new(), Vec::new());
    for scene in &plan.scenes {
        let (reference, described) = runner.reference(scene, &folder)?;
        let subject = Subject { plan, scene, reference: &reference, described: &described };
        let bar = progress_bar(repetitions.into(), options.quiet);
        bar.set_message(scene.name.clone());
        let one = |i: u32| {
            if interrupted() {
                return Err(Error::Interrupted);
            }
            let done = subject.repetition(seed(plan.seed, &scene.name, i));
            bar.inc(1);
            done
        };
        let done: Vec<Repetition> = match subject.side_by_side() {
            false => (0..repetitions).map(one).collect::<Result<_>>()?,
            true => (0..repetitions).into_par_iter().map(one).collect::<Result<_>>()?,
        };
        bar.finish_and_clear();
        verdicts.extend(plan.claims.iter().enumerate().filter_map(|(i, claim)| tally(&subject, i, claim, &done)));
        forecasts.extend(tally_forecasts(&subject, &done));
    }
    Ok(Calibration {
        name: plan.name.clone(),
        question: plan.question.clone(),
        experiment: plan.experiment.clone(),
        repetitions,
        replicates: plan.replicates,
        verdicts,
        forecasts,
    })
}

/// Seed of a repetition: no two scenes, repetitions or calibrations share one.
fn seed(of_plan: u64, scene: &str, repetition: u32) -> u64 {
    let hash = blake3::hash(format!("calibration {of_plan} {repetition} {scene}").as_bytes());
    u64::from_le_bytes(hash.as_bytes()[..8].try_into().expect("eight bytes"))
}

/// Growth beyond which neither power nor forecasts are followed up.
const MOST: f64 = 1e4;

/// What is repeated.
struct Subject<'a> {
    plan: &'a Plan<'a>,
    scene: &'a PlannedScene<'a>,
    reference: &'a Reference,
    described: &'a ReferenceResult,
}

/// What one repetition gave.
struct Repetition {
    points: Vec<Point>,
    /// Place of the claim, samples per value, verdict.
    power: Vec<(usize, u64, Verdict)>,
    forecasts: Vec<Forecast>,
}

/// All verdicts at an N.
struct Point {
    spp: u64,
    /// Of each strategy.
    variance_of_variance: Vec<Option<f64>>,
    verdicts: Vec<(usize, ClaimResult)>,
}

/// A forecast, and whether one more run needed that many samples and seconds.
struct Forecast {
    strategy: usize,
    target: f64,
    spp: f64,
    held: [bool; 2],
}

impl Subject<'_> {
    /// Seconds of rendering mean something only where repetitions do not compete.
    fn side_by_side(&self) -> bool {
        !self.scene.rendered
    }

    fn repetition(&self, seed: u64) -> Result<Repetition> {
        let Self { plan, scene, .. } = *self;
        let reference = (self.reference, self.described);
        let mut source = Memory { checkpoints: &plan.checkpoints, seed, kept: Vec::new() };
        let mut points = Vec::new();
        let (result, verdicts) = match plan.stop {
            Stop::Decided => {
                let Examined { result, verdicts, .. } = examine(plan, scene, reference, &mut source)?;
                points.push(Point::of(&result, verdicts.clone()));
                (result, verdicts)
            }
            _ => {
                source.sample(scene, self.reference, 0..plan.replicates)?;
                let mut last = None;
                // Two samples are the fewest that have a variance; without claims only the last N matters, to forecasts.
                let end = plan.checkpoints.len();
                let first = if plan.claims.is_empty() { end - 1 } else { 0 };
                for k in (first..end).filter(|&k| plan.checkpoints[k] > 1) {
                    let have = vec![k + 1; scene.contenders.len()];
                    let (result, _) = results(plan, scene, reference, plan.replicates, &have, &source)?;
                    let judge = |c: &Claim| c.judge(&result, plan.metrics[0], 1.0);
                    let speak = plan.claims.iter().enumerate().filter(|(_, c)| c.speaks_of(&scene.name));
                    let verdicts: Vec<_> = speak.map(|(i, c)| (i, judge(c))).collect();
                    points.push(Point::of(&result, verdicts.clone()));
                    last = Some((result, verdicts));
                }
                last.expect("checked on loading")
            }
        };
        let mut power = Vec::new();
        for (i, verdict) in &verdicts {
            let claim = &plan.claims[*i];
            if let Some(spp) = self.asked_for(claim, verdict, &result) {
                power.push((*i, spp, self.again(claim, spp, !seed)?));
            }
        }
        Ok(Repetition { points, power, forecasts: self.forecasts(&result, seed)? })
    }

    /// Samples per value that the tool asks for to find out that a claim is wrong, if it is; at least the pilot's. `None` where
    /// more samples are not what it asks for.
    fn asked_for(&self, claim: &Claim, pilot: &ClaimResult, result: &SceneResult) -> Option<u64> {
        let by_samples = matches!(claim.kind, Kind::VarianceRatio | Kind::Unbiased | Kind::Agrees);
        if pilot.doubtful || !by_samples || self.plan.stop != Stop::Never {
            return None;
        }
        let growth = claim.growth(pilot, claim.violation(claim.truth?)?).filter(|&g| g <= MOST)?;
        let spp = result.strategies.first()?.checkpoints.last()?.spp;
        Some((growth.max(1.0) * spp as f64).ceil() as u64)
    }

    /// The verdict of a fresh run with so many samples.
    fn again(&self, claim: &Claim, spp: u64, seed: u64) -> Result<Verdict> {
        let plan = Plan {
            seed,
            replicates: self.plan.replicates,
            checkpoints: powers_of_two(spp),
            metrics: self.plan.metrics.clone(),
            claims: vec![claim.clone()],
            ..Plan::default()
        };
        let mut source = Memory { checkpoints: &plan.checkpoints, seed, kept: Vec::new() };
        let examined = examine(&plan, self.scene, (self.reference, self.described), &mut source)?;
        Ok(examined.verdicts[0].1.verdict)
    }

    /// Holds each forecast against one more replicate, sampled as far as forecast.
    fn forecasts(&self, result: &SceneResult, seed: u64) -> Result<Vec<Forecast>> {
        let metric = self.plan.metrics[0];
        let share = metric.reference_share(&self.reference.mean, &self.reference.variance);
        let mut forecasts = Vec::new();
        for (i, s) in result.strategies.iter().enumerate() {
            for cost in &s.cost {
                let order = Curve::of(s, metric).order_at(cost.target);
                let (Some(forecast), Some(order)) = (&cost.forecast, order) else { continue };
                let contender = &self.scene.contenders[i];
                let n = forecast.spp.estimate.max(1.0);
                if n > MOST * result.strategies[i].checkpoints.last().map_or(1.0, |c| c.spp as f64) {
                    continue;
                }
                // Curves are those of powers of two, where Sobol points are at their best.
                let n = match contender.strategy.sequence {
                    Sequence::Sobol => 2f64.powf(n.log2().round()),
                    _ => n.round(),
                } as u64;
                // As the pilot's replicates were: in turn with the other strategies, checkpoint by checkpoint.
                let checkpoints = powers_of_two(n);
                let mut source = Memory { checkpoints: &checkpoints, seed, kept: Vec::new() };
                source.sample(self.scene, self.reference, self.plan.replicates..self.plan.replicates + 1)?;
                let run = &source.kept[0][i][checkpoints.len() - 1];
                let error = metric.measure(&run.mean, &self.reference.mean, share).value;
                let error = if metric.squared() { error.sqrt() } else { error };
                let spp = n as f64 * (error / cost.target).powf(-1.0 / order.value);
                let seconds = spp * run.seconds / n as f64;
                let held = [forecast.spp.contains(spp), forecast.seconds.contains(seconds)];
                forecasts.push(Forecast { strategy: i, target: cost.target, spp: forecast.spp.estimate, held });
            }
        }
        Ok(forecasts)
    }
}

impl Point {
    fn of(result: &SceneResult, verdicts: Vec<(usize, ClaimResult)>) -> Self {
        Self {
            spp: result.strategies[0].checkpoints.last().map_or(0, |c| c.spp),
            variance_of_variance: result
                .strategies
                .iter()
                .map(|s| Some(s.health.as_ref()?.variance_of_variance))
                .collect(),
            verdicts,
        }
    }
}

/// Samples without leaving anything on disk.
struct Memory<'a> {
    checkpoints: &'a [u64],
    seed: u64,
    /// By replicate, contender and checkpoint.
    kept: Vec<Vec<Vec<Checkpoint>>>,
}

impl Source for Memory<'_> {
    fn sample(&mut self, scene: &PlannedScene<'_>, _: &Reference, replicates: Range<u32>) -> Result<Vec<usize>> {
        for replicate in replicates {
            let mut states: Vec<Option<Estimate>> = vec![None; scene.contenders.len()];
            let mut kept = vec![Vec::new(); scene.contenders.len()];
            for &n in self.checkpoints {
                for i in turns(replicate, scene.contenders.len()) {
                    let c = &scene.contenders[i];
                    let key = Key::new(self.seed, Role::Calibration, &c.strategy.identity(), replicate);
                    let cell = Cell { key, length: n };
                    let estimate = c.estimator.estimate(&cell, n, &mut states[i])?;
                    kept[i].push(Checkpoint::of(&estimate));
                    states[i] = c.estimator.progressive().then_some(estimate);
                }
            }
            self.kept.push(kept);
        }
        Ok(vec![self.checkpoints.len(); scene.contenders.len()])
    }

    fn load(&self, _: &PlannedScene<'_>, contender: usize, replicate: u32, n: u64) -> Result<Checkpoint> {
        let k = self.checkpoints.iter().position(|&c| c == n).expect("a checkpoint of the plan");
        Ok(self.kept[replicate as usize][contender][k].clone())
    }
}

/// How a claim fared on a scene; `None` where it does not speak of it.
fn tally(subject: &Subject<'_>, i: usize, claim: &Claim, done: &[Repetition]) -> Option<Verdicts> {
    let first = done.first()?.points.first()?;
    let place = first.verdicts.iter().position(|v| v.0 == i)?;
    let speaks_of = |name: &str| name == claim.of || Some(name) == claim.to.as_deref();
    let contenders = subject.scene.contenders.iter().enumerate();
    let own: Vec<usize> = contenders.filter(|(_, c)| speaks_of(&c.name)).map(|(i, _)| i).collect();
    let sequential = subject.plan.stop == Stop::Decided;
    let points = (0..done[0].points.len()).map(|k| {
        let at: Vec<&Point> = done.iter().map(|r| &r.points[k]).collect();
        let results: Vec<&ClaimResult> = at.iter().map(|p| &p.verdicts[place].1).collect();
        let count = |f: &dyn Fn(&ClaimResult) -> bool| results.iter().filter(|r| f(r)).count() as u32;
        let vov: Vec<f64> =
            at.iter().filter_map(|p| own.iter().filter_map(|&i| p.variance_of_variance[i]).reduce(f64::max)).collect();
        Outcomes {
            spp: at.iter().map(|p| p.spp).max().unwrap_or(0),
            variance_of_variance: (!vov.is_empty()).then(|| median(&vov)),
            supported: count(&|r| r.verdict == Verdict::Supported),
            refuted: count(&|r| r.verdict == Verdict::Refuted),
            open: count(&|r| r.verdict == Verdict::Inconclusive && !r.doubtful),
            doubtful: count(&|r| r.doubtful),
            covered: claim.truth.map_or(0, |t| count(&|r| !r.doubtful && r.interval.contains(t))),
            covered_doubtful: claim.truth.map_or(0, |t| count(&|r| r.doubtful && r.interval.contains(t))),
        }
    });
    let asked: Vec<&(usize, u64, Verdict)> = done.iter().flat_map(|r| &r.power).filter(|p| p.0 == i).collect();
    let count = |v: Verdict| asked.iter().filter(|p| p.2 == v).count() as u32;
    let spp: Vec<f64> = asked.iter().map(|p| p.1 as f64).collect();
    Some(Verdicts {
        scene: subject.scene.name.clone(),
        text: claim.text.clone(),
        kind: claim.kind.label(),
        confidence: claim.confidence,
        truth: claim.truth,
        holds: claim.truth.map(|t| claim.violation(t).is_none()),
        nominal_error: claim.nominal_error(),
        sequential,
        points: points.collect(),
        power: (!asked.is_empty()).then(|| Power {
            spp: median(&spp),
            trials: asked.len() as u32,
            found: count(Verdict::Refuted),
            missed: count(Verdict::Supported),
        }),
    })
}

/// How forecasts fared on a scene.
fn tally_forecasts(subject: &Subject<'_>, done: &[Repetition]) -> Vec<Forecasts> {
    let mut all = Vec::new();
    let timed = !subject.side_by_side() || subject.scene.contenders.iter().all(|c| !c.estimator.is_timed());
    for (i, contender) in subject.scene.contenders.iter().enumerate() {
        for &target in &subject.plan.targets {
            let of = |f: &&Forecast| f.strategy == i && f.target == target;
            let made: Vec<&Forecast> = done.iter().flat_map(|r| &r.forecasts).filter(of).collect();
            let held = |k: usize| made.iter().filter(|f| f.held[k]).count() as u32;
            if !made.is_empty() {
                all.push(Forecasts {
                    scene: subject.scene.name.clone(),
                    strategy: contender.name.clone(),
                    target,
                    confidence: PREDICTION,
                    pilot: subject.plan.checkpoints.last().copied().unwrap_or(0),
                    spp: median(&made.iter().map(|f| f.spp).collect::<Vec<_>>()),
                    trials: made.len() as u32,
                    spp_held: held(0),
                    seconds_held: timed.then(|| held(1)),
                });
            }
        }
    }
    all
}
