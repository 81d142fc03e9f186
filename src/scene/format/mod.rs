//! Scene and mesh readers: one file per format.

mod cie;
pub mod mesh;
pub mod mitsuba;
pub mod obj;
pub(crate) mod openexr;
pub mod picture;
pub mod ply;
pub mod serialized;
pub mod spectrum;

use crate::error::{Error, Place, Result};
use crate::scene::Scene;
use std::path::Path;

/// Larger files are refused: offsets and counts then fit 31 bits, and a mistake cannot fill the memory.
const LARGEST_FILE: u64 = 2 << 30;

/// Longest piece of input that a message repeats, in characters.
const LONGEST_QUOTE: usize = 40;

/// How a scene is read.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Pairs (name, value) for `$name` in Mitsuba XML.
    pub parameters: Vec<(String, String)>,
    /// Width and height that replace the film's, crop window included, with the field of view as the file defines it for
    /// that aspect.
    pub size: Option<[u32; 2]>,
    /// Files outside the scene file's folder are read too. A scene may come from anyone, and what is in a file that cannot be
    /// read ends up in messages.
    pub allow_outside: bool,
}

impl Options {
    /// A film of this width and height.
    pub fn sized(size: [u32; 2]) -> Self {
        Self { size: Some(size), ..Self::default() }
    }
}

/// Reads a scene and checks it.
///
/// # Errors
/// [`Error::Input`] with file, line, what was found and what is allowed; [`Error::Io`] where the file cannot be read.
pub fn load(path: &Path, options: &Options) -> Result<Scene> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "xml" => mitsuba::load(path, options),
        _ => Err(Error::input(
            Place::file(path),
            format!("unknown scene format (extension `{extension}`); allowed: .xml (Mitsuba 3)"),
        )),
    }
}

/// A whole file, if it is not too large.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    let data = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    if data.is_dir() {
        return Err(Error::input(Place::file(path), "found a directory; a file is wanted"));
    }
    if data.len() > LARGEST_FILE {
        let message = format!("the file has {} bytes; at most {LARGEST_FILE} are read", data.len());
        return Err(Error::input(Place::file(path), message));
    }
    std::fs::read(path).map_err(|e| Error::io(path, e))
}

/// Input as part of a message: without control characters, cut to a readable length.
fn shorten(text: &str) -> String {
    let visible = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c });
    match text.char_indices().nth(LONGEST_QUOTE) {
        Some(_) => visible.take(LONGEST_QUOTE).chain(['…']).collect(),
        None => visible.collect(),
    }
}
