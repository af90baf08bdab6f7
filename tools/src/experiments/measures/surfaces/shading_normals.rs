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
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::greatest;
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

const ADAPTED: &str = "adapted (engine)";

/// Ways to take normals, and whether they are adapted.
const FORMS: [(&str, bool); 2] = [(ADAPTED, true), ("as it is", false)];

/// Degrees.
const TILTS: [f64; 4] = [5.0, 20.0, 45.0, 75.0];

rows! {
    /// A way to take normals, at a tilt.
    struct Row = "A white surface under a shading normal that is tilted" by [normal, tilt] {
        normal: String = "normal",
        tilt: f64 = "tilt (degrees)",
        greatest: f64 = "greatest reflectance seen",
        least: f64 = "least reflectance seen",
        mean: f64 = "mean reflectance seen",
        black: f64 = "views that see black",
        through: f64 = "greatest share of light through the surface",
        scattered_up: f64 = "greatest share of a beam that is scattered up",
        views: u64 = "views",
        samples: u64 = "samples per view",
        time: Repeats = "a normal (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the greatest reflectance seen is 1",
        Bound::Between(0.99, 1.01),
        |row: &Row| row.greatest.into(),
    )
    .among(Row::is_adapted)
    .because("half of what an eye sees"),
    Criterion::each(
        "the least reflectance seen is 1",
        Bound::Between(0.99, 1.01),
        |row: &Row| row.least.into(),
    )
    .among(Row::is_adapted)
    .because("half of what an eye sees"),
    Criterion::each(
        "the mean reflectance seen is 1",
        Bound::Between(0.99, 1.01),
        |row: &Row| row.mean.into(),
    )
    .among(Row::is_adapted)
    .because("half of what an eye sees"),
    Criterion::each("no view sees black", Bound::AtMost(0.0), |row: &Row| row.black.into())
        .among(Row::is_adapted)
        .in_every_form(),
    Criterion::each("no light passes through", Bound::AtMost(0.0), |row: &Row| {
        row.through.into()
    })
    .among(Row::is_adapted)
    .in_every_form(),
];

impl Row {
    fn is_adapted(&self) -> bool {
        self.normal == ADAPTED
    }

    fn of((name, adapted): (&str, bool), tilt: f64, directions: &[DVec3], samples: u32, time: Vec<f64>) -> Self {
        let ns = tilted(tilt);
        let all: Vec<Seen> = directions.iter().map(|wo| seen(ns, *wo, adapted, samples)).collect();
        let of_all = |value: fn(&Seen) -> f64| greatest(all.iter().map(value));
        let black = all.iter().filter(|seen| seen.reflected + seen.through == 0.0).count();
        let beams = directions.iter().map(|wi| beam(ns, *wi, adapted, samples));
        Self {
            normal: name.into(),
            tilt,
            greatest: of_all(|seen| seen.reflected),
            least: -of_all(|seen| -seen.reflected),
            mean: all.iter().map(|seen| seen.reflected).sum::<f64>() / all.len() as f64,
            black: black as f64 / all.len() as f64,
            through: of_all(|seen| seen.through),
            scattered_up: greatest(beams),
            views: all.len() as u64,
            samples: samples.into(),
            time: Repeats(time),
        }
    }
}

/// The shading normal at so many degrees from the surface's own.
fn tilted(tilt: f64) -> DVec3 {
    direction(tilt.to_radians().cos(), 0.0)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (views, samples): (u32, u32) = context.pick((256, 2048), (8, 64));
        let name = |tilt: &f64| format!("{tilt} degrees");
        context.each(&TILTS, name, |tilt| {
            let mut random = Random::new(6);
            let directions: Vec<DVec3> = (0..views)
                .map(|_| direction(1.0 - 0.99 * random.unit(), TAU * random.unit()))
                .collect();
            let ns = tilted(*tilt);
            let times = context.in_turns(9, FORMS.len(), |i| {
                let (_, adapted) = FORMS[i];
                Ok(nanoseconds_once(&directions, |wo| {
                    if adapted {
                        adapt_shading_normal(ns, SURFACE, *wo)
                    } else {
                        ns
                    }
                }))
            })?;
            let forms = FORMS.into_iter().zip(times);
            Ok(forms
                .map(|(form, time)| Row::of(form, *tilt, &directions, samples, time))
                .collect())
        })
    }

    fn findings(&self) -> Findings {
        let half_way = self.iter().find(|row| row.is_adapted() && row.tilt == 45.0);
        Findings::of(self, CRITERIA)
            .headline(
                "mean reflectance by adapted normals at a tilt of 45 degrees",
                half_way.map(|row| row.mean.into()),
            )
            .note(
                "Exact: reflectance 1, nothing black, nothing through. Directions over the upper half, Sobol' samples. A path tracer gathers what \
                 is seen; a beam's share above 1 concerns paths from lights (Veach 1997, 5.3), which shading normals of either kind give energy to.",
            )
    }
}
