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
}

/// Decisions per vertex.
const SLOTS: u32 = 2;

/// The group of words for a decision at a path vertex (0 = camera, 1 = first surface hit …).
pub const fn group(vertex: u32, decision: Decision) -> u32 {
    let slot = match decision {
        Decision::Direction => 0,
        Decision::Light | Decision::Lens => 1,
    };
    vertex * SLOTS + slot
}
