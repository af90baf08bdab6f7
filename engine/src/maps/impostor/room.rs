//! Rooms of boxes seen from their middle: exact distances, hits and visibility, and the rays that a shiny sphere in them sends. What
//! searches in impostors are judged by.
//!
//! The walls are those of \[-1, 1\]³, seen from inside; the map's place o is the origin. A box may stand in the room. Everything is a closed
//! form in f64: tests of rays against slabs, and of rays against a sphere. Deterministic.

use glam::DVec3;

use super::proxy::{mirrored, refracted};
use super::{ImpostorRay, ImpostorSurface};

/// The walls.
const WALLS: [DVec3; 2] = [DVec3::NEG_ONE, DVec3::ONE];
/// By how much a point may be beyond the surface that o sees and still be that surface, relatively: the rounding of the two ways to it.
const SEEN: f64 = 1e-9;

/// The room \[-1, 1\]³, with or without a box in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxRoom {
    /// Lower and upper corner of the box; o is outside of it.
    pub obstacle: Option<[DVec3; 2]>,
}

/// Where a ray enters and leaves a box, with the normals there, both outwards.
fn slab(x: DVec3, r: DVec3, [low, high]: [DVec3; 2]) -> Option<[(f64, DVec3); 2]> {
    let mut enter = (f64::NEG_INFINITY, DVec3::ZERO);
    let mut leave = (f64::INFINITY, DVec3::ZERO);
    for axis in 0..3 {
        if r[axis] == 0.0 {
            if x[axis] < low[axis] || x[axis] > high[axis] {
                return None;
            }
            continue;
        }
        let side = r[axis].signum() * DVec3::AXES[axis];
        let (near, far) = if r[axis] > 0.0 { (low, high) } else { (high, low) };
        let (first, last) = ((near[axis] - x[axis]) / r[axis], (far[axis] - x[axis]) / r[axis]);
        if first > enter.0 {
            enter = (first, -side);
        }
        if last < leave.0 {
            leave = (last, side);
        }
    }
    (enter.0 < leave.0).then_some([enter, leave])
}

impl BoxRoom {
    /// Walls alone.
    pub const EMPTY: Self = Self { obstacle: None };
    /// A box on the floor.
    pub const BOX: Self = Self {
        obstacle: Some([DVec3::new(-0.2, -1.0, 0.35), DVec3::new(0.3, -0.1, 0.75)]),
    };
    /// A pillar from floor to ceiling.
    pub const PILLAR: Self = Self {
        obstacle: Some([DVec3::new(0.2, -1.0, -0.2), DVec3::new(0.45, 1.0, 0.2)]),
    };

    /// All surfaces that a ray from o crosses, nearest first: both sides of the box, where it meets it, and the wall.
    pub fn surfaces(&self, direction: DVec3) -> Vec<ImpostorSurface> {
        let Some(d) = direction.try_normalize() else {
            return Vec::new();
        };
        let of_box = self.obstacle.and_then(|obstacle| slab(DVec3::ZERO, d, obstacle));
        let of_box = of_box.filter(|[enter, _]| enter.0 > 0.0);
        let wall = slab(DVec3::ZERO, d, WALLS).map(|[_, (distance, normal)]| (distance, -normal));
        let all = of_box.into_iter().flatten().chain(wall);
        all.map(|(distance, normal)| ImpostorSurface { distance, normal })
            .collect()
    }

    /// Distance to the first surface that a ray meets from a point in the room; the direction is a unit vector.
    pub fn hit(&self, x: DVec3, r: DVec3) -> f64 {
        self.surface_from(x, r).distance
    }

    /// The first surface that a ray meets from a point in the room, nowhere on a surface; the direction is a unit vector.
    pub fn surface_from(&self, x: DVec3, r: DVec3) -> ImpostorSurface {
        let of_box = self.obstacle.and_then(|obstacle| slab(x, r, obstacle));
        let enters = of_box.map(|[enter, _]| enter).filter(|enter| enter.0 > 0.0);
        let wall = || slab(x, r, WALLS).map(|[_, (distance, normal)]| (distance, -normal));
        let (distance, normal) = enters.or_else(wall).unwrap_or((f64::INFINITY, -r));
        ImpostorSurface { distance, normal }
    }

