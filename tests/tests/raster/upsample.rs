//! Bilateral upsampling: constants and steps exactly, other values as the twin, and pixels that no neighbour stands for.

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::constants::SHADING_NORMAL_BITS;
use clerestory::gpu::{Access, Area, Category, Gpu};
use clerestory::maps::packed_direction::unpack_octahedral;
use clerestory::raster::upsample::{SeenPoint, UpsampleDesc, UpsampledPicture, Upsampler, upsampled};
use clerestory::raster::{GBuffer, GBufferDesc, Layering, Output, View};
use clerestory::scene::{Camera, Material, Scene};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::{cuboid, orthographic};
use clerestory_tests::render::{builtin, floor};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

const FINE: [u32; 2] = [64, 48];

/// A step of 1 m on a floor, and a post that is thinner than coarse pixels; from above, so that normals are all alike.
fn terrace() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, 2.0, 0.0));
    let step = [Vec3::new(-0.9, 0.0, -0.7), Vec3::new(0.3, 1.0, 0.4)];
    let post = [Vec3::new(0.735, 0.0, -0.9), Vec3::new(0.775, 0.5, 0.9)];
    for [lower, upper] in [step, post] {
        scene.place(cuboid("step", white, lower, upper));
    }
    scene
        .cameras
        .push(orthographic(DVec3::Y * 3.0, DVec3::ZERO, -DVec3::Z, 0.9));
    scene
}

struct Views {
    desc: UpsampleDesc,
    coarse: GBuffer,
    fine: GBuffer,
}

fn gbuffer(gpu: &Gpu, scene: &GpuScene, camera: &Camera, size: [u32; 2], outputs: &[Output]) -> GBuffer {
    let surfaces = scene.surfaces();
    let desc = GBufferDesc {
        size,
        layering: Layering::One,
        outputs,
    };
    let gbuffer = GBuffer::new(gpu, &surfaces, &desc).expect("G-buffer");
    let view = View::of_camera(camera, &surfaces, Area::whole(size)).expect("view");
    let mut recorder = gpu.recorder("G-buffer").expect("recorder");
    gbuffer.record(&mut recorder, &surfaces, &[view]).expect("drawn");
    recorder.submit().expect("submitted").wait().expect("drawn");
    gbuffer
}

/// What pixels see; none where nothing is.
fn points(gpu: &Gpu, gbuffer: &GBuffer) -> Vec<Option<SeenPoint>> {
    let positions: Vec<[f32; 4]> = gbuffer.read(gpu, Output::Position).expect("positions");
    let normals: Vec<[u32; 2]> = gbuffer.read(gpu, Output::Normals).expect("normals");
    let pairs = positions.into_iter().zip(normals);
    pairs
        .map(|([x, y, z, w], words)| {
            (w != 0.0).then(|| SeenPoint {
                position: Vec3::new(x, y, z).as_dvec3(),
                normal: unpack_octahedral(words[1], SHADING_NORMAL_BITS),
            })
        })
        .collect()
}

impl Views {
    fn new(gpu: &Gpu, scene: &Scene, coarse: [u32; 2]) -> Self {
        let on_device = GpuScene::new(gpu, scene).expect("scene");
        let outputs = [Output::Position, Output::Normals];
        let of = |size| gbuffer(gpu, &on_device, &scene.cameras[0], size, &outputs);
        Self {
            desc: UpsampleDesc {
                coarse,
                fine: FINE,
                plane_max: 0.1,
                normal_min: 0.9,
            },
            coarse: of(coarse),
            fine: of(FINE),
        }
    }

    fn upsample(&self, gpu: &Gpu, values: &[[f32; 3]]) -> UpsampledPicture {
        let input = gpu.buffer_with("values", Category::Work, values).expect("values");
        let upsampler = Upsampler::new(gpu, self.desc).expect("upsampler");
        let mut recorder = gpu.recorder("upsample").expect("recorder");
        recorder
            .pass("show", |pass| {
                let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
                for gbuffer in [&self.coarse, &self.fine] {
                    gbuffer.barrier_to(pass, Access::COMPUTE_READ, layout);
                }
                Ok(())
            })
            .expect("recorded");
        upsampler
            .record(&mut recorder, &self.coarse, &self.fine, &input)
            .expect("recorded");
        recorder.submit().expect("submitted").wait().expect("upsampled");
        upsampler.read(gpu).expect("picture")
    }
}

