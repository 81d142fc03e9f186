//! `cargo +nightly fuzz run cell`: any bytes in place of a cell are an estimate or an error. A right checksum gets them past the
//! first gate, and a header with arbitrary numbers past the second.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rootn::moments::cell::CellFolder;
use std::sync::OnceLock;
use tempfile::TempDir;

fuzz_target!(|bytes: &[u8]| {
    static ROOT: OnceLock<TempDir> = OnceLock::new();
    let root = ROOT.get_or_init(|| tempfile::tempdir().expect("a temporary folder")).path();
    let cell = CellFolder::new(root, "fuzz".into());
    let Some((&[kind, values, samples, pixels, channels, bad], rest)) = bytes.split_first_chunk::<6>() else { return };
    let mut body = Vec::new();
    if kind & 1 == 1 {
        let header = format!(
            r#"{{"identity":"fuzz","values":{values},"samples":{samples},"seconds":1,"non_finite":{bad},"located":[],"pixels":{pixels},"channels":{channels}}}"#
        );
        body.extend(b"rootncel");
        body.extend(2u32.to_le_bytes());
        body.extend((header.len() as u64).to_le_bytes());
        body.extend(header.as_bytes());
    }
    body.extend(rest);
    let checksum = blake3::hash(&body);
    body.extend(checksum.as_bytes());
    let folder = root.join(cell.hash());
    std::fs::create_dir_all(&folder).expect("a folder");
    for name in ["state.cell".into(), format!("{samples}.cell")] {
        std::fs::write(folder.join(name), &body).expect("a file");
    }
    let _ = cell.load_checkpoint(samples.into(), values.into());
    let _ = cell.load_state(pixels.into(), channels.into());
});
