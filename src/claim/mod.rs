//! Claims about strategies, and verdicts on them: pure functions of results.

pub mod baseline;
mod measure;
mod sentence;

use crate::analysis::health::RestsOn;
use crate::record::{ClaimResult, Interval, SceneResult, StrategyResult, Verdict};
use crate::stats::number::significant;
use crate::stats::power::{detectable, factor};
use crate::stats::{Metric, student_t};
use measure::{Measure, Narrows};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a claim speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Weighted variance per sample of `of` over that of `to`, at equal N.
    VarianceRatio,
    /// Error of `of` over that of `to` (the headline metric, its root where it is a square), at equal spp or equal seconds.
    ErrorRatio,
    /// 1/(variance × seconds) of `of` over that of `to`.
    EfficiencyRatio,
    /// Seconds that `of` takes to reach `error` over those of `to`.
    TimeToErrorRatio,
    /// Seconds per sample of `of` over those of `to`.
    CostRatio,
    /// The mean of `of` is that of the reference (or of `to`) within `margin`, relative: an equivalence test.
    Unbiased,
    /// The means of `of` and `to` are the same within `margin`, relative; paired where both drew the same samples.
    Agrees,
    /// Slope of log error over log N of `of`.
    Slope,
    /// Variance of the replicates' means of `of` over its samples' own variance / N: 1 for independent samples.
    VarianceOfMean,
    /// Every value of `of` is the exact reference: the largest deviation, relative to the reference's mean size, is at most
    /// `at_most` (default 0).
    Exact,
    /// `of` has no sample that is not finite; with `at_most`: their rate is at most this.
    Finite,
}

/// At equal what two errors are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Equal {
    /// At the largest N that both have.
    #[default]
    Spp,
    /// At the seconds that the quicker one has taken in all.
    Seconds,
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
    /// The strategy it is compared with.
    pub to: Option<String>,
    /// The quantity is at most this.
    pub at_most: Option<f64>,
    /// The quantity is at least this.
    pub at_least: Option<f64>,
    /// Largest relative difference that counts as none (unbiased, agrees).
    pub margin: Option<f64>,
    /// The error that is to be reached (time-to-error-ratio), in the root of the headline metric.
    pub error: Option<f64>,
    /// At equal what errors are compared (error-ratio); default: spp.
    pub equal: Option<Equal>,
    /// Confidence of the interval that decides.
    #[serde(default = "default_confidence")]
    pub confidence: f64,
    /// What the quantity is in truth, for `rootn calibrate`; left out where it has no value, so that any decision is wrong.
    pub truth: Option<f64>,
    /// The scene; default: every scene.
    pub scene: Option<String>,
    /// Part of the field: first column, first row, and the column and row behind the last ones; default: all of it.
    pub region: Option<[u32; 4]>,
}

const fn default_confidence() -> f64 {
    0.99
}

/// Probability with which an effect is to be seen where a claim says what it could have detected and what would decide.
pub const POWER: f64 = 0.9;
/// What is aimed at to keep that: some runs find the effect but do not trust themselves (calibration: 3 to 5 % of runs on
/// exponential samples).
const AIM: f64 = 0.95;

/// How many times the share of the variance that is expected in larger samples than were seen must not change a verdict:
/// the mass of what is so rare follows about an exponential distribution, 98 % of which lies below.
const UNSEEN: f64 = 4.0;

/// What a sentence says where it does.
const UNSEEN_COUNTS: &str = "not by as much as rare samples that were not seen may add to the variance";

/// Data so many times as much are not asked for: whoever needs them has claimed the truth itself.
const MOST: f64 = 1e4;

impl Kind {
    /// The kind's name in files.
    pub fn label(self) -> String {
        let name = serde_json::to_value(self).expect("plain data");
        name.as_str().unwrap_or_default().to_owned()
    }

    /// Whether it compares two strategies: `None` where it may.
    const fn compares(self) -> Option<bool> {
        match self {
            Self::VarianceRatio | Self::ErrorRatio | Self::EfficiencyRatio => Some(true),
            Self::TimeToErrorRatio | Self::CostRatio | Self::Agrees => Some(true),
            Self::Unbiased => None,
            Self::Slope | Self::VarianceOfMean | Self::Exact | Self::Finite => Some(false),
        }
    }

