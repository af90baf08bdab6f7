// Ray queries on compact sibling pairs: what each visits and reads.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define COMPACT_RAY
#include "compact_query.glsl"

void main() {
    uint query = gl_GlobalInvocationID.x;
    if (query < compact_push.count) {
        compact_finish(query, compact_ray_query(compact_push.root, compact_queries[query]));
    }
}
