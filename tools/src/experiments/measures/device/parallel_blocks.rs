//! Scans, reductions, compactions, splits and sorts on the device, beside copies of as many words: results against the twins, times by the number of
//! words.
//!
//! Source of what is measured: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §2.2.4, whose radix
//! sort is compared with one split a bit (G. E. Blelloch, "Prefix sums and their applications", 1990, §1.3.1).

use clerestory::Result;

use super::blocks::{Block, Inputs, all, seconds};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;

/// Numbers of words, the last but one no multiple of any tile.
const SIZES: &[u32] = &[1 << 14, 1 << 17, 1 << 20, (1 << 20) + 3, 1 << 22];
const SMOKE_SIZES: &[u32] = &[1000, 4099];
/// From here on times must be linear.
const LINEAR_FROM: u64 = 1 << 17;
const TURNS: usize = 9;
/// Of the headline.
const SIZE: u64 = 1 << 20;

rows! {
    /// A block on so many words.
    struct Row = "Blocks by number of words" by [system, block, words] {
        system: String = "row of the catalogue",
        block: String = "block",
        words: u64 = "words",
        wrong: u64 = "words that differ from the twin's",
        time: Repeats = "time (ms)",
        rate: Repeats = "M words/s",
        over_copy: Repeats = "time over that of copying as many words",
        over_sort: Option<Repeats> = "time over that of the radix sort",
    }
}

rows! {
    /// How a block's time grows.
    struct Growth = "Growth of times with the number of words" by [system, block] {
        system: String = "row of the catalogue",
        block: String = "block",
        exponent: Repeats = "exponent from 2¹⁷ words to the most",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "results are those of the twins: words that differ",
        Bound::AtMost(0.0),
        |row: &Row| row.wrong.into(),
    )
    .in_every_form(),
    Criterion::each(
        "a radix sort is faster than one split a bit: time of the splits over its",
        Bound::AtLeast(1.0),
        |row: &Row| row.over_sort.as_ref().map_or(f64::NAN.into(), Repeats::measured),
    )
    .among(|row| row.over_sort.is_some()),
];

const OF_GROWTH: &[Criterion<Growth>] = &[Criterion::each(
    "time is linear in the number of words above 10⁵: exponent",
    Bound::AtMost(1.05),
    |growth: &Growth| (&growth.exponent).into(),
)
.because("n log n has 1.07 over this range")];

impl Growth {
    /// Of each block, from [`LINEAR_FROM`] to the most words that it has.
    fn all(rows: &[Row]) -> Vec<Self> {
        let first = rows.iter().filter(|row| row.words == LINEAR_FROM);
        let growth = |first: &Row| {
            let same = rows.iter().filter(|row| row.block == first.block);
            let last = same.max_by_key(|row| row.words)?;
            let factor = (last.words as f64 / first.words as f64).ln();
            let ratios = last.time.over(&first.time);
            let exponent = ratios.0.iter().map(|ratio| ratio.ln() / factor);
            (last.words > first.words).then(|| Self {
                system: first.system.clone(),
                block: first.block.clone(),
                exponent: exponent.collect(),
            })
        };
        first.filter_map(growth).collect()
    }
}

impl Row {
    /// All blocks on so many words; the first copies them.
    fn of_words(context: &Context<'_>, gpu: &clerestory::gpu::Gpu, words: u32) -> Result<Vec<Self>> {
        let inputs = Inputs::random(gpu, words)?;
        let blocks = all(gpu, &inputs)?;
        let times = context.in_turns(TURNS, blocks.len(), |i| Ok(1e3 * seconds(gpu, &blocks[i])?))?;
        let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
        let sort = blocks.iter().position(Block::is_sort);
        let row = |(block, time): (&Block, &Repeats)| {
            let rate = |ms: &f64| 1e-3 * f64::from(words) / ms;
            Ok(Self {
                system: block.system.into(),
                block: block.name.into(),
                words: words.into(),
                wrong: block.wrong(gpu)?,
                rate: time.0.iter().map(rate).collect(),
                over_copy: time.over(&times[0]),
                over_sort: sort
                    .filter(|_| block.is_split_sort())
                    .map(|sort| time.over(&times[sort])),
                time: time.clone(),
            })
        };
        blocks.iter().zip(&times).map(row).collect()
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let sizes = context.pick(SIZES, SMOKE_SIZES);
        context.each(sizes, u32::to_string, |words| Row::of_words(context, &gpu, *words))
    }

    fn findings(&self) -> Findings {
        let scan = self.iter().find(|row| row.system == "PM-B-1" && row.words == SIZE);
        let times = curves(
            self,
            |row| row.block.clone(),
            |row| (row.words as f64, row.time.measured()),
        );
        Findings::of(self, CRITERIA)
            .headline(
                "a scan of 2²⁰ words over a copy of them, times",
                scan.map(|row| row.over_copy.measured()),
            )
            .curves(
                "times",
                "Blocks by number of words",
                Axes::rates("words", "time (ms)"),
                times,
            )
            .note(
                "Random words, half of them flagged; segments of about a hundred. Times are the device's, of the block alone, in turns; the copy \
                 is the device's command over as many words. Sorts are of 32-bit keys. One split a bit takes 32 splits; their flags were made \
                 beforehand, so that its time is a lower bound, and up to 2²⁰ + 3 words alone, since each bit has flags of its own.",
            )
            .and(Findings::of(&Growth::all(self), OF_GROWTH))
            .note("1 is linear, less where fixed costs weigh.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_of_the_times_above_the_first() {
        let row = |words, ms| Row {
            block: "scan".into(),
            words,
            time: Repeats(vec![ms; 5]),
            ..Row::default()
        };
        let exponent = |rows: &[Row]| Growth::all(rows).first().map(|growth| growth.exponent.0[0]);
        let rows = [row(1 << 14, 9.0), row(1 << 17, 1.0), row(1 << 19, 16.0)];
        assert_eq!(exponent(&rows), Some(2.0));
        assert_eq!(exponent(&rows[..2]), None);
    }
}
