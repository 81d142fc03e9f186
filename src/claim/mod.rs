//! Claims about strategies, and verdicts on them: pure functions of the record.

use crate::analysis::{efficiency_ratio, variance_ratio};
use crate::record::{ClaimResult, Interval, SceneResult, StrategyResult, Verdict};
use crate::stats::mean_interval;
use crate::stats::number::{percent, significant};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a claim speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Weighted variance per sample of `of` over that of `to`, at equal N.
    VarianceRatio,
    /// 1/(variance × seconds) of `of` over that of `to`.
    EfficiencyRatio,
    /// Slope of log error over log N of `of`.
    Slope,
}

/// A statement to be tested, as an experiment file states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// The statement in words.
    pub text: String,
    /// What it speaks of.
    pub kind: Kind,
    /// The strategy it is about.
    pub of: String,
    /// The strategy it is compared with (ratios only).
    pub to: Option<String>,
    /// The quantity is at most this.
    pub at_most: Option<f64>,
    /// The quantity is at least this.
    pub at_least: Option<f64>,
    /// Confidence of the interval that decides.
    #[serde(default = "default_confidence")]
    pub confidence: f64,
    /// The scene; default: every scene.
    pub scene: Option<String>,
}

const fn default_confidence() -> f64 {
    0.99
}

impl Claim {
    /// What is wrong with the claim, if anything: unknown names, missing thresholds.
    pub fn check(&self, strategies: &[&str], scenes: &[&str]) -> Result<(), String> {
        let known = |what: &str, name: &str, all: &[&str]| {
            let hint = crate::error::suggestion(name, all.iter().copied()).map(|s| format!("; did you mean `{s}`?"));
            match all.contains(&name) {
                true => Ok(()),
                false => Err(format!(
                    "no {what} is named `{name}` (there are {}){}",
                    all.join(", "),
                    hint.unwrap_or_default()
                )),
            }
        };
        known("strategy", &self.of, strategies)?;
        match (self.kind, &self.to) {
            (Kind::Slope, Some(_)) => return Err("a slope is of one strategy; `to` has no meaning".into()),
            (Kind::Slope, None) => {}
            (_, None) => return Err("a ratio needs `to`, the strategy to compare with".into()),
            (_, Some(to)) => known("strategy", to, strategies)?,
        }
        if let Some(scene) = &self.scene {
            known("scene", scene, scenes)?;
        }
        if !(self.confidence > 0.5 && self.confidence < 1.0) {
            return Err(format!("confidence {} is not between 0.5 and 1", self.confidence));
        }
        let finite = |x: Option<f64>| x.is_none_or(f64::is_finite);
        match (self.at_least, self.at_most) {
            (None, None) => Err("a claim needs `at_most`, `at_least` or both".into()),
            (Some(a), Some(b)) if a > b => Err(format!("at_least {a} is above at_most {b}")),
            (a, b) if !finite(a) || !finite(b) => Err("thresholds must be finite".into()),
            _ => Ok(()),
        }
    }

    /// Judges the claim on every scene that it speaks of.
    pub fn judge(&self, scenes: &[SceneResult]) -> Vec<ClaimResult> {
        let mine = |s: &&SceneResult| self.scene.as_ref().is_none_or(|name| *name == s.name);
        scenes.iter().filter(mine).map(|scene| self.judge_scene(scene)).collect()
    }

    fn judge_scene(&self, scene: &SceneResult) -> ClaimResult {
        let find = |name: &str| scene.strategies.iter().find(|s| s.name == name);
        let interval = self.measure(find(&self.of), self.to.as_deref().and_then(find));
        let verdict = self.verdict(&interval);
        ClaimResult {
            text: self.text.clone(),
            scene: scene.name.clone(),
            interval,
            verdict,
            sentence: self.sentence(&interval, verdict),
        }
    }

    fn measure(&self, of: Option<&StrategyResult>, to: Option<&StrategyResult>) -> Interval {
        let unknown = Interval { estimate: f64::NAN, lower: None, upper: None, confidence: self.confidence };
        match (self.kind, of, to) {
            (Kind::VarianceRatio, Some(a), Some(b)) => variance_ratio(a, b, self.confidence),
            (Kind::EfficiencyRatio, Some(a), Some(b)) => efficiency_ratio(a, b, self.confidence),
            (Kind::Slope, Some(a), _) => {
                a.slope.as_ref().map_or(unknown, |s| mean_interval(&s.values, self.confidence))
            }
            _ => unknown,
        }
    }

    /// Supported if the whole interval satisfies the thresholds, refuted if all of it violates one, else inconclusive.
    fn verdict(&self, i: &Interval) -> Verdict {
        let (Some(lower), Some(upper)) = (i.lower, i.upper) else { return Verdict::Inconclusive };
        let above = self.at_least.unwrap_or(f64::NEG_INFINITY);
        let below = self.at_most.unwrap_or(f64::INFINITY);
        if lower >= above && upper <= below {
            Verdict::Supported
        } else if upper < above || lower > below {
            Verdict::Refuted
        } else {
            Verdict::Inconclusive
        }
    }

    fn sentence(&self, i: &Interval, verdict: Verdict) -> String {
        let claimed = match (self.at_least, self.at_most) {
            (Some(a), Some(b)) => format!("claimed: {a} to {b}"),
            (Some(a), None) => format!("claimed: at least {a}"),
            (None, Some(b)) => format!("claimed: at most {b}"),
            (None, None) => "nothing claimed".into(),
        };
        let (Some(lower), Some(upper)) = (i.lower, i.upper) else {
            return format!("no interval could be formed ({claimed})");
        };
        let range = format!("{} to {}", significant(lower, 3), significant(upper, 3));
        let of = &self.of;
        let to = self.to.as_deref().unwrap_or_default();
        let what = match self.kind {
            Kind::VarianceRatio => format!("{of} has {range} times the variance of {to} at equal N"),
            Kind::EfficiencyRatio => format!("{of} has {range} times the efficiency of {to}"),
            Kind::Slope => format!("the error of {of} falls as N to the power {range}"),
        };
        let open = if verdict == Verdict::Inconclusive { "; the interval straddles the threshold" } else { "" };
        format!("{} confident: {what} ({claimed}{open})", percent(self.confidence))
    }
}
