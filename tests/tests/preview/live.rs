//! Live maps: irradiance in a closed room against rays, reflections at the map's middle against rays, and parallax beside it.

use clerestory::gpu::Gpu;
use clerestory::scene::{Material, Mesh, Scene};
use clerestory::techniques::preview::{LightProbeDesc, LiveProbe, Preview, PreviewDesc};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3, Vec4};

use crate::subject::Subject;

/// A closed room [-1, 1]³ of six black faces, each with a radiance of its own.
fn room() -> (Scene, [Vec3; 6]) {
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
fn face(from: DVec3, direction: DVec3) -> (usize, f64) {
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

fn live(gpu: &Gpu, subject: &Subject, desc: LightProbeDesc, place: Vec3) -> LiveProbe {
    let scene = &subject.on_device;
    let preview = Preview::new(
        gpu,
        scene,
        PreviewDesc {
            size: [8, 8],
            samples: 1,
            lights: 0,
            shadows: None,
            has_probes: false,
        },
    )
    .unwrap();
    let live = LiveProbe::new(gpu, scene, &preview, desc, false).unwrap();
    let mut recorder = gpu.recorder("live").unwrap();
    live.record(&mut recorder, scene, &scene.surfaces(), &preview, place, None)
        .unwrap();
    let passes = recorder.submit().unwrap().wait().unwrap().passes;
    let names: Vec<_> = passes.iter().map(|pass| pass.name.as_str()).collect();
    let expected = [
        "raster: surfaces",
        "preview: shade live map",
        "probe: levels and borders",
        "probe: copy",
        "probe: filter",
    ];
    assert_eq!(names, expected);
    live
}

const DESC: LightProbeDesc = LightProbeDesc { side: 256, finest: 128 };

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
            let live = live(gpu, &subject, LightProbeDesc { side, finest: 32 }, place);
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
                // Somewhere within the texels that were looked up another face begins: they are no wider than 4.3 / side either way.
                let reach = 2.0 * 4.3 / f64::from(side);
                let (x, y) = d.any_orthonormal_pair();
                let is_at_edge = (0..16).any(|i| {
                    let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 16.0).sin_cos();
                    let near = (d + reach * (cosine * x + sine * y)).normalize();
                    face(place.as_dvec3(), near).0 != face(place.as_dvec3(), d).0
                });
                assert!(is_at_edge, "{side}: {d} {value} instead of {exact}");
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
            LightProbeDesc { side: 256, finest: 32 },
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
                let reach = (from + distance * ray - middle).length();
                // What is off is an angle of less than that under which the offset is seen.
                assert!(to.angle_between(ray) <= (radius / reach).min(1.0).asin() + 1e-12);
                queries.extend([to, ray].map(|d| d.as_vec3().extend(0.0)));
                exact.push(colors[seen]);
            }
            let found = live.probe().filtered().look_up(&queries).unwrap();
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
