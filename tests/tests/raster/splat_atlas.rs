//! Imperfect shadow maps: against their twin, against maps of all triangles, and by parts.

use clerestory::accel::RayIndex;
use clerestory::gpu::{Area, Category, Gpu};
use clerestory::maps::octahedron::OctahedronLayout;
use clerestory::maps::{Parametrization, Texel};
use clerestory::raster::splat_atlas::{STRATA, SplatAtlas, SplatAtlasDesc, atlas_map};
use clerestory::raster::{Surfaces, View};
use clerestory::scene::Scene;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::{UVec2, Vec3};

use crate::directions::{octahedron_rays, place_in, prepare};
use crate::gbuffer::place;

/// Whether two distances, both of which may be infinite, differ by less than a share.
fn near(found: f64, expected: f64, share: f64) -> bool {
    found == expected || (found / expected - 1.0).abs() < share
}

/// In the room, off all surfaces.
const SHARES: [Vec3; 3] = [
    Vec3::new(0.55, 0.6, 0.35),
    Vec3::new(0.2, 0.9, 0.7),
    Vec3::new(0.8, 0.45, 0.15),
];

/// The bits of the distances of maps, drawn as so many records of a first number, a first map and a number of maps.
fn drawn(
    gpu: &Gpu,
    surfaces: &Surfaces<'_>,
    atlas: &SplatAtlas,
    origins: &[Vec3],
    records: &[[u32; 3]],
) -> Vec<Vec<f32>> {
    let origins: Vec<_> = origins.iter().map(|origin| origin.extend(0.0).to_array()).collect();
    let origins = gpu.buffer_with("origins", Category::Light, &origins).unwrap();
    let mut recorder = gpu.recorder("imperfect maps").unwrap();
    atlas.record_surfels(&mut recorder, surfaces).unwrap();
    for record in records {
        atlas.record(&mut recorder, &origins, *record).unwrap();
    }
    recorder.submit().unwrap().wait().unwrap();
    (0..atlas.desc().maps)
        .map(|map| atlas.read(map).unwrap().distances)
        .collect()
}

#[test]
fn imperfect_maps_are_those_of_the_twin() {
    with_gpu(|gpu| {
        let prepared = prepare(gpu, &builtin("builtin:cornell-box"));
        let surfaces = prepared.on_device.surfaces();
        let origins = SHARES.map(|share| place_in(surfaces.bounds, share));
        for (side, fill_levels) in [(16, 0), (24, 2)] {
            let desc = SplatAtlasDesc {
                side,
                maps: 3,
                points: 300,
                fill_levels,
            };
            let atlas = SplatAtlas::new(gpu, &surfaces, desc).unwrap();
            let maps = drawn(gpu, &surfaces, &atlas, &origins, &[[0, 0, 3]]);
            let surfels = atlas.read_surfels().unwrap();
            assert_eq!(surfels.len() as u32, 300 * STRATA);
            let [lower, upper] = surfaces.bounds;
            let is_inside = |p: Vec3| p.cmpge(lower - 1e-4).all() && p.cmple(upper + 1e-4).all();
            assert!(
                surfels
                    .iter()
                    .all(|surfel| is_inside(Vec3::from_array(surfel.position)))
            );
            for (number, (origin, map)) in (0..).zip(origins.iter().zip(&maps)) {
                let twin = atlas_map(&surfels, atlas.radius(), (number, *origin), side, fill_levels);
                let empty = |all: usize, distance: f64| all + usize::from(distance == f64::INFINITY);
                let holes = twin.iter().copied().fold(0, empty);
                let differs = |(found, expected): &(&f32, &f64)| {
                    let found = f64::from(**found);
                    !near(found, **expected, 1e-4)
                };
                let wrong = map.iter().zip(&twin).filter(differs).count();
                println!(
                    "side {side}, map {number}: {wrong} of {} differ, {holes} empty",
                    twin.len()
                );
                // Borders of discs are within rounding of the middles of few texels.
                assert!(wrong * 100 <= twin.len(), "{wrong}");
                assert!(holes < twin.len() / 2);
            }
        }
        let none = SplatAtlasDesc {
            side: 0,
            maps: 1,
            points: 1,
            fill_levels: 0,
        };
        let large = SplatAtlasDesc {
            side: 1024,
            maps: 64,
            ..none
        };
        for (desc, word) in [(none, "imperfect shadow maps"), (large, "maxStorageBufferRange")] {
            let error = SplatAtlas::new(gpu, &surfaces, desc).expect_err(word).to_string();
            assert!(error.contains(word), "{error}");
        }
    });
}

