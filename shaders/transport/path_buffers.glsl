// Working memory of the wavefront path tracer: set 0 of its stages.
//
// Paths live in slots; a queue holds the slots that are still alive. What one stage hands to the next within a bounce (hits, shadow rays,
// flags) is indexed by the place in the queue. Nothing a path computes depends on its slot or place, so queue order and wave size
// never reach the picture.
//
// What is handed on is written as a storage buffer and read, by a later dispatch, as a texel buffer over the same memory: software drivers fetch
// texels for all lanes at once, but load storage buffers lane by lane and word by word. No dispatch reads by one what it writes by the
// other: queues and slots alternate between two buffers.
#ifndef CLERESTORY_TRANSPORT_PATH_BUFFERS_GLSL
#define CLERESTORY_TRANSPORT_PATH_BUFFERS_GLSL

#include "accel/ray.glsl"
#include "transport/outside.glsl"

// descriptor set 0: PathBuffers

const uint STALLED_NOT = 0u;
const uint STALLED_EXTEND = 1u;
const uint STALLED_SHADOW = 2u;
const uint STALLED_ARRIVAL = 3u;  // a stage of a technique's own

const uint FLAG_ALIVE = 1u;
const uint FLAG_SHADOW = 2u;
// In scenes with media, which shadow rays a place has: to light scattered once on the way there, and to light sampled at its end.
const uint FLAG_AIRLIGHT = 4u;
const uint FLAG_SAMPLED = 8u;

// Four-word texels of a path's state and of a shadow ray.
const uint PATH_STATE_QUARTERS = 3u;
const uint SHADOW_RAY_QUARTERS = 3u;
// Places whose flags one texel holds.
const uint FLAGS_PER_TEXEL = 4u;
// Places of the queue that one invocation of the compaction kernels handles.
const uint COMPACT_CHUNK = 32u;
// Invocations of a workgroup of every stage.
const uint PATH_GROUP = 64u;

struct PathState {
    vec3 origin;      // of the ray under way
    float pdf;        // of its direction, solid angle; 0 after a delta lobe or at the camera: emission then counts in full
    vec3 direction;   // unit
    uint bounce;      // scattering events so far
    vec3 throughput;
    float eta_scale;  // undoes the radiance scaling of refractions for Russian roulette
};

struct GatheredLight {
    vec3 radiance;
    uint interior;  // material of the solid that the path is inside of, or OUTSIDE
};

struct ShadowRay {
    vec3 origin;
    float t_max;        // from t = 0
    vec3 direction;
    uint slot;
    vec3 contribution;  // radiance if nothing is in between
    uint bounce;        // scattering events with the one at the light
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
    uint shadow_groups[3];   // one a shadow ray
    uint active_count;       // places in the queue
    uint previous_count;     // as it was before the last scan
    uint shadow_count;       // shadow rays of the bounce that the last scan ended
    uint stalled;            // STALLED_*; every later stage leaves at once
    uint unfinished;         // rays that a quota stopped
    uint rounds;             // bounces finished in this wave
    uint extend_rays[2];     // 64-bit counters, low word first
    uint shadow_rays[2];
} status;
layout(set = 0, binding = 1) uniform utextureBuffer path_queue_in;
layout(set = 0, binding = 2, scalar) restrict writeonly buffer PathQueueOut { uint path_queue_out[]; };
layout(set = 0, binding = 3) uniform utextureBuffer path_states_in;  // by slot
layout(set = 0, binding = 4, scalar) restrict writeonly buffer PathStatesOut { PathState path_states_out[]; };
layout(set = 0, binding = 5, scalar) restrict buffer PathGathered { GatheredLight path_gathered[]; };  // by slot
layout(set = 0, binding = 6) uniform utextureBuffer path_hits_in;  // by place
layout(set = 0, binding = 7, scalar) restrict buffer PathHitsOut { Hit path_hits_out[]; };
layout(set = 0, binding = 8) uniform utextureBuffer path_shadow_rays_in;  // by place
layout(set = 0, binding = 9, scalar) restrict writeonly buffer PathShadowRaysOut { ShadowRay path_shadow_rays_out[]; };
layout(set = 0, binding = 10) uniform utextureBuffer path_shadow_queue_in;  // places
layout(set = 0, binding = 11, scalar) restrict writeonly buffer PathShadowQueueOut { uint path_shadow_queue_out[]; };
layout(set = 0, binding = 12) uniform utextureBuffer path_flags_in;  // four places a texel
layout(set = 0, binding = 13, scalar) restrict writeonly buffer PathFlagsOut { uint path_flags_out[]; };
// Where stopped rays go on, by place in the queue of the stage that stalled.
layout(set = 0, binding = 14, scalar) restrict buffer PathResume { uint path_resume[]; };
layout(set = 0, binding = 15, scalar) restrict buffer PathChunks { uvec2 path_chunks[]; };  // paths alive, shadow rays
layout(set = 0, binding = 16, scalar) restrict buffer PathAovs { PathAov path_aovs[]; };    // by slot

PathState load_path(uint slot) {
    int first = int(PATH_STATE_QUARTERS * slot);
    vec4 q0 = uintBitsToFloat(texelFetch(path_states_in, first));
    uvec4 q1 = texelFetch(path_states_in, first + 1);
    vec4 q2 = uintBitsToFloat(texelFetch(path_states_in, first + 2));
    return PathState(q0.xyz, q0.w, uintBitsToFloat(q1.xyz), q1.w, q2.xyz, q2.w);
}

Hit load_hit(uint place) {
    uvec4 q = texelFetch(path_hits_in, int(place));
    return Hit(uintBitsToFloat(q.x), uintBitsToFloat(q.yz), q.w);
}

ShadowRay load_shadow_ray(uint place) {
    int first = int(SHADOW_RAY_QUARTERS * place);
    vec4 q0 = uintBitsToFloat(texelFetch(path_shadow_rays_in, first));
    uvec4 q1 = texelFetch(path_shadow_rays_in, first + 1);
    uvec4 q2 = texelFetch(path_shadow_rays_in, first + 2);
    return ShadowRay(q0.xyz, q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), q2.w);
}

// The slot at a place: in the first bounce, the place.
uint load_slot(uint place) { return status.rounds == 0u ? place : texelFetch(path_queue_in, int(place)).x; }

#endif
