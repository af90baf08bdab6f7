//! Kernels against quadrature, inverses and simulation; records against what went in.

use super::*;
use crate::test_random::Random;
use crate::transport::differentials::footprint_side;
use crate::transport::testing::random3;
use glam::{DMat3, DVec2};
use std::f64::consts::{PI, TAU};

const PROFILES: [KernelProfile; 3] = [KernelProfile::Uniform, KernelProfile::Cone, KernelProfile::Epanechnikov];

const SETTINGS: KernelSettings = KernelSettings {
    shape: KernelShape::Skewed,
    spread: 1.0,
    exponent: 1.0,
    unit_length: 1.0,
    length_min: 1e-3,
    length_max: 1e3,
    flatness: 0.05,
    widens_flat: false,
};

fn footprint(z1: DVec3, z2: DVec3) -> Differentials {
    Differentials {
        z1,
        z2,
        ..Differentials::default()
    }
}

/// An ellipse's axes and its normal: up to 20 times as long as wide, and up to 85 degrees from a right angle.
fn random_axes(random: &mut Random) -> [DVec3; 3] {
    let n = random.direction().as_dvec3().normalize();
    let (t, b) = orthonormal_basis(n);
    let turn = TAU * f64::from(random.unit());
    let skew = 85f64.to_radians() * f64::from(random.signed());
    let at = |angle: f64| angle.cos() * t + angle.sin() * b;
    let length = f64::from(random.magnitude(-5, 4));
    let ratio = 20f64.powf(f64::from(random.unit()));
    [length * at(turn), length / ratio * at(turn + 0.5 * PI + skew), n]
}

fn random_kernel(random: &mut Random) -> (PhotonKernel, [DVec3; 3]) {
    loop {
        let [a, b, n] = random_axes(random);
        let settings = KernelSettings {
            flatness: 1e-4,
            ..SETTINGS
        };
        if let Some(kernel) = photon_kernel(&settings, &footprint(b, a), n) {
            return (kernel, [a, b, n]);
        }
    }
}

#[test]
fn profiles_integrate_to_one_with_their_variance() {
    for (profile, factor) in PROFILES.iter().zip([1.0, 1.5, 4.0 / 3.0]) {
        let rings = 200_000;
        let (mut one, mut squared) = (0.0, 0.0);
        for i in 0..rings {
            // Even in area.
            let k = kernel_profile(*profile, (f64::from(i) + 0.5) / f64::from(rings));
            one += k * PI / f64::from(rings);
            squared += k * k * PI / f64::from(rings);
        }
        assert!(
            (one - 1.0).abs() < 1e-6 && (squared * PI - factor).abs() < 1e-6,
            "{profile:?}: {one} {squared}"
        );
        assert_eq!(kernel_profile(*profile, 1.0), 0.0);
        // Sums over Poisson-distributed points, 30 in the disk on average, among 120 in a square about it.
        let (repeats, points) = (20_000u32, 120.0 / PI);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0u32);
        let mut unit = || {
            count += 1;
            random3(count, *profile as u32 + 60)
        };
        for _ in 0..repeats {
            let mut estimate = 0.0;
            // Gaps of a Poisson process have exponential lengths.
            let mut along = 0.0f64;
            loop {
                let u: DVec3 = unit();
                along -= (1.0 - u.z).ln() / points;
                if along >= 1.0 {
                    break;
                }
                estimate += kernel_profile(*profile, (2.0 * u.truncate() - 1.0).length_squared());
            }
            sum += estimate;
            squares += estimate * estimate;
        }
        let mean = sum / f64::from(repeats);
        let expected = points / 4.0;
        let relative = (squares / f64::from(repeats) - mean * mean) / (mean * mean) * expected * PI;
        // A sample variance of 20,000 nearly normal values is off by 1 %: five standard deviations.
        assert!((relative / factor - 1.0).abs() < 0.05, "{profile:?}: {relative}");
        assert!((mean / expected - 1.0).abs() < 5.0 * (factor / (expected * PI * f64::from(repeats))).sqrt());
    }
}

