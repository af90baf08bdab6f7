//! Traversal of kd-trees with a stack, and without one by a word of flags: leaves come in the same order, hits are the same.
//!
//! Sources: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.2.4.1 and §4.2.2 to §4.2.3; the carry is that
//! of the leaf's parent kept in a register of its own, so that ways of 32 inner nodes work.
//!
//! One bit a level of the way from the root: 0 where the near subtree of a node with both children met is in progress, 1 where nothing is
//! left but the child that the way takes. Adding the lowest bit of the way carries to the deepest node with something left, or out of the
//! word. A subtree that begins beyond the best hit is skipped by the same addition.

use super::KdTree;
use super::tree::KdKind;
use crate::accel::bvh2::traverse::BoxTest;
use crate::accel::triangle::{intersect_triangle, ray_shear};
use crate::accel::{CandidateFilter, Hit, Ray, TraversalCounters};
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

/// Exact work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KdCounters {
    /// Inner nodes visited.
    pub nodes: u64,
    /// Leaves visited, empty ones included.
    pub leaves: u64,
    /// Triangle tests.
    pub triangles: u64,
    /// Entries written to the stack or the ring.
    pub pushes: u64,
    /// Entries read from it.
    pub pops: u64,
    /// Descents that began anew.
    pub restarts: u64,
}

impl KdCounters {
    /// Adds to the counters that all indexes share.
    pub fn add_to(&self, counters: &mut TraversalCounters) {
        counters.nodes += self.nodes;
        counters.triangles += self.triangles;
        counters.iterations += self.nodes + self.triangles;
    }
}

/// What planes are met by: the box test's ray and slack.
struct PlaneTest(BoxTest);

/// Which children of a node a ray meets within its span.
enum Met {
    Near,
    Far,
    /// Both: where the near one ends.
    Both(f32),
}

impl PlaneTest {
    /// Which of the two is near: 0 for that below the plane.
    fn near(&self, axis: usize) -> u32 {
        u32::from(self.0.inverse[axis] < 0.0)
    }

    fn met(&self, axis: usize, plane: f32, [enter, leave]: [f32; 2]) -> Met {
        let t = (plane - self.0.origin[axis]) * self.0.inverse[axis];
        if t - self.0.slack[axis] > leave {
            Met::Near
        } else if t + self.0.slack[axis] < enter {
            Met::Far
        } else {
            Met::Both(leave.min(t + self.0.slack[axis]))
        }
    }

    /// Where the far child begins when the near one has ended at `leave`. A function of this alone, so that stack entries need not hold it.
    fn far_begins(&self, axis: usize, leave: f32, t_min: f32) -> f32 {
        (leave - 2.0 * self.0.slack[axis]).max(t_min)
    }
}

/// A subtree to go on with.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    node: u32,
    /// Axis of the plane above it.
    axis: usize,
    /// End of its span.
    leave: f32,
    /// Bit of the node above it.
    parent: u32,
}

/// Far children that are left: a stack, or a ring that forgets the oldest.
struct Entries {
    entries: [Entry; super::MAX_DEPTH as usize],
    capacity: usize,
    front: usize,
    size: usize,
}

impl Entries {
    fn new(capacity: usize) -> Self {
        Self {
            entries: [Entry::default(); super::MAX_DEPTH as usize],
            capacity,
            front: 0,
            size: 0,
        }
    }

    fn push(&mut self, entry: Entry) {
        self.entries[(self.front + self.size) % self.capacity] = entry;
        if self.size < self.capacity {
            self.size += 1;
        } else {
            self.front = (self.front + 1) % self.capacity;
        }
    }

