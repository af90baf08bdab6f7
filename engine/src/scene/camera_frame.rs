//! Camera parameters as kernels take them.

use glam::DVec3;

use super::{Camera, Projection};
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
        })
    }
}
