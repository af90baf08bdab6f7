//! How many kernels rays meet in media: kernels as wide as footprints beside those as wide as the 85th neighbour is far.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.3.4, Tables 7.1 to 7.3. Media, photons' share,
//! spread, dampening and greatest radii are its own; scenes are stand-ins of the same size.

use clerestory::gpu::Gpu;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::volume::VolumeKernel;
use clerestory::{Result, scene};

use super::cases::mapper;
use super::scenarios::{Depths, SCENARIOS, Scenario, TWO_BOUNCES, by_name};
use crate::experiments::findings::{Bound, Criterion, Findings, Study, change, geometric_mean, rows};
use crate::experiments::measures::Context;

const SIZE: [u32; 2] = [64, 48];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// The source's photons over ours.
const SHARE: u32 = 4;
const SMOKE_SHARE: u32 = 256;

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
    by_name(name).map(|scenario| scenario.kernels)
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
        let bandwidths = context.each(
            &SCENARIOS,
            |scenario| scenario.name.to_owned(),
            |scenario| Ok(vec![row(&gpu, scenario, size, share)?]),
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

fn row(gpu: &Gpu, scenario: &Scenario, size: [u32; 2], share: u32) -> Result<Row> {
    let scene = scene::load(scenario.scene)?;
    let met = |volume_kernel: VolumeKernel| -> Result<(f64, u64)> {
        let settings = PhotonSettings {
            volume_kernel,
            ..scenario.settings(TWO_BOUNCES, Depths::UpToOne, share)?
        };
        let mut mapper = mapper(gpu, &scene, size, settings)?;
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
        scene: scenario.name.into(),
        photons: (scenario.photons / share).into(),
        events,
        neighbors,
        footprints,
        change: change(footprints, neighbors),
    })
}
