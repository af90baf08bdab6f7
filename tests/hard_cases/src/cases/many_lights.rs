//! A hundred thousand lights.

use clerestory::Result;
use clerestory::scene::{LightKind, Material, Scene};
use glam::{DVec3, Vec3};

use crate::random::Random;
use crate::scenes::{floor_from_above, pixel_averages};
use crate::{Easel, HardCase, Judgement};

const LIGHTS: usize = 100_000;
const RHO: f32 = 0.5;
const SIZE: u32 = 8;

pub(super) const CASE: HardCase = HardCase {
    name: "many-lights",
    breaks: "A loop over all lights at each bounce never ends (the software driver silently ends it after 65,535 turns); sums of powers in f32 lose the small lights.",
    expects: "A floor under 10⁵ point lights, whose powers span six decades, has the sum of their laws: I cos θ / r² each.",
    picture: || Ok(scene().0),
    techniques: Some(judge),
    ..HardCase::BASE
};

/// The floor with its lights, and their places and intensities.
fn scene() -> (Scene, Vec<(DVec3, f64)>) {
    let mut scene = floor_from_above(Material::lambert("floor", Vec3::splat(RHO)));
    let mut random = Random(12);
    let mut lights = Vec::with_capacity(LIGHTS);
    for i in 0..LIGHTS {
        let position = Vec3::new(random.range(-3.0, 3.0), random.range(1.0, 2.0), random.range(-3.0, 3.0));
        let intensity = [1e-4, 1e-8, 1e-10][i % 3] * random.range(0.5, 1.5);
        scene.add_light(
            "small",
            LightKind::Point {
                position,
                intensity: Vec3::splat(intensity),
            },
        );
        lights.push((position.as_dvec3(), f64::from(intensity)));
    }
    (scene, lights)
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let (scene, lights) = scene();
    let irradiance = |x: f64, z: f64| {
        let law = |(place, intensity): &(DVec3, f64)| {
            let to = *place - DVec3::new(x, 0.0, z);
            intensity * to.y / to.length().powi(3)
        };
        lights.iter().map(law).sum::<f64>()
    };
    // Lights at 1 m and more, pixels of 0.25 m: four points per pixel err by less than 10⁻³, a tenth of the noise of the sum.
    let averages = pixel_averages(SIZE, 1.0, 2, irradiance);
    let radiance: Vec<f32> = (averages.iter())
        .flat_map(|e| [(f64::from(RHO) * e / std::f64::consts::PI) as f32; 3])
        .collect();
    let painted = easel.paint_in_passes(&scene, [SIZE; 2], 256)?;
    judgement.pixels("sum of the laws", &painted, &radiance)?;
    Ok(judgement)
}
