//! Distance impostors on the device: the published errors in rooms whose rays are known exactly, edges, and bits over runs.

use clerestory::gpu::shaders::types::{ImpostorHit as DeviceHit, ImpostorQuery};
use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::maps::Parametrization;
use clerestory::maps::impostor::published;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::{
    Impostor, ImpostorHit, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, ImpostorSurface, SearchMethod,
};
use clerestory_tests::with_gpu;
use glam::{DVec3, UVec2};

pub const MAPS: [Parametrization; 2] = [Parametrization::Cube, Parametrization::OctahedronQuadratic];
/// Texels of a cube of 256² a face, which octahedra have as many of.
const TEXELS: f64 = 6.0 * 256.0 * 256.0;
/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 96;

fn room(gpu: &Gpu, map: Parametrization, room: BoxRoom, layers: u32) -> (ImpostorImage, Impostor) {
    let image = ImpostorImage::from_fn(map, map.size_for(TEXELS), layers, true, |d| room.surfaces(d)).unwrap();
    let impostor = Impostor::new(gpu, &image).unwrap();
    (image, impostor)
}

fn errors(sphere: &ShinySphere, rays: &[ImpostorRay], hits: &[ImpostorHit]) -> Vec<f64> {
    let of = |(ray, hit): (&ImpostorRay, &ImpostorHit)| sphere.room.error(ray, hit.direction);
    rays.iter().zip(hits).map(of).collect()
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Within a fifth of the published value, or three hundredths of a degree.
#[track_caller]
fn near(what: &str, found: f64, published: f64) {
    println!("{what}: {found:.4}, published {published}");
    assert!(
        (found - published).abs() <= (0.2 * published).max(0.03),
        "{what}: {found}, published {published}"
    );
}

/// Off from the twin by more than a hundredth of a degree or a thousandth of residual, or in another layer: rays at texels' borders and silhouettes, where
/// rounding chooses the texel.
pub fn share_that_differs(
    image: &ImpostorImage,
    rays: &[ImpostorRay],
    hits: &[ImpostorHit],
    settings: &ImpostorSettings,
) -> f64 {
    let differs = |(ray, hit): (&ImpostorRay, &ImpostorHit)| {
        let twin = image.search(ray, settings);
        hit.direction.angle_between(twin.direction).to_degrees() > 0.01
            || (hit.residual - twin.residual).abs() > 1e-3
            || hit.layer != twin.layer
    };
    let count = rays.iter().zip(hits).filter(|pair| differs(*pair)).count();
    count as f64 / rays.len() as f64
}

#[test]
fn convex_rooms_give_the_published_errors() {
    use SearchMethod::{Classical, FalsePosition, Mixed, SecantFromGuess};
    with_gpu(|gpu| {
        let searched = [(Classical, 0), (SecantFromGuess, 0), (FalsePosition, 3), (Mixed, 3)];
        let mut searches = published::in_the_empty_room();
        searches.retain(|search| {
            let is_searched = searched.contains(&(search.settings.method, search.settings.steps));
            is_searched && [ShinySphere::B, ShinySphere::C].contains(&search.sphere)
        });
        assert_eq!(searches.len(), 8);
        for map in MAPS {
            let (image, impostor) = room(gpu, map, BoxRoom::EMPTY, 1);
            for search in &searches {
                let (sphere, settings) = (search.sphere, search.settings);
                let rays = sphere.rays(SIDE, None);
                let hits = impostor.search(&rays, &settings).unwrap();
                let what = format!("{map} {} {} +{}", sphere.name, settings.method, settings.steps);
                let published = search.figures.mean.unwrap();
                near(&what, mean(&errors(&sphere, &rays, &hits)), published);
                let off = share_that_differs(&image, &rays, &hits, &settings);
                assert!(off < 0.01, "{what}: {off}");
                let unit = |hit: &ImpostorHit| (hit.direction.length() - 1.0).abs() < 1e-6;
                assert!(hits.iter().all(unit), "{what}");
            }
        }
    });
}

/// The first interface of a glass sphere, by the index of glass.
#[test]
fn refracted_rays_are_found_as_published() {
    with_gpu(|gpu| {
        let sphere = ShinySphere::B;
        let rays = sphere.rays(SIDE, Some(1.5));
        for map in MAPS {
            let (image, impostor) = room(gpu, map, sphere.room, 1);
            for (method, steps, published) in published::REFRACTED {
                let settings = ImpostorSettings::of(method, steps);
                let hits = impostor.search(&rays, &settings).unwrap();
                let what = format!("{map} glass {method} +{steps}");
                near(&what, mean(&errors(&sphere, &rays, &hits)), published);
                let off = share_that_differs(&image, &rays, &hits, &settings);
                assert!(off < 0.01, "{what}: {off}");
            }
        }
    });
}

#[test]
fn hidden_points_need_the_hybrid() {
    use SearchMethod::{FalsePosition, Hybrid};
    with_gpu(|gpu| {
        let sphere = ShinySphere::P2;
        let rays: Vec<ImpostorRay> = sphere.rays(SIDE, None);
        let seen: Vec<ImpostorRay> = rays.iter().copied().filter(|ray| sphere.room.sees_hit(ray)).collect();
        for map in MAPS {
            let (image, impostor) = room(gpu, map, BoxRoom::PILLAR, 1);
            for search in published::behind_the_pillar() {
                let (settings, method) = (search.settings, search.settings.method);
                if ![FalsePosition, Hybrid].contains(&method) {
                    continue;
                }
                let published = search.figures.seen.unwrap();
                let hits = impostor.search(&seen, &settings).unwrap();
                near(
                    &format!("{map} P2 {method}"),
                    mean(&errors(&sphere, &seen, &hits)),
                    published,
                );
                let off = share_that_differs(&image, &seen, &hits, &settings);
                assert!(off < 0.03, "{map} {method}: {off}");
            }
        }
    });
}

#[test]
fn three_layers_hold_what_lies_behind() {
    with_gpu(|gpu| {
        let settings = ImpostorSettings {
            tolerance: 5e-3,
            ..ImpostorSettings::of(SearchMethod::March, 64)
        };
        for map in MAPS {
            let (_, impostor) = room(gpu, map, BoxRoom::PILLAR, 3);
            for search in published::in_layers().iter().filter(|search| search.layers == 3) {
                let (sphere, published) = (search.sphere, search.figures.good.unwrap());
                let rays = sphere.rays(SIDE, None);
                let errors = errors(&sphere, &rays, &impostor.search(&rays, &settings).unwrap());
                let good = 100.0 * errors.iter().filter(|error| **error < 1.0).count() as f64 / errors.len() as f64;
                println!("{map} {}: {good:.2} % below 1°, published {published}", sphere.name);
                assert!((good - published).abs() < 1.0, "{map} {}: {good}", sphere.name);
            }
        }
    });
}

/// What every method finds is what its twin finds, edges included; and a second run has the same bits.
#[test]
fn every_method_agrees_with_its_twin_and_repeats_its_bits() {
    with_gpu(|gpu| {
        let map = Parametrization::Cube;
        let image = ImpostorImage::from_fn(map, UVec2::splat(64), 2, true, |d| BoxRoom::BOX.surfaces(d)).unwrap();
        let impostor = Impostor::new(gpu, &image).unwrap();
        let mut rays = ShinySphere::BOX.rays(32, None);
        // At the map's place, through it, and along a wall.
        for (origin, direction) in [
            (DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)),
            (DVec3::new(-0.5, 0.0, 0.0), DVec3::X),
            (DVec3::new(0.0, 0.9, 0.0), DVec3::X),
        ] {
            rays.push(ImpostorRay { origin, direction });
        }
        for method in SearchMethod::ALL {
            let settings = ImpostorSettings::of(method, if method == SearchMethod::March { 32 } else { 3 });
            let hits = impostor.search(&rays, &settings).unwrap();
            assert_eq!(hits, impostor.search(&rays, &settings).unwrap(), "{method}");
            assert!(
                hits.iter()
                    .all(|hit| hit.direction.is_finite() && hit.distance.is_finite() && hit.residual.is_finite())
            );
            let off = share_that_differs(&image, &rays, &hits, &settings);
            println!("{method}: {:.2} % differ from the twin", 100.0 * off);
            assert!(off < 0.01, "{method}: {off}");
            for (ray, hit) in rays.iter().zip(&hits).rev().take(3) {
                let twin = image.search(ray, &settings);
                assert!(
                    (hit.distance - twin.distance).abs() <= 1e-3 + 1e-3 * twin.distance,
                    "{method} {ray:?}: {hit:?} {twin:?}"
                );
            }
        }
    });
}

