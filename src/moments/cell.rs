//! Files that keep estimates: one folder per cell, named by the hash of what determines its samples.
//!
//! `<N>.cell` holds mean, sample variance and tail of every value at checkpoint N; `state.cell` the whole block tree of the newest estimate,
//! from which a run continues. Each file is replaced in one step and ends in a BLAKE3 checksum of all before it:
//! magic, version, length and text of a JSON header, payload (little endian), checksum.

use super::{BlockTree, Moments};
use crate::error::{Error, Result};
use crate::estimator::Estimate;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"rootncel";
const VERSION: u32 = 2;
const CHECKSUM: usize = 32;
/// Largest file that is read: 16 GiB would be a 10⁸-pixel state.
const LARGEST: u64 = 1 << 34;

/// What is kept of an estimate at a checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Seconds of sampling up to here.
    pub seconds: f64,
    /// Seconds that passed meanwhile: [`Estimate::wall_seconds`].
    pub wall_seconds: f64,
    /// Running mean of every value.
    pub mean: Vec<f64>,
    /// Sample variance S²/(n−1) of every value; NaN where n < 2. Empty for estimators without samples.
    pub variance: Vec<f64>,
    /// Tail of every value's samples. Empty for estimators without samples.
    pub tails: Vec<Tail>,
    /// Non-finite samples: count over all values.
    pub non_finite: u64,
    /// (pixel, sample) of the first ones.
    pub located: Vec<(u32, u64)>,
}

/// What a value's samples leave beside mean and variance, in few bytes: how heavy their tail is, and where the largest lies.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tail {
    /// Σ (x − mean)⁴ / (Σ (x − mean)²)², between 1/n and 1; 0 where all samples are equal.
    pub fourth: f32,
    /// Largest sample; −∞ where there is none.
    pub max: f32,
    /// Fraction of samples that were exactly 0.
    pub zeros: f32,
    /// Index of the largest sample, low word first.
    argmax: [u32; 2],
}

impl Tail {
    fn of(m: &Moments) -> Self {
        Self {
            fourth: if m.m2 > 0.0 { (m.m4 / (m.m2 * m.m2)) as f32 } else { 0.0 },
            max: m.max as f32,
            zeros: m.zeros as f32 / (m.n as f32).max(1.0),
            argmax: [m.argmax as u32, (m.argmax >> 32) as u32],
        }
    }

    /// Index of the largest sample.
    pub fn argmax(&self) -> u64 {
        u64::from(self.argmax[0]) | u64::from(self.argmax[1]) << 32
    }
}

impl Checkpoint {
    /// What an estimate leaves at a checkpoint.
    pub fn of(estimate: &Estimate) -> Self {
        let tree = estimate.moments.as_ref();
        Self {
            tails: tree.map(|t| t.fold_map(Tail::of)).unwrap_or_default(),
            seconds: estimate.seconds,
            wall_seconds: estimate.wall_seconds,
            mean: estimate.field.clone(),
            variance: tree.map(|t| t.fold_map(|m| m.sample_variance().unwrap_or(f64::NAN))).unwrap_or_default(),
            non_finite: tree.map_or(0, |t| t.nodes().iter().map(|m| m.non_finite).sum()),
            located: tree.map(|t| t.non_finite().to_vec()).unwrap_or_default(),
        }
    }
}

/// When a run's state is worth writing again: sampling that is not in it has taken two hundred times as long as writing took.
/// That bounds both what keeping states costs and, up to the next checkpoint, what a killed run does again.
#[derive(Clone, Copy, Debug)]
pub struct Saving {
    /// Seconds of sampling in the state on disk.
    kept: f64,
    /// Seconds that the last writing took; before the first, a guess.
    cost: f64,
}

impl Default for Saving {
    fn default() -> Self {
        Self::from_disk(0.0)
    }
}

impl Saving {
    /// For a state read from disk, with `kept` seconds of sampling in it.
    pub fn from_disk(kept: f64) -> Self {
        Self { kept, cost: 1e-3 }
    }

    /// Whether a state with `seconds` of sampling in it is worth writing.
    pub fn is_worth_it(&self, seconds: f64) -> bool {
        seconds - self.kept >= 200.0 * self.cost
    }

