//! Where a quota has stopped a query, all records are gone through: in what parts.

use crate::gpu::shaders::constants::WALK_GROUP;
use crate::walk::StoppedPlaces;

/// Records that a submission takes at all of its places, where no hierarchy helps: a fraction of a second on devices that a driver watches.
pub(super) const LINEAR_RECORDS: u64 = 1 << 28;

/// How a pass through all records is cut: some records at a time, which says in what order sums are formed, each of them for some places at a
/// time, which nothing depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearParts {
    quota: u32,
    count: u32,
    stopped: StoppedPlaces,
    /// Places of a part: whole workgroups.
    pub places: u32,
}

impl LinearParts {
    /// Of `count` records, `quota` at a time.
    pub fn new(quota: u32, count: u32, stopped: StoppedPlaces) -> Self {
        let most = (LINEAR_RECORDS / u64::from(quota)).min(u64::from(u32::MAX / 2)) as u32;
        let places = if stopped.stopped <= most { stopped.places } else { most };
        Self {
            quota,
            count,
            stopped,
            places: places.max(1).next_multiple_of(WALK_GROUP),
        }
    }

    /// Parts for the same records.
    fn ranges(&self) -> u64 {
        u64::from(self.stopped.places.div_ceil(self.places))
    }

    pub fn count(&self) -> u64 {
        self.ranges() * u64::from(self.count.div_ceil(self.quota))
    }

    /// Records that a part takes, at most.
    pub fn cost(&self) -> u64 {
        u64::from(self.quota) * u64::from(self.stopped.stopped.min(self.places))
    }

    pub fn first_place(&self, part: u64) -> u32 {
        (part % self.ranges()) as u32 * self.places
    }

    /// The first record and the one past the last.
    pub fn records(&self, part: u64) -> [u32; 2] {
        let first = (part / self.ranges()) as u32 * self.quota;
        [first, first.saturating_add(self.quota).min(self.count)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::WalkKey;

    #[test]
    fn linear_parts_take_every_record_at_every_place_once_in_order() {
        for (quota, count, places, stopped) in [
            (1, 5, 1, 1),
            (64, 6000, 256, 3),
            (32_768, 40_000, 100_000, 100_000),
            (32_768, 1 << 16, 100_000, 7),
            (32_768, 32_768, 8192, 8192),
            (3, 10, 65, 65),
        ] {
            let key = WalkKey::default();
            let parts = LinearParts::new(quota, count, StoppedPlaces { places, stopped, key });
            // Records that the places of each range have gone through.
            let mut done = std::collections::BTreeMap::new();
            for part in 0..parts.count() {
                let [first, last] = parts.records(part);
                assert!(last > first && last - first <= quota, "{parts:?}");
                let before = done.insert(parts.first_place(part), last);
                assert_eq!(before.unwrap_or(0), first, "{parts:?}");
            }
            assert!(done.values().all(|last| *last == count), "{parts:?}");
            let firsts: Vec<u32> = done.into_keys().collect();
            let expected: Vec<u32> = (0..places).step_by(parts.places as usize).collect();
            assert_eq!(firsts, expected, "{parts:?}");
            assert!(
                parts.places.is_multiple_of(WALK_GROUP) && parts.cost() <= LINEAR_RECORDS,
                "{parts:?}"
            );
        }
    }
}
