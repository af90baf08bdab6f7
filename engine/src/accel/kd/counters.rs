//! Exact work of traversals of kd-trees.
//!
//! The traffic model is that of B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §4.2.4 and §4.3.3.

use crate::accel::TraversalCounters;

/// Bytes of a node and of an entry of a stack.
const WORD_PAIR: u64 = 8;

/// Exact work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct KdCounters {
    /// Inner nodes visited.
    pub nodes: u64,
    /// Those of them that came from a cache.
    pub cached_nodes: u64,
    /// Leaves visited, empty ones included.
    pub leaves: u64,
    /// Triangle tests.
    pub triangles: u64,
    /// Entries written to the stack or the ring in memory.
    pub pushes: u64,
    /// Entries read from it.
    pub pops: u64,
    /// Entries put in registers.
    pub register_pushes: u64,
    /// Entries taken from there to go on with.
    pub register_pops: u64,
    /// Descents that began anew at the restart node; those that go on after a quota are not among them.
    pub restarts: u64,
    /// Loop iterations as kernels count them against their quota.
    pub iterations: u64,
}

impl KdCounters {
    /// Bytes by the traffic model of the source: 8 for each inner node fetched from memory, and 8 for each entry of the stack written or
    /// read there.
    pub fn bytes(&self) -> u64 {
        WORD_PAIR * (self.nodes - self.cached_nodes + self.pushes + self.pops)
    }

    /// Adds to the counters that all indexes share.
    pub fn add_to(&self, counters: &mut TraversalCounters) {
        counters.nodes += self.nodes;
        counters.triangles += self.triangles;
        counters.iterations += self.iterations;
    }
}
