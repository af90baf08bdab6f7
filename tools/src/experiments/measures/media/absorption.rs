//! Absorption inside of solid bodies, seen straight through a slab.
//!
//! Oracle: e^−σd without refraction; with it, the series of reflections inside the slab, (1 − R)² a / (1 − R² a²) with a = e^−σd.

use clerestory::Result;
use clerestory::render::Renderer;
use clerestory::scene::Material;
use clerestory_hard_cases::scenes::{cuboid, floor_from_above, lamp};
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Image, z_score};

/// Thickness, m, and absorption, 1/m.
const SLABS: [(f32, f64); 5] = [(0.5, 0.0), (0.5, 1.0), (2.0, 1.0), (2.0, 4.0), (5.0, 0.1)];
const INDICES: [f32; 2] = [1.0, 1.5];

rows! {
    /// A slab.
    struct Row = "Light straight through an absorbing slab" by [index, thickness, absorption] {
        index: f64 = "index",
        thickness: f64 = "thickness (m)",
        absorption: f64 = "absorption (1/m)",
        expected: f64 = "expected",
        rendered: f64 = "rendered",
        error: f64 = "relative error",
        deviation: f64 = "standard deviation",
        z: f64 = "z",
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
        |row: &Row| (row.z.abs() / z_most(SLABS.len() * INDICES.len())).into(),
    )
    .because("by Šidák for all slabs"),
    Criterion::each(
        "the test can tell an error of one per cent",
        Bound::AtMost(0.002),
        |row: &Row| (row.deviation / row.expected).into(),
    )
    .because("then an error of one per cent is five deviations, and found 19 times in 20"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (size, spp) = context.pick((32, 1024), (4, 16));
        let gpu = (context.gpu)()?;
        let slabs = INDICES
            .iter()
            .flat_map(|ior| SLABS.iter().map(move |slab| (*ior, *slab)));
        let slabs: Vec<(f32, (f32, f64))> = slabs.collect();
        let name = |(ior, (thickness, sigma)): &(f32, (f32, f64))| format!("index {ior}, {thickness} m, {sigma}/m");
        // A seed for each, or their noise would be one and the same.
        let mut seeds = 4..;
        context.each(&slabs, name, |(ior, (thickness, sigma))| {
            let mut scene = floor_from_above(lamp(Vec3::ONE));
            let material = Material {
                attenuation_color: Vec3::splat((-sigma).exp() as f32),
                attenuation_distance: 1.0,
                ..Material::glass("slab", *ior)
            };
            let (lower, upper) = (Vec3::new(-3.0, 0.5, -3.0), Vec3::new(3.0, 0.5 + thickness, 3.0));
            let material = scene.add_material(material);
            scene.place(cuboid("slab", material, lower, upper));
            let index = f64::from(*ior);
            let reflected = ((index - 1.0) / (index + 1.0)).powi(2);
            // The colour is what the material holds, rounded.
            let through = f64::from((-sigma).exp() as f32).powf((*thickness).into());
            let expected = (1.0 - reflected).powi(2) * through / (1.0 - (reflected * through).powi(2));
            let image = Image::render(
                &Renderer::new(&gpu, &scene)?,
                size,
                spp,
                seeds.next().unwrap_or_default(),
                "all",
            )?;
            let (mean, deviation) = image.mean(0);
            Ok(vec![Row {
                index,
                thickness: (*thickness).into(),
                absorption: *sigma,
                expected,
                rendered: mean,
                error: mean / expected - 1.0,
                deviation,
                z: z_score(mean - expected, deviation, expected),
                samples: image.samples(),
                time: image.nanoseconds_per_sample(),
            }])
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "the largest relative error",
                largest(self, |_| true, |row| row.error.abs()),
            )
            .note("Independent samples. Deviations below 2⁻¹⁷ of the value count as that much in z: they are rounding.")
    }
}
