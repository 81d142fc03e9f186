//! The same bits for any number of threads, order of pixels, interruption and continuation.

use crate::stats::Random;
use rootn::estimator::choice::{DeviceRequest, Traversal};
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::integrand::{Integrand, IntegrandEstimator};
use rootn::estimator::{Cell, Estimator};
use rootn::experiment::{load, plan};
use rootn::moments::BlockTree;
use rootn::record::Record;
use rootn::run::{Options, Reuse, run};
use rootn::sampling::strategy::Preset;
use rootn::sampling::{Draw, Sequence, rng::Key};
use rootn::transport::NoSink;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

/// The Cornell box that the experiments use.
pub(crate) fn cornell() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/scenes/cornell-box.xml")
}

/// Writes a small experiment on a scene file.
pub(crate) fn experiment(folder: &Path, scene: &Path, spp: u64, rest: &str) -> PathBuf {
    let path = folder.join("small.toml");
    let text = format!(
        "name = \"small\"\nfilm = {{ width = 8, height = 8 }}\nmax_depth = 4\nprobes = [[3, 4]]\n\
         [[scene]]\nfile = {:?}\n[budget]\nspp = {spp}\nreplicates = 3\n[reference]\nspp = 16\nreplicates = 4\n\
         [[strategy]]\npreset = \"mis\"\n[[strategy]]\npreset = \"stratified\"\n[[strategy]]\npreset = \"sobol\"\n{rest}",
        scene.to_str().unwrap()
    );
    std::fs::write(&path, text).unwrap();
    path
}

/// Runs an experiment file in this process.
pub(crate) fn run_file(path: &Path, out: &Path, fresh: bool) -> rootn::Result<(Record, Reuse)> {
    let (parsed, text) = load::load(path, &[])?;
    let plan = plan::plan(&parsed, path, text, &DeviceRequest::Cpu, Traversal::Compute)?;
    let (record, reuse) = run(&plan, &Options { out: out.to_owned(), fresh, quiet: true })?;
    rootn::report::write(&record, &out.join(&record.name))?;
    Ok((record, reuse))
}

/// Fields that hold times, or follow from times: all that may differ between two runs of the same experiment.
const TIMES: [&str; 9] = [
    "seconds",
    "wall_seconds",
    "sampling_seconds",
    "seconds_per_sample",
    "setup_seconds",
    "efficiency_ratio",
    // Of error² × seconds.
    "drift",
    "threads",
    // Runs that met damaged files say so.
    "warnings",
];

fn without_times(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !TIMES.contains(&key.as_str()));
            map.values_mut().for_each(without_times);
        }
        Value::Array(list) => list.iter_mut().for_each(without_times),
        _ => {}
    }
}

/// Everything that a run left and that must not differ: record, curves, cells (header and payload).
#[derive(Debug, PartialEq)]
pub(crate) struct Left {
    record: Value,
    curves: Vec<Vec<String>>,
    cells: BTreeMap<PathBuf, (Value, Vec<u8>)>,
}

/// The record without times.
pub(crate) fn results(out: &Path, name: &str) -> Value {
    let text = std::fs::read_to_string(out.join(name).join("record.json")).unwrap();
    let mut record = serde_json::from_str(&text).unwrap();
    without_times(&mut record);
    record
}

pub(crate) fn left(out: &Path, name: &str) -> Left {
    let record = results(out, name);
    let mut curves = csv::ReaderBuilder::new().has_headers(false).from_path(out.join(name).join("curves.csv")).unwrap();
    let mut rows: Vec<Vec<String>> = curves.records().map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect();
    let column = rows[0].iter().position(|c| c == "seconds").unwrap();
    rows.iter_mut().for_each(|r| drop(r.remove(column)));
    let mut cells = BTreeMap::new();
    for folder in std::fs::read_dir(out.join("cells")).unwrap() {
        for file in std::fs::read_dir(folder.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            if path.extension().is_some_and(|e| e == "cell") {
                cells.insert(path.strip_prefix(out).unwrap().to_owned(), cell(&std::fs::read(&path).unwrap()));
            }
        }
    }
    Left { record, curves: rows, cells }
}

