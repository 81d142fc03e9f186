//! Comparison of a shader's functions with their twins: inputs by pattern, answers with their units, and sabotage.

use crate::support::seed;
use rayon::prelude::*;
use rootn::estimator::vulkan::Device;
use rootn::estimator::vulkan::kernel::{TEST_INPUTS, run_test};
use rootn::math::{Vec3, warp};
use rootn::sampling::Key;
use rootn::sampling::rng::{philox4x32, unit_f32};
use std::sync::Arc;

/// Words that a test kernel writes per invocation.
const OUTPUTS: usize = 16;
/// Inputs of one dispatch, and of a function of floats.
const CHUNK: usize = 1 << 17;
/// Relative change of inputs that shows what their last digits mean.
const NUDGE: f32 = 1.0 / 1_048_576.0;
/// Where devices take numbers below the smallest normal one for 0, differences of a few of these mean nothing.
const NOTHING: f32 = 4.0 * f32::MIN_POSITIVE;
/// Relative change of inputs that no comparison may overlook.
const SABOTAGE: f32 = 1e-4;

/// The inputs of an invocation, read as the shaders read them.
#[derive(Clone, Copy)]
pub(super) struct Words([u32; TEST_INPUTS]);

impl Words {
    pub(super) fn w(&self, k: usize) -> u32 {
        self.0[k]
    }
    pub(super) fn w4(&self, k: usize) -> [u32; 4] {
        [0, 1, 2, 3].map(|i| self.0[k + i])
    }
    pub(super) fn w64(&self, k: usize) -> u64 {
        u64::from(self.0[k]) | u64::from(self.0[k + 1]) << 32
    }
    pub(super) fn f(&self, k: usize) -> f32 {
        f32::from_bits(self.0[k])
    }
    pub(super) fn f2(&self, k: usize) -> [f32; 2] {
        [self.f(k), self.f(k + 1)]
    }
    pub(super) fn v(&self, k: usize) -> Vec3 {
        Vec3::new(self.f(k), self.f(k + 1), self.f(k + 2))
    }
}

/// How a word may move.
#[derive(Clone, Copy)]
pub(super) enum Step {
    Fixed,
    /// A float that is precise relative to this.
    Float(f32),
    /// A float in [0, 1).
    Unit,
    /// A word that stands for one.
    Word,
}

impl Step {
    fn moved(self, word: u32, by: f32) -> u32 {
        let x = f32::from_bits(word);
        match self {
            Self::Fixed => word,
            Self::Float(size) => (x + by * size).to_bits(),
            Self::Unit => (x + by).clamp(0.0, 1.0 - f32::EPSILON / 2.0).to_bits(),
            Self::Word => (f64::from(word) + f64::from(by) * 4_294_967_296.0) as u32,
        }
    }
}

/// The inputs of one invocation while they are made, and the random numbers that they are made of.
pub(super) struct Input {
    words: Words,
    steps: [Step; TEST_INPUTS],
    used: usize,
    key: Key,
    index: u32,
    drawn: u32,
}

impl Input {
    pub(super) fn new(key: Key, index: u32) -> Self {
        let (words, steps) = (Words([0; TEST_INPUTS]), [Step::Fixed; TEST_INPUTS]);
        Self { words, steps, used: 0, key, index, drawn: 0 }
    }

