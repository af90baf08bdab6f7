//! What maps onto the unit disc share: integrals over a rectangle cut by the disc, from those over rectangles at the centre.

use glam::DVec2;
use std::f64::consts::FRAC_PI_2;

/// The integral of an even density over the part of a rectangle within the unit disc. `corner(u, v)` is the one over \[0, u\] × \[0, v\]
/// for 0 ≤ u, v ≤ 1, cut by the disc where u² + v² > 1.
pub(super) fn integrate(corner: impl Fn(f64, f64) -> f64, lower: DVec2, upper: DVec2) -> f64 {
    let at = |u: f64, v: f64| {
        let (a, b) = (u.abs().min(1.0), v.abs().min(1.0));
        corner(a, b).copysign(u * v)
    };
    let sum = at(upper.x, upper.y) - at(lower.x, upper.y) - at(upper.x, lower.y) + at(lower.x, lower.y);
    // What is outside the disc is the difference of equal numbers.
    if outside(lower, upper) { 0.0 } else { sum.max(0.0) }
}

/// Whether a rectangle lies outside the disc.
fn outside(lower: DVec2, upper: DVec2) -> bool {
    DVec2::ZERO.clamp(lower, upper).length_squared() >= 1.0
}

/// Area of the part of a rectangle within the disc.
pub(super) fn area(lower: DVec2, upper: DVec2) -> f64 {
    let corner = |u: f64, v: f64| {
        if u * u + v * v <= 1.0 {
            return u * v;
        }
        // ∫ √(1 − x²) from where the circle leaves the rectangle's upper side.
        let under = |x: f64| 0.5 * (x * (1.0 - x * x).max(0.0).sqrt() + x.asin());
        let leaves = (1.0 - v * v).max(0.0).sqrt();
        leaves * v + under(u) - under(leaves)
    };
    let far = lower.abs().max(upper.abs());
    if far.length_squared() <= 1.0 {
        let extent = upper - lower;
        return extent.x * extent.y;
    }
    integrate(corner, lower, upper)
}

/// The integral of 1/√(1 − u² − v²) over \[0, u\] × \[0, v\] within the disc.
pub(super) fn over_cosine(u: f64, v: f64) -> f64 {
    let rest = 1.0 - u * u - v * v;
    if rest <= 0.0 {
        return FRAC_PI_2 * (u + v - 1.0);
    }
    let angle = |a: f64, b: f64| a.atan2((1.0 - a * a - b * b).max(0.0).sqrt());
    u * angle(v, u) + v * angle(u, v) - (u * v).atan2(rest.sqrt())
}

/// The integral of 4/(1 + u² + v²)² over \[0, u\] × \[0, v\] within the disc.
pub(super) fn stereographic(u: f64, v: f64) -> f64 {
    let part = |a: f64, b: f64| {
        let h = (1.0 + a * a).sqrt();
        2.0 * a / h * (b / h).atan()
    };
    let whole = |u: f64, v: f64| part(u, v) + part(v, u);
    if u * u + v * v <= 1.0 {
        return whole(u, v);
    }
    let leaves = (1.0 - v * v).max(0.0).sqrt();
    let under = |x: f64| x.asin() + part(x, (1.0 - x * x).max(0.0).sqrt());
    whole(leaves, v) + under(u) - under(leaves)
}
