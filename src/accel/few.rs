//! Few triangles against a packet of rays at once: each shared vertex is sheared once for all rays, every triangle is tested
//! without a branch, and only the crossed ones are looked at again. For scenes that fit into the cache next to their rays
//! this beats a tree, whose branches are unpredictable for scattered rays. Same arithmetic, same bits as [`super::bvh`].

use super::simd::Simd;
use super::slab::{Bounds, WideSlabs};
use super::triangle::{Crossing, REACH, Shear, WideShear, bounds, decide, distance, edge, settle_ends, within};
use super::{Hits, NO_PRIMITIVE, Rays};
use crate::math::lanes::set_bits;
use crate::math::{LANES, Vec3};
use std::collections::HashMap;
use std::mem::MaybeUninit;

/// Most triangles.
const FEW: usize = 64;

/// Room for all vertices that a byte can name: no index is out of bounds.
const VERTICES: usize = 256;

/// All triangles of a small scene.
pub(super) struct Few {
    /// Distinct positions, x y z 0.
    vertices: Vec<[f32; 4]>,
    /// By primitive index.
    triangles: Vec<FewTriangle>,
    pairs: Vec<Pair>,
    bounds: Bounds,
}

struct FewTriangle {
    /// Indices into [`Few::vertices`].
    corners: [u8; 3],
    bounds: Bounds,
    positions: [Vec3; 3],
}

/// Two triangles (0, 1, 2) and (0, 2, 3) with an edge in common, neighbours in the scene's order; or one alone.
struct Pair {
    /// Indices into [`Few::vertices`].
    corners: [u8; 4],
    /// Primitive index of the first.
    first: u8,
    /// All lanes, or none where there is no second.
    second: u32,
}

/// Sheared vertices of all triangles for a packet of rays.
type Sheared<S> = [MaybeUninit<[<S as Simd<LANES>>::F; 3]>; VERTICES];

/// Per-ray constants of a packet.
struct PacketRays<S: Simd<LANES>> {
    axes: [S::I; 3],
    shear: WideShear<S, LANES>,
    reach: S::F,
    t_max: S::F,
    /// Triangles that rays start and end on, as numbers.
    ends: [S::F; 2],
}

impl<S: Simd<LANES>> PacketRays<S> {
    #[inline(always)]
    fn new(s: S, rays: &Rays) -> Self {
        let mut axes = [[0; LANES]; 3];
        let mut origin = [[0.0; LANES]; 3];
        let mut shear = [[0.0; LANES]; 3];
        let mut ends = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            ends[0][lane] = rays.from[lane] as f32;
            ends[1][lane] = rays.to[lane] as f32;
            let one = Shear::new(&rays.get(lane));
            for a in 0..3 {
                axes[a][lane] = one.axes[a];
                origin[a][lane] = one.origin[a];
                shear[a][lane] = one.shear[a];
            }
        }
        Self {
            axes: [s.indices(&axes[0]), s.indices(&axes[1]), s.indices(&axes[2])],
            shear: WideShear {
                origin: [s.load(&origin[0]), s.load(&origin[1]), s.load(&origin[2])],
                shear: [s.load(&shear[0]), s.load(&shear[1]), s.load(&shear[2])],
            },
            reach: s.mul(s.load(&rays.t_max), s.splat(REACH)),
            t_max: s.load(&rays.t_max),
            ends: [s.load(&ends[0]), s.load(&ends[1])],
        }
    }

    /// Lanes whose ray starts or ends on a triangle.
    #[inline(always)]
    fn ends_on(&self, s: S, triangle: u8) -> u32 {
        let triangle = s.splat(f32::from(triangle));
        s.eq(self.ends[0], triangle) | s.eq(self.ends[1], triangle)
    }
}

/// Crossed triangles: index and lanes. One entry more than triangles is written, beyond the end.
struct List {
    entries: [MaybeUninit<(u8, u16)>; FEW + 1],
    len: usize,
}

impl List {
    const EMPTY: Self = Self { entries: [MaybeUninit::uninit(); FEW + 1], len: 0 };

    /// Written in any case, counted where something is crossed: no branch.
    #[inline(always)]
    fn push(&mut self, triangle: u8, lanes: u32) {
        self.entries[self.len].write((triangle, lanes as u16));
        self.len += usize::from(lanes != 0);
    }

