//! Nearest neighbours at points of a wall, against all photons that the device has traced, one by one.

use super::settings::room;
use super::*;
use clerestory::techniques::photon_mapping::kernel::kernel_profile;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::with_gpu;
use glam::DVec3;

/// Half of the side of what is seen: as good as a point.
const HALF: f32 = 1e-5;
/// Squared radii are known to 10⁻⁴, and what is seen is 10⁻⁴ of the distance to neighbours wide.
const TOLERANCE: f64 = 1e-3;
/// What the room's walls reflect.
const REFLECTANCE: [f64; 3] = [0.6, 0.5, 0.4];

/// Points of the wall at z = −1, off its edges.
fn points() -> impl Iterator<Item = DVec3> {
    (0..9).map(|i| DVec3::new(0.3 * f64::from(i % 3) - 0.29, 0.3 * f64::from(i / 3) - 0.31, -1.0))
}

/// Photons of the first pass that were scattered once, on facets like the wall's, by squared distance from a point.
fn nearest(mapper: &mut PhotonMapper, point: DVec3) -> Vec<(f64, Vec3)> {
    let photons = mapper.photons(0).unwrap_or_else(|error| panic!("{error}"));
    let mut near: Vec<(f64, Vec3)> = photons
        .iter()
        .filter(|p| p.bounce == 1 && p.record.normal.z > 0.5)
        .map(|p| (p.record.position.as_dvec3().distance_squared(point), p.record.flux))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near
}

/// Radiance from the photons nearer than the root of `squared` under one kernel as wide.
fn radiance(near: &[(f64, Vec3)], squared: f64, profile: KernelProfile) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (distance, flux) in near.iter().take_while(|(distance, _)| *distance < squared) {
        let weight = kernel_profile(profile, distance / squared) / squared;
        (0..3).for_each(|c| sum[c] += REFLECTANCE[c] / PI * weight * f64::from(flux[c]));
    }
    sum
}

/// Greatest relative difference of a picture from a colour.
fn difference(picture: &[f32], expected: [f64; 3]) -> f64 {
    let of = |(i, value): (usize, &f32)| (f64::from(*value) / expected[i % 3] - 1.0).abs();
    picture.iter().enumerate().map(of).fold(0.0, f64::max)
}

/// The first pass at a point.
fn seen(mapper: &mut PhotonMapper, point: DVec3) -> Vec<f32> {
    let camera = orthographic(point.with_z(0.9), point, DVec3::Y, HALF);
    mapper.set_camera(&camera).unwrap_or_else(|error| panic!("{error}"));
    advance(mapper, 1)
}

#[test]
fn neighbours_are_those_of_brute_force() {
    with_gpu(|gpu| {
        let (scene, neighbors) = (room(), 20);
        for profile in [KernelProfile::Epanechnikov, KernelProfile::Uniform] {
            let settings = PhotonSettings {
                neighbors,
                profile,
                ..settings("bounces=2..2")
            };
            let mut mapper = mapper(gpu, &scene, &settings);
            let (mut judged, mut told) = (0, 0);
            for point in points() {
                let near = nearest(&mut mapper, point);
                let picture = seen(&mut mapper, point);
                // An even kernel leaves the last one out of its sum, others by themselves.
                let share = |k: usize| {
                    if profile == KernelProfile::Uniform {
                        (k - 1) as f64 / k as f64
                    } else {
                        1.0
                    }
                };
                // Just beyond the last neighbour.
                let of = |k: usize| radiance(&near, near[k - 1].0 * (1.0 + 1e-12), profile).map(|v| v * share(k));
                let k = neighbors as usize;
                if near[k].0 < near[k - 1].0 * (1.0 + 2.0 * TOLERANCE) {
                    // The next photon is as near, to what is told apart.
                    continue;
                }
                let error = difference(&picture, of(k));
                println!("{profile:?}, {point}: {error:.1e}");
                assert!(error < TOLERANCE, "{profile:?}, {point}: {error}");
                judged += 1;
                let others = [k - 1, k + 1].map(|k| difference(&picture, of(k)));
                told += u32::from(others.iter().all(|error| *error > TOLERANCE));
            }
            // One neighbour more or less is seen.
            assert!(
                judged > 4 && told * 2 > judged,
                "{profile:?}: {told} of {judged} points tell"
            );
        }
    });
}

#[test]
fn fewer_neighbours_than_asked_for_have_the_kernel_that_was_searched() {
    with_gpu(|gpu| {
        let scene = room();
        // Too few within the radius.
        let few = PhotonSettings {
            neighbors: 100,
            radius: 0.2,
            ..settings("bounces=2..2")
        };
        // More within the radius than a query has steps for, and fewer than asked for: the area searched is halved until the steps suffice.
        let dense = PhotonSettings {
            neighbors: 1000,
            radius: 0.35,
            photons: 1 << 16,
            query_quota: 450,
            ..settings("bounces=2..2")
        };
        for (settings, halved) in [(few, false), (dense, true)] {
            let mut mapper = mapper(gpu, &scene, &settings);
            for point in points() {
                let near = nearest(&mut mapper, point);
                let picture = seen(&mut mapper, point);
                let searched = f64::from(settings.radius).powi(2);
                let found = near.iter().filter(|(distance, _)| *distance < searched).count();
                assert!(
                    found > 3 && found < settings.neighbors as usize,
                    "{point}: {found} photons"
                );
                let errors: Vec<f64> = (0..7)
                    .map(|h| {
                        let squared = searched * 0.5f64.powi(h);
                        difference(&picture, radiance(&near, squared, settings.profile))
                    })
                    .collect();
                println!("{point}: {found} photons, {errors:.4?}");
                let right: Vec<usize> = (0..7).filter(|h| errors[*h] < TOLERANCE).collect();
                // That of the radius alone, or of one of the halved areas.
                assert!(
                    right.iter().any(|h| (*h > 0) == halved) && right.len() == 1,
                    "{point}: {errors:?}"
                );
            }
        }
    });
}
