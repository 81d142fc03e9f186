//! Philox4x32-10, the counter-based generator behind every random number.
//!
//! Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011, §3.3.

/// One Philox4x32 key: everything of a sample's identity that is fixed during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(pub [u32; 2]);

/// What a run's samples are for. Part of the key, so that no two purposes share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The measured run.
    Run,
    /// The reference it is measured against.
    Reference,
    /// Repetitions of a run that show how often its verdicts are right.
    Calibration,
}

impl Role {
    /// Name used in keys and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Reference => "reference",
            Self::Calibration => "calibration",
        }
    }
}

impl Key {
    /// The key of one replicate: a BLAKE3 hash of (seed, role, strategy, replicate).
    /// `strategy` names everything of the strategy that determines samples ([`super::Strategy::identity`]).
    pub fn new(seed: u64, role: Role, strategy: &str, replicate: u32) -> Self {
        let mut h = blake3::Hasher::new_derive_key("rootn 2026 philox key");
        h.update(&seed.to_le_bytes());
        h.update(role.name().as_bytes());
        h.update(&[0]);
        h.update(strategy.as_bytes());
        h.update(&[0]);
        h.update(&replicate.to_le_bytes());
        let b = h.finalize();
        let b = b.as_bytes();
        Self([u32::from_le_bytes([b[0], b[1], b[2], b[3]]), u32::from_le_bytes([b[4], b[5], b[6], b[7]])])
    }
}

/// Philox4x32 with ten rounds: four random words per (counter, key). Bijective in the counter for a fixed key.
#[inline(always)]
pub fn philox4x32(mut c: [u32; 4], key: Key) -> [u32; 4] {
    let [mut k0, mut k1] = key.0;
    for _ in 0..10 {
        let p0 = u64::from(c[0]) * 0xD251_1F53;
        let p1 = u64::from(c[2]) * 0xCD9E_8D57;
        c = [(p1 >> 32) as u32 ^ c[1] ^ k0, p1 as u32, (p0 >> 32) as u32 ^ c[3] ^ k1, p0 as u32];
        k0 = k0.wrapping_add(0x9E37_79B9);
        k1 = k1.wrapping_add(0xBB67_AE85);
    }
    c
}

/// The float in \[0, 1) that stands for a word in f32 transport: multiples of 2⁻²⁴, never 1.
#[inline(always)]
pub fn unit_f32(word: u32) -> f32 {
    (word >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// An event of probability `p`, exact to 2⁻³²; certain from p = 1 on.
#[inline(always)]
pub fn happens(word: u32, p: f32) -> bool {
    // 2³² itself does not fit into a word.
    p >= 1.0 || word < (p * 4_294_967_296.0) as u32
}

/// The float in the open interval (0, 1) that stands for two words in f64 integrands, `hi` leading: odd multiples of 2⁻⁵³.
#[inline(always)]
pub fn unit_f64(hi: u32, lo: u32) -> f64 {
    let bits = (u64::from(hi) << 20) | u64::from(lo >> 12);
    (2 * bits + 1) as f64 * (1.0 / 9_007_199_254_740_992.0)
}
