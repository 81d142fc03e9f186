//! What every statistical test shares: the suite's false-alarm budget and seeds made of test names.
//!
//! Policy. All statistical tests together may go red by chance in one edit out of a thousand (`ALPHA`). Each test asks
//! [`level`] for its share: `ALPHA` over the number of cells that all tests declare in `CELLS` (Bonferroni; a test with
//! several cells may use Holm inside its share). Seeds are hashes of the test's name, so a test gives the same answer
//! every run; `ROOTN_FRESH_SEEDS=n` mixes n into every seed.

/// False-alarm probability of the whole suite.
pub const ALPHA: f64 = 1e-3;

/// Every statistical test with the number of cells (single comparisons) it makes.
const CELLS: &[(&str, usize)] = &[
    ("permutations", 27),
    ("words", 144),
    ("runs", 18),
    ("directions", 3),
    ("cones", 5),
    ("planar", 2),
    ("filters", 5),
    ("diffuse", 3),
    ("rectangles", 26),
    ("triangles", 14),
    ("spheres", 9),
    ("disks and cylinders", 6),
    ("environments", 1),
    ("agreement", 50),
    ("closed forms", 245),
];

/// Significance level of one cell of the named test.
pub fn level(test: &str) -> f64 {
    assert!(CELLS.iter().any(|c| c.0 == test), "{test} is not declared in support::CELLS");
    ALPHA / CELLS.iter().map(|c| c.1).sum::<usize>() as f64
}

/// Seed of the named test.
pub fn seed(test: &str) -> u64 {
    let fresh = std::env::var("ROOTN_FRESH_SEEDS").unwrap_or_default();
    let hash = blake3::hash(format!("{test}/{fresh}").as_bytes());
    u64::from_le_bytes(hash.as_bytes()[..8].try_into().unwrap())
}
