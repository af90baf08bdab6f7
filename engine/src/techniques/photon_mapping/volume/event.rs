//! A photon where it has collided with a medium: the record of a volume map, the kernels of its estimates, and its box. Twin of
//! `techniques/photon_mapping/photon_event.glsl`.
//!
//! The flux is that which the collision scatters. With it the beam estimate is L = Σ K(dⱼ/hⱼ)/hⱼ² τ(tⱼ) p(ωⱼ, −v) Φⱼ, which is the source's corrected form, of
//! the flux before the collision times the albedo. Guarantees: kernels integrate to one over a plane and over space; boxes hold their kernels.

use crate::accel::Aabb;
use crate::gpu::shaders::constants::{
    BALL_CONE, BALL_EPANECHNIKOV, BALL_UNIFORM, BEAM_BOUNCE_SHIFT, EVENT_LEAF_END, EVENT_MEDIUM_MASK, EVENT_QUARTERS,
    EVENT_ROUNDING, EVENT_SLACK, PHOTON_BOUNCE_MAX, PHOTON_BOUNCE_SHIFT, PHOTON_DIRECTION_BITS,
};
use crate::maps::packed_direction::{pack_octahedral, unpack_octahedral};
use crate::techniques::photon_mapping::kernel::KernelProfile;
use crate::transport::packing::{pack_rgb9e5, unpack_rgb9e5};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Words of a record.
pub type EventWords = [[u32; 4]; EVENT_QUARTERS as usize];

/// The word of the first quarter that says which medium, and whether a leaf ends.
pub(super) const MEDIUM_WORD: usize = 3;

/// A collision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonEvent {
    /// Where, m.
    pub position: Vec3,
    /// In which the photon came, unit.
    pub direction: Vec3,
    /// That is scattered.
    pub flux: Vec3,
    /// Of its kernel, m.
    pub radius: f32,
    /// Its medium, by the scene's numbers.
    pub medium: u32,
    /// Scatterings before this one, at most [`PHOTON_BOUNCE_MAX`].
    pub bounce: u32,
}

/// The words of an event. Directions are good to 5.2·10⁻⁴ radians, flux to 2⁻⁹ of its largest band.
pub fn pack_event(e: &PhotonEvent) -> EventWords {
    let [x, y, z] = e.position.to_array().map(f32::to_bits);
    let way =
        pack_octahedral(e.direction, PHOTON_DIRECTION_BITS) | e.bounce.min(PHOTON_BOUNCE_MAX) << PHOTON_BOUNCE_SHIFT;
    [
        [x, y, z, e.medium & EVENT_MEDIUM_MASK],
        [pack_rgb9e5(e.flux), e.radius.to_bits(), way, 0],
    ]
}

/// The event of these words.
pub fn unpack_event(words: &EventWords) -> PhotonEvent {
    let [[x, y, z, medium], [flux, radius, way, _]] = *words;
    PhotonEvent {
        position: Vec3::from_array([x, y, z].map(f32::from_bits)),
        direction: unpack_octahedral(way, PHOTON_DIRECTION_BITS).as_vec3(),
        flux: unpack_rgb9e5(flux).as_vec3(),
        radius: f32::from_bits(radius),
        medium: medium & EVENT_MEDIUM_MASK,
        bounce: way >> PHOTON_BOUNCE_SHIFT,
    }
}

/// Gives a record another radius, m.
pub(super) fn set_event_radius(words: &mut EventWords, radius: f32) {
    words[1][1] = radius.to_bits();
}

/// Whether the record is the last one of a leaf.
pub fn event_ends_leaf(words: &EventWords) -> bool {
    words[0][MEDIUM_WORD] & EVENT_LEAF_END != 0
}

/// A piece of a photon's way through a homogeneous medium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonBeam {
    /// Where it begins, m.
    pub start: Vec3,
    /// Where it ends, m.
    pub end: Vec3,
    /// Where it begins.
    pub flux: Vec3,
    /// Its medium, by the scene's numbers.
    pub medium: u32,
    /// Scatterings before, at most [`PHOTON_BOUNCE_MAX`].
    pub bounce: u32,
}

