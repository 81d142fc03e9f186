//! One scene: sampled as far as the plan says, analysed, its claims judged.

use super::track::Track;
use super::{Contender, Plan, PlannedScene, Runner, Stop};
use crate::analysis::scene::{Fields, Reference, Settings, Subject, analyse, compare_with_first, headline_bound};
use crate::claim::Claim;
use crate::error::{Error, Result};
use crate::estimator::Shape;
use crate::moments::cell::Checkpoint;
use crate::record::{ClaimResult, ReferenceResult, RegionResult, SceneResult, StrategyResult, Verdict};
use crate::sampling::Role;
use crate::stats::number::{self, percent};
use std::ops::Range;
use std::path::Path;

/// Where a scene's checkpoints come from: sampled now, or found.
pub(super) trait Source {
    /// Makes sure that these replicates can be loaded; returns how many of the plan's checkpoints each contender has.
    fn sample(&mut self, scene: &PlannedScene<'_>, reference: &Reference, replicates: Range<u32>)
    -> Result<Vec<usize>>;

    /// The checkpoint at N of a contender's replicate.
    fn load(&self, scene: &PlannedScene<'_>, contender: usize, replicate: u32, n: u64) -> Result<Checkpoint>;
}

/// What is known of a scene.
pub(super) struct Examined {
    pub(super) result: SceneResult,
    pub(super) fields: Vec<Fields>,
    /// Verdicts, with the claims' places in the plan.
    pub(super) verdicts: Vec<(usize, ClaimResult)>,
    /// Replicates that were sampled.
    pub(super) replicates: u32,
}

/// Samples a scene, analyses it and judges the claims about it, as often as the plan looks.
pub(super) fn examine(
    plan: &Plan<'_>,
    scene: &PlannedScene<'_>,
    reference: (&Reference, &ReferenceResult),
    source: &mut dyn Source,
) -> Result<Examined> {
    let claims: Vec<(usize, &Claim)> =
        plan.claims.iter().enumerate().filter(|(_, c)| c.speaks_of(&scene.name)).collect();
    let mut verdicts: Vec<Option<ClaimResult>> = vec![None; claims.len()];
    let (mut replicates, mut found) = (0, None);
    for look in plan.looks() {
        let checkpoints = source.sample(scene, reference.0, replicates..look.replicates)?;
        replicates = look.replicates;
        let (result, _) = found.insert(results(plan, scene, reference, replicates, &checkpoints, source)?);
        // What an earlier look has decided stays decided.
        let open = |v: &Option<ClaimResult>| v.as_ref().is_none_or(|v| v.verdict == Verdict::Inconclusive);
        for ((_, claim), verdict) in claims.iter().zip(&mut verdicts).filter(|(_, v)| open(v)) {
            *verdict = Some(claim.judge(result, plan.metrics[0], look.share));
        }
        if !claims.is_empty() && !verdicts.iter().any(open) {
            break;
        }
    }
    let (result, fields) = found.expect("a plan has looks");
    let verdicts = claims.iter().map(|c| c.0).zip(verdicts.into_iter().flatten()).collect();
    Ok(Examined { result, fields, verdicts, replicates })
}

/// Strategies take turns at every checkpoint of a replicate, so that drift of the machine hits all alike, and every second
/// replicate in reverse, so that none always finds what another has left in the caches.
pub(super) fn turns(replicate: u32, contenders: usize) -> impl Iterator<Item = usize> {
    (0..contenders).map(move |i| if replicate.is_multiple_of(2) { i } else { contenders - 1 - i })
}

impl Source for Runner<'_> {
    fn sample(
        &mut self,
        scene: &PlannedScene<'_>,
        reference: &Reference,
        replicates: Range<u32>,
    ) -> Result<Vec<usize>> {
        let checkpoints = match self.plan.stop {
            Stop::Error { target, confidence } => self.sample_until(scene, reference, target, confidence)?,
            _ => {
                self.sample_all(scene, replicates)?;
                vec![self.plan.checkpoints.len(); scene.contenders.len()]
            }
        };
        self.bar.set_message(format!("{} · analysing", scene.name));
        Ok(checkpoints)
    }

    /// What sampling has left on disk.
    fn load(&self, scene: &PlannedScene<'_>, contender: usize, replicate: u32, n: u64) -> Result<Checkpoint> {
        self.stored(&scene.contenders[contender], replicate, n)
    }
}

impl Runner<'_> {
    /// The scene's results, and the verdicts with the claims' places in the plan.
    pub(super) fn scene(
        &mut self,
        scene: &PlannedScene<'_>,
        folder: &Path,
    ) -> Result<(SceneResult, Vec<(usize, ClaimResult)>)> {
        let (reference, described) = self.reference(scene, folder)?;
        self.warm_up(scene)?;
        let plan = self.plan;
        let Examined { mut result, fields, verdicts, replicates } =
            examine(plan, scene, (&reference, &described), self)?;
        let left = u64::from(plan.replicates - replicates) * super::work_of_replicate(plan, scene);
        self.bar.set_length(self.bar.length().unwrap_or(0).saturating_sub(left));
        for ((strategy, fields), contender) in result.strategies.iter_mut().zip(&fields).zip(&scene.contenders) {
            self.images(strategy, fields, contender, scene, folder)?;
        }
        self.warn_of(&scene.name, &result.strategies);
        Ok((result, verdicts))
    }

