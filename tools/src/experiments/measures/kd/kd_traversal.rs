//! Ways through a kd-tree: with a stack, and without one by a word of flags, with push-down, a short stack or both.
//!
//! Oracle: all give the same hits to the bit. Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College
//! Dublin, 2011, tables 4.5 and 4.6.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{KdCaches, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::gpu::Gpu;

use super::flights::{
    Case, Flight, SOURCE_LEAVES, TURNS, cases, different_of_both, each_flight, on_hardware, race, source_tree, trace,
};
use super::published::{WAYS, Ways, of_source};
use super::restarts::{Restart, restarts};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::{Context, EXACT_DIVISION};

/// Entries of the source's short stack.
const SHORT_STACK: u32 = 4;

const fn flags(push_down: bool, short_stack: u32) -> Scheme {
    Scheme::Flags { push_down, short_stack }
}

/// The one that others are compared with first, then by how much they keep of it.
pub(super) const SCHEMES: [(&str, Scheme); 5] = [
    ("stack", Scheme::Stack),
    ("flags", flags(false, 0)),
    ("flags, push-down", flags(true, 0)),
    ("flags, short stack of 4", flags(false, SHORT_STACK)),
    ("flags, both", flags(true, SHORT_STACK)),
];

rows! {
    /// A scheme in a tree over a scene.
    struct Row = "Ways through a kd-tree" by [scene, leaf_size, scheme] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        leaf_size: u64 = "leaves of",
        scheme: String = "scheme",
        different: u64 = "hits of the host that differ",
        timed_different: u64 = "hits of the kernels that differ",
        nodes: f64 = "inner nodes per ray",
        change: f64 = "change of nodes (%)",
        leaves: f64 = "leaves per ray",
        restarts: f64 = "restarts per ray",
        entries: f64 = "stack entries per ray",
        bytes: f64 = "bytes per ray",
        closest: Repeats = "closest hits (M rays/s)",
        any: Repeats = "any hits (M rays/s)",
        speed: Repeats = "speed, change (%)",
        on_hardware: bool = "on a device of its own",
    }
    beside "source: inner nodes per ray by a stack" = |row| row.published().map(|ways| ways.visits).into();
    beside "source: change of nodes (%)" = |row| row.of_source(|ways| &ways.changes).into();
    beside "source: speed, change (%)" = |row| row.of_source(|ways| &ways.speeds).into();
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "all schemes find the same hits on the host",
        Bound::AtMost(0.0),
        |row: &Row| row.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "kernels find the hits of the host by a stack, to the bit",
        Bound::AtMost(0.0),
        |row: &Row| row.timed_different.into(),
    )
    .among(|row| !row.on_hardware)
    .needs(EXACT_DIVISION)
    .in_every_form(),
    Criterion::all(
        "share of the trees in which visits fall from flags over push-down and the short stack to both",
        Bound::AtLeast(1.0),
        share_in_order,
    ),
    Criterion::each(
        "visits with a short stack are about the stack's: change (%)",
        Bound::Between(-1.0, 1.0),
        |row: &Row| row.change.into(),
    )
    .among(Row::has_short_stack)
    .because("the source's are 0 to 0.8"),
];

impl Row {
    fn published(&self) -> Option<&'static Ways> {
        of_source(&WAYS, &self.counterpart)
    }

    fn of_source(&self, of: fn(&Ways) -> &[f64; 4]) -> Option<f64> {
        let scheme = SCHEMES[1..].iter().position(|(name, _)| *name == self.scheme)?;
        Some(of(self.published()?)[scheme])
    }

    fn has_short_stack(&self) -> bool {
        SCHEMES[3..].iter().any(|(name, _)| *name == self.scheme)
    }
}