    fn pop(&mut self) -> Option<Entry> {
        self.size = self.size.checked_sub(1)?;
        Some(self.entries[(self.front + self.size) % self.capacity])
    }
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

/// Closest hit, or the first candidate of all.
pub fn traverse(
    tree: &KdTree,
    scheme: Scheme,
    ray: &Ray,
    any: bool,
    filter: CandidateFilter<'_>,
    counters: &mut KdCounters,
) -> Hit {
    let mut hit = Hit::none(ray.t_max);
    if !ray.is_traceable() || tree.positions.is_empty() {
        return hit;
    }
    let boxes = BoxTest::new(&tree.bounds, ray);
    let (enter, leave) = boxes.span(tree.bounds.lower, tree.bounds.upper);
    let span = [enter.max(ray.t_min), leave.min(ray.t_max)];
    let planes = PlaneTest(boxes);
    let shear = ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction));
    if span[0] > span[1] {
        return hit;
    }
    let root = Descent {
        node: 0,
        span,
        bit: 1 << 31,
        parent: 0,
    };
    let (uses_flags, push_down, capacity) = match scheme {
        Scheme::Stack => (false, false, super::MAX_DEPTH as usize),
        Scheme::Flags { push_down, short_stack } => (true, push_down, (short_stack as usize).min(MAX_SHORT_STACK)),
    };
    let mut entries = Entries::new(capacity);
    let mut flags = 0u32;
    let mut restart = root;
    let mut can_push_down = push_down;
    let mut at = root;
    loop {
        // Down to a leaf, or to a far child that begins beyond the hit.
        let mut leaf = None;
        loop {
            let (axis, plane, children) = match tree.nodes[at.node as usize].kind() {
                KdKind::Leaf { first, count } => {
                    leaf = Some((first, count));
                    break;
                }
                KdKind::Inner { axis, plane, children } => (axis, plane, children),
            };
            counters.nodes += 1;
            let near = planes.near(axis);
            let side = match planes.met(axis, plane, at.span) {
                Met::Near => {
                    flags |= at.bit;
                    near
                }
                Met::Far => {
                    flags |= at.bit;
                    1 - near
                }
                Met::Both(end) if uses_flags && flags & at.bit != 0 => {
                    at.span[0] = planes.far_begins(axis, end, ray.t_min);
                    if at.span[0] > hit.t {
                        at.parent = at.bit;
                        break;
                    }
                    1 - near
                }
                Met::Both(end) => {
                    if can_push_down {
                        restart = at;
                        can_push_down = false;
                    }
                    if capacity > 0 {
                        counters.pushes += 1;
                        entries.push(Entry {
                            node: children + 1 - near,
                            axis,
                            leave: at.span[1],
                            parent: at.bit,
                        });
                    }
                    at.span[1] = end;
                    near
                }
            };
            at.node = children + side;
            at.parent = at.bit;
            at.bit >>= 1;
        }
        if let Some((first, count)) = leaf {
            counters.leaves += 1;
            for reference in &tree.references[first as usize..][..count as usize] {
                counters.triangles += 1;
                let place = *reference as usize;
                let Some(candidate) = intersect_triangle(&shear, &tree.positions[place], ray.t_min, hit.t) else {
                    continue;
                };
                let triangle = tree.indices[place];
                let barycentrics = [candidate.u, candidate.v];
                // A triangle of several leaves is met again with the same hit, which is not better.
                let better = candidate.t < hit.t || triangle < hit.triangle;
                if better && filter(triangle, barycentrics) {
                    hit = Hit {
                        t: candidate.t,
                        barycentrics,
                        triangle,
                    };
                    if any {
                        return hit;
                    }
                }
            }
        }
        // On to what is left, skipping what begins beyond the hit.
        loop {
            if uses_flags {
                flags = flags.wrapping_add(at.parent);
                if flags == 0 {
                    return hit;
                }
            }
            let Some(entry) = entries.pop() else {
                if !uses_flags {
                    return hit;
                }
                counters.restarts += 1;
                at = restart;
                can_push_down = push_down;
                break;
            };
            counters.pops += 1;
            at = Descent {
                node: entry.node,
                span: [planes.far_begins(entry.axis, at.span[1], ray.t_min), entry.leave],
                bit: entry.parent >> 1,
                parent: entry.parent,
            };
            if at.span[0] <= hit.t {
                can_push_down = false;
                break;
            }
        }
    }
}
