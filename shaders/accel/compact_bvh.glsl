// Queries by points and by rays on compact sibling pairs; twin of clerestory::accel::photon_map::compact_bvh, to the bit where divisions are exact.
//
// The includer defines, before this file,
//   uvec4 compact_quarter(uint index);                     halves of pairs: lower planes and left reference, upper planes and right one
//   bool compact_visit_point(uint record);                 for each leaf with its first record, and with the one behind it as long as it
//                                                          returns true, if COMPACT_POINT is defined
//   float compact_visit_ray(uint first, float t_max);      the same, returning the ray's end, if COMPACT_RAY is defined
//   bool compact_visit_beam(uint record);                  as for points, if COMPACT_BEAM is defined: rays that meet all on their way, and end nowhere.
//                                                          Records count where compact_mine says so
// Loops take at most COMPACT_QUOTA steps, each a node or a record; a query that they stop returns false.
#ifndef CLERESTORY_ACCEL_COMPACT_BVH_GLSL
#define CLERESTORY_ACCEL_COMPACT_BVH_GLSL

const uint COMPACT_INDEX_BITS = 28u;
const uint COMPACT_LEAF_BIT = 1u << COMPACT_INDEX_BITS;
const uint COMPACT_MASK_SHIFT = COMPACT_INDEX_BITS + 1u;
const uint COMPACT_REFERENCE_MASK = (1u << COMPACT_MASK_SHIFT) - 1u;
// Reference of a tree that holds nothing.
const uint COMPACT_NOTHING = 0xFFFFFFFFu;
const uint COMPACT_STACK_SIZE = 96u;
// 2^36: beyond MAX_COORDINATE, and finite times the largest reciprocal, 2^88.
const float COMPACT_NO_PLANE = 68719476736.0;

layout(constant_id = 110) const uint COMPACT_QUOTA = 32768u;

struct CompactRoot {
    vec3 lower;
    uint reference;
    vec3 upper;
    uint padding;
};

// Nodes fetched and stack entries written; the caller sets them to zero.
uvec2 compact_counters = uvec2(0u);

#if defined(COMPACT_POINT) || defined(COMPACT_BEAM)
// Nodes and records of the invocation's queries so far.
uint compact_steps = 0u;

// With COMPACT_PACKET defined, by includers with the extension for subgroup votes, the points or rays of a subgroup go through the tree together:
// each child that any of them lies in or meets is visited by all.
#ifdef COMPACT_PACKET
#define COMPACT_ANY(MEETS) subgroupAny(MEETS)
#else
#define COMPACT_ANY(MEETS) (MEETS)
#endif
#endif

// Bits of the three components, x highest.
uint compact_bits(bvec3 v) { return uint(v.x) << 2 | uint(v.y) << 1 | uint(v.z); }

#ifdef COMPACT_POINT
// A pair says where a point lies only for points in its parent's box, so that with COMPACT_PACKET each invocation remembers whether its own is there.

// Includers whose queries reach less far than the boxes allow for move the boxes' planes inwards, all by one distance.
#ifndef COMPACT_LOWER
#define COMPACT_LOWER(PLANES) (PLANES)
#define COMPACT_UPPER(PLANES) (PLANES)
#endif

