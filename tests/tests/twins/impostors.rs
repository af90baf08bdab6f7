//! Impostors and gathers: proxies, directions, steps of searches, the choice of maps, solid angles and reflectivities.

use clerestory::maps::gather::{Reflectivity, SolidAngleForm, gather_solid_angle};
use clerestory::maps::impostor::places::blended_maps;
use clerestory::maps::impostor::proxy::{box_proxy, hemisphere_proxy, mirrored, refracted, sphere_proxy};
use clerestory::maps::impostor::{impostor_plane, impostor_plane_ratio, impostor_step};
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Case, Tolerance, U, compare};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec3, Vec3};

use crate::{cases, direction, join, list, shift, ulps, v3};

twin_kernel!(twin_impostor);

/// Lengths are subtracted from ones of size 1.
fn of_size_one(result: f64, absolute: f64) -> Tolerance {
    Tolerance {
        input_size: 1.0,
        ..ulps(result, 4.0, absolute)
    }
}

#[test]
fn proxies_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(70, |r| {
            let x = r.vector();
            let low = [r.range(-3.0, -1.0), r.range(-3.0, -1.0), r.range(-3.0, -1.0)];
            let high = [r.range(1.0, 3.0), r.range(1.0, 3.0), r.range(1.0, 3.0)];
            join(&[
                &x.to_array(),
                &direction(r).to_array(),
                &[r.range(2.0, 4.0)],
                &low,
                &high,
            ])
        });
        let results = twin_impostor(gpu, 0, &table, &[]);
        let worst = compare("proxies", &table, &results, of_size_one(16.0, 4.0 * U), 0..13, |x| {
            let (at, r) = (v3(x, 0), v3(x, 3));
            vec![
                sphere_proxy(at, r, x[6]),
                hemisphere_proxy(at, r, x[6]),
                box_proxy(at, r, v3(x, 7), v3(x, 10)),
            ]
        });
        println!("proxies: {worst:.3} of what is allowed");
        // Along walls, and out of them.
        let edges: Vec<_> = [
            [0.0, 1.0, 0.0, 1.0, 0.0, 0.0],
            [3.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 5.0, 0.0, 0.0, 0.0, 1.0],
        ]
        .map(|x| clerestory_tests::twin::Case::new(&join(&[&x, &[1.0], &[-1.0; 3], &[1.0; 3]])))
        .to_vec();
        for (case, result) in edges.iter().zip(twin_impostor(gpu, 0, &edges, &[])) {
            let x = case.0.map(f64::from);
            let (at, r) = (v3(&x, 0), v3(&x, 3));
            let expected = [
                sphere_proxy(at, r, 1.0),
                hemisphere_proxy(at, r, 1.0),
                box_proxy(at, r, DVec3::NEG_ONE, DVec3::ONE),
            ];
            for (found, expected) in result.0.iter().zip(expected) {
                assert!(
                    (f64::from(*found) - expected).abs() < 1e-6,
                    "{case:?}: {found} {expected}"
                );
            }
        }
    });
}

#[test]
fn directions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(71, |r| {
            let n = direction(r);
            let d = r.direction();
            let against = if d.dot(n) > 0.0 { -d } else { d };
            let ratio = r.choose(&[1.0 / 1.5, 1.0, 1.33, 1.5]);
            join(&[&against.to_array(), &n.to_array(), &[ratio]])
        });
        let results = twin_impostor(gpu, 1, &table, &[]);
        let near_total = |x: &[f64]| {
            let cos_i = v3(x, 0).dot(v3(x, 3));
            (1.0 - x[6] * x[6] * (1.0 - cos_i * cos_i)).abs() < 1e-3
        };
        // On the verge of total reflection the two forms differ by rounding of the root.
        let kept: Vec<_> = table
            .iter()
            .zip(&results)
            .filter(|(case, _)| !near_total(&case.0.map(f64::from)))
            .collect();
        assert!(kept.len() > table.len() * 9 / 10);
        let (table, results): (Vec<_>, Vec<_>) = kept.into_iter().map(|(case, result)| (*case, *result)).unzip();
        let worst = compare("directions", &table, &results, of_size_one(8.0, 4.0 * U), 0..7, |x| {
            list![
                mirrored(v3(x, 0), v3(x, 3)).to_array(),
                refracted(v3(x, 0), v3(x, 3), x[6]).to_array(),
            ]
        });
        println!("directions: {worst:.3} of what is allowed");
    });
}

#[test]
fn steps_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(72, |r: &mut Random| {
            // Ratios apart, or equal to the bit.
            let g = r.range(0.2, 1.8);
            let other = if r.below(4) == 0 {
                g
            } else {
                g + r.choose(&[0.3, -0.2, 0.05])
            };
            join(&[
                &[r.range(0.0, 3.0), g, r.range(0.0, 3.0), other, r.range(0.5, 4.0)],
                &[f32::from_bits(r.below(2) as u32)],
            ])
        });
        let results = twin_impostor(gpu, 2, &table, &[]);
        let worst = compare("steps", &table, &results, of_size_one(8.0, 0.0), 0..5, |x| {
            let other = ((x[5] as f32).to_bits() != 0).then_some((x[2], x[3]));
            vec![impostor_step((x[0], x[1]), other, x[4])]
        });
        println!("steps: {worst:.3} of what is allowed");
    });
}

