//! An eight-wide tree of boxes: built by obvhs (PLOC, Meister & Bittner 2018, and parallel reinsertion), collapsed to
//! eight children by the dynamic programme of Ylitie, Karras & Laine 2017, §3.1, with exact f32 boxes.

use super::simd::Simd;
use super::slab::{Bounds, Slabs, WideSlabs};
use crate::math::Vec3;
use crate::math::lanes::set_bits;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::mem::MaybeUninit;

/// Set in a child reference that names a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// Entries of the traversal stack kept on the machine stack; deeper trees allocate.
const STACK: usize = 128;

/// The boxes and references of a node's children.
pub(super) type Wide = Vec<(Bounds, u32)>;

/// Eight boxes `[axis][lower, upper][child]` and where they lead.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    planes: [[[f32; 8]; 2]; 3],
    children: [u32; 8],
    /// Bit per child in use. The boxes of the others are empty, but a NaN ray would enter even those.
    used: u32,
}

/// What happens at the leaves (not a closure: it must inline into code compiled for the instruction set).
pub(super) trait Leaves<S: Simd> {
    /// Tests a leaf, given the best distance so far; returns the new one, a negative one to end the walk.
    fn visit(&mut self, s: S, slabs: &WideSlabs<S>, leaf: u32, best: f32) -> f32;
}

/// The tree. Leaves are numbers that the builder's `leaf` callback gave out.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    root: u32,
    pub(super) bounds: Bounds,
    /// Most entries that the traversal stack can hold.
    stack: usize,
}

/// From so many boxes on the builder takes less care: building would take seconds longer than rays through the better tree save.
const LARGE: usize = 1 << 20;

impl Tree {
    /// Over `boxes`, at most `per_leaf` in a leaf. `cost` is the SAH cost of a leaf of so many primitives relative to an inner
    /// node's; `leaf` stores the primitives of a leaf and names it (< 2³¹). `None` where there are no boxes.
    pub(super) fn new(
        boxes: &[Bounds],
        per_leaf: u32,
        cost: impl Fn(u32) -> f32,
        mut leaf: impl FnMut(&[u32]) -> u32,
    ) -> Option<Self> {
        if boxes.is_empty() {
            return None;
        }
        let aabbs: Vec<Aabb> = boxes.iter().map(|b| Aabb::new(b.lo.into(), b.hi.into())).collect();
        let (search, reinserted) =
            if boxes.len() < LARGE { (PlocSearchDistance::Medium, 0.25) } else { (PlocSearchDistance::Low, 0.02) };
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            search,
            &aabbs,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            3,
        );
        ReinsertionOptimizer::default().run(&mut binary, reinserted, None);
        let plan = Plan::new(&binary, boxes, per_leaf, cost);
        let mut tree = Self { nodes: Vec::new(), root: 0, bounds: plan.bounds[0], stack: 1 };
        // (binary node, node and slot that lead to it, stack entries in use when it is entered)
        let mut todo = vec![(0u32, None, 0usize)];
        while let Some((index, parent, below)) = todo.pop() {
            let reference = if plan.split[index as usize][1] == 0 {
                LEAF | leaf(&plan.primitives(index))
            } else {
                let mut children = Vec::with_capacity(8);
                plan.forest(index, 8, &mut children);
                let slot = tree.nodes.len();
                tree.nodes.push(Node::new(children.iter().map(|&c| plan.bounds[c as usize])));
                tree.stack = tree.stack.max(below + children.len());
                todo.extend(children.iter().enumerate().map(|(i, &c)| (c, Some((slot, i)), below + children.len())));
                slot as u32
            };
            match parent {
                None => tree.root = reference,
                Some((node, child)) => tree.nodes[node].children[child] = reference,
            }
        }
        Some(tree)
    }

    /// Bytes of the inner nodes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Where a walk starts: an inner node or, with [`LEAF`], a leaf.
    pub(super) fn root(&self) -> u32 {
        self.root
    }

    /// All inner nodes.
    pub(super) fn nodes(&self) -> impl Iterator<Item = Wide> {
        self.nodes.iter().map(|node| {
            let corner = |upper: usize, i: usize| Vec3::from([0, 1, 2].map(|a| node.planes[a][upper][i]));
            let child = |i: usize| (Bounds { lo: corner(0, i), hi: corner(1, i) }, node.children[i]);
            (0..8).filter(|i| node.used >> i & 1 == 1).map(child).collect()
        })
    }

    /// Visits the leaves that the ray may hit nearer than or at `best`; near ones first if `SORTED`.
    #[inline(always)]
    pub(super) fn walk<S: Simd, L: Leaves<S>, const SORTED: bool>(
        &self,
        s: S,
        mut best: f32,
        slabs: &Slabs,
        leaves: &mut L,
    ) {
        let slabs = WideSlabs::new(s, slabs);
        let mut small = [MaybeUninit::<u64>::uninit(); STACK];
        let mut large;
        let stack = if self.stack <= STACK {
            &mut small[..]
        } else {
            large = vec![MaybeUninit::uninit(); self.stack];
            &mut large[..]
        };
        // An entry is (bits of the near distance, child): near ≥ 0, so entries order as their distances.
        let mut top = 0;
        let mut next = self.root;
        loop {
            if next & LEAF != 0 {
                best = leaves.visit(s, &slabs, next & !LEAF, best);
                if best < 0.0 {
                    return;
                }
            } else {
                let node = &self.nodes[next as usize];
                let (near, far) = slabs.boxes(s, &node.planes, best);
                let hit = s.le(near, far) & node.used;
                if hit & hit.wrapping_sub(1) == 0 {
                    // One child at most: no stack.
                    if hit != 0 {
                        next = node.children[hit.trailing_zeros() as usize];
                        continue;
                    }
                } else {
                    let near = s.store(near);
                    let first = top;
                    for child in set_bits(hit) {
                        let entry = u64::from(near[child].to_bits()) << 32 | u64::from(node.children[child]);
                        // Insertion sort, nearest on top.
                        let mut at = top;
                        while SORTED && at > first {
                            // SAFETY: every slot below `top` was written.
                            let other = unsafe { stack[at - 1].assume_init() };
                            if other >= entry {
                                break;
                            }
                            stack[at] = MaybeUninit::new(other);
                            at -= 1;
                        }
                        stack[at] = MaybeUninit::new(entry);
                        top += 1;
                    }
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                // SAFETY: every slot below `top` was written.
                let entry = unsafe { stack[top].assume_init() };
                if (entry >> 32) as u32 <= best.to_bits() {
                    next = entry as u32;
                    break;
                }
            }
        }
    }
}

