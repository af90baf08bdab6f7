//! Stages of the linear hierarchy's construction on the host and on the device, with kernels as they come and in the order of the tree, and
//! the fresh memory that they touch.

use clerestory::Result;
use clerestory::accel::Aabb;
use clerestory::accel::lbvh::{LbvhBuilder, SortedCodes};
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::accel::photon_map::merge::merged_hierarchy;
use glam::Vec3;
use rayon::prelude::*;

use crate::experiments::findings::{Repeats, rows};
use crate::experiments::measures::Context;
use crate::timing::timed;

/// Turns of all builds.
pub const TURNS: usize = 5;
/// The whole build on the host.
pub const ON_HOST: &str = "host: all, codes, sort and merge";
/// And on the device.
pub const ON_DEVICE: &str = "device: all";
/// Contenders of [`stages`].
const CONTENDERS: usize = 6;

rows! {
    /// A stage of a build over some number of kernels.
    struct Stage = "Construction by stage" by [stage, kernels] {
        stage: String = "stage",
        kernels: u64 = "kernels",
        time: Repeats = "ns per kernel",
    }
}

rows! {
    /// How a stage grows.
    struct Growth = "Growth of the stages' times with the number of kernels" by [stage] {
        stage: String = "stage",
        exponent: Repeats = "exponent from the fewest to the most kernels",
    }
}

impl Growth {
    /// Of all stages that take time.
    pub fn all(stages: &[Stage]) -> Vec<Self> {
        let Some(fewest) = stages.iter().map(|stage| stage.kernels).min() else {
            return Vec::new();
        };
        let first = stages.iter().filter(|stage| stage.kernels == fewest);
        let growth = |first: &Stage| {
            let same = stages.iter().filter(|stage| stage.stage == first.stage);
            let last = same.max_by_key(|stage| stage.kernels)?;
            let factor = last.kernels as f64 / first.kernels as f64;
            // Of time per kernel.
            let of = |ratio: &f64| 1.0 + ratio.ln() / factor.ln();
            let exponent: Repeats = last.time.over(&first.time).0.iter().map(of).collect();
            let is_known = exponent.0.iter().all(|value| value.is_finite());
            is_known.then(|| Self {
                stage: first.stage.clone(),
                exponent,
            })
        };
        first.filter_map(growth).collect()
    }
}

/// A triangle whose box is the given one: the device builds over triangles.
fn triangle_in(bounds: &Aabb) -> [Vec3; 3] {
    let corner = Vec3::new(bounds.upper.x, bounds.lower.y, bounds.lower.z);
    [bounds.lower, corner, bounds.upper]
}

/// Triangles in boxes, for the device.
pub fn triangles_in(boxes: &[Aabb]) -> Vec<[Vec3; 3]> {
    boxes.iter().map(triangle_in).collect()
}

/// Names and seconds of the passes of a build.
pub fn on_device(builder: &LbvhBuilder, triangles: &[[Vec3; 3]]) -> Result<Vec<(String, f64)>> {
    let passes = builder.build(triangles)?.timings.passes.into_iter();
    Ok(passes
        .map(|pass| (pass.name, 1e-9 * pass.nanoseconds.unwrap_or(0) as f64))
        .collect())
}

/// Seconds of all of them.
pub fn whole(passes: &[(String, f64)]) -> f64 {
    passes.iter().map(|pass| pass.1).sum()
}

/// Pages that this process has touched for the first time so far, where the system tells; else 0.
fn first_touches() -> u64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name in parentheses may hold blanks; minor faults are the eighth field behind it.
    let mut fields = text.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace();
    fields.nth(7).and_then(|field| field.parse().ok()).unwrap_or(0)
}

/// Seconds that the first touch of a page takes; 0 where the system does not count them.
pub fn price_of_a_page(smoke: bool) -> f64 {
    let words = if smoke { 1 << 16 } else { 1 << 23 };
    let before = first_touches();
    let (memory, touched) = timed(|| (0..words).collect::<Vec<u64>>());
    let pages = first_touches().saturating_sub(before);
    let mut memory = std::hint::black_box(memory);
    let ((), again) = timed(|| {
        memory.iter_mut().zip(0..).for_each(|(word, i)| *word = i);
        std::hint::black_box(&memory);
    });
    if pages == 0 {
        0.0
    } else {
        (touched - again).max(0.0) / pages as f64
    }
}

