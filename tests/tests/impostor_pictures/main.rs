//! Pictures by maps with distances, techniques `impostor` and `localized-gather`, beside the path tracer on equal path sets, closed forms and published errors.
//!
//! The room of most tests is that of the published figures, \[-1, 1\]³, with six walls of different colours and a point light; a sphere stands in it.

mod bits;
mod edge_cases;
mod gathers;
mod reflections;
mod refractions;

use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::{Camera, LightKind, Material, Mesh, Scene};
use clerestory_tests::render::quad;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

/// Albedos of the walls +x, −x, +y, −y, +z and −z.
const COLORS: [[f32; 3]; 6] = [
    [0.9, 0.3, 0.2],
    [0.2, 0.6, 0.9],
    [0.8, 0.8, 0.7],
    [0.5, 0.4, 0.3],
    [0.3, 0.8, 0.4],
    [0.7, 0.3, 0.8],
];

/// A sphere with normals.
fn sphere(material: u32, centre: Vec3, radius: f32, slices: u32) -> Mesh {
    let stacks = slices / 2;
    let mut mesh = Mesh {
        name: "sphere".into(),
        material: Some(material),
        ..Mesh::default()
    };
    for stack in 0..=stacks {
        for slice in 0..=slices {
            let theta = std::f32::consts::PI * stack as f32 / stacks as f32;
            let phi = std::f32::consts::TAU * (slice % slices) as f32 / slices as f32;
            let n = Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            mesh.positions.push(centre + radius * n);
            mesh.normals.push(n.normalize());
        }
    }
    let at = |stack: u32, slice: u32| stack * (slices + 1) + slice;
    for stack in 0..stacks {
        for slice in 0..slices {
            let [a, b] = [at(stack, slice), at(stack + 1, slice)];
            let [c, d] = [at(stack + 1, slice + 1), at(stack, slice + 1)];
            if stack > 0 {
                mesh.triangles.push([a, b, d]);
            }
            if stack + 1 < stacks {
                mesh.triangles.push([b, c, d]);
            }
        }
    }
    mesh
}

/// The six walls of the room about the origin, of half a width `scale`.
fn walls(scene: &mut Scene, scale: f32) {
    for (wall, color) in COLORS.into_iter().enumerate() {
        let axis = wall / 2;
        let side = if wall % 2 == 0 { scale } else { -scale };
        let [n, u, v] = [0, 1, 2].map(|i| Vec3::AXES[(axis + i) % 3]);
        let corner = |a: f32, b: f32| side * n + scale * (a * u + b * v);
        let material = scene.add_material(Material::lambert("wall", Vec3::from_array(color)));
        scene.place(quad(
            "wall",
            material,
            [
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
        ));
    }
}

/// The lamp's place and intensity for half a width of 1.
const LAMP: Vec3 = Vec3::new(-0.2, 0.3, 0.2);
const INTENSITY: Vec3 = Vec3::new(1.0, 0.9, 0.8);

/// A point light.
fn lamp(scene: &mut Scene, scale: f32) {
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: scale * LAMP,
            intensity: scale * scale * INTENSITY,
        },
    );
}

/// Albedo of the wall of this normal, towards the room.
fn albedo_of_wall(normal: DVec3) -> DVec3 {
    let axis = (0..3_usize).find(|axis| normal[*axis] != 0.0).expect("normal");
    Vec3::from_array(COLORS[2 * axis + usize::from(normal[axis] > 0.0)]).as_dvec3()
}

/// Number of the sphere in rooms.
const SPHERE: u32 = 6;

/// The room with a sphere of a material, seen by a pinhole whose square is `about` times as wide as the sphere.
fn room_with(material: Material, centre: DVec3, radius: f64, eye: DVec3, about: f64, scale: f64) -> Scene {
    let mut scene = Scene {
        name: "room".into(),
        ..Scene::default()
    };
    walls(&mut scene, scale as f32);
    let material = scene.add_material(material);
    scene.place(sphere(
        material,
        (scale * centre).as_vec3(),
        (scale * radius) as f32,
        96,
    ));
    let half = about * (radius / centre.distance(eye)).asin().tan();
    scene.cameras.push(Camera::look_at(
        "main",
        scale * eye,
        scale * centre,
        DVec3::Y,
        2.0 * half.atan() as f32,
    ));
    scene
}

/// The published eye.
const EYE: DVec3 = DVec3::new(-0.8, 0.1, -0.7);
/// The published sphere half-way to a wall.
const B: DVec3 = DVec3::new(0.5, 0.0, 0.0);

