// Working memory of a wave of walks: set 0 of every stage. A walk is light's way through a scene, ray by ray, from an eye or from a light.
//
// Walks live in slots; a queue holds the slots that are still alive. What one stage hands to the next within a bounce (hits, flags, what waits)
// is indexed by the place in the queue. Nothing a walk computes depends on its slot or place, so queue order and wave size
// never reach the picture.
//
// What is handed on is written as a storage buffer and read, by a later dispatch, as a texel buffer over the same memory: software drivers fetch
// texels for all lanes at once, but load storage buffers lane by lane and word by word. No dispatch reads by one what it writes by the
// other: queues and slots alternate between two buffers.
//
// What waits by place is WAITING_QUARTERS quarters that a stage behind the compaction takes up: a shadow ray (shadow.comp), or whatever a technique keeps
// of a place.
#ifndef CLERESTORY_WALK_WAVE_GLSL
#define CLERESTORY_WALK_WAVE_GLSL

#include "accel/ray.glsl"
#include "scene/fetches.glsl"
#include "wide_counter.glsl"

// descriptor set 0: WaveSet

const uint STALLED_NOT = 0u;
const uint STALLED_EXTEND = 1u;
const uint STALLED_SHADOW = 2u;
const uint STALLED_ARRIVAL = 3u;  // a stage between arrival and scattering
const uint STALLED_SCATTER = 4u;

// Stands in walk_resume for a place that a scatter stage has handled, should the stage stall elsewhere.
const uint PLACE_SCATTERED = 0xFFFFFFFDu;
// Where a stage finds the hits of rays itself, values from here on say how far places are whose rays have ended; rays through any index but a kd-tree never go on there.
const uint PLACE_RAY_ENDED = 0xFFFFFFF0u;

// Loop iterations of a unit of work. What takes less is not counted: it is bounded by the places of a wave.
const uint WORK_UNIT = 64u;
// Units of work of an iteration of a walk through a grid: it draws numbers and looks up densities.
const uint GRID_ITERATION_WORK = 4u;
// And of one of a query of a map, where photons are weighed.
const uint QUERY_STEP_WORK = 2u;

const uint FLAG_ALIVE = 1u;
const uint FLAG_WAITING = 2u;  // something waits at the place
// In scenes with media, which shadow rays a place that waits has: to light scattered once on the way there (walk_airlight_rays), and to light
// sampled at its end (walk_waiting_out). One that has neither is passed over. walk/hand_on.glsl sets what a shadow ray takes.
const uint FLAG_AIRLIGHT = 4u;
const uint FLAG_SAMPLED = 8u;

// Four-word texels of a walk's state, and of what waits at a place.
const uint WALK_STATE_QUARTERS = 3u;
const uint WAITING_QUARTERS = 3u;
// Places whose flags one texel holds.
const uint FLAGS_PER_TEXEL = 4u;
// Places of the queue that one invocation of the compaction kernels handles.
const uint COMPACT_CHUNK = 32u;
// Stages whose fetches are counted.
const uint FETCHES_EXTEND = 0u;
const uint FETCHES_MEDIUM = 1u;
const uint FETCHES_SHADE = 2u;
const uint FETCHES_SHADOW = 3u;
const uint FETCH_STAGES = 4u;
// Invocations of a workgroup of every stage.
const uint WALK_GROUP = 64u;

// What the random numbers of a wave's walks are keyed by: sequences, and walks of each. Of eye paths pixels and their samples, of photons
// passes and the photons in them.
struct WalkKey {
    uint first_sequence;
    uint first_index;  // in each sequence
    uint indices;      // of each sequence in the wave, in neighbouring slots
    uint seed;
};

struct WalkState {
    vec3 origin;      // of the ray under way
    float eta_scale;  // undoes the radiance scaling of refractions for Russian roulette. Of photons instead their number (EVEN_SURVIVAL), or what they come from (PHOTON_FROM_...)
    vec3 direction;   // unit
    uint bounce;      // scattering events so far
    vec3 throughput;
    float pdf;        // of the direction, solid angle; 0 after a delta lobe or at the start: emission then counts in full. Of photons instead the squared distance of
                      // their light, m2 (CARRIES_LIGHT_DISTANCE)
};

struct GatheredLight {
    vec3 radiance;
    uint interior;  // material of the solid that the walk is inside of, or OUTSIDE
};

struct ShadowRay {
    vec3 origin;
    float t_max;        // from t = 0
    vec3 direction;
    uint slot;
    vec3 contribution;  // radiance if nothing is in between
    uint bounce;        // scattering events with the one at the light
};

// There is nothing left for the shading stage.
const uint EVENT_HANDLED = 1u;

