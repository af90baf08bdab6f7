//! Footprints with known areas: emission, mirrors and flat glass, re-emission, roulette, cameras.

use super::testing::{ROOM_AREA, room_photons};
use super::*;
use crate::transport::testing::random3;
use crate::transport::warp::{UNIFORM_SPHERE_PDF, cone_pdf, cosine_hemisphere_pdf, square_to_sphere};

const FLAT: [DVec3; 2] = [DVec3::ZERO; 2];

fn area(d: &Differentials) -> f64 {
    footprint_side(d).powi(2)
}

fn assert_near(value: f64, expected: f64, relative: f64) {
    assert!((value / expected - 1.0).abs() < relative, "{value} for {expected}");
}

#[test]
fn emitted_photons_share_what_they_meet() {
    let r = 2.5;
    for i in 0..200 {
        let w = square_to_sphere(random3(i, 1).truncate());
        let d = emission_differentials(w, UNIFORM_SPHERE_PDF);
        // A sphere about the light, where each of n photons has 4πr²/n.
        assert_near(area(&transfer_differentials(&d, r, w, -w)), r * r, 1e-12);
        let n = square_to_sphere(random3(i, 2).truncate());
        if w.dot(n).abs() > DIFFERENTIAL_COS_MIN {
            let on_plane = transfer_differentials(&d, r, w, n);
            assert_near(area(&on_plane), r * r / w.dot(n).abs(), 1e-9);
            assert!(
                on_plane.z1.dot(n).abs() < 1e-9 * on_plane.z1.length()
                    && on_plane.z2.dot(n).abs() < 1e-9 * on_plane.z2.length()
            );
        }
    }
    // A cone of half angle 0.5: derivatives of length sin(0.25).
    let spot = emission_differentials(DVec3::Z, cone_pdf(1.0 - 0.5f64.cos()));
    assert!((spot.w1.length() - 0.247_404).abs() < 1e-6 && (spot.w2.length() - 0.25f64.sin()).abs() < 1e-12);
}

#[test]
fn lights_with_area_and_beams_share_their_surface() {
    let (light, beam) = (0.7, 30.0);
    let photons = 1e5;
    let strata = 100_000;
    let mut sum = 0.0;
    for i in 0..strata {
        let cos = ((f64::from(i) + 0.5) / f64::from(strata)).sqrt();
        let w = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let d = area_light_differentials(w, cosine_hemisphere_pdf(cos), 1.0 / light, TAU);
        sum += 4.0 * PI / photons * area(&d);
        // Far away it is a point.
        if i % 1000 == 999 {
            let far = transfer_differentials(&d, 1e4, w, w);
            let pdf = cosine_hemisphere_pdf(cos.max(DIFFERENTIAL_REEMISSION_COS_MIN));
            assert_near(area(&far), 1e8 / (4.0 * PI * pdf), 1e-3);
        }
    }
    // The clamp takes half of its cosine away from the mean.
    let expected = light / photons * (1.0 - 0.5 * DIFFERENTIAL_REEMISSION_COS_MIN);
    assert_near(sum / f64::from(strata), expected, 1e-4);
    let w = DVec3::new(0.6, 0.0, -0.8);
    let d = parallel_beam_differentials(w, 1.0 / beam);
    assert_near(4.0 * PI / photons * area(&d), beam / photons, 1e-12);
    // Any distance further it has the same area across, and more on a floor.
    let floor = transfer_differentials(&d, 123.0, w, DVec3::Z);
    assert_near(4.0 * PI / photons * area(&floor), beam / photons / 0.8, 1e-12);
}

