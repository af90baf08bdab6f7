//! Maps without distances on the device: shapes in place of the surroundings, and several maps.

use clerestory::gpu::Gpu;
use clerestory::maps::impostor::ImpostorRay;
use clerestory::maps::impostor::places::blended_maps;
use clerestory::maps::impostor::proxy_maps::{ProxyHit, ProxyMaps, ProxyShape};
use clerestory::maps::impostor::published::{BY_PROXIES, PROXY_RADII};
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::{MapImage, Parametrization};
use clerestory_tests::with_gpu;
use glam::{DVec3, UVec2, Vec3};

use crate::impostors::MAPS;

/// Texels of a cube of 64² a face, which octahedra have as many of.
const TEXELS: f64 = 6.0 * 64.0 * 64.0;
/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 96;
/// The room of all spheres.
const ROOM: ProxyShape = ProxyShape::Box {
    low: DVec3::NEG_ONE,
    high: DVec3::ONE,
};

/// A map whose texels tell their number.
fn numbered(map: Parametrization, first: f64) -> MapImage {
    let size = map.size_for(TEXELS);
    let number = |layer: u32, x: u32, y: u32| f64::from((layer * size.y + y) * size.x + x);
    MapImage::from_fn(map, size, |texel| {
        DVec3::new(first + number(texel.layer, texel.x, texel.y), 1.0, 0.5)
    })
    .unwrap()
}

