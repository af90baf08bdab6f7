//! Light on surfaces: probes of known environments in closed form and against the path tracer, lights without area against the path tracer.

use clerestory::film::Picture;
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::scene::{Camera, Environment, LightKind, Material, Scene};
use clerestory::techniques::preview::{
    LightProbe, LightProbeDesc, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap,
};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::{cuboid, floor};
use clerestory_tests::render::{builtin, camera_aslant, independent, paths, render};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

use crate::subject::sphere;

const SIZE: [u32; 2] = [48, 48];
pub const PROBE: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Octahedron,
    side: 256,
    finest: 128,
};

/// A scene's picture by its first camera and its own lights, lit by a probe of its environment if it has one.
pub fn picture(gpu: &Gpu, scene: &Scene, samples: u32, shadows: Option<PreviewShadows>) -> Picture {
    picture_by(gpu, scene, samples, shadows, PROBE)
}

/// The same by a probe of some map.
pub fn picture_by(
    gpu: &Gpu,
    scene: &Scene,
    samples: u32,
    shadows: Option<PreviewShadows>,
    desc: LightProbeDesc,
) -> Picture {
    let on_device = GpuScene::new(gpu, scene).unwrap();
    let probe = scene
        .environment
        .as_ref()
        .map(|environment| LightProbe::of_environment(gpu, desc, environment).unwrap());
    let desc = PreviewDesc {
        size: SIZE,
        samples,
        lights: scene.lights.len() as u32,
        shadows,
        probes: probe.as_ref().map(|probe| probe.desc().map),
    };
    let mut preview = Preview::new(gpu, &on_device, desc).unwrap();
    let surfaces = on_device.surfaces();
    let lights: Vec<LightKind> = scene.lights.iter().map(|light| light.kind).collect();
    let mut recorder = gpu.recorder("preview").unwrap();
    preview.record_lights(&mut recorder, &surfaces, &lights).unwrap();
    let part = PreviewPart {
        triangles: 0..surfaces.triangles,
        background: true,
        probe: probe.as_ref(),
    };
    preview
        .record(&mut recorder, &on_device, &surfaces, &scene.cameras[0], &[part])
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    preview.picture().unwrap()
}

pub fn pixels(picture: &Picture) -> Vec<DVec3> {
    let layer = picture.main_layer().unwrap();
    layer.pixels().map(|p| Vec3::from_array(p).as_dvec3()).collect()
}

/// Nothing absorbs, so nothing is seen: the split of the integral into albedo and filtered light keeps all energy.
#[test]
fn white_surfaces_vanish_in_a_white_furnace() {
    with_gpu(|gpu| {
        for (settings, allowed) in [
            ("metallic=0&specular=0", 2e-6),
            ("metallic=0&roughness=0.5", 2e-3),
            ("metallic=0&roughness=0.1", 2e-3),
            ("metallic=1&roughness=0", 1e-4),
            ("metallic=1&roughness=0.3", 2e-3),
            ("metallic=1&roughness=1", 2e-3),
            ("metallic=0.5&roughness=0.6", 2e-3),
        ] {
            let scene = builtin(&format!("builtin:white-furnace?frequency=8&{settings}"));
            let all = pixels(&picture(gpu, &scene, 1, None));
            let worst = all.iter().map(|p| (*p - 1.0).abs().max_element()).fold(0.0, f64::max);
            println!("{settings}: {worst:.2e}");
            // Reciprocal averages of the albedo table: the error of its interpolation.
            assert!(worst < allowed, "{settings}: {worst}");
        }
    });
}

/// Coloured materials in a uniform environment reflect their albedo: the path tracer's mean over the picture.
#[test]
fn albedos_in_a_uniform_environment_are_the_path_tracers() {
    with_gpu(|gpu| {
        for (settings, allowed) in [
            ("metallic=0&roughness=0.4&base_color=0.8,0.4,0.1", 0.004),
            ("metallic=1&roughness=0.5&base_color=0.9,0.6,0.2", 0.004),
            ("metallic=1&roughness=0.15&base_color=0.9,0.6,0.2", 0.004),
        ] {
            let scene = builtin(&format!("builtin:white-furnace?frequency=24&{settings}"));
            let found = pixels(&picture(gpu, &scene, 4, None));
            let traced = render(gpu, &scene, SIZE, 64, &independent());
            let mean = found.iter().sum::<DVec3>() / found.len() as f64;
            let expected = DVec3::from(traced.mean().map(|(mean, _)| mean));
            let off = ((mean - expected) / expected).abs().max_element();
            println!("{settings}: {mean} {expected}: {off:.2e}");
            // Paths from facet to facet do not occur on a convex body; noise of 64 samples in 2304 pixels is below two thousandths.
            assert!(off < allowed, "{settings}: {off}");
        }
    });
}

