#version 460
// The deposits of a bounce go to the ends of the maps' records, those of surfaces and those of media to their own, in the order of the queue.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_volume.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;           // record of the wave's first deposit on a surface
    uint capacity;        // records
    uint first_event;     // of its first one in a medium
    uint event_capacity;
} push;

// A way becomes beams, each with what is left of its flux where it begins.
void append_way(uint place, uint event, uint pieces) {
    for (uint i = 0u; i < pieces && event + i < push.event_capacity; ++i) {
        PhotonWay way = photon_ways[place];
        float from = way.reach * (float(i) / float(pieces));
        float to = way.reach * (float(i + 1u) / float(pieces));
        uvec4 q0;
        uvec4 q1;
        pack_beam(PhotonBeam(way.start + from * way.direction, way.start + to * way.direction, way.flux * exp(-way.sigma_t * from), way.medium, way.bounce),
                  q0, q1);
        uint quarter = volume_quarters() * (event + i);
        photon_volume_records[quarter] = q0;
        photon_volume_records[quarter + 1u] = q1;
        if (STORES_BESIDE) {
            photon_volume_records[quarter + 2u] = STORES_POINTS ? pack_flight(from, way.light2, 0u) : pack_beside_planes(way.light2);
        }
    }
}

bool has_beside(uint place) {
    return STORES_BESIDE && (texelFetch(walk_flags_in, int(place / FLAGS_PER_TEXEL))[place % FLAGS_PER_TEXEL] & FLAG_BESIDE) != 0u;
}

// What waits beside a way.
void append_beside(uint place, uint event) {
    for (uint i = 0u; event < push.event_capacity && i < WIDE_QUARTERS; ++i) {
        photon_volume_records[WIDE_QUARTERS * event + i] = photon_beside[WIDE_QUARTERS * place + i];
    }
}

void main() {
    uint waiting = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || waiting >= status.waiting_count) {
        return;
    }
    uint before = photon_volume_queue.before;
    uint rank = photon_volume_ranks[waiting];
    uint in_medium = photon_volume_flags[waiting];
    if (waiting + 1u == status.waiting_count) {
        photon_volume_queue.in_bounce = rank + in_medium;
    }
    uint place = texelFetch(walk_waiting_queue_in, int(waiting)).x;
    uint source = WAITING_QUARTERS * place;
    uint event = push.first_event + before + rank;
    if (STORES_WAYS) {
        uint beside = has_beside(place) ? 1u : 0u;
        append_way(place, event, in_medium - beside);
        if (beside != 0u) {
            append_beside(place, event + in_medium - beside);
        }
        // Ranks of surfaces go over the wave's earlier bounces as those of media do.
        uint landed = photon_landed_flags[waiting];
        uint landed_rank = photon_landed_ranks[waiting];
        if (waiting + 1u == status.waiting_count) {
            photon_volume_queue.landed_in_bounce = landed_rank + landed;
        }
        uint record = push.first + photon_volume_queue.landed_before + landed_rank;
        for (uint i = 0u; landed != 0u && record < push.capacity && i < PHOTON_QUARTERS; ++i) {
            photon_records[PHOTON_QUARTERS * record + i] = texelFetch(walk_waiting_in, int(source + i));
        }
        return;
    }
    if (in_medium != 0u) {
        for (uint i = 0u; event < push.event_capacity && i < EVENT_QUARTERS; ++i) {
            photon_volume_records[EVENT_QUARTERS * event + i] = texelFetch(walk_waiting_in, int(source + i));
        }
        return;
    }
    // The scan has counted this bounce already.
    uint record = push.first + (status.waited[0] - status.waiting_count) - before + (waiting - rank);
    for (uint i = 0u; record < push.capacity && i < PHOTON_QUARTERS; ++i) {
        photon_records[PHOTON_QUARTERS * record + i] = texelFetch(walk_waiting_in, int(source + i));
    }
}