struct MediumState {
    vec3 bands;   // as in transport/medium.glsl
    float start;  // distance along the ray up to which the walk has come; negative by what the offset of its origin left out
};

struct MediumEvent {
    vec3 weight;  // of the throughput on the way to the surface
    uint flags;   // EVENT_HANDLED, FLAG_AIRLIGHT
};

// What is known of a place's shadow rays where they start: written by the stage that sends them, in scenes with media.
struct ShadowStart {
    uint sampled_interior;   // material of the body that the ray begins in, or OUTSIDE
    uint airlight_interior;
    float start;             // of the sampled ray, as in ShadowState
};

struct ShadowState {
    vec3 transmittance;
    float start;  // as in MediumState, in lengths of the ray's direction
    Hit hit;
    uint interior;
    uint grid_walks;  // so far
    uint rays;        // those still to follow: FLAG_AIRLIGHT, FLAG_SAMPLED; the first one is under way
};

layout(set = 0, binding = 0, scalar) restrict buffer WaveStatusBlock {
    uint item_groups[3];     // indirect arguments: one invocation per place
    uint chunk_groups[3];    // one per chunk
    uint scatter_groups[3];  // chunk_groups as they were before the last scan
    uint waiting_groups[3];  // one per waiting place
    uint active_count;       // places in the queue
    uint previous_count;     // as it was before the last scan
    uint waiting_count;      // waiting places of the bounce that the last scan ended
    uint stalled;            // STALLED_*; every later stage leaves at once
    uint unfinished;         // rays that a quota stopped
    uint rounds;             // bounces finished in this wave
    uint rays[2];            // 64-bit counters, low word first: rays followed to their ends
    uint waited[2];          // places that have waited
    uint unstarted;          // 1 where places were left for later, since the submission's work was used up
    coherent int work_left;  // of this submission, in units of WORK_UNIT iterations; the places under way may take it below 0
    uint oldest;             // of a wave that is kept full: what its owner has numbered the walk by that is first in the queue
    // 64-bit counters by stage, low word first, where kernels count what they fetch: texels, and words of them.
    uint fetched_texels[2u * FETCH_STAGES];
    uint fetched_words[2u * FETCH_STAGES];
} status;
layout(set = 0, binding = 1) uniform utextureBuffer walk_queue_in;
layout(set = 0, binding = 2, scalar) restrict writeonly buffer WalkQueueOut { uint walk_queue_out[]; };
layout(set = 0, binding = 3) uniform utextureBuffer walk_states_in;  // by slot
layout(set = 0, binding = 4, scalar) restrict writeonly buffer WalkStatesOut { WalkState walk_states_out[]; };
layout(set = 0, binding = 5, scalar) restrict buffer WalkGathered { GatheredLight walk_gathered[]; };  // by slot
layout(set = 0, binding = 6) uniform utextureBuffer walk_hits_in;  // by place
layout(set = 0, binding = 7, scalar) restrict buffer WalkHitsOut { Hit walk_hits_out[]; };
layout(set = 0, binding = 8) uniform utextureBuffer walk_waiting_in;  // by place
layout(set = 0, binding = 9, scalar) restrict writeonly buffer WalkWaitingOut { uvec4 walk_waiting_out[]; };
layout(set = 0, binding = 10) uniform utextureBuffer walk_waiting_queue_in;  // places
layout(set = 0, binding = 11, scalar) restrict writeonly buffer WalkWaitingQueueOut { uint walk_waiting_queue_out[]; };
layout(set = 0, binding = 12) uniform utextureBuffer walk_flags_in;  // four places per texel
layout(set = 0, binding = 13, scalar) restrict writeonly buffer WalkFlagsOut { uint walk_flags_out[]; };
// Where stopped rays go on, and which places are done, by place in the queue of the stage that stalled.
layout(set = 0, binding = 14, scalar) restrict buffer WalkResume { uint walk_resume[]; };
layout(set = 0, binding = 15, scalar) restrict buffer WalkChunks { uvec2 walk_chunks[]; };  // walks alive, waiting places

// Those that follow are there in scenes with media alone; in others some other buffer is bound, and nothing may be read or written.
// The way of walks that go on, by slot: read by extend.comp from the second bounce on, written by every stage that lets a walk go on.
layout(set = 0, binding = 16, scalar) restrict buffer WalkMediumStates { MediumState walk_medium_states[]; };
layout(set = 0, binding = 17, scalar) restrict buffer WalkMediumEvents { MediumEvent walk_medium_events[]; };  // by place
layout(set = 0, binding = 18, scalar) restrict buffer WalkShadowStarts { ShadowStart walk_shadow_starts[]; };  // by place
layout(set = 0, binding = 19, scalar) restrict buffer WalkAirlightRays { ShadowRay walk_airlight_rays[]; };    // by place
layout(set = 0, binding = 20, scalar) restrict buffer WalkShadowStates { ShadowState walk_shadow_states[]; };  // by place in the waiting queue
// 64-bit counters, low word first.
layout(set = 0, binding = 21, scalar) restrict buffer WalkMediumCounters {
    uint collisions[2];
    uint null_collisions[2];
    uint density_lookups[2];
    uint second_rays[2];  // of places that have one already
} medium_counters;

