//! A table of random numbers that were drawn beforehand, read in the order of samples and their slots: a yardstick for counter-based numbers.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping" (2011), §5.2.3, whose photons on surfaces read a table of true random numbers.
//! Samples beyond the table's size read it again from its beginning, and where the slots of a sample have no divisor in common with the pairs
//! of the table, a sample comes back after as many samples as there are pairs: from then on, more of them bring nothing new.

use super::random::unit_float;
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};
use glam::DVec2;

/// Random words drawn beforehand, a pair for each slot of a sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RandomTable {
    pairs: Vec<[u32; 2]>,
}

impl RandomTable {
    /// A table of these words; where they come from is the caller's matter.
    ///
    /// # Errors
    /// [`Error::Setting`] without any.
    pub fn new(pairs: Vec<[u32; 2]>) -> Result<Self> {
        if pairs.is_empty() {
            return Err(Error::setting("pairs", 0, "must be 1 at least"));
        }
        Ok(Self { pairs })
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.pairs.as_slice()) as u64
    }

    /// The pair in \[0, 1)² of a slot of a sample, each of which has so many slots.
    pub fn sample_2d(&self, sample_index: u32, slots: u32, slot: u32) -> DVec2 {
        let place = u64::from(sample_index) * u64::from(slots) + u64::from(slot);
        let [x, y] = self.pairs[(place % self.pairs.len() as u64) as usize];
        DVec2::new(unit_float(x), unit_float(y))
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-RANDOM-TABLE",
    name: "table of random numbers",
    role: Role::Yardstick,
    limits: "Needs as many numbers as all samples draw: beyond, samples repeat and errors stop falling.",
    sources: &[sources::FABIANOWSKI_2011.at("§5.2.3")],
    tests: &[
        "engine/src/transport/random_table.rs::slots_are_read_in_order_and_again_from_the_beginning",
        "engine/src/transport/random_table.rs::samples_are_independent_until_the_table_is_used_up",
    ],
    api: &["clerestory::transport::random_table::RandomTable"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use crate::transport::testing::chi_square_test;

    #[test]
    fn slots_are_read_in_order_and_again_from_the_beginning() {
        let table = RandomTable::new((0..5).map(|i| [i << 8, (10 + i) << 8]).collect()).expect("table");
        let read = |sample_index, slot| (table.sample_2d(sample_index, 3, slot) * f64::from(1u32 << 24)).as_uvec2();
        let all: Vec<u32> = (0..4)
            .flat_map(|sample| [0, 1, 2].map(|slot| read(sample, slot).x))
            .collect();
        assert_eq!(all, [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1]);
        assert_eq!((read(1, 0).y, table.bytes()), (13, 40));
        // The last sample that there can be.
        assert_eq!(read(u32::MAX, 2).x, 2);
        assert!(RandomTable::new(Vec::new()).is_err());
    }

    /// Pairs in 8 × 8 cells, by χ² at 10⁻⁵: a table for all samples, and one that they read 64 times.
    #[test]
    fn samples_are_independent_until_the_table_is_used_up() {
        let samples = 1u32 << 14;
        let p = |pairs: usize| {
            let mut random = Random(5);
            let words = (0..pairs).map(|_| [random.word(), random.word()]).collect();
            let table = RandomTable::new(words).expect("table");
            let mut counts = [0.0; 64];
            for sample in 0..samples {
                let cell = (table.sample_2d(sample, 3, 1) * 8.0).as_uvec2();
                counts[(8 * cell.y + cell.x) as usize] += 1.0;
            }
            chi_square_test(&counts, &[f64::from(samples) / 64.0; 64])
        };
        let (whole, short) = (p(3 << 14), p(1 << 8));
        assert!(whole > 1e-5, "{whole}");
        assert!(short < 1e-5, "{short}");
    }
}
