//! Lamps, and their directions as points of a domain in which equal areas have equal shares of their power.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::gpu::shaders::constants::SPOT_COS_RANGE_MIN;
use crate::scene::LightKind;
use crate::transport::lights::light_power;

/// Where the directions of a lamp are points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// The unit disc about the origin, where z is 0.
    Disc,
    /// The unit sphere about the origin.
    Sphere,
}

/// A point light or a spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamp {
    position: DVec3,
    power: DVec3,
    cone: Option<Cone>,
}

/// A spot's directions, and how its power is spread over the cosines of their angles with the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cone {
    axis: DVec3,
    /// Cosine of the rim, at which nothing is sent.
    outer: f64,
    /// Cosine at which the falloff begins.
    inner: f64,
    /// Over which cosines the falloff would go from nothing to one.
    width: f64,
}

impl Cone {
    /// Integral of the falloff over the cosines from one of them to the axis.
    fn beyond(&self, cosine: f64) -> f64 {
        let ramp = |cosine: f64| (cosine - self.outer).max(0.0).powi(3);
        let flat = 1.0 - cosine.max(self.inner);
        let falling = ramp(self.inner) - ramp(cosine.min(self.inner));
        flat + falling / (3.0 * self.width * self.width)
    }

    /// The cosine beyond which the integral is `share` of all.
    fn cosine(&self, share: f64) -> f64 {
        let wanted = share * self.beyond(self.outer);
        let flat = 1.0 - self.inner;
        if wanted <= flat {
            return 1.0 - wanted;
        }
        let left = (self.inner - self.outer).powi(3) - 3.0 * self.width * self.width * (wanted - flat);
        self.outer + left.max(0.0).cbrt()
    }
}

impl Lamp {
    /// That of a light; `None` for parallel light, which has no place.
    pub fn new(kind: &LightKind) -> Option<Self> {
        let power = light_power(kind, 0.0);
        match *kind {
            LightKind::Point { position, .. } => Some(Self {
                position: position.as_dvec3(),
                power,
                cone: None,
            }),
            LightKind::Spot {
                position,
                direction,
                inner,
                outer,
                ..
            } => {
                let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
                let width = (inner - outer).max(f64::from(SPOT_COS_RANGE_MIN));
                let cone = Cone {
                    axis: direction.as_dvec3().normalize_or(DVec3::Z),
                    outer,
                    inner: (outer + width).min(1.0),
                    width,
                };
                Some(Self {
                    position: position.as_dvec3(),
                    power,
                    cone: Some(cone),
                })
            }
            LightKind::Directional { .. } => None,
        }
    }

    /// Where it is, metres.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// What it sends, W.
    pub fn power(&self) -> DVec3 {
        self.power
    }

    /// Where its directions are points.
    pub fn domain(&self) -> Domain {
        match self.cone {
            Some(_) => Domain::Disc,
            None => Domain::Sphere,
        }
    }

    /// The point of a unit direction; `None` where the lamp sends nothing, and for what is no direction.
    pub fn point_of(&self, direction: DVec3) -> Option<DVec3> {
        let is_direction = direction.length_squared() > 0.5;
        if !is_direction {
            return None;
        }
        let Some(cone) = &self.cone else {
            return Some(direction);
        };
        let cosine = direction.dot(cone.axis);
        if cosine <= cone.outer {
            return None;
        }
        let radius = (cone.beyond(cosine) / cone.beyond(cone.outer)).clamp(0.0, 1.0).sqrt();
        let (right, up) = cone.axis.any_orthonormal_pair();
        let across = DVec3::new(direction.dot(right), direction.dot(up), 0.0);
        Some(radius * across.normalize_or_zero())
    }

    /// The unit direction of a point.
    pub fn direction_of(&self, point: DVec3) -> DVec3 {
        let Some(cone) = &self.cone else {
            return point.normalize_or(DVec3::Z);
        };
        let cosine = cone.cosine(point.length_squared().min(1.0)).clamp(-1.0, 1.0);
        let (right, up) = cone.axis.any_orthonormal_pair();
        let across = (right * point.x + up * point.y).normalize_or_zero();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        (cosine * cone.axis + sine * across).normalize_or(cone.axis)
    }
}

impl Domain {
    /// Its area.
    pub fn area(self) -> f64 {
        match self {
            Self::Disc => 0.5 * TAU,
            Self::Sphere => 2.0 * TAU,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use crate::transport::lights::spot_falloff;
    use glam::Vec3;

    fn spot(inner: f32, outer: f32) -> LightKind {
        LightKind::Spot {
            position: Vec3::new(1.0, 2.0, 3.0),
            direction: Vec3::new(0.36, 0.48, 0.8),
            intensity: Vec3::new(1.0, 2.0, 3.0),
            inner,
            outer,
        }
    }

    /// With falloff, without, over in less than its least width, and wider than a half space.
    const CONES: [(f32, f32); 4] = [(0.2, 0.7), (0.5, 0.5), (0.0, 0.02), (1.0, 2.0)];

    #[test]
    fn directions_are_found_again_and_lie_within_the_cone() {
        let mut random = Random(3);
        for (inner, outer) in CONES {
            let lamp = Lamp::new(&spot(inner, outer)).expect("a lamp");
            assert_eq!(lamp.domain(), Domain::Disc);
            for _ in 0..200 {
                let mut unit = || f64::from(random.unit());
                let (angle, radius) = (TAU * unit(), unit().sqrt() * 0.999);
                let point = DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
                let direction = lamp.direction_of(point);
                assert!((direction.length() - 1.0).abs() < 1e-12);
                let again = lamp.point_of(direction).expect("within the cone");
                assert!((again - point).length() < 1e-6, "{inner} {outer}: {point} {again}");
            }
            assert!(lamp.point_of(-Vec3::new(0.36, 0.48, 0.8).as_dvec3()).is_none());
            assert!(lamp.point_of(DVec3::ZERO).is_none());
        }
        let point = LightKind::Point {
            position: Vec3::ZERO,
            intensity: Vec3::ONE,
        };
        let lamp = Lamp::new(&point).expect("a lamp");
        assert_eq!(
            (lamp.domain(), lamp.point_of(DVec3::Y)),
            (Domain::Sphere, Some(DVec3::Y))
        );
        let parallel = LightKind::Directional {
            direction: Vec3::Y,
            irradiance: Vec3::ONE,
        };
        assert!(Lamp::new(&parallel).is_none());
    }

    /// The share of a disc about the middle is the share of the power that the lamp sends there, by the trapezium rule over its falloff.
    #[test]
    fn equal_areas_have_equal_shares_of_the_power() {
        for (inner, outer) in CONES {
            let (cos_inner, cos_outer) = (f64::from(inner).cos(), f64::from(outer).cos());
            let lamp = Lamp::new(&spot(inner, outer)).expect("a lamp");
            let axis = lamp.direction_of(DVec3::ZERO);
            let steps = 20_000;
            let flux = |from: f64| {
                let width = (1.0 - from) / f64::from(steps);
                let at = |i: i32| spot_falloff(from + (f64::from(i) + 0.5) * width, cos_inner, cos_outer);
                TAU * width * (0..steps).map(at).sum::<f64>()
            };
            let all = flux(cos_outer);
            assert!((lamp.power().x / all - 1.0).abs() < 1e-4, "{inner} {outer}");
            for share in [0.1, 0.5, 0.9] {
                let rim = lamp.direction_of(DVec3::X * f64::sqrt(share));
                let found = flux(rim.dot(axis)) / all;
                assert!((found - share).abs() < 1e-4, "{inner} {outer}: {found} {share}");
            }
        }
    }
}
