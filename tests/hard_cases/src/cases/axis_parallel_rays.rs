//! Rays along axes, whose directions have zeros of either sign.

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::scene::load;
use glam::{DVec3, Vec3};

use crate::random::Random;
use crate::rays::RaySet;
use crate::scenes::{SMALL, lattice, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "axis-parallel-rays",
    breaks: "The reciprocal of a zero component is ±∞ and 0 · ∞ is NaN: boxes are skipped when a ray runs in the plane of their faces.",
    expects: "From inside a closed room that only shines, every sample of a camera that looks along an axis is exactly the wall's radiance; rays through vertices, edges and box faces find what a search through all triangles finds.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        scene.cameras[0].projection = clerestory::scene::Projection::Orthographic { half_height: 0.32 };
        Ok(scene)
    },
    techniques: Some(judge),
    rays: Some(|| {
        let mut random = Random(2);
        let mut rays = Vec::new();
        let mut point = || Vec3::from_array([0; 3].map(|_| random.below(5) as f32 - 2.0));
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        for i in 0..600 {
            let (from, to) = (point(), point());
            let axis = axes[i % 6];
            rays.push(Ray::new(from, axis));
            rays.push(Ray::new(from, to - from));
            rays.push(Ray::new(from + axis * 7.0, -axis * 1e-20));
            let signed = |sign: u32, v: f32| if v == 0.0 && i as u32 & sign != 0 { -0.0 } else { v };
            rays.push(Ray::new(
                from,
                Vec3::new(signed(1, axis.x), signed(2, axis.y), signed(4, axis.z)),
            ));
        }
        vec![RaySet {
            what: "lattice".into(),
            triangles: lattice(),
            rays,
        }]
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut scene = load("builtin:furnace-box?rho=0&emission=1")?;
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for sign in [1.0, -1.0] {
            let up = if axis == DVec3::Y { DVec3::Z } else { DVec3::Y };
            scene.cameras = vec![orthographic(DVec3::ZERO, axis * sign, up, 0.9999)];
            let painted = easel.paint(&scene, SMALL, 16)?;
            judgement.exactly(&format!("along {}", axis * sign), &painted, [1.0; 3]);
        }
    }
    Ok(judgement)
}
