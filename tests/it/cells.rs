//! Files that keep estimates: whatever happens to them, they give what was written or say that they are damaged.

use crate::stats::Random;
use rootn::Error;
use rootn::estimator::integrand::{Integrand, IntegrandEstimator};
use rootn::estimator::{Cell, Estimate, Estimator};
use rootn::moments::Moments;
use rootn::moments::cell::{CellFolder, Checkpoint};
use rootn::sampling::Sequence;
use rootn::sampling::rng::Key;
use std::path::{Path, PathBuf};

const IDENTITY: &str = "a test · seed 1";
const SAMPLES: u64 = 100;
const PIXELS: usize = 6;

fn estimate() -> Estimate {
    let estimator = IntegrandEstimator { integrand: Integrand::Root, size: [3, 2], sequence: Sequence::Independent };
    estimator.estimate(&Cell { key: Key([1, 2]), length: SAMPLES }, SAMPLES, &mut None).unwrap()
}

struct Kept {
    _folder: tempfile::TempDir,
    cell: CellFolder,
    checkpoint: PathBuf,
    state: PathBuf,
    estimate: Estimate,
}

impl Kept {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let cell = CellFolder::new(folder.path(), IDENTITY.into());
        let estimate = estimate();
        cell.save_checkpoint(SAMPLES, &Checkpoint::of(&estimate)).unwrap();
        cell.save_state(&estimate, PIXELS, 1).unwrap();
        let inside = folder.path().join(cell.hash());
        Self {
            cell,
            checkpoint: inside.join(format!("{SAMPLES}.cell")),
            state: inside.join("state.cell"),
            estimate,
            _folder: folder,
        }
    }

    /// Loads the file with these bytes and demands that it is told as damaged.
    fn refuses(&self, path: &Path, bytes: &[u8], what: &str) {
        std::fs::write(path, bytes).unwrap();
        let error = if path == self.state {
            self.cell.load_state(PIXELS, 1).map(|s| s.is_some()).err()
        } else {
            self.cell.load_checkpoint(SAMPLES, PIXELS).map(|c| c.is_some()).err()
        };
        let Some(error) = error else { panic!("{what}: not noticed") };
        assert!(matches!(error, Error::Damaged { .. }) && error.exit_code() == 4, "{what}: {error}");
        assert!(error.to_string().contains(path.file_name().unwrap().to_str().unwrap()), "{error}");
    }
}

/// The same file with another header or payload and a checksum that holds.
fn forged(bytes: &[u8], header: impl Fn(&str) -> String, payload: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let length = u64::from_le_bytes(bytes[12..20].try_into().unwrap()) as usize;
    let text = header(std::str::from_utf8(&bytes[20..20 + length]).unwrap());
    let mut rest = bytes[20 + length..bytes.len() - 32].to_vec();
    payload(&mut rest);
    let mut out = bytes[..12].to_vec();
    out.extend((text.len() as u64).to_le_bytes());
    out.extend(text.as_bytes());
    out.extend(rest);
    sealed(out)
}

fn sealed(mut body: Vec<u8>) -> Vec<u8> {
    let checksum = blake3::hash(&body);
    body.extend(checksum.as_bytes());
    body
}

#[test]
fn what_was_kept_comes_back() {
    let kept = Kept::new();
    let checkpoint = kept.cell.load_checkpoint(SAMPLES, PIXELS).unwrap().unwrap();
    assert_eq!(checkpoint, Checkpoint::of(&kept.estimate));
    let state = kept.cell.load_state(PIXELS, 1).unwrap().unwrap();
    assert_eq!((state.field, state.abscissa), (kept.estimate.field.clone(), SAMPLES));
    assert_eq!(state.moments, kept.estimate.moments);
    assert_eq!(state.seconds, kept.estimate.seconds);
    assert!(kept.cell.has(SAMPLES) && !kept.cell.has(SAMPLES + 1));
    assert!(kept.cell.load_checkpoint(SAMPLES + 1, PIXELS).unwrap().is_none());
    kept.cell.remove().unwrap();
    kept.cell.remove().unwrap();
    assert!(kept.cell.load_state(PIXELS, 1).unwrap().is_none() && !kept.cell.has(SAMPLES));
}

