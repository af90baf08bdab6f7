//! How probable rays visit nodes: the heuristics beside the exact integral, on named nodes and over a grid of them.
//!
//! Oracle: the closed form of the integral (see [`clerestory::accel::kd::probability`]), which agrees with quadrature to 1e-6 and with
//! four million samples to their error, both in the engine's tests.

use clerestory::Result;
use clerestory::accel::kd::Heuristic;
use clerestory::accel::kd::bounds::Bounds;
use glam::DVec3;

use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

const CUBE: DVec3 = DVec3::ONE;
const ROOM: DVec3 = DVec3::new(10.0, 6.0, 3.0);

/// A node of a scene that begins at the origin, and its exact probability by 4·10⁶ samples, ±2·10⁻⁴.
struct Node {
    name: &'static str,
    scene: DVec3,
    lower: [f64; 3],
    upper: [f64; 3],
    sampled: f64,
}

const fn node(name: &'static str, scene: DVec3, lower: [f64; 3], upper: [f64; 3], sampled: f64) -> Node {
    Node {
        name,
        scene,
        lower,
        upper,
        sampled,
    }
}

const NODES: [Node; 12] = [
    node("cube, all", CUBE, [0.0; 3], [1.0; 3], 1.0),
    node("cube, x < 0.5", CUBE, [0.0; 3], [0.5, 1.0, 1.0], 0.6240),
    node("cube, x < 0.1", CUBE, [0.0; 3], [0.1, 1.0, 1.0], 0.2605),
    node("cube, an eighth in a corner", CUBE, [0.0; 3], [0.5; 3], 0.2180),
    node("cube, half-sized in the middle", CUBE, [0.25; 3], [0.75; 3], 0.2683),
    node("cube, tenth-sized in the middle", CUBE, [0.45; 3], [0.55; 3], 0.00971),
    node("cube, tenth-sized in a corner", CUBE, [0.0; 3], [0.1; 3], 0.00412),
    node("cube, flat at x = 0.5", CUBE, [0.5, 0.0, 0.0], [0.5, 1.0, 1.0], 0.2480),
    node("cube, flat at x = 0", CUBE, [0.0; 3], [0.0, 1.0, 1.0], 0.16667),
    node(
        "10 × 6 × 3, unit cube in the middle",
        ROOM,
        [4.5, 2.5, 1.0],
        [5.5, 3.5, 2.0],
        0.0277,
    ),
    node("10 × 6 × 3, left half", ROOM, [0.0; 3], [5.0, 6.0, 3.0], 0.5719),
    node(
        "10 × 6 × 3, floor slab z < 0.3",
        ROOM,
        [0.0; 3],
        [10.0, 6.0, 0.3],
        0.3576,
    ),
];

/// Cells of the grid along an axis.
const GRID: u32 = 8;
const SMOKE_GRID: u32 = 3;
/// Nodes are sorted by their exact probability: below each of these, and above the last.
const CLASSES: [f64; 3] = [0.01, 0.1, 0.5];
/// Heuristics that are judged by the exact one.
const JUDGED: [Heuristic; 3] = [Heuristic::Regions, Heuristic::InteriorOrigin, Heuristic::SurfaceArea];

/// Signed relative errors: sum, sum of magnitudes, greatest magnitude, count.
#[derive(Clone, Copy, Default)]
struct Errors {
    sum: f64,
    magnitudes: f64,
    worst: f64,
    count: u64,
}

/// All boxes with corners on a grid over a scene, flat ones left out.
fn grid(scene: DVec3, cells: u32) -> Vec<Bounds> {
    let ranges: Vec<[f64; 2]> = (0..cells)
        .flat_map(|from| (from + 1..=cells).map(move |to| [from, to].map(|at| f64::from(at) / f64::from(cells))))
        .collect();
    let mut all = Vec::with_capacity(ranges.len().pow(3));
    for x in &ranges {
        for y in &ranges {
            for z in &ranges {
                let corner = |side: usize| scene * DVec3::new(x[side], y[side], z[side]);
                all.push(Bounds {
                    lower: corner(0),
                    upper: corner(1),
                });
            }
        }
    }
    all
}

/// Words for the classes.
fn classes() -> Vec<String> {
    let mut words = vec![format!("below {}", CLASSES[0])];
    words.extend(CLASSES.windows(2).map(|pair| format!("{} to {}", pair[0], pair[1])));
    words.push(format!("from {}", CLASSES[CLASSES.len() - 1]));
    words
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let mut named = Table::new(
        "Probabilities of named nodes",
        &[
            "scene, node",
            "exact",
            "by samples",
            "26 regions",
            "SIROH",
            "surface area",
        ],
    );
    for node in &NODES {
        let of = |lower: DVec3, upper: DVec3| Bounds { lower, upper };
        let (scene, bounds) = (of(DVec3::ZERO, node.scene), of(node.lower.into(), node.upper.into()));
        let by = |heuristic: Heuristic| Cell::from(heuristic.probability(&bounds, &scene));
        let [regions, siroh, area] = JUDGED.map(by);
        named.row([
            node.name.into(),
            by(Heuristic::Exact),
            node.sampled.into(),
            regions,
            siroh,
            area,
        ]);
    }
    named.note(
        "Origins uniform in the scene, directions uniform, nothing in the way: the share of rays that visit the node.",
    );
    let mut table = Table::new(
        "Errors over a grid of nodes",
        &[
            "scene",
            "exact probability",
            "nodes",
            "heuristic",
            "mean error (%)",
            "mean magnitude (%)",
            "worst (%)",
        ],
    );
    let cells = if context.smoke { SMOKE_GRID } else { GRID };
    for (name, scene) in [("cube", CUBE), ("10 × 6 × 3", ROOM)] {
        let whole = Bounds {
            lower: DVec3::ZERO,
            upper: scene,
        };
        let mut found = [[Errors::default(); CLASSES.len() + 1]; JUDGED.len()];
        for bounds in grid(scene, cells) {
            let exact = Heuristic::Exact.probability(&bounds, &whole);
            let class = CLASSES.partition_point(|end| *end <= exact);
            for (errors, heuristic) in found.iter_mut().zip(JUDGED) {
                let error = 100.0 * (heuristic.probability(&bounds, &whole) / exact - 1.0);
                let errors = &mut errors[class];
                errors.sum += error;
                errors.magnitudes += error.abs();
                errors.worst = errors.worst.max(error.abs());
                errors.count += 1;
            }
        }
        for (class, words) in classes().into_iter().enumerate() {
            for (found, heuristic) in found.iter().zip(JUDGED) {
                let Errors {
                    sum,
                    magnitudes,
                    worst,
                    count,
                } = found[class];
                if count > 0 {
                    table.row([
                        name.into(),
                        words.as_str().into(),
                        count.into(),
                        heuristic.name().into(),
                        (sum / count as f64).into(),
                        (magnitudes / count as f64).into(),
                        worst.into(),
                    ]);
                }
            }
        }
    }
    table.note(
        "All boxes between the planes of a grid of 8 cells along each axis (3 in a quick look), flat ones left out; errors relative to the \
         exact probability. SIROH lets its regions overlap, which is too much in corners and too little far from all sides.",
    );
    Ok(vec![named, table])
}
