// Closest-hit and any-hit traversal of two levels; twin of clerestory::accel::two_level::TwoLevelTraversal, which explains the order, how a ray goes in and
// out of instances, and how a stopped ray goes on.
//
// Rounds as in wide.glsl, whose loops these are. A round ends, too, where a ray goes into an instance or out of one, which happens between rounds, where
// lanes wait for each other. Triangles are tested in world space: their corners' images are made on the way. The quota must be at least twice WIDE_MAX_DEPTH and
// three times WIDE_ROUND_ITERATIONS, or a stopped ray may not get on (DeviceTraversal::least_quota); to it a round adds WIDE_ROUND_ITERATIONS, a node and its triangles at most. With a filter each candidate that is asked about is a round of its own, and
// counts as INSTANCE_SEARCH_STEPS more, since whoever is asked may have to find its instance.
#ifndef CLERESTORY_ACCEL_TWO_LEVEL_GLSL
#define CLERESTORY_ACCEL_TWO_LEVEL_GLSL

#include "accel/two_level_layout.glsl"
#include "accel/wide.glsl"
#include "scene/instance.glsl"

// Smallest component of a direction in the space of a mesh, relative to the largest.
const float TWO_LEVEL_MIN_COMPONENT = 5.6843419e-14;
// Bits of a word of the stack: places that are left, slots that hold anything, slots that hold instances.
const uint TWO_LEVEL_HELD_SHIFT = WIDE_SLOTS;
const uint TWO_LEVEL_KIND_SHIFT = 2u * WIDE_SLOTS;
// Where the way to the node to go on with ends on the stack.
const uint TWO_LEVEL_WAY_END = 2u * WIDE_MAX_DEPTH;

// As in wide.glsl, of both trees.
uint two_level_stack_children[TWO_LEVEL_WAY_END + 2u];
uint two_level_stack_slots[TWO_LEVEL_WAY_END + 2u];

// The rows from world space, the translation to it, and the slack, of an instance; `reach` is of the whole index.
BoxTest instance_box_test(vec3 x, vec3 y, vec3 z, vec3 translation, vec3 slack, Ray ray, float reach) {
    precise vec3 from = ray.origin - translation;
    vec3 origin = instance_rows(x, y, z, from);
    vec3 direction = instance_rows(x, y, z, ray.direction);
    float least = largest_component(abs(direction)) * TWO_LEVEL_MIN_COMPONENT;
    vec3 inverse = vec3(clamped_reciprocal(direction.x, least), clamped_reciprocal(direction.y, least),
                        clamped_reciprocal(direction.z, least));
    precise vec3 sums = vec3(abs(x.x) + abs(x.y) + abs(x.z), abs(y.x) + abs(y.y) + abs(y.z), abs(z.x) + abs(z.y) + abs(z.z));
    precise vec3 grown = (BOX_SLACK * reach * sums + slack) * abs(inverse);
    return BoxTest(origin, inverse, grown);
}

uint ray_octant(bvec3 backwards) {
    return uint(backwards.x) | uint(backwards.y) << 1 | uint(backwards.z) << 2;
}

// Climbs from a node to a root, and writes the way down from a place of the stack on, towards its beginning. The levels that the way has then.
uint two_level_climb(uint node, uint root, uint levels) {
    for (; node != root; ++levels) {
        uint parent = index_texel(TWO_LEVEL_HEADER_TEXELS + WIDE_NODE_TEXELS * node + 1u).w;
        two_level_stack_slots[TWO_LEVEL_WAY_END - levels] = parent & WIDE_SLOT_MASK;
        node = parent >> WIDE_SLOT_BITS;
    }
    return levels;
}

