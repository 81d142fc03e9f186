//! Colours of vertices and faces of PLY files.

use super::super::mesh::Attribute;
use super::super::shorten;
use super::{Element, Number, Parsed};
use crate::math::Rgb;

/// A mesh attribute while it is read.
pub(super) struct Colors {
    name: String,
    columns: [usize; 3],
    values: Vec<Rgb>,
}

impl Colors {
    /// Adds the colour of a row, `count` times.
    pub(super) fn push(&mut self, element: &Element, row: &[f32], count: usize) -> Parsed<()> {
        let color = Rgb::from_array(self.columns.map(|i| row[i] / element.properties[i].number.white()));
        if !color.is_finite() {
            return Err(format!("a colour of {} is not finite (32 bits)", shorten(&self.name)));
        }
        self.values.extend(std::iter::repeat_n(color, count));
        Ok(())
    }

    pub(super) fn finish(all: Vec<Self>) -> impl Iterator<Item = Attribute> {
        all.into_iter().map(|Self { name, values, .. }| Attribute { name, values })
    }
}

impl Element {
    /// The colours among the properties, under the names that Mitsuba gives them: `r`, `g`, `b` (also in full) are
    /// `color`; neighbours that differ after their last `_` are one attribute of three numbers, or of one: `x_r`, `x_g`, `x_b` are
    /// `x_color`, `x_0`, `x_1`, `x_2` are `x`.
    pub(super) fn colors(&self) -> Vec<Colors> {
        let of = |name: &str, columns| Colors { name: format!("{}_{name}", self.name), columns, values: Vec::new() };
        let plain = self.columns(["r", "g", "b"]).or_else(|| self.columns(["red", "green", "blue"]));
        let mut found: Vec<Colors> = plain.map(|c| of("color", c)).into_iter().collect();
        let mut stems: Vec<(&str, Vec<usize>)> = Vec::new();
        for (i, property) in self.properties.iter().enumerate().filter(|(_, p)| p.length.is_none()) {
            let Some((stem, _)) = property.name.rsplit_once('_') else { continue };
            match stems.last_mut() {
                Some((last, columns)) if *last == stem => columns.push(i),
                _ => stems.push((stem, vec![i])),
            }
        }
        for (stem, columns) in stems {
            let is_color = self.properties[columns[0]].name.ends_with("_r");
            let name = if is_color { format!("{stem}_color") } else { stem.to_owned() };
            match columns[..] {
                [x] => found.push(of(&name, [x; 3])),
                [x, y, z] => found.push(of(&name, [x, y, z])),
                _ => {}
            }
        }
        found
    }
}

impl Number {
    /// What stands for 1 where numbers are colours.
    fn white(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32_767.0,
            Self::U16 => 65_535.0,
            Self::I32 => 2_147_483_647.0,
            Self::U32 => 4_294_967_295.0,
            Self::F32 | Self::F64 => 1.0,
        }
    }
}
