#version 460
// Where photons have arrived: what is stored of them, and where they go on.
//
// Diffuse surfaces keep a deposit of each photon that has been scattered as often as asked for; for virtual lights (STORES_LIGHTS) all surfaces do
// that scatter into more than one direction, and what is kept is where the photon is and what it brings. A photon goes on with the probability that
// leaves its largest band as it is; where one specular scattering would make another path set, by diffuse and glossy lobes alone (ONLY_ROUGH).
// Scattering functions are those of power (BSDF_IMPORTANCE), and where normals are interpolated the ratio of cosines makes up for it (Veach 1997, 5.3.2), except for
// what adapt_shading_normal bends.
//
// In scenes with media photon_medium.comp has gone before: it has handled those that did not come as far, and says what is left of the others.
//
// PM-PH-1, PM-PD-2 to PM-PD-7: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §3.4.1 and §5.1. Deterministic in (seed, pass, photon).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"
#include "transport/adjoint_ratio.glsl"
#include "transport/arrival.glsl"
#include "transport/bsdf_label.glsl"
#include "transport/path_set.glsl"
#include "transport/photon_share.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint last_bounce;    // greatest number of scatterings before a hit that is stored
    vec3 scene_upper;
    uint first_deposit;  // least
    WalkKey key;         // the sequence is the pass, places in it photons
    float flux_scale;    // of fluxes as they are stored
    KernelSettings kernel;
} push;

#include "walk/draws.glsl"
#include "techniques/photon_mapping/photon_flux.glsl"
#include "walk/hand_on.glsl"
#include "walk/survival.glsl"

// Least axis of a kernel, in errors of its position: far from the origin positions lie on a grid, which a kernel must not fall through.
const float KERNEL_RESOLUTION = 4.0;
void deposit(uint slot, uint place, WalkState photon, SurfacePoint point, vec3 normal, Differentials footprint, inout uint flags) {
    atomicAdd(photon_counters.deposits, 1u);
    PhotonKernel kernel;
    bool fit;
    KernelSettings settings = push.kernel;
    float resolution = KERNEL_RESOLUTION * largest_component(point.error) / settings.unit_length;
    settings.length_min = max(settings.length_min, resolution);
    settings.length_max = max(settings.length_max, resolution);
    if (HAS_DIFFERENTIALS && guard_differentials(footprint, settings.unit_length)) {
        fit = photon_kernel(settings, footprint, normal, kernel);
    } else {
        // Of fixed size, or a footprint beyond all bounds.
        kernel = disk_kernel(settings.length_max * settings.unit_length, normal);
        fit = !HAS_DIFFERENTIALS || settings.shape == KERNEL_FIXED || settings.widens_flat != 0u;
    }
    if (!fit) {
        atomicAdd(photon_counters.without_kernel, 1u);
        return;
    }
    uvec4 q0;
    uvec4 q1;
    uvec4 q2;
    vec3 flux = dithered_flux(photon.throughput * push.flux_scale, slot, path_set_bounce(photon.bounce));
    pack_photon(PhotonRecord(point.position, normal, photon.direction, flux, kernel), q0, q1, q2);
    uint history = HAS_CLASSES ? path_set_state(photon.bounce) : path_set_bounce(photon.bounce);
    add_history(history, !HAS_CLASSES && path_set_state(photon.bounce) == PHOTON_DIFFUSED, q0, q1);
    store_waiting(place, q0, q1, q2);
    flags |= HAS_MEDIA ? FLAG_WAITING | FLAG_LANDED : FLAG_WAITING;
}

// What a virtual light is made of (techniques/instant_radiosity/virtual_light.glsl): power that arrives, unrounded, since it is not averaged over
// neighbours.
void deposit_light(uint place, WalkState photon, Hit hit, uint bounce, inout uint flags) {
    atomicAdd(photon_counters.deposits, 1u);
    store_waiting(place, uvec4(floatBitsToUint(hit.barycentrics), hit.triangle, bounce), uvec4(floatBitsToUint(photon.throughput), 0u),
                  uvec4(floatBitsToUint(photon.direction), 0u));
    flags |= FLAG_WAITING;
}

