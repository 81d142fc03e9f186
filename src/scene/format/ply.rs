//! Polygon File Format (PLY): ascii and both binary byte orders, any property types and order, polygons, colours.

mod colors;

use self::colors::Colors;
use super::mesh::Mesh;
use super::shorten;
use crate::error::{Error, Place, Result};
use crate::math::{Vec2, Vec3};
use std::path::Path;

/// Reads a PLY file; `file` is its name for messages. Polygons become fans around their first vertex.
///
/// # Errors
/// [`Error::Input`] with the line (header, ascii) or byte offset (binary): broken headers, too little data, numbers
/// that are not finite, indices out of range, no face.
pub fn parse(bytes: &[u8], file: &Path) -> Result<Mesh> {
    let mut cursor = Cursor { bytes, at: 0, line: 1, format: Format::Ascii, in_header: true };
    read(&mut cursor).map_err(|message| {
        if cursor.in_header || cursor.format == Format::Ascii {
            Error::input(Place::line(file, cursor.line), message)
        } else {
            Error::input(Place::file(file), format!("byte {}: {message}", cursor.at))
        }
    })
}

type Parsed<T> = std::result::Result<T, String>;

fn read(cursor: &mut Cursor) -> Parsed<Mesh> {
    let elements = header(cursor)?;
    cursor.in_header = false;
    let mut mesh = Mesh::default();
    for element in &elements {
        element.check_count(cursor)?;
        match element.name.as_str() {
            "vertex" => vertices(cursor, element, &mut mesh)?,
            "face" => faces(cursor, element, &mut mesh)?,
            _ => {
                for _ in 0..element.rows() {
                    element.row(cursor, |_, _| Ok(()), |_, _| Ok(()))?;
                }
            }
        }
    }
    let count = mesh.positions.len();
    if let Some(i) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= count) {
        return Err(format!("a face names vertex {i}; the file has {count} vertices, counted from 0"));
    }
    if mesh.triangles.is_empty() {
        return Err("the file has no faces (element `face` with a list `vertex_indices`)".into());
    }
    Ok(mesh)
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, PartialEq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn named(name: &str) -> Parsed<Self> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => {
                return Err(format!(
                    "unknown type `{}`; allowed: char, uchar, short, ushort, int, uint, float, double (or int8 … float64)",
                    shorten(name)
                ));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

struct Property {
    name: String,
    number: Number,
    /// Type of the length, for lists.
    length: Option<Number>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// What is left of the file, and where we are.
struct Cursor<'a> {
    bytes: &'a [u8],
    /// Byte offset of the next byte.
    at: usize,
    /// Line of the next byte, from 1 (header and ascii data).
    line: u32,
    format: Format,
    in_header: bool,
}

impl<'a> Cursor<'a> {
    /// The next line of the header, without its end.
    fn header_line(&mut self) -> Parsed<&'a str> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n').ok_or("the header ends without `end_header`")?;
        self.at += end + 1;
        std::str::from_utf8(&rest[..end]).map(str::trim).or(Ok("comment (not UTF-8)"))
    }

    /// The next number as f64: exact for all types.
    fn number(&mut self, number: Number) -> Parsed<f64> {
        match self.format {
            Format::Ascii => self.word(),
            _ => self.binary(number),
        }
    }

    fn word(&mut self) -> Parsed<f64> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("the data ends too early")?;
        self.line += rest[..start].iter().filter(|&&b| b == b'\n').count() as u32;
        let word = &rest[start..];
        let word = &word[..word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len())];
        self.at += start + word.len();
        let word = String::from_utf8_lossy(word);
        word.parse().map_err(|_| format!("`{}` is not a number", shorten(&word)))
    }

    fn binary(&mut self, number: Number) -> Parsed<f64> {
        let size = number.size();
        let data = self.bytes.get(self.at..self.at + size).ok_or("the data ends too early")?;
        self.at += size;
        let mut bytes = [0u8; 8];
        bytes[..size].copy_from_slice(data);
        if self.format == Format::Big {
            bytes[..size].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match number {
            Number::I8 => i8::from_le_bytes([a]).into(),
            Number::U8 => a.into(),
            Number::I16 => i16::from_le_bytes([a, b]).into(),
            Number::U16 => u16::from_le_bytes([a, b]).into(),
            Number::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Number::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            Number::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            Number::F64 => f64::from_le_bytes(bytes),
        })
    }

    /// A list's length: no longer than the data that is left.
    fn length(&mut self, length: Number, number: Number) -> Parsed<usize> {
        let value = self.number(length)?;
        let smallest = if self.format == Format::Ascii { 2 } else { number.size() };
        let most = (self.bytes.len() - self.at + 1) / smallest;
        if value.fract() != 0.0 || !(0.0..=most as f64).contains(&value) {
            return Err(format!("a list of length {value}; the file has data for at most {most}"));
        }
        Ok(value as usize)
    }
}