#[test]
fn steps_keep_both_values_and_what_has_no_neighbours_is_defective() {
    with_gpu(|gpu| {
        let scene = terrace();
        for coarse in [[16, 12], [20, 15], [64, 48]] {
            let views = Views::new(gpu, &scene, coarse);
            let (few, many) = (points(gpu, &views.coarse), points(gpu, &views.fine));
            let value = |point: &Option<SeenPoint>| match point {
                Some(point) if point.position.y > 0.9 => [0.1, 7.3, 1e-3],
                Some(_) => [0.3, 0.7, 1.9],
                None => [f32::NAN; 3],
            };
            let values: Vec<_> = few.iter().map(value).collect();
            let found = views.upsample(gpu, &values);
            let mut defective = [0, 0];
            for (i, point) in many.iter().enumerate() {
                let is_post = point.is_some_and(|point| (0.4..0.6).contains(&point.position.y));
                if found.defective[i] {
                    assert_eq!(found.values[i], [0.0; 3]);
                    defective[usize::from(is_post)] += 1;
                } else {
                    // To the bit, on both sides of the step.
                    assert_eq!(found.values[i], value(point), "{coarse:?} {i}");
                }
            }
            assert_eq!(found.count, defective[0] + defective[1]);
            println!("{coarse:?}: {defective:?} defective");
            if coarse == FINE {
                assert_eq!(found.count, 0);
            } else {
                // The post, which few coarse pixels see, if any, and next to nothing else.
                assert!(defective[1] > 10, "{defective:?}");
                assert!(defective[0] < FINE[0] * FINE[1] / 100, "{defective:?}");
            }
        }
    });
}

#[test]
fn pictures_agree_with_their_twin() {
    with_gpu(|gpu| {
        for scene in [
            terrace(),
            builtin("builtin:cornell-box"),
            builtin("builtin:furnace-sphere"),
        ] {
            let views = Views::new(gpu, &scene, [24, 18]);
            let (few, many) = (points(gpu, &views.coarse), points(gpu, &views.fine));
            let values: Vec<[f32; 3]> = few
                .iter()
                .map(|point| point.map_or([0.0; 3], |point| (point.position.as_vec3() + 2.0).to_array()))
                .collect();
            let found = views.upsample(gpu, &values);
            let mut compared = 0;
            for (i, point) in many.iter().enumerate() {
                let Some(point) = point else {
                    assert!(!found.defective[i] && found.values[i] == [0.0; 3]);
                    continue;
                };
                let pixel = [i as u32 % FINE[0], i as u32 / FINE[0]];
                let of_coarse = |[x, y]: [u32; 2]| {
                    let at = (y * 24 + x) as usize;
                    few[at].map(|point| (point, Vec3::from_array(values[at]).as_dvec3()))
                };
                let expected = upsampled(&views.desc, pixel, point, of_coarse);
                // Thresholds are met within rounding by few.
                match expected {
                    Some(expected) if !found.defective[i] => {
                        let there = Vec3::from_array(found.values[i]).as_dvec3();
                        compared += usize::from((there - expected).length() < 1e-5);
                    }
                    _ => compared += usize::from(expected.is_none() == found.defective[i]),
                }
            }
            let seen = many.iter().flatten().count();
            assert!(
                seen > 100 && compared + seen / 500 >= seen,
                "{}: {compared} of {seen}",
                scene.name
            );
        }
    });
}

#[test]
fn mistakes_are_refused() {
    with_gpu(|gpu| {
        let views = Views::new(gpu, &terrace(), [16, 12]);
        let desc = views.desc;
        for wrong in [
            UpsampleDesc { coarse: [0, 4], ..desc },
            UpsampleDesc {
                plane_max: f32::NAN,
                ..desc
            },
            UpsampleDesc {
                normal_min: 1.5,
                ..desc
            },
        ] {
            assert!(
                matches!(Upsampler::new(gpu, wrong), Err(Error::Setting { .. })),
                "{wrong:?}"
            );
        }
        let upsampler = Upsampler::new(gpu, desc).expect("upsampler");
        let input = gpu
            .buffer_with("values", Category::Work, &vec![[1.0f32; 3]; 16 * 12])
            .expect("values");
        let mut recorder = gpu.recorder("upsample").expect("recorder");
        let swapped = upsampler.record(&mut recorder, &views.fine, &views.coarse, &input);
        assert!(matches!(swapped, Err(Error::Setting { .. })), "{swapped:?}");
        let scene = terrace();
        let on_device = GpuScene::new(gpu, &scene).expect("scene");
        let bare = gbuffer(gpu, &on_device, &scene.cameras[0], FINE, &[Output::Position]);
        let lacking = upsampler.record(&mut recorder, &views.coarse, &bare, &input);
        assert!(matches!(lacking, Err(Error::Picture { .. })), "{lacking:?}");
    });
}
