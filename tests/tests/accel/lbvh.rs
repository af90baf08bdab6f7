//! The device's linear hierarchies and compact traversals against their Rust twins, bit for bit.

use clerestory::Error;
use clerestory::accel::bvh2::MAX_DEPTH;
use clerestory::accel::lbvh::radix_tree::hierarchy;
use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings, SortedCodes, build, refit};
use clerestory::accel::photon_map::compact_bvh::CompactBvh;
use clerestory::accel::photon_map::complete_bvh::{CompleteBvh, QueryCounters};
use clerestory::accel::{Aabb, LeafRule, Ray, RayIndex};
use clerestory::gpu::{Category, DeviceKind, Gpu, transfer_to_compute};
use clerestory_tests::random::Random;
use clerestory_tests::shaders::types::{CompactRoot, CompactWork};
use clerestory_tests::shaders::{compact_points, compact_rays};
use clerestory_tests::with_gpu;
use glam::Vec3;

fn fast(code_bits: u32, leaf_size: u32) -> LbvhSettings {
    LbvhSettings {
        code_bits,
        leaf_size,
        quality: BuildQuality::Fast,
        ..LbvhSettings::default()
    }
}

fn soup(random: &mut Random, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let triangle = |random: &mut Random| {
        let centre = 10.0 * random.vector();
        [0; 3].map(|_| centre + size * random.vector())
    };
    (0..count).map(|_| triangle(random)).collect()
}

/// Builds on the device are those of the host, to the bit.
fn check(what: &str, builder: &LbvhBuilder, settings: &LbvhSettings, triangles: &[[Vec3; 3]]) {
    let device = builder.build(triangles).unwrap();
    let host = build(triangles, settings).unwrap();
    assert_eq!(device.index.statistics(), host.statistics(), "{what}, {settings:?}");
    assert!(device.index.texels() == host.texels(), "{what}, {settings:?}");
}

#[test]
fn device_builds_are_the_twins_on_soups() {
    with_gpu(|gpu| {
        let mut random = Random(71);
        for settings in [fast(30, 4), fast(63, 8), fast(30, 1)] {
            let builder = LbvhBuilder::new(gpu, &settings).unwrap();
            for count in [0, 1, 2, 3, 63, 64, 65, 1000, 30_000] {
                let mut triangles = soup(&mut random, count, 0.3);
                if count > 100 {
                    triangles[7][1].z = f32::NAN;
                    triangles[8][1] = triangles[8][0];
                    triangles[9].iter_mut().for_each(|v| v.x = -0.0);
                    triangles[11] = triangles[10];
                }
                check(&format!("soup of {count}"), &builder, &settings, &triangles);
            }
            // Two in each cell along an axis, the last one first: the order of places is not that of codes anywhere.
            let row: Vec<[Vec3; 3]> = (0..2048u16)
                .rev()
                .map(|i| [0.0, 0.1, 0.2].map(|y| Vec3::new(f32::from(i), y, y * y)))
                .collect();
            check("row", &builder, &settings, &row);
        }
    });
}

#[test]
fn device_builds_are_the_twins_on_hard_cases() {
    with_gpu(|gpu| {
        let builders = [fast(30, 4), fast(63, 4)].map(|s| (LbvhBuilder::new(gpu, &s).unwrap(), s));
        let check = |what: &str, triangles: &[[Vec3; 3]]| {
            for (builder, settings) in &builders {
                check(what, builder, settings, triangles);
            }
        };
        let cases = clerestory_hard_cases::all();
        for set in cases.iter().filter_map(|case| case.rays).flat_map(|rays| rays()) {
            check(&set.what, &set.triangles);
        }
        let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
        check("identical", &vec![one; 20_000]);
    });
}

/// Many equal triangles in the lowest cell, and for each bit of a code one whose highest bit it is: the way down to the equal ones parts with
/// another triangle at each bit, and then goes on by places.
fn ladder(equal: usize, axis_bits: i32) -> Vec<[Vec3; 3]> {
    // Small in its cell, and large enough for corners that differ.
    let at = |place: Vec3| {
        let size = place.max_element().max(1e-6) / 4096.0;
        [place, place + size * Vec3::X, place + size * Vec3::Y]
    };
    let mut triangles = vec![at(Vec3::ZERO); equal];
    // The other end of the grid.
    triangles.push(at(Vec3::ONE));
    for halvings in 0..axis_bits {
        // In the middle of the upper half of the lowest cells of this size.
        triangles.extend(Vec3::AXES.map(|axis| at(0.75 * 0.5f32.powi(halvings) * axis)));
    }
    triangles
}

