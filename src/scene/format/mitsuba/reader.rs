//! From XML text to [`Tree`].

use super::super::spectrum::Spectrum;
use super::super::{Options, shorten};
use super::attribute::{Attributes, File, Parameter};
use super::tree::{Child, Node, Property, Target, Tree};
use super::value::{self, Parsed, Value};
use crate::error::{Error, Place, Result, did_you_mean, suggestion};
use glam::{DAffine3, DVec3};
use roxmltree::{Document, Node as Xml, ParsingOptions};
use std::cell::Cell;
use std::path::{Path, PathBuf};

/// Includes inside includes; Mitsuba's limit.
const INCLUDE_DEPTH: usize = 15;
/// Includes in all: files that include each other several times over stay harmless.
const INCLUDES: usize = 1000;
/// Elements inside elements. Real scenes need about six.
const ELEMENT_DEPTH: usize = 50;
/// Bounds the memory that the XML parser takes.
const LARGEST_XML: usize = 64 << 20;
const MOST_XML_NODES: u32 = 4_000_000;

/// Elements that stand for plugins.
const OBJECTS: [&str; 13] = [
    "bsdf",
    "emitter",
    "film",
    "integrator",
    "medium",
    "phase",
    "rfilter",
    "sampler",
    "sensor",
    "shape",
    "texture",
    "volume",
    "field",
];
/// All other elements.
const OTHERS: [&str; 15] = [
    "boolean",
    "float",
    "integer",
    "string",
    "point",
    "vector",
    "rgb",
    "srgb",
    "spectrum",
    "transform",
    "ref",
    "alias",
    "include",
    "default",
    "path",
];

/// Reads a scene from XML text; `path` is its name for messages and the base of relative file names.
pub(super) fn read(text: &str, path: &Path, options: &Options) -> Result<Tree> {
    let parameters = options
        .parameters
        .iter()
        .map(|(name, value)| Parameter { name: name.clone(), value: value.clone(), known: false })
        .collect();
    let mut reader = Reader { tree: Tree::default(), parameters, open: Vec::new(), includes: 0 };
    let folder = path.parent().unwrap_or(Path::new(""));
    reader.tree.directories.push(folder.to_owned());
    if !options.allow_outside {
        // The folder itself is named where files in it are not found.
        reader.tree.inside = Path::new(".").join(folder).canonicalize().ok();
    }
    reader.file(text, path, None)?;
    if let Some(unknown) = reader.parameters.iter().find(|p| !p.known) {
        let known: Vec<_> = reader.parameters.iter().filter(|p| p.known).map(|p| p.name.as_str()).collect();
        let hint = did_you_mean(&unknown.name, known.iter().copied());
        let all = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        let message = format!("the scene has no parameter `{}`{hint} (it has: {all})", unknown.name);
        return Err(Error::input(Place::file(path), message));
    }
    Ok(reader.tree)
}

pub(super) struct Reader {
    tree: Tree,
    pub(super) parameters: Vec<Parameter>,
    /// The files being read, outermost first.
    open: Vec<PathBuf>,
    includes: usize,
}

impl Reader {
    /// Reads a file: the scene itself, or what it includes into `parent` (object, the property's name, depth).
    fn file(&mut self, text: &str, path: &Path, parent: Option<(usize, Option<&str>, usize)>) -> Result<()> {
        if text.len() > LARGEST_XML {
            let message = format!("{} bytes of XML; at most {LARGEST_XML} are read", text.len());
            return Err(Error::input(Place::file(path), message));
        }
        let options = ParsingOptions { nodes_limit: MOST_XML_NODES, ..Default::default() };
        let document = Document::parse_with_options(text, options).map_err(|error| {
            let position = error.pos();
            let place = Place { file: path.to_owned(), line: position.row, column: position.col };
            // The parser repeats the character that it did not expect, whatever it is.
            let message = error.to_string().replace(char::is_control, "\u{fffd}");
            Error::input(place, format!("not well-formed XML: {message}"))
        })?;
        let newlines = text.bytes().enumerate().filter(|b| b.1 == b'\n').map(|b| b.0 + 1);
        let mut file = File { path, lines: std::iter::once(0).chain(newlines).collect(), old: false };
        let root = document.root_element();
        let version = root.attribute("version").ok_or_else(|| {
            file.error(root, format!("<{}> lacks the attribute `version`", shorten(root.tag_name().name())))
        })?;
        let major = version.trim().split('.').next().and_then(|v| v.parse::<u32>().ok());
        match major {
            Some(0..=3) => file.old = major < Some(2),
            _ => return Err(file.error(root, format!("version `{}`; allowed: 0.x to 3.x", shorten(version)))),
        }
        self.tree.add_source(path);
        self.open.push(path.to_owned());
        let is_scene = root.tag_name().name() == "scene";
        match parent {
            None if !is_scene => {
                return Err(file.error(root, format!("<{}> found; <scene> is wanted", shorten(root.tag_name().name()))));
            }
            None => {
                let node = self.node(&file, root, "scene", String::new())?;
                self.children(&file, root, node, 0)?;
            }
            Some((node, _, depth)) if is_scene => self.children(&file, root, node, depth)?,
            Some((node, name, depth)) => self.element(&file, root, node, name, depth + 1)?,
        }
        self.open.pop();
        Ok(())
    }

