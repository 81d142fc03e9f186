// Twin of src/moments/mod.rs: f64 moments and their merging.
#ifndef MOMENTS_MOMENTS
#define MOMENTS_MOMENTS

#include "moments/leaf.glsl"

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_float64 : require

struct Moments {
    uint64_t n;
    double mean;
    double m2;
    double m3;
    double m4;
    double min;
    double max;
    uint64_t argmax;
    uint64_t non_finite;
    uint64_t zeros;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer MomentsAt { Moments at[]; };

// `first`: index of the block's first sample.
Moments moments_of(Leaf leaf, uint64_t first) {
    uint n = leaf.counts & 0xFFu;
    return Moments(uint64_t(n), double(leaf.mean), double(leaf.m2), double(leaf.m3), double(leaf.m4), double(leaf.min),
        double(leaf.max), n > 0u ? first + uint64_t(leaf.argmax) : uint64_t(0), uint64_t(leaf.counts >> 16),
        uint64_t(leaf.counts >> 8 & 0xFFu));
}

// The inverse, exact for what moments_of gave.
Leaf leaf_of(Moments m, uint64_t first) {
    return Leaf(float(m.mean), float(m.m2), float(m.m3), float(m.m4), float(m.min), float(m.max),
        uint(m.n) | uint(m.zeros) << 8 | uint(m.non_finite) << 16, m.n > 0 ? uint(m.argmax - first) : 0u);
}

Moments moments_merge(Moments self, Moments later) {
    uint64_t non_finite = self.non_finite + later.non_finite;
    if (later.n == 0) {
        self.non_finite = non_finite;
        return self;
    }
    if (self.n == 0) {
        later.non_finite = non_finite;
        return later;
    }
    double na = double(self.n), nb = double(later.n);
    double n = na + nb;
    double fa = na / n, fb = nb / n;
    double d = later.mean - self.mean;
    double d2 = d * d;
    Moments all;
    all.n = self.n + later.n;
    all.mean = self.mean + d * fb;
    all.m2 = self.m2 + later.m2 + d2 * na * fb;
    all.m3 = self.m3 + later.m3 + d * d2 * na * fb * (fa - fb) + 3.0lf * d * (fa * later.m2 - fb * self.m2);
    all.m4 = self.m4 + later.m4 + d2 * d2 * na * fb * (fa * fa - fa * fb + fb * fb)
        + 6.0lf * d2 * (fa * fa * later.m2 + fb * fb * self.m2) + 4.0lf * d * (fa * later.m3 - fb * self.m3);
    bool later_max = later.max > self.max;
    all.min = later.min < self.min ? later.min : self.min;
    all.max = later_max ? later.max : self.max;
    all.argmax = later_max ? later.argmax : self.argmax;
    all.non_finite = non_finite;
    all.zeros = self.zeros + later.zeros;
    return all;
}
#endif
