//! Dispatches: their size, two of them in flight, and the moments that stay on the device until they are read back.

use super::buffer::{Buffer, Use};
use super::commands::{Commands, Queries, all_before};
use super::device::Device;
use super::kernel::Kernel;
use crate::error::{Error, Result};
use crate::estimator::{Cell, interrupted};
use crate::moments::tree::node_count;
use crate::moments::{BLOCK, BlockTree, Moments};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Seconds that a dispatch should take: long enough to be worth its overhead, far from the two seconds after which systems
/// take a device for hung.
const DISPATCH: f64 = 0.07;

/// Samples of the first dispatch, whose speed is not known yet.
const FIRST: f64 = 65_536.0;

/// Seconds of work that an interruption waits for.
const PATIENCE: f64 = 2.0;

/// How many times the samples of the one before a dispatch may have: the speed of few need not be that of many.
const GROWTH: f64 = 8.0;

/// How much of a slow dispatch is remembered at the next one: parts of a film differ.
const MEMORY: f64 = 0.75;

/// Most invocations of a dispatch: leaves take 104 bytes each, and 65535 groups of 64 always fit.
const MOST: u32 = 1 << 20;

/// How fast dispatches of a kernel have been.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    /// Seconds per sample; 0 before the first dispatch.
    seconds: f64,
    /// Samples of the last dispatch.
    samples: f64,
}

impl Pace {
    /// Samples of the next dispatch.
    fn next(&self) -> f64 {
        if self.seconds > 0.0 { (DISPATCH / self.seconds).min(GROWTH * self.samples.max(FIRST)) } else { FIRST }
    }

    fn update(&mut self, samples: f64, seconds: f64) {
        *self = Self { seconds: (seconds / samples).max(MEMORY * self.seconds), samples };
    }
}

/// Bytes of the push constants.
pub(super) const PUSH: u32 = size_of::<Work>() as u32;

/// `Work` of `shaders/transport/work.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Work {
    tracer: u64,
    leaves: u64,
    nodes: u64,
    masks: u64,
    bad: u64,
    from: u64,
    to: u64,
    first_block: u64,
    length: u64,
    key: [u32; 2],
    first_pixel: u32,
    pixels: u32,
    blocks: u32,
    film_pixels: u32,
}

impl Work {
    fn invocations(&self) -> u32 {
        self.pixels * self.blocks
    }

    fn samples(&self) -> f64 {
        let end = ((self.first_block + u64::from(self.blocks)) * BLOCK).min(self.to);
        let start = (self.first_block * BLOCK).max(self.from);
        f64::from(self.pixels) * (end - start) as f64
    }
}

/// Bytes per invocation, and per pixel and node.
const LEAF: u64 = 3 * 32;
const MASK: u64 = 8;
const NODE: u64 = 3 * size_of::<Moments>() as u64;

/// What is there and what is wanted.
pub(super) struct Accumulators<'a> {
    pub(super) pixels: u32,
    pub(super) tree: &'a BlockTree,
    pub(super) to: u64,
}

/// Memory of one dispatch in flight.
struct Slot {
    commands: vk::CommandBuffer,
    queries: Queries,
    leaves: Buffer,
    masks: Buffer,
    /// One word: blocks with non-finite samples.
    bad: Buffer,
}

/// A dispatch in flight.
struct Flight {
    slot: usize,
    done: u64,
    work: Work,
}

/// The stream of dispatches of a scene: one strategy at a time.
pub(super) struct Engine {
    device: Arc<Device>,
    commands: Commands,
    fold: Kernel,
    slots: Vec<Slot>,
    /// Invocations that the slots have room for.
    room: u32,
    nodes: Option<Buffer>,
}

impl Engine {
    pub(super) fn new(device: &Arc<Device>, commands: Commands) -> Result<Self> {
        // SAFETY: our build made the code.
        let fold = unsafe { Kernel::new(device, super::spirv!("fold"), &[], PUSH) }?;
        Ok(Self { device: Arc::clone(device), commands, fold, slots: Vec::new(), room: 0, nodes: None })
    }