    #[inline(always)]
    fn get(&self) -> &[(u8, u16)] {
        let written: *const [MaybeUninit<_>] = &self.entries[..self.len];
        // SAFETY: `push` writes before it counts.
        unsafe { &*(written as *const [(u8, u16)]) }
    }
}

impl Few {
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.triangles[..]) + size_of_val(&self.pairs[..])
    }

    /// `None` where there are too many triangles, or none.
    pub(super) fn new(triangles: &[[Vec3; 3]]) -> Option<Self> {
        if triangles.is_empty() || triangles.len() > FEW {
            return None;
        }
        let mut vertices = Vec::new();
        let mut index = HashMap::new();
        let items = triangles.iter().map(|t| {
            let corners = t.map(|p| {
                *index.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                    vertices.push([p.x, p.y, p.z, 0.0]);
                    (vertices.len() - 1) as u8
                })
            });
            FewTriangle { corners, bounds: bounds(t), positions: *t }
        });
        let triangles: Vec<_> = items.collect();
        let bounds = triangles.iter().map(|t| t.bounds).reduce(Bounds::union)?;
        (vertices.len() <= VERTICES).then_some(Self { pairs: pairs(&triangles), vertices, triangles, bounds })
    }

    /// The nearest hits; lanes that are not `live` may hold anything.
    #[inline(always)]
    pub(super) fn closest<S: Simd<LANES>>(&self, s: S, rays: &Rays, live: u32) -> Hits {
        let packet = PacketRays::new(s, rays);
        let slabs = WideSlabs::of_rays(s, rays, &self.bounds);
        let mut sheared = [const { MaybeUninit::uninit() }; VERTICES];
        let mut list = List::EMPTY;
        self.crossed(s, &packet, live, &mut sheared, &mut list);
        let mut best = s.load(&last(rays));
        let (mut found, mut which) = (0, s.splat(0.0));
        let (mut u, mut v) = (which, which);
        for &(index, lanes) in list.get() {
            let triangle = &self.triangles[usize::from(index)];
            let p = corners::<S>(triangle, &sheared);
            let mut crossing = Crossing::new(s, &p);
            crossing.settle(s, &p);
            let (near, far) = slabs.one_box(s, &triangle.bounds);
            let mut lanes = u32::from(lanes)
                & crossing.lanes
                & within(s, &p, packet.reach)
                & s.le(near, far)
                & !packet.ends_on(s, index);
            let mut t = distance(s, &crossing.weight, &p, near, far);
            let doubtful = lanes & (s.le(near, s.splat(0.0)) | s.le(packet.t_max, far));
            if doubtful != 0 {
                (lanes, t) = settle_ends(s, lanes, doubtful, t, [near, far], |lane, rough| {
                    decide(&rays.get(lane), triangle.positions, rough)
                });
            }
            // Of equal distances the first in the scene's order stays.
            lanes &= s.le(t, best) & !(found & s.eq(t, best));
            let [b, c] = crossing.barycentric(s);
            (best, which) = (s.select(lanes, t, best), s.select(lanes, s.splat(f32::from(index)), which));
            (u, v) = (s.select(lanes, b, u), s.select(lanes, c, v));
            found |= lanes;
        }
        let which = s.store(which);
        let mut primitive = [NO_PRIMITIVE; LANES];
        for lane in set_bits(found) {
            primitive[lane] = which[lane] as u32;
        }
        Hits { t: s.store(best), primitive, u: s.store(u), v: s.store(v) }
    }

    /// `live` lanes whose segment meets anything.
    #[inline(always)]
    pub(super) fn occluded<S: Simd<LANES>>(&self, s: S, rays: &Rays, live: u32) -> u32 {
        let packet = PacketRays::new(s, rays);
        let mut sheared = [const { MaybeUninit::uninit() }; VERTICES];
        let mut list = List::EMPTY;
        self.crossed(s, &packet, live, &mut sheared, &mut list);
        if list.len == 0 {
            return 0;
        }
        let slabs = WideSlabs::of_rays(s, rays, &self.bounds);
        let end = s.load(&last(rays));
        let mut found = 0;
        for &(index, lanes) in list.get() {
            let lanes = u32::from(lanes) & !found & !packet.ends_on(s, index);
            if lanes == 0 {
                continue;
            }
            let triangle = &self.triangles[usize::from(index)];
            let p = corners::<S>(triangle, &sheared);
            let mut crossing = Crossing::new(s, &p);
            crossing.settle(s, &p);
            let (near, far) = slabs.one_box(s, &triangle.bounds);
            let lanes = lanes & crossing.lanes & within(s, &p, packet.reach) & s.le(near, far) & s.le(near, end);
            let doubtful = lanes & (s.le(near, s.splat(0.0)) | s.le(packet.t_max, far));
            found |= lanes & !doubtful;
            if doubtful != 0 {
                let t = distance(s, &crossing.weight, &p, near, far);
                found |= settle_ends(s, doubtful, doubtful, t, [near, far], |lane, rough| {
                    decide(&rays.get(lane), triangle.positions, rough)
                })
                .0;
            }
        }
        found
    }

    /// Triangles that the rays' lines cross, in the scene's order, few of them behind or beyond; and all sheared vertices.
    #[inline(always)]
    fn crossed<S: Simd<LANES>>(
        &self,
        s: S,
        rays: &PacketRays<S>,
        live: u32,
        sheared: &mut Sheared<S>,
        list: &mut List,
    ) {
        for (vertex, sheared) in self.vertices.iter().zip(sheared.iter_mut()) {
            let [x, y, z] = rays.axes;
            let turned = [s.look_up(vertex, x), s.look_up(vertex, y), s.look_up(vertex, z)];
            sheared.write(rays.shear.apply(s, turned));
        }
        let zero = s.splat(0.0);
        for pair in &self.pairs {
            // SAFETY: the loop above wrote all vertices, which these are indices of.
            let corner = |i: usize| unsafe { sheared[usize::from(pair.corners[i])].assume_init() };
            let p = [corner(0), corner(1), corner(2), corner(3)];
            let e = [edge(s, &p[0], &p[1]), edge(s, &p[1], &p[2]), edge(s, &p[2], &p[3]), edge(s, &p[3], &p[0])];
            let shared = edge(s, &p[2], &p[0]);
            // Signs alone matter, so that the order of the corners does not; the second triangle has the shared edge negated.
            let (low, high) = (s.min(e[0], e[1]), s.max(e[0], e[1]));
            let (up, down) = (s.le(zero, shared), s.le(shared, zero));
            let first = s.le(zero, low) & up | s.le(high, zero) & down;
            let (low, high) = (s.min(e[2], e[3]), s.max(e[2], e[3]));
            let second = s.le(zero, low) & down | s.le(high, zero) & up;
            let nearest = s.min(s.min(p[0][2], p[1][2]), s.min(p[2][2], p[3][2]));
            let farthest = s.max(s.max(p[0][2], p[1][2]), s.max(p[2][2], p[3][2]));
            let both = live & s.le(zero, farthest) & s.le(nearest, rays.reach);
            list.push(pair.first, first & both);
            list.push(pair.first.wrapping_add(1), second & both & pair.second);
        }
    }
}

