//! Reading experiment files: every error names file and line, what was found and what is allowed.

use super::Experiment;
use crate::claim::Claim;
use crate::error::{Error, Place, Result, suggestion};
use crate::estimator::MOST_PIXELS;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Largest experiment file that is read, in bytes.
const LARGEST: u64 = 1 << 20;
/// Longest name, in bytes: file systems end at 255, and file names add to it.
const LONGEST_NAME: usize = 100;
/// Most targets, and most probes.
const LONGEST_LIST: usize = 64;

/// Reads an experiment file; `overrides` are `key.path=value` pairs that win over the file. The text is the file's,
/// followed by the overrides as comments.
pub fn load(path: &Path, overrides: &[String]) -> Result<(Experiment, String)> {
    let size = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.len();
    if size > LARGEST {
        return Err(Error::input(Place::file(path), format!("{size} bytes; an experiment file has at most {LARGEST}")));
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml")) {
        let message = "a scene; an experiment is a TOML file that names scenes (`rootn render` takes a scene alone)";
        return Err(Error::input(Place::file(path), message));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let mut text = String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        Error::input(Place::line(path, line), "not UTF-8 text")
    })?;
    if overrides.is_empty() {
        return Ok((parse(path, &text)?, text));
    }
    let mut table: toml::Table = toml::from_str(&text).map_err(|e| toml_error(path, &text, &e))?;
    for o in overrides {
        set(&mut table, o)?;
    }
    let experiment: Experiment = match table.try_into::<Experiment>() {
        Ok(experiment) => experiment,
        // Where the file itself is wrong, its line helps more.
        Err(e) => {
            let text_of = e.to_string();
            let key = text_of.lines().find(|l| l.starts_with("in `")).map(|l| format!(" ({l})")).unwrap_or_default();
            let mistaken = || Error::Usage(format!("--set: {}{key}", said(&e)));
            return Err(parse(path, &text).err().unwrap_or_else(mistaken));
        }
    };
    check(path, &text, &experiment)?;
    for o in overrides {
        text += &format!("\n# --set {}", o.escape_debug());
    }
    Ok((experiment, text))
}

/// Parses and checks the text of an experiment file; `path` is used in messages only.
pub fn parse(path: &Path, text: &str) -> Result<Experiment> {
    let experiment: Experiment = toml::from_str(text).map_err(|e| toml_error(path, text, &e))?;
    check(path, text, &experiment)?;
    Ok(experiment)
}

/// Sets one `key.path=value`; what is no TOML value is taken as text.
fn set(table: &mut toml::Table, o: &str) -> Result<()> {
    let usage = || Error::Usage(format!("--set {o}: expected KEY=VALUE, for example budget.spp=512"));
    let (key, value) = o.split_once('=').ok_or_else(usage)?;
    let parsed = toml::from_str::<toml::Table>(&format!("v = {value}")).ok().and_then(|mut t| t.remove("v"));
    let value = parsed.unwrap_or_else(|| toml::Value::String(value.to_owned()));
    let mut parts: Vec<&str> = key.split('.').map(str::trim).collect();
    let last = parts.pop().filter(|k| !k.is_empty()).ok_or_else(usage)?;
    let mut table = table;
    for part in parts {
        let entry = table.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        table = entry.as_table_mut().ok_or_else(|| Error::Usage(format!("--set {o}: `{part}` is not a table")))?;
    }
    table.insert(last.to_owned(), value);
    Ok(())
}

/// The parser's message, with a likely name where one is unknown.
fn said(e: &toml::de::Error) -> String {
    let message = e.message();
    let hint = unknown_name(message).map(|hint| format!("; did you mean `{hint}`?"));
    // Serde speaks of this program's types.
    let message = ["u32", "u64"]
        .iter()
        .fold(message.to_owned(), |m, t| m.replace(&format!("expected {t}"), "expected a whole number, not negative"));
    format!("{message}{}", hint.unwrap_or_default())
}