// Sequence and place in it of the walk in each slot, where walks have numbers of their own instead of those of a WalkKey; elsewhere some other buffer is bound. Of a
// wave that is kept full also the round that the walk began in, and a number of its owner's; 0 stands for the round elsewhere.
layout(set = 0, binding = 22) uniform utextureBuffer walk_numbers_in;

#define COUNT_MEDIUM(COUNTER, AMOUNT) COUNT_WIDE(medium_counters.COUNTER, AMOUNT)

#define ADD_WIDE(COUNTER, STAGE, AMOUNT) { \
    uint added = AMOUNT; \
    if (added > 0u && atomicAdd(COUNTER[2u * STAGE], added) > 0xFFFFFFFFu - added) { \
        atomicAdd(COUNTER[2u * STAGE + 1u], 1u); \
    } \
}

// Adds what an invocation has fetched to the counters of its stage.
void add_fetches(uint stage) {
    if (CLERESTORY_COUNT_FETCHES) {
        ADD_WIDE(status.fetched_texels, stage, fetched_texels)
        ADD_WIDE(status.fetched_words, stage, fetched_words)
    }
}

// Whether a place may be begun. What one place takes is bounded by its quota, so that a submission ends soon after its work is used up, whatever the scene.
bool has_work_left() { return status.work_left > 0; }

// Counts loop iterations, where they are `least` or more.
void count_work(uint iterations, uint least) {
    if (iterations >= least) {
        atomicAdd(status.work_left, -int(iterations / WORK_UNIT));
    }
}

// Leaves a place for a later submission: its stage stalls, and goes on with those that walk_resume does not say to be done.
void leave_for_later(uint stage) {
    if (status.unstarted == 0u) {
        atomicMax(status.unstarted, 1u);
        atomicMax(status.stalled, stage);
    }
}

// Notes a place that a ray stage goes on with in a later dispatch: its quota stopped it, or it has not begun. One masked block for both, since some drivers
// run through all of them.
void stall_place(uint stage, bool begun) {
    if (begun) {
        atomicAdd(status.unfinished, 1u);
    } else {
        status.unstarted = 1u;
    }
    atomicMax(status.stalled, stage);
}

// Where nothing refracts, what a surface scatters needs the last two quarters alone.
WalkState load_walk(uint slot) {
    int first = int(WALK_STATE_QUARTERS * slot);
    vec4 q0 = uintBitsToFloat(texelFetch(walk_states_in, first));
    uvec4 q1 = texelFetch(walk_states_in, first + 1);
    vec4 q2 = uintBitsToFloat(texelFetch(walk_states_in, first + 2));
    return WalkState(q0.xyz, q0.w, uintBitsToFloat(q1.xyz), q1.w, q2.xyz, q2.w);
}

Hit load_hit(uint place) {
    count_quarters(1u);
    uvec4 q = texelFetch(walk_hits_in, int(place));
    return Hit(uintBitsToFloat(q.x), uintBitsToFloat(q.yz), q.w);
}

ShadowRay load_shadow_ray(uint place) {
    count_quarters(WAITING_QUARTERS);
    int first = int(WAITING_QUARTERS * place);
    vec4 q0 = uintBitsToFloat(texelFetch(walk_waiting_in, first));
    uvec4 q1 = texelFetch(walk_waiting_in, first + 1);
    uvec4 q2 = texelFetch(walk_waiting_in, first + 2);
    return ShadowRay(q0.xyz, q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), q2.w);
}

// Lets something wait at a place, which FLAG_WAITING must say.
void store_waiting(uint place, uvec4 q0, uvec4 q1, uvec4 q2) {
    uint first = WAITING_QUARTERS * place;
    walk_waiting_out[first] = q0;
    walk_waiting_out[first + 1u] = q1;
    walk_waiting_out[first + 2u] = q2;
}

// The slot at a place: in the first bounce, the place.
uint load_slot(uint place) {
    if (status.rounds == 0u) {
        return place;
    }
    count_fetches(1u, 1u);
    return texelFetch(walk_queue_in, int(place)).x;
}

#endif
