//! Searches along a ray for what it meets, by ratios of distances: the twin of `maps/impostor.glsl`.
//!
//! With D(v) the distance that the impostor has in a direction, g(d) = |x + d r| / D(x + d r) is below 1 in front of the surface, above 1
//! behind it and 1 on it. For one plane g is linear in d, so that a secant through two guesses on the plane meets it exactly; through a guess
//! and the point at infinity, where g grows as d / D(r), the step is D(r) (1 − g). The methods differ in which two guesses they join.

use glam::DVec3;

use super::proxy::sphere_proxy;
use super::settings::{ImpostorSettings, SearchMethod};
use super::{ImpostorHit, ImpostorImage, ImpostorRay};
use crate::gpu::shaders::constants::{IMPOSTOR_FLAT, IMPOSTOR_MARGIN, IMPOSTOR_UNIT};

const NOTHING: f64 = ImpostorImage::NOTHING as f64;

/// What is seen from the map's place: what a search asks of an impostor.
#[derive(Debug)]
pub struct ImpostorScene<F> {
    /// Distance of a layer's surface in a direction; [`ImpostorImage::NOTHING`] where there is none.
    pub distance: F,
    /// Layers of surfaces.
    pub layers: u32,
    /// Least and greatest distance of a surface.
    pub extent: [f64; 2],
}

/// A guess and its ratio.
type Guess = (f64, f64);

/// g(d) of a layer, |x + d r| over the distance that it has there: below 1 in front of the surface; 0, in front of everything, where x + d r has no direction.
pub fn impostor_ratio<F: Fn(u32, DVec3) -> f64>(
    scene: &ImpostorScene<F>,
    layer: u32,
    ray: &ImpostorRay,
    d: f64,
) -> f64 {
    let l = ray.origin + d * ray.direction;
    let size = l.length();
    if size > 0.0 {
        size / (scene.distance)(layer, l / size)
    } else {
        0.0
    }
}

/// The step from a guess by the line through it and another one, or, without, through the point at infinity, whose distance is `far`.
pub fn impostor_step(guess: (f64, f64), other: Option<(f64, f64)>, far: f64) -> f64 {
    let Some(other) = other else {
        return far * (1.0 - guess.1);
    };
    let slope = guess.1 - other.1;
    if slope.abs() < f64::from(IMPOSTOR_FLAT) {
        0.0
    } else {
        (guess.0 - other.0) * (1.0 - guess.1) / slope
    }
}

/// How far a ray goes to the guess after so many steps in a layer, by secants and brackets; of all methods but the classical look-up and the march.
pub fn impostor_by_steps<F: Fn(u32, DVec3) -> f64>(
    scene: &ImpostorScene<F>,
    layer: u32,
    ray: &ImpostorRay,
    settings: &ImpostorSettings,
) -> f64 {
    let (x, r, method) = (ray.origin, ray.direction, settings.method);
    let reach = x.length() + scene.extent[1];
    let far = (scene.distance)(layer, r);
    let across = (far - r.dot(x)).clamp(0.0, reach);
    if method == SearchMethod::Perpendicular {
        return across;
    }
    if method == SearchMethod::FixedPoint {
        let mut d = sphere_proxy(x, r, far).min(reach);
        for _ in 0..settings.steps {
            let l = x + d * r;
            let distance = l.try_normalize().map_or(far, |v| (scene.distance)(layer, v));
            d = sphere_proxy(x, r, distance).min(reach);
        }
        return d;
    }
    let is_secant = matches!(method, SearchMethod::SecantFromPoint | SearchMethod::SecantFromGuess);
    let mut begin = across;
    let mut is_at_point = matches!(method, SearchMethod::SecantFromPoint | SearchMethod::FalsePosition);
    let mut g = 0.0;
    if is_at_point || method == SearchMethod::Hybrid {
        g = impostor_ratio(scene, layer, ray, 0.0);
        // A point that the map's place does not see is no bracket.
        is_at_point = is_at_point || g <= 1.0;
    }
    if is_at_point {
        begin = 0.0;
    } else {
        g = impostor_ratio(scene, layer, ray, begin);
    }
    let (mut under, mut over): (Option<Guess>, Option<Guess>) = (None, None);
    let mut last = (begin, g);
    // As printed, false position takes its point for one in front.
    if g < 1.0 || is_at_point {
        under = Some(last);
    } else {
        over = Some(last);
    }
    let mut d = (begin + impostor_step(last, None, far)).clamp(0.0, reach);
    for _ in 0..settings.steps {
        let guess = (d, impostor_ratio(scene, layer, ray, d));
        let other = if is_secant {
            Some(last)
        } else if guess.1 < 1.0 {
            under = Some(guess);
            over
        } else {
            over = Some(guess);
            under
        };
        last = guess;
        d = (d + impostor_step(guess, other, far)).clamp(0.0, reach);
    }
    d
}

