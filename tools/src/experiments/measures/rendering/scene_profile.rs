//! What a scene pays for: the same picture by kernels and buffers made for the scene, and by ones that hold features which it does not use.
//!
//! Oracle: pictures must not differ in any bit.

use clerestory::Result;
use clerestory::gpu::Category;
use clerestory::render::Renderer;
use clerestory::scene::{ConductorIor, Filter, Image as Texels, Material, Scene, Texture, Wrap};
use clerestory::{gpu::Gpu, scene};
use clerestory_hard_cases::scenes::point_triangle;
use glam::{Vec2, Vec3, Vec4};

use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::Image;
use crate::experiments::table::Table;

/// Adds a triangle without area, which no ray meets; its material counts all the same.
fn add_unseen(scene: &mut Scene, material: Material, full: bool) {
    let place = scene.meshes.first().and_then(|mesh| mesh.positions.first()).copied();
    point_triangle(scene, material, place.unwrap_or_default());
    if let Some(mesh) = scene.meshes.last_mut().filter(|_| full) {
        mesh.normals = vec![Vec3::Y; 3];
        mesh.tangents = vec![Vec4::X; 3];
        mesh.uv0 = vec![Vec2::ZERO; 3];
        mesh.colors = vec![Vec4::ONE; 3];
    }
}

fn texture(scene: &mut Scene) -> Texture {
    let image = scene.add_image(Texels {
        name: "grey".into(),
        width: 2,
        height: 2,
        texels: vec![[128, 128, 255, 255]; 4],
    });
    Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

type Change = fn(&mut Scene);

const CHANGES: [(&str, Change); 6] = [
    ("as it is", |_| {}),
    ("metal unseen", |scene| {
        let metal = Material::mirror("metal", Vec3::ONE);
        add_unseen(
            scene,
            Material {
                roughness: 0.5,
                ..metal
            },
            false,
        );
    }),
    ("glass unseen", |scene| {
        add_unseen(
            scene,
            Material {
                attenuation_color: Vec3::splat(0.5),
                attenuation_distance: 1.0,
                ..Material::glass("glass", 1.5)
            },
            false,
        );
    }),
    ("texture unseen", |scene| {
        let texture = texture(scene);
        let mut material = Material::lambert("textured", Vec3::ONE);
        material.base_color_texture = Some(texture);
        add_unseen(scene, material, true);
    }),
    ("vertex attributes unseen", |scene| {
        add_unseen(scene, Material::lambert("plain", Vec3::ONE), true);
    }),
    ("everything unseen", |scene| {
        let texture = texture(scene);
        let material = Material {
            base_color_texture: Some(texture),
            normal_texture: Some(texture),
            metallic: 0.5,
            roughness: 0.5,
            transmission: 0.5,
            thickness: 0.1,
            attenuation_color: Vec3::splat(0.5),
            attenuation_distance: 1.0,
            conductor: Some(ConductorIor {
                eta: Vec3::splat(0.2),
                k: Vec3::splat(3.0),
            }),
            ..Material::default()
        };
        add_unseen(scene, material, true);
        add_unseen(
            scene,
            Material {
                unlit: true,
                ..Material::default()
            },
            false,
        );
    }),
];

/// Device bytes of a scene alone: geometry, materials with textures and tables, lights.
fn bytes(gpu: &Gpu, scene: &Scene) -> Result<[u64; 3]> {
    let categories = [Category::Geometry, Category::Material, Category::Light];
    let before = gpu.memory_report();
    let renderer = Renderer::new(gpu, scene)?;
    let after = gpu.memory_report();
    drop(renderer);
    Ok(categories.map(|category| after.of(category).saturating_sub(before.of(category))))
}

fn features(image: &Image) -> u64 {
    let shade = image
        .report
        .pipelines
        .iter()
        .find(|p| p.shader.ends_with("path_shade.comp"));
    let constants = shade.map_or(&[][..], |p| &p.specialization[..]);
    let compiled = constants
        .iter()
        .filter(|(name, bits)| name.starts_with("has_") && *bits != 0);
    compiled.count() as u64
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (size, spp) = if context.smoke { (8, 4) } else { (64, 64) };
    let changes = if context.smoke { &CHANGES[..2] } else { &CHANGES[..] };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "One picture, kernels made for the scene and for more",
        &[
            "scene",
            "compiled for",
            "values that differ",
            "features in the shading kernel",
            "kernels",
            "passes of the picture",
            "geometry bytes",
            "material bytes",
            "light bytes",
            "million rays/s",
            "GPU seconds",
        ],
    );
    for address in ["builtin:cornell-box", "builtin:white-furnace?frequency=4&roughness=0.4"] {
        let lean = scene::load(address)?;
        let mut first: Option<Vec<u32>> = None;
        for (what, change) in changes {
            let mut scene = lean.clone();
            change(&mut scene);
            let held = bytes(&gpu, &scene)?;
            let image = Image::render(&Renderer::new(&gpu, &scene)?, size, spp, 5, "all")?;
            let values = image.radiance.iter().chain(&image.variance);
            let bits: Vec<u32> = values.map(|v| v.to_bits()).collect();
            let reference = first.get_or_insert_with(|| bits.clone());
            let different = bits.iter().zip(reference.iter()).filter(|(a, b)| a != b).count();
            let passes: u64 = image.report.passes.iter().map(|pass| pass.count).sum();
            let seconds = image.report.gpu_seconds;
            let mut cells = vec![
                address.trim_start_matches("builtin:").into(),
                (*what).into(),
                (different as u64).into(),
                features(&image).into(),
                (image.report.pipelines.len() as u64).into(),
                passes.into(),
            ];
            cells.extend(held.map(Into::into));
            let rate = image.count("rays") as f64 * 1e-6 / seconds.max(1e-9);
            cells.extend([rate.into(), seconds.into()]);
            table.row(cells);
        }
    }
    table.note(format!(
        "{size} × {size} pixels, {spp} samples each, after one that compiles the kernels. Unseen: on a triangle without area, so that the \
         kernels and buffers hold the feature and no ray meets it."
    ));
    Ok(vec![table])
}
