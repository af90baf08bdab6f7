// Bounds of the geometry term between two points that see each other. Source and meaning: transport/edge_bound.rs, whose twin this is.
#ifndef CLERESTORY_TRANSPORT_EDGE_BOUND_GLSL
#define CLERESTORY_TRANSPORT_EDGE_BOUND_GLSL

const uint EDGE_UNBOUNDED = 0u;
const uint EDGE_GEOMETRY = 1u;  // min(G, bound)
const uint EDGE_DISTANCE = 2u;  // the squared distance is `bound` at least

// The cosines at both ends over the squared distance, 1/m^2.
float geometry_term(float cos_a, float cos_b, float squared) { return cos_a * cos_b / squared; }

// The part of the geometry term that a bound leaves, in [0, 1]: exactly 1 where the bound does nothing. Divides by nothing that may be zero.
float bounded_share(uint kind, float bound, float cos_a, float cos_b, float squared) {
    float kept = 1.0;
    if (kind == EDGE_GEOMETRY) {
        float cosines = cos_a * cos_b;
        float most = bound * squared;
        kept = most < cosines ? most / cosines : 1.0;
    } else if (kind == EDGE_DISTANCE) {
        kept = squared < bound ? squared / bound : 1.0;
    }
    return kept;
}

// What other means that have the light of an edge up to a bound leave of it, in [0, 1]: all where there is no bound, or where the scattering at the edge's far end
// was a mirror's, of density 0.
float share_beyond(uint kind, float bound, float pdf, float cos_there, float cos_here, float squared) {
    return kind != EDGE_UNBOUNDED && pdf > 0.0 ? 1.0 - bounded_share(kind, bound, cos_there, cos_here, squared) : 1.0;
}

#endif