/// Look-ups of every map that impostors have, in which a ray's texel is another one each time.
#[test]
fn every_map_agrees_with_its_twin_with_normals_and_without() {
    with_gpu(|gpu| {
        let maps = [
            (Parametrization::Cube, UVec2::splat(24)),
            (Parametrization::OctahedronQuadratic, UVec2::splat(48)),
            (Parametrization::OctahedronRectangular, UVec2::new(64, 32)),
            (Parametrization::EqualArea, UVec2::splat(48)),
            (Parametrization::LatLong, UVec2::new(64, 32)),
        ];
        let sphere = ShinySphere::BOX;
        let rays = sphere.rays(40, None);
        for (map, size) in maps {
            let mut means = Vec::new();
            for with_normals in [true, false] {
                let image = ImpostorImage::from_fn(map, size, 1, with_normals, |d| sphere.room.surfaces(d)).unwrap();
                let impostor = Impostor::new(gpu, &image).unwrap();
                for (method, steps) in [(SearchMethod::Hybrid, 3), (SearchMethod::March, 32)] {
                    let settings = ImpostorSettings::of(method, steps);
                    let hits = impostor.search(&rays, &settings).unwrap();
                    let off = share_that_differs(&image, &rays, &hits, &settings);
                    let mean = mean(&errors(&sphere, &rays, &hits));
                    println!(
                        "{map}, normals {with_normals}, {method}: {:.2} % differ, {mean:.3}°",
                        100.0 * off
                    );
                    assert!(off < 0.02, "{map}, normals {with_normals}, {method}: {off}");
                    assert!(mean < 5.0, "{map}, normals {with_normals}, {method}: {mean}");
                    means.push(mean);
                }
            }
            // Planes are of use in every map.
            assert!(means[0] < means[2], "{map}: {means:?}");
        }
    });
}

