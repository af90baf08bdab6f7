//! Features that a scene has and no ray meets.

use clerestory::scene::{ConductorIor, Filter, Image as Texels, Material, Scene, Texture, Wrap};
use clerestory_hard_cases::scenes::point_triangle;
use glam::{Vec2, Vec3, Vec4};

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

/// What is done to a scene, and how that is called.
pub type Change = (&'static str, fn(&mut Scene));

/// Nothing.
pub const LEAN: &str = "as it is";
/// All at once.
pub const FULL: &str = "everything unseen";

/// The scene alone first.
pub const CHANGES: [Change; 6] = [
    (LEAN, |_| {}),
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
    (FULL, |scene| {
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
