#version 460
// Shader functions that read no tables, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

const bool SEPARABLE_MASKING = false;

#include "accel/offset.glsl"
#include "accel/sphere.glsl"
#include "accel/triangle.glsl"
#include "film/two_float.glsl"
#include "techniques/bidirectional/bdpt_mis.glsl"
#include "techniques/instant_radiosity/history.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/resampling.glsl"
#include "transport/densest_band.glsl"
#include "transport/edge_bound.glsl"
#include "transport/fresnel.glsl"
#include "transport/ggx.glsl"
#include "transport/lights.glsl"
#include "transport/medium.glsl"
#include "transport/phase.glsl"
#include "transport/phong.glsl"
#include "transport/shading_normal.glsl"
#include "transport/warp.glsl"

void out_pair(uint i, TwoFloat x) { out2(i, vec2(x.hi, x.lo)); }

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // warps of the square
        out2(0u, square_to_disk(in2(0u)));
        out3(2u, square_to_cosine_hemisphere(in2(0u)));
        out3(5u, square_to_sphere(in2(0u)));
        out3(8u, square_to_hemisphere(in2(0u)));
        out3(11u, square_to_triangle(in2(0u)));
        break;
    }
    case 1u: {  // cone, and the bases about a unit vector
        out3(0u, square_to_cone(in2(0u), in1(2u)));
        out1(3u, cone_pdf(in1(2u)));
        out1(4u, cosine_hemisphere_pdf(in1(3u)));
        vec3 t;
        vec3 b;
        orthonormal_basis(in3(4u), t, b);
        out3(5u, t);
        out3(8u, b);
        break;
    }
    case 2u: {  // Fresnel
        out1(0u, fresnel_f0(in1(1u)));
        out1(1u, fresnel_dielectric(in1(0u), in1(1u)));
        out3(2u, fresnel_schlick(in1(0u), in3(2u)));
        out3(5u, fresnel_conductor(in1(0u), in3(2u), in3(5u)));
        break;
    }
    case 3u: {  // GGX
        vec3 wo = in3(0u);
        float alpha = in1(3u);
        out3(0u, ggx_sample_visible(wo, alpha, in2(4u)));
        out1(3u, ggx_d(in3(6u), alpha));
        out1(4u, ggx_g1(wo.z, alpha));
        out1(5u, ggx_g2(wo.z, in1(9u), alpha));
        out1(6u, ggx_visible_pdf(wo, in3(6u), alpha));
        break;
    }
    case 4u: {  // lights
        out1(0u, area_to_solid_angle(in1(0u), in1(1u), in1(2u)));
        out1(1u, spot_falloff(in1(3u), in1(4u), in1(5u)));
        out1(2u, balance_heuristic(in1(6u), in1(7u)));
        out1(3u, power_heuristic(in1(6u), in1(7u)));
        out3(4u, triangle_point(in3(8u), in3(11u), in3(14u), in2(17u)));
        break;
    }
    case 5u: {  // phase functions
        out1(0u, henyey_greenstein(in1(0u), in1(1u)));
        out1(1u, henyey_greenstein_sample(in1(1u), in1(3u)));
        out1(2u, schlick_phase(in1(0u), in1(2u)));
        out1(3u, schlick_phase_sample(in1(2u), in1(3u)));
        out3(4u, phase_direction(in3(5u), in1(0u), in1(4u)));
        out1(7u, phase_function_sample(in_bits(8u), in1(1u), in1(3u)));
        out1(8u, phase_function(in_bits(8u), in1(1u), in3(5u), in3(9u)));
        break;
    }
    case 6u: {  // Phong
        out3(0u, phong_eval(in3(0u), in1(3u), in3(4u), in3(7u)));
        out1(3u, phong_pdf(in1(3u), in3(4u), in3(7u)));
        out3(4u, phong_sample(in1(3u), in3(4u), in2(10u)));
        break;
    }
    case 7u: {  // shading normals
        out3(0u, adapt_shading_normal(in3(0u), in3(3u), in3(6u)));
        out_bits(3u, sides_agree(in3(0u), in3(3u), in3(6u)) ? 1u : 0u);
        out3(4u, mapped_normal(in3(0u), in4(9u), in3(13u), in1(16u)));
        break;
    }
    case 8u: {  // ray starts
        SurfacePoint p = surface_point(in3(0u), in3(3u), in3(6u), in2(9u), scene_reach(in3(0u), in3(11u), in3(14u)));
        out3(0u, p.position);
        out3(3u, p.error);
        out3(6u, offset_ray_origin(p.position, p.error, in3(17u), in3(20u)));
        vec3 start;
        vec3 segment;
        SurfacePoint to = SurfacePoint(in3(23u), in3(26u));
        shadow_segment(p, in3(17u), to, vec3(0.0), start, segment);
        out3(9u, start);
        out3(12u, segment);
        break;
    }
    case 9u: {  // spheres
        vec2 t;
        out_bits(0u, intersect_sphere(in3(0u), in3(3u), in3(6u), in1(9u), t) ? 1u : 0u);
        out2(1u, t);
        out2(3u, closest_approach(in3(0u), in3(3u), in3(6u)));
        break;
    }
    case 10u: {  // triangles
        TriangleHit hit;
        out_bits(0u, intersect_triangle(ray_shear(in3(0u), in3(3u)), in3(6u), in3(9u), in3(12u), in1(15u), in1(16u), hit) ? 1u : 0u);
        out1(1u, hit.t);
        out2(2u, hit.barycentrics);
        break;
    }
    case 11u: {  // sums in pairs
        TwoFloat a = TwoFloat(in1(0u), in1(1u));
        out_pair(0u, two_sum(in1(2u), in1(3u)));
        out_pair(2u, split(in1(2u)));
        out_pair(4u, two_product(in1(2u), in1(3u)));
        out_pair(6u, two_float_add(a, in1(2u)));
        out_pair(8u, two_float_add_two_float(a, TwoFloat(in1(4u), in1(5u))));
        out_pair(10u, two_float_add_square(a, in1(2u)));
        break;
    }
    case 12u: {  // media
        FreeFlight f = sample_free_flight(in3(0u), in3(3u), in3(6u), in1(9u), in2(10u));
        out1(0u, f.t);
        out_bits(1u, f.collides ? 1u : 0u);
        out3(2u, f.weight);
        out3(5u, f.bands);
        out1(8u, collision_density(in3(3u), in3(6u), f.t));
        out1(9u, attenuated_length(in1(3u), in1(9u)));
        break;
    }
    case 13u: {  // lights by segments, null collisions
        EquiAngular e = equi_angular(in3(0u), in3(3u), in1(9u), in3(6u));
        float t = equi_angular_sample(e, in1(9u), in1(10u));
        out3(0u, vec3(e.along, e.off, e.range));
        out1(3u, t);
        // Without the angle, which stands for itself.
        out1(4u, equi_angular_pdf(e, in1(11u)) * e.range);
        vec3 bands = in3(12u);
        vec3 weight = vec3(1.0);
        out_bits(5u, sample_null_collision(in3(15u), in3(18u), in1(10u), bands, weight) ? 1u : 0u);
        out3(6u, bands);
        out3(9u, weight);
        out_bits(12u, equi_angular_helps(e, in1(9u), in1(21u)) ? 1u : 0u);
        break;
    }
    case 14u: {  // eight edges under one bound
        for (uint i = 0u; i < 8u; ++i) {
            vec3 edge = in3(3u * i);
            out1(i, geometry_term(edge.x, edge.y, edge.z));
            out1(8u + i, bounded_share(in_bits(24u), in1(25u), edge.x, edge.y, edge.z));
        }
        break;
    }
    case 15u: {  // interleaved pixels and lights
        uvec2 size = uvec2(in_bits(0u), in_bits(1u));
        uint n = in_bits(2u);
        uvec2 pixel;
        out_bits(0u, interleave_merge(in_bits(3u), size, n, pixel) ? 1u : 0u);
        out_bits(1u, pixel.x);
        out_bits(2u, pixel.y);
        out_bits(3u, interleave_split(uvec2(in_bits(4u), in_bits(5u)), size, n));
        uvec2 lights = interleave_lights(in_bits(6u), n * n, in_bits(7u));
        out_bits(4u, lights.x);
        out_bits(5u, lights.y);
        out_bits(6u, interleave_subset(lights.x, n * n, max(in_bits(7u), 1u)));
        out_bits(7u, interleave_subset_of_tile(in_bits(6u), in_bits(8u), in_bits(9u)));
        break;
    }
    case 16u: {  // partial weights of paths from both ends
        PartialWeights w = PartialWeights(in1(0u), in1(1u));
        PartialWeights arrived = mis_arrive(w, in1(2u), in1(3u));
        PartialWeights scattered = mis_scatter(w, in1(4u), in1(5u), in1(6u));
        PartialWeights mirrored = mis_scatter_delta(w, in1(4u), in1(7u));
        out2(0u, vec2(arrived.d_vcm, arrived.d_vc));
        out2(2u, vec2(scattered.d_vcm, scattered.d_vc));
        out2(4u, vec2(mirrored.d_vcm, mirrored.d_vc));
        out2(6u, vec2(mis_behind(w, in1(6u)), mis_weight(in1(0u), in1(1u))));
        break;
    }
    case 17u: {  // light of the frame before
        SeenFrom from = SeenFrom(in3(0u), in_bits(30u), in3(3u), in_bits(31u), in3(6u), in_bits(29u), in3(9u));
        vec2 place;
        out_bits(9u, history_place(from, in3(12u), place) ? 1u : 0u);
        out2(0u, place);
        ivec2 first;
        vec4 weights = history_weights(in2(15u), first);
        out3(2u, weights.xyz);
        out1(5u, weights.w);
        out_bits(10u, uint(first.x));
        out_bits(11u, uint(first.y));
        out1(6u, history_change(in1(24u), in1(25u)));
        out1(7u, history_confidence(in1(17u), in3(18u), in3(21u)));
        out1(8u, history_bound(in1(26u), in1(27u), in1(28u)));
        break;
    }
    case 18u: {  // eight candidates, one after the other
        float sum = 0.0;
        for (uint i = 0u; i < 8u; ++i) {
            out_bits(i, resample(in1(2u * i), in1(2u * i + 1u), sum) ? 1u : 0u);
            out1(8u + i, sum);
        }
        break;
    }
    case 19u: {  // flights by the densest band
        FreeFlight f = densest_band_flight(in3(0u), in3(3u), in1(6u), in1(7u));
        out1(0u, f.t);
        out_bits(1u, f.collides ? 1u : 0u);
        out3(2u, f.weight);
        out3(5u, densest_band(in3(3u)));
        out3(8u, passed_second_moment(in3(3u), in3(9u), in1(8u)));
        break;
    }
    }
}
