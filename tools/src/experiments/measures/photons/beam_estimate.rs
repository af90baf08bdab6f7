//! Single scattering along a ray by the photons of a device, beside its closed form: collisions under disks and under balls, and whole ways.
//!
//! Closed form: the airlight integral about a point light of 1 W/sr in an endless medium, as far as a wall. Source of the units that are compared: B. Fabianowski, "Interactive Manycore
//! Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.1, on W. Jarosz, M. Zwicker and H. W. Jensen, "The Beam Radiance Estimate for Volumetric Photon Mapping", Computer
//! Graphics Forum 27(2), 2008.

use clerestory::Result;
use clerestory::accel::sphere::closest_approach;
use clerestory::gpu::Gpu;
use clerestory::scene::{Camera, LightKind, Material, Medium, Phase, Projection, Scene};
use clerestory::techniques::photon_mapping::kernel::{KernelProfile, kernel_profile};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory::techniques::photon_mapping::volume::event::PhotonEvent;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::transport::phase::phase_function;
use clerestory::transport::random::SamplerKind;
use clerestory_hard_cases::scenes::quad;
use glam::{DVec3, Vec3};

use super::cases::mapper;
use crate::experiments::findings::{Bound, Criterion, Findings, Study, change, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;
use crate::experiments::measures::pictures::mean;

/// Pixels, all of which see the same ray.
const SIZE: [u32; 2] = [2, 2];
/// Passes, whose spread gives the standard error of their mean, and the divisor of their photons: in full, and in a smoke run.
const FULL: (u32, u32) = (24, 1);
const SMOKE: (u32, u32) = (4, 32);
/// Constants of a smoke run.
const SMOKE_CONSTANTS: usize = 2;
/// Coefficients of absorption and scattering, 1/m.
const SIGMA_A: f32 = 0.05;
const SIGMA_S: f32 = 0.1;
/// The light's distance from the ray, and that of the wall that ends it, m.
const ASIDE: f32 = 1.0;
const WALL: f32 = 4.0;
/// Half of what the orthographic camera sees, m: one ray.
const HALF_HEIGHT: f32 = 1e-6;
/// What lengths are multiplied by for the second size.
const LONGER: f32 = 10.0;

/// Schlick's k, the light's place along the ray, m, and the radiance, W/(m² sr).
const CONSTANTS: [(f32, f32, f64); 6] = [
    (0.0, 2.0, 0.010_839_7),
    (0.5, 2.0, 0.011_318_0),
    (-0.5, 2.0, 0.009_750_8),
    (0.0, 0.0, 0.007_289_3),
    (0.5, 0.0, 0.003_596_0),
    (-0.5, 0.0, 0.011_123_0),
];

const DISKS: &str = "beam estimate";
const BALLS: &str = "marched estimate";
const BEAMS: &str = "photon beams";

/// An estimate, the radius of its kernels, m, and its photons in a pass.
struct Estimate {
    name: &'static str,
    volume: VolumeEstimate,
    radius: f32,
    photons: u32,
}

/// A ray meets a beam far more often than a collision, so fewer and narrower beams do.
const ESTIMATES: [Estimate; 3] = [
    Estimate {
        name: DISKS,
        volume: VolumeEstimate::Ray,
        radius: 0.1,
        photons: 1 << 20,
    },
    Estimate {
        name: BALLS,
        volume: VolumeEstimate::March,
        radius: 0.1,
        photons: 1 << 20,
    },
    Estimate {
        name: BEAMS,
        volume: VolumeEstimate::Beams,
        radius: 0.02,
        photons: 1 << 16,
    },
];

rows! {
    /// An estimate of a constant.
    struct Row = "Single scattering along a ray" by [estimate, k, place, lengths] {
        estimate: String = "estimate",
        k: f64 = "k",
        place: f64 = "light's place along the ray (m)",
        lengths: f64 = "lengths multiplied by",
        photons: u64 = "photons",
        kernels: u64 = "kernels that the ray met",
        closed_form: f64 = "closed form",
        found: f64 = "found",
        spread: f64 = "standard error by the spread of passes",
        off: f64 = "standard errors off",
        mirrored: Option<f64> = "standard errors off the constant of −k",
        rescaled: Option<f64> = "change by the lengths alone, but for their square (%)",
    }
}

rows! {
    /// What a sum over collisions takes for the flux of one.
    struct Units = "Units of the flux, by the same collisions" by [units] {
        units: String = "units",
        found: f64 = "found",
        over_device: f64 = "over what the device found",
        off: f64 = "standard errors off the closed form",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    constants: Vec<Row>,
    units: Vec<Units>,
}

const CORRECTED: &str = "flux times the albedo, as corrected";
const ORIGINAL: &str = "flux times the scattering coefficient, as first published";

const THREE: Bound = Bound::AtMost(3.0);
const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("disks have the closed form: standard errors off", THREE, |row: &Row| {
        row.off.abs().into()
    })
    .among(|row| row.estimate == DISKS),
    Criterion::each("balls have the closed form: standard errors off", THREE, |row: &Row| {
        row.off.abs().into()
    })
    .among(|row| row.estimate == BALLS),
    Criterion::each("beams have the closed form: standard errors off", THREE, |row: &Row| {
        row.off.abs().into()
    })
    .among(|row| row.estimate == BEAMS),
    Criterion::each(
        "a mirrored phase function fails: standard errors off",
        Bound::AtLeast(3.0),
        |row: &Row| row.mirrored.map_or(f64::NAN, f64::abs).into(),
    )
    .among(|row| row.mirrored.is_some()),
    Criterion::each(
        "lengths times ten give a hundredth: change (%)",
        Bound::Between(-0.01, 0.01),
        |row: &Row| row.rescaled.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.rescaled.is_some())
    .because("photons are the same, and all that lengths may do is rounding"),
];
const OF_UNITS: &[Criterion<Units>] = &[
    Criterion::each(
        "the device sums up as its collisions say: ratio",
        Bound::Between(0.999, 1.001),
        |row: &Units| row.over_device.into(),
    )
    .among(|row| row.units == CORRECTED)
    .because("both have the same collisions and kernels; sums are in f32"),
    Criterion::each(
        "the units first published are off by the extinction, 0.15: ratio",
        Bound::Between(0.1495, 0.1505),
        |row: &Units| row.over_device.into(),
    )
    .among(|row| row.units == ORIGINAL)
    .because("0.00163 stands where 0.01084 should"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (passes, share) = context.pick(FULL, SMOKE);
        let constants = context.first(&CONSTANTS, SMOKE_CONSTANTS);
        let mut units = Vec::new();
        let name = |estimate: &Estimate| estimate.name.to_owned();
        let constants = context.each(&ESTIMATES, name, |estimate| {
            let mut rows: Vec<Row> = Vec::new();
            for (place, constant) in constants.iter().enumerate() {
                if context.watch.stopped() {
                    break;
                }
                let setup = Setup::new(estimate, *constant, 1.0, share)?;
                rows.push(setup.row(&gpu, passes)?);
                if place > 0 {
                    continue;
                }
                if estimate.volume == VolumeEstimate::Ray {
                    units = setup.units(&gpu, passes, &rows[0])?;
                }
                let longer = Setup::new(estimate, *constant, LONGER, share)?.row(&gpu, passes)?;
                let rescaled = change(longer.found * f64::from(LONGER * LONGER), rows[0].found);
                rows.push(Row {
                    rescaled: Some(rescaled),
                    ..longer
                });
            }
            Ok(rows)
        })?;
        Ok(Self { constants, units })
    }

    fn findings(&self) -> Findings {
        let among = |row: &Row| row.estimate == DISKS;
        Findings::of(&self.constants, CRITERIA)
            .headline(
                "standard errors that the beam estimate is off its closed form, the most",
                largest(&self.constants, among, |row| row.off.abs()),
            )
            .note(format!(
                "σₐ = {SIGMA_A}/m, σₛ = {SIGMA_S}/m, a light of 1 W/sr {ASIDE} m beside a ray of {WALL} m; Epanechnikov kernels of 0.1 m, of 0.02 m for ways, whose blur \
                 adds 0.2 % at most. {} passes, of independent photons; the first constant once more with lengths times ten and coefficients by ten.",
                FULL.0,
            ))
            .and(Findings::of(&self.units, OF_UNITS))
    }
}

/// The ray along z from the origin to a black wall, in an endless medium beside a light of 1 W/sr; lengths are multiplied.
fn airlight(phase: Phase, place: f32, lengths: f32) -> Scene {
    let mut scene = Scene {
        name: "airlight".into(),
        ..Scene::default()
    };
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    let corner = |x: f32, y: f32| Vec3::new(x, y, 1.0) * WALL * lengths;
    let corners = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    scene.place(quad("wall", black, corners));
    scene.media.push(Medium {
        name: "fog".into(),
        sigma_a: Vec3::splat(SIGMA_A / lengths),
        sigma_s: Vec3::splat(SIGMA_S / lengths),
        phase,
        ..Medium::default()
    });
    scene.surrounding = Some(0);
    let mut camera = Camera::look_at("ray", DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0);
    camera.projection = Projection::Orthographic {
        half_height: HALF_HEIGHT * lengths,
    };
    scene.cameras.push(camera);
    scene.add_light(
        "light",
        LightKind::Point {
            position: Vec3::new(ASIDE, 0.0, place) * lengths,
            intensity: Vec3::ONE,
        },
    );
    scene
}

/// An estimate of a constant, at a size.
struct Setup<'a> {
    estimate: &'a Estimate,
    constant: (f32, f32, f64),
    lengths: f32,
    scene: Scene,
    settings: PhotonSettings,
}