    pub(super) fn commands(&mut self) -> &mut Commands {
        &mut self.commands
    }

    /// Adds samples up to `job.to`; the tree with them, and the seconds that the device took.
    pub(super) fn advance(
        &mut self,
        kernel: &Kernel,
        tracer: u64,
        cell: &Cell,
        job: &Accumulators<'_>,
        fixed: Option<u32>,
        pace: &mut Pace,
    ) -> Result<(BlockTree, f64)> {
        let (from, to) = (job.tree.samples(), job.to);
        assert!(to > from, "a tree only grows");
        let blocks = (from / BLOCK)..to.div_ceil(BLOCK);
        // Before the last block there are at most as many nodes as the number of blocks has bits; then one more.
        let most_nodes = u64::from(u64::BITS - (blocks.end - 1).leading_zeros()) + 1;
        self.put_nodes(job, most_nodes)?;
        let nodes = self.nodes.as_ref().expect("just made").address;
        let total = (blocks.end - blocks.start).saturating_mul(job.pixels.into());
        let mut next = (blocks.start, 0);
        let mut bad = job.tree.non_finite().to_vec();
        let mut seconds = 0.0;
        let mut flights: VecDeque<Flight> = VecDeque::new();
        let (mut failure, mut left) = (None, f64::from(job.pixels) * (to - from) as f64);
        while failure.is_none() && (next.0 < blocks.end || !flights.is_empty()) {
            // What is not finished for all pixels is lost, so little is better finished.
            if interrupted() && left * pace.seconds > PATIENCE {
                failure = Some(Error::Interrupted);
                break;
            }
            let per_invocation = (to - from).min(BLOCK) as f64;
            let size = fixed.unwrap_or((pace.next() / per_invocation) as u32).clamp(64, MOST);
            let (part, after) = part(next, &blocks, job.pixels, u64::from(size).min(total) as u32);
            // More room can only be made when nothing is under way.
            let must_land = flights.len() == 2 || next.0 == blocks.end || part.invocations() > self.room;
            let outcome = match flights.front() {
                Some(flight) if must_land => {
                    let samples = flight.work.samples();
                    self.land(flight, &mut bad).map(|elapsed| {
                        seconds += elapsed;
                        pace.update(samples, elapsed);
                        left -= samples;
                        flights.pop_front();
                    })
                }
                _ => {
                    let (length, key) = (cell.length, cell.key.0);
                    let work = Work { tracer, nodes, from, to, length, key, film_pixels: job.pixels, ..part };
                    let slot = flights.back().map_or(0, |f| 1 - f.slot);
                    self.launch(kernel, work, slot).map(|flight| {
                        flights.push_back(flight);
                        next = after;
                    })
                }
            };
            failure = outcome.err();
        }
        if let Some(e) = failure {
            // What is under way must end before its memory goes.
            for flight in flights {
                let _ = self.commands.wait(flight.done);
            }
            return Err(e);
        }
        bad.sort_unstable_by_key(|&(pixel, sample)| (sample, pixel));
        bad.truncate(crate::moments::tree::LOCATED);
        let nodes = self.take_nodes(job.pixels as usize, node_count(to))?;
        // Read back; the next strategy, or another scene, may need the room.
        self.nodes = None;
        let tree = BlockTree::from_parts(job.pixels as usize, 3, to, nodes, bad);
        let tree = tree.ok_or_else(|| Error::Device {
            device: self.device.info.name.clone(),
            message: "it gave back moments that do not add up".into(),
        })?;
        Ok((tree, seconds))
    }

