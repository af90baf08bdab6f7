//! Events in media, and chains of up to five, against finite differences of where photons collide.
//!
//! That is a function of three numbers: two that choose the direction, and the share of photons that have not collided before. Its determinant is the volume that each of n photons has,
//! times n. A scattering begins anew, as from a point behind it.

use super::footprint::{footprint_across, passed_differentials, scattered_in_medium};
use crate::scene::Phase;
use crate::test_random::Random;
use crate::transport::differentials::test_surfaces::{KINDS, Kind, Surface, surface, vector};
use crate::transport::differentials::{
    Differentials, emission_differentials, reflect_differentials, transfer_differentials,
};
use crate::transport::phase::{phase_direction, phase_function, phase_function_sample};
use crate::transport::warp::{UNIFORM_SPHERE_PDF, square_to_sphere};
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::PI;

const PHASES: [Phase; 4] = [
    Phase::Isotropic,
    Phase::Rayleigh,
    Phase::Schlick { k: -0.6 },
    Phase::HenyeyGreenstein { g: 0.7 },
];

/// How far the extinction is from its mean, at most.
const UNEVEN: f64 = 0.6;

/// An extinction that waves through space.
#[derive(Clone, Copy)]
struct Waves {
    /// 1/m.
    mean: f64,
    /// 1/m.
    wave: DVec3,
}

impl Waves {
    fn new(random: &mut Random) -> Self {
        Self {
            mean: f64::from(random.range(0.1, 0.8)),
            wave: 1.5 * vector(random),
        }
    }

    fn extinction(&self, x: DVec3) -> f64 {
        self.mean * (1.0 + UNEVEN * self.wave.dot(x).sin())
    }

    /// Optical depth of the distance `t` from `x` along `w`.
    fn depth(&self, x: DVec3, w: DVec3, t: f64) -> f64 {
        let (phase, slope) = (self.wave.dot(x), self.wave.dot(w));
        self.mean * (t + UNEVEN * (phase.cos() - (phase + slope * t).cos()) / slope)
    }

    /// The distance with this optical depth, which is close to `near`.
    fn distance(&self, x: DVec3, w: DVec3, depth: f64, near: f64) -> f64 {
        let mut t = near;
        for _ in 0..8 {
            t -= (self.depth(x, w, t) - depth) / self.extinction(x + t * w);
        }
        t
    }
}

#[derive(Clone, Copy)]
enum Event {
    Specular(Kind),
    /// An invisible one.
    Boundary,
    Scattered,
}

/// Where a leg's direction is from.
#[derive(Clone, Copy)]
enum Source {
    Light,
    /// A collision, to which a photon came along this direction.
    Collision(Phase, DVec3),
}

/// A photon's way since it was emitted or scattered last.
struct Leg {
    source: Source,
    start: DVec3,
    /// Of the point behind the start, m.
    offset: f64,
    /// The numbers that chose the direction.
    square: DVec2,
    /// Media, each up to a surface at about this distance, through which photons go straight or which scatters them.
    media: Vec<(Waves, Surface, f64, bool)>,
    /// The last one, and the distance of the collision in it.
    last: (Waves, f64),
}

impl Leg {
    fn direction(&self, square: DVec2) -> DVec3 {
        match self.source {
            Source::Light => square_to_sphere(square),
            Source::Collision(phase, from) => phase_direction(from, phase_function_sample(phase, square.x), square.y),
        }
    }

    /// Optical depth that the photon itself has behind it.
    fn depth(&self) -> f64 {
        let (x, w, depth) = self.to_the_last(self.square);
        depth + self.last.0.depth(x, w, self.last.1)
    }

    /// Place and direction at which the last medium begins, and the optical depth before it.
    fn to_the_last(&self, square: DVec2) -> (DVec3, DVec3, f64) {
        let mut w = self.direction(square);
        let mut x = self.start + self.offset * (w - self.direction(self.square));
        let mut depth = 0.0;
        for (medium, surface, near, straight) in &self.media {
            let met = surface.meet(x, w, *near);
            depth += medium.depth(x, w, met.t);
            x = met.position;
            if !straight {
                w = surface
                    .scatter(w, &met, &Differentials::default(), reflect_differentials)
                    .0;
            }
        }
        (x, w, depth)
    }

    /// Where photons collide whose numbers are so far from the photon's; `share` is of those that come as far as it.
    fn collision(&self, square: DVec2, share: f64) -> DVec3 {
        let (x, w, depth) = self.to_the_last(self.square + square);
        let (medium, near) = self.last;
        let whole = self.depth() - (1.0 + share).ln();
        x + medium.distance(x, w, whole - depth, near) * w
    }

    /// The determinant of the place by the three numbers, by differences of fourth order.
    fn volume(&self, h: f64) -> f64 {
        let difference =
            |at: &dyn Fn(f64) -> DVec3| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let columns = DMat3::from_cols(
            difference(&|s| self.collision(s * DVec2::X, 0.0)),
            difference(&|s| self.collision(s * DVec2::Y, 0.0)),
            difference(&|s| self.collision(DVec2::ZERO, s)),
        );
        // Of shares of all photons.
        columns.determinant().abs() * self.depth().exp()
    }
}

type Pass = fn(&Differentials, f64) -> Differentials;

/// A number in the middle of [0, 1).
fn middle(random: &mut Random) -> f64 {
    f64::from(random.range(0.1, 0.9))
}

