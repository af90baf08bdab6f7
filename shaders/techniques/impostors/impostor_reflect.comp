#version 460
// Radiance that smooth surfaces mirror where eye paths first arrive, by a map of radiance and distance: one place an invocation. The surface's own mirrored
// direction and weight are the path tracer's; what the reflected ray meets is searched for in the map's distances, or taken to lie in the ray's own direction or
// on the box about the scene. Where that is asked for, the refracted ray is followed likewise.
//
// Sources, bias and guarantees: techniques/impostors/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "walk/wave.glsl"
#include "maps/impostor_set.glsl"
#include "techniques/impostors/reflection_record.glsl"
#include "transport/arrival.glsl"
#include "transport/path_set.glsl"

layout(constant_id = 150) const bool REFLECTS_IN_BOX = false;  // the box about the scene stands for distances
layout(constant_id = 151) const bool KEEPS_LOOK_UPS = false;
layout(constant_id = 152) const bool REFRACTS = false;  // rays that are refracted are followed, too

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint first_triangle;  // of what reflects
    vec3 scene_upper;
    uint end_triangle;
    vec3 place;           // of the map
    float tolerance;      // residual of what counts as found
    uint side;            // texels across and down
    uint keeps;           // whether this wave's look-ups are kept, where KEEPS_LOOK_UPS says that any are
} push;

// Octahedron of directions, row by row without a border; layer of surfaces by layer.
layout(set = 3, binding = 0, scalar) restrict readonly buffer MapRadiance { vec3 map_radiance[]; };
layout(set = 3, binding = 1, scalar) restrict buffer ReflectionCounters {
    uint reflections;  // rays of both kinds
    uint refractions;  // the refracted ones
    uint sky;          // rays that met nothing
    uint unfound;      // searches that ended beside surfaces
} reflection_counters;
layout(set = 3, binding = 2, scalar) restrict writeonly buffer ReflectionRecords { ReflectionRecord reflection_records[]; };  // by slot

// Stands in walk_resume for a place that has been reflected.
const uint REFLECTION_DONE = 0xFFFFFFFCu;
// Loop iterations that a place counts as, beside its steps.
const uint REFLECTION_ITERATIONS = 4u;

vec3 map_texel(uint layer, ivec2 p) {
    ivec2 size = ivec2(int(push.side));
    if (min(p.x, p.y) < 0 || any(greaterThanEqual(p, size))) {
        p = octahedron_wrap(p, size);
    }
    return map_radiance[(int(layer) * size.y + p.y) * size.x + p.x];
}

// Radiance of a layer from a unit direction, bilinear over the octahedron's edges.
vec3 map_look_up(uint layer, vec3 d) {
    vec2 place = (0.5 * octahedron_encode(d) + 0.5) * float(push.side) - 0.5;
    vec2 corner = floor(place);
    vec2 part = place - corner;
    ivec2 p = ivec2(corner);
    vec3 upper = mix(map_texel(layer, p), map_texel(layer, p + ivec2(1, 0)), part.x);
    vec3 lower = mix(map_texel(layer, p + ivec2(0, 1)), map_texel(layer, p + ivec2(1, 1)), part.x);
    return mix(upper, lower, part.y);
}

// Where the map shows what a ray meets, from x beside the map's place.
ImpostorHit reflected_hit(vec3 x, vec3 r) {
    if (REFLECTS_IN_BOX) {
        float d = box_proxy(x, r, push.scene_lower - push.place, push.scene_upper - push.place);
        vec3 l = x + d * r;
        float size = length(l);
        return ImpostorHit(size > 0.0 ? l / size : r, d, 0.0, 0u);
    }
    vec2 extent = IMPOSTOR_METHOD == IMPOSTOR_CLASSICAL ? vec2(0.0) : impostor_extent;
    return impostor_search(x, r, extent, push.tolerance);
}

// Adds what lies along the mirrored or the refracted ray, where there is one.
void follow(uint slot, WalkState path, Arrival a, ScatteringFrame frame, uint kind) {
    uint lobe = LOBE_SPECULAR & (kind == REFLECTION_REFRACTED ? LOBE_TRANSMISSION : LOBE_REFLECTION);
    // One lobe alone: no number chooses.
    BsdfSample mirror = bsdf_sample(a.bsdf, frame.wo, vec3(0.5), lobe);
    vec3 r = normalize(frame_to_world(frame, mirror.wi));
    if (mirror.flags == 0u || !sides_agree(frame.z, frame.outward, r)) {
        return;
    }
    vec3 x = a.surface.point.position - push.place;
    ImpostorHit found = reflected_hit(x, r);
    // A ray that is none finds nothing.
    if (dot(found.direction, found.direction) > 0.0) {
        vec3 light = path.throughput * mirror.weight * map_look_up(IMPOSTOR_LAYERS > 1u ? found.layer : 0u, found.direction);
        // What is infinitely far is seen as by the path tracer: nothing is absorbed of it.
        bool enters = kind == REFLECTION_REFRACTED && a.solid && frame.wo.z > 0.0 && found.distance < IMPOSTOR_NOTHING;
        walk_gathered[slot].radiance += absorbed(light, enters ? a.surface.material : OUTSIDE, found.distance);
    }
    bool searches = !REFLECTS_IN_BOX && IMPOSTOR_METHOD != IMPOSTOR_CLASSICAL;
    atomicAdd(reflection_counters.reflections, 1u);
    if (kind == REFLECTION_REFRACTED) {
        atomicAdd(reflection_counters.refractions, 1u);
    }
    if (searches && found.distance >= IMPOSTOR_NOTHING) {
        atomicAdd(reflection_counters.sky, 1u);
    } else if (searches && !(found.residual < push.tolerance)) {
        atomicAdd(reflection_counters.unfound, 1u);
    }
    if (KEEPS_LOOK_UPS && push.keeps != 0u) {
        SurfacePoint point = a.surface.point;
        vec3 start = offset_ray_origin(point.position, point.error, a.surface.geometric_normal, r);
        reflection_records[slot] = ReflectionRecord(x, found.residual, r, kind, found.direction, start);
    }
}

void reflect_at(uint slot, uint place) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    uint bounce = HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce;
    if (bounce != 0u || hit.triangle == NO_HIT || hit.triangle < push.first_triangle || hit.triangle >= push.end_triangle) {
        return;
    }
    Arrival a = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(a) || !bsdf_is_delta(a.bsdf)) {
        return;
    }
    // One that begins inside a body learns it where it arrives, as the path tracer's do.
    path.throughput = absorbed(path.throughput, arrival_interior(a, OUTSIDE), hit.t);
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    follow(slot, path, a, frame, REFLECTION_MIRRORED);
    if (REFRACTS) {
        follow(slot, path, a, frame, REFLECTION_REFRACTED);
    }
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    if (walk_resume[place] == REFLECTION_DONE) {
        return;
    }
    if (!has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = REFLECTION_DONE;
    reflect_at(load_slot(place), place);
    bool marches = IMPOSTOR_METHOD == IMPOSTOR_MARCH;
    uint searches = REFRACTS ? 2u : 1u;
    count_work(REFLECTION_ITERATIONS + searches * IMPOSTOR_LAYERS * (IMPOSTOR_STEPS + (marches ? IMPOSTOR_BISECTIONS : 0u)), WORK_UNIT);
}
