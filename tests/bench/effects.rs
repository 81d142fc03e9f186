//! What leaving out saves: time per sample with only the effects that a scene calls for, and with all of them.
//! `cargo bench --bench effects`, with `-- --write` into `reports/effects/effects.md`, too. Devices: the CPU engine, and the best
//! Vulkan device or `ROOTN_TEST_DEVICE=INDEX`. Rounds of the two alternate; figures are medians, the ratio that of neighbours.

use rootn::Error;
use rootn::estimator::choice::Which;
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::vulkan::{Device, DeviceKind, DeviceScene, Tuning, VulkanEstimator};
use rootn::estimator::{Cell, Estimate, Estimator};
use rootn::run::machine;
use rootn::sampling::Key;
use rootn::sampling::strategy::Preset;
use rootn::scene::Effects;
use rootn::scene::format::{Options, load};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels per side.
const FILM: u32 = 96;
/// Of each of the two.
const ROUNDS: usize = 9;
/// Seconds of a round, about.
const ROUND: f64 = 0.25;

/// Scenes that need more than ours do, in the folder shared between projects.
const SHARED: [&str; 11] = [
    "own/lights.xml",
    "own/overcast.xml",
    "own/dragon.xml",
    "own/baffle.xml",
    "mitsuba-tutorials/cbox.xml",
    "mitsuba-matpreview/matpreview.xml",
    "mitsuba-tests/tests/scenes/bsdf_spheres/test_envmap_path.xml",
    "bitterli-veach-mis/mitsuba/scene.xml",
    "bitterli-classroom/mitsuba/scene_v3_ply_altenv.xml",
    "bitterli-staircase2/mitsuba/scene.xml",
    "bitterli-veach-ajar/mitsuba/scene_ply.xml",
];

fn scenes() -> Vec<(String, PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = std::fs::read_dir(root.join("experiments/scenes")).into_iter().flatten().flatten();
    let mut own: Vec<PathBuf> =
        folder.map(|f| f.path()).filter(|p| p.extension().is_some_and(|e| e == "xml")).collect();
    own.sort();
    let named = |path: PathBuf| (path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), path);
    let shared = SHARED.iter().map(|name| {
        let folder = name.split('/').next().unwrap_or(name);
        let path = root.join("../shared/scenes").join(name);
        (format!("{folder}/{}", path.file_stem().unwrap_or_default().to_string_lossy()), path)
    });
    own.into_iter().map(named).chain(shared.filter(|(_, path)| path.exists())).collect()
}

/// CPU seconds of all threads of this process so far.
fn cpu_seconds() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x[x.len() / 2]
}

/// Seconds per sample with special and with full code, the ratio, and whether the samples are the same.
struct Measured {
    seconds: [f64; 2],
    ratio: f64,
    equal: bool,
}

/// `on_cpu`: whether the work is done by this process, whose own clock is not disturbed by others.
fn measure(special: &dyn Estimator, full: &dyn Estimator, on_cpu: bool) -> rootn::Result<Measured> {
    let pixels = special.shape().pixels() as f64;
    let run = |estimator: &dyn Estimator, n: u64| -> rootn::Result<(f64, Estimate)> {
        let before = cpu_seconds();
        let estimate = estimator.estimate(&Cell { key: Key([3, 4]), length: n }, n, &mut None)?;
        let seconds = if on_cpu { cpu_seconds() - before } else { estimate.seconds };
        Ok((seconds / (n as f64 * pixels), estimate))
    };
    run(full, 1)?;
    run(special, 1)?;
    let cores = if on_cpu { std::thread::available_parallelism().map_or(1, usize::from) } else { 1 };
    let n = ((ROUND * cores as f64 / (run(special, 4)?.0 * pixels)) as u64).clamp(1, 4096);
    let (mut seconds, mut ratios, mut equal) = ([Vec::new(), Vec::new()], Vec::new(), true);
    for _ in 0..ROUNDS {
        let ((a, first), (b, second)) = (run(special, n)?, run(full, n)?);
        seconds[0].push(a);
        seconds[1].push(b);
        ratios.push(b / a);
        equal &= first.field == second.field;
    }
    Ok(Measured { seconds: seconds.map(median), ratio: median(ratios), equal })
}

