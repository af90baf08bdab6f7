//! Traversal of kd-trees with a stack, and without one by a word of flags: leaves come in the same order, hits are the same.
//!
//! Sources: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.2.4.1 and §4.2.2 to §4.2.3; the carry is that
//! of the leaf's parent kept in a register of its own, so that ways of 32 inner nodes work.
//!
//! One bit a level of the way from the root: 0 where the near subtree of a node with both children met is in progress, 1 where nothing is
//! left but the child that the way takes. Adding the lowest bit of the way carries to the deepest node with something left, or out of the
//! word. A subtree that begins beyond the best hit is skipped by the same addition, and where all that is left does, the ray ends: what is
//! left begins no earlier than the part just left has ended, less twice the largest slack. Without that a ray would go back to each far child
//! that its hit has made needless, by a restart each. Rays nearly parallel to an axis still do, since their slack across it has no bound.

use super::entries::{Entries, Entry};
use super::tree::KdKind;
use super::{KdCaches, KdCounters, KdTree, MAX_DEPTH};
use crate::accel::box_test::BoxTest;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::{CandidateFilter, FINISHED, Hit, Ray};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// Most entries of a short stack.
pub const MAX_SHORT_STACK: usize = 16;

/// How a traversal finds back to what it has left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// A stack of far children.
    Stack,
    /// A word of flags, and restarts.
    Flags {
        /// Whether restarts begin at the lowest node that holds all that is left, not at the root.
        push_down: bool,
        /// Entries of a ring of the last far children, at most [`MAX_SHORT_STACK`]; 0 for none.
        short_stack: u32,
    },
}

impl Scheme {
    /// What kernels are specialized by: whether by flags, whether restarts are pushed down, entries of the ring.
    pub(in crate::accel) fn specialization(self) -> (bool, bool, u32) {
        match self {
            Self::Stack => (false, false, 0),
            Self::Flags { push_down, short_stack } => (true, push_down, short_stack.min(MAX_SHORT_STACK as u32)),
        }
    }
}

/// The box test along one axis.
struct PlaneTest {
    origin: f32,
    inverse: f32,
    slack: f32,
}

/// Which children of a node a ray meets within its span.
enum Met {
    Near,
    Far,
    /// Both: where the near one ends.
    Both(f32),
}

fn plane_test(boxes: &BoxTest, axis: usize) -> PlaneTest {
    PlaneTest {
        origin: boxes.origin[axis],
        inverse: boxes.inverse[axis],
        slack: boxes.slack[axis],
    }
}

/// Which of the two children is near: 0 for that below the plane.
fn near_child(test: &PlaneTest) -> u32 {
    u32::from(test.inverse < 0.0)
}

fn children_met(test: &PlaneTest, plane: f32, [enter, leave]: [f32; 2]) -> Met {
    let t = (plane - test.origin) * test.inverse;
    let (early, late) = (t - test.slack, t + test.slack);
    if early > leave {
        Met::Near
    } else if late < enter {
        Met::Far
    } else {
        Met::Both(leave.min(late))
    }
}

/// Where the far child begins when the near one has ended. A function of this alone, so that stack entries need not hold it.
fn far_begins(slack: f32, near_ended: f32, t_min: f32) -> f32 {
    (near_ended - 2.0 * slack).max(t_min)
}

/// Whether all that is left begins beyond a hit when a part has ended: each far child that is left begins by [`far_begins`] of an end that is
/// not nearer, and roundings keep that order.
fn ends_beyond(largest_slack: f32, ended: f32, hit: f32) -> bool {
    ended - 2.0 * largest_slack > hit
}

/// A place to descend from.
#[derive(Debug, Clone, Copy)]
struct Descent {
    node: u32,
    span: [f32; 2],
    /// Bit of the node's level.
    bit: u32,
    /// Bit of the level above; 0 at the root.
    parent: u32,
}

impl Descent {
    fn at_root(boxes: &BoxTest, tree: &KdTree, ray: &Ray) -> Self {
        let (enter, leave) = boxes.span(tree.bounds.lower, tree.bounds.upper);
        Self {
            node: 0,
            span: [enter.max(ray.t_min), leave.min(ray.t_max)],
            bit: constants::KD_ROOT_BIT,
            parent: 0,
        }
    }
}

/// A traversal between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KdTraversal {
    /// Best hit so far.
    pub hit: Hit,
    /// Flags of what is left, 0 at the start, or [`FINISHED`].
    pub resume: u32,
    any: bool,
    scheme: Scheme,
    caches: KdCaches,
}

impl KdTraversal {
    /// Starts a closest-hit query.
    pub fn closest(scheme: Scheme, ray: &Ray) -> Self {
        Self {
            hit: Hit::none(ray.t_max),
            resume: 0,
            any: false,
            scheme,
            caches: KdCaches::default(),
        }
    }

