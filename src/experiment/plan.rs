//! From an experiment to a plan: scenes loaded, estimators built, references found.

use super::load::fail_at;
use super::{Experiment, MaxDepth, ReferenceEntry, SceneEntry, StrategyEntry};
use crate::analysis::scene::Reference;
use crate::error::{Error, Result};
use crate::estimator::choice::{Chosen, DeviceRequest, PathTracers, Taken, Traversal};
use crate::estimator::cpu::PreparedScene;
use crate::estimator::integrand::IntegrandEstimator;
use crate::estimator::mock::Mock;
use crate::estimator::{Estimator, Shape};
use crate::record::image::read_exr;
use crate::run::{Contender, Plan, PlannedScene, ReferencePlan, powers_of_two};
use crate::sampling::strategy::{Preset, Technique};
use crate::scene::Scene;
use crate::scene::format::Options;
use crate::stats::Metric;
use crate::transport::path::depths;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Replicates of a rendered reference unless the file says otherwise.
const REFERENCE_REPLICATES: u32 = 32;

/// Builds the plan of an experiment; `path` is its file, `text` what it says, `device` and
/// `traversal` are for strategies that name none.
pub fn plan(
    experiment: &Experiment,
    path: &Path,
    text: String,
    device: &DeviceRequest,
    traversal: Traversal,
) -> Result<Plan<'static>> {
    let (mut warnings, mut taken) = (Vec::new(), Taken::default());
    let mut scenes = Vec::new();
    for entry in &experiment.scene {
        let scene = match entry.file {
            None => abstract_scene(experiment, entry, path, &text)?,
            Some(_) => {
                rendered_scene(experiment, entry, (path, &text), (device, traversal, &mut taken), &mut warnings)?
            }
        };
        check_pixels(experiment, &scene, path, &text)?;
        check_distinct(&scene, path, &text)?;
        scenes.push(scene);
    }
    let mut metrics = vec![experiment.metric];
    metrics.extend(Metric::ALL.into_iter().filter(|&m| m != experiment.metric));
    Ok(Plan {
        name: experiment.name.clone(),
        question: experiment.question.clone(),
        experiment: text,
        seed: experiment.budget.seed,
        replicates: experiment.budget.replicates,
        stop: experiment.budget.stop(),
        checkpoints: powers_of_two(experiment.budget.spp),
        metrics,
        targets: experiment.targets.clone(),
        probes: experiment.probes.clone(),
        log_pixels: experiment.log == super::Log::Pixels,
        scenes,
        claims: experiment.claim.clone(),
        devices: taken.notes(),
        warnings,
    })
}

/// Probes and regions lie on the film.
fn check_pixels(experiment: &Experiment, scene: &PlannedScene<'_>, path: &Path, text: &str) -> Result<()> {
    let shape = scene.contenders[0].estimator.shape();
    for (i, claim) in experiment.claim.iter().enumerate().filter(|(_, c)| c.speaks_of(&scene.name)) {
        if let Some([x0, y0, x1, y1]) =
            claim.region.filter(|r| r[2] as usize > shape.width || r[3] as usize > shape.height)
        {
            let (w, h, name) = (shape.width, shape.height, &scene.name);
            let message =
                format!("region [{x0}, {y0}, {x1}, {y1}] ends outside the film of {w} × {h} pixels of {name}");
            return fail_at(path, text, &["claim", &i.to_string(), "region"], message);
        }
    }
    let outside = |p: &&[u32; 2]| p[0] as usize >= shape.width || p[1] as usize >= shape.height;
    match experiment.probes.iter().find(outside) {
        Some([x, y]) => fail_at(
            path,
            text,
            &["probes"],
            format!(
                "probe [{x}, {y}] lies outside the film of {} × {} pixels of {}",
                shape.width, shape.height, scene.name
            ),
        ),
        None => Ok(()),
    }
}

/// Two strategies that come down to the same samples would be compared with themselves.
fn check_distinct(scene: &PlannedScene<'_>, path: &Path, text: &str) -> Result<()> {
    let samples: Vec<_> = scene.contenders.iter().map(|c| (c.estimator.identity(), c.strategy)).collect();
    for (i, own) in samples.iter().enumerate() {
        if let Some(j) = samples[..i].iter().position(|other| other == own) {
            let (a, b) = (&scene.contenders[j], &scene.contenders[i]);
            let message = format!(
                "`{}` is the same strategy on the same device as `{}` ({}): it would be the same samples",
                b.name, a.name, a.device
            );
            return fail_at(path, text, &["strategy", &i.to_string()], message);
        }
    }
    Ok(())
}

/// Paths in an experiment are relative to its file.
fn beside(path: &Path, file: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new(".")).join(file)
}

/// An integrand or a mock.
fn abstract_scene(
    experiment: &Experiment,
    entry: &SceneEntry,
    path: &Path,
    text: &str,
) -> Result<PlannedScene<'static>> {
    let size = experiment.film.map_or([16, 16], |f| [f.width as usize, f.height as usize]);
    let contender = |s: &StrategyEntry| {
        let (name, strategy) = s.resolve();
        let sequence = strategy.sequence;
        let estimator: Box<dyn Estimator> = match (entry.integrand, entry.mock) {
            (Some(integrand), _) => Box::new(IntegrandEstimator { integrand, size, sequence }),
            (None, mock) => {
                let knobs = s.mock.unwrap_or_default();
                let distribution = knobs.distribution.or(mock).expect("checked on loading");
                Box::new(Mock { distribution, knobs, size, sequence })
            }
        };
        Contender { name, device: "cpu".into(), strategy, estimator }
    };
    let reference = match &experiment.reference {
        Some(ReferenceEntry { exact: Some(value), .. }) => ReferencePlan::Exact(*value),
        // Beside rendered scenes [reference] is theirs.
        Some(_) if experiment.scene.iter().all(|s| s.file.is_none()) => {
            let message = format!("the value of {} is known; leave [reference] out", entry.label());
            return fail_at(path, text, &["reference"], message);
        }
        _ => ReferencePlan::Exact(entry.integrand.map_or(crate::estimator::mock::MEAN, |i| i.integral())),
    };
    let contenders = experiment.strategy.iter().map(contender).collect();
    Ok(PlannedScene { name: entry.label(), contenders, reference, max_depth: None, rendered: false })
}

