//! Counters of 64 bits on devices that add up words.

/// A counter of a kernel's: two words, the low one first, whose carry the kernel adds.
pub fn wide_counter([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << u32::BITS | u64::from(low)
}