    /// What has been put so far.
    pub(super) fn words(&self) -> Words {
        self.words
    }
    pub(super) fn random(&mut self) -> u32 {
        self.drawn += 1;
        philox4x32([self.index, self.drawn, 0, 0], self.key)[0]
    }
    pub(super) fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.random()) * u64::from(n)) >> 32) as u32
    }
    pub(super) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u32) as usize]
    }
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * unit_f32(self.random())
    }
    /// 2^low to 2^high, every power equally often.
    pub(super) fn size(&mut self, low: i32, high: i32) -> f32 {
        let exponent = low + self.below((high - low) as u32) as i32;
        2f32.powi(exponent) * self.between(1.0, 2.0)
    }
    pub(super) fn signed(&mut self, low: i32, high: i32) -> f32 {
        let sign = self.pick(&[-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0, -0.0]);
        sign * self.size(low, high)
    }
    /// A word; one in eight lies on an edge.
    pub(super) fn word(&mut self) -> u32 {
        if self.below(8) == 0 { self.pick(&[0, 255, 1 << 31, u32::MAX]) } else { self.random() }
    }
    pub(super) fn sphere(&mut self) -> Vec3 {
        warp::sample_uniform_sphere([self.between(0.0, 1.0), self.between(0.0, 1.0)])
    }
    /// A unit vector, often along an axis, close to −z or close to the horizon.
    pub(super) fn direction(&mut self) -> Vec3 {
        let v = self.sphere();
        match self.below(16) {
            0 => Vec3::NEG_Z,
            1 => Vec3::new(0.0, -0.0, -1.0),
            2 => (Vec3::NEG_Z + 1e-4 * v).normalize(),
            3 => self.pick(&[Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z]),
            4 => (v * Vec3::new(1.0, 1.0, 1e-5)).normalize(),
            _ => v,
        }
    }
    pub(super) fn any_vector(&mut self, low: i32, high: i32) -> Vec3 {
        if self.below(32) == 0 { Vec3::ZERO } else { self.direction() * self.size(low, high) }
    }

    pub(super) fn put(&mut self, word: u32, step: Step) {
        (self.words.0[self.used], self.steps[self.used]) = (word, step);
        self.used += 1;
    }
    pub(super) fn fixed(&mut self, words: &[u32]) {
        words.iter().for_each(|&w| self.put(w, Step::Fixed));
    }
    pub(super) fn float(&mut self, x: f32) {
        self.put(x.to_bits(), if x.is_finite() { Step::Float(x.abs()) } else { Step::Fixed });
    }
    /// A vector whose digits count relative to `size` if that is larger.
    pub(super) fn sized(&mut self, v: Vec3, size: f32) {
        let size = v.abs().max_element().max(size);
        v.to_array().into_iter().for_each(|x| self.put(x.to_bits(), Step::Float(size)));
    }
    pub(super) fn vector(&mut self, v: Vec3) {
        self.sized(v, 0.0);
    }

    /// An argument: a letter for its kind.
    fn argument(&mut self, kind: char) {
        match kind {
            // Below 2, 3 … outcomes.
            '2'..='9' => {
                let word = self.below(u32::from(kind) - u32::from('0'));
                self.fixed(&[word]);
            }
            // A word, and a float in [0, 1).
            'w' | 'u' => {
                let word = self.word();
                let unit = unit_f32(word).to_bits();
                if kind == 'w' { self.put(word, Step::Word) } else { self.put(unit, Step::Unit) }
            }
            // Floats: in [−1/8, 1/8], of any size or zero, below 10 or NaN, the height of a cone, a width.
            'e' | 's' | 'n' | 'c' | 'f' => {
                let x = match kind {
                    'e' => self.between(-0.125, 0.125),
                    's' => self.signed(-20, 20),
                    'n' if self.below(16) == 0 => f32::NAN,
                    'n' => self.signed(-3, 3),
                    'c' => self.size(-40, 1),
                    _ => self.size(-2, 3),
                };
                self.float(x);
            }
            // Vectors: a direction, of any size, with a square in range, or perhaps without one; a colour.
            'd' | 'v' | 'l' | 'h' | 'r' => {
                let huge = if kind == 'h' { self.below(8) } else { 8 };
                let v = match (kind, huge) {
                    ('d', _) => self.direction(),
                    ('v', _) => self.any_vector(-20, 20),
                    ('r', _) => self.sphere().abs(),
                    (_, 0) => self.any_vector(-100, -90),
                    (_, 1) => self.any_vector(90, 100),
                    _ => self.any_vector(-50, 60),
                };
                self.vector(v);
            }
            // The end of a ray: a point, its error, and a normal if it lies on a surface.
            _ => {
                let p = self.any_vector(-20, 20);
                let error = p.abs().max_element() * self.between(0.0, 1e-6);
                let normal = if self.below(8) == 0 { Vec3::ZERO } else { self.direction() };
                let error = self.sphere().abs() * error;
                [p, error, normal].into_iter().for_each(|v| self.vector(v));
            }
        }
    }
}

/// Makes arguments by a pattern of letters.
pub(super) fn of(pattern: &'static str) -> impl Fn(&mut Input) + Sync {
    move |r: &mut Input| pattern.chars().for_each(|kind| r.argument(kind))
}

/// What a function gives, in the words that its shader writes.
#[derive(Clone, Copy, Default)]
pub(super) struct Answer {
    words: [u32; OUTPUTS],
    /// What floats are precise relative to; 0: not a float, the bits count.
    sizes: [f32; OUTPUTS],
    /// Word 0 says whether there is an answer.
    decides: bool,
    /// It takes a decision that it does not tell, or one that slightly different inputs take otherwise.
    torn: bool,
}

