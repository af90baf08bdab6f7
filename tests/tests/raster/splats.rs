//! Points splatted into octahedron maps: against the twin, and without holes where there is no opening.

use clerestory::accel::RayIndex;
use clerestory::gpu::Area;
use clerestory::gpu::shaders::types::Surfel;
use clerestory::maps::octahedron::{OctahedronLayout, octahedron_decode, octahedron_rectangular_decode};
use clerestory::raster::View;
use clerestory::raster::splats::{Splat, SplatMap, splat_levels, surfels_of};
use clerestory_tests::random::Random;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::{DVec2, UVec2, Vec3};

use crate::directions::{octahedron_rays, place_in, prepare};

const CASES: [(OctahedronLayout, UVec2); 3] = [
    (OctahedronLayout::Quadratic, UVec2::new(32, 32)),
    (OctahedronLayout::Rectangular, UVec2::new(38, 19)),
    (OctahedronLayout::Quadratic, UVec2::new(1, 1)),
];

/// Points in the middles of texels, where no rounding takes them to others.
fn points(layout: OctahedronLayout, size: UVec2, origin: Vec3, random: &mut Random) -> Vec<Surfel> {
    let mut points = Vec::new();
    for _ in 0..(size.element_product() / 2).max(1) {
        let texel = UVec2::new(
            random.below(size.x as usize) as u32,
            random.below(size.y as usize) as u32,
        );
        let uv = (texel.as_dvec2() + 0.45) / size.as_dvec2() * 2.0 - 1.0;
        let direction = match layout {
            OctahedronLayout::Quadratic => octahedron_decode(uv),
            OctahedronLayout::Rectangular => octahedron_rectangular_decode(uv * DVec2::new(2.0, 1.0)),
        };
        let distance = f64::from(random.range(0.5, 4.0));
        // Twice, with other numbers.
        for _ in 0..2 {
            points.push(Surfel {
                position: (origin.as_dvec3() + distance * direction).as_vec3().to_array(),
                number: random.below(1000) as u32,
            });
        }
    }
    points
}

fn compare(what: &str, found: &[Option<Splat>], expected: &[Option<Splat>]) {
    assert_eq!(found.len(), expected.len());
    for (texel, (found, expected)) in found.iter().zip(expected).enumerate() {
        match (found, expected) {
            (None, None) => {}
            (Some(found), Some(expected)) => {
                // A length of five roundings and a root, and of the fill a sum of four and a quotient at each level.
                let error = (found.distance / expected.distance - 1.0).abs();
                assert!(error < 1e-5, "{what}, texel {texel}: {found:?} {expected:?}");
                assert_eq!(found.number, expected.number, "{what}, texel {texel}");
            }
            _ => panic!("{what}, texel {texel}: {found:?} {expected:?}"),
        }
    }
}

#[test]
fn splats_and_their_fill_are_those_of_the_twin() {
    with_gpu(|gpu| {
        let mut random = Random(41);
        for (layout, size) in CASES {
            let origin = Vec3::new(0.25, -0.5, 1.0);
            let mut points = points(layout, size, origin, &mut random);
            // Nowhere: at the origin, out of range, and no place at all.
            for position in [origin, Vec3::splat(3e9), Vec3::NAN, Vec3::splat(f32::INFINITY)] {
                points.push(Surfel {
                    position: position.to_array(),
                    number: 0,
                });
            }
            let map = SplatMap::new(gpu, layout, size).unwrap();
            for fills in [false, true] {
                let what = format!("{layout:?} {size}, filled: {fills}");
                let found = map.splat(gpu, origin, &points, fills).unwrap();
                compare(&what, &found, &splat_levels(layout, size, origin, &points, fills));
                assert!(!fills || found.iter().all(Option::is_some), "{what}");
                // Whatever the order.
                points.reverse();
                assert_eq!(map.splat(gpu, origin, &points, fills).unwrap(), found, "{what}");
            }
            let nothing = map.splat(gpu, origin, &[], true).unwrap();
            assert!(nothing.iter().all(Option::is_none));
        }
        assert!(SplatMap::new(gpu, OctahedronLayout::Quadratic, UVec2::new(4, 0)).is_err());
        assert!(SplatMap::new(gpu, OctahedronLayout::Quadratic, UVec2::splat(1 << 15)).is_err());
    });
}

/// Distances are those of rays, but where a texel sees an edge or a slope.
#[test]
fn rooms_of_splats_are_closed_and_as_far_as_rays_go() {
    with_gpu(|gpu| {
        let (layout, size) = (OctahedronLayout::Quadratic, [32, 32]);
        let prepared = prepare(gpu, &builtin("builtin:furnace-box"));
        let surfaces = prepared.on_device.surfaces();
        let origin = place_in(surfaces.bounds, Vec3::new(0.55, 0.6, 0.35));
        let views = View::of_octants(origin, layout, 1e-3, Area::whole(size)).unwrap();
        let distances: Vec<f32> = octahedron_rays(&views, size)
            .iter()
            .map(|ray| prepared.index.closest_hit(ray).t * Vec3::from_array(ray.direction).length())
            .collect();
        let map = SplatMap::new(gpu, layout, UVec2::from_array(size)).unwrap();
        let error = |count| {
            let points = surfels_of(&prepared.corners, count);
            let found = map.splat(gpu, origin, &points, true).unwrap();
            assert!(found.iter().all(Option::is_some), "a hole");
            let errors = found.iter().zip(&distances).map(|(splat, distance)| {
                let splat = splat.as_ref().expect("no hole");
                f64::from((splat.distance / distance - 1.0).abs())
            });
            errors.sum::<f64>() / distances.len() as f64
        };
        let errors = [64, 1024, 16_384].map(error);
        println!("mean relative error of distances by points: {errors:?}");
        assert!(errors[2] < 0.05 && errors[1] < errors[0], "{errors:?}");
    });
}
