#version 460
// The queue of queries in blocks: each subgroup walks COMPACT_CHUNK places per lane, collects those that ask the photon map in shared memory and
// appends them to the list of blocks whenever less than a block of room is left; at its end the last block may be partial. No workgroup waits
// for another. What is in a block follows from the places alone, its number from who came first.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_asks.glsl"
#include "techniques/photon_mapping/photon_queue.glsl"

layout(push_constant, scalar) uniform Push { AskSettings ask; } push;

shared uint collected[QUEUE_BUFFER_BLOCKS * WALK_GROUP];

// Appends so many places from `first` on in blocks of `width`.
void append_blocks(uint first, uint places, uint width) {
    uint blocks = (places + width - 1u) / width;
    uint base = 0u;
    if (subgroupElect()) {
        base = atomicAdd(gather_head.count, blocks);
        atomicMax(gather_head.groups[0], ((base + blocks) * width + WALK_GROUP - 1u) / WALK_GROUP);
        gather_head.block_size = width;
        for (uint block = 0u; block < blocks; ++block) {
            gather_blocks[base + block] = min(places - block * width, width);
        }
    }
    base = subgroupBroadcastFirst(base);
    for (uint at = gl_SubgroupInvocationID; at < places; at += width) {
        gather_places[base * width + at] = collected[first + at];
    }
}

void main() {
    uint width = WALK_GROUP / gl_NumSubgroups;
    uint first = gl_SubgroupID * QUEUE_BUFFER_BLOCKS * width;
    uint begin = (gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID) * COMPACT_CHUNK * width;
    uint count = wave_has_arrived() ? status.active_count : 0u;
    uint held = 0u;
    for (uint tile = 0u; tile < COMPACT_CHUNK && begin + tile * width < count; ++tile) {
        uint place = begin + tile * width + gl_SubgroupInvocationID;
        bool asks = false;
        if (place < count) {
            Arrival arrival;
            asks = asks_map(push.ask, load_walk(load_slot(place)), place, arrival);
        }
        uvec4 asking = subgroupBallot(asks);
        if (asks) {
            collected[first + held + subgroupBallotExclusiveBitCount(asking)] = place;
        }
        held += subgroupBallotBitCount(asking);
        if (QUEUE_BUFFER_BLOCKS * width - held < width) {
            subgroupMemoryBarrierShared();
            subgroupBarrier();
            uint whole = held / width * width;
            append_blocks(first, whole, width);
            held -= whole;
            uint rest = NO_PLACE;
            if (gl_SubgroupInvocationID < held) {
                rest = collected[first + whole + gl_SubgroupInvocationID];
            }
            subgroupMemoryBarrierShared();
            subgroupBarrier();
            if (gl_SubgroupInvocationID < held) {
                collected[first + gl_SubgroupInvocationID] = rest;
            }
            subgroupMemoryBarrierShared();
            subgroupBarrier();
        }
    }
    if (held > 0u) {
        subgroupMemoryBarrierShared();
        subgroupBarrier();
        append_blocks(first, held, width);
    }
}
