// Closest-hit and any-hit traversal of the wide hierarchy; twin of clerestory::accel::wide::WideTraversal, which explains the order, the decoded
// boxes, their bound and how a stopped ray goes on.
//
// Each round visits nodes until one has triangles to test, and tests them: two loops, in each of which lanes wait for each other, since software
// drivers run both sides of branches. Both test at their end whether they go on. A subgroup may run as many iterations as its lanes have in sum,
// and the quota must be that much smaller. A ray that its quota stops returns the node to go on with; call again with it and the same hit. The
// quota must exceed WIDE_MAX_DEPTH; to it a round adds WIDE_ROUND_ITERATIONS, a node and its triangles at most. With a filter each candidate that is
// asked about is a round of its own.
//
// With CLERESTORY_CANDIDATE_FILTER defined, as a constant that says whether there is a filter, the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
#ifndef CLERESTORY_ACCEL_WIDE_GLSL
#define CLERESTORY_ACCEL_WIDE_GLSL

#include "accel/box_test.glsl"
#include "accel/index_bindings.glsl"
#include "accel/triangle.glsl"
#include "accel/wide_layout.glsl"

const uint WIDE_MAX_DEPTH = 32u;
// Iterations of a round beside its nodes and triangles: the round, and both loops where no lane goes through them.
const uint WIDE_ROUND_ITERATIONS = 4u;

// Bits of what a slot can hold.
#define WIDE_SLOT_HOLDS(SLOT) (7u << (3u * SLOT) | 1u << (WIDE_INNER_SHIFT + SLOT))

// The grid of a node as a ray meets it: ray parameters between planes, and of the corner, less and plus the slack.
struct WideGrid {
    vec3 scale;
    vec3 near;
    vec3 far;
};

WideGrid wide_grid(BoxTest boxes, vec3 corner, uint exponents) {
    vec3 steps = uintBitsToFloat(uvec3(exponents << 23, exponents << 15, exponents << 7) & WIDE_EXPONENT_MASK);
    precise vec3 at_corner = (corner - boxes.origin) * boxes.inverse;
    precise vec3 near = at_corner - boxes.slack;
    precise vec3 far = at_corner + boxes.slack;
    return WideGrid(steps * boxes.inverse, near, far);
}

// The bytes of a word, but the second and the third times 2^8 and 2^16: wide_byte_scale has the reciprocals.
vec4 wide_bytes(uint word) {
    return vec4(ivec4(word & 0xFFu, word & 0xFF00u, word & 0xFF0000u, word >> 24));
}

vec4 wide_byte_scale(float scale) { return scale * vec4(1.0, 1.0 / 256.0, 1.0 / 65536.0, 1.0); }

// Which of the boxes of four slots a ray meets: words of near and of far planes by axis.
bvec4 wide_met(WideGrid grid, uvec3 near, uvec3 far, float t_min, float t_max) {
    vec4 scale_x = wide_byte_scale(grid.scale.x);
    vec4 scale_y = wide_byte_scale(grid.scale.y);
    vec4 scale_z = wide_byte_scale(grid.scale.z);
    precise vec4 near_x = wide_bytes(near.x) * scale_x + grid.near.x;
    precise vec4 near_y = wide_bytes(near.y) * scale_y + grid.near.y;
    precise vec4 near_z = wide_bytes(near.z) * scale_z + grid.near.z;
    precise vec4 far_x = wide_bytes(far.x) * scale_x + grid.far.x;
    precise vec4 far_y = wide_bytes(far.y) * scale_y + grid.far.y;
    precise vec4 far_z = wide_bytes(far.z) * scale_z + grid.far.z;
    vec4 enter = max(max(near_x, near_y), max(near_z, vec4(t_min)));
    vec4 leave = min(min(far_x, far_y), min(far_z, vec4(t_max)));
    return lessThanEqual(enter, leave);
}

