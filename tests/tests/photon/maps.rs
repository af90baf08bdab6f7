//! Maps built by the device against those of the host, byte for byte; and what both hold.

use clerestory::Error;
use clerestory::accel::Aabb;
use clerestory::accel::photon_map::compact_bvh::CompactBvh;
use clerestory::accel::photon_map::complete_bvh::{LEAF_BIT, QueryCounters, RootDescriptor};
use clerestory::accel::photon_map::device::MapBuilder;
use clerestory::gpu::{GpuOptions, Lesser, OptionalFeatures};
use clerestory::techniques::photon_mapping::kernel::{
    PhotonRecord, PhotonWords, kernel_weight, pack_photon, photon_ends_leaf, unpack_photon,
};
use clerestory::techniques::photon_mapping::{MapBuild, MapContents, map_contents};
use clerestory_tests::random::Random;
use clerestory_tests::render::{builtin, point_triangle};
use clerestory_tests::{gpu_with, with_gpu};

use super::*;

/// Bytes of a map, without its figures.
fn bytes(map: &MapContents) -> [&[u8]; 3] {
    [
        bytemuck::bytes_of(&map.root),
        bytemuck::cast_slice(&map.pairs),
        bytemuck::cast_slice(&map.records),
    ]
}

/// Fails unless the device's map has the host's bytes and figures; returns it.
fn expect_twins(what: &str, device: MapContents, host: &MapContents) -> MapContents {
    assert_eq!(
        (device.leaf_size, device.cover.to_bits()),
        (host.leaf_size, host.cover.to_bits()),
        "{what}: figures"
    );
    assert_eq!(device.root, host.root, "{what}: root");
    assert_eq!(device.pairs.len(), host.pairs.len(), "{what}: pairs");
    assert!(bytes(&device) == bytes(host), "{what}: bytes");
    device
}

/// The device's map of records, which is the host's.
fn built(gpu: &Gpu, what: &str, records: &[PhotonWords], scene_area: f64) -> MapContents {
    let [device, host] = [MapBuild::Device, MapBuild::Host]
        .map(|build| map_contents(gpu, records, scene_area, build).unwrap_or_else(|error| panic!("{what}: {error}")));
    expect_twins(what, device, &host)
}

/// A record about a place with semi-axes of these lengths, in a random plane.
fn record(random: &mut Random, position: Vec3, [along, across]: [f32; 2]) -> PhotonWords {
    let normal = random.direction();
    let side = normal.any_orthonormal_vector();
    // Not quite at right angles.
    let skewed = (side + 0.3 * normal.cross(side)).normalize();
    pack_photon(&PhotonRecord {
        position,
        normal,
        direction: random.direction(),
        flux: Vec3::splat(1.0),
        along: along * skewed,
        across: across * side,
    })
}

fn records(random: &mut Random, places: &[Vec3], axes: [f32; 2]) -> Vec<PhotonWords> {
    places.iter().map(|place| record(random, *place, axes)).collect()
}

fn cloud(random: &mut Random, count: usize) -> Vec<Vec3> {
    (0..count).map(|_| random.vector()).collect()
}

/// Records that break naive builds.
fn hard_records() -> Vec<(&'static str, Vec<PhotonWords>)> {
    let random = &mut Random(91);
    let points = cloud(random, 3000);
    let round = [0.05, 0.05];
    let one_point = vec![Vec3::new(0.25, -1.0, 3.0); 2000];
    let few_places: Vec<Vec3> = points.iter().map(|p| (3.0 * p).floor()).collect();
    let far: Vec<Vec3> = points.iter().map(|p| p + Vec3::new(1e5, -1e5, 1e5)).collect();
    let plane: Vec<Vec3> = points.iter().map(|p| p.with_y(0.0)).collect();
    let mut outlier = points.clone();
    outlier[1500] = Vec3::splat(1e6);
    let ladder: Vec<Vec3> = (0..900).map(|i| Vec3::splat(0.5f32.powi(i % 30))).collect();
    let mut sizes = records(random, &points, [0.001, 0.001]);
    sizes.extend(records(random, &points[..50], [1.0, 0.7]));
    // One more and one less than a block, a workgroup, and what a workgroup takes.
    let mut all = vec![("none", Vec::new())];
    for (name, count) in [
        ("one", 1),
        ("two", 2),
        ("three", 3),
        ("four", 4),
        ("five", 5),
        ("six", 6),
        ("a workgroup", 64),
        ("more than a workgroup", 65),
        ("what a workgroup takes", 1024),
        ("more than that", 1025),
    ] {
        all.push((name, records(random, &points[..count], round)));
    }
    all.extend([
        ("one point", records(random, &one_point, round)),
        ("few places", records(random, &few_places, round)),
        ("far away", records(random, &far, round)),
        ("plane", records(random, &plane, round)),
        ("outlier", records(random, &outlier, round)),
        ("ladder", records(random, &ladder, [1e-6, 1e-6])),
        ("flat", records(random, &points, [0.2, 1e-4])),
        ("mixed sizes", sizes),
        ("many", {
            let points = cloud(random, 70_000);
            records(random, &points, [0.02, 0.01])
        }),
    ]);
    all
}

