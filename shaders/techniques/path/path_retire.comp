#version 460
// Waves that stay full: what paths that have ended have gathered goes from their slots to their samples' places among the results, which keep it until all samples
// before it have ended. Its set 0 has the turnover's lists in place of the wave's.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool WRITE_AOVS = true;

#include "techniques/path/path_slots.glsl"
#include "walk/turnover.glsl"
#include "walk/wave.glsl"

// By sample, over and over.
layout(set = 2, binding = 0, scalar) restrict writeonly buffer PathResults { GatheredLight path_results[]; };
layout(set = 2, binding = 1, scalar) restrict writeonly buffer PathResultAovs { PathAov path_result_aovs[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= status.waiting_count) {
        return;
    }
    uint slot = texelFetch(walk_waiting_queue_in, int(index)).x;
    uint result = texelFetch(walk_numbers_in, int(slot)).w;
    path_results[result] = walk_gathered[slot];
    if (WRITE_AOVS) {
        path_result_aovs[result] = path_aovs[slot];
    }
    walk_flags_out[slot] = SLOT_FREE;
}
