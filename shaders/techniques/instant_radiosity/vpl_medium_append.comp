#version 460
// The deposits of a bounce become virtual lights behind those that are there, as in vpl_append.comp, in scenes with media: on surfaces, and at collisions. In the order of the
// queue: the same order on every run.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"
#include "techniques/instant_radiosity/collision_light.glsl"
#include "techniques/instant_radiosity/new_virtual_light.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint first;     // record of the wave's first deposit
    vec3 scene_upper;
    uint capacity;  // records
} push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.waiting_count) {
        return;
    }
    // The scan has counted this bounce already.
    uint record = push.first + (status.waited[0] - status.waiting_count) + place;
    if (record >= push.capacity) {
        return;
    }
    int source = int(WAITING_QUARTERS * texelFetch(walk_waiting_queue_in, int(place)).x);
    uvec4 where = texelFetch(walk_waiting_in, source);
    uvec4 brought = texelFetch(walk_waiting_in, source + 1);
    vec3 power = uintBitsToFloat(brought.xyz);
    vec3 direction = uintBitsToFloat(texelFetch(walk_waiting_in, source + 2).xyz);
    uvec4 quarters[VIRTUAL_LIGHT_QUARTERS];
    // One more than the medium's index; of those on surfaces zero.
    if (brought.w != 0u) {
        pack_collision_light(uintBitsToFloat(where.xyz), power, direction, brought.w - 1u, where.w, quarters);
    } else {
        vec2 barycentrics = uintBitsToFloat(where.xy);
        Arrival a = arrival_at(Hit(0.0, barycentrics, where.z), direction, push.scene_lower, push.scene_upper);
        pack_virtual_light(new_virtual_light(a, where.z, barycentrics, power, direction, where.w), quarters);
    }
    for (uint i = 0u; i < VIRTUAL_LIGHT_QUARTERS; ++i) {
        photon_records[VIRTUAL_LIGHT_QUARTERS * record + i] = quarters[i];
    }
}
