// Working memory of the wavefront path tracer: set 0 of its stages.
//
// Paths live in slots; a queue holds the slots that are still alive. What one stage hands to the next within a bounce (hits, shadow rays,
// flags) is indexed by the place in the queue. Nothing a path computes depends on its slot or place, so queue order and wave size
// never reach the picture.
//
// What all paths read and write is in texel buffers of whole quarters (four words): software drivers load and store those for all lanes
// at once, but storage buffers lane by lane and word by word.
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

// Quarters of a slot, of a hit and of a shadow ray.
const uint PATH_SLOT_QUARTERS = 4u;
const uint PATH_SHADOW_QUARTERS = 3u;
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

struct PathGathered {
    vec3 radiance;
    uint interior;  // material of the solid that the path is inside of, or OUTSIDE
};

struct ShadowRay {
    Ray ray;            // its t_min is 0
    vec3 contribution;  // radiance if nothing is in between
    uint slot;
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
    uint resuming;           // STALLED_*: that stage goes on with rays that a quota stopped
    uint unfinished;         // rays that a quota stopped
    uint rounds;             // bounces finished in this wave
    uint extend_rays[2];     // 64-bit counters, low word first
    uint shadow_rays[2];
} status;
layout(set = 0, binding = 1, r32ui) uniform restrict uimageBuffer path_queue_in;
layout(set = 0, binding = 2, r32ui) uniform restrict uimageBuffer path_queue_out;
layout(set = 0, binding = 3, rgba32ui) uniform restrict uimageBuffer path_slots;
layout(set = 0, binding = 4, rgba32ui) uniform restrict uimageBuffer path_hits;          // by place
layout(set = 0, binding = 5, rgba32ui) uniform restrict uimageBuffer path_shadow_rays;   // by place
layout(set = 0, binding = 6, r32ui) uniform restrict uimageBuffer path_shadow_queue;     // places
layout(set = 0, binding = 7, r32ui) uniform restrict uimageBuffer path_flags;            // by place
layout(set = 0, binding = 8, r32ui) uniform restrict uimageBuffer path_resume;           // by place in the stage's queue
layout(set = 0, binding = 9, scalar) restrict buffer PathChunks { uvec2 path_chunks[]; };  // alive, with a shadow ray
layout(set = 0, binding = 10, scalar) restrict buffer PathAovs { PathAov path_aovs[]; };   // by slot

PathState load_path(uint slot) {
    int first = int(PATH_SLOT_QUARTERS * slot);
    vec4 q0 = uintBitsToFloat(imageLoad(path_slots, first));
    uvec4 q1 = imageLoad(path_slots, first + 1);
    vec4 q2 = uintBitsToFloat(imageLoad(path_slots, first + 2));
    return PathState(q0.xyz, q0.w, uintBitsToFloat(q1.xyz), q1.w, q2.xyz, q2.w);
}

void store_path(uint slot, PathState path) {
    int first = int(PATH_SLOT_QUARTERS * slot);
    imageStore(path_slots, first, floatBitsToUint(vec4(path.origin, path.pdf)));
    imageStore(path_slots, first + 1, uvec4(floatBitsToUint(path.direction), path.bounce));
    imageStore(path_slots, first + 2, floatBitsToUint(vec4(path.throughput, path.eta_scale)));
}

PathGathered load_gathered(uint slot) {
    uvec4 q = imageLoad(path_slots, int(PATH_SLOT_QUARTERS * slot + 3u));
    return PathGathered(uintBitsToFloat(q.xyz), q.w);
}

void store_gathered(uint slot, PathGathered gathered) {
    imageStore(path_slots, int(PATH_SLOT_QUARTERS * slot + 3u), uvec4(floatBitsToUint(gathered.radiance), gathered.interior));
}

Hit load_hit(uint place) {
    uvec4 q = imageLoad(path_hits, int(place));
    return Hit(uintBitsToFloat(q.x), uintBitsToFloat(q.yz), q.w);
}

void store_hit(uint place, Hit hit) {
    imageStore(path_hits, int(place), uvec4(floatBitsToUint(vec3(hit.t, hit.barycentrics)), hit.triangle));
}

ShadowRay load_shadow_ray(uint place) {
    int first = int(PATH_SHADOW_QUARTERS * place);
    vec4 q0 = uintBitsToFloat(imageLoad(path_shadow_rays, first));
    uvec4 q1 = imageLoad(path_shadow_rays, first + 1);
    uvec4 q2 = imageLoad(path_shadow_rays, first + 2);
    return ShadowRay(Ray(q0.xyz, 0.0, uintBitsToFloat(q1.xyz), q0.w), uintBitsToFloat(q2.xyz), q1.w, q2.w);
}

void store_shadow_ray(uint place, ShadowRay s) {
    int first = int(PATH_SHADOW_QUARTERS * place);
    imageStore(path_shadow_rays, first, floatBitsToUint(vec4(s.ray.origin, s.ray.t_max)));
    imageStore(path_shadow_rays, first + 1, uvec4(floatBitsToUint(s.ray.direction), s.slot));
    imageStore(path_shadow_rays, first + 2, uvec4(floatBitsToUint(s.contribution), s.bounce));
}

#endif
