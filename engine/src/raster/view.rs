//! Views: how points come to pixels, and the ray that goes through a pixel.
//!
//! A view is a linear map of points from its origin to clip space, and its inverse. Depth is stored reversed, near plane over distance, from 1 at
//! the near plane to 0 at infinity: a float has as many digits near 0 as near 1, so that the step of the stored distance z is 2⁻²⁴ z
//! anywhere, where the ordinary way, 1 − n/z, has one of 2⁻²⁴ z²/n (N. Reed, "Depth Precision Visualized", 2015). There is no far plane.
//! Parallel views cannot have that: there depth falls linearly from 1 at the origin to 0 behind the scene. Twin of
//! `raster/bindings.glsl`.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::Surfaces;
use crate::accel::{MAX_COORDINATE, Ray};
use crate::gpu::Area;
use crate::gpu::shaders::types::RasterView;
use crate::maps::cube::{CUBE_FACES, cube_axes};
use crate::maps::octahedron::OctahedronLayout;
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::{Error, Result};

/// The near plane's share of the scene's reach. Clipping there moves what it cuts by 2⁻²⁴ / 2⁻¹⁴ of half the picture at most.
const NEAR: f32 = 1.0 / 16_384.0;

/// How near to the end of depths oblique near planes let infinity come: what is left is for rounding.
const OBLIQUE: f64 = 1.0 - 1.0 / 1024.0;

/// How points come to the pixels of an area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    pub(super) record: RasterView,
    /// Of views of octants.
    pub(super) layout: Option<OctahedronLayout>,
}

/// The sphere about what rays can meet within bounds, of a radius above 0, metres.
fn sphere_about(bounds: [Vec3; 2]) -> (DVec3, f64) {
    let limit = Vec3::splat(MAX_COORDINATE);
    let [lower, upper] = bounds.map(|corner| corner.clamp(-limit, limit).as_dvec3());
    let radius = 0.5 * (upper - lower).length();
    (0.5 * (lower + upper), if radius > 0.0 { radius } else { 1.0 })
}

impl View {
    /// What a camera sees of surfaces, as a pinhole: a lens is left out.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used.
    pub fn of_camera(camera: &Camera, surfaces: &Surfaces<'_>, area: Area) -> Result<Self> {
        Self::of_frame(&CameraFrame::new(camera, area.size)?, surfaces, area)
    }

    /// As [`View::of_camera`], of a frame whose middle may lie beside its axis.
    pub(crate) fn of_frame(frame: &CameraFrame, surfaces: &Surfaces<'_>, area: Area) -> Result<Self> {
        let axis = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let forward = axis(frame.forward);
        let [beside, above] = frame.skew.map(f64::from);
        let rows = [
            (axis(frame.right) - beside * forward) / f64::from(frame.half_width),
            (above * forward - axis(frame.up)) / f64::from(frame.half_height),
            forward,
        ];
        let origin = Vec3::from_array(frame.origin);
        let reach = surfaces.reach(origin);
        if !frame.orthographic {
            return Self::central(origin, rows, reach * NEAR, area);
        }
        let view = Self::central(origin, rows, 0.0, area)?;
        // Behind all of the scene, if there is any.
        let far = f64::from(if reach > 0.0 { 2.0 * reach } else { 1.0 });
        Ok(view.into_parallel(forward, far))
    }

    /// What is seen from a point through a face of a cube map ([`crate::maps::cube`]).
    ///
    /// # Errors
    /// [`Error::Setting`] for a face that does not exist, or a place or near plane that is not finite.
    pub fn of_cube_face(origin: Vec3, face: u32, near: f32, area: Area) -> Result<Self> {
        if face >= CUBE_FACES {
            return Err(Error::setting("cube face", face, "is not below 6"));
        }
        Self::central(origin, cube_axes(face), near, area)
    }

