//! EXR images with statistics layers.
//!
//! One file holds one field. The mean is `R,G,B` (or `Y` for one channel), so that every viewer opens it; each further
//! statistic is a layer of its own, `layer.R`, `layer.G`, `layer.B` (or `layer.Y`): see [`DEFINITIONS`]. All values are
//! 32-bit floats, counts 32-bit unsigned integers, compressed without loss (ZIP, 16 lines).

use crate::error::{Error, Result};
use crate::record::write_atomically;
use crate::scene::format::openexr;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder, Text,
    WritableImage,
};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// The layers that rootn writes and what they mean. The text goes into the header as `definition.<layer>`.
pub const DEFINITIONS: &[(&str, &str)] = &[
    ("mean", "mean of all samples of the pixel; linear radiance, Rec. 709 primaries; no clamp, no tone curve"),
    ("sample_variance", "unbiased variance of one sample: sum (x - mean)^2 / (n - 1)"),
    ("std_error", "standard error of the mean"),
    ("n", "number of samples in the mean"),
    ("m2", "sum (x - mean)^2"),
    ("m3", "sum (x - mean)^3"),
    ("m4", "sum (x - mean)^4"),
    ("min", "smallest sample"),
    ("max", "largest sample"),
    ("argmax", "index of the largest sample"),
    ("non_finite", "number of samples that were not finite; they are not in the mean"),
    ("zeros", "number of samples that were exactly 0"),
];

/// A field of `width` × `height` values with any number of named channels, row by row from the top left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Channels of 32-bit floats by full name (`R`, `sample_variance.G`), each of `width * height` values.
    pub floats: BTreeMap<String, Vec<f32>>,
    /// Channels of counts by full name (`n.Y`), each of `width * height` values.
    pub counts: BTreeMap<String, Vec<u32>>,
}

/// What the header says about a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Samples per pixel, all replicates together (`samplesPerPixel`, int).
    pub samples_per_pixel: u64,
    /// Seconds of sampling (`renderTimeSeconds`, float).
    pub render_time_seconds: f64,
    /// Experiment seed (`seed`, text: it has 64 bits).
    pub seed: u64,
    /// Name of the strategy (`strategy`, text).
    pub strategy: String,
    /// Hash of what determines the samples (`cellHash`, text).
    pub cell_hash: String,
    /// Definitions that differ from [`DEFINITIONS`] or add to it: (layer, text).
    pub definitions: Vec<(String, String)>,
}

impl Layers {
    /// A field without channels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Adds a layer from interleaved values, `width * height * channels` of them: three channels become R, G, B, one Y.
    /// An empty name is the picture itself. Panics on any other number of channels.
    pub fn insert(&mut self, layer: &str, channels: usize, values: impl IntoIterator<Item = f32>) {
        let names: &[&str] = match channels {
            1 => &["Y"],
            3 => &["R", "G", "B"],
            _ => panic!("a layer has 1 or 3 channels, not {channels}"),
        };
        let mut planes = vec![Vec::with_capacity(self.width * self.height); channels];
        for (i, value) in values.into_iter().enumerate() {
            planes[i % channels].push(value);
        }
        for (name, plane) in names.iter().zip(planes) {
            assert_eq!(plane.len(), self.width * self.height, "layer {layer:?}");
            self.floats.insert(full_name(layer, name), plane);
        }
    }

    /// Adds a layer of counts, named `layer.Y`.
    pub fn insert_counts(&mut self, layer: &str, counts: Vec<u32>) {
        assert_eq!(counts.len(), self.width * self.height, "layer {layer:?}");
        self.counts.insert(full_name(layer, "Y"), counts);
    }

    /// The values of a layer, interleaved, and its number of channels: 3 where it has R, G and B, 1 where it has Y (or is
    /// a single channel of the name itself). `None` where it has neither.
    pub fn layer(&self, layer: &str) -> Option<(usize, Vec<f32>)> {
        let plane = |name: &str| {
            let counts = || self.counts.get(name).map(|c| c.iter().map(|&v| v as f32).collect());
            self.floats.get(name).cloned().or_else(counts)
        };
        let rgb: Option<Vec<Vec<f32>>> = ["R", "G", "B"].iter().map(|c| plane(&full_name(layer, c))).collect();
        if let Some(rgb) = rgb {
            let pixels = self.width * self.height;
            return Some((3, (0..3 * pixels).map(|i| rgb[i % 3][i / 3]).collect()));
        }
        plane(&full_name(layer, "Y")).or_else(|| plane(layer)).map(|y| (1, y))
    }

    /// The standard error of the mean under any of its names (`std_error`, `stderr`).
    pub fn std_error(&self) -> Option<(usize, Vec<f32>)> {
        self.layer("std_error").or_else(|| self.layer("stderr"))
    }