/// Between the centres of coarse texels the walls are nearer than at any of them, on the device.
#[test]
fn a_march_begins_in_front_of_coarse_texels() {
    with_gpu(|gpu| {
        for side in [2, 4] {
            let image = ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(side), 1, true, |d| {
                BoxRoom::EMPTY.surfaces(d)
            });
            let impostor = Impostor::new(gpu, &image.unwrap()).unwrap();
            let ray = ImpostorRay {
                origin: DVec3::ZERO,
                direction: DVec3::X,
            };
            let hit = impostor
                .search(&[ray], &ImpostorSettings::of(SearchMethod::March, 32))
                .unwrap()[0];
            assert!(
                (hit.distance - 1.0).abs() < 1e-3 && hit.residual < 1e-3,
                "{side}: {hit:?}"
            );
        }
    });
}

/// Rays that are none, which a host's own kernels may make: they find nothing, and no number that is none.
#[test]
fn rays_that_are_none_find_nothing_in_the_kernel() {
    with_gpu(|gpu| {
        let (_, impostor) = room(gpu, Parametrization::Cube, BoxRoom::EMPTY, 1);
        let good = ([0.2, 0.0, 0.0], [1.0, 0.0, 0.0]);
        let rays = [
            good,
            ([1e20, 0.0, 0.0], good.1),
            ([0.0, -1e16, 0.0], good.1),
            ([f32::NAN, 0.0, 0.0], good.1),
            ([0.0, f32::INFINITY, 0.0], good.1),
            (good.0, [0.0; 3]),
            (good.0, [2.0, 0.0, 0.0]),
            (good.0, [f32::NAN; 3]),
            ([9e15, -9e15, 9e15], good.1),
        ]
        .map(|(origin, direction)| ImpostorQuery { origin, direction });
        let queries = gpu
            .texels_with("rays", Category::Work, ImpostorSearch::RAY_FORMAT, &rays)
            .unwrap();
        let bytes = (rays.len() * size_of::<DeviceHit>()) as u64;
        let hits = gpu.buffer(&BufferDesc::storage("hits", bytes, Category::Work)).unwrap();
        for method in [SearchMethod::Hybrid, SearchMethod::March] {
            let search = ImpostorSearch::new(gpu, &impostor, &ImpostorSettings::of(method, 8)).unwrap();
            let mut recorder = gpu.recorder("none").unwrap();
            recorder
                .pass("none", |pass| {
                    search.record(pass, &impostor, &queries, hits.view(), rays.len() as u32)
                })
                .unwrap();
            recorder.submit().unwrap().wait().unwrap();
            let found: Vec<DeviceHit> = gpu.read(hits.view(), rays.len()).unwrap();
            assert!((found[0].distance - 0.8).abs() < 1e-3, "{method}: {:?}", found[0]);
            for (i, hit) in found.iter().enumerate().skip(1) {
                let is_last = i + 1 == rays.len();
                let is_nothing = hit.direction == [0.0; 3] && hit.distance == 0.0 && hit.residual == 1.0;
                assert!(is_nothing != is_last, "{method}, ray {i}: {hit:?}");
                let numbers = hit.direction.iter().chain([&hit.distance, &hit.residual]);
                assert!(numbers.clone().all(|x| x.is_finite()), "{method}, ray {i}: {hit:?}");
            }
        }
    });
}

