//! Wavefront OBJ: polygons with positions, texture coordinates and normals; everything else is passed over.

use super::mesh::Mesh;
use super::shorten;
use crate::error::{Error, Place, Result};
use crate::math::{Vec2, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// Statements without effect here: names, groups, materials, points, lines and display hints.
const PASSED_OVER: [&str; 19] = [
    "vp",
    "g",
    "o",
    "s",
    "mg",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "p",
    "l",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

/// Reads an OBJ file; `file` is its name for messages. Polygons become fans around their first vertex.
///
/// # Errors
/// [`Error::Input`] with the line: numbers that are not finite, indices out of range, unknown statements, no face.
pub fn parse(bytes: &[u8], file: &Path) -> Result<Mesh> {
    let mut reader = Reader::default();
    for (line, text) in logical_lines(bytes) {
        // Names and comments may be in any encoding; numbers are ASCII, so lossy decoding harms nothing.
        let text = String::from_utf8_lossy(&text);
        reader.statement(&text).map_err(|message| Error::input(Place::line(file, line), message))?;
    }
    reader.finish().map_err(|message| Error::input(Place::file(file), message))
}

/// Lines with their number, from 1; a backslash at the end of a line (not of a comment) joins the next one to it.
fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (u32, std::borrow::Cow<'_, [u8]>)> {
    let mut lines = bytes.split(|&b| b == b'\n').zip(1..);
    std::iter::from_fn(move || {
        let (first, number) = lines.next()?;
        let mut text = std::borrow::Cow::Borrowed(first);
        let comment = first.trim_ascii_start().starts_with(b"#");
        while let Some(rest) = text.trim_ascii_end().strip_suffix(b"\\").map(<[u8]>::len).filter(|_| !comment) {
            text.to_mut().truncate(rest);
            let Some((next, _)) = lines.next() else { break };
            text.to_mut().push(b' ');
            text.to_mut().extend_from_slice(next);
        }
        Some((number, text))
    })
}

/// What has been read so far.
#[derive(Default)]
struct Reader {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Vertices of the mesh: position; texture coordinates and normal, each + 1 or 0 for none.
    vertices: HashMap<[u32; 3], u32>,
    mesh: Mesh,
    /// Vertices of the polygon being read.
    polygon: Vec<u32>,
}

impl Reader {
    fn statement(&mut self, text: &str) -> std::result::Result<(), String> {
        let text = text.split('#').next().unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            None => Ok(()),
            Some("v") => push(&mut self.positions, numbers("v", &mut words)?.into()),
            Some("vt") => push(&mut self.uvs, numbers("vt", &mut words)?.into()),
            Some("vn") => push(&mut self.normals, numbers("vn", &mut words)?.into()),
            Some("f" | "fo") => self.face(words),
            Some(word) if PASSED_OVER.contains(&word) => Ok(()),
            Some(word) => Err(format!(
                "unknown statement `{}`; known are v, vt, vn, f (polygons) and, without effect, {}",
                shorten(word),
                PASSED_OVER.join(", ")
            )),
        }
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> std::result::Result<(), String> {
        self.polygon.clear();
        for word in words {
            let mut parts = word.split('/');
            let position = index(parts.next(), self.positions.len(), "vertex", word)?;
            let position = position.ok_or_else(|| format!("`{}` names no vertex", shorten(word)))?;
            let uv = index(parts.next(), self.uvs.len(), "texture coordinate", word)?.map_or(0, |t| t + 1);
            let normal = index(parts.next(), self.normals.len(), "normal", word)?.map_or(0, |n| n + 1);
            if parts.next().is_some() {
                return Err(format!("`{}` has too many parts; allowed: v, v/vt, v//vn, v/vt/vn", shorten(word)));
            }
            let mesh = &mut self.mesh;
            let vertex = *self.vertices.entry([position, uv, normal]).or_insert_with(|| {
                mesh.positions.push(self.positions[position as usize]);
                mesh.uvs.push(uv.checked_sub(1).map_or(Vec2::ZERO, |t| self.uvs[t as usize]));
                mesh.normals.push(normal.checked_sub(1).map_or(Vec3::ZERO, |n| self.normals[n as usize]));
                mesh.positions.len() as u32 - 1
            });
            self.polygon.push(vertex);
        }
        let [first, rest @ ..] = &self.polygon[..] else { return Err("a face without vertices".into()) };
        if rest.len() < 2 {
            return Err(format!("a face with {} vertices; it needs at least three", rest.len() + 1));
        }
        self.mesh.triangles.extend(rest.windows(2).map(|w| [*first, w[0], w[1]]));
        Ok(())
    }

    fn finish(mut self) -> std::result::Result<Mesh, String> {
        if self.mesh.triangles.is_empty() {
            return Err("the file has no face (`f` statement)".into());
        }
        if self.uvs.is_empty() {
            self.mesh.uvs.clear();
        }
        if self.normals.is_empty() {
            self.mesh.normals.clear();
        }
        Ok(self.mesh)
    }
}

/// Appends, while indices still fit 31 bits.
fn push<T>(list: &mut Vec<T>, v: T) -> std::result::Result<(), String> {
    if list.len() >= i32::MAX as usize {
        return Err("more than 2³¹ vertices".into());
    }
    list.push(v);
    Ok(())
}

/// The first `N` finite numbers; what follows (weight, colour, depth) has no effect.
fn numbers<'a, const N: usize>(
    statement: &str,
    words: &mut impl Iterator<Item = &'a str>,
) -> std::result::Result<[f32; N], String> {
    let mut v = [0f32; N];
    for x in &mut v {
        let word = words.next().ok_or_else(|| format!("`{statement}` needs {N} numbers"))?;
        *x = word.parse().map_err(|_| format!("`{}` is not a number", shorten(word)))?;
        if !x.is_finite() {
            return Err(format!("`{}` is not a finite number (32 bits)", shorten(word)));
        }
    }
    Ok(v)
}

/// An index from 1, or from the end if negative, as an index from 0; `None` where the part is absent or empty.
fn index(part: Option<&str>, len: usize, what: &str, word: &str) -> std::result::Result<Option<u32>, String> {
    let Some(part) = part.filter(|p| !p.is_empty()) else { return Ok(None) };
    let number: i64 = part.parse().map_err(|_| format!("`{}` is not a face vertex", shorten(word)))?;
    let from_zero = if number < 0 { len as i64 + number } else { number - 1 };
    if !(0..len as i64).contains(&from_zero) {
        return Err(format!("{what} {number} does not exist; {len} are defined above this line"));
    }
    Ok(Some(from_zero as u32))
}
