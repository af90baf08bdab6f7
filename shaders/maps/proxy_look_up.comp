#version 460
// Radiance of what rays meet by maps without distances, with a simple shape in place of the surroundings, one ray an invocation; texels are the nearest. Sources, bias
// and guarantees: maps/impostor/proxy_maps.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/impostor_encode.glsl"
#include "maps/impostor_query.glsl"
#include "maps/proxy.glsl"

// What stands in for the surroundings; without it all is infinitely far.
layout(constant_id = 137) const uint PROXY_SHAPE = PROXY_NONE;
// Whether the two nearest maps are blended, instead of the nearest one alone.
layout(constant_id = 138) const bool PROXY_BLENDS = false;

layout(push_constant, scalar) uniform Push {
    ivec2 size;    // texels of a layer of a map
    uint count;    // rays
    uint maps;
    float radius;  // of a sphere or a hemisphere about a map's place
    vec3 low;      // corners of a box
    vec3 high;
    vec3 up;       // unit normal of a hemisphere's ground
} push;

// The direction, of any length, in which the nearest map was looked up, and the radiance of what was.
struct ProxyHit {
    vec3 direction;
    vec3 radiance;
};

// Rays in the axes of the maps' places.
layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ImpostorQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer Places { vec3 places[]; };
// Map by map, each layer by layer, row by row.
layout(set = 0, binding = 2) uniform textureBuffer texels;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer Hits { ProxyHit hits[]; };

vec3 map_place(uint i) { return places[i]; }

#include "maps/map_places.glsl"

// Where a map shows what the ray meets; the ray's own direction at the map's place itself.
vec3 proxy_direction(uint map, vec3 origin, vec3 r) {
    vec3 place = map_place(map);
    vec3 x = origin - place;
    vec3 l = r;
    switch (PROXY_SHAPE) {
    case PROXY_SPHERE: l = x + sphere_proxy(x, r, push.radius) * r; break;
    case PROXY_BOX: l = x + box_proxy(x, r, push.low - place, push.high - place) * r; break;
    case PROXY_HEMISPHERE: l = x + hemisphere_proxy(x, push.up, push.radius) * r; break;
    }
    return l == vec3(0.0) ? r : l;
}

vec3 proxy_radiance(uint map, vec3 l) {
    uint face;
    vec2 uv = impostor_encode(l, length(l), face);
    ivec2 p = clamp(ivec2(uv * vec2(push.size)), ivec2(0), push.size - 1);
    uint layers = DIRECTIONAL_KIND == DIRECTIONAL_CUBE ? CUBE_FACES : 1u;
    return texelFetch(texels, (int(map * layers + face) * push.size.y + p.y) * push.size.x + p.x).rgb;
}

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ImpostorQuery query = queries[i];
        float weight;
        uvec2 maps = blended_maps(push.maps, query.origin, weight);
        vec3 l = proxy_direction(maps.x, query.origin, query.direction);
        vec3 radiance = proxy_radiance(maps.x, l);
        if (PROXY_BLENDS) {
            vec3 other = proxy_direction(maps.y, query.origin, query.direction);
            radiance = mix(radiance, proxy_radiance(maps.y, other), weight);
        }
        hits[i] = ProxyHit(l, radiance);
    }
}