#[test]
fn weights_are_those_of_the_inverse_matrix() {
    let mut random = Random(1);
    let mut worst = 0.0f64;
    for _ in 0..2000 {
        let (kernel, [a, b, n]) = random_kernel(&mut random);
        assert!(kernel.across.dot(kernel.along) > 0.0);
        assert!((kernel_area(&kernel) / a.cross(b).length() - 1.0).abs() < 1e-12);
        // The longer axis is "along".
        let (a, b) = if a.length() >= b.length() { (a, b) } else { (b, a) };
        let inverse = DMat3::from_cols(a, b, b.length() * n).inverse();
        let delta = a * f64::from(random.signed())
            + b * f64::from(random.signed())
            + b.length() * n * f64::from(random.signed());
        let expected = kernel_profile(KernelProfile::Cone, (inverse * delta).length_squared()) / kernel_area(&kernel);
        let weight = kernel_weight(KernelProfile::Cone, &kernel, delta);
        worst = worst.max((weight - expected).abs() * kernel_area(&kernel));
    }
    println!("weights: {worst:.1e}");
    assert!(worst < 1e-10, "{worst:e}");
}

#[test]
fn kernels_integrate_to_one_over_the_tangent_plane() {
    let mut random = Random(2);
    for i in 0..1000 {
        let (kernel, [a, b, _]) = random_kernel(&mut random);
        let profile = PROFILES[i % 3];
        // In coordinates of the ellipse's principal axes, which bound it: the midpoint rule meets its rim only by a share of 1/steps.
        let [a, b] = principal_axes(a, b);
        let steps = 128;
        let mut sum = 0.0;
        for k in 0..steps * steps {
            let u = (DVec2::new(f64::from(k % steps), f64::from(k / steps)) + 0.5) * 2.0 / f64::from(steps) - 1.0;
            sum += kernel_weight(profile, &kernel, u.x * a + u.y * b);
        }
        let integral = sum * 4.0 / f64::from(steps * steps) * a.cross(b).length();
        // Gauss's circle problem: the hard rim of the uniform profile errs by about steps^(-3/2).
        let bound = if profile == KernelProfile::Uniform { 3e-3 } else { 1e-3 };
        assert!((integral - 1.0).abs() < bound, "{profile:?}: {integral}");
    }
}

#[test]
fn boxes_hold_the_ellipsoid_and_touch_it() {
    let mut random = Random(3);
    for _ in 0..300 {
        let (kernel, [a, b, n]) = random_kernel(&mut random);
        let (a, b) = if a.length() >= b.length() { (a, b) } else { (b, a) };
        let c = b.length() * n;
        let extent = kernel_extent(&kernel);
        for axis in 0..3 {
            // Where the ellipsoid reaches farthest along the axis.
            let gradient = DVec3::new(a[axis], b[axis], c[axis]);
            let u = gradient.normalize();
            let farthest = u.x * a + u.y * b + u.z * c;
            assert!((farthest[axis] - extent[axis]).abs() < 1e-12 * a.length());
            assert!(kernel_weight(KernelProfile::Uniform, &kernel, farthest * (1.0 - 1e-9)) > 0.0);
            assert_eq!(
                kernel_weight(KernelProfile::Uniform, &kernel, farthest * (1.0 + 1e-9)),
                0.0
            );
        }
        for _ in 0..20 {
            let u = random.direction().as_dvec3().normalize();
            let x = u.x * a + u.y * b + u.z * c;
            assert!((x.abs() - extent).max_element() <= 1e-12 * a.length());
        }
    }
}

#[test]
fn principal_axes_draw_the_same_ellipse_in_every_frame() {
    let mut random = Random(4);
    for _ in 0..500 {
        let [a, b, n] = random_axes(&mut random);
        let turn = TAU * f64::from(random.unit());
        let turned = [turn.cos() * a + turn.sin() * b, turn.cos() * b - turn.sin() * a];
        let [p, q] = principal_axes(a, b);
        assert!(p.dot(q).abs() < 1e-9 * p.length_squared() && p.length() >= q.length());
        assert!((p.cross(q).length() / a.cross(b).length() - 1.0).abs() < 1e-9);
        let again = principal_axes(turned[0], turned[1]);
        assert!((again[0].length() / p.length() - 1.0).abs() < 1e-12);
        let settings = KernelSettings {
            shape: KernelShape::Principal,
            exponent: 0.25,
            flatness: 1e-4,
            length_min: 1e-9,
            length_max: 1e9,
            ..SETTINGS
        };
        let kernels = [[a, b], turned].map(|[a, b]| photon_kernel(&settings, &footprint(a, b), n));
        if let [Some(k), Some(l)] = kernels {
            let delta = (k.along + k.across) * 0.5 * f64::from(random.signed()) + n * 0.1 * k.across.length();
            let [x, y] = [&k, &l].map(|k| kernel_weight(KernelProfile::Cone, k, delta) * kernel_area(k));
            assert!((x - y).abs() < 1e-8, "{x} {y}");
        }
    }
    let [a, b] = principal_axes(DVec3::X, DVec3::Y);
    assert_eq!([a, b], [DVec3::X, DVec3::Y]);
}

