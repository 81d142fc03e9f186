use super::{Transport, parameter, use_threads};
use crate::error::{Error, Result};
use crate::estimator::Cell;
use crate::estimator::choice::{DeviceRequest, PathTracers, Traversal};
use crate::estimator::cpu::PreparedScene;
use crate::record::image::{Attributes, write_exr};
use crate::record::layers;
use crate::run::{progress_bar, sample};
use crate::sampling::strategy::{NoRoulette, Preset, Roulette, Strategy, Technique};
use crate::sampling::{Key, Role};
use crate::scene::Scene;
use crate::scene::format::Options;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Renders one image and writes it with all its moments.
#[derive(clap::Args)]
pub struct Render {
    /// Scene file (Mitsuba 3 XML).
    scene: PathBuf,
    /// Image to write (EXR).
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Sampling strategy.
    #[arg(long, value_enum, default_value_t = Preset::Mis)]
    strategy: Preset,
    #[command(flatten)]
    settings: Settings,
    /// Samples per pixel.
    #[arg(long, default_value_t = 64)]
    spp: u64,
    /// Where to render: auto, cpu, vulkan, vulkan:NAME or vulkan:INDEX (see `rootn devices`).
    #[arg(long, value_name = "DEVICE", default_value_t)]
    device: DeviceRequest,
    /// How rays find what they meet on a Vulkan device.
    #[arg(long, value_enum, default_value_t)]
    traversal: Traversal,
    /// Worker threads; default: one per core.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// No progress on stderr.
    #[arg(long)]
    quiet: bool,
}

/// What `render`, `replay` and `explain` share: how the scene file is to be read.
#[derive(clap::Args)]
pub(super) struct Reading {
    /// Film width in pixels; default: the scene's.
    #[arg(long)]
    width: Option<u32>,
    /// Film height in pixels; default: the scene's.
    #[arg(long)]
    height: Option<u32>,
    /// Value of a <default> parameter of the scene file.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parameter)]
    parameters: Vec<(String, String)>,
    /// Let the scene read files outside its own folder.
    #[arg(long)]
    pub(super) allow_outside: bool,
}

/// What `render` and `replay` share.
#[derive(clap::Args)]
pub(super) struct Settings {
    #[command(flatten)]
    pub(super) reading: Reading,
    /// Longest path in edges (1 = emission only), or none; default: the scene's.
    #[arg(long, value_name = "D")]
    max_depth: Option<DepthLimit>,
    /// Depth from which Russian roulette may end a path, or none; default: the scene's.
    #[arg(long, value_name = "R")]
    roulette_depth: Option<DepthLimit>,
    /// Seed.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) transport: Transport,
}

/// A number of edges, or `none`.
#[derive(Clone, Copy)]
struct DepthLimit(Option<u32>);

impl std::str::FromStr for DepthLimit {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "none" => Ok(Self(None)),
            _ => text.parse().map(|n| Self(Some(n))).map_err(|_| "expected a number of edges or `none`".into()),
        }
    }
}

impl Reading {
    /// The scene as the flags ask for.
    pub(super) fn load(&self, path: &Path) -> Result<Scene> {
        let size = match (self.width, self.height) {
            (None, None) => None,
            (Some(w), Some(h)) if [w, h].iter().all(|n| (1..=65_536).contains(n)) => Some([w, h]),
            (Some(w), Some(h)) => {
                return Err(Error::Usage(format!("film of {w} × {h} pixels: 1 to 65536 are allowed")));
            }
            _ => return Err(Error::Usage("--width and --height go together".into())),
        };
        let options = Options { parameters: self.parameters.clone(), size, allow_outside: self.allow_outside };
        crate::scene::format::load(path, &options)
    }

    /// Whether no flag was given that changes the scene.
    fn is_default(&self) -> bool {
        self.width.is_none() && self.height.is_none() && self.parameters.is_empty()
    }
}