/// The guess of the first crossing whose residual is below the tolerance, by even steps and bisection; of none, the end where that is in front of everything,
/// or else the crossing of the least residual. How far the ray goes in a layer; settings have a step at least.
pub fn impostor_by_march<F: Fn(u32, DVec3) -> f64>(
    scene: &ImpostorScene<F>,
    layer: u32,
    ray: &ImpostorRay,
    settings: &ImpostorSettings,
) -> f64 {
    let margin = f64::from(IMPOSTOR_MARGIN);
    let [nearest, farthest] = scene.extent;
    let is_inside = ray.origin.length() < nearest;
    let mut begin = if is_inside {
        (1.0 - margin) * sphere_proxy(ray.origin, ray.direction, nearest)
    } else {
        0.0
    };
    let mut g_low = impostor_ratio(scene, layer, ray, begin);
    if begin > 0.0 && g_low >= 1.0 {
        // Between the centres of coarse texels the surface is nearer than at any of them.
        begin = 0.0;
        g_low = impostor_ratio(scene, layer, ray, begin);
    }
    let end = (1.0 + margin) * sphere_proxy(ray.origin, ray.direction, farthest);
    let step = (end - begin).max(0.0) / f64::from(settings.steps);
    let mut low = begin;
    let (mut best, mut least) = (end, f64::INFINITY);
    for i in 0..settings.steps {
        let high = begin + f64::from(i + 1) * step;
        let g_high = impostor_ratio(scene, layer, ray, high);
        if (g_low < 1.0) != (g_high < 1.0) {
            let (mut a, mut b) = (low, high);
            for _ in 0..settings.bisections {
                let middle = 0.5 * (a + b);
                if (impostor_ratio(scene, layer, ray, middle) < 1.0) == (g_low < 1.0) {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            let d = 0.5 * (a + b);
            let residual = (1.0 - impostor_ratio(scene, layer, ray, d)).abs();
            if residual < least {
                (best, least) = (d, residual);
            }
            if residual < f64::from(settings.tolerance) {
                return d;
            }
        }
        (low, g_low) = (high, g_high);
    }
    // Beyond the farthest surface and in front of what there is: the sky.
    if g_low < 1.0 { end } else { best }
}

/// Whether a search can follow a ray: squares and quotients of what it meets stay finite, in f32 too.
pub(super) fn is_ray(ray: &ImpostorRay) -> bool {
    let is_unit = (ray.direction.length_squared() - 1.0).abs() < f64::from(IMPOSTOR_UNIT);
    is_unit && ray.origin.abs().cmplt(DVec3::splat(NOTHING)).all()
}

/// What a ray meets, by the surfaces that are seen from the map's place. A direction that is no unit vector, and an origin that is not nearer than
/// [`ImpostorImage::NOTHING`] in each coordinate, find nothing.
pub fn impostor_search<F: Fn(u32, DVec3) -> f64>(
    scene: &ImpostorScene<F>,
    ray: &ImpostorRay,
    settings: &ImpostorSettings,
) -> ImpostorHit {
    let (x, r) = (ray.origin, ray.direction);
    let nowhere = ImpostorHit {
        direction: DVec3::ZERO,
        distance: 0.0,
        residual: 1.0,
        layer: 0,
    };
    if !is_ray(ray) {
        return nowhere;
    }
    if settings.method == SearchMethod::Classical {
        return ImpostorHit {
            direction: r,
            distance: NOTHING,
            ..nowhere
        };
    }
    let (mut best, mut is_found) = (nowhere, false);
    for layer in 0..scene.layers {
        let d = if settings.method == SearchMethod::March {
            impostor_by_march(scene, layer, ray, settings)
        } else {
            impostor_by_steps(scene, layer, ray, settings)
        };
        let l = x + d * r;
        let v = l.try_normalize();
        let distance = v.map_or(f64::INFINITY, |v| (scene.distance)(layer, v));
        let mut hit = ImpostorHit {
            direction: v.unwrap_or(r),
            distance: d,
            // 1 at the map's place itself.
            residual: (1.0 - l.length() / distance).abs(),
            layer,
        };
        if v.is_some() && distance >= NOTHING {
            // The sky in the first layer; in others no further surface.
            hit.direction = r;
            hit.distance = NOTHING;
            hit.residual = if layer == 0 { 0.0 } else { 1.0 };
        }
        let is_surface = hit.residual < f64::from(settings.tolerance) && hit.distance < NOTHING && hit.distance > 0.0;
        let is_better = if is_surface {
            !is_found || hit.distance < best.distance
        } else {
            !is_found && (layer == 0 || hit.residual < best.residual)
        };
        if is_better {
            best = hit;
        }
        is_found |= is_surface;
    }
    best
}

impl ImpostorImage {
    /// What a ray meets: twin of the search on the device.
    pub fn search(&self, ray: &ImpostorRay, settings: &ImpostorSettings) -> ImpostorHit {
        let scene = ImpostorScene {
            distance: |layer, v| self.distance(layer, v),
            layers: self.layers(),
            extent: self.extent().map(f64::from),
        };
        impostor_search(&scene, ray, settings)
    }
}
