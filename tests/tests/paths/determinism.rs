//! Same scene, settings, seed and driver: the same bits, however the work is cut up and whoever does it.

use clerestory::gpu::Gpu;
use clerestory::render::spectral::{SpectralMetal, render_spectral};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::metals::bins::Bins;
use clerestory::scene::{
    Camera, Distribution, Environment, FresnelForm, Geometry, LightKind, Material, Mesh, Microfacets, Scene,
    SceneProfile, metals,
};
use clerestory::techniques::{self, PathTracerSettings};
use clerestory::transport::random::SamplerKind;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::random::Random;
use clerestory_tests::render::{Rendered, builtin, finish, quad, render, tracer};
use clerestory_tests::{gpu, with_gpu};
use glam::{DVec3, Vec3};

const SIZE: [u32; 2] = [24, 16];
const SAMPLES: u32 = 12;
/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH";
const CHILD_TEST: &str = "determinism::prints_its_hash_when_asked";
/// The same of pictures of metals.
const CHILD_OF_METALS: &str = "CLERESTORY_TEST_PRINT_HASH_OF_METALS";
const CHILD_TEST_OF_METALS: &str = "determinism::prints_its_hash_of_metals_when_asked";

fn scene() -> Scene {
    builtin("builtin:cornell-box")
}

fn picture(gpu: &Gpu, settings: &PathTracerSettings) -> Rendered {
    render(gpu, &scene(), SIZE, SAMPLES, settings)
}

#[test]
fn how_the_work_is_cut_up_never_shows() {
    with_gpu(|gpu| {
        let settings = PathTracerSettings::default();
        let truth = picture(gpu, &settings);
        assert!(truth.mean()[0].0 > 0.01);
        assert_eq!(picture(gpu, &settings).bits(), truth.bits(), "two runs");
        // Fewer paths than pixels, an odd number, several samples per wave.
        for paths_in_flight in [64, 200, 1000, 4096] {
            let split = picture(
                gpu,
                &PathTracerSettings {
                    paths_in_flight,
                    ..settings.clone()
                },
            );
            assert_eq!(split.bits(), truth.bits(), "{paths_in_flight} paths in flight");
            assert_eq!(
                split.counters.extend_rays, truth.counters.extend_rays,
                "{paths_in_flight}"
            );
            assert_eq!(
                split.counters.shadow_rays, truth.counters.shadow_rays,
                "{paths_in_flight}"
            );
        }
        // Stopped and gone on with, one step at a time, with the picture read in between.
        let mut steps = tracer(gpu, &scene(), SIZE, &settings);
        for samples in [1, 2, 5, 6, SAMPLES] {
            steps.render(samples).unwrap();
            steps.picture().unwrap();
        }
        assert_eq!(finish(&mut steps, SAMPLES).bits(), truth.bits(), "in steps");
        // A camera set anew begins anew.
        steps.set_camera(&scene().cameras[0]).unwrap();
        assert_eq!(finish(&mut steps, SAMPLES).bits(), truth.bits(), "after set_camera");
        let seen = picture(
            gpu,
            &PathTracerSettings {
                aovs: true,
                ..settings.clone()
            },
        );
        assert_eq!(seen.bits(), truth.bits(), "with AOVs");
        for other in [
            PathTracerSettings {
                seed: 1,
                ..settings.clone()
            },
            PathTracerSettings {
                sampler: SamplerKind::Pcg,
                ..settings
            },
        ] {
            assert_ne!(
                picture(gpu, &other).bits(),
                truth.bits(),
                "another seed or sampler is another picture"
            );
        }
    });
}

#[test]
fn every_technique_gives_the_same_bits_again() {
    with_gpu(|gpu| {
        // A scene for each of them, in the order of how much is in it.
        let scenes = [
            "builtin:cornell-box",
            "builtin:cornell-box?source=point",
            "builtin:triangle-soup?n=300",
        ]
        .map(builtin);
        for card in techniques::all() {
            let can = |scene: &&Scene| (card.refusals)(&SceneProfile::of(scene)).is_empty();
            let scene = scenes.iter().find(can);
            let scene = scene.unwrap_or_else(|| panic!("`scenes` needs one that `{}` can render", card.id));
            let bits = || -> Vec<u32> {
                let options = RenderOptions {
                    technique: Some(card.id.into()),
                    size: SIZE,
                    spp: 2,
                    seed: 3,
                    ..RenderOptions::default()
                };
                let rendered = Renderer::new(gpu, scene).and_then(|renderer| renderer.render(&options));
                let picture = rendered.unwrap_or_else(|error| panic!("{}: {error}", card.id)).picture;
                let radiance = picture.layer("radiance").expect("layer");
                radiance.values().iter().map(|value| value.to_bits()).collect()
            };
            let first = bits();
            assert!(first.iter().any(|bits| f32::from_bits(*bits) > 0.0), "{}", card.id);
            assert!(first == bits(), "{}", card.id);
        }
    });
}