// Bits of what the slots can hold whose boxes a ray meets: the texels of a node but for its words.
uint wide_slots_met(BoxTest boxes, bvec3 backwards, uvec4 frame, uvec4 x, uvec4 y, uvec4 z, float t_min, float t_max) {
    WideGrid grid = wide_grid(boxes, uintBitsToFloat(frame.xyz), frame.w);
    x = backwards.x ? x.zwxy : x;
    y = backwards.y ? y.zwxy : y;
    z = backwards.z ? z.zwxy : z;
    bvec4 low = wide_met(grid, uvec3(x.x, y.x, z.x), uvec3(x.z, y.z, z.z), t_min, t_max);
    bvec4 high = wide_met(grid, uvec3(x.y, y.y, z.y), uvec3(x.w, y.w, z.w), t_min, t_max);
    return (low.x ? WIDE_SLOT_HOLDS(0u) : 0u) | (low.y ? WIDE_SLOT_HOLDS(1u) : 0u)
         | (low.z ? WIDE_SLOT_HOLDS(2u) : 0u) | (low.w ? WIDE_SLOT_HOLDS(3u) : 0u)
         | (high.x ? WIDE_SLOT_HOLDS(4u) : 0u) | (high.y ? WIDE_SLOT_HOLDS(5u) : 0u)
         | (high.z ? WIDE_SLOT_HOLDS(6u) : 0u) | (high.w ? WIDE_SLOT_HOLDS(7u) : 0u);
}

// Bits of slots as bits of places in a ray's order, place = slot ^ octant, and the other way round.
uint wide_in_order(uint slots, uint octant) {
    uint by_x = (slots & 0x55u) << 1 | slots >> 1 & 0x55u;
    slots = (octant & 1u) != 0u ? by_x : slots;
    uint by_y = (slots & 0x33u) << 2 | slots >> 2 & 0x33u;
    slots = (octant & 2u) != 0u ? by_y : slots;
    uint by_z = (slots & 0x0Fu) << 4 | slots >> 4 & 0x0Fu;
    return (octant & 4u) != 0u ? by_z : slots;
}

// Children that are left of a node, but for what is on the stack: its first child; places in the ray's order that are left, and, above them, which
// slots hold children. Then the way to the node to go on with, from the end of the array on: its slots, the root's lowest.
uint wide_stack_children[WIDE_MAX_DEPTH + 2u];
uint wide_stack_slots[WIDE_MAX_DEPTH + 2u];

