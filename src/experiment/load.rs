//! Reading experiment files: every error names file and line, what was found and what is allowed.

use super::Experiment;
use crate::error::{Error, Place, Result, suggestion};
use std::path::Path;

/// Largest experiment file that is read, in bytes.
const LARGEST: u64 = 1 << 20;

/// Reads an experiment file; `overrides` are `key.path=value` pairs that win over the file.
pub fn load(path: &Path, overrides: &[String]) -> Result<(Experiment, String)> {
    let size = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.len();
    if size > LARGEST {
        return Err(Error::input(Place::file(path), format!("{size} bytes; an experiment file has at most {LARGEST}")));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        Error::input(Place::line(path, line), "not UTF-8 text")
    })?;
    let text = apply(path, text, overrides)?;
    let experiment = parse(path, &text)?;
    Ok((experiment, text))
}

/// Parses and checks the text of an experiment file; `path` is used in messages only.
pub fn parse(path: &Path, text: &str) -> Result<Experiment> {
    let experiment: Experiment = toml::from_str(text).map_err(|e| toml_error(path, text, &e))?;
    check(path, text, &experiment)?;
    Ok(experiment)
}

/// The text with overrides applied; unchanged without any, so that lines stay what the author sees.
fn apply(path: &Path, text: String, overrides: &[String]) -> Result<String> {
    if overrides.is_empty() {
        return Ok(text);
    }
    let mut table: toml::Table = toml::from_str(&text).map_err(|e| toml_error(path, &text, &e))?;
    for o in overrides {
        let usage = || Error::Usage(format!("--set {o}: expected KEY=VALUE, for example budget.spp=512"));
        let (key, value) = o.split_once('=').ok_or_else(usage)?;
        let parsed = toml::from_str::<toml::Table>(&format!("v = {value}")).ok().and_then(|mut t| t.remove("v"));
        let value = parsed.unwrap_or_else(|| toml::Value::String(value.to_owned()));
        let mut parts: Vec<&str> = key.split('.').collect();
        let last = parts.pop().ok_or_else(usage)?;
        let mut table = &mut table;
        for part in parts {
            let entry = table.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
            table = entry.as_table_mut().ok_or_else(|| Error::Usage(format!("--set {o}: `{part}` is not a table")))?;
        }
        table.insert(last.to_owned(), value);
    }
    toml::to_string_pretty(&table).map_err(|e| Error::Usage(format!("--set: {e}")))
}

fn toml_error(path: &Path, text: &str, e: &toml::de::Error) -> Error {
    let mut place = Place::file(path);
    if let Some(before) = e.span().and_then(|s| text.get(..s.start)) {
        place.line = before.matches('\n').count() as u32 + 1;
        place.column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) as u32 + 1;
    }
    let mut message = e.message().to_owned();
    if let Some(hint) = unknown_name(&message) {
        message += &format!("; did you mean `{hint}`?");
    }
    Error::input(place, message)
}

/// The likeliest of the names that serde lists after an unknown one.
fn unknown_name(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown field `").or_else(|| message.strip_prefix("unknown variant `"))?;
    let (found, expected) = rest.split_once('`')?;
    suggestion(found, expected.split('`').skip(1).step_by(2)).map(str::to_owned)
}

/// Line of the `index`-th header such as `[[claim]]`; 0 if it is not written that way.
fn line_of(text: &str, header: &str, index: usize) -> u32 {
    let mut lines = text.lines().enumerate().filter(|(_, l)| l.trim_start().starts_with(header));
    lines.nth(index).map_or(0, |(i, _)| i as u32 + 1)
}