#[test]
fn trees_that_are_too_deep_are_made_again_as_the_hosts() {
    with_gpu(|gpu| {
        // Ways of 30 and of 63 nodes above leaves of ten thousand equal triangles, of which eight levels at least remain.
        for (code_bits, least_excess) in [(30, 30 + 8 - MAX_DEPTH), (63, 63 + 8 - MAX_DEPTH)] {
            let settings = fast(code_bits, 4);
            let builder = LbvhBuilder::new(gpu, &settings).unwrap();
            let triangles = ladder(10_000, code_bits as i32 / 3);
            let buffers = builder.buffers(triangles.len() as u32).unwrap();
            gpu.upload(&buffers.corners, 0, &triangles).unwrap();
            let indices: Vec<u32> = (0..triangles.len() as u32).collect();
            gpu.upload(&buffers.indices, 0, &indices).unwrap();
            let mut recorder = gpu.recorder("build").unwrap();
            builder.record(&mut recorder, &buffers).unwrap();
            recorder.submit().unwrap().wait().unwrap();
            let first = builder.bits_to_skip(&buffers, 0).unwrap().unwrap_or(0);
            assert!(first >= least_excess, "{code_bits}: {first}");
            let (mut skipped, mut builds) = (first, 1);
            loop {
                let mut recorder = gpu.recorder("shallower").unwrap();
                builder.record_shallower(&mut recorder, &buffers, skipped).unwrap();
                recorder.submit().unwrap().wait().unwrap();
                builds += 1;
                match builder.bits_to_skip(&buffers, skipped).unwrap() {
                    Some(more) => skipped = more,
                    None => break,
                }
            }
            let host = build(&triangles, &settings).unwrap();
            let texels = host.texels();
            let there: Vec<[u32; 4]> = gpu.read(buffers.quarters.buffer().view(), texels.len()).unwrap();
            assert!(there == texels, "{code_bits}");
            // The builder that does so by itself, and says how often.
            let whole = builder.build(&triangles).unwrap();
            assert_eq!(whole.timings.count("lbvh: hierarchy"), builds, "{code_bits}");
            assert_eq!(whole.timings.count("lbvh: sort"), 1);
            assert!(whole.index.texels() == texels && whole.index.statistics() == host.statistics());
            assert!(host.statistics().max_depth <= MAX_DEPTH);
            let mut recorder = gpu.recorder("refused").unwrap();
            let refused = builder.record_shallower(&mut recorder, &buffers, code_bits + 1);
            assert!(matches!(refused, Err(Error::Setting { .. })));
        }
    });
}

#[test]
fn builds_that_the_device_corrects_are_traversable_and_else_the_hosts() {
    with_gpu(|gpu| {
        let mut random = Random(73);
        for code_bits in [30, 63] {
            let settings = fast(code_bits, 4);
            let builder = LbvhBuilder::new(gpu, &settings).unwrap();
            let deep = ladder(10_000, code_bits as i32 / 3);
            // Bits above the 14 levels of equal codes.
            assert_eq!(builder.bits_too_many(deep.len() as u32), code_bits + 14 - MAX_DEPTH);
            assert_eq!(builder.bits_too_many(4), (code_bits + 2).saturating_sub(MAX_DEPTH));
            for (triangles, is_deep) in [(deep, true), (soup(&mut random, 1000, 0.3), false)] {
                let count = triangles.len() as u32;
                let skipped = if is_deep { builder.bits_too_many(count) } else { 0 };
                let filled = || {
                    let buffers = builder.buffers(count).unwrap();
                    gpu.upload(&buffers.corners, 0, &triangles).unwrap();
                    gpu.upload(&buffers.indices, 0, &(0..count).collect::<Vec<_>>())
                        .unwrap();
                    buffers
                };
                let read = |buffers: &clerestory::accel::lbvh::LbvhBuffers| -> Vec<[u32; 4]> {
                    let view = buffers.quarters.buffer().view();
                    // The root says where the triangles begin.
                    let root: Vec<[u32; 4]> = gpu.read(view, 4).unwrap();
                    gpu.read(view, (root[3][3] + 3 * count) as usize).unwrap()
                };
                let (corrected, plain) = (filled(), filled());
                let mut recorder = gpu.recorder("corrected").unwrap();
                // Twice, as in two frames of one recording.
                builder.record_traversable(&mut recorder, &corrected).unwrap();
                builder.record_traversable(&mut recorder, &corrected).unwrap();
                recorder.submit().unwrap().wait().unwrap();
                assert_eq!(builder.bits_to_skip(&corrected, 0).unwrap(), None);
                let mut recorder = gpu.recorder("plain").unwrap();
                builder.record(&mut recorder, &plain).unwrap();
                recorder.submit().unwrap().wait().unwrap();
                assert_eq!(builder.bits_to_skip(&plain, 0).unwrap().is_some(), is_deep);
                if is_deep {
                    let mut recorder = gpu.recorder("shallower").unwrap();
                    builder.record_shallower(&mut recorder, &plain, skipped).unwrap();
                    recorder.submit().unwrap().wait().unwrap();
                } else {
                    assert!(read(&plain) == build(&triangles, &settings).unwrap().texels());
                }
                assert!(read(&corrected) == read(&plain), "{code_bits} {is_deep}");
            }
        }
    });
}

