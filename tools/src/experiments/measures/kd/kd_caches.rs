//! Caches of kd-trees that kernels manage themselves: what they keep from memory, what they load beforehand, and what that gains.
//!
//! Oracle: all give the same hits to the bit. Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College
//! Dublin, 2011, tables 4.8 and 4.10.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{KdCaches, KdCounters, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::gpu::Gpu;

use super::cache_costs::{TUNED_IN, fetched_beforehand, groups, leaves_that_wait, tuned};
use super::cache_ranking::{OF_ORDERS, orders};
use super::flights::{
    Case, Flight, SOURCE_LEAVES, TURNS, cases, different_of_both, each_flight, on_hardware, race, source_tree, trace,
};
use super::published::{CACHES, Caches, of_source};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::{Context, EXACT_DIVISION, MEMORY_OF_ITS_OWN};

/// The forms of [`KdCaches::COMPARED`].
pub(super) const NAMES: [&str; 7] = [
    "none",
    "nodes",
    "last entry",
    "a leaf that waits",
    "nodes, last entry",
    "nodes with boxes, entries as bytes",
    "nodes, a leaf that waits",
];
/// The best of the source's.
const BEST: &str = NAMES[4];
/// Of a node, by the source's model.
const NODE_BYTES: f64 = 8.0;
/// Leaves of the trees whose numbers of nodes are nearest to the source's.
const NEAREST_LEAVES: u64 = 1;

rows! {
    /// A form of caches in a tree over a scene.
    struct Row = "Caches of a kd-tree in persistent threads" by [scene, leaf_size, caches] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        leaf_size: u64 = "leaves of",
        caches: String = "caches",
        different: u64 = "hits of the host that differ",
        timed_different: u64 = "hits of the kernels that differ",
        nodes: f64 = "inner nodes per ray from memory",
        nodes_change: f64 = "change of nodes (%)",
        entries: f64 = "entries per ray written to and read from memory",
        entries_change: f64 = "change of entries (%)",
        bytes: f64 = "bytes per ray",
        bytes_change: f64 = "change of bytes (%)",
        preload: f64 = "bytes per ray that workgroups load beforehand",
        all_bytes_change: f64 = "change of bytes, those included (%)",
        all_nodes: f64 = "inner nodes per ray in all",
        twice_fetched_change: Option<f64> = "change of nodes, leaves that waited fetched twice (%)",
        groups: u64 = "workgroups of a dispatch",
        rate: Repeats = "M rays/s",
        speed: Repeats = "speed, change (%)",
        on_hardware: bool = "on a device of its own",
    }
    beside "source without caches: inner nodes per ray" = |row| row.without(0).into();
    beside "source without caches: entries per ray" = |row| row.without(1).into();
    beside "source without caches: bytes per ray" = |row| row.without(2).into();
    beside "source: change of nodes (%)" = |row| row.of_source(|caches| &caches.nodes).into();
    beside "source: change of entries (%)" = |row| row.of_source(|caches| &caches.entries).into();
    beside "source: change of bytes (%)" = |row| row.of_source(|caches| &caches.bytes).into();
    beside "source: speed, change (%)" = |row| row.of_source(|caches| &caches.speed).into();
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "all caches leave the hits of the host as they are",
        Bound::AtMost(0.0),
        |row: &Row| row.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "kernels find the hits of the host without caches, to the bit",
        Bound::AtMost(0.0),
        |row: &Row| row.timed_different.into(),
    )
    .among(|row| !row.on_hardware)
    .needs(EXACT_DIVISION)
    .in_every_form(),
    Criterion::each(
        "changes of nodes, entries and bytes with another sign than the source's",
        Bound::AtMost(0.0),
        |row: &Row| row.other_signs().into(),
    )
    .among(Row::is_compared),
    Criterion::each(
        "the best caches spare bytes, those included that workgroups load beforehand: change of bytes (%)",
        Bound::AtMost(0.0),
        |row: &Row| row.all_bytes_change.into(),
    )
    .among(|row| row.caches == BEST)
    .because("the source's 30 workgroups load 240 KiB once a launch"),
    Criterion::each(
        "visits with a leaf that waits change as the source's, where each such leaf is fetched twice (%)",
        Bound::Between(11.0, 16.0),
        |row: &Row| row.twice_fetched_change.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.is_compared() && row.twice_fetched_change.is_some())
    .because("the source's scenes have 11.1 to 16.0"),
    Criterion::each(
        "the speed changes to the source's side: its change, or the opposite of it where the source's is a loss (%)",
        Bound::AtLeast(0.0),
        Row::speed_to_its_side,
    )
    .among(|row| row.is_compared() && row.on_hardware)
    .needs(MEMORY_OF_ITS_OWN),
];

