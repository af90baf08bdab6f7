//! A picture does not depend on the ray index: every index reports the hit of least distance, of equal ones the triangle of least index,
//! from the same arithmetic. So pictures are equal to the bit, those of coincident triangles included; but for instances that two levels keep.

use clerestory::accel::IndexKind;
use std::sync::Arc;

use clerestory::accel::bvh2::Bvh2Settings;
use clerestory::accel::driver::DRIVER_REACH;
use clerestory::accel::kd::KdSettings;
use clerestory::accel::wide::WideSettings;
use clerestory::film::picture::{NORMAL, VARIANCE};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::render::{RenderOptions, Rendered, Renderer, RendererDesc};
use clerestory::scene::{AlphaMode, Instance, Projection, Scene};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_tests::render::{builtin, finish};
use clerestory_tests::with_gpu;
use glam::Vec3;

/// Iterations at which rays of a city stop.
const SMALL_QUOTA: u32 = 128;

fn with(index: IndexKind) -> RendererDesc {
    RendererDesc {
        index,
        ..RendererDesc::default()
    }
}

fn render(gpu: &Gpu, scene: &Scene, index: &IndexKind) -> Result<Rendered> {
    let mut rendering = Renderer::with(gpu, scene, &with(*index))?.start(&RenderOptions {
        size: [40, 32],
        spp: 3,
        seed: 5,
        aovs: true,
        ..RenderOptions::default()
    })?;
    while rendering.step()?.is_some() {}
    rendering.finish()
}

fn bits(rendered: &Rendered) -> Vec<u32> {
    ["radiance", VARIANCE, NORMAL]
        .iter()
        .filter_map(|name| rendered.picture.layer(name))
        .flat_map(|layer| layer.values().iter().map(|value| value.to_bits()))
        .collect()
}

/// The Cornell box with every instance twice in the same place: each hit is a tie, between surfaces of two colours.
fn doubled() -> Scene {
    let mut scene = builtin("builtin:cornell-box");
    let count = scene.materials.len() as u32;
    let twins: Vec<Instance> = scene
        .instances
        .iter()
        .map(|instance| {
            let mut mesh = scene.meshes[instance.mesh as usize].clone();
            mesh.material = mesh.material.map(|material| (material + 1) % count);
            scene.meshes.push(mesh);
            Instance {
                mesh: scene.meshes.len() as u32 - 1,
                ..instance.clone()
            }
        })
        .collect();
    scene.instances.extend(twins);
    scene
}

#[test]
fn pictures_are_the_same_to_the_bit_with_every_index() {
    with_gpu(|gpu| {
        let city = builtin("builtin:box-city?n=60");
        let glass = builtin("builtin:cornell-box?sphere=glass");
        for (what, scene) in [("city", &city), ("glass sphere", &glass), ("doubled", &doubled())] {
            let mut first: Option<(Vec<u32>, f64)> = None;
            for name in IndexKind::NAMES {
                let kind: IndexKind = name.parse().unwrap();
                // The city's boxes are instances, which two levels keep, with vertices that are elsewhere by rounding (tests/tests/accel/instances.rs).
                if what == "city" && name == "two-level" {
                    continue;
                }
                if !kind.is_offered_by(gpu.caps()) {
                    println!("{what}: not supported: {name}");
                    continue;
                }
                let rendered = render(gpu, scene, &kind).unwrap();
                let index = rendered.report.index;
                assert_eq!(index.kind, name);
                // What its tree is like the driver does not say.
                let is_known = index.statistics.leaves > 0 && index.statistics.sah_cost > 0.0;
                assert!(
                    index.build_ms > 0.0 && is_known == (kind != IndexKind::Driver),
                    "{index:?}"
                );
                let bits = bits(&rendered);
                assert!(
                    bits.iter().filter(|b| **b != 0).count() > bits.len() / 4,
                    "{what}: empty"
                );
                let (truth, sah_cost) = first.get_or_insert_with(|| (bits.clone(), index.statistics.sah_cost));
                assert!(*truth == bits, "{what}: the picture differs with {name}");
                // Of few triangles the optimised tree is the binned one.
                assert!(
                    !["lbvh", "lbvh-device", "kd"].contains(&name) || *sah_cost != index.statistics.sah_cost,
                    "{what}: {name} is the same tree"
                );
            }
        }
    });
}

/// Surfaces that let half of the light through.
fn thin(address: &str) -> Scene {
    let mut scene = builtin(address);
    for material in scene.materials.iter_mut().filter(|material| !material.boundary) {
        material.base_color.w = 0.5;
        material.alpha_mode = AlphaMode::Blend;
    }
    scene
}

/// Pictures in an index against those in the binary one; rays of the scenes that are named stop at the small quota, and only there.
fn pictures_stay_the_same(gpu: &Gpu, index: &IndexKind, scenes: &[(&str, Scene)], stopping: &[&str]) {
    let of = |scene: &Scene, index: &IndexKind, ray_quota| {
        let settings = PathTracerSettings {
            ray_quota,
            ..PathTracerSettings::default()
        };
        let scene_there = Arc::new(GpuScene::with_index(gpu, scene, index).unwrap());
        let mut tracer = PathTracer::new(gpu, scene_there, &scene.cameras[0], [24, 16], settings).unwrap();
        finish(&mut tracer, 2)
    };
    for (what, scene) in scenes {
        let truth = of(scene, &IndexKind::Bvh2(Bvh2Settings::default()), 32_768);
        assert!(truth.mean()[0].0 > 0.0, "{what}: dark");
        for ray_quota in [32_768, SMALL_QUOTA] {
            let picture = of(scene, index, ray_quota);
            assert_eq!(picture.bits(), truth.bits(), "{what}, quota {ray_quota}");
            let stalls = picture.counters.stalls;
            assert!(
                !stopping.contains(what) || (stalls > 0) == (ray_quota == SMALL_QUOTA),
                "{what}, quota {ray_quota}: {stalls} stalls"
            );
        }
    }
}

