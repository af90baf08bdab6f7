//! Rays through media that ask the volume map from queues, by themselves and a subgroup's together: the same bits and counts in all six forms, and what they fetch.

use super::queues::FORMS;
use super::volume::{coloured, direct, endless, lit_box, uneven};
use super::volume_truths::ESTIMATES;
use super::*;
use clerestory::gpu::Category;
use clerestory::scene::{Medium, Phase};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory::techniques::photon_mapping::{GatherCounts, MapQueue, RayFetches};
use clerestory_hard_cases::scenes::place_sparse_grid;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::{gpu, with_gpu};
use glam::DVec3;

/// Set in the processes that only print their pictures' hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_VOLUME_QUEUE_HASH";
const CHILD_TEST: &str = "volume_queues::prints_its_hash_when_asked";

/// The same for one estimate, which the second variable names.
const ESTIMATE_CHILD: &str = "CLERESTORY_TEST_PRINT_ESTIMATE_HASH";
const ESTIMATE: &str = "CLERESTORY_TEST_ESTIMATE";
const ESTIMATE_CHILD_TEST: &str = "volume_queues::prints_the_hash_of_an_estimate_when_asked";

type Form = (MapQueue, MapQuery);

/// A form for each queue, one of them by packets.
const FEW_FORMS: [Form; 4] = [FORMS[0], FORMS[1], FORMS[2], FORMS[5]];

/// Samples per pixel of a pass, so that a wave has as many places as two workgroups of the queue in blocks walk.
const SAMPLES: u32 = 16;
const PLACES: u64 = SAMPLES as u64 * (SIDE * SIDE) as u64;

/// What one form makes of a scene.
#[derive(Debug, Clone, PartialEq)]
struct Made {
    bits: Vec<u32>,
    beams: GatherCounts,
    gather: GatherCounts,
    fetches: RayFetches,
    stalls: u64,
    postponed: u64,
}

fn made(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, (queue, query): Form) -> Made {
    let settings = PhotonSettings {
        queue,
        query,
        ..settings.clone()
    };
    let mut mapper = mapper(gpu, scene, &settings);
    let bits = bits(&advance(&mut mapper, settings.samples_per_pass));
    let (counts, eye) = (mapper.counts(), mapper.eye_counters());
    Made {
        bits,
        beams: counts.beams,
        gather: counts.gather,
        fetches: counts.ray_fetches,
        stalls: eye.stalls,
        postponed: eye.postponed,
    }
}

/// Fails unless all of these forms, the plainest first, make the same of a scene; what each made.
fn expect_alike(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, forms: &[Form]) -> Vec<Made> {
    let all: Vec<Made> = forms.iter().map(|form| made(gpu, scene, settings, *form)).collect();
    for (form, other) in forms.iter().zip(&all) {
        let what = format!("{}: {form:?}", scene.name);
        assert!(all[0].bits == other.bits, "{what}: another picture");
        assert_eq!((all[0].beams, all[0].gather), (other.beams, other.gather), "{what}");
        assert_eq!(
            all[0].fetches.queries_by_bounce, other.fetches.queries_by_bounce,
            "{what}"
        );
        if form.1 == MapQuery::Single {
            // Whichever invocations they have, rays go the same ways through the map.
            assert_eq!(all[0].fetches, other.fetches, "{what}");
        }
    }
    all
}

/// Kernels of a radius, all light from the maps, what is fetched counted.
pub(super) fn asked(photons: u32, volume_radius: f32) -> PhotonSettings {
    PhotonSettings {
        volume_radius,
        samples_per_pass: SAMPLES,
        count_fetches: true,
        ..direct(photons)
    }
}

/// Adds a box of a medium that scatters nothing: rays go through it as through the others, and ask for nothing.
fn add_absorbing(scene: &mut Scene, lower: Vec3, upper: Vec3) {
    let inside = scene.media.len() as u32;
    scene.media.push(medium(2.0, 0.0, Phase::Isotropic));
    let boundary = scene.add_material(Material {
        name: "absorbing boundary".into(),
        boundary: true,
        interior: Some(inside),
        ..Material::default()
    });
    scene.place(cuboid("absorbing", boundary, lower, upper));
}

/// A box of a medium with one that scatters nothing beside it, both seen from above with the floor around them: some rays ask, and not all of a subgroup.
pub(super) fn boxes(of: Medium) -> Scene {
    let mut scene = lit_box(of);
    add_absorbing(&mut scene, Vec3::new(0.55, -0.4, -0.45), Vec3::new(0.85, 0.4, 0.45));
    scene.cameras = vec![camera_down(0.9, 5.0)];
    scene
}