impl<'a> Setup<'a> {
    fn new(estimate: &'a Estimate, constant: (f32, f32, f64), lengths: f32, share: u32) -> Result<Self> {
        let (k, place, _) = constant;
        let settings = PhotonSettings {
            path_set: "bounces=1..1".parse()?,
            photons: estimate.photons / share,
            // Light that was scattered once is the eye's own otherwise.
            direct_photons: true,
            reduction: 1.0,
            sampler: SamplerKind::Pcg,
            volume: estimate.volume,
            volume_radius: estimate.radius * lengths,
            ..PhotonSettings::default()
        };
        Ok(Self {
            estimate,
            constant,
            lengths,
            scene: airlight(Phase::Schlick { k }, place, lengths),
            settings,
        })
    }

    fn mapper(&self, gpu: &Gpu) -> Result<PhotonMapper> {
        mapper(gpu, &self.scene, SIZE, self.settings.clone())
    }

    fn row(&self, gpu: &Gpu, passes: u32) -> Result<Row> {
        let mut mapper = self.mapper(gpu)?;
        let (mut before, mut values) = (0.0, Vec::new());
        for pass in 1..=passes {
            while mapper.step(pass)?.is_some() {}
            let (picture, _) = mapper.picture()?;
            // The picture is the mean of its passes so far.
            let total = mean(&picture)? * f64::from(pass);
            values.push(total - before);
            before = total;
        }
        let [found, spread] = mean_with_error(&values);
        let (k, place, closed_form) = self.constant;
        let expected = |constant: f64| constant / f64::from(self.lengths * self.lengths);
        let mirrored = CONSTANTS
            .iter()
            .find(|(other, at, _)| (*other, *at) == (-k, place) && k != 0.0);
        let beams = mapper.counts().beams;
        let rays = u64::from(SIZE[0] * SIZE[1]);
        Ok(Row {
            estimate: self.estimate.name.into(),
            k: f64::from(k),
            place: f64::from(place),
            lengths: f64::from(self.lengths),
            photons: u64::from(self.settings.photons) * u64::from(passes),
            kernels: beams.photons / rays,
            closed_form: expected(closed_form),
            found,
            spread,
            off: (found - expected(closed_form)) / spread,
            mirrored: mirrored.map(|(.., constant)| (found - expected(*constant)) / spread),
            rescaled: None,
        })
    }

