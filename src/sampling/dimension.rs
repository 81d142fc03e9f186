//! Dimensions are addressed by purpose, not by a running counter: (vertex, decision) gives one group of four 32-bit words.
//! Leaving a decision out, replaying a sample or specialising a kernel therefore never shifts the others.

/// What a group of four random words decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// At vertex 0: words 0, 1 = position on the film; words 2, 3 unused (time).
    /// At a surface vertex: words 0, 1 = direction; 2 = lobe; 3 = roulette.
    Direction,
    /// Words 0, 1 = point on the light; 2 = which light; 3 = which part of it.
    Light,
    /// At vertex 0, where no light is sampled: words 0, 1 = point on the lens.
    Lens,
    /// Which of the layers of a mixed material: a word per mixture inside another.
    Layer,
}

/// Decisions per vertex.
const SLOTS: u32 = 2;
/// Beyond the vertices that paths have.
const FIRST_LAYER: u32 = 1 << 30;

/// The group of words for a decision at a path vertex (0 = camera, 1 = first surface hit …).
pub const fn group(vertex: u32, decision: Decision) -> u32 {
    match decision {
        Decision::Direction => vertex * SLOTS,
        Decision::Light | Decision::Lens => vertex * SLOTS + 1,
        // Few scenes have any: apart, so that the others need no third slot.
        Decision::Layer => FIRST_LAYER + vertex,
    }
}
