//! A camera that turns around a point, moves with the hand and comes nearer, beginning at a scene's own camera.
//!
//! A pose is azimuth, elevation and roll (the rotation is yaw · pitch · roll in this order), the distance to a target and the target, so
//! any camera is taken over exactly, tilted ones and those that look straight down included. The roll stays as it was.

use clerestory::scene::{Camera, Projection};
use glam::{DAffine3, DMat3, DVec3};

/// Greatest elevation of the eye above or below the target, radians: nearer to the vertical, dragging would turn the view on the spot.
const ELEVATION: f64 = 88.0 * std::f64::consts::PI / 180.0;
/// Least and greatest distance, as factors of that at the start.
const ZOOM: [f64; 2] = [0.01, 100.0];
/// Below this cosine of its elevation a view has no azimuth to speak of.
const VERTICAL: f64 = 1e-6;

/// Where the camera is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// What it turns around, metres.
    pub target: DVec3,
    /// Angle around the vertical, from +Z towards +X, radians.
    pub azimuth: f64,
    /// Angle of the eye above the target, radians.
    pub elevation: f64,
    /// Turn of the picture around the view axis, radians.
    pub roll: f64,
    /// Distance (perspective) or height of the view (orthographic) as a factor of that at the start.
    pub zoom: f64,
}

/// A camera on an orbit.
#[derive(Debug, Clone)]
pub struct Orbit {
    camera: Camera,
    distance: f64,
    start: Pose,
    pose: Pose,
}

impl Orbit {
    /// An orbit that begins at `camera`. The target is the point on the view axis nearest to the middle of `bounds` (least and greatest
    /// corner, metres); where that lies behind the eye, or for an empty scene, a point in front of it.
    pub fn new(camera: &Camera, bounds: Option<[[f64; 3]; 2]>) -> Self {
        let DAffine3 { matrix3, translation } = camera.transform;
        let back = matrix3.z_axis.normalize();
        let [low, high] = bounds.unwrap_or_default().map(DVec3::from_array);
        let radius = (0.5 * (high - low).length()).max(1e-3 * translation.length());
        let ahead = (translation - low.midpoint(high)).dot(back);
        let distance = [ahead, radius, 1.0]
            .into_iter()
            .find(|distance| *distance > 1e-3 * radius && *distance > 0.0)
            .unwrap_or(1.0);
        let flat = back.x.hypot(back.z);
        let azimuth = if flat > VERTICAL {
            back.x.atan2(back.z)
        } else {
            (-matrix3.x_axis.z).atan2(matrix3.x_axis.x)
        };
        let mut start = Pose {
            target: translation - distance * back,
            azimuth,
            elevation: back.y.atan2(flat),
            roll: 0.0,
            zoom: 1.0,
        };
        // What is left of the rotation once yaw and pitch are undone.
        let across = rotation(&start).transpose() * matrix3.x_axis;
        start.roll = across.y.atan2(across.x);
        Self {
            camera: camera.clone(),
            distance,
            start,
            pose: start,
        }
    }

    /// Turns by angles in radians.
    pub fn turn(&mut self, azimuth: f64, elevation: f64) {
        let pose = &mut self.pose;
        pose.azimuth = (pose.azimuth + azimuth) % std::f64::consts::TAU;
        // A start beyond the bound may stay, or come back.
        let (low, high) = (pose.elevation.min(-ELEVATION), pose.elevation.max(ELEVATION));
        pose.elevation = (pose.elevation + elevation).clamp(low, high);
    }

    /// Moves target and eye within the picture's plane: right and up, as shares of the height that is seen at the target.
    pub fn pan(&mut self, right: f64, up: f64) {
        let height = match self.camera.projection {
            Projection::Perspective { fov_y } => 2.0 * (0.5 * f64::from(fov_y)).tan() * self.distance,
            Projection::Orthographic { half_height } => 2.0 * f64::from(half_height),
        };
        let axes = rotation(&self.pose);
        self.pose.target += height * self.pose.zoom * (right * axes.x_axis + up * axes.y_axis);
    }

