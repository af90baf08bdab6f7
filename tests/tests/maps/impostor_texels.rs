//! What texels of distance impostors hold on the device: planes, normals, distances beside radiance or by themselves; and how many there may be.

use clerestory::Error;
use clerestory::gpu::{GpuOptions, Lesser};
use clerestory::maps::impostor::layouts::{ImpostorLayout, ImpostorLayouts};
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::{
    Impostor, ImpostorHit, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, ImpostorTexels, SearchMethod,
};
use clerestory::maps::{MapImage, Parametrization, Texel};
use clerestory_tests::{assert_no_messages, gpu_with, with_gpu};
use glam::{DVec3, UVec2};

use crate::impostors::{MAPS, share_that_differs};

/// Planes that are stored and those that each look-up makes of a normal: rays find the same but where rounding chooses the texel, in a room and under an empty sky.
#[test]
fn texels_of_planes_and_of_normals_find_the_same() {
    with_gpu(|gpu| {
        let sphere = ShinySphere::BOX;
        let rays = sphere.rays(40, None);
        let settings = ImpostorSettings::default();
        for (map, is_open) in [(MAPS[0], false), (MAPS[1], true)] {
            let image = ImpostorImage::from_fn(map, map.size_for(6.0 * 24.0 * 24.0), 1, true, |d| {
                if is_open && d.y > 0.4 {
                    Vec::new()
                } else {
                    sphere.room.surfaces(d)
                }
            });
            let image = image.unwrap();
            let [planes, normals] = [ImpostorTexels::Planes, ImpostorTexels::Normals].map(|texels| {
                let impostor = Impostor::with_texels(gpu, &image, texels).unwrap();
                impostor.search(&rays, &settings).unwrap()
            });
            for (hits, texels) in [(&planes, "planes"), (&normals, "normals")] {
                let off = share_that_differs(&image, &rays, hits, &settings);
                println!("{map}, {texels}: {:.2} % differ from the twin", 100.0 * off);
                assert!(off < 0.02, "{map}, {texels}: {off}");
            }
            let differs = |(a, b): (&ImpostorHit, &ImpostorHit)| {
                (a.direction - b.direction).length() > 1e-4 || (a.distance - b.distance).abs() > 1e-4 * b.distance
            };
            let count = planes.iter().zip(&normals).filter(|pair| differs(*pair)).count();
            assert!(50 * count < rays.len(), "{map}: {count} of {}", rays.len());
            let sky = |hits: &[ImpostorHit]| hits.iter().filter(|hit| hit.distance > 100.0).count();
            assert!((sky(&planes) > 0) == is_open && (sky(&normals) > 0) == is_open, "{map}");
        }
        // Each kind has kernels of its own.
        let image = ImpostorImage::from_fn(MAPS[0], UVec2::splat(8), 1, true, |d| sphere.room.surfaces(d)).unwrap();
        let [planes, normals] = [ImpostorTexels::Planes, ImpostorTexels::Normals]
            .map(|texels| Impostor::with_texels(gpu, &image, texels).unwrap());
        let of_planes = ImpostorSearch::new(gpu, &planes, &settings).unwrap();
        let refused = of_planes.search_timed(&normals, &rays).unwrap_err().to_string();
        assert!(refused.contains("what texels hold"), "{refused}");
    });
}

/// Four bytes a texel and layer for distances alone; where there are normals, sixteen for planes, eight for normals, and four where they are left out.
#[test]
fn distances_have_a_buffer_of_their_own() {
    with_gpu(|gpu| {
        let bytes = |layers: u32, with_normals: bool, texels: ImpostorTexels| {
            let image = ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(16), layers, with_normals, |d| {
                BoxRoom::BOX.surfaces(d)
            });
            Impostor::with_texels(gpu, &image.unwrap(), texels).unwrap().bytes()
        };
        for texels in [
            ImpostorTexels::Planes,
            ImpostorTexels::Normals,
            ImpostorTexels::Distances,
        ] {
            assert_eq!(bytes(1, false, texels), 6 * 16 * 16 * 4, "{texels:?}");
        }
        assert_eq!(bytes(3, true, ImpostorTexels::Planes), 4 * 3 * 6 * 16 * 16 * 4);
        assert_eq!(bytes(3, true, ImpostorTexels::Normals), 2 * 3 * 6 * 16 * 16 * 4);
        assert_eq!(bytes(3, true, ImpostorTexels::Distances), 3 * 6 * 16 * 16 * 4);
    });
}

