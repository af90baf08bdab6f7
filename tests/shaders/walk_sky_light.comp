#version 460
// Ambient occlusion twice over, by a host's own walks: where a walk arrives first, a shadow ray is sent into the hemisphere (red), and the walk goes on in the same
// direction, to find out by itself whether something is there (green), and how steeply it goes (blue). In scenes with media the shadow ray is weakened by them; walks
// take no notice, and their boundaries hide nothing.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/arrival.glsl"
#include "transport/warp.glsl"
#include "walk/hand_on.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    vec3 scene_upper;
    WalkKey key;
} push;

#include "walk/draws.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    WalkState walk = load_walk(slot);
    Hit hit = load_hit(place);
    uint flags = 0u;
    bool is_open = hit.triangle == NO_HIT;
    if (HAS_MEDIA && !is_open) {
        is_open = (load_material(load_triangle(hit.triangle).material).flags & MATERIAL_BOUNDARY) != 0u;
    }
    if (walk.bounce > 0u && is_open) {
        walk_gathered[slot].radiance += vec3(0.0, walk.throughput.g, walk.direction.y);
    }
    if (walk.bounce == 0u && hit.triangle != NO_HIT) {
        Arrival a = arrival_at(hit, walk.direction, push.scene_lower, push.scene_upper);
        vec3 x;
        vec3 y;
        orthonormal_basis(a.facing, x, y);
        vec3 local = square_to_cosine_hemisphere(bounce_sample(slot, walk.bounce, DIMENSION_DIRECTION));
        vec3 wi = normalize(local.x * x + local.y * y + local.z * a.facing);
        walk.origin = departure(a, wi, walk.throughput);
        walk.direction = wi;
        walk.throughput *= a.bsdf.base_color;
        walk.bounce = 1u;
        ShadowRay to_sky = ShadowRay(walk.origin, FAR_AWAY, wi, slot, vec3(walk.throughput.r, 0.0, 0.0), walk.bounce);
        // The floor and its air are outside of all bodies, and their ways begin where the rays do.
        flags = store_shadow_ray(place, to_sky, OUTSIDE, 0.0) | store_walk(slot, walk, 0.0);
    }
    walk_flags_out[place] = flags;
}