/// Reads the header up to and with `end_header`.
fn header(cursor: &mut Cursor) -> Parsed<Vec<Element>> {
    if cursor.header_line().unwrap_or_default() != "ply" {
        return Err("the first line is not `ply`".into());
    }
    let mut elements: Vec<Element> = Vec::new();
    let mut format = None;
    loop {
        cursor.line += 1;
        let line = cursor.header_line()?;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, "1.0"] => {
                format = Some(match name {
                    "ascii" => Format::Ascii,
                    "binary_little_endian" => Format::Little,
                    "binary_big_endian" => Format::Big,
                    _ => {
                        return Err(format!(
                            "unknown format `{}`; allowed: ascii, binary_little_endian, binary_big_endian",
                            shorten(name)
                        ));
                    }
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("`{}` is not a count", shorten(count)))?;
                if elements.iter().any(|e| e.name == name) {
                    return Err(format!("a second element `{}`", shorten(name)));
                }
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", ref rest @ ..] => {
                let element = elements.last_mut().ok_or("a property before the first element")?;
                element.properties.push(property(rest)?);
            }
            ["end_header"] => {
                cursor.format = format.ok_or("the header has no `format … 1.0` line")?;
                cursor.line += 1;
                return Ok(elements);
            }
            _ => {
                return Err(format!(
                    "cannot read `{}`; allowed: format … 1.0, comment, obj_info, element, property, end_header",
                    shorten(line)
                ));
            }
        }
    }
}

fn property(words: &[&str]) -> Parsed<Property> {
    match *words {
        ["list", length, number, name] => {
            let length = Number::named(length)?;
            if !length.is_integer() {
                return Err("the length of a list must have an integer type".into());
            }
            Ok(Property { name: name.into(), number: Number::named(number)?, length: Some(length) })
        }
        [number, name] => Ok(Property { name: name.into(), number: Number::named(number)?, length: None }),
        _ => Err("a property is `property TYPE NAME` or `property list TYPE TYPE NAME`".into()),
    }
}

impl Element {
    /// Rows to read: none where a row has no data, whatever the count says.
    fn rows(&self) -> usize {
        if self.properties.is_empty() { 0 } else { self.count }
    }

    /// Refuses counts for which the file is too short, before anything is allocated.
    fn check_count(&self, cursor: &Cursor) -> Parsed<()> {
        let row: usize = match cursor.format {
            Format::Ascii => 2 * self.properties.len(),
            _ => self.properties.iter().map(|p| p.length.unwrap_or(p.number).size()).sum(),
        };
        // The last ascii number may end with the file.
        let most = (cursor.bytes.len() - cursor.at + 1).checked_div(row).unwrap_or(usize::MAX);
        if self.rows() > most {
            let name = shorten(&self.name);
            return Err(format!(
                "the header announces {} of element `{name}`; the file has data for at most {most}",
                self.count
            ));
        }
        Ok(())
    }

