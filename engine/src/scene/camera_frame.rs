//! Camera parameters as kernels take them.

use glam::{DVec2, DVec3, Vec3};

use super::{Camera, Projection};
use crate::gpu::shaders::types::CameraRays;
use crate::{Error, Result};

/// An orthonormal frame with what maps pixels, lens and distance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CameraFrame {
    pub origin: [f32; 3],
    pub right: [f32; 3],
    pub up: [f32; 3],
    pub forward: [f32; 3],
    pub half_width: f32,
    pub half_height: f32,
    pub lens_radius: f32,
    pub focus_distance: f32,
    pub orthographic: bool,
    /// By how much the middle of the picture lies beside `forward`, along `right` and `up` at distance 1.
    pub skew: [f32; 2],
}

impl CameraFrame {
    /// The frame of a camera for pictures of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used.
    pub fn new(camera: &Camera, size: [u32; 2]) -> Result<Self> {
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let axis = |v: DVec3| v.normalize_or_zero().as_vec3().to_array();
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { fov_y } => ((0.5 * f64::from(fov_y)).tan(), false),
            Projection::Orthographic { half_height } => (f64::from(half_height), true),
        };
        let usable = half_height.is_finite()
            && half_height > 0.0
            && camera.transform.is_finite()
            && camera.lens_radius >= 0.0
            && camera.lens_radius.is_finite()
            && camera.focus_distance > 0.0
            && camera.focus_distance.is_finite()
            && camera.transform.translation.as_vec3().is_finite();
        if !usable {
            let cause = "has a field of view, lens or place that cannot be used";
            return Err(Error::setting("camera", &camera.name, cause));
        }
        let matrix = camera.transform.matrix3;
        Ok(Self {
            origin: camera.transform.translation.as_vec3().to_array(),
            right: axis(matrix.x_axis),
            up: axis(matrix.y_axis),
            forward: axis(-matrix.z_axis),
            half_width: (half_height * aspect) as f32,
            half_height: half_height as f32,
            lens_radius: camera.lens_radius,
            focus_distance: camera.focus_distance,
            orthographic,
            skew: [0.0; 2],
        })
    }

    /// The frame whose rays through centres of pixels are this one's through a `place` within each pixel, in [0, 1)² from its upper left corner,
    /// from a point of the unit disk as the lens.
    pub fn seen_through(&self, size: [u32; 2], place: DVec2, lens: DVec2) -> Self {
        let half = DVec2::new(f64::from(self.half_width), -f64::from(self.half_height));
        let shift = (2.0 * place - 1.0) / DVec2::new(f64::from(size[0]), f64::from(size[1])) * half;
        let moved = |by: DVec2| {
            let [right, up] = [self.right, self.up].map(|axis| Vec3::from_array(axis).as_dvec3());
            (Vec3::from_array(self.origin).as_dvec3() + by.x * right + by.y * up)
                .as_vec3()
                .to_array()
        };
        if self.orthographic {
            return Self {
                origin: moved(shift),
                ..*self
            };
        }
        let offset = f64::from(self.lens_radius) * lens;
        let skew = shift - offset / f64::from(self.focus_distance);
        Self {
            origin: moved(offset),
            lens_radius: 0.0,
            skew: skew.as_vec2().to_array(),
            ..*self
        }
    }

    /// What lies in the middle of the picture, from the origin: at distance 1 along `forward`.
    pub fn middle(&self) -> Vec3 {
        let [right, up, forward] = [self.right, self.up, self.forward].map(Vec3::from_array);
        forward + self.skew[0] * right + self.skew[1] * up
    }

    /// The frame as kernels take it, for pictures of `size` pixels; without skew.
    pub fn rays(&self, size: [u32; 2]) -> CameraRays {
        CameraRays {
            origin: self.origin,
            half_width: self.half_width,
            right: self.right,
            half_height: self.half_height,
            up: self.up,
            lens_radius: self.lens_radius,
            forward: self.forward,
            focus_distance: self.focus_distance,
            width: size[0],
            height: size[1],
            is_parallel: self.orthographic.into(),
        }
    }
}

/// Twin of `camera_ray` in `scene/camera.glsl`: origin and direction of the ray through a place, in pixels, from a point of the unit disk as the
/// lens.
#[cfg(test)]
fn camera_ray(c: &CameraRays, place: DVec2, lens: DVec2) -> [DVec3; 2] {
    let [origin, right, up, forward] = [c.origin, c.right, c.up, c.forward].map(|v| Vec3::from_array(v).as_dvec3());
    let plane = (2.0 * place / DVec2::new(f64::from(c.width), f64::from(c.height)) - 1.0)
        * DVec2::new(f64::from(c.half_width), -f64::from(c.half_height));
    let across = plane.x * right + plane.y * up;
    if c.is_parallel != 0 {
        return [origin + across, forward];
    }
    let offset = f64::from(c.lens_radius) * (lens.x * right + lens.y * up);
    let direction = (forward + across) * f64::from(c.focus_distance) - offset;
    [origin + offset, direction.normalize()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_seen_through_a_place_have_the_rays_through_it() {
        let eye = DVec3::new(1.0, 2.0, -3.0);
        let mut camera = Camera::look_at("main", eye, DVec3::new(0.2, 0.1, 0.4), DVec3::Y, 0.8);
        camera.lens_radius = 0.25;
        camera.focus_distance = 2.5;
        let mut parallel = camera.clone();
        parallel.projection = Projection::Orthographic { half_height: 1.5 };
        let size = [9, 5];
        for camera in [camera, parallel] {
            let frame = CameraFrame::new(&camera, size).expect("frame");
            for (place, lens) in [
                (DVec2::new(0.5, 0.5), DVec2::ZERO),
                (DVec2::new(0.1, 0.9), DVec2::new(-0.6, 0.3)),
                (DVec2::new(0.99, 0.0), DVec2::new(0.0, -1.0)),
            ] {
                let seen = frame.seen_through(size, place, lens);
                let middle = seen.middle().as_dvec3();
                let [right, down] = [(seen.right, seen.half_width), (seen.up, -seen.half_height)]
                    .map(|(axis, half)| Vec3::from_array(axis).as_dvec3() * f64::from(half));
                for pixel in [DVec2::ZERO, DVec2::new(3.0, 4.0), DVec2::new(8.0, 1.0)] {
                    let [origin, direction] = camera_ray(&frame.rays(size), pixel + place, lens);
                    let centre = 2.0 * (pixel + 0.5) / DVec2::new(9.0, 5.0) - 1.0;
                    let across = centre.x * right + centre.y * down;
                    let from = Vec3::from_array(seen.origin).as_dvec3();
                    let [found, along] = match frame.orthographic {
                        true => [from + across, middle],
                        false => [from, (middle + across).normalize()],
                    };
                    assert!(found.distance(origin) < 1e-5, "{found} {origin}");
                    assert!(along.distance(direction) < 1e-6, "{along} {direction}");
                }
            }
        }
    }
}
