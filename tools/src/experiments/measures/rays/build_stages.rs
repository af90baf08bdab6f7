//! Builds of hierarchies for rays by stage, on the host and on the device, beside the binned surface area heuristic on the same threads.

use clerestory::Result;
use clerestory::accel::lbvh::{BuildQuality, LbvhSettings};
use clerestory::accel::{BuildStages, IndexKind};
use clerestory::gpu::Gpu;
use clerestory::scene;
use glam::Vec3;

use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::geometry;
use crate::timing::{median, timed};

/// From 282 thousand triangles to a million.
const SCENES: [&str; 4] = [
    "builtin:conference",
    "builtin:box-city?n=25000",
    "builtin:sphere-flake?depth=3&frequency=4",
    "builtin:triangle-soup?n=1000000&size=0.005",
];
const SMOKE_SCENE: &str = "builtin:cornell-box";
const REPEATS: usize = 7;

/// What builds, the one that others are compared with first.
fn kinds() -> [(&'static str, IndexKind); 4] {
    [
        ("binned, host", IndexKind::default()),
        ("linear, host", IndexKind::lbvh(BuildQuality::Fast)),
        ("linear and optimised, host", IndexKind::lbvh(BuildQuality::High)),
        ("linear, device", IndexKind::LbvhOnDevice(LbvhSettings::default())),
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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let stage_names = BuildStages::default().named().map(|(name, _)| name);
    let mut heads = vec!["scene", "triangles", "build", "ms", "binned / this"];
    let stage_heads: Vec<String> = stage_names.iter().map(|name| format!("{name} (ms)")).collect();
    heads.extend(stage_heads.iter().map(String::as_str));
    let mut table = Table::new("Builds by stage", &heads);
    let smoke = [SMOKE_SCENE];
    let scenes = if context.smoke { &smoke[..] } else { &SCENES[..] };
    for (done, address) in scenes.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        let name = address.trim_start_matches("builtin:");
        context.watch.begin(name, done, scenes.len());
        let triangles = geometry::triangles(&scene::load(address)?);
        let kinds = kinds();
        let mut builds = kinds.map(|_| Vec::new());
        // In turns, after once to warm up.
        for repeat in 0..=if context.smoke { 1 } else { REPEATS } {
            for ((_, kind), builds) in kinds.iter().zip(&mut builds) {
                let built = build(&gpu, kind, &triangles)?;
                if repeat > 0 {
                    builds.push(built);
                }
            }
        }
        let times = builds
            .each_ref()
            .map(|builds| median(builds.iter().map(|(ms, _)| *ms).collect()));
        for (i, (kind, _)) in kinds.iter().enumerate() {
            let mut row: Vec<Cell> = vec![
                name.into(),
                (triangles.len() as u64).into(),
                (*kind).into(),
                times[i].into(),
                (times[0] / times[i]).into(),
            ];
            row.extend((0..stage_names.len()).map(|stage| {
                let all = builds[i].iter().map(|(_, stages)| stages.named()[stage].1);
                Cell::from(median(all.collect()))
            }));
            table.row(row);
        }
    }
    table.note(
        "From triangles on the host to an index where it was built, medians of 7 builds that take turns, by wall clock; stages are medians of \
         their own, those of the device by its timestamps, transfers between host and device and waiting in a column of their own. On a \
         software driver device and host are the same threads.",
    );
    Ok(vec![table])
}
