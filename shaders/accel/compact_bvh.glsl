// Queries by points and by rays on compact sibling pairs; twin of clerestory::accel::photon_map::compact_bvh, to the bit where divisions are exact.
//
// The includer defines, before this file,
//   uvec4 compact_quarter(uint index);                     halves of pairs: lower planes and left reference, upper planes and right one
//   bool compact_visit_point(uint record);                 for each leaf with its first record, and with the one behind it as long as it
//                                                          returns true, if COMPACT_POINT is defined
//   float compact_visit_ray(uint first, float t_max);      the same, returning the ray's end, if COMPACT_RAY is defined
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
const float COMPACT_PARALLEL_COMPONENT = 1.0e-20;
const float COMPACT_NO_PLANE = 1.0e17;
// Units in the last place: each of two distances is a rounded difference times a reciprocal of up to 2.5.
const float COMPACT_SPAN_SLACK = 8.0 / 8388608.0;

layout(constant_id = 110) const uint COMPACT_QUOTA = 32768u;

struct CompactRoot {
    vec3 lower;
    uint reference;
    vec3 upper;
    uint padding;
};

// Nodes fetched and stack entries written; the caller sets them to zero.
uvec2 compact_counters = uvec2(0u);

// Bits of the three components, x highest.
uint compact_bits(bvec3 v) { return uint(v.x) << 2 | uint(v.y) << 1 | uint(v.z); }

#ifdef COMPACT_POINT
// With COMPACT_PACKET defined, by includers with the extension for subgroup votes, the points of a subgroup go through the tree together:
// each child that holds any of them is visited by all. A pair says where a point lies only for points in its parent's box, so that each
// invocation remembers whether its own is there.
#ifdef COMPACT_PACKET
#define COMPACT_ANY(MEETS) subgroupAny(MEETS)
#else
#define COMPACT_ANY(MEETS) (MEETS)
#endif

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
    for (uint step = 0u; next != COMPACT_NOTHING && step < COMPACT_QUOTA; ++step) {
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
    return next == COMPACT_NOTHING;
}
#endif

#ifdef COMPACT_RAY
// Entry and exit distance of a box within a span.
vec2 compact_span(vec3 lower, vec3 upper, vec3 origin, vec3 inverse, bvec3 parallel, vec2 span) {
    precise vec3 t0 = (lower - origin) * inverse;
    precise vec3 t1 = (upper - origin) * inverse;
    vec3 enter = min(t0, t1);
    vec3 leave = max(t0, t1);
    bool beside = false;
    for (uint axis = 0u; axis < 3u; ++axis) {
        if (parallel[axis]) {
            beside = beside || !(lower[axis] <= origin[axis] && origin[axis] <= upper[axis]);
        } else {
            span = vec2(max(span.x, enter[axis]), min(span.y, leave[axis]));
        }
    }
    return beside ? vec2(COMPACT_NO_PLANE, -COMPACT_NO_PLANE) : span;
}

bool compact_met(vec2 span) {
    precise float end = span.y + abs(span.y) * COMPACT_SPAN_SLACK;
    return span.x <= end;
}

bool compact_ray_query(CompactRoot root, vec3 origin, vec3 direction, float t_min, float t_max) {
    bvec3 parallel = lessThanEqual(abs(direction), vec3(COMPACT_PARALLEL_COMPONENT));
    vec3 inverse = 1.0 / mix(direction, vec3(1.0), parallel);
    t_max = min(t_max, COMPACT_NO_PLANE);
    vec2 span = compact_span(root.lower, root.upper, origin, inverse, parallel, vec2(t_min, t_max));
    uint next = compact_met(span) ? root.reference : COMPACT_NOTHING;
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
            bvec3 lower_left = notEqual(low.www & (uvec3(4u, 2u, 1u) << COMPACT_MASK_SHIFT), uvec3(0u));
            bvec3 upper_left = notEqual(high.www & (uvec3(4u, 2u, 1u) << COMPACT_MASK_SHIFT), uvec3(0u));
            vec3 lower = uintBitsToFloat(low.xyz);
            vec3 upper = uintBitsToFloat(high.xyz);
            vec3 none = vec3(COMPACT_NO_PLANE);
            vec2 carried = vec2(span.x, min(span.y, t_max));
            vec2 left = compact_span(mix(-none, lower, lower_left), mix(none, upper, upper_left), origin, inverse, parallel, carried);
            vec2 right = compact_span(mix(lower, -none, lower_left), mix(upper, none, upper_left), origin, inverse, parallel, carried);
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

#endif
