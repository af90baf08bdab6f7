// What kernels hold of rays under way in a ray index, whatever the index: quotas, where rays go on, and counters.
#ifndef CLERESTORY_ACCEL_INDEX_RAYS_GLSL
#define CLERESTORY_ACCEL_INDEX_RAYS_GLSL

// Iterations after which a ray stops and waits for the next dispatch; INDEX_NEVER_STOPS for none.
layout(constant_id = 100) const uint INDEX_QUOTA = 32768u;
layout(constant_id = 101) const bool INDEX_COUNT = false;

const uint INDEX_NEVER_STOPS = 0xFFFFFFFFu;

// Where a ray begins, and what says that it has ended; anything else says where it goes on.
const uint INDEX_START = 0u;
const uint INDEX_FINISHED = 0xFFFFFFFFu;

// Defined by the includer as a constant: false where every call begins at INDEX_START, which leaves the bookkeeping of resumption out.
#ifndef INDEX_RESUMES
#define INDEX_RESUMES true
#endif

// Exact work of an invocation, filled when INDEX_COUNT is set. Those from the leaves on are of kd-trees.
struct IndexCounters {
    uint nodes;
    uint triangles;
    uint iterations;
    uint leaves;
    uint pushes;
    uint pops;
    uint restarts;
    uint cached_nodes;
    uint register_pushes;
    uint register_pops;
};

IndexCounters index_counters = IndexCounters(0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);

// Loop iterations of the invocation's traversals so far.
uint index_iterations = 0u;

#define INDEX_COUNT_ONE(counter) \
    if (INDEX_COUNT) { \
        ++index_counters.counter; \
    }

#endif
