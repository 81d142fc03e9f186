//! `curves.csv`: the measured points in tidy form, one row per scene, strategy, replicate, checkpoint and metric.

use crate::error::{Error, Result};
use crate::record::Record;

/// The columns. `value` is the metric itself (not its root), corrected for the reference's variance where it is a square;
/// `predicted` is what σ/√N predicts for the headline metric, empty for other metrics and dependent samples.
const COLUMNS: [&str; 9] =
    ["scene", "strategy", "device", "replicate", "spp", "seconds", "metric", "value", "predicted"];

/// The file's text. Numbers are written with as many digits as read back to the same bits; replicates count from 0.
pub(super) fn curves(record: &Record) -> Result<String> {
    let encode = |e: ::csv::Error| Error::io("curves.csv", std::io::Error::other(e));
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS).map_err(encode)?;
    for scene in &record.scenes {
        for strategy in &scene.strategies {
            for point in &strategy.checkpoints {
                for (index, (metric, result)) in record.metrics.iter().zip(&point.metrics).enumerate() {
                    let predicted = point.predicted.filter(|_| index == 0).map(|p| p.to_string()).unwrap_or_default();
                    for (replicate, value) in result.values.iter().enumerate() {
                        let seconds = point.seconds.get(replicate).map(f64::to_string).unwrap_or_default();
                        let (replicate, spp, value) = (replicate.to_string(), point.spp.to_string(), value.to_string());
                        writer
                            .write_record([
                                &scene.name,
                                &strategy.name,
                                &strategy.device,
                                &replicate,
                                &spp,
                                &seconds,
                                &metric.name,
                                &value,
                                &predicted,
                            ])
                            .map_err(encode)?;
                    }
                }
            }
        }
    }
    let bytes = writer.into_inner().map_err(|e| encode(e.into_error().into()))?;
    Ok(String::from_utf8(bytes).expect("made of strings"))
}