fn mirror() -> Material {
    Material::mirror("mirror", Vec3::new(0.95, 0.9, 0.8))
}

/// A picture by a technique.
fn rendered(renderer: &Renderer, technique: &str, size: u32, spp: u32, settings: Value) -> Rendered {
    rendered_by(renderer, technique, (size, spp), 5, settings)
}

/// The same with a seed.
fn rendered_by(renderer: &Renderer, technique: &str, (size, spp): (u32, u32), seed: u32, settings: Value) -> Rendered {
    let options = RenderOptions {
        technique: Some(technique.into()),
        size: [size; 2],
        spp,
        seed,
        settings: settings.into(),
        ..RenderOptions::default()
    };
    let rendered = renderer
        .render(&options)
        .unwrap_or_else(|error| panic!("{technique}: {error}"));
    let values = layer(&rendered, "radiance");
    assert_eq!(rendered.report.non_finite_samples.total(), 0, "{technique}");
    assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{technique}");
    rendered
}

fn renderer(gpu: &Gpu, scene: &Scene) -> Renderer {
    Renderer::new(gpu, scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

fn layer<'a>(rendered: &'a Rendered, name: &str) -> &'a [f32] {
    rendered.picture.layer(name).expect("layer").values()
}

/// The path tracer's picture of the same light paths as another one, with numbers of its own.
fn traced(renderer: &Renderer, of: &Rendered, size: u32, spp: u32) -> Rendered {
    let settings = json!({"path_set": of.report.path_set, "sampler": "pcg"});
    let traced = rendered_by(renderer, "path", (size, spp), 6, settings);
    assert_eq!(traced.report.path_set, of.report.path_set);
    traced
}

/// Relative RMS of differences over some pixels, and the bias, both over the mean of what is expected.
fn errors(found: &[f32], expected: &[f32], pixels: &[usize]) -> [f64; 2] {
    let (mut squares, mut sum, mut whole) = (0.0, 0.0, 0.0);
    for i in pixels.iter().flat_map(|pixel| 3 * pixel..3 * pixel + 3) {
        let (a, b) = (f64::from(found[i]), f64::from(expected[i]));
        squares += (a - b) * (a - b);
        sum += a - b;
        whole += b;
    }
    let n = 3.0 * pixels.len() as f64;
    [(squares / n).sqrt() / (whole / n), sum / whole]
}

/// As [`errors`] of pictures of independent samples, the RMS without what their variances explain.
fn errors_beyond_noise(found: &Rendered, expected: &Rendered, pixels: &[usize]) -> [f64; 2] {
    let [rms, bias] = errors(layer(found, "radiance"), layer(expected, "radiance"), pixels);
    let mean = |rendered: &Rendered, name: &str| {
        let values = layer(rendered, name);
        let of_pixel = |pixel: &usize| {
            values[3 * pixel..3 * pixel + 3]
                .iter()
                .map(|v| f64::from(*v))
                .sum::<f64>()
        };
        pixels.iter().map(of_pixel).sum::<f64>() / (3 * pixels.len()) as f64
    };
    let noise = (mean(found, "variance") + mean(expected, "variance")) / mean(expected, "radiance").powi(2);
    println!("RMS {rms:.4}, of noise {:.4}", noise.sqrt());
    [(rms * rms - noise).max(0.0).sqrt(), bias]
}

/// Pixels of a square picture whose corners all see the sphere, or with `inside` off all pass by it, by a part of its radius.
fn pixels_of_sphere(scene: &Scene, size: u32, centre: DVec3, radius: f64, inside: bool) -> Vec<usize> {
    let camera = &scene.cameras[0];
    let clerestory::scene::Projection::Perspective { fov_y } = camera.projection else {
        panic!("no perspective");
    };
    let half = f64::from(0.5 * fov_y).tan();
    let sees = |x: u32, y: u32, radius: f64| {
        let at = |i: u32| half * (2.0 * f64::from(i) / f64::from(size) - 1.0);
        let d = camera
            .transform
            .transform_vector3(DVec3::new(at(x), -at(y), -1.0))
            .normalize();
        (centre - camera.transform.translation).reject_from(d).length() < radius
    };
    let pixel = |i: &u32| {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (i % size + x, i / size + y));
        match inside {
            true => corners.iter().all(|(x, y)| sees(*x, *y, 0.97 * radius)),
            false => !corners.iter().any(|(x, y)| sees(*x, *y, 1.1 * radius)),
        }
    };
    (0..size * size).filter(pixel).map(|i| i as usize).collect()
}