impl Row {
    fn published(&self) -> Option<&'static Caches> {
        of_source(&CACHES, &self.counterpart)
    }

    fn without(&self, column: usize) -> Option<f64> {
        self.published().map(|caches| caches.none[column])
    }

    /// What it says of these caches.
    pub(super) fn of_source(&self, of: fn(&Caches) -> &[f64; 6]) -> Option<f64> {
        let form = NAMES[1..].iter().position(|name| *name == self.caches)?;
        Some(of(self.published()?)[form])
    }

    /// Whether it is held against the source.
    pub(super) fn is_compared(&self) -> bool {
        self.leaf_size == NEAREST_LEAVES && self.of_source(|caches| &caches.bytes).is_some()
    }

    fn other_signs(&self) -> u64 {
        let changes = [self.nodes_change, self.entries_change, self.bytes_change];
        let of_source: [fn(&Caches) -> &[f64; 6]; 3] =
            [|caches| &caches.nodes, |caches| &caches.entries, |caches| &caches.bytes];
        let pairs = changes.into_iter().zip(of_source);
        let differ = pairs.filter(|(ours, of)| self.of_source(*of).is_some_and(|theirs| sign(theirs) != sign(*ours)));
        differ.count() as u64
    }

    fn speed_to_its_side(&self) -> Measured {
        let theirs = self.of_source(|caches| &caches.speed).map_or(0, sign);
        self.speed.scaled(f64::from(theirs)).measured()
    }
}

