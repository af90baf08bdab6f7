//! Objects that move: as if the scene had been made so, left out of their own maps, to the same bits each time; and what is refused.

use clerestory::Error;
use clerestory::gpu::Gpu;
use clerestory::raster::{SHADOW_MAPS_MAX, SHADOW_WIDTH_MAX, ShadowLayout};
use clerestory::scene::{Camera, LightKind, Material, Scene};
use clerestory::techniques::preview::{
    LightProbe, LightProbeDesc, LiveProbe, PARTS_MAX, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap,
};
use clerestory::transport::GpuScene;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::subject::sphere;

const LIGHT: Vec3 = Vec3::new(-0.6, 0.7, 0.5);
const DESC: PreviewDesc = PreviewDesc {
    size: [40, 30],
    samples: 2,
    lights: 2,
    shadows: Some(PreviewShadows {
        layout: ShadowLayout::Octahedron,
        side: 64,
        width: 1,
        suns: 0,
    }),
    probes: Some(ProbeMap::Octahedron),
};

/// A closed room with a block and, last, a mirror that moves.
fn scene(transform: DAffine3) -> (Scene, u32) {
    let mut scene = builtin("builtin:furnace-box?emission=0.05");
    let matte = scene.add_material(Material::lambert("block", Vec3::new(0.8, 0.3, 0.2)));
    scene.place(clerestory_hard_cases::scenes::cuboid(
        "block",
        matte,
        Vec3::new(-0.9, -1.0, -0.9),
        Vec3::new(-0.4, -0.2, -0.4),
    ));
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::splat(0.9)));
    scene.place(sphere("moving", mirror, Vec3::ZERO, 0.25, 24));
    let moving = scene.instances.len() - 1;
    scene.instances[moving].transform = transform;
    scene.cameras = vec![Camera::look_at(
        "main",
        DVec3::new(0.5, 0.4, 0.9),
        DVec3::new(-0.2, -0.3, -0.3),
        DVec3::Y,
        1.2,
    )];
    (scene, moving as u32)
}

fn placed(offset: f64) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 0.8, 1.2),
        DQuat::from_rotation_y(2.0 * offset),
        DVec3::new(offset, -0.3, 0.1),
    )
}

/// One frame: shadows, the map about the object without it, the picture; its bits.
fn frame(
    gpu: &Gpu,
    on_device: &GpuScene,
    scene: &Scene,
    moving: u32,
    place: DAffine3,
    without: bool,
) -> (Vec<u32>, Vec<u32>) {
    let mut preview = Preview::new(gpu, on_device, DESC).unwrap();
    let desc = LightProbeDesc {
        map: ProbeMap::Octahedron,
        side: 64,
        finest: 32,
    };
    let live = LiveProbe::new(gpu, on_device, &preview, desc, false).unwrap();
    let surfaces = on_device.surfaces();
    let others = if without { surfaces.before(moving) } else { surfaces };
    let lights = [LightKind::Point {
        position: LIGHT,
        intensity: Vec3::splat(0.8),
    }];
    let mut recorder = gpu.recorder("frame").unwrap();
    preview.record_lights(&mut recorder, &surfaces, &lights).unwrap();
    let middle = place.translation.as_vec3();
    live.record(&mut recorder, on_device, &others, &preview, middle, None)
        .unwrap();
    let object = surfaces.triangles_of(moving);
    let parts = [
        PreviewPart {
            triangles: 0..object.start,
            background: true,
            probe: None,
        },
        PreviewPart {
            triangles: object,
            background: false,
            probe: Some(live.probe()),
        },
    ];
    preview
        .record(&mut recorder, on_device, &surfaces, &scene.cameras[0], &parts)
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let picture = preview.picture().unwrap();
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let map = live.probe().filtered().read(0).unwrap();
    let texels: Vec<f32> = map.texels().iter().flat_map(|texel| texel.to_array()).collect();
    (bits(picture.main_layer().unwrap().values()), bits(&texels))
}

