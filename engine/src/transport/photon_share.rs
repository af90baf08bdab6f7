//! Shares of light in media that photons find as well as eye paths that go on: the balance heuristic of both, by what is known at either end of a path.
//!
//! Light from x₀ is scattered at x₁ … xₖ, k ≥ 2, the last time in a medium that a ray from the eye goes through. An eye path collides at xₖ and goes on to x₁, where it samples the light; of n
//! photons one comes to xₖ, and is seen within a radius r of the ray as a collision (density n σ e^(−σs) π r² …) or within one of b as a beam (n 2 b sin …). The density of a path by one over that by the other is a
//! product over its places, in which densities of scattering between two places are the same from both sides and cancel, with the extinction and the transmittance between them. What is left are the
//! ends, of which these shares take the phase function and the angle at xₖ and the distance d of the light from x₁:
//!
//! eye / photons = d² / e²,  e² = n (π r² + 2 b sin θ / σ) / (16 π² p(xₖ)).
//!
//! They leave out the transmittances from the eye to xₖ, along the last flight of a beam and from the light to x₁, and take light and x₁ for ones that send and scatter evenly. So the shares are near to those of
//! the balance heuristic, not the least noise there is; but the same function of a path for both, so that they sum to one for every path, and eye paths are not biased by them. A photon that is seen beside the
//! ray has the share of its own way: that blurs as its light does, and fades as kernels shrink. Eye paths do not find light that a mirror
//! scatters first, and light that no photon carries is theirs alone: that d² is 0, or not asked for. The distance d makes up for the 1/d² of light samples next to lights, whose variance has no bound.
//!
//! Photons that are seen by planes, of two flights in the directions ω₁ and ω₂ where a ray in the direction v meets them, come so with the density n J τ …, J = |v · (ω₁ × ω₂)|: J / σ² stands for the area
//! of a kernel. The share of planes is J / (J + c) with c = 16 π² σ² p(xₖ) d² / n, which makes up for the 1/J of their light: however nearly parallel flights and ray are, what one plane brings is bounded as
//! a light sample is that stands for as many photons, and by nothing that a narrow phase function has at xₖ. Nor is x₁ taken to scatter evenly there: where it lies in a medium d² stands over 4 π times the
//! density with which light is scattered ([`evened_distance2`]), of planes and of the beams beside them.
//!
//! Weights of whole densities, with a term for each way to join the subpaths, are carried from vertex to vertex recursively by N. Moonen and A. Jalba. Here eye paths that go on
//! and photons that are seen where eye paths first scatter are all the ways there are to find a path, between which the inner factors cancel: the closed form above has what is left at both ends, and there is nothing to carry.
//!
//! Sources: J. Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", ACM TOG 33(4), 2014, whose weights take whole densities; N. Moonen and A. Jalba, "Efficient Hardware
//! Acceleration of Robust Volumetric Light Transport Simulation", CGF 42(6), 2023, for recursive weights; E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, 9.2.2. Units: m, m⁻¹, m². Scaling lengths changes no share. Twin of `transport/photon_share.glsl`.

use glam::DVec3;
use std::f64::consts::PI;

/// What stands for the area of a kernel in the density with which photons are seen, m², of beams that pass a ray within a radius, m, at an angle of this sine, in a medium of a mean extinction, m⁻¹.
pub fn across_of_beams(sine: f64, extinction: f64, radius: f64) -> f64 {
    2.0 * radius * sine / extinction
}

/// The same of planes, of which two flights and the ray, of unit length, span a box of this volume.
pub fn across_of_planes(jacobian: f64, extinction: f64) -> f64 {
    jacobian / (extinction * extinction)
}

/// Squared distance of a light, m², at which eye paths and so many photons of a pass, which are seen across an area, m², each have half of its light. `phase`: density of the phase function, sr⁻¹.
pub fn even_distance2_across(across: f64, phase: f64, photons: f64) -> f64 {
    photons * across / (16.0 * PI * PI * phase)
}