/// The words of a beam, as many as an event's.
pub fn pack_beam(b: &PhotonBeam) -> EventWords {
    let [x, y, z] = b.start.to_array().map(f32::to_bits);
    let [u, v, w] = b.end.to_array().map(f32::to_bits);
    let medium = b.medium & EVENT_MEDIUM_MASK | b.bounce.min(PHOTON_BOUNCE_MAX) << BEAM_BOUNCE_SHIFT;
    [[x, y, z, medium], [u, v, w, pack_rgb9e5(b.flux)]]
}

/// The beam of these words.
pub fn unpack_beam(words: &EventWords) -> PhotonBeam {
    let [[x, y, z, medium], [u, v, w, flux]] = *words;
    PhotonBeam {
        start: Vec3::from_array([x, y, z].map(f32::from_bits)),
        end: Vec3::from_array([u, v, w].map(f32::from_bits)),
        flux: unpack_rgb9e5(flux).as_vec3(),
        medium: medium & EVENT_MEDIUM_MASK,
        bounce: medium >> BEAM_BOUNCE_SHIFT & PHOTON_BOUNCE_MAX,
    }
}

/// Share that the estimate by collisions has of light that one by beams has, too, in media of a mean extinction, 1/m: the balance heuristic.
///
/// A photon collides within the disk of a ray with the density of its flight, of this length, times the disk's area; its beam passes within a width of both sides, seen at an angle of this
/// sine. Radii and lengths in metres.
pub fn point_share(extinction: f64, flight: f64, collision_radius: f64, beam_radius: f64, sine: f64) -> f64 {
    let points = extinction * (-extinction * flight).exp() * PI * collision_radius * collision_radius;
    let both = points + 2.0 * beam_radius * sine;
    if both > 0.0 { points / both } else { 1.0 }
}

/// Kernel of one dimension, of the squared distance in units of the radius: over a radius on both sides it integrates to one.
pub fn line_profile(profile: KernelProfile, d2: f64) -> f64 {
    let k = match profile {
        KernelProfile::Uniform => 0.5,
        KernelProfile::Cone => 1.0 - d2.sqrt(),
        KernelProfile::Epanechnikov => 0.75 * (1.0 - d2),
    };
    if d2 < 1.0 { k } else { 0.0 }
}

/// Where a ray and a beam come closest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BeamMeeting {
    /// Distance along the ray, m.
    pub t: f64,
    /// Distance along the beam, m.
    pub along: f64,
    /// Squared distance between them, m².
    pub squared: f64,
    /// Sine of the angle between them; 0 where they are parallel, and nothing else is known.
    pub sine: f64,
}

/// Where a ray comes closest to a beam from `start` along the unit direction `way`.
pub fn meet_beam(origin: DVec3, direction: DVec3, start: DVec3, way: DVec3) -> BeamMeeting {
    let across = direction.cross(way);
    let sine2 = across.length_squared();
    if sine2 <= 0.0 {
        return BeamMeeting::default();
    }
    let delta = start - origin;
    BeamMeeting {
        t: delta.cross(way).dot(across) / sine2,
        along: delta.cross(direction).dot(across) / sine2,
        squared: delta.dot(across).powi(2) / sine2,
        sine: sine2.sqrt(),
    }
}

/// Kernel of the squared distance in the unit ball, 1/volume of the ball of radius 1.
pub fn ball_profile(profile: KernelProfile, d2: f64) -> f64 {
    let k = match profile {
        KernelProfile::Uniform => f64::from(BALL_UNIFORM),
        KernelProfile::Cone => f64::from(BALL_CONE) * (1.0 - d2.sqrt()),
        KernelProfile::Epanechnikov => f64::from(BALL_EPANECHNIKOV) * (1.0 - d2),
    };
    if d2 < 1.0 { k } else { 0.0 }
}