#[test]
fn every_queue_and_packets_give_the_same_picture_through_media() {
    with_gpu(|gpu| {
        let settings = asked(1 << 13, 0.1);
        let scene = boxes(coloured());
        let all = expect_alike(gpu, &scene, &settings, &FORMS);
        let (first, packet) = (&all[0], &all[3]);
        println!("{:?}, {:?}, packets {:?}", first.beams, first.fetches, packet.fetches);
        assert!(
            first.beams.queries > 0 && first.beams.queries < PLACES / 2 && first.gather.queries > 0,
            "{first:?}"
        );
        assert!(first.beams.photons > first.beams.queries && first.stalls == 0);
        // Rays come into a box behind their first bounce.
        let [of_first_rays, behind_one, ..] = first.fetches.queries_by_bounce;
        assert!(of_first_rays == 0 && behind_one > 0, "{first:?}");
        assert_eq!(first.fetches.later_queries(), first.beams.queries);
        for (form, made) in FORMS.iter().zip(&all) {
            let fetches = made.fetches;
            let fetched = fetches.nodes / 2 + fetches.records;
            match form.1 {
                MapQuery::Single => assert_eq!(fetched, fetches.tests, "{form:?}"),
                // What others of a subgroup meet is tested, too, and fetched once for all.
                MapQuery::Packet => {
                    assert!(
                        fetched < fetches.tests && fetches.nodes < first.fetches.nodes,
                        "{form:?}: {fetches:?}"
                    );
                    assert!(
                        fetches.tests >= first.fetches.tests && fetches.records <= first.fetches.records,
                        "{form:?}: {fetches:?}"
                    );
                }
            }
        }
        // Without counting the same pictures.
        let plain = PhotonSettings {
            count_fetches: false,
            ..settings
        };
        for form in [FORMS[0], FORMS[3]] {
            let made = made(gpu, &scene, &plain, form);
            assert!(
                made.bits == first.bits && made.fetches == RayFetches::default(),
                "{form:?}"
            );
        }
    });
}

#[test]
fn queues_and_packets_go_through_grids() {
    with_gpu(|gpu| {
        let all = expect_alike(gpu, &boxes(uneven(coloured())), &asked(1 << 13, 0.1), &FEW_FORMS);
        assert!(all[0].beams.photons > all[0].beams.queries && all[0].beams.queries > 0);
    });
}

#[test]
fn queues_and_packets_take_rays_that_all_meet_the_same_thousand_kernels() {
    with_gpu(|gpu| {
        // The eye is in an endless medium, and kernels reach across all that is lit.
        let scene = endless(medium(1.0, 0.9, Phase::Isotropic));
        let all = expect_alike(gpu, &scene, &asked(160, 50.0), &FORMS);
        let first = &all[0];
        assert_eq!(first.beams.queries, PLACES);
        assert_eq!(first.fetches.queries_by_bounce, [PLACES, 0, 0, 0]);
        let each = first.beams.photons / PLACES;
        println!("{each} kernels about each ray, {:?}", first.fetches);
        assert!(
            each >= 1000 && first.beams.photons == each * PLACES,
            "{:?}",
            first.beams
        );
        assert!(first.bits.iter().all(|bits| f32::from_bits(*bits) > 0.0));
        // All go the same way, by themselves or together, and nothing is fetched twice for a subgroup.
        for (form, made) in FORMS.iter().zip(&all).filter(|(form, _)| form.1 == MapQuery::Packet) {
            assert_eq!(made.fetches.tests, first.fetches.tests, "{form:?}");
            assert!(2 * made.fetches.nodes <= first.fetches.nodes, "{form:?}");
            assert!(2 * made.fetches.records <= first.fetches.records, "{form:?}");
        }
    });
}

#[test]
fn queues_and_packets_take_rays_that_a_quota_stops() {
    with_gpu(|gpu| {
        let scene = boxes(coloured());
        let whole = made(gpu, &scene, &asked(1 << 13, 0.1), FORMS[0]);
        let settings = PhotonSettings {
            query_quota: 64,
            ..asked(1 << 13, 0.1)
        };
        let singles: Vec<Made> = FORMS[..3]
            .iter()
            .map(|form| made(gpu, &scene, &settings, *form))
            .collect();
        // By themselves the same ones stop, whichever invocations they have.
        assert!(singles[0].stalls > 0);
        assert_eq!(
            (singles[0].beams, singles[0].gather),
            (whole.beams, whole.gather),
            "queries, and kernels that they met"
        );
        for single in &singles {
            assert!(single.bits == singles[0].bits && single.beams == singles[0].beams);
        }
        for form in &FORMS[3..] {
            let packet = made(gpu, &scene, &settings, *form);
            assert!(packet.stalls > 0);
            assert_eq!((packet.beams, packet.gather), (whole.beams, whole.gather), "{form:?}");
            // Sums of some hundred kernels in another order.
            for (a, b) in whole.bits.iter().zip(&packet.bits) {
                let (a, b) = (f32::from_bits(*a), f32::from_bits(*b));
                assert!((a - b).abs() <= 1e-5 * a, "{form:?}: {b}, not {a}");
            }
            assert!(
                packet.bits == made(gpu, &scene, &settings, *form).bits,
                "{form:?}: two runs"
            );
        }
    });
}