#[test]
fn rays_that_a_quota_stops_go_on_where_they_were() {
    with_gpu(|gpu| {
        // Long traversals: large triangles through each other, whose boxes nearly all hold each ray.
        let mut random = Random(3);
        let mut scene = Scene::default();
        let material = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
        scene.place(Mesh {
            positions: (0..3 * 600).map(|_| random.vector()).collect(),
            triangles: (0..600).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material: Some(material),
            ..Mesh::default()
        });
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.cameras = builtin("builtin:white-furnace").cameras;
        let of = |ray_quota| {
            let settings = PathTracerSettings {
                ray_quota,
                ..PathTracerSettings::default()
            };
            render(gpu, &scene, SIZE, 2, &settings)
        };
        let (whole, stopped) = (of(32_768), of(128));
        assert_eq!(whole.counters.stalls, 0);
        assert!(stopped.counters.stalls > 0, "{:?}", stopped.counters);
        assert_eq!(stopped.bits(), whole.bits());
        assert_eq!(stopped.counters.extend_rays, whole.counters.extend_rays);
        assert_eq!(stopped.counters.shadow_rays, whole.counters.shadow_rays);
        assert!(whole.mean()[0].0 > 0.0);
    });
}

#[test]
fn threads_of_the_driver_and_of_the_host_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "1")]);
    for variables in [
        &[("LP_NUM_THREADS", "0")][..],
        &[("LP_NUM_THREADS", "2")],
        &[("LP_NUM_THREADS", "2"), ("RAYON_NUM_THREADS", "1")],
        &[("RAYON_NUM_THREADS", "5")],
    ] {
        assert_eq!(hash(variables), truth, "{variables:?}");
    }
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let settings = PathTracerSettings {
        paths_in_flight: 1024,
        ..PathTracerSettings::default()
    };
    println!("hash {:016x}", picture(&gpu, &settings).hash());
    clerestory_tests::assert_no_messages(&gpu);
}

/// Plates of rough gold side by side under a sky and a lamp: one for each form of its factor, and two of classical microfacets.
fn plates() -> (Scene, Vec<SpectralMetal>) {
    const WIDTH: f32 = 0.7;
    let gold = metals::spectrum("gold").unwrap();
    let classical = [
        (Distribution::Beckmann, Geometry::CookTorrance),
        (Distribution::CosineLobe, Geometry::Simplified),
    ]
    .map(|(distribution, geometry)| Some(Microfacets { distribution, geometry }));
    let kinds = FresnelForm::ALL
        .map(|form| (form, None))
        .into_iter()
        .chain(classical.map(|microfacets| (FresnelForm::Exact, microfacets)));
    let mut scene = Scene::default();
    let mut spectral = Vec::new();
    for (place, (fresnel, classic_microfacets)) in (0u8..).zip(kinds) {
        let material = scene.add_material(Material {
            roughness: 0.4,
            conductor: Some(gold.channels()),
            fresnel,
            classic_microfacets,
            ..Material::mirror("gold", Vec3::ONE)
        });
        let at = |x: f32, z: f32| Vec3::new(WIDTH * (f32::from(place) + x - 5.0), 0.0, z);
        scene.place(quad(
            "plate",
            material,
            [at(0.0, -1.0), at(0.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)],
        ));
        spectral.push(SpectralMetal {
            material,
            spectrum: gold.clone(),
        });
    }
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: Vec3::new(0.0, 1.5, -0.5),
            intensity: Vec3::splat(3.0),
        },
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 5.0, 6.0),
        DVec3::ZERO,
        DVec3::Y,
        0.6,
    ));
    (scene, spectral)
}

/// Every form of the factor, classical microfacets, and bins of wavelengths.
#[test]
fn threads_of_the_driver_never_show_on_metals() {
    let hash = |threads| hash_in_child(CHILD_TEST_OF_METALS, CHILD_OF_METALS, &[("LP_NUM_THREADS", threads)]);
    assert_eq!(hash("2"), hash("1"));
}

#[test]
fn prints_its_hash_of_metals_when_asked() {
    if std::env::var_os(CHILD_OF_METALS).is_none() {
        return;
    }
    with_gpu(|gpu| {
        let (scene, spectral) = plates();
        let options = RenderOptions {
            size: SIZE,
            spp: 2,
            seed: 3,
            ..RenderOptions::default()
        };
        let channels = Renderer::new(gpu, &scene)
            .and_then(|renderer| renderer.render(&options))
            .unwrap();
        let bins = render_spectral(gpu, &scene, &spectral, &Bins::new(8).unwrap(), &options).unwrap();
        let bits = [&channels.picture, &bins.picture].map(|picture| -> Vec<u32> {
            let values = picture.require("radiance").unwrap().values();
            assert!(values.iter().any(|value| *value > 0.1));
            values.iter().map(|value| value.to_bits()).collect()
        });
        assert!(bits[0] != bits[1]);
        print_hash(bits.concat());
    });
}