/// The box with a front: no texel sees nothing, so that none is a fill of nothing.
fn closed_box() -> Scene {
    let mut scene = builtin("builtin:cornell-box");
    let [a, b, c, d] = [(0.0, 0.0), (0.556, 0.0), (0.556, 0.5488), (0.0, 0.5488)].map(|(x, y)| Vec3::new(x, y, 0.0));
    place(&mut scene, "front", &[[a, b, c], [a, c, d]]);
    scene
}

/// Distances of all texels of a map, by rays.
fn by_rays(index: &impl RayIndex, origin: Vec3, side: u32) -> Vec<f32> {
    let views = View::of_octants(origin, OctahedronLayout::Quadratic, 1e-9, Area::whole([side; 2])).unwrap();
    let distance = |ray| index.closest_hit(ray).t * Vec3::from_array(ray.direction).length();
    octahedron_rays(&views, [side; 2]).iter().map(distance).collect()
}

/// Of a closed room: holes are filled, and distances those of rays more and more.
#[test]
fn imperfect_maps_come_to_exact_ones_with_more_points() {
    with_gpu(|gpu| {
        let prepared = prepare(gpu, &closed_box());
        let surfaces = prepared.on_device.surfaces();
        let (side, origins) = (32, SHARES.map(|share| place_in(surfaces.bounds, share)));
        let exact: Vec<f32> = origins
            .iter()
            .flat_map(|origin| by_rays(&prepared.index, *origin, side))
            .collect();
        assert!(exact.iter().all(|distance| distance.is_finite()));
        // Shares of texels that are off by a tenth, and of empty ones.
        let wrong = |points, fill_levels| {
            let desc = SplatAtlasDesc {
                side,
                maps: 3,
                points,
                fill_levels,
            };
            let atlas = SplatAtlas::new(gpu, &surfaces, desc).unwrap();
            let map = drawn(gpu, &surfaces, &atlas, &origins, &[[0, 0, 3]]).concat();
            let share = |counts: &dyn Fn(f32, f32) -> bool| {
                let counted = map.iter().zip(&exact).filter(|(found, exact)| counts(**found, **exact));
                counted.count() as f64 / exact.len() as f64
            };
            let off = share(&|found, exact| !near(found.into(), exact.into(), 0.1));
            let empty = share(&|found, _| found == f32::INFINITY);
            [off, empty]
        };
        const POINTS: [u32; 4] = [128, 1024, 4096, 16_384];
        let found = POINTS.map(|points| wrong(points, 2));
        let unfilled = wrong(128, 0);
        println!("off and empty by points: {found:?}; without a fill {unfilled:?}");
        for ([off, _], most) in found.into_iter().zip([0.25, 0.12, 0.07, 0.045]) {
            assert!(off < most, "{found:?}");
        }
        assert!(found.windows(2).all(|pair| pair[1][0] < 0.9 * pair[0][0]), "{found:?}");
        // As long as discs are larger than texels.
        let slope = (found[2][0] / found[0][0]).ln() / f64::from(POINTS[2] / POINTS[0]).ln();
        assert!((-0.5..-0.3).contains(&slope), "{slope}");
        assert!(unfilled[1] > 0.02 && found[0][1] < 0.5 * unfilled[1] && found[0][0] < unfilled[0]);
    });
}