/// Neighbours with two corners in common, else single triangles.
fn pairs(triangles: &[FewTriangle]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    let mut i = 0;
    while i < triangles.len() {
        let [a, b, c] = triangles[i].corners;
        let next = triangles.get(i + 1).map(|t| t.corners);
        let pair = next.and_then(|next| {
            let other = *next.iter().find(|v| !triangles[i].corners.contains(v))?;
            // Turned so that the corner which the next triangle lacks comes second.
            let turned = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|t| !next.contains(&t[1]))?;
            (next.contains(&turned[0]) && next.contains(&turned[2])).then_some([turned[0], turned[1], turned[2], other])
        });
        let (corners, second) = pair.map_or(([a, b, c, b], 0), |corners| (corners, u32::MAX));
        pairs.push(Pair { corners, first: i as u8, second });
        i += if second == 0 { 1 } else { 2 };
    }
    pairs
}

#[inline(always)]
fn corners<S: Simd<LANES>>(triangle: &FewTriangle, sheared: &Sheared<S>) -> [[S::F; 3]; 3] {
    // SAFETY: the vertices that corners name were written by `Few::crossed`, whose array this is.
    let corner = |v: usize| unsafe { sheared[usize::from(triangle.corners[v])].assume_init() };
    [corner(0), corner(1), corner(2)]
}

/// The largest distances inside the segments.
#[inline(always)]
fn last(rays: &Rays) -> [f32; LANES] {
    let mut last = rays.t_max;
    for t in &mut last {
        *t = t.next_down();
    }
    last
}