    /// Starts an any-hit query: the first accepted candidate ends it.
    pub fn any(scheme: Scheme, ray: &Ray) -> Self {
        Self {
            any: true,
            ..Self::closest(scheme, ray)
        }
    }

    /// The same with caches, in a traversal by a stack.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for caches with another scheme, or with more levels than they can name.
    pub fn with_caches(mut self, caches: KdCaches) -> crate::Result<Self> {
        caches.check()?;
        if self.scheme != Scheme::Stack {
            caches.check_absent("go only with a stack")?;
        }
        self.caches = caches;
        Ok(self)
    }

    /// Runs for about `quota` iterations; [`Self::resume`] says whether it is done. Any quota makes progress.
    ///
    /// It stops between leaves: a round may come on top of the quota, which is [`MAX_DEPTH`] nodes, a leaf and [`MAX_DEPTH`] skipped subtrees
    /// at most. It goes on from the root, by the flags and with the same hit, so nothing is lost and no triangle is tested twice for it; the
    /// nodes of the way back are visited again, and what lies beside it pushed again.
    pub fn run(
        &mut self,
        tree: &KdTree,
        ray: &Ray,
        quota: u64,
        filter: CandidateFilter<'_>,
        counters: &mut KdCounters,
    ) {
        self.run_watched(tree, ray, quota, filter, counters, &mut |_| {});
    }

    /// As [`Self::run`]; `watch` sees the node of each leaf, in order.
    pub fn run_watched(
        &mut self,
        tree: &KdTree,
        ray: &Ray,
        quota: u64,
        filter: CandidateFilter<'_>,
        counters: &mut KdCounters,
        watch: &mut dyn FnMut(u32),
    ) {
        if self.resume == FINISHED {
            return;
        }
        let flags = std::mem::replace(&mut self.resume, FINISHED);
        if !ray.is_traceable() || tree.positions.is_empty() {
            return;
        }
        let boxes = BoxTest::new(&tree.bounds, ray);
        let root = Descent::at_root(&boxes, tree, ray);
        if root.span[0] > root.span[1] {
            return;
        }
        let (push_down, capacity) = match self.scheme {
            Scheme::Stack => (false, MAX_DEPTH as usize),
            Scheme::Flags { push_down, short_stack } => (push_down, (short_stack as usize).min(MAX_SHORT_STACK)),
        };
        let mut walk = Walk {
            tree,
            ray,
            boxes,
            push_down,
            entries: Entries::new(capacity, self.caches),
            flags,
            restart: root,
            can_push_down: push_down,
            at: root,
            cached_nodes: self.caches.cached_nodes(),
        };
        let round = u64::from(match self.caches.postpone {
            true => constants::KD_PAIR_ITERATIONS,
            false => constants::KD_ROUND_ITERATIONS,
        });
        let begun = counters.nodes + counters.triangles;
        let mut iterations = 0;
        let mut waiting: Option<&[u32]> = None;
        let mut tests = LeafTests {
            tree,
            shear: ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction)),
            t_min: ray.t_min,
            filter,
        };
        loop {
            iterations += round;
            if let Some(leaf) = walk.descend(self.hit.t, counters) {
                counters.leaves += 1;
                watch(walk.at.node);
                let [first, second]: [&[u32]; 2] = match (self.caches.postpone, waiting.take()) {
                    (false, _) => [leaf, &[]],
                    (true, Some(first)) => [first, leaf],
                    (true, None) => {
                        waiting = Some(leaf);
                        [&[], &[]]
                    }
                };
                // The second only if it begins before what is met in the first.
                if self.test_leaf(&mut tests, first, counters)
                    || walk.at.span[0] <= self.hit.t && self.test_leaf(&mut tests, second, counters)
                {
                    break;
                }
            }
            if !walk.next(self.hit.t, counters, &mut iterations) {
                if let Some(leaf) = waiting {
                    iterations += round;
                    self.test_leaf(&mut tests, leaf, counters);
                }
                break;
            }
            // A leaf that alone is left is not worth stopping at; nor could flags say so at the lowest level, where they read as the end.
            let one_leaf = match self.scheme {
                Scheme::Stack => walk.entries.is_empty() && walk.is_at_leaf(),
                Scheme::Flags { .. } => walk.flags == FINISHED,
            };
            let all = iterations + counters.nodes + counters.triangles - begun;
            if all >= quota && !one_leaf && waiting.is_none() {
                self.resume = walk.flags;
                break;
            }
        }
        counters.iterations += iterations + counters.nodes + counters.triangles - begun;
    }

    /// Tests the triangles of a leaf; true when that answers the query.
    fn test_leaf(&mut self, tests: &mut LeafTests<'_, '_>, leaf: &[u32], counters: &mut KdCounters) -> bool {
        leaf.iter().any(|place| {
            counters.triangles += 1;
            self.test(tests, *place as usize) && self.any
        })
    }

    /// Tests one triangle; true when it is the best hit now.
    fn test(&mut self, tests: &mut LeafTests<'_, '_>, place: usize) -> bool {
        let tree = tests.tree;
        let Some(candidate) = intersect_triangle(&tests.shear, &tree.positions[place], tests.t_min, self.hit.t) else {
            return false;
        };
        let triangle = tree.indices[place];
        let barycentrics = [candidate.u, candidate.v];
        // A triangle of several leaves is met again with the same hit, which is not better.
        let better = candidate.t < self.hit.t || triangle < self.hit.triangle;
        if !better || !(tests.filter)(triangle, barycentrics) {
            return false;
        }
        self.hit = Hit {
            t: candidate.t,
            barycentrics,
            triangle,
        };
        true
    }
}