/// The share of trees whose visits never rise along the schemes without a full stack.
fn share_in_order(rows: &[&Row]) -> Option<Measured> {
    let trees = rows.chunk_by(|a, b| a.scene == b.scene && a.leaf_size == b.leaf_size);
    let fall = |tree: &[&Row]| tree[1..].is_sorted_by(|a, b| a.nodes >= b.nodes);
    let (all, falling) = trees.fold((0.0, 0.0), |(all, falling), tree| {
        (all + 1.0, falling + f64::from(u8::from(fall(tree))))
    });
    (all > 0.0).then(|| Measured::exact(falling / all))
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    schemes: Vec<Row>,
    restarts: Vec<Restart>,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut restarted = Vec::new();
        let schemes = each_flight(context, &cases(context), |case, surfaces, flight| {
            let mut rows = Vec::new();
            for leaf_size in SOURCE_LEAVES {
                let tree = source_tree(surfaces, leaf_size)?;
                rows.extend(schemes(context, &gpu, case, flight, (leaf_size, &tree))?);
                if leaf_size == SOURCE_LEAVES[0] {
                    restarted.extend(restarts(case, &tree, flight));
                }
            }
            Ok(rows)
        })?;
        Ok(Self {
            schemes,
            restarts: restarted,
        })
    }

    fn findings(&self) -> Findings {
        let small = |row: &&Row| row.leaf_size == 1;
        let shown: Vec<Row> = self.schemes.iter().filter(small).cloned().collect();
        let both = shown.iter().filter(|row| row.scheme == SCHEMES[4].0);
        let short = || {
            self.schemes
                .iter()
                .filter(|row| row.has_short_stack())
                .map(|row| row.change)
        };
        let least = short().fold(f64::INFINITY, f64::min);
        let most = short().fold(f64::NEG_INFINITY, f64::max);
        let short_stack = match least <= most {
            true => format!(
                " With a short stack of {SHORT_STACK}, with push-down or without, inner nodes change by {least:.1} to {most:.1} % of a \
                 stack's; in the source by 0 to 0.8 %."
            ),
            false => String::new(),
        };
        Findings::of(&self.schemes, CRITERIA)
            .headline(
                "inner nodes of flags with push-down and a short stack over those of a stack, leaves of 1, geometric mean",
                geometric_mean(both.map(|row| (1.0 + 0.01 * row.change).into())),
            )
            .bars(
                "visits",
                "Inner nodes per ray, leaves of 1",
                &shown,
                |row| [row.scene.clone(), row.scheme.clone()],
                |row| row.nodes.into(),
            )
            .note(format!(
                "Flights as in `kd-heuristics`, SIROH trees over boxes; leaves of 4 are those of the source's text, leaves of 1 come nearer \
                 to the numbers of nodes that it gives (see there). Hits, of closest and of any hits, are compared with those of the host by \
                 a stack: first the host's, then those of the kernels that were timed. Here rays go on until leaves begin beyond their hit, \
                 so that no rounding loses one. Counts are exact and the same on every machine: inner nodes, entries of stacks written and \
                 read, and bytes by the source's model of 8 for each of these. Visits are independent of hardware, so their changes can be \
                 held against the source's; their sizes need not be its own: flags restart once for each leaf that is left, and rays meet \
                 more leaves in these trees. A hit ends a ray where all that is left begins behind it, but for rays nearly parallel to an \
                 axis, which still restart at each far child that is left. Schemes take turns, one invocation per ray.{short_stack}",
            ))
            .and(Findings::of(&self.restarts, &[]))
            .note(
                "Without flags a ray that restarts behind the leaf that it has left (at its end, or a step behind it) does not know which of \
                 the leaves that begin there it has had: closed intervals meet the last one for ever, open ones never meet leaves without \
                 volume, and a step skips what is thinner or is lost in rounding. Leaves of the whole ray, whatever it hits, beside those by \
                 a stack, in the trees with leaves of 4.",
            )
    }
}

/// All schemes in one tree, by its leaf size.
fn schemes(
    context: &Context<'_>,
    gpu: &Gpu,
    case: &Case,
    flight: &Flight,
    (leaf_size, tree): (u32, &KdTree),
) -> Result<Vec<Row>> {
    let settings = SCHEMES.map(|(_, scheme)| TraceSettings {
        scheme,
        ..TraceSettings::ray_per_thread()
    });
    let contenders = settings.map(|settings| (tree as &dyn RayIndex, settings));
    let raced = race(context, gpu, flight, TURNS, contenders)?;
    let closest = flight.closest();
    let of = |(_, scheme)| trace(tree, scheme, KdCaches::default(), [&closest, &flight.shadow]);
    let traced = SCHEMES.into_iter().map(of).collect::<Result<Vec<_>>>()?;
    let (expected, by_stack) = &traced[0];
    let schemes = SCHEMES.into_iter().zip(&traced).zip(&raced);
    let rows = schemes.map(|(((scheme, _), (hits, work)), timed)| Row {
        scene: case.name().into(),
        counterpart: case.counterpart.into(),
        leaf_size: leaf_size.into(),
        scheme: scheme.into(),
        different: different_of_both(hits, expected),
        timed_different: different_of_both(&timed.hits, expected),
        nodes: flight.per_ray(work.nodes),
        change: change(work.nodes as f64, by_stack.nodes as f64),
        leaves: flight.per_ray(work.leaves),
        restarts: flight.per_ray(work.restarts),
        entries: flight.per_ray(work.pushes + work.pops),
        bytes: flight.per_ray(work.bytes()),
        closest: timed.rates[0].clone(),
        any: timed.rates[1].clone(),
        speed: timed.rates[2].change_from(&raced[0].rates[2]),
        on_hardware: on_hardware(gpu),
    });
    Ok(rows.collect())
}
