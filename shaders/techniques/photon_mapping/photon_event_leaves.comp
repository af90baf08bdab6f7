#version 460
// Last stage of a volume map: the events in the order of its leaves, with the mark of a leaf's end.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "techniques/photon_mapping/photon_event.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform utextureBuffer event_records_in;
// Four words per texel.
layout(set = 0, binding = 1) uniform utextureBuffer map_order;
// Not 0 for places at which a node is split: a leaf ends there.
layout(set = 0, binding = 2) uniform utextureBuffer map_retained;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer EventMapRecords { uvec4 event_records_out[]; };

layout(constant_id = 0) const bool WIDE = false;  // records are of several kinds

layout(push_constant, scalar) uniform PhotonEventLeavesPush { uint count; } event_push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= event_push.count) {
        return;
    }
    uint quarters = WIDE ? WIDE_QUARTERS : EVENT_QUARTERS;
    uint from = quarters * texelFetch(map_order, int(place >> 2))[place & 3u];
    bool ends = place + 1u == event_push.count || texelFetch(map_retained, int(place)).x != 0u;
    uvec4 first = texelFetch(event_records_in, int(from));
    first.w |= ends ? EVENT_LEAF_END : 0u;
    event_records_out[quarters * place] = first;
    for (uint i = 1u; i < quarters; ++i) {
        event_records_out[quarters * place + i] = texelFetch(event_records_in, int(from + i));
    }
}
