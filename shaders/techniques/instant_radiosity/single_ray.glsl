// Visibility of a virtual light by a ray that does not go on in another dispatch. Expects accel/index.glsl with candidates by HAS_ALPHA, and visibility.glsl.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SINGLE_RAY_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SINGLE_RAY_GLSL

// Whether nothing stands on the ray's way, which is so without a ray where nothing tells; `stopped` where its quota stops it.
bool single_ray_arrives(Ray ray, out bool stopped) {
    stopped = false;
    if (VISIBILITY == VISIBILITY_NONE) {
        return true;
    }
    if (HAS_ALPHA) {
        // Cut-outs are there or not, whoever asks.
        candidate_key = uvec4(0u);
    }
    Hit hit = no_hit(ray.t_max);
    stopped = any_hit(ray, INDEX_START, hit) != INDEX_FINISHED;
    return hit.triangle == NO_HIT;
}

#endif
