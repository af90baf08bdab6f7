//! Walks from a lamp on the host, in double precision, which leave lights where they begin and wherever they arrive, whether they go on from there or not.
//!
//! Source: A. Keller, "Instant Radiosity", SIGGRAPH 1997, whose fractional walks survive by their number; the chapter on virtual light sources of a doctoral
//! thesis on metals and reflections on graphics hardware, §6.2 (`MET-V1`), whose walks survive by a roulette and count the lamp's own points as lights.
//!
//! Guarantee: a walk depends on (seed, number of the walk) alone.

use glam::{DVec2, DVec3, UVec4};

use super::potential::SurfaceLight;
use crate::transport::random::{pcg4d, unit_float};
use crate::transport::warp::square_to_cosine_hemisphere;

/// Scatterings of a walk at most, so that none goes on for ever where nothing is absorbed.
const BOUNCES_MAX: u32 = 4096;
/// Tells the number by which a walk survives from those of its ways.
const SURVIVAL: u32 = 0x7376_7276;

/// What a walk meets: a surface that scatters by Lambert's law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkHit {
    /// Place, m, from which the next way may begin.
    pub position: DVec3,
    /// Unit normal, to the side that the walk came from.
    pub normal: DVec3,
    /// Share of the light that is scattered, by channel.
    pub reflectance: DVec3,
}

/// By what walks end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Survival {
    /// A number each at every scattering.
    Roulette,
    /// One number each, evenly spread over all walks: of N, N ρᵏ go on after k scatterings, but for rounding.
    Fractional,
}

/// How many walks, and how they end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightWalks {
    /// Their number.
    pub walks: u32,
    /// Another one for other walks.
    pub seed: u32,
    /// By what they end.
    pub survival: Survival,
}

/// A direction about a normal.
fn about(normal: DVec3, local: DVec3) -> DVec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    tangent * local.x + bitangent * local.y + normal * local.z
}

impl LightWalks {
    /// The lights of all walks, one walk after the other, each from its beginning: `lamp` gives a point of the lamp and its normal by a point of the unit square,
    /// `power` is the lamp's, W, and `meet` says what a ray meets from a point along a unit direction.
    pub fn lights(
        &self,
        lamp: impl Fn(DVec2) -> (DVec3, DVec3),
        power: DVec3,
        meet: impl Fn(DVec3, DVec3) -> Option<WalkHit>,
    ) -> Vec<SurfaceLight> {
        let mut lights = Vec::new();
        for walk in 0..self.walks {
            let words = |bounce| pcg4d(UVec4::new(walk, bounce, self.seed, 0)).to_array().map(unit_float);
            let own = unit_float(pcg4d(UVec4::new(0, 0, self.seed, SURVIVAL)).x);
            // The fractions of a shifted lattice.
            let number = ((f64::from(walk) + own) / f64::from(self.walks)).fract();
            let [x, y, ..] = words(0);
            let (mut position, mut normal) = lamp(DVec2::new(x, y));
            let mut power = power / f64::from(self.walks);
            // Probability that the walk is still under way.
            let mut reached = 1.0;
            lights.push(SurfaceLight {
                position,
                normal,
                power,
                bounce: 0,
            });
            for bounce in 1..=BOUNCES_MAX {
                let [x, y, drawn, _] = words(bounce);
                let direction = about(normal, square_to_cosine_hemisphere(DVec2::new(x, y)));
                let Some(hit) = meet(position, direction) else {
                    break;
                };
                (position, normal) = (hit.position, hit.normal);
                power *= hit.reflectance;
                if power == DVec3::ZERO {
                    break;
                }
                lights.push(SurfaceLight {
                    position,
                    normal,
                    power,
                    bounce,
                });
                let survives = hit.reflectance.max_element().min(1.0);
                reached *= survives;
                let goes_on = match self.survival {
                    Survival::Roulette => drawn < survives,
                    Survival::Fractional => number < reached,
                };
                if !goes_on {
                    break;
                }
                power /= survives;
            }
        }
        lights
    }
}
