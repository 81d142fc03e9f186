//! Samples per second of the path tracer on the Cornell box, what moments and checkpoints cost beside it, peak memory.
//! `cargo bench --bench render`. CPU seconds of all threads, medians of interleaved rounds, since the machine may be busy.

use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::{Cell, Estimate, Estimator, estimate_by_batches};
use rootn::moments::BATCH;
use rootn::moments::cell::{CellFolder, Checkpoint, Saving};
use rootn::sampling::strategy::{NoRoulette, Preset, Roulette, Strategy};
use rootn::sampling::{Key, Role};
use rootn::scene::format::{Options, load};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const SPP: u64 = 256;
const ROUNDS: usize = 21;

/// CPU seconds of all threads of this process so far.
fn cpu_seconds() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.map_or("unknown".into(), |l| l.trim().to_owned())
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x[x.len() / 2]
}

/// CPU and wall seconds.
fn timed(work: impl FnOnce()) -> [f64; 2] {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    work();
    [cpu_seconds() - cpu, wall.elapsed().as_secs_f64()]
}

/// Estimates and keeps every power of two, and the states from which the run goes on, as a run does.
fn with_checkpoints(estimator: &CpuEstimator, cell: &Cell, folder: &Path) {
    let (shape, folder) = (estimator.shape(), CellFolder::new(folder, estimator.identity()));
    folder.remove().unwrap();
    let (mut estimate, mut saving): (Option<Estimate>, _) = (None, Saving::default());
    for n in (0..=SPP.trailing_zeros()).map(|k| 1 << k) {
        let next = estimator.estimate(cell, n, &mut estimate).unwrap();
        folder.save_checkpoint(n, &Checkpoint::of(&next)).unwrap();
        if n == SPP || saving.is_worth_it(next.seconds) {
            saving.write(&folder, &next, shape.pixels(), shape.channels).unwrap();
        }
        estimate = Some(next);
    }
}

fn report(name: &str, path: &Path, folder: &Path) {
    let mut scene = load(path, &Options { allow_outside: true, ..Options::sized([96, 96]) }).unwrap();
    scene.depth.max = Some(8);
    let prepared = Arc::new(PreparedScene::new(scene).unwrap());
    let roulette = Some(Roulette::Never(NoRoulette::None));
    let strategy = Strategy { roulette, ..Preset::Mis.strategy() };
    let estimator = CpuEstimator::new(prepared, strategy);
    let shape = estimator.shape();
    let cell = Cell { key: Key::new(1, Role::Run, "bench", 0), length: SPP };
    let mut seconds = [const { Vec::new() }; 3];
    let mut wall = Vec::new();
    let free: Vec<f64> = (0..BATCH * 3).map(|i| (i * 37 % 101) as f64).collect();
    for _ in 0..ROUNDS {
        let [cpu, elapsed] = timed(|| drop(black_box(estimator.estimate(&cell, SPP, &mut None))));
        seconds[0].push(cpu);
        wall.push(elapsed);
        // The same bookkeeping for samples that cost nothing, ten times, to be seen at all.
        let fill = |_: std::ops::Range<u32>, _: std::ops::Range<u64>, out: &mut [f64]| {
            out.copy_from_slice(&free[..out.len()]);
        };
        let [cpu, _] =
            timed(|| (0..10).for_each(|_| drop(black_box(estimate_by_batches(shape, SPP, &mut None, fill)))));
        seconds[1].push(cpu / 10.0);
        seconds[2].push(timed(|| with_checkpoints(&estimator, &cell, folder))[0]);
    }
    // Neighbours in time are compared: the machine's speed drifts by more than what is looked for.
    let more = seconds[2].iter().zip(&seconds[0]).map(|(checkpoints, whole)| checkpoints / whole - 1.0).collect();
    let [whole, moments, _] = seconds.map(median);
    let samples = SPP as f64 * shape.pixels() as f64 / 1e6;
    println!("{name}: {:.2} million samples per CPU second, {:.2} per second", samples / whole, samples / median(wall));
    println!("  moments: {:.1} % of the rendering alone", 100.0 * moments / (whole - moments));
    println!("  checkpoints at all powers of two: {:+.1} %", 100.0 * median(more));
}

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    report("cornell box", &root.join("experiments/scenes/cornell-box.xml"), folder.path());
    for file in ["bitterli-cornell-box/mitsuba/scene_v3.xml", "own/dragon.xml", "own/lights.xml"] {
        let path = root.join("../shared/scenes").join(file);
        if path.exists() {
            report(file, &path, folder.path());
        } else {
            println!("{file}: skipped, ../shared/scenes is absent");
        }
    }
    println!("peak memory: {}", peak_memory());
}
