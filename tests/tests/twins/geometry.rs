//! Ray starts, spheres and triangles.

use clerestory::accel::offset::{SURFACE_SLACK, scene_reach, surface_point};
use clerestory::accel::sphere::{closest_approach, intersect_sphere};
use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use clerestory::gpu::DeviceKind;
use clerestory_tests::twin::{Results, U, compare};
use clerestory_tests::with_gpu;
use glam::Vec3;

use crate::{CASES, cases, direction, join, shift, twin_math, ulps, v3};

#[test]
fn surface_points_and_ray_starts_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(10, |r| {
            let size = r.choose(&[1e-4, 1.0, 1e5]);
            let place = r.vector() * r.choose(&[0.0, 1.0, 1e5]);
            let mut all: Vec<f32> = (0..3).flat_map(|_| (place + size * r.vector()).to_array()).collect();
            let u = r.unit();
            all.extend([u, r.unit() * (1.0 - u)]);
            all.extend((place - 2.0 * size).to_array());
            all.extend((place + 2.0 * size).to_array());
            for _ in 0..2 {
                all.extend(direction(r).to_array());
            }
            all.extend((place + size * r.vector()).to_array());
            all.extend([size * 1e-6; 3]);
            all
        });
        for (case, result) in table.iter().zip(twin_math(gpu, 8, &table, &[])) {
            let x = case.0.map(f64::from);
            let corner = |i: usize| Vec3::from_slice(&case.0[3 * i..]);
            let vertices = [corner(0), corner(1), corner(2)];
            let reach = scene_reach(
                vertices[0],
                Vec3::from_slice(&case.0[11..]),
                Vec3::from_slice(&case.0[14..]),
            );
            let twin = surface_point(&vertices, [case.0[9], case.0[10]], reach);
            let exact = v3(&x, 0) + (v3(&x, 3) - v3(&x, 0)) * x[9] + (v3(&x, 6) - v3(&x, 0)) * x[10];
            // The point's own bound, without the share that belongs to the triangle test, must hold.
            let bound = twin.error.as_dvec3() - f64::from(SURFACE_SLACK * reach) * 0.999;
            let difference = (result.vector(0) - exact).abs();
            assert!(difference.cmple(bound).all(), "{difference} {bound} {:?}", case.0);
            let error = result.vector(3);
            assert!(
                (error - twin.error.as_dvec3()).abs().cmple(error * 1e-6).all(),
                "{error} {}",
                twin.error
            );
            // The start lies on the side of the direction, as far off as the error says, to the rounding of the position.
            let (normal, towards) = (v3(&x, 17), v3(&x, 20));
            let side = if normal.dot(towards) < 0.0 { -1.0 } else { 1.0 };
            let wanted = result.vector(0) + normal * (side * normal.abs().dot(error));
            if normal.dot(towards).abs() > 1e-6 {
                let rounding = 4.0 * U * (wanted.abs() + error.length());
                assert!((result.vector(6) - wanted).abs().cmple(rounding).all(), "{:?}", case.0);
            }
            // Start plus segment is the far point: its normal is zero.
            let end = result.vector(9) + result.vector(12);
            let rounding = 4.0 * U * (end.abs() + result.vector(9).abs() + result.vector(12).abs());
            assert!((end - v3(&x, 23)).abs().cmple(rounding).all(), "{end} {:?}", case.0);
        }
    });
}

#[test]
fn spheres_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(11, |r| {
            join(&[
                &(5.0 * r.vector()).to_array(),
                &direction(r).to_array(),
                &(5.0 * r.vector()).to_array(),
                &[r.choose(&[0.0, -1.0, 0.1, 2.0, 6.0])],
            ])
        });
        let results = twin_math(gpu, 9, &table, &[]);
        let approach: Vec<Results> = results.iter().map(|r| shift(r, 3)).collect();
        compare(
            "closest approach",
            &table,
            &approach,
            ulps(16.0, 4.0, 16.0 * 5.0 * U),
            0..9,
            |x| {
                let a = closest_approach(v3(x, 0), v3(x, 3), v3(x, 6));
                vec![a.t, a.distance_squared]
            },
        );
        let mut hits = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let near = closest_approach(v3(&x, 0), v3(&x, 3), v3(&x, 6))
                .distance_squared
                .sqrt();
            let clear = (near - x[9]).abs() > 1e-3;
            match intersect_sphere(v3(&x, 0), v3(&x, 3), v3(&x, 6), x[9]) {
                Some(t) if clear => {
                    hits += 1;
                    // √((r − d)(r + d)) has the slope d/√…: with r − d above 10⁻³ an error of 10u·5 in d becomes below 4·10⁻⁴.
                    assert_eq!(result.bits(0), 1);
                    assert!(
                        (f64::from(result.0[1]) - t[0])
                            .abs()
                            .max((f64::from(result.0[2]) - t[1]).abs())
                            < 4e-4,
                        "{:?}",
                        case.0
                    );
                }
                None if clear || x[9] <= 0.0 => assert_eq!(result.bits(0), 0, "{:?}", case.0),
                _ => {}
            }
        }
        assert!(hits > 100);
    });
}

#[test]
fn triangles_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(12, |r| {
            let origin = r.vector();
            let corners: Vec<f32> = (0..3).flat_map(|_| r.vector().to_array()).collect();
            let inside = Vec3::from_slice(&corners) * 0.4
                + Vec3::from_slice(&corners[3..]) * 0.3
                + Vec3::from_slice(&corners[6..]) * 0.3;
            let to = if r.below(2) == 0 { inside - origin } else { direction(r) };
            join(&[
                &origin.to_array(),
                &to.to_array(),
                &corners,
                &[r.choose(&[0.0, 0.5]), r.choose(&[1e30, 0.9, f32::INFINITY])],
            ])
        });
        let mut met = 0;
        for (case, result) in table.iter().zip(twin_math(gpu, 10, &table, &[])) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let twin = intersect_triangle(
                &ray_shear(at(0), at(3)),
                &[at(6), at(9), at(12)],
                case.0[15],
                case.0[16],
            );
            if gpu.caps().kind == DeviceKind::Cpu {
                assert_eq!(result.bits(0) == 1, twin.is_some(), "{:?}", case.0);
            }
            if let (Some(hit), 1) = (twin, result.bits(0)) {
                met += 1;
                if gpu.caps().kind == DeviceKind::Cpu {
                    assert_eq!(
                        [result.0[1], result.0[2], result.0[3]],
                        [hit.t, hit.u, hit.v],
                        "{:?}",
                        case.0
                    );
                }
            }
        }
        assert!(met > CASES / 4, "{met}");
    });
}
