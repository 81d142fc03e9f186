//! The scene as objects with typed properties. Includes, parameters, aliases and old spellings are gone here.

use super::super::shorten;
use super::value::Value;
use crate::error::{Error, Place, Result, did_you_mean};
use glam::{DAffine3, DVec3};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The scene as objects.
#[derive(Default)]
pub(super) struct Tree {
    /// The first is `<scene>`.
    pub(super) nodes: Vec<Node>,
    pub(super) ids: BTreeMap<String, usize>,
    /// Files read so far.
    pub(super) sources: Vec<PathBuf>,
    /// What was read otherwise than Mitsuba 3 reads it.
    pub(super) warnings: Vec<String>,
    /// Where relative file names are looked up, in this order.
    pub(super) directories: Vec<PathBuf>,
    /// The folder that files must be below, without symbolic links; `None`: they may be anywhere.
    pub(super) inside: Option<PathBuf>,
}

/// One object.
pub(super) struct Node {
    /// Element name: `shape`, `bsdf` …
    pub(super) tag: String,
    /// Its `type`.
    pub(super) plugin: String,
    pub(super) id: Option<String>,
    pub(super) place: Place,
    pub(super) properties: Vec<Property>,
    pub(super) children: Vec<Child>,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) value: Value,
    pub(super) place: Place,
    /// Whether anything asked for it.
    pub(super) used: Cell<bool>,
}

/// An object inside another one.
pub(super) struct Child {
    /// The property that it stands for, if it says so.
    pub(super) name: Option<String>,
    pub(super) target: Target,
    pub(super) place: Place,
}

pub(super) enum Target {
    Node(usize),
    Reference(String),
}

impl Tree {
    /// The object that a child stands for.
    pub(super) fn resolve(&self, child: &Child) -> Result<usize> {
        match &child.target {
            Target::Node(index) => Ok(*index),
            Target::Reference(id) => self.ids.get(id).copied().ok_or_else(|| {
                let hint = did_you_mean(id, self.ids.keys().map(String::as_str));
                Error::input(child.place.clone(), format!("no object has the id `{}`{hint}", shorten(id)))
            }),
        }
    }

    /// The file that a scene means by `name`.
    pub(super) fn find_file(&self, name: &str, place: &Place) -> Result<PathBuf> {
        let beside = place.file.parent().unwrap_or(Path::new(""));
        let directories = self.directories.iter().map(PathBuf::as_path).chain([beside]);
        let path = directories.map(|d| d.join(name)).find(|p| p.is_file()).ok_or_else(|| {
            let tried: Vec<_> = self.directories.iter().map(|d| format!("`{}`", d.join("").display())).collect();
            let message = format!("file `{}` not found (looked in {})", shorten(name), tried.join(", "));
            Error::input(place.clone(), message)
        })?;
        match &self.inside {
            Some(folder) if !path.canonicalize().is_ok_and(|p| p.starts_with(folder)) => {
                let message = "is outside the scene file's folder; --allow-outside allows it";
                Err(Error::input(place.clone(), format!("file `{}` {message}", shorten(name))))
            }
            _ => Ok(path),
        }
    }

    /// Notes that the scene depends on this file.
    pub(super) fn add_source(&mut self, path: &Path) {
        if !self.sources.iter().any(|p| p == path) {
            self.sources.push(path.to_owned());
        }
    }
}

/// Typed access to properties. `None` where the property is absent.
impl Node {
    pub(super) fn error(&self, message: impl std::fmt::Display) -> Error {
        Error::input(self.place.clone(), format!("{}: {message}", self.title()))
    }

    pub(super) fn unsupported(&self, plugin: &str, allowed: &str) -> Error {
        let message = format!("{} `{}` is not supported; allowed: {allowed}", self.tag, shorten(plugin));
        Error::input(self.place.clone(), message)
    }

    /// For messages: ``shape `obj` ``.
    pub(super) fn title(&self) -> String {
        format!("{} `{}`", self.tag, shorten(&self.plugin))
    }

    pub(super) fn get<T>(&self, name: &str, kind: &str, convert: impl Fn(&Value) -> Option<T>) -> Result<Option<T>> {
        let Some(property) = self.properties.iter().find(|p| p.name == name) else { return Ok(None) };
        property.used.set(true);
        let value = convert(&property.value).ok_or_else(|| {
            let message = format!("`{name}` of {} is a {}; a {kind} is wanted", self.title(), property.value.kind());
            Error::input(property.place.clone(), message)
        })?;
        Ok(Some(value))
    }

    pub(super) fn float(&self, name: &str) -> Result<Option<f64>> {
        self.get(name, "float", |v| match v {
            Value::Float(v) => Some(*v),
            Value::Integer(v) => Some(*v as f64),
            _ => None,
        })
    }

    pub(super) fn integer(&self, name: &str) -> Result<Option<i64>> {
        self.get(name, "integer", |v| if let Value::Integer(v) = v { Some(*v) } else { None })
    }

    pub(super) fn boolean(&self, name: &str) -> Result<Option<bool>> {
        self.get(name, "boolean", |v| if let Value::Boolean(v) = v { Some(*v) } else { None })
    }

    pub(super) fn string(&self, name: &str) -> Result<Option<String>> {
        self.get(name, "string", |v| if let Value::String(v) = v { Some(v.clone()) } else { None })
    }

    pub(super) fn vector(&self, name: &str) -> Result<Option<DVec3>> {
        self.get(name, "point or vector", |v| if let Value::Vector(v) = v { Some(*v) } else { None })
    }

    pub(super) fn transform(&self, name: &str) -> Result<Option<DAffine3>> {
        self.get(name, "transform", |v| if let Value::Transform(v) = v { Some(*v) } else { None })
    }
}