fn toml_error(path: &Path, text: &str, e: &toml::de::Error) -> Error {
    let mut place = Place::file(path);
    if let Some(before) = e.span().and_then(|s| text.get(..s.start)) {
        place.line = before.matches('\n').count() as u32 + 1;
        place.column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) as u32 + 1;
    }
    Error::input(place, said(e))
}

/// The likeliest of the names that serde lists after an unknown one.
fn unknown_name(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown field `").or_else(|| message.strip_prefix("unknown variant `"))?;
    let (found, expected) = rest.split_once('`')?;
    suggestion(found, expected.split('`').skip(1).step_by(2)).map(str::to_owned)
}

/// An input error at a key, given as the way to it: `["claim", "2", "of"]`. Where the way ends early, so does the place.
pub(super) fn fail_at<T>(path: &Path, text: &str, keys: &[&str], message: impl Into<String>) -> Result<T> {
    Err(Error::input(Place::line(path, line_of(text, keys).unwrap_or(0)), message))
}

/// The line of a key.
fn line_of(text: &str, keys: &[&str]) -> Option<u32> {
    let root = DeTable::parse(text).ok()?;
    let mut value = DeValue::Table(root.into_inner());
    let mut start = None;
    for key in keys {
        let found = match value {
            DeValue::Table(table) => table.into_iter().find(|(k, _)| k.get_ref() == key).map(|(k, v)| (k.span(), v)),
            DeValue::Array(array) => key.parse().ok().and_then(|i| array.into_iter().nth(i)).map(|v| (v.span(), v)),
            _ => None,
        };
        let Some((span, next)) = found else { break };
        start = Some(span.start);
        value = next.into_inner();
    }
    Some(text.get(..start?)?.matches('\n').count() as u32 + 1)
}

/// What types cannot say.
fn check(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let fail = |keys: &[&str], message: String| fail_at(path, text, keys, message);
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if e.name.is_empty() || e.name == "cells" || e.name.starts_with('.') || !e.name.chars().all(safe) {
        let allowed = "letters, digits, '-', '_' and '.' are allowed, except \"cells\" (it names a folder)";
        return fail(&["name"], format!("name {:?}: {allowed}", e.name));
    }
    if e.name.len() > LONGEST_NAME {
        return fail(&["name"], format!("name: {} letters; at most {LONGEST_NAME} are allowed", e.name.len()));
    }
    for (what, number) in [("scene", e.scene.len()), ("strategy", e.strategy.len())] {
        if number == 0 {
            return fail(&[what], format!("no [[{what}]]; an experiment needs at least one"));
        }
    }
    check_numbers(path, text, e)?;
    let strategies: Vec<String> = e.strategy.iter().map(|s| s.resolve().0).collect();
    check_names(path, text, "strategy", &strategies)?;
    let scenes: Vec<String> = e.scene.iter().map(super::SceneEntry::label).collect();
    check_names(path, text, "scene", &scenes)?;
    for (i, s) in e.scene.iter().enumerate() {
        let kinds = [s.file.is_some(), s.integrand.is_some(), s.mock.is_some()];
        if kinds.iter().filter(|k| **k).count() != 1 {
            return fail(&["scene", &i.to_string()], "a scene has one of `file`, `integrand` and `mock`".into());
        }
        if s.file.is_none() && !s.parameters.is_empty() {
            return fail(&["scene", &i.to_string(), "parameters"], "only a scene file has parameters".into());
        }
        if e.reference.is_none() && s.file.is_some() {
            let message = "a rendered scene needs a [reference]: `spp`, `image` or `exact`";
            return fail(&["scene", &i.to_string()], message.into());
        }
    }
    check_reference(path, text, e)?;
    check_mocks(path, text, e)?;
    let strategies: Vec<&str> = strategies.iter().map(String::as_str).collect();
    let scenes: Vec<&str> = scenes.iter().map(String::as_str).collect();
    for (i, c) in e.claim.iter().enumerate() {
        c.check(&strategies, &scenes).or_else(|m| fail(&["claim", &i.to_string()], m))?;
    }
    Ok(())
}

