//! What every statistical test shares: the suite's false-alarm budget and seeds made of test names.
//!
//! Policy. All statistical tests together may go red by chance in one edit out of a thousand (`ALPHA`). Each test asks
//! [`level`] for its share: `ALPHA` over the number of cells that all tests declare in `CELLS` (Bonferroni; a test with
//! several cells may use Holm inside its share). Seeds are hashes of the test's name, so a test gives the same answer
//! every run; `ROOTN_FRESH_SEEDS=n` mixes n into every seed.

/// False-alarm probability of the whole suite.
pub(crate) const ALPHA: f64 = 1e-3;

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
    ("visible normals", 24),
    ("glass and plastics", 42),
    ("rectangles", 26),
    ("triangles", 14),
    ("spheres", 9),
    ("disks and cylinders", 6),
    ("environments", 1),
    ("environment maps", 3),
    ("coverage of medians", 4),
    ("coverage of means", 3),
    ("coverage of ratios", 4),
    ("coverage of slopes", 2),
    ("coverage of forecasts of bent curves", 3),
    ("uniform p-values", 6),
    ("coverage of bootstraps", 4),
    ("tails", 15),
    ("repeated looks", 2),
    ("order of independent samples", 15),
    ("orders of spread points", 8),
    ("rare values", 1),
    ("agreement", 64),
    ("closed forms", 319),
];

/// Significance level of one cell of the named test.
pub(crate) fn level(test: &str) -> f64 {
    assert!(CELLS.iter().any(|c| c.0 == test), "{test} is not declared in support::CELLS");
    ALPHA / CELLS.iter().map(|c| c.1).sum::<usize>() as f64
}

/// Seed of the named test.
pub(crate) fn seed(test: &str) -> u64 {
    let fresh = std::env::var("ROOTN_FRESH_SEEDS").unwrap_or_default();
    let hash = blake3::hash(format!("{test}/{fresh}").as_bytes());
    u64::from_le_bytes(hash.as_bytes()[..8].try_into().unwrap())
}

/// A folder of the material shared between projects, beside this checkout. Where it is absent the test cannot run: `None`
/// with a printed reason, but a failure where `CI` is set.
pub(crate) fn shared(folder: &str) -> Option<std::path::PathBuf> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing", path.display());
    println!("skipped: {} is missing", path.display());
    None
}

/// Broken copies of an input, without end, the same for the same seed: cut short, bytes flipped, overwritten, inserted,
/// dropped or doubled, stretches moved, and numbers replaced by ones that readers stumble over. Some may still be valid.
pub(crate) fn mutations(bytes: &[u8], seed: u64) -> impl Iterator<Item = Vec<u8>> {
    const NUMBERS: [&str; 14] = [
        "nan",
        "-inf",
        "1e999",
        "-1",
        "0",
        "4294967295",
        "4294967296",
        "99999999999999999999",
        "-2147483649",
        "1e-320",
        "0x10",
        "",
        "1,5",
        "\u{e9}",
    ];
    let original = bytes.to_owned();
    let mut state = seed;
    // SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
    let mut random = move |below: usize| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % below.max(1) as u64) as usize
    };
    std::iter::repeat_with(move || {
        let mut bytes = original.clone();
        for _ in 0..=random(3) {
            let at = random(bytes.len());
            let end = at + random((bytes.len() - at).min(40));
            match random(8) {
                0 => bytes.truncate(at),
                1 if !bytes.is_empty() => bytes[at] ^= 1 << random(8),
                2 if !bytes.is_empty() => bytes[at] = [0, 0xff, b'<', b'"', b'\n', b'/', b'$', b'-'][random(8)],
                3 => bytes.insert(at, [0, 0xff, b'<', b'>', b'&', b'\\', b' ', b'9'][random(8)]),
                4 => drop(bytes.drain(at..end)),
                5 => drop(bytes.splice(end..end, bytes[at..end].to_owned())),
                6 => bytes[at..].rotate_left(end - at),
                _ => {
                    let digit = |b: &u8| b.is_ascii_digit();
                    let start = bytes[at..].iter().position(digit).map_or(at, |i| at + i);
                    let stop = bytes[start..].iter().position(|b| !digit(b)).map_or(bytes.len(), |i| start + i);
                    drop(bytes.splice(start..stop, NUMBERS[random(NUMBERS.len())].bytes()));
                }
            }
        }
        bytes
    })
}

/// The Vulkan device that tests run on, with the validation layer; the same for all tests. Where there is none the test cannot
/// run: `None` with a printed reason, but a failure where `CI` is set.
#[cfg(feature = "vulkan")]
pub(crate) fn vulkan() -> Option<std::sync::Arc<rootn::estimator::vulkan::Device>> {
    use rootn::estimator::choice::Which;
    use rootn::estimator::vulkan::Device;
    use std::sync::{Arc, OnceLock};
    static DEVICE: OnceLock<Result<Arc<Device>, String>> = OnceLock::new();
    let which = std::env::var("ROOTN_TEST_DEVICE").ok().and_then(|v| v.parse().ok()).map_or(Which::First, Which::Index);
    match DEVICE.get_or_init(|| Device::open(&which, true).map_err(|e| e.to_string())) {
        Ok(device) => Some(Arc::clone(device)),
        Err(e) => {
            assert!(std::env::var_os("CI").is_none(), "{e}");
            println!("skipped: {e}");
            None
        }
    }
}

/// Fails where the validation layer has said anything.
#[cfg(feature = "vulkan")]
pub(crate) fn no_messages(device: &rootn::estimator::vulkan::Device) {
    let messages = device.messages();
    assert!(messages.is_empty(), "{}", messages.join("\n"));
}
