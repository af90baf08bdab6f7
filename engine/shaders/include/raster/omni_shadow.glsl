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

// The image of a texel changes by less than this share over the texels along a side while one goes to the next texel.
const float SHADOW_CHANGE = 4.0;
// Filters are taken to span this much at most, radians.
const float SHADOW_SPAN_MAX = 0.75;

// A place that light reaches or not, moved off its surface.
struct ShadowReceiver {
    vec3 to;         // from the light, moved
    float distance;  // of the place before it was moved
    vec3 normal;     // of the surface, to the side of the light
    float height;    // of the light over the plane through the place; not positive for one that it does not shine on
};

struct ShadowTexel {
    uint layer;
    ivec2 at;
};

// Half the longer diagonal of a texel's image on the sphere, radians, in a map of side x side texels a layer.
float shadow_texel_radius(uint kind, vec3 d, int side) {
    vec3 p;
    vec3 across;
    vec3 down;
    if (kind == SHADOW_CUBE) {
        // Any face's axes do: the largest component is the face's normal.
        vec3 a = abs(d);
        a = a.z >= a.x && a.z >= a.y ? a : a.y >= a.x ? a.zxy : a.yzx;
        p = vec3(a.xy / a.z, 1.0);
        across = vec3(1.0, 0.0, 0.0);
        down = vec3(0.0, 1.0, 0.0);
    } else {
        vec2 s = octahedron_signs(d.xy);
        p = d / (abs(d.x) + abs(d.y) + abs(d.z));
        across = d.z < 0.0 ? vec3(0.0, -s.x * s.y, -s.x) : vec3(1.0, 0.0, -s.x);
        down = d.z < 0.0 ? vec3(-s.x * s.y, 0.0, -s.y) : vec3(0.0, 1.0, -s.y);
    }
    float squared = dot(p, p);
    vec3 one = across + down;
    vec3 other = across - down;
    one -= p * (dot(p, one) / squared);
    other -= p * (dot(p, other) / squared);
    // A texel is 2 / side wide in the map's coordinates.
    return sqrt(max(dot(one, one), dot(other, other)) / squared) / float(side);
}

// `width`: texels that the filter is wide, 0 for none. `slack`: by how much the position may be off its plane, metres.
ShadowReceiver shadow_receiver(uint kind, int side, int width, vec3 light, vec3 position, vec3 normal, float slack) {
    ShadowReceiver r;
    r.to = position - light;
    r.normal = dot(normal, r.to) > 0.0 ? -normal : normal;
    r.distance = length(r.to);
    // Centres of texels that count are no farther away than this.
    float span = shadow_texel_radius(kind, r.to, side) * float(width + 1) * (1.0 + SHADOW_CHANGE / float(side));
    r.to += r.normal * (r.distance * tan(min(span, SHADOW_SPAN_MAX)) + slack);
    r.height = -dot(r.normal, r.to);
    return r;
}

// What is nearer than this along a unit direction shades the receiver: its own plane, or its distance where that is nearer.
float shadow_threshold(ShadowReceiver r, vec3 direction) {
    float fall = -dot(r.normal, direction);
    // The plane is met within the distance.
    bool is_met = r.height > 0.0 && r.height < fall * r.distance;
    return (is_met ? r.height / fall : r.distance) * (1.0 - SHADOW_ROUNDING);
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
