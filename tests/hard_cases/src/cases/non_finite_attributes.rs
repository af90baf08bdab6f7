//! NaN and infinity in what a scene holds.

use clerestory::accel::Ray;
use clerestory::scene::{Environment, LightKind, Medium, Phase, Scene, load};
use clerestory::{Error, Result};
use glam::{Vec2, Vec3, Vec4};

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{furnace, lattice};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "non-finite-attributes",
    breaks: "A NaN passes every comparison as false: it spreads through boxes and sums until the picture is black, or a loop never ends.",
    expects: "Every attribute that is not a finite number, an index out of range and a count that does not fit are refused by an error that names the place. Rays that are not rays meet nothing, and triangles that are none are left out.",
    picture: || load("builtin:triangle-soup"),
    techniques: Some(judge),
    rays: Some(|| {
        let mut triangles = lattice();
        triangles.extend([
            [Vec3::NAN, Vec3::X, Vec3::Y],
            [Vec3::splat(f32::INFINITY), Vec3::X, Vec3::Y],
            [Vec3::splat(f32::MAX), Vec3::X, Vec3::Y],
        ]);
        let mut rays = awkward_rays(15, &triangles, 300);
        let directions = [
            Vec3::ZERO,
            Vec3::NAN,
            Vec3::new(f32::INFINITY, 0.0, 0.0),
            Vec3::splat(1e30),
            Vec3::new(0.0, 1e-38, 0.0),
        ];
        rays.extend(directions.map(|direction| Ray::new(Vec3::ZERO, direction)));
        rays.push(Ray::new(Vec3::splat(f32::NAN), Vec3::X));
        rays.push(Ray::new(Vec3::splat(1e20), Vec3::NEG_ONE));
        vec![RaySet {
            what: "what is not a ray".into(),
            triangles,
            rays,
        }]
    }),
    ..HardCase::BASE
};

/// A change that breaks a scene, and the place that its refusal has to name.
type Fault = (&'static str, fn(&mut Scene));

const FAULTS: &[Fault] = &[
    ("meshes[0]", |s| s.meshes[0].positions[1].y = f32::NAN),
    ("meshes[0]", |s| s.meshes[0].positions[2].x = f32::INFINITY),
    ("meshes[0]", |s| {
        s.meshes[0].normals = vec![Vec3::NAN; s.meshes[0].positions.len()]
    }),
    ("meshes[0]", |s| s.meshes[0].normals = vec![Vec3::Y]),
    ("meshes[0]", |s| {
        s.meshes[0].tangents = vec![Vec4::NAN; s.meshes[0].positions.len()]
    }),
    ("meshes[0]", |s| {
        s.meshes[0].uv0 = vec![Vec2::NAN; s.meshes[0].positions.len()]
    }),
    ("meshes[0]", |s| {
        s.meshes[0].uv1 = vec![Vec2::INFINITY; s.meshes[0].positions.len()]
    }),
    ("meshes[0]", |s| {
        s.meshes[0].colors = vec![Vec4::NAN; s.meshes[0].positions.len()]
    }),
    ("meshes[0]", |s| s.meshes[0].triangles[0][1] = 1_000_000),
    ("meshes[0]", |s| s.meshes[0].material = Some(7)),
    ("instances[0].transform", |s| {
        s.instances[0].transform.translation.z = f64::NAN
    }),
    ("instances[0].transform", |s| {
        s.instances[0].transform.matrix3.x_axis.y = f64::INFINITY
    }),
    ("instances[0].mesh", |s| s.instances[0].mesh = 9),
    ("materials[0]", |s| s.materials[0].emission.x = f32::NAN),
    ("materials[0]", |s| s.materials[0].emission.y = f32::INFINITY),
    ("materials[0]", |s| s.materials[0].roughness = f32::NAN),
    ("materials[0]", |s| s.materials[0].base_color.z = -1.0),
    ("materials[0]", |s| s.materials[0].ior = f32::NAN),
    ("materials[0]", |s| s.materials[0].ior = 0.5),
    ("materials[0]", |s| s.materials[0].thickness = f32::NAN),
    ("materials[0]", |s| s.materials[0].attenuation_color = Vec3::NAN),
    ("materials[0]", |s| s.materials[0].attenuation_distance = f32::NAN),
    ("materials[0]", |s| s.materials[0].normal_scale = f32::NAN),
    ("lights[0]", |s| {
        s.add_light(
            "bad",
            LightKind::Point {
                position: Vec3::NAN,
                intensity: Vec3::ONE,
            },
        );
    }),
    ("lights[0]", |s| {
        s.add_light(
            "bad",
            LightKind::Point {
                position: Vec3::ONE,
                intensity: Vec3::INFINITY,
            },
        );
    }),
    ("lights[0]", |s| {
        s.add_light(
            "bad",
            LightKind::Directional {
                direction: Vec3::ZERO,
                irradiance: Vec3::ONE,
            },
        );
    }),
    ("lights[0]", |s| {
        s.add_light(
            "bad",
            LightKind::Spot {
                position: Vec3::ONE,
                direction: Vec3::NEG_Y,
                intensity: Vec3::ONE,
                inner: f32::NAN,
                outer: 1.0,
            },
        );
    }),
    ("cameras[0]", |s| s.cameras[0].transform.translation.x = f64::NAN),
    ("cameras[0]", |s| s.cameras[0].lens_radius = f32::NAN),
    ("cameras[0]", |s| s.cameras[0].focus_distance = 0.0),
    ("media[0]", |s| {
        s.media.push(Medium {
            sigma_s: Vec3::NAN,
            ..Medium::default()
        });
    }),
    ("media[0]", |s| {
        s.media.push(Medium {
            phase: Phase::HenyeyGreenstein { g: 1.0 },
            ..Medium::default()
        });
    }),
    ("surrounding", |s| s.surrounding = Some(0)),
    ("environment", |s| {
        s.environment = Some(Environment::uniform(Vec3::splat(f32::NAN)))
    }),
    ("environment", |s| {
        s.environment = Some(Environment {
            strength: f32::INFINITY,
            ..Environment::uniform(Vec3::ONE)
        });
    }),
];

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for (i, (place, change)) in FAULTS.iter().enumerate() {
        let mut scene = furnace()?;
        change(&mut scene);
        judgement.refused(
            &format!("fault {i} of {place}"),
            easel.upload(&scene),
            |error| matches!(error, Error::Scene { at, cause, .. } if at.contains(place) && !cause.is_empty()),
        );
    }
    Ok(judgement)
}
