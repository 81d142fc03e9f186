//! `cargo +nightly fuzz run obj`: any bytes are a mesh or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let _ = rootn::scene::format::obj::parse(bytes, Path::new("mesh.obj"));
});
