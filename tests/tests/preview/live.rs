//! Live maps: irradiance in a closed room against rays, reflections at the map's middle against rays, and parallax beside it.

use clerestory::Error;
use clerestory::film::PixelFormat;
use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::raster::ShadowLayout;
use clerestory::scene::{Camera, Material, Mesh, Scene};
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap,
};
use clerestory::transport::GpuScene;
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3, Vec4};

use crate::subject::Subject;

/// A closed room [-1, 1]³ of six black faces, each with a radiance of its own.
pub fn room() -> (Scene, [Vec3; 6]) {
    let colors = [
        Vec3::new(1.0, 0.2, 0.1),
        Vec3::new(0.2, 0.9, 0.3),
        Vec3::new(0.8, 0.8, 1.0),
        Vec3::new(0.1, 0.1, 0.15),
        Vec3::new(0.9, 0.7, 0.2),
        Vec3::new(0.2, 0.4, 0.9),
    ];
    let mut scene = Scene::default();
    for (face, color) in colors.iter().enumerate() {
        let mut material = Material::lambert(format!("face {face}"), Vec3::ZERO);
        material.emission = *color;
        let material = scene.add_material(material);
        let axis = face / 2;
        let side = if face % 2 == 0 { 1.0 } else { -1.0 };
        let corner = |u: f32, v: f32| {
            let mut p = Vec3::ZERO;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
            p
        };
        scene.place(Mesh {
            name: format!("face {face}"),
            positions: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: Some(material),
            ..Mesh::default()
        });
    }
    (scene, colors)
}

/// The face that a ray from inside meets: that of the nearest plane.
pub fn face(from: DVec3, direction: DVec3) -> (usize, f64) {
    let (mut nearest, mut found) = (f64::INFINITY, 0);
    for axis in 0..3 {
        let side = if direction[axis] < 0.0 { -1.0 } else { 1.0 };
        let t = (side - from[axis]) / direction[axis];
        if t < nearest {
            (nearest, found) = (t, 2 * axis + usize::from(side < 0.0));
        }
    }
    (found, nearest)
}

/// Whether another face begins within the texels that a look-up in a map of that side takes: they are no wider than 4.3 / side either way.
pub fn is_at_edge(from: DVec3, direction: DVec3, side: u32) -> bool {
    let reach = 2.0 * 4.3 / f64::from(side);
    let (x, y) = direction.any_orthonormal_pair();
    (0..16).any(|i| {
        let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 16.0).sin_cos();
        let near = (direction + reach * (cosine * x + sine * y)).normalize();
        face(from, near).0 != face(from, direction).0
    })
}

pub fn live(gpu: &Gpu, subject: &Subject, desc: LightProbeDesc, place: Vec3) -> LiveProbe {
    let scene = &subject.on_device;
    let preview = Preview::new(
        gpu,
        scene,
        PreviewDesc {
            size: [8, 8],
            samples: 1,
            lights: 0,
            shadows: None,
            probes: None,
        },
    )
    .unwrap();
    let live = LiveProbe::new(gpu, scene, &preview, desc, false).unwrap();
    let mut recorder = gpu.recorder("live").unwrap();
    live.record(&mut recorder, scene, &scene.surfaces(), &preview, place, None)
        .unwrap();
    let passes = recorder.submit().unwrap().wait().unwrap().passes;
    let names: Vec<_> = passes.iter().map(|pass| pass.name.as_str()).collect();
    let drawings = match desc.map {
        ProbeMap::Octahedron => 1,
        ProbeMap::Cube => 6,
    };
    let mut expected = ["raster: surfaces", "preview: shade live map"].repeat(drawings);
    expected.extend(["probe: levels and borders", "probe: copy", "probe: filter"]);
    assert_eq!(names, expected);
    live
}

const DESC: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Octahedron,
    side: 256,
    finest: 128,
};

