//! Mitsuba's serialized meshes, versions 3 and 4: several meshes in one file, each a zlib stream, and where they start.
//! <https://mitsuba.readthedocs.io/en/stable/src/generated/plugins_shapes.html#serialized-mesh-loader-serialized>

use super::mesh::Mesh;
use crate::error::{Error, Place, Result};
use crate::math::{Vec2, Vec3};
use flate2::bufread::ZlibDecoder;
use std::io::Read;
use std::path::Path;

/// The first two bytes, little endian.
const MAGIC: u16 = 0x041C;
/// DEFLATE makes a byte of at most this many.
const MAX_COMPRESSION: u64 = 1032;
/// Larger meshes are refused, bytes.
const LARGEST_MESH: u64 = 16 << 30;
/// Longest name of a mesh, bytes.
const LONGEST_NAME: usize = 1 << 16;

const NORMALS: u32 = 1;
const UVS: u32 = 2;
const COLORS: u32 = 8;
const DOUBLE: u32 = 0x2000;

/// Reads mesh number `index` of a file; `file` is its name for messages. As in Mitsuba 3, vertex colours are left out, and the
/// flag for face normals has no effect.
///
/// # Errors
/// [`Error::Input`] with the byte offset of the mesh: no such mesh, other formats and versions, damaged or missing data,
/// numbers that are not finite, indices out of range, no triangle.
pub fn parse(bytes: &[u8], index: u32, file: &Path) -> Result<Mesh> {
    let fail = |message: String| Error::input(Place::file(file), message);
    let (version, start) = locate(bytes, index).map_err(fail)?;
    let compressed = &bytes[start + 4..];
    let most = LARGEST_MESH.min(MAX_COMPRESSION * compressed.len() as u64);
    let mut stream = Stream { decoder: ZlibDecoder::new(compressed), most };
    read(&mut stream, version).map_err(|message| fail(format!("mesh {index} at byte {start}: {message}")))
}

type Parsed<T> = std::result::Result<T, String>;

/// Version of the file and offset of a mesh's header.
fn locate(bytes: &[u8], index: u32) -> Parsed<(u16, usize)> {
    let version = header(bytes, 0)?;
    if index == 0 {
        return Ok((version, 0));
    }
    // The last word counts the meshes; before it are their offsets.
    let word = if version == 4 { 8 } else { 4 };
    let end = bytes.len() - 4;
    let count = u32::from_le_bytes(array(&bytes[end..]));
    if count as usize > end / word {
        return Err(format!("the list of {count} meshes at the end is longer than the file"));
    }
    if index >= count {
        return Err(format!("shape_index is {index}; the file has {count} meshes, counted from 0"));
    }
    let at = end - word * (count - index) as usize;
    let offset = match version {
        4 => u64::from_le_bytes(array(&bytes[at..])),
        _ => u32::from_le_bytes(array(&bytes[at..])).into(),
    };
    let start = usize::try_from(offset)
        .ok()
        .filter(|o| *o <= end)
        .ok_or_else(|| format!("mesh {index} starts at byte {offset}; the file has {} bytes", bytes.len()))?;
    header(bytes, start).map_err(|message| format!("mesh {index} at byte {start}: {message}"))?;
    Ok((version, start))
}

/// Version in the header at an offset.
fn header(bytes: &[u8], at: usize) -> Parsed<u16> {
    let head = bytes.get(at..).filter(|b| b.len() >= 8).ok_or("too short for a serialized mesh")?;
    let [magic, version] = [0, 2].map(|k| u16::from_le_bytes(array(&head[k..])));
    match (magic, version) {
        (MAGIC, 3 | 4) => Ok(version),
        (MAGIC, _) => Err(format!("version {version} of the format; allowed: 3, 4")),
        _ => Err(format!("starts with {magic:#06x}, not with {MAGIC:#06x} as serialized meshes do")),
    }
}