// Traverses from `resume` on (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns INDEX_FINISHED or where to go on.
uint two_level_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    if (resume == INDEX_FINISHED || !is_traceable(ray)) {
        return INDEX_FINISHED;
    }
    uvec4 header0 = index_texel(0u);
    uvec4 header1 = index_texel(1u);
    vec3 lower = uintBitsToFloat(header0.xyz);
    vec3 upper = uintBitsToFloat(header1.xyz);
    BoxTest world = box_test(lower, upper, ray);
    float reach = largest_component(max(abs(lower - ray.origin), abs(upper - ray.origin)));
    bvec3 world_backwards = lessThan(world.inverse, vec3(0.0));
    uint world_octant = ray_octant(world_backwards);
    RayShear shear = ray_shear(ray.origin, ray.direction);

    // Levels of the way that are left to go.
    uint replay = 0u;
    if (INDEX_RESUMES) {
        uvec4 header2 = index_texel(2u);
        uint outer = resume;
        if (resume >= header2.x) {
            // The last instance whose nodes do not come behind it.
            uint low = 0u;
            uint beyond = header2.y;
            while (beyond - low > 1u) {
                uint middle = low + beyond >> 1;
                bool behind = index_texel(header1.w + TWO_LEVEL_INSTANCE_TEXELS * middle + 1u).w > resume;
                beyond = behind ? middle : beyond;
                low = behind ? low : middle;
            }
            uint record = header1.w + TWO_LEVEL_INSTANCE_TEXELS * low;
            outer = index_texel(record + 2u).w;
            uint mesh = index_texel(TWO_LEVEL_HEADER_TEXELS + WIDE_NODE_TEXELS * outer + 2u).w;
            replay = two_level_climb(mesh + (resume - index_texel(record + 1u).w), mesh, 0u);
        }
        replay = two_level_climb(outer, 0u, replay);
    }

    BoxTest boxes = world;
    bvec3 backwards = world_backwards;
    uint octant = world_octant;
    uint node = 0u;
    uint children = 0u;
    uint slots = 0u;
    uint top = 0u;
    // Of the instance that the ray is in: root of its mesh, 0 outside of all; what is on the stack of the tree above; number of its first triangle and of
    // its root among all nodes; where it is.
    uint root = 0u;
    uint above = 0u;
    uint first_index = 0u;
    uint first_node = 0u;
    uint flags = INSTANCE_IDENTITY;
    vec3 row_x = vec3(0.0);
    vec3 row_y = vec3(0.0);
    vec3 row_z = vec3(0.0);
    vec3 translation = vec3(0.0);
    bool leaving = false;
    bool entering = false;
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
            uint texel = TWO_LEVEL_HEADER_TEXELS + WIDE_NODE_TEXELS * node;
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
                uint place = (two_level_stack_slots[TWO_LEVEL_WAY_END + 1u - replay] ^ octant) & WIDE_SLOT_MASK;
                order = replays ? order & WIDE_ORDER_MASK << place : order;
                found = replays ? 0u : found;
                replay = replays && (order >> place & 1u) != 0u ? replay - 1u : 0u;
            }
            // Carried from iteration to iteration, as in wide.glsl.
            triangles |= found;
            holds = found != 0u ? below.z : holds;
            first_triangle = found != 0u ? below.y : first_triangle;
            bool none_left = (slots & WIDE_ORDER_MASK) == 0u;
            if (order != 0u) {
                two_level_stack_children[top] = children;
                two_level_stack_slots[top] = slots;
                top += none_left ? 0u : 1u;
                children = below.x;
                slots = frame.w >> TWO_LEVEL_INSTANCE_SHIFT << TWO_LEVEL_KIND_SHIFT
                      | below.z >> WIDE_INNER_SHIFT << TWO_LEVEL_HELD_SHIFT | order;
            } else {
                leaving = leaving || root != 0u && none_left && top == above;
                if (none_left && top > 0u) {
                    --top;
                    children = two_level_stack_children[top];
                    slots = two_level_stack_slots[top];
                }
            }
            bool some_left = (slots & WIDE_ORDER_MASK) != 0u;
            uint slot = (uint(findLSB(slots)) ^ (leaving ? world_octant : octant)) & WIDE_SLOT_MASK;
            uint before = slots >> TWO_LEVEL_HELD_SHIFT & (1u << slot) - 1u;
            node = some_left ? children + uint(bitCount(before)) : INDEX_FINISHED;
            entering = entering || some_left && (slots >> TWO_LEVEL_KIND_SHIFT >> slot & 1u) != 0u;
            slots = some_left ? slots & slots - 1u : slots;
        } while (triangles == 0u && node != INDEX_FINISHED && !leaving && !entering && iterations < INDEX_QUOTA);
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
                vec3 a = q0.xyz;
                vec3 b = vec3(q0.w, q1.xy);
                vec3 c = vec3(q1.zw, uintBitsToFloat(q2.x));
                bool is_image = (flags & INSTANCE_IDENTITY) == 0u;
                a = is_image ? instance_vertex(row_x, row_y, row_z, translation, a) : a;
                b = is_image ? instance_vertex(row_x, row_y, row_z, translation, b) : b;
                c = is_image ? instance_vertex(row_x, row_y, row_z, translation, c) : c;
                bool swaps = (flags & INSTANCE_MIRRORED) != 0u;
                uint index = first_index + q2.y;
                TriangleHit candidate;
                if (intersect_triangle(shear, a, swaps ? c : b, swaps ? b : c, ray.t_min, hit.t, candidate)
                    && (candidate.t < hit.t || index < hit.triangle)) {
                    awaited = Hit(candidate.t, candidate.barycentrics, index);
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
        if (CLERESTORY_CANDIDATE_FILTER && awaiting) {
            iterations += INSTANCE_SEARCH_STEPS;
            if (accept_candidate(awaited.triangle, awaited.barycentrics)) {
                hit = awaited;
                triangles = any_hit ? 0u : triangles;
                node = any_hit ? INDEX_FINISHED : node;
            }
        }
#endif
        if (triangles == 0u && leaving) {
            boxes = world;
            backwards = world_backwards;
            octant = world_octant;
            root = 0u;
        }
        if (triangles == 0u && entering && node != INDEX_FINISHED) {
            uint texel = TWO_LEVEL_HEADER_TEXELS + WIDE_NODE_TEXELS * node;
            uvec4 x = index_texel(texel);
            uvec4 y = index_texel(texel + 1u);
            uvec4 z = index_texel(texel + 2u);
            uvec4 at = index_texel(texel + 3u);
            vec3 slack = uintBitsToFloat(index_texel(texel + 4u).xyz);
            uint record = header1.w + TWO_LEVEL_INSTANCE_TEXELS * at.w;
            uvec4 world_x = index_texel(record);
            uvec4 world_y = index_texel(record + 1u);
            uvec4 world_z = index_texel(record + 2u);
            row_x = uintBitsToFloat(world_x.xyz);
            row_y = uintBitsToFloat(world_y.xyz);
            row_z = uintBitsToFloat(world_z.xyz);
            translation = uintBitsToFloat(at.xyz);
            first_index = world_x.w;
            first_node = world_y.w;
            flags = x.w;
            root = z.w;
            node = root;
            boxes = instance_box_test(uintBitsToFloat(x.xyz), uintBitsToFloat(y.xyz), uintBitsToFloat(z.xyz), translation, slack, ray, reach);
            backwards = lessThan(boxes.inverse, vec3(0.0));
            octant = ray_octant(backwards);
            two_level_stack_children[top] = children;
            two_level_stack_slots[top] = slots;
            top += (slots & WIDE_ORDER_MASK) != 0u ? 1u : 0u;
            above = top;
            slots = 0u;
        }
        leaving = leaving && triangles != 0u;
        entering = entering && triangles != 0u;
        iterations += WIDE_ROUND_ITERATIONS;
    } while (triangles != 0u || node != INDEX_FINISHED && iterations < INDEX_QUOTA);
    index_iterations += iterations;
    if (INDEX_COUNT) {
        index_counters.iterations += iterations;
    }
    return root != 0u && node != INDEX_FINISHED ? first_node + (node - root) : node;
}

#endif
