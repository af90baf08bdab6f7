// What kernels of bidirectional paths share: the vertices that walks from the lights leave, the partial weights of subpaths under way, and the picture of what
// light subpaths show the camera.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_SET_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_SET_GLSL

#extension GL_EXT_samplerless_texture_functions : require

#include "techniques/bidirectional/bdpt_mis.glsl"
#include "wide_counter.glsl"

// descriptor set 3: BidirectionalSet

// Ways in which a path is made: the eye path meets the lamp; it samples one; it is joined to a light subpath; a light subpath meets the camera.
const uint STRATEGY_COMBINED = 0u;  // all, weighted
const uint STRATEGY_EMISSION = 1u;  // and each alone, where all that it finds counts in full
const uint STRATEGY_LIGHT_SAMPLES = 2u;
const uint STRATEGY_CONNECTIONS = 3u;
const uint STRATEGY_SPLATS = 4u;

layout(constant_id = 50) const uint STRATEGY = STRATEGY_COMBINED;
layout(constant_id = 51) const bool PARALLEL_CAMERA = false;  // orthographic

// Quarters of a vertex (bdpt_vertex.glsl).
const uint LIGHT_VERTEX_QUARTERS = 3u;

// Stand for the pixel of a vertex that shows the camera nothing, and of one whose shadow ray goes on.
const uint SPLAT_NONE = 0xFFFFFFFFu;
const uint SPLAT_STOPPED = 0xFFFFFFFEu;

struct LightSplat {
    uvec3 words;  // bits of its radiance; where its ray has stopped the first is where that goes on
    uint pixel;   // behind those of the groups before
};

// Sums of a pixel in steps of splat_step, 64 bits a band, low word first.
struct SplatSum {
    uint words[6];
};

// Where the connections of a place go on.
struct ConnectionState {
    vec3 sum;
    uint next;    // connection
    uint cursor;  // of its shadow ray
};

layout(set = 3, binding = 0) uniform utextureBuffer light_vertex_texels;
layout(set = 3, binding = 1, scalar) restrict writeonly buffer LightVertices { uvec4 light_vertices[]; };
layout(set = 3, binding = 2, scalar) restrict buffer SubpathWeights { PartialWeights subpath_weights[]; };          // by slot
layout(set = 3, binding = 3, scalar) restrict buffer ConnectionStates { ConnectionState connection_states[]; };     // by place
layout(set = 3, binding = 4, scalar) restrict buffer BidirectionalCounters {
    uint remaining;        // places or vertices of a sweep whose shadow rays go on
    uint greatest_splat;   // bits of the greatest band of a splat
    uint connections[2];   // 64 bits, low word first: pairs of vertices
    uint in_view[2];       // vertices that the camera might see
    uint shadow_rays[2];   // those that might bring light
} bdpt_counters;
layout(set = 3, binding = 5, scalar) restrict buffer LightSplats { LightSplat light_splats[]; };  // by vertex
layout(set = 3, binding = 6, scalar) restrict buffer SplatSums { SplatSum splat_sums[]; };        // by group, then pixel
// Of path sets that are more than a range of bounces: successors of each state, and behind these the states in which light counts, a bit each (transport/path_set.glsl). Elsewhere some
// other buffer is bound, and nothing is read.
layout(set = 3, binding = 7, scalar) restrict readonly buffer BidirectionalStates { uint bdpt_states[]; };

// Bits of the greatest splat in steps: with 2^22 splats a pixel's sum stays within 64 bits.
const int SPLAT_BITS = 40;
const uint FLOAT_EXPONENT_SHIFT = 23u;

// A power of two, below the greatest splat by SPLAT_BITS bits, that no device flushes to zero.
float splat_step(uint greatest) {
    int exponent = max(int(greatest >> FLOAT_EXPONENT_SHIFT) + 1 - SPLAT_BITS, 1);
    return uintBitsToFloat(uint(exponent) << FLOAT_EXPONENT_SHIFT);
}

#endif
