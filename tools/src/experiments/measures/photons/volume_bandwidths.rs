//! How many kernels rays meet in media: kernels as wide as footprints beside those as wide as the 85th neighbour is far.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.3.4, Tables 7.1 to 7.3. Media, photons' share,
//! spread, dampening and greatest radii are its own; scenes are stand-ins of the same size. Of its partly filled hall all is filled here.

use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::render::Renderer;
use clerestory::scene::{DensityGrid, LightKind, Medium, Phase, Scene};
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::kernel::KernelProfile;
use clerestory::techniques::photon_mapping::volume::VolumeKernel;
use clerestory::{Result, scene};
use glam::{DVec3, Vec3};

use super::cases::mapper;
use crate::experiments::findings::{Bound, Criterion, Findings, Study, change, geometric_mean, rows};
use crate::experiments::measures::Context;

const SIZE: [u32; 2] = [64, 48];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// The source's photons over ours.
const SHARE: u32 = 4;
const SMOKE_SHARE: u32 = 256;
/// Half angle of the spot's cone, radians; the source says 0.5.
const SPOT: f32 = 0.5;
/// Multiples of a footprint's cube root.
const SPREAD: f32 = 3.0;

/// A scene of the source with its medium.
pub(super) struct Case {
    /// What it is called.
    pub(super) name: &'static str,
    scene: &'static str,
    spot: bool,
    sigma_a: [f32; 3],
    sigma_s: [f32; 3],
    is_even: bool,
    k: f32,
    photons: u32,
    /// Greatest radius, m.
    greatest: f32,
    /// Of the dampening, m.
    dampening: f32,
    /// Kernels about a ray by neighbours, and what footprints change of it, %.
    published: [f64; 2],
}

const ATRIUM: Case = Case {
    name: "atrium, neutral",
    scene: "builtin:atrium?source=point",
    spot: false,
    sigma_a: [0.3; 3],
    sigma_s: [0.1; 3],
    is_even: true,
    k: 0.0,
    photons: 1 << 20,
    greatest: 2.0,
    dampening: 3.0,
    published: [1124.68, -15.21],
};
const RING: Case = Case {
    name: "ring, point light",
    scene: "builtin:ring",
    sigma_a: [0.01; 3],
    sigma_s: [0.5; 3],
    greatest: 1.0,
    dampening: 2.5,
    published: [766.87, 37.95],
    ..ATRIUM
};
const CATHEDRAL: Case = Case {
    name: "cathedral, k = 0",
    scene: "builtin:cathedral?source=point",
    sigma_a: [0.05; 3],
    sigma_s: [0.15; 3],
    photons: 1 << 18,
    greatest: 3.0,
    dampening: 3.0,
    published: [1290.03, -7.75],
    ..ATRIUM
};
const COLOURED: [f32; 3] = [0.05, 0.3, 0.3];

pub(super) static CASES: [Case; 9] = [
    RING,
    Case {
        name: "ring, spot",
        spot: true,
        dampening: 10.0,
        published: [645.28, 18.56],
        ..RING
    },
    Case {
        name: "ring, spot, coloured",
        spot: true,
        sigma_s: [0.5, 0.01, 0.01],
        dampening: 10.0,
        published: [599.85, 11.59],
        ..RING
    },
    ATRIUM,
    Case {
        name: "atrium, coloured",
        sigma_a: COLOURED,
        published: [1145.64, -12.23],
        ..ATRIUM
    },
    Case {
        name: "atrium, uneven",
        sigma_a: COLOURED,
        is_even: false,
        dampening: 5.0,
        published: [728.14, 22.30],
        ..ATRIUM
    },
    Case {
        name: "cathedral, k = 0.5",
        k: 0.5,
        dampening: 4.0,
        published: [1298.92, 3.97],
        ..CATHEDRAL
    },
    CATHEDRAL,
    Case {
        name: "cathedral, k = -0.5",
        k: -0.5,
        dampening: 2.5,
        published: [1287.44, -3.51],
        ..CATHEDRAL
    },
];

rows! {
    /// A scene.
    struct Row = "Kernels that a ray meets" by [scene] {
        scene: String = "scene",
        photons: u64 = "photons",
        events: u64 = "collisions that were stored",
        neighbors: f64 = "k by neighbours",
        footprints: f64 = "k by footprints",
        change: f64 = "change (%)",
    }
    beside "source: k by neighbours" = |row| published(&row.scene).map(|published| published[0]).into();
    beside "source: change (%)" = |row| published(&row.scene).map(|published| published[1]).into();
}

