//! Footprints by path differentials, which have a derivative for each parameter of a path, beside those by the four vectors of photon differentials.
//!
//! Oracles: finite differences of where paths end; and inside a diffuse sphere around its light, where every meeting is uniform, each photon's share of
//! the sphere, with the closed form of what the re-emission makes of a footprint there: at a meeting of ratio r to that share, left at the cosine c,
//! the next ratio is (1 + √(r/2)/c)².

use std::f64::consts::{FRAC_1_PI, PI};

use clerestory::Result;
use clerestory::transport::differentials::path_differentials::PathDifferentials;
use clerestory::transport::differentials::{
    Differentials, diffuse_reemission, emission_differentials, footprint_side, transfer_differentials,
};
use clerestory::transport::warp::{
    UNIFORM_SPHERE_PDF, orthonormal_basis, square_to_cosine_hemisphere, square_to_sphere,
};
use glam::{DQuat, DVec2, DVec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::{Errors, greatest};
use crate::random::Random;

/// Photons of a pass that footprints are for.
const PHOTONS: [f64; 3] = [4096.0, 131_072.0, 4_194_304.0];
/// Meetings with the sphere: of two, four and six parameters.
const MEETINGS: usize = 3;
/// Least cosine of a reflection: below, photon differentials are clamped.
const COS_MIN: f64 = 0.1;
/// Step of the finite differences, in parameters of [0, 1].
const STEP: f64 = 1e-6;
/// Bytes of the four vectors of a pair of parameters in single precision.
const PAIR: u64 = 48;

rows! {
    /// A meeting, and photons of a pass.
    struct Row = "Footprints in a diffuse sphere, over each photon's share of it" by [meeting, photons] {
        meeting: u64 = "meeting",
        photons: f64 = "photons",
        photon: f64 = "photon differentials, median",
        path: f64 = "path differentials, median",
        off: f64 = "photon differentials off their closed form, worst",
        derivative: f64 = "path differentials off finite differences, worst",
        bytes: u64 = "bytes of path differentials",
        paths: u64 = "paths",
    }
    beside "bytes of photon differentials" = |_row| PAIR.into();
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "path differentials are the derivatives of where paths end: worst relative difference from finite ones",
        Bound::AtMost(1e-6),
        |row: &Row| row.derivative.into(),
    )
    .in_every_form(),
    Criterion::each(
        "photon differentials have their closed form: worst relative difference",
        Bound::AtMost(1e-9),
        |row: &Row| row.off.into(),
    )
    .in_every_form(),
    Criterion::each(
        "before a re-emission both are a photon's share: greatest difference from 1",
        Bound::AtMost(1e-9),
        |row: &Row| greatest([row.photon, row.path].map(|ratio| (ratio - 1.0).abs())).into(),
    )
    .among(|row| row.meeting == 1)
    .in_every_form(),
    Criterion::each(
        "behind one, photon differentials are nearer to it: their median over that of path differentials",
        Bound::AtMost(0.1),
        |row: &Row| (row.photon / row.path).into(),
    )
    .among(|row| row.meeting > 1),
];

/// A step of a path: its direction, with the derivatives by its two parameters, and the normal of the sphere where it begins.
struct Leg {
    direction: DVec3,
    by: [DVec3; 2],
    normal: DVec3,
    pdf: f64,
}

impl Leg {
    fn new(direction: DVec3, normal: DVec3, pdf: f64) -> Self {
        // A parameter of [0, 1] goes over all directions.
        let Differentials { w1, w2, .. } = emission_differentials(direction, pdf / (4.0 * PI));
        Self {
            direction,
            by: [w1, w2],
            normal,
            pdf,
        }
    }

    /// The cosine at which a reflection leaves.
    fn cosine(&self) -> f64 {
        self.direction.dot(self.normal)
    }
}

/// Where a ray from inside meets the unit sphere.
fn meet(place: DVec3, direction: DVec3) -> DVec3 {
    let b = place.dot(direction);
    place + direction * ((b * b + 1.0 - place.length_squared()).sqrt() - b)
}

/// Where a path ends when its parameters change; its frames turn with the normal.
fn end(legs: &[Leg], parameters: &[f64]) -> DVec3 {
    let mut place = DVec3::ZERO;
    for (leg, by) in legs.iter().zip(parameters.as_chunks::<2>().0) {
        let mut direction = (leg.direction + by[0] * leg.by[0] + by[1] * leg.by[1]).normalize();
        if leg.normal != DVec3::ZERO {
            direction = DQuat::from_rotation_arc(leg.normal, -place.normalize()) * direction;
        }
        place = meet(place, direction);
    }
    place
}

