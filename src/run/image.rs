//! The images that a run leaves.

use super::{Contender, PlannedScene, Runner};
use crate::analysis::scene::{Fields, Reference};
use crate::error::Result;
use crate::estimator::Shape;
use crate::record::image::{Attributes, write_exr};
use crate::record::{Dependence, StrategyResult, layers};
use crate::sampling::Role;
use std::path::Path;

impl Runner<'_> {
    /// Writes the final image over all replicates, and with `log = "pixels"` those of every checkpoint and replicate.
    pub(super) fn images(
        &self,
        strategy: &mut StrategyResult,
        fields: &Fields,
        c: &Contender<'_>,
        scene: &PlannedScene<'_>,
        folder: &Path,
    ) -> Result<()> {
        let shape = c.estimator.shape();
        if shape.channels != 3 {
            return Ok(());
        }
        let relative = format!("images/{}/{}", file_name(&scene.name), file_name(&c.name));
        let checkpoints: Vec<u64> = strategy.checkpoints.iter().map(|k| k.spp).collect();
        let (Some(end), Some(&last)) = (strategy.checkpoints.last(), checkpoints.last()) else { return Ok(()) };
        let (replicates, seconds) = (end.seconds.len() as u32, end.seconds.iter().sum());
        let hash = |n| self.folder(&self.track(&*c.estimator, &c.strategy, Role::Run, 0), n).hash();
        let about = |n: u64, replicates: u64, seconds: f64| Attributes {
            samples_per_pixel: n * replicates,
            render_time_seconds: seconds,
            seed: self.plan.seed,
            strategy: c.name.clone(),
            cell_hash: hash(n),
            definitions: Vec::new(),
        };
        let all = format!("{relative}/all-{last}.exr");
        let mut layers = layers::statistics(
            shape,
            &fields.mean,
            &fields.sample_variance,
            &fields.std_error,
            last * u64::from(replicates),
        );
        if let Some(maps) = &fields.health {
            layers::add(&mut layers, "variance_of_variance", &maps.variance_of_variance);
            layers::add(&mut layers, "largest_share", &maps.largest_share);
            layers::add(&mut layers, "zero_fraction", &maps.zero_fraction);
        }
        write_exr(&folder.join(&all), &layers, &about(last, replicates.into(), seconds))?;
        strategy.image = Some(all);
        if self.plan.log_pixels {
            for n in checkpoints {
                for replicate in 0..replicates {
                    let k = self.stored(c, replicate, n)?;
                    let std_error: Vec<f64> = match c.estimator.dependence() {
                        Dependence::Independent => k.variance.iter().map(|v| (v / n as f64).sqrt()).collect(),
                        _ => Vec::new(),
                    };
                    let layers = layers::statistics(shape, &k.mean, &k.variance, &std_error, n);
                    let path = folder.join(format!("{relative}/{replicate}-{n}.exr"));
                    write_exr(&path, &layers, &about(n, 1, k.seconds))?;
                }
            }
        }
        Ok(())
    }
}

/// Writes the reference as an image and returns its path relative to the folder.
pub(super) fn reference_image(reference: &Reference, scene: &str, shape: Shape, folder: &Path) -> Result<String> {
    let relative = format!("images/{}/reference.exr", file_name(scene));
    let std_error: Vec<f64> = reference.variance.iter().map(|v| v.sqrt()).collect();
    let layers = layers::statistics(shape, &reference.mean, &[], &std_error, 0);
    write_exr(&folder.join(&relative), &layers, &Attributes::default())?;
    Ok(relative)
}

/// A name that is safe as one part of a path.
pub(crate) fn file_name(name: &str) -> String {
    let safe = |c: char| if c.is_alphanumeric() || "-_.+".contains(c) { c } else { '-' };
    let name: String = name.chars().map(safe).collect();
    if name.trim_matches('.').is_empty() { "unnamed".into() } else { name }
}
