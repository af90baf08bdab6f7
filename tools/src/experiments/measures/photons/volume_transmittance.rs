//! What a grid leaves of light along the rays of photon mapping, by walks and by tables, beside the integral of the density, and their noise beside that of delta tracking.
//!
//! A floor that a light beneath a grid lights is seen through the grid and beside it, by the same photons and rays: the ratio of both pictures is what rays have left of light. Lines between the
//! centres of cells have the mean of the cells, which makes the integral exact.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::gpu::shaders::constants::WAY_PLACES;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::volume::transmittance::VolumeTransmittance;
use clerestory::transport::random::SamplerKind;
use clerestory_hard_cases::scenes::{
    DensityProfile, PROFILE_FACES, PROFILE_SIGMA, density_profiles, floor_under, profile_grid,
};

use super::cases::mapper;
use crate::experiments::findings::{Bound, Criterion, Findings, Study, change, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;

/// Pixels a side, and rays of each: in full, and in a smoke run.
const FULL: (u32, u32) = (32, 256);
const SMOKE: (u32, u32) = (4, 16);
/// How far aside the grid is that rays miss, m.
const ASIDE: f64 = 100.0;
/// Photons, and the radius of their kernels, m: the floor's light is the same in both pictures, whatever these are.
const PHOTONS: u32 = 1 << 10;
const RADIUS: f32 = 0.4;

const WALK: &str = "walk";
const TABLE: &str = "table";
const ESTIMATES: [(&str, VolumeTransmittance); 2] =
    [(WALK, VolumeTransmittance::Walk), (TABLE, VolumeTransmittance::Table)];

rows! {
    /// An estimate of a transmittance.
    struct Row = "What rays through a grid have left of light" by [density, estimate, extinction] {
        density: String = "density",
        estimate: String = "transmittance by",
        extinction: f64 = "extinction at density 1 (1/m)",
        exact: f64 = "exact",
        found: f64 = "found",
        error: f64 = "error (%)",
        off: Option<f64> = "standard errors off, by the spread of pixels",
        noise: f64 = "variance of a ray over that of delta tracking",
        look_ups: f64 = "look-ups of the density a ray, with the eye path's own",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    all: Vec<Row>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "walks have the exact transmittance: standard errors off",
        Bound::AtMost(3.0),
        |row: &Row| row.off.map_or(f64::NAN, f64::abs).into(),
    )
    .among(|row| row.estimate == WALK),
    Criterion::each(
        "walks vary less than delta tracking: variance over its",
        Bound::AtMost(1.0),
        |row: &Row| row.noise.into(),
    )
    .among(|row| row.estimate == WALK),
    Criterion::each(
        "tables have no noise: variance over that of delta tracking",
        Bound::AtMost(1e-6),
        |row: &Row| row.noise.into(),
    )
    .among(|row| row.estimate == TABLE)
    .because("rays are parallel, and all that differs is rounding"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let form = context.pick(FULL, SMOKE);
        let name = |profile: &DensityProfile| profile.name.to_owned();
        let all = context.each(&density_profiles(), name, |profile| {
            let of = |estimate: &(&str, VolumeTransmittance)| rows_of(&gpu, profile, *estimate, form);
            Ok(ESTIMATES.iter().map(of).collect::<Result<Vec<_>>>()?.concat())
        })?;
        Ok(Self { all })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.all, CRITERIA)
            .headline(
                "error of a table where a layer lies between its places, the most (%)",
                largest(&self.all, |row| row.estimate == TABLE, |row| row.error.abs()),
            )
            .note(format!(
                "{} rays, a metre of a grid each, straight through it. A table has {WAY_PLACES} places and no more look-ups than these; it misses what lies between. Delta tracking lets \
                 all of a ray's light pass, or nothing: τ (1 − τ).",
                FULL.0 * FULL.0 * FULL.1,
            ))
    }
}

/// The floor's picture, and look-ups of the density a ray.
fn seen(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, side: u32) -> Result<(Vec<f32>, f64)> {
    let mut mapper = mapper(gpu, scene, [side; 2], settings.clone())?;
    let rays = settings.samples_per_pass;
    while mapper.step(rays)?.is_some() {}
    let (picture, _) = mapper.picture()?;
    let look_ups = mapper.eye_counters().density_lookups as f64 / f64::from(side * side * rays);
    Ok((picture.main_layer()?.values().to_vec(), look_ups))
}

fn rows_of(
    gpu: &Gpu,
    profile: &DensityProfile,
    (estimate, volume_transmittance): (&str, VolumeTransmittance),
    (side, rays): (u32, u32),
) -> Result<Vec<Row>> {
    let settings = PhotonSettings {
        path_set: "bounces=1..1".parse()?,
        photons: PHOTONS,
        radius: RADIUS,
        volume_radius: RADIUS,
        samples_per_pass: rays,
        direct_photons: true,
        sampler: SamplerKind::Pcg,
        volume_transmittance,
        ..PhotonSettings::default()
    };
    let (through, look_ups) = seen(gpu, &floor_under(profile, 0.0), &settings, side)?;
    let (beside, _) = seen(gpu, &floor_under(profile, ASIDE), &settings, side)?;
    let [low, high] = PROFILE_FACES;
    let depth = profile_grid(profile, 0.0).mean() * (high - low);
    let rows = PROFILE_SIGMA.into_iter().enumerate().map(|(band, sigma)| {
        let pixels = through.chunks_exact(3).zip(beside.chunks_exact(3));
        let left: Vec<f64> = pixels
            .map(|(through, beside)| f64::from(through[band]) / f64::from(beside[band]))
            .collect();
        let [found, spread] = mean_with_error(&left);
        let exact = (-f64::from(sigma) * depth).exp();
        // The mean's error is of all rays.
        let variance = spread * spread * left.len() as f64 * f64::from(rays);
        Row {
            density: profile.name.into(),
            estimate: estimate.into(),
            extinction: f64::from(sigma),
            exact,
            found,
            error: change(found, exact),
            off: (volume_transmittance == VolumeTransmittance::Walk).then(|| (found - exact) / spread),
            noise: variance / (exact * (1.0 - exact)),
            look_ups,
        }
    });
    Ok(rows.collect())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn grids_have_the_mean_of_their_cells_along_rays() {
        const STEPS: u32 = 1 << 16;
        let [low, high] = PROFILE_FACES;
        for profile in density_profiles() {
            let density = profile_grid(&profile, 0.0);
            let step = (high - low) / f64::from(STEPS);
            let at = |i: u32| density.density(DVec3::Y * (low + (f64::from(i) + 0.5) * step));
            let sum: f64 = (0..STEPS).map(at).sum();
            assert!((sum * step / density.mean() - 1.0).abs() < 1e-6, "{}", profile.name);
        }
    }
}
