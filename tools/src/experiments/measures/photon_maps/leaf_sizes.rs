//! Leaf sizes of photon maps: what a query reads, tests and takes, from 1 kernel a leaf to 128, beside the size chosen from the kernels.
//!
//! Source of the sweep: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.1.

use clerestory::Result;
use clerestory::accel::box_tree::BoxTree;
use clerestory::accel::photon_map::leaf_threshold::{LEAF_SHARE, automatic_leaf_size};

use super::leaf_frames::{BY_VOLUME, LINEAR, Published, SIZES};
use super::photon_kernels::{Kernels, Map, Prepared, SOURCE_SHAPE, Work, of_each_prepared};
use crate::experiments::findings::{
    Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;

/// Twice the share that is shipped, [`LEAF_SHARE`], which the source's own leaf sizes need.
const LARGE_SHARE: f64 = 2.0 * LEAF_SHARE;
/// Scenes that the share is found on; the others judge it.
const FOUND_ON: [&str; 2] = ["box-room?source=point", "passage"];
/// What chose a size.
const SWEEP: &str = "sweep";
const LARGE: &str = "share 1/8";
const SMALL: &str = "share 1/16";
/// Half of the turns choose the best size by time, the others say what it takes: no size is the best by the luck of its own turns.
const TURNS: usize = 10;

type Build = fn(&Kernels, u32) -> BoxTree;
const TREES: [(&str, Build); 2] = [(BY_VOLUME, Kernels::by_volume), (LINEAR, Kernels::linear)];

rows! {
    /// A size of a tree's leaves.
    struct Size = "Queries of photon maps by leaf size" by [scene, tree, size, by] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        tree: String = "tree",
        size: u64 = "leaf size",
        by: String = "chosen by",
        nodes: f64 = "nodes per query",
        kernels: f64 = "kernels tested per query",
        contributions: f64 = "kernels that count",
        reached: f64 = "nodes + kernels: best of the sweep / this",
        time: Repeats = "a query (µs)",
        speed: Repeats = "speed / best of the sweep",
    }
    beside "source: frames/s / best of its sweep" = |row| row.of_source().into();
}

rows! {
    /// The sweep of a tree.
    struct Sweep = "The best of the sweep by nodes + kernels" by [scene, shape, tree] {
        scene: String = "scene",
        shape: String = "kernels' shape",
        tree: String = "tree",
        best: u64 = "best leaf size",
        out_of_order: u64 = "neighbouring sizes that do not fall to the best or rise from it",
        ends: u64 = "ends of the sweep that are the best",
    }
}

rows! {
    /// An automatic size of a tree.
    struct Automatic = "Automatic leaf sizes" by [scene, shape, tree, share] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        shape: String = "kernels' shape",
        tree: String = "tree",
        share: String = "share",
        size: u64 = "leaf size",
        cover: f64 = "mean cover",
        contributions: f64 = "kernels that count where the camera looks",
        contributions_anywhere: f64 = "kernels that count anywhere",
        reached: f64 = "nodes + kernels: best / this, where the camera looks",
        reached_anywhere: f64 = "nodes + kernels: best / this, anywhere",
        reached_in_time: Option<Repeats> = "time: best / this, where the camera looks",
        frames_without: Option<f64> = "source's frames: share without queries (%)",
        frames_error: Option<f64> = "source's frames: error of the fit (%)",
        reached_in_frames: Option<f64> = "source's frames by our counts: best / this",
    }
    beside "source: best / this" = |row| {
        Published::of(&row.counterpart, &row.tree).map(|source| source.reached(source.automatic)).into()
    };
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    sweeps: Vec<Sweep>,
    automatic: Vec<Automatic>,
    sizes: Vec<Size>,
}

const OF_SWEEPS: &[Criterion<Sweep>] = &[Criterion::each(
    "one best size, with more nodes + kernels to both sides: exceptions",
    Bound::AtMost(0.0),
    |sweep: &Sweep| (sweep.out_of_order + sweep.ends).into(),
)];
const CRITERIA: &[Criterion<Automatic>] = &[
    Criterion::each(
        "the automatic size is within 3 % of the best by time, on scenes that judge it: best / this",
        Bound::AtLeast(0.97),
        |row: &Automatic| row.reached_in_time.as_ref().map_or(f64::NAN.into(), Repeats::measured),
    )
    .among(|row| row.is_the_default() && row.judges()),
    Criterion::all(
        "the share is the better of both where it is found: time of share 1/8 over that of 1/16, geometric mean",
        Bound::AtLeast(1.0),
        gain,
    )
    .among(|row| !row.judges()),
    Criterion::all(
        "it is so on scenes that judge it: time of share 1/8 over that of 1/16, geometric mean",
        Bound::AtLeast(1.0),
        gain,
    )
    .among(Automatic::judges),
];

