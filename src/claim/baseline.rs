//! Comparison with an earlier run: variance first, cost second, bias apart. Each is a claim like any other, so that noise is
//! told from regression.

use super::measure::{Measure, Narrows, PAIRED, difference};
use super::{Claim, Kind};
use crate::analysis::efficiency::quotient;
use crate::record::{ClaimResult, Record, SceneResult, StrategyResult};
use crate::stats::interval::Uncertain;
use crate::stats::number::percent;

/// Confidence of these claims.
const CONFIDENCE: f64 = 0.99;

/// Judges every strategy of `now` that is also in `before`: its variance and its seconds per sample have grown by at most
/// `tolerance` (0.1 = 10 %), and its mean has moved by at most a tenth of that. Err: why the two cannot be compared.
pub fn compare(now: &Record, before: &Record, tolerance: f64) -> Result<Vec<ClaimResult>, String> {
    let metric = |r: &Record| r.metrics.first().map(|m| m.formula.clone());
    if metric(now) != metric(before) {
        return Err("the headline metrics differ".into());
    }
    let mut results = Vec::new();
    for scene in &now.scenes {
        let old = before.scenes.iter().find(|s| s.name == scene.name);
        let old = old.ok_or_else(|| format!("it has no scene {}", scene.name))?;
        comparable(scene, old)?;
        for strategy in &scene.strategies {
            let Some(earlier) = old.strategies.iter().find(|s| s.name == strategy.name) else { continue };
            let name = format!("{}, {}", scene.name, strategy.name);
            if strategy.strategy != earlier.strategy {
                return Err(format!("{name}: the strategy has other axis values"));
            }
            if class(&strategy.device) != class(&earlier.device) {
                return Err(format!("{name}: it ran on {}, now on {}", earlier.device, strategy.device));
            }
            if strategy.identity != earlier.identity {
                return Err(format!("{name}: the scene, the driver or the traversal is another one"));
            }
            let same_samples = now.provenance.seed == before.provenance.seed;
            results.extend(judge(scene, strategy, earlier, same_samples, tolerance));
        }
    }
    match results.is_empty() {
        true => Err("it has none of the strategies".into()),
        false => Ok(results),
    }
}

/// CPU or GPU: figures of the two are not compared, those of two processors are (their names stand in the records).
fn class(device: &str) -> &str {
    if device.starts_with("cpu") { "cpu" } else { device }
}

fn comparable(now: &SceneResult, before: &SceneResult) -> Result<(), String> {
    let name = &now.name;
    if now.shape != before.shape {
        return Err(format!("{name}: its film is {:?}, now {:?}", before.shape, now.shape));
    }
    if now.max_depth != before.max_depth {
        return Err(format!("{name}: its paths have other lengths"));
    }
    Ok(())
}

fn judge(
    scene: &SceneResult,
    now: &StrategyResult,
    before: &StrategyResult,
    same_samples: bool,
    tolerance: f64,
) -> Vec<ClaimResult> {
    let claim = |kind: Kind, text: &str, margin: Option<f64>| Claim {
        text: format!("{}: {text} than before by at most {}", now.name, percent(margin.unwrap_or(tolerance))),
        kind,
        of: now.name.clone(),
        to: Some("its baseline".into()),
        at_most: margin.is_none().then_some(1.0 + tolerance),
        at_least: None,
        margin,
        error: None,
        equal: None,
        confidence: CONFIDENCE,
        truth: None,
        scene: None,
        region: None,
    };
    let judged = |claim: Claim, found: Option<Uncertain>, remark: Option<String>| {
        let known = found.unwrap_or(Uncertain { value: f64::NAN, error: 0.0, degrees: f64::INFINITY });
        let measure = Measure {
            interval: if claim.kind.is_ratio() { known.exp_interval(CONFIDENCE) } else { known.interval(CONFIDENCE) },
            degrees: known.degrees,
            narrows: Narrows::WithReplicates,
            replicates: now.means.len() as u32,
            seconds: now.checkpoints.last().map_or(0.0, |c| c.seconds.iter().sum()),
            abscissa: scene.abscissa.clone(),
            reach: [0.0; 2],
            doubt: found.is_none().then(|| "one of the two has too few replicates".to_owned()),
            remark,
        };
        claim.judge_measure(&scene.name, &measure)
    };
    let paired = same_samples.then(|| PAIRED.to_owned());
    vec![
        judged(claim(Kind::VarianceRatio, "more variance", None), variance_ratio(now, before, same_samples), None),
        judged(claim(Kind::CostRatio, "more seconds per sample", None), time_ratio(now, before), None),
        judged(
            claim(Kind::Agrees, "another mean", Some(0.1 * tolerance)),
            difference(now, before, same_samples),
            paired,
        ),
    ]
}

/// log of the ratio of variances; paired where both drew the same random numbers.
fn variance_ratio(now: &StrategyResult, before: &StrategyResult, same_samples: bool) -> Option<Uncertain> {
    let (a, b) = (now.variance_statistic(), before.variance_statistic());
    if same_samples && a.without.len() == b.without.len() {
        let ratio = quotient(&a, &b);
        return Uncertain::log_jackknife(ratio.all, &ratio.without);
    }
    Uncertain::log_ratio((a.all, &a.without), (b.all, &b.without))
}

/// log of the ratio of seconds per sample. The runs did not take turns: what the machine did between them is not in the error.
fn time_ratio(now: &StrategyResult, before: &StrategyResult) -> Option<Uncertain> {
    let logs = |s: &StrategyResult| {
        let last = s.checkpoints.last()?;
        let logs: Vec<f64> = last.seconds.iter().map(|t| (t / last.spp as f64).ln()).collect();
        Uncertain::mean(&logs).filter(|u| u.value.is_finite())
    };
    Some(logs(now)?.minus(logs(before)?))
}
