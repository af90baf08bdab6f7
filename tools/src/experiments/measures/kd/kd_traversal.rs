//! Ways through a kd-tree: with a stack, and without one by a word of flags, with push-down, a short stack or both.
//!
//! Oracle: all give the same hits to the bit. Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College
//! Dublin, 2011, tables 4.5 and 4.6.

use clerestory::Result;
use clerestory::accel::kd::shifted_restart::{ShiftedRestart, leaves_by_stack};
use clerestory::accel::kd::{KdCaches, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{Ray, RayIndex};

use super::flights::{
    Case, Flight, SOURCE_LEAVES, cases, change, different_of_both, each_flight, race, source_tree, trace,
};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

/// Entries of the source's short stack.
const SHORT_STACK: u32 = 4;

const fn flags(push_down: bool, short_stack: u32) -> Scheme {
    Scheme::Flags { push_down, short_stack }
}

/// The one that others are compared with first.
pub(super) const SCHEMES: [(&str, Scheme); 5] = [
    ("stack", Scheme::Stack),
    ("flags", flags(false, 0)),
    ("flags, push-down", flags(true, 0)),
    ("flags, short stack of 4", flags(false, SHORT_STACK)),
    ("flags, both", flags(true, SHORT_STACK)),
];

/// What the source says of a scene: inner nodes a ray with a stack, what the other schemes change in them and in frames a second, in per cent.
struct Published {
    counterpart: &'static str,
    visits: f64,
    changes: [f64; 4],
    speeds: [f64; 4],
}

const PUBLISHED: [Published; 5] = [
    Published {
        counterpart: "Scene 6",
        visits: 7.31,
        changes: [35.7, 21.1, 0.0, 0.0],
        speeds: [-5.3, -2.6, -1.3, -2.5],
    },
    Published {
        counterpart: "Sponza",
        visits: 29.81,
        changes: [136.7, 97.1, 0.3, 0.2],
        speeds: [-37.1, -30.6, -8.7, -12.2],
    },
    Published {
        counterpart: "Sibenik",
        visits: 37.63,
        changes: [151.5, 107.2, 0.8, 0.8],
        speeds: [-43.5, -35.8, -10.2, -13.8],
    },
    Published {
        counterpart: "Fairy",
        visits: 37.43,
        changes: [182.7, 98.2, 0.6, 0.6],
        speeds: [-41.6, -29.8, -11.6, -14.9],
    },
    Published {
        counterpart: "Conference",
        visits: 19.57,
        changes: [108.1, 59.4, 0.3, 0.3],
        speeds: [-18.1, -11.4, -4.6, -7.2],
    },
];

/// Restarts behind a leaf, each of which fails.
const RESTARTS: [(&str, ShiftedRestart); 4] = [
    ("closed intervals", ShiftedRestart::Closed),
    ("open intervals", ShiftedRestart::Open),
    ("closed, 1e-5 m behind", ShiftedRestart::ClosedBehind(1e-5)),
    ("closed, 1e-8 m behind", ShiftedRestart::ClosedBehind(1e-8)),
];
/// Rays that are followed so, and leaves after which there is no end.
const RESTARTED_RAYS: usize = 2000;
const MOST_LEAVES: usize = 4096;

/// Rays whose leaves have no end, and those whose leaves are not the stack's.
fn failures(tree: &KdTree, rays: &[&Ray], form: ShiftedRestart) -> [u64; 2] {
    let mut failures = [0; 2];
    for ray in rays {
        let found = form.leaves(tree, ray, MOST_LEAVES);
        if found.endless {
            failures[0] += 1;
        } else if found != leaves_by_stack(tree, ray) {
            failures[1] += 1;
        }
    }
    failures
}

/// Rows of restarts that fail.
fn restarted(restarts: &mut Table, case: &Case, tree: &KdTree, flight: &Flight) {
    let step = flight.camera.len().div_ceil(RESTARTED_RAYS).max(1);
    let some: Vec<&Ray> = flight.camera.iter().step_by(step).collect();
    for (name, form) in RESTARTS {
        let [endless, other] = failures(tree, &some, form);
        restarts.row([
            case.name().into(),
            name.into(),
            (some.len() as u64).into(),
            endless.into(),
            other.into(),
        ]);
    }
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Ways through a kd-tree",
        &[
            "scene",
            "counterpart",
            "leaves of",
            "scheme",
            "hits that differ",
            "timed hits that differ",
            "inner nodes a ray",
            "change (%)",
            "source: inner nodes",
            "source: change (%)",
            "leaves a ray",
            "restarts a ray",
            "stack entries a ray",
            "bytes a ray",
            "closest hits (M rays/s)",
            "any hits (M rays/s)",
            "speed, change (%)",
            "source: speed, change (%)",
        ],
    );
    let mut restarts = Table::new(
        "Restarts behind a leaf",
        &["scene", "form", "rays", "rays without an end", "rays with other leaves"],
    );
    each_flight(context, &cases(context), |case, surfaces, flight| {
        let published = PUBLISHED.iter().find(|row| row.counterpart == case.counterpart);
        for leaf_size in SOURCE_LEAVES {
            let tree = source_tree(surfaces, leaf_size)?;
            let closest = flight.closest();
            let settings = SCHEMES.map(|(_, scheme)| TraceSettings {
                scheme,
                ..TraceSettings::ray_per_thread()
            });
            let contenders = settings.map(|settings| (&tree as &dyn RayIndex, settings));
            let raced = race(context, &gpu, flight, contenders)?;
            let of = |(_, scheme)| trace(&tree, scheme, KdCaches::default(), [&closest, &flight.shadow]);
            let traced = SCHEMES.into_iter().map(of).collect::<Result<Vec<_>>>()?;
            let (expected, by_stack) = &traced[0];
            let each = |count: u64| count as f64 / flight.rays().max(1) as f64;
            for (i, ((name, _), (hits, work))) in SCHEMES.into_iter().zip(&traced).enumerate() {
                let of_source = |of: fn(&Published) -> &[f64; 4]| {
                    Cell::from(published.zip(i.checked_sub(1)).map(|(row, i)| of(row)[i]))
                };
                let rates = raced[i].rates;
                table.row([
                    case.name().into(),
                    case.counterpart.into(),
                    u64::from(leaf_size).into(),
                    name.into(),
                    different_of_both(hits, expected).into(),
                    different_of_both(&raced[i].hits, expected).into(),
                    each(work.nodes).into(),
                    change(work.nodes as f64, by_stack.nodes as f64).into(),
                    published.map(|row| row.visits).into(),
                    of_source(|row| &row.changes),
                    each(work.leaves).into(),
                    each(work.restarts).into(),
                    each(work.pushes + work.pops).into(),
                    each(work.bytes()).into(),
                    rates[0].into(),
                    rates[1].into(),
                    change(rates[2], raced[0].rates[2]).into(),
                    of_source(|row| &row.speeds),
                ]);
            }
            if leaf_size == SOURCE_LEAVES[0] {
                restarted(&mut restarts, case, &tree, flight);
            }
        }
        Ok(())
    })?;
    table.note(
        "Flights as in `kd-heuristics`, SIROH trees over boxes; leaves of 4 are those of the source's text, leaves of 1 come nearer to \
         the numbers of nodes that it gives (see there). Hits, of closest and of any hits, are compared with those of the host by a \
         stack: first the host's, then those of the kernels that were timed. Here rays go on until leaves begin beyond their hit, so that \
         no rounding loses one. Counts are exact and the same on every machine: inner nodes, entries of stacks written and read, and \
         bytes by the source's model of 8 for each of these. Visits are hardware independent, so their changes can be held against the \
         source's; the ranking is the source's, the sizes are not: flags restart once for each leaf that is left, and rays meet more \
         leaves in these trees. Times are medians of runs that take turns, one invocation a ray.",
    );
    restarts.note(
        "Without flags a ray that restarts behind the leaf that it has left (at its end, or a step behind it) does not know which of the \
         leaves that begin there it has had: closed intervals meet the last one for ever, open ones never meet leaves without volume, and a \
         step skips what is thinner or is lost in rounding. Leaves of the whole ray, whatever it hits, beside those by a stack, in \
         the trees with leaves of 4.",
    );
    Ok(vec![table, restarts])
}
