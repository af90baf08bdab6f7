#version 460
// The queue of queries in blocks: teams, as many invocations as a block has places, walk COMPACT_CHUNK places each, collect those that ask a photon
// map in shared memory and append them to the list of blocks whenever less than a block of room is left; at its end the last block of a team may be
// partial. No workgroup waits for another. What is in a block follows from the places that ask, its number from who came first; which places ask of a
// wave whose work is used up may differ.
//
// Teams are as wide as subgroups, but exchange data by shared memory and barriers, which the whole workgroup reaches: whether a place asks is known
// only after divergent branches, and SPIR-V does not promise that a subgroup has reconverged behind them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_queue.glsl"
#include "techniques/photon_mapping/photon_queue_asks.glsl"

layout(constant_id = 47) const uint QUEUE_WIDTH = 32u;  // places of a block, lanes of a team: a divisor of WALK_GROUP

layout(push_constant, scalar) uniform Push { AskSettings ask; } push;

const uint QUEUE_CAPACITY = QUEUE_BUFFER_BLOCKS * QUEUE_WIDTH;

// By invocation: 1 where its place asks.
shared uint asking[WALK_GROUP];
// By team: places in a ring that have not been appended.
shared uint collected[QUEUE_BUFFER_BLOCKS * WALK_GROUP];
// By team: the number of the block that it appends first.
shared uint first_blocks[WALK_GROUP];

uint collected_at(uint team, uint index) { return team * QUEUE_CAPACITY + index % QUEUE_CAPACITY; }

// Takes blocks for so many places; the number of the first.
uint take_blocks(uint places) {
    uint blocks = (places + QUEUE_WIDTH - 1u) / QUEUE_WIDTH;
    uint first = atomicAdd(gather_head.count, blocks);
    atomicMax(gather_head.groups[0], ((first + blocks) * QUEUE_WIDTH + WALK_GROUP - 1u) / WALK_GROUP);
    gather_head.block_size = QUEUE_WIDTH;
    for (uint block = 0u; block < blocks; ++block) {
        gather_blocks[first + block] = min(places - block * QUEUE_WIDTH, QUEUE_WIDTH);
    }
    return first;
}

void main() {
    uint team = gl_LocalInvocationID.x / QUEUE_WIDTH;
    uint lane = gl_LocalInvocationID.x % QUEUE_WIDTH;
    uint group_begin = gl_WorkGroupID.x * COMPACT_CHUNK * WALK_GROUP;
    uint team_begin = group_begin + team * COMPACT_CHUNK * QUEUE_WIDTH;
    uint count = wave_has_arrived() ? status.active_count : 0u;
    // Of the first team, which has the most: all teams meet the same barriers.
    uint tiles = count > group_begin ? min((count - group_begin + QUEUE_WIDTH - 1u) / QUEUE_WIDTH, COMPACT_CHUNK) : 0u;
    uint start = 0u;
    uint held = 0u;
    for (uint tile = 0u; tile < tiles; ++tile) {
        uint place = team_begin + tile * QUEUE_WIDTH + lane;
        bool asks = place < count && asks_at(push.ask, place);
        asking[gl_LocalInvocationID.x] = asks ? 1u : 0u;
        barrier();
        uint before = 0u;
        uint all = 0u;
        for (uint other = 0u; other < QUEUE_WIDTH; ++other) {
            uint one = asking[team * QUEUE_WIDTH + other];
            before += other < lane ? one : 0u;
            all += one;
        }
        if (asks) {
            collected[collected_at(team, start + held + before)] = place;
        }
        held += all;
        uint ready = 0u;
        if (tile + 1u == tiles) {
            ready = held;
        } else if (QUEUE_CAPACITY - held < QUEUE_WIDTH) {
            ready = held / QUEUE_WIDTH * QUEUE_WIDTH;
        }
        if (ready > 0u && lane == 0u) {
            first_blocks[team] = take_blocks(ready);
        }
        barrier();
        for (uint at = lane; at < ready; at += QUEUE_WIDTH) {
            gather_places[first_blocks[team] * QUEUE_WIDTH + at] = collected[collected_at(team, start + at)];
        }
        start = (start + ready) % QUEUE_CAPACITY;
        held -= ready;
    }
}
