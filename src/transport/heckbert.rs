//! Which kinds of paths a scene may have, in the notation of Heckbert 1990 ("Adaptive radiosity textures for bidirectional
//! ray tracing", SIGGRAPH): L a light, E the eye, S a vertex that scatters by a delta lobe, D one that scatters by any other.
//! Rough lobes are D: what matters here is which techniques can find a path, and they have a density.
//!
//! The classes follow from the kinds of materials, lights and the depth alone, so they are an upper bound: whether light
//! takes such a path depends on where things are.

use crate::scene::{Bsdf, Light, Material, Scene};
use serde::Serialize;

/// Paths of one form. All classes together are all paths, and no path is in two.
struct Form {
    /// As a regular expression, and the same where nothing is specular.
    expression: [&'static str; 2],
    meaning: &'static str,
    /// Edges of the shortest.
    edges: u32,
    /// Needs a vertex of kind D, and of kind S.
    needs: [bool; 2],
    /// The vertex next to the light: `None` for the eye.
    first: Option<Scatters>,
}

#[derive(Clone, Copy, PartialEq)]
enum Scatters {
    Diffuse,
    Specular,
}

const FORMS: [Form; 8] = [
    Form { expression: ["L E"; 2], meaning: "lights seen directly", edges: 1, needs: [false, false], first: None },
    Form {
        expression: ["L S+ E"; 2],
        meaning: "lights seen in mirrors and through glass",
        edges: 2,
        needs: [false, true],
        first: Some(Scatters::Specular),
    },
    Form {
        expression: ["L D E"; 2],
        meaning: "direct light",
        edges: 2,
        needs: [true, false],
        first: Some(Scatters::Diffuse),
    },
    Form {
        expression: ["L D S+ E"; 2],
        meaning: "direct light seen in mirrors and through glass",
        edges: 3,
        needs: [true, true],
        first: Some(Scatters::Diffuse),
    },
    Form {
        expression: ["L S+ D E"; 2],
        meaning: "caustics",
        edges: 3,
        needs: [true, true],
        first: Some(Scatters::Specular),
    },
    Form {
        expression: ["L S+ D S+ E"; 2],
        meaning: "caustics seen in mirrors and through glass",
        edges: 4,
        needs: [true, true],
        first: Some(Scatters::Specular),
    },
    Form {
        expression: ["L D (D|S)* D S* E", "L D D+ E"],
        meaning: "indirect light",
        edges: 3,
        needs: [true, false],
        first: Some(Scatters::Diffuse),
    },
    Form {
        expression: ["L S+ D (D|S)* D S* E"; 2],
        meaning: "indirect light of caustics",
        edges: 4,
        needs: [true, true],
        first: Some(Scatters::Specular),
    },
];

/// How paths of a class are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Found {
    /// By drawn directions alone.
    Directions,
    /// By light sampling and, where the light has an extent, by drawn directions.
    LightSampling,
    /// By nothing that starts at the eye: the light is a point or a direction behind a mirror or glass.
    Nothing,
}

impl Found {
    /// In words.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Directions => "drawn directions",
            Self::LightSampling => "light sampling",
            Self::Nothing => "nothing",
        }
    }
}

/// Paths of one form that a scene may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PathClass {
    /// As a regular expression.
    pub expression: &'static str,
    /// In words.
    pub meaning: &'static str,
    /// Edges of the shortest.
    pub edges: u32,
    /// How they are found.
    pub found: Found,
}

/// The classes that a scene may have, shortest first.
pub fn path_classes(scene: &Scene) -> Vec<PathClass> {
    let [diffuse, specular] = scatters(scene);
    let extended = scene.lights.iter().any(|l| !l.is_delta());
    let delta = scene.lights.iter().any(Light::is_delta);
    let reached = |form: &Form| {
        let scattered = (diffuse || !form.needs[0]) && (specular || !form.needs[1]);
        // Lights without extent are never met: seen directly or by delta lobes alone they would be points of infinite radiance.
        let lit = extended || delta && form.needs[0];
        scattered && lit && scene.depth.max.is_none_or(|max| form.edges <= max)
    };
    let class = |form: &Form| PathClass {
        expression: form.expression[usize::from(!specular)],
        meaning: form.meaning,
        edges: form.edges,
        found: match form.first {
            Some(Scatters::Diffuse) => Found::LightSampling,
            _ if extended => Found::Directions,
            _ => Found::Nothing,
        },
    };
    let mut classes: Vec<PathClass> = FORMS.iter().filter(|f| reached(f)).map(class).collect();
    classes.sort_by_key(|c| c.edges);
    classes
}

