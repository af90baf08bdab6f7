//! Scans, reductions, compactions, splits and sorts over random words, each with what it must give.

use clerestory::Result;
use clerestory::gpu::{Access, Buffer, BufferDesc, Category, Gpu, Pass};
use clerestory::kernels::{
    Count, Form, Keep, KeyWidth, Operation, Partition, PartitionBuffers, PartitionOptions, RadixSort, RadixSortOptions,
    ReduceWords, Scan, ScanBuffers, ScanOptions, SortBuffers, compact, reduce_words, scan, split,
};

use crate::random::Random;
use crate::timing::timed;

/// The pass that is timed.
const TIMED: &str = "block";
/// One word in so many begins a segment.
const SEGMENT: u32 = 100;
/// The most words that are sorted by one split a bit: each bit has flags of its own.
const MOST_SPLIT: usize = (1 << 20) + 3;

/// Random words.
pub struct Inputs {
    keys: Vec<u32>,
    /// Every other one is not 0.
    flags: Vec<u32>,
    heads: Vec<u32>,
    key_words: Buffer,
    flag_words: Buffer,
    head_words: Buffer,
}

impl Inputs {
    /// So many of each.
    ///
    /// # Errors
    /// Those of buffers.
    pub fn random(gpu: &Gpu, count: u32) -> Result<Self> {
        let mut random = Random::new(1);
        let mut words = |of: fn(u32) -> u32| -> Vec<u32> { (0..count).map(|_| of(random.word())).collect() };
        let keys = words(|word| word);
        let flags = words(|word| word & 1);
        let heads = words(|word| u32::from(word.is_multiple_of(SEGMENT)));
        Ok(Self {
            key_words: gpu.buffer_with("keys", Category::Work, &keys)?,
            flag_words: gpu.buffer_with("flags", Category::Work, &flags)?,
            head_words: gpu.buffer_with("heads", Category::Work, &heads)?,
            keys,
            flags,
            heads,
        })
    }

    fn count(&self) -> u32 {
        self.keys.len() as u32
    }

    /// A buffer for as many words.
    fn room(&self, gpu: &Gpu, name: &str) -> Result<Buffer> {
        bytes(gpu, name, 4 * self.keys.len() as u64)
    }
}

fn bytes(gpu: &Gpu, name: &str, bytes: u64) -> Result<Buffer> {
    gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
}