/// A sphere in a scene with an environment that is given by directions, and a parallel view of it along −z.
pub fn sphere_under(material: Material, radiance: impl Fn(DVec3) -> Vec3) -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(material);
    scene.place(sphere("sphere", material, Vec3::ZERO, 1.0, 96));
    let mut camera = Camera::look_at("main", DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, 1.0);
    camera.projection = clerestory::scene::Projection::Orthographic { half_height: 1.0 };
    scene.cameras.push(camera);
    let (width, height) = (256u32, 128u32);
    let mut environment = Environment::uniform(Vec3::ONE);
    (environment.width, environment.height) = (width, height);
    environment.radiance = (0..height)
        .flat_map(|y| (0..width).map(move |x| [x, y].map(|i| f64::from(i) + 0.5)))
        .map(|[x, y]| {
            let (phi, theta) = (2.0 * PI * (x / f64::from(width) - 0.5), PI * y / f64::from(height));
            radiance(DVec3::new(
                theta.sin() * phi.sin(),
                theta.cos(),
                -theta.sin() * phi.cos(),
            ))
        })
        .collect();
    scene.environment = Some(environment);
    scene
}

/// The point of the unit sphere at the middle of each pixel of the parallel view; none beside it or close to its outline.
pub fn normals() -> Vec<Option<DVec3>> {
    let [width, height] = SIZE.map(f64::from);
    (0..SIZE[1])
        .flat_map(|y| (0..SIZE[0]).map(move |x| [x, y].map(|i| f64::from(i) + 0.5)))
        .map(|[x, y]| {
            let (x, y) = (2.0 * x / width - 1.0, 1.0 - 2.0 * y / height);
            let squared = x * x + y * y;
            (squared < 0.81).then(|| DVec3::new(x, y, (1.0 - squared).sqrt()))
        })
        .collect()
}

/// Under a sky of radiance max(0, y) a surface whose normal is θ from the zenith has the irradiance (2/3)(sin θ + (π − θ) cos θ).
#[test]
fn a_lambert_sphere_under_a_cosine_sky_has_the_closed_form() {
    with_gpu(|gpu| {
        let albedo = DVec3::new(0.8, 0.5, 0.2);
        let material = Material::lambert("sphere", albedo.as_vec3());
        let scene = sphere_under(material, |d| Vec3::splat(d.y.max(0.0) as f32));
        let found = pixels(&picture(gpu, &scene, 1, None));
        let mut worst = 0.0f64;
        for (pixel, normal) in found.iter().zip(normals()) {
            let Some(n) = normal else { continue };
            let theta = n.y.acos();
            let irradiance = 2.0 / 3.0 * (theta.sin() + (PI - theta) * theta.cos());
            let expected = albedo / PI * irradiance;
            worst = worst.max((*pixel - expected).abs().max_element());
        }
        println!("cosine sky: {worst:.2e}");
        // The brightest is 0.53, and its curvature is as large. Centres of 32² texels are up to 0.27 apart, along the long diagonal of those in the
        // middle of an octant: 0.53 · 0.27²/8.
        assert!(worst < 5e-3, "{worst}");
    });
}

/// A mirror sphere shows the environment in the mirrored direction, as far as texels tell it.
#[test]
fn a_mirror_sphere_shows_the_environment() {
    with_gpu(|gpu| {
        let radiance = |d: DVec3| (0.5 + 0.5 * d).as_vec3();
        let scene = sphere_under(Material::mirror("mirror", Vec3::ONE), radiance);
        let found = pixels(&picture(gpu, &scene, 1, None));
        let mut worst = 0.0f64;
        for (pixel, normal) in found.iter().zip(normals()) {
            let Some(n) = normal else { continue };
            let direction = 2.0 * n.z * n - DVec3::Z;
            worst = worst.max((*pixel - radiance(direction).as_dvec3()).abs().max_element());
        }
        println!("mirror: {worst:.2e}");
        // Smooth normals of 96 facets a round are off by less than their sagitta, a quarter of (π/96)² · 2, which mirroring doubles; texels of
        // the map and of the environment are 0.02 wide.
        assert!(worst < 3e-3, "{worst}");
    });
}