/// The box of a kernel about a place, or about what lies between two, in the device's arithmetic.
pub fn event_box(a: Vec3, b: Vec3, radius: f32) -> Aabb {
    let wide = radius + EVENT_SLACK * radius;
    let beyond = Vec3::splat(wide) + EVENT_ROUNDING * a.abs().max(b.abs());
    let bounds = Aabb {
        lower: a.min(b) - beyond,
        upper: a.max(b) + beyond,
    };
    bounds.without_negative_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::sphere::closest_approach;
    use crate::scene::Phase;
    use crate::techniques::photon_mapping::kernel::kernel_profile;
    use crate::test_random::Random;
    use crate::transport::phase::phase_function;
    use glam::DVec3;

    const PROFILES: [KernelProfile; 3] = [KernelProfile::Uniform, KernelProfile::Cone, KernelProfile::Epanechnikov];

    #[test]
    fn shares_of_collisions_are_those_of_the_balance_heuristic() {
        let mut random = Random(6);
        for _ in 0..200 {
            let unit = |random: &mut Random| f64::from(random.unit()).max(1e-3);
            let (extinction, flight) = (20.0 * unit(&mut random), 3.0 * unit(&mut random));
            let (of_points, of_beams, sine) = (unit(&mut random), unit(&mut random), unit(&mut random));
            let share = point_share(extinction, flight, of_points, of_beams, sine);
            // Expected meetings of a ray's piece of a metre: collisions in its cylinder, and beams in the strip that is seen of it, of photons of the same density.
            let collisions = extinction * (-extinction * flight).exp() * PI * of_points.powi(2);
            let beams = 2.0 * of_beams * sine;
            assert!((share * (collisions + beams) - collisions).abs() < 1e-12 * collisions);
            assert!(point_share(extinction, flight, of_points, of_beams, 0.0) > 1.0 - 1e-12);
        }
        // Neither underflow nor a ray along a beam leaves light out.
        assert_eq!(point_share(1e3, 1e3, 0.1, 0.1, 0.0), 1.0);
        assert_eq!(point_share(1e3, 1e3, 0.1, 0.1, 0.5), 0.0);
    }

    #[test]
    fn records_come_back() {
        let mut random = Random(5);
        for bounce in 0..70 {
            let event = PhotonEvent {
                position: Vec3::new(random.signed(), random.signed(), random.signed()) * 10.0,
                direction: Vec3::new(random.signed(), random.signed(), random.signed()).normalize(),
                flux: Vec3::new(random.unit(), random.unit(), random.unit()),
                radius: random.unit(),
                medium: bounce * 3,
                bounce,
            };
            let back = unpack_event(&pack_event(&event));
            assert_eq!(
                (back.position, back.radius, back.medium),
                (event.position, event.radius, event.medium)
            );
            assert_eq!(back.bounce, bounce.min(PHOTON_BOUNCE_MAX));
            assert!(back.direction.angle_between(event.direction) < 6e-4);
            assert!((back.flux - event.flux).abs().max_element() <= event.flux.max_element() / 511.0);
            assert!(!event_ends_leaf(&pack_event(&event)));
        }
        // A leaf's end touches no medium.
        let mut words = pack_event(&PhotonEvent {
            position: Vec3::ZERO,
            direction: Vec3::Z,
            flux: Vec3::ONE,
            radius: 1.0,
            medium: EVENT_MEDIUM_MASK,
            bounce: 0,
        });
        words[0][MEDIUM_WORD] |= EVENT_LEAF_END;
        assert_eq!(unpack_event(&words).medium, EVENT_MEDIUM_MASK);
        assert!(event_ends_leaf(&words));
    }

    #[test]
    fn boxes_hold_what_rays_find_within_the_radius() {
        let mut random = Random(6);
        for _ in 0..20_000 {
            let size = random.magnitude(-8, 12);
            let centre = Vec3::new(random.signed(), random.signed(), random.signed()) * size;
            let radius = size * random.magnitude(-12, 2);
            let bounds = event_box(centre, centre, radius);
            let reach = bounds.upper.as_dvec3() - centre.as_dvec3();
            assert!(reach.min_element() >= f64::from(radius), "{centre} {radius}");
            let back = centre.as_dvec3() - bounds.lower.as_dvec3();
            assert!(back.min_element() >= f64::from(radius), "{centre} {radius}");
        }
    }

    #[test]
    fn beams_come_back_and_their_boxes_hold_them() {
        let mut random = Random(8);
        for bounce in 0..70 {
            let beam = PhotonBeam {
                start: random.vector() * 4.0,
                end: random.vector() * 4.0,
                flux: Vec3::new(random.unit(), random.unit(), random.unit()),
                medium: bounce * 3,
                bounce,
            };
            let mut words = pack_beam(&beam);
            words[0][MEDIUM_WORD] |= EVENT_LEAF_END;
            let back = unpack_beam(&words);
            assert_eq!((back.start, back.end, back.medium), (beam.start, beam.end, beam.medium));
            assert_eq!(back.bounce, bounce.min(PHOTON_BOUNCE_MAX));
            assert!((back.flux - beam.flux).abs().max_element() <= beam.flux.max_element() / 511.0);
            let bounds = event_box(beam.start, beam.end, 0.25);
            for i in 0..=10 {
                let at = beam.start.lerp(beam.end, i as f32 / 10.0);
                assert!(bounds.lower.cmple(at - 0.25).all() && bounds.upper.cmpge(at + 0.25).all());
            }
        }
    }

    #[test]
    fn rays_meet_beams_where_they_are_closest() {
        let mut random = Random(9);
        for profile in PROFILES {
            let n = 10_000;
            let place = |i: usize| (i as f64 + 0.5) / f64::from(n);
            let all: f64 = (0..n as usize)
                .map(|i| 2.0 * line_profile(profile, place(i).powi(2)) / f64::from(n))
                .sum();
            assert!((all - 1.0).abs() < 1e-6, "{profile:?}: {all}");
        }
        for _ in 0..1000 {
            let [origin, start] = [random.vector(), random.vector()].map(|v| v.as_dvec3());
            let [ray, way] = [random.direction(), random.direction()].map(|v| v.as_dvec3().normalize());
            let met = meet_beam(origin, ray, start, way);
            let between = |t: f64, along: f64| (origin + t * ray).distance_squared(start + along * way);
            assert!((between(met.t, met.along) - met.squared).abs() < 1e-9 / met.sine.powi(2));
            let step = 1e-3;
            for (t, along) in [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)] {
                assert!(between(met.t + t, met.along + along) >= met.squared - 1e-9 / met.sine.powi(2));
            }
        }
        assert_eq!(meet_beam(DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::Z).sine, 0.0);
    }

    #[test]
    fn beams_have_the_airlight_integral() {
        // Beams of a point light of 4π W at (1, 0, 2) in an endless medium of coefficients 0.1 and 0.05, over all directions; a ray from the origin along z to 4 m.
        let (sigma_s, sigma_t, h, t_max) = (0.1, 0.15, 0.05, 4.0);
        let light = DVec3::new(1.0, 0.0, 2.0);
        // Directions that pass within the kernel: y of less than the radius where they do.
        let (across, along) = (200, 2000);
        let mut sum = 0.0;
        for i in 0..across {
            for j in 0..along {
                // A place beside the ray, whose solid angle from the light the direction stands for.
                let y = (2.0 * (f64::from(i) + 0.5) / f64::from(across) - 1.0) * h * 1.2;
                let z = -4.0 + 16.0 * (f64::from(j) + 0.5) / f64::from(along);
                let way = DVec3::new(0.0, y, z) - light;
                let r = way.length();
                let solid_angle = (2.4 * h / f64::from(across)) * (16.0 / f64::from(along)) * (-way.x / r) / (r * r);
                let met = meet_beam(DVec3::ZERO, DVec3::Z, light, way / r);
                let d2 = met.squared / (h * h);
                if d2 < 1.0 && met.t > 0.0 && met.t < t_max && met.along > 0.0 {
                    let kernel = line_profile(KernelProfile::Epanechnikov, d2) / h;
                    let phase = phase_function(Phase::Isotropic, way / r, -DVec3::Z);
                    sum += sigma_s * kernel * phase * (-sigma_t * (met.t + met.along)).exp() / met.sine * solid_angle;
                }
            }
        }
        assert!((sum / 0.0108397 - 1.0).abs() < 3e-3, "{sum}");
    }

    #[test]
    fn kernels_integrate_to_one_over_space_and_marches_to_a_disk() {
        for profile in PROFILES {
            let n = 20_000;
            let shell = |i: usize| {
                let r = (i as f64 + 0.5) / f64::from(n);
                4.0 * PI * r * r * ball_profile(profile, r * r) / f64::from(n)
            };
            let all: f64 = (0..n as usize).map(shell).sum();
            assert!((all - 1.0).abs() < 1e-6, "{profile:?}: {all}");
            // Places a radius apart, the first by chance, see on average what the whole chord does.
            for d2 in [0.0, 0.25, 0.81] {
                let chord = |count: usize| -> f64 {
                    let step = 2.0 / count as f64;
                    let place = |i: usize| -1.0 + (i as f64 + 0.5) * step;
                    (0..count)
                        .map(|i| ball_profile(profile, d2 + place(i).powi(2)) * step)
                        .sum()
                };
                let marched: f64 = (0..1000)
                    .map(|i| {
                        let offset = (i as f64 + 0.5) / 1000.0;
                        let first = (-(1.0f64 - d2).sqrt() - offset).ceil();
                        let place = |k: i32| first + f64::from(k) + offset;
                        (0..3)
                            .map(|k| ball_profile(profile, d2 + place(k).powi(2)))
                            .sum::<f64>()
                            / 1000.0
                    })
                    .sum();
                let exact = chord(200_000);
                assert!(
                    (marched - exact).abs() < 2e-3 * exact,
                    "{profile:?} {d2}: {marched} {exact}"
                );
            }
        }
    }

    /// What the beam estimate expects of single scattering in an endless medium of coefficients 0.1 and 0.05, by events of a point light of 4π W at
    /// (1, 0, `z`), seen along z from the origin as far as 4: over the events' density about the ray. All lengths are multiplied by `lengths`, the
    /// way to the eye by `sign`, and each event by `factor`.
    fn airlight(k: f64, z: f64, sign: f64, lengths: f64, factor: f64) -> f64 {
        let (sigma_s, sigma_t) = (0.1 / lengths, 0.15 / lengths);
        let (light, h, t_max) = (DVec3::new(1.0, 0.0, z) * lengths, 0.05 * lengths, 4.0 * lengths);
        let (along, off, around) = (1000, 8, 12);
        let mut sum = 0.0;
        for i in 0..along {
            for j in 0..off {
                for a in 0..around {
                    let t = (f64::from(i) + 0.5) / f64::from(along) * t_max;
                    // Even in the disk's area.
                    let d = ((f64::from(j) + 0.5) / f64::from(off)).sqrt() * h;
                    let phi = 2.0 * PI * (f64::from(a) + 0.5) / f64::from(around);
                    let position = DVec3::new(d * phi.cos(), d * phi.sin(), t);
                    let volume = t_max * PI * h * h / f64::from(along * off * around);
                    let (way, r) = (position - light, (position - light).length());
                    // Watts that collide there.
                    let flux = sigma_t * (-sigma_t * r).exp() / (r * r) * volume * factor;
                    let approach = closest_approach(DVec3::ZERO, DVec3::Z, position);
                    let phase = phase_function(Phase::Schlick { k: k as f32 }, way / r, -DVec3::Z * sign);
                    let kernel =
                        kernel_profile(KernelProfile::Epanechnikov, approach.distance_squared / (h * h)) / (h * h);
                    sum += kernel * (-sigma_t * approach.t).exp() * sigma_s / sigma_t * phase * flux;
                }
            }
        }
        sum
    }

    #[test]
    fn single_scattering_has_its_constants_and_original_units_do_not() {
        // The exact integrals; kernels of 0.05 m blur them by about 0.1 %, most where the light is nearest to the ray.
        let expected = [
            (0.0, 2.0, 0.0108397),
            (0.5, 2.0, 0.0113180),
            (-0.5, 2.0, 0.0097508),
            (0.0, 0.0, 0.0072893),
            (0.5, 0.0, 0.0035960),
            (-0.5, 0.0, 0.0111230),
        ];
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 4e-3;
        for (k, z, expected) in expected {
            let value = airlight(k, z, 1.0, 1.0, 1.0);
            assert!(near(value, expected), "k {k}, z {z}: {value}, {expected}");
        }
        // The way to the eye is −v: turned round, forward scattering is taken for backward scattering.
        let mirrored = airlight(0.5, 0.0, -1.0, 1.0, 1.0);
        assert!(near(mirrored, 0.0111230), "{mirrored}");
        // The original form has the scattering coefficient in the albedo's place.
        let original = airlight(0.0, 2.0, 1.0, 1.0, 0.15);
        assert!((original - 0.00163).abs() < 1e-5, "{original}");
        // Ten times the lengths and a tenth of the coefficients: a hundredth; the original form's factor makes it a thousandth.
        let scaled = airlight(0.0, 2.0, 1.0, 10.0, 1.0);
        assert!(
            (scaled * 100.0 / airlight(0.0, 2.0, 1.0, 1.0, 1.0) - 1.0).abs() < 1e-9,
            "{scaled}"
        );
    }
}
