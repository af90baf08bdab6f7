// The few greatest terms of a gather. Sources, bias and guarantees: maps/gather/mod.rs. Deterministic: of equal terms the first ones are kept.
#ifndef CLERESTORY_MAPS_GATHER_FEW_GLSL
#define CLERESTORY_MAPS_GATHER_FEW_GLSL

// How many terms are kept: GatherFew has a member for each.
const uint GATHER_FEW = 5u;

// Radiance and term of each, greatest first.
struct GatherFew {
    vec4 a;
    vec4 b;
    vec4 c;
    vec4 d;
    vec4 e;
};

GatherFew gather_no_terms() { return GatherFew(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)); }

// Takes the place of a lesser entry, which it becomes.
void gather_keep(inout vec4 kept, inout vec4 entry) {
    if (entry.w > kept.w) {
        vec4 lesser = kept;
        kept = entry;
        entry = lesser;
    }
}

// Adds radiance and its term, and leaves the least out.
void gather_add(inout GatherFew few, vec4 entry) {
    gather_keep(few.a, entry);
    gather_keep(few.b, entry);
    gather_keep(few.c, entry);
    gather_keep(few.d, entry);
    gather_keep(few.e, entry);
}

// Terms times radiance, and terms, in all.
vec4 gather_sum(GatherFew few) {
    vec3 sum = few.a.w * few.a.rgb + few.b.w * few.b.rgb + few.c.w * few.c.rgb + few.d.w * few.d.rgb + few.e.w * few.e.rgb;
    return vec4(sum, few.a.w + few.b.w + few.c.w + few.d.w + few.e.w);
}

#endif
