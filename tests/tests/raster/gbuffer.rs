//! G-buffers against rays: both forms of visibility from a point must see the same surfaces, and what is told of them must be true.

use clerestory::Error;
use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::{Hit, NO_HIT, RayIndex};
use clerestory::gpu::shaders::constants::SHADING_NORMAL_BITS;
use clerestory::gpu::shaders::types::SceneTriangle;
use clerestory::gpu::{Area, Category, Gpu, GpuOptions, Lesser, OptionalFeatures};
use clerestory::maps::octahedron::OctahedronLayout;
use clerestory::maps::packed_direction::unpack_octahedral;
use clerestory::raster::{GBuffer, GBufferDesc, Layering, OctantCut, Output, View};
use clerestory::scene::{AlphaMode, Camera, Filter, Image, Material, Mesh, Scene, Texture, Wrap};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::random::Random;
use clerestory_tests::render::{builtin, camera_down, floor};
use clerestory_tests::{assert_no_messages, gpu_with, with_gpu};
use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::oracle::{Oracle, Tally, compare, illegal};

const SIZE: [u32; 2] = [64, 48];

/// Half an ulp of 1.
const U: f32 = 1.0 / 16_777_216.0;

/// Triangles as the device has them.
pub fn triangles(gpu: &Gpu, scene: &GpuScene) -> Vec<SceneTriangle> {
    let surfaces = scene.surfaces();
    gpu.read(
        surfaces.set.scene_triangles.buffer().view(),
        surfaces.triangles as usize,
    )
    .unwrap()
}

pub fn corners(triangles: &[SceneTriangle]) -> Vec<[Vec3; 3]> {
    triangles
        .iter()
        .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
        .collect()
}

/// What the rays of a view meet, by pixels.
pub fn hits(index: &dyn RayIndex, view: &View, size: [u32; 2]) -> Vec<Hit> {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    pixels
        .map(|[x, y]| index.closest_hit(&view.ray(x as f32 + 0.5, y as f32 + 0.5)))
        .collect()
}

pub fn draw(gpu: &Gpu, gbuffer: &GBuffer, scene: &GpuScene, views: &[View]) -> Vec<String> {
    let mut recorder = gpu.recorder("raster").unwrap();
    gbuffer.record(&mut recorder, &scene.surfaces(), views).unwrap();
    let timings = recorder.submit().unwrap().wait().unwrap();
    timings.passes.into_iter().map(|pass| pass.name).collect()
}