    /// What is seen from a point in one half of a dual paraboloid map ([`crate::maps::paraboloid`]), 1 for z < 0, for
    /// [`Layering::Paraboloids`](super::Layering). Its rays are not those of [`View::ray`], which no linear map has.
    ///
    /// # Errors
    /// [`Error::Setting`] for a half that does not exist, or a place or near plane that is not finite.
    pub fn of_paraboloid(origin: Vec3, half: u32, near: f32, area: Area) -> Result<Self> {
        if half > 1 {
            return Err(Error::setting("paraboloid", half, "is not below 2"));
        }
        let side = DVec3::new(0.0, 0.0, if half == 0 { 1.0 } else { -1.0 });
        let mut view = Self::central(origin, [DVec3::X, DVec3::Y, side], near, area)?;
        view.record.signs = side.as_vec3().to_array();
        Ok(view)
    }

    /// What is seen from a point about an axis of length 1, in a square whose sides are seen under that angle from it, radians, above 0 and below a quarter turn.
    ///
    /// # Errors
    /// [`Error::Setting`] for such an angle, or a place or near plane that is not finite.
    pub fn of_square(origin: Vec3, axis: Vec3, half_angle: f32, near: f32, area: Area) -> Result<Self> {
        let half_side = f64::from(half_angle).tan();
        if !(half_angle > 0.0 && half_angle < std::f32::consts::FRAC_PI_2 && half_side.is_finite()) {
            return Err(Error::setting(
                "half angle",
                half_angle,
                "is not between 0 and a quarter turn",
            ));
        }
        let axis = axis.as_dvec3();
        let (right, down) = axis.any_orthonormal_pair();
        Self::central(origin, [right / half_side, down / half_side, axis], near, area)
    }

    /// What parallel rays along a direction of length 1 meet of surfaces: all of them, in a square as wide as the sphere about their bounds.
    ///
    /// # Errors
    /// [`Error::Setting`] for bounds that are not finite.
    pub fn of_beam(direction: Vec3, surfaces: &Surfaces<'_>, area: Area) -> Result<Self> {
        let (middle, radius) = sphere_about(surfaces.bounds);
        let forward = direction.as_dvec3();
        let origin = (middle - radius * forward).as_vec3();
        Self::parallel_square(origin, forward, radius, area)
    }

    /// What parallel rays along a direction meet of surfaces within bounds, in a target of `side` pixels a side: as [`View::of_beam`], in a square that is a pixel wider on each side, all pixels moved by a
    /// part of one, from −½ to ½ across and down, so that over evenly distributed shifts the rays of a pixel are even over the width of one. Everything lies before its origin by a
    /// pixel's width or more.
    ///
    /// # Errors
    /// As [`View::of_beam`].
    pub(crate) fn of_shifted_beam(direction: Vec3, bounds: [Vec3; 2], side: u32, shift: DVec2) -> Result<Self> {
        let (middle, radius) = sphere_about(bounds);
        // Half of the pixels are as wide as the radius and one pixel more.
        let pixel = 2.0 * radius / f64::from(side.saturating_sub(2).max(1));
        let half_side = 0.5 * f64::from(side) * pixel;
        let forward = direction.as_dvec3().normalize();
        let (right, down) = forward.any_orthonormal_pair();
        let across = shift.x * pixel * right + shift.y * pixel * down;
        let origin = (middle + across - (radius + pixel) * forward).as_vec3();
        Self::parallel_square(origin, forward, half_side, Area::whole([side; 2]))
    }

    /// Parallel rays of a unit direction, in a square about an origin, up to twice its width.
    fn parallel_square(origin: Vec3, forward: DVec3, half_side: f64, area: Area) -> Result<Self> {
        let (right, down) = forward.any_orthonormal_pair();
        let rows = [right / half_side, down / half_side, forward];
        Ok(Self::central(origin, rows, 0.0, area)?.into_parallel(forward, 4.0 * half_side))
    }

