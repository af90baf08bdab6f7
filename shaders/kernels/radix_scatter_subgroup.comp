#version 460
// Radix sort, third stage of a digit: each workgroup ranks the keys of a tile and writes them to the places of their digits, tile after tile.
// A subgroup finds the lanes with equal digits by one ballot a bit, so ranks keep the order (Adinets and Merrill, Onesweep, 2022, section
// 4.4, after Ashkiani and others, GPU multisplit, 2016).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_subgroup.glsl"
#include "kernels/wrapping_sum.glsl"

layout(constant_id = 5) const uint KEYS_PER_INVOCATION = 8u;
layout(constant_id = 6) const uint MAX_SUBGROUPS = 16u;

// The next place of each digit.
shared uint places[BINS];
// By subgroup: how many of each digit it has; then, how many the subgroups before it have.
shared uint subgroup_counts[MAX_SUBGROUPS * BINS];

// The live lanes whose digit is this lane's.
uvec4 lanes_with_digit(uint digit, bool live) {
    uvec4 lanes = subgroupBallot(live);
    for (uint bit = 1u; bit < BINS; bit <<= 1u) {
        bool is_set = (digit & bit) != 0u;
        uvec4 with_bit = subgroupBallot(is_set);
        lanes &= is_set ? with_bit : ~with_bit;
    }
    return lanes;
}

void first_places(uint team) {
    uint each = (BINS + LANES - 1u) / LANES;
    uint first = min(gl_LocalInvocationID.x * each, BINS);
    uint last = min(first + each, BINS);
    uint own = 0u;
    for (uint digit = first; digit < last; ++digit) {
        own += scratch[total_at(digit)];
    }
    uint total;
    uint before = team_exclusive(own, total);
    for (uint digit = first; digit < last; ++digit) {
        places[digit] = before + scratch[count_at(digit, team)];
        before += scratch[total_at(digit)];
    }
}

void main() {
    uint team = gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationID.x;
    uint count = stream_size(push.plan);
    uvec2 range = stream_range(team, count, stream_block(count, push.plan.tile, push.plan.max_teams));
    first_places(team);
    // Subgroups are full: the host asks for that.
    uint width = LANES / gl_NumSubgroups;
    uint row = gl_SubgroupID * BINS;
    for (uint tile = range.x; tile < range.y; tile += LANES * KEYS_PER_INVOCATION) {
        for (uint i = lane; i < MAX_SUBGROUPS * BINS; i += LANES) {
            subgroup_counts[i] = 0u;
        }
        barrier();
        uint first = tile + gl_SubgroupID * width * KEYS_PER_INVOCATION + gl_SubgroupInvocationID;
        uvec2 keys[KEYS_PER_INVOCATION];
        uint ranks[KEYS_PER_INVOCATION];
        for (uint i = 0u; i < KEYS_PER_INVOCATION; ++i) {
            uint at = first + i * width;
            bool live = at < range.y;
            keys[i] = live ? load_key(at) : uvec2(0u);
            uint digit = radix_digit(keys[i].x, keys[i].y);
            uvec4 lanes = lanes_with_digit(digit, live);
            uint rank = subgroupBallotExclusiveBitCount(lanes);
            uint earlier = subgroup_counts[row + digit];
            subgroupMemoryBarrierShared();
            subgroupBarrier();
            if (live && rank == 0u) {
                subgroup_counts[row + digit] = earlier + subgroupBallotBitCount(lanes);
            }
            subgroupMemoryBarrierShared();
            subgroupBarrier();
            ranks[i] = earlier + rank;
        }
        barrier();
        for (uint digit = lane; digit < BINS; digit += LANES) {
            uint next = places[digit];
            for (uint other = 0u; other < gl_NumSubgroups; ++other) {
                uint own = subgroup_counts[other * BINS + digit];
                subgroup_counts[other * BINS + digit] = next;
                next += own;
            }
            places[digit] = next;
        }
        barrier();
        for (uint i = 0u; i < KEYS_PER_INVOCATION; ++i) {
            uint at = first + i * width;
            if (at < range.y) {
                uint target = subgroup_counts[row + radix_digit(keys[i].x, keys[i].y)] + ranks[i];
                radix_keys_to[KEY_WORDS * target] = keys[i].x;
                if (KEY_WORDS == 2u) {
                    radix_keys_to[2u * target + 1u] = keys[i].y;
                }
                if (HAS_VALUES) {
                    radix_values_to[target] = radix_values_from[at];
                }
            }
        }
        barrier();
    }
}