impl Settings {
    /// The scene, ready to be traced, as the flags ask for.
    pub(super) fn prepare(&self, path: &Path) -> Result<PreparedScene> {
        let mut scene = self.reading.load(path)?;
        for warning in &scene.warnings {
            eprintln!("rootn: warning: {warning}");
        }
        if let Some(DepthLimit(depth)) = self.max_depth {
            scene.depth.max = depth;
        }
        PreparedScene::new(scene)
    }

    /// Whether no flag was given.
    pub(super) fn is_default(&self) -> bool {
        let depths = self.max_depth.is_none() && self.roulette_depth.is_none();
        depths && self.reading.is_default() && self.seed == 1
    }

    /// The strategy of a preset with the flags' roulette and transport.
    pub(super) fn strategy(&self, preset: Preset) -> Strategy {
        let roulette = self.roulette_depth.map(|DepthLimit(d)| match d {
            Some(n) => Roulette::Depth(n),
            None => Roulette::Never(NoRoulette::None),
        });
        let strategy = preset.strategy();
        Strategy { roulette, technique: self.transport.only.unwrap_or(strategy.technique), ..strategy }
    }
}

impl Render {
    pub(super) fn execute(self) -> Result<()> {
        use_threads(self.threads)?;
        if self.spp == 0 {
            return Err(Error::Usage("--spp 0: at least 1".into()));
        }
        if !self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            return Err(Error::Usage(format!("--output {}: only .exr images are written", self.output.display())));
        }
        let prepared = Arc::new(self.settings.prepare(&self.scene)?);
        let strategy = self.settings.strategy(self.strategy);
        let chosen = self.device.take()?;
        let mut tracers = PathTracers::new(prepared, self.settings.transport.all_effects);
        let (estimator, device) = tracers.estimator(&chosen, self.traversal, strategy)?;
        if !self.quiet {
            eprintln!("device: {device}, because {}", chosen.reason);
        }
        let key = Key::new(self.settings.seed, Role::Run, &strategy.identity(), 0);
        let bar = progress_bar(self.spp * estimator.shape().pixels() as u64, self.quiet);
        let (cell, mut kept) = (Cell { key, length: self.spp }, None);
        let outcome = sample(&*estimator, &cell, self.spp, &mut kept, &bar);
        bar.finish_and_clear();
        // What a device leaves that fails is an image, too.
        let (estimate, end) = match (outcome, kept) {
            (Ok((estimate, interrupted)), _) => (estimate, interrupted.then_some(Error::Interrupted)),
            (Err(e), Some(estimate)) => (estimate, Some(e)),
            (Err(e), None) => return Err(e),
        };
        let tree = estimate.moments.as_ref().expect("a path tracer has samples");
        let about = Attributes {
            samples_per_pixel: tree.samples(),
            render_time_seconds: estimate.seconds,
            seed: self.settings.seed,
            strategy: match strategy.technique {
                Technique::Path => self.strategy.label().into(),
                Technique::Direct => format!("{}, direct light only", self.strategy.label()),
            },
            definitions: Vec::new(),
            cell_hash: blake3::hash(estimator.identity().as_bytes()).to_hex()[..24].to_owned(),
        };
        write_exr(&self.output, &layers::of_moments(estimator.shape(), &tree.fold(), strategy.sequence), &about)?;
        if let Some(&(pixel, sample)) = tree.non_finite().first() {
            eprintln!(
                "rootn: warning: non-finite samples, the first in pixel {pixel}, sample {sample}: see `rootn replay`"
            );
        }
        if !self.quiet {
            let samples = tree.samples() as f64 * estimator.shape().pixels() as f64;
            let (seconds, wall) = (estimate.seconds, estimate.wall_seconds);
            let rate = samples / seconds.max(1e-9) / 1e6;
            eprintln!(
                "{} spp in {seconds:.2} s of sampling ({wall:.2} s on the clock), {rate:.2} million samples/s",
                tree.samples()
            );
        }
        end.map_or(Ok(()), Err)
    }
}
