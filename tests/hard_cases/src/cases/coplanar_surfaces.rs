//! Surfaces that lie in one plane and overlap.

use clerestory::Result;
use clerestory::scene::{LightKind, Material, Mesh, Scene};
use glam::{DVec3, Quat, Vec3};

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, floor, orthographic};
use crate::{Easel, HardCase, Judgement};

/// An oblique plane's frame: no coordinate of it is round.
fn tilt() -> Quat {
    Quat::from_rotation_x(0.4) * Quat::from_rotation_z(-0.7)
}

pub(super) const CASE: HardCase = HardCase {
    name: "coplanar-surfaces",
    breaks: "Which of two surfaces in one place is met changes from ray to ray (z-fighting), and each shades the other.",
    expects: "No self-shadowing: two overlapping squares of one plane, cut into triangles differently, have the radiance ρE·cos θ/π of one. Of two equal squares the first is met, bit for bit as if it were alone. Where squares of other shapes overlap, rounding decides which of them a ray meets.",
    picture: || {
        let mut scene = overlapping();
        let red = scene.add_material(Material::lambert("red", Vec3::new(0.7, 0.1, 0.1)));
        scene.meshes[1].material = Some(red);
        scene.cameras[0] = orthographic(DVec3::new(0.0, 10.0, 4.0), DVec3::ZERO, DVec3::Y, 3.2);
        Ok(scene)
    },
    techniques: Some(judge),
    rays: Some(|| {
        let scene = overlapping();
        let triangles: Vec<_> = (scene.meshes.iter())
            .flat_map(|mesh| mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])))
            .collect();
        vec![RaySet {
            what: "overlapping squares".into(),
            rays: awkward_rays(9, &triangles, 800),
            triangles,
        }]
    }),
    ..HardCase::BASE
};

/// A square of the oblique plane, turned in it.
fn square(name: &str, turn: f32, half: f32) -> Mesh {
    let mut mesh = floor(name, 0, half, 0.0);
    for position in &mut mesh.positions {
        *position = tilt() * (Quat::from_rotation_y(turn) * *position);
    }
    mesh
}

const RHO: f32 = 0.5;

/// The sun's direction.
fn sun() -> Vec3 {
    Vec3::new(0.2, -1.0, 0.1).normalize()
}

fn overlapping() -> Scene {
    let mut scene = Scene {
        name: "coplanar".into(),
        ..Scene::default()
    };
    scene.add_material(Material::lambert("grey", Vec3::splat(RHO)));
    scene.place(square("first", 0.0, 2.0));
    scene.place(square("second", 0.5, 2.2));
    scene.add_light(
        "sun",
        LightKind::Directional {
            direction: sun(),
            irradiance: Vec3::ONE,
        },
    );
    scene
        .cameras
        .push(orthographic(DVec3::Y * 10.0, DVec3::ZERO, -DVec3::Z, 0.5));
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let scene = overlapping();
    let normal = (tilt() * Vec3::Y).as_dvec3();
    let radiance = f64::from(RHO) * -normal.dot(sun().as_dvec3()) / std::f64::consts::PI;
    if easel.has("light_paths") {
        // A part of the sun's light comes by light subpaths, with noise.
        let painted = easel.paint_in_passes(&scene, SMALL, 64)?;
        judgement.sound("overlapping squares", &painted);
        judgement.mean("overlapping squares", &painted, [radiance; 3], 0.0)?;
    } else {
        let painted = easel.paint(&scene, SMALL, 64)?;
        judgement.exactly_rounded("overlapping squares", &painted, [radiance; 3], 1.0);
    }

    let mut alone = overlapping();
    alone.instances.truncate(1);
    let mut twice = alone.clone();
    let black = twice.add_material(Material::lambert("black", Vec3::ZERO));
    twice.place(Mesh {
        material: Some(black),
        ..square("again", 0.0, 2.0)
    });
    let (alone, twice) = (easel.paint(&alone, SMALL, 16)?, easel.paint(&twice, SMALL, 16)?);
    judgement.sound("equal squares", &twice);
    judgement.same_bits("equal squares", &twice, &alone);
    Ok(judgement)
}