/// A grid of which next to nothing is dense, with a box that scatters nothing beside it.
pub(super) fn sparse() -> Scene {
    let mut scene = Scene {
        name: "sparse grid".into(),
        ..Scene::default()
    };
    place_sparse_grid(&mut scene, 4000.0);
    add_absorbing(&mut scene, Vec3::new(1.1, 0.0, 0.0), Vec3::new(1.4, 1.0, 1.0));
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.6)));
    scene.place(floor("floor", grey, 3.0, -0.1));
    let (eye, target) = (DVec3::new(0.6, 4.0, 0.5), DVec3::new(0.6, 0.0, 0.5));
    scene.cameras = vec![clerestory_hard_cases::scenes::orthographic(eye, target, DVec3::Z, 0.7)];
    scene
}

/// A way through the grid takes more tentative collisions than a dispatch has, and goes on in the next one, before it asks.
#[test]
fn queues_and_packets_wait_for_walks_through_grids() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            samples_per_pass: 1,
            ..asked(1 << 8, 0.2)
        };
        let all = expect_alike(gpu, &sparse(), &settings, &FEW_FORMS);
        assert!(all.iter().all(|made| made.postponed > 0));
        assert!(all[0].beams.photons > 0, "{:?}", all[0].beams);
    });
}

/// Pictures are the same wherever submissions end, with which places that wait in a queue are asked for in the next one, without their ways being found again.
#[test]
fn queues_and_packets_are_the_same_in_parts() {
    with_gpu(|gpu| {
        let scene = boxes(uneven(coloured()));
        let settings = PhotonSettings {
            samples_per_pass: 2,
            ..asked(1 << 11, 0.1)
        };
        let whole = made(gpu, &scene, &settings, FORMS[0]);
        assert!(whole.beams.photons > 0);
        let parts = PhotonSettings {
            submission_work: 64,
            ..settings
        };
        for parted in expect_alike(gpu, &scene, &parts, &FEW_FORMS) {
            assert!(parted.bits == whole.bits && parted.postponed > 0);
            assert_eq!((parted.beams, parted.gather), (whole.beams, whole.gather));
        }
    });
}

#[test]
fn queues_and_packets_of_rays_are_made_for_media_alone() {
    with_gpu(|gpu| {
        let of = |scene: &Scene, (queue, query): Form| {
            let settings = PhotonSettings {
                queue,
                query,
                samples_per_pass: 1,
                ..asked(1 << 8, 0.1)
            };
            let mut mapper = mapper(gpu, scene, &settings);
            let mut passes = Vec::new();
            while let Some(step) = mapper.step(1).unwrap_or_else(|error| panic!("{error}")) {
                passes.extend(step.timings.into_iter().flat_map(|timings| timings.passes));
            }
            let beams = |name: &str| name.contains("beam");
            let kernels = mapper.pipelines();
            (
                kernels
                    .iter()
                    .map(|kernel| kernel.shader)
                    .filter(|name| beams(name))
                    .count(),
                passes.iter().map(|pass| &pass.name).filter(|name| beams(name)).count(),
                kernels
                    .iter()
                    .filter(|kernel| kernel.shader.contains("photon_queue"))
                    .count(),
            )
        };
        // In a room without media nothing of rays, and one queue.
        for form in FEW_FORMS {
            let queues = usize::from(form.0 != MapQueue::Slots);
            assert_eq!(of(&builtin("builtin:cornell-box"), form), (0, 0, queues), "{form:?}");
        }
        // In fog a kernel of queries, and with a queue one that finds ways and a second queue.
        let fog = lit_box(coloured());
        let (kernels, passes, queues) = of(&fog, FORMS[0]);
        assert!((kernels, queues) == (1, 0) && passes > 0);
        for form in [FORMS[1], FORMS[5]] {
            let (kernels, queued, queues) = of(&fog, form);
            assert_eq!((kernels, queues), (2, 2), "{form:?}");
            assert!(queued >= 3 && queued.is_multiple_of(3), "{form:?}: {queued} passes");
        }
    });
}