bool compact_point_query(CompactRoot root, vec3 point) {
    bool mine = all(lessThan(COMPACT_LOWER(root.lower), point)) && all(lessThan(point, COMPACT_UPPER(root.upper)));
    uint next = COMPACT_ANY(mine) ? root.reference : COMPACT_NOTHING;
    uint stack[COMPACT_STACK_SIZE];
#ifdef COMPACT_PACKET
    bool stack_mine[COMPACT_STACK_SIZE];
#endif
    uint top = 0u;
    uint step = 0u;
    for (; next != COMPACT_NOTHING && step < COMPACT_QUOTA; ++step) {
        bool pop = true;
        if ((next & COMPACT_LEAF_BIT) != 0u) {
            pop = !compact_visit_point(next ^ COMPACT_LEAF_BIT);
            ++next;
        } else {
            uvec4 low = compact_quarter(2u * next);
            uvec4 high = compact_quarter(2u * next + 1u);
            uint owners = low.w >> COMPACT_MASK_SHIFT << 3 | high.w >> COMPACT_MASK_SHIFT;
            uint outside = compact_bits(greaterThanEqual(COMPACT_LOWER(uintBitsToFloat(low.xyz)), point)) << 3
                         | compact_bits(lessThanEqual(COMPACT_UPPER(uintBitsToFloat(high.xyz)), point));
            bool left_mine = mine && (owners & outside) == 0u;
            bool right_mine = mine && (~owners & outside) == 0u;
            bool in_left = COMPACT_ANY(left_mine);
            bool in_right = COMPACT_ANY(right_mine);
            compact_counters.x += 2u;
            if (in_left && in_right) {
#ifdef COMPACT_PACKET
                stack_mine[top] = left_mine;
#endif
                stack[top++] = low.w & COMPACT_REFERENCE_MASK;
                ++compact_counters.y;
            }
            pop = !in_left && !in_right;
            next = (in_right ? high.w : low.w) & COMPACT_REFERENCE_MASK;
#ifdef COMPACT_PACKET
            mine = in_right ? right_mine : left_mine;
#endif
        }
        if (pop) {
            next = top > 0u ? stack[--top] : COMPACT_NOTHING;
#ifdef COMPACT_PACKET
            mine = next != COMPACT_NOTHING && stack_mine[top];
#endif
        }
    }
    compact_steps += step;
    return next == COMPACT_NOTHING;
}
#endif

#if defined(COMPACT_RAY) || defined(COMPACT_BEAM)
#include "accel/box_test.glsl"

// The part of a span in which a ray is within a box.
vec2 compact_span_within(BoxTest boxes, vec3 lower, vec3 upper, vec2 span) {
    vec2 own = box_span(boxes, lower, upper);
    return vec2(max(own.x, span.x), min(own.y, span.y));
}

bool compact_met(vec2 span) { return span.x <= span.y; }

// The parts of a span in which a ray is within both children of a pair.
void compact_spans(BoxTest boxes, uvec4 low, uvec4 high, vec2 carried, out vec2 left, out vec2 right) {
    bvec3 lower_left = notEqual(low.www & (uvec3(4u, 2u, 1u) << COMPACT_MASK_SHIFT), uvec3(0u));
    bvec3 upper_left = notEqual(high.www & (uvec3(4u, 2u, 1u) << COMPACT_MASK_SHIFT), uvec3(0u));
    vec3 lower = uintBitsToFloat(low.xyz);
    vec3 upper = uintBitsToFloat(high.xyz);
    vec3 none = vec3(COMPACT_NO_PLANE);
    left = compact_span_within(boxes, mix(-none, lower, lower_left), mix(none, upper, upper_left), carried);
    right = compact_span_within(boxes, mix(lower, -none, lower_left), mix(upper, none, upper_left), carried);
}
#endif

#ifdef COMPACT_RAY
bool compact_ray_query(CompactRoot root, Ray ray) {
    BoxTest boxes = box_test(root.lower, root.upper, ray);
    float t_max = ray.t_max;
    vec2 span = compact_span_within(boxes, root.lower, root.upper, vec2(ray.t_min, t_max));
    uint next = is_traceable(ray) && compact_met(span) ? root.reference : COMPACT_NOTHING;
    uint stack[COMPACT_STACK_SIZE];
    vec2 spans[COMPACT_STACK_SIZE];
    uint top = 0u;
    for (uint step = 0u; next != COMPACT_NOTHING && step < COMPACT_QUOTA; ++step) {
        bool pop = true;
        if ((next & COMPACT_LEAF_BIT) != 0u) {
            t_max = compact_visit_ray(next ^ COMPACT_LEAF_BIT, t_max);
        } else {
            uvec4 low = compact_quarter(2u * next);
            uvec4 high = compact_quarter(2u * next + 1u);
            vec2 left;
            vec2 right;
            compact_spans(boxes, low, high, vec2(span.x, min(span.y, t_max)), left, right);
            bool meets_left = compact_met(left);
            bool meets_right = compact_met(right);
            bool right_first = right.x < left.x;
            compact_counters.x += 2u;
            uvec2 references = uvec2(low.w, high.w) & COMPACT_REFERENCE_MASK;
            if (meets_left && meets_right) {
                stack[top] = right_first ? references.x : references.y;
                spans[top++] = right_first ? left : right;
                ++compact_counters.y;
            }
            pop = !meets_left && !meets_right;
            bool take_right = meets_right && (right_first || !meets_left);
            next = take_right ? references.y : references.x;
            span = take_right ? right : left;
        }
        if (pop) {
            next = COMPACT_NOTHING;
            while (top > 0u && next == COMPACT_NOTHING) {
                span = spans[--top];
                next = compact_met(vec2(span.x, t_max)) ? stack[top] : COMPACT_NOTHING;
            }
        }
    }
    return next == COMPACT_NOTHING;
}
#endif