/// Of places just off a block's slanted sides, as those of virtual lights, however their normals are packed: nothing of the side is in front of it.
#[test]
fn surfaces_do_not_stand_before_lights_on_them() {
    with_gpu(|gpu| {
        let prepared = prepare(gpu, &closed_box());
        let surfaces = prepared.on_device.surfaces();
        let side = 32;
        let is_slanted = |n: &Vec3| n.x.abs() > 0.1 && n.z.abs() > 0.1 && n.y.abs() < 0.1;
        let off_sides = prepared.corners.iter().flat_map(|[a, b, c]| {
            let normal = (b - a).cross(c - a).normalize();
            // Of both sides of the triangle.
            [1.0, -1.0].map(|sign| ((a + b + c) / 3.0, sign * normal))
        });
        let lights: Vec<(Vec3, Vec3)> = off_sides
            .filter(|(_, normal)| is_slanted(normal))
            .map(|(middle, normal)| (middle + 2e-7 * normal, normal))
            .collect();
        assert!(lights.len() >= 16, "{}", lights.len());
        let maps = lights.len() as u32;
        let desc = SplatAtlasDesc {
            side,
            maps,
            points: 1024,
            fill_levels: 0,
        };
        let atlas = SplatAtlas::new(gpu, &surfaces, desc).unwrap();
        let origins: Vec<Vec3> = lights.iter().map(|(origin, _)| *origin).collect();
        let drawn = drawn(gpu, &surfaces, &atlas, &origins, &[[0, 0, maps]]);
        let octahedron = Parametrization::OctahedronQuadratic;
        for ((origin, normal), map) in lights.iter().zip(&drawn) {
            let exact = by_rays(&prepared.index, *origin, side);
            let mut far = 0;
            for (place, (found, exact)) in (0..).zip(map.iter().zip(&exact)) {
                let texel = Texel {
                    layer: 0,
                    x: place % side,
                    y: place / side,
                };
                let direction = octahedron.texel_direction(UVec2::splat(side), texel).unwrap();
                if direction.dot(normal.as_dvec3()) > 0.03 && *exact > 0.01 {
                    far += 1;
                    assert!(*found > 0.001, "{origin}, {normal}: {found} instead of {exact}");
                }
            }
            assert!(far > 400, "{far}");
        }
    });
}

#[test]
fn maps_do_not_depend_on_how_they_are_parted() {
    with_gpu(|gpu| {
        let prepared = prepare(gpu, &builtin("builtin:cornell-box"));
        let surfaces = prepared.on_device.surfaces();
        // Twice the same place: its number tells which points it has.
        let mut origins = SHARES.map(|share| place_in(surfaces.bounds, share)).to_vec();
        origins.push(origins[0]);
        let desc = SplatAtlasDesc {
            side: 16,
            maps: 4,
            points: 200,
            fill_levels: 1,
        };
        let atlas = SplatAtlas::new(gpu, &surfaces, desc).unwrap();
        let bits = |records: &[[u32; 3]]| -> Vec<Vec<u32>> {
            let maps = drawn(gpu, &surfaces, &atlas, &origins, records);
            let bits = |map: Vec<f32>| map.into_iter().map(f32::to_bits).collect();
            maps.into_iter().map(bits).collect()
        };
        let whole = bits(&[[0, 0, 4]]);
        assert_eq!(bits(&[[2, 2, 2], [0, 0, 1], [1, 1, 1]]), whole);
        assert!(whole[0] != whole[3]);
        // In another place of the atlas.
        let moved = bits(&[[3, 0, 1], [1, 1, 3]]);
        assert_eq!((&moved[0], &moved[1..]), (&whole[3], &whole[1..]));
        let mut recorder = gpu.recorder("too many").unwrap();
        let origins = gpu.buffer_with("origins", Category::Light, &[[0f32; 4]; 4]).unwrap();
        assert!(atlas.record(&mut recorder, &origins, [0, 2, 3]).is_err());
    });
}
