//! Scans, partitions, reductions, histograms and permutations against their twins.

use clerestory::Error;
use clerestory::gpu::{Buffer, Gpu, transfer_to_compute};
use clerestory::kernels::{
    BoxElements, Count, Direction, Form, Histogram, Keep, MAX_BINS, Operation, Partition, PartitionBuffers,
    PartitionOptions, Permute, PermuteBuffers, ReduceBox, ReduceWords, Scan, ScanBuffers, ScanOptions, StreamStatus,
    compact, gather, histogram, ordered_float, reduce_box, reduce_words, scan, scatter, split,
};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;

use super::{FORMS, PATTERNS, Pattern, SIZES, empty, read, run, words};

/// Every other time the count is read from a buffer.
fn counted(counts: &Buffer, count: u32, turn: usize) -> Count<'_> {
    counted_of(counts, count, count, turn)
}

/// The same where the buffers hold more.
fn counted_of(counts: &Buffer, count: u32, capacity: u32, turn: usize) -> Count<'_> {
    if turn.is_multiple_of(2) {
        Count::Host(count)
    } else {
        Count::Device {
            view: counts.view(),
            capacity,
        }
    }
}

/// Words that are not 0 now and then, the first word or not.
fn flags(random: &mut Random, count: u32, one_in: usize) -> Vec<u32> {
    (0..count)
        .map(|_| {
            if random.below(one_in) == 0 {
                1 + random.word() / 2
            } else {
                0
            }
        })
        .collect()
}

fn check_scan(gpu: &Gpu, options: ScanOptions, random: &mut Random) {
    let kernel = Scan::new(gpu, options).unwrap();
    for (turn, size) in SIZES.into_iter().enumerate() {
        let capacity = size + [1, 300, 5_000, 100_000][turn % 4];
        let values = random.choose(&PATTERNS).words(random, capacity);
        let heads = flags(random, capacity, [2, 40, 5000][turn % 3]);
        let input = words(gpu, "input", &values);
        let head_words = words(gpu, "heads", &heads);
        let output = words(gpu, "output", &values);
        let scratch = empty(gpu, "scratch", kernel.scratch_bytes(capacity));
        let counts = words(gpu, "count", &[size]);
        // Every third time in place.
        let target = if turn % 3 == 2 { &input } else { &output };
        let buffers = ScanBuffers {
            input: input.view(),
            heads: options.segmented.then_some(head_words.view()),
            output: target.view(),
        };
        run(gpu, |pass| {
            kernel.record(pass, &buffers, counted_of(&counts, size, capacity, turn), &scratch)
        });
        let (within, beyond) = values.split_at(size as usize);
        let heads = options.segmented.then_some(&heads[..size as usize]);
        let (expected, total) = scan(within, heads, options.operation, options.inclusive);
        let found = read(gpu, target, capacity as usize);
        assert!(found[..size as usize] == expected, "{size}: {options:?}");
        assert!(found[size as usize..] == *beyond, "written beyond {size}: {options:?}");
        assert_eq!(
            gpu.read::<u32>(kernel.total(&scratch), 1).unwrap(),
            [total],
            "{size}: {options:?}"
        );
    }
}

#[test]
fn scans_are_as_their_twin() {
    with_gpu(|gpu| {
        let mut random = Random(51);
        for form in FORMS {
            for (operation, inclusive, segmented) in [
                (Operation::Sum, false, false),
                (Operation::Sum, true, true),
                (Operation::Min, false, true),
                (Operation::Max, true, false),
            ] {
                let options = ScanOptions {
                    operation,
                    inclusive,
                    segmented,
                    form,
                };
                check_scan(gpu, options, &mut random);
            }
        }
    });
}

