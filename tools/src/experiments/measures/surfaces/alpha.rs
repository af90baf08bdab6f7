//! Alpha: light through surfaces that are there by chance or by a threshold.
//!
//! Oracle: a black surface of alpha α lets 1 − α of what is behind it through, n of them (1 − α)ⁿ.

use clerestory::Result;
use clerestory::render::Renderer;
use clerestory::scene::{AlphaMode, Material};
use clerestory_hard_cases::scenes::{floor, floor_from_above, lamp};
use glam::{Vec3, Vec4};

use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Image, z_score};
use crate::experiments::table::Table;

/// What the emitter behind shines with.
const EMISSION: f32 = 2.0;

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (size, spp) = if context.smoke { (4, 16) } else { (32, 1024) };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Light through black surfaces with alpha",
        &[
            "alpha",
            "mode",
            "surfaces",
            "expected",
            "rendered",
            "error over what is behind",
            "z",
            "variance over the binomial one",
            "rays a sample",
            "GPU ns a sample",
        ],
    );
    let blend = ("blend", AlphaMode::Blend);
    let mask = ("mask, cutoff 0.5", AlphaMode::Mask { cutoff: 0.5 });
    for (alpha, (name, alpha_mode), layers) in [
        (0.0, blend, 1),
        (0.25, blend, 1),
        (0.25, blend, 4),
        (0.25, blend, 16),
        (0.75, blend, 1),
        (0.75, blend, 4),
        (1.0, blend, 1),
        (0.25, mask, 4),
        (0.75, mask, 4),
    ] {
        let mut scene = floor_from_above(lamp(Vec3::splat(EMISSION)));
        for layer in 0..layers {
            let material = Material {
                base_color: Vec4::new(0.0, 0.0, 0.0, alpha),
                alpha_mode,
                ..Material::lambert("black", Vec3::ZERO)
            };
            let material = scene.add_material(material);
            scene.place(floor("black", material, 4.0, 0.25 * (layer + 1) as f32));
        }
        let through = match alpha_mode {
            AlphaMode::Mask { cutoff } => f64::from(u8::from(alpha < cutoff)),
            _ => (1.0 - f64::from(alpha)).powi(layers),
        };
        let expected = f64::from(EMISSION) * through;
        let image = Image::render(&Renderer::new(&gpu, &scene)?, size, spp, 3, "all")?;
        let (mean, deviation) = image.mean(0);
        let samples = f64::from(size * size) * f64::from(spp);
        // Each sample is all or nothing: the variance of the mean is known as well.
        let binomial = f64::from(EMISSION).powi(2) * through * (1.0 - through) / samples;
        let ratio = if binomial > 0.0 {
            deviation * deviation / binomial
        } else {
            1.0 + deviation
        };
        table.row([
            f64::from(alpha).into(),
            name.into(),
            (layers as u64).into(),
            expected.into(),
            mean.into(),
            ((mean - expected) / f64::from(EMISSION)).into(),
            z_score(mean - expected, binomial.sqrt(), expected).into(),
            ratio.into(),
            (image.count("rays") as f64 / samples).into(),
            (image.report.gpu_seconds * 1e9 / samples).into(),
        ]);
    }
    table.note(format!(
        "{size} × {size} pixels, {spp} independent samples each; z with the binomial variance, standard normal when the probability is right. \
         Where the expectation is 0 or certain, any difference shows as a large z."
    ));
    Ok(vec![table])
}
