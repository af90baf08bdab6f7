// An eye subpath joined to a vertex of a light subpath: the scattering at both ends, the geometry term between them, and the weight of the path against all other ways to make it. What
// stands between, and what media let through, is the includer's.
//
// An end at a collision with a medium has the phase function and no cosine, in kernels with media (CLERESTORY_MEDIA_BOUND). Veach 1997, 10; I. Georgiev, "Implementing Vertex Connection
// and Merging", 2012; E. Lafortune and Y. Willems, "Rendering Participating Media with Bidirectional Path Tracing", 1996.
// Expects a push-constant block `push` with the scene's corners `scene_lower` and `scene_upper`, the range of bounces, `key` and what bdpt_eye.glsl does, and the constants of
// transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_JOINT_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_JOINT_GLSL

#include "techniques/bidirectional/bdpt_ends.glsl"
#include "techniques/bidirectional/bdpt_eye.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "techniques/bidirectional/bdpt_vertex.glsl"
#include "walk/draws.glsl"
#include "walk/medium_ray_state.glsl"

layout(constant_id = 52) const uint CONNECTIONS = 1u;  // of a place

// Stand in walk_resume for a place that goes on in a later dispatch, and for one that has nothing to join or is done.
const uint CONNECT_STOPPED = 0xFFFFFFFEu;
const uint CONNECT_DONE = 0xFFFFFFFCu;
// Tells these draws from those of paths.
const uint CONNECT_SEED = 0x6a6f696eu;
// Loop iterations that a connection without its ray counts as.
const uint CONNECT_ITERATIONS = 8u;

// Scattering looked up at a connection, one after the other, so that its code is there once.
const uint LOOK_UP_EYE = 0u;               // at the eye's vertex, on to the light's
const uint LOOK_UP_EYE_BACK = 1u;          // there, back
const uint LOOK_UP_LIGHT_BACK = 2u;        // at the light's vertex, from the eye back along its subpath
const uint LOOK_UP_LIGHT = 3u;             // there, on to the eye
const uint LOOK_UP_EYE_GLOSSY = 4u;        // of path sets with an automaton also by the other class of lobes
const uint LOOK_UP_LIGHT_BACK_GLOSSY = 5u;
const uint LOOK_UPS = 4u;
const uint LOOK_UPS_OF_STATES = 6u;

// Where the path of an invocation has arrived.
struct Receiver {
    Arrival arrival;  // of a collision the place and the way there alone
    uint medium;      // of a collision, or NO_MEDIUM on a surface
    PartialWeights weights;
    uint interior;    // body that the way there was in
    uint bounce;      // scatterings between the point and the eye
    uint state;
    vec3 throughput;  // from the point on
};

// Four random words of a connection: the first chooses the vertex.
uvec4 connection_words(uint slot, uint bounce, uint connection) {
    return pcg4d(uvec4(walk_sequence(slot), walk_index(slot), bounce * CONNECTIONS + connection, push.key.seed ^ CONNECT_SEED));
}

// The vertex that a connection's words choose of so many.
LightVertex chosen_vertex(uvec4 words, uint vertices) {
    uint index;
    uint low;
    umulExtended(words.x, vertices, index, low);
    return load_light_vertex(index);
}

// Lobes of the ends of a joint by a class of lobes at the eye's, LOBE_DIFFUSE or LOBE_GLOSSY; a medium has one lobe, which stands in the first class.
JointLobes joint_by(Receiver r, uint lobes, vec3 wi, uint states) {
    if (!HAS_PATH_AUTOMATON) {
        return JointLobes(LOBE_ALL, LOBE_ALL);
    }
    if (is_collision(r.medium)) {
        return lobes == LOBE_DIFFUSE ? joint_lobes(r.state, LOBE_VOLUME, states) : JointLobes(0u, 0u);
    }
    return joint_lobes(r.state, lobes_between(r.arrival, r.arrival.wo, wi, lobes), states);
}