/// Codes that were sorted, with their places before.
fn unsorted(sorted: &SortedCodes) -> Vec<u64> {
    let mut codes = vec![0; sorted.order.len()];
    for (code, i) in sorted.codes.iter().zip(&sorted.order) {
        codes[*i as usize] = code << 32 | u64::from(*i);
    }
    codes
}

/// Every stage of the linear hierarchy's build over boxes.
pub fn stages(
    context: &Context<'_>,
    boxes: &[Aabb],
    leaf_size: u32,
    builder: &LbvhBuilder,
    page_price: f64,
) -> Result<Vec<Stage>> {
    let sorted = SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS);
    let unsorted = unsorted(&sorted);
    let in_order: Vec<Aabb> = sorted.order.iter().map(|i| boxes[*i as usize]).collect();
    let renumbered = SortedCodes {
        codes: sorted.codes.clone(),
        order: (0..boxes.len() as u32).collect(),
        bits: sorted.bits,
    };
    let (triangles, triangles_in_order) = (triangles_in(boxes), triangles_in(&in_order));
    // The seconds of a contender and its stages, in a turn.
    let turns = context.in_turns(TURNS, CONTENDERS, |contender| {
        let before = first_touches();
        let fresh = || page_price * first_touches().saturating_sub(before) as f64;
        let host = |stage: &str, seconds: f64| (format!("host: {stage}"), seconds);
        Ok(match contender {
            0 => {
                let (_, seconds) = timed(|| SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS));
                vec![host("codes and sort", seconds)]
            }
            1 => {
                let mut pairs = unsorted.clone();
                let ((), seconds) = timed(|| pairs.par_sort_unstable());
                vec![host("of these the sort, by comparisons", seconds)]
            }
            2 => {
                let (_, seconds) = timed(|| merged_hierarchy(boxes, &sorted, leaf_size, |_| {}));
                vec![host("merge", seconds), host("of the merge fresh memory", fresh())]
            }
            3 => {
                let (_, seconds) = timed(|| merged_hierarchy(&in_order, &renumbered, leaf_size, |_| {}));
                vec![host("merge, kernels in the tree's order", seconds)]
            }
            4 => {
                let passes = on_device(builder, &triangles)?;
                let fresh = fresh();
                let all = whole(&passes);
                let passes = passes.into_iter().map(|(name, time)| (format!("device: {name}"), time));
                let others = [
                    (ON_DEVICE.to_owned(), all),
                    ("device: fresh memory of a build, its copies included".to_owned(), fresh),
                ];
                passes.chain(others).collect()
            }
            _ => {
                let passes = on_device(builder, &triangles_in_order)?;
                vec![("device: all, kernels in the tree's order".to_owned(), whole(&passes))]
            }
        })
    })?;
    let mut stages: Vec<Stage> = Vec::new();
    let per_kernel = 1e9 / boxes.len().max(1) as f64;
    for (stage, seconds) in turns.into_iter().flatten().flatten() {
        let time = per_kernel * seconds;
        match stages.iter_mut().find(|known| known.stage == stage) {
            Some(known) => known.time.0.push(time),
            None => stages.push(Stage {
                stage,
                kernels: boxes.len() as u64,
                time: Repeats(vec![time]),
            }),
        }
    }
    // By the order of contenders.
    let all = match stages.as_slice() {
        [sort, _, merge, ..] => sort
            .time
            .0
            .iter()
            .zip(&merge.time.0)
            .map(|(sort, merge)| sort + merge)
            .collect(),
        _ => Repeats::default(),
    };
    stages.push(Stage {
        stage: ON_HOST.into(),
        kernels: boxes.len() as u64,
        time: all,
    });
    Ok(stages)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_that_take_as_long_per_kernel_grow_with_their_number() {
        let stage = |kernels, nanoseconds: f64| Stage {
            stage: "merge".into(),
            kernels,
            time: Repeats(vec![nanoseconds; 2]),
        };
        let growth = |all: &[Stage]| {
            Growth::all(all)
                .iter()
                .map(|growth| growth.exponent.0[0])
                .collect::<Vec<f64>>()
        };
        assert_eq!(growth(&[stage(10, 3.0), stage(1000, 3.0)]), [1.0]);
        assert_eq!(growth(&[stage(10, 3.0), stage(20, 9.0), stage(1000, 300.0)]), [2.0]);
        assert_eq!(growth(&[stage(10, 0.0), stage(1000, 0.0)]), [0.0; 0]);
        assert_eq!(growth(&[]), [0.0; 0]);
    }
}