#[test]
fn alpha_media_and_quotas_leave_pictures_of_kd_trees_the_same() {
    with_gpu(|gpu| {
        let scenes = [
            ("city", builtin("builtin:box-city?n=60")),
            ("thin city", thin("builtin:box-city?n=60")),
            ("smoke", builtin("builtin:smoke")),
            ("smoke between thin walls", thin("builtin:smoke")),
        ];
        let kd = IndexKind::Kd(KdSettings::default());
        pictures_stay_the_same(gpu, &kd, &scenes, &["city", "thin city"]);
    });
}

#[test]
fn alpha_media_and_quotas_leave_pictures_of_wide_trees_the_same() {
    with_gpu(|gpu| {
        let soup = "builtin:triangle-soup?n=5000&size=0.3";
        let scenes = [
            ("soup", builtin(soup)),
            ("thin soup", thin(soup)),
            ("smoke between thin walls", thin("builtin:smoke")),
        ];
        let wide = IndexKind::Wide(WideSettings::default());
        pictures_stay_the_same(gpu, &wide, &scenes, &["soup", "thin soup"]);
    });
}

#[test]
fn alpha_and_media_leave_pictures_by_the_drivers_structure_the_same() {
    with_gpu(|gpu| {
        if !IndexKind::Driver.is_offered_by(gpu.caps()) {
            println!("not supported: VK_KHR_ray_query");
            return;
        }
        // So far away that camera rays try all triangles, and stop.
        let mut far = thin("builtin:box-city?n=60");
        let [lower, upper] = GpuScene::new(gpu, &far).unwrap().bounds();
        let away = 2.0 * DRIVER_REACH;
        let camera = &mut far.cameras[0];
        let back = camera.transform.matrix3.z_axis;
        camera.transform.translation += f64::from(away * (upper - lower).max_element()) * back;
        camera.projection = Projection::Perspective { fov_y: 1.0 / away };
        let scenes = [
            ("thin city", thin("builtin:box-city?n=60")),
            ("smoke", builtin("builtin:smoke")),
            ("smoke between thin walls", thin("builtin:smoke")),
            ("far away", far),
        ];
        pictures_stay_the_same(gpu, &IndexKind::Driver, &scenes, &["far away"]);
    });
}

#[test]
fn what_the_device_cannot_build_the_host_does_and_says_so() {
    with_gpu(|gpu| {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let two = [triangle, triangle.map(|v| v + Vec3::Z)];
        for name in ["lbvh-device", "wide-device"] {
            let kind: IndexKind = name.parse().unwrap();
            let report = kind.build_for(gpu, &two).unwrap().report;
            assert_eq!((report.kind, report.host_because), (name, None));
            for few in [&two[..0], &two[..1], &[[Vec3::NAN; 3], triangle]] {
                let built = kind.build_for(gpu, few).unwrap();
                let report = built.report;
                let host = kind.build(few).unwrap();
                assert!(
                    report
                        .host_because
                        .is_some_and(|cause| cause.contains("fewer than two"))
                );
                assert_eq!(report.statistics, host.statistics());
                let there: Vec<[u32; 4]> = gpu.read(built.texels.buffer().view(), host.texels().len()).unwrap();
                assert!(there == host.texels());
            }
        }
    });
}

#[test]
fn leaves_that_software_devices_cannot_end_are_those_of_another_index_which_says_so() {
    with_gpu(|gpu| {
        // In one place, so that no plane parts them.
        let mut scene = builtin("builtin:cornell-box");
        let mut heap = scene.meshes[0].clone();
        heap.triangles = vec![heap.triangles[0]; 20_000];
        scene.place(heap);
        let truth = render(gpu, &scene, &IndexKind::default()).unwrap();
        assert_eq!(truth.report.index.instead_because, None);
        let rendered = render(gpu, &scene, &IndexKind::Kd(KdSettings::default())).unwrap();
        assert!(bits(&rendered) == bits(&truth));
        let (kind, because) = (rendered.report.index.kind, rendered.report.index.instead_because);
        if gpu.caps().kind == DeviceKind::Cpu {
            assert!(
                kind == "bvh2" && because.is_some_and(|cause| cause.contains("leaf")),
                "{kind}"
            );
        } else {
            assert_eq!((kind, because), ("kd", None));
        }
    });
}

#[test]
fn settings_of_the_index_that_are_out_of_range_are_refused() {
    with_gpu(|gpu| {
        let index = IndexKind::Bvh2(Bvh2Settings { leaf_size: 9, bins: 16 });
        let refused = Renderer::with(gpu, &builtin("builtin:cornell-box"), &with(index));
        assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
    });
}