    /// Whether the quantity is a ratio, so that its error is about even in the logarithm.
    const fn is_ratio(self) -> bool {
        match self {
            Self::VarianceRatio | Self::ErrorRatio | Self::EfficiencyRatio => true,
            Self::TimeToErrorRatio | Self::CostRatio | Self::VarianceOfMean => true,
            Self::Unbiased | Self::Agrees | Self::Slope | Self::Exact | Self::Finite => false,
        }
    }

    /// The quantity on the scale where its error is even.
    fn on_scale(self, x: f64) -> f64 {
        if self.is_ratio() { x.ln() } else { x }
    }

    /// The inverse.
    fn off_scale(self, x: f64) -> f64 {
        if self.is_ratio() { x.exp() } else { x }
    }

    /// Whether a margin takes the place of thresholds.
    const fn has_margin(self) -> bool {
        matches!(self, Self::Unbiased | Self::Agrees)
    }

    /// Whether it makes sense to ask what the run could have detected: not where one counterexample decides.
    const fn has_power(self) -> bool {
        !matches!(self, Self::Exact | Self::Finite)
    }

    /// How far the bounds of an interval may have to move, on the scale where errors are even, if the variances of `of` and `to`
    /// were larger by these shares.
    fn reach(self, of: f64, to: f64) -> [f64; 2] {
        let [of, to] = [of, to].map(|share| (1.0 + UNSEEN * share).ln());
        match self {
            Self::VarianceRatio | Self::TimeToErrorRatio => [to, of],
            Self::ErrorRatio => [0.5 * to, 0.5 * of],
            Self::EfficiencyRatio => [of, to],
            Self::VarianceOfMean => [of, of],
            _ => [0.0, 0.0],
        }
    }

    /// Which moment of the samples its interval rests on; `None` where on none.
    fn rests_on(self, of: &StrategyResult) -> Option<RestsOn> {
        match self {
            Self::Unbiased | Self::Agrees => Some(RestsOn::Mean),
            Self::VarianceOfMean => Some(RestsOn::Dispersion),
            Self::Slope => Some(RestsOn::Curve(of.slope.as_ref().map_or(1.0, |s| s.to as f64 / s.from as f64))),
            Self::CostRatio | Self::Exact | Self::Finite => None,
            _ => Some(RestsOn::Variance),
        }
    }
}

/// What an interval comes to.
struct Decision {
    verdict: Verdict,
    /// What stands in the way of a verdict, and what would decide.
    open: Option<String>,
    /// Whether it is that the interval is not to be trusted.
    doubtful: bool,
}

impl Claim {
    /// What is wrong with the claim, if anything: unknown names, missing or meaningless keys.
    pub fn check(&self, strategies: &[&str], scenes: &[&str]) -> Result<(), String> {
        known("strategy", &self.of, strategies)?;
        let kind = self.kind.label();
        match (self.kind.compares(), &self.to) {
            (Some(false), Some(_)) => return Err(format!("{kind} is of one strategy; `to` has no meaning")),
            (Some(true), None) => return Err(format!("{kind} needs `to`, the strategy to compare with")),
            (_, Some(to)) => known("strategy", to, strategies)?,
            (_, None) => {}
        }
        if self.to.as_ref() == Some(&self.of) {
            return Err(format!("`{}` is compared with itself", self.of));
        }
        if let Some(scene) = &self.scene {
            known("scene", scene, scenes)?;
        }
        if !(self.confidence > 0.5 && self.confidence < 1.0) {
            return Err(format!("confidence {} is not between 0.5 and 1", self.confidence));
        }
        if let Some([x0, y0, x1, y1]) = self.region.filter(|r| r[0] >= r[2] || r[1] >= r[3]) {
            return Err(format!(
                "region [{x0}, {y0}, {x1}, {y1}] is empty; it is [x0, y0, x1, y1] with x0 < x1 and y0 < y1"
            ));
        }
        if self.region.is_some() && self.kind == Kind::Finite {
            return Err("finite speaks of the whole field; `region` has no meaning".into());
        }
        if self.truth.is_some() && !self.kind.has_power() {
            return Err(format!("{kind} has no `truth`: one counterexample decides it"));
        }
        if self.truth.is_some_and(|t| !(t.is_finite() && (t > 0.0 || !self.kind.is_ratio()))) {
            return Err(format!("truth {} is no value that a {kind} can have", self.truth.unwrap_or_default()));
        }
        self.check_keys(&kind)?;
        self.check_thresholds(&kind)
    }

