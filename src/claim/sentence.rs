//! A verdict as one sentence with figures.

use super::{Claim, Equal, Kind, measure::Measure};
use crate::record::{ClaimResult, Interval};
use crate::stats::number::{about, confidence, percent, range, significant};

impl Claim {
    /// "99 % confident: mis has 0.21 to 0.24 times the variance of importance at equal spp (claimed: at most 0.5; 3.8 %
    /// beyond that would have been seen with probability 0.9)".
    pub(super) fn sentence(&self, result: &ClaimResult, measure: &Measure) -> String {
        let mut notes = vec![self.claimed()];
        notes.extend(measure.remark.clone());
        if let Some(why) = &result.open {
            notes.push(why.clone());
        } else if let Some(effect) = result.detectable {
            notes.push(self.detected(effect));
        }
        let notes = notes.join("; ");
        let i = &result.interval;
        let (Some(lower), Some(upper)) = (i.lower, i.upper) else {
            return format!("nothing is known of {} ({notes})", self.subject());
        };
        if self.kind == Kind::Exact {
            return format!("{} ({notes})", self.statement(&significant(i.estimate, 3), &measure.abscissa));
        }
        let confident = confidence(i.confidence);
        if self.kind == Kind::Finite && i.estimate == 0.0 {
            let bound = significant(upper, 2);
            return format!(
                "{confident} confident: fewer than {bound} of the samples of {} are not finite ({notes})",
                self.of
            );
        }
        let range = self.range(i, lower, upper);
        format!("{confident} confident: {} ({notes})", self.statement(&range, &measure.abscissa))
    }

    /// "0.21 to 0.24", rounded alike, relative differences in percent.
    fn range(&self, i: &Interval, lower: f64, upper: f64) -> String {
        let (scale, unit) = if self.kind.has_margin() { (100.0, " %") } else { (1.0, "") };
        let sign = |x: f64| if self.kind.has_margin() && x > 0.0 { "+" } else { "" };
        let [low, high] = range(i.estimate * scale, lower * scale, upper * scale);
        match low == high {
            true => format!("{}{low}{unit}", sign(lower)),
            false => format!("{}{low} to {}{high}{unit}", sign(lower), sign(upper)),
        }
    }

    fn subject(&self) -> String {
        let to = self.to.as_ref().map(|to| format!(" against {to}")).unwrap_or_default();
        format!("the {} of {}{to}", self.kind.label().replace('-', " "), self.of)
    }

    fn statement(&self, range: &str, abscissa: &str) -> String {
        let (of, to) = (&self.of, self.to.as_deref().unwrap_or("the reference"));
        match self.kind {
            Kind::VarianceRatio => format!("{of} has {range} times the variance of {to} at equal {abscissa}"),
            Kind::ErrorRatio => {
                let equal = match self.equal.unwrap_or_default() {
                    Equal::Spp => abscissa,
                    Equal::Seconds => "seconds",
                };
                format!("{of} has {range} times the error of {to} at equal {equal}")
            }
            Kind::EfficiencyRatio => format!("{of} has {range} times the efficiency of {to}"),
            Kind::TimeToErrorRatio => {
                let error = self.error.unwrap_or(f64::NAN);
                format!("{of} takes {range} times the seconds of {to} to an error of {}", percent(error))
            }
            Kind::CostRatio => format!("a sample of {of} takes {range} times the seconds of one of {to}"),
            Kind::Unbiased | Kind::Agrees => format!("the mean of {of} differs from that of {to} by {range}"),
            Kind::Slope => format!("the error of {of} falls as N to the power {range}"),
            Kind::VarianceOfMean => {
                format!("the variance of {of}'s mean is {range} times what its samples' own variance predicts")
            }
            Kind::Exact => format!("the largest deviation of {of} from the exact reference is {range}, relative"),
            Kind::Finite => format!("{range} of the samples of {of} are not finite"),
        }
    }

    fn claimed(&self) -> String {
        match (self.margin, self.at_least, self.at_most, self.kind) {
            (Some(margin), ..) => format!("claimed: by at most {}", percent(margin)),
            (None, Some(a), Some(b), _) => format!("claimed: {} to {}", plain(a), plain(b)),
            (None, Some(a), None, _) => format!("claimed: at least {}", plain(a)),
            (None, None, Some(b), _) => format!("claimed: at most {}", plain(b)),
            (None, None, None, Kind::Finite) => "claimed: none".into(),
            (None, None, None, _) => "claimed: 0".into(),
        }
    }

    /// What this run could have seen.
    fn detected(&self, effect: f64) -> String {
        let effect = match self.kind {
            _ if self.kind.has_margin() => about(effect),
            _ if self.kind.is_ratio() && effect < 1.1 => about(effect - 1.0),
            _ if self.kind.is_ratio() => format!("a factor of {}", significant(effect, 2)),
            _ => significant(effect, 2),
        };
        format!("{effect} beyond that would have been seen with probability 0.9")
    }
}

/// A threshold as the author wrote it, but not in many zeros.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-4..1e7).contains(&x.abs()) { x.to_string() } else { significant(x, 3) }
}