/// What triangles of leaves are tested by.
struct LeafTests<'a, 'f> {
    tree: &'a KdTree,
    shear: RayShear,
    t_min: f32,
    filter: CandidateFilter<'f>,
}

/// The entry of a node at the top of the tree as kernels find it in their caches: the axis of the plane above it, and where the ray leaves its box,
/// which is where its span ends, since planes on the way to it bound both.
fn cached_entry(tree: &KdTree, boxes: &BoxTest, t_max: f32, place: u32) -> Entry {
    let (mut node, mut axis_above, mut bounds) = (0, 0, tree.bounds);
    for level in (0..place.ilog2()).rev() {
        if let KdKind::Inner { axis, plane, children } = tree.nodes[node as usize].kind() {
            let side = place >> level & 1;
            match side {
                0 => bounds.upper[axis] = plane,
                _ => bounds.lower[axis] = plane,
            }
            axis_above = axis;
            node = children + side;
        }
    }
    Entry {
        node: place,
        axis: axis_above,
        leave: boxes.span(bounds.lower, bounds.upper).1.min(t_max),
    }
}

/// The way of a ray through the leaves.
struct Walk<'a> {
    tree: &'a KdTree,
    ray: &'a Ray,
    boxes: BoxTest,
    push_down: bool,
    entries: Entries,
    flags: u32,
    restart: Descent,
    can_push_down: bool,
    at: Descent,
    cached_nodes: u32,
}