    fn children(&mut self, file: &File, xml: Xml, node: usize, depth: usize) -> Result<()> {
        xml.children().filter(Xml::is_element).try_for_each(|child| self.element(file, child, node, None, depth + 1))
    }

    /// Adds an object without its children.
    fn node(&mut self, file: &File, xml: Xml, tag: &str, plugin: String) -> Result<usize> {
        let id = xml.attribute("id").map(|id| self.substitute(file, xml, id)).transpose()?;
        let index = self.tree.nodes.len();
        if let Some(id) = &id {
            self.name(file, xml, id, index)?;
        }
        let (properties, children) = (Vec::new(), Vec::new());
        self.tree.nodes.push(Node { tag: tag.to_owned(), plugin, id, place: file.place(xml), properties, children });
        Ok(index)
    }

    /// Gives an id to an object.
    fn name(&mut self, file: &File, xml: Xml, id: &str, index: usize) -> Result<()> {
        if let Some(&other) = self.tree.ids.get(id) {
            let place = &self.tree.nodes[other].place;
            return Err(file.error(xml, format!("the id `{}` is taken already ({place})", shorten(id))));
        }
        self.tree.ids.insert(id.to_owned(), index);
        Ok(())
    }

    /// Reads one element inside object `parent`. `name`: the property it stands for, if an `<include>` says so.
    fn element(&mut self, file: &File, xml: Xml, parent: usize, name: Option<&str>, depth: usize) -> Result<()> {
        if depth > ELEMENT_DEPTH {
            return Err(file.error(xml, format!("elements are nested deeper than {ELEMENT_DEPTH}")));
        }
        let tag = xml.tag_name().name();
        let is_object = OBJECTS.contains(&tag) || tag == "spectrum" && xml.has_attribute("type");
        if !is_object && let Some(child) = xml.children().find(Xml::is_element).filter(|_| tag != "transform") {
            let message = format!("<{}> cannot stand inside <{}>", shorten(child.tag_name().name()), shorten(tag));
            return Err(file.error(child, message));
        }
        match tag {
            _ if is_object => {
                let attributes = self.attributes(file, xml, &["type"], &["id", "name", "version"])?;
                let name =
                    name.or(attributes.get("name")).map(|n| file.property_name(&self.tree.nodes[parent].plugin, n));
                let node = self.node(file, xml, tag, attributes.required("type").to_owned())?;
                self.add_child(parent, name, Target::Node(node), file.place(xml));
                self.children(file, xml, node, depth)
            }
            "ref" => {
                let attributes = self.attributes(file, xml, &["id"], &["name"])?;
                let name = attributes.get("name").map(|n| file.property_name(&self.tree.nodes[parent].plugin, n));
                let target = Target::Reference(attributes.required("id").to_owned());
                self.add_child(parent, name, target, file.place(xml));
                Ok(())
            }
            "alias" => {
                let attributes = self.attributes(file, xml, &["id", "as"], &[])?;
                let id = attributes.required("id");
                let index = self.tree.ids.get(id).copied();
                let index =
                    index.ok_or_else(|| file.error(xml, format!("no object above has the id `{}`", shorten(id))))?;
                self.name(file, xml, attributes.required("as"), index)
            }
            "default" => self.default(file, xml),
            "path" => self.search_path(file, xml, parent),
            "include" => self.include(file, xml, parent, depth),
            "transform" => {
                let attributes = self.attributes(file, xml, &["name"], &[])?;
                let transform = self.transform(file, xml)?;
                self.add_property(file, xml, parent, attributes.required("name"), Value::Transform(transform))
            }
            "translate" | "rotate" | "scale" | "lookat" | "lookAt" | "matrix" => {
                Err(file.error(xml, format!("<{tag}> must stand inside <transform>")))
            }
            _ => self.property(file, xml, parent),
        }
    }