#[test]
fn device_maps_of_hard_records_are_the_twins() {
    with_gpu(|gpu| {
        for (name, records) in hard_records() {
            // Leaves of the least size, of more, and of everything; and a scene without an area.
            for scene_area in [1e9, 1.0, 1e-9, 0.0] {
                let map = built(gpu, name, &records, scene_area);
                assert_eq!(map.records.len(), records.len(), "{name}");
                let is_leaf = map.root.reference & LEAF_BIT != 0;
                assert_eq!(is_leaf, map.pairs.is_empty(), "{name}");
                if name == "many" && scene_area == 1e9 {
                    assert!(map.leaf_size == 5 && map.pairs.len() > 10_000, "{}", map.pairs.len());
                }
            }
        }
        // Rounded to the nearest: the cover of the scene decides to the last bit how large leaves are.
        let (_, records) = hard_records().swap_remove(10);
        let sizes: Vec<u32> = (1..60)
            .map(|i| built(gpu, "areas", &records, 0.37 / f64::from(i)).leaf_size)
            .collect();
        assert!(sizes.is_sorted() && sizes[0] < sizes[58], "{sizes:?}");
    });
}

#[test]
fn queries_of_device_maps_meet_every_kernel() {
    with_gpu(|gpu| {
        let random = &mut Random(92);
        let points = cloud(random, 2000);
        let mut all = records(random, &points, [0.3, 0.1]);
        all.extend(records(random, &points[..200], [0.05, 0.05]));
        let map = built(gpu, "queries", &all, 30.0);
        let tree = CompactBvh {
            root: RootDescriptor {
                bounds: Aabb {
                    lower: map.root.lower.into(),
                    upper: map.root.upper.into(),
                },
                reference: Some(map.root.reference),
            },
            pairs: map.pairs.clone(),
        };
        let (mut held, mut visited) = (0, 0);
        for _ in 0..300 {
            let point = random.vector();
            let mut met = vec![false; map.records.len()];
            tree.point_query(point, &mut QueryCounters::default(), |first| {
                let leaf = met.iter_mut().zip(&map.records).skip(first as usize);
                for (met, record) in leaf {
                    assert!(!std::mem::replace(met, true), "twice");
                    visited += 1;
                    if photon_ends_leaf(record) {
                        break;
                    }
                }
            });
            for (record, met) in map.records.iter().zip(met) {
                let photon = unpack_photon(record);
                let delta = (point - photon.position).as_dvec3();
                let holds = kernel_weight(KernelProfile::Uniform, &photon.kernel(), delta) > 0.0;
                held += u32::from(holds);
                assert!(met || !holds, "{point}: {photon:?}");
            }
        }
        assert!(held > 100 && visited < 300 * map.records.len() / 4, "{held} {visited}");
    });
}

