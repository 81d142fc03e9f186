//! The sensor and its film.

use super::value::{self, Value};
use super::{Builder, Node};
use crate::error::Result;
use crate::scene::validate::camera_problem;
use crate::scene::{Camera, Film, Filter, Projection};
use glam::DVec3;

/// Largest film side in pixels.
const LARGEST_SIDE: i64 = 1 << 16;

/// Relative deviation of the camera's axes from equal length that counts as rounding: Mitsuba's figure.
const AXIS_TOLERANCE: f64 = 1e-3;

/// Mitsuba's default for `far_clip`, and so for `focus_distance`.
const DEFAULT_FAR: f64 = 1e4;

impl Builder {
    pub(super) fn sensor(&mut self, index: usize) -> Result<()> {
        let node = &self.tree.nodes[index];
        if !["perspective", "thinlens", "orthographic"].contains(&node.plugin.as_str()) {
            return Err(node.unsupported(&node.plugin, "perspective, thinlens, orthographic"));
        }
        let mut film = None;
        for child in &node.children {
            let inner = self.tree.resolve(child)?;
            match self.tree.nodes[inner].tag.as_str() {
                "film" if film.is_none() => film = Some(inner),
                "sampler" => {}
                _ => return Err(self.tree.nodes[inner].error("has no place in a sensor, or is there twice")),
            }
        }
        self.scene.film = match film {
            Some(film) => self.film(film)?,
            None => Film { filter: Filter::Gaussian { stddev: 0.5 }, ..Film::default() },
        };
        if let Some(size) = self.size {
            let filter = self.scene.film.filter;
            self.scene.film = Film { size, crop_offset: [0, 0], crop_size: size, filter };
        }
        let [width, height] = self.scene.film.size.map(f64::from);
        let node = &self.tree.nodes[index];
        let camera = match node.plugin.as_str() {
            "orthographic" => orthographic(node, width / height)?,
            _ => perspective(node, width / height)?,
        };
        if let Some(problem) = camera_problem(&camera) {
            return Err(node.error(problem));
        }
        self.scene.camera = camera;
        // No motion, no lens but of `thinlens`; the sample count belongs to the experiment.
        self.finish(index, &["focus_distance", "aperture_radius", "shutter_open", "shutter_close"]);
        Ok(())
    }

    fn film(&mut self, index: usize) -> Result<Film> {
        let node = &self.tree.nodes[index];
        if !matches!(node.plugin.as_str(), "hdrfilm" | "ldrfilm" | "mfilm") {
            return Err(node.unsupported(&node.plugin, "hdrfilm"));
        }
        let default = Film::default();
        let side = |name: &str, default: u32, range: std::ops::RangeInclusive<i64>| {
            let value = node.integer(name)?.unwrap_or(i64::from(default));
            if !range.contains(&value) {
                let message = format!("{name} is {value}; allowed: {} to {}", range.start(), range.end());
                return Err(node.error(message));
            }
            Ok(value as u32)
        };
        let size =
            [side("width", default.size[0], 1..=LARGEST_SIDE)?, side("height", default.size[1], 1..=LARGEST_SIDE)?];
        let [width, height] = size.map(i64::from);
        let crop_offset = [side("crop_offset_x", 0, 0..=width - 1)?, side("crop_offset_y", 0, 0..=height - 1)?];
        let crop_size = [side("crop_width", size[0], 1..=width)?, side("crop_height", size[1], 1..=height)?];
        if (0..2).any(|k| crop_offset[k] + crop_size[k] > size[k]) {
            let message = format!("the crop window {crop_offset:?} + {crop_size:?} leaves the film {size:?}");
            return Err(node.error(message));
        }
        let mut filter = None;
        for child in &node.children {
            let inner = &self.tree.nodes[self.tree.resolve(child)?];
            if inner.tag != "rfilter" || filter.is_some() {
                return Err(inner.error("has no place in a film, or is there twice"));
            }
            filter = Some(self.tree.resolve(child)?);
        }
        let filter = match filter {
            Some(filter) => self.filter(filter)?,
            None => Filter::Gaussian { stddev: 0.5 },
        };
        // How the image is stored.
        let quiet = [
            "pixel_format",
            "file_format",
            "component_format",
            "banner",
            "sample_border",
            "compensate",
            "gamma",
            "exposure",
            "attach_log",
            "high_quality_edges",
            "tonemap_method",
            "key",
            "burn",
        ];
        self.finish(index, &quiet);
        Ok(Film { size, crop_offset, crop_size, filter })
    }

    fn filter(&mut self, index: usize) -> Result<Filter> {
        let node = &self.tree.nodes[index];
        let length = |name: &str, default: f64| match node.float(name)?.unwrap_or(default) as f32 {
            v if v > 0.0 && v <= 100.0 => Ok(v),
            v => Err(node.error(format!("{name} is {v}; it must be above 0 and at most 100 pixels"))),
        };
        let filter = match node.plugin.as_str() {
            "box" => Filter::Box,
            "tent" => Filter::Tent { radius: length("radius", 1.0)? },
            "gaussian" => Filter::Gaussian { stddev: length("stddev", 0.5)? },
            other => {
                let allowed = "box, tent, gaussian (filters with negative lobes cannot be importance-sampled)";
                return Err(node.unsupported(other, allowed));
            }
        };
        self.finish(index, &[]);
        Ok(filter)
    }
}