/// Distances beside the radiance of texels, or in a buffer of their own: the same bits, and the radiance in the direction that the twin finds.
#[test]
fn layouts_show_the_same_radiance() {
    with_gpu(|gpu| {
        let (map, size) = (Parametrization::Cube, UVec2::splat(32));
        let sphere = ShinySphere::C;
        let image = ImpostorImage::from_fn(map, size, 1, false, |d| sphere.room.surfaces(d)).unwrap();
        let number = |texel: Texel| f64::from((texel.layer * size.y + texel.y) * size.x + texel.x);
        let radiance = MapImage::from_fn(map, size, |texel| DVec3::new(number(texel), 1.0, 0.5)).unwrap();
        let layouts = ImpostorLayouts::new(gpu, &radiance, &image).unwrap();
        let rays = sphere.rays(40, None);
        for (method, steps) in [(SearchMethod::Classical, 0), (SearchMethod::FalsePosition, 3)] {
            let settings = ImpostorSettings::of(method, steps);
            let [split, packed] = [ImpostorLayout::Split, ImpostorLayout::Packed].map(|layout| {
                layouts
                    .look_up(&settings, layout)
                    .unwrap()
                    .look_up_timed(&rays)
                    .unwrap()
                    .0
            });
            assert_eq!(split, packed, "{method}");
            let differs = rays.iter().zip(&split).filter(|(ray, found)| {
                let at = map.encode(image.search(ray, &settings).direction).unwrap();
                let p = (at.uv * size.as_dvec2()).as_uvec2().min(size - 1);
                let texel = Texel {
                    layer: at.layer,
                    x: p.x,
                    y: p.y,
                };
                **found != radiance.at(texel).as_dvec3()
            });
            let share = differs.count() as f64 / rays.len() as f64;
            assert!(share < 0.02, "{method}: {share}");
        }
        let other = MapImage::from_fn(map, UVec2::splat(16), |_| DVec3::ONE).unwrap();
        assert!(
            ImpostorLayouts::new(gpu, &other, &image)
                .unwrap_err()
                .to_string()
                .contains("radiance")
        );
        let layered = ImpostorImage::from_fn(map, size, 2, false, |d| sphere.room.surfaces(d)).unwrap();
        let error = ImpostorLayouts::new(gpu, &radiance, &layered).unwrap_err().to_string();
        assert!(error.contains("several layers"), "{error}");
    });
}

/// Three layers of squares, a texel more than a buffer may have, whatever texels hold.
#[test]
fn distances_beyond_a_texel_buffer_are_refused() {
    const LAYERS: u32 = 3;
    const SIDE: u32 = 16;
    let count = u64::from(LAYERS * SIDE * SIDE);
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_texel_buffer_elements: Some(count - 1),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let map = Parametrization::OctahedronQuadratic;
    let of = |layers: u32, with_normals: bool| {
        let count = (layers * SIDE * SIDE) as usize;
        let normals = vec![DVec3::Z; count];
        let normals = with_normals.then_some(normals.as_slice());
        ImpostorImage::new(map, UVec2::splat(SIDE), layers, vec![1.0; count], normals).unwrap()
    };
    for texels in [ImpostorTexels::Planes, ImpostorTexels::Normals] {
        let upload = |layers| Impostor::with_texels(&gpu, &of(layers, true), texels);
        assert!(upload(LAYERS - 1).is_ok(), "{texels:?}");
        let error = upload(LAYERS).unwrap_err().to_string();
        assert!(error.contains("maxTexelBufferElements"), "{texels:?}: {error}");
    }
    assert!(Impostor::new(&gpu, &of(LAYERS - 1, false)).is_ok());
    let error = Impostor::new(&gpu, &of(LAYERS, false)).unwrap_err();
    let Error::LimitExceeded {
        name,
        value,
        limit_name,
        limit,
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!(
        (name.as_str(), *limit_name),
        ("impostor: texels", "maxTexelBufferElements")
    );
    assert_eq!((*value, *limit), (count, count - 1));
    assert_no_messages(&gpu);
}

/// A map whose planes have more bytes than a storage buffer of the baseline may have, on any device: a texel buffer holds them, to the last texel. Rounding leaves 2e-5 of a distance where the plane is
/// seen most from aside; neighbours differ by a hundredth.
#[test]
fn planes_beyond_a_storage_buffers_range_are_looked_up() {
    const SIDE: u32 = 2900;
    const RANGE: u64 = 1 << 27;
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_storage_buffer_range: Some(RANGE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let map = Parametrization::OctahedronQuadratic;
    let count = (SIDE * SIDE) as usize;
    let of = |i: u32| 1.0 + (i % 97) as f32 / 97.0;
    let distances = (0..SIDE * SIDE).map(of).collect();
    let normals = vec![DVec3::new(0.3, 0.5, 0.8); count];
    let image = ImpostorImage::new(map, UVec2::splat(SIDE), 1, distances, Some(&normals)).unwrap();
    let impostor = Impostor::new(&gpu, &image).unwrap();
    assert!(impostor.bytes() > RANGE);
    // From the map's place along the middles of texels, to the middles of their planes.
    let of_row = |y: u32| (0..64).map(move |i| UVec2::new(i * SIDE / 64 + 7, y));
    let texels: Vec<UVec2> = [0, SIDE / 2, SIDE - 1].into_iter().flat_map(of_row).collect();
    let ray = |p: &UVec2| ImpostorRay {
        origin: DVec3::ZERO,
        direction: map
            .texel_direction(
                image.size(),
                Texel {
                    layer: 0,
                    x: p.x,
                    y: p.y,
                },
            )
            .unwrap(),
    };
    let rays: Vec<ImpostorRay> = texels.iter().map(ray).collect();
    let hits = impostor.search(&rays, &ImpostorSettings::default()).unwrap();
    for (p, hit) in texels.iter().zip(&hits) {
        let expected = f64::from(of(p.y * SIDE + p.x));
        assert!((hit.distance - expected).abs() < 1e-4, "{p}: {hit:?}, not {expected}");
    }
    assert_no_messages(&gpu);
}