#[test]
fn the_normal_is_no_product_of_the_axes() {
    // The source would recover it as the direction of P × A. At right angles there is none, elsewhere its sign is that of A·B.
    let (mut right, mut wrong) = (0, 0);
    let mut random = Random(5);
    for _ in 0..2000 {
        let [a, b, n] = random_axes(&mut random);
        let Some(k) = photon_kernel(
            &KernelSettings {
                flatness: 1e-4,
                ..SETTINGS
            },
            &footprint(a, b),
            n,
        ) else {
            continue;
        };
        if k.across.cross(k.along).dot(n) > 0.0 {
            right += 1;
        } else {
            wrong += 1;
        }
    }
    println!("normals from axes: {right} right, {wrong} wrong");
    assert!(right > 500 && wrong > 500);
    let square = photon_kernel(&SETTINGS, &footprint(2.0 * DVec3::X, DVec3::Y), DVec3::Z).unwrap();
    assert!(square.across.cross(square.along).length() < 1e-12);
    // The stored normal answers, whatever the sign of A·B.
    for b in [DVec3::new(0.5, 1.0, 0.0), DVec3::new(-0.5, 1.0, 0.0)] {
        let k = photon_kernel(&SETTINGS, &footprint(2.0 * DVec3::X, b), DVec3::Z).unwrap();
        let words = pack_photon(&record(&k, Vec3::Z));
        let weight = |n: DVec3| photon_weight(KernelProfile::Cone, &words, DVec3::new(1.0, 2.0, 3.0), n, 0.0);
        assert!(weight(DVec3::Z) > 0.0);
        assert_eq!(weight(DVec3::NEG_Z), 0.0);
    }
}

#[test]
fn dampening_takes_the_root_of_the_longer_axis() {
    for (length, dampened) in [(16.0, 2.0), (1.0, 1.0), (1.0 / 16.0, 0.5)] {
        let settings = KernelSettings {
            exponent: 0.25,
            ..SETTINGS
        };
        let d = footprint(0.3 * length * DVec3::Y, length * DVec3::X);
        let k = photon_kernel(&settings, &d, DVec3::Z).unwrap();
        assert!((k.along.length() - dampened).abs() < 1e-12);
        assert!((k.across.length() / k.along.length() - 0.3).abs() < 1e-12);
        // As a disk of the same area, by its own root.
        let disk = KernelSettings {
            shape: KernelShape::Isotropic,
            ..settings
        };
        let k = photon_kernel(&disk, &d, DVec3::Z).unwrap();
        assert!((k.along.length() - footprint_side(&d).powf(0.25)).abs() < 1e-12);
    }
}

#[test]
fn flat_and_empty_footprints_have_no_kernel_and_long_ones_are_clamped() {
    let kernel = |a: DVec3, b: DVec3, s: &KernelSettings| photon_kernel(s, &footprint(a, b), DVec3::Z);
    assert!(kernel(DVec3::X, 0.049 * DVec3::Y, &SETTINGS).is_none());
    assert!(kernel(DVec3::X, 0.051 * DVec3::Y, &SETTINGS).is_some());
    assert!(kernel(DVec3::X, DVec3::X + 0.049 * DVec3::Y, &SETTINGS).is_none());
    assert!(kernel(DVec3::ZERO, DVec3::ZERO, &SETTINGS).is_none());
    assert!(kernel(DVec3::X, DVec3::ZERO, &SETTINGS).is_none());
    let settings = KernelSettings {
        length_min: 0.1,
        length_max: 2.0,
        flatness: 1e-3,
        ..SETTINGS
    };
    let k = kernel(5.0 * DVec3::X, DVec3::new(0.01, 0.02, 0.0), &settings).unwrap();
    assert!((k.along - 2.0 * DVec3::X).length() < 1e-12 && (k.across.length() - 0.1).abs() < 1e-12);
    // The Jacobian follows the clamped axes.
    let b = DVec3::new(0.01, 0.02, 0.0).normalize() * 0.1;
    assert!((kernel_area(&k) - (2.0 * DVec3::X).cross(b).length()).abs() < 1e-12);
}

