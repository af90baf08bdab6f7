//! A lamp and a camera inside fog so dense that light comes a millimetre far.

use std::f64::consts::PI;

use clerestory::Result;
use clerestory::scene::{Camera, LightKind, Phase, Scene};
use glam::{DVec3, Vec3};

use crate::scenes::{medium, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-inside",
    breaks: "Offsets of rays, least distances and radii of kernels that are fine in metres are many free paths here, and 1/r² beside the lamp is 10⁸.",
    expects: "A ray past a lamp in endless fog of σ = 10³ m⁻¹ and albedo ½ has the radiance of the same fog a thousand times as thin, times 10⁶: single scattering by its integral, and multiple scattering as the integral equation of a point source has it.",
    picture: || {
        let mut scene = past_a_lamp();
        let (eye, target) = (DVec3::new(-3.0, 0.5, 0.0), DVec3::new(0.0, 0.5, 0.0));
        scene.cameras = vec![Camera::look_at("main", eye * METRES, target * METRES, DVec3::Y, 0.9)];
        Ok(scene)
    },
    documented_bias: Some(
        "Kernels of photons are wide beside a lamp, where light changes within a part of a free path, and blur it. Kernels shrink from pass to pass; choose a smaller radius. Planes have no kernels; but few of them have much of the light \
         of a single ray, those that it nearly lies in, and where the radius is chosen for them a share of ways alone has planes. Here all have, in eight passes; take more of them, or let eye paths share the light (setting `volume_paths`).",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// A free path, m.
const METRES: f64 = 1e-3;
/// Share that collisions scatter.
const ALBEDO: f64 = 0.5;
/// Free paths from the lamp to the ray, and from the camera to where the ray passes it.
const PAST: f64 = 0.5;
const BEFORE: f64 = 3.0;
/// Radiance of light that was scattered twice or more, of a lamp of 1 W in fog of a free path of 1 m: as the tests of the path tracer have it (`tests/tests/media`).
const MULTIPLE: f64 = 4.22674e-4;
/// What blur about a lamp may cost techniques with kernels, and rare planes those without.
const BLURRED: f64 = 0.1;
/// A radius that lets all ways have planes, m: none of their light comes by kernels.
const RADIUS: f64 = 0.1 * METRES;
/// Samples, and passes of planes.
const SAMPLES: u32 = 256;
const PASSES: u32 = 8;

/// A lamp of 1 W, and one ray past it.
fn past_a_lamp() -> Scene {
    let mut scene = Scene {
        name: "lamp in fog".into(),
        ..Scene::default()
    };
    scene
        .media
        .push(medium((1.0 / METRES) as f32, ALBEDO as f32, Phase::Isotropic));
    scene.surrounding = Some(0);
    let intensity = Vec3::splat((0.25 / PI) as f32);
    let position = Vec3::ZERO;
    scene.add_light("point", LightKind::Point { position, intensity });
    let (eye, target) = (DVec3::new(-BEFORE, PAST, 0.0), DVec3::new(0.0, PAST, 0.0));
    scene.cameras = vec![orthographic(
        eye * METRES,
        target * METRES,
        DVec3::Y,
        (1e-6 * METRES) as f32,
    )];
    scene
}

/// Radiance of light that was scattered once, as [`MULTIPLE`]: by a midpoint rule, as far as anything is left.
fn single() -> f64 {
    let (step, far) = (1e-3, 30.0);
    let places = (0..(far / step) as u32).map(|i| (f64::from(i) + 0.5) * step);
    let scattered = places.map(|t| {
        let r = (t - BEFORE).hypot(PAST);
        (-t - r).exp() / (r * r)
    });
    ALBEDO / (16.0 * PI * PI) * scattered.sum::<f64>() * step
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let expected = (single() + MULTIPLE) / (METRES * METRES);
    let of_planes = easel
        .with("volume_radius", RADIUS)
        .with("samples_per_pass", SAMPLES / PASSES);
    let easel = match easel.chosen_word("volume") {
        Some("planes") => &of_planes,
        _ => easel,
    };
    let painted = easel.paint_in_passes(&past_a_lamp(), easel.size_in_media()?, SAMPLES)?;
    let documented = if easel.has_bias() { BLURRED } else { 0.0 };
    judgement.mean_documented("a ray past a lamp", &painted, [expected; 3], [0.0, documented])?;
    Ok(judgement)
}
