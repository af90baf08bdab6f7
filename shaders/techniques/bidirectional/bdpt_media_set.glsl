// What kernels of bidirectional paths have besides in scenes with media.
//
// Expects nothing of scene/media_bindings.glsl, whose buffers stand here, since set 3 is that of bdpt_set.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_MEDIA_SET_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_MEDIA_SET_GLSL

#extension GL_EXT_samplerless_texture_functions : require

#include "walk/medium_ray_state.glsl"

// descriptor set 3 from binding 8: BidirectionalMediaSet

// How a path's flight has ended where it is joined.
struct FlightEnd {
    vec3 weight;    // of the throughput
    float t;        // of a collision, along the ray
    uint medium;    // of a collision, or NO_MEDIUM at a surface
    uint interior;  // body that the way was in, or OUTSIDE
};

// Where the connections of a place go on.
struct MediumConnectionState {
    vec3 sum;
    uint next;         // connection
    uint begun;        // 1 where its ray is under way
    MediumRay ray;
    FlightEnd flight;  // that it does not repeat
};

layout(set = 3, binding = 8) uniform utextureBuffer media_records;
layout(set = 3, binding = 9) uniform textureBuffer media_densities;  // of all grids, x fastest
layout(set = 3, binding = 10) uniform textureBuffer media_majorants;  // greatest densities of blocks of cells
layout(set = 3, binding = 11, scalar) restrict buffer MediumConnectionStates { MediumConnectionState medium_connection_states[]; };  // by place
layout(set = 3, binding = 12, scalar) restrict buffer MediumSplatRays { MediumRay medium_splat_rays[]; };  // by vertex of a dispatch
#define CLERESTORY_MEDIA_BOUND

#include "scene/media.glsl"

#endif
