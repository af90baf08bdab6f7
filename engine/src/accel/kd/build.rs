//! Greedy construction of kd-trees in O(n log n): events sorted once, planes weighed in one sweep an axis, order kept when nodes are split.
//!
//! Sources: I. Wald and V. Havran, "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)", IEEE RT 2006 (events,
//! classification, planar triangles to the cheaper side); B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin,
//! 2011, §3.2.3.1 and §4.1.4 (constants, bonus for empty space).
//!
//! Guarantees: the same tree whatever the number of threads; of planes of one cost the lowest axis and then the lowest coordinate wins; a
//! node of which all parts lie in one plane may have no volume, which is wanted: it shaves off a wall.

use super::bounds::Bounds;
use super::clip::clipped_bounds;
use super::probability::{AreaTerms, Heuristic, InteriorOrigin};
use super::tree::KdKind;
use super::{KdSettings, KdTree, MAX_DEPTH};
use crate::accel::Aabb;
use crate::accel::input::bounds_of;
use crate::catalogue::{Role, Row, sources};
use glam::Vec3;
use rayon::prelude::*;

/// Nodes with more triangles than this build their children in parallel.
const PARALLEL_TRIANGLES: usize = 2048;

/// Flat scenes are thought to be as thick as this share of their diagonal.
const FLAT_SHARE: f64 = 1e-4;

/// A node of the finished tree before it is laid out.
#[derive(Debug, Clone, PartialEq)]
pub enum Built {
    /// Triangles, ascending.
    Leaf(Vec<u32>),
    /// A plane and the children below and above it.
    Inner(u8, f32, Box<[Built; 2]>),
}

/// What happens to a triangle at a plane, in the order in which a sweep must see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    End,
    Planar,
    Start,
}

/// A place where a triangle begins or ends on an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Event {
    plane: f32,
    kind: Kind,
    /// Index into the node's triangles.
    triangle: u32,
}

impl Event {
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let by_plane = self.plane.total_cmp(&other.plane);
        by_plane
            .then(self.kind.cmp(&other.kind))
            .then(self.triangle.cmp(&other.triangle))
    }
}

/// A node under construction.
struct Work {
    bounds: Aabb,
    /// Indices of its triangles, ascending.
    triangles: Vec<u32>,
    /// Events by axis, sorted.
    events: [Vec<Event>; 3],
    depth: u32,
}

/// The best plane of a node.
#[derive(Debug, Clone, Copy)]
struct Plane {
    axis: usize,
    plane: f32,
    planar_below: bool,
    cost: f64,
}

/// Where a triangle goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Below,
    Above,
    Both,
}

/// Construction over triangles that rays can meet.
pub(super) struct Builder<'a> {
    triangles: &'a [[Vec3; 3]],
    settings: &'a KdSettings,
    /// Box of all triangles.
    bounds: Aabb,
    scene: Bounds,
    max_depth: u32,
}

/// The tree over triangles that rays can meet, all of them within `bounds`.
pub fn build(triangles: &[[Vec3; 3]], bounds: Aabb, settings: &KdSettings) -> Built {
    let builder = Builder::new(triangles, bounds, settings);
    builder.node(builder.root())
}

/// With one kind of zero, since events compare planes by their bits.
pub(super) fn triangle_bounds(triangle: &[Vec3; 3]) -> Aabb {
    bounds_of(triangle).without_negative_zero()
}

fn push_events(events: &mut Vec<Event>, bounds: &Aabb, triangle: u32, axis: usize) {
    let (lower, upper) = (bounds.lower[axis], bounds.upper[axis]);
    let event = |plane, kind| Event { plane, kind, triangle };
    if lower == upper {
        events.push(event(lower, Kind::Planar));
    } else {
        events.push(event(lower, Kind::Start));
        events.push(event(upper, Kind::End));
    }
}

impl<'a> Builder<'a> {
    /// All triangles lie within `bounds`.
    pub(super) fn new(triangles: &'a [[Vec3; 3]], bounds: Aabb, settings: &'a KdSettings) -> Self {
        let mut scene = Bounds::from(bounds);
        let pad = FLAT_SHARE * scene.extent().length();
        for axis in 0..3 {
            if scene.extent()[axis] < pad {
                scene.upper[axis] = scene.lower[axis] + pad;
            }
        }
        Self {
            triangles,
            settings,
            bounds,
            scene,
            max_depth: settings.max_depth.min(MAX_DEPTH),
        }
    }

