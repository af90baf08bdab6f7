//! Each kind of material under photons: a floor's light, all of it from the map, against the path tracer's.
//!
//! Materials of all kinds stand by without area, so that all scenes share their kernels.

use super::*;
use clerestory::scene::{AlphaMode, Image, Texture};
use clerestory_tests::render::{cuboid, lamp, point_triangle};
use clerestory_tests::with_gpu;
use glam::{Vec2, Vec4};

/// Kernels of 3 cm blur by h²/12 ∇²E, under a wide lamp at 1.6 m 0.02 %, and by a hundredth of a picture's quarter where the rim of an image of
/// the lamp crosses its border, at most a fifth of that in its mean. Bands of flux are rounded to a 2⁻¹⁰ of the largest, here three times
/// the smallest at most.
const BIAS: f64 = 2e-3;
const RADIUS: f32 = 0.03;
/// Photons of a pass: sixteen passes have means within 2 % of what they expect, so that a cosine too many is found.
const PHOTONS: u32 = 1 << 14;

fn texture(scene: &mut Scene, texels: Vec<[u8; 4]>) -> Option<Texture> {
    let image = scene.add_image(Image {
        name: "texels".into(),
        width: 2,
        height: texels.len() as u32 / 2,
        texels,
    });
    Some(Texture {
        image,
        uv_set: 0,
        wrap: Default::default(),
        filter: Default::default(),
        transform: [[2.0, 0.0, 0.1], [0.0, 2.0, 0.3]],
    })
}

fn mapped(mut mesh: Mesh) -> Mesh {
    mesh.uv0 = vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO];
    mesh
}

fn plain(name: &str) -> Material {
    Material::lambert(name, Vec3::new(0.7, 0.5, 0.4))
}

fn rough_metal() -> Material {
    Material {
        base_color: Vec4::new(0.9, 0.7, 0.4, 1.0),
        roughness: 0.4,
        ..Material::default()
    }
}

fn phong() -> Material {
    Material::phong("phong", Vec3::new(0.9, 0.7, 0.4), 0.6, 20.0)
}

fn plastic() -> Material {
    Material {
        base_color: Vec4::new(0.7, 0.5, 0.4, 1.0),
        metallic: 0.0,
        roughness: 0.3,
        ..Material::default()
    }
}

fn ink() -> Material {
    Material {
        attenuation_color: Vec3::new(0.8, 0.6, 0.5),
        attenuation_distance: 0.3,
        ..Material::glass("ink", 1.5)
    }
}

fn thin() -> Material {
    Material {
        base_color: Vec4::new(0.9, 0.8, 0.6, 1.0),
        thickness: 0.0,
        ..Material::glass("thin", 1.5)
    }
}

fn sheet(alpha_mode: AlphaMode) -> Material {
    Material {
        base_color: Vec4::new(0.7, 0.5, 0.4, 0.5),
        alpha_mode,
        ..plain("sheet")
    }
}

/// A floor under a lamp beside a wall, with all kinds of materials standing by.
fn fixture(name: &str, floor_material: Material, wall: Material) -> Scene {
    let mut scene = floor_and_wall(name, floor_material, wall);
    scene.meshes[0] = mapped(scene.meshes[0].clone());
    let shining = scene.add_material(Material {
        double_sided: false,
        ..lamp(Vec3::new(8.0, 6.0, 5.0))
    });
    scene.place(ceiling("lamp", shining, Vec3::new(0.3, 1.6, 0.1), 0.5, true));
    let texels = texture(&mut scene, vec![[255, 200, 180, 255], [150, 200, 255, 255]]);
    let textured = Material {
        base_color_texture: texels,
        ..sheet(AlphaMode::Mask { cutoff: 0.5 })
    };
    for material in [
        rough_metal(),
        phong(),
        plastic(),
        ink(),
        thin(),
        textured,
        sheet(AlphaMode::Blend),
    ] {
        point_triangle(&mut scene, material, Vec3::ZERO);
    }
    if let Some(mesh) = scene.meshes.last_mut() {
        mesh.normals = vec![Vec3::Y; 3];
        mesh.uv0 = vec![Vec2::ZERO; 3];
    }
    scene
}

fn expect_material(gpu: &Gpu, scene: &Scene) {
    let settings = PhotonSettings {
        direct_photons: true,
        photons: PHOTONS,
        ..fixed("bounces=1..4", RADIUS)
    };
    expect_agreement(gpu, scene, &settings, [16, 384], [BIAS; 3]);
}

#[test]
fn walls_of_all_kinds_light_the_floor() {
    with_gpu(|gpu| {
        for (name, wall) in [
            ("lambert wall", plain("wall")),
            ("mirror", Material::mirror("mirror", Vec3::new(0.9, 0.8, 0.7))),
            ("rough metal", rough_metal()),
            ("phong wall", phong()),
            ("plastic wall", plastic()),
        ] {
            expect_material(gpu, &fixture(name, plain("floor"), wall));
        }
    });
}

