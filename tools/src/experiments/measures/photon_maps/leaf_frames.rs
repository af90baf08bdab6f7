//! Frames of the source by leaf size, and what they take by our counts of nodes and kernels.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.1.

use super::photon_kernels::Work;
use crate::least_squares::{Fit, non_negative};

/// Leaf sizes of the sweep.
pub const SIZES: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
/// A tree of the source.
pub const BY_VOLUME: &str = "volume heuristic";
/// Its other tree.
pub const LINEAR: &str = "linear";

/// A row of the source's table: frames in a hundred seconds.
pub struct Published {
    counterpart: &'static str,
    tree: &'static str,
    /// By the leaf sizes of the sweep.
    pub sweep: [u32; SIZES.len()],
    /// With its automatic leaf size.
    pub automatic: u32,
}

impl Published {
    /// Of a scene of the source and a tree.
    pub fn of(counterpart: &str, tree: &str) -> Option<&'static Self> {
        PUBLISHED
            .iter()
            .find(|row| row.counterpart == counterpart && row.tree == tree)
    }

    /// Some of these rates over the most of the sweep.
    pub fn reached(&self, rate: u32) -> f64 {
        f64::from(rate) / f64::from(self.sweep.into_iter().fold(1, u32::max))
    }

    /// Its frame times as a sum of our counts: a constant, nodes and kernels per query.
    pub fn frames(&self, works: &[Work], points: usize) -> Fit<3> {
        let rows = self.sweep.iter().zip(works).map(|(rate, work)| {
            let each = |count: u64| count as f64 / points.max(1) as f64;
            ([1.0, each(work.tree.nodes), each(work.tests)], 100.0 / f64::from(*rate))
        });
        non_negative(&rows.collect::<Vec<_>>())
    }
}

const PUBLISHED: [Published; 4] = [
    Published {
        counterpart: "Scene 6",
        tree: BY_VOLUME,
        sweep: [260, 327, 349, 371, 374, 368, 355, 328],
        automatic: 374,
    },
    Published {
        counterpart: "Scene 6",
        tree: LINEAR,
        sweep: [256, 291, 323, 350, 356, 355, 335, 314],
        automatic: 359,
    },
    Published {
        counterpart: "Passage",
        tree: BY_VOLUME,
        sweep: [478, 517, 539, 558, 569, 572, 554, 528],
        automatic: 567,
    },
    Published {
        counterpart: "Passage",
        tree: LINEAR,
        sweep: [446, 473, 495, 519, 528, 521, 501, 452],
        automatic: 522,
    },
];