impl Node {
    fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut node = Self { planes: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3], children: [0; 8], used: 0 };
        for (i, b) in boxes.enumerate() {
            node.used |= 1 << i;
            for a in 0..3 {
                node.planes[a][0][i] = b.lo[a];
                node.planes[a][1][i] = b.hi[a];
            }
        }
        node
    }
}

/// How the binary tree collapses.
struct Plan<'a> {
    binary: &'a Bvh2,
    bounds: Vec<Bounds>,
    /// `split[n][i]`: of i roots (i = 1: of an inner node's 8 children) that stand for the subtree n, how many go to the left
    /// child; 0 = no more roots than i−1 (i = 1: a leaf).
    split: Vec<[u8; 8]>,
}

impl<'a> Plan<'a> {
    fn new(binary: &'a Bvh2, boxes: &[Bounds], per_leaf: u32, leaf_cost: impl Fn(u32) -> f32) -> Self {
        let n = binary.nodes.len();
        let mut plan = Self { binary, bounds: vec![Bounds::EMPTY; n], split: vec![[0; 8]; n] };
        let mut cost = vec![[0f32; 8]; n];
        let mut count = vec![1u32; n];
        let mut order = vec![0u32];
        let mut i = 0;
        while i < order.len() {
            let node = &binary.nodes[order[i] as usize];
            if !node.is_leaf() {
                order.extend([node.first_index, node.first_index + 1]);
            }
            i += 1;
        }
        for &index in order.iter().rev() {
            let index = index as usize;
            let node = &binary.nodes[index];
            if node.is_leaf() {
                let primitive = binary.primitive_indices[node.first_index as usize];
                plan.bounds[index] = boxes[primitive as usize];
                cost[index] = [plan.bounds[index].half_area() * leaf_cost(1); 8];
                continue;
            }
            let (l, r) = (node.first_index as usize, node.first_index as usize + 1);
            plan.bounds[index] = plan.bounds[l].union(plan.bounds[r]);
            count[index] = count[l] + count[r];
            let area = plan.bounds[index].half_area();
            // Cheapest way to share i roots; ties go to the even share, which keeps degenerate trees shallow.
            let share = |i: usize| {
                let mut best = (f32::INFINITY, 0u8);
                for k in
                    (1..i).map(|k| if k % 2 == 0 { i / 2 + k / 2 } else { i / 2 - k / 2 }).filter(|&k| k > 0 && k < i)
                {
                    let c = cost[l][k] + cost[r][i - k];
                    if c < best.0 {
                        best = (c, k as u8);
                    }
                }
                best
            };
            let shares: [(f32, u8); 9] = std::array::from_fn(share);
            let inner = shares[8].0 + area;
            let leaf = if count[index] <= per_leaf { area * leaf_cost(count[index]) } else { f32::INFINITY };
            (cost[index][1], plan.split[index][1]) = if leaf <= inner { (leaf, 0) } else { (inner, shares[8].1) };
            for i in 2..8 {
                (cost[index][i], plan.split[index][i]) =
                    if shares[i].0 < cost[index][i - 1] { shares[i] } else { (cost[index][i - 1], 0) };
            }
        }
        plan
    }

    /// The roots that stand for `index` when it may have `i`; i = 8: the children of the inner node made of it.
    fn forest(&self, index: u32, i: usize, roots: &mut Vec<u32>) {
        let split = self.split[index as usize];
        let mut i = i;
        let left = if i == 8 {
            split[1]
        } else {
            while i > 1 && split[i] == 0 {
                i -= 1;
            }
            if i == 1 { 0 } else { split[i] }
        };
        if left == 0 {
            roots.push(index);
            return;
        }
        let first = self.binary.nodes[index as usize].first_index;
        self.forest(first, left.into(), roots);
        self.forest(first + 1, i - usize::from(left), roots);
    }

    /// All primitives under `index`.
    fn primitives(&self, index: u32) -> Vec<u32> {
        let (mut todo, mut out) = (vec![index], Vec::new());
        while let Some(index) = todo.pop() {
            let node = &self.binary.nodes[index as usize];
            if node.is_leaf() {
                out.push(self.binary.primitive_indices[node.first_index as usize]);
            } else {
                todo.extend([node.first_index, node.first_index + 1]);
            }
        }
        out
    }
}

/// Largest supported coordinate: products of three differences of coordinates stay finite in f32.
const LIMIT: f32 = 1e15;

/// Whether all coordinates are finite and within the limit.
pub(super) fn traceable(b: &Bounds) -> bool {
    let ok = |v: Vec3| v.is_finite() && v.abs().max_element() <= LIMIT;
    ok(b.lo) && ok(b.hi)
}