fn cell(bytes: &[u8]) -> (Value, Vec<u8>) {
    let length = u64::from_le_bytes(bytes[12..20].try_into().unwrap()) as usize;
    let mut header = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    without_times(&mut header);
    (header, bytes[20 + length..bytes.len() - 32].to_vec())
}

#[test]
fn the_number_of_threads_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let path = experiment(folder.path(), &cornell(), 70, "");
    let all: Vec<Left> = [1, 2, 3]
        .into_iter()
        .map(|threads| {
            let out = folder.path().join(threads.to_string());
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run_file(&path, &out, false)).unwrap();
            left(&out, "small")
        })
        .collect();
    assert!(all[0].cells.len() > 60, "{}", all[0].cells.len());
    assert!(all[0] == all[1] && all[0] == all[2]);
    // The sabotaged twin: another seed is seen.
    let text = std::fs::read_to_string(&path).unwrap().replace("replicates = 3", "replicates = 3\nseed = 2");
    std::fs::write(&path, text).unwrap();
    let out = folder.path().join("other");
    run_file(&path, &out, false).unwrap();
    let other = left(&out, "small");
    assert!(other.record != all[0].record && other.curves != all[0].curves && other.cells != all[0].cells);
}

/// Numbers 0 … n−1 in random order.
fn shuffled(n: usize, random: &mut Random) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i as u64 + 1) as usize);
    }
    order
}

#[test]
fn the_order_of_pixels_leaves_no_trace() {
    let mut random = Random::new("order of pixels");
    let scene = rootn::scene::format::load(&cornell(), &rootn::scene::format::Options::sized([7, 5])).unwrap();
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let cell = Cell { key: Key([7, 8]), length: 150 };
    for preset in [Preset::Mis, Preset::Stratified, Preset::Sobol] {
        let strategy = preset.strategy();
        let estimator = CpuEstimator::new(Arc::clone(&prepared), strategy);
        let whole = estimator.estimate(&cell, 150, &mut None).unwrap().moments.unwrap();
        let per_pixel = whole.nodes().len() / 35;
        let mut nodes = whole.nodes().to_vec();
        nodes.fill(Default::default());
        // Pixel by pixel, one sample at a time, in any order.
        for pixel in shuffled(35, &mut random) {
            let tree = BlockTree::new(3).extend(1, 150, |_, samples, out| {
                for (sample, out) in samples.zip(out.chunks_exact_mut(3)) {
                    let draw =
                        Draw { key: cell.key, pixel: pixel as u32, sample, length: 150, sequence: strategy.sequence };
                    let c = estimator.sample_with(&draw, &mut NoSink);
                    out.copy_from_slice(&c.to_array().map(f64::from));
                }
            });
            nodes[pixel * per_pixel..][..per_pixel].copy_from_slice(tree.nodes());
        }
        let (a, b): (&[u8], &[u8]) = (bytemuck::cast_slice(&nodes), bytemuck::cast_slice(whole.nodes()));
        assert!(a == b, "{preset:?}");
    }
}