    /// Writes, and remembers what it cost.
    pub fn write(&mut self, folder: &CellFolder, estimate: &Estimate, pixels: usize, channels: usize) -> Result<()> {
        let start = std::time::Instant::now();
        folder.save_state(estimate, pixels, channels)?;
        *self = Self { kept: estimate.seconds, cost: start.elapsed().as_secs_f64() };
        Ok(())
    }
}

#[derive(Serialize, Deserialize)]
struct Header {
    identity: String,
    values: usize,
    samples: u64,
    seconds: f64,
    /// Absent in files of older versions.
    wall_seconds: Option<f64>,
    non_finite: u64,
    located: Vec<(u32, u64)>,
    pixels: usize,
    channels: usize,
}

/// The folder of one cell.
#[derive(Clone, Debug)]
pub struct CellFolder {
    path: PathBuf,
    identity: String,
}

impl CellFolder {
    /// The folder below `root` for samples determined by `identity`.
    pub fn new(root: &Path, identity: String) -> Self {
        // Files of other versions lie elsewhere.
        let hash = blake3::hash(format!("{VERSION} {identity}").as_bytes()).to_hex();
        Self { path: root.join(&hash[..24]), identity }
    }

    /// The hash that names the folder.
    pub fn hash(&self) -> String {
        self.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Forgets everything kept.
    pub fn remove(&self) -> Result<()> {
        match std::fs::remove_dir_all(&self.path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(&self.path, e)),
            _ => Ok(()),
        }
    }

    /// Removes what killed runs left half written. Files younger than an hour may be another run's that is still writing.
    pub fn tidy(root: &Path) {
        let cells = std::fs::read_dir(root).into_iter().flatten().flatten();
        let files = cells.filter_map(|cell| std::fs::read_dir(cell.path()).ok()).flatten().flatten();
        for file in files.filter(|f| f.file_name().as_encoded_bytes().starts_with(b".tmp")) {
            let age = file.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
            if age.is_some_and(|age| age.as_secs() > 3600) {
                // If it cannot be removed, nothing depends on it.
                let _ = std::fs::remove_file(file.path());
            }
        }
    }

    /// Forgets the state that a run continues from.
    pub fn remove_state(&self) -> Result<()> {
        let path = self.state();
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(&path, e)),
            _ => Ok(()),
        }
    }

    /// Whether the checkpoint's file exists (it may still turn out damaged).
    pub fn has(&self, checkpoint: u64) -> bool {
        self.file(checkpoint).exists()
    }

    fn file(&self, checkpoint: u64) -> PathBuf {
        self.path.join(format!("{checkpoint}.cell"))
    }

    fn state(&self) -> PathBuf {
        self.path.join("state.cell")
    }

    fn header(&self, values: usize, samples: u64, [seconds, wall_seconds]: [f64; 2]) -> Header {
        Header {
            identity: self.identity.clone(),
            values,
            samples,
            seconds,
            wall_seconds: Some(wall_seconds),
            non_finite: 0,
            located: Vec::new(),
            pixels: 0,
            channels: 0,
        }
    }

    /// Keeps a checkpoint.
    pub fn save_checkpoint(&self, samples: u64, c: &Checkpoint) -> Result<()> {
        let header = Header {
            non_finite: c.non_finite,
            located: c.located.clone(),
            ..self.header(c.mean.len(), samples, [c.seconds, c.wall_seconds])
        };
        write(
            &self.file(samples),
            &header,
            &[bytemuck::cast_slice(&c.mean), bytemuck::cast_slice(&c.variance), bytemuck::cast_slice(&c.tails)],
        )
    }

    /// Reads a checkpoint; `None` if there is none. `values` is the size that the field must have.
    pub fn load_checkpoint(&self, samples: u64, values: usize) -> Result<Option<Checkpoint>> {
        let path = self.file(samples);
        let Some((header, payload)) = read(&path)? else { return Ok(None) };
        self.check(&path, &header, samples)?;
        const NUMBER: usize = size_of::<f64>();
        const TAIL: usize = size_of::<Tail>();
        let lengths = [values * NUMBER, values * (2 * NUMBER + TAIL)];
        if header.values != values || !lengths.contains(&payload.len()) {
            return Err(Error::damaged(&path, format!("{} bytes for {values} values", payload.len())));
        }
        let (mean, rest) = payload.split_at(values * NUMBER);
        let (variance, tails) = rest.split_at(rest.len().min(values * NUMBER));
        Ok(Some(Checkpoint {
            seconds: header.seconds,
            wall_seconds: header.wall_seconds.unwrap_or(header.seconds),
            mean: list(mean),
            variance: list(variance),
            tails: list(tails),
            non_finite: header.non_finite,
            located: header.located,
        }))
    }

    /// Keeps the state that the run continues from.
    pub fn save_state(&self, estimate: &Estimate, pixels: usize, channels: usize) -> Result<()> {
        let Some(tree) = &estimate.moments else { return Ok(()) };
        let header = Header {
            pixels,
            channels,
            located: tree.non_finite().to_vec(),
            ..self.header(pixels * channels, tree.samples(), [estimate.seconds, estimate.wall_seconds])
        };
        write(&self.state(), &header, &[bytemuck::cast_slice(tree.nodes())])
    }

    /// Reads the newest state; `None` if there is none.
    pub fn load_state(&self, pixels: usize, channels: usize) -> Result<Option<Estimate>> {
        let path = self.state();
        let Some((header, payload)) = read(&path)? else { return Ok(None) };
        self.check(&path, &header, header.samples)?;
        let nodes: Vec<Moments> = list(&payload);
        let whole = payload.len().is_multiple_of(size_of::<Moments>());
        let fits = header.pixels == pixels && header.channels == channels && whole;
        let tree = fits
            .then(|| BlockTree::from_parts(pixels, channels, header.samples, nodes, header.located))
            .flatten()
            .ok_or_else(|| Error::damaged(&path, "its arrays do not fit its header"))?;
        let field = tree.fold_map(|m| m.mean);
        Ok(Some(Estimate {
            field,
            abscissa: tree.samples(),
            moments: Some(tree),
            seconds: header.seconds,
            wall_seconds: header.wall_seconds.unwrap_or(header.seconds),
        }))
    }

    fn check(&self, path: &Path, header: &Header, samples: u64) -> Result<()> {
        if header.identity != self.identity || header.samples != samples {
            return Err(Error::damaged(path, "it belongs to another run"));
        }
        Ok(())
    }
}