#ifdef COMPACT_BEAM
// Whether the invocation's own ray meets the leaf under visit: with COMPACT_PACKET it may be one that only others meet.
#ifdef COMPACT_PACKET
bool compact_mine;
#else
const bool compact_mine = true;
#endif

// Whether the invocation counts what all that go through the tree with it fetch at once. Includers with COMPACT_PACKET that count say which one does.
#ifndef COMPACT_LEADS
#define COMPACT_LEADS true
#endif
// Records fetched, beside compact_counters.
uint compact_records = 0u;

// The empty span: of a box that a ray does not meet, and of all in it.
const vec2 COMPACT_NO_SPAN = vec2(1.0, -1.0);

// One loop, whose step is a node or a record, as in a point's query. With COMPACT_PACKET a ray that does not meet a box has no span there, and so meets nothing within; all
// meet their leaves in the same order as by themselves.
bool compact_beam_query(CompactRoot root, Ray ray) {
    BoxTest boxes = box_test(root.lower, root.upper, ray);
    vec2 span = compact_span_within(boxes, root.lower, root.upper, vec2(ray.t_min, ray.t_max));
    bool meets = is_traceable(ray) && compact_met(span);
    span = meets ? span : COMPACT_NO_SPAN;
    uint next = COMPACT_ANY(meets) ? root.reference : COMPACT_NOTHING;
    uint stack[COMPACT_STACK_SIZE];
    vec2 spans[COMPACT_STACK_SIZE];
    uint top = 0u;
    uint step = 0u;
    for (; next != COMPACT_NOTHING && step < COMPACT_QUOTA; ++step) {
        bool pop = true;
        if ((next & COMPACT_LEAF_BIT) != 0u) {
#ifdef COMPACT_PACKET
            compact_mine = compact_met(span);
#endif
            compact_records += COMPACT_LEADS ? 1u : 0u;
            pop = !compact_visit_beam(next ^ COMPACT_LEAF_BIT);
            ++next;
        } else {
            uvec4 low = compact_quarter(2u * next);
            uvec4 high = compact_quarter(2u * next + 1u);
            vec2 left;
            vec2 right;
            compact_spans(boxes, low, high, span, left, right);
            bool met_left = COMPACT_ANY(compact_met(left));
            bool met_right = COMPACT_ANY(compact_met(right));
            compact_counters.x += COMPACT_LEADS ? 2u : 0u;
            if (met_left && met_right) {
                stack[top] = low.w & COMPACT_REFERENCE_MASK;
                spans[top++] = left;
                ++compact_counters.y;
            }
            pop = !met_left && !met_right;
            next = (met_right ? high.w : low.w) & COMPACT_REFERENCE_MASK;
            span = met_right ? right : left;
        }
        if (pop) {
            next = COMPACT_NOTHING;
            if (top > 0u) {
                next = stack[--top];
                span = spans[top];
            }
        }
    }
    compact_steps += step;
    return next == COMPACT_NOTHING;
}
#endif

#endif
