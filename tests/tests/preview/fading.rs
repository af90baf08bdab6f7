//! Maps that are drawn now and then and fade from one to the next: pictures of a mirror that shows them.

use clerestory::gpu::Gpu;
use clerestory::scene::{Camera, Material, Scene};
use clerestory::techniques::preview::{
    FadingProbe, LightProbeDesc, Preview, PreviewDesc, PreviewPart, ProbeMap, Refresh, RefreshStep,
};
use clerestory::transport::GpuScene;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

use crate::live::room;
use crate::subject::sphere;

const SIZE: u32 = 24;
const DESC: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Octahedron,
    side: 64,
    finest: 32,
};

/// Of a cube, with half as many texels along a side.
const CUBE: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Cube,
    side: 32,
    finest: 16,
};

/// A closed room of bright walls and, last, a mirror in its middle.
fn scene() -> (Scene, u32) {
    let (mut scene, _) = room();
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::splat(0.9)));
    scene.place(sphere("mirror", mirror, Vec3::ZERO, 0.4, 24));
    scene.cameras = vec![Camera::look_at(
        "main",
        DVec3::new(0.6, 0.3, 0.7),
        DVec3::ZERO,
        DVec3::Y,
        0.9,
    )];
    let object = scene.instances.len() as u32 - 1;
    (scene, object)
}

/// A frame of each: what it does, the picture of the mirror, and its passes.
struct Shown {
    step: RefreshStep,
    values: Vec<f32>,
    passes: Vec<String>,
}

/// Frames whose maps are drawn from the places that `place` gives.
fn frames(gpu: &Gpu, map: LightProbeDesc, refresh: Refresh, count: u64, place: impl Fn(u64) -> Vec3) -> Vec<Shown> {
    let (scene, object) = scene();
    let on_device = GpuScene::new(gpu, &scene).unwrap();
    let desc = PreviewDesc {
        size: [SIZE; 2],
        samples: 1,
        lights: 0,
        shadows: None,
        probes: Some(map.map),
    };
    let preview = Preview::new(gpu, &on_device, desc).unwrap();
    let mut probe = FadingProbe::new(gpu, &on_device, &preview, (map, false), refresh).unwrap();
    let surfaces = on_device.surfaces();
    let others = surfaces.before(object);
    let frame = |number: u64| {
        let mut recorder = gpu.recorder("frame").unwrap();
        assert_eq!(probe.frames(), number);
        let step = probe
            .record(&mut recorder, &on_device, &others, &preview, place(number), None)
            .unwrap();
        let parts = [
            PreviewPart {
                triangles: 0..surfaces.triangles_of(object).start,
                background: true,
                probe: None,
            },
            PreviewPart {
                triangles: surfaces.triangles_of(object),
                background: false,
                probe: Some(probe.probe()),
            },
        ];
        preview
            .record(&mut recorder, &on_device, &surfaces, &scene.cameras[0], &parts)
            .unwrap();
        let passes = recorder.submit().unwrap().wait().unwrap().passes;
        Shown {
            step,
            values: preview.picture().unwrap().main_layer().unwrap().values().to_vec(),
            passes: passes.into_iter().map(|pass| pass.name).collect(),
        }
    };
    (0..count).map(frame).collect()
}

/// Values of frames over a map's refresh and its fade.
pub fn faded_values(gpu: &Gpu) -> Vec<f32> {
    let place = |frame: u64| Vec3::new(if frame < 2 { -0.5 } else { 0.5 }, 0.1, 0.0);
    let shown = frames(gpu, DESC, Refresh { period: 2, fade: 2 }, 4, place);
    shown.into_iter().flat_map(|frame| frame.values).collect()
}

