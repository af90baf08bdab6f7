//! The engine as a library, without a window: a device, a scene made in code, a renderer that is driven step by step, the picture in memory.
//!
//! `embed_headless [FILE] [--size WxH] [--spp N]`

use std::f32::consts::PI;
use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::film::png;
use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Environment, Material, Mesh, Scene};
use clerestory_samples::arguments::Arguments;
use glam::{DVec3, Vec3};

fn main() -> ExitCode {
    clerestory_samples::run_with("embed_headless", &["--size", "--spp"], sample)
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    // The fastest device there is; CLERESTORY_VALIDATION=core adds the validation layers.
    let gpu = Gpu::headless(&GpuOptions::default())?;
    println!("on {} ({})", gpu.caps().device, gpu.caps().driver);

    let renderer = Renderer::new(&gpu, &scene())?;
    let mut rendering = renderer.start(&RenderOptions {
        size: arguments.size("--size")?.unwrap_or([320, 240]),
        spp: arguments.value("--spp")?.unwrap_or(32),
        ..RenderOptions::default()
    })?;
    // A host does what it likes between the steps: shows the picture so far, moves the camera, stops.
    let mut printed = 0.0;
    while let Some(progress) = rendering.step()? {
        if progress.fraction >= printed + 0.1 || progress.fraction == 1.0 {
            printed = progress.fraction;
            println!(
                "{:3.0} %  {:6.2} s  {} rays",
                100.0 * printed,
                progress.seconds,
                progress.rays
            );
        }
    }
    let picture = rendering.picture()?;

    let radiance = picture.main_layer()?;
    let pixels = radiance.pixels().len() as f32;
    println!(
        "mean radiance {:.4}",
        radiance.values().iter().sum::<f32>() / (3.0 * pixels)
    );
    let tone = ToneMap {
        exposure: 0.0,
        curve: ToneCurve::PbrNeutral,
    };
    clerestory_samples::make_folder(path)?;
    png::write(path, &png::tone_mapped(radiance, picture.width(), &tone))?;
    clerestory_samples::check_messages(&gpu.validation_log())
}

/// Two balls, one red and one of polished metal, on a floor below a square lamp.
fn scene() -> Scene {
    let mut scene = Scene {
        name: "balls".into(),
        source: "embed_headless".into(),
        environment: Some(Environment::uniform(Vec3::new(0.15, 0.2, 0.3))),
        ..Scene::default()
    };
    let grey = scene.add_material(Material::lambert("floor", Vec3::splat(0.6)));
    let red = scene.add_material(Material::lambert("red", Vec3::new(0.7, 0.08, 0.06)));
    let metal = scene.add_material(Material {
        roughness: 0.25,
        ..Material::mirror("metal", Vec3::new(0.9, 0.75, 0.45))
    });
    let lamp = scene.add_material(Material {
        emission: Vec3::splat(12.0),
        ..Material::lambert("lamp", Vec3::ZERO)
    });
    scene.place(square("floor", grey, Vec3::ZERO, Vec3::X * 6.0, Vec3::NEG_Z * 6.0));
    scene.place(square(
        "lamp",
        lamp,
        Vec3::new(-1.0, 3.5, 1.0),
        Vec3::X * 0.7,
        Vec3::Z * 0.7,
    ));
    scene.place(ball("red ball", red, Vec3::new(-0.9, 0.8, 0.0), 0.8));
    scene.place(ball("metal ball", metal, Vec3::new(0.9, 0.8, 0.0), 0.8));
    let (eye, target) = (DVec3::new(0.0, 2.2, 5.0), DVec3::new(0.0, 0.7, 0.0));
    scene.cameras.push(Camera::look_at("main", eye, target, DVec3::Y, 0.6));
    scene
}

/// A parallelogram around `centre`, spanned by two half sides; its front looks along their cross product.
fn square(name: &str, material: u32, centre: Vec3, u: Vec3, v: Vec3) -> Mesh {
    Mesh {
        name: name.into(),
        positions: vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A ball of meridians and circles of latitude with smooth normals.
fn ball(name: &str, material: u32, centre: Vec3, radius: f32) -> Mesh {
    const STACKS: u32 = 32;
    const SLICES: u32 = 2 * STACKS;
    let normals: Vec<Vec3> = (0..=STACKS)
        .flat_map(|stack| (0..=SLICES).map(move |slice| (stack, slice)))
        .map(|(stack, slice)| {
            let (around, out) = (slice as f32 / SLICES as f32 * 2.0 * PI).sin_cos();
            let (ring, up) = (stack as f32 / STACKS as f32 * PI).sin_cos();
            Vec3::new(ring * out, up, -ring * around).normalize()
        })
        .collect();
    let at = |stack, slice| stack * (SLICES + 1) + slice;
    let triangles = (0..STACKS)
        .flat_map(|stack| (0..SLICES).map(move |slice| (stack, slice)))
        .flat_map(|(i, j)| {
            [
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]
        })
        .collect();
    Mesh {
        name: name.into(),
        positions: normals.iter().map(|normal| centre + radius * *normal).collect(),
        normals,
        triangles,
        material: Some(material),
        ..Mesh::default()
    }
}