#[test]
fn truncated_and_flipped_files_are_refused() {
    let kept = Kept::new();
    let mut random = Random::new("damaged cells");
    for path in [&kept.checkpoint, &kept.state] {
        let bytes = std::fs::read(path).unwrap();
        for length in (0..bytes.len()).filter(|l| l % 7 == 0 || *l < 64 || bytes.len() - l < 64) {
            kept.refuses(path, &bytes[..length], &format!("first {length} bytes"));
        }
        for longer in [1, 8, 32, 1000] {
            kept.refuses(path, &[&bytes[..], &vec![0; longer]].concat(), "longer");
        }
        for _ in 0..500 {
            let mut bytes = bytes.clone();
            let (at, bit) = (random.below(bytes.len() as u64) as usize, random.below(8));
            bytes[at] ^= 1 << bit;
            kept.refuses(path, &bytes, &format!("bit {bit} of byte {at}"));
        }
        kept.refuses(path, &[], "empty");
        kept.refuses(path, &vec![0; bytes.len()], "zeros");
    }
}

#[test]
fn files_that_lie_are_refused() {
    let kept = Kept::new();
    let whole = |path: &Path| std::fs::read(path).unwrap();
    for path in [kept.checkpoint.clone(), kept.state.clone()] {
        let bytes = whole(&path);
        let with = |from: usize, to: &[u8]| {
            let mut body = bytes[..bytes.len() - 32].to_vec();
            body[from..from + to.len()].copy_from_slice(to);
            sealed(body)
        };
        assert_eq!(with(0, b"rootncel"), bytes, "the forger's checksum is ours");
        kept.refuses(&path, &with(0, b"notncell"), "magic");
        kept.refuses(&path, &with(8, &7u32.to_le_bytes()), "version");
        for length in [0, 1, 1 << 20, 1 << 40, u64::MAX] {
            kept.refuses(&path, &with(12, &length.to_le_bytes()), "length of the header");
        }
        let replaced = |from: &'static str, to: &'static str| {
            let forged = forged(&bytes, |h| h.replace(from, to), |_| {});
            assert_ne!(forged, bytes, "{from}");
            forged
        };
        let lies = [
            ("seed 1", "seed 2"),
            ("\"samples\":100", "\"samples\":64"),
            ("\"samples\":100", "\"samples\":101"),
            ("\"samples\":100", "\"samples\":18446744073709551615"),
            ("\"samples\":100", "\"samples\":-1"),
            ("\"values\":6", "\"valuez\":6"),
            ("\"seconds\":", "\"seconds\":null,\"x\":"),
            ("{", "["),
        ];
        for (from, to) in lies {
            kept.refuses(&path, &replaced(from, to), &format!("{from} → {to}"));
        }
        for change in
            [|p: &mut Vec<u8>| p.clear(), |p: &mut Vec<u8>| p.truncate(p.len() - 1), |p: &mut Vec<u8>| p.extend([0; 8])]
        {
            kept.refuses(&path, &forged(&bytes, str::to_owned, change), "payload");
        }
        std::fs::write(&path, &bytes).unwrap();
    }
    let (checkpoint, state) = (whole(&kept.checkpoint), whole(&kept.state));
    for values in ["7", "3", "0", "18446744073709551615"] {
        let lie = forged(&checkpoint, |h| h.replace("\"values\":6", &format!("\"values\":{values}")), |_| {});
        kept.refuses(&kept.checkpoint, &lie, "values");
    }
    for (pixels, channels) in [("3", "2"), ("12", "1"), ("6", "0"), ("18446744073709551615", "1")] {
        let header = |h: &str| {
            h.replace("\"pixels\":6", &format!("\"pixels\":{pixels}"))
                .replace("\"channels\":1", &format!("\"channels\":{channels}"))
        };
        kept.refuses(&kept.state, &forged(&state, header, |_| {}), "shape");
    }
    // The count inside a node.
    let size = size_of::<Moments>();
    kept.refuses(&kept.state, &forged(&state, str::to_owned, |p| p[size] ^= 1), "count of a node");
    // One kind of file in the place of the other.
    kept.refuses(&kept.checkpoint, &state, "a state as a checkpoint");
    kept.refuses(&kept.state, &checkpoint, "a checkpoint as a state");
}

#[test]
fn folders_where_files_should_be_are_an_error() {
    let kept = Kept::new();
    for path in [&kept.checkpoint, &kept.state] {
        std::fs::remove_file(path).unwrap();
        std::fs::create_dir(path).unwrap();
    }
    assert_eq!(kept.cell.load_state(PIXELS, 1).unwrap_err().exit_code(), 4);
    assert_eq!(kept.cell.load_checkpoint(SAMPLES, PIXELS).unwrap_err().exit_code(), 4);
}
