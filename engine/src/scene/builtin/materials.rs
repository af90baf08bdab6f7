//! A row of spheres over a checkered floor, one material feature each, under a procedural sky.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, lat_long_sphere, textured_quad};
use super::textures::{blotches, bumps, checker, image, plain, sky, srgb_byte, unorm_byte};
use crate::Result;
use crate::scene::{AlphaMode, Camera, Filter, Material, Scene, metals, tangents};

pub const MATERIALS: Entry = Entry {
    name: "materials",
    summary: "Nine spheres with one glTF material feature each over a checkered floor under a procedural sky.",
    parameters: &[
        Parameter::real("sky", "1", 0.0, 1000.0, "strength of the sky"),
        Parameter::integer("slices", "64", 8, 1024, "slices of each sphere; half as many stacks"),
        Parameter::real("aperture", "0", 0.0, 1.0, "lens radius of the main camera, m"),
    ],
    build,
};

const RADIUS: f32 = 0.45;
const TEXTURE_SIZE: u32 = 128;

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let tiles = scene.add_image(checker("tiles", TEXTURE_SIZE, 2, [Vec3::splat(0.6), Vec3::splat(0.2)]));
    let mut floor = Material::lambert("floor", Vec3::ONE);
    floor.base_color_texture = Some(plain(tiles, Filter::Nearest));
    let floor = scene.add_material(floor);
    let extent = 12.0;
    scene.place(textured_quad(
        "floor",
        floor,
        [
            Vec3::new(-extent, 0.0, extent),
            Vec3::new(extent, 0.0, extent),
            Vec3::new(extent, 0.0, -extent),
            Vec3::new(-extent, 0.0, -extent),
        ],
        Vec2::splat(extent),
    ));
    let list = sphere_materials(&mut scene);
    let slices = values.integer("slices")?;
    let middle = (list.len() as f32 - 1.0) / 2.0;
    for (i, material) in list.into_iter().enumerate() {
        let name = material.name.clone();
        let bumped = material.normal_texture.is_some();
        let index = scene.add_material(material);
        let ball = lat_long_sphere(&name, index, f64::from(RADIUS), slices, slices / 2);
        // A hair above the floor, so that the solid ones do not touch it.
        let centre = Vec3::new(i as f32 - middle, RADIUS + 0.002, 0.0);
        let mut mesh = MeshBuilder::new(&name, index).append(&ball, |p| p + centre).build();
        if bumped {
            tangents::generate(&mut mesh);
        }
        scene.place(mesh);
    }
    let sun = Vec3::new(-0.5, 0.7, 0.5).normalize();
    scene.environment = Some(sky(sun, values.real("sky")? as f32));
    let (eye, target) = (DVec3::new(0.0, 1.8, 7.0), DVec3::new(0.0, 0.35, 0.0));
    let mut main = Camera::look_at("main", eye, target, DVec3::Y, 28f32.to_radians());
    main.lens_radius = values.real("aperture")? as f32;
    main.focus_distance = eye.distance(target) as f32;
    scene.cameras.push(main);
    scene.cameras.push(Camera::look_at(
        "close",
        DVec3::new(1.5, 0.9, 2.5),
        DVec3::new(1.2, 0.4, 0.0),
        DVec3::Y,
        45f32.to_radians(),
    ));
    scene.defaults.aspect = Some(2.0);
    Ok(scene)
}

fn sphere_materials(scene: &mut Scene) -> Vec<Material> {
    let size = TEXTURE_SIZE;
    let marble = scene.add_image(image("marble", size, size, |x, y| {
        let color = Vec3::new(0.75, 0.6, 0.45).lerp(Vec3::new(0.25, 0.12, 0.08), blotches(11, size, 4, x, y));
        [srgb_byte(color.x), srgb_byte(color.y), srgb_byte(color.z), 255]
    }));
    let worn = scene.add_image(image("worn metal", size, size, |x, y| {
        let wear = blotches(23, size, 8, x, y);
        [0, unorm_byte(0.2 + 0.6 * wear), if wear < 0.6 { 255 } else { 0 }, 255]
    }));
    let bumps = scene.add_image(bumps("bumps", 5, size, 8, 1.0));
    let holes = scene.add_image(image("holes", size, size, |x, y| {
        let (fx, fy) = ((x % 16) as f32 - 7.5, (y % 16) as f32 - 7.5);
        [200, 180, 120, if fx * fx + fy * fy < 30.0 { 0 } else { 255 }]
    }));
    let dielectric = |name: &str, color: Vec3, roughness: f32| Material {
        name: name.into(),
        base_color: Vec4::from((color, 1.0)),
        metallic: 0.0,
        roughness,
        ..Material::default()
    };
    vec![
        Material {
            conductor: metals::by_name("gold"),
            ..Material::mirror("gold", Vec3::ONE)
        },
        Material {
            roughness: 0.45,
            ..Material::mirror("rough metal", Vec3::new(0.9, 0.88, 0.85))
        },
        dielectric("plastic", Vec3::new(0.1, 0.3, 0.6), 0.25),
        Material {
            attenuation_color: Vec3::new(0.6, 0.9, 0.7),
            attenuation_distance: 0.5,
            ..Material::glass("glass", 1.5)
        },
        Material {
            transmission: 1.0,
            double_sided: true,
            ..dielectric("thin frosted glass", Vec3::splat(0.95), 0.4)
        },
        Material {
            emission: Vec3::new(4.0, 2.0, 0.8),
            ..dielectric("emissive", Vec3::splat(0.1), 1.0)
        },
        Material {
            base_color_texture: Some(plain(holes, Filter::Nearest)),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            double_sided: true,
            ..dielectric("alpha masked", Vec3::ONE, 0.8)
        },
        Material {
            base_color_texture: Some(plain(marble, Filter::Linear)),
            normal_texture: Some(plain(bumps, Filter::Linear)),
            ..dielectric("bumpy marble", Vec3::ONE, 0.3)
        },
        Material {
            name: "worn metal".into(),
            base_color: Vec4::new(0.8, 0.5, 0.35, 1.0),
            metallic_roughness_texture: Some(plain(worn, Filter::Linear)),
            ..Material::default()
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::{EnvironmentUse, SceneProfile};

    #[test]
    fn every_feature_is_there() {
        let scene = generate("builtin:materials?aperture=0.05").expect("scene");
        let profile = SceneProfile::of(&scene);
        assert!(profile.has_textures && profile.has_normal_maps && profile.has_metal && profile.has_conductor);
        assert!(profile.transmission.solid && profile.transmission.thin && profile.has_absorption);
        assert!(profile.alpha.mask && !profile.alpha.blend && profile.has_lens && profile.has_area_lights());
        assert_eq!(profile.environment, EnvironmentUse::Map);
        assert_eq!(profile.roughness, Some([0.0, 1.0]));
        assert_eq!(profile.emissive_triangles, 2 * 64 * 31);
    }
}