#[test]
fn mirrors_and_flat_glass_have_the_areas_of_unfolded_paths() {
    let (d1, d2) = (1.5, 2.5);
    let w = DVec3::new(0.6, 0.0, -0.8);
    let d = transfer_differentials(&emission_differentials(w, UNIFORM_SPHERE_PDF), d1, w, DVec3::Z);
    let d = reflect_differentials(&d, w, DVec3::Z, FLAT);
    let out = DVec3::new(0.6, 0.0, 0.8);
    let wall = DVec3::new(-0.8, 0.6, 0.0);
    let met = transfer_differentials(&d, d2, out, wall);
    assert_near(area(&met), (d1 + d2).powi(2) / out.dot(wall).abs(), 1e-12);
    for eta in [1.0 / 1.5, 1.5] {
        let w = -DVec3::Z;
        let d = transfer_differentials(&emission_differentials(w, UNIFORM_SPHERE_PDF), d1, w, DVec3::Z);
        let d = refract_differentials(&d, w, DVec3::Z, eta, FLAT);
        let met = transfer_differentials(&d, d2, w, DVec3::Z);
        assert_near(area(&met), (d1 + eta * d2).powi(2), 1e-12);
    }
    // Total reflection is reflection.
    let d = emission_differentials(w, 0.3);
    assert_eq!(
        refract_differentials(&d, w, DVec3::Z, 2.0, FLAT),
        reflect_differentials(&d, w, DVec3::Z, FLAT)
    );
}

#[test]
fn a_concave_mirror_about_the_light_focuses_to_nothing() {
    let r = 3.0;
    for i in 0..50 {
        let w = square_to_sphere(random3(i, 5).truncate());
        let d = transfer_differentials(&emission_differentials(w, UNIFORM_SPHERE_PDF), r, w, -w);
        let before = area(&d);
        let d = reflect_differentials(&d, w, -w, [-d.z1 / r, -d.z2 / r]);
        let at_light = transfer_differentials(&d, r, -w, w);
        assert!(area(&at_light) < 1e-12 * before, "{}", area(&at_light));
    }
}

#[test]
fn reemission_keeps_the_expected_area() {
    let d = Differentials {
        z1: DVec3::new(0.3, 0.1, 0.0),
        z2: DVec3::new(0.1, 0.5, 0.0),
        w1: DVec3::X,
        w2: DVec3::Y,
    };
    let strata = 1_000_000;
    let (mut plain, mut carried) = (0.0, 0.0);
    for i in 0..strata {
        let cos = (1.0 - (f64::from(i) + 0.5) / f64::from(strata)).sqrt();
        plain += 1.0 / cos;
        if i % 10 == 5 {
            let w = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            carried += 10.0 * area(&diffuse_reemission(&d, w, cosine_hemisphere_pdf(cos)));
        }
    }
    // The mean of 1/cos is 2; the midpoint rule misses 2.4·√(strata)⁻¹ of its inverse root.
    assert!(
        (plain / f64::from(strata) - 2.0).abs() < 2e-3,
        "{}",
        plain / f64::from(strata)
    );
    let expected = area(&d) * (1.0 - 0.5 * DIFFERENTIAL_REEMISSION_COS_MIN);
    assert_near(carried / f64::from(strata), expected, 1e-3);
    // The virtual offset of a hemisphere is √(2 |z1 × z2|).
    let up = diffuse_reemission(&d, DVec3::Z, cosine_hemisphere_pdf(1.0));
    assert_near(up.z1.length() / up.w1.length(), (2.0 * area(&d)).sqrt(), 1e-12);
    // Rough lobes keep every photon's area, and spread as their density says.
    for pdf in [0.1, 1.0, 1e4] {
        let rough = rough_reemission(&d, DVec3::Z, pdf);
        assert_near(area(&rough), area(&d), 1e-12);
        assert_near(rough.w1.length(), 1.0 / (4.0 * PI * pdf).sqrt(), 1e-12);
    }
    // Grazing directions stay finite.
    let grazing = diffuse_reemission(&d, DVec3::X, 0.0);
    assert!(guard_differentials(&grazing, 1.0).1);
}