/// How many times as long queries take with the larger share, on footprints, geometric mean of trees; `None` without any.
fn gain(rows: &[&Automatic]) -> Option<Measured> {
    let of = |share: &'static str| {
        rows.iter()
            .filter(move |row| row.share == share)
            .map(|row| row.reached_in_time.as_ref())
    };
    let pairs = of(SMALL)
        .zip(of(LARGE))
        .filter_map(|(small, large)| Some(small?.over(large?)));
    geometric_mean(pairs.map(|ratio| ratio.measured()))
}

impl Automatic {
    fn is_the_default(&self) -> bool {
        self.share == SMALL
    }

    /// Whether it is of footprints in a scene that the share was not found on.
    fn judges(&self) -> bool {
        self.shape == SOURCE_SHAPE.word() && !FOUND_ON.contains(&self.scene.as_str())
    }
}

impl Size {
    /// The source's frames a second over the best of its sweep; its own sizes are those of the smaller share.
    fn of_source(&self) -> Option<f64> {
        let source = Published::of(&self.counterpart, &self.tree)?;
        let place = SIZES.iter().position(|size| u64::from(*size) == self.size);
        match self.by.as_str() {
            SWEEP => Some(source.reached(source.sweep[place?])),
            SMALL => Some(source.reached(source.automatic)),
            _ => None,
        }
    }
}

/// Nodes and kernels at the same price.
fn steps(work: &Work) -> f64 {
    (work.tree.nodes + work.tests) as f64
}

/// What the best of the sweep costs, over what a size does: 1 is the best.
fn reached(cost: impl Fn(&Work) -> f64, works: &[Work], sizes: usize, chosen: usize) -> f64 {
    let least = works[..sizes].iter().map(&cost).fold(f64::INFINITY, f64::min);
    least / cost(&works[chosen])
}

/// Neighbours of a sweep whose costs do not fall to the place of the best or rise from it.
fn out_of_order(costs: &[f64], best: usize) -> u64 {
    let wrong = |(i, pair): &(usize, &[f64])| {
        if *i < best {
            pair[0] <= pair[1]
        } else {
            pair[0] >= pair[1]
        }
    };
    costs.windows(2).enumerate().filter(wrong).count() as u64
}

/// The best of the sweep over all in time: it is chosen by every other turn, and the remaining ones count.
fn over_best(times: &[Vec<f64>], sizes: usize) -> Vec<Repeats> {
    let turns = |times: &[f64], first: usize| times.iter().skip(first).step_by(2).copied().collect::<Repeats>();
    let chosen_by = |i: &usize| turns(&times[*i], 0).measured().value;
    let best = (0..sizes).min_by(|a, b| chosen_by(a).total_cmp(&chosen_by(b)));
    let best = turns(&times[best.unwrap_or(0)], 1);
    times.iter().map(|times| best.over(&turns(times, 1))).collect()
}

