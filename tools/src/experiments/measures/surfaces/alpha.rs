//! Alpha: light through surfaces that are there by chance or by a threshold.
//!
//! Oracle: a black surface of alpha α lets 1 − α of what is behind it through, n of them (1 − α)ⁿ.

use clerestory::Result;
use clerestory::render::Renderer;
use clerestory::scene::{AlphaMode, Material};
use clerestory_hard_cases::scenes::{floor, floor_from_above, lamp};
use glam::{Vec3, Vec4};

use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Image, z_score};

/// What the emitter behind shines with.
const EMISSION: f32 = 2.0;

const BLEND: (&str, AlphaMode) = ("blend", AlphaMode::Blend);
const MASK: (&str, AlphaMode) = ("mask, cutoff 0.5", AlphaMode::Mask { cutoff: 0.5 });
/// Alpha, what it does, and surfaces one behind the other.
type Case = (f32, (&'static str, AlphaMode), i32);
const CASES: [Case; 9] = [
    (0.0, BLEND, 1),
    (0.25, BLEND, 1),
    (0.25, BLEND, 4),
    (0.25, BLEND, 16),
    (0.75, BLEND, 1),
    (0.75, BLEND, 4),
    (1.0, BLEND, 1),
    (0.25, MASK, 4),
    (0.75, MASK, 4),
];

rows! {
    /// Surfaces of an alpha.
    struct Row = "Light through black surfaces with alpha" by [mode, alpha, surfaces] {
        mode: String = "mode",
        alpha: f64 = "alpha",
        surfaces: u64 = "surfaces",
        expected: f64 = "expected",
        rendered: f64 = "rendered",
        error: f64 = "error over what is behind",
        z: f64 = "z",
        variance: f64 = "variance over the binomial one",
        rays: f64 = "rays per sample",
        samples: u64 = "samples",
        time: f64 = "GPU time of a sample (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "z of the mean is standard normal: |z| over what chance exceeds once in a hundred runs",
        Bound::AtMost(1.0),
        |row: &Row| (row.z.abs() / z_most(CASES.len())).into(),
    )
    .because("by Šidák for all cases"),
    Criterion::each("the variance is the binomial one", Bound::Between(0.95, 1.05), |row: &Row| row.variance.into())
        .among(|row: &Row| (0.0..EMISSION.into()).contains(&row.expected) && row.expected > 0.0)
    .because("four surfaces of three quarters let 0.4 % through: the standard error is 1.6 % in 2²⁰ samples, and three of them are allowed"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (size, spp) = context.pick((32, 1024), (4, 16));
        let gpu = (context.gpu)()?;
        let name = |(alpha, (mode, _), layers): &Case| format!("{mode}, {layers} of {alpha}");
        // A seed for each, or their noise would be one and the same.
        let mut seeds = 3..;
        context.each(&CASES, name, |(alpha, (mode, alpha_mode), layers)| {
            let mut scene = floor_from_above(lamp(Vec3::splat(EMISSION)));
            for layer in 0..*layers {
                let material = Material {
                    base_color: Vec4::new(0.0, 0.0, 0.0, *alpha),
                    alpha_mode: *alpha_mode,
                    ..Material::lambert("black", Vec3::ZERO)
                };
                let material = scene.add_material(material);
                scene.place(floor("black", material, 4.0, 0.25 * (layer + 1) as f32));
            }
            let through = match alpha_mode {
                AlphaMode::Mask { cutoff } => f64::from(u8::from(alpha < cutoff)),
                _ => (1.0 - f64::from(*alpha)).powi(*layers),
            };
            let expected = f64::from(EMISSION) * through;
            let image = Image::render(
                &Renderer::new(&gpu, &scene)?,
                size,
                spp,
                seeds.next().unwrap_or_default(),
                "all",
            )?;
            let (mean, deviation) = image.mean(0);
            let samples = image.samples();
            // Each sample is all or nothing: the variance of the mean is known as well.
            let binomial = f64::from(EMISSION).powi(2) * through * (1.0 - through) / samples as f64;
            let variance = if binomial > 0.0 {
                deviation * deviation / binomial
            } else {
                1.0 + deviation
            };
            Ok(vec![Row {
                mode: (*mode).into(),
                alpha: (*alpha).into(),
                surfaces: *layers as u64,
                expected,
                rendered: mean,
                error: (mean - expected) / f64::from(EMISSION),
                z: z_score(mean - expected, binomial.sqrt(), expected),
                variance,
                rays: image.count("rays") as f64 / samples as f64,
                samples,
                time: image.nanoseconds_per_sample(),
            }])
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline("the largest error over what is behind", largest(self, |_| true, |row| row.error.abs()))
            .note(
                "Independent samples; z with the binomial variance, standard normal when the probability is right. Where the expectation is 0 or \
                 certain, any difference shows as a large z.",
            )
    }
}