/// Draws all that can be asked for and holds it against rays.
fn check(gpu: &Gpu, what: &str, scene: &Scene) -> Tally {
    let on_device = GpuScene::new(gpu, scene).unwrap();
    let surfaces = on_device.surfaces();
    let desc = GBufferDesc {
        size: SIZE,
        layering: Layering::One,
        outputs: &Output::ALL,
    };
    let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
    let area = Area::whole(SIZE);
    let view = View::of_camera(&scene.cameras[0], &surfaces, area).unwrap();
    draw(gpu, &gbuffer, &on_device, &[view]);
    let records = triangles(gpu, &on_device);
    let corners = corners(&records);
    let index = Bvh2::build(&corners, &Default::default()).unwrap();
    let hits = hits(&index, &view, SIZE);
    let seen: Vec<u32> = gbuffer.read(gpu, Output::Triangle).unwrap();
    let mut oracle = Oracle::new(SIZE, gpu.caps().sub_pixel_bits);
    oracle.add(&view, area, &corners);
    let rays: Vec<u32> = hits.iter().map(|hit| hit.triangle).collect();
    let tally = compare(what, &oracle, &seen, &rays);
    let objects: Vec<u32> = gbuffer.read(gpu, Output::Object).unwrap();
    let materials: Vec<u32> = gbuffer.read(gpu, Output::Material).unwrap();
    let distances: Vec<f32> = gbuffer.read(gpu, Output::Distance).unwrap();
    let positions: Vec<[f32; 4]> = gbuffer.read(gpu, Output::Position).unwrap();
    let normals: Vec<[u32; 2]> = gbuffer.read(gpu, Output::Normals).unwrap();
    let weights: Vec<[f32; 2]> = gbuffer.read(gpu, Output::Weights).unwrap();
    for (pixel, (triangle, hit)) in seen.iter().zip(&hits).enumerate() {
        let place = format!("{what}, pixel {pixel}");
        if *triangle == NO_HIT {
            assert_eq!((objects[pixel], materials[pixel]), (NO_HIT, NO_HIT), "{place}");
            assert_eq!(
                (distances[pixel], positions[pixel]),
                (f32::INFINITY, [0.0; 4]),
                "{place}"
            );
            continue;
        }
        let record = &records[*triangle as usize];
        let object = surfaces.objects.iter().find(|o| o.triangles.contains(triangle));
        assert_eq!(object.map(|o| o.object), Some(objects[pixel]), "{place}");
        assert_eq!(materials[pixel], record.material, "{place}");
        let [a, b, c] = corners[*triangle as usize];
        // A position is three roundings of what its weights say.
        let [w1, w2] = weights[pixel];
        let expected = a + (w1 * (b - a) + w2 * (c - a));
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let position = Vec4::from_array(positions[pixel]);
        assert!(
            (position.truncate() - expected).abs().max_element() <= 8.0 * U * largest,
            "{place}"
        );
        assert_eq!(position.w, 1.0, "{place}");
        let front = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize();
        let [geometric, shading] = normals[pixel].map(|word| unpack_octahedral(word, SHADING_NORMAL_BITS));
        // The packing's bound, and the rounding of a sliver's normal: an edge's rounding over its height.
        let height =
            (b - a).as_dvec3().cross((c - a).as_dvec3()).length() / f64::from((b - a).length().max((c - a).length()));
        let allowed = 6.6e-5 + 8.0 * f64::from(U * largest) / height;
        assert!(
            (geometric - front).length() <= allowed,
            "{place}: {geometric} is not {front}"
        );
        assert!(shading.dot(front) >= -allowed, "{place}");
        if *triangle == hit.triangle {
            let ray = view.ray(
                (pixel as u32 % SIZE[0]) as f32 + 0.5,
                (pixel as u32 / SIZE[0]) as f32 + 0.5,
            );
            let exact = f64::from(hit.t) * Vec3::from_array(ray.direction).as_dvec3().length();
            // The same t but for a division that a device may round to 2.5 ulp; then a length of five roundings or so, and a product.
            let error = (f64::from(distances[pixel]) - exact).abs() / exact;
            assert!(error <= 8.0 * f64::from(U), "{place}: {error:e}");
            if gpu.caps().kind == clerestory::gpu::DeviceKind::Cpu {
                assert_eq!(weights[pixel], hit.barycentrics, "{place}");
            }
        }
    }
    assert_no_messages(gpu);
    tally
}

#[test]
fn what_is_seen_is_what_rays_meet() {
    with_gpu(|gpu| {
        let mut all = Tally::default();
        for address in [
            "builtin:cornell-box",
            "builtin:triangle-soup?n=400",
            "builtin:sphere-flake?depth=1",
            "builtin:box-city?n=60",
            "builtin:ring",
            "builtin:divider-room",
            "builtin:box-room",
            "builtin:passage",
        ] {
            let tally = check(gpu, address, &builtin(address));
            assert!(tally.covered > tally.pixels / 10, "{address}: {tally:?}");
            // What rounding leaves open is the neighbourhood of edges.
            assert!(tally.open < tally.pixels / 8, "{address}: {tally:?}");
            all.pixels += tally.pixels;
            all.at_edges += tally.at_edges;
            all.at_equal_depths += tally.at_equal_depths;
        }
        println!(
            "all: {} differences at edges, {} at equal depths, of {}",
            all.at_edges, all.at_equal_depths, all.pixels
        );
    });
}