    /// The node of all triangles.
    fn root(&self) -> Work {
        let boxes: Vec<Aabb> = self.triangles.par_iter().map(triangle_bounds).collect();
        let events = [0, 1, 2].map(|axis| {
            let mut events = Vec::with_capacity(2 * boxes.len());
            for (i, bounds) in boxes.iter().enumerate() {
                push_events(&mut events, bounds, i as u32, axis);
            }
            events.par_sort_unstable_by(Event::order);
            events
        });
        Work {
            bounds: self.bounds,
            triangles: (0..self.triangles.len() as u32).collect(),
            events,
            depth: 0,
        }
    }

    fn node(&self, work: Work) -> Built {
        let count = work.triangles.len();
        let Some(best) = self.plane_of(&work) else {
            return Built::Leaf(work.triangles);
        };
        let [below, above] = self.split(work, &best);
        let children = if count > PARALLEL_TRIANGLES {
            let (below, above) = rayon::join(|| self.node(below), || self.node(above));
            [below, above]
        } else {
            [self.node(below), self.node(above)]
        };
        Built::Inner(best.axis as u8, best.plane, Box::new(children))
    }

    /// The plane that cuts a node; `None` for a leaf.
    fn plane_of(&self, work: &Work) -> Option<Plane> {
        if work.triangles.len() <= self.settings.leaf_size as usize || work.depth >= self.max_depth {
            return None;
        }
        self.best_plane(work)
    }

    /// Whether a tree over the same triangles is cut, or left uncut, as here at all nodes that are `wanted`; with a node those above it are.
    pub(super) fn has_built(&self, tree: &KdTree, wanted: &[bool]) -> bool {
        !wanted[0] || self.has_built_below(self.root(), tree, 0, wanted)
    }

    fn has_built_below(&self, work: Work, tree: &KdTree, node: u32, wanted: &[bool]) -> bool {
        match (tree.nodes[node as usize].kind(), self.plane_of(&work)) {
            (KdKind::Leaf { .. }, None) => true,
            (KdKind::Inner { axis, plane, children }, Some(best)) if axis == best.axis && plane == best.plane => {
                let [below, above] = self.split(work, &best);
                [(children, below), (children + 1, above)]
                    .into_iter()
                    .all(|(child, work)| !wanted[child as usize] || self.has_built_below(work, tree, child, wanted))
            }
            _ => false,
        }
    }

    /// The cheapest plane, if it is cheaper than a leaf.
    fn best_plane(&self, work: &Work) -> Option<Plane> {
        let node = Bounds::from(work.bounds);
        let settings = self.settings;
        let count = work.triangles.len();
        let handed_down = settings.heuristic == Heuristic::InteriorOrigin;
        let interior = handed_down.then(|| InteriorOrigin::new(&node, &self.scene));
        let own = match &interior {
            Some(interior) => interior.sum(),
            None => settings.heuristic.probability(&node, &self.scene),
        };
        let leaf_cost = own * count as f64 * settings.intersection_cost;
        let sweep = |axis| self.sweep(work, &node, own, interior.as_ref(), axis);
        let axes: [Option<Plane>; 3] = if count > PARALLEL_TRIANGLES {
            let ((x, y), z) = rayon::join(|| rayon::join(|| sweep(0), || sweep(1)), || sweep(2));
            [x, y, z]
        } else {
            [0, 1, 2].map(sweep)
        };
        let mut best: Option<Plane> = None;
        for plane in axes.into_iter().flatten() {
            if best.is_none_or(|best| plane.cost < best.cost) {
                best = Some(plane);
            }
        }
        best.filter(|best| best.cost < leaf_cost)
    }