/// Whether some surface scatters by lobes with a density, and by delta lobes.
pub fn scatters(scene: &Scene) -> [bool; 2] {
    let worn = worn_materials(scene);
    let any = |kind: fn(&Material) -> bool| scene.materials.iter().zip(&worn).any(|(m, worn)| *worn && kind(m));
    let diffuse = |m: &Material| {
        use Bsdf::{Diffuse, Plastic, RoughConductor, RoughDielectric, RoughPlastic};
        matches!(
            m.bsdf,
            Diffuse { .. } | Plastic { .. } | RoughConductor { .. } | RoughDielectric { .. } | RoughPlastic { .. }
        )
    };
    let specular = |m: &Material| {
        use Bsdf::{Conductor, Dielectric, Null, Plastic, ThinDielectric};
        matches!(m.bsdf, Conductor { .. } | Dielectric { .. } | ThinDielectric { .. } | Null | Plastic { .. })
    };
    [any(diffuse), any(specular)]
}

/// Of each material whether a shape has it, be it as part of a mixture.
fn worn_materials(scene: &Scene) -> Vec<bool> {
    let mut worn = vec![false; scene.materials.len()];
    for side in scene.shapes.iter().flat_map(|s| [s.front, s.back]) {
        worn[side as usize] = true;
    }
    // Mixtures come after what they mix.
    for (i, material) in scene.materials.iter().enumerate().rev() {
        if let Bsdf::Mixture { materials, .. } = material.bsdf
            && worn[i]
        {
            materials.iter().for_each(|&m| worn[m as usize] = true);
        }
    }
    worn
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the letters match the parts of a regular expression.
    fn matches(parts: &[&str], word: &[char]) -> bool {
        let Some((part, rest)) = parts.split_first() else { return word.is_empty() };
        let letters = part.trim_end_matches(['*', '+']);
        let takes = |word: &[char]| word.first().is_some_and(|c| letters.contains(*c));
        match part.chars().last() {
            Some('*') => matches(rest, word) || takes(word) && matches(parts, &word[1..]),
            Some('+') => {
                let star = format!("{letters}*");
                let more: Vec<&str> = std::iter::once(&*star).chain(rest.iter().copied()).collect();
                takes(word) && matches(&more, &word[1..])
            }
            _ => takes(word) && matches(rest, &word[1..]),
        }
    }

    /// Every path is in one class, and that class asks for just what the path has.
    #[test]
    fn classes_are_a_partition() {
        for vertices in 0..7 {
            for bits in 0..1u32 << vertices {
                let middle = (0..vertices).map(|i| if bits >> i & 1 == 1 { 'S' } else { 'D' });
                let word: Vec<char> = std::iter::once('L').chain(middle).chain(['E']).collect();
                let holds = |expression: &str| matches(&expression.split(' ').collect::<Vec<_>>(), &word);
                let found: Vec<&Form> = FORMS.iter().filter(|f| holds(f.expression[0])).collect();
                let [form] = found[..] else { panic!("{word:?} is in {} classes", found.len()) };
                assert!(form.edges <= vertices + 1, "{word:?}");
                assert_eq!(form.needs[0], word.contains(&'D'), "{word:?}");
                assert!(!form.needs[1] || word.contains(&'S'), "{word:?}");
                let first = word[1..].first().filter(|_| vertices > 0);
                assert_eq!(form.first.is_some_and(|f| f == Scatters::Specular), first == Some(&'S'), "{word:?}");
                assert!(bits > 0 || holds(form.expression[1]), "{word:?}");
            }
        }
    }
}