/// Positions come back to the middles of their pixels.
#[test]
fn positions_project_to_the_middles_of_their_pixels() {
    with_gpu(|gpu| {
        for address in ["builtin:cornell-box", "builtin:box-room"] {
            let scene = builtin(address);
            let on_device = GpuScene::new(gpu, &scene).unwrap();
            let surfaces = on_device.surfaces();
            let desc = GBufferDesc {
                size: SIZE,
                layering: Layering::One,
                outputs: &[Output::Triangle, Output::Position],
            };
            let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
            let view = View::of_camera(&scene.cameras[0], &surfaces, Area::whole(SIZE)).unwrap();
            draw(gpu, &gbuffer, &on_device, &[view]);
            let corners = corners(&triangles(gpu, &on_device));
            let index = Bvh2::build(&corners, &Default::default()).unwrap();
            let hits = hits(&index, &view, SIZE);
            let seen: Vec<u32> = gbuffer.read(gpu, Output::Triangle).unwrap();
            let positions: Vec<[f32; 4]> = gbuffer.read(gpu, Output::Position).unwrap();
            let (mut worst, mut met) = (0.0f64, 0);
            for (pixel, (triangle, hit)) in seen.iter().zip(&hits).enumerate() {
                // What is seen where the pixel's ray passes it lies as near to the ray as there is something.
                if *triangle == NO_HIT || *triangle != hit.triangle {
                    continue;
                }
                let [x, y, _, w] = view.project(Vec4::from_array(positions[pixel]).truncate().as_dvec3());
                let place = [x, y].map(|clip| 0.5 * (clip / w + 1.0));
                let middle = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]].map(|i| f64::from(i) + 0.5);
                for ((place, middle), side) in place.into_iter().zip(middle).zip(SIZE) {
                    worst = worst.max((f64::from(side) * place - middle).abs());
                }
                met += 1;
            }
            println!("{address}: {worst:e} pixels off at most, of {met} pixels");
            assert!(worst < 1e-3, "{address}: {worst}");
            assert!(met > seen.len() / 2, "{address}: {met}");
        }
    });
}

/// The rule is not a wide one: pictures from a place that is off by a twentieth of a pixel break it.
#[test]
fn the_rule_finds_a_twentieth_of_a_pixel() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:triangle-soup?n=400");
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let surfaces = on_device.surfaces();
        let desc = GBufferDesc {
            size: SIZE,
            layering: Layering::One,
            outputs: &[Output::Triangle],
        };
        let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
        let corners = corners(&triangles(gpu, &on_device));
        let area = Area::whole(SIZE);
        let camera = &mut scene.cameras[0];
        let exact = View::of_camera(camera, &surfaces, area).unwrap();
        let center = 0.5 * (surfaces.bounds[0] + surfaces.bounds[1]);
        let pixel = 2.0 / f64::from(SIZE[0]) * exact.project(center.as_dvec3())[3]
            / (exact.project(center.as_dvec3() + camera.transform.matrix3.x_axis)[0]
                - exact.project(center.as_dvec3())[0]);
        let mut found = Vec::new();
        for share in [0.0, 0.05] {
            let mut moved = camera.clone();
            moved.transform.translation += share * pixel * camera.transform.matrix3.x_axis;
            let view = View::of_camera(&moved, &surfaces, area).unwrap();
            draw(gpu, &gbuffer, &on_device, &[view]);
            let mut oracle = Oracle::new(SIZE, gpu.caps().sub_pixel_bits);
            oracle.add(&exact, area, &corners);
            found.push(illegal(&oracle, &gbuffer.read(gpu, Output::Triangle).unwrap()));
        }
        println!("illegal answers where the camera is, and beside it: {found:?}");
        assert!(found[0] == 0 && found[1] > 10, "{found:?}");
    });
}

