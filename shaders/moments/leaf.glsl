// Twin of Moments::push in src/moments/mod.rs, in f32, for one block of 64 samples.
#ifndef MOMENTS_LEAF
#define MOMENTS_LEAF

#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require

struct Leaf {
    float mean;
    float m2;
    float m3;
    float m4;
    float min;
    float max;
    // Lowest byte: samples that count; next: those of them that are 0; high half: samples that do not count.
    uint counts;
    // Index of the largest sample within the block.
    uint argmax;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Leaves { Leaf at[]; };

Leaf leaf_new() {
    return Leaf(0.0, 0.0, 0.0, 0.0, uintBitsToFloat(0x7F800000u), uintBitsToFloat(0xFF800000u), 0u, 0u);
}

// False: the sample is not finite and was only counted.
bool leaf_push(inout Leaf leaf, float x, uint index) {
    if ((floatBitsToUint(x) & 0x7F800000u) == 0x7F800000u) {
        leaf.counts += 0x10000u;
        return false;
    }
    float before = float(leaf.counts & 0xFFu);
    leaf.counts += x == 0.0 ? 0x101u : 1u;
    float n = before + 1.0;
    float delta = x - leaf.mean;
    float dn = delta / n;
    float dn2 = dn * dn;
    float t = delta * dn * before;
    leaf.mean += dn;
    leaf.m4 += t * dn2 * (n * n - 3.0 * n + 3.0) + 6.0 * dn2 * leaf.m2 - 4.0 * dn * leaf.m3;
    leaf.m3 += t * dn * (n - 2.0) - 3.0 * dn * leaf.m2;
    leaf.m2 += t;
    leaf.min = x < leaf.min ? x : leaf.min;
    if (x > leaf.max) {
        leaf.max = x;
        leaf.argmax = index;
    }
    return true;
}
#endif