    fn add_child(&mut self, parent: usize, name: Option<String>, target: Target, place: Place) {
        self.tree.nodes[parent].children.push(Child { name, target, place });
    }

    fn add_property(&mut self, file: &File, xml: Xml, parent: usize, name: &str, value: Value) -> Result<()> {
        let node = &mut self.tree.nodes[parent];
        let name = file.property_name(&node.plugin, name);
        if let Some(other) = node.properties.iter().find(|p| p.name == name) {
            let message = format!("property `{}` is given twice (first: {})", shorten(&name), other.place);
            return Err(file.error(xml, message));
        }
        node.properties.push(Property { name, value, place: file.place(xml), used: Cell::new(false) });
        Ok(())
    }

    /// A property that is not an object.
    fn property(&mut self, file: &File, xml: Xml, parent: usize) -> Result<()> {
        let tag = xml.tag_name().name();
        let value = |parsed: Parsed<Value>| parsed.map_err(|message| file.error(xml, message));
        let (name, value) = match tag {
            "point" | "vector" => {
                let attributes = self.attributes(file, xml, &["name"], &["value", "x", "y", "z"])?;
                let v = attributes.components(0.0).map(Value::Vector);
                (attributes.required("name").to_owned(), value(v)?)
            }
            "spectrum" => {
                let attributes = self.attributes(file, xml, &["name"], &["value", "filename"])?;
                let value = match attributes.get("value").and_then(value::bare_rgb) {
                    Some(rgb) => {
                        let place = file.place(xml);
                        self.tree.warnings.push(format!("{place}: a spectrum of three bare numbers is taken as RGB"));
                        Value::Rgb(rgb)
                    }
                    None => Value::Spectrum(self.spectrum(file, xml, &attributes)?),
                };
                (attributes.required("name").to_owned(), value)
            }
            "float" | "integer" | "boolean" | "string" | "rgb" | "srgb" => {
                let attributes = self.attributes(file, xml, &["name", "value"], &[])?;
                let text = attributes.required("value");
                let v = match tag {
                    "float" => value::float(text).map(Value::Float),
                    "integer" => value::integer(text).map(Value::Integer),
                    "boolean" => value::boolean(text).map(Value::Boolean),
                    "string" => Ok(Value::String(text.to_owned())),
                    "rgb" => value::rgb(text).map(Value::Rgb),
                    _ => value::srgb(text).map(Value::Rgb),
                };
                (attributes.required("name").to_owned(), value(v)?)
            }
            _ => {
                let hint = suggestion(tag, OBJECTS.into_iter().chain(OTHERS));
                let hint = hint.map_or(String::new(), |s| format!("; did you mean <{s}>?"));
                let allowed = OBJECTS.into_iter().chain(OTHERS).collect::<Vec<_>>().join(", ");
                let message = format!("unknown element <{}>{hint} (allowed: {allowed})", shorten(tag));
                return Err(file.error(xml, message));
            }
        };
        self.add_property(file, xml, parent, &name, value)
    }

    fn spectrum(&mut self, file: &File, xml: Xml, attributes: &Attributes) -> Result<Spectrum> {
        match (attributes.get("value"), attributes.get("filename")) {
            (Some(text), None) => value::spectrum(text).map_err(|message| file.error(xml, message)),
            (None, Some(name)) => {
                let path = self.tree.find_file(name, &file.place(xml))?;
                self.tree.add_source(&path);
                let bytes = super::super::read(&path)?;
                value::spectrum_file(&String::from_utf8_lossy(&bytes))
                    .map_err(|(line, message)| Error::input(Place::line(&path, line), message))
            }
            _ => Err(file.error(xml, "<spectrum> needs either `value` or `filename`")),
        }
    }

