//! Passes of photon mapping with the map built by the device, without photons read back, beside those with it built by the host: milliseconds
//! of the map, by stage, and of the pass.

use std::time::Instant;

use clerestory::gpu::Gpu;
use clerestory::techniques::photon_mapping::{MapBuild, PhotonMapper, PhotonSettings};
use clerestory::{Error, Result, scene};

use super::cases::{Case, mapper};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::{Spread, median};

/// Passes that count, of each kind in turn, after one that compiles kernels and allocates memory.
const PASSES: u32 = 11;
const SMOKE_PASSES: u32 = 2;
/// Stages of the device's builds.
const STAGES: [&str; 8] = ["boxes", "codes", "sort", "blocks", "split", "ranks", "pairs", "records"];

/// Milliseconds of a pass.
#[derive(Debug, Clone, Copy, Default)]
struct Pass {
    map: f64,
    /// By wall clock.
    all: f64,
    stages: [f64; STAGES.len()],
}

/// The table without rows.
pub fn table() -> Table {
    let mut heads: Vec<String> = [
        "scene",
        "records",
        "map by the host (ms)",
        "map by the device (ms)",
        "device over host",
        "least … greatest",
        "pass, map by the host (ms)",
        "pass, map by the device (ms)",
        "device over host, pass",
        "least … greatest, pass",
    ]
    .map(String::from)
    .to_vec();
    heads.extend(STAGES.map(|stage| format!("{stage} (ms)")));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    Table::new("Maps built by the device and by the host", &heads)
}

/// What the table says beside its rows.
pub fn note(table: &mut Table, smoke: bool) {
    table.note(format!(
        "Medians of {} passes of each kind, in turn, of one progressive rendering each, whose pictures were compared to the bit. The host's map \
         takes the photons' way back, the build and the copy to the device; the device's the recording of its build and its passes, which are \
         the last columns. Ratios are of neighbouring passes: median, least and greatest.",
        if smoke { SMOKE_PASSES } else { PASSES },
    ));
}

/// A row: renders a case both ways.
pub fn row(context: &Context<'_>, gpu: &Gpu, case: &Case, size: [u32; 2]) -> Result<Vec<Cell>> {
    let scene = scene::load(case.scene)?;
    let settings = case.settings(context.smoke)?;
    let build = if gpu.caps().float64 {
        MapBuild::Device
    } else {
        MapBuild::Auto
    };
    let with = |map_build| {
        let settings = PhotonSettings {
            map_build,
            ..settings.clone()
        };
        mapper(gpu, &scene, size, settings)
    };
    let (mut host, mut device) = (with(MapBuild::Host)?, with(build)?);
    let count = if context.smoke { SMOKE_PASSES } else { PASSES };
    let (mut of_host, mut of_device) = (Vec::new(), Vec::new());
    for number in 0..=count {
        let passes = [pass(&mut host, number + 1)?, pass(&mut device, number + 1)?];
        if number > 0 {
            of_host.push(passes[0]);
            of_device.push(passes[1]);
        }
    }
    let pictures = [host.picture()?.0, device.picture()?.0];
    let [first, second] = pictures.map(|picture| picture.layer("radiance").map(|layer| layer.values().to_vec()));
    if first != second {
        return Err(Error::setting("map_build", case.name(), "changes the picture"));
    }
    let middle = |passes: &[Pass], field: &dyn Fn(&Pass) -> f64| median(passes.iter().map(field).collect());
    let ratios = |field: &dyn Fn(&Pass) -> f64| {
        let pairs = of_device.iter().zip(&of_host);
        Spread::of(pairs.map(|(device, host)| field(device) / field(host)).collect())
    };
    let mut row: Vec<Cell> = vec![
        case.name().into(),
        (device.counts().records as f64 / f64::from(count + 1)).into(),
    ];
    let fields: [&dyn Fn(&Pass) -> f64; 2] = [&|pass| pass.map, &|pass| pass.all];
    for field in fields {
        let ratio = ratios(field);
        let range = [ratio.least, ratio.greatest].map(|value| Cell::Number(value).to_string());
        row.extend([
            middle(&of_host, field).into(),
            middle(&of_device, field).into(),
            ratio.median.into(),
            range.join(" … ").into(),
        ]);
    }
    row.extend((0..STAGES.len()).map(|stage| Cell::from(middle(&of_device, &|pass| pass.stages[stage]))));
    Ok(row)
}

/// The next pass.
fn pass(mapper: &mut PhotonMapper, samples: u32) -> Result<Pass> {
    let mut pass = Pass::default();
    let before = mapper.counts().map_seconds;
    let clock = Instant::now();
    while let Some(step) = mapper.step(samples)? {
        for timed in step.timings.iter().flat_map(|timings| &timings.passes) {
            let stage = STAGES
                .iter()
                .position(|stage| timed.name.strip_prefix("map: ") == Some(stage));
            if let Some(stage) = stage {
                pass.stages[stage] += 1e-6 * timed.nanoseconds.unwrap_or(0) as f64;
            }
        }
    }
    pass.all = 1e3 * clock.elapsed().as_secs_f64();
    pass.map = 1e3 * (mapper.counts().map_seconds - before);
    Ok(pass)
}
