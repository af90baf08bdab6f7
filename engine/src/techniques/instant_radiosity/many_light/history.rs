//! Light that is blended with that of the frame before: where a point was in the picture then, which pixels there stand for it, how far they are trusted, and how bright a
//! pixel may be beside its neighbours. Twin of `history.glsl`.
//!
//! Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §2.2.4: I = c I_before + (1 - c) I_now, with a confidence c
//! that changes of position, of the normal and of light lower. The forms of these are derived here: what they are relative to, so that no unit shows, and the third power of the
//! change of light, which lets noise through and changes not. Of independent frames with one c the deviation is √((1 - c)/(1 + c)) of theirs, and 1 - cᵏ of a step of light are there
//! after k frames.

use glam::{BVec2, DVec2, DVec3, IVec2, Vec3};

use crate::gpu::shaders::constants::{HISTORY_CHANGE_MAX, HISTORY_SNAP};
use crate::gpu::shaders::types::SeenFrom;

/// From where the pixels of a picture are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryView {
    /// Of the camera, m.
    pub origin: DVec3,
    /// Over the picture's half width.
    pub right: DVec3,
    /// Over its half height.
    pub down: DVec3,
    /// To the middle of the picture.
    pub forward: DVec3,
    /// Rays are parallel to `forward`.
    pub is_parallel: bool,
    /// Pixels across and down.
    pub size: [u32; 2],
}

impl From<&SeenFrom> for HistoryView {
    fn from(from: &SeenFrom) -> Self {
        let [origin, right, down, forward] =
            [from.origin, from.right, from.down, from.forward].map(|v| Vec3::from_array(v).as_dvec3());
        Self {
            origin,
            right,
            down,
            forward,
            is_parallel: from.is_parallel != 0,
            size: [from.width, from.height],
        }
    }
}

/// Where a point is in a picture, in pixels from its upper left corner; `None` behind the camera.
pub fn history_place(from: &HistoryView, point: DVec3) -> Option<DVec2> {
    let (way, across) = (point - from.origin, from.right.cross(from.down));
    let (volume, depth) = (across.dot(from.forward), across.dot(way));
    let sides = DVec2::new(
        from.down.cross(from.forward).dot(way),
        from.forward.cross(from.right).dot(way),
    );
    let sides = sides / if from.is_parallel { volume } else { depth };
    let size = DVec2::new(from.size[0].into(), from.size[1].into());
    (depth * volume > 0.0).then_some(0.5 * (sides + 1.0) * size)
}

/// The upper left one of the four pixels about a place, and weights of all by rows. A place within [`HISTORY_SNAP`] of the middle of a pixel is there.
pub fn history_weights(place: DVec2) -> (IVec2, [f64; 4]) {
    let from_middle = place - 0.5;
    let lower = from_middle.floor();
    let within = from_middle - lower;
    let is_next = within.cmpgt(DVec2::splat(1.0 - f64::from(HISTORY_SNAP)));
    let is_there: BVec2 = within.min(1.0 - within).cmplt(DVec2::splat(HISTORY_SNAP.into()));
    let x = DVec2::select(is_there, DVec2::ZERO, within);
    let first = lower.as_ivec2() + IVec2::select(is_next, IVec2::ONE, IVec2::ZERO);
    let weights = [
        (1.0 - x.x) * (1.0 - x.y),
        x.x * (1.0 - x.y),
        (1.0 - x.x) * x.y,
        x.x * x.y,
    ];
    (first, weights)
}

/// By how much luminance has changed, over what it was; [`HISTORY_CHANGE_MAX`] at most.
pub fn history_change(now: f64, before: f64) -> f64 {
    if before <= 0.0 {
        return if now > 0.0 { HISTORY_CHANGE_MAX.into() } else { 0.0 };
    }
    ((now - before).abs() / before).min(HISTORY_CHANGE_MAX.into())
}

/// The share of light that is that of the frame before: at most `most`, less by the largest of the weighted changes of position, normal and, to the third power,
/// luminance.
pub fn history_confidence(most: f64, weights: DVec3, changes: DVec3) -> f64 {
    let reducers = weights * DVec3::new(changes.x, changes.y, changes.z.powi(3));
    most * (1.0 - reducers.max_element()).clamp(0.0, 1.0)
}