#[test]
fn continued_estimates_have_the_bits_of_whole_ones() {
    let scene = rootn::scene::format::load(&cornell(), &rootn::scene::format::Options::sized([6, 6])).unwrap();
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let cell = Cell { key: Key([3, 9]), length: 200 };
    let mut estimators: Vec<Box<dyn Estimator>> = vec![
        Box::new(CpuEstimator::new(Arc::clone(&prepared), Preset::Mis.strategy())),
        Box::new(CpuEstimator::new(Arc::clone(&prepared), Preset::Stratified.strategy())),
        Box::new(CpuEstimator::new(prepared, Preset::Sobol.strategy())),
    ];
    for sequence in [Sequence::Independent, Sequence::Stratified, Sequence::LatinHypercube, Sequence::Sobol] {
        estimators.push(Box::new(IntegrandEstimator { integrand: Integrand::ProductPeak6d, size: [4, 4], sequence }));
    }
    for estimator in estimators {
        let whole = estimator.estimate(&cell, 200, &mut None).unwrap();
        for steps in [vec![1, 2, 4, 200], vec![64, 128, 200], vec![63, 65, 199, 200]] {
            let mut estimate = None;
            for n in steps {
                estimate = Some(estimator.estimate(&cell, n, &mut estimate).unwrap());
            }
            let estimate = estimate.unwrap();
            assert!(estimate.field == whole.field && estimate.moments == whole.moments, "{}", estimator.identity());
        }
    }
}

fn rootn(path: &Path, out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rootn"));
    command.args(["run", path.to_str().unwrap(), "--quiet", "--threads", "1", "--out", out.to_str().unwrap()]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Samples per pixel of a run that lasts about two seconds.
const LONG: u64 = 2000;

/// Whether a cell has a state, but not yet its last checkpoint.
fn unfinished_state(out: &Path, last: u64) -> bool {
    let Ok(cells) = std::fs::read_dir(out.join("cells")) else { return false };
    cells.map(|c| c.unwrap().path()).any(|c| c.join("state.cell").exists() && !c.join(format!("{last}.cell")).exists())
}

/// Kills runs of `spp` samples per pixel after random numbers of milliseconds, and then lets one finish.
fn kill_and_continue(device: &str, spp: u64, after: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let path = experiment(folder.path(), &cornell(), spp, "");
    let (undisturbed, disturbed) = (folder.path().join("a"), folder.path().join("b"));
    let start = |out: &Path| {
        let mut command = rootn(&path, out);
        command.args(["--device", device]).spawn().unwrap()
    };
    assert!(start(&undisturbed).wait().unwrap().success());
    let mut random = Random::new("killed runs");
    let (mut killed, mut continued) = (0, 0);
    for _ in 0..10 {
        let mut child = start(&disturbed);
        std::thread::sleep(Duration::from_millis(after.start + random.below(after.end - after.start)));
        killed += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        continued += usize::from(unfinished_state(&disturbed, spp));
    }
    assert!(killed >= 3, "only {killed} runs were still running when killed");
    assert!(continued >= 3, "only {continued} runs went on from a state");
    assert!(start(&disturbed).wait().unwrap().success());
    assert!(left(&undisturbed, "small") == left(&disturbed, "small"));
}

#[test]
fn killed_runs_continue_to_the_same_bits() {
    kill_and_continue("cpu", LONG, 5..155);
}

#[cfg(feature = "vulkan")]
#[test]
fn killed_runs_on_a_gpu_continue_to_the_same_bits() {
    if crate::support::vulkan().is_some() {
        kill_and_continue("vulkan", 2 * LONG, 300..2500);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_keeps_its_state_and_continues() {
    let folder = tempfile::tempdir().unwrap();
    let path = experiment(folder.path(), &cornell(), LONG, "");
    let (undisturbed, disturbed) = (folder.path().join("a"), folder.path().join("b"));
    assert!(rootn(&path, &undisturbed).status().unwrap().success());
    let mut interrupted = 0;
    for wait in [100, 200, 300, 400] {
        let mut child = rootn(&path, &disturbed).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(wait));
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let code = child.wait().unwrap().code();
        assert!(matches!(code, Some(0 | 130)), "{code:?}");
        interrupted += usize::from(code == Some(130));
    }
    assert!(interrupted >= 1);
    assert!(disturbed.join("cells").exists(), "an interrupted run keeps its cells");
    assert!(rootn(&path, &disturbed).status().unwrap().success());
    assert!(left(&undisturbed, "small") == left(&disturbed, "small"));
}