/// Planes across directions and nearly along them, in front and behind, near and far; and those that are none.
#[test]
fn planes_agree_with_their_twins() {
    with_gpu(|gpu| {
        let aside = [Vec3::X, Vec3::Y, Vec3::NEG_Z];
        let table = cases(78, |r: &mut Random| {
            let c = direction(r);
            let n = r.choose(&[1.0, -1.0, 0.3]) * direction(r);
            let (n, c) = if r.below(10) == 0 {
                let i = r.below(3);
                (aside[i], aside[(i + 1) % 3])
            } else {
                (n, c)
            };
            let size = r.range(0.1, 10.0);
            let l = size * (c + r.choose(&[0.0, 0.01, 0.5]) * r.vector());
            // Lengths of a room, and of where there is no surface.
            let near = r.range(0.1, 10.0);
            let inverse = r.choose(&[near, 1e-16, 1e16]);
            join(&[&[inverse], &n.to_array(), &c.to_array(), &l.to_array(), &[l.length()]])
        });
        let results = twin_impostor(gpu, 5, &table, &[]);
        // A plane along a direction goes anywhere.
        let is_across = |case: &Case| {
            let x = case.0.map(f64::from);
            let at_centre = v3(&x, 1).dot(v3(&x, 4)).abs();
            at_centre == 0.0 || at_centre > 1e-2
        };
        let kept: Vec<_> = table.iter().zip(&results).filter(|(case, _)| is_across(case)).collect();
        assert!(kept.len() > table.len() * 8 / 10, "{}", kept.len());
        let (table, results): (Vec<_>, Vec<_>) = kept.into_iter().map(|(case, result)| (*case, *result)).unzip();
        let worst = compare("planes", &table, &results, of_size_one(8.0, 0.0), 1..11, |x| {
            let plane = impostor_plane(x[0], v3(x, 1), v3(x, 4));
            let ratio = impostor_plane_ratio(plane, v3(x, 7), x[10]);
            list![plane.to_array(), [ratio]]
        });
        println!("planes: {worst:.3} of what is allowed");
    });
}

#[test]
fn discs_and_reflectivities_agree_with_their_twins() {
    with_gpu(|gpu| {
        let lobe = Reflectivity::new(20.0).expect("table");
        let edges = [0.0, 1e-30, 1e-7, 1.0, 1e9, 6e37, 3.4e38, f32::INFINITY];
        let table = cases(75, |r: &mut Random| {
            let t = if r.below(3) == 0 {
                r.choose(&edges)
            } else {
                r.range(0.0, 50.0)
            };
            // A quotient that overflows, one that is 0, and the ones that there are.
            let [area, squared] = r.choose(&[[1e20, 1e-25], [1e-30, 1e30], [0.3, 0.7], [2.0, 1e-3]]);
            join(&[&[
                t,
                area,
                squared,
                r.unit(),
                r.choose(&[1.0, -1.0, 0.9999, 0.0]) * r.unit(),
            ]])
        });
        let results = twin_impostor(gpu, 4, &table, lobe.values());
        let discs = compare("discs", &table, &results, ulps(16.0, 0.0, 0.0), 0..0, |x| {
            let of_disc = |area: f64, squared: f64| {
                // As f32 has it.
                let area = if area / squared > f64::from(f32::MAX) {
                    f64::INFINITY
                } else {
                    area
                };
                gather_solid_angle(SolidAngleForm::Disc, area, squared, 1.0)
            };
            vec![of_disc(x[0], 1.0), of_disc(x[1], x[2])]
        });
        // A table of numbers up to 3.3, in steps of up to half of one over a part of 63 in all.
        let reflectivities: Vec<_> = results.iter().map(|results| shift(results, 2)).collect();
        let looked_up = compare(
            "reflectivities",
            &table,
            &reflectivities,
            ulps(8.0, 4.0, 4e-6),
            3..5,
            |x| vec![lobe.at(x[3], x[4])],
        );
        println!("discs {discs:.3}, reflectivities {looked_up:.3} of what is allowed");
    });
}

#[test]
fn maps_are_chosen_as_their_twins_say() {
    with_gpu(|gpu| {
        let mut random = Random(73);
        let places: Vec<Vec3> = (0..16).map(|_| random.vector()).collect();
        let exact: Vec<DVec3> = places.iter().map(|place| place.as_dvec3()).collect();
        let flat: Vec<f32> = places.iter().flat_map(Vec3::to_array).collect();
        let table = cases(74, |r| {
            let count = [1, 2, 3, 16][r.below(4)];
            let point = if r.below(5) == 0 {
                places[r.below(16)]
            } else {
                1.5 * r.vector()
            };
            join(&[&point.to_array(), &[f32::from_bits(count)]])
        });
        let results = twin_impostor(gpu, 3, &table, &flat);
        let mut ties = 0;
        for (case, result) in table.iter().zip(&results) {
            let point = Vec3::from_slice(&case.0).as_dvec3();
            let count = case.0[3].to_bits() as usize;
            let twin = blended_maps(&exact[..count], point).expect("places");
            if [result.bits(0), result.bits(1)] != twin.maps {
                // Equally far but for rounding.
                ties += 1;
                continue;
            }
            assert!(
                (f64::from(result.0[2]) - twin.weight).abs() < 1e-4,
                "{point}: {twin:?} {result:?}"
            );
        }
        assert!(ties < 3, "{ties}");
    });
}
