//! Reflective and imperfect shadow maps: device and twin.

use clerestory::raster::reflective::{rsm_radical_inverse, rsm_solid_angle, rsm_warp};
use clerestory::raster::splat_atlas::{atlas_distance, atlas_middle_radius, atlas_reach, atlas_slack, atlas_stratum};
use clerestory_tests::twin_kernel;
use clerestory_tests::with_gpu;

use super::*;

twin_kernel!(twin_reflective);

#[test]
fn reflective_maps_agree_with_their_twins() {
    with_gpu(|gpu| {
        // Texels of a cube's face of whatever size, and whole faces.
        let table = cases(80, |r| {
            let size = if r.below(8) == 0 { 2.0 } else { r.magnitude(-4, 0) };
            let lower = [r.range(-1.0, 1.0), r.range(-1.0, 1.0)];
            // What is left of the width when the corner is rounded.
            let upper = lower.map(|x| x + size);
            join(&[&lower, &upper])
        });
        let results = twin_reflective(gpu, 0, &table, &[]);
        let worst = compare("solid angles", &table, &results, ulps(512.0, 8.0, 0.0), 0..1, |x| {
            vec![rsm_solid_angle(v2(x, 0), v2(x, 2))]
        });
        println!("solid angles: worst error {worst:.3} of what is allowed");
        let table = cases(81, |r| {
            let share = |r: &mut Random| if r.below(4) == 0 { 0.0 } else { r.magnitude(-3, 3) };
            let mut children = [share(r), share(r), share(r), share(r)];
            children[r.below(4)] += 1.0;
            let base = r.choose(&[2u32, 3, 5]);
            let magnitude = r.below(31);
            let index = r.below(1 << magnitude) as u32;
            join(&[&children, &[unit(r), unit(r)], &[index, base].map(f32::from_bits)])
        });
        let results = twin_reflective(gpu, 1, &table, &[]);
        let mut other = 0;
        for (case, result) in table.iter().zip(&results) {
            let x: Vec<f64> = case.0.iter().map(|x| f64::from(*x)).collect();
            let (child, place) = rsm_warp([x[0], x[1], x[2], x[3]], v2(&x, 4));
            let inverse = rsm_radical_inverse(case.0[6].to_bits(), case.0[7].to_bits());
            assert!((f64::from(result.0[3]) - inverse).abs() < 4e-7, "{case:?}");
            let chosen = result.bits(2);
            assert!(case.0[chosen as usize] > 0.0, "an empty child: {case:?}");
            if chosen != 2 * child.y + child.x {
                // A number on the border of shares.
                other += 1;
                continue;
            }
            // Places are as exact as the shares that they are stretched by.
            let shares = [x[0] + x[1], x[2] + x[3]];
            let row = [(x[0], x[1]), (x[2], x[3])][child.y as usize];
            let stretch = |part: f64, all: f64| 1e-6 * (1.0 + all / part);
            let own = [[row.0, row.1][child.x as usize], shares[child.y as usize]];
            let allowed = [stretch(own[0], row.0 + row.1), stretch(own[1], shares[0] + shares[1])];
            for (i, allowed) in allowed.into_iter().enumerate() {
                let error = (f64::from(result.0[i]) - place[i]).abs();
                assert!(error <= allowed, "{case:?}: {error} of {allowed}");
            }
        }
        assert!(other < CASES / 50, "{other}");
    });
}

#[test]
fn discs_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(82, |r| {
            let distance = r.magnitude(-2, 2);
            let p = r.direction() * distance;
            let normal = r.direction();
            let (radius, half_diagonal) = (distance * r.magnitude(-3, 0), r.magnitude(-3, 0));
            let position = r.vector() * r.magnitude(-2, 4);
            // Towards the disc, or about.
            let direction = (p / distance + r.vector() * r.magnitude(-3, 0)).normalize();
            let words = [r.below(1 << 20) as u32, r.below(1 << 16) as u32, 16].map(f32::from_bits);
            join(&[
                &p.to_array(),
                &normal.to_array(),
                &[radius],
                &direction.to_array(),
                &[half_diagonal],
                &words,
                &[distance],
                &position.to_array(),
            ])
        });
        let results = twin_reflective(gpu, 2, &table, &[]);
        let (mut open, mut met) = (0, 0);
        for (case, result) in table.iter().zip(&results) {
            let x: Vec<f64> = case.0.iter().map(|x| f64::from(*x)).collect();
            let (p, normal, direction) = (v3(&x, 0), v3(&x, 3), v3(&x, 7));
            // Edge-on what is rounding decides.
            let fall = normal.dot(direction).abs().max(1e-3);
            let allowed = 1e-6 * p.length() * (1.0 + 1.0 / (fall * fall));
            let same = |found: f32, expected: f64| {
                f64::from(found) == expected || (f64::from(found) - expected).abs() <= allowed
            };
            let slack = atlas_slack(v3(&x, 15), p.length());
            let hit = atlas_distance(p, normal, x[6], slack, direction);
            met += usize::from(hit < f64::INFINITY);
            open += usize::from(!same(result.0[0], hit));
            // Heights are as far off as distances are rounded, over half diagonals of a thousandth at least.
            let middle = atlas_middle_radius(p.length(), normal.dot(p).abs(), x[6], x[10]);
            for (found, expected) in [(result.0[1], middle), (result.0[4], slack)] {
                assert!(
                    (f64::from(found) / expected - 1.0).abs() < 1e-3,
                    "{found} instead of {expected}"
                );
            }
            let [map, point, strata] = [11, 12, 13].map(|i| case.0[i].to_bits());
            assert_eq!(result.bits(2), atlas_stratum(map, point, strata));
            open += usize::from(result.bits(3) != atlas_reach(x[14], x[6], x[10]) as u32);
        }
        println!("{met} of {CASES} met, {open} within rounding of a border");
        assert!(met > CASES / 8 && open < CASES / 100, "{met} {open}");
    });
}