    /// The layers that have channels, `mean` for the picture itself.
    fn names(&self) -> Vec<&str> {
        let channels = self.floats.keys().chain(self.counts.keys());
        let mut names: Vec<&str> = channels.map(|c| c.rsplit_once('.').map_or("mean", |(layer, _)| layer)).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// `R` in the picture itself, `layer.R` elsewhere.
fn full_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() { channel.to_owned() } else { format!("{layer}.{channel}") }
}

/// UTF-8 text as the format stores it, as bytes.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

/// Writes a file atomically. The same input gives the same bytes.
pub fn write_exr(path: &Path, layers: &Layers, attributes: &Attributes) -> Result<()> {
    let channel = |name: &String, samples| AnyChannel::new(text(name), samples);
    let floats = layers.floats.iter().map(|(name, v)| channel(name, FlatSamples::F32(v.clone())));
    let counts = layers.counts.iter().map(|(name, v)| channel(name, FlatSamples::U32(v.clone())));
    let channels = AnyChannels::sort(floats.chain(counts).collect());
    let encoding = Encoding {
        compression: exr::prelude::Compression::ZIP16,
        blocks: exr::prelude::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((layers.width, layers.height), layer_attributes(layers, attributes), encoding, channels);
    let mut bytes = Vec::new();
    let image = Image::from_layer(layer);
    image
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|e| Error::io(path, std::io::Error::other(format!("cannot encode the image: {e}"))))?;
    sort_header(&mut bytes);
    write_atomically(path, &bytes)
}

/// The header's own attributes.
fn layer_attributes(layers: &Layers, attributes: &Attributes) -> LayerAttributes {
    let software = text(concat!("rootn ", env!("CARGO_PKG_VERSION")));
    let mut header = LayerAttributes { software_name: Some(software), ..LayerAttributes::default() };
    let mut put = |name: &str, value| header.other.insert(text(name), value);
    put("samplesPerPixel", AttributeValue::I32(i32::try_from(attributes.samples_per_pixel).unwrap_or(i32::MAX)));
    put("renderTimeSeconds", AttributeValue::F32(attributes.render_time_seconds as f32));
    put("seed", AttributeValue::Text(text(&attributes.seed.to_string())));
    put("strategy", AttributeValue::Text(text(&attributes.strategy)));
    put("cellHash", AttributeValue::Text(text(&attributes.cell_hash)));
    for name in layers.names() {
        let given = attributes.definitions.iter().find(|d| d.0 == name).map(|d| d.1.as_str());
        let known = || DEFINITIONS.iter().find(|d| d.0 == name).map(|d| d.1);
        if let Some(definition) = given.or_else(known) {
            put(&format!("definition.{name}"), AttributeValue::Text(text(definition)));
        }
    }
    header
}

/// Sorts the attributes of a freshly encoded single-part file by name. The encoder keeps them in a hash map, whose order
/// changes from run to run; the length of the header, and so every offset behind it, stays the same.
fn sort_header(bytes: &mut [u8]) {
    let start = 8;
    let mut attributes = Vec::new();
    let mut at = start;
    let end_of_text = |at: usize| at + bytes[at..].iter().position(|&b| b == 0).expect("terminated") + 1;
    while bytes[at] != 0 {
        let size_at = end_of_text(end_of_text(at));
        let size = u32::from_le_bytes(bytes[size_at..size_at + 4].try_into().expect("four bytes")) as usize;
        attributes.push(bytes[at..size_at + 4 + size].to_vec());
        at = size_at + 4 + size;
    }
    attributes.sort();
    bytes[start..at].copy_from_slice(&attributes.concat());
}

/// Reads the first part of a file. Half floats become floats; deep and subsampled images are refused, as are files that
/// declare more samples than their own size can hold.
pub fn read_exr(path: &Path) -> Result<Layers> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    decode(&bytes).map_err(|message| Error::damaged(path, message))
}

/// Reads an image from memory; the error says what was found.
fn decode(bytes: &[u8]) -> std::result::Result<Layers, String> {
    let image = openexr::decode(bytes)?;
    let part = image.layer_data.into_iter().next().ok_or("an image without parts")?;
    let mut layers = Layers::new(part.size.width(), part.size.height());
    for channel in part.channel_data.list {
        let name = String::from_utf8_lossy(channel.name.as_slice()).into_owned();
        match channel.sample_data {
            FlatSamples::F16(v) => drop(layers.floats.insert(name, v.into_iter().map(f32::from).collect())),
            FlatSamples::F32(v) => drop(layers.floats.insert(name, v)),
            FlatSamples::U32(v) => drop(layers.counts.insert(name, v)),
        }
    }
    Ok(layers)
}