impl Answer {
    pub(super) fn bits(mut self, at: usize, words: &[u32]) -> Self {
        self.words[at..at + words.len()].copy_from_slice(words);
        self
    }
    /// Floats of one vector, made of numbers up to `size`.
    pub(super) fn sized(mut self, at: usize, size: f32, values: &[f32]) -> Self {
        let finite = values.iter().filter(|v| v.is_finite());
        let size = finite.fold(size.max(f32::MIN_POSITIVE), |size, v| size.max(v.abs()));
        for (k, v) in (at..).zip(values) {
            (self.words[k], self.sizes[k]) = (v.to_bits(), size);
        }
        self
    }
    pub(super) fn floats(self, at: usize, values: &[f32]) -> Self {
        self.sized(at, 0.0, values)
    }
    pub(super) fn vector(self, at: usize, v: Vec3) -> Self {
        self.floats(at, &v.to_array())
    }
}

pub(super) fn float(x: f32) -> Answer {
    Answer::default().floats(0, &[x])
}

pub(super) fn vector(v: Vec3) -> Answer {
    Answer::default().vector(0, v)
}

/// An answer that there may be or not.
pub(super) fn decided<T>(found: Option<T>, put: impl FnOnce(Answer, T) -> Answer) -> Answer {
    let answer = Answer { decides: true, ..Answer::default() };
    found.map_or(answer, |found| put(answer.bits(0, &[1]), found))
}

/// Units between two words; infinite where they may not differ.
fn apart(got: u32, expected: u32, size: f32) -> f32 {
    let (g, e) = (f32::from_bits(got), f32::from_bits(expected));
    let off = (g - e).abs();
    if got == expected || (size > 0.0 && ((g.is_nan() && e.is_nan()) || off <= NOTHING)) {
        0.0
    } else if size > 0.0 && off.is_finite() {
        off / (f32::EPSILON * size)
    } else {
        f32::INFINITY
    }
}

/// What comparisons found.
#[derive(Clone, Copy, Default)]
struct Outcome {
    /// Largest difference that is allowed, units.
    worst: f32,
    /// Decisions, how many of them were yes, and answers that show that the device took one otherwise.
    decisions: usize,
    yes: usize,
    flips: usize,
    /// Other answers that differ by more than is allowed, and the first of these or those.
    beyond: usize,
    first: Option<usize>,
}

impl Outcome {
    fn new(index: usize, got: &[u32], answer: &Answer, ulps: f32) -> Self {
        let decisions = usize::from(answer.decides);
        let yes = decisions * answer.words[0] as usize;
        let units = (0..OUTPUTS).map(|k| apart(got[k], answer.words[k], answer.sizes[k])).fold(0.0, f32::max);
        if units <= ulps {
            return Self { worst: units, decisions, yes, ..Self::default() };
        }
        let flip = answer.torn || (answer.decides && got[0] != answer.words[0]);
        let (flips, beyond) = (usize::from(flip), usize::from(!flip));
        Self { decisions, yes, flips, beyond, first: Some(index), ..Self::default() }
    }

    fn and(self, other: Self) -> Self {
        Self {
            worst: self.worst.max(other.worst),
            decisions: self.decisions + other.decisions,
            yes: self.yes + other.yes,
            flips: self.flips + other.flips,
            beyond: self.beyond + other.beyond,
            first: self.first.or(other.first),
        }
    }

    /// One decision in 10⁴ may go the other way where rounding differs, and nothing else.
    fn is_sound(&self, inputs: usize) -> bool {
        self.beyond == 0 && self.flips * 10_000 <= inputs
    }
}

/// A shader of functions, with its tables.
pub(super) struct Program<'a> {
    pub(super) device: &'a Arc<Device>,
    pub(super) code: &'a [u8],
    pub(super) tables: &'a [u32],
    pub(super) addresses: &'a [(usize, &'a [u32])],
}

/// A row of the tables: a function, what it is called with, and its twin.
pub(super) struct Case<'a> {
    number: u32,
    name: String,
    /// Units that an answer may be off by.
    ulps: f32,
    make: Box<dyn Fn(&mut Input) + Sync + 'a>,
    twin: Box<dyn Fn(&Words) -> Answer + Sync + 'a>,
    inputs: usize,
    nudged: bool,
    hidden: bool,
}

impl<'a> Case<'a> {
    pub(super) fn new(
        number: u32,
        name: impl Into<String>,
        ulps: f32,
        make: impl Fn(&mut Input) + Sync + 'a,
        twin: impl Fn(&Words) -> Answer + Sync + 'a,
    ) -> Self {
        let (make, twin) = (Box::new(make), Box::new(twin));
        Self { number, name: name.into(), ulps, make, twin, inputs: CHUNK, nudged: false, hidden: false }
    }

    /// Integers only: bits, and more inputs.
    pub(super) fn exact(
        number: u32,
        name: &str,
        make: impl Fn(&mut Input) + Sync + 'a,
        twin: impl Fn(&Words) -> Answer + Sync + 'a,
    ) -> Self {
        Self { inputs: 8 * CHUNK, ..Self::new(number, name, 0.0, make, twin) }
    }