    /// Flies on: the eye moves to its right by metres and looks further to the right by an angle in radians; the target stays ahead of it.
    pub fn fly(&mut self, right: f64, turn: f64) {
        let axes = rotation(&self.pose);
        let ahead = self.eye_distance();
        let eye = self.pose.target + ahead * axes.z_axis + right * axes.x_axis;
        self.pose.azimuth = (self.pose.azimuth - turn) % std::f64::consts::TAU;
        self.pose.target = eye - ahead * rotation(&self.pose).z_axis;
    }

    /// Comes nearer (below 1) or goes away: distance or height of the view are multiplied by `factor`.
    pub fn zoom(&mut self, factor: f64) {
        self.pose.zoom = (self.pose.zoom * factor).clamp(ZOOM[0], ZOOM[1]);
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        self.pose = self.start;
    }

    /// Where the camera is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// The scene's camera at this place. A lens stays focused on what it was focused on at the start, in proportion.
    pub fn camera(&self) -> Camera {
        let Pose { target, zoom, .. } = self.pose;
        let axes = rotation(&self.pose);
        let mut camera = self.camera.clone();
        match &mut camera.projection {
            Projection::Perspective { .. } => camera.focus_distance *= zoom as f32,
            Projection::Orthographic { half_height } => *half_height *= zoom as f32,
        }
        camera.transform = DAffine3::from_mat3_translation(axes, target + self.eye_distance() * axes.z_axis);
        camera
    }

    /// From target to eye, metres.
    fn eye_distance(&self) -> f64 {
        match self.camera.projection {
            Projection::Perspective { .. } => self.distance * self.pose.zoom,
            Projection::Orthographic { .. } => self.distance,
        }
    }
}

