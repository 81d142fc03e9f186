//! Which statistics become which image layers.

use super::image::Layers;
use crate::estimator::{Shape, dependence_of};
use crate::moments::Moments;
use crate::record::Dependence;
use crate::sampling::Sequence;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Mean, sample variance, standard error of the mean and sample count of a three-channel field. Layers that are not
/// defined (one sample, one replicate) are left out rather than filled.
pub fn statistics(shape: Shape, mean: &[f64], variance: &[f64], std_error: &[f64], n: u64) -> Layers {
    let mut layers = Layers::new(shape.width, shape.height);
    for (prefix, values) in [("", mean), ("sample_variance", variance), ("std_error", std_error)] {
        if !values.iter().all(|v| v.is_nan()) {
            push(&mut layers, prefix, |i| values[i] as f32);
        }
    }
    if n > 0 {
        layers.insert_counts("n", vec![u32::try_from(n).unwrap_or(u32::MAX); shape.pixels()]);
    }
    layers
}

/// Adds a layer of three channels.
pub fn add(layers: &mut Layers, name: &str, values: &[f64]) {
    push(layers, name, |i| values[i] as f32);
}

/// Every moment of a three-channel field. The standard error is s/√n where samples are independent; otherwise one run
/// cannot tell it, and the layer is left out.
pub fn of_moments(shape: Shape, moments: &[Moments], sequence: Sequence) -> Layers {
    let mut layers = Layers::new(shape.width, shape.height);
    let variance = |m: &Moments| m.sample_variance().unwrap_or(f64::NAN);
    push(&mut layers, "", |i| moments[i].mean as f32);
    if moments.iter().any(|m| m.n > 1) {
        push(&mut layers, "sample_variance", |i| variance(&moments[i]) as f32);
        if dependence_of(sequence) == Dependence::Independent {
            push(&mut layers, "std_error", |i| (variance(&moments[i]) / moments[i].n as f64).sqrt() as f32);
        }
    }
    push(&mut layers, "m3", |i| moments[i].m3 as f32);
    push(&mut layers, "m4", |i| moments[i].m4 as f32);
    push(&mut layers, "min", |i| moments[i].min as f32);
    push(&mut layers, "max", |i| moments[i].max as f32);
    for (c, channel) in CHANNELS.into_iter().enumerate() {
        let of = |pick: fn(&Moments) -> u64| {
            moments.iter().skip(c).step_by(3).map(|m| u32::try_from(pick(m)).unwrap_or(u32::MAX)).collect()
        };
        layers.counts.insert(format!("argmax.{channel}"), of(|m| m.argmax));
        layers.counts.insert(format!("non_finite.{channel}"), of(|m| m.non_finite));
        layers.counts.insert(format!("zeros.{channel}"), of(|m| m.zeros));
    }
    layers.insert_counts("n", moments.iter().step_by(3).map(|m| u32::try_from(m.n).unwrap_or(u32::MAX)).collect());
    layers
}

/// One layer of three channels from a function of the value index.
fn push(layers: &mut Layers, name: &str, value: impl Fn(usize) -> f32) {
    let values = 3 * layers.width * layers.height;
    layers.insert(name, 3, (0..values).map(value));
}