    pub(super) fn nudged(self) -> Self {
        Self { nudged: true, ..self }
    }

    pub(super) fn inputs(self, inputs: usize) -> Self {
        Self { inputs, ..self }
    }

    /// It takes decisions that its answers do not tell.
    pub(super) fn hidden(self) -> Self {
        Self { hidden: true, ..self }
    }

    fn input(&self, key: Key, index: u32) -> Input {
        let mut input = Input::new(key, index);
        (self.make)(&mut input);
        input
    }

    fn answer(&self, input: &Input) -> Answer {
        let mut answer = (self.twin)(&input.words);
        answer.torn = self.hidden;
        for (k, by) in (0..if self.nudged { input.used } else { 0 }).flat_map(|k| [(k, NUDGE), (k, -NUDGE)]) {
            let mut words = input.words;
            words.0[k] = input.steps[k].moved(words.0[k], by);
            if words.0[k] == input.words.0[k] {
                continue;
            }
            let near = (self.twin)(&words);
            if answer.decides && near.words[0] != answer.words[0] {
                answer.torn = true;
                continue;
            }
            for j in 0..OUTPUTS {
                let change = (f32::from_bits(near.words[j]) - f32::from_bits(answer.words[j])).abs() / NUDGE;
                if answer.sizes[j] > 0.0 && change.is_finite() {
                    answer.sizes[j] = answer.sizes[j].max(change);
                }
            }
        }
        answer
    }

    /// The answer for slightly different inputs; where these make no difference, a slightly different answer.
    fn sabotaged(&self, input: &Input) -> Answer {
        let answer = self.answer(input);
        let mut moved = input.words;
        for k in 0..TEST_INPUTS {
            moved.0[k] = input.steps[k].moved(moved.0[k], if k % 2 == 0 { SABOTAGE } else { -SABOTAGE });
        }
        let mut words = (self.twin)(&moved).words;
        if words == answer.words {
            for k in (0..OUTPUTS).filter(|&k| answer.sizes[k] > 0.0) {
                words[k] = (f32::from_bits(words[k]) * (1.0 + SABOTAGE)).to_bits();
            }
        }
        Answer { words, ..answer }
    }

    fn compare(&self, inputs: &[Input], got: &[u32], twin: impl Fn(&Input) -> Answer + Sync) -> Outcome {
        let both = inputs.par_iter().zip(got.par_chunks(OUTPUTS)).enumerate();
        both.map(|(i, (input, got))| Outcome::new(i, got, &twin(input), self.ulps))
            .reduce(Outcome::default, Outcome::and)
    }

    /// The device passes, and does not when the twin gets inputs that are off by 10⁻⁴.
    pub(super) fn check(&self, on: &Program) {
        let (name, seed) = (&self.name, seed(&self.name));
        let key = Key([seed as u32, (seed >> 32) as u32]);
        let mut all = Outcome::default();
        for first in (0..self.inputs).step_by(CHUNK) {
            let indices = first as u32..(first + CHUNK).min(self.inputs) as u32;
            let inputs: Vec<Input> = indices.into_par_iter().map(|i| self.input(key, i)).collect();
            let words: Vec<u32> = inputs.iter().flat_map(|i| i.words.0).collect();
            let constants = [(0, self.number)];
            // SAFETY: our build made the code, and the tables have what it reads.
            let got =
                unsafe { run_test(on.device, on.code, &constants, &words, OUTPUTS, on.tables, on.addresses) }.unwrap();
            assert_eq!(got.len(), inputs.len() * OUTPUTS, "{name}");
            let outcome = self.compare(&inputs, &got, |input| self.answer(input));
            if let Some(i) = outcome.first {
                let (given, expected) = (inputs[i].words.0, self.answer(&inputs[i]).words);
                println!("{name} of {given:x?}: {:x?}, expected {expected:x?}", &got[i * OUTPUTS..][..OUTPUTS]);
            }
            if first == 0 {
                let n = inputs.len().min(4096);
                let off = self.compare(&inputs[..n], &got[..n * OUTPUTS], |input| self.sabotaged(input));
                assert!(!off.is_sound(n), "{name}: inputs that are 1e-4 off must be rejected");
            }
            all = all.and(outcome);
        }
        let Outcome { worst, decisions, yes, flips, beyond, .. } = all;
        println!("{name}: off by {worst:.2} of {} units; {flips} of {decisions} decisions flipped", self.ulps);
        assert!(all.is_sound(self.inputs), "{name}: {beyond} answers and {flips} decisions differ");
        assert!(yes * 20 >= decisions, "{name}: {yes} of {decisions} have an answer: too few");
    }
}