    /// Whether o sees a point of a surface.
    pub fn sees(&self, point: DVec3) -> bool {
        let first = self.surfaces(point);
        first
            .first()
            .is_some_and(|surface| surface.distance >= point.length() * (1.0 - SEEN))
    }

    /// Angle at o between a direction and the true hit of a ray, in degrees.
    pub fn error(&self, ray: &ImpostorRay, direction: DVec3) -> f64 {
        let hit = ray.origin + self.hit(ray.origin, ray.direction) * ray.direction;
        hit.cross(direction).length().atan2(hit.dot(direction)).to_degrees()
    }

    /// Whether o sees what a ray meets.
    pub fn sees_hit(&self, ray: &ImpostorRay) -> bool {
        self.sees(ray.origin + self.hit(ray.origin, ray.direction) * ray.direction)
    }
}

/// A sphere in a room, and who looks at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShinySphere {
    /// Its name in tables.
    pub name: &'static str,
    /// Where it stands.
    pub room: BoxRoom,
    /// Middle.
    pub centre: DVec3,
    /// Radius.
    pub radius: f64,
    /// The pinhole of the camera, which looks at the middle with +y up.
    pub camera: DVec3,
}

const CORNER: DVec3 = DVec3::new(-0.8, 0.1, -0.7);

impl ShinySphere {
    /// About o.
    pub const A: Self = Self::of("A", BoxRoom::EMPTY, DVec3::ZERO, 0.3, CORNER);
    /// Half-way to a wall.
    pub const B: Self = Self::of("B", BoxRoom::EMPTY, DVec3::new(0.5, 0.0, 0.0), 0.3, CORNER);
    /// In a corner.
    pub const C: Self = Self::of("C", BoxRoom::EMPTY, DVec3::new(0.55, -0.6, 0.55), 0.3, CORNER);
    /// Beside a box on the floor.
    pub const BOX: Self = Self::of("box", BoxRoom::BOX, DVec3::new(0.5, -0.2, -0.35), 0.25, CORNER);
    /// Beside a pillar.
    pub const P1: Self = Self::of(
        "P1",
        BoxRoom::PILLAR,
        DVec3::new(0.35, 0.0, 0.65),
        0.2,
        DVec3::new(-0.7, 0.2, 0.1),
    );
    /// Behind the pillar: o sees nothing of the sphere.
    pub const P2: Self = Self::of(
        "P2",
        BoxRoom::PILLAR,
        DVec3::new(0.75, 0.0, 0.0),
        0.15,
        DVec3::new(0.6, 0.1, -0.8),
    );

    const fn of(name: &'static str, room: BoxRoom, centre: DVec3, radius: f64, camera: DVec3) -> Self {
        Self {
            name,
            room,
            centre,
            radius,
            camera,
        }
    }

    /// What the camera's rays become at the sphere, by the middles of `side`² pixels of a square that just holds it, for pixels that show
    /// it: mirrored ones, or refracted ones into a body with so many times the index of what surrounds it.
    pub fn rays(&self, side: u32, index: Option<f64>) -> Vec<ImpostorRay> {
        self.pixels(side, index).into_iter().flatten().collect()
    }

    /// The same of all pixels, row by row from below; `None` for those that do not show it.
    pub fn pixels(&self, side: u32, index: Option<f64>) -> Vec<Option<ImpostorRay>> {
        let to_centre = self.centre - self.camera;
        let forward = to_centre.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half = (self.radius / to_centre.length()).asin().tan();
        let at = |i: u32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(side) - 1.0);
        let pixels = (0..side * side).map(|i| (forward + at(i % side) * right + at(i / side) * up).normalize());
        let ray = |d: DVec3| {
            let along = d.dot(to_centre);
            let root = along * along - to_centre.length_squared() + self.radius * self.radius;
            if root < 0.0 {
                return None;
            }
            let origin = self.camera + (along - root.sqrt()) * d;
            let normal = (origin - self.centre) / self.radius;
            let direction = match index {
                None => mirrored(d, normal),
                Some(index) => refracted(d, normal, 1.0 / index),
            };
            Some(ImpostorRay { origin, direction })
        };
        pixels.map(ray).collect()
    }
}
