//! Angles in whole turns.
//!
//! On the device by polynomials of their own, since Vulkan lets sines be off by 2⁻¹¹ and arc tangents by 4096 units: least-squares fits
//! at Chebyshev nodes, of relative error 2·10⁻⁸ (arc tangent, within a sixteenth of a turn of an axis or a diagonal), 4·10⁻⁹ (sine) and
//! 10⁻⁹ (cosine less one, within an eighth). In f32 angles are off by 4·10⁻⁸ turns and components by 10⁻⁷. Twin of `maps/turn.glsl`.

use glam::DVec2;
use std::f64::consts::TAU;

/// The angle of a vector, in \[-1/2, 1/2\] turns; 0 for zero, and the sign of zero does not count.
pub fn vector_turn(v: DVec2) -> f64 {
    // Of −0 the arc tangent would be on the other side of the seam.
    (v.y + 0.0).atan2(v.x + 0.0) / TAU
}

/// The unit vector (cosine, sine) of an angle in turns.
pub fn turn_vector(turn: f64) -> DVec2 {
    DVec2::from_angle(TAU * turn)
}
