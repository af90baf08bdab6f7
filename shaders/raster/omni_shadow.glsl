// Omnidirectional shadow maps: what a texel spans, and from where on along its direction a receiver is in shadow. Sources and guarantees:
// raster/omni_shadow.rs.
#ifndef CLERESTORY_RASTER_OMNI_SHADOW_GLSL
#define CLERESTORY_RASTER_OMNI_SHADOW_GLSL

#include "maps/cube.glsl"
#include "maps/octahedron.glsl"
#include "maps/topology.glsl"

// How directions lie in the map.
const uint SHADOW_CUBE = 0u;
const uint SHADOW_OCTAHEDRON = 1u;

// Relative rounding of distances, of either side: differences, squares, a root.
const float SHADOW_ROUNDING = 16.0 / 16777216.0;

// How far folds towards the light keep from shading themselves, in half diagonals of the filter.
const float SHADOW_FOLD = 2.0;
// The most that a receiver's plane is moved for folds, as a share of the light's height over its plane.
const float SHADOW_MOVE_MAX = 0.125;

// A place that light reaches or not.
struct ShadowReceiver {
    vec3 to;         // from the light to where it is looked up
    float distance;  // from the light
    vec3 normal;     // of the surface, to the side of the light
    float height;    // of the light over the surface's plane, which is moved towards the light; 0 where the light may be in the plane
};

struct ShadowTexel {
    uint layer;
    ivec2 at;
};

// Half the diagonal of a square as large as the texel about a direction, radians, in a map of side x side texels per layer.
float shadow_texel_radius(uint kind, vec3 d, int side) {
    uint face;
    float density = kind == SHADOW_CUBE ? cube_density(cube_encode(d, face)) : octahedron_density(octahedron_encode(d));
    // A texel is 2 / side wide in the map's coordinates.
    return sqrt(2.0 * density) / float(side);
}

// `width`: texels that the filter is wide, 0 for none. `slack`: by how much the position may be off its plane, metres.
ShadowReceiver shadow_receiver(uint kind, int side, int width, vec3 light, vec3 position, vec3 normal, float slack) {
    ShadowReceiver r;
    r.to = position - light;
    r.normal = dot(normal, r.to) > 0.0 ? -normal : normal;
    r.distance = length(r.to);
    float half_texel = r.distance * shadow_texel_radius(kind, r.to, side);
    float height = -dot(r.normal, r.to);
    float fold = min(SHADOW_FOLD * half_texel * float(width + 1), SHADOW_MOVE_MAX * height);
    r.height = max(height - fold - slack, 0.0);
    // Off the surface, so that the texel is more often one of what is in front of it than of itself.
    r.to += half_texel * r.normal;
    return r;
}

// What is nearer than this along a unit direction shades the receiver: its moved plane, or its distance where that is nearer. Nothing is
// where the light may be in the plane, of which no side is known.
float shadow_threshold(ShadowReceiver r, vec3 direction) {
    float fall = -dot(r.normal, direction);
    if (!(r.height > 0.0)) {
        return 0.0;
    }
    return (r.height < fall * r.distance ? r.height / fall : r.distance) * (1.0 - SHADOW_ROUNDING);
}

// The texel that is so far from a layer's corner, or the one that it repeats beyond the edges.
ShadowTexel shadow_wrap(uint kind, ShadowTexel texel, int side) {
    if (kind == SHADOW_OCTAHEDRON) {
        texel.at = octahedron_wrap(texel.at, ivec2(side));
    } else if (min(texel.at.x, texel.at.y) < 0 || max(texel.at.x, texel.at.y) >= side) {
        vec3 d = cube_decode(texel.layer, (2.0 * vec2(texel.at) + 1.0) / float(side) - 1.0);
        vec2 uv = cube_encode(d, texel.layer);
        texel.at = clamp(ivec2(floor((0.5 * uv + 0.5) * float(side))), ivec2(0), ivec2(side - 1));
    }
    return texel;
}

// The unit direction of a texel's centre.
vec3 shadow_direction(uint kind, ShadowTexel texel, int side) {
    vec2 uv = (2.0 * vec2(texel.at) + 1.0) / float(side) - 1.0;
    return kind == SHADOW_CUBE ? cube_decode(texel.layer, uv) : octahedron_decode(uv);
}

// In texels of a layer.
vec2 shadow_place(uint kind, vec3 d, int side, out uint layer) {
    layer = 0u;
    vec2 uv;
    if (kind == SHADOW_CUBE) {
        uv = cube_encode(d, layer);
    } else {
        uv = octahedron_encode(d);
    }
    return (0.5 * uv + 0.5) * float(side);
}

// Weight of a filter's texel, of `count` = width + 1 along an axis, when the first is covered but for `part`; all sum to the width.
float shadow_weight(int i, int width, float part) { return i == 0 ? 1.0 - part : i == width ? part : 1.0; }

#endif
