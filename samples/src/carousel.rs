//! A light that goes around the vertical axis through the middle of its scene.

use clerestory::scene::{LightKind, Scene, SceneProfile};
use clerestory::transport::lights::light_power;
use clerestory::{Error, Result};
use glam::{DQuat, DVec3, Vec3};

/// Least radius of the circle, as a share of the scene's lesser side: a light nearer to the axis is moved away from it.
const RADIUS: f64 = 0.2;

/// A light without area and its circle. Directional ones turn, spots turn as they go.
#[derive(Debug, Clone)]
pub struct Carousel {
    light: usize,
    start: LightKind,
    middle: DVec3,
    /// From the axis, metres.
    least: f64,
}

impl Carousel {
    /// The first light of the scene that can go around.
    ///
    /// # Errors
    /// [`Error::Scene`] for a scene without.
    pub fn new(scene: &Scene) -> Result<Self> {
        let [low, high] = SceneProfile::of(scene)
            .bounds
            .unwrap_or_default()
            .map(DVec3::from_array);
        let mut lights = scene.lights.iter().map(|light| light.kind).enumerate();
        let has_power = |kind: &LightKind| light_power(kind, 1.0).max_element() > 0.0;
        let found = lights.find(|(_, kind)| has_power(kind));
        let (light, start) = found.ok_or_else(|| Error::Scene {
            file: scene.source.clone(),
            at: "lights".into(),
            cause: "holds no point, spot or directional light that could move".into(),
        })?;
        let size = high - low;
        Ok(Self {
            light,
            start,
            middle: low.midpoint(high),
            least: RADIUS * size.x.min(size.z),
        })
    }

    /// Index of the light in the scene.
    pub fn light(&self) -> usize {
        self.light
    }

    /// The light after it has gone around by an angle in radians, from +Z towards +X.
    pub fn at(&self, angle: f64) -> LightKind {
        let turn = DQuat::from_rotation_y(angle);
        let moved = |position: Vec3| {
            let mut from_axis = position.as_dvec3() - self.middle;
            if from_axis.x.hypot(from_axis.z) < self.least {
                from_axis = DVec3::new(self.least, from_axis.y, 0.0);
            }
            (self.middle + turn * from_axis).as_vec3()
        };
        let turned = |direction: Vec3| (turn * direction.as_dvec3()).normalize().as_vec3();
        let mut kind = self.start;
        match &mut kind {
            LightKind::Point { position, .. } => *position = moved(*position),
            LightKind::Spot {
                position, direction, ..
            } => (*position, *direction) = (moved(*position), turned(*direction)),
            LightKind::Directional { direction, .. } => *direction = turned(*direction),
        }
        kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::scene;

    fn position(kind: LightKind) -> Vec3 {
        match kind {
            LightKind::Point { position, .. } => position,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_light_goes_around_the_middle() -> Result<()> {
        // The ring stands in the middle of a box of 4 m × 4 m, its light at (1.7, 1, 0).
        let ring = Carousel::new(&scene::load("builtin:ring")?)?;
        let quarters = [
            (0.0, [1.7, 1.0, 0.0]),
            (90.0, [0.0, 1.0, -1.7]),
            (180.0, [-1.7, 1.0, 0.0]),
        ];
        for (degrees, expected) in quarters {
            let found = position(ring.at(f64::to_radians(degrees)));
            // Positions of up to 2 m in f32.
            assert!(
                (found - Vec3::from_array(expected)).length() < 1e-6,
                "{degrees}: {found}"
            );
        }
        // That of the room of 6 m × 6 m hangs in the middle.
        let room = Carousel::new(&scene::load("builtin:box-room?source=point")?)?;
        assert!((position(room.at(0.0)) - Vec3::new(4.2, 2.5, 3.0)).length() < 1e-6);
        Ok(())
    }

    #[test]
    fn a_scene_without_such_lights_is_refused() -> Result<()> {
        let error = Carousel::new(&scene::load("builtin:cornell-box")?).err();
        assert!(error.is_some_and(|error| error.to_string().contains("no point, spot or directional light")));
        Ok(())
    }
}
