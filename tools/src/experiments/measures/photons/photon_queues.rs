//! What queues of queries cost and gain: milliseconds of a gather with the stages of its queue, by themselves and by packets.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4 and Table 7.5, of rays through
//! photons in media, on a GPU of its time; points on surfaces are queued here.

use clerestory::gpu::Gpu;
use clerestory::techniques::photon_mapping::{MapQuery, MapQueue, PhotonMapper, PhotonSettings};
use clerestory::{Error, Result, scene};

use super::cases::{mapper, settings};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::{Spread, median};

const SIZE: [u32; 2] = [128, 96];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// Frames that count, after one that compiles kernels.
const FRAMES: u32 = 7;
const SMOKE_FRAMES: u32 = 2;
const SMOKE_SCENES: usize = 1;
/// How passes of queries and their queues are called.
const GATHER_PASSES: &str = "photon: gather";
/// And their queues alone.
const QUEUE_PASSES: &str = "photon: gather queue";

/// What is seen of a scene, its address, photons, and the spread of their kernels.
const SCENES: [(&str, &str, u32, f32); 4] = [
    ("closed rooms", "builtin:passage", 1 << 17, 15.0),
    ("a metal ring on a floor", "builtin:ring", 1 << 17, 10.0),
    ("trees under the open sky", "builtin:forest?source=point", 1 << 17, 25.0),
    ("mirrors and glass", "builtin:materials", 1 << 17, 20.0),
];

/// Queue, query, and what it is called.
const FORMS: [(MapQueue, MapQuery, &str); 6] = [
    (MapQueue::Slots, MapQuery::Single, "I, slots"),
    (MapQueue::Compacted, MapQuery::Single, "II, compacted"),
    (MapQueue::Blocks, MapQuery::Single, "III, blocks"),
    (MapQueue::Slots, MapQuery::Packet, "packets, I"),
    (MapQueue::Compacted, MapQuery::Packet, "packets, II"),
    (MapQueue::Blocks, MapQuery::Packet, "packets, III"),
];

/// The source's means over nine scenes in media, % over type I without packets; the fourth as computed from its rows, which its own mean is not.
const PUBLISHED: [f64; 6] = [0.0, 2.1, 27.2, -71.9, -69.3, -66.8];

/// One form of queries at work, and the milliseconds of its frames.
struct Runner {
    mapper: PhotonMapper,
    gather: Vec<f64>,
    /// The queue's share of it.
    queue: Vec<f64>,
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let columns = [
        "scene",
        "seen",
        "eye's rays",
        "of them ask (%)",
        "k, contributions a query",
    ];
    let mut times = Table::new(
        "GPU milliseconds of queries with their queues",
        &columns.into_iter().chain(FORMS.map(|form| form.2)).collect::<Vec<_>>(),
    );
    let mut shares = Table::new(
        "The same over type I by itself, %",
        &std::iter::once("scene")
            .chain(FORMS.map(|form| form.2))
            .collect::<Vec<_>>(),
    );
    let scenes = if context.smoke {
        &SCENES[..SMOKE_SCENES]
    } else {
        &SCENES[..]
    };
    for (done, (seen, address, photons, spread)) in scenes.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        let name = address.trim_start_matches("builtin:");
        context.watch.begin(name, done, scenes.len());
        let runners = runners(context, &gpu, address, &settings(*photons, *spread, context.smoke)?)?;
        let Some(first) = runners.first() else { continue };
        let (rays, counts) = (
            first.mapper.eye_counters().extend_rays as f64,
            first.mapper.counts().gather,
        );
        if runners.iter().any(|runner| runner.mapper.counts().gather != counts) {
            return Err(Error::Internal {
                what: "queries of one map by different queues".into(),
                fault: "have different counts".into(),
            });
        }
        let queries = counts.queries as f64;
        let mut row: Vec<Cell> = vec![
            name.into(),
            (*seen).into(),
            (rays / f64::from(frames(context) + 1)).into(),
            (1e2 * queries / rays).into(),
            (counts.photons as f64 / queries.max(1.0)).into(),
        ];
        let medians = runners.iter().map(|runner| median(runner.gather.clone()));
        let medians: Vec<f64> = medians.collect();
        for runner in &runners {
            let spread = Spread::of(runner.gather.clone());
            let [median, least, greatest] =
                [spread.median, spread.least, spread.greatest].map(|value| Cell::Number(value).to_string());
            let queue = Cell::Number(crate::timing::median(runner.queue.clone())).to_string();
            row.push(format!("{median} ({least} … {greatest}), queue {queue}").into());
        }
        times.row(row);
        let mut row: Vec<Cell> = vec![name.into()];
        row.extend(medians.iter().map(|ms| Cell::from(1e2 * (ms / medians[0] - 1.0))));
        shares.row(row);
    }
    let mut row: Vec<Cell> = vec!["source: rays through media, mean of nine scenes".into()];
    row.extend(PUBLISHED.map(Cell::from));
    shares.row(row);
    let [width, height] = size(context);
    times.note(format!(
        "{width} × {height} pixels, a sample each; medians (least … greatest) of {} frames of the same map, one of each form in turn after one that \
         compiles kernels; then what of it the queue's own stages take. Types II and III look at the surface once more to see who asks, which in the source the \
         kernels do that trace rays. Subgroups of {}; counts of queries and contributions are equal in all forms.",
        frames(context),
        gpu.caps().subgroup_size,
    ));
    shares.note(
        "Source: milliseconds of density estimation by rays through photons in media, 512 × 512 pixels, on a GPU of 2008; its printed mean for packets with \
         type I is −74.7, its rows give −71.9.",
    );
    Ok(vec![times, shares])
}

fn size(context: &Context<'_>) -> [u32; 2] {
    if context.smoke { SMOKE_SIZE } else { SIZE }
}

fn frames(context: &Context<'_>) -> u32 {
    if context.smoke { SMOKE_FRAMES } else { FRAMES }
}

/// All forms of one scene, with their frames taken in turns: samples of one pass, so that all have the same map.
fn runners(context: &Context<'_>, gpu: &Gpu, address: &str, settings: &PhotonSettings) -> Result<Vec<Runner>> {
    let scene = scene::load(address)?;
    let frames = frames(context);
    let mut runners = Vec::new();
    for (queue, query, _) in FORMS {
        let settings = PhotonSettings {
            queue,
            query,
            samples_per_pass: frames + 1,
            ..settings.clone()
        };
        runners.push(Runner {
            mapper: mapper(gpu, &scene, size(context), settings)?,
            gather: Vec::new(),
            queue: Vec::new(),
        });
    }
    for frame in 0..=frames {
        for runner in &mut runners {
            let mut milliseconds = [0.0; 2];
            while let Some(step) = runner.mapper.step(frame + 1)? {
                for pass in step.timings.iter().flat_map(|timings| &timings.passes) {
                    for (sum, name) in milliseconds.iter_mut().zip([GATHER_PASSES, QUEUE_PASSES]) {
                        if pass.name.starts_with(name) {
                            *sum += pass.nanoseconds.unwrap_or(0) as f64 * 1e-6;
                        }
                    }
                }
            }
            if frame > 0 {
                runner.gather.push(milliseconds[0]);
                runner.queue.push(milliseconds[1]);
            }
        }
    }
    Ok(runners)
}