    /// The cheapest plane across an axis of a node with probability `own`. What the axis's candidates share is computed once, for surface area and
    /// for SIROH alike, and the sweep is compiled for each heuristic.
    fn sweep(
        &self,
        work: &Work,
        node: &Bounds,
        own: f64,
        interior: Option<&InteriorOrigin>,
        axis: usize,
    ) -> Option<Plane> {
        if node.extent()[axis] <= 0.0 {
            return None;
        }
        let scene = &self.scene;
        let extents = |plane: f64| [plane - node.lower[axis], node.upper[axis] - plane];
        match (interior, self.settings.heuristic) {
            (Some(interior), _) => {
                let terms = interior.terms(node, scene, axis);
                let to_scene = |plane: f64| [plane - scene.lower[axis], scene.upper[axis] - plane];
                self.cheapest(work, node, own, axis, |plane| {
                    terms.split(extents(plane), to_scene(plane))
                })
            }
            (None, Heuristic::SurfaceArea) => {
                let terms = AreaTerms::new(node, scene, axis);
                self.cheapest(work, node, own, axis, |plane| terms.split(extents(plane)))
            }
            (None, heuristic) => self.cheapest(work, node, own, axis, |plane| {
                node.split(axis, plane)
                    .map(|child| heuristic.probability(&child, scene))
            }),
        }
    }

    /// The same, where `probabilities` gives those of the two children of a plane.
    fn cheapest(
        &self,
        work: &Work,
        node: &Bounds,
        own: f64,
        axis: usize,
        probabilities: impl Fn(f64) -> [f64; 2],
    ) -> Option<Plane> {
        let settings = self.settings;
        let extent = node.extent()[axis];
        let count = work.triangles.len() as u32;
        let events = &work.events[axis];
        let (mut below, mut above) = (0, count);
        let mut best: Option<Plane> = None;
        let mut next = 0;
        while next < events.len() {
            let plane = events[next].plane;
            let mut of_kind = [0; 3];
            while next < events.len() && events[next].plane == plane {
                of_kind[events[next].kind as usize] += 1;
                next += 1;
            }
            let [ends, planar, starts] = of_kind;
            above -= planar + ends;
            let at = f64::from(plane);
            // Shares of the node's extent, and of its volume.
            let extents = [(at - node.lower[axis]) / extent, (node.upper[axis] - at) / extent];
            let shares = probabilities(at);
            for planar_below in [true, false] {
                let counts = if planar_below {
                    [below + planar, above]
                } else {
                    [below, above + planar]
                };
                if !planar_below && planar == 0 || !separates(counts, count, extents) {
                    continue;
                }
                let tests = shares[0] * f64::from(counts[0]) + shares[1] * f64::from(counts[1]);
                let mut cost = own * settings.traversal_cost + settings.intersection_cost * tests;
                for side in 0..2 {
                    if counts[side] == 0 && extents[side] > settings.empty_share {
                        cost *= 1.0 - settings.empty_bonus;
                    }
                }
                if best.is_none_or(|best| cost < best.cost) {
                    best = Some(Plane {
                        axis,
                        plane,
                        planar_below,
                        cost,
                    });
                }
            }
            below += starts + planar;
        }
        best
    }

    /// Hands triangles and events down, in order; triangles on both sides get new events of their parts.
    fn split(&self, work: Work, best: &Plane) -> [Work; 2] {
        let sides = sides(&work, best);
        let bounds = {
            let (mut below, mut above) = (work.bounds, work.bounds);
            below.upper[best.axis] = best.plane;
            above.lower[best.axis] = best.plane;
            [below, above]
        };
        let mut children = bounds.map(|bounds| Work {
            bounds,
            triangles: Vec::new(),
            events: [const { Vec::new() }; 3],
            depth: work.depth + 1,
        });
        // New index of each triangle on each side.
        let mut places = [
            vec![u32::MAX; work.triangles.len()],
            vec![u32::MAX; work.triangles.len()],
        ];
        let mut fresh: [[Vec<Event>; 3]; 2] = Default::default();
        for (i, side) in sides.iter().enumerate() {
            for (s, child) in children.iter_mut().enumerate() {
                let goes = match side {
                    Side::Below => s == 0,
                    Side::Above => s == 1,
                    Side::Both => true,
                };
                if !goes {
                    continue;
                }
                let place = child.triangles.len() as u32;
                if *side == Side::Both {
                    let triangle = &self.triangles[work.triangles[i] as usize];
                    let Some(part) = self.part(triangle, &child.bounds) else {
                        continue;
                    };
                    for (axis, events) in fresh[s].iter_mut().enumerate() {
                        push_events(events, &part, place, axis);
                    }
                } else {
                    places[s][i] = place;
                }
                child.triangles.push(work.triangles[i]);
            }
        }
        for ((child, places), fresh) in children.iter_mut().zip(&places).zip(&mut fresh) {
            for ((events, fresh), kept) in child.events.iter_mut().zip(fresh).zip(&work.events) {
                let kept = kept.iter().filter_map(|event| {
                    let triangle = places[event.triangle as usize];
                    (triangle != u32::MAX).then_some(Event { triangle, ..*event })
                });
                fresh.sort_unstable_by(Event::order);
                *events = merge(kept, fresh, 2 * child.triangles.len());
            }
        }
        children
    }