/// In whatever direction a surface looks, the probe's last level is its irradiance over π: the rays' mean by the cosine.
#[test]
fn irradiance_in_a_closed_room_is_that_of_rays() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let subject = Subject::new(gpu, &scene);
        let place = Vec3::new(0.2, -0.3, 0.1);
        let live = live(gpu, &subject, DESC, place);
        let filtered = live.probe().filtered();
        let mut random = Random(3);
        let mut queries: Vec<Vec4> = (0..60).map(|_| random.direction().extend(9.0)).collect();
        queries.extend([Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z].map(|d| d.extend(9.0)));
        let found = filtered.look_up(&queries).unwrap();
        let mut worst = 0.0f64;
        for (query, value) in queries.iter().zip(&found) {
            let n = query.truncate().as_dvec3();
            let (x, y) = n.any_orthonormal_pair();
            let mut mean = DVec3::ZERO;
            let strata = 128;
            for i in 0..strata * strata {
                let u = f64::from(i / strata) + 0.5;
                let v = f64::from(i % strata) + 0.5;
                let (r, phi) = (
                    (u / f64::from(strata)).sqrt(),
                    std::f64::consts::TAU * v / f64::from(strata),
                );
                let d = r * phi.cos() * x + r * phi.sin() * y + (1.0 - r * r).sqrt() * n;
                mean += colors[face(place.as_dvec3(), d).0].as_dvec3() / f64::from(strata * strata);
            }
            worst = worst.max(((value.as_dvec3() - mean) / mean).abs().max_element());
        }
        println!("irradiance: {worst:.2e}");
        // Bilinear look-ups between centres up to 0.27 apart, of a function whose curvature is about its size: 0.27²/8; and faces' edges in 32²
        // texels.
        assert!(worst < 0.012, "{worst}");
    });
}

/// The mirror at the map's middle shows what rays from there meet, to the texel.
#[test]
fn reflections_at_the_middle_are_those_of_rays() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let subject = Subject::new(gpu, &scene);
        let place = Vec3::new(0.2, -0.3, 0.1);
        let mut last = f64::INFINITY;
        for side in [64, 128, 256] {
            let live = live(
                gpu,
                &subject,
                LightProbeDesc {
                    map: ProbeMap::Octahedron,
                    side,
                    finest: 32,
                },
                place,
            );
            let mut random = Random(5);
            let queries: Vec<Vec4> = (0..4000).map(|_| random.direction().extend(0.0)).collect();
            let found = live.probe().filtered().look_up(&queries).unwrap();
            let mut wrong = 0;
            for (query, value) in queries.iter().zip(&found) {
                let d = query.truncate().as_dvec3();
                let exact = colors[face(place.as_dvec3(), d).0];
                if (*value - exact).abs().max_element() < 1e-6 {
                    continue;
                }
                wrong += 1;
                assert!(
                    is_at_edge(place.as_dvec3(), d, side),
                    "{side}: {d} {value} instead of {exact}"
                );
            }
            let share = f64::from(wrong) / queries.len() as f64;
            println!("{side}: {share:.4} of directions at edges");
            assert!(share < 0.6 * last, "{side}: {share} after {last}");
            last = share;
        }
    });
}

/// Beside the middle the map shows what lies in the same direction: wrong by the parallax and by nothing else.
#[test]
fn deviations_beside_the_middle_are_parallax() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let subject = Subject::new(gpu, &scene);
        let middle = DVec3::new(0.2, -0.3, 0.1);
        let live = live(
            gpu,
            &subject,
            LightProbeDesc {
                map: ProbeMap::Octahedron,
                side: 256,
                finest: 32,
            },
            middle.as_vec3(),
        );
        let mut random = Random(6);
        for radius in [0.05, 0.2, 0.5] {
            let mut queries = Vec::new();
            let mut exact = Vec::new();
            for _ in 0..2000 {
                // A place on a mirror sphere about the middle, and where it mirrors the eye's ray.
                let n = random.direction().as_dvec3();
                let from = middle + radius * n;
                let eye = random.direction().as_dvec3();
                let ray = eye - 2.0 * eye.dot(n).min(0.0) * n;
                if ray.dot(n) <= 0.0 {
                    continue;
                }
                let (seen, distance) = face(from, ray);
                let to = (from + distance * ray - middle).normalize();
                queries.extend([to, ray].map(|d| d.as_vec3().extend(0.0)));
                exact.push(colors[seen]);
            }
            let found = live.probe().filtered().look_up(&queries).unwrap();
            // What is shown is what a ray from the middle meets in the mirrored direction.
            let mut inside = 0;
            for (query, value) in queries.iter().zip(&found).skip(1).step_by(2) {
                let ray = query.truncate().as_dvec3();
                if is_at_edge(middle, ray, 256) {
                    continue;
                }
                inside += 1;
                let from_middle = colors[face(middle, ray).0];
                assert!(
                    (*value - from_middle).abs().max_element() < 1e-5,
                    "{ray}: {value} instead of {from_middle}"
                );
            }
            assert!(10 * inside > 8 * exact.len(), "{radius}: {inside} of {}", exact.len());
            let mut differing = [0u32; 2];
            for (pair, exact) in found.as_chunks::<2>().0.iter().zip(&exact) {
                for (count, value) in differing.iter_mut().zip(pair) {
                    *count += u32::from((*value - *exact).abs().max_element() > 1e-5);
                }
            }
            let [corrected, plain] = differing.map(|count| f64::from(count) / exact.len() as f64);
            println!("radius {radius}: {plain:.3} wrong, {corrected:.3} once the parallax is taken off");
            // With the direction from the middle only edges are left: texels of 0.012 along some 24 m of them at a metre or more.
            assert!(corrected < 0.05, "{radius}: {corrected}");
            assert!(plain > corrected, "{radius}: {plain}");
        }
    });
}

