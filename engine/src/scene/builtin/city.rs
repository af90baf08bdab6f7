//! A city of boxes: many instances, occlusion in depth, thin streets.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::Entry;
use super::noise::unit;
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use super::textures::sky;
use crate::Result;
use crate::scene::{Camera, Instance, LightKind, Material, Scene};

pub const BOX_CITY: Entry = Entry {
    name: "box-city",
    summary: "Boxes of many heights on a street grid under sun and sky.",
    parameters: &[
        Parameter::integer("n", "400", 1, 200_000, "boxes"),
        Parameter::integer("seed", "1", 0, u32::MAX, "seed of heights and colours"),
        Parameter::choice(
            "instanced",
            "yes",
            &["yes", "no"],
            "boxes as instances of one mesh per colour",
        ),
        Parameter::real("sky", "1", 0.0, 1000.0, "strength of the sky"),
        Parameter::real("sun", "0", 0.0, 1000.0, "irradiance of an extra directional sun, W/m²"),
    ],
    build,
};

const PALETTE: [Vec3; 4] = [
    Vec3::new(0.6, 0.57, 0.5),
    Vec3::new(0.5, 0.3, 0.22),
    Vec3::new(0.35, 0.42, 0.5),
    Vec3::new(0.7, 0.68, 0.62),
];
/// Metres from one box's middle to the next.
const PITCH: f64 = 20.0;

fn build(values: &Values) -> Result<Scene> {
    let n = values.integer("n")?;
    let seed = values.integer("seed")?;
    let side = f64::from(n).sqrt().ceil() as u32;
    let half = f64::from(side) * PITCH / 2.0;
    let mut scene = Scene::default();
    let ground = scene.add_material(Material::lambert("ground", Vec3::splat(0.3)));
    let paints: Vec<u32> = (0..PALETTE.len())
        .map(|i| scene.add_material(Material::lambert(format!("facade {i}"), PALETTE[i])))
        .collect();
    let far = (half * 2.0) as f32;
    scene.place(
        MeshBuilder::new("ground", ground)
            .quad([
                Vec3::new(-far, 0.0, far),
                Vec3::new(far, 0.0, far),
                Vec3::new(far, 0.0, -far),
                Vec3::new(-far, 0.0, -far),
            ])
            .build(),
    );
    let unit_box = |name: &str, paint| {
        MeshBuilder::new(name, paint)
            .cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5))
            .build()
    };
    let frames = (0..n).map(|i| {
        let random = |dimension| f64::from(unit(seed, i, dimension));
        let width = PITCH * (0.4 + 0.35 * random(0));
        let depth = PITCH * (0.4 + 0.35 * random(1));
        let height = 5.0 + 60.0 * random(2).powi(3);
        let place = DVec3::new(
            (f64::from(i % side) + 0.5) * PITCH - half,
            0.0,
            (f64::from(i / side) + 0.5) * PITCH - half,
        );
        let turn = DQuat::from_rotation_y(0.1 * (random(3) - 0.5));
        let paint = (random(4) * PALETTE.len() as f64) as usize;
        (
            paint,
            DAffine3::from_scale_rotation_translation(DVec3::new(width, height, depth), turn, place),
        )
    });
    if values.yes("instanced")? {
        let meshes: Vec<u32> = paints
            .iter()
            .map(|&paint| scene.add_mesh(unit_box("box", paint)))
            .collect();
        for (paint, transform) in frames {
            scene.instances.push(Instance {
                mesh: meshes[paint],
                transform,
                name: "box".into(),
            });
        }
    } else {
        let frames: Vec<_> = frames.collect();
        for (i, &paint) in paints.iter().enumerate() {
            let mut block = MeshBuilder::new(&format!("boxes {i}"), paint);
            let one = unit_box("", paint);
            for (_, frame) in frames.iter().filter(|(p, _)| *p == i) {
                block.append(&one, |p| frame.transform_point3(p.as_dvec3()).as_vec3());
            }
            scene.place(block.build());
        }
    }
    let sun = Vec3::new(0.5, 0.6, 0.62).normalize();
    scene.environment = Some(sky(sun, values.real("sky")? as f32));
    let irradiance = values.real("sun")? as f32;
    if irradiance > 0.0 {
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: -sun,
                irradiance: Vec3::splat(irradiance),
            },
        );
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(-0.6 * half, 60.0 + 0.3 * half, 1.3 * half),
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::Y,
        45f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "street",
        DVec3::new(0.0, 2.0, half),
        DVec3::new(0.0, 6.0, -half),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(16.0 / 9.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn there_are_as_many_boxes_as_asked_for() {
        for instanced in ["yes", "no"] {
            let scene = generate(&format!("builtin:box-city?n=77&instanced={instanced}")).expect("scene");
            assert_eq!(SceneProfile::of(&scene).triangles, 77 * 12 + 2);
        }
    }
}