type Record = Box<dyn Fn(&mut Pass<'_>) -> Result<()>>;

/// A block over buffers of its own.
pub struct Block {
    /// The row of the catalogue that it is; none for copies.
    pub system: &'static str,
    /// For tables.
    pub name: &'static str,
    record: Record,
    /// What is copied anew to where before each run, since the run writes over it.
    input: Option<[Buffer; 2]>,
    /// What is in which buffer after a run.
    expected: Vec<(Buffer, Vec<u32>)>,
}

const SORT: &str = "radix sort";
const SPLIT_SORT: &str = "sort by one split a bit";

impl Block {
    /// Whether it is the radix sort.
    pub fn is_sort(&self) -> bool {
        self.name == SORT
    }

    /// Whether it is the sort that the radix sort is compared with.
    pub fn is_split_sort(&self) -> bool {
        self.name == SPLIT_SORT
    }

    /// Words of the last run that are not those expected.
    ///
    /// # Errors
    /// Those of reading.
    pub fn wrong(&self, gpu: &Gpu) -> Result<u64> {
        let mut wrong = 0;
        for (buffer, expected) in &self.expected {
            let found: Vec<u32> = gpu.read(buffer.view(), expected.len())?;
            wrong += found.iter().zip(expected).filter(|(a, b)| a != b).count();
        }
        Ok(wrong as u64)
    }
}

/// Seconds of a run, on the device where it tells.
///
/// # Errors
/// Those of recording and of submissions.
pub fn seconds(gpu: &Gpu, block: &Block) -> Result<f64> {
    let mut recorder = gpu.recorder("parallel block")?;
    if let Some([from, to]) = &block.input {
        recorder.pass("input", |pass| {
            pass.copy(from.view(), to.view())?;
            pass.memory_barrier(Access::TRANSFER, Access::COMPUTE);
            Ok(())
        })?;
    }
    recorder.pass(TIMED, |pass| (block.record)(pass))?;
    let (timings, wall) = timed(|| recorder.submit()?.wait());
    let on_device = timings?.seconds_of(TIMED);
    Ok(if on_device > 0.0 { on_device } else { wall })
}

/// All of them, copies first; one split a bit only where its flags have room.
///
/// # Errors
/// Those of kernels and of buffers.
pub fn all(gpu: &Gpu, inputs: &Inputs) -> Result<Vec<Block>> {
    let mut all = vec![of_copies(gpu, inputs)?];
    for (name, is_segmented) in [("scan", false), ("segmented scan", true)] {
        all.push(of_scan(gpu, inputs, name, is_segmented)?);
    }
    all.push(of_reduction(gpu, inputs)?);
    for (name, keep, numbers) in [
        ("compaction", Keep::Flagged, false),
        ("compaction of numbers", Keep::Flagged, true),
        ("split", Keep::Split, false),
        ("split of numbers", Keep::Split, true),
    ] {
        all.push(of_partition(gpu, inputs, name, (keep, numbers))?);
    }
    all.push(of_sort(gpu, inputs)?);
    if inputs.keys.len() <= MOST_SPLIT {
        all.push(of_splits(gpu, inputs)?);
    }
    Ok(all)
}

fn of_copies(gpu: &Gpu, inputs: &Inputs) -> Result<Block> {
    let (from, to) = (inputs.key_words.clone(), inputs.room(gpu, "copy")?);
    Ok(Block {
        system: "none",
        name: "copy",
        expected: vec![(to.clone(), inputs.keys.clone())],
        record: Box::new(move |pass| pass.copy(from.view(), to.view())),
        input: None,
    })
}

fn of_scan(gpu: &Gpu, inputs: &Inputs, name: &'static str, segmented: bool) -> Result<Block> {
    let options = ScanOptions {
        segmented,
        ..ScanOptions::default()
    };
    let kernel = Scan::new(gpu, options)?;
    let count = inputs.count();
    let scratch = bytes(gpu, "scratch", kernel.scratch_bytes(count))?;
    let (input, heads, output) = (
        inputs.key_words.clone(),
        inputs.head_words.clone(),
        inputs.room(gpu, "output")?,
    );
    let starts = segmented.then_some(&inputs.heads[..]);
    let (expected, _) = scan(&inputs.keys, starts, Operation::Sum, false);
    Ok(Block {
        system: "PM-B-1",
        name,
        expected: vec![(output.clone(), expected)],
        record: Box::new(move |pass| {
            let buffers = ScanBuffers {
                input: input.view(),
                heads: segmented.then_some(heads.view()),
                output: output.view(),
            };
            kernel.record(pass, &buffers, Count::Host(count), &scratch)
        }),
        input: None,
    })
}

/// The sum of all words, in 64 bits.
fn of_reduction(gpu: &Gpu, inputs: &Inputs) -> Result<Block> {
    let kernel = ReduceWords::new(gpu, Operation::Sum, Form::default())?;
    let count = inputs.count();
    let scratch = bytes(gpu, "scratch", kernel.scratch_bytes(count))?;
    let (input, result) = (inputs.key_words.clone(), bytes(gpu, "sum", 8)?);
    let sum = reduce_words(&inputs.keys, Operation::Sum);
    // The low word first.
    let expected = vec![sum as u32, (sum >> u32::BITS) as u32];
    Ok(Block {
        system: "PM-B-1",
        name: "reduction",
        expected: vec![(result.clone(), expected)],
        record: Box::new(move |pass| kernel.record(pass, input.view(), result.view(), Count::Host(count), &scratch)),
        input: None,
    })
}

fn of_partition(gpu: &Gpu, inputs: &Inputs, name: &'static str, (keep, numbers): (Keep, bool)) -> Result<Block> {
    let options = PartitionOptions {
        keep,
        numbers,
        ..PartitionOptions::default()
    };
    let kernel = Partition::new(gpu, options)?;
    let count = inputs.count();
    let scratch = bytes(gpu, "scratch", kernel.scratch_bytes(count))?;
    let flagged = bytes(gpu, "flagged", 4)?;
    let (flags, input, output) = (
        inputs.flag_words.clone(),
        inputs.key_words.clone(),
        inputs.room(gpu, "output")?,
    );
    let elements = if numbers {
        (0..count).collect()
    } else {
        inputs.keys.clone()
    };
    let expected = match keep {
        Keep::Flagged => compact(&inputs.flags, &elements),
        Keep::Split => split(&inputs.flags, &elements),
    };
    let expected_flagged = inputs.flags.iter().filter(|flag| **flag != 0).count() as u32;
    Ok(Block {
        system: if keep == Keep::Split { "PM-B-3" } else { "PM-B-2" },
        name,
        expected: vec![(output.clone(), expected), (flagged.clone(), vec![expected_flagged])],
        record: Box::new(move |pass| {
            let buffers = PartitionBuffers {
                flags: flags.view(),
                input: (!numbers).then_some(input.view()),
                output: output.view(),
                flagged: flagged.view(),
            };
            kernel.record(pass, &buffers, Count::Host(count), &scratch)
        }),
        input: None,
    })
}

fn sorted(inputs: &Inputs) -> Vec<u32> {
    let mut keys = inputs.keys.clone();
    keys.sort_unstable();
    keys
}

fn of_sort(gpu: &Gpu, inputs: &Inputs) -> Result<Block> {
    let kernel = RadixSort::new(gpu, RadixSortOptions::new(KeyWidth::Bits32, false))?;
    let count = inputs.count();
    let sides = [kernel.keys("sorted", count)?, kernel.keys("sorted, other side", count)?];
    let scratch = bytes(gpu, "scratch", kernel.scratch_bytes(count))?;
    let result = sides[kernel.result_side(count)].buffer().clone();
    Ok(Block {
        system: "PM-B-4",
        name: SORT,
        input: Some([inputs.key_words.clone(), sides[0].buffer().clone()]),
        expected: vec![(result, sorted(inputs))],
        record: Box::new(move |pass| {
            let buffers = SortBuffers {
                keys: [&sides[0], &sides[1]],
                values: None,
            };
            kernel.record(pass, &buffers, Count::Host(count), &scratch).map(drop)
        }),
    })
}

/// Stable splits by each bit from the lowest up. The flags of each are those of the keys in the order that the splits before have given them.
fn of_splits(gpu: &Gpu, inputs: &Inputs) -> Result<Block> {
    let options = PartitionOptions {
        keep: Keep::Split,
        ..PartitionOptions::default()
    };
    let kernel = Partition::new(gpu, options)?;
    let count = inputs.count();
    let scratch = bytes(gpu, "scratch", kernel.scratch_bytes(count))?;
    let flagged = bytes(gpu, "flagged", 4)?;
    let sides = [
        inputs.room(gpu, "split keys")?,
        inputs.room(gpu, "split keys, other side")?,
    ];
    let mut keys = inputs.keys.clone();
    let mut flags_of_bits = Vec::new();
    for bit in 0..u32::BITS {
        let flags: Vec<u32> = keys.iter().map(|key| key >> bit & 1).collect();
        keys = split(&flags, &keys);
        flags_of_bits.push(gpu.buffer_with("flags of a bit", Category::Work, &flags)?);
    }
    Ok(Block {
        system: "PM-B-4",
        name: SPLIT_SORT,
        input: Some([inputs.key_words.clone(), sides[0].clone()]),
        // As many bits as bring the keys back to the first side.
        expected: vec![(sides[0].clone(), sorted(inputs))],
        record: Box::new(move |pass| {
            for (bit, flags) in flags_of_bits.iter().enumerate() {
                if bit > 0 {
                    pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
                }
                let buffers = PartitionBuffers {
                    flags: flags.view(),
                    input: Some(sides[bit % 2].view()),
                    output: sides[(bit + 1) % 2].view(),
                    flagged: flagged.view(),
                };
                kernel.record(pass, &buffers, Count::Host(count), &scratch)?;
            }
            Ok(())
        }),
    })
}