impl<'a> Walk<'a> {
    /// Down to a leaf, whose references are returned, or to a far child that begins beyond the hit.
    fn descend(&mut self, hit: f32, counters: &mut KdCounters) -> Option<&'a [u32]> {
        loop {
            let at = &mut self.at;
            let (axis, plane, children) = match self.tree.nodes[at.node as usize].kind() {
                KdKind::Leaf { first, count } => {
                    return Some(&self.tree.references[first as usize..][..count as usize]);
                }
                KdKind::Inner { axis, plane, children } => (axis, plane, children),
            };
            counters.nodes += 1;
            counters.cached_nodes += u64::from(at.node < self.cached_nodes);
            let test = plane_test(&self.boxes, axis);
            let near = near_child(&test);
            let mut goes_on = true;
            let side = match children_met(&test, plane, at.span) {
                Met::Near => {
                    self.flags |= at.bit;
                    near
                }
                Met::Far => {
                    self.flags |= at.bit;
                    1 - near
                }
                Met::Both(end) if self.flags & at.bit != 0 => {
                    at.span[0] = far_begins(test.slack, end, self.ray.t_min);
                    goes_on = at.span[0] <= hit;
                    1 - near
                }
                Met::Both(end) => {
                    if self.can_push_down {
                        self.restart = *at;
                        self.can_push_down = false;
                    }
                    let far = Entry {
                        node: children + 1 - near,
                        axis,
                        leave: at.span[1],
                    };
                    self.entries.push(far, counters);
                    at.span[1] = end;
                    near
                }
            };
            at.node = children + side;
            at.parent = at.bit;
            at.bit >>= 1;
            if !goes_on {
                return None;
            }
        }
    }

    fn is_at_leaf(&self) -> bool {
        matches!(self.tree.nodes[self.at.node as usize].kind(), KdKind::Leaf { .. })
    }

    /// On to what is left, an iteration for each subtree that is skipped since it begins beyond the hit; false at the end.
    fn next(&mut self, hit: f32, counters: &mut KdCounters, iterations: &mut u64) -> bool {
        let largest_slack = self.boxes.slack.max_element();
        loop {
            self.flags = self.flags.wrapping_add(self.at.parent);
            if self.flags == 0 || ends_beyond(largest_slack, self.at.span[1], hit) {
                return false;
            }
            let (tree, boxes, t_max) = (self.tree, self.boxes, self.ray.t_max);
            let of_node = |node| cached_entry(tree, &boxes, t_max, node);
            let Some(entry) = self.entries.pop(counters, of_node) else {
                counters.restarts += 1;
                self.at = self.restart;
                self.can_push_down = self.push_down;
                return true;
            };
            // The carry has set the bit of the node above.
            let parent = self.flags & self.flags.wrapping_neg();
            let slack = self.boxes.slack[entry.axis];
            self.at = Descent {
                node: entry.node,
                span: [far_begins(slack, self.at.span[1], self.ray.t_min), entry.leave],
                bit: parent >> 1,
                parent,
            };
            self.can_push_down = false;
            if self.at.span[0] <= hit {
                return true;
            }
            *iterations += 1;
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-TR-1",
        name: "traversal of kd-trees with a stack",
        role: Role::PartOf("PM-KD-1"),
        limits: "Kernels reserve 32 entries of eight bytes for each ray, however shallow the tree is.",
        sources: &[sources::WALD_2004.at("7.1")],
        shaders: &["shaders/accel/kd.glsl", "shaders/accel/trace_rays.comp"],
        tests: &[
            "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
            "engine/src/accel/kd/tests.rs::leaves_come_in_the_order_of_the_ray",
            "tests/tests/accel/kd.rs::kernels_of_every_scheme_are_their_twins",
        ],
        api: &[
            "clerestory::accel::kd::KdTraversal",
            "clerestory::accel::kd::Scheme",
            "clerestory::accel::trace::RayTracer",
        ],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-TR-3",
        name: "traversal of kd-trees without a stack, by a word of flags",
        role: Role::PartOf("PM-KD-1"),
        limits: "Walks down from the root again after each leaf, and for each far child that a hit leaves where a ray is nearly parallel to an axis.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.2.2")],
        shaders: &["shaders/accel/kd.glsl", "shaders/accel/trace_rays.comp"],
        tests: &[
            "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
            "engine/src/accel/kd/tests.rs::ways_as_long_as_the_word_of_flags_are_gone_to_their_end",
            "engine/src/accel/kd/tests.rs::a_hit_ends_a_ray_without_a_restart_for_each_far_child_that_is_left",
            "tests/tests/accel/kd.rs::kernels_of_every_scheme_are_their_twins",
        ],
        api: &[
            "clerestory::accel::kd::KdTraversal",
            "clerestory::accel::kd::Scheme",
            "clerestory::accel::trace::RayTracer",
        ],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-TR-4",
        name: "traversal of kd-trees by a word of flags with push-down",
        role: Role::PartOf("PM-KD-1"),
        limits: "Restarts at the lowest node that holds all that is left of the ray; a ray that leaves something near the root gains nothing.",
        sources: &[sources::HORN_2007.whole()],
        shaders: &["shaders/accel/kd.glsl", "shaders/accel/trace_rays.comp"],
        tests: &[
            "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
            "tests/tests/accel/kd.rs::kernels_of_every_scheme_are_their_twins",
        ],
        api: &[
            "clerestory::accel::kd::KdTraversal",
            "clerestory::accel::kd::Scheme",
            "clerestory::accel::trace::RayTracer",
        ],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-TR-5",
        name: "traversal of kd-trees by a word of flags with a short stack",
        role: Role::PartOf("PM-KD-1"),
        limits: "Restarts where the short stack has run empty.",
        sources: &[sources::HORN_2007.whole()],
        shaders: &["shaders/accel/kd.glsl", "shaders/accel/trace_rays.comp"],
        tests: &[
            "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
            "tests/tests/accel/kd.rs::kernels_of_every_scheme_are_their_twins",
        ],
        api: &[
            "clerestory::accel::kd::KdTraversal",
            "clerestory::accel::kd::Scheme",
            "clerestory::accel::trace::RayTracer",
        ],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-TR-6",
        name: "traversal of kd-trees by a word of flags with push-down and a short stack",
        role: Role::PartOf("PM-KD-1"),
        limits: "Restarts, below the root, where the short stack has run empty.",
        sources: &[sources::HORN_2007.whole()],
        shaders: &["shaders/accel/kd.glsl", "shaders/accel/trace_rays.comp"],
        tests: &[
            "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
            "engine/src/accel/kd/tests.rs::work_is_in_the_order_of_the_schemes",
            "tests/tests/accel/kd.rs::kernels_of_every_scheme_are_their_twins",
        ],
        api: &[
            "clerestory::accel::kd::KdTraversal",
            "clerestory::accel::kd::Scheme",
            "clerestory::accel::trace::RayTracer",
        ],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
];
