//! Kernels of the photons of an empty closed room: how many cover a point, against figures that were published for such a room, and footprints
//! against the true density of photons.

use super::*;
use crate::transport::differentials::testing::{ROOM_AREA, room_photons};
use crate::transport::differentials::{footprint_side, global_step};
use glam::DVec3;
use std::f64::consts::PI;

const PHOTONS: u32 = 1 << 17;

/// What is counted over the second and third hits.
#[derive(Debug, Default)]
struct Cover {
    records: u32,
    discarded: u32,
    clamped: u32,
    /// Kernels over a point.
    contributions: f64,
    /// Standard deviation of that sum.
    deviation: f64,
}

fn cover(photons: u32, rho: f64, scale: f64, settings: &KernelSettings) -> Cover {
    let mut cover = Cover::default();
    let (mut sum, mut squares, mut of_photon) = (0.0, 0.0, 0.0);
    room_photons(photons, rho, false, scale, 17, |hit| {
        if hit.number == 1 {
            sum += of_photon;
            squares += of_photon * of_photon;
            of_photon = 0.0;
            return;
        }
        match photon_kernel(settings, &hit.differentials, hit.normal) {
            None => cover.discarded += 1,
            Some(k) => {
                cover.records += 1;
                cover.clamped +=
                    u32::from(k.along.length() > settings.length_max * settings.unit_length * (1.0 - 1e-9));
                of_photon += PI * kernel_area(&k) / (ROOM_AREA * scale * scale);
            }
        }
    });
    sum += of_photon;
    squares += of_photon * of_photon;
    cover.contributions = sum;
    cover.deviation = (squares - sum * sum / f64::from(photons)).sqrt();
    cover
}

fn room_settings(shape: KernelShape) -> KernelSettings {
    KernelSettings {
        shape,
        spread: 20.0 * global_step(f64::from(PHOTONS)),
        exponent: 0.25,
        unit_length: 1.0,
        length_min: 1e-3,
        length_max: 1.0,
        flatness: 1.0 / 20.0,
        widens_flat: false,
    }
}

#[test]
fn kernels_cover_the_room_as_published() {
    for (n, spread, rho, contributions, records) in [
        (PHOTONS, 20.0, 0.5, 213.0, 98_083.0),
        (PHOTONS, 20.0, 0.7, 309.0, 155_262.0),
        (PHOTONS, 20.0, 0.8, 361.0, 188_249.0),
        (2 * PHOTONS, 28.0, 0.75, 657.0, 2.0 * 131_072.0 * 0.75 * 1.75),
    ] {
        let settings = KernelSettings {
            spread: spread * global_step(f64::from(n)),
            ..room_settings(KernelShape::Skewed)
        };
        let c = cover(n, rho, 1.0, &settings);
        println!("rho {rho}, n {n}: {c:?}");
        // The figures are of another run with as many photons; one run's sum is good to 0.5 %.
        assert!(c.deviation < 0.005 * c.contributions);
        assert!((c.contributions / contributions - 1.0).abs() < 0.02, "rho {rho}: {c:?}");
        // The count of survivors: five standard deviations of both runs, one survivor in the next being no more than itself.
        let deviation = f64::from(n).sqrt() * 2.0;
        assert!(
            (f64::from(c.records) - records).abs() < 5.0 * deviation,
            "rho {rho}: {c:?}"
        );
        let share = |count: u32| f64::from(count) / f64::from(c.records);
        assert!(
            (0.0009..0.0016).contains(&share(c.discarded)) && share(c.clamped) < 1e-4,
            "rho {rho}: {c:?}"
        );
    }
}

#[test]
fn stronger_dampening_means_fewer_kernels_over_a_point() {
    let at = |exponent: f64, length_max: f64, shape: KernelShape| {
        let settings = KernelSettings {
            exponent,
            length_max,
            ..room_settings(shape)
        };
        cover(PHOTONS / 4, 0.5, 1.0, &settings).contributions
    };
    let undampened = at(1.0, 1e9, KernelShape::Skewed);
    let [half, quarter] = [0.5, 0.25].map(|exponent| at(exponent, 1.0, KernelShape::Skewed));
    println!("exponents 1, 1/2, 1/4: {undampened} {half} {quarter}");
    assert!(undampened > 5.0 * half && half > 1.5 * quarter);
    for shape in [KernelShape::Principal, KernelShape::Isotropic] {
        println!("{shape:?}: {}", at(0.25, 1.0, shape));
    }
    // Undampened, all shapes have the area of the footprint.
    for shape in [KernelShape::Principal, KernelShape::Isotropic] {
        let same = at(1.0, 1e9, shape);
        assert!((same / undampened - 1.0).abs() < 0.02, "{shape:?}: {same} {undampened}");
    }
}