#[test]
fn partitions_are_as_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(52);
        for form in FORMS {
            for (keep, numbers) in [
                (Keep::Flagged, false),
                (Keep::Flagged, true),
                (Keep::Split, false),
                (Keep::Split, true),
            ] {
                let options = PartitionOptions { keep, numbers, form };
                let kernel = Partition::new(gpu, options).unwrap();
                for (turn, size) in SIZES.into_iter().enumerate() {
                    // All, half, and few.
                    let flags = flags(&mut random, size, [1, 2, 500][turn % 3]);
                    let elements = if numbers {
                        (0..size).collect()
                    } else {
                        Pattern::Random.words(&mut random, size)
                    };
                    let buffers = [words(gpu, "flags", &flags), words(gpu, "elements", &elements)];
                    let untouched = 0xABCD_EF01;
                    let output = words(gpu, "output", &vec![untouched; size as usize]);
                    let flagged = empty(gpu, "flagged", 4);
                    let scratch = empty(gpu, "scratch", kernel.scratch_bytes(size));
                    let counts = words(gpu, "count", &[size]);
                    let bound = PartitionBuffers {
                        flags: buffers[0].view(),
                        input: (!numbers).then_some(buffers[1].view()),
                        output: output.view(),
                        flagged: flagged.view(),
                    };
                    run(gpu, |pass| {
                        kernel.record(pass, &bound, counted(&counts, size, turn), &scratch)
                    });
                    let count = compact(&flags, &elements).len();
                    let mut expected = match keep {
                        Keep::Flagged => compact(&flags, &elements),
                        Keep::Split => split(&flags, &elements),
                    };
                    expected.resize(size as usize, untouched);
                    assert!(read(gpu, &output, size as usize) == expected, "{size}: {options:?}");
                    assert_eq!(read(gpu, &flagged, 1), [count as u32]);
                }
            }
        }
    });
}

/// What the split is for: one a bit, from the lowest up, is a sort.
#[test]
fn splits_by_bits_sort() {
    with_gpu(|gpu| {
        const COUNT: u32 = 4099;
        let keys = Pattern::Random.words(&mut Random(53), COUNT);
        let mut expected = keys.clone();
        expected.sort();
        for form in FORMS {
            let options = PartitionOptions {
                keep: Keep::Split,
                numbers: false,
                form,
            };
            let kernel = Partition::new(gpu, options).unwrap();
            let sides = [words(gpu, "keys", &keys), words(gpu, "other keys", &keys)];
            let flagged = empty(gpu, "flagged", 4);
            let scratch = empty(gpu, "scratch", kernel.scratch_bytes(COUNT));
            for bit in 0..u32::BITS {
                let (from, to) = (&sides[bit as usize % 2], &sides[(bit as usize + 1) % 2]);
                let of_bit: Vec<u32> = read(gpu, from, COUNT as usize)
                    .iter()
                    .map(|key| key >> bit & 1)
                    .collect();
                let flags = words(gpu, "flags", &of_bit);
                let bound = PartitionBuffers {
                    flags: flags.view(),
                    input: Some(from.view()),
                    output: to.view(),
                    flagged: flagged.view(),
                };
                run(gpu, |pass| kernel.record(pass, &bound, Count::Host(COUNT), &scratch));
            }
            assert!(read(gpu, &sides[0], COUNT as usize) == expected, "{form:?}");
        }
    });
}

/// A scan by sums.
fn sums(gpu: &Gpu, form: Form) -> Scan {
    let options = ScanOptions {
        form,
        ..ScanOptions::default()
    };
    Scan::new(gpu, options).unwrap()
}

/// Many blocks, the last of three elements.
#[test]
fn a_million_words_and_three_are_as_by_the_twins() {
    with_gpu(|gpu| {
        const COUNT: u32 = (1 << 20) + 3;
        let mut random = Random(58);
        let values = Pattern::Random.words(&mut random, COUNT);
        let flags = flags(&mut random, COUNT, 2);
        let (prefixes, total) = scan(&values, None, Operation::Sum, false);
        let parted = split(&flags, &values);
        let [input, flag_words] = [words(gpu, "input", &values), words(gpu, "flags", &flags)];
        for form in FORMS {
            let output = words(gpu, "output", &values);
            let kernel = sums(gpu, form);
            let scratch = empty(gpu, "scratch", kernel.scratch_bytes(COUNT));
            let buffers = ScanBuffers {
                input: input.view(),
                heads: None,
                output: output.view(),
            };
            run(gpu, |pass| kernel.record(pass, &buffers, Count::Host(COUNT), &scratch));
            assert!(read(gpu, &output, COUNT as usize) == prefixes, "{form:?}");
            assert_eq!(gpu.read::<u32>(kernel.total(&scratch), 1).unwrap(), [total]);
            let keep = Keep::Split;
            let numbers = false;
            let kernel = Partition::new(gpu, PartitionOptions { keep, numbers, form }).unwrap();
            let scratch = empty(gpu, "scratch", kernel.scratch_bytes(COUNT));
            let flagged = empty(gpu, "flagged", 4);
            let bound = PartitionBuffers {
                flags: flag_words.view(),
                input: Some(input.view()),
                output: output.view(),
                flagged: flagged.view(),
            };
            run(gpu, |pass| kernel.record(pass, &bound, Count::Host(COUNT), &scratch));
            assert!(read(gpu, &output, COUNT as usize) == parted, "{form:?}");
        }
    });
}

