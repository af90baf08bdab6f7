//! One kernel for the hits of eye rays, their ways through media and what they see there: the same bits and counts as by a kernel each, in fewer passes, also where it leaves places to these.

use super::volume::{coloured, uneven};
use super::volume_queues::{asked, boxes, sparse};
use super::*;
use clerestory::Error;
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory::techniques::photon_mapping::{GatherCounts, MapQueue, MapStages, RayFetches};
use clerestory::transport::GpuScene;
use clerestory_tests::with_gpu;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is made of a scene.
struct Made {
    bits: Vec<u32>,
    beams: GatherCounts,
    gather: GatherCounts,
    fetches: RayFetches,
    stalls: u64,
    postponed: u64,
    /// How often a pass of a name was recorded, of eye paths.
    passes: BTreeMap<String, usize>,
}

fn made(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, stages: MapStages) -> Made {
    let settings = PhotonSettings {
        stages,
        ..settings.clone()
    };
    let mut mapper = mapper(gpu, scene, &settings);
    let mut passes = BTreeMap::new();
    while let Some(step) = mapper
        .step(settings.samples_per_pass)
        .unwrap_or_else(|error| panic!("{}: {error}", scene.name))
    {
        for pass in step.timings.into_iter().flat_map(|timings| timings.passes) {
            *passes.entry(pass.name).or_insert(0) += 1;
        }
    }
    let bits = bits(&advance(&mut mapper, settings.samples_per_pass));
    let (counts, eye) = (mapper.counts(), mapper.eye_counters());
    Made {
        bits,
        beams: counts.beams,
        gather: counts.gather,
        fetches: counts.ray_fetches,
        stalls: eye.stalls,
        postponed: eye.postponed,
        passes,
    }
}

impl Made {
    /// How often a pass was recorded.
    fn of(&self, name: &str) -> usize {
        self.passes.get(name).copied().unwrap_or(0)
    }
}

const RAYS: &str = "path: extend";
const BEAMS: &str = "photon: beams";
const FUSED: &str = "photon: rays and beams";
/// Once a bounce, by stages and fused.
const BOUNCES: &str = "path: shade";

/// By stages and fused, the same.
fn both(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) -> [Made; 2] {
    let both = [MapStages::Stream, MapStages::Fused].map(|stages| made(gpu, scene, settings, stages));
    let [stream, fused] = &both;
    let what = format!("{}, {:?}", scene.name, settings.volume);
    println!("{what}: {:?}, fused {:?}", stream.passes, fused.passes);
    assert!(stream.bits == fused.bits, "{what}: another picture");
    assert_eq!((stream.beams, stream.gather), (fused.beams, fused.gather), "{what}");
    assert!(stream.beams.queries > 0 && stream.beams.photons > 0, "{what}");
    assert!(stream.of(FUSED) == 0 && fused.of(FUSED) > 0, "{what}");
    both
}

/// The same where nothing stops: a pass instead of two in each bounce.
fn expect_fewer_passes(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) {
    let settings = PhotonSettings {
        submission_work: 1 << 30,
        ..settings.clone()
    };
    let [stream, fused] = both(gpu, scene, &settings);
    for made in [&stream, &fused] {
        assert_eq!((made.stalls, made.postponed), (0, 0));
    }
    assert_eq!(
        (stream.of(RAYS), stream.of(BEAMS)),
        (stream.of(BOUNCES), stream.of(BOUNCES))
    );
    assert_eq!((fused.of(RAYS), fused.of(BEAMS)), (0, 0));
    assert_eq!(fused.of(FUSED), fused.of(BOUNCES));
    assert_eq!(fused.passes.len() + 1, stream.passes.len());
    // Rays go the same ways through the map.
    assert_eq!(fused.fetches, stream.fetches);
}

#[test]
fn fused_stages_make_the_same_picture_in_fewer_passes() {
    with_gpu(|gpu| expect_fewer_passes(gpu, &boxes(coloured()), &asked(1 << 12, 0.1)));
}

