//! Weights of texels: seamless bilinear look-ups, across the edges of layers, and mips that keep energy.

use super::{Parametrization, Texel};
use glam::{DVec2, DVec3, UVec2};

/// A texel and its share of a look-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tap {
    /// The texel, inside the map.
    pub texel: Texel,
    /// Its weight.
    pub weight: f64,
}

impl Parametrization {
    /// The bilinear taps of a direction; weights sum to 1. Where a texel does not exist (see [`Parametrization::wrap`]) or its centre lies
    /// outside a disc, its weight is 0 and the others share it. `None` for a direction that the map does not hold.
    pub fn taps(self, size: UVec2, direction: DVec3) -> Option<[Tap; 4]> {
        let at = self.encode(direction)?;
        let place = at.uv * size.as_dvec2() - 0.5;
        let corner = place.floor();
        let part = place - corner;
        let none = Tap {
            texel: Texel {
                layer: at.layer,
                x: 0,
                y: 0,
            },
            weight: 0.0,
        };
        let mut taps = [none; 4];
        let mut sum = 0.0;
        for (i, tap) in taps.iter_mut().enumerate() {
            let step = UVec2::new(i as u32 & 1, i as u32 >> 1);
            let weight = DVec2::select(step.cmpeq(UVec2::ONE), part, 1.0 - part).element_product();
            let p = corner.as_ivec2() + step.as_ivec2();
            let Some(texel) = self.wrap(size, at.layer, p.x, p.y) else {
                continue;
            };
            if weight > 0.0 && (!self.is_disc() || self.holds(texel.centre(size))) {
                *tap = Tap { texel, weight };
                sum += weight;
            }
        }
        if sum > 0.0 {
            for tap in &mut taps {
                tap.weight /= sum;
            }
            return Some(taps);
        }
        // A direction at the rim of a disc of few texels: the texel that holds it.
        let nearest = (at.uv * size.as_dvec2()).as_uvec2().min(size - 1);
        taps[0] = Tap {
            texel: Texel {
                layer: at.layer,
                x: nearest.x,
                y: nearest.y,
            },
            weight: 1.0,
        };
        Some(taps)
    }

    /// The four texels of a level that one of the next coarser level, of half the `size`, is the mean of: weighted by solid angle, so that the
    /// integral over the sphere stays, which plain means do not keep. All weights are 0 where no direction is.
    pub fn children(self, size: UVec2, coarse: Texel) -> [Tap; 4] {
        let texels = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| Texel {
            layer: coarse.layer,
            x: 2 * coarse.x + x,
            y: 2 * coarse.y + y,
        });
        let solid_angles = texels.map(|texel| self.texel_solid_angle(size, texel));
        let whole: f64 = solid_angles.iter().sum();
        let scale = if whole > 0.0 { 1.0 / whole } else { 0.0 };
        let mut taps = texels.map(|texel| Tap { texel, weight: 0.0 });
        for (tap, solid_angle) in taps.iter_mut().zip(solid_angles) {
            tap.weight = scale * solid_angle;
        }
        taps
    }
}