fn read(stream: &mut Stream, version: u16) -> Parsed<Mesh> {
    let flags = u32::from_le_bytes(stream.array()?);
    if version == 4 {
        let name = (0..=LONGEST_NAME).find(|_| stream.array().map_or(true, |[byte]| byte == 0));
        name.ok_or("the mesh's name does not end")?;
    }
    let vertices = stream.count("vertices")?;
    let triangles = stream.count("triangles")?;
    let double = flags & DOUBLE != 0;
    let given = |flag: u32, n: u64| if flags & flag != 0 { n } else { 0 };
    let numbers = 3 + given(NORMALS, 3) + given(UVS, 2) + given(COLORS, 3);
    let wanted = vertices * numbers * if double { 8 } else { 4 } + triangles * 12;
    if wanted > stream.most {
        return Err(format!("{vertices} vertices and {triangles} triangles are more than the file can hold"));
    }
    let (vertices, triangles) = (vertices as usize, triangles as usize);
    let triples = |v: Vec<f32>| v.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    let positions = triples(stream.floats(3 * vertices, double)?);
    let normals = triples(stream.floats(given(NORMALS, 3) as usize * vertices, double)?);
    let uvs = stream.floats(given(UVS, 2) as usize * vertices, double)?;
    let uvs: Vec<Vec2> = uvs.chunks_exact(2).map(Vec2::from_slice).collect();
    stream.bytes(given(COLORS, 3) as usize * vertices * if double { 8 } else { 4 })?;
    let indices = stream.bytes(12 * triangles)?;
    let corner = |triangle: &[u8], k: usize| u32::from_le_bytes(array(&triangle[4 * k..]));
    let triangles: Vec<[u32; 3]> = indices.chunks_exact(12).map(|t| [0, 1, 2].map(|k| corner(t, k))).collect();
    if let Some(i) = triangles.iter().flatten().find(|&&i| i as usize >= vertices) {
        return Err(format!("a triangle names vertex {i}; the mesh has {vertices} vertices, counted from 0"));
    }
    if triangles.is_empty() {
        return Err("the mesh has no triangles".into());
    }
    let finite = positions.iter().chain(&normals).all(|v| v.is_finite()) && uvs.iter().all(|v| v.is_finite());
    if !finite {
        return Err("a position, normal or texture coordinate is not finite".into());
    }
    Ok(Mesh { positions, normals, uvs, triangles, attributes: Vec::new() })
}

/// Decompresses as much as is asked for.
struct Stream<'a> {
    decoder: ZlibDecoder<&'a [u8]>,
    /// Bytes that it can hold at most.
    most: u64,
}

impl Stream<'_> {
    fn array<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let mut bytes = [0; N];
        self.decoder.read_exact(&mut bytes).map_err(|e| format!("damaged or incomplete data ({e})"))?;
        Ok(bytes)
    }

    fn count(&mut self, what: &str) -> Parsed<u64> {
        let count = u64::from_le_bytes(self.array()?);
        match count <= i32::MAX as u64 {
            true => Ok(count),
            false => Err(format!("{count} {what}; at most {} are read", i32::MAX)),
        }
    }

    /// The memory grows with what is really there.
    fn bytes(&mut self, count: usize) -> Parsed<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = (&mut self.decoder).take(count as u64).read_to_end(&mut bytes);
        match read {
            Ok(n) if n == count => Ok(bytes),
            Ok(_) => Err("damaged or incomplete data".into()),
            Err(e) => Err(format!("damaged or incomplete data ({e})")),
        }
    }

    fn floats(&mut self, count: usize, double: bool) -> Parsed<Vec<f32>> {
        let bytes = self.bytes(count * if double { 8 } else { 4 })?;
        Ok(match double {
            true => bytes.chunks_exact(8).map(|b| f64::from_le_bytes(array(b)) as f32).collect(),
            false => bytes.chunks_exact(4).map(|b| f32::from_le_bytes(array(b))).collect(),
        })
    }
}

/// The first bytes of a slice that is long enough.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}