#[test]
fn walls_of_which_normals_fan_out_light_the_floor() {
    with_gpu(|gpu| {
        let mirror = Material::mirror("mirror", Vec3::new(0.9, 0.8, 0.7));
        // The mirror is a convex one, the diffuse wall is lit as if it were.
        for (name, wall) in [("bent wall", plain("wall")), ("bent mirror", mirror)] {
            let mut scene = fixture(name, plain("floor"), wall);
            scene.meshes[1].normals = [0.3, -0.3, -0.3, 0.3]
                .map(|z| Vec3::new(1.0, 0.0, z).normalize())
                .to_vec();
            expect_material(gpu, &scene);
        }
    });
}

#[test]
fn floors_of_all_kinds_gather() {
    with_gpu(|gpu| {
        let wall = || plain("wall");
        expect_material(gpu, &fixture("plastic floor", plastic(), wall()));
        let mut scene = fixture("textured floor", plain("floor"), wall());
        let texels = vec![
            [255, 255, 255, 255],
            [100, 200, 255, 255],
            [255, 150, 100, 255],
            [200; 4],
        ];
        scene.materials[0].base_color_texture = texture(&mut scene, texels);
        expect_material(gpu, &scene);
        let mut scene = fixture("bent floor", plain("floor"), wall());
        scene.meshes[0].normals = [0.3, -0.2, -0.3, 0.1]
            .map(|x| Vec3::new(x, 1.0, 0.2).normalize())
            .to_vec();
        expect_material(gpu, &scene);
        // Half of a metal is a diffuse base.
        let half = Material {
            metallic: 0.5,
            ..plastic()
        };
        expect_material(gpu, &fixture("half metal", half, wall()));
    });
}

#[test]
fn blended_surfaces_meet_their_share_of_photons() {
    with_gpu(|gpu| {
        // How many photons meet a sheet as it is, and when half of it is there, whose square has half of them as variance.
        let meet = |alpha_mode: AlphaMode| {
            let mut scene = fixture("sheet", plain("floor"), plain("wall"));
            let index = scene.add_material(sheet(alpha_mode));
            scene.place(ceiling("sheet", index, Vec3::Y * 0.4, 0.5, true));
            let settings = PhotonSettings {
                direct_photons: true,
                ..fixed("bounces=1..1", RADIUS)
            };
            let photons = mapper(gpu, &scene, &settings).photons(0);
            let photons = photons.unwrap_or_else(|error| panic!("{error}"));
            let on_sheet = photons
                .iter()
                .filter(|p| p.record.position.y > 0.3 && p.record.position.x > -0.9);
            println!("{alpha_mode:?}: {} photons", photons.len());
            on_sheet.count() as f64
        };
        let (whole, half) = (meet(AlphaMode::Opaque), meet(AlphaMode::Blend));
        assert!(whole > 1000.0);
        expect_mean("half a sheet", half, 0.5 * whole, 0.5 * whole, 0.0);
    });
}

#[test]
fn light_goes_through_what_lets_it_through() {
    with_gpu(|gpu| {
        let wall = || plain("wall");
        let (low, high) = (Vec3::new(-0.5, 0.3, -0.45), Vec3::new(0.55, 0.5, 0.5));
        let rough = Material {
            roughness: 0.4,
            ..ink()
        };
        for (name, material) in [("slab of ink", ink()), ("rough slab", rough)] {
            let mut scene = fixture(name, plain("floor"), wall());
            let index = scene.add_material(material);
            scene.place(cuboid(name, index, low, high));
            expect_material(gpu, &scene);
        }
        for (name, material) in [
            ("thin glass", thin()),
            ("sheet", sheet(AlphaMode::Opaque)),
            ("blended sheet", sheet(AlphaMode::Blend)),
            ("masked sheet", sheet(AlphaMode::Mask { cutoff: 0.5 })),
        ] {
            let mut scene = fixture(name, plain("floor"), wall());
            let index = scene.add_material(material);
            let mut mesh = mapped(ceiling(name, index, Vec3::Y * 0.4, 0.5, true));
            if name == "masked sheet" {
                let texels = vec![
                    [255, 255, 255, 255],
                    [255, 255, 255, 120],
                    [255, 255, 255, 90],
                    [255; 4],
                ];
                scene.materials[index as usize].base_color.w = 1.0;
                scene.materials[index as usize].base_color_texture = texture(&mut scene, texels);
                // Above the lamp's reach for kernels: the sheet itself is seen, with the light on it.
                mesh.positions.iter_mut().for_each(|p| p.y += 0.1);
            }
            scene.place(mesh);
            expect_material(gpu, &scene);
        }
    });
}

/// A lamp in two bands, a point light in the third: all that they light is in the body with them.
#[test]
fn lights_inside_a_body_that_absorbs_shine_through_it() {
    with_gpu(|gpu| {
        let mut scene = fixture("body of ink", plain("floor"), plain("wall"));
        let lamps = scene.materials.iter_mut().filter(|m| m.emission != Vec3::ZERO);
        lamps.for_each(|lamp| lamp.emission.y = 0.0);
        add_point(&mut scene, Vec3::new(0.2, 1.0, -0.3), Vec3::Y * 20.0);
        let index = scene.add_material(ink());
        scene.place(cuboid(
            "body",
            index,
            Vec3::new(-2.2, -0.1, -2.2),
            Vec3::new(2.2, 2.0, 2.2),
        ));
        expect_material(gpu, &scene);
    });
}