// Radiance that comes of joining both, if nothing stands between, and the way that tells.
vec3 connection(Receiver r, LightVertex vertex, out ShadowWay shadow) {
    Surface s = r.arrival.surface;
    Arrival there = end_of(vertex);
    vec3 way = there.surface.point.position - s.point.position;
    float squared = dot(way, way);
    shadow = ShadowWay(Ray(vec3(0.0), 0.0, vec3(0.0), 1.0), r.interior, 0.0);
    uint bounces = r.bounce + vertex.bounce + 2u;
    float cos_lit = end_cos(there, vertex.medium, there.wo);
    // Points in one place are on one surface, or their distance is lost to rounding.
    if (bounces < push.least_bounces || bounces > push.most_bounces || !(squared > 0.0) || !(cos_lit > 0.0)) {
        return vec3(0.0);
    }
    vec3 wi = way * inversesqrt(squared);
    JointLobes first = joint_by(r, LOBE_DIFFUSE, wi, vertex.states);
    JointLobes second = joint_by(r, LOBE_GLOSSY, wi, vertex.states);
    if (HAS_PATH_AUTOMATON && (first.there | second.there) == 0u) {
        return vec3(0.0);
    }
    vec4 here = vec4(0.0);
    vec4 lit = vec4(0.0);
    vec3 here_glossy = vec3(0.0);
    vec3 lit_glossy = vec3(0.0);
    float here_back = 0.0;
    float lit_on = 0.0;
    uint look_up = LOOK_UP_EYE;
    do {
        bool glossy = HAS_PATH_AUTOMATON && look_up >= LOOK_UP_EYE_GLOSSY;
        bool at_eye = glossy ? look_up == LOOK_UP_EYE_GLOSSY : look_up < LOOK_UP_LIGHT_BACK;
        vec3 across = at_eye ? wi : -wi;
        vec3 along = at_eye ? r.arrival.wo : there.wo;
        bool comes_along = look_up == LOOK_UP_EYE || look_up == LOOK_UP_LIGHT || (glossy && at_eye);
        Arrival end = there;
        if (at_eye) {
            end = r.arrival;
        }
        uint lobes = PATH_SET_LOBES;
        if (HAS_PATH_AUTOMATON) {
            lobes = look_up == LOOK_UP_EYE ? first.here : look_up == LOOK_UP_LIGHT_BACK ? first.there : lobes;
            lobes = glossy ? (at_eye ? second.here : second.there) : lobes;
        }
        uint medium = at_eye ? r.medium : vertex.medium;
        vec4 found = end_scattering(end, medium, comes_along ? along : across, comes_along ? across : along, lobes);
        here = look_up == LOOK_UP_EYE ? found : here;
        here_back = look_up == LOOK_UP_EYE_BACK ? found.a : here_back;
        lit = look_up == LOOK_UP_LIGHT_BACK ? found : lit;
        lit_on = look_up == LOOK_UP_LIGHT ? found.a : lit_on;
        if (HAS_PATH_AUTOMATON) {
            here_glossy = look_up == LOOK_UP_EYE_GLOSSY ? found.rgb : here_glossy;
            lit_glossy = look_up == LOOK_UP_LIGHT_BACK_GLOSSY ? found.rgb : lit_glossy;
        }
        look_up += 1u;
    } while (look_up < (HAS_PATH_AUTOMATON ? LOOK_UPS_OF_STATES : LOOK_UPS));
    float cos_there = end_cos(there, vertex.medium, wi);
    vec3 both = here.rgb * lit.rgb;
    if (HAS_PATH_AUTOMATON) {
        both += here_glossy * lit_glossy;
    }
    vec3 found = both * vertex.power * (cos_there / (cos_lit * squared));
    if (found == vec3(0.0)) {
        return vec3(0.0);
    }
    if (STRATEGY == STRATEGY_COMBINED) {
        float to_light = here.a * end_mis_cos(there, vertex.medium, wi) / squared * mis_behind(vertex.weights, lit.a);
        float to_eye = lit_on * end_mis_cos(r.arrival, r.medium, wi) / squared * mis_behind(r.weights, here_back);
        found *= mis_weight(to_light, to_eye);
    }
    bool inwards = !is_collision(r.medium) && dot(wi, s.geometric_normal) < 0.0;
    if (HAS_ABSORPTION && !HAS_MEDIA) {
        uint passed = r.arrival.solid ? (inwards ? s.material : OUTSIDE) : r.interior;
        found = absorbed(found, passed, sqrt(squared));
    }
    vec3 end;
    shadow_segment(s.point, end_normal(r.arrival, r.medium), there.surface.point, end_normal(there, vertex.medium), shadow.ray.origin, end);
    shadow.ray.direction = end;
    if (HAS_MEDIA && !is_collision(r.medium)) {
        shadow.interior = r.arrival.solid ? (inwards ? s.material : s.around) : r.interior;
        shadow.start = -way_left_out(s, shadow.ray.origin, wi) / length(end);
    }
    return finite_or_black(found);
}

#endif