// Derivatives of the normal that a specular lobe reflects or refracts about, which faces wo.
void specular_normal_derivatives(Hit hit, Differentials footprint, vec3 normal, out vec3 dn1, out vec3 dn2) {
    dn1 = vec3(0.0);
    dn2 = vec3(0.0);
    if (HAS_SHADING_NORMALS) {
        SceneInstance at = instance_of(hit.triangle);
        SceneTriangle t = load_triangle_of(at, hit.triangle);
        uvec3 v = load_vertices_of(at, hit.triangle);
        vec3 n0 = load_normal(at, v.x);
        vec3 n1 = load_normal(at, v.y);
        vec3 n2 = load_normal(at, v.z);
        normal_derivatives(t.b - t.a, t.c - t.a, n0, n1, n2, hit.barycentrics, footprint, dn1, dn2);
        vec3 interpolated = interpolate(n0, n1, n2, vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics));
        if (dot(interpolated, normal) < 0.0) {
            dn1 = -dn1;
            dn2 = -dn2;
        }
    }
}

// The footprint of a photon that has been scattered into wi.
Differentials scattered_differentials(Differentials d, Hit hit, Bsdf bsdf, vec3 w, vec3 normal, bool front, BsdfSample scattered,
                                      vec3 wi) {
    if ((scattered.flags & LOBE_DIFFUSE) != 0u) {
        return diffuse_reemission(d, wi, scattered.pdf);
    }
    if ((scattered.flags & LOBE_GLOSSY) != 0u) {
        return rough_reemission(d, wi, scattered.pdf);
    }
    bool straight = (scattered.flags & LOBE_TRANSMISSION) != 0u && (bsdf.flags & BSDF_THIN) != 0u;
    if (straight) {
        return d;
    }
    vec3 dn1;
    vec3 dn2;
    specular_normal_derivatives(hit, d, normal, dn1, dn2);
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u) {
        return refract_differentials(d, w, normal, front ? 1.0 / bsdf.eta : bsdf.eta, dn1, dn2);
    }
    return reflect_differentials(d, w, normal, dn1, dn2);
}

