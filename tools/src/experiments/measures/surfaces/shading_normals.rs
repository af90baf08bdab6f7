//! Shading normals that differ from the surface's own: light that appears from nothing, passes through the surface or is lost, for the
//! engine's adapted normals and for normals taken as they are.
//!
//! Oracle: a white surface reflects all light and lets none through.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::transport::bsdf::{BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval, bsdf_gltf, bsdf_sample};
use clerestory::transport::shading_normal::{adapt_shading_normal, sides_agree};
use clerestory::transport::warp::orthonormal_basis;
use glam::DVec3;

use super::energy::{WHITE, context as bsdf, direction, numbers};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::Table;
use crate::random::Random;

/// A frame about a normal.
struct Frame(DVec3, DVec3, DVec3);

impl Frame {
    fn about(n: DVec3) -> Self {
        let (t, b) = orthonormal_basis(n);
        Self(t, b, n)
    }

    fn local(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.0), v.dot(self.1), v.dot(self.2))
    }

    fn world(&self, v: DVec3) -> DVec3 {
        self.0 * v.x + self.1 * v.y + self.2 * v.z
    }
}

/// What a surface does with light that is seen from one direction.
#[derive(Default)]
struct Seen {
    reflected: f64,
    through: f64,
}

const SURFACE: DVec3 = DVec3::Z;

fn seen(ns: DVec3, wo: DVec3, adapted: bool, samples: u32) -> Seen {
    let (context, white) = (
        bsdf(BsdfFeatures::ALL),
        bsdf_gltf(&GltfFactors {
            roughness: 0.6,
            ..WHITE
        }),
    );
    let n = if adapted {
        adapt_shading_normal(ns, SURFACE, wo)
    } else {
        ns
    };
    let frame = Frame::about(n);
    let local = frame.local(wo);
    let mut sums = Seen::default();
    if local.z <= 0.0 {
        return sums;
    }
    for i in 0..samples {
        let sample = bsdf_sample(&context, &white, local, numbers(i), LOBE_ALL);
        let wi = frame.world(sample.wi);
        if sample.flags == 0 || (adapted && !sides_agree(n, SURFACE, wi)) {
            continue;
        }
        if wi.dot(SURFACE) > 0.0 {
            sums.reflected += sample.weight.x;
        } else {
            sums.through += sample.weight.x;
        }
    }
    Seen {
        reflected: sums.reflected / f64::from(samples),
        through: sums.through / f64::from(samples),
    }
}

/// The share of a beam from `wi` that leaves upwards: ∫ f |wi·n| wo·ng / wi·ng dwo.
fn beam(ns: DVec3, wi: DVec3, adapted: bool, samples: u32) -> f64 {
    let (context, white) = (
        bsdf(BsdfFeatures::ALL),
        bsdf_gltf(&GltfFactors {
            roughness: 0.6,
            ..WHITE
        }),
    );
    let mut sum = 0.0;
    for i in 0..samples {
        let u = numbers(i);
        let wo = direction(1.0 - u.x, TAU * u.y);
        let n = if adapted {
            adapt_shading_normal(ns, SURFACE, wo)
        } else {
            ns
        };
        let frame = Frame::about(n);
        let (o, i) = (frame.local(wo), frame.local(wi));
        if o.z > 0.0 && (!adapted || sides_agree(n, SURFACE, wi)) {
            // The scattering function holds the cosine to the shading normal.
            sum += bsdf_eval(&context, &white, o, i, LOBE_ALL).x * wo.z / wi.z;
        }
    }
    TAU * sum / f64::from(samples)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (views, samples) = if context.smoke { (8, 64) } else { (256, 2048) };
    let mut table = Table::new(
        "A white surface under a shading normal that is tilted",
        &[
            "tilt (degrees)",
            "normal",
            "greatest reflectance seen",
            "mean reflectance seen",
            "views that see black",
            "greatest share of light through the surface",
            "greatest share of a beam that is scattered up",
            "ns a normal",
        ],
    );
    for tilt in [5.0_f64, 20.0, 45.0, 75.0] {
        let ns = direction(tilt.to_radians().cos(), 0.0);
        for (name, adapted) in [("adapted (engine)", true), ("as it is", false)] {
            let mut random = Random::new(6);
            let directions: Vec<DVec3> = (0..views)
                .map(|_| direction(1.0 - 0.99 * random.unit(), TAU * random.unit()))
                .collect();
            let all: Vec<Seen> = directions.iter().map(|wo| seen(ns, *wo, adapted, samples)).collect();
            let greatest = |value: fn(&Seen) -> f64| all.iter().map(value).fold(0.0, f64::max);
            let black = all.iter().filter(|seen| seen.reflected + seen.through == 0.0).count();
            let beams = directions
                .iter()
                .map(|wi| beam(ns, *wi, adapted, samples))
                .fold(0.0, f64::max);
            let time = nanoseconds(context.smoke, &directions, |wo| {
                if adapted {
                    adapt_shading_normal(ns, SURFACE, *wo)
                } else {
                    ns
                }
            });
            table.row([
                tilt.into(),
                name.into(),
                greatest(|seen| seen.reflected).into(),
                (all.iter().map(|seen| seen.reflected).sum::<f64>() / all.len() as f64).into(),
                (black as f64 / all.len() as f64).into(),
                greatest(|seen| seen.through).into(),
                beams.into(),
                time.into(),
            ]);
        }
    }
    table.note(format!(
        "Exact: reflectance 1, nothing black, nothing through. {views} directions over the upper half, {samples} Sobol' samples each. A path \
         tracer gathers what is seen; a beam's share above 1 concerns paths from lights (Veach 1997, 5.3), which shading normals of either \
         kind give energy to."
    ));
    Ok(vec![table])
}
