#version 460
// Photons of media that emit, in the place of a share of those that have left lights: one slot each, with the footprints of their source.
//
// A source by what it may send, a place in it evenly, or in a grid in proportion to the density, by rejection, and a direction evenly. A place that is in another medium
// carries nothing: the winding numbers of bodies tell, by the solid angles of their triangles (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983).
// Deterministic in (seed, pass, photon).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_history.glsl"
#include "scene/media.glsl"
#include "transport/differentials.glsl"
#include "transport/glow.glsl"
#include "transport/path_set.glsl"
#include "transport/warp.glsl"
#include "walk/wave.glsl"

layout(set = 1, binding = 0, scalar) restrict readonly buffer GlowSources { GlowSource glow_sources[]; };
layout(set = 1, binding = 1, scalar) restrict readonly buffer GlowBodies { GlowBody glow_bodies[]; };
layout(set = 1, binding = 2, scalar) restrict readonly buffer GlowCorners { float glow_corners[]; };  // nine for each triangle
layout(set = 1, binding = 3, scalar) restrict writeonly buffer GlowDifferentials { Differentials glow_differentials[]; };  // by slot

layout(push_constant, scalar) uniform Push {
    WalkKey key;       // the sequence is the pass, places in it photons
    float share;       // of photons that media send
    uint sources;
    uint bodies;
    uint surrounding;  // index of the medium outside all bodies, or NO_MEDIUM
    uint outside;      // stands for the material of a body where there is none around
    float placeless2;  // carried by photons, m2 (transport/photon_share.glsl); 0 where they carry none
} push;

#include "walk/draws.glsl"

// Tells these draws from others of the photon.
const uint GLOW_KEY = 0x676c6f77u;

vec3 glow_corner(uint number) { return vec3(glow_corners[3u * number], glow_corners[3u * number + 1u], glow_corners[3u * number + 2u]); }

// Signed solid angle of a triangle with these corners, seen from the origin, sr.
float solid_angle(vec3 a, vec3 b, vec3 c) {
    float la = length(a);
    float lb = length(b);
    float lc = length(c);
    float above = dot(cross(a, b), c);
    float below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    return above == 0.0 ? 0.0 : 2.0 * atan(above, below);
}

bool contains(GlowBody body, vec3 at) {
    if (any(lessThan(at, body.lower)) || any(greaterThan(at, body.upper))) {
        return false;
    }
    float whole = 0.0;
    for (uint i = 0u; i < body.triangles; ++i) {
        uint corner = 3u * (body.first + i);
        whole += solid_angle(glow_corner(corner) - at, glow_corner(corner + 1u) - at, glow_corner(corner + 2u) - at);
    }
    // Once around is 4 pi.
    return abs(whole) > 2.0 * PI;
}

// A place in the unit cube of a grid in proportion to the density, from the first one on; false where none is found.
bool place_in_grid(SceneMedium m, uvec4 key, inout vec3 u) {
    uvec4 bits = pcg4d(key + uvec4(1u, 0u, 0u, 0u));
    for (uint i = 0u; i < GLOW_TRIES; ++i) {
        if (unit_float(bits.w) * m.density_max < density_in_cells(m, u * vec3(m.cells))) {
            return true;
        }
        u = vec3(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z));
        bits = pcg4d(bits);
    }
    return false;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.key.indices) {
        return;
    }
    uvec4 key = pcg4d(uvec4(walk_sequence(slot), walk_index(slot), GLOW_KEY, push.key.seed));
    if (unit_float(key.x) >= push.share) {
        return;
    }
    float choice = unit_float(key.y);
    uint index = 0u;
    while (index + 1u < push.sources && choice >= glow_sources[index].until) {
        ++index;
    }
    GlowSource source = glow_sources[index];
    uvec2 point = sampler_bits(walk_sampler(slot, DIMENSION_START_POINT));
    uvec2 direction = sampler_bits(walk_sampler(slot, DIMENSION_START_DIRECTION));
    vec3 u = vec3(unit_float(point.x), unit_float(point.y), unit_float(key.z));
    bool found = true;
    if (HAS_GRIDS) {
        SceneMedium m = load_medium(source.medium);
        found = m.has_grid == 0u || place_in_grid(m, key, u);
    }
    vec3 at = source.corner + u.x * source.edge_x + u.y * source.edge_y + u.z * source.edge_z;
    uint interior = push.outside;
    uint medium = push.surrounding;
    for (uint i = 0u; i < push.bodies; ++i) {
        GlowBody body = glow_bodies[i];
        if (contains(body, at)) {
            interior = body.material;
            medium = body.medium;
            break;
        }
    }
    vec3 w = square_to_sphere(vec2(unit_float(direction.x), unit_float(direction.y)));
    vec3 power = found && medium == source.medium ? source.power / push.share : vec3(0.0);
    walk_states_out[slot] = WalkState(at, 1.0, normalize(w), path_set_joined(0u, PHOTON_UNDIFFUSED), power, push.placeless2);
    walk_gathered[slot] = GatheredLight(vec3(0.0), interior);
    if (HAS_DIFFERENTIALS) {
        Differentials d = area_light_differentials(w, 0.25 * INV_PI, 1.0 / (source.side * source.side), 4.0 * PI);
        glow_differentials[slot] = roulette_differentials(d, push.share * source.probability);
    }
}
