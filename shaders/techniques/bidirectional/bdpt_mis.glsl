// Partial weights of the balance heuristic over all ways to make a path from its two ends: two numbers a subpath, carried from vertex to vertex, from which the
// weight of a whole path follows where its ends are joined, whatever its length.
//
// Source: I. Georgiev, "Implementing Vertex Connection and Merging", 2012, whose d_vcm and d_vc these are; heuristic of Veach 1997, 9.2.2. Twin:
// techniques/bidirectional/mis.rs, which proves that the weights of a path sum to one. Probabilities of Russian roulette are in none of them: weights sum
// to one without, too.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_MIS_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_MIS_GLSL

// Greatest partial weight, so that products with densities are numbers.
const float MIS_PARTIAL_MAX = 1e30;
// Least cosine between a ray and a surface that densities per area are made with.
const float MIS_COS_MIN = 1e-6;

struct PartialWeights {
    float d_vcm;
    float d_vc;
};

PartialWeights mis_bounded(PartialWeights w) {
    return PartialWeights(min(w.d_vcm, MIS_PARTIAL_MAX), min(w.d_vc, MIS_PARTIAL_MAX));
}

// Of a subpath whose ray of a squared length arrives under a cosine. A length of 1 stands for rays from an end at infinity, whose density is per area across them.
PartialWeights mis_arrive(PartialWeights w, float squared, float cos_here) {
    return mis_bounded(PartialWeights(w.d_vcm * squared / cos_here, w.d_vc / cos_here));
}

// Scattered with density `forward` under a cosine; `backward` is the density of the way back.
PartialWeights mis_scatter(PartialWeights w, float cos_out, float forward, float backward) {
    return mis_bounded(PartialWeights(1.0 / forward, cos_out / forward * (w.d_vc * backward + w.d_vcm)));
}

// Scattered by a delta lobe, where nothing is joined; `ratio` is the density of the way back over that of the way there.
PartialWeights mis_scatter_delta(PartialWeights w, float cos_out, float ratio) {
    return mis_bounded(PartialWeights(0.0, cos_out * ratio * w.d_vc));
}

// What the other ways to make a subpath weigh, but for the density per area of its last vertex from the other side; `backward` is that of its last edge backwards.
float mis_behind(PartialWeights w, float backward) { return w.d_vcm + w.d_vc * backward; }

// Weight of a path, by what those of the other ways weigh whose joint is nearer to the light, and nearer to the eye.
float mis_weight(float to_light, float to_eye) { return 1.0 / (1.0 + to_light + to_eye); }

#endif
