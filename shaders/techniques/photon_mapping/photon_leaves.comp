#version 460
// Last stage of a map: the records in the order of its leaves, with the mark of a leaf's end.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "techniques/photon_mapping/kernel.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform utextureBuffer photon_records_in;
// Four words per texel.
layout(set = 0, binding = 1) uniform utextureBuffer map_order;
// Not 0 for places at which a node is split: a leaf ends there.
layout(set = 0, binding = 2) uniform utextureBuffer map_retained;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer PhotonMapRecords { uvec4 photon_records_out[]; };

layout(push_constant, scalar) uniform PhotonLeavesPush { uint count; } photon_push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= photon_push.count) {
        return;
    }
    uint from = PHOTON_QUARTERS * texelFetch(map_order, int(place >> 2))[place & 3u];
    bool ends = place + 1u == photon_push.count || texelFetch(map_retained, int(place)).x != 0u;
    uvec4 first = texelFetch(photon_records_in, int(from));
    first.w |= ends ? PHOTON_LEAF_END : 0u;
    uint to = PHOTON_QUARTERS * place;
    photon_records_out[to] = first;
    for (uint i = 1u; i < PHOTON_QUARTERS; ++i) {
        photon_records_out[to + i] = texelFetch(photon_records_in, int(from + i));
    }
}
