//! `cargo +nightly fuzz run mitsuba`: any text is a checked scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|text: &str| {
    // A folder that is not there: no file can be included.
    let _ = rootn::scene::format::mitsuba::parse_str(text, Path::new("/nowhere/scene.xml"), &[], None);
});