#[test]
fn a_million_identical_centres_give_the_hosts_tree() {
    with_gpu(|gpu| {
        let settings = fast(30, 4);
        let builder = LbvhBuilder::new(gpu, &settings).unwrap();
        check(
            "identical",
            &builder,
            &settings,
            &vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 1_000_000],
        );
    });
}

#[test]
fn an_index_that_stays_on_the_device_knows_its_size_and_cost() {
    with_gpu(|gpu| {
        let builder = LbvhBuilder::new(gpu, &fast(30, 4)).unwrap();
        for count in [0, 1, 2, 3, 5000] {
            let mut triangles = soup(&mut Random(75), count, 0.3);
            if count > 100 {
                triangles[7][1].z = f32::NAN;
                triangles[8][1] = triangles[8][0];
            }
            let host = build(&triangles, &fast(30, 4)).unwrap();
            let resident = builder.build_resident(&triangles).unwrap();
            assert_eq!(resident.is_some(), count >= 2);
            let Some(resident) = resident else { continue };
            let (device, host_size) = (resident.statistics, host.statistics());
            // Sums of positive terms, one per level, each within three units of roundoff.
            let bound = 3.0 * f64::from(host_size.max_depth + 1) / f64::from(1 << 24);
            let error = device.sah_cost / host_size.sah_cost - 1.0;
            assert!(error.abs() <= bound, "{count}: {error:e} of {bound:e}");
            assert!(device.bytes >= host_size.bytes);
            let mut counts = device;
            (counts.sah_cost, counts.bytes) = (host_size.sah_cost, host_size.bytes);
            assert_eq!(counts, host_size);
            assert!(resident.stages.hierarchy > 0.0 && resident.stages.layout > 0.0);
            let texels = host.texels();
            let there: Vec<[u32; 4]> = gpu.read(resident.quarters.buffer().view(), texels.len()).unwrap();
            assert!(there == texels, "{count}");
        }
    });
}

#[test]
fn every_stage_is_named_and_timed() {
    with_gpu(|gpu| {
        let builder = LbvhBuilder::new(gpu, &fast(30, 4)).unwrap();
        let triangles = soup(&mut Random(72), 500, 0.3);
        let build = builder.build(&triangles).unwrap();
        let stages = ["boxes", "codes", "sort", "hierarchy", "climb", "ranks", "emit"];
        assert_eq!(build.timings.passes.len(), stages.len());
        for stage in stages {
            assert_eq!(build.timings.count(&format!("lbvh: {stage}")), 1, "{stage}");
        }
        assert!(build.buffers.unwrap().bytes() > 500 * 100);
    });
}

#[test]
fn device_refits_are_the_twins() {
    with_gpu(|gpu| {
        let mut random = Random(73);
        for (settings, count) in [(fast(30, 4), 5000), (fast(30, 1), 2), (fast(30, 4), 1)] {
            let builder = LbvhBuilder::new(gpu, &settings).unwrap();
            let mut triangles = soup(&mut random, count, 0.3);
            let before = builder.build(&triangles).unwrap();
            for triangle in &mut triangles {
                let shift = random.vector() * 0.2;
                triangle.iter_mut().for_each(|v| *v += shift);
            }
            if count > 100 {
                triangles[40][1] = triangles[40][0];
            }
            let (device, _) = builder.refit(&before, &triangles).unwrap();
            let host = refit(&before.index, &triangles).unwrap();
            assert!(device.texels() == host.texels(), "{count}");
            assert_eq!(device.statistics(), host.statistics(), "{count}");
            assert!(builder.refit(&before, &triangles[1..]).is_err());
        }
    });
}