    /// Makes room for the nodes and fills in those of the tree.
    fn put_nodes(&mut self, job: &Accumulators<'_>, most: u64) -> Result<()> {
        let size = most * u64::from(job.pixels) * NODE;
        if self.nodes.as_ref().is_none_or(|n| n.size < size) {
            self.nodes = None;
            self.nodes = Some(Buffer::new(&self.device, size, Use::Device)?);
        }
        let nodes = transposed(job.tree.nodes(), job.pixels as usize, node_count(job.tree.samples()));
        let buffer = self.nodes.as_ref().expect("just made");
        self.commands.write(buffer, bytemuck::cast_slice(&nodes))
    }

    /// The nodes in the order of a [`BlockTree`].
    fn take_nodes(&mut self, pixels: usize, count: usize) -> Result<Vec<Moments>> {
        let buffer = self.nodes.as_ref().expect("made before");
        let nodes: Vec<Moments> = self.commands.read(buffer, pixels * count * 3)?;
        // [slot][pixel] becomes [pixel][slot].
        Ok(transposed(&nodes, count, pixels))
    }

    fn launch(&mut self, kernel: &Kernel, work: Work, slot: usize) -> Result<Flight> {
        if work.invocations() > self.room {
            self.make_room(work.invocations())?;
        }
        let Slot { commands, queries, leaves, masks, bad } = &self.slots[slot];
        let work = Work { leaves: leaves.address, masks: masks.address, bad: bad.address, ..work };
        let fold = &self.fold;
        let done = self.commands.submit(*commands, |raw, c| {
            // SAFETY: recording into our buffer; all buffers and pools live in the slot until the flight has landed.
            unsafe {
                raw.cmd_reset_query_pool(c, queries.raw, 0, 2);
                raw.cmd_fill_buffer(c, bad.raw, 0, 4, 0);
                all_before(raw, c);
                raw.cmd_write_timestamp(c, vk::PipelineStageFlags::BOTTOM_OF_PIPE, queries.raw, 0);
                kernel.dispatch(c, bytemuck::bytes_of(&work), work.invocations());
                all_before(raw, c);
                fold.dispatch(c, bytemuck::bytes_of(&work), work.pixels * 3);
                raw.cmd_write_timestamp(c, vk::PipelineStageFlags::BOTTOM_OF_PIPE, queries.raw, 1);
                all_before(raw, c);
            }
        })?;
        Ok(Flight { slot, done, work })
    }

    /// Waits for a dispatch; its seconds. Non-finite samples are located.
    fn land(&mut self, flight: &Flight, found: &mut Vec<(u32, u64)>) -> Result<f64> {
        self.commands.wait(flight.done)?;
        let slot = &self.slots[flight.slot];
        let ticks: [u64; 2] = slot.queries.results()?;
        if bytemuck::pod_read_unaligned::<u32>(&slot.bad.bytes()[..4]) > 0 {
            let masks: Vec<u64> = self.commands.read(&slot.masks, flight.work.invocations() as usize)?;
            locate(&masks, &flight.work, found);
        }
        let info = &self.device.info;
        let valid = if info.timestamp_bits >= 64 { u64::MAX } else { (1 << info.timestamp_bits) - 1 };
        let elapsed = ticks[1].wrapping_sub(ticks[0]) & valid;
        Ok(elapsed as f64 * f64::from(info.timestamp_period.unwrap_or(1.0)) * 1e-9)
    }

    /// Nothing must be under way.
    fn make_room(&mut self, invocations: u32) -> Result<()> {
        let room = invocations.next_power_of_two();
        self.room = 0;
        while self.slots.len() < 2 {
            self.slots.push(Slot {
                queries: Queries::new(&self.device, vk::QueryType::TIMESTAMP, 2)?,
                commands: self.commands.buffer()?,
                leaves: Buffer::new(&self.device, 0, Use::Device)?,
                masks: Buffer::new(&self.device, 0, Use::Device)?,
                bad: Buffer::new(&self.device, 4, Use::Readback)?,
            });
        }
        for slot in &mut self.slots {
            slot.leaves = Buffer::new(&self.device, u64::from(room) * LEAF, Use::Device)?;
            slot.masks = Buffer::new(&self.device, u64::from(room) * MASK, Use::Device)?;
        }
        self.room = room;
        Ok(())
    }
}