/// The largest relative difference of derivatives from finite ones.
fn off_differences(legs: &[Leg], derivatives: &[DVec3]) -> f64 {
    greatest(derivatives.iter().enumerate().map(|(k, derivative)| {
        let at = |step: f64| {
            let mut parameters = vec![0.0; derivatives.len()];
            parameters[k] = step;
            end(legs, &parameters)
        };
        let difference = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        (difference - *derivative).length() / derivative.length()
    }))
}

/// What is gathered of a meeting.
#[derive(Default)]
struct Gathered {
    photon: Errors,
    path: [Errors; PHOTONS.len()],
    off: f64,
    derivative: f64,
}

/// Follows a path, and adds what its footprints are at each meeting.
fn follow(random: &mut Random, gathered: &mut [Gathered; MEETINGS]) {
    let mut pair = || DVec2::new(random.unit(), random.unit());
    let mut legs = vec![Leg::new(square_to_sphere(pair()), DVec3::ZERO, UNIFORM_SPHERE_PDF)];
    let mut place = legs[0].direction;
    while legs.len() < MEETINGS {
        let local = square_to_cosine_hemisphere(pair());
        if local.z < COS_MIN {
            continue;
        }
        let (x, y) = orthonormal_basis(-place);
        let direction = local.x * x + local.y * y - local.z * place;
        legs.push(Leg::new(direction, -place, local.z * FRAC_1_PI));
        place = meet(place, direction).normalize();
    }
    let bend = |d: &Differentials| [-d.z1, -d.z2];
    let mut path = PathDifferentials::emission(legs[0].direction, legs[0].pdf);
    let mut photon = emission_differentials(legs[0].direction, legs[0].pdf);
    let (mut place, mut expected) = (DVec3::ZERO, 1.0f64);
    for (k, gathered) in gathered.iter_mut().enumerate() {
        let leg = &legs[k];
        if k > 0 {
            let fits = path.scatter(leg.normal, leg.direction, leg.pdf, bend);
            debug_assert!(fits, "six parameters at most");
            photon = diffuse_reemission(&photon, leg.direction, leg.pdf);
            expected = (1.0 + (0.5 * expected).sqrt() / leg.cosine()).powi(2);
        }
        let next = meet(place, leg.direction);
        let t = next.distance(place);
        place = next.normalize();
        path.transfer(t, leg.direction, -place);
        photon = transfer_differentials(&photon, t, leg.direction, -place);
        let ratio = footprint_side(&photon).powi(2);
        gathered.photon.add(ratio);
        gathered.off = greatest([gathered.off, (ratio / expected - 1.0).abs()]);
        for (errors, photons) in gathered.path.iter_mut().zip(PHOTONS) {
            errors.add(path.footprint_area(photons) * photons / (4.0 * PI));
        }
        let differences = off_differences(&legs[..=k], &path.footprint(1.0));
        gathered.derivative = greatest([gathered.derivative, differences]);
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let paths: u64 = context.pick(20_000, 50);
        let (mut random, mut gathered) = (Random::new(9), std::array::from_fn(|_| Gathered::default()));
        for _ in 0..paths {
            follow(&mut random, &mut gathered);
        }
        let rows = gathered.into_iter().zip(1..).flat_map(|(mut of, meeting)| {
            let photon = of.photon.quantile(0.5);
            let ratios = of.path.into_iter().zip(PHOTONS);
            let row = move |(mut path, photons): (Errors, f64)| Row {
                meeting,
                photons,
                photon,
                path: path.quantile(0.5),
                off: of.off,
                derivative: of.derivative,
                bytes: PAIR * meeting,
                paths,
            };
            ratios.map(row).collect::<Vec<Row>>()
        });
        Ok(rows.collect())
    }

    fn findings(&self) -> Findings {
        let second = |row: &&Row| row.meeting == 2;
        Findings::of(self, CRITERIA)
            .headline(
                "footprints of photon differentials behind a diffuse reflection, over each photon's share, median",
                self.iter().find(second).map(|row| row.photon.into()),
            )
            .note(
                "Each of n photons has the share 4π/n of the unit sphere at each meeting. With m parameters, steps of n^(−1/m) make footprints of path \
                 differentials grow over it as n^(1 − 2/m). Reflections at cosines below 0.1 are left out.",
            )
    }
}