#[test]
fn device_maps_of_scenes_are_the_twins_and_pictures_are_equal() {
    with_gpu(|gpu| {
        let footprints = PhotonSettings {
            shape: KernelShape::Principal,
            photons: 1 << 12,
            reduction: 2.0 / 3.0,
            ..settings("all")
        };
        let nearest = PhotonSettings {
            neighbors: 20,
            photons: 1 << 11,
            ..settings("all")
        };
        let glass = builtin("builtin:cornell-box?sphere=glass&source=point");
        let mut dark = floor_and_wall(
            "dark",
            Material::lambert("floor", Vec3::ZERO),
            Material::lambert("wall", Vec3::ZERO),
        );
        add_point(&mut dark, Vec3::new(0.3, 1.5, 0.2), Vec3::splat(20.0));
        // Without a material that may be diffuse there would be no map.
        point_triangle(&mut dark, Material::lambert("grey", Vec3::splat(0.5)), Vec3::ZERO);
        for (scene, settings, is_empty) in [
            (&glass, &footprints, false),
            (&glass, &nearest, false),
            // Photons end where they land first, and direct light is not the map's.
            (&dark, &fixed("all", 0.3), true),
        ] {
            let made = [MapBuild::Device, MapBuild::Host, MapBuild::Auto].map(|map_build| {
                let settings = PhotonSettings {
                    map_build,
                    ..settings.clone()
                };
                let mut mapper = mapper(gpu, scene, &settings);
                let picture = bits(&advance(&mut mapper, 3));
                let map = mapper.map(1, map_build).unwrap_or_else(|error| panic!("{error}"));
                (picture, mapper.counts(), map.expect("a map"))
            });
            let [(picture, counts, device), (of_host, host_counts, host), (of_auto, ..)] = made;
            assert!(
                picture == of_host && picture == of_auto,
                "{}: another picture",
                scene.name
            );
            let figures = |c: &MapperCounts| (c.passes, c.photons, c.records, c.cover.to_bits(), c.leaf_size, c.gather);
            assert_eq!(figures(&counts), figures(&host_counts), "{}", scene.name);
            let map = expect_twins(&scene.name, device, &host);
            assert_eq!(map.records.is_empty(), is_empty, "{}", scene.name);
            assert_eq!(counts.records == 0, is_empty, "{}", scene.name);
        }
    });
}

#[test]
fn devices_without_numbers_of_64_bits_leave_maps_to_the_host() {
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::default()),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let (_, records) = hard_records().swap_remove(9);
    match map_contents(&gpu, &records, 1.0, MapBuild::Device) {
        Err(Error::MissingFeature { feature, instead, .. }) => {
            assert_eq!(feature, "shaderFloat64");
            assert!(instead.contains("map_build"), "{instead}");
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("was built without the feature"),
    }
    let [auto, host] = [MapBuild::Auto, MapBuild::Host]
        .map(|build| map_contents(&gpu, &records, 1.0, build).unwrap_or_else(|error| panic!("{error}")));
    assert!(auto == host);
}

#[test]
fn maps_that_the_device_has_no_room_for_are_the_hosts_to_build() {
    // So few workgroups reach some hundred records.
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_workgroups: Some([4; 3]),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    if !gpu.caps().float64 {
        return;
    }
    let random = &mut Random(17);
    let points = cloud(random, 3000);
    let records = records(random, &points, [0.05, 0.05]);
    let refused = map_contents(&gpu, &records, 1.0, MapBuild::Device).err();
    assert!(matches!(refused, Some(Error::LimitExceeded { .. })), "{refused:?}");
    let [auto, host] = [MapBuild::Auto, MapBuild::Host]
        .map(|build| map_contents(&gpu, &records, 1.0, build).unwrap_or_else(|error| panic!("{error}")));
    assert!(auto == host);
}

#[test]
fn maps_take_no_more_memory_than_they_must_where_there_is_no_more() {
    const COUNT: u32 = 400_000;
    const MARGIN: u64 = 1 << 16;
    let random = &mut Random(18);
    let points = cloud(random, COUNT as usize);
    let records = records(random, &points, [0.01, 0.01]);
    let input = size_of_val(&records[..]) as u64;
    let with_heap = |heap_bytes| {
        gpu_with(&GpuOptions {
            lesser: Lesser {
                heap_bytes,
                ..Lesser::default()
            },
            ..GpuOptions::default()
        })
    };
    let builder = match with_heap(None) {
        gpu if gpu.caps().float64 => MapBuilder::new(&gpu).unwrap(),
        _ => return,
    };
    // The map, with the records in its order.
    let bytes = |count: u32| builder.buffers(count).unwrap().bytes() + input * u64::from(count) / u64::from(COUNT);
    // The host reads records through as much memory again.
    let heap = 2 * input + bytes(COUNT) + MARGIN;
    assert!(input + bytes(COUNT + COUNT / 4) > heap, "there is room for more");
    let map = map_contents(&with_heap(Some(heap)), &records, 1e9, MapBuild::Device);
    let map = map.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(map.records.len(), COUNT as usize);
}