/// −1, 0 or 1.
fn sign(change: f64) -> i8 {
    i8::from(change > 0.0) - i8::from(change < 0.0)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let settings = tuned(context, &gpu)?;
        each_flight(context, &cases(context), |case, surfaces, flight| {
            let mut rows = Vec::new();
            for leaf_size in SOURCE_LEAVES {
                let tree = source_tree(surfaces, leaf_size)?;
                rows.extend(forms(context, &gpu, &settings, case, flight, (leaf_size, &tree))?);
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let shown: Vec<Row> = self
            .iter()
            .filter(|row| row.leaf_size == NEAREST_LEAVES)
            .cloned()
            .collect();
        let best = shown.iter().filter(|row| row.caches == BEST);
        Findings::of(self, CRITERIA)
            .headline(
                "bytes with nodes and the last entry cached, those loaded beforehand included, over those without caches, leaves of 1, geometric mean",
                geometric_mean(best.map(|row| (1.0 + 0.01 * row.all_bytes_change).into())),
            )
            .bars(
                "bytes",
                "Bytes per ray from memory, those loaded beforehand included, leaves of 1",
                &shown,
                |row| [row.scene.clone(), row.caches.clone()],
                |row| (row.bytes + row.preload).into(),
            )
            .note(format!(
                "Flights as in `kd-heuristics`, SIROH trees over boxes; leaves of 4 are those of the source's text, leaves of 1 come nearer \
                 to the numbers of nodes that it gives (see there). Traversal with a stack. Hits, of closest and of any hits, are compared \
                 with those of the host without caches: first the host's, then those of the kernels that were timed. Counts are exact and \
                 the same on every machine but for workgroups and what they load; bytes by the source's model of 8 for each node fetched \
                 from memory and each entry written or read there. Each form has the number of workgroups that is fastest for it in \
                 `{TUNED_IN}`, a scene of none of the rows. Workgroups load the top of the tree at each dispatch: this is in the columns \
                 that say so and in no other. On a software driver shared memory and registers are ordinary cached memory, and its cap on \
                 loops lets a workgroup trace only some dozens of rays for each of these loads: there the times say what the forms cost, \
                 nothing about what they would gain on a device with such memories. Instructions are not counted."
            ))
            .note(
                "Leaves that waited: in the source's tables a leaf that waits adds 1.2 to 4.9 visits a ray, but only 0.04 to 1.1 accesses of \
                 the stack, which are too few for as many nodes behind them: its additional visits are about as many as there are leaves \
                 that wait, half of all. Its kernel keeps the number of such a leaf and fetches its node again; ours keeps what the node \
                 says. The column adds one visit for each leaf that waited.",
            )
            .and(Findings::of(&orders(self), OF_ORDERS))
            .note("Pairs of the six forms that have caches, of which the source has one before the other. An interval is of pairs whose own do not overlap.")
    }
}

/// All forms in one tree, by its leaf size.
fn forms(
    context: &Context<'_>,
    gpu: &Gpu,
    settings: &[TraceSettings],
    case: &Case,
    flight: &Flight,
    (leaf_size, tree): (u32, &KdTree),
) -> Result<Vec<Row>> {
    let contenders = settings.iter().map(|settings| (tree as &dyn RayIndex, *settings));
    let raced = race(context, gpu, flight, TURNS, contenders)?;
    let closest = flight.closest();
    let of = |caches| trace(tree, Scheme::Stack, caches, [&closest, &flight.shadow]);
    let traced = KdCaches::COMPARED.into_iter().map(of).collect::<Result<Vec<_>>>()?;
    let waited = |caches| leaves_that_wait(tree, caches, [&closest, &flight.shadow]);
    let waited = KdCaches::COMPARED.into_iter().map(waited).collect::<Result<Vec<_>>>()?;
    let counts = |work: &KdCounters| {
        let counts = [work.nodes - work.cached_nodes, work.pushes + work.pops, work.bytes()];
        counts.map(|count| flight.per_ray(count))
    };
    let (expected, without) = (&traced[0].0, counts(&traced[0].1));
    let rows = (0..NAMES.len()).map(|form| {
        let ((hits, work), timed) = (&traced[form], &raced[form]);
        let [nodes, entries, bytes] = counts(work);
        let caches = KdCaches::COMPARED[form];
        let loaded = timed.workgroups * fetched_beforehand(caches, tree.nodes().len());
        let preload = NODE_BYTES * flight.per_ray(loaded);
        let twice_fetched = nodes + flight.per_ray(waited[form]);
        // Leaves that wait come from memory again where no nodes are cached.
        let is_fetched_twice = caches.postpone && caches.node_levels == 0;
        Row {
            scene: case.name().into(),
            counterpart: case.counterpart.into(),
            leaf_size: leaf_size.into(),
            caches: NAMES[form].into(),
            different: different_of_both(hits, expected),
            timed_different: different_of_both(&timed.hits, expected),
            nodes,
            nodes_change: change(nodes, without[0]),
            entries,
            entries_change: change(entries, without[1]),
            bytes,
            bytes_change: change(bytes, without[2]),
            preload,
            all_bytes_change: change(bytes + preload, without[2]),
            twice_fetched_change: is_fetched_twice.then(|| change(twice_fetched, without[0])),
            groups: groups(&settings[form]),
            all_nodes: flight.per_ray(work.nodes),
            rate: timed.rates[2].clone(),
            speed: timed.rates[2].change_from(&raced[0].rates[2]),
            on_hardware: on_hardware(gpu),
        }
    });
    Ok(rows.collect())
}