#[test]
fn flat_footprints_are_widened_where_asked_for() {
    let widening = KernelSettings {
        length_min: 1e-6,
        widens_flat: true,
        ..SETTINGS
    };
    let kernel = |a: DVec3, b: DVec3, s: &KernelSettings| photon_kernel(s, &footprint(a, b), DVec3::Z).unwrap();
    // Nothing changes above the limit, and below it nothing but the width across the ellipse's longer axis.
    let b = DVec3::new(0.3, 0.051, 0.0);
    assert_eq!(kernel(DVec3::X, b, &widening), kernel(DVec3::X, b, &SETTINGS));
    for b in [0.049 * DVec3::Y, DVec3::X * 0.9 + 0.049 * DVec3::Y, DVec3::ZERO] {
        let k = kernel(DVec3::X, b, &widening);
        let longer = principal_axes(DVec3::X, b)[0];
        assert!((k.along - longer).length() < 1e-15, "{k:?}");
        let area = 0.05 * longer.length_squared();
        assert!((kernel_area(&k) - area).abs() < 1e-15, "{k:?}");
        let disk = KernelSettings {
            shape: KernelShape::Isotropic,
            ..widening
        };
        assert!((kernel_area(&kernel(DVec3::X, b, &disk)) - area).abs() < 1e-12);
    }
    let point = kernel(DVec3::ZERO, DVec3::ZERO, &widening);
    assert!((kernel_area(&point) - 1e-12).abs() < 1e-24, "{point:?}");
    // Without a limit there is one nevertheless.
    let unlimited = KernelSettings {
        flatness: 0.0,
        ..widening
    };
    let k = kernel(DVec3::X, 1e-300 * DVec3::X, &unlimited);
    assert_eq!(kernel_area(&k), FLATNESS_MIN);
}

#[test]
fn records_keep_the_area_of_the_flattest_kernels() {
    // Axes nearly along each other, whose product single precision loses, and just above the least flatness, where it keeps it.
    let mut random = Random(11);
    let mut kept = 0;
    for _ in 0..1000 {
        let n = random.direction().as_dvec3().normalize();
        let (t, b) = orthonormal_basis(n);
        let turn = TAU * f64::from(random.unit());
        let long = turn.cos() * t + turn.sin() * b;
        let beside = n.cross(long);
        for (offset, widens_flat) in [(1e-9, true), (1e-5, true), (1e-9, false), (1.2 * FLATNESS_MIN, false)] {
            let settings = KernelSettings {
                flatness: 0.0,
                widens_flat,
                ..SETTINGS
            };
            let made = photon_kernel(&settings, &footprint(long, 0.9 * long + offset * beside), n);
            assert_eq!(made.is_some(), widens_flat || offset > FLATNESS_MIN, "{offset}");
            let Some(kernel) = made else {
                continue;
            };
            kept += 1;
            let stored = unpack_photon(&pack_photon(&record(&kernel, n.as_vec3()))).kernel();
            let error = (kernel_area(&stored) / kernel_area(&kernel) - 1.0).abs();
            assert!(error < 1e-3, "{offset}: {error}");
            let weight = kernel_weight(KernelProfile::Epanechnikov, &stored, 0.5 * stored.along);
            assert!(
                (weight * kernel_area(&stored) * PI - 1.5).abs() < 1e-3,
                "{offset}: {weight}"
            );
        }
    }
    assert_eq!(kept, 3000);
}

