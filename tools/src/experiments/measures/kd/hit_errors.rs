//! A hit in f32 against all triangles: the same search in f32, to the bit, and in f64, up to the stated bounds of the watertight test.
//!
//! The bounds are those of `clerestory::accel::triangle`, with u = 2⁻²⁴, M the largest coordinate distance of one of the triangle's corners
//! from the ray's origin and |d| the largest component of the direction: the point that a hit's weights name lies within 16uM of the ray,
//! seen along the dominant axis, and within 32uM when the rounding of the reported weights counts too; its parameter is within 18uM/|d| of
//! the point's. So the parameter is within 18uM/|d| + 16uM·s of where the ray meets the triangle's plane, where s is the sum of the sizes of
//! both slopes of the plane's parameter.

use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use clerestory::accel::yardstick::intersect_triangle_f64;
use clerestory::accel::{Hit, MAX_COORDINATE, Ray};
use glam::{DVec3, Vec3};

use super::flights::different;
use crate::experiments::measures::errors::greatest;

/// Unit roundoff of f32.
const U: f64 = 1.0 / 16_777_216.0;
/// Of the parameter at the point that the weights name, in uM/|d|.
const PARAMETER: f64 = 18.0;
/// Of that point's distance along each sheared axis, in uM: as it is met, and as the reported weights name it.
const POINT: f64 = 16.0;
const REPORTED_POINT: f64 = 32.0;

/// A ray and a triangle in f64, seen along the ray: z is the ray's parameter.
pub struct Sheared {
    /// With the ray in the origin of x and y.
    pub corners: [DVec3; 3],
    /// u times the largest distance of a corner.
    unit: f64,
    /// Largest component of the direction.
    direction: f64,
}

impl Sheared {
    /// What a ray sees of a triangle.
    pub fn new(ray: &Ray, triangle: &[Vec3; 3]) -> Self {
        let origin = Vec3::from(ray.origin).as_dvec3();
        let axis = ray_shear(Vec3::ZERO, ray.direction.into()).axis;
        let last = |v: DVec3| match axis {
            0 => DVec3::new(v.y, v.z, v.x),
            1 => DVec3::new(v.z, v.x, v.y),
            _ => v,
        };
        let d = last(Vec3::from(ray.direction).as_dvec3());
        let from_origin = triangle.map(|corner| corner.as_dvec3() - origin);
        let reach = greatest(from_origin.iter().flat_map(|v| v.abs().to_array()));
        Self {
            corners: from_origin.map(|v| {
                let v = last(v);
                DVec3::new(v.x - d.x / d.z * v.z, v.y - d.y / d.z * v.z, v.z / d.z)
            }),
            unit: U * reach,
            direction: d.z.abs(),
        }
    }

    /// The parameter where the ray meets the triangle's plane, and the bound of what a hit reports of it; infinite when seen edge-on.
    pub fn plane(&self) -> (f64, f64) {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let slopes = (normal.x.abs() + normal.y.abs()) / normal.z.abs();
        let bound = self.unit * (PARAMETER / self.direction + POINT * slopes);
        (
            normal.dot(a) / normal.z,
            if bound.is_nan() { f64::INFINITY } else { bound },
        )
    }

    /// What no rounding of sheared corners exceeds, a length along a diagonal: the ray's distance from edges to be clear of them.
    pub fn rounding(&self) -> f64 {
        POINT * std::f64::consts::SQRT_2 * self.unit
    }

    /// Distance of the ray from the nearest edge, positive inside.
    fn depth_inside(&self) -> f64 {
        let [a, b, c] = self.corners;
        let edge = |p: DVec3, q: DVec3| (p.x * q.y - p.y * q.x, (q - p).truncate().length());
        let edges = [edge(b, c), edge(c, a), edge(a, b)];
        let area: f64 = edges.iter().map(|(product, _)| product).sum();
        let depths = edges.iter().map(|(product, length)| product * area.signum() / length);
        depths.fold(f64::INFINITY, f64::min)
    }
}

/// Triangles that rays can meet, with their places.
pub struct Reachable(Vec<(u32, [Vec3; 3])>);

impl Reachable {
    /// Those in range and of an area in f64.
    pub fn among(triangles: &[[Vec3; 3]]) -> Self {
        let can_be_met = |triangle: &[Vec3; 3]| {
            let [a, b, c] = triangle.map(|corner| corner.as_dvec3());
            let in_range = |corner: &Vec3| corner.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
            triangle.iter().all(in_range) && (b - a).cross(c - a) != DVec3::ZERO
        };
        let all = (0..).zip(triangles.iter().copied());
        Self(all.filter(|(_, triangle)| can_be_met(triangle)).collect())
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.0.len()
    }
}

/// What a search through all triangles says of a hit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Verdict {
    /// Hits that are not those of the search in f32 (0 or 1 of one hit).
    pub different: u64,
    /// Hits above a bound.
    pub above: u64,
    /// Error of the parameter over its bound, also against triangles that f64 meets clearly inside and nearer.
    pub parameter: f64,
    /// Distance of the reported point from the ray over its bound.
    pub point: f64,
}