    /// The box of what a node has of a triangle.
    pub(super) fn part(&self, triangle: &[Vec3; 3], node: &Aabb) -> Option<Aabb> {
        if self.settings.clip {
            return clipped_bounds(triangle, node);
        }
        let bounds = triangle_bounds(triangle);
        Some(Aabb {
            lower: bounds.lower.max(node.lower),
            upper: bounds.upper.min(node.upper),
        })
    }
}

/// Whether a plane makes progress: not all triangles on both sides, and no side that is neither filled nor thick.
fn separates(counts: [u32; 2], count: u32, extents: [f64; 2]) -> bool {
    let is_nothing = |side: usize| counts[side] == 0 && extents[side] <= 0.0;
    counts != [count; 2] && !is_nothing(0) && !is_nothing(1)
}

/// Where each triangle of a node goes (Wald and Havran 2006, Algorithm 6).
fn sides(work: &Work, best: &Plane) -> Vec<Side> {
    let mut sides = vec![Side::Both; work.triangles.len()];
    for event in &work.events[best.axis] {
        let side = &mut sides[event.triangle as usize];
        match event.kind {
            Kind::End if event.plane <= best.plane => *side = Side::Below,
            Kind::Start if event.plane >= best.plane => *side = Side::Above,
            Kind::Planar if event.plane < best.plane => *side = Side::Below,
            Kind::Planar if event.plane > best.plane => *side = Side::Above,
            Kind::Planar => *side = if best.planar_below { Side::Below } else { Side::Above },
            _ => {}
        }
    }
    sides
}

/// Where a triangle goes by the box of what the node has of it, the same as by its events; `None` for one in the plane, which goes where the
/// plane's choice says.
pub(super) fn side_of(part: &Aabb, axis: usize, plane: f32) -> Option<Side> {
    let (lower, upper) = (part.lower[axis], part.upper[axis]);
    if lower == plane && upper == plane {
        None
    } else if upper <= plane {
        Some(Side::Below)
    } else if lower >= plane {
        Some(Side::Above)
    } else {
        Some(Side::Both)
    }
}

/// Two sorted runs as one.
fn merge(kept: impl Iterator<Item = Event>, fresh: &[Event], capacity: usize) -> Vec<Event> {
    let mut merged = Vec::with_capacity(capacity);
    let mut fresh = fresh.iter().copied().peekable();
    for event in kept {
        while let Some(earlier) = fresh.next_if(|other| other.order(&event).is_lt()) {
            merged.push(earlier);
        }
        merged.push(event);
    }
    merged.extend(fresh);
    merged
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-KD-1",
    name: "kd-trees by the surface area heuristic, O(n log n), with perfect splits",
    role: Role::Kernel,
    limits: "Built on the host, the slowest of the builds; what moves is rebuilt.",
    sources: &[sources::WALD_HAVRAN_2006.whole()],
    tests: &[
        "engine/src/accel/kd/cost_tests.rs::every_plane_has_the_least_cost_and_every_leaf_costs_less",
        "engine/src/accel/kd/tests.rs::every_point_of_a_triangle_lies_in_a_leaf_that_holds_it",
        "engine/src/accel/kd/tests.rs::a_wall_ends_in_a_leaf_without_volume",
        "engine/src/accel/kd/tests.rs::bytes_do_not_depend_on_the_number_of_threads",
        "engine/src/accel/kd/probability/tests.rs::shared_terms_give_the_areas_of_the_children_to_the_bit",
    ],
    api: &["clerestory::accel::kd::KdTree"],
    settings: &["clerestory::accel::kd::KdSettings", "clerestory render --index kd"],
    ..Row::of(file!())
}];