/// Order of visits and work of a query, as the kernels report it.
fn work(visit: impl FnOnce(&mut QueryCounters, &mut dyn FnMut(u32))) -> [u32; 4] {
    let mut counters = QueryCounters::default();
    let mut visits = 0u32;
    visit(&mut counters, &mut |leaf| {
        visits = (visits ^ leaf).wrapping_mul(0x9E37_79B1)
    });
    [
        visits,
        counters.leaves as u32,
        counters.nodes as u32,
        counters.pushes as u32,
    ]
}

/// Runs a kernel that measures queries. Macro, since each shader has types of its own.
macro_rules! measure {
    ($shader:ident, $gpu:expr, $bvh:expr, $rays:expr, $leaf_end:expr) => {{
        let (gpu, bvh, rays): (&Gpu, &CompactBvh, &[Ray]) = ($gpu, $bvh, $rays);
        let pipeline = gpu.compute_pipeline::<$shader::Kernel>(&Default::default()).unwrap();
        let pairs = gpu.buffer_with("pairs", Category::Index, &bvh.pairs).unwrap();
        let queries = gpu.buffer_with("queries", Category::Work, rays).unwrap();
        let works = gpu
            .buffer_with("works", Category::Work, &vec![[0u32; 4]; rays.len()])
            .unwrap();
        let status = gpu.buffer_with("status", Category::Work, &[0u32]).unwrap();
        let set = $shader::Set0 {
            compact_pairs: pairs.view(),
            compact_queries: queries.view(),
            compact_works: works.view(),
            compact_status: status.view(),
        };
        let push = $shader::Push {
            root: CompactRoot {
                lower: bvh.root.bounds.lower.into(),
                reference: bvh.root.reference.unwrap_or(u32::MAX),
                upper: bvh.root.bounds.upper.into(),
                padding: 0,
            },
            count: rays.len() as u32,
            leaf_end: $leaf_end,
        };
        let mut recorder = gpu.recorder("queries").unwrap();
        recorder
            .pass("queries", |pass| {
                pass.barrier(&[transfer_to_compute(&works)]);
                let groups = [pipeline.groups_for(rays.len() as u32), 1, 1];
                pass.dispatch(&pipeline, &[&set], &push, groups)
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(status.view(), 1).unwrap(), [0], "stopped by the quota");
        gpu.read::<CompactWork>(works.view(), rays.len()).unwrap()
    }};
}

#[test]
fn compact_queries_are_the_twins() {
    with_gpu(|gpu| {
        let mut random = Random(74);
        let boxes: Vec<Aabb> = (0..20_000)
            .map(|i| {
                let centre = random.vector();
                let half = random.vector().abs() * if i % 7 == 0 { 0.0 } else { 0.05 };
                Aabb {
                    lower: centre - half,
                    upper: centre + half,
                }
            })
            .collect();
        let rays: Vec<Ray> = (0..16_384)
            .map(|i| Ray {
                origin: random.vector().into(),
                t_min: 0.0,
                direction: (if i % 5 == 0 {
                    Vec3::AXES[i / 5 % 3]
                } else {
                    random.direction()
                })
                .into(),
                t_max: if i % 2 == 0 { f32::INFINITY } else { 0.5 },
            })
            .collect();
        for count in [0, 1, 2, 20_000] {
            let boxes = &boxes[..count];
            let sorted = SortedCodes::of_boxes(boxes, 10);
            let tree = hierarchy(boxes, &sorted, LeafRule::Size(5), 64);
            let compact = CompactBvh::encode(&CompleteBvh::new(&tree).unwrap()).unwrap();
            let bits = |w: &CompactWork| [w.visits, w.leaves, w.nodes, w.pushes];
            let points = measure!(compact_points, gpu, &compact, &rays, 0.0);
            for (ray, got) in rays.iter().zip(&points) {
                let twin = work(|counters, visit| compact.point_query(ray.origin.into(), counters, visit));
                assert_eq!(bits(got), twin, "{ray:?}");
            }
            for leaf_end in [f32::INFINITY, 0.3] {
                let traced = measure!(compact_rays, gpu, &compact, &rays, leaf_end);
                let mut differ = 0;
                for (ray, got) in rays.iter().zip(&traced) {
                    let twin = work(|counters, visit| {
                        compact.ray_query(ray, counters, |leaf, t_max| {
                            visit(leaf);
                            *t_max = t_max.min(leaf_end);
                        });
                    });
                    differ += u32::from(bits(got) != twin);
                }
                // Divisions may err by 2.5 ULP elsewhere, which turns the order of a pair where entries are that close.
                let allowed = if gpu.caps().kind == DeviceKind::Cpu {
                    0
                } else {
                    rays.len() as u32 / 1000
                };
                assert!(differ <= allowed, "{differ} rays differ");
            }
        }
    });
}