    /// The same with parallel rays along its axis, up to a distance.
    fn into_parallel(mut self, forward: DVec3, far: f64) -> Self {
        let record = &mut self.record;
        record.z = (-forward / far).as_vec3().extend(1.0).to_array();
        record.w = [0.0, 0.0, 0.0, 1.0];
        record.parallel = 1;
        self
    }

    /// The same without what lies behind a plane: `normal`, a unit vector, points to its front, and the view's origin is `height` behind it, metres. Depths go from 1 at the plane towards
    /// infinity, in their order along each ray, with a step of 2⁻²⁴ everywhere; rays and pixels are the same. What is nearer to the plane than 2⁻¹⁴ of `reach`, the distance to the farthest surface, is cut off, too.
    ///
    /// Source: E. Lengyel, "Oblique View Frustum Depth Projection and Clipping", Journal of Game Development 1(2), 2005.
    pub(crate) fn cut_by(mut self, reach: f32, normal: Vec3, height: f32) -> Self {
        let r = &mut self.record;
        let normal = normal.as_dvec3();
        let behind = f64::from(height) + f64::from(reach * NEAR);
        let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        // Depth is w less so much of the distance before the plane that it is never below 0.
        let (w, scale) = if r.parallel != 0 {
            (
                glam::DVec4::new(0.0, 0.0, 0.0, 1.0),
                1.0 / f64::from((2.0 * reach).max(f32::MIN_POSITIVE)),
            )
        } else {
            let corner = |x: f64, y: f64| normal.dot(vector(r.forward) + x * vector(r.right) + y * vector(r.down));
            let steepest = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
                .into_iter()
                .fold(0.0, |steepest: f64, (x, y)| steepest.max(corner(x, y)));
            let [x, y, z, _] = r.w.map(f64::from);
            // A picture that looks away from the plane sees nothing, at whatever scale.
            let scale = if steepest > 0.0 { OBLIQUE / steepest } else { 1.0 };
            (glam::DVec4::new(x, y, z, 0.0), scale)
        };
        let row = w - scale * normal.extend(-behind);
        r.z = row.as_vec4().to_array();
        self
    }

    /// The near plane that [`View::of_camera`] takes from here: 2⁻¹⁴ of the distance to the farthest surface, metres.
    pub fn near_plane(origin: Vec3, surfaces: &Surfaces<'_>) -> f32 {
        surfaces.reach(origin) * NEAR
    }

    /// The central projection whose clip coordinates x, y and w are these rows times the point from the origin.
    pub(super) fn central(origin: Vec3, [x, y, w]: [DVec3; 3], near: f32, area: Area) -> Result<Self> {
        if !(origin.is_finite() && near.is_finite() && near >= 0.0) {
            return Err(Error::setting(
                "view",
                origin,
                "has a place or a near plane that is not finite",
            ));
        }
        // The inverse of what is stored, not of what was meant.
        let rounded = [x, y, w].map(|row| row.as_vec3().as_dvec3());
        let rows = DMat3::from_cols(rounded[0], rounded[1], rounded[2]).transpose();
        if rows.determinant() == 0.0 {
            return Err(Error::setting("view", origin, "sees a line"));
        }
        let inverse = rows.inverse();
        let row = |row: DVec3, constant: f32| row.as_vec3().extend(constant).to_array();
        let column = |column: DVec3| column.as_vec3().to_array();
        let scale = |axis: usize| 2.0 / f64::from(area.size[axis]);
        let offset = |axis: usize| (-1.0 - scale(axis) * f64::from(area.offset[axis])) as f32;
        Ok(Self {
            layout: None,
            record: RasterView {
                x: row(x, 0.0),
                y: row(y, 0.0),
                // Where depths would be 0 at all distances, nothing hides anything.
                z: [0.0, 0.0, 0.0, near.max(f32::MIN_POSITIVE)],
                w: row(w, 0.0),
                origin: origin.to_array(),
                parallel: 0,
                right: column(inverse.x_axis),
                scale_x: scale(0) as f32,
                down: column(inverse.y_axis),
                scale_y: scale(1) as f32,
                forward: column(inverse.z_axis),
                offset_x: offset(0),
                signs: [0.0; 3],
                offset_y: offset(1),
            },
        })
    }

