//! Absorption inside of solid bodies, seen straight through a slab.
//!
//! Oracle: e^−σd without refraction; with it, the series of reflections inside the slab, (1 − R)² a / (1 − R² a²) with a = e^−σd.

use clerestory::Result;
use clerestory::render::Renderer;
use clerestory::scene::Material;
use clerestory_hard_cases::scenes::{cuboid, floor_from_above, lamp};
use glam::Vec3;

use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Image, z_score};
use crate::experiments::table::Table;

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (size, spp) = if context.smoke { (4, 16) } else { (32, 1024) };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Light straight through an absorbing slab",
        &[
            "index",
            "thickness (m)",
            "absorption (1/m)",
            "expected",
            "rendered",
            "relative error",
            "standard deviation",
            "z",
            "GPU ns a sample",
        ],
    );
    for ior in [1.0_f32, 1.5] {
        for (thickness, sigma) in [(0.5_f32, 0.0_f64), (0.5, 1.0), (2.0, 1.0), (2.0, 4.0), (5.0, 0.1)] {
            let mut scene = floor_from_above(lamp(Vec3::ONE));
            let material = Material {
                attenuation_color: Vec3::splat((-sigma).exp() as f32),
                attenuation_distance: 1.0,
                ..Material::glass("slab", ior)
            };
            let (lower, upper) = (Vec3::new(-3.0, 0.5, -3.0), Vec3::new(3.0, 0.5 + thickness, 3.0));
            let material = scene.add_material(material);
            scene.place(cuboid("slab", material, lower, upper));
            let index = f64::from(ior);
            let reflected = ((index - 1.0) / (index + 1.0)).powi(2);
            // The colour is what the material holds, rounded.
            let through = f64::from((-sigma).exp() as f32).powf(thickness.into());
            let expected = (1.0 - reflected).powi(2) * through / (1.0 - (reflected * through).powi(2));
            let image = Image::render(&Renderer::new(&gpu, &scene)?, size, spp, 4, "all")?;
            let (mean, deviation) = image.mean(0);
            let samples = f64::from(size * size) * f64::from(spp);
            table.row([
                index.into(),
                f64::from(thickness).into(),
                sigma.into(),
                expected.into(),
                mean.into(),
                (mean / expected - 1.0).into(),
                deviation.into(),
                z_score(mean - expected, deviation, expected).into(),
                (image.report.gpu_seconds * 1e9 / samples).into(),
            ]);
        }
    }
    table.note(format!(
        "{size} × {size} pixels, {spp} independent samples each. Deviations below 2⁻¹⁷ of the value count as that much in z: they are rounding."
    ));
    Ok(vec![table])
}
