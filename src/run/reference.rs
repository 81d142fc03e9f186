//! The reference: where it comes from, and its image.

use super::image::reference_image;
use super::{PlannedScene, ReferencePlan, Runner};
use crate::analysis::scene::Reference;
use crate::error::Result;
use crate::estimator::Estimator;
use crate::moments::Moments;
use crate::record::ReferenceResult;
use crate::sampling::Role;
use crate::sampling::strategy::Preset;
use std::path::Path;

impl Runner<'_> {
    /// The reference as numbers, and as the record describes it.
    pub(super) fn reference(
        &mut self,
        scene: &PlannedScene<'_>,
        folder: &Path,
    ) -> Result<(Reference, ReferenceResult)> {
        let shape = scene.contenders[0].estimator.shape();
        let (reference, description, seconds) = match &scene.reference {
            ReferencePlan::Exact(value) => {
                let mean = vec![*value; shape.values()];
                (
                    Reference { variance: vec![0.0; mean.len()], mean, replicates: None },
                    format!("exact value {value}"),
                    None,
                )
            }
            ReferencePlan::Image { path, reference } => (reference.clone(), format!("image {}", path.display()), None),
            ReferencePlan::Rendered { estimator, name, spp, replicates } => {
                let (reference, seconds) = self.render_reference(scene, &**estimator, *spp, *replicates)?;
                (reference, format!("{name}: {replicates} replicates of {spp} {}", estimator.abscissa()), Some(seconds))
            }
        };
        let image = match shape.channels {
            3 => Some(reference_image(&reference, &scene.name, shape, folder)?),
            _ => None,
        };
        let described = reference.describe(self.plan.metrics[0], description, seconds, image);
        Ok((reference, described))
    }

    /// Mean and variance of the mean over independent replicates.
    fn render_reference(
        &mut self,
        scene: &PlannedScene<'_>,
        estimator: &dyn Estimator,
        spp: u64,
        replicates: u32,
    ) -> Result<(Reference, f64)> {
        let strategy = Preset::Sobol.strategy();
        let mut moments = vec![Moments::default(); estimator.shape().values()];
        let mut seconds = 0.0;
        for replicate in 0..replicates {
            self.bar.set_message(format!("{} · reference", scene.name));
            let mut track = self.track(estimator, &strategy, Role::Reference, replicate);
            let found = self.advance(&mut track, spp)?;
            for (m, &x) in moments.iter_mut().zip(&found.mean) {
                m.push(x, u64::from(replicate));
            }
            seconds += found.seconds;
        }
        let r = f64::from(replicates);
        let variance = moments.iter().map(|m| m.sample_variance().unwrap_or(f64::NAN) / r).collect();
        let mean = moments.iter().map(|m| m.mean).collect();
        Ok((Reference { mean, variance, replicates: Some(replicates) }, seconds))
    }
}
