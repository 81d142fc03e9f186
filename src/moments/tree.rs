//! Moments of a whole field, merged along an aligned binary tree over blocks of samples.
//!
//! Leaves are blocks of [`BLOCK`] consecutive sample indices; node k of level l covers blocks k·2ˡ … (k+1)·2ˡ−1. Which
//! numbers are merged with which therefore depends on sample indices alone: threads, tiles, shards and interruptions
//! leave no trace in the bits.

use super::Moments;
use rayon::prelude::*;
use std::ops::Range;

/// Samples per leaf.
pub const BLOCK: u64 = 64;

/// Most samples that are drawn at once, of one pixel or of several.
pub const BATCH: u64 = 4 * BLOCK;

/// Fewest pixels that are worth a thread's turn when they are only folded.
const FOLDED_TOGETHER: usize = 256;

/// How many non-finite samples are located.
pub(crate) const LOCATED: usize = 16;

/// Moments of the first `samples` samples of every value of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockTree {
    channels: usize,
    samples: u64,
    /// Per pixel: for each node (largest level first, then the partial leaf) the moments of each channel.
    nodes: Vec<Moments>,
    /// (pixel, sample) of the first samples with a non-finite channel, ordered by sample, then pixel.
    bad: Vec<(u32, u64)>,
}

/// Number of nodes that stand for `samples` samples: one per set bit of the block count, and a partial leaf.
pub(crate) fn node_count(samples: u64) -> usize {
    (samples / BLOCK).count_ones() as usize + usize::from(!samples.is_multiple_of(BLOCK))
}

/// How many samples each of these nodes holds, in their order.
fn node_sizes(samples: u64) -> impl Iterator<Item = u64> + Clone {
    let full = (0..u64::BITS).rev().map(|k| 1 << k).filter(move |bit| *bit >= BLOCK && samples & bit != 0);
    full.chain((!samples.is_multiple_of(BLOCK)).then_some(samples % BLOCK))
}

impl BlockTree {
    /// No samples yet.
    pub fn new(channels: usize) -> Self {
        assert!(channels > 0, "a value has channels");
        Self { channels, samples: 0, nodes: Vec::new(), bad: Vec::new() }
    }

    /// Rebuilds a tree from stored parts; `None` if they don't fit together.
    pub fn from_parts(
        pixels: usize,
        channels: usize,
        samples: u64,
        nodes: Vec<Moments>,
        bad: Vec<(u32, u64)>,
    ) -> Option<Self> {
        let per_pixel = channels.checked_mul(node_count(samples)).filter(|&n| n > 0)?;
        let fits = pixels.checked_mul(per_pixel) == Some(nodes.len());
        // Every node must hold the samples that its place in the tree says.
        let counted = |node: &Moments| node.n.checked_add(node.non_finite);
        let expected = node_sizes(samples).flat_map(|n| std::iter::repeat_n(n, channels));
        let full = |pixel: &[Moments]| {
            pixel.iter().zip(expected.clone()).all(|(m, n)| counted(m) == Some(n) && m.zeros <= m.n)
        };
        (fits && nodes.chunks(per_pixel).all(full)).then_some(Self { channels, samples, nodes, bad })
    }

    /// Samples per value so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The stored nodes, per pixel, node, channel.
    pub fn nodes(&self) -> &[Moments] {
        &self.nodes
    }

    /// (pixel, sample) of at most the first sixteen samples that had a non-finite channel.
    pub fn non_finite(&self) -> &[(u32, u64)] {
        &self.bad
    }

    /// Adds samples `self.samples() .. to` of every pixel, in parallel over pixels.
    ///
    /// `draw(pixels, samples, out)` must fill `out` with the channels of the first pixel's samples, in their order, then with
    /// those of the next pixel's. It is called for at most [`BATCH`] samples at a time, of as many pixels as that allows.
    pub fn extend<F>(mut self, pixels: usize, to: u64, draw: F) -> Self
    where
        F: Fn(Range<u32>, Range<u64>, &mut [f64]) + Sync,
    {
        assert!(to > self.samples, "a tree only grows");
        let c = self.channels;
        let (old, new) = (node_count(self.samples) * c, node_count(to) * c);
        assert_eq!(self.nodes.len(), pixels * old, "as many pixels as before");
        // Few pixels are spread over the threads rather than drawn together.
        let spread = pixels.div_ceil(4 * rayon::current_num_threads()).max(1);
        let together = ((BATCH / (to - self.samples).min(BATCH)) as usize).min(spread);
        // As many nodes as before are replaced where they stand.
        let (mut nodes, before) =
            if new == old { (self.nodes, Vec::new()) } else { (vec![Moments::default(); pixels * new], self.nodes) };
        let mut bad: Vec<(u32, u64)> = nodes
            .par_chunks_mut(new * together)
            .enumerate()
            .map_init(
                || (vec![0.0; BATCH as usize * c], Vec::new()),
                |(buffer, stacks), (group, out)| {
                    let first = group * together;
                    let pixels = first..first + out.len() / new;
                    stacks.resize_with(pixels.len(), Stack::default);
                    for (stack, pixel) in stacks.iter_mut().zip(pixels.clone()) {
                        let nodes = if new == old {
                            &out[(pixel - first) * old..][..old]
                        } else {
                            &before[pixel * old..][..old]
                        };
                        stack.restart(pixel as u32, self.samples, nodes);
                    }
                    let mut start = self.samples;
                    while start < to {
                        let end = ((start / BATCH + 1) * BATCH).min(to);
                        let stride = (end - start) as usize * c;
                        let values = &mut buffer[..stride * pixels.len()];
                        draw(pixels.start as u32..pixels.end as u32, start..end, values);
                        for (stack, values) in stacks.iter_mut().zip(values.chunks_exact(stride)) {
                            stack.push(values, c);
                        }
                        start = end;
                    }
                    for (stack, out) in stacks.iter().zip(out.chunks_exact_mut(new)) {
                        out.copy_from_slice(&stack.nodes);
                    }
                    stacks.iter_mut().flat_map(|stack| std::mem::take(&mut stack.bad)).collect::<Vec<_>>()
                },
            )
            .flatten_iter()
            .collect();
        bad.sort_unstable_by_key(|&(pixel, sample)| (sample, pixel));
        self.bad.extend(bad);
        self.bad.truncate(LOCATED);
        Self { channels: c, samples: to, nodes, bad: self.bad }
    }