fn list<T: bytemuck::AnyBitPattern>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

fn write(path: &Path, header: &Header, payload: &[&[u8]]) -> Result<()> {
    let text = serde_json::to_vec(header).expect("plain data");
    let (version, length) = (VERSION.to_le_bytes(), (text.len() as u64).to_le_bytes());
    let mut parts: Vec<&[u8]> = vec![MAGIC, &version, &length, &text];
    parts.extend(payload);
    let mut checksum = blake3::Hasher::new();
    parts.iter().for_each(|part| _ = checksum.update(part));
    let checksum = checksum.finalize();
    parts.push(checksum.as_bytes());
    crate::record::write_quickly(path, &parts)
}

/// Header and payload of a file whose checksum holds; `None` if the file does not exist.
fn read(path: &Path) -> Result<Option<(Header, Vec<u8>)>> {
    let length = match std::fs::metadata(path) {
        Ok(m) => m.len(),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Error::io(path, e)),
    };
    if length > LARGEST {
        return Err(Error::damaged(path, format!("{length} bytes; cells are smaller than {LARGEST}")));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    parse(&bytes).map(Some).map_err(|message| Error::damaged(path, message))
}

/// The inverse of `write`, on bytes.
fn parse(bytes: &[u8]) -> std::result::Result<(Header, Vec<u8>), String> {
    let body = bytes.len().checked_sub(CHECKSUM).filter(|&n| n >= 20).ok_or("too short for a cell file")?;
    let (body, checksum) = bytes.split_at(body);
    if &body[..8] != MAGIC {
        return Err("not a cell file (wrong first bytes)".into());
    }
    let version = u32::from_le_bytes(body[8..12].try_into().expect("4 bytes"));
    if version != VERSION {
        return Err(format!("cell format {version}; this version reads {VERSION}"));
    }
    if blake3::hash(body).as_bytes() != checksum {
        return Err("checksum does not hold: the file is damaged".into());
    }
    let length = u64::from_le_bytes(body[12..20].try_into().expect("8 bytes"));
    let rest = &body[20..];
    let text = usize::try_from(length).ok().and_then(|n| rest.get(..n)).ok_or("header longer than the file")?;
    let header = serde_json::from_slice(text).map_err(|e| format!("header: {e}"))?;
    Ok((header, rest[text.len()..].to_vec()))
}