/// What types cannot say.
fn check(path: &Path, text: &str, e: &Experiment) -> Result<()> {
    let fail = |line: u32, message: String| Err(Error::input(Place::line(path, line), message));
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if e.name.is_empty() || e.name == "cells" || e.name.starts_with('.') || !e.name.chars().all(safe) {
        return fail(
            0,
            format!("name {:?}: letters, digits, '-', '_' and '.' are allowed (it names a folder)", e.name),
        );
    }
    if e.scene.is_empty() || e.strategy.is_empty() {
        return fail(0, "an experiment needs at least one [[scene]] and one [[strategy]]".into());
    }
    let in_range = |what: &str, value: u64, least: u64, most: u64| {
        if (least..=most).contains(&value) {
            Ok(())
        } else {
            fail(0, format!("{what} = {value}: {least} to {most} are allowed"))
        }
    };
    in_range("budget.spp", e.budget.spp, 1, 1 << 48)?;
    in_range("budget.replicates", u64::from(e.budget.replicates), 1, 10_000)?;
    if let Some(f) = e.film {
        in_range("film.width", u64::from(f.width), 1, 65_536)?;
        in_range("film.height", u64::from(f.height), 1, 65_536)?;
        in_range("film.width × film.height", u64::from(f.width) * u64::from(f.height), 1, 1 << 28)?;
    }
    if let Some(t) = e.targets.iter().find(|t| !(**t > 0.0 && t.is_finite())) {
        return fail(0, format!("targets: {t} is not a positive number"));
    }
    let strategies: Vec<String> = e.strategy.iter().map(|s| s.resolve().0).collect();
    for (i, s) in e.strategy.iter().enumerate() {
        let line = line_of(text, "[[strategy]]", i);
        if strategies[..i].contains(&strategies[i]) {
            return fail(line, format!("a second strategy named `{}`; give it another `name`", strategies[i]));
        }
        if let Some(j) = e.strategy[..i].iter().position(|t| t.resolve().1 == s.resolve().1) {
            let (a, b) = (&strategies[j], &strategies[i]);
            return fail(line, format!("`{b}` is the same strategy as `{a}`: it would be the same samples"));
        }
    }
    let scenes: Vec<String> = e.scene.iter().map(super::SceneEntry::label).collect();
    for (i, s) in e.scene.iter().enumerate() {
        let line = line_of(text, "[[scene]]", i);
        if s.file.is_some() == s.integrand.is_some() {
            return fail(line, "a scene has either `file` or `integrand`".into());
        }
        if scenes[..i].contains(&scenes[i]) {
            return fail(line, format!("a second scene named `{}`; give it another `name`", scenes[i]));
        }
        if e.reference.is_none() && s.integrand.is_none() {
            return fail(line, "a rendered scene needs a [reference]: `spp`, `image` or `exact`".into());
        }
    }
    if let Some(r) = &e.reference {
        let given = usize::from(r.spp.is_some()) + usize::from(r.image.is_some()) + usize::from(r.exact.is_some());
        let line = line_of(text, "[reference]", 0);
        if given != 1 {
            return fail(line, format!("[reference] needs exactly one of `spp`, `image`, `exact`; found {given}"));
        }
        if r.replicates.is_some_and(|n| !(2..=10_000).contains(&n)) || r.spp.is_some_and(|n| n == 0 || n > 1 << 48) {
            return fail(line, "[reference]: spp at least 1 and replicates from 2 to 10000 are allowed".into());
        }
    }
    let strategies: Vec<&str> = strategies.iter().map(String::as_str).collect();
    let scenes: Vec<&str> = scenes.iter().map(String::as_str).collect();
    for (i, c) in e.claim.iter().enumerate() {
        c.check(&strategies, &scenes).or_else(|m| fail(line_of(text, "[[claim]]", i), m))?;
    }
    Ok(())
}

impl super::SceneEntry {
    /// The scene's name in tables.
    pub fn label(&self) -> String {
        let stem = || self.file.as_ref()?.file_stem().map(|s| s.to_string_lossy().into_owned());
        let named = || self.integrand.map(|i| i.label().to_owned());
        self.name.clone().or_else(stem).or_else(named).unwrap_or_else(|| "scene".into())
    }
}