#[test]
fn points_and_rays_share_the_memory_of_their_queues() {
    with_gpu(|gpu| {
        // Bytes to work in that a queue adds.
        let work = |scene: &Scene, queue| {
            let settings = PhotonSettings {
                queue,
                ..asked(1 << 8, 0.1)
            };
            let before = gpu.memory_report().of(Category::Work);
            let mapper = mapper(gpu, scene, &settings);
            let bytes = gpu.memory_report().of(Category::Work) - before;
            drop(mapper);
            bytes
        };
        let (room, fog) = (builtin("builtin:cornell-box"), lit_box(coloured()));
        for queue in [MapQueue::Compacted, MapQueue::Blocks] {
            let [of_points, of_both] = [&room, &fog].map(|scene| work(scene, queue) - work(scene, MapQueue::Slots));
            // A word a place at least.
            assert!(of_points > 4 * PLACES, "{queue:?}: {of_points}");
            assert_eq!(of_both, of_points, "{queue:?}");
        }
    });
}

#[test]
fn queues_and_packets_never_show_on_any_number_of_threads() {
    let hash = |threads| hash_in_child(CHILD_TEST, CHILD, &[("LP_NUM_THREADS", threads)]);
    let truth = hash("1");
    assert_eq!(hash("2"), truth, "two threads");
}

/// Fails unless all six forms of an estimate make the same, in processes with one thread and with two.
fn expect_the_same_on_threads(volume: VolumeEstimate) {
    let name = format!("{volume:?}");
    let hash = |threads| {
        let variables = [("LP_NUM_THREADS", threads), (ESTIMATE, name.as_str())];
        hash_in_child(ESTIMATE_CHILD_TEST, ESTIMATE_CHILD, &variables)
    };
    let truth = hash("1");
    assert_eq!(hash("2"), truth, "two threads");
}

#[test]
fn marches_are_the_same_in_every_form_on_any_number_of_threads() {
    expect_the_same_on_threads(VolumeEstimate::March);
}

#[test]
fn beams_are_the_same_in_every_form_on_any_number_of_threads() {
    expect_the_same_on_threads(VolumeEstimate::Beams);
}

#[test]
fn planes_are_the_same_in_every_form_on_any_number_of_threads() {
    expect_the_same_on_threads(VolumeEstimate::Planes);
}

#[test]
fn unified_estimates_are_the_same_in_every_form_on_any_number_of_threads() {
    expect_the_same_on_threads(VolumeEstimate::Unified);
}

#[test]
fn prints_the_hash_of_an_estimate_when_asked() {
    if std::env::var_os(ESTIMATE_CHILD).is_none() {
        return;
    }
    let name = std::env::var(ESTIMATE).unwrap();
    let mut estimates = ESTIMATES.into_iter();
    let volume = estimates.find(|volume| format!("{volume:?}") == name).unwrap();
    let gpu = gpu();
    let settings = PhotonSettings {
        volume,
        ..asked(1 << 10, 0.05)
    };
    let mut cases = vec![(boxes(coloured()), &FORMS[..])];
    if !matches!(volume, VolumeEstimate::Beams | VolumeEstimate::Planes) {
        cases.push((boxes(uneven(coloured())), &FEW_FORMS[..]));
    }
    let mut words: Vec<u32> = Vec::new();
    for (scene, forms) in &cases {
        let all = expect_alike(&gpu, scene, &settings, forms);
        let beams = all[0].beams;
        assert!(
            beams.queries > 0 && beams.photons > 0 && all[0].stalls == 0,
            "{beams:?}"
        );
        assert_eq!(beams.rays > 0, volume == VolumeEstimate::Planes, "{beams:?}");
        words.extend_from_slice(&all[0].bits);
        words.extend([beams.queries as u32, beams.photons as u32, beams.rays as u32]);
    }
    print_hash(words);
    clerestory_tests::assert_no_messages(&gpu);
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let whole = asked(1 << 13, 0.1);
    let stopping = PhotonSettings {
        query_quota: 64,
        ..asked(1 << 11, 0.1)
    };
    let mut words = Vec::new();
    for form in FORMS {
        let made = made(&gpu, &boxes(coloured()), &whole, form);
        words.extend(made.bits);
        words.extend([made.beams.queries as u32, made.beams.photons as u32]);
        words.extend([made.fetches.nodes as u32, made.fetches.records as u32]);
    }
    for form in FEW_FORMS {
        words.extend(made(&gpu, &boxes(uneven(coloured())), &whole, form).bits);
        words.extend(made(&gpu, &boxes(coloured()), &stopping, form).bits);
    }
    print_hash(words);
    clerestory_tests::assert_no_messages(&gpu);
}
