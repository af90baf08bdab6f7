//! How probable rays visit nodes: the heuristics beside the exact integral, on named nodes and over a grid of them.
//!
//! Oracle: the closed form of the integral (see [`clerestory::accel::kd::probability`]), which agrees with quadrature to 1e-6 and with
//! four million samples to their error, both in the engine's tests.

use clerestory::Result;
use clerestory::accel::kd::Heuristic;
use clerestory::accel::kd::bounds::Bounds;
use glam::DVec3;

use super::named_nodes::{NODES, Node, SCENES, grid};
use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;

/// Nodes are sorted by their exact probability: below each of these, and above the last.
const CLASSES: [f64; 3] = [0.01, 0.1, 0.5];
/// Samples of named nodes.
const SAMPLES: f64 = 4e6;
/// Heuristics that are judged by the exact one.
const JUDGED: [Heuristic; 3] = [Heuristic::Regions, Heuristic::InteriorOrigin, Heuristic::SurfaceArea];

rows! {
    /// A named node.
    struct Named = "Probabilities of named nodes" by [node] {
        node: String = "scene, node",
        exact: f64 = "exact",
        sampled: f64 = "by samples",
        regions: f64 = "26 regions",
        siroh: f64 = "SIROH",
        area: f64 = "surface area",
    }
}

rows! {
    /// A heuristic on the nodes of a scene whose exact probability lies between two.
    struct Class = "Errors over a grid of nodes" by [scene, class, heuristic] {
        scene: String = "scene",
        class: String = "exact probability",
        nodes: u64 = "nodes",
        heuristic: String = "heuristic",
        mean: f64 = "mean error (%)",
        magnitude: f64 = "mean magnitude (%)",
        worst: f64 = "worst (%)",
    }
}

rows! {
    /// A heuristic on all nodes of a scene.
    struct Whole = "Errors over all nodes of the grid" by [scene, heuristic] {
        scene: String = "scene",
        heuristic: String = "heuristic",
        nodes: u64 = "nodes",
        magnitude: f64 = "mean magnitude (%)",
        of_area: f64 = "mean magnitude over that of the surface area",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    named: Vec<Named>,
    classes: Vec<Class>,
}

const OF_NAMED: &[Criterion<Named>] = &[Criterion::each(
    "the exact probability is that of four million samples: |z| over what chance exceeds once in a hundred runs",
    Bound::AtMost(1.0),
    |node: &Named| (node.z() / z_most(NODES.len())).into(),
)
.because("by Šidák for all nodes; figures of samples are rounded to 10⁻⁴, at most 0.7 of a standard error")
.in_every_form()];

impl Named {
    /// The difference in standard errors of the samples; without end where these have none and the difference has.
    fn z(&self) -> f64 {
        let difference = (self.exact - self.sampled).abs();
        if difference == 0.0 {
            return 0.0;
        }
        difference / (self.exact * (1.0 - self.exact) / SAMPLES).sqrt()
    }
}

const OF_WHOLES: &[Criterion<Whole>] = &[Criterion::each(
    "heuristics for origins in the scene err less than the surface area: mean magnitude over its own",
    Bound::AtMost(1.0),
    |whole: &Whole| whole.of_area.into(),
)
.among(|whole| whole.heuristic != Heuristic::SurfaceArea.name())];

/// Signed relative errors in per cent: sum, sum of magnitudes, greatest magnitude, count.
#[derive(Clone, Copy, Default)]
struct Errors {
    sum: f64,
    magnitudes: f64,
    worst: f64,
    count: u64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.sum += error;
        self.magnitudes += error.abs();
        self.worst = greatest([self.worst, error.abs()]);
        self.count += 1;
    }
}

/// Words for the classes.
fn classes() -> Vec<String> {
    let mut words = vec![format!("below {}", CLASSES[0])];
    words.extend(CLASSES.windows(2).map(|pair| format!("{} to {}", pair[0], pair[1])));
    words.push(format!("from {}", CLASSES[CLASSES.len() - 1]));
    words
}

fn named(node: &Node) -> Named {
    let of = |lower: DVec3, upper: DVec3| Bounds { lower, upper };
    let (scene, bounds) = (of(DVec3::ZERO, node.scene), of(node.lower.into(), node.upper.into()));
    let by = |heuristic: Heuristic| heuristic.probability(&bounds, &scene);
    let [regions, siroh, area] = JUDGED.map(by);
    Named {
        node: node.name.into(),
        exact: by(Heuristic::Exact),
        sampled: node.sampled,
        regions,
        siroh,
        area,
    }
}