    /// Keys that belong to one kind only.
    fn check_keys(&self, kind: &str) -> Result<(), String> {
        let positive = |key: &str, value: Option<f64>, wanted: bool| match value {
            Some(_) if !wanted => Err(format!("{kind} has no `{key}`")),
            None if wanted => Err(format!("{kind} needs `{key}`")),
            Some(x) if !(x > 0.0 && x.is_finite()) => Err(format!("{key} {x} is not a positive number")),
            _ => Ok(()),
        };
        positive("margin", self.margin, self.kind.has_margin())?;
        positive("error", self.error, self.kind == Kind::TimeToErrorRatio)?;
        match self.equal {
            Some(_) if self.kind != Kind::ErrorRatio => Err(format!("{kind} has no `equal`")),
            _ => Ok(()),
        }
    }

    fn check_thresholds(&self, kind: &str) -> Result<(), String> {
        let finite = |x: Option<f64>| x.is_none_or(f64::is_finite);
        match (self.at_least, self.at_most) {
            (None, None) if self.kind.has_margin() || matches!(self.kind, Kind::Exact | Kind::Finite) => Ok(()),
            (_, _) if self.kind.has_margin() => Err(format!("{kind} has a `margin`, no `at_least` and `at_most`")),
            (Some(_), _) if matches!(self.kind, Kind::Exact | Kind::Finite) => Err(format!("{kind} has no `at_least`")),
            (None, None) => Err("a claim needs `at_most`, `at_least` or both".into()),
            (Some(a), Some(b)) if a > b => Err(format!("at_least {a} is above at_most {b}")),
            (a, b) if !finite(a) || !finite(b) => Err("thresholds must be finite".into()),
            _ => Ok(()),
        }
    }

    /// Whether the claim is about this scene.
    pub fn speaks_of(&self, scene: &str) -> bool {
        self.scene.as_deref().is_none_or(|name| name == scene)
    }

    /// How far a truth lies beyond the threshold that it violates, on the scale where errors are even; `None` where it violates
    /// none.
    pub(crate) fn violation(&self, truth: f64) -> Option<f64> {
        let [least, most] = self.thresholds().map(|t| self.kind.on_scale(t));
        let truth = self.kind.on_scale(truth);
        let beyond = (least - truth).max(truth - most);
        (beyond > 0.0).then_some(beyond)
    }

    /// By what factor a run's data must grow to see an effect this far beyond a threshold, where it could have seen `result`'s.
    pub(crate) fn growth(&self, result: &ClaimResult, violation: f64) -> Option<f64> {
        let growth = (self.kind.on_scale(result.detectable?) / violation).powi(2);
        growth.is_finite().then_some(growth)
    }

    /// Probability of a wrong verdict at most: that of an interval beyond either threshold.
    pub(crate) fn nominal_error(&self) -> f64 {
        let [least, most] = self.thresholds();
        (1.0 - self.confidence) * if least.is_finite() && most.is_finite() { 1.0 } else { 0.5 }
    }

    /// Where the quantity must lie.
    fn thresholds(&self) -> [f64; 2] {
        match (self.margin, self.kind) {
            (Some(margin), _) => [-margin, margin],
            (None, Kind::Exact | Kind::Finite) => [f64::NEG_INFINITY, self.at_most.unwrap_or(0.0)],
            _ => [self.at_least.unwrap_or(f64::NEG_INFINITY), self.at_most.unwrap_or(f64::INFINITY)],
        }
    }

    /// Judges the claim on a scene, errors in this headline metric; `share` of the claim's error probability may be spent on it.
    pub fn judge(&self, scene: &SceneResult, metric: Metric, share: f64) -> ClaimResult {
        let measure = self.measure(scene, metric, 1.0 - (1.0 - self.confidence) * share);
        self.judge_measure(&scene.name, &measure)
    }

    fn judge_measure(&self, scene: &str, measure: &Measure) -> ClaimResult {
        let Decision { verdict, open, doubtful } = self.decide(measure);
        let confidence = measure.interval.confidence;
        let result = ClaimResult {
            text: self.text.clone(),
            kind: self.kind.label(),
            scene: scene.to_owned(),
            replicates: measure.replicates,
            interval: measure.interval,
            verdict,
            sentence: String::new(),
            detectable: self
                .error(measure)
                .filter(|_| self.kind.has_power())
                .map(|error| self.kind.off_scale(detectable(error, measure.degrees, confidence, AIM))),
            open,
            doubtful,
        };
        ClaimResult { sentence: self.sentence(&result, measure), ..result }
    }

