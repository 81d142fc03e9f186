//! Places and attributes of XML elements; parameters.

use super::super::shorten;
use super::reader::Reader;
use super::value::{self, Parsed};
use crate::error::{Error, Place, Result};
use glam::DVec3;
use roxmltree::Node as Xml;
use std::path::Path;

/// Parameters made of parameters can grow without end.
const LONGEST_VALUE: usize = 1 << 20;

/// A `$name`.
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) value: String,
    /// A `<default>` names it, or something uses it.
    pub(super) known: bool,
}

/// One XML file.
pub(super) struct File<'a> {
    pub(super) path: &'a Path,
    /// Byte offsets at which lines start.
    pub(super) lines: Vec<usize>,
    /// Written for Mitsuba 0.x or 1.x: property names are camelCase.
    pub(super) old: bool,
}

impl File<'_> {
    pub(super) fn place(&self, xml: Xml) -> Place {
        let at = xml.range().start;
        let line = self.lines.partition_point(|&start| start <= at);
        Place { file: self.path.to_owned(), line: line as u32, column: (at - self.lines[line - 1] + 1) as u32 }
    }

    pub(super) fn error(&self, xml: Xml, message: impl Into<String>) -> Error {
        Error::input(self.place(xml), message)
    }

    /// Mitsuba's upgrade of names from 0.x: `toWorld` becomes `to_world`. `plugin`: whose property it is.
    pub(super) fn property_name(&self, plugin: &str, name: &str) -> String {
        if !self.old {
            return name.to_owned();
        }
        let mut upgraded = String::new();
        let mut last = '_';
        for c in name.chars() {
            if c.is_ascii_uppercase() && last.is_ascii_lowercase() {
                upgraded.push('_');
            }
            upgraded.push(c.to_ascii_lowercase());
            last = c;
        }
        let alias = plugin == "diffuse" && upgraded == "diffuse_reflectance";
        if alias { "reflectance".to_owned() } else { upgraded }
    }
}

/// An element's attributes after substitution.
pub(super) struct Attributes(Vec<(String, String)>);

impl Attributes {
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|a| a.0 == name).map(|a| a.1.as_str())
    }

    /// An attribute that [`Reader::attributes`] was told to require.
    pub(super) fn required(&self, name: &str) -> &str {
        self.get(name).unwrap_or_default()
    }

    pub(super) fn components(&self, default: f64) -> Parsed<DVec3> {
        value::components(self.get("value"), ["x", "y", "z"].map(|n| self.get(n)), default)
    }
}

impl Reader {
    /// The element's attributes after substitution: all of `required`, some of `optional`, nothing else.
    pub(super) fn attributes(
        &mut self,
        file: &File,
        xml: Xml,
        required: &[&str],
        optional: &[&str],
    ) -> Result<Attributes> {
        let mut found = Vec::new();
        for attribute in xml.attributes() {
            let name = attribute.name();
            if !required.contains(&name) && !optional.contains(&name) {
                let allowed = [required, optional].concat().join(", ");
                let (name, tag) = (shorten(name), shorten(xml.tag_name().name()));
                return Err(file.error(xml, format!("unknown attribute `{name}` of <{tag}>; allowed: {allowed}")));
            }
            found.push((name.to_owned(), self.substitute(file, xml, attribute.value())?));
        }
        if let Some(missing) = required.iter().find(|r| !found.iter().any(|f| f.0 == **r)) {
            return Err(file.error(xml, format!("<{}> lacks the attribute `{missing}`", xml.tag_name().name())));
        }
        Ok(Attributes(found))
    }

    /// Puts in parameters: `$name` (the longest name that fits); `\$` is a dollar sign.
    pub(super) fn substitute(&mut self, file: &File, xml: Xml, text: &str) -> Result<String> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, after) = (&rest[..at], &rest[at + 1..]);
            if let Some(escaped) = before.strip_suffix('\\') {
                result.push_str(escaped);
                result.push('$');
                rest = after;
                continue;
            }
            result.push_str(before);
            let fits = |p: &&mut Parameter| !p.name.is_empty() && after.starts_with(&p.name);
            let fitting = self.parameters.iter_mut().filter(fits);
            let Some(parameter) = fitting.max_by_key(|p| p.name.len()) else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
                let known = self.parameters.iter().map(|p| format!("${}", p.name)).collect::<Vec<_>>().join(", ");
                let message = format!("undefined parameter ${} (defined: {known})", shorten(&after[..end]));
                return Err(file.error(xml, message));
            };
            parameter.known = true;
            result.push_str(&parameter.value);
            rest = &after[parameter.name.len()..];
            if result.len() > LONGEST_VALUE {
                return Err(file.error(xml, format!("parameters make an attribute longer than {LONGEST_VALUE} bytes")));
            }
        }
        result.push_str(rest);
        Ok(result)
    }
}
