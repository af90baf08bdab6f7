//! Light from all directions, as functions: what maps are measured with.

use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::{NO_HIT, Ray, RayIndex};
use clerestory::{Result, scene};
use glam::{DVec3, Vec3};

/// A function over the sphere.
pub struct Environment {
    /// Its name.
    pub name: &'static str,
    /// Radiance by unit direction.
    pub radiance: Box<dyn Fn(DVec3) -> f64 + Sync>,
}

/// Names of all, and what each stands for, in a few words.
pub const LIGHTS: [(&str, &str); 4] = [
    ("smooth sky", "polynomials and a lobe of 40°"),
    ("sun", "that sky and a sun of 2.9°, 40 times as bright"),
    ("sharp edges", "black and white cells of 0.4 along each axis"),
    ("live map", SCENE),
];

/// 1/variance of the sun's angle: a standard deviation of 0.05 rad.
const SUN: f64 = 400.0;
/// Of the sky's.
const SUN_RADIANCE: f64 = 40.0;
/// Cells along an axis from −1 to 1.
const CELLS: f64 = 5.0;
/// What a live map shows.
const SCENE: &str = "builtin:box-city?n=60";

fn sky(d: DVec3) -> f64 {
    1.0 + 0.5 * d.z + 0.3 * d.x * d.y + (2.0 * (d.dot(DVec3::new(0.6, 0.64, 0.48)) - 1.0)).exp()
}

fn sunny(d: DVec3) -> f64 {
    sky(d) + SUN_RADIANCE * (SUN * (d.dot(DVec3::new(0.8, 0.48, 0.36)) - 1.0)).exp()
}

fn edges(d: DVec3) -> f64 {
    let cells = (0.5 * CELLS * (d + 1.0)).floor();
    cells.element_sum().rem_euclid(2.0)
}

/// Colours of surfaces seen from within a city of boxes, under the sky.
fn live() -> Result<Box<dyn Fn(DVec3) -> f64 + Sync>> {
    let scene = scene::load(SCENE)?;
    let (triangles, albedos): (Vec<_>, Vec<_>) = scene
        .triangles()
        .map(|(triangle, material)| {
            let material = material.and_then(|index| scene.materials.get(index as usize));
            let color = material.map_or(Vec3::splat(0.5), |material| material.base_color.truncate());
            (triangle, f64::from(color.element_sum() / 3.0))
        })
        .unzip();
    let all = || triangles.iter().flatten().copied();
    let (lower, upper) = all().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    let origin = lower + Vec3::new(0.55, 0.6, 0.52) * (upper - lower);
    let index = Bvh2::build(&triangles, &Default::default())?;
    Ok(Box::new(move |d| {
        let hit = index.closest_hit(&Ray::new(origin, d.as_vec3()));
        if hit.triangle == NO_HIT {
            return sky(d);
        }
        let [a, b, c] = triangles[hit.triangle as usize].map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        albedos[hit.triangle as usize] * (0.2 + normal.dot(DVec3::new(0.36, 0.8, 0.48)).abs())
    }))
}

/// Those that maps are chosen by, in the order of [`LIGHTS`].
pub fn all() -> Result<Vec<Environment>> {
    let radiances: [Box<dyn Fn(DVec3) -> f64 + Sync>; 4] = [Box::new(sky), Box::new(sunny), Box::new(edges), live()?];
    let of = |((name, _), radiance)| Environment { name, radiance };
    Ok(LIGHTS.into_iter().zip(radiances).map(of).collect())
}