/// A floor under an empty sky, on the device.
#[test]
fn the_sky_is_seen_in_the_rays_own_direction() {
    with_gpu(|gpu| {
        let floor = |d: DVec3| {
            let below = (d.y < -1e-3).then(|| ImpostorSurface {
                distance: -1.0 / d.y,
                normal: DVec3::Y,
            });
            below.into_iter().collect()
        };
        let image = ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(64), 1, true, floor).unwrap();
        let impostor = Impostor::new(gpu, &image).unwrap();
        let origin = DVec3::new(0.3, -0.2, 0.5);
        let rays =
            [DVec3::new(0.0, 0.8, 0.6), DVec3::new(0.0, -0.8, 0.6)].map(|direction| ImpostorRay { origin, direction });
        for method in [SearchMethod::Hybrid, SearchMethod::March] {
            let hits = impostor.search(&rays, &ImpostorSettings::of(method, 24)).unwrap();
            assert_eq!(
                (hits[0].distance as f32, hits[0].residual),
                (ImpostorImage::NOTHING, 0.0),
                "{method}"
            );
            assert!((hits[0].direction - rays[0].direction).length() < 1e-6);
            assert!(
                (hits[1].distance - 1.0).abs() < 2e-3 && hits[1].residual < 1e-3,
                "{method}: {:?}",
                hits[1]
            );
        }
    });
}

#[test]
fn what_cannot_be_searched_is_refused_by_name() {
    with_gpu(|gpu| {
        let image = |layers: u32, with: bool| {
            ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(8), layers, with, |d| {
                BoxRoom::EMPTY.surfaces(d)
            })
            .unwrap()
        };
        let impostor = Impostor::new(gpu, &image(1, false)).unwrap();
        let settings = ImpostorSettings::default();
        let good = ImpostorRay {
            origin: DVec3::ZERO,
            direction: DVec3::X,
        };
        assert!(impostor.search(&[], &settings).unwrap().is_empty());
        let no_unit = "no unit vector";
        for (origin, direction, words) in [
            (good.origin, DVec3::ZERO, no_unit),
            (good.origin, DVec3::INFINITY, no_unit),
            (good.origin, 2.0 * DVec3::X, no_unit),
            (good.origin, 1.0002 * DVec3::X, no_unit),
            (DVec3::NAN, good.direction, "does not begin nearer"),
            (1e20 * DVec3::X, good.direction, "does not begin nearer"),
        ] {
            let bad = ImpostorRay { origin, direction };
            let error = impostor.search(&[good, bad], &settings).unwrap_err().to_string();
            assert!(error.contains("ray 1") && error.contains(words), "{error}");
        }
        assert!(
            impostor
                .search(
                    &[good],
                    &ImpostorSettings {
                        steps: 1000,
                        ..settings
                    }
                )
                .is_err()
        );
        // A search is made for one kind of impostor.
        let search = ImpostorSearch::new(gpu, &impostor, &settings).unwrap();
        let layered = Impostor::new(gpu, &image(2, true)).unwrap();
        let none = gpu.texels_with("rays", Category::Work, ImpostorSearch::RAY_FORMAT, &[0u32; 32]);
        let (none, hits) = (
            none.unwrap(),
            gpu.buffer_with("hits", Category::Work, &[0u32; 32]).unwrap(),
        );
        let mut recorder = gpu.recorder("refused").unwrap();
        let refused = recorder.pass("refused", |pass| search.record(pass, &layered, &none, hits.view(), 1));
        assert!(refused.unwrap_err().to_string().contains("differs in map"));
        // One for maps with a surface everywhere sees none of the sky; one for others searches these, too.
        let open = ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(8), 1, false, |d| {
            if d.y > 0.5 {
                Vec::new()
            } else {
                BoxRoom::EMPTY.surfaces(d)
            }
        });
        let open = Impostor::new(gpu, &open.unwrap()).unwrap();
        assert!(open.is_open() && !impostor.is_open());
        let refused = search.search_timed(&open, &[good]).unwrap_err().to_string();
        assert!(refused.contains("places without a surface"), "{refused}");
        let of_open = ImpostorSearch::new(gpu, &open, &settings).unwrap();
        let (found, _) = of_open.search_timed(&impostor, &[good]).unwrap();
        assert_eq!(found, impostor.search(&[good], &settings).unwrap());
    });
}