#[test]
fn more_elements_than_the_capacity_are_reported_and_left() {
    with_gpu(|gpu| {
        const CAPACITY: u32 = 100;
        let untouched = vec![0xABCD_EF01; CAPACITY as usize];
        let [ones, output] = [vec![1; CAPACITY as usize], untouched.clone()].map(|data| words(gpu, "words", &data));
        let counts = words(gpu, "count", &[CAPACITY + 1]);
        let count = Count::Device {
            view: counts.view(),
            capacity: CAPACITY,
        };
        for form in FORMS {
            let kernel = sums(gpu, form);
            let of_scan = empty(gpu, "scratch", kernel.scratch_bytes(CAPACITY));
            let buffers = ScanBuffers {
                input: ones.view(),
                heads: None,
                output: output.view(),
            };
            run(gpu, |pass| kernel.record(pass, &buffers, count, &of_scan));
            assert_eq!(gpu.read::<u32>(kernel.total(&of_scan), 1).unwrap(), [0], "{form:?}");
            for keep in [Keep::Flagged, Keep::Split] {
                let numbers = true;
                let kernel = Partition::new(gpu, PartitionOptions { keep, numbers, form }).unwrap();
                let of_partition = empty(gpu, "scratch", kernel.scratch_bytes(CAPACITY));
                let flagged = words(gpu, "flagged", &[7]);
                let bound = PartitionBuffers {
                    flags: ones.view(),
                    input: None,
                    output: output.view(),
                    flagged: flagged.view(),
                };
                run(gpu, |pass| kernel.record(pass, &bound, count, &of_partition));
                assert_eq!(read(gpu, &flagged, 1), [0], "{form:?}");
                for scratch in [&of_scan, &of_partition] {
                    let status = StreamStatus::read(gpu, scratch).unwrap();
                    assert_eq!((status.count, status.wanted), (0, CAPACITY + 1), "{form:?}");
                    assert!(status.check("block", CAPACITY).is_err());
                }
            }
            assert!(read(gpu, &output, CAPACITY as usize) == untouched, "{form:?}");
        }
    });
}

#[test]
fn reductions_of_words_are_as_their_twin() {
    with_gpu(|gpu| {
        let mut random = Random(54);
        for form in FORMS {
            for operation in [Operation::Sum, Operation::Min, Operation::Max] {
                let kernel = ReduceWords::new(gpu, operation, form).unwrap();
                for (turn, size) in SIZES.into_iter().enumerate() {
                    let values = random.choose(&PATTERNS).words(&mut random, size);
                    let input = words(gpu, "input", &values);
                    let result = empty(gpu, "result", 8);
                    let scratch = empty(gpu, "scratch", kernel.scratch_bytes(size));
                    let counts = words(gpu, "count", &[size]);
                    run(gpu, |pass| {
                        kernel.record(
                            pass,
                            input.view(),
                            result.view(),
                            counted(&counts, size, turn),
                            &scratch,
                        )
                    });
                    let expected = reduce_words(&values, operation);
                    assert_eq!(
                        gpu.read::<u64>(result.view(), 1).unwrap(),
                        [expected],
                        "{size}: {operation:?}"
                    );
                }
            }
        }
    });
}

fn corners(bits: &[u32]) -> [f32; 3] {
    [0, 1, 2].map(|axis| f32::from_bits(bits[axis]))
}

#[test]
fn boxes_are_exact_and_leave_nans_out() {
    with_gpu(|gpu| {
        let mut random = Random(55);
        for form in FORMS {
            let wide = BoxElements { stride: 8, upper: 4 };
            for elements in [BoxElements::POINTS, BoxElements::BOXES, wide] {
                let kernel = ReduceBox::new(gpu, elements, form).unwrap();
                for (turn, size) in SIZES.into_iter().enumerate() {
                    let pattern = [Pattern::Floats, Pattern::Random][turn % 2];
                    let data = pattern.words(&mut random, size * elements.stride);
                    let input = words(gpu, "input", &data);
                    let result = empty(gpu, "result", 24);
                    let scratch = empty(gpu, "scratch", kernel.scratch_bytes(size));
                    let counts = words(gpu, "count", &[size]);
                    run(gpu, |pass| {
                        kernel.record(
                            pass,
                            input.view(),
                            result.view(),
                            counted(&counts, size, turn / 2),
                            &scratch,
                        )
                    });
                    let of_data = data.chunks_exact(elements.stride as usize);
                    let expected = reduce_box(of_data.map(|e| [corners(e), corners(&e[elements.upper as usize..])]));
                    let bits = expected.as_flattened().iter().map(|value| value.to_bits());
                    assert!(bits.eq(read(gpu, &result, 6)), "{size}: {elements:?} {expected:?}");
                }
            }
        }
    });
}