/// The same of photons that are seen as collisions and, with `has_beams`, as beams.
///
/// `sine`: of the angle between both directions at the eye path's first scattering; `extinction`: mean over bands, m⁻¹; `collision_radius`, `beam_radius`: of kernels, m.
pub fn even_distance2(
    phase: f64,
    sine: f64,
    extinction: f64,
    collision_radius: f64,
    beam_radius: f64,
    photons: f64,
    has_beams: bool,
) -> f64 {
    let of_beams = if has_beams {
        across_of_beams(sine, extinction, beam_radius)
    } else {
        0.0
    };
    even_distance2_across(PI * collision_radius * collision_radius + of_beams, phase, photons)
}

/// Share of eye paths in light whose squared distance from its first scattering is `light2`, m², in \[0, 1\].
pub fn eye_share(light2: f64, even_distance2: f64) -> f64 {
    if light2 > 0.0 {
        1.0 / (1.0 + even_distance2 / light2)
    } else {
        0.0
    }
}

/// That of photons: what eye paths leave.
pub fn photon_share(light2: f64, even_distance2: f64) -> f64 {
    if light2 > 0.0 {
        1.0 / (1.0 + light2 / even_distance2)
    } else {
        1.0
    }
}

/// Stands for the squared distance of light without a place, from infinity or that a medium emits, in a scene of that box, m²: what the disk that light from infinity goes through has in its place.
pub fn placeless_distance2(lower: DVec3, upper: DVec3) -> f64 {
    (upper - lower).length_squared() / 16.0
}

/// Squared distance of the light as a photon carries it that is scattered after `bounce` scatterings and a way, m; `carried` before, 0 at first but for light without a place.
///
/// A mirror that scatters first leaves 0: eye paths do not find such light.
pub fn carried_distance2(carried: f64, bounce: u32, way: f64, rough: bool) -> f64 {
    match (bounce, rough) {
        (1.., _) => carried,
        (0, false) => 0.0,
        (0, true) if carried > 0.0 => carried,
        (0, true) => way * way,
    }
}

/// Squared distance of light, m², as it would be of one that a medium scatters first evenly, and not with this density, sr⁻¹.
pub fn evened_distance2(light2: f64, phase: f64) -> f64 {
    light2 / (4.0 * PI * phase)
}

