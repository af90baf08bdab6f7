// Lobes as sums of boxes of a summed-area table. Sources and guarantees: maps/box_lobe.rs.
#ifndef CLERESTORY_MAPS_BOX_LOBE_GLSL
#define CLERESTORY_MAPS_BOX_LOBE_GLSL

#include "maps/directional_map.glsl"
#include "maps/spherical_sat.glsl"
#include "scene/normal_map.glsl"

struct LobeBox {
    vec3 direction;     // of its middle, in the frame about the lobe
    float solid_angle;  // sr
    float weight;       // of its mean
};

// Half the side, over the map's height, of a box that holds a solid angle where the map is as dense as at a place, and at poles as the row of
// texels there.
float sat_half_width(vec2 uv, float solid_angle) {
    bool is_wide = DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG || DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR;
    float aspect = is_wide ? 2.0 : 1.0;
    float least = DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG ? lat_long_pole_density(float(sat_shape.size.y)) : 0.0;
    return 0.5 * sqrt(aspect * solid_angle / max(directional_density(uv), least));
}

#endif