/// One triangle a mesh, given by its corners.
pub fn place(scene: &mut Scene, name: &str, corners: &[[Vec3; 3]]) {
    let material = scene.add_material(Material::lambert(name, Vec3::splat(0.5)));
    scene.place(Mesh {
        name: name.into(),
        positions: corners.as_flattened().to_vec(),
        triangles: (0..corners.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        material: Some(material),
        ..Mesh::default()
    });
}

pub fn looking(camera: Camera) -> Scene {
    Scene {
        cameras: vec![camera],
        ..Scene::default()
    }
}

pub fn forward() -> Camera {
    Camera::look_at("main", DVec3::ZERO, -DVec3::Z, DVec3::Y, 1.0)
}

#[test]
fn hard_cases_are_seen_as_rays_meet_them() {
    with_gpu(|gpu| {
        let mut random = Random(5);
        let v = Vec3::new;
        // Triangles through the plane of the eye, and beside and behind it.
        let mut scene = looking(forward());
        let mut around = Vec::new();
        for _ in 0..60 {
            let center = 3.0 * random.vector();
            around.push([0; 3].map(|_| center + 2.0 * random.vector()));
        }
        place(&mut scene, "around", &around);
        place(
            &mut scene,
            "ground",
            &[[v(-50.0, -1.0, 50.0), v(50.0, -1.0, 50.0), v(0.0, -1.0, -80.0)]],
        );
        check(gpu, "around the eye", &scene);
        // Duplicates in one place, others that cross, and neighbours that share edges through pixel centres.
        let mut scene = looking(forward());
        let wall = [v(-1.0, -1.0, -3.0), v(1.0, -1.0, -3.0), v(0.0, 1.0, -3.0)];
        place(&mut scene, "wall", &[wall, wall, [wall[1], wall[2], wall[0]]]);
        place(
            &mut scene,
            "crossing",
            &[[v(-1.0, 0.0, -2.0), v(1.0, 0.1, -4.0), v(1.0, -0.5, -4.0)]],
        );
        place(
            &mut scene,
            "square",
            &[
                [v(0.5, 0.5, -2.0), v(1.0, 0.5, -2.0), v(1.0, 1.0, -2.0)],
                [v(0.5, 0.5, -2.0), v(1.0, 1.0, -2.0), v(0.5, 1.0, -2.0)],
            ],
        );
        check(gpu, "coplanar", &scene);
        let mut scene = looking(forward());
        place(&mut scene, "copies", &[wall, wall, wall]);
        let tally = check(gpu, "copies", &scene);
        assert!(
            tally.open > 100 && tally.at_equal_depths == 0,
            "of copies the first one is seen, by both"
        );
        // Slivers, specks, lines and points, and coordinates that no ray can reach.
        let mut scene = looking(forward());
        let mut thin = Vec::new();
        for i in 0..80 {
            let [a, b] = [0; 2].map(|_| v(random.vector().x, random.vector().y, -3.0));
            thin.push([a, b, b + [1e-2, 1e-4, 1e-6, 0.0][i % 4] * random.vector()]);
        }
        thin.push([v(0.0, 0.0, -2.0), v(1e30, 0.0, -2.0), v(0.0, 1e30, -2.0)]);
        // In a plane through the eye.
        thin.push([v(-0.5, 0.0, -1.0), v(0.5, 0.0, -1.0), v(0.3, 0.0, -4.0)]);
        place(&mut scene, "thin", &thin);
        check(gpu, "thin", &scene);
        check(
            gpu,
            "far",
            &builtin("builtin:triangle-soup?n=200&offset=10000&slivers=0.5"),
        );
        // Parallel rays, and a scene on both sides of where they begin.
        let mut scene = builtin("builtin:triangle-soup?n=300&slivers=0.3");
        scene.cameras = vec![orthographic(
            DVec3::new(0.1, 0.2, 0.05),
            DVec3::new(1.0, -0.3, -0.5),
            DVec3::Y,
            1.2,
        )];
        check(gpu, "parallel", &scene);
        // Nothing, and nothing in sight.
        let tally = check(gpu, "empty", &looking(forward()));
        assert_eq!((tally.covered, tally.open), (0, 0));
        let mut scene = looking(forward());
        place(&mut scene, "behind", &[wall.map(|p| -p)]);
        assert_eq!(check(gpu, "behind", &scene).covered, 0);
    });
}

#[test]
fn masks_let_through_and_texture_coordinates_are_told() {
    with_gpu(|gpu| {
        let size = [32, 32];
        let mut scene = looking(camera_down(1.0, 3.0));
        let below = scene.add_material(Material::lambert("below", Vec3::splat(0.5)));
        scene.place(floor("below", below, 1.0, 0.0));
        let image = scene.add_image(Image {
            name: "checkers".into(),
            width: 2,
            height: 2,
            texels: [255u8, 0, 0, 255].map(|alpha| [255, 255, 255, alpha]).to_vec(),
        });
        // Eight checkers of four pixels each way.
        let texture = Texture {
            image,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Nearest,
            transform: [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        };
        for alpha_mode in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
            let mut scene = scene.clone();
            let mask = scene.add_material(Material {
                base_color_texture: Some(texture),
                alpha_mode,
                ..Material::lambert("mask", Vec3::ONE)
            });
            let mut mesh = floor("mask", mask, 1.0, 1.0);
            mesh.uv0 = mesh
                .positions
                .iter()
                .map(|p| Vec2::new(p.x + 1.0, p.z + 1.0) * 0.5)
                .collect();
            scene.place(mesh);
            let on_device = GpuScene::new(gpu, &scene).unwrap();
            let surfaces = on_device.surfaces();
            let outputs = [Output::Object, Output::TextureCoordinates];
            let desc = GBufferDesc {
                size,
                layering: Layering::One,
                outputs: &outputs,
            };
            let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
            let view = View::of_camera(&scene.cameras[0], &surfaces, Area::whole(size)).unwrap();
            draw(gpu, &gbuffer, &on_device, &[view]);
            let objects: Vec<u32> = gbuffer.read(gpu, Output::Object).unwrap();
            let uvs: Vec<[f32; 4]> = gbuffer.read(gpu, Output::TextureCoordinates).unwrap();
            for (pixel, (object, uv)) in (0..).zip(objects.iter().zip(uvs)) {
                let [x, y] = [pixel % size[0], pixel / size[0]];
                let is_there = (x / 4 + y / 4) % 2 == 0;
                assert_eq!(*object, u32::from(is_there), "pixel {x}, {y}");
                if is_there {
                    // The picture shows x to the right and z downwards; rays, weights and coordinates round some ten times.
                    let expected = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 32.0;
                    assert!(
                        (Vec2::new(uv[0], uv[1]) - expected).abs().max_element() < 16.0 * U,
                        "pixel {x}, {y}"
                    );
                }
            }
        }
    });
}

#[test]
fn what_is_not_asked_for_costs_nothing() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let surfaces = on_device.surfaces();
        let view = View::of_camera(&scene.cameras[0], &surfaces, Area::whole(SIZE)).unwrap();
        let names = || -> Vec<String> {
            let all = gpu.allocations().into_iter().map(|allocation| allocation.name);
            all.filter(|name| name.starts_with("G-buffer") || name == "objects")
                .collect()
        };
        let film = || gpu.memory_report().of(Category::Film);
        let pixels = u64::from(SIZE[0] * SIZE[1]);
        let mut pictures = Vec::new();
        for outputs in [
            &[][..],
            &[Output::Triangle],
            &[Output::Object, Output::Distance],
            &[Output::Triangle, Output::Normals, Output::Weights],
            &Output::ALL,
        ] {
            let before = film();
            let desc = GBufferDesc {
                size: SIZE,
                layering: Layering::One,
                outputs,
            };
            let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
            let mut expected: Vec<_> = outputs.iter().map(|output| output.name().to_owned()).collect();
            expected.push("G-buffer depth".into());
            expected.extend(outputs.contains(&Output::Object).then(|| "objects".to_owned()));
            let mut found = names();
            found.sort();
            expected.sort();
            assert_eq!(found, expected);
            let bytes = pixels * (4 + outputs.iter().map(|output| output.bytes()).sum::<u64>());
            assert_eq!(gbuffer.bytes(), bytes);
            // The device may round each picture up.
            let allocated = film() - before;
            assert!(allocated >= bytes && allocated < bytes + (1 << 16) * (1 + outputs.len() as u64));
            assert_eq!(draw(gpu, &gbuffer, &on_device, &[view]), ["raster: surfaces"]);
            if outputs.contains(&Output::Triangle) {
                pictures.push(gbuffer.read::<u32>(gpu, Output::Triangle).unwrap());
            } else {
                let refused = gbuffer.read::<u32>(gpu, Output::Triangle);
                assert!(matches!(refused, Err(Error::Picture { .. })), "{refused:?}");
            }
        }
        assert!(names().is_empty(), "nothing is left");
        assert!(
            pictures.windows(2).all(|pair| pair[0] == pair[1]),
            "other outputs change nothing"
        );
    });
}

