//! `cargo +nightly fuzz run experiment`: any text is an experiment or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|text: &str| {
    let _ = rootn::experiment::load::parse(Path::new("experiment.toml"), text);
});