#[test]
fn moved_objects_are_as_if_made_there() {
    with_gpu(|gpu| {
        let (start, moving) = scene(placed(-0.4));
        let on_device = GpuScene::new(gpu, &start).unwrap();
        let before = frame(gpu, &on_device, &start, moving, placed(-0.4), true);
        let twice = frame(gpu, &on_device, &start, moving, placed(-0.4), true);
        assert!(before == twice, "the same frame twice has the same bits");
        on_device
            .move_object(gpu, &start, moving as usize, placed(0.3))
            .unwrap();
        let moved = frame(gpu, &on_device, &start, moving, placed(0.3), true);
        let (anew, _) = scene(placed(0.3));
        let made = GpuScene::new(gpu, &anew).unwrap();
        let expected = frame(gpu, &made, &anew, moving, placed(0.3), true);
        assert!(moved == expected, "moved and made there: the same bits");
        assert!(moved.0 != before.0 && moved.1 != before.1, "it has moved");
        on_device
            .move_object(gpu, &start, moving as usize, placed(-0.4))
            .unwrap();
        let back = frame(gpu, &on_device, &start, moving, placed(-0.4), true);
        assert!(back == before, "and back");
        // Every value is finite, and none is negative.
        let sound = |bits: &[u32]| bits.iter().all(|b| (0.0..f32::INFINITY).contains(&f32::from_bits(*b)));
        assert!(sound(&moved.0) && sound(&moved.1));
    });
}

/// From inside the object its own map would show nothing but itself.
#[test]
fn objects_are_left_out_of_their_own_maps() {
    with_gpu(|gpu| {
        let (whole, moving) = scene(placed(0.1));
        let on_device = GpuScene::new(gpu, &whole).unwrap();
        let (_, without) = frame(gpu, &on_device, &whole, moving, placed(0.1), true);
        let (_, with) = frame(gpu, &on_device, &whole, moving, placed(0.1), false);
        // The mirror's inside, without a probe, is black; the walls shine, and of the block some is in shadow.
        let dark = |bits: &[u32]| bits.iter().filter(|b| **b == 0).count();
        assert_eq!(dark(&with), with.len());
        assert!(dark(&without) < without.len() / 10, "{}", dark(&without));
    });
}

#[test]
fn mistakes_are_refused() {
    with_gpu(|gpu| {
        let (whole, moving) = scene(placed(0.0));
        let on_device = GpuScene::new(gpu, &whole).unwrap();
        let refused =
            |object: usize, place: DAffine3, words: &str| match on_device.move_object(gpu, &whole, object, place) {
                Err(Error::Setting { cause, .. }) => assert!(cause.contains(words), "{cause}"),
                other => panic!("{words}: {other:?}"),
            };
        let moving = moving as usize;
        refused(99, placed(0.0), "does not exist");
        refused(0, placed(0.0), "emits light");
        refused(moving, placed(f64::NAN), "not finite");
        refused(moving, placed(3.0), "leave the box");
        refused(moving, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)), "mirrored");
        let fog = builtin("builtin:fog-box");
        let in_fog = GpuScene::new(gpu, &fog).unwrap();
        assert!(matches!(
            Preview::new(gpu, &in_fog, DESC),
            Err(Error::Unsupported { .. })
        ));
        for wrong in [
            PreviewDesc { samples: 0, ..DESC },
            PreviewDesc { samples: 9, ..DESC },
            PreviewDesc { lights: 4096, ..DESC },
            PreviewDesc { size: [0, 4], ..DESC },
            PreviewDesc {
                lights: SHADOW_MAPS_MAX + 1,
                ..DESC
            },
        ] {
            assert!(Preview::new(gpu, &on_device, wrong).is_err(), "{wrong:?}");
        }
        // Filters wider than is known of or than the map.
        for (side, width) in [(64, SHADOW_WIDTH_MAX + 1), (2, 3), (64, u32::MAX)] {
            let shadows = PreviewShadows {
                layout: ShadowLayout::Cube,
                side,
                width,
                suns: 0,
            };
            let wrong = PreviewDesc {
                shadows: Some(shadows),
                ..DESC
            };
            let refused = Preview::new(gpu, &on_device, wrong).map(|_| ());
            assert!(
                matches!(&refused, Err(Error::Setting { name, .. }) if name == "shadow width"),
                "{wrong:?}: {refused:?}"
            );
        }
        let mut preview = Preview::new(gpu, &on_device, DESC).unwrap();
        let surfaces = on_device.surfaces();
        let mut recorder = gpu.recorder("mistakes").unwrap();
        let sun = LightKind::Directional {
            direction: -Vec3::Y,
            irradiance: Vec3::ONE,
        };
        assert!(preview.record_lights(&mut recorder, &surfaces, &[sun; 3]).is_err());
        let bent = LightKind::Directional {
            direction: Vec3::ONE,
            irradiance: Vec3::ONE,
        };
        assert!(preview.record_lights(&mut recorder, &surfaces, &[bent]).is_err());
        let part = PreviewPart {
            triangles: 0..1,
            background: true,
            probe: None,
        };
        let many = vec![part.clone(); PARTS_MAX + 1];
        let camera = &whole.cameras[0];
        assert!(
            preview
                .record(&mut recorder, &on_device, &surfaces, camera, &many)
                .is_err()
        );
        let probeless = Preview::new(gpu, &on_device, PreviewDesc { probes: None, ..DESC }).unwrap();
        let probe = LightProbe::new(gpu, LightProbeDesc::default()).unwrap();
        let lit = PreviewPart {
            probe: Some(&probe),
            ..part
        };
        assert!(
            probeless
                .record(&mut recorder, &on_device, &surfaces, camera, &[lit])
                .is_err()
        );
    });
}