/// The part of the work from (block, pixel) `next` on that `size` invocations can do, blocks of all pixels or pixels of one
/// block; and where the rest starts.
fn part((block, pixel): (u64, u32), blocks: &Range<u64>, film: u32, size: u32) -> (Work, (u64, u32)) {
    let mut work = Work { first_block: block, first_pixel: pixel, pixels: film, blocks: 1, ..Work::zeroed() };
    if pixel == 0 && size >= film {
        work.blocks = u64::from(size / film).min(blocks.end - block) as u32;
        return (work, (block + u64::from(work.blocks), 0));
    }
    work.pixels = size.min(film - pixel);
    let end = pixel + work.pixels;
    (work, if end == film { (block + 1, 0) } else { (block, end) })
}

/// Adds the first non-finite samples of a dispatch.
fn locate(masks: &[u64], work: &Work, found: &mut Vec<(u32, u64)>) {
    let mut here = Vec::new();
    for (i, mask) in masks.iter().enumerate().filter(|(_, m)| **m != 0) {
        let (pixel, block) = (i as u32 % work.pixels, i as u32 / work.pixels);
        let first = (work.first_block + u64::from(block)) * BLOCK;
        let samples = (0..BLOCK).filter(|bit| mask >> bit & 1 == 1);
        here.extend(samples.map(|bit| (work.first_pixel + pixel, first + bit)));
    }
    here.sort_unstable_by_key(|&(pixel, sample)| (sample, pixel));
    here.truncate(crate::moments::tree::LOCATED);
    found.extend(here);
}

/// Groups of three channels, `rows` × `columns` of them, transposed.
fn transposed(nodes: &[Moments], rows: usize, columns: usize) -> Vec<Moments> {
    if rows == 1 || columns == 1 {
        return nodes.to_vec();
    }
    let group = |i: usize| {
        let (column, row) = (i / rows, i % rows);
        let at = (row * columns + column) * 3;
        [nodes[at], nodes[at + 1], nodes[at + 2]]
    };
    (0..rows * columns).into_par_iter().with_min_len(1024).flat_map_iter(group).collect()
}

#[cfg(test)]
mod tests {
    use super::{DISPATCH, FIRST, GROWTH, Pace, part};

    #[test]
    fn parts_cover_every_block_of_every_pixel_once() {
        for (film, size) in [(1, 64), (7, 64), (64, 64), (100, 64), (1000, 64), (100, 1000), (13, 5000)] {
            let blocks = 5..12;
            let mut seen = vec![0; film as usize * 7];
            let mut next = (blocks.start, 0);
            while next.0 < blocks.end {
                let (work, after) = part(next, &blocks, film, size);
                assert!(work.invocations() > 0 && work.invocations() <= size);
                for block in 0..u64::from(work.blocks) {
                    for pixel in 0..work.pixels {
                        let block = work.first_block + block - blocks.start;
                        seen[(block as u32 * film + work.first_pixel + pixel) as usize] += 1;
                    }
                }
                assert!(after > next);
                next = after;
            }
            assert!(seen.iter().all(|&n| n == 1), "{film} pixels, {size} invocations");
        }
    }

    #[test]
    fn dispatches_are_sized_by_samples() {
        let mut pace = Pace::default();
        assert_eq!(pace.next(), FIRST);
        // A few samples, fast: growth is bounded, whatever dispatches were larger before.
        pace.update(64.0, 64e-9);
        assert_eq!(pace.next(), GROWTH * FIRST);
        pace.update(1e7, 1e-1);
        assert!((pace.next() - DISPATCH / 1e-8).abs() < 1.0);
        // A slow part is remembered for a while.
        pace.update(1e7, 1.0);
        pace.update(1e7, 1e-1);
        assert!(pace.next() < 1.0e6 && pace.next() > DISPATCH / 1e-7);
    }
}