#[test]
fn the_room_looks_the_same_at_every_scale_when_the_unit_goes_with_it() {
    let photons = 1 << 12;
    let settings = KernelSettings {
        spread: 20.0 * global_step(f64::from(photons)),
        ..room_settings(KernelShape::Skewed)
    };
    let plain = cover(photons, 0.7, 1.0, &settings);
    for scale in [1e-3, 1e3] {
        let scaled = KernelSettings {
            unit_length: scale,
            ..settings
        };
        let c = cover(photons, 0.7, scale, &scaled);
        assert_eq!(
            (c.records, c.discarded, c.clamped),
            (plain.records, plain.discarded, plain.clamped)
        );
        assert!((c.contributions / plain.contributions - 1.0).abs() < 1e-9);
        // A unit that stays a metre, as the source has it, gives other kernels.
        let c = cover(photons, 0.7, scale, &settings);
        assert!(
            (c.contributions / plain.contributions - 1.0).abs() > 0.5,
            "{}",
            c.contributions
        );
    }
}

#[test]
fn footprints_after_a_diffuse_bounce_follow_the_density_of_photons() {
    let (rho, photons) = (0.5, 1 << 15);
    let mut first = Vec::new();
    // Of second hits: place, normal, |z1 × z2|, and the same without the virtual offset.
    let mut second = Vec::new();
    room_photons(photons, rho, false, 1.0, 23, |hit| {
        if hit.number == 1 {
            first.push((hit.position, hit.normal));
        } else if let (2, Some((from, _))) = (hit.number, first.last()) {
            let along = hit.position - *from;
            let t = along.length();
            let d = &hit.differentials;
            let plain = t * t * d.w1.cross(d.w2).length() * t / along.dot(hit.normal).abs();
            second.push((hit.position, hit.normal, footprint_side(d).powi(2), plain));
        }
    });
    // Footprints over a point: each first hit covers all walls but its own once.
    let mean_and_deviation = |values: &[f64]| {
        let n = f64::from(photons);
        let (sum, squares) = values.iter().fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
        (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt())
    };
    let cover = |area: fn(&(DVec3, DVec3, f64, f64)) -> f64| {
        let shares: Vec<f64> = second.iter().map(|hit| 4.0 * PI * area(hit) / ROOM_AREA).collect();
        mean_and_deviation(&shares)
    };
    let (with, without) = (cover(|hit| hit.2), cover(|hit| hit.3));
    let others: Vec<f64> = first
        .iter()
        .map(|(_, n)| 1.0 - if n.z == 0.0 { 18.0 } else { 36.0 } / ROOM_AREA)
        .collect();
    let others = mean_and_deviation(&others).0;
    println!("over a point: {with:?} with the offset, {without:?} without, {others} expected");
    // Five standard deviations, and 1 % of walls that lie within the cosine's clamp.
    assert!((without.0 - others).abs() < 5.0 * without.1 + 0.01, "{without:?}");
    assert!((with.0 - 4.4).abs() < 5.0 * with.1 + 0.1, "{with:?}");

    // Photons of the second hit per area and emitted photon are the mean over first hits; 4π |z1 × z2| is the footprint's area.
    first.truncate(2000);
    second.truncate(2000);
    let ratios = |area: fn(&(DVec3, DVec3, f64, f64)) -> f64| {
        let mut ratios: Vec<f64> = second
            .iter()
            .map(|hit| {
                let arriving = |(x, m): &(DVec3, DVec3)| {
                    let to = hit.0 - *x;
                    let squared = to.length_squared().max(1e-6);
                    m.dot(to).max(0.0) * -hit.1.dot(to).min(0.0) / (PI * squared * squared)
                };
                4.0 * PI * area(hit) * rho * first.iter().map(arriving).sum::<f64>() / first.len() as f64
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        [0.1, 0.25, 0.5, 0.75, 0.9].map(|share| ratios[(share * ratios.len() as f64) as usize])
    };
    let (with, without) = (ratios(|hit| hit.2), ratios(|hit| hit.3));
    println!("area times density at 10, 25, 50, 75, 90 %: {with:.2?} with the offset, {without:.2?} without");
    // Without the offset most footprints are smaller than the photon's share of the walls, with it larger: dampening is for that excess.
    assert!(without[2] > 0.4 && without[2] < 1.0 && with[2] > 1.0 && with[2] < 4.0);
}
