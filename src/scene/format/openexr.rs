//! OpenEXR files, with checks that bound time and memory before anything is decoded.

use exr::meta::MetaData;
use exr::prelude::{FlatImage, ReadChannels, ReadLayers, read};
use std::io::Cursor;

/// Largest size of the samples that a file may declare, in bytes.
const MAX_BYTES: u128 = 1 << 31;
/// Largest ratio of declared samples to file size that is believed: DEFLATE reaches 1032, wavelets on constants some more.
const MAX_COMPRESSION: u128 = 4096;

/// Decodes all parts; the error says what was found. Deep and subsampled images are refused, as are files that declare
/// more samples than their own size can hold.
pub(crate) fn decode(bytes: &[u8]) -> Result<FlatImage, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| format!("not an EXR image: {e}"))?;
    for header in &meta.headers {
        if header.deep {
            return Err("a deep image; only flat ones can be read".into());
        }
        let pixels = header.layer_size.width() as u128 * header.layer_size.height() as u128;
        let declared = 4 * pixels * header.channels.list.len() as u128;
        if declared > MAX_BYTES.min(bytes.len() as u128 * MAX_COMPRESSION) {
            return Err(format!(
                "declares {} × {} pixels of {} channels in a file of {} bytes",
                header.layer_size.width(),
                header.layer_size.height(),
                header.channels.list.len(),
                bytes.len()
            ));
        }
        if header.channels.list.iter().any(|c| c.sampling.x() != 1 || c.sampling.y() != 1) {
            return Err("subsampled channels; every channel must have one value per pixel".into());
        }
    }
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| format!("damaged image: {e}"))
}
