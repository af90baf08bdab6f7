// Working memory of the wavefront path tracer: set 0 of its stages.
//
// Paths live in slots; a queue holds the slots that are still alive. What one stage hands to the next within a bounce (hits, shadow rays,
// flags) is indexed by the place in the queue. Nothing a path computes depends on its slot or place, so queue order and wave size
// never reach the picture.
#ifndef CLERESTORY_TRANSPORT_PATH_BUFFERS_GLSL
#define CLERESTORY_TRANSPORT_PATH_BUFFERS_GLSL

#include "accel/ray.glsl"

// descriptor set 0: PathBuffers

const uint STALLED_NOT = 0u;
const uint STALLED_EXTEND = 1u;
const uint STALLED_SHADOW = 2u;

const uint FLAG_ALIVE = 1u;
const uint FLAG_SHADOW = 2u;

const uint OUTSIDE = 0xFFFFFFFFu;

// Places of the queue that one invocation of the compaction kernels handles.
const uint COMPACT_CHUNK = 32u;
// Invocations of a workgroup of every stage.
const uint PATH_GROUP = 64u;

struct PathState {
    vec3 throughput;
    float pdf;        // of the last direction, solid angle; 0 after a delta lobe or at the camera: emission then counts in full
    vec3 radiance;    // gathered so far
    uint bounce;      // scattering events so far
    float eta_scale;  // undoes the radiance scaling of refractions for Russian roulette
    uint interior;    // material of the solid that the path is inside of, or OUTSIDE
};

struct ShadowRay {
    Ray ray;
    vec3 contribution;  // radiance if nothing is in between
};

struct PathAov {
    vec3 albedo;
    float depth;  // distance along the ray; 0 without a hit
    vec3 normal;
    uint filled;
};

layout(set = 0, binding = 0, scalar) restrict buffer PathStatusBlock {
    uint item_groups[3];     // indirect arguments: one invocation a place
    uint chunk_groups[3];    // one a chunk
    uint scatter_groups[3];  // chunk_groups as they were before the last scan
    uint active_count;       // places in the queue
    uint previous_count;     // as it was before the last scan
    uint stalled;            // STALLED_*; every later stage leaves at once
    uint unfinished;         // rays that a quota stopped
    uint rounds;             // bounces finished in this wave
    uint extend_rays[2];     // 64-bit counters, low word first
    uint shadow_rays[2];
} status;
layout(set = 0, binding = 1, scalar) restrict buffer PathQueueIn { uint queue_in[]; };
layout(set = 0, binding = 2, scalar) restrict buffer PathQueueOut { uint queue_out[]; };
layout(set = 0, binding = 3, scalar) restrict buffer PathRays { Ray rays[]; };            // by slot
layout(set = 0, binding = 4, scalar) restrict buffer PathStates { PathState paths[]; };   // by slot
layout(set = 0, binding = 5, scalar) restrict buffer PathHits { Hit hits[]; };            // by place
layout(set = 0, binding = 6, scalar) restrict buffer PathShadowRays { ShadowRay shadow[]; };  // by place
layout(set = 0, binding = 7, scalar) restrict buffer PathFlags { uint flags[]; };         // by place
layout(set = 0, binding = 8, scalar) restrict buffer PathResume { uint resume_words[]; };  // by place: extend and shadow, alternating
layout(set = 0, binding = 9, scalar) restrict buffer PathChunks { uint chunk_counts[]; };
layout(set = 0, binding = 10, scalar) restrict buffer PathAovs { PathAov aovs[]; };       // by slot

#endif
