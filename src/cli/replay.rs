use super::render::Settings;
use super::{print, use_threads};
use crate::error::{Error, Result};
use crate::estimator::cpu::CpuEstimator;
use crate::estimator::{Estimator, dependence_of};
use crate::record::Dependence;
use crate::sampling::strategy::Preset;
use crate::sampling::{Draw, Key, Role};
use crate::transport::sink::Recorder;
use std::path::PathBuf;
use std::sync::Arc;

/// Traces one sample again and prints its path vertex by vertex: positions, densities, weights, contributions.
#[derive(clap::Args)]
pub struct Replay {
    /// Scene file (Mitsuba 3 XML).
    scene: PathBuf,
    /// Pixel.
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pixel: [u32; 2],
    /// Index of the sample, from 0.
    #[arg(long, default_value_t = 0)]
    sample: u64,
    /// Sampling strategy.
    #[arg(long, value_enum, default_value_t = Preset::Mis)]
    strategy: Preset,
    /// Replicate of the experiment; `render` is replicate 0.
    #[arg(long, default_value_t = 0)]
    replicate: u32,
    /// Samples per pixel of the whole run: stratified points depend on it.
    #[arg(long, default_value_t = 64)]
    spp: u64,
    #[command(flatten)]
    settings: Settings,
    /// Print JSON: the events of the path and the sample's radiance.
    #[arg(long)]
    json: bool,
}

/// Parses `x,y`.
fn pixel(text: &str) -> std::result::Result<[u32; 2], String> {
    let parts: Vec<u32> =
        text.split(',').map(|t| t.trim().parse()).collect::<std::result::Result<_, _>>().unwrap_or_default();
    <[u32; 2]>::try_from(parts).map_err(|_| "expected X,Y".into())
}

impl Replay {
    pub(super) fn execute(self) -> Result<()> {
        use_threads(Some(1))?;
        let prepared = Arc::new(self.settings.prepare(&self.scene)?);
        let strategy = self.settings.strategy(self.strategy);
        let estimator = CpuEstimator::new(prepared, strategy);
        let shape = estimator.shape();
        let [x, y] = self.pixel.map(|v| v as usize);
        if x >= shape.width || y >= shape.height {
            let message = format!("--pixel {x},{y} lies outside the film of {} × {}", shape.width, shape.height);
            return Err(Error::Usage(message));
        }
        if dependence_of(strategy.sequence) != Dependence::Independent && self.sample >= self.spp {
            return Err(Error::Usage(format!("--sample {}: the run has --spp {} samples", self.sample, self.spp)));
        }
        let draw = Draw {
            key: Key::new(self.settings.seed, Role::Run, &strategy.identity(), self.replicate),
            pixel: (y * shape.width + x) as u32,
            sample: self.sample,
            length: self.spp,
            sequence: strategy.sequence,
        };
        let mut recorder = Recorder::default();
        let value = estimator.sample_with(&draw, &mut recorder);
        let text = match self.json {
            true => {
                let path = serde_json::json!({ "events": recorder.events, "radiance": value.to_array() });
                serde_json::to_string_pretty(&path).expect("plain data") + "\n"
            }
            // Shortest digits that give the very same float.
            false => format!("{recorder}radiance ({:e}, {:e}, {:e})\n", value.x, value.y, value.z),
        };
        print(&text)
    }
}
