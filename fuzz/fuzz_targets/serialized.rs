//! `cargo +nightly fuzz run serialized`: any bytes are a mesh or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let _ = rootn::scene::format::serialized::parse(bytes, 0, Path::new("mesh.serialized"));
});