#[test]
fn mistakes_are_named() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let surfaces = on_device.surfaces();
        let desc = |layering| GBufferDesc {
            size: [8, 8],
            layering,
            outputs: &[Output::Triangle],
        };
        for layering in [
            Layering::Passes(0),
            Layering::Views(33),
            Layering::Geometry(7),
            Layering::Octants(OctantCut::Unsplit { level: 0 }),
            Layering::Paraboloids { level: 65 },
        ] {
            let refused = GBuffer::new(gpu, &surfaces, &desc(layering));
            assert!(matches!(refused, Err(Error::Setting { .. })), "{layering:?}");
        }
        let gbuffer = GBuffer::new(gpu, &surfaces, &desc(Layering::One)).unwrap();
        let view = View::of_camera(&scene.cameras[0], &surfaces, Area::whole([8, 8])).unwrap();
        let mut recorder = gpu.recorder("mistakes").unwrap();
        let two = gbuffer.record(&mut recorder, &surfaces, &[view, view]);
        assert!(matches!(two, Err(Error::Setting { .. })), "{two:?}");
        let views = View::of_octants(Vec3::ZERO, OctahedronLayout::Quadratic, 0.1, Area::whole([8, 8])).unwrap();
        let halves = GBuffer::new(gpu, &surfaces, &desc(Layering::Octants(OctantCut::Halves))).unwrap();
        let square = halves.record(&mut recorder, &surfaces, &views);
        assert!(matches!(square, Err(Error::Setting { .. })), "{square:?}");
        let mut other = surfaces;
        other.features.alpha = true;
        let other = gbuffer.record(&mut recorder, &other, &[view]);
        assert!(matches!(other, Err(Error::Setting { .. })), "{other:?}");
        recorder.submit().unwrap().wait().unwrap();
        for (origin, near) in [(Vec3::NAN, 1.0), (Vec3::ZERO, f32::INFINITY), (Vec3::ZERO, -1.0)] {
            assert!(View::of_cube_face(origin, 0, near, Area::whole([8, 8])).is_err());
        }
        assert!(View::of_cube_face(Vec3::ZERO, 6, 1.0, Area::whole([8, 8])).is_err());
        assert!(View::of_paraboloid(Vec3::ZERO, 2, 1.0, Area::whole([8, 8])).is_err());
    });
    // Devices that lack a way to several layers say so, and every device has one way.
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let on_device = GpuScene::new(&gpu, &builtin("builtin:cornell-box")).unwrap();
    for layering in [
        Layering::Views(6),
        Layering::Instances(6),
        Layering::Geometry(6),
        Layering::Octants(OctantCut::ClipDistances),
        Layering::Octants(OctantCut::Split),
        Layering::Paraboloids { level: 1 },
    ] {
        let desc = GBufferDesc {
            size: [8, 8],
            layering,
            outputs: &[Output::Triangle],
        };
        let refused = GBuffer::new(&gpu, &on_device.surfaces(), &desc).map(|_| ());
        assert!(
            matches!(refused, Err(Error::MissingFeature { .. })),
            "{layering:?}: {refused:?}"
        );
    }
    assert_eq!(Layering::of_layers(gpu.caps(), 6), Layering::Passes(6));
    assert_no_messages(&gpu);
}
