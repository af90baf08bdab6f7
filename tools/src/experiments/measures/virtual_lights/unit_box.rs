//! The unit box as rays of the host meet it, the points that its view shows, and lights of walks from its lamp.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::{Ray, RayIndex};
use clerestory::techniques::instant_radiosity::selection::{LightWalks, LitPoint, SurfaceLight, Survival, WalkHit};
use clerestory::{Error, Result, scene};
use glam::{DVec2, DVec3, Vec3};

/// The scene.
pub const ADDRESS: &str = "builtin:unit-box";
/// Reflectance of its surfaces.
pub const RHO: f64 = 0.8;
/// How far from surfaces rays begin, m.
const OFFSET: f64 = 1e-6;
/// Corner and sides of the lamp in the ceiling, m.
const LAMP: [f64; 2] = [0.35, 0.3];
/// The eye, and half of the picture at a distance of one, whatever its size.
const EYE: DVec3 = DVec3::new(0.5, 0.55, 0.02);
const HALF: f64 = 0.9;

/// Its surfaces.
pub struct UnitBox {
    triangles: Vec<[Vec3; 3]>,
    index: Bvh2,
}

impl UnitBox {
    /// Loads it.
    pub fn load() -> Result<Self> {
        let scene = scene::load(ADDRESS)?;
        let triangles: Vec<[Vec3; 3]> = scene.triangles().map(|(triangle, _)| triangle).collect();
        let index = Bvh2::build(&triangles, &Bvh2Settings::default())?;
        Ok(Self { triangles, index })
    }

    /// What a ray meets first.
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Option<WalkHit> {
        let hit = self.index.closest_hit(&Ray::new(origin.as_vec3(), direction.as_vec3()));
        let [a, b, c] = self
            .triangles
            .get(hit.triangle as usize)?
            .map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(WalkHit {
            position: origin + direction * f64::from(hit.t) + OFFSET * normal,
            normal,
            reflectance: DVec3::splat(RHO),
        })
    }

    /// Whether nothing stands between a point and a light.
    pub fn sees(&self, point: &LitPoint, light: &SurfaceLight) -> bool {
        let way = light.position + OFFSET * light.normal - point.position;
        let mut ray = Ray::new(point.position.as_vec3(), way.as_vec3());
        ray.t_max = 1.0;
        !self.index.any_hit(&ray)
    }

    /// Lights of walks from the lamp, which has one watt.
    pub fn lights(&self, walks: u32, seed: u32, survival: Survival) -> Vec<SurfaceLight> {
        let plan = LightWalks { walks, seed, survival };
        let lamp = |u: DVec2| {
            let [x, z] = [u.x, u.y].map(|along| LAMP[0] + LAMP[1] * along);
            (DVec3::new(x, 1.0 - OFFSET, z), DVec3::NEG_Y)
        };
        plan.lights(lamp, DVec3::ONE, |origin, direction| self.meet(origin, direction))
    }

    /// The direction of a pixel's middle.
    fn way([x, y]: [u32; 2], [width, height]: [u32; 2]) -> DVec3 {
        let at = |i: u32, n: u32| HALF * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
        DVec3::new(at(x, width), -at(y, height), 1.0).normalize()
    }

    /// Points that the pixels of a picture show, row by row.
    ///
    /// # Errors
    /// [`Error::Scene`] where one sees nothing.
    pub fn points(&self, size: [u32; 2]) -> Result<Vec<LitPoint>> {
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let point = |pixel| {
            let hit = self.meet(EYE, Self::way(pixel, size));
            let hit = hit.ok_or_else(|| Error::scene(ADDRESS, "walls", "are not closed"))?;
            Ok(LitPoint {
                position: hit.position,
                normal: hit.normal,
                reflectance: hit.reflectance,
            })
        };
        pixels.map(point).collect()
    }

    /// The pixel that shows a place, where nothing hides it.
    pub fn pixel_of(&self, place: DVec3, size: [u32; 2]) -> Option<usize> {
        let way = place - EYE;
        if way.z <= 0.0 {
            return None;
        }
        let at = |x: f64, n: u32| {
            let i = (0.5 * (x / way.z / HALF + 1.0) * f64::from(n)).floor();
            (0.0..f64::from(n)).contains(&i).then_some(i as usize)
        };
        let pixel = at(-way.y, size[1])? * size[0] as usize + at(way.x, size[0])?;
        let eye = LitPoint {
            position: EYE,
            normal: DVec3::Z,
            reflectance: DVec3::ZERO,
        };
        let light = SurfaceLight {
            position: place,
            normal: DVec3::ZERO,
            power: DVec3::ZERO,
            bounce: 0,
        };
        self.sees(&eye, &light).then_some(pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_show_the_places_that_show_there() {
        let unit_box = UnitBox::load().unwrap();
        let size = [24, 15];
        for (i, point) in unit_box.points(size).unwrap().iter().enumerate() {
            // Its middle, off by the offset of the point alone.
            let found = unit_box.pixel_of(point.position + 1e-5 * point.normal, size);
            assert!(found == Some(i) || found.is_none(), "{i}: {found:?}");
        }
        let lights = unit_box.lights(20, 0, Survival::Roulette);
        assert!(
            lights
                .iter()
                .filter(|light| unit_box.pixel_of(light.position, size).is_some())
                .count()
                > 10
        );
    }
}