// Scatters the photon of a slot at its hit; true when it goes on.
bool scatter(uint slot, uint place, WalkState photon, inout uint flags) {
    Hit hit = load_hit(place);
    if (hit.triangle == NO_HIT) {
        return false;
    }
    uint diffused = path_set_state(photon.bounce);
    uint bounce = path_set_bounce(photon.bounce);
    Arrival a = arrival_at(hit, photon.direction, push.scene_lower, push.scene_upper);
    Surface s = a.surface;
    if (photon.throughput == vec3(0.0) || arrival_is_unlit(a)) {
        return false;
    }
    if (HAS_ABSORPTION && !HAS_MEDIA) {
        photon.throughput = absorbed(photon.throughput, arrival_interior(a, walk_gathered[slot].interior), hit.t);
    }
    Bsdf bsdf = a.bsdf;
    bsdf.flags |= BSDF_IMPORTANCE;
    vec3 normal = arrival_normal(a);
    Differentials footprint;
    if (HAS_DIFFERENTIALS) {
        footprint = transfer_differentials(photon_differentials[slot], hit.t, photon.direction, s.geometric_normal);
    }
    bool deposits = STORES_LIGHTS ? arrival_has_rough_lobes(a) : arrival_has_diffuse_base(a);
    if (bounce >= push.first_deposit && deposits) {
        if (STORES_LIGHTS) {
            // Of a blended surface it keeps the share of those that the surface has stopped, since no shadow ray to it asks whether it is there.
            deposit_light(place, photon, hit, bounce, flags);
        } else {
            WalkState landed = photon;
            if (HAS_ALPHA) {
                // Blended surfaces stop only that share of photons, but whoever meets them sees all of their light.
                landed.throughput /= material_coverage(a.material, surface_base_color(a.material, s).a);
            }
            deposit(slot, place, landed, s.point, a.facing, footprint, flags);
        }
    }
    if (bounce >= push.last_bounce) {
        return false;
    }
    ScatteringFrame frame = scattering_frame(a, normal);
    vec2 side = bounce_sample(slot, bounce, DIMENSION_SIDE);
    BsdfSample scattered = bsdf_sample(bsdf, frame.wo, vec3(bounce_sample(slot, bounce, DIMENSION_DIRECTION), side.x),
                                       ONLY_ROUGH ? LOBE_DIFFUSE | LOBE_GLOSSY : LOBE_ALL);
    if ((TELLS_CAUSTICS || HAS_CLASSES) && (HAS_METAL || HAS_SPECULAR_LAYER)) {
        scattered = bsdf_label(bsdf, frame.wo, scattered, LOBE_ALL, false, side.y);
    }
    vec3 wi = frame_to_world(frame, scattered.wi);
    if (scattered.flags == 0u || !sides_agree(frame.z, frame.outward, wi)) {
        return false;
    }
    if (HAS_CLASSES) {
        diffused = path_set_successor(photon_class_successors[diffused], scattered.flags);
        if (diffused == PATH_SET_DEAD) {
            return false;
        }
    }
    vec3 flux = photon.throughput * scattered.weight;
    if (HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) {
        flux *= adjoint_ratio(frame.z, s.geometric_normal, a.wo, wi);
    }
    float survival = walk_survival(photon.throughput, flux, bounce);
    // Eye paths alone keep a scale of radiance: a photon's number stands there, made uniform again by each roulette, or what it comes from.
    float draw = EVEN_SURVIVAL ? photon.eta_scale : side.y;
    // Also ends a photon whose flux is not a number.
    if (!(draw < survival)) {
        return false;
    }
    photon.eta_scale = EVEN_SURVIVAL ? draw / survival : PHOTON_FROM_ELSEWHERE;
    if (HAS_DIFFERENTIALS) {
        if ((scattered.flags & (LOBE_DIFFUSE | LOBE_GLOSSY)) != 0u) {
            // A re-emission takes nothing but the footprint's area along; specular lobes keep what is beyond all bounds.
            guard_differentials(footprint, push.kernel.unit_length);
        }
        footprint = scattered_differentials(footprint, hit, bsdf, photon.direction, normal, frame.wo.z > 0.0, scattered, wi);
        // Of the photons that arrive only this share goes the same way on.
        footprint = roulette_differentials(footprint, scattered.choice * survival);
        photon_differentials[slot] = footprint;
    }
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u && (bsdf.flags & BSDF_THIN) == 0u) {
        walk_gathered[slot].interior = frame.wo.z > 0.0 ? s.material : HAS_MEDIA ? s.around : OUTSIDE;
    }
    if (!HAS_CLASSES && (scattered.flags & LOBE_DIFFUSE) != 0u) {
        diffused = PHOTON_DIFFUSED;
    }
    photon.throughput = flux / survival;
    photon.origin = departure(a, wi, photon.throughput);
    photon.direction = normalize(wi);
    if (CARRIES_LIGHT_DISTANCE) {
        photon.pdf = carried_distance2(photon.pdf, bounce, hit.t, (scattered.flags & (LOBE_DIFFUSE | LOBE_GLOSSY)) != 0u);
    }
    photon.bounce = path_set_joined(bounce + 1u, diffused);
    store_walk(slot, photon, HAS_MEDIA ? -way_left_out(s, photon.origin, photon.direction) : 0.0);
    return true;
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    uint flags = 0u;
    WalkState photon = load_walk(slot);
    if (HAS_MEDIA) {
        MediumEvent event = walk_medium_events[place];
        if ((event.flags & EVENT_HANDLED) != 0u) {
            return;
        }
        photon.throughput *= event.weight;
        // A way that is stored, and what waits beside it.
        flags = event.flags & (FLAG_WAITING | FLAG_VOLUME | FLAG_BESIDE);
    }
    if (scatter(slot, place, photon, flags)) {
        flags |= FLAG_ALIVE;
    } else if (load_hit(place).triangle == NO_HIT) {
        atomicAdd(photon_counters.escaped, 1u);
    } else {
        atomicAdd(photon_counters.absorbed, 1u);
    }
    walk_flags_out[place] = flags;
}