fn published(name: &str) -> Option<[f64; 2]> {
    CASES.iter().find(|case| case.name == name).map(|case| case.published)
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    bandwidths: Vec<Row>,
}

const CRITERIA: &[Criterion<Row>] = &[Criterion::each(
    "footprints have rays meet as many kernels as neighbours do, within 40 % (%)",
    Bound::Between(-40.0, 40.0),
    |row: &Row| row.change.into(),
)
.because("the source's own are within 38 %, 6 % more on average with a deviation of 18 %")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let size = context.pick(SIZE, SMOKE_SIZE);
        let share = context.pick(SHARE, SMOKE_SHARE);
        let cases: Vec<&Case> = CASES.iter().collect();
        let bandwidths = context.each(
            &cases,
            |case| case.name.to_owned(),
            |case| Ok(vec![case.row(&gpu, size, share)?]),
        )?;
        Ok(Self { bandwidths })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.bandwidths, CRITERIA)
            .headline(
                "kernels that a ray meets by footprints over those by the 85th neighbour, geometric mean of all scenes",
                geometric_mean(self.bandwidths.iter().map(|row| (row.footprints / row.neighbors).into())),
            )
            .note(
                "Events of photons that were scattered at most once before, with the source's spread of 3, its dampening and its greatest radii, and a \
                 quarter of its photons, so that kernels are wider than its own by ∛4. A smoke run has a 256th.",
            )
    }
}

impl Case {
    fn row(&self, gpu: &Gpu, size: [u32; 2], share: u32) -> Result<Row> {
        let scene = self.scene(gpu)?;
        let met = |volume_kernel: VolumeKernel| -> Result<(f64, u64)> {
            let mut mapper = mapper(gpu, &scene, size, self.settings(share, volume_kernel)?)?;
            while mapper.step(1)?.is_some() {}
            let counts = mapper.counts();
            Ok((
                counts.beams.photons as f64 / counts.beams.queries.max(1) as f64,
                counts.events,
            ))
        };
        let (neighbors, events) = met(VolumeKernel::Neighbor)?;
        let (footprints, _) = met(VolumeKernel::Footprint)?;
        Ok(Row {
            scene: self.name.into(),
            photons: (self.photons / share).into(),
            events,
            neighbors,
            footprints,
            change: change(footprints, neighbors),
        })
    }

    /// The source's settings, with its photons over `share`.
    pub(super) fn settings(&self, share: u32, volume_kernel: VolumeKernel) -> Result<PhotonSettings> {
        Ok(PhotonSettings {
            path_set: "bounces=1..2".parse()?,
            photons: self.photons / share,
            direct_photons: true,
            profile: KernelProfile::Uniform,
            unit_length: 1.0,
            volume_kernel,
            volume_radius: self.greatest,
            volume_spread: SPREAD,
            volume_dampening: self.dampening,
            ..PhotonSettings::default()
        })
    }

    /// The scene with its medium.
    pub(super) fn scene(&self, gpu: &Gpu) -> Result<Scene> {
        let mut scene = scene::load(self.scene)?;
        if self.spot {
            for light in &mut scene.lights {
                if let LightKind::Point { position, intensity } = light.kind {
                    light.kind = LightKind::Spot {
                        position,
                        direction: Vec3::NEG_Y,
                        intensity,
                        inner: SPOT,
                        outer: SPOT,
                    };
                }
            }
        }
        let mut medium = Medium {
            name: "medium".into(),
            sigma_a: Vec3::from_array(self.sigma_a),
            sigma_s: Vec3::from_array(self.sigma_s),
            phase: Phase::Schlick { k: self.k },
            ..Medium::default()
        };
        if !self.is_even {
            // Averages are those of the table.
            let [lower, upper] = Arc::clone(Renderer::new(gpu, &scene)?.gpu_scene()).bounds();
            let density = |p: DVec3| (1.0 + (9.0 * p.x).sin() * (7.0 * p.y).cos() * (11.0 * p.z).sin()) as f32;
            let grid = DensityGrid::from_fn([32, 16, 32], density);
            medium.density = Some(grid.in_box(lower.as_dvec3(), upper.as_dvec3()));
        }
        scene.surrounding = Some(scene.media.len() as u32);
        scene.media.push(medium);
        Ok(scene)
    }
}
