//! Far children that a traversal has left: a stack, or a ring that forgets the oldest, some of them in registers.

use super::MAX_DEPTH;
use super::cache::{KdCaches, StackCache};
use super::counters::KdCounters;

/// A byte of a register, and of how many there are room for in one.
const BYTE_BITS: u32 = 8;
const HAS_ROOM_BELOW: u32 = 1 << (u32::BITS - BYTE_BITS);

/// A subtree to go on with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Entry {
    pub node: u32,
    /// Axis of the plane above it.
    pub axis: usize,
    /// End of its span.
    pub leave: f32,
}

/// Those that are left.
pub struct Entries {
    entries: [Entry; MAX_DEPTH as usize],
    capacity: usize,
    top: usize,
    size: usize,
    caches: KdCaches,
    head: Option<Entry>,
    /// Nodes, four per word, the older word first.
    bytes: [u32; 2],
}

impl Entries {
    pub fn new(capacity: usize, caches: KdCaches) -> Self {
        Self {
            entries: [Entry::default(); MAX_DEPTH as usize],
            capacity,
            top: 0,
            size: 0,
            caches,
            head: None,
            bytes: [0; 2],
        }
    }

    pub fn push(&mut self, entry: Entry, counters: &mut KdCounters) {
        let mut to_stack = Some(entry);
        if self.caches.stack == StackCache::Head {
            counters.register_pushes += 1;
            to_stack = self.head.replace(entry);
        } else if self.caches.stack == StackCache::Bytes && entry.node < self.caches.cached_nodes() {
            counters.register_pushes += 1;
            let word = usize::from(self.bytes[0] >= HAS_ROOM_BELOW);
            self.bytes[word] = self.bytes[word] << BYTE_BITS | entry.node;
            to_stack = None;
        }
        if let Some(entry) = to_stack
            && self.capacity > 0
        {
            counters.pushes += 1;
            self.entries[self.top % self.capacity] = entry;
            self.top += 1;
            self.size = (self.size + 1).min(self.capacity);
        }
    }

    pub fn is_empty(&self) -> bool {
        self.size == 0 && self.head.is_none() && self.bytes == [0; 2]
    }

    /// The last one; `of_node` is the entry of a cached node.
    pub fn pop(&mut self, counters: &mut KdCounters, of_node: impl Fn(u32) -> Entry) -> Option<Entry> {
        if let Some(entry) = self.head.take() {
            counters.register_pops += 1;
            return Some(entry);
        }
        if self.size > 0 {
            counters.pops += 1;
            self.size -= 1;
            self.top -= 1;
            return Some(self.entries[self.top % self.capacity]);
        }
        let word = self.bytes.iter_mut().rev().find(|word| **word != 0)?;
        counters.register_pops += 1;
        let node = *word & ((1 << BYTE_BITS) - 1);
        *word >>= BYTE_BITS;
        Some(of_node(node))
    }
}