// Traverses from `resume` on (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns INDEX_FINISHED or where to go on.
uint wide_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    if (resume == INDEX_FINISHED || !is_traceable(ray)) {
        return INDEX_FINISHED;
    }
    uvec4 header0 = index_texel(0u);
    uvec4 header1 = index_texel(1u);
    BoxTest boxes = box_test(uintBitsToFloat(header0.xyz), uintBitsToFloat(header1.xyz), ray);
    bvec3 backwards = lessThan(boxes.inverse, vec3(0.0));
    uint octant = uint(backwards.x) | uint(backwards.y) << 1 | uint(backwards.z) << 2;
    RayShear shear = ray_shear(ray.origin, ray.direction);

    // Levels of the way that are left to go.
    uint replay = 0u;
    for (uint node = INDEX_RESUMES ? resume : 0u; node != 0u; ++replay) {
        uint parent = index_texel(WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * node + 1u).w;
        wide_stack_slots[WIDE_MAX_DEPTH - replay] = parent & WIDE_SLOT_MASK;
        node = parent >> WIDE_SLOT_BITS;
    }

    uint node = 0u;
    uint children = 0u;
    uint slots = 0u;
    uint top = 0u;
    // Triangles to test, among those of a node.
    uint triangles = 0u;
    uint holds = 0u;
    uint first_triangle = 0u;
    uint iterations = 0u;
    do {
#ifdef CLERESTORY_CANDIDATE_FILTER
        // Unless a candidate has interrupted the triangles of a node.
        if (!CLERESTORY_CANDIDATE_FILTER || triangles == 0u)
#endif
        do {
            ++iterations;
            INDEX_COUNT_ONE(nodes)
            uint texel = WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * node;
            uvec4 frame = index_texel(texel);
            uvec4 below = index_texel(texel + 1u);
            uvec4 x = index_texel(texel + 2u);
            uvec4 y = index_texel(texel + 3u);
            uvec4 z = index_texel(texel + 4u);
            uint met = wide_slots_met(boxes, backwards, frame, x, y, z, ray.t_min, hit.t) & below.z;
            uint found = met & WIDE_TRIANGLE_MASK;
            uint order = wide_in_order(met >> WIDE_INNER_SHIFT, octant);
            if (INDEX_RESUMES) {
                // On the way back: what comes before it in the order has been gone through, triangles too.
                bool replays = replay > 0u;
                uint place = (wide_stack_slots[WIDE_MAX_DEPTH + 1u - replay] ^ octant) & WIDE_SLOT_MASK;
                order = replays ? order & WIDE_ORDER_MASK << place : order;
                found = replays ? 0u : found;
                replay = replays && (order >> place & 1u) != 0u ? replay - 1u : 0u;
            }
            // Carried from iteration to iteration, since a lane that has left the loop sees, of what each iteration finds anew, what later ones make of its
            // next node, on drivers that mask only what is carried.
            triangles |= found;
            holds = found != 0u ? below.z : holds;
            first_triangle = found != 0u ? below.y : first_triangle;
            bool none_left = (slots & WIDE_ORDER_MASK) == 0u;
            if (order != 0u) {
                if (!none_left) {
                    wide_stack_children[top] = children;
                    wide_stack_slots[top] = slots;
                    ++top;
                }
                children = below.x;
                slots = below.z >> WIDE_INNER_SHIFT << WIDE_SLOTS | order;
            } else if (none_left && top > 0u) {
                --top;
                children = wide_stack_children[top];
                slots = wide_stack_slots[top];
            }
            uint slot = uint(findLSB(slots)) ^ octant;
            uint before = slots >> WIDE_SLOTS & (1u << (slot & WIDE_SLOT_MASK)) - 1u;
            node = (slots & WIDE_ORDER_MASK) != 0u ? children + uint(bitCount(before)) : INDEX_FINISHED;
            slots = (slots & WIDE_ORDER_MASK) != 0u ? slots & slots - 1u : slots;
        } while (triangles == 0u && node != INDEX_FINISHED && iterations < INDEX_QUOTA);
        bool awaiting = false;
        Hit awaited = hit;
        if (triangles != 0u) {
            do {
                ++iterations;
                INDEX_COUNT_ONE(triangles)
                uint before = holds & (1u << findLSB(triangles)) - 1u;
                triangles &= triangles - 1u;
                uint texel = header0.w + WIDE_TRIANGLE_TEXELS * (first_triangle + uint(bitCount(before)));
                vec4 q0 = uintBitsToFloat(index_texel(texel));
                vec4 q1 = uintBitsToFloat(index_texel(texel + 1u));
                uvec4 q2 = index_texel(texel + 2u);
                TriangleHit candidate;
                if (intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, uintBitsToFloat(q2.x)), ray.t_min, hit.t, candidate)
                    && (candidate.t < hit.t || q2.y < hit.triangle)) {
                    awaited = Hit(candidate.t, candidate.barycentrics, q2.y);
#ifdef CLERESTORY_CANDIDATE_FILTER
                    if (CLERESTORY_CANDIDATE_FILTER) {
                        awaiting = true;
                    } else
#endif
                    {
                        hit = awaited;
                        triangles = any_hit ? 0u : triangles;
                        node = any_hit ? INDEX_FINISHED : node;
                    }
                }
            } while (triangles != 0u && !awaiting);
        }
#ifdef CLERESTORY_CANDIDATE_FILTER
        // Outside of the loop, where lanes wait for each other with their candidates.
        if (CLERESTORY_CANDIDATE_FILTER && awaiting && accept_candidate(awaited.triangle, awaited.barycentrics)) {
            hit = awaited;
            triangles = any_hit ? 0u : triangles;
            node = any_hit ? INDEX_FINISHED : node;
        }
#endif
        iterations += WIDE_ROUND_ITERATIONS;
    } while (triangles != 0u || node != INDEX_FINISHED && iterations < INDEX_QUOTA);
    index_iterations += iterations;
    if (INDEX_COUNT) {
        index_counters.iterations += iterations;
    }
    return node;
}

#endif