    fn sample_all(&mut self, scene: &PlannedScene<'_>, replicates: Range<u32>) -> Result<()> {
        for replicate in replicates {
            let mut tracks: Vec<Track<'_>> =
                scene.contenders.iter().map(|c| self.track(&*c.estimator, &c.strategy, Role::Run, replicate)).collect();
            for &n in &self.plan.checkpoints {
                for i in turns(replicate, scene.contenders.len()) {
                    let contender = &scene.contenders[i];
                    self.bar.set_message(format!("{} · {}", scene.name, contender.name));
                    if let Err(e) = self.advance(&mut tracks[i], n) {
                        self.keep_states(&tracks)?;
                        return Err(e);
                    }
                }
            }
        }
        Ok(())
    }

    /// Samples each strategy up to the first checkpoint at which the upper bound of its mean error is at most `target`;
    /// returns how many checkpoints each has. The error probability is shared equally by all looks (Bonferroni), so that
    /// looking often does not make the confidence smaller than it says.
    fn sample_until(
        &mut self,
        scene: &PlannedScene<'_>,
        reference: &Reference,
        target: f64,
        confidence: f64,
    ) -> Result<Vec<usize>> {
        let plan = self.plan;
        let share = (1.0 - confidence) / plan.checkpoints.len() as f64;
        let mut done: Vec<Option<usize>> = vec![None; scene.contenders.len()];
        for (k, &n) in plan.checkpoints.iter().enumerate() {
            for (c, done) in scene.contenders.iter().zip(&mut done).filter(|(_, done)| done.is_none()) {
                self.bar.set_message(format!("{} · {}", scene.name, c.name));
                let mut loaded = Vec::new();
                for replicate in 0..plan.replicates {
                    let mut track = self.track(&*c.estimator, &c.strategy, Role::Run, replicate).ending_at(n);
                    loaded.push(self.advance(&mut track, n)?);
                }
                let bound = headline_bound(&plan.metrics, &loaded, reference, 1.0 - share);
                if bound.is_some_and(|b| b <= target) {
                    *done = Some(k + 1);
                }
            }
        }
        let last = plan.checkpoints.last().copied().unwrap_or(0);
        let (wanted, confidence) = (percent(target), number::confidence(confidence));
        for (c, _) in scene.contenders.iter().zip(&done).filter(|(_, done)| done.is_none()) {
            self.warnings.push(format!(
                "{}, {}: the whole budget (N = {last}) does not reach an error of {wanted} with confidence {confidence}",
                scene.name, c.name
            ));
        }
        Ok(done.into_iter().map(|d| d.unwrap_or(plan.checkpoints.len())).collect())
    }

    /// A checkpoint on disk.
    pub(super) fn stored(&self, c: &Contender<'_>, replicate: u32, n: u64) -> Result<Checkpoint> {
        let track = self.track(&*c.estimator, &c.strategy, Role::Run, replicate);
        let folder = self.folder(&track, n);
        let found = folder.load_checkpoint(n, c.estimator.shape().values())?;
        found.ok_or_else(|| Error::damaged(&self.cells, format!("the cell of {} at N = {n} has vanished", c.name)))
    }

