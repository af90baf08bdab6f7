//! Distance impostors on the device: the published errors in rooms whose rays are known exactly, edges, and bits over runs.

use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::{
    Impostor, ImpostorHit, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, SearchMethod,
};
use clerestory_tests::with_gpu;
use glam::{DVec3, UVec2};

const MAPS: [Parametrization; 2] = [Parametrization::Cube, Parametrization::OctahedronQuadratic];
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

/// Off by more than a hundredth of a degree from the twin: rays at texels' borders and silhouettes, where rounding chooses the texel.
fn share_that_differs(
    image: &ImpostorImage,
    rays: &[ImpostorRay],
    hits: &[ImpostorHit],
    settings: &ImpostorSettings,
) -> f64 {
    let differs = |(ray, hit): (&ImpostorRay, &ImpostorHit)| {
        let twin = image.search(ray, settings);
        hit.direction.angle_between(twin.direction).to_degrees() > 0.01
    };
    let count = rays.iter().zip(hits).filter(|pair| differs(*pair)).count();
    count as f64 / rays.len() as f64
}

#[test]
fn convex_rooms_give_the_published_errors() {
    use SearchMethod::{Classical, FalsePosition, Mixed, SecantFromGuess};
    with_gpu(|gpu| {
        let published = [
            (Classical, 0, [11.96, 30.88]),
            (SecantFromGuess, 0, [0.010, 0.712]),
            (FalsePosition, 3, [0.001, 0.419]),
            (Mixed, 3, [0.0, 0.045]),
        ];
        for map in MAPS {
            let (image, impostor) = room(gpu, map, BoxRoom::EMPTY, 1);
            for (method, steps, published) in published {
                let settings = ImpostorSettings::of(method, steps);
                for (sphere, published) in [ShinySphere::B, ShinySphere::C].into_iter().zip(published) {
                    let rays = sphere.rays(SIDE, None);
                    let hits = impostor.search(&rays, &settings).unwrap();
                    near(
                        &format!("{map} {} {method} +{steps}", sphere.name),
                        mean(&errors(&sphere, &rays, &hits)),
                        published,
                    );
                    let off = share_that_differs(&image, &rays, &hits, &settings);
                    assert!(off < 0.01, "{map} {} {method} +{steps}: {off}", sphere.name);
                    let unit = |hit: &ImpostorHit| (hit.direction.length() - 1.0).abs() < 1e-6;
                    assert!(hits.iter().all(unit), "{map} {} {method}", sphere.name);
                }
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
            for (method, published) in [(FalsePosition, 70.0), (Hybrid, 2.1)] {
                let settings = ImpostorSettings::of(method, 10);
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
            for (sphere, published) in [(ShinySphere::P1, 98.7), (ShinySphere::P2, 99.1)] {
                let rays = sphere.rays(SIDE, None);
                let errors = errors(&sphere, &rays, &impostor.search(&rays, &settings).unwrap());
                let good = 100.0 * errors.iter().filter(|error| **error < 1.0).count() as f64 / errors.len() as f64;
                println!("{map} {}: {good:.2} % below 1°, published {published}", sphere.name);
                assert!((good - published).abs() < 1.0, "{map} {}: {good}", sphere.name);
            }
        }
    });
}

/// What every method finds is what its twin finds, edges included; and the same bits again.
#[test]
fn every_method_is_its_twin_to_the_bit_over_runs() {
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
            assert!(off < 0.05, "{method}: {off}");
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

/// A floor under an empty sky, on the device.
#[test]
fn the_sky_is_seen_in_the_rays_own_direction() {
    with_gpu(|gpu| {
        let floor = |d: DVec3| {
            let below = (d.y < -1e-3).then(|| clerestory::maps::impostor::ImpostorSurface {
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

/// Four bytes a texel and layer, as many again for normals that were asked for, and none for those that were not.
#[test]
fn distances_have_a_buffer_of_their_own() {
    with_gpu(|gpu| {
        let bytes = |layers: u32, with_normals: bool| {
            let image = ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(16), layers, with_normals, |d| {
                BoxRoom::BOX.surfaces(d)
            });
            Impostor::new(gpu, &image.unwrap()).unwrap().bytes()
        };
        assert_eq!(bytes(1, false), [6 * 16 * 16 * 4, 0]);
        assert_eq!(bytes(3, true), [3 * 6 * 16 * 16 * 4; 2]);
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
        for (bad, words) in [
            (
                ImpostorRay {
                    direction: DVec3::ZERO,
                    ..good
                },
                "ray 1\": has no direction",
            ),
            (
                ImpostorRay {
                    origin: DVec3::NAN,
                    ..good
                },
                "is not finite",
            ),
            (
                ImpostorRay {
                    direction: DVec3::INFINITY,
                    ..good
                },
                "is not finite",
            ),
        ] {
            let error = impostor.search(&[good, bad], &settings).unwrap_err().to_string();
            assert!(
                error.contains("ray 1") && error.contains(words.rsplit(": ").next().unwrap()),
                "{error}"
            );
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
        let buffer = gpu
            .buffer_with("rays", clerestory::gpu::Category::Work, &[0u32; 64])
            .unwrap();
        let mut recorder = gpu.recorder("refused").unwrap();
        let refused = recorder.pass("refused", |pass| {
            search.record(pass, &layered, buffer.slice(0, 128), buffer.slice(128, 128), 1)
        });
        assert!(refused.unwrap_err().to_string().contains("differs in map"));
    });
}
