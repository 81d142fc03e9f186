//! Every scene file of other people that is at hand: it loads, or one error names the place and what is missing.

use crate::support::shared;
use rootn::Error;
use rootn::scene::format::{Options, load};
use std::path::{Path, PathBuf};

/// Scene files below a folder, sorted.
fn scene_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "xml") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn real_scenes_load_or_name_what_is_missing() {
    let Some(folder) = shared("scenes") else { return };
    let (mut loaded, mut failures) = (0, Vec::new());
    let files = scene_files(&folder);
    for path in &files {
        let name = path.strip_prefix(&folder).unwrap().display();
        match load(path, &Options { size: Some([16, 16]), allow_outside: true, ..Options::default() }) {
            Ok(scene) => {
                loaded += 1;
                println!("{name}: {} shapes, {} warnings", scene.shapes.len(), scene.warnings.len());
            }
            Err(Error::Input { place, message }) => {
                println!("{name}:{} {message}", place.line);
                let named = place.file.is_file() && (place.line > 0 || !place.file.extension().is_some_and(|e| e == "xml"));
                if !named || message.contains('\n') {
                    failures.push(format!("{name}: {place}: {message}"));
                }
            }
            Err(other) => failures.push(format!("{name}: {other}")),
        }
    }
    println!("{loaded} of {} load", files.len());
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    assert!(loaded > 0);
}