/// Ranges of numbers.
fn check_numbers(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let in_range = |keys: &[&str], value: u64, least: u64, most: u64| {
        if (least..=most).contains(&value) {
            Ok(())
        } else {
            fail_at(path, text, keys, format!("{} = {value}: {least} to {most} are allowed", keys.join(".")))
        }
    };
    in_range(&["budget", "spp"], e.budget.spp, 1, 1 << 48)?;
    in_range(&["budget", "replicates"], u64::from(e.budget.replicates), 1, 10_000)?;
    check_stop(path, text, e)?;
    if let Some(f) = e.film {
        in_range(&["film", "width"], u64::from(f.width), 1, 65_536)?;
        in_range(&["film", "height"], u64::from(f.height), 1, 65_536)?;
        let pixels = u64::from(f.width) * u64::from(f.height);
        if pixels > MOST_PIXELS {
            return fail_at(
                path,
                text,
                &["film"],
                format!("a film of {pixels} pixels; at most {MOST_PIXELS} are allowed"),
            );
        }
    }
    for (key, number) in [("targets", e.targets.len()), ("probes", e.probes.len())] {
        if number > LONGEST_LIST {
            return fail_at(path, text, &[key], format!("{number} {key}; at most {LONGEST_LIST} are allowed"));
        }
    }
    match e.targets.iter().find(|t| !(**t > 0.0 && t.is_finite())) {
        Some(t) => fail_at(path, text, &["targets"], format!("targets: {t} is not a positive number")),
        None => Ok(()),
    }
}

/// What ends a run early.
fn check_stop(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let b = &e.budget;
    let fail = |key: &str, message: String| fail_at(path, text, &["budget", key], format!("budget.{key}{message}"));
    if b.until.is_some() && e.claim.is_empty() {
        return fail("until", " = \"decided\": there is no [[claim]] to decide".into());
    }
    if b.until.is_some() && b.relative_error.is_some() {
        return fail("relative_error", ": a run ends either when claims are decided or at an error, not both".into());
    }
    if let Some(error) = b.relative_error {
        if !(error > 0.0 && error.is_finite()) {
            return fail("relative_error", format!(" = {error}: a positive number is allowed"));
        }
        if !e.metric.converges_to_zero() {
            return fail("relative_error", format!(": the metric {} does not tend to 0", e.metric.info().name));
        }
        if b.replicates < 2 {
            return fail("relative_error", ": it takes at least 2 replicates to know an error's confidence".into());
        }
    }
    match (b.confidence, b.relative_error) {
        (Some(c), _) if !(c > 0.5 && c < 1.0) => fail("confidence", format!(" = {c}: between 0.5 and 1 is allowed")),
        (Some(_), None) => {
            fail("confidence", ": it belongs to `relative_error`; claims have a confidence of their own".into())
        }
        _ => Ok(()),
    }
}

fn check_reference(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let Some(r) = &e.reference else { return Ok(()) };
    let fail = |key: &str, message: String| fail_at(path, text, &["reference", key], message);
    let given = usize::from(r.spp.is_some()) + usize::from(r.image.is_some()) + usize::from(r.exact.is_some());
    if given != 1 {
        return fail("", format!("[reference] needs exactly one of `spp`, `image`, `exact`; found {given}"));
    }
    if let Some(n) = r.spp.filter(|n| !(1..=1 << 48).contains(n)) {
        return fail("spp", format!("reference.spp = {n}: 1 to {} are allowed", 1u64 << 48));
    }
    if let Some(n) = r.replicates.filter(|n| !(2..=10_000).contains(n)) {
        return fail("replicates", format!("reference.replicates = {n}: 2 to 10000 are allowed"));
    }
    if r.replicates.is_some() && r.spp.is_none() {
        return fail("replicates", "reference.replicates: only a rendered reference (`spp`) has replicates".into());
    }
    match r.exact.filter(|x| !(x.abs() <= f64::from(f32::MAX))) {
        Some(x) => {
            fail("exact", format!("reference.exact = {x}: a finite number in the range of 32-bit floats is allowed"))
        }
        None => Ok(()),
    }
}