/// A pinhole or thin-lens camera. Mitsuba's cameras look along z, with y up and x to the left.
fn perspective(node: &Node, aspect: f64) -> Result<Camera> {
    let to_world = node.transform("to_world")?.unwrap_or_default();
    let axes = to_world.matrix3;
    let scale = axes.z_axis.length();
    let even = |axis: DVec3| (axis.length() / scale - 1.0).abs() <= AXIS_TOLERANCE;
    if axes.determinant() == 0.0 || !(even(axes.x_axis) && even(axes.y_axis)) {
        return Err(node.error("to_world scales the camera's axes unequally, or to nothing"));
    }
    let tan_x = tan_half_fov(node, aspect)?;
    let lens = node.plugin == "thinlens";
    let offset = |name| Ok::<_, crate::error::Error>(if lens { 0.0 } else { node.float(name)?.unwrap_or(0.0) });
    let (x, y) = (offset("principal_point_offset_x")?, offset("principal_point_offset_y")?);
    let (left, up, forward) = (axes.x_axis / scale, axes.y_axis / scale, axes.z_axis / scale);
    let (half_across, half_up) = (left * tan_x, up * (tan_x / aspect));
    let near = node.float("near_clip")?.unwrap_or(0.0);
    let far = node.float("far_clip")?.unwrap_or(f64::INFINITY);
    Ok(Camera {
        origin: to_world.translation.as_vec3(),
        corner: (forward + half_across * (1.0 - 2.0 * x) + half_up * (1.0 - 2.0 * y)).as_vec3(),
        across: (half_across * -2.0).as_vec3(),
        down: (half_up * -2.0).as_vec3(),
        near: near as f32,
        far: far as f32,
        projection: if lens { thin_lens(node, left, up)? } else { Projection::Pinhole },
    })
}

/// The lens between the unit axes `left` and `up`.
fn thin_lens(node: &Node, left: DVec3, up: DVec3) -> Result<Projection> {
    let radius = node.float("aperture_radius")?.ok_or_else(|| node.error("lacks the property `aperture_radius`"))?;
    if radius < 0.0 {
        return Err(node.error(format!("aperture_radius is {radius}; it must be at least 0")));
    }
    let focus = match node.float("focus_distance")? {
        Some(distance) => distance,
        None => node.float("far_clip")?.unwrap_or(DEFAULT_FAR),
    };
    if focus <= 0.0 {
        return Err(node.error(format!("focus_distance is {focus}; it must be above 0")));
    }
    let radii = [left, up].map(|axis| (axis * radius).as_vec3());
    Ok(Projection::ThinLens { radii, inverse_focus: (1.0 / focus) as f32 })
}

/// Parallel rays along z from a film that spans \[−1, 1\] along x, and along y as much as its aspect says.
fn orthographic(node: &Node, aspect: f64) -> Result<Camera> {
    let to_world = node.transform("to_world")?.unwrap_or_default();
    let axes = to_world.matrix3;
    let direction = axes.z_axis.try_normalize().ok_or_else(|| node.error("to_world takes the z axis to nothing"))?;
    let (half_across, half_up) = (axes.x_axis, axes.y_axis / aspect);
    // Mitsuba scales the distance of the nearest point, but not the length of rays.
    let near = node.float("near_clip")?.unwrap_or(0.0);
    let far = node.float("far_clip")?.unwrap_or(f64::INFINITY);
    let scaled = near * axes.z_axis.length();
    Ok(Camera {
        origin: to_world.translation.as_vec3(),
        corner: (half_across + half_up).as_vec3(),
        across: (half_across * -2.0).as_vec3(),
        down: (half_up * -2.0).as_vec3(),
        near: scaled as f32,
        far: (scaled + (far - near)) as f32,
        projection: Projection::Orthographic { direction: direction.as_vec3() },
    })
}

/// Tangent of half the horizontal field of view.
fn tan_half_fov(node: &Node, aspect: f64) -> Result<f64> {
    let fov = node.float("fov")?;
    let focal_length = focal_length(node)?;
    let axis = node.string("fov_axis")?;
    let (tan, axis) = match (fov, focal_length) {
        (Some(_), Some(_)) => return Err(node.error("found both `fov` and `focal_length`; give one")),
        (Some(fov), None) if !(fov > 0.0 && fov < 180.0) => {
            return Err(node.error(format!("fov is {fov}; it must be above 0 and below 180 degrees")));
        }
        (Some(fov), None) => ((0.5 * fov.to_radians()).tan(), axis.unwrap_or("x".into()).to_ascii_lowercase()),
        // The diagonal of the 36 × 24 mm film.
        (None, length) => ((36f64 * 36.0 + 24.0 * 24.0).sqrt() / (2.0 * length.unwrap_or(50.0)), "diagonal".into()),
    };
    match axis.as_str() {
        "x" => Ok(tan),
        "y" => Ok(tan * aspect),
        "smaller" => Ok(if aspect > 1.0 { tan * aspect } else { tan }),
        "larger" => Ok(if aspect > 1.0 { tan } else { tan * aspect }),
        "diagonal" => Ok(tan / (1.0 + 1.0 / (aspect * aspect)).sqrt()),
        other => {
            let allowed = "x, y, diagonal, smaller, larger";
            Err(node.error(format!("fov_axis is `{}`; allowed: {allowed}", super::super::shorten(other))))
        }
    }
}

/// Millimetres, written as `50mm` or `50`.
fn focal_length(node: &Node) -> Result<Option<f64>> {
    let Some(property) = node.properties.iter().find(|p| p.name == "focal_length") else { return Ok(None) };
    let length = match &property.value {
        Value::String(text) => {
            property.used.set(true);
            value::float(text.trim().trim_end_matches("mm")).map_err(|m| node.error(m))?
        }
        _ => node.float("focal_length")?.unwrap_or_default(),
    };
    if length > 0.0 { Ok(Some(length)) } else { Err(node.error("focal_length must be above 0 mm")) }
}