    /// Reads one row: `scalar(property, value)` for each number, `item(property, value)` for each item of a list.
    fn row(
        &self,
        cursor: &mut Cursor,
        mut scalar: impl FnMut(usize, f64) -> Parsed<()>,
        mut item: impl FnMut(usize, f64) -> Parsed<()>,
    ) -> Parsed<()> {
        for (i, property) in self.properties.iter().enumerate() {
            match property.length {
                None => scalar(i, cursor.number(property.number)?)?,
                Some(length) => {
                    for _ in 0..cursor.length(length, property.number)? {
                        item(i, cursor.number(property.number)?)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn scalar(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name && p.length.is_none())
    }

    /// The scalar properties of these names, if all are there.
    fn columns<const N: usize>(&self, names: [&str; N]) -> Option<[usize; N]> {
        let mut found = [0; N];
        for (column, name) in found.iter_mut().zip(names) {
            *column = self.scalar(name)?;
        }
        Some(found)
    }
}

fn vertices(cursor: &mut Cursor, element: &Element, mesh: &mut Mesh) -> Parsed<()> {
    if element.rows() > i32::MAX as usize {
        return Err("more than 2³¹ vertices".into());
    }
    let xyz = element.columns(["x", "y", "z"]).ok_or("element `vertex` lacks a property x, y or z")?;
    let normal = element.columns(["nx", "ny", "nz"]);
    let uv = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]].into_iter().find_map(|names| element.columns(names));
    let mut colors = element.colors();
    let mut values = vec![0f32; element.properties.len()];
    for _ in 0..element.rows() {
        let set = |i: usize, v: f64| {
            values[i] = v as f32;
            Ok(())
        };
        element.row(cursor, set, |_, _| Ok(()))?;
        let p = Vec3::from_array(xyz.map(|i| values[i]));
        let n = normal.map(|n| Vec3::from_array(n.map(|i| values[i])));
        let uv = uv.map(|uv| Vec2::from_array(uv.map(|i| values[i])));
        if !p.is_finite() || n.is_some_and(|n| !n.is_finite()) || uv.is_some_and(|uv| !uv.is_finite()) {
            return Err(format!("vertex {} is not finite (32 bits)", mesh.positions.len()));
        }
        mesh.positions.push(p);
        mesh.normals.extend(n);
        mesh.uvs.extend(uv);
        colors.iter_mut().try_for_each(|c| c.push(element, &values, 1))?;
    }
    mesh.attributes.extend(Colors::finish(colors));
    Ok(())
}

fn faces(cursor: &mut Cursor, element: &Element, mesh: &mut Mesh) -> Parsed<()> {
    let is_list = |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index") && p.length.is_some();
    let list = element.properties.iter().position(is_list);
    let list = list.ok_or("element `face` lacks a list `vertex_indices` (or `vertex_index`)")?;
    if !element.properties[list].number.is_integer() {
        return Err("vertex indices must have an integer type".into());
    }
    let mut colors = element.colors();
    let mut values = vec![0f32; element.properties.len()];
    let mut polygon = Vec::new();
    for row in 0..element.rows() {
        polygon.clear();
        let set = |i: usize, v: f64| {
            values[i] = v as f32;
            Ok(())
        };
        let push = |i: usize, v: f64| {
            if i == list {
                if v.fract() != 0.0 || !(0.0..=f64::from(i32::MAX)).contains(&v) {
                    return Err(format!("face {row} names vertex {v}"));
                }
                polygon.push(v as u32);
            }
            Ok(())
        };
        element.row(cursor, set, push)?;
        let [first, rest @ ..] = &polygon[..] else { return Err(format!("face {row} has no vertices")) };
        if rest.len() < 2 {
            return Err(format!("face {row} has {} vertices; it needs at least three", rest.len() + 1));
        }
        mesh.triangles.extend(rest.windows(2).map(|w| [*first, w[0], w[1]]));
        colors.iter_mut().try_for_each(|c| c.push(element, &values, rest.len() - 1))?;
    }
    mesh.attributes.extend(Colors::finish(colors));
    Ok(())
}
