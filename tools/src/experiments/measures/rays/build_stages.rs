//! Builds of hierarchies for rays by stage, on the host and on the device, beside the binned surface area heuristic on the same threads.

use clerestory::Result;
use clerestory::accel::bvh2::Bvh2Settings;
use clerestory::accel::lbvh::{BuildQuality, LbvhSettings};
use clerestory::accel::{BuildStages, IndexKind};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::scene;
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::{Context, MEMORY_OF_ITS_OWN};
use crate::experiments::reference::short_name;
use crate::geometry;
use crate::timing::timed;

/// From 282 thousand triangles to a million.
const SCENES: [&str; 4] = [
    "builtin:conference",
    "builtin:box-city?n=25000",
    "builtin:sphere-flake?depth=3&frequency=4",
    "builtin:triangle-soup?n=1000000&size=0.005",
];
const SMOKE_SCENES: &[&str] = &["builtin:cornell-box"];

const ON_HOST: &str = "linear, host";
const ON_DEVICE: &str = "linear, device";

/// What builds, the one that others are compared with first.
fn kinds() -> [(&'static str, IndexKind); 4] {
    [
        ("binned, host", IndexKind::Bvh2(Bvh2Settings::default())),
        (ON_HOST, IndexKind::lbvh(BuildQuality::Fast)),
        ("linear and optimised, host", IndexKind::lbvh(BuildQuality::High)),
        (ON_DEVICE, IndexKind::LbvhOnDevice(LbvhSettings::default())),
    ]
}

/// Milliseconds of a build and of its stages.
fn build(gpu: &Gpu, kind: &IndexKind, triangles: &[[Vec3; 3]]) -> Result<(f64, BuildStages)> {
    if matches!(kind, IndexKind::LbvhOnDevice(_)) {
        let report = kind.build_for(gpu, triangles)?.report;
        return Ok((report.build_ms, report.stages));
    }
    let (index, seconds) = timed(|| kind.build(triangles));
    Ok((1e3 * seconds, index?.stages()))
}

rows! {
    /// A builder on a scene.
    struct Row = "Builds" by [scene, builder] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        builder: String = "builder",
        by_hardware: bool = "has a device of its own",
        time: Repeats = "a build (ms)",
        speed: Repeats = "binned / this",
    }
}

rows! {
    /// A stage of a build.
    struct Stage = "Builds by stage (ms)" by [scene, builder, stage] {
        scene: String = "scene",
        builder: String = "builder",
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
        "a linear build on the host is five times as fast",
        Bound::AtLeast(5.0),
        |row: &Row| (&row.speed).into(),
    )
    .among(|row| row.builder == ON_HOST),
    Criterion::each(
        "a linear build on the device is five times as fast",
        Bound::AtLeast(5.0),
        |row: &Row| (&row.speed).into(),
    )
    .among(|row| row.builder == ON_DEVICE && row.by_hardware)
    .needs(MEMORY_OF_ITS_OWN),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let is_hardware = gpu.caps().kind != DeviceKind::Cpu;
        let mut stages = Vec::new();
        let scenes = context.pick(&SCENES[..], SMOKE_SCENES);
        let name = |address: &&str| short_name(address).to_owned();
        let builds = context.each(scenes, name, |address| {
            let scene = short_name(address);
            let triangles = geometry::triangles(&scene::load(address)?);
            let kinds = kinds();
            let builds = context.in_turns(7, kinds.len(), |i| build(&gpu, &kinds[i].1, &triangles))?;
            let time = |builds: &[(f64, BuildStages)]| builds.iter().map(|(ms, _)| *ms).collect::<Repeats>();
            let binned = time(&builds[0]);
            Ok(kinds
                .iter()
                .zip(&builds)
                .map(|((builder, kind), builds)| {
                    stages.extend(stages_of(scene, builder, builds));
                    let time = time(builds);
                    Row {
                        scene: scene.into(),
                        triangles: triangles.len() as u64,
                        builder: (*builder).into(),
                        by_hardware: is_hardware && matches!(kind, IndexKind::LbvhOnDevice(_)),
                        speed: binned.over(&time),
                        time,
                    }
                })
                .collect())
        })?;
        Ok(Self { builds, stages })
    }

    fn findings(&self) -> Findings {
        let on_host = self.builds.iter().filter(|row| row.builder == ON_HOST);
        Findings::of(&self.builds, CRITERIA)
            .headline(
                "speed of the linear build on the host over that of the binned one, geometric mean",
                geometric_mean(on_host.map(|row| row.speed.measured())),
            )
            .note(
                "From triangles on the host to an index where it was built, by wall clock, in turns. On a software driver device and host are \
                 the same threads.",
            )
            .bars(
                "speed",
                "Speed of builds over that of the binned one",
                &self.builds,
                |row| [row.scene.clone(), row.builder.clone()],
                |row| row.speed.measured(),
            )
            .and(Findings::pivoted(&self.stages, "stage", &[]))
            .note(
                "Stages of the device by its timestamps, transfers between host and device and waiting for them in a column of their own.",
            )
    }
}

/// All stages of a builder.
fn stages_of(scene: &str, builder: &str, builds: &[(f64, BuildStages)]) -> Vec<Stage> {
    let names = BuildStages::default().named();
    let of = |(place, (stage, _)): (usize, (&str, f64))| Stage {
        scene: scene.into(),
        builder: builder.into(),
        stage: stage.into(),
        time: builds.iter().map(|(_, stages)| stages.named()[place].1).collect(),
    };
    names.into_iter().enumerate().map(of).collect()
}