fn row(scene: &str, effects: Effects, engine: &str, m: &Measured) -> String {
    let [special, full] = m.seconds.map(|s| s * 1e6);
    let bits = if m.equal { "same" } else { "differ" };
    let (called, all) = (effects.names().count(), Effects::ALL.len());
    format!("| {scene} | {called} of {all} | {engine} | {special:.3} | {full:.3} | {:.2} | {bits} |\n", m.ratio)
}

/// Rows of a scene; an error of the reader is for the notes.
fn rows(name: &str, path: &Path, device: Option<&Arc<Device>>) -> rootn::Result<String> {
    let scene = load(path, &Options { allow_outside: true, ..Options::sized([FILM, FILM]) })?;
    let prepared = Arc::new(PreparedScene::new(scene)?);
    let strategy = Preset::Mis.strategy();
    let effects = Effects::of(&prepared.scene, true);
    let cpu = || CpuEstimator::new(Arc::clone(&prepared), strategy);
    let mut text = row(name, effects, "cpu", &measure(&cpu(), &cpu().with_all_effects(), true)?);
    let Some(device) = device else { return Ok(text) };
    let scene = Arc::new(DeviceScene::new(device, prepared)?);
    let with = |also| VulkanEstimator::new(Arc::clone(&scene), strategy, Tuning { also, ..Tuning::default() });
    let kernel = if Effects::SHORT.contains(effects) { "vulkan, short" } else { "vulkan, long" };
    let on_cpu = device.info().kind == DeviceKind::Cpu;
    text += &row(name, effects, kernel, &measure(&with(Effects::NONE)?, &with(Effects::EVERY)?, on_cpu)?);
    Ok(text)
}

fn main() {
    let which = std::env::var("ROOTN_TEST_DEVICE").ok().and_then(|v| v.parse().ok()).map_or(Which::First, Which::Index);
    let device = Device::open(&which, false);
    let driver = match &device {
        Ok(d) => format!("{}, {}", d.info().name, d.info().driver),
        Err(e) => e.to_string(),
    };
    let mut text = format!(
        "# What leaving out saves\n\nBy `cargo bench --bench effects -- --write` on {}, {} cores; {driver}.\n\n\
         Time per sample with MIS at {FILM} × {FILM} pixels, by code that has only the effects that a scene calls for, and by \
         code that has all (`--all-effects`): medians of {ROUNDS} alternating rounds; CPU seconds of all cores together where the \
         CPU does the work, else kernel time. *long*: the scene calls for an effect that the short variant of the kernels lacks.\n\n",
        machine(),
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    text += "| scene | effects | engine | special (µs) | full (µs) | full/special | bits |\n";
    text += "| --- | --- | --- | --- | --- | --- | --- |\n";
    print!("{text}");
    let mut notes = String::new();
    for (name, path) in scenes() {
        match rows(&name, &path, device.as_ref().ok()) {
            Ok(rows) => {
                print!("{rows}");
                text += &rows;
            }
            // Without the place, which is this machine's.
            Err(Error::Input { message, .. }) => writeln!(notes, "- {name}: {message}").expect("written to memory"),
            Err(e) => println!("{name}: {e}"),
        }
    }
    if !notes.is_empty() {
        text += &format!("\nNot read yet:\n\n{notes}");
        println!("\n{notes}");
    }
    if std::env::args().any(|a| a == "--write") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/effects/effects.md");
        if let Err(e) = rootn::record::write_atomically(&path, text.as_bytes()) {
            println!("{e}");
        }
    }
}