/// The greatest difference of two pictures' values.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn a_scene_at_rest_shows_no_change() {
    with_gpu(|gpu| {
        for (map, refresh) in [
            (DESC, Refresh { period: 4, fade: 3 }),
            (DESC, Refresh { period: 2, fade: 2 }),
            (DESC, Refresh { period: 3, fade: 1 }),
            (CUBE, Refresh { period: 4, fade: 3 }),
        ] {
            let shown = frames(gpu, map, refresh, 9, |_| Vec3::new(0.1, -0.2, 0.05));
            assert!(shown[0].values.iter().any(|value| *value > 0.1));
            for (number, frame) in shown.iter().enumerate() {
                let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert!(
                    bits(&frame.values) == bits(&shown[0].values),
                    "{map:?}, {refresh:?}, frame {number}"
                );
            }
        }
    });
}

/// The places from which the scene is drawn are far apart, so that a map that is shown at once is seen to be; and what is not due costs no pass.
#[test]
fn pictures_go_over_in_even_steps() {
    with_gpu(|gpu| {
        for map in [DESC, CUBE] {
            goes_over_in_even_steps(gpu, map);
        }
    });
}

fn goes_over_in_even_steps(gpu: &Gpu, map: LightProbeDesc) {
    let place = |frame: u64| Vec3::new(if frame < 4 { -0.5 } else { 0.5 }, 0.1, 0.0);
    let at_once = frames(gpu, map, Refresh { period: 4, fade: 1 }, 8, place);
    let faded = frames(gpu, map, Refresh { period: 4, fade: 3 }, 8, place);
    let (before, after) = (&at_once[3].values, &at_once[4].values);
    let jump = difference(before, after);
    assert!(jump > 0.2, "{jump}");
    for (number, frame) in faded.iter().enumerate() {
        let [old, new] = frame.step.weights;
        assert_eq!(old + new, 1.0);
        let [old, new] = if number < 4 { [1.0, 0.0] } else { [old, new] };
        let expected: Vec<f32> = before.iter().zip(after).map(|(a, b)| old * a + new * b).collect();
        let off = difference(&frame.values, &expected);
        assert!(off < 2e-6, "frame {number}: {off}");
        if number > 0 {
            let step = difference(&frame.values, &faded[number - 1].values);
            assert!(step < jump / 3.0 + 2e-6, "frame {number}: {step} of {jump}");
        }
        let has = |name: &str| frame.passes.iter().any(|pass| pass == name);
        assert_eq!(
            has("preview: shade live map"),
            number % 4 == 0,
            "{number}: {:?}",
            frame.passes
        );
        // The last of a fade's frames changes places.
        assert_eq!(
            has("probe: fade"),
            [4, 5].contains(&number),
            "{number}: {:?}",
            frame.passes
        );
    }
    // From the end of the fade on it is the new map, to the bit.
    assert!(faded[6].values == *after && faded[7].values == *after);
    assert!(
        !at_once
            .iter()
            .any(|frame| frame.passes.iter().any(|pass| pass == "probe: fade"))
    );
}

#[test]
fn refreshes_that_cannot_be_are_refused() {
    with_gpu(|gpu| {
        let (scene, _) = scene();
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let desc = PreviewDesc {
            size: [8; 2],
            samples: 1,
            lights: 0,
            shadows: None,
            probes: Some(ProbeMap::Octahedron),
        };
        let preview = Preview::new(gpu, &on_device, desc).unwrap();
        for (period, fade, words) in [
            (0, 1, "setting period: 0"),
            (4, 0, "setting fade: 0"),
            (4, 5, "setting fade: 5"),
        ] {
            let error =
                FadingProbe::new(gpu, &on_device, &preview, (DESC, false), Refresh { period, fade }).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
        let mut probe = FadingProbe::new(gpu, &on_device, &preview, (DESC, false), Refresh::default()).unwrap();
        // A frame that is refused is none.
        let mut recorder = gpu.recorder("refused").unwrap();
        let refused = probe.record(
            &mut recorder,
            &on_device,
            &on_device.surfaces(),
            &preview,
            Vec3::NAN,
            None,
        );
        assert!(refused.is_err() && probe.frames() == 0);
    });
}