    fn default(&mut self, file: &File, xml: Xml) -> Result<()> {
        let attributes = self.attributes(file, xml, &["name", "value"], &[])?;
        let name = attributes.required("name");
        if name.is_empty() {
            return Err(file.error(xml, "<default> with an empty name"));
        }
        match self.parameters.iter_mut().find(|p| p.name == name) {
            Some(parameter) => parameter.known = true,
            None => {
                let value = attributes.required("value").to_owned();
                self.parameters.push(Parameter { name: name.to_owned(), value, known: true });
            }
        }
        Ok(())
    }

    fn search_path(&mut self, file: &File, xml: Xml, parent: usize) -> Result<()> {
        let attributes = self.attributes(file, xml, &["value"], &[])?;
        if parent != 0 {
            return Err(file.error(xml, "<path> must stand directly inside <scene>"));
        }
        let name = attributes.required("value");
        let directory = self.tree.directories.iter().map(|d| d.join(name)).find(|d| d.is_dir());
        let directory = directory.ok_or_else(|| file.error(xml, format!("folder `{}` not found", shorten(name))))?;
        self.tree.directories.insert(0, directory);
        Ok(())
    }

    fn include(&mut self, file: &File, xml: Xml, parent: usize, depth: usize) -> Result<()> {
        let attributes = self.attributes(file, xml, &["filename"], &["name"])?;
        let place = file.place(xml);
        let path = self.tree.find_file(attributes.required("filename"), &place)?;
        self.includes += 1;
        let problem = if self.open.iter().any(|open| same_file(open, &path)) {
            Some("the file includes itself".to_owned())
        } else if self.open.len() > INCLUDE_DEPTH {
            Some(format!("includes are nested deeper than {INCLUDE_DEPTH}"))
        } else if self.includes > INCLUDES {
            Some(format!("more than {INCLUDES} includes"))
        } else {
            None
        };
        if let Some(problem) = problem {
            return Err(Error::input(place, format!("including `{}`: {problem}", path.display())));
        }
        let text = text(super::super::read(&path)?, &path)?;
        self.file(&text, &path, Some((parent, attributes.get("name"), depth)))
    }

    /// Steps in document order: each applies after the ones above it.
    fn transform(&mut self, file: &File, xml: Xml) -> Result<DAffine3> {
        let mut transform = DAffine3::IDENTITY;
        for step in xml.children().filter(Xml::is_element) {
            if let Some(child) = step.children().find(Xml::is_element) {
                return Err(file.error(child, "nothing may stand inside a step of <transform>"));
            }
            transform = self.step(file, step)? * transform;
            if !transform.is_finite() {
                return Err(file.error(step, "the transform is not finite"));
            }
        }
        Ok(transform)
    }

    fn step(&mut self, file: &File, xml: Xml) -> Result<DAffine3> {
        let xyz = ["value", "x", "y", "z"];
        let step = match xml.tag_name().name() {
            "translate" => self.attributes(file, xml, &[], &xyz)?.components(0.0).map(DAffine3::from_translation),
            "scale" => self.attributes(file, xml, &[], &xyz)?.components(1.0).map(DAffine3::from_scale),
            "rotate" => {
                let attributes = self.attributes(file, xml, &["angle"], &xyz)?;
                let angle = value::float(attributes.required("angle"));
                let axis = attributes.components(0.0);
                if axis.as_ref().is_ok_and(|axis| !axis.is_normalized()) {
                    let place = file.place(xml);
                    let message = "the axis has no unit length; taken as a direction (Mitsuba 3 distorts the scene)";
                    self.tree.warnings.push(format!("{place}: {message}"));
                }
                axis.and_then(|axis| value::rotation(axis, angle?))
            }
            "lookat" | "lookAt" => {
                let attributes = self.attributes(file, xml, &["origin", "target"], &["up"])?;
                let point = |name| value::triple(attributes.required(name));
                let up = attributes.get("up").map_or(Ok(DVec3::ZERO), value::triple);
                point("origin").and_then(|origin| value::look_at(origin, point("target")?, up?))
            }
            "matrix" => value::matrix(self.attributes(file, xml, &["value"], &[])?.required("value")),
            other => Err(format!(
                "<{}> inside <transform>; allowed: translate, rotate, scale, lookat, matrix",
                shorten(other)
            )),
        };
        step.map_err(|message| file.error(xml, message))
    }
}

/// Bytes as UTF-8 text.
pub(super) fn text(bytes: Vec<u8>, path: &Path) -> Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        Error::input(Place::line(path, line), format!("not UTF-8 text (byte {at})"))
    })
}

fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}