/// What is for mocks only, or for calibration only.
fn check_mocks(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let measured = e.scene.iter().find(|s| s.mock.is_none());
    for (i, knobs) in e.strategy.iter().enumerate().filter_map(|(i, s)| Some((i, s.mock?))) {
        let fail = |message: String| fail_at(path, text, &["strategy", &i.to_string(), "mock"], message);
        if let Some(scene) = measured {
            return fail(format!("strategy.mock is for scenes with a `mock`; `{}` has none", scene.label()));
        }
        knobs.check().or_else(fail)?;
    }
    if let Some(c) = e.calibration.filter(|c| !(1..=1_000_000).contains(&c.repetitions)) {
        let message = format!("calibration.repetitions = {}: 1 to 1000000 are allowed", c.repetitions);
        return fail_at(path, text, &["calibration", "repetitions"], message);
    }
    if e.calibration.is_some() && e.budget.relative_error.is_some() {
        let message = "budget.relative_error: calibration does not go with relative_error";
        return fail_at(path, text, &["budget", "relative_error"], message);
    }
    let same =
        |a: &Claim, b: &Claim| a.text == b.text && (a.scene.is_none() || b.scene.is_none() || a.scene == b.scene);
    let again = |i: &usize| e.claim[..*i].iter().any(|c| same(c, &e.claim[*i]));
    if let Some(i) = (0..e.claim.len()).filter(|_| e.calibration.is_some()).find(again) {
        let message = "a second claim with the same text: tables of a calibration tell claims apart by it";
        return fail_at(path, text, &["claim", &i.to_string(), "text"], message);
    }
    if e.calibration.is_some() && e.budget.spp < 2 {
        return fail_at(
            path,
            text,
            &["budget", "spp"],
            "budget.spp = 1: calibration takes at least 2 samples per value",
        );
    }
    match e.claim.iter().position(|c| c.truth.is_some()).filter(|_| e.calibration.is_none()) {
        Some(i) => {
            let message = "`truth` is what `rootn calibrate` holds verdicts against; there is no [calibration]";
            fail_at(path, text, &["claim", &i.to_string(), "truth"], message)
        }
        None => Ok(()),
    }
}

/// Names of scenes or strategies: each its own, also as a folder.
fn check_names(path: &Path, text: &str, what: &str, names: &[String]) -> Result<()> {
    let folder = |name: &str| crate::run::file_name(name).to_lowercase();
    for (i, name) in names.iter().enumerate() {
        let fail = |message: String| fail_at(path, text, &[what, &i.to_string(), "name"], message);
        if name.is_empty() || name.len() > LONGEST_NAME || name.contains(char::is_control) {
            let allowed = format!("1 to {LONGEST_NAME} bytes without control characters are allowed");
            return fail(format!("name {name:?} of a {what}: {allowed}"));
        }
        if let Some(other) = names[..i].iter().find(|n| folder(n) == folder(name)) {
            return fail(match other == name {
                true => format!("a second {what} named `{name}`; give it another `name`"),
                false => format!("the {what} names `{other}` and `{name}` would be the same folder; change one"),
            });
        }
    }
    Ok(())
}

impl super::SceneEntry {
    /// The scene's name in tables.
    pub fn label(&self) -> String {
        let stem = || self.file.as_ref()?.file_stem().map(|s| s.to_string_lossy().into_owned());
        let named = || self.integrand.map(|i| i.label()).or_else(|| self.mock.map(|m| m.label())).map(str::to_owned);
        self.name.clone().or_else(stem).or_else(named).unwrap_or_else(|| "scene".into())
    }
}