/// The last leg of a way with these events and a collision at its end, and the volume that its footprint has; `None` where an event is ill-conditioned.
fn chain(random: &mut Random, events: &[Event], pass: Pass) -> Option<(Leg, f64)> {
    let distance = |random: &mut Random| f64::from(random.range(0.3, 1.5));
    let mut leg = Leg {
        source: Source::Light,
        start: vector(random),
        offset: 0.0,
        square: DVec2::new(middle(random), middle(random)),
        media: Vec::new(),
        last: (Waves::new(random), 0.0),
    };
    let (mut x, mut w) = (leg.start, leg.direction(leg.square));
    let mut d = emission_differentials(w, UNIFORM_SPHERE_PDF);
    for event in events {
        let medium = leg.last.0;
        let kind = match event {
            Event::Specular(kind) => *kind,
            // Only where it is counts.
            Event::Boundary => Kind::PlaneMirror,
            Event::Scattered => {
                let t = distance(random);
                let at = x + t * w;
                let here = medium.extinction(at);
                let pdf = here * (-medium.depth(x, w, t)).exp();
                let across = footprint_across(&d, t, w);
                let (phase, survival) = (random.choose(&PHASES), f64::from(random.range(0.3, 1.0)));
                leg = Leg {
                    source: Source::Collision(phase, w),
                    start: at,
                    // Photons in the area across the way that collide in a mean free path, and those that outlive it.
                    offset: (across / (pdf / here) / survival).sqrt(),
                    square: DVec2::new(middle(random), middle(random)),
                    media: Vec::new(),
                    last: (medium, 0.0),
                };
                let out = leg.direction(leg.square);
                d = scattered_in_medium(across, pdf, here, survival, out, phase_function(phase, w, out));
                (x, w) = (at, out);
                continue;
            }
        };
        let (surface, near) = surface(random, kind, x, w);
        let met = surface.meet(x, w, near);
        let straight = matches!(event, Event::Boundary);
        let passed = (-medium.depth(x, w, met.t)).exp();
        let mut beyond = medium;
        if straight {
            d = Differentials {
                z1: d.z1 + met.t * d.w1,
                z2: d.z2 + met.t * d.w2,
                ..d
            };
            beyond = Waves::new(random);
        } else {
            d = transfer_differentials(&d, met.t, w, met.geometric);
            let (out, scattered) = surface.scatter(w, &met, &d, reflect_differentials);
            let refracted = surface.eta > 0.0;
            // As for surfaces alone: near the critical angle differences have no bound of their error.
            if refracted && (out.dot(met.normal).abs() < 0.2 || out.dot(met.normal) * w.dot(met.normal) < 0.0) {
                return None;
            }
            (w, d) = (out, scattered);
            if refracted {
                beyond = Waves::new(random);
            }
        }
        d = pass(&d, passed);
        leg.media.push((medium, surface, near, straight));
        leg.last.0 = beyond;
        x = met.position;
    }
    leg.last.1 = distance(random);
    let (medium, t) = leg.last;
    let across = footprint_across(&d, t, w);
    let pdf = medium.extinction(x + t * w) * (-medium.depth(x, w, t)).exp();
    let sides = (d.z1 + t * d.w1).length() * (d.z2 + t * d.w2).length();
    // A flat footprint is a difference of larger numbers.
    let is_sound = across > 0.05 * sides && (1e-3..1e3).contains(&across);
    is_sound.then_some((leg, 4.0 * PI * across / pdf))
}

/// The largest and the middle error of the volumes of so many chains, relative. Of three steps the one that suits the chain's curvature counts: a wrong volume agrees with none.
fn errors(seed: u64, count: usize, pass: Pass, events: impl Fn(&mut Random) -> Vec<Event>) -> (f64, f64) {
    let mut random = Random(seed);
    let mut errors = Vec::new();
    while errors.len() < count {
        let events = events(&mut random);
        if let Some((leg, carried)) = chain(&mut random, &events, pass) {
            let error = |h: f64| (carried / leg.volume(h) - 1.0).abs();
            errors.push([2e-4, 2e-5, 2e-6].map(error).into_iter().fold(f64::INFINITY, f64::min));
        }
    }
    errors.sort_by(f64::total_cmp);
    (errors[count - 1], errors[count / 2])
}

fn any_event(random: &mut Random) -> Event {
    match random.below(4) {
        0 => Event::Boundary,
        1 => Event::Scattered,
        _ => Event::Specular(random.choose(&KINDS)),
    }
}

#[test]
fn each_event_in_media_agrees_with_finite_differences() {
    let none = errors(1, 200, passed_differentials, |_| Vec::new());
    assert!(none.0 < 1e-8 && none.1 < 1e-10, "a flight alone: {none:?}");
    let specular = KINDS.map(Event::Specular);
    for (i, event) in [Event::Boundary, Event::Scattered]
        .into_iter()
        .chain(specular)
        .enumerate()
    {
        let (largest, middle) = errors(i as u64 + 2, 200, passed_differentials, |_| vec![event]);
        println!("event {i}: {largest:.1e}, median {middle:.1e}");
        assert!(largest < 1e-8 && middle < 1e-10, "event {i}: {largest:e} {middle:e}");
    }
}

#[test]
fn chains_of_events_in_media_agree_with_finite_differences() {
    for length in 2..=5 {
        let (largest, middle) = errors(100 + length as u64, 200, passed_differentials, |random| {
            (0..length).map(|_| any_event(random)).collect()
        });
        println!("{length} events: {largest:.1e}, median {middle:.1e}");
        assert!(
            largest < 1e-6 && middle < 1e-9,
            "{length} events: {largest:e} {middle:e}"
        );
    }
}

#[test]
fn footprints_that_forget_who_has_collided_are_too_small() {
    let (_, middle) = errors(7, 100, |d, _| *d, |_| vec![Event::Boundary]);
    assert!(middle > 0.1, "median error {middle:e}");
}