/// A probe is drawn with the shadow maps and the scene's features that it was made for.
#[test]
fn other_previews_and_scenes_are_refused() {
    with_gpu(|gpu| {
        let (scene, _) = room();
        let subject = Subject::new(gpu, &scene);
        let scene = &subject.on_device;
        let preview = |on_device: &GpuScene, shadows: Option<(ShadowLayout, u32)>| {
            let desc = PreviewDesc {
                size: [8, 8],
                samples: 1,
                lights: 1,
                shadows: shadows.map(|(layout, width)| PreviewShadows {
                    layout,
                    side: 16,
                    width,
                    suns: 0,
                }),
                probes: None,
            };
            Preview::new(gpu, on_device, desc).unwrap()
        };
        let made_for = preview(scene, Some((ShadowLayout::Cube, 1)));
        let desc = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: 64,
            finest: 32,
        };
        let live = LiveProbe::new(gpu, scene, &made_for, desc, false).unwrap();
        let record = |scene: &GpuScene, preview: &Preview| {
            let mut recorder = gpu.recorder("others").unwrap();
            live.record(&mut recorder, scene, &scene.surfaces(), preview, Vec3::ZERO, None)
        };
        record(scene, &made_for).unwrap();
        record(scene, &preview(scene, Some((ShadowLayout::Cube, 1)))).unwrap();
        for other in [None, Some((ShadowLayout::Octahedron, 1)), Some((ShadowLayout::Cube, 2))] {
            let refused = record(scene, &preview(scene, other));
            assert!(matches!(refused, Err(Error::Setting { .. })), "{other:?}: {refused:?}");
        }
        // Of the same shapes, but without surfaces that emit light.
        let (mut dark, _) = room();
        for material in &mut dark.materials {
            material.emission = Vec3::ZERO;
        }
        let dark = GpuScene::new(gpu, &dark).unwrap();
        let refused = record(&dark, &preview(&dark, Some((ShadowLayout::Cube, 1))));
        assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        let part = PreviewPart {
            triangles: 0..12,
            background: true,
            probe: None,
        };
        let camera = Camera::look_at("main", DVec3::ZERO, DVec3::X, DVec3::Y, 1.0);
        let mut recorder = gpu.recorder("others").unwrap();
        let refused = made_for.record(&mut recorder, &dark, &dark.surfaces(), &camera, &[part]);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
    });
}

/// More samples and pixels than one row of workgroups has invocations, down to the last.
#[test]
fn large_pictures_take_several_rows_of_workgroups() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let scene = GpuScene::new(gpu, &scene).unwrap();
        let size = [2048, 2050];
        assert!(size[0] * size[1] > 65_535 * 64);
        let desc = PreviewDesc {
            size,
            samples: 1,
            lights: 0,
            shadows: None,
            probes: None,
        };
        let preview = Preview::new(gpu, &scene, desc).unwrap();
        let camera = Camera::look_at("main", DVec3::ZERO, DVec3::X, DVec3::Y, 0.5);
        let part = PreviewPart {
            triangles: 0..12,
            background: true,
            probe: None,
        };
        let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
        let shown = gpu
            .buffer(&BufferDesc::storage("shown", bytes, Category::Film))
            .unwrap();
        let mut recorder = gpu.recorder("large").unwrap();
        preview
            .record(&mut recorder, &scene, &scene.surfaces(), &camera, &[part])
            .unwrap();
        preview
            .record_display(&mut recorder, &shown, 0.0, PixelFormat::Rgba8)
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let pixels = (size[0] * size[1]) as usize;
        let shown: Vec<u32> = gpu.read(shown.view(), pixels).unwrap();
        assert!(shown.iter().all(|pixel| *pixel == shown[0]) && shown[0] & 0xFF == 0xFF);
        let picture = preview.picture().unwrap();
        let layer = picture.main_layer().unwrap();
        assert!(layer.pixels().all(|pixel| pixel == colors[0].to_array()));
    });
}
