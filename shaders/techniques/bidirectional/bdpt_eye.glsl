// Partial weights of eye subpaths. Expects: a push-constant block `push` with `camera_forward`, the camera's axis, and `camera_measure`: light subpaths of a sample
// times a pixel's area at distance 1 from the camera (orthographic: in m2), or 0 where none meets the camera.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_EYE_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_EYE_GLSL

#include "techniques/bidirectional/bdpt_both_ways.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"

// Where the path in a slot has arrived under a cosine, its ray `way` long.
PartialWeights eye_weights_under(uint slot, WalkState path, float cos_here, float way) {
    PartialWeights w = subpath_weights[slot];
    float squared = way * way;
    if (path.bounce == 0u) {
        // Light subpaths of a sample, over the density of the camera's rays.
        float cos_camera = PARALLEL_CAMERA ? 1.0 : dot(path.direction, push.camera_forward);
        w = PartialWeights(push.camera_measure * cos_camera * cos_camera * cos_camera, 0.0);
        squared = PARALLEL_CAMERA ? 1.0 : squared;
    }
    return mis_arrive(w, squared, cos_here);
}

// At a surface.
PartialWeights eye_weights(uint slot, WalkState path, Arrival a, float way) { return eye_weights_under(slot, path, surface_cos(a, a.wo), way); }

#endif