    /// Supported if the whole interval satisfies the thresholds, refuted if all of it violates one, else inconclusive, with
    /// what stands in the way.
    fn decide(&self, measure: &Measure) -> Decision {
        let decided = |verdict| Decision { verdict, open: None, doubtful: false };
        let open = |why, doubtful| Decision { verdict: Verdict::Inconclusive, open: Some(why), doubtful };
        if let Some(doubt) = &measure.doubt {
            return open(doubt.clone(), true);
        }
        let Interval { lower: Some(lower), upper: Some(upper), .. } = measure.interval else {
            return open("no interval could be formed".into(), true);
        };
        if self.kind == Kind::Finite && self.at_most.is_none() {
            // Nothing found supports it; the sentence says how rare what was not found may be.
            return decided(if lower > 0.0 { Verdict::Refuted } else { Verdict::Supported });
        }
        let move_by = |x: f64, by: f64| self.kind.off_scale(self.kind.on_scale(x) + by);
        let [down, up] = measure.reach;
        match self.compare(lower, upper) {
            None => open(self.would_decide(measure), false),
            Some(verdict) if self.compare(move_by(lower, -down), move_by(upper, up)) == Some(verdict) => {
                decided(verdict)
            }
            Some(_) => open(format!("the interval is clear of the threshold, but {UNSEEN_COUNTS}"), true),
        }
    }

    /// What an interval says against the thresholds; `None` where it straddles one.
    fn compare(&self, lower: f64, upper: f64) -> Option<Verdict> {
        let [least, most] = self.thresholds();
        if lower >= least && upper <= most {
            Some(Verdict::Supported)
        } else if upper < least || lower > most {
            Some(Verdict::Refuted)
        } else {
            None
        }
    }

    /// Standard error on the scale where it is even; `None` without bounds or doubt.
    fn error(&self, measure: &Measure) -> Option<f64> {
        let i = &measure.interval;
        let width = self.kind.on_scale(i.upper?) - self.kind.on_scale(i.lower?);
        let error = width / 2.0 / student_t(i.confidence, measure.degrees);
        (error.is_finite() && error > 0.0).then_some(error)
    }

    /// What would decide a claim whose interval straddles a threshold, if the estimate is about right.
    fn would_decide(&self, measure: &Measure) -> String {
        let straddles = "the interval straddles the threshold";
        if let (Kind::Finite, Some(upper), Some(rate), 0.0) =
            (self.kind, measure.interval.upper, self.at_most, measure.interval.estimate)
        {
            // Nothing was found; the bound falls as 1/samples.
            let replicates = round_up(upper / rate * f64::from(measure.replicates));
            return format!("{straddles}; if none is found in {replicates} replicates, they will decide");
        }
        let Some(error) = self.error(measure) else { return straddles.into() };
        let estimate = self.kind.on_scale(measure.interval.estimate);
        // Supporting a claim with two thresholds takes both.
        let distance = self
            .thresholds()
            .into_iter()
            .filter(|t| t.is_finite())
            .map(|t| (estimate - self.kind.on_scale(t)).abs())
            .fold(f64::INFINITY, f64::min);
        let times = factor(distance, error, measure.degrees, measure.interval.confidence, AIM).map(|f| f.max(1.0));
        match times.filter(|&f| f <= MOST) {
            None => format!("{straddles}, and the estimate lies on it: no budget would decide"),
            Some(times) => {
                let budget = match measure.narrows {
                    Narrows::WithSamples(spp) => format!("{} {}", round_up(times * spp as f64), measure.abscissa),
                    Narrows::WithReplicates => {
                        format!("{} replicates", round_up(times * f64::from(measure.replicates)))
                    }
                };
                let seconds = significant(times * measure.seconds, 2);
                format!("{straddles}; {budget}, {seconds} s of sampling, would probably decide")
            }
        }
    }
}

/// An unknown name is an error with a suggestion.
pub(crate) fn known(what: &str, name: &str, all: &[&str]) -> Result<(), String> {
    if all.contains(&name) {
        return Ok(());
    }
    let hint = crate::error::did_you_mean(name, all.iter().copied());
    Err(format!("no {what} is named `{name}` (there are {}){hint}", all.join(", ")))
}

/// Up to two significant digits.
fn round_up(x: f64) -> u64 {
    let unit = 10f64.powf((x.max(1.0).log10().floor() - 1.0).max(0.0));
    ((x / unit).ceil() * unit) as u64
}