/// Camera axes: right, up, back.
fn rotation(pose: &Pose) -> DMat3 {
    DMat3::from_rotation_y(pose.azimuth) * DMat3::from_rotation_x(-pose.elevation) * DMat3::from_rotation_z(pose.roll)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Option<[[f64; 3]; 2]> = Some([[-1.0, -2.0, -3.0], [3.0, 2.0, 1.0]]);

    /// Largest difference of any number of two placements.
    fn difference(a: &Camera, b: &Camera) -> f64 {
        let (a, b) = (a.transform.to_cols_array(), b.transform.to_cols_array());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    fn looking(eye: DVec3, target: DVec3, up: DVec3) -> Camera {
        Camera::look_at("camera", eye, target, up, 0.7)
    }

    #[test]
    fn the_start_is_the_scenes_camera() {
        let eye = DVec3::new(4.0, 1.5, 6.0);
        let upright = [
            looking(eye, DVec3::ZERO, DVec3::Y),
            looking(-eye, DVec3::ZERO, DVec3::Y),
            // Tilted, upside down, straight down, straight up, nearly so, and with everything behind the eye.
            looking(eye, DVec3::X, DVec3::new(0.3, 1.0, -0.2)),
            looking(eye, DVec3::X, DVec3::NEG_Y),
            looking(DVec3::new(0.0, 9.0, 0.0), DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)),
            looking(DVec3::new(0.0, -9.0, 0.0), DVec3::ZERO, DVec3::X),
            looking(DVec3::new(1e-7, 9.0, 1e-8), DVec3::ZERO, DVec3::Z),
            looking(eye, 2.0 * eye, DVec3::Y),
            looking(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y),
        ];
        for (i, camera) in upright.iter().enumerate() {
            for bounds in [BOUNDS, None, Some([[0.0; 3]; 2])] {
                let orbit = Orbit::new(camera, bounds);
                let found = difference(&orbit.camera(), camera);
                assert!(found < 1e-5, "camera {i}: off by {found}");
                assert_eq!(orbit.camera().projection, camera.projection);
                assert_eq!(orbit.camera().focus_distance, camera.focus_distance);
            }
        }
    }

    #[test]
    fn every_generated_scenes_camera_is_reproduced() -> clerestory::Result<()> {
        for name in ["cornell-box", "passage", "ring", "materials", "slab"] {
            let scene = clerestory::scene::load(&format!("builtin:{name}"))?;
            let bounds = clerestory::scene::SceneProfile::of(&scene).bounds;
            for camera in &scene.cameras {
                assert!(
                    difference(&Orbit::new(camera, bounds).camera(), camera) < 1e-5,
                    "{name}"
                );
            }
        }
        Ok(())
    }

    #[test]
    fn the_target_is_the_point_of_the_axis_nearest_to_the_middle() {
        let middle = DVec3::new(1.0, 0.0, -1.0);
        let camera = looking(DVec3::new(5.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let target = Orbit::new(&camera, BOUNDS).pose().target;
        let axis = camera.transform.matrix3.z_axis;
        assert!((target - middle).dot(axis).abs() < 1e-12);
        assert!((target - camera.transform.translation).cross(axis).length() < 1e-12);
    }

    #[test]
    fn turning_keeps_distance_and_target_in_the_middle() {
        let camera = looking(DVec3::new(5.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let mut orbit = Orbit::new(&camera, BOUNDS);
        let before = orbit.pose();
        orbit.turn(1.0, 0.3);
        let turned = orbit.camera().transform;
        let distance = |eye: DVec3| (eye - before.target).length();
        assert!((distance(turned.translation) - distance(camera.transform.translation)).abs() < 1e-12);
        let to_target = (before.target - turned.translation).normalize();
        assert!((to_target + turned.matrix3.z_axis).length() < 1e-12);
        assert!((orbit.pose().elevation - before.elevation - 0.3).abs() < 1e-12);
        orbit.turn(0.0, 9.0);
        assert_eq!(orbit.pose().elevation, ELEVATION);
        orbit.turn(0.0, -9.0);
        assert_eq!(orbit.pose().elevation, -ELEVATION);
        orbit.reset();
        assert_eq!(orbit.pose(), before);
    }

    #[test]
    fn panning_moves_the_picture_by_its_share() {
        for projection in [
            Projection::Perspective { fov_y: 0.7 },
            Projection::Orthographic { half_height: 2.0 },
        ] {
            let mut camera = looking(DVec3::new(0.0, 0.0, 8.0), DVec3::ZERO, DVec3::Y);
            camera.projection = projection;
            let mut orbit = Orbit::new(&camera, Some([[-1.0; 3], [1.0; 3]]));
            orbit.zoom(0.5);
            orbit.pan(0.25, -0.5);
            let height = match projection {
                Projection::Perspective { fov_y } => 2.0 * (0.5 * f64::from(fov_y)).tan() * 4.0,
                Projection::Orthographic { .. } => 2.0,
            };
            let expected = DVec3::new(0.25 * height, -0.5 * height, 0.0);
            assert!((orbit.pose().target - expected).length() < 1e-6, "{projection:?}");
        }
    }

    #[test]
    fn flying_moves_and_turns_the_eye_to_the_right() {
        let camera = looking(DVec3::new(5.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let mut orbit = Orbit::new(&camera, BOUNDS);
        orbit.zoom(0.7);
        let before = orbit.camera().transform;
        orbit.fly(0.1, 0.25f64.to_radians());
        let after = orbit.camera().transform;
        let step = after.translation - before.translation;
        assert!((step - 0.1 * before.matrix3.x_axis).length() < 1e-12, "{step}");
        let [back, was] = [after, before].map(|place| place.matrix3.z_axis);
        // About the vertical, so that the way ahead, which is not level, turns by less; and towards the right.
        let turned = (back.x * was.x + back.z * was.z) / (back.x.hypot(back.z) * was.x.hypot(was.z));
        assert!((turned - 0.25f64.to_radians().cos()).abs() < 1e-12, "{turned}");
        assert!(back.y == was.y && (-back).dot(before.matrix3.x_axis) > 0.0);
    }

    #[test]
    fn zoom_is_relative_to_the_start_and_bounded() {
        let camera = looking(DVec3::new(0.0, 0.0, 8.0), DVec3::ZERO, DVec3::Y);
        let mut orbit = Orbit::new(&camera, Some([[-1.0; 3], [1.0; 3]]));
        orbit.zoom(0.5);
        assert!((orbit.camera().transform.translation.z - 4.0).abs() < 1e-12);
        assert!((orbit.camera().focus_distance - 0.5 * camera.focus_distance).abs() < 1e-6);
        orbit.zoom(1e-9);
        assert!((orbit.camera().transform.translation.z - 8.0 * ZOOM[0]).abs() < 1e-12);
        orbit.zoom(1e9);
        assert!((orbit.camera().transform.translation.z - 8.0 * ZOOM[1]).abs() < 1e-9);
    }
}