    /// The ray through a place of the target, in pixels: half numbers are centres of pixels. Its parameter is the clip coordinate w of what it
    /// meets (of parallel views, the distance), and it begins at the near plane. The same bits as the fragment shader's.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let r = &self.record;
        let vector = Vec3::from_array;
        let place = [r.scale_x * x + r.offset_x, r.scale_y * y + r.offset_y];
        let across = place[0] * vector(r.right) + place[1] * vector(r.down);
        let (origin, forward) = (vector(r.origin), vector(r.forward));
        let (start, direction, t_min) = if r.parallel != 0 {
            (across, forward, 0.0)
        } else {
            (Vec3::ZERO, forward + across, r.z[3])
        };
        let t_min = self.cut(start, direction).unwrap_or(t_min);
        let origin = origin + start;
        Ray {
            origin: origin.to_array(),
            t_min,
            direction: direction.to_array(),
            t_max: f32::INFINITY,
        }
    }

    /// Where a ray from beside the origin meets the plane that cuts the view, where there is one: there depth is 1. Infinite for rays that go away from it.
    fn cut(&self, start: Vec3, direction: Vec3) -> Option<f32> {
        let r = &self.record;
        let is_cut = match r.parallel {
            0 => r.z[..3] != [0.0; 3],
            _ => r.z[3] != r.w[3],
        };
        // Above 0 before the plane.
        let row: [f32; 4] = std::array::from_fn(|i| r.w[i] - r.z[i]);
        let normal = Vec3::from_slice(&row);
        let along = normal.dot(direction);
        let behind = -(normal.dot(start) + row[3]);
        let meets = || if along > 0.0 { behind / along } else { f32::INFINITY };
        is_cut.then(meets)
    }

    /// What kernels know of it.
    pub(crate) fn record(&self) -> RasterView {
        self.record
    }

    /// Where rays begin, metres; of parallel views, the middle of where they do.
    pub fn origin(&self) -> Vec3 {
        Vec3::from_array(self.record.origin)
    }

    /// Whether its rays are parallel.
    pub fn is_parallel(&self) -> bool {
        self.record.parallel != 0
    }

    /// The ray through the place (u, v) of its picture, from (−1, −1) to (1, 1), goes along the third of these and u and v times the others.
    pub fn axes(&self) -> [Vec3; 3] {
        [self.record.right, self.record.down, self.record.forward].map(Vec3::from_array)
    }

    /// The signs of the octant that it shows, the third alone for halves of a paraboloid map; zeros for other views.
    pub fn octant(&self) -> Vec3 {
        Vec3::from_array(self.record.signs)
    }

    /// Clip coordinates x, y, z and w of a point, metres, without rounding what the device rounds.
    pub fn project(&self, point: DVec3) -> [f64; 4] {
        let r = &self.record;
        let from = point - Vec3::from_array(r.origin).as_dvec3();
        [r.x, r.y, r.z, r.w].map(|row| {
            let [x, y, z, constant] = row.map(f64::from);
            DVec3::new(x, y, z).dot(from) + constant
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifted_beams_hold_their_bounds_and_are_moved_by_parts_of_a_pixel() {
        let bounds = [Vec3::new(-1.0, 0.5, 2.0), Vec3::new(2.0, 1.0, 4.0)];
        let corners = [0usize, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let at = |axis: usize| bounds[corner >> axis & 1][axis];
            Vec3::new(at(0), at(1), at(2)).as_dvec3()
        });
        for direction in [Vec3::Y, Vec3::new(0.3, -0.5, 0.8), Vec3::new(-1.0, 1e-3, 0.0)] {
            for side in [16, 33, 256] {
                let of = |x, y| View::of_shifted_beam(direction, bounds, side, DVec2::new(x, y)).expect("view");
                let still = of(0.0, 0.0);
                let pixel = 2.0 * still.axes()[0].length() / side as f32;
                for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (0.25, 0.0)] {
                    let moved = of(x, y);
                    for corner in corners {
                        let [u, v, ..] = moved.project(corner);
                        assert!(u.abs() <= 1.0 && v.abs() <= 1.0, "{direction} {side}: {u} {v}");
                        let from = (corner - moved.origin().as_dvec3()).dot(direction.as_dvec3().normalize());
                        assert!(from > 0.99 * f64::from(pixel), "{direction} {side}: {from}");
                    }
                    // A pixel's ray is that of a place between pixels.
                    let [a, b] = [moved.ray(3.5, 4.5), still.ray(3.5 + x as f32, 4.5 + y as f32)];
                    let off = Vec3::from_array(a.origin) - Vec3::from_array(b.origin);
                    assert!(off.length() < 1e-2 * pixel, "{direction} {side}: {off}");
                }
            }
        }
    }

    #[test]
    fn oblique_near_planes_keep_pixels_and_the_order_of_depths() {
        const REACH: f32 = 20.0;
        let rows = [
            DVec3::new(1.1, 0.1, 0.0),
            DVec3::new(0.0, -0.9, 0.2),
            DVec3::new(0.1, 0.2, 0.97),
        ];
        let origin = Vec3::new(0.3, -0.2, 1.0);
        let area = Area::whole([64, 48]);
        let normal = Vec3::new(0.2, -0.1, 0.9).normalize();
        let height = 2.0;
        let central = View::central(origin, rows, 0.01, area).expect("view");
        let mut parallel = central;
        parallel.record.z = [0.0; 4];
        parallel.record.w = [0.0, 0.0, 0.0, 1.0];
        parallel.record.parallel = 1;
        for view in [central, parallel] {
            let cut = view.cut_by(REACH, normal, height);
            // Rays go the same ways, and begin at the near plane, which is the cutting one now.
            for (x, y) in [(10.5, 20.5), (40.0, 3.0), (60.5, 44.5)] {
                let ray = cut.ray(x, y);
                let from = Vec3::from_array(ray.origin) + ray.t_min * Vec3::from_array(ray.direction);
                let off = normal.dot(from - origin) - (height + REACH * NEAR);
                assert!(ray.t_min > 0.0 && off.abs() < 1e-3, "{x} {y}: {off}");
                let [.., z, w] = cut.project(from.as_dvec3());
                assert!((z / w - 1.0).abs() < 1e-3, "{z} {w}");
            }
            let way = |view: &View| {
                let ray = view.ray(10.5, 20.5);
                (ray.origin, ray.direction)
            };
            assert_eq!(way(&cut), way(&view));
            let mut seen = [0; 2];
            for x in 0..8 {
                for y in 0..6 {
                    let ray = view.ray(8.0 * x as f32 + 4.0, 8.0 * y as f32 + 4.0);
                    let mut last = f64::INFINITY;
                    for step in 1..60 {
                        let t = 0.25 * f64::from(step);
                        let [from, along] = [ray.origin, ray.direction].map(|v| Vec3::from_array(v).as_dvec3());
                        let point = from + t * along;
                        if f64::from(REACH) < point.distance(origin.as_dvec3()) {
                            break;
                        }
                        let before = normal.as_dvec3().dot(point - origin.as_dvec3()) - f64::from(height);
                        let [.., z, w] = cut.project(point);
                        assert_eq!(cut.project(point)[..2], view.project(point)[..2]);
                        assert!(z / w < last, "depths fall along rays");
                        last = z / w;
                        if before.abs() > 2.0 * f64::from(REACH * NEAR) {
                            assert_eq!(z <= w, before > 0.0, "{before}");
                            seen[usize::from(before > 0.0)] += 1;
                        }
                        assert!(z >= 0.0 || before < 0.0, "nothing is too far");
                    }
                }
            }
            assert!(seen.into_iter().all(|count| count > 100), "{seen:?}");
        }
    }
}