#[test]
fn roulette_makes_up_for_those_that_it_ends() {
    let d = emission_differentials(DVec3::Z, 0.2);
    let d = transfer_differentials(&d, 2.0, DVec3::Z, DVec3::Z);
    let after = roulette_differentials(&d, 0.25);
    assert_near(area(&after), 4.0 * area(&d), 1e-12);
    // In a room of mirrors the footprints of a hit cover the walls as often with roulette as without.
    let photons = 1 << 15;
    let cover = |rho: f64, seed: u64| {
        let mut sums = [0.0; 3];
        let mut squares = [0.0; 3];
        room_photons(photons, rho, true, 1.0, seed, |hit| {
            let share = 4.0 * PI * area(&hit.differentials) / ROOM_AREA;
            sums[hit.number as usize - 1] += share;
            squares[hit.number as usize - 1] += share * share;
        });
        let n = f64::from(photons);
        [0, 1, 2].map(|k| {
            let mean = sums[k] / n;
            (mean, ((squares[k] / n - mean * mean) / n).sqrt())
        })
    };
    let (with, without) = (cover(0.5, 1), cover(1.0, 2));
    println!("footprints over the walls: {with:?}, {without:?}");
    // The first hits cover them exactly once. Five standard deviations each: false alarm below 3e-6 in all.
    assert!((with[0].0 - 1.0).abs() < 5.0 * with[0].1);
    for (a, b) in with.iter().zip(&without).skip(1) {
        assert!((a.0 - b.0).abs() < 5.0 * (a.1 * a.1 + b.1 * b.1).sqrt());
    }
}

#[test]
fn what_is_not_a_number_or_too_large_is_zeroed() {
    let fit = emission_differentials(DVec3::Z, 0.2);
    assert_eq!(guard_differentials(&fit, 1.0), (fit, true));
    let mut large = fit;
    large.z2.y = 2e3;
    assert!(guard_differentials(&large, 1.0).1);
    assert_eq!(guard_differentials(&large, 1e-3), (Differentials::default(), false));
    for bad in [f64::NAN, f64::INFINITY, 2e6] {
        let mut d = fit;
        d.w1.x = bad;
        assert_eq!(guard_differentials(&d, 1e3), (Differentials::default(), false));
    }
}

#[test]
fn grazing_transfers_stay_finite_and_in_the_plane() {
    let w = DVec3::new(1.0, 0.0, -1e-9).normalize();
    let d = transfer_differentials(&emission_differentials(w, 0.1), 2.0, w, DVec3::Z);
    assert!(guard_differentials(&d, 1.0).1);
    assert!(d.z1.z.abs().max(d.z2.z.abs()) < 1e-9);
}

#[test]
fn camera_footprints_are_pixels() {
    let (right, up) = (DVec3::X * 0.001, DVec3::Y * 0.002);
    let distance = 7.0;
    for (px, py) in [(0.0, 0.0), (300.0, -200.0)] {
        let pinhole = DVec3::NEG_Z + px * right + py * up;
        let w = pinhole.normalize();
        let d = camera_differentials(pinhole, right, up);
        let d = transfer_differentials(&d, distance * pinhole.length(), w, DVec3::Z);
        assert!((d.z1 - distance * right).length() < 1e-12 && (d.z2 - distance * up).length() < 1e-12);
    }
}

#[test]
fn scaling_the_scene_scales_positions_alone() {
    let mut plain = Vec::new();
    room_photons(2000, 0.7, false, 1.0, 5, |hit| plain.push(hit.differentials));
    for scale in [1e-3, 1e3] {
        let mut i = 0;
        room_photons(2000, 0.7, false, scale, 5, |hit| {
            let (a, b) = (&plain[i], &hit.differentials);
            let near = |a: DVec3, b: DVec3| (a - b).length() <= 1e-9 * a.length();
            assert!(near(scale * a.z1, b.z1) && near(scale * a.z2, b.z2) && near(a.w1, b.w1) && near(a.w2, b.w2));
            i += 1;
        });
        assert_eq!(i, plain.len());
    }
}