/// Rough reflections against the path tracer: off by what the round lobe leaves out, which grows with roughness, where the sphere is not seen at
/// grazing angles.
#[test]
fn rough_reflections_are_close_to_the_path_tracers() {
    with_gpu(|gpu| {
        for (roughness, allowed) in [(0.35f32, 0.07), (0.6, 0.12), (1.0, 0.2)] {
            let material = Material {
                roughness,
                ..Material::mirror("metal", Vec3::new(0.9, 0.7, 0.4))
            };
            let scene = sphere_under(material, |d| {
                let window = (12.0 * (d.dot(DVec3::new(0.5, 0.6, 0.624)) - 1.0)).exp();
                Vec3::new(0.2, 0.3, 0.5) + 4.0 * window as f32
            });
            let found = pixels(&picture(gpu, &scene, 2, None));
            let traced = render(gpu, &scene, SIZE, 128, &independent());
            let [mut off, mut sum] = [0.0; 2];
            for ((pixel, expected), normal) in found.iter().zip(traced.radiance.as_chunks::<3>().0).zip(normals()) {
                if normal.is_some_and(|n| n.z > 0.6) {
                    let expected = Vec3::from_array(*expected).as_dvec3();
                    off += (*pixel - expected).length_squared();
                    sum += expected.length_squared();
                }
            }
            let relative = (off / sum).sqrt();
            println!("roughness {roughness}: {relative:.3}");
            assert!(relative < allowed, "roughness {roughness}: {relative}");
        }
    });
}

/// A floor and a block under these lights.
fn lit_block(lights: &[LightKind]) -> Scene {
    let mut scene = Scene::default();
    let matte = scene.add_material(Material::lambert("matte", Vec3::new(0.7, 0.5, 0.3)));
    let glossy = scene.add_material(Material {
        metallic: 0.0,
        roughness: 0.5,
        base_color: Vec3::new(0.2, 0.4, 0.7).extend(1.0),
        ..Material::default()
    });
    scene.place(floor("floor", matte, 1.0, 0.0));
    scene.place(cuboid(
        "block",
        glossy,
        Vec3::new(-0.3, 0.0, -0.3),
        Vec3::new(0.2, 0.5, 0.1),
    ));
    for light in lights {
        scene.add_light("light", *light);
    }
    scene.cameras.push(camera_aslant());
    scene
}

/// What lights without area send to surfaces, and where they do not reach, is the path tracer's direct light.
#[test]
fn direct_light_is_the_path_tracers() {
    with_gpu(|gpu| {
        let position = Vec3::new(-0.8, 1.2, 0.6);
        let direction = (Vec3::new(0.1, 0.0, 0.0) - position).normalize();
        let intensity = Vec3::new(3.0, 2.5, 2.0);
        let point = LightKind::Point { position, intensity };
        let spot = LightKind::Spot {
            position,
            direction,
            intensity,
            inner: 0.2,
            outer: 0.5,
        };
        let sun = |direction: Vec3| LightKind::Directional {
            direction: direction.normalize(),
            irradiance: intensity,
        };
        let suns = [sun(direction), sun(Vec3::new(-0.7, -1.0, 0.4))];
        for lights in [[point], [spot], [suns[0]], [suns[1]]] {
            let scene = lit_block(&lights);
            let traced = render(gpu, &scene, SIZE, 64, &paths("direct"));
            for layout in ShadowLayout::ALL {
                let shadows = PreviewShadows {
                    layout,
                    side: layout.side_for(6 * 256 * 256),
                    width: 1,
                    suns: 2,
                };
                let found = pixels(&picture(gpu, &scene, 8, Some(shadows)));
                let mut off = Vec::new();
                for (pixel, expected) in found.iter().zip(traced.radiance.as_chunks::<3>().0) {
                    let expected = Vec3::from_array(*expected).as_dvec3();
                    off.push((*pixel - expected).length());
                }
                let mean = traced.mean().map(|(mean, _)| mean).iter().sum::<f64>() / 3.0;
                off.sort_by(f64::total_cmp);
                let [median, high] = [0.5, 0.97].map(|share| off[(share * off.len() as f64) as usize] / mean);
                println!("{lights:?}, {}: median {median:.2e}, 97 % {high:.2e}", layout.name());
                // Pixels of one surface differ by where samples lie; those with edges by the noise of samples.
                assert!(median < 0.01, "{lights:?}, {}: {median}", layout.name());
                assert!(high < 0.25, "{lights:?}, {}: {high}", layout.name());
            }
        }
        // Together each has the map of its own.
        let layout = ShadowLayout::Octahedron;
        let shadows = PreviewShadows {
            layout,
            side: 256,
            width: 1,
            suns: 2,
        };
        let shown = |lights: &[LightKind]| pixels(&picture(gpu, &lit_block(lights), 1, Some(shadows)));
        let all = [suns[0], point, suns[1], spot];
        let each = all.map(|light| shown(&[light]));
        for (i, found) in shown(&all).into_iter().enumerate() {
            let sum: DVec3 = each.iter().map(|picture| picture[i]).sum();
            assert!(
                (found - sum).abs().max_element() <= 1e-5 * (1.0 + sum.max_element()),
                "{i}: {found} {sum}"
            );
        }
    });
}