    /// Moments of every value (pixel-major, then channel) over all samples so far.
    pub fn fold(&self) -> Vec<Moments> {
        self.fold_map(|m| *m)
    }

    /// What `f` makes of the moments of every value (pixel-major, then channel) over all samples so far.
    pub fn fold_map<T: Send>(&self, f: impl Fn(&Moments) -> T + Sync) -> Vec<T> {
        let c = self.channels;
        let stride = node_count(self.samples) * c;
        if stride == 0 {
            return Vec::new();
        }
        let f = &f;
        if stride == c {
            return self.nodes.par_iter().with_min_len(FOLDED_TOGETHER * c).map(f).collect();
        }
        self.nodes
            .par_chunks(stride)
            .with_min_len(FOLDED_TOGETHER)
            .flat_map_iter(|nodes| {
                (0..c).map(move |k| {
                    let mut all = nodes[stride - c + k];
                    for node in nodes[..stride - c].chunks(c).rev() {
                        all = node[k].merge(&all);
                    }
                    f(&all)
                })
            })
            .collect()
    }
}

/// One pixel's nodes while samples are added: a binary counter.
#[derive(Default)]
struct Stack {
    pixel: u32,
    samples: u64,
    nodes: Vec<Moments>,
    /// See [`BlockTree::bad`].
    bad: Vec<(u32, u64)>,
}

impl Stack {
    fn restart(&mut self, pixel: u32, samples: u64, nodes: &[Moments]) {
        (self.pixel, self.samples) = (pixel, samples);
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
    }

    /// Adds the samples that follow, of `c` channels.
    fn push(&mut self, mut values: &[f64], c: usize) {
        #[cfg(target_arch = "x86_64")]
        while self.samples.is_multiple_of(BLOCK) && values.len() >= 2 * BLOCK as usize * c {
            let (blocks, rest) = values.split_at(2 * BLOCK as usize * c);
            if !self.push_blocks(blocks, c) {
                break;
            }
            values = rest;
        }
        while !values.is_empty() {
            let room = (BLOCK - self.samples % BLOCK) as usize * c;
            let (leaf, rest) = values.split_at(room.min(values.len()));
            self.push_leaf(leaf, c);
            values = rest;
        }
    }

    /// Adds two whole blocks side by side; does nothing and returns false where that is not possible.
    #[cfg(target_arch = "x86_64")]
    fn push_blocks(&mut self, values: &[f64], c: usize) -> bool {
        let mut moments = [Moments::default(); 2 * super::leaf::WIDTH];
        let Some(moments) = moments.get_mut(..2 * c) else { return false };
        if !super::leaf::push(moments, c, values, self.samples) {
            return false;
        }
        for leaf in moments.chunks_exact(c) {
            self.nodes.extend_from_slice(leaf);
            self.samples += BLOCK;
            self.carry(c);
        }
        true
    }

    /// Adds samples of one block.
    fn push_leaf(&mut self, values: &[f64], c: usize) {
        if self.samples.is_multiple_of(BLOCK) {
            self.nodes.extend(std::iter::repeat_n(Moments::default(), c));
        }
        let first = self.nodes.len() - c;
        let moments = &mut self.nodes[first..];
        #[cfg(target_arch = "x86_64")]
        let done = super::leaf::push(moments, c, values, self.samples);
        #[cfg(not(target_arch = "x86_64"))]
        let done = false;
        if !done {
            for (i, sample) in values.chunks_exact(c).enumerate() {
                let index = self.samples + i as u64;
                let before: u64 = moments.iter().map(|m| m.non_finite).sum();
                for (m, &x) in moments.iter_mut().zip(sample) {
                    m.push(x, index);
                }
                if moments.iter().map(|m| m.non_finite).sum::<u64>() > before && self.bad.len() < LOCATED {
                    self.bad.push((self.pixel, index));
                }
            }
        }
        self.samples += (values.len() / c) as u64;
        if self.samples.is_multiple_of(BLOCK) {
            self.carry(c);
        }
    }

    /// A leaf is full: merges equal neighbours, as many as the block count has trailing zeros.
    fn carry(&mut self, c: usize) {
        for _ in 0..(self.samples / BLOCK).trailing_zeros() {
            let last = self.nodes.len() - c;
            let (earlier, later) = self.nodes.split_at_mut(last);
            for (earlier, later) in earlier[last - c..].iter_mut().zip(&*later) {
                *earlier = earlier.merge(later);
            }
            self.nodes.truncate(last);
        }
    }
}
