//! Choices among finitely many outcomes by comparing 32-bit words with thresholds.

/// A discrete distribution whose probabilities are exact multiples of 2⁻³².
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    /// Smallest word of each outcome, ascending; the first is 0.
    first: Vec<u32>,
}

impl Discrete {
    /// Probabilities as close to the weights as 2⁻³² allows, but at least 2⁻³² each. Weights must be finite and positive.
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        // One unit for each, the rest by weight.
        let rest = (u64::from(u32::MAX) + 1).saturating_sub(weights.len() as u64) as f64;
        let mut before = 0.0;
        let first = weights.iter().enumerate().map(|(i, w)| {
            let units = (before / total * rest).round() as u64 + i as u64;
            before += w;
            u32::try_from(units).unwrap_or(u32::MAX)
        });
        Self { first: first.collect() }
    }

    /// Bytes of its table.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.first[..])
    }

    /// Whether there is nothing to choose from.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// The smallest word of each outcome.
    pub fn thresholds(&self) -> &[u32] {
        &self.first
    }

    /// The outcome that a word stands for. The table must not be empty.
    #[inline(always)]
    pub fn pick(&self, word: u32) -> usize {
        self.first.partition_point(|&f| f <= word) - 1
    }

    /// Probability of an outcome.
    #[inline(always)]
    pub fn pmf(&self, outcome: usize) -> f32 {
        let end = self.first.get(outcome + 1).map_or(1 << 32, |&f| u64::from(f));
        (end - u64::from(self.first[outcome])) as f32 * (1.0 / 4_294_967_296.0)
    }
}