fn off(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// Share of rays that have another texel than the one in the direction that was looked up: where that lies on a border, rounding chooses.
fn share_of_other_texels(image: &MapImage, hits: &[ProxyHit]) -> f64 {
    let differs = |hit: &&ProxyHit| image.nearest(hit.direction).map(Vec3::as_dvec3) != Some(hit.radiance);
    hits.iter().filter(differs).count() as f64 / hits.len() as f64
}

/// Cubes and octahedra are looked up in the direction of each shape, whose errors are the published ones.
#[test]
fn shapes_are_looked_up_as_their_twins_say() {
    with_gpu(|gpu| {
        for map in MAPS {
            let image = numbered(map, 0.0);
            let maps = ProxyMaps::new(gpu, &[(DVec3::ZERO, image.clone())]).unwrap();
            for (sphere, published) in BY_PROXIES {
                let rays = sphere.rays(SIDE, None);
                let found = |shape: &ProxyShape| {
                    let hits = maps.look_up(&rays, shape, false).unwrap();
                    // Where a ray just meets a sphere, its root is of a difference that rounds.
                    let gap =
                        |(ray, hit): (&ImpostorRay, &ProxyHit)| off(hit.direction, shape.direction(DVec3::ZERO, ray));
                    let gaps: Vec<f64> = rays.iter().zip(&hits).map(gap).collect();
                    let wide = gaps.iter().filter(|gap| **gap > 1e-5).count();
                    let most = gaps.iter().copied().fold(0.0, f64::max);
                    assert!(
                        most < 1e-3 && 500 * wide < rays.len(),
                        "{map}, {}, {shape:?}: {most}, {wide}",
                        sphere.name
                    );
                    let other = share_of_other_texels(&image, &hits);
                    assert!(other < 2e-3, "{map}, {}, {shape:?}: {other}", sphere.name);
                    let errors = rays
                        .iter()
                        .zip(&hits)
                        .map(|(ray, hit)| sphere.room.error(ray, hit.direction));
                    errors.collect::<Vec<f64>>()
                };
                for (radius, published) in PROXY_RADII.into_iter().zip(published) {
                    let errors = found(&ProxyShape::Sphere { radius });
                    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                    println!(
                        "{map}, {}, sphere of {radius}: {mean:.4}, published {published}",
                        sphere.name
                    );
                    assert!(
                        (mean - published).abs() < f64::max(0.03, 0.02 * published),
                        "{map}, {}, {radius}: {mean}",
                        sphere.name
                    );
                }
                let worst = found(&ROOM).into_iter().fold(0.0, f64::max);
                println!("{map}, {}, box: {worst:.2e}", sphere.name);
                assert!(worst < 2e-5, "{map}, {}: {worst}", sphere.name);
                found(&ProxyShape::Hemisphere {
                    up: DVec3::Y,
                    radius: 1.2,
                });
                found(&ProxyShape::None);
            }
        }
    });
}

fn two_maps(gpu: &Gpu, places: [DVec3; 2], images: &[MapImage; 2]) -> ProxyMaps {
    let maps = [(places[0], images[0].clone()), (places[1], images[1].clone())];
    ProxyMaps::new(gpu, &maps).unwrap()
}

/// Each ray's texel is one of the nearest map, or the mean of one of each by their weights; boxes stay where they are, whatever the map's place.
#[test]
fn two_maps_are_looked_up_and_blended() {
    with_gpu(|gpu| {
        let places = [0.3, 0.6].map(|x| DVec3::new(x, 0.0, 0.0));
        let rays = ShinySphere::B.rays(SIDE, None);
        for map in MAPS {
            let images = [numbered(map, 0.0), numbered(map, 1e5)];
            let maps = two_maps(gpu, places, &images);
            let mut of_second = 0;
            for shape in [ProxyShape::None, ROOM] {
                let [nearest, blended] = [false, true].map(|blends| maps.look_up(&rays, &shape, blends).unwrap());
                let mut differ = 0;
                for (ray, (nearest, blended)) in rays.iter().zip(nearest.iter().zip(&blended)) {
                    let blend = blended_maps(&places, ray.origin).unwrap();
                    let texels = blend.maps.map(|map| {
                        let direction = shape.direction(places[map as usize], ray);
                        images[map as usize].nearest(direction).unwrap().as_dvec3()
                    });
                    of_second += u32::from(blend.maps[0] == 1);
                    let mean = texels[0].lerp(texels[1], blend.weight);
                    // Numbers up to 1e5, with weights of single precision.
                    let is_same = nearest.radiance == texels[0] && (blended.radiance - mean).length() < 0.2;
                    differ += u32::from(!is_same);
                    assert_eq!(nearest.direction, blended.direction);
                    assert!(off(nearest.direction, shape.direction(places[blend.maps[0] as usize], ray)) < 1e-6);
                }
                assert!(500 * differ < rays.len() as u32, "{map}, {shape:?}: {differ}");
            }
            assert!(of_second > 100 && of_second < rays.len() as u32, "{of_second}");
            // One map alone is blended with itself.
            let one = ProxyMaps::new(gpu, &[(places[1], images[1].clone())]).unwrap();
            let [a, b] = [false, true].map(|blends| one.look_up(&rays, &ROOM, blends).unwrap());
            assert_eq!(a, b);
        }
    });
}

#[test]
fn maps_and_shapes_that_are_none_are_refused() {
    with_gpu(|gpu| {
        let map = Parametrization::Cube;
        let image = |size: u32| MapImage::from_fn(map, UVec2::splat(size), |_| DVec3::ONE).unwrap();
        let refused = |maps: &[(DVec3, MapImage)], words: &str| {
            let error = ProxyMaps::new(gpu, maps).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(&[], "places of maps");
        refused(&vec![(DVec3::ZERO, image(4)); 17], "places of maps");
        refused(&[(DVec3::NAN, image(4))], "not finite");
        refused(&[(DVec3::ZERO, image(4)), (DVec3::X, image(8))], "is not cube");
        let disc = MapImage::from_fn(Parametrization::Nusselt, UVec2::splat(4), |_| DVec3::ONE).unwrap();
        refused(&[(DVec3::ZERO, disc)], "proxies");
        let maps = ProxyMaps::new(gpu, &[(DVec3::ZERO, image(4))]).unwrap();
        assert!(maps.look_up(&[], &ROOM, true).unwrap().is_empty());
        let ray = ImpostorRay {
            origin: DVec3::ZERO,
            direction: DVec3::X,
        };
        // At the map's place itself, with no way to go, the ray's own direction.
        let flat = ProxyShape::Box {
            low: DVec3::NEG_ONE,
            high: DVec3::new(0.0, 1.0, 1.0),
        };
        let found = maps.look_up(&[ray], &flat, false).unwrap();
        assert_eq!((found[0].direction, found[0].radiance), (DVec3::X, DVec3::ONE));
        let up = 2.0 * DVec3::Y;
        for (shape, words) in [
            (ProxyShape::Sphere { radius: 0.0 }, "radius"),
            (ProxyShape::Sphere { radius: f64::NAN }, "radius"),
            (ProxyShape::Hemisphere { up, radius: 1.0 }, "unit vector"),
            (
                ProxyShape::Box {
                    low: DVec3::ONE,
                    high: DVec3::ZERO,
                },
                "corner",
            ),
        ] {
            let error = maps.look_up(&[ray], &shape, false).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let bad = ImpostorRay {
            direction: 2.0 * DVec3::X,
            ..ray
        };
        let error = maps.look_up(&[bad], &ROOM, false).unwrap_err().to_string();
        assert!(error.contains("no unit vector"), "{error}");
    });
}