#[test]
fn fused_stages_send_rays_towards_planes() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            volume: VolumeEstimate::Planes,
            ..asked(1 << 10, 0.05)
        };
        expect_fewer_passes(gpu, &boxes(coloured()), &settings);
    });
}

#[test]
fn fused_stages_go_through_grids() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            volume: VolumeEstimate::Unified,
            ..asked(1 << 11, 0.1)
        };
        expect_fewer_passes(gpu, &boxes(uneven(coloured())), &settings);
    });
}

/// Rays ask once more by their stage, which then goes through all records.
#[test]
fn queries_that_a_quota_stops_in_a_fused_kernel_are_the_stages() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            query_quota: 64,
            ..asked(1 << 12, 0.1)
        };
        let [stream, fused] = both(gpu, &boxes(coloured()), &settings);
        assert!(stream.stalls > 0 && fused.stalls > 0 && fused.of(RAYS) > 0 && fused.of(BEAMS) > 0);
    });
}

#[test]
fn walks_that_a_quota_stops_in_a_fused_kernel_are_the_stages() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            samples_per_pass: 1,
            ..asked(1 << 8, 0.2)
        };
        let [stream, fused] = both(gpu, &sparse(), &settings);
        assert!(stream.postponed > 0 && fused.postponed > 0 && fused.of(BEAMS) > 0);
    });
}

/// Submissions end wherever their work is used up, also between a ray's hit and its query.
#[test]
fn fused_stages_are_the_same_in_parts() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            samples_per_pass: 2,
            ..asked(1 << 11, 0.1)
        };
        let scene = boxes(uneven(coloured()));
        let whole = made(gpu, &scene, &settings, MapStages::Fused);
        let parts = PhotonSettings {
            submission_work: 64,
            ..settings
        };
        for parted in both(gpu, &scene, &parts) {
            assert!(parted.bits == whole.bits && parted.postponed > 0);
            assert_eq!((parted.beams, parted.gather), (whole.beams, whole.gather));
        }
    });
}

/// Rays that test thousands of triangles in one place take more than a dispatch has, and go on by their stage while others have asked already.
#[test]
fn rays_that_a_quota_stops_in_a_fused_kernel_are_the_stages() {
    with_gpu(|gpu| {
        let mut scene = boxes(coloured());
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
        let corner = |x: f32, z: f32| Vec3::new(x, 1.2, z);
        scene.place(Mesh {
            name: "triangles".into(),
            positions: vec![corner(-0.9, -0.9), corner(-0.9, 0.3), corner(0.3, -0.9)],
            triangles: vec![[0, 1, 2]; 3000],
            material: Some(grey),
            ..Mesh::default()
        });
        let settings = PhotonSettings {
            samples_per_pass: 2,
            ..asked(1 << 9, 0.1)
        };
        let [stream, fused] = both(gpu, &scene, &settings);
        assert!(stream.stalls > 0 && fused.stalls > 0 && fused.of(RAYS) > 0);
    });
}

#[test]
fn fused_stages_are_refused_beside_queues_packets_and_kd_trees() {
    with_gpu(|gpu| {
        let scene = boxes(coloured());
        let fused = PhotonSettings {
            stages: MapStages::Fused,
            ..asked(1 << 8, 0.1)
        };
        let cases = [
            PhotonSettings {
                queue: MapQueue::Compacted,
                ..fused.clone()
            },
            PhotonSettings {
                query: MapQuery::Packet,
                ..fused.clone()
            },
        ];
        let kd = GpuScene::with_index(gpu, &scene, &"kd".parse().unwrap()).unwrap();
        let cases = cases.map(|settings| (upload(gpu, &scene), settings));
        for (scene_there, settings) in cases.into_iter().chain([(Arc::new(kd), fused)]) {
            let refused = PhotonMapper::new(gpu, scene_there, &scene.cameras[0], SIZE, settings);
            match refused.err() {
                Some(Error::Setting { name, .. }) => assert_eq!(name, "stages"),
                other => panic!("{other:?}"),
            }
        }
    });
}