/// Errors of all heuristics over the grid of a scene, by class.
fn over_grid(name: &str, scene: DVec3, cells: u32) -> Vec<Class> {
    let whole = Bounds {
        lower: DVec3::ZERO,
        upper: scene,
    };
    let mut found = [[Errors::default(); JUDGED.len()]; CLASSES.len() + 1];
    for bounds in grid(scene, cells) {
        let exact = Heuristic::Exact.probability(&bounds, &whole);
        let class = CLASSES.partition_point(|end| *end <= exact);
        for (errors, heuristic) in found[class].iter_mut().zip(JUDGED) {
            errors.add(100.0 * (heuristic.probability(&bounds, &whole) / exact - 1.0));
        }
    }
    let mut rows = Vec::new();
    for (class, found) in classes().into_iter().zip(found) {
        let of = |(errors, heuristic): (Errors, Heuristic)| Class {
            scene: name.into(),
            class: class.clone(),
            nodes: errors.count,
            heuristic: heuristic.name().into(),
            mean: errors.sum / errors.count as f64,
            magnitude: errors.magnitudes / errors.count as f64,
            worst: errors.worst,
        };
        let with_nodes = found.into_iter().zip(JUDGED).filter(|(errors, _)| errors.count > 0);
        rows.extend(with_nodes.map(of));
    }
    rows
}

/// The same over all classes.
fn wholes(classes: &[Class]) -> Vec<Whole> {
    let of = |scene: &str, heuristic: Heuristic| {
        let of_it = classes
            .iter()
            .filter(|class| class.scene == scene && class.heuristic == heuristic.name());
        let (nodes, sum) = of_it.fold((0, 0.0), |(nodes, sum), class| {
            (nodes + class.nodes, sum + class.nodes as f64 * class.magnitude)
        });
        (nodes, sum / nodes as f64)
    };
    let mut rows = Vec::new();
    for scene in classes.chunk_by(|a, b| a.scene == b.scene) {
        let name = &scene[0].scene;
        rows.extend(JUDGED.map(|heuristic| {
            let (nodes, magnitude) = of(name, heuristic);
            Whole {
                scene: name.clone(),
                heuristic: heuristic.name().into(),
                nodes,
                magnitude,
                of_area: magnitude / of(name, Heuristic::SurfaceArea).1,
            }
        }));
    }
    rows
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let cells = context.pick(8, 3);
        let name = |(name, _): &(&str, DVec3)| (*name).to_owned();
        Ok(Self {
            named: NODES.iter().map(named).collect(),
            classes: context.each(&SCENES, name, |(name, scene)| Ok(over_grid(name, *scene, cells)))?,
        })
    }

    fn findings(&self) -> Findings {
        let wholes = wholes(&self.classes);
        let is_siroh = |whole: &Whole| whole.heuristic == Heuristic::InteriorOrigin.name();
        Findings::of(&self.named, OF_NAMED)
            .note("Origins uniform in the scene, directions uniform, nothing in the way: the share of rays that visit the node.")
            .and(Findings::of(&wholes, OF_WHOLES))
            .headline(
                "SIROH's mean error over the surface area's, the worse of the scenes",
                largest(&wholes, is_siroh, |whole| whole.of_area),
            )
            .bars(
                "errors",
                "Mean magnitude of errors by exact probability (%)",
                &self.classes,
                |class| [format!("{}: {}", class.scene, class.class), class.heuristic.clone()],
                |class| class.magnitude.into(),
            )
            .note(
                "All boxes between the planes of a grid of 8 cells along each axis (3 in a smoke run), flat ones left out; errors relative to \
                 the exact probability.",
            )
            .and(Findings::of(&self.classes, &[]))
            .note("SIROH lets its regions overlap, which is too much in corners and too little far from all sides.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_probabilities_are_judged_by_their_own_error() {
        let z = |exact: f64, sampled: f64| {
            let node = Named {
                exact,
                sampled,
                ..Named::default()
            };
            node.z()
        };
        // 2.5·10⁻⁴ of 0.5, and 3.2·10⁻⁵ of 0.004.
        assert!((z(0.5, 0.5 + 2.5e-4) - 1.0).abs() < 1e-9);
        assert!(z(0.004, 0.0048) > 25.0);
        assert_eq!((z(1.0, 1.0), z(1.0, 0.9999)), (0.0, f64::INFINITY));
        assert!(z(f64::NAN, 0.5).is_nan());
    }
}