impl Verdict {
    /// Of both: sums of counts and the largest errors, not a number where one is none.
    pub fn and(self, other: Self) -> Self {
        Self {
            different: self.different + other.different,
            above: self.above + other.above,
            parameter: greatest([self.parameter, other.parameter]),
            point: greatest([self.point, other.point]),
        }
    }
}

/// Judges the closest hit that an index reports for a ray.
pub fn judge(reachable: &Reachable, ray: &Ray, hit: &Hit) -> Verdict {
    let mut best = Hit::none(ray.t_max);
    if !ray.is_traceable() {
        return Verdict {
            different: different(&[best], &[*hit]),
            ..Verdict::default()
        };
    }
    let shear = ray_shear(ray.origin.into(), ray.direction.into());
    let mut nearer = Vec::new();
    let mut met = None;
    for (place, triangle) in &reachable.0 {
        if let Some(found) = intersect_triangle(&shear, triangle, ray.t_min, best.t)
            && (found.t < best.t || !best.is_hit())
        {
            best = Hit {
                t: found.t,
                barycentrics: [found.u, found.v],
                triangle: *place,
            };
        }
        if *place == hit.triangle {
            met = Some(Sheared::new(ray, triangle));
        }
        if intersect_triangle_f64(ray, triangle).is_some_and(|found| !hit.is_hit() || found.t < f64::from(hit.t)) {
            nearer.push(Sheared::new(ray, triangle));
        }
    }
    let mut verdict = Verdict {
        different: different(&[best], &[*hit]),
        ..Verdict::default()
    };
    if let Some(met) = met {
        let (t, bound) = met.plane();
        if bound.is_finite() {
            verdict.parameter = (f64::from(hit.t) - t).abs() / bound;
        }
        let [u, v] = hit.barycentrics.map(f64::from);
        let [a, b, c] = met.corners;
        let point = a + u * (b - a) + v * (c - a);
        verdict.point = greatest(point.truncate().abs().to_array()) / (REPORTED_POINT * met.unit);
    }
    for triangle in nearer {
        let (t, bound) = triangle.plane();
        // So far inside that no rounding loses it, and clear of the ray's ends.
        let is_clear = triangle.depth_inside() > triangle.rounding()
            && t - bound > f64::from(ray.t_min)
            && t + bound < f64::from(ray.t_max);
        if is_clear {
            let lost = if hit.is_hit() {
                (f64::from(hit.t) - t) / bound
            } else {
                f64::INFINITY
            };
            verdict.parameter = greatest([verdict.parameter, lost]);
        }
    }
    let is_within = verdict.parameter <= 1.0 && verdict.point <= 1.0;
    verdict.above = u64::from(!is_within);
    verdict
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Reachable {
        let at = |z: f32| {
            [
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(3.0, -1.0, z),
                Vec3::new(-1.0, 3.0, z),
            ]
        };
        Reachable::among(&[at(5.0), [Vec3::ZERO; 3], at(2.0)])
    }

    fn hit(t: f32, triangle: u32) -> Hit {
        Hit {
            t,
            barycentrics: [0.25, 0.25],
            triangle,
        }
    }

    const RAY: Ray = Ray {
        origin: [0.0; 3],
        t_min: 0.0,
        direction: [0.0, 0.0, 1.0],
        t_max: f32::INFINITY,
    };

    #[test]
    fn right_hits_pass_and_wrong_ones_do_not() {
        let reachable = two();
        assert_eq!(reachable.count(), 2);
        let right = judge(&reachable, &RAY, &hit(2.0, 2));
        assert_eq!((right.different, right.above), (0, 0), "{right:?}");
        for wrong in [hit(5.0, 0), Hit::none(f32::INFINITY), hit(2.001, 2)] {
            let verdict = judge(&reachable, &RAY, &wrong);
            assert!(
                verdict.different == 1 && verdict.above == 1 && verdict.parameter > 1.0,
                "{verdict:?}"
            );
        }
        let beside = Hit {
            barycentrics: [0.2501, 0.25],
            ..hit(2.0, 2)
        };
        assert!(judge(&reachable, &RAY, &beside).point > 1.0);
        for broken in [
            hit(f32::NAN, 2),
            Hit {
                barycentrics: [f32::NAN; 2],
                ..hit(2.0, 2)
            },
        ] {
            let verdict = judge(&reachable, &RAY, &broken);
            let errors = |verdict: Verdict| greatest([verdict.parameter, verdict.point]);
            assert_eq!(verdict.above, 1, "{verdict:?}");
            assert!(errors(verdict.and(right)).is_nan() && errors(right.and(verdict)).is_nan());
        }
        let last_bit = Hit {
            t: f32::from_bits(2.0f32.to_bits() + 1),
            ..hit(2.0, 2)
        };
        let verdict = judge(&reachable, &RAY, &last_bit);
        assert_eq!(
            (verdict.different, verdict.above),
            (1, 0),
            "rounding is within the bound"
        );
    }
}