#[test]
fn empty_boxes_and_nan_boxes_are_empty() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let empty = [[inf; 3], [-inf; 3]];
    assert_eq!(reduce_box([]), empty);
    assert_eq!(reduce_box([[[nan; 3]; 2], [[-nan; 3]; 2]]), empty);
    let point = [nan, -0.0, 2.0];
    let other = [1.0, 0.0, -inf];
    let expected = [[1.0, -0.0, -inf], [1.0, 0.0, 2.0]];
    let found = reduce_box([[point; 2], [other; 2]]);
    assert_eq!(
        found.map(|c| c.map(f32::to_bits)),
        expected.map(|c: [f32; 3]| c.map(f32::to_bits))
    );
    // The order of floats is that of their integers.
    let floats = [-inf, -1.5, -1e-45, -0.0, 0.0, 1e-45, 2.0, inf];
    assert!(floats.map(|f| ordered_float(f.to_bits())).is_sorted());
}

#[test]
fn histograms_are_as_their_twin() {
    with_gpu(|gpu| {
        let mut random = Random(56);
        for (bins, bits) in [(1, 0..1), (256, 8..16), (1000, 3..17), (MAX_BINS, 0..32)] {
            let kernel = Histogram::new(gpu, bins, bits.clone()).unwrap();
            for (turn, size) in SIZES.into_iter().enumerate() {
                let mut values = random.choose(&PATTERNS).words(&mut random, size);
                values.iter_mut().step_by(2).for_each(|value| *value &= 0xFFF);
                let input = words(gpu, "input", &values);
                let counts = empty(gpu, "counts", 4 * u64::from(kernel.count_words()));
                let scratch = empty(gpu, "scratch", kernel.scratch_bytes());
                let sizes = words(gpu, "count", &[size]);
                run(gpu, |pass| {
                    pass.fill(counts.view(), 0)?;
                    pass.barrier(&[transfer_to_compute(&counts)]);
                    kernel.record(pass, input.view(), counts.view(), counted(&sizes, size, turn), &scratch)
                });
                let expected = histogram(&values, bins, bits.clone());
                assert_eq!(expected.iter().sum::<u32>(), size);
                assert!(
                    read(gpu, &counts, bins as usize + 1) == expected,
                    "{size}: {bins} {bits:?}"
                );
            }
        }
        assert!(matches!(Histogram::new(gpu, 4097, 0..32), Err(Error::Setting { .. })));
        assert!(matches!(Histogram::new(gpu, 1, 4..4), Err(Error::Setting { .. })));
    });
}

#[test]
fn gathers_and_scatters_are_as_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(57);
        for element in [1, 3] {
            let kernels = [Direction::Gather, Direction::Scatter].map(|d| Permute::new(gpu, d, element).unwrap());
            for (turn, size) in SIZES.into_iter().enumerate() {
                // A permutation, some of whose indices are out of range.
                let mut indices: Vec<u32> = (0..size).collect();
                for i in (1..indices.len()).rev() {
                    indices.swap(i, random.below(i + 1));
                }
                if size > 4 {
                    indices[3] = size;
                    indices[1] = u32::MAX;
                }
                let data = Pattern::Random.words(&mut random, size * element);
                let before = vec![0x5555_5555; data.len()];
                for (direction, kernel) in kernels.iter().enumerate() {
                    let index_words = words(gpu, "indices", &indices);
                    let input = words(gpu, "input", &data);
                    let output = words(gpu, "output", &before);
                    let faults = words(gpu, "faults", &[0]);
                    let scratch = empty(gpu, "scratch", kernel.scratch_bytes());
                    let counts = words(gpu, "count", &[size]);
                    let buffers = PermuteBuffers {
                        indices: index_words.view(),
                        input: input.view(),
                        output: output.view(),
                        faults: faults.view(),
                        places: size,
                    };
                    run(gpu, |pass| {
                        kernel.record(pass, &buffers, counted(&counts, size, turn), &scratch)
                    });
                    let (expected, missed) = if direction == 0 {
                        gather(&indices, &data, element as usize)
                    } else {
                        let mut output = before.clone();
                        let missed = scatter(&indices, &data, element as usize, &mut output);
                        (output, missed)
                    };
                    assert!(
                        read(gpu, &output, data.len()) == expected,
                        "{size} {element} {direction}"
                    );
                    assert_eq!(read(gpu, &faults, 1), [missed]);
                }
            }
        }
    });
}