/// What is not asked for costs nothing: no shadow maps without lights that have a place, or directional ones of which a host wants them.
#[test]
fn passes_are_those_that_are_needed() {
    with_gpu(|gpu| {
        let (whole, _) = scene(placed(0.0));
        let on_device = GpuScene::new(gpu, &whole).unwrap();
        let surfaces = on_device.surfaces();
        let names = |shadows: Option<PreviewShadows>, lights: &[LightKind]| {
            let desc = PreviewDesc {
                shadows,
                probes: None,
                ..DESC
            };
            let mut preview = Preview::new(gpu, &on_device, desc).unwrap();
            let mut recorder = gpu.recorder("passes").unwrap();
            preview.record_lights(&mut recorder, &surfaces, lights).unwrap();
            let part = PreviewPart {
                triangles: 0..surfaces.triangles,
                background: true,
                probe: None,
            };
            preview
                .record(&mut recorder, &on_device, &surfaces, &whole.cameras[0], &[part])
                .unwrap();
            let passes = recorder.submit().unwrap().wait().unwrap().passes;
            (
                passes.into_iter().map(|pass| pass.name).collect::<Vec<_>>().join(", "),
                preview.bytes(),
            )
        };
        let point = LightKind::Point {
            position: LIGHT,
            intensity: Vec3::ONE,
        };
        let sun = LightKind::Directional {
            direction: -Vec3::Y,
            irradiance: Vec3::ONE,
        };
        let bare = "preview: lights, raster: surfaces, preview: shade";
        let shadows = DESC.shadows;
        let shadowed = "preview: lights, raster: surfaces, shadow maps: distances, raster: surfaces, preview: shade";
        let (plain, bytes) = names(None, &[point]);
        assert_eq!(plain, bare);
        // Depth, triangle, two weights and radiance of each sample.
        assert_eq!(bytes, 80 * 60 * (4 + 4 + 8 + 12));
        assert_eq!(names(shadows, &[sun]).0, bare);
        // A map of the first of two suns, of which a host asked for one.
        let with_sun = shadows.map(|shadows| PreviewShadows { suns: 1, ..shadows });
        let of_sun =
            "preview: lights, raster: surfaces, shadow maps of views: distances, raster: surfaces, preview: shade";
        assert_eq!(names(with_sun, &[sun, sun]).0, of_sun);
        let (with, more) = names(shadows, &[sun, point]);
        assert_eq!(with, shadowed);
        // Depth and distance of the picture, and two maps.
        assert_eq!(more - bytes, 64 * 64 * (4 + 4) + 2 * 64 * 64 * 4);
    });
}