/// That of a plane's light, by what its record tells: the distance itself, m²; or, below 0, where the scattering between both flights is the first one, of this density, minus how far the light is from
/// the first flight's beginning, m, that is `along` before the scattering.
pub fn distance2_in_plane(told: f64, along: f64, phase: f64) -> f64 {
    if told < 0.0 {
        evened_distance2((along - told).powi(2), phase)
    } else {
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Phase;
    use crate::test_random::Random;
    use crate::transport::phase::phase_function;

    fn place(random: &mut Random) -> DVec3 {
        random.vector().as_dvec3() * 2.0
    }

    #[test]
    fn eye_paths_and_photons_share_every_path() {
        let mut random = Random(7);
        for _ in 0..10_000 {
            let [light2, even2] = [(); 2].map(|()| f64::from(random.magnitude(-40, 40)));
            let both = eye_share(light2, even2) + photon_share(light2, even2);
            assert!((both - 1.0).abs() < 1e-15, "{light2} {even2}: {both}");
            assert!((eye_share(light2, even2) / photon_share(light2, even2) / (light2 / even2) - 1.0).abs() < 1e-12);
        }
        assert_eq!(eye_share(2.0, 2.0), 0.5);
        // What eye paths do not find is the photons', and no phase function of zero leaves light out.
        assert_eq!([eye_share(0.0, 1.0), photon_share(0.0, 1.0)], [0.0, 1.0]);
        assert_eq!([eye_share(0.0, 0.0), photon_share(0.0, 0.0)], [0.0, 1.0]);
        assert_eq!(
            [eye_share(1.0, f64::INFINITY), photon_share(1.0, f64::INFINITY)],
            [0.0, 1.0]
        );
        assert_eq!([eye_share(1.0, 0.0), photon_share(1.0, 0.0)], [1.0, 0.0]);
    }

    /// The densities of whole paths, place by place from either end, against what the shares take and what they leave out.
    #[test]
    fn shares_are_those_of_densities_but_for_what_they_leave_out() {
        let mut random = Random(8);
        let isotropic = 1.0 / (4.0 * PI);
        for round in 0..400 {
            let scatterings = 2 + round % 4;
            let extinction = f64::from(random.magnitude(-4, 3));
            let [radius, beam_radius] = [(); 2].map(|()| f64::from(random.magnitude(-8, -2)));
            let photons = f64::from(random.magnitude(0, 20));
            let passed = |a: DVec3, b: DVec3| (-extinction * a.distance(b)).exp();
            // From the light on: its place, those of the scatterings, and the eye's.
            let places: Vec<DVec3> = (0..scatterings + 2).map(|_| place(&mut random)).collect();
            let (first, last, eye) = (places[1], places[scatterings], places[scatterings + 1]);
            let sine = (eye - last)
                .normalize()
                .cross((last - places[scatterings - 1]).normalize())
                .length();
            // Of a flight from one place that collides at the other, by volume.
            let flight = |a: DVec3, b: DVec3| isotropic * extinction * passed(a, b) / a.distance_squared(b);
            // Along the ray, on which the eye path collides, by length; then place by place. The light is a point, which light samples find for certain.
            let by_eye: f64 = extinction
                * passed(eye, last)
                * (1..scatterings)
                    .map(|i| flight(places[i + 1], places[i]))
                    .product::<f64>();
            // A photon leaves the light, collides, and comes within a radius of the ray: as a collision, or on a way that passes.
            let before: f64 = photons
                * (0..scatterings - 1)
                    .map(|i| flight(places[i], places[i + 1]))
                    .product::<f64>();
            let previous = places[scatterings - 1];
            let as_collision = before * flight(previous, last) * PI * radius * radius;
            let as_beam = before * isotropic / previous.distance_squared(last) * 2.0 * beam_radius * sine;
            for has_beams in [false, true] {
                let by_photons = as_collision + if has_beams { as_beam } else { 0.0 };
                let even2 = even_distance2(isotropic, sine, extinction, radius, beam_radius, photons, has_beams);
                let light2 = places[0].distance_squared(first);
                let across = |attenuated: f64| {
                    PI * radius * radius
                        + if has_beams {
                            2.0 * beam_radius * sine / (extinction * attenuated)
                        } else {
                            0.0
                        }
                };
                let left_out =
                    passed(eye, last) / passed(places[0], first) * across(1.0) / across(passed(previous, last));
                let ratio = by_eye / by_photons / (light2 / even2 * left_out);
                assert!((ratio - 1.0).abs() < 1e-9, "{scatterings} scatterings: {ratio}");
            }
        }
    }

    /// The same of planes, whatever phase functions are.
    #[test]
    fn planes_share_by_densities_of_narrow_phase_functions() {
        let mut random = Random(9);
        for round in 0..400 {
            let last = 2 + round % 4;
            let phase = Phase::HenyeyGreenstein {
                g: 0.95 * random.signed(),
            };
            let extinction = f64::from(random.magnitude(-4, 3));
            let photons = f64::from(random.magnitude(0, 20));
            // From the light on: its place, those of the scatterings, and the eye's.
            let places: Vec<DVec3> = (0..last + 2).map(|_| place(&mut random)).collect();
            let way = |a: usize, b: usize| (places[b] - places[a]).normalize();
            let passed = |a: usize, b: usize| (-extinction * places[a].distance(places[b])).exp();
            // Light leaves its own place evenly.
            let turn = |i: usize| match i {
                0 => 1.0 / (4.0 * PI),
                _ => phase_function(phase, way(i - 1, i), way(i, i + 1)),
            };
            // Of flights that come as far, by area across them.
            let flight = |a: usize, b: usize| passed(a, b) / places[a].distance_squared(places[b]);
            let by_eye: f64 = extinction
                * passed(last + 1, last)
                * (1..last)
                    .map(|i| turn(i + 1) * extinction * flight(i + 1, i))
                    .product::<f64>();
            let before: f64 = photons
                * (0..last - 2)
                    .map(|i| turn(i) * extinction * flight(i, i + 1))
                    .product::<f64>();
            // Both flights of a plane come farther than where the ray meets it, in directions that the photon has been scattered into.
            let volume = way(last, last + 1)
                .dot(way(last - 2, last - 1).cross(way(last - 1, last)))
                .abs();
            let flights = turn(last - 2) * flight(last - 2, last - 1) * turn(last - 1) * flight(last - 1, last);
            let by_planes = before * flights * volume;
            let even2 = even_distance2_across(across_of_planes(volume, extinction), turn(last), photons);
            let light2 = evened_distance2(places[0].distance_squared(places[1]), turn(1));
            let left_out = passed(last + 1, last) / passed(0, 1);
            let ratio = by_eye / by_planes / (light2 / even2 * left_out);
            assert!((ratio - 1.0).abs() < 1e-9, "{last} scatterings: {ratio}");
            // A plane tells as much, of a light that its first flight may begin behind.
            let told = if last == 2 {
                -0.25 * places[0].distance(places[1])
            } else {
                light2
            };
            let along = 0.75 * places[last - 2].distance(places[last - 1]);
            let of_plane = distance2_in_plane(told, along, turn(last - 1));
            assert!((of_plane / light2 - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn shares_of_planes_make_up_for_their_volume() {
        let (phase, extinction, photons, light2) = (0.3, 2.0, 1e4, 0.7);
        let share = |volume: f64| {
            let even2 = even_distance2_across(across_of_planes(volume, extinction), phase, photons);
            assert!((eye_share(light2, even2) + photon_share(light2, even2) - 1.0).abs() < 1e-15);
            photon_share(light2, even2)
        };
        // What a plane brings goes with the share over the volume.
        let bound = photons / (16.0 * PI * PI * extinction * extinction * phase * light2);
        let volumes = (0..100).map(|i| 10f64.powf(-0.1 * f64::from(i)));
        let weights: Vec<f64> = volumes.map(|volume| share(volume) / volume).collect();
        assert!(weights.is_sorted() && weights.iter().all(|weight| *weight < bound));
        assert!((weights[99] / bound - 1.0).abs() < 1e-6, "the bound is met");
        assert!(share(1.0) > 0.9 && share(0.0) == 0.0);
        // No distance leaves all to photons.
        assert_eq!(photon_share(distance2_in_plane(0.0, 1.0, phase), 0.0), 1.0);
    }

    #[test]
    fn lengths_do_not_show_and_narrow_kernels_leave_all_to_eye_paths() {
        let even =
            |scale: f64, radius: f64| even_distance2(0.2, 0.5, 3.0 / scale, radius * scale, radius * scale, 1e4, true);
        for scale in [1e-3, 1e3] {
            assert!((even(scale, 0.02) / (scale * scale * even(1.0, 0.02)) - 1.0).abs() < 1e-12);
        }
        assert!(photon_share(1.0, even(1.0, 1e-9)) < 1e-6 && eye_share(1.0, even(1.0, 1e3)) < 1e-6);
    }

    #[test]
    fn photons_carry_the_distance_of_their_first_scattering() {
        assert_eq!(carried_distance2(0.0, 0, 3.0, true), 9.0);
        assert_eq!(carried_distance2(0.0, 0, 3.0, false), 0.0);
        // Of light without a place what it began with.
        let far = placeless_distance2(DVec3::splat(-1.0), DVec3::splat(1.0));
        assert_eq!(far, 0.75);
        assert_eq!(carried_distance2(far, 0, 3.0, true), far);
        assert_eq!(carried_distance2(far, 0, 3.0, false), 0.0);
        for rough in [false, true] {
            assert_eq!(carried_distance2(9.0, 1, 5.0, rough), 9.0);
            assert_eq!(carried_distance2(0.0, 2, 5.0, rough), 0.0);
        }
    }
}