#[test]
fn equal_disks_are_the_estimator_of_fixed_bandwidth() {
    let (h, n) = (0.37, DVec3::new(0.6, 0.0, 0.8));
    let fixed = KernelSettings {
        shape: KernelShape::Fixed,
        length_max: h,
        ..SETTINGS
    };
    let kernels = [
        photon_kernel(&fixed, &Differentials::default(), n).unwrap(),
        disk_kernel(h, n),
    ];
    let mut random = Random(6);
    for _ in 0..1000 {
        let delta = 0.3 * random.vector().as_dvec3();
        for profile in PROFILES {
            let expected = kernel_profile(profile, delta.length_squared() / (h * h)) / (h * h);
            for k in &kernels {
                assert!((kernel_weight(profile, k, delta) - expected).abs() < 1e-9 * (1.0 + expected));
            }
        }
    }
}

#[test]
fn even_light_is_estimated_without_bias() {
    // Photons even over a square, kernels of varying size and skew far from its rim: the mean is flux / area.
    let photons = 1_600_000u32;
    let mut random = Random(7);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..photons {
        let x = DVec3::new(f64::from(random.signed()), f64::from(random.signed()), 0.0);
        let size = 0.1 + 0.2 * f64::from(random.unit());
        let d = footprint(size * DVec3::X, DVec3::new(0.1 * f64::from(random.signed()), 0.1, 0.0));
        let k = photon_kernel(&SETTINGS, &d, DVec3::Z).unwrap();
        let weight = kernel_weight(KernelProfile::Epanechnikov, &k, -x);
        sum += weight;
        squares += weight * weight;
    }
    let n = f64::from(photons);
    let mean = sum / n;
    let deviation = ((squares / n - mean * mean) / n).sqrt();
    assert!(
        (mean - 0.25).abs() < 5.0 * deviation && deviation < 2e-3,
        "{mean} ± {deviation}"
    );
}

#[test]
fn scaling_the_scene_and_the_unit_scales_the_kernel() {
    let mut random = Random(8);
    for _ in 0..500 {
        let [a, b, n] = random_axes(&mut random);
        for shape in [
            KernelShape::Skewed,
            KernelShape::Principal,
            KernelShape::Isotropic,
            KernelShape::Fixed,
        ] {
            let settings = KernelSettings {
                shape,
                exponent: 0.25,
                length_min: 0.05,
                length_max: 1.0,
                ..SETTINGS
            };
            let plain = photon_kernel(&settings, &footprint(a, b), n);
            for scale in [1e-3, 1e3] {
                let settings = KernelSettings {
                    unit_length: scale,
                    ..settings
                };
                let scaled = photon_kernel(&settings, &footprint(scale * a, scale * b), n);
                match (&plain, &scaled) {
                    (Some(k), Some(l)) => {
                        assert!((scale * k.along - l.along).length() < 1e-9 * l.along.length());
                        assert!((scale * k.across - l.across).length() < 1e-9 * l.across.length());
                    }
                    _ => assert_eq!(plain.is_some(), scaled.is_some()),
                }
            }
        }
    }
}

fn record(k: &PhotonKernel, normal: Vec3) -> PhotonRecord {
    PhotonRecord {
        position: Vec3::new(1.0, 2.0, 3.0),
        normal,
        direction: Vec3::NEG_Z,
        flux: Vec3::new(0.25, 1.5, 0.75),
        along: k.along.as_vec3(),
        across: k.across.as_vec3(),
    }
}

#[test]
fn records_come_back() {
    let mut random = Random(10);
    for _ in 0..1000 {
        let (kernel, [_, _, n]) = random_kernel(&mut random);
        let mut p = record(&kernel, n.as_vec3());
        p.position = 100.0 * random.vector();
        p.direction = random.direction();
        p.flux = Vec3::new(random.unit(), random.unit(), random.unit());
        let mut words = pack_photon(&p);
        assert!(!photon_ends_leaf(&words));
        words[0][3] |= PHOTON_LEAF_END;
        assert!(photon_ends_leaf(&words));
        let back = unpack_photon(&words);
        assert_eq!(
            [back.position, back.along, back.across],
            [p.position, p.along, p.across]
        );
        assert!((back.normal - p.normal).length() < 1.31e-4 && (back.direction - p.direction).length() < 5.2e-4);
        assert!((back.flux - p.flux).abs().max_element() <= p.flux.max_element() / 512.0);
    }
    assert_eq!(size_of::<PhotonWords>(), 48);
}