    fn warn_of(&mut self, scene: &str, strategies: &[StrategyResult]) {
        for s in strategies {
            if s.non_finite.count > 0 {
                let (replicate, pixel, sample) = s.non_finite.first.first().copied().unwrap_or_default();
                self.warnings.push(format!(
                    "{scene}, {}: {} non-finite samples, kept out of the mean (the estimate is not to be trusted); first \
                     in replicate {replicate}, pixel {pixel}, sample {sample}: see `rootn replay`",
                    s.name, s.non_finite.count
                ));
            }
            for doubt in s.health.iter().flat_map(|h| h.doubts()) {
                self.warnings.push(format!("{scene}, {}: {doubt}", s.name));
            }
        }
    }
}

/// A scene's results on so many replicates; `checkpoints`: how many of the plan's each contender has.
pub(super) fn results(
    plan: &Plan<'_>,
    scene: &PlannedScene<'_>,
    (reference, described): (&Reference, &ReferenceResult),
    replicates: u32,
    checkpoints: &[usize],
    source: &dyn Source,
) -> Result<(SceneResult, Vec<Fields>)> {
    let shape = scene.contenders[0].estimator.shape();
    let settings = Settings {
        shape,
        origin: [0, 0],
        metrics: &plan.metrics,
        targets: &plan.targets,
        probes: &plan.probes,
        checkpoints: &plan.checkpoints,
        replicates,
    };
    let whole = |contender, replicate, n| source.load(scene, contender, replicate, n);
    let (strategies, fields) = analyse_all(scene, &settings, reference, checkpoints, &whole)?;
    let mut regions: Vec<[u32; 4]> =
        plan.claims.iter().filter(|c| c.speaks_of(&scene.name)).filter_map(|c| c.region).collect();
    regions.sort_unstable();
    regions.dedup();
    let regions = regions.into_iter().map(|region| {
        let [x0, y0, x1, y1] = region;
        let part = Shape { width: (x1 - x0) as usize, height: (y1 - y0) as usize, ..shape };
        let settings = Settings { shape: part, origin: [x0, y0], probes: &[], ..settings };
        let reference = reference.crop(shape, region);
        let cropped = |contender, replicate, n| Ok(whole(contender, replicate, n)?.crop(shape, region));
        let (strategies, _) = analyse_all(scene, &settings, &reference, checkpoints, &cropped)?;
        let described = described.clone();
        let reference = reference.describe(plan.metrics[0], described.description, described.seconds, None);
        Ok(RegionResult { region, reference, strategies })
    });
    let regions = regions.collect::<Result<Vec<_>>>()?;
    let result = SceneResult {
        name: scene.name.clone(),
        shape: [shape.width, shape.height, shape.channels],
        abscissa: scene.contenders[0].estimator.abscissa().into(),
        max_depth: scene.max_depth,
        reference: described.clone(),
        targets: plan.targets.clone(),
        strategies,
        regions,
    };
    Ok((result, fields))
}

/// All contenders, compared with the first.
fn analyse_all(
    scene: &PlannedScene<'_>,
    settings: &Settings<'_>,
    reference: &Reference,
    checkpoints: &[usize],
    load: &dyn Fn(usize, u32, u64) -> Result<Checkpoint>,
) -> Result<(Vec<StrategyResult>, Vec<Fields>)> {
    let analysed = scene.contenders.iter().zip(checkpoints).enumerate().map(|(i, (c, &number))| {
        let subject = Subject {
            name: c.name.clone(),
            device: c.device.clone(),
            strategy: c.strategy,
            identity: blake3::hash(c.estimator.identity().as_bytes()).to_hex()[..24].to_owned(),
            dependence: c.estimator.dependence(),
            setup_seconds: c.estimator.setup_seconds(),
        };
        let settings = Settings { checkpoints: &settings.checkpoints[..number], ..*settings };
        analyse(subject, &settings, reference, |replicate, n| load(i, replicate, n))
    });
    let mut analysed = analysed.collect::<Result<Vec<_>>>()?;
    compare_with_first(&mut analysed);
    Ok(analysed.into_iter().unzip())
}