impl Found {
    /// Adds one tree of one scene: all sizes of the sweep, and the automatic ones.
    fn add(&mut self, context: &Context<'_>, prepared: &Prepared, (tree, build): (&str, Build)) -> Result<()> {
        let Prepared {
            case,
            surfaces,
            kernels,
            shape,
            points,
            anywhere,
        } = prepared;
        let automatic = |share| automatic_leaf_size(kernels.areas(), surfaces.area, share);
        let swept = context.first(&SIZES, 3);
        let sizes = swept.len();
        let mut wanted: Vec<(u32, &str)> = swept.iter().map(|size| (*size, SWEEP)).collect();
        wanted.extend([(automatic(LARGE_SHARE), LARGE), (automatic(LEAF_SHARE), SMALL)]);
        let maps = wanted.iter().map(|(size, _)| Map::new(kernels, &build(kernels, *size)));
        let maps: Vec<Map> = maps.collect::<Result<_>>()?;
        let [works, works_anywhere] = [points, anywhere].map(|points| {
            maps.iter()
                .map(|map| map.work(points, Map::gather_compact))
                .collect::<Vec<Work>>()
        });
        let each = |count: u64| count as f64 / points.len().max(1) as f64;
        let costs: Vec<f64> = works[..sizes].iter().map(steps).collect();
        let best = (0..sizes).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        self.sweeps.push(Sweep {
            scene: case.name().into(),
            shape: shape.word().into(),
            tree: tree.into(),
            best: wanted[best].0.into(),
            out_of_order: out_of_order(&costs, best),
            ends: u64::from(best == 0) + u64::from(best + 1 == sizes),
        });
        // Of other shapes, counts alone.
        let times = if *shape == SOURCE_SHAPE {
            context.in_turns(TURNS, maps.len(), |i| {
                Ok(1e-3 * maps[i].nanoseconds(points, Map::gather_compact))
            })?
        } else {
            Vec::new()
        };
        let speeds = if times.is_empty() {
            Vec::new()
        } else {
            over_best(&times, sizes)
        };
        // A smoke run has too few sizes.
        let source = Published::of(case.counterpart, tree).filter(|_| sizes == SIZES.len());
        let frames = source.map(|source| (source, source.frames(&works, points.len())));
        for (chosen, (size, share)) in wanted.iter().enumerate().skip(sizes) {
            self.automatic.push(Automatic {
                scene: case.name().into(),
                counterpart: case.counterpart().into(),
                shape: shape.word().into(),
                tree: tree.into(),
                share: (*share).into(),
                size: (*size).into(),
                cover: kernels.areas().sum::<f64>() / surfaces.area,
                contributions: each(works[chosen].contributions),
                contributions_anywhere: each(works_anywhere[chosen].contributions),
                reached: reached(steps, &works, sizes, chosen),
                reached_anywhere: reached(steps, &works_anywhere, sizes, chosen),
                reached_in_time: speeds.get(chosen).cloned(),
                frames_without: frames
                    .as_ref()
                    .map(|(source, fit)| fit.coefficients[0] * f64::from(source.automatic)),
                frames_error: frames.as_ref().map(|(_, fit)| 100.0 * fit.relative_error),
                reached_in_frames: frames.as_ref().map(|(_, fit)| {
                    let [frame, node, kernel] = fit.coefficients;
                    let cost = |work: &Work| frame + node * each(work.tree.nodes) + kernel * each(work.tests);
                    reached(cost, &works, sizes, chosen)
                }),
            });
        }
        for (i, (time, speed)) in times.into_iter().zip(speeds).enumerate() {
            self.sizes.push(Size {
                scene: case.name().into(),
                counterpart: case.counterpart().into(),
                tree: tree.into(),
                size: wanted[i].0.into(),
                by: wanted[i].1.into(),
                nodes: each(works[i].tree.nodes),
                kernels: each(works[i].tests),
                contributions: each(works[i].contributions),
                reached: reached(steps, &works, sizes, i),
                time: Repeats(time),
                speed,
            });
        }
        Ok(())
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let mut found = Self::default();
        of_each_prepared(context, |prepared| {
            TREES
                .into_iter()
                .try_for_each(|tree| found.add(context, prepared, tree))?;
            Ok(Vec::<Size>::new())
        })?;
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let of_default = self.automatic.iter().filter(|row| row.is_the_default());
        let times = of_default.filter_map(|row| Some(row.reached_in_time.as_ref()?.measured()));
        let worst = times.min_by(|a, b| a.value.total_cmp(&b.value));
        let swept: Vec<Size> = self.sizes.iter().filter(|row| row.by == SWEEP).cloned().collect();
        Findings::of(&self.automatic, CRITERIA)
            .headline(
                "best of the sweep over the automatic size by time, the worst tree",
                worst,
            )
            .curves(
                "steps",
                "Queries of photon maps by leaf size",
                Axes::rates("kernels in a leaf at most", "nodes + kernels per query"),
                curves(&swept, |row| format!("{}, {}", row.scene, row.tree), |row| {
                    (row.size as f64, (row.nodes + row.kernels).into())
                }),
            )
            .note(
                "The one reading of the criteria is the time of a query on footprints, by turns that did not choose the best size. Counts stand \
                 beside: they are exact, nodes and kernels at the same price. The rule takes the mean cover of all surfaces, whatever the camera \
                 sees: anywhere are as many points evenly on all surfaces. The source judges by frames, which hold rays and shading too: its eight \
                 frame times are fitted as a constant and our counts of nodes and kernels, none with a negative price, and the automatic size \
                 is judged by the sum. By time, the best size is chosen by half of the turns, and compared in the others.",
            )
            .and(Findings::of(&self.sweeps, OF_SWEEPS))
            .and(Findings::of(&self.sizes, &[]))
            .note(
                "Footprints: kernels of 2¹⁷ photons (2⁹ in a smoke run) that the photon tracer has followed by their differentials with the \
                 source's settings, spread so that a surface point lies in about as many as the source's Table 5.1 says of the counterpart. \
                 Spheres and ellipsoids: stand-ins about the second and third hits, radii by the fourth root of the photon's way, scaled to the \
                 same number. \
                 Queries at the points that the scene's camera sees, on compact pairs, one thread. Node and kernel counts are the same on every machine. \
                 Frames per second of the source's Table 6.1 stand over their best in the sweep, its automatic size in the row of share 1/16, \
                 which its own sizes need.",
            )
            .long()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_have_one_valley_and_the_best_is_chosen_by_other_turns() {
        assert_eq!(out_of_order(&[3.0, 2.0, 1.0, 2.0], 2), 0);
        assert_eq!(out_of_order(&[3.0, 4.0, 1.0, 2.0, 2.0], 2), 2);
        let times = [vec![1.0, 6.0, 1.0, 6.0], vec![2.0, 3.0, 2.0, 3.0]];
        assert_eq!(over_best(&times, 2), [Repeats(vec![1.0; 2]), Repeats(vec![2.0; 2])]);
    }
}