/// Reads the scene file of an entry (which has one) and applies what the experiment at `path` says of film and depth.
pub fn read_scene(experiment: &Experiment, entry: &SceneEntry, path: &Path) -> Result<Scene> {
    let file = beside(path, entry.file.as_deref().expect("checked on loading"));
    let options = Options {
        parameters: entry.parameters.iter().map(|(k, v)| (k.clone(), v.clone())).collect(),
        size: experiment.film.map(|f| [f.width, f.height]),
        allow_outside: experiment.allow_outside,
    };
    let mut scene = crate::scene::format::load(&file, &options)?;
    match experiment.max_depth {
        Some(MaxDepth::Edges(n)) => scene.depth.max = Some(n),
        Some(MaxDepth::Unbounded(_)) => scene.depth.max = None,
        None => {}
    }
    Ok(scene)
}

fn rendered_scene(
    experiment: &Experiment,
    entry: &SceneEntry,
    (path, text): (&Path, &str),
    (device, traversal, taken): (&DeviceRequest, Traversal, &mut Taken),
    warnings: &mut Vec<String>,
) -> Result<PlannedScene<'static>> {
    let mut scene = read_scene(experiment, entry, path)?;
    warnings.append(&mut scene.warnings);
    let reference = experiment.restricted(Preset::Sobol.strategy());
    let direct = reference.technique == Technique::Direct;
    let max_depth = if direct { Some(depths(&scene, &reference).0) } else { scene.depth.max };
    let mut tracers = PathTracers::new(Arc::new(PreparedScene::new(scene)?), experiment.all_effects);
    let mut contenders = Vec::new();
    for (i, s) in experiment.strategy.iter().enumerate() {
        let (name, strategy) = s.resolve();
        let strategy = experiment.restricted(strategy);
        let chosen = taken.take(s.device.as_ref().unwrap_or(device));
        // What the command line says of Vulkan devices is not meant for the CPU.
        let default = if chosen.as_ref().is_ok_and(Chosen::is_cpu) { Traversal::Compute } else { traversal };
        let made = chosen.and_then(|c| tracers.estimator(&c, s.traversal.unwrap_or(default), strategy));
        let (estimator, device) = match made {
            Err(e @ Error::Unavailable { .. }) if s.device.is_some() || s.traversal.is_some() => {
                return fail_at(path, text, &["strategy", &i.to_string()], format!("`{name}`: {e}"));
            }
            made => made?,
        };
        contenders.push(Contender { name, device, strategy, estimator });
    }
    let shape = contenders[0].estimator.shape();
    if direct {
        let given = !matches!(experiment.reference, Some(ReferenceEntry { exact: None, image: None, .. }));
        let judge = if given { "; the reference is given and may hold more" } else { " and the reference" };
        let name = entry.label();
        warnings.push(format!("{name}: --only direct restricts strategies to paths of at most two edges{judge}"));
    }
    let reference = match experiment.reference.as_ref().expect("checked on loading") {
        ReferenceEntry { exact: Some(value), .. } => ReferencePlan::Exact(*value),
        ReferenceEntry { image: Some(image), .. } => image_reference(&beside(path, image), shape)?,
        ReferenceEntry { spp, replicates, .. } => ReferencePlan::Rendered {
            // Judged by our own traversal: a driver's may leak, and errors would not show it.
            estimator: tracers.estimator(&taken.take(device)?, Traversal::Compute, reference)?.0,
            name: format!("MIS with Sobol points{}", if direct { ", direct light only" } else { "" }),
            spp: spp.expect("checked on loading"),
            replicates: replicates.unwrap_or(REFERENCE_REPLICATES),
        },
    };
    Ok(PlannedScene { name: entry.label(), contenders, reference, max_depth, rendered: true })
}

/// Reads a reference image with its standard error.
fn image_reference(path: &Path, shape: Shape) -> Result<ReferencePlan<'static>> {
    let layers = read_exr(path)?;
    let fail = |message: String| Err(Error::damaged(path, message));
    if (layers.width, layers.height) != (shape.width, shape.height) {
        let (w, h) = (layers.width, layers.height);
        return fail(format!("{w} × {h} pixels; the film has {} × {}", shape.width, shape.height));
    }
    let Some((3, mean)) = layers.layer("") else { return fail("no channels R, G, B".into()) };
    let Some((3, error)) = layers.std_error() else {
        return fail("no channels std_error.R, .G, .B: a reference must say how certain it is".into());
    };
    if !mean.iter().chain(&error).all(|v| v.is_finite()) {
        return fail("non-finite values; a reference must be finite".into());
    }
    let wide = |values: Vec<f32>| values.into_iter().map(f64::from);
    let reference =
        Reference { mean: wide(mean).collect(), variance: wide(error).map(|e| e * e).collect(), replicates: None };
    Ok(ReferencePlan::Image { path: path.to_owned(), reference })
}
