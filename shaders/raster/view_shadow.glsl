// Shadow maps of lights that one view covers, spots and parallel light: where a receiver is in the map, from where on along a texel's ray it is in shadow; look-ups are in
// raster/view_shadow_set.glsl. Sources and guarantees: raster/view_shadow.rs.
#ifndef CLERESTORY_RASTER_VIEW_SHADOW_GLSL
#define CLERESTORY_RASTER_VIEW_SHADOW_GLSL

#include "raster/omni_shadow.glsl"

// From where a map is drawn: axes at right angles.
struct ShadowView {
    vec3 origin;       // of parallel rays, the middle of where they begin
    uint is_parallel;
    vec3 right;        // over the map's half width
    vec3 down;
    vec3 forward;      // unit
};

// A place that light reaches or not.
struct ViewReceiver {
    vec2 place;      // where it is looked up, from (-1, -1) to (1, 1)
    vec3 position;
    vec3 normal;     // of the surface, to the side of the light
    float moved;     // of the plane towards the light, m
    float distance;  // from where its ray begins; below 0 behind the light
};

// Where the ray through a place of the map begins, and its unit direction.
vec3 shadow_view_ray(ShadowView view, vec2 place, out vec3 direction) {
    vec3 across = place.x * view.right + place.y * view.down;
    bool is_parallel = view.is_parallel != 0u;
    direction = normalize(is_parallel ? view.forward : view.forward + across);
    return view.origin + (is_parallel ? across : vec3(0.0));
}

// Where a point is in the map, and in z how far along `forward`.
vec3 shadow_view_place(ShadowView view, vec3 point) {
    vec3 to = point - view.origin;
    float depth = dot(to, view.forward);
    vec2 place = vec2(dot(to, view.right) / dot(view.right, view.right), dot(to, view.down) / dot(view.down, view.down));
    return vec3(view.is_parallel != 0u ? place : place / depth, depth);
}

// `width`: texels that the filter is wide, 0 for none. `slack`: by how much the position may be off its plane, metres.
ViewReceiver shadow_view_receiver(ShadowView view, int side, int width, vec3 position, vec3 normal, float slack) {
    ViewReceiver r;
    float depth = shadow_view_place(view, position).z;
    bool is_parallel = view.is_parallel != 0u;
    vec3 to = is_parallel ? depth * view.forward : position - view.origin;
    r.position = position;
    r.normal = dot(normal, to) > 0.0 ? -normal : normal;
    r.distance = depth > 0.0 ? length(to) : -1.0;
    float half_texel = sqrt(dot(view.right, view.right) + dot(view.down, view.down)) / float(side) * (is_parallel ? 1.0 : depth);
    float height = -dot(r.normal, to);
    r.moved = min(SHADOW_FOLD * half_texel * float(width + 1), SHADOW_MOVE_MAX * height) + slack;
    // Off the surface, so that the texel is more often one of what is in front of it than of itself.
    r.place = shadow_view_place(view, position + half_texel * r.normal).xy;
    return r;
}

// What is nearer than this along the ray through a place of the map shades the receiver: its moved plane, or its distance where that is nearer. Nothing is where the
// ray may begin in the plane, of which no side is known.
float shadow_view_threshold(ShadowView view, ViewReceiver r, vec2 place) {
    vec3 direction;
    vec3 start = shadow_view_ray(view, place, direction);
    float height = dot(r.normal, start - r.position) - r.moved;
    if (!(height > 0.0)) {
        return 0.0;
    }
    float fall = -dot(r.normal, direction);
    return (height < fall * r.distance ? height / fall : r.distance) * (1.0 - SHADOW_ROUNDING);
}

#endif
