//! Passes of photon mapping with the map built by the device, without photons read back, beside those with it built by the host: milliseconds
//! of the map, by stage, and of the pass.

use std::time::Instant;

use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::techniques::photon_mapping::{MapBuild, PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};

use super::cases::{Case, mapper};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, rows};
use crate::experiments::measures::Context;

/// Passes of each kind.
const TURNS: usize = 11;
/// Stages of the device's builds.
const STAGES: [&str; 8] = ["boxes", "codes", "sort", "blocks", "split", "ranks", "pairs", "records"];

rows! {
    /// A scene's passes, with the map built both ways.
    struct Row = "Maps built by the device and by the host" by [scene] {
        scene: String = "scene",
        on_hardware: bool = "on a device of its own",
        by_device: bool = "the device can build",
        records: f64 = "records",
        host: Repeats = "map by the host (ms)",
        device: Repeats = "map by the device (ms)",
        ratio: Repeats = "device over host, map",
        pass_host: Repeats = "pass, map by the host (ms)",
        pass_device: Repeats = "pass, map by the device (ms)",
        pass_ratio: Repeats = "device over host, pass",
        different: u64 = "values of the picture that differ",
    }
}

rows! {
    /// A stage of the device's builds.
    struct Stage = "Stages of the maps built by the device" by [scene, stage] {
        scene: String = "scene",
        stage: String = "stage",
        time: Repeats = "time (ms)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    builds: Vec<Row>,
    stages: Vec<Stage>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the device's map changes no value of the picture",
        Bound::AtMost(0.0),
        |row: &Row| row.different.into(),
    )
    .among(|row| row.by_device)
    .needs("a device with shaderFloat64")
    .because("both build the same map of the same photons")
    .in_every_form(),
    Criterion::each(
        "a pass is not slower with the device's map: over that with the host's",
        Bound::AtMost(1.0),
        |row: &Row| (&row.pass_ratio).into(),
    )
    .among(|row| row.on_hardware && row.by_device)
    .needs("a GPU with memory of its own and shaderFloat64")
    .because("what is built where it is used spares both copies"),
];

/// Milliseconds of a pass.
#[derive(Debug, Clone, Copy, Default)]
struct Pass {
    map: f64,
    /// By wall clock.
    all: f64,
    stages: [f64; STAGES.len()],
}

impl Found {
    /// Renders these scenes both ways.
    pub fn measure(context: &Context<'_>, gpu: &Gpu, cases: &[&Case], size: [u32; 2]) -> Result<Self> {
        let mut stages = Vec::new();
        let name = |case: &&Case| format!("{}, maps", case.name());
        let builds = context.each(cases, name, |case| {
            let (row, of_device) = build(context, gpu, case, size)?;
            stages.extend(STAGES.iter().zip(of_device).map(|(stage, time)| Stage {
                scene: case.name().into(),
                stage: (*stage).into(),
                time,
            }));
            Ok(vec![row])
        })?;
        Ok(Self { builds, stages })
    }

    /// What these rows say.
    pub fn findings(&self) -> Findings {
        Findings::of(&self.builds, CRITERIA)
            .note(
                "Passes of one progressive rendering each, whose pictures are compared at the end. The host's map takes the photons' way back, \
                 the build and the copy to the device; the device's the recording of its build and its passes.",
            )
            .and(Findings::pivoted(&self.stages, "stage", &[]))
    }
}

/// A case both ways, and the stages of the device's builds.
fn build(context: &Context<'_>, gpu: &Gpu, case: &Case, size: [u32; 2]) -> Result<(Row, [Repeats; STAGES.len()])> {
    let scene = scene::load(case.scene)?;
    let settings = case.settings(context.smoke)?;
    let on_device = if gpu.caps().float64 {
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
    let mut mappers = [with(MapBuild::Host)?, with(on_device)?];
    let mut passes = [0; 2];
    let turns = context.in_turns(TURNS, mappers.len(), |i| {
        passes[i] += 1;
        pass(&mut mappers[i], passes[i])
    })?;
    let of = |i: usize, value: fn(&Pass) -> f64| turns[i].iter().map(value).collect::<Repeats>();
    let [host, device] = [0, 1].map(|i| of(i, |pass| pass.map));
    let [pass_host, pass_device] = [0, 1].map(|i| of(i, |pass| pass.all));
    let stages: Vec<[f64; STAGES.len()]> = turns[1].iter().map(|pass| pass.stages).collect();
    let row = Row {
        scene: case.name().into(),
        on_hardware: gpu.caps().kind != DeviceKind::Cpu,
        by_device: gpu.caps().float64,
        records: mappers[1].counts().records as f64 / f64::from(passes[1]),
        ratio: device.over(&host),
        pass_ratio: pass_device.over(&pass_host),
        host,
        device,
        pass_host,
        pass_device,
        different: differing(&mut mappers)?,
    };
    Ok((row, Repeats::by_part(&stages)))
}

/// Values in which the pictures differ.
fn differing([first, second]: &mut [PhotonMapper; 2]) -> Result<u64> {
    let values = |mapper: &mut PhotonMapper| -> Result<Vec<f32>> {
        let (picture, _) = mapper.picture()?;
        Ok(picture
            .layer("radiance")
            .map_or_else(Vec::new, |layer| layer.values().to_vec()))
    };
    let (first, second) = (values(first)?, values(second)?);
    let different = first.iter().zip(&second).filter(|(a, b)| a != b).count();
    Ok((different + first.len().abs_diff(second.len())) as u64)
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
