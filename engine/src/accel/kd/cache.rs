//! Caches of kd-trees that kernels manage themselves: nodes in shared memory, entries of the stack in registers, a leaf that waits.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §4.3. They change where nodes and entries come from,
//! and, with a leaf that waits, how much is visited; never a hit.

use crate::accel::input::check_range;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::{Error, Result};

/// Most levels of nodes in shared memory, which are as many as trees keep as a heap.
pub const MAX_CACHED_LEVELS: u32 = constants::KD_HEAP_LEVELS;

/// Most of them where entries of the stack are bytes that name nodes.
pub const MAX_BYTE_LEVELS: u32 = constants::KD_BYTE_LEVELS;

/// Which entries of the stack are in registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StackCache {
    /// None.
    #[default]
    None,
    /// The last one ("stack cache I").
    Head,
    /// Those of cached nodes, each a byte, eight in two words ("stack cache II"); ends of their spans come from boxes beside the nodes
    /// ("node cache II").
    Bytes,
}

/// Which caches a traversal by a stack uses; none by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KdCaches {
    /// Levels of the tree in shared memory ("node cache I"): 0 for none, at most [`MAX_CACHED_LEVELS`], and 1..=[`MAX_BYTE_LEVELS`] with
    /// [`StackCache::Bytes`].
    pub node_levels: u32,
    /// Entries of the stack in registers.
    pub stack: StackCache,
    /// Whether the first of two leaves waits until the second is found, so that both are tested together ("stack cache III").
    pub postpone: bool,
    /// Whether leaves wait until each lane of a subgroup holds one, which the subgroup votes on; lanes that hold one go on behind it
    /// meanwhile ("speculation"). What a ray visits then depends on its neighbours. The twin is a subgroup of one ray, in which no leaf
    /// waits. Not with [`KdCaches::postpone`]; needs subgroup votes.
    pub vote: bool,
}

impl KdCaches {
    /// The forms that the source compares, in the order of its tables: none; nodes; the last entry; a leaf that waits; nodes and the last
    /// entry, the best of them; nodes with boxes and bytes; nodes and a leaf that waits.
    pub const COMPARED: [Self; 7] = {
        let none = Self {
            node_levels: 0,
            stack: StackCache::None,
            postpone: false,
            vote: false,
        };
        let nodes = Self {
            node_levels: MAX_CACHED_LEVELS,
            ..none
        };
        [
            none,
            nodes,
            Self {
                stack: StackCache::Head,
                ..none
            },
            Self { postpone: true, ..none },
            Self {
                stack: StackCache::Head,
                ..nodes
            },
            Self {
                node_levels: MAX_BYTE_LEVELS,
                stack: StackCache::Bytes,
                ..none
            },
            Self {
                postpone: true,
                ..nodes
            },
        ]
    };

    /// Speculation by a vote, without other caches: what the source describes and does not measure, so that it is not among
    /// [`KdCaches::COMPARED`], whose work is exact.
    pub const SPECULATION: Self = Self {
        vote: true,
        ..Self::COMPARED[0]
    };

    /// Nodes whose index is below this are in shared memory.
    pub(super) fn cached_nodes(&self) -> u32 {
        match self.node_levels {
            0 => 0,
            levels => 1 << levels,
        }
    }

    /// What kernels are specialized by.
    pub(in crate::accel) fn stack_specialization(&self) -> u32 {
        match self.stack {
            StackCache::None => constants::KD_STACK_CACHE_NONE,
            StackCache::Head => constants::KD_STACK_CACHE_HEAD,
            StackCache::Bytes => constants::KD_STACK_CACHE_BYTES,
        }
    }

    /// # Errors
    /// [`Error::Setting`] for too many levels, or none for bytes to name, or leaves that wait in two ways.
    pub(in crate::accel) fn check(&self) -> Result<()> {
        if self.postpone && self.vote {
            return Err(Error::setting("kd.vote", self.vote, "does not go with `postpone`"));
        }
        match self.stack {
            StackCache::Bytes => check_range("kd.node_levels", self.node_levels, 1, MAX_BYTE_LEVELS),
            _ => check_range("kd.node_levels", self.node_levels, 0, MAX_CACHED_LEVELS),
        }
    }

    /// # Errors
    /// [`Error::Setting`] where there are caches.
    pub(in crate::accel) fn check_absent(&self, because: &str) -> Result<()> {
        if *self == Self::default() {
            return Ok(());
        }
        Err(Error::setting("kd.caches", format!("{self:?}"), because))
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-CA-1",
        name: "kd node cache I: the top of the tree in shared memory",
        role: Role::PartOf("PM-X-2"),
        limits: "Only persistent threads that traverse kd-trees by a stack have it, and for the top 10 levels at most (8 KiB).",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "engine/src/accel/kd/tests.rs::bytes_are_eight_for_each_node_and_entry_that_memory_serves",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
            "tests/tests/accel/kd.rs::caches_hold_the_top_of_the_tree_and_are_what_is_read",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-2",
        name: "kd node cache II: the top of the tree in shared memory, with boxes",
        role: Role::PartOf("PM-X-2"),
        limits: "Exists only with stack cache II, whose entries it gives their ends, and for the top 8 levels at most (8 KiB).",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
            "tests/tests/accel/kd.rs::caches_hold_the_top_of_the_tree_and_are_what_is_read",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-3",
        name: "kd stack cache I: the last entry in registers",
        role: Role::PartOf("PM-X-2"),
        limits: "Only persistent threads that traverse kd-trees by a stack have it, for one entry.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-4",
        name: "kd stack cache II: entries as bytes in registers",
        role: Role::PartOf("PM-X-2"),
        limits: "Eight entries at most, which name cached nodes only: needs node cache II.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-5",
        name: "kd stack cache III: a leaf that waits",
        role: Role::PartOf("PM-X-2"),
        limits: "Visits leaves that a hit would have spared.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "engine/src/accel/kd/tests.rs::a_leaf_that_waits_lets_its_ray_go_on_to_the_next",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-6",
        name: "speculation: rays with a leaf that waits go on until all of their subgroup have one",
        role: Role::PartOf("PM-X-2"),
        limits: "What a ray visits depends on its neighbours; needs subgroup votes.",
        sources: &[
            sources::AILA_LAINE_2009.whole(),
            sources::FABIANOWSKI_2011.at("§4.3.2.3"),
        ],
        shaders: &["shaders/accel/trace_queue_vote.comp"],
        tests: &[
            "tests/tests/accel/kd.rs::votes_change_no_hit",
            "tests/tests/accel/kd.rs::rays_that_hold_a_leaf_go_on_while_others_of_their_subgroup_have_none",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-CA-7",
        name: "kd caches of nodes and of the last entry together",
        role: Role::PartOf("PM-X-2"),
        limits: "As its two caches.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3")],
        shaders: &["shaders/accel/kd_cache.glsl"],
        tests: &[
            "engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit",
            "tests/tests/accel/kd.rs::caches_are_those_of_the_twin_and_change_no_hit",
            "tests/tests/accel/kd.rs::caches_hold_the_top_of_the_tree_and_are_what_is_read",
        ],
        api: &["clerestory::accel::kd::KdCaches", "clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
];