/// What a pixel's light is scaled by to be so many times as bright as what is around at most; 0 bounds nothing, and neither does black.
pub fn history_bound(most: f64, luminance: f64, around: f64) -> f64 {
    let bound = most * around;
    if bound > 0.0 && luminance > bound {
        bound / luminance
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(is_parallel: bool) -> HistoryView {
        HistoryView {
            origin: DVec3::new(1.0, 2.0, 3.0),
            right: DVec3::X,
            down: DVec3::NEG_Y * 0.5,
            // Not across the picture, as through a lens.
            forward: DVec3::new(0.1, -0.2, -1.0),
            is_parallel,
            size: [40, 20],
        }
    }

    #[test]
    fn points_on_a_pixels_ray_are_in_its_middle() {
        for is_parallel in [false, true] {
            let from = view(is_parallel);
            for (x, y) in [(0, 0), (13, 7), (39, 19)] {
                let middle = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let place = middle / DVec2::new(20.0, 10.0) - 1.0;
                let across = place.x * from.right + place.y * from.down;
                for depth in [0.1, 1.0, 1e3] {
                    let point = if is_parallel {
                        from.origin + across + depth * from.forward
                    } else {
                        from.origin + depth * (from.forward + across)
                    };
                    let found = history_place(&from, point).expect("in front of the camera");
                    assert!(found.distance(middle) < 1e-9, "{found} instead of {middle}");
                }
                assert_eq!(history_place(&from, from.origin - from.forward), None);
            }
        }
    }

    #[test]
    fn weights_sum_to_one_and_middles_have_one_pixel() {
        for place in [
            DVec2::new(3.5, 7.5),
            DVec2::new(3.5004, 7.4996),
            DVec2::new(3.495, 7.502),
        ] {
            assert_eq!(
                history_weights(place),
                (IVec2::new(3, 7), [1.0, 0.0, 0.0, 0.0]),
                "{place}"
            );
        }
        for (place, first, expected) in [
            (DVec2::new(4.0, 8.0), [3, 7], [0.25; 4]),
            (DVec2::new(3.75, 7.5), [3, 7], [0.75, 0.25, 0.0, 0.0]),
            (DVec2::new(0.25, 0.75), [-1, 0], [0.1875, 0.5625, 0.0625, 0.1875]),
        ] {
            let (found, weights) = history_weights(place);
            assert_eq!(found.to_array(), first);
            assert_eq!(weights, expected, "{place}");
            assert_eq!(weights.iter().sum::<f64>(), 1.0);
        }
    }

    #[test]
    fn confidence_falls_with_the_largest_change() {
        let of = |weights: [f64; 3], changes: [f64; 3]| {
            history_confidence(0.9, DVec3::from_array(weights), DVec3::from_array(changes))
        };
        assert_eq!(of([1.0; 3], [0.0; 3]), 0.9);
        assert_eq!(of([0.0; 3], [1.0, 1.0, HISTORY_CHANGE_MAX.into()]), 0.9);
        assert_eq!(of([2.0, 3.0, 4.0], [0.25, 0.0, 0.5]), 0.45);
        assert_eq!(of([2.0, 3.0, 4.0], [0.0, 0.25, 0.5]), 0.9 * 0.25);
        assert_eq!(of([2.0, 3.0, 4.0], [0.0, 0.0, 1.0]), 0.0);
        // Noise of a tenth takes a thousandth, as light that halves takes an eighth.
        assert!((of([0.0, 0.0, 1.0], [0.0, 0.0, 0.1]) - 0.8991).abs() < 1e-12);
        assert_eq!(of([0.0, 0.0, 1.0], [0.0, 0.0, 0.5]), 0.9 * 0.875);
    }

    #[test]
    fn changes_are_relative_and_bounds_scale() {
        assert_eq!(history_change(3.0, 2.0), 0.5);
        assert_eq!(history_change(1.0, 2.0), 0.5);
        assert_eq!(history_change(0.0, 0.0), 0.0);
        assert_eq!(history_change(1e-30, 0.0), f64::from(HISTORY_CHANGE_MAX));
        assert_eq!(history_change(1e9, 1.0), f64::from(HISTORY_CHANGE_MAX));
        assert_eq!(history_bound(8.0, 32.0, 2.0), 0.5);
        for (most, luminance, around) in [(8.0, 16.0, 2.0), (0.0, 32.0, 2.0), (8.0, 1.0, 0.0)] {
            assert_eq!(history_bound(most, luminance, around), 1.0);
        }
    }
}
