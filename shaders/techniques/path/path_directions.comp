#version 460
// Wavefront path tracer, first stage of pictures in all directions: paths along the middles of an octahedron's texels, one slot each (slot = texel × samples +
// sample). Each begins in front of what its texel is known to show, so that what stands between is not seen; or behind it, and goes back.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/octahedron.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    WalkKey key;
    vec3 place;
    uint side;  // texels across and down
    uint slot_count;
    uint interior;  // material of the body that the place is inside of, or OUTSIDE
} push;

// How far from the place the paths of a texel begin; below 0 so far, and towards the place.
layout(set = 1, binding = 0, scalar) restrict readonly buffer Starts { float path_starts[]; };

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slot_count) {
        return;
    }
    uint texel = push.key.first_sequence + slot / push.key.indices;
    vec2 at = (2.0 * vec2(texel % push.side, texel / push.side) + 1.0) / float(push.side) - 1.0;
    float start = path_starts[texel];
    vec3 direction = octahedron_decode(at);
    vec3 way = start < 0.0 ? -direction : direction;
    walk_states_out[slot] = WalkState(push.place + abs(start) * direction, 1.0, way, 0u, vec3(1.0), 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), push.interior);
}
