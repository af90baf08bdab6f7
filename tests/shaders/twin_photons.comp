#version 460
// Photon differentials, kernels and records, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#include "techniques/photon_mapping/kernel.glsl"
#include "techniques/photon_mapping/photon_event.glsl"
#include "techniques/photon_mapping/photon_footprint.glsl"
#include "techniques/photon_mapping/photon_transmittance.glsl"

Differentials in_differentials(uint i) { return Differentials(in3(i), in3(i + 3u), in3(i + 6u), in3(i + 9u)); }

void out_differentials(Differentials d) {
    out3(0u, d.z1);
    out3(3u, d.z2);
    out3(6u, d.w1);
    out3(9u, d.w2);
}

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // what emits
        uint kind = in_bits(9u);
        if (kind == 0u) {
            out_differentials(emission_differentials(in3(0u), in1(3u)));
        } else if (kind == 1u) {
            out_differentials(area_light_differentials(in3(0u), in1(3u), in1(4u), in1(5u)));
        } else if (kind == 2u) {
            out_differentials(parallel_beam_differentials(in3(0u), in1(4u)));
        } else {
            out_differentials(camera_differentials(in3(0u), in3(3u), in3(6u)));
        }
        break;
    }
    case 1u: {  // what happens at a surface
        uint kind = in_bits(28u);
        Differentials d = in_differentials(0u);
        vec3 w = in3(12u);
        vec3 n = in3(15u);
        if (kind == 0u) {
            d = transfer_differentials(d, in1(24u), w, n);
        } else if (kind == 1u) {
            d = reflect_differentials(d, w, n, in3(18u), in3(21u));
        } else if (kind == 2u) {
            d = refract_differentials(d, w, n, in1(25u), in3(18u), in3(21u));
        } else if (kind == 3u) {
            d = diffuse_reemission(d, w, in1(26u));
        } else if (kind == 4u) {
            d = rough_reemission(d, w, in1(26u));
        } else if (kind == 5u) {
            d = roulette_differentials(d, in1(27u));
        } else {
            out_bits(12u, guard_differentials(d, in1(27u)) ? 1u : 0u);
        }
        out_differentials(d);
        break;
    }
    case 2u: {  // derivatives of normals
        Differentials d = Differentials(in3(17u), in3(20u), vec3(0.0), vec3(0.0));
        vec3 dn1;
        vec3 dn2;
        normal_derivatives(in3(0u), in3(3u), in3(6u), in3(9u), in3(12u), in2(15u), d, dn1, dn2);
        out3(0u, dn1);
        out3(3u, dn2);
        break;
    }
    case 3u: {  // kernels
        KernelSettings s = KernelSettings(in_bits(18u), in1(9u), in1(10u), in1(11u), in1(12u), in1(13u), in1(14u),
                                          uint(in1(15u)));
        Differentials d = Differentials(in3(0u), in3(3u), vec3(0.0), vec3(0.0));
        PhotonKernel k;
        bool has = photon_kernel(s, d, in3(6u), k);
        out3(0u, has ? k.along : vec3(0.0));
        out3(3u, has ? k.across : vec3(0.0));
        out3(6u, has ? kernel_extent(k) : vec3(0.0));
        out1(9u, has ? kernel_area(k) : 0.0);
        out_bits(10u, has ? 1u : 0u);
        break;
    }
    case 4u: {  // their weights
        out1(0u, kernel_weight(in_bits(9u), PhotonKernel(in3(0u), in3(3u)), in3(6u)));
        out1(1u, kernel_profile(in_bits(9u), in1(10u)));
        break;
    }
    case 5u: {  // records
        uvec4 q0;
        uvec4 q1;
        uvec4 q2;
        pack_photon(PhotonRecord(in3(0u), in3(3u), in3(6u), in3(9u), PhotonKernel(in3(12u), in3(15u))), q0, q1, q2);
        out_bits(0u, q0.w);
        out_bits(1u, q1.w);
        out_bits(2u, q2.w);
        out3(3u, photon_normal(q0));
        out3(6u, photon_direction(q1));
        out3(9u, photon_flux(q2));
        q0.w |= in_bits(21u);
        out1(12u, photon_weight(in_bits(22u), q0, q1, q2, in3(18u), in3(23u), in1(26u)));
        out_bits(13u, photon_ends_leaf(q0) ? 1u : 0u);
        break;
    }
    case 6u: {  // events in media
        uvec4 q0;
        uvec4 q1;
        pack_event(PhotonEvent(in3(0u), in3(3u), in3(6u), in1(9u), in_bits(10u), in_bits(11u)), q0, q1);
        out_bits(0u, q1.z);
        out_bits(1u, q1.x);
        q0.w |= in_bits(12u);
        PhotonEvent e = unpack_event(q0, q1);
        out3(2u, e.direction);
        out3(5u, e.flux);
        out1(8u, e.radius);
        out_bits(9u, e.medium);
        out_bits(10u, e.bounce);
        out_bits(11u, event_ends_leaf(q0) ? 1u : 0u);
        out1(12u, ball_profile(in_bits(13u), in1(14u)));
        break;
    }
    case 8u: {  // beams
        uvec4 q0;
        uvec4 q1;
        pack_beam(PhotonBeam(in3(0u), in3(3u), in3(6u), in_bits(9u), in_bits(10u)), q0, q1);
        PhotonBeam b = unpack_beam(q0, q1);
        out_bits(0u, q0.w);
        out_bits(1u, q1.w);
        out_bits(2u, b.medium);
        out_bits(3u, b.bounce);
        BeamMeeting at = meet_beam(in3(11u), in3(14u), b.start, in3(17u));
        out1(4u, at.t);
        out1(5u, at.along);
        out1(6u, at.squared);
        out1(7u, at.sine);
        out1(8u, line_profile(in_bits(20u), in1(21u)));
        out1(9u, point_share(in1(22u), in1(23u), in1(24u), in1(25u), at.sine));
        break;
    }
    case 9u: {  // planes
        uvec4 q0;
        uvec4 q1;
        uvec4 q2;
        pack_plane(PhotonPlane(in3(0u), in3(3u), in3(6u), in3(9u), in_bits(12u), in_bits(13u), in1(26u)), q0, q1, q2);
        PhotonPlane p = unpack_plane(q0, q1, q2);
        out_bits(0u, q0.w);
        out_bits(1u, q1.w);
        out_bits(2u, is_plane(q2) ? 1u : 0u);
        out_bits(3u, p.medium);
        out_bits(4u, p.bounce);
        out3(5u, p.first);
        PlaneMeeting at = meet_plane(in3(14u), in3(17u), p.start, p.first, p.second);
        out1(8u, at.t);
        out1(9u, at.along.x);
        out1(10u, at.along.y);
        out1(11u, at.jacobian);
        out1(12u, least_extinction(in3(20u)));
        out1(13u, plane_extinction(in3(23u), in3(20u)));
        out1(14u, p.light);
        break;
    }
    case 10u: {  // shares of photons and of eye paths
        float even2 = even_distance2(in1(6u), in1(7u), in1(8u), in1(18u), in1(9u), in1(10u), in_bits(11u) != 0u);
        out1(0u, even2);
        out1(1u, eye_share(in1(12u), even2));
        out1(2u, photon_share(in1(12u), even2));
        out1(3u, placeless_distance2(in3(0u), in3(3u)));
        out1(4u, carried_distance2(in1(13u), in_bits(14u), in1(15u), in_bits(16u) != 0u));
        out1(5u, even_distance2_across(across_of_planes(in1(7u), in1(8u)), in1(6u), in1(10u)));
        out1(6u, evened_distance2(in1(12u), in1(6u)));
        out1(7u, distance2_in_plane(in1(17u), in1(15u), in1(6u)));
        break;
    }
    case 12u: {  // extinction along short beams
        out3(0u, short_way_extinction(in3(0u), in3(3u)));
        break;
    }
    case 11u: {  // steps of walks through grids
        vec3 passed = in3(3u);
        bool is_step = attenuate(in3(0u), in_bits(6u), in2(7u), passed);
        out_bits(0u, is_step ? 1u : 0u);
        out3(1u, passed);
        break;
    }
    case 7u: {  // footprints in media
        Differentials d = Differentials(in3(0u), in3(3u), in3(6u), in3(9u));
        EventKernelSettings s = EventKernelSettings(in1(12u), in1(13u), in1(14u), in1(15u), in1(16u));
        float across = footprint_across(d, in1(17u), in3(18u));
        out1(0u, event_radius(s, across, in1(21u), in1(22u)));
        Differentials scattered = scattered_in_medium(across, in1(21u), in1(22u), in1(23u), in3(18u), in1(24u));
        out1(1u, length(scattered.z1));
        out1(2u, length(scattered.w2));
        out3(3u, passed_differentials(d, in1(23u)).z2);
        out1(6u, across);
        out1(7u, log_of_one_plus(in1(25u)));
        break;
    }
    }
}