    /// Sums over the collisions of the same passes by the host, with the flux in either unit.
    fn units(&self, gpu: &Gpu, passes: u32, device: &Row) -> Result<Vec<Units>> {
        let mut mapper = self.mapper(gpu)?;
        let mut sums: [Vec<f64>; 2] = Default::default();
        let (absorbs, scatters) = (f64::from(SIGMA_A), f64::from(SIGMA_S));
        let albedo = scatters / (absorbs + scatters);
        for pass in 0..passes {
            let events = mapper.events(pass)?;
            let seen = events.iter().map(|mapped| self.seen(&mapped.event)).sum::<f64>();
            // Stored is what is scattered: the flux that collides times the albedo.
            for (sums, factor) in sums.iter_mut().zip([albedo, scatters]) {
                sums.push(seen / albedo * factor);
            }
        }
        let rows = [CORRECTED, ORIGINAL].into_iter().zip(&sums).map(|(units, sums)| {
            let [found, spread] = mean_with_error(sums);
            Units {
                units: units.into(),
                found,
                over_device: found / device.found,
                off: (found - device.closed_form) / spread,
            }
        });
        Ok(rows.collect())
    }

    /// What the ray sees of a collision, for the flux that is stored.
    fn seen(&self, event: &PhotonEvent) -> f64 {
        let near = closest_approach(DVec3::ZERO, DVec3::Z, event.position.as_dvec3());
        let radius = f64::from(event.radius);
        let (on_ray, squared) = (near.t > 0.0 && near.t < f64::from(WALL), radius * radius);
        if !on_ray || near.distance_squared >= squared {
            return 0.0;
        }
        let kernel = kernel_profile(KernelProfile::Epanechnikov, near.distance_squared / squared) / squared;
        let phase = Phase::Schlick { k: self.constant.0 };
        let scattered = phase_function(phase, event.direction.as_dvec3().normalize(), DVec3::NEG_Z);
        let passed = (-f64::from(SIGMA_A + SIGMA_S) * near.t).exp();
        kernel * passed * scattered * f64::from(event.flux.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_those_of_the_airlight_integral() {
        let (scatters, extinction) = (f64::from(SIGMA_S), f64::from(SIGMA_A) + f64::from(SIGMA_S));
        for (k, place, expected) in CONSTANTS {
            let light = DVec3::new(f64::from(ASIDE), 0.0, f64::from(place));
            let at = |t: f64| {
                let point = DVec3::Z * t;
                let way = point - light;
                let phase = phase_function(Phase::Schlick { k }, way.normalize(), DVec3::NEG_Z);
                scatters * phase * (-extinction * (t + way.length())).exp() / way.length_squared()
            };
            // Simpson's rule, far finer than the digits of the constants.
            const STEPS: u32 = 4000;
            let step = f64::from(WALL) / f64::from(STEPS);
            let weight = |i: u32| match i {
                0 | STEPS => 1.0,
                _ if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let sum: f64 = (0..=STEPS).map(|i| weight(i) * at(f64::from(i) * step)).sum();
            let found = sum * step / 3.0;
            assert!((found - expected).abs() < 6e-8, "{k} {place}: {found}, not {expected}");
        }
    }
}
