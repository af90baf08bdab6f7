//! Radix sort: equality with the standard library's stable sort, by key and index.

use std::ops::Range;

use clerestory::Error;
use clerestory::gpu::{DeviceKind, Gpu, rw_compute_to_compute};
use clerestory::kernels::{
    Count, Form, KeyWidth, Order, RadixSort, RadixSortOptions, SortBuffers, StreamStatus, radix_sort,
};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;

use super::{FORMS, PATTERNS, Pattern, SIZES, empty, run, words};

/// What the standard library makes of keys with their indices, and only these bits.
pub(super) fn expected(keys: &[u64], bits: &Range<u32>, order: Order) -> (Vec<u64>, Vec<u32>) {
    let part = |key: u64| key << (64 - bits.end) >> (64 - bits.end + bits.start);
    let mut pairs: Vec<(u64, u32)> = keys.iter().copied().zip(0..).collect();
    match order {
        Order::Ascending => pairs.sort_by_key(|(key, _)| part(*key)),
        Order::Descending => pairs.sort_by_key(|(key, _)| std::cmp::Reverse(part(*key))),
    }
    pairs.into_iter().unzip()
}

/// Keys as words of their width.
pub(super) fn to_words(keys: &[u64], width: KeyWidth) -> Vec<u32> {
    match width {
        KeyWidth::Bits32 => keys.iter().map(|key| *key as u32).collect(),
        KeyWidth::Bits64 => bytemuck::cast_slice(keys).to_vec(),
    }
}

pub(super) fn random_keys(random: &mut Random, pattern: Pattern, width: KeyWidth, count: u32) -> Vec<u64> {
    let low = pattern.words(random, count);
    match width {
        KeyWidth::Bits32 => low.into_iter().map(u64::from).collect(),
        KeyWidth::Bits64 => {
            let high = pattern.words(random, count);
            low.iter()
                .zip(high)
                .map(|(l, h)| u64::from(*l) | u64::from(h) << 32)
                .collect()
        }
    }
}

/// What no sort writes: beyond the count, keys stay this.
const UNTOUCHED: u32 = 0xA5A5_5A5A;

/// Sorts on the device; keys as words, and values where there are any. A count on the device comes with a capacity that is larger.
fn sorted(gpu: &Gpu, sort: &RadixSort, keys: &[u64], on_device: bool) -> (Vec<u32>, Vec<u32>) {
    let (count, options) = (keys.len() as u32, sort.options());
    let input = to_words(keys, options.key);
    let more = [1, 300, 5_000, 100_000][keys.len() % 4];
    let capacity = if on_device { count + more } else { count };
    let sides = ["keys", "other keys"].map(|name| sort.keys(name, capacity).unwrap());
    let values = ["values", "other values"].map(|name| sort.values(name, capacity).unwrap());
    let capacity_words = capacity as usize * options.key.words() as usize;
    if capacity > 0 {
        for view in &sides {
            gpu.upload(view.buffer(), 0, &vec![UNTOUCHED; capacity_words]).unwrap();
        }
    }
    if count > 0 {
        gpu.upload(sides[0].buffer(), 0, &input).unwrap();
        gpu.upload(values[0].buffer(), 0, &(0..count).collect::<Vec<_>>())
            .unwrap();
    }
    let counts = words(gpu, "count", &[count]);
    let count_given = if on_device {
        Count::Device {
            view: counts.view(),
            capacity,
        }
    } else {
        Count::Host(count)
    };
    let scratch = empty(gpu, "scratch", sort.scratch_bytes(capacity));
    let buffers = SortBuffers {
        keys: [&sides[0], &sides[1]],
        values: options.values.then_some([&values[0], &values[1]]),
    };
    let mut side = 0;
    run(gpu, |pass| {
        side = sort.record(pass, &buffers, count_given, &scratch)?;
        Ok(())
    });
    assert_eq!(side, sort.result_side(capacity));
    if on_device {
        let status = StreamStatus::read(gpu, &scratch).unwrap();
        assert_eq!((status.count, status.wanted), (count, count));
    }
    let mut result: Vec<u32> = gpu.read(sides[side].buffer().view(), capacity_words).unwrap();
    assert!(
        result.drain(input.len()..).all(|word| word == UNTOUCHED),
        "written beyond the count: {count} of {capacity}, {options:?}"
    );
    let moved = gpu.read(values[side].buffer().view(), count as usize).unwrap();
    (result, if options.values { moved } else { Vec::new() })
}

fn check(gpu: &Gpu, sort: &RadixSort, keys: &[u64], on_device: bool, what: &str) {
    let options = sort.options();
    let (expected_keys, expected_values) = expected(keys, &options.bits, options.order);
    let (result, moved) = sorted(gpu, sort, keys, on_device);
    let what = format!("{what}: {} keys, {options:?}", keys.len());
    assert!(result == to_words(&expected_keys, options.key), "keys: {what}");
    assert!(!options.values || moved == expected_values, "values: {what}");
}

#[test]
fn every_size_and_pattern_is_as_by_std() {
    with_gpu(|gpu| {
        let mut random = Random(41);
        for form in FORMS.into_iter().chain([Form::Auto]) {
            for (key, values) in [(KeyWidth::Bits32, true), (KeyWidth::Bits64, false)] {
                let options = RadixSortOptions {
                    form,
                    ..RadixSortOptions::new(key, values)
                };
                let sort = RadixSort::new(gpu, options).unwrap();
                for (i, size) in SIZES.into_iter().enumerate() {
                    let pattern = PATTERNS[i % PATTERNS.len()];
                    let keys = random_keys(&mut random, pattern, key, size);
                    check(gpu, &sort, &keys, i % 3 == 0, &format!("{pattern:?}"));
                }
                for pattern in PATTERNS {
                    let keys = random_keys(&mut random, pattern, key, 5000);
                    check(gpu, &sort, &keys, false, &format!("{pattern:?}"));
                }
            }
        }
    });
}

/// Barriers and shader invocations of a sort of so many keys.
fn barriers_and_invocations(gpu: &Gpu, sort: &RadixSort, count: Count<'_>) -> (u32, u64) {
    let capacity = count.capacity();
    let sides = ["keys", "other keys"].map(|name| sort.keys(name, capacity).unwrap());
    let scratch = empty(gpu, "scratch", sort.scratch_bytes(capacity));
    let buffers = SortBuffers {
        keys: [&sides[0], &sides[1]],
        values: None,
    };
    let mut recorder = gpu.recorder("counted").unwrap();
    recorder.count_invocations();
    recorder
        .pass("sort", |pass| sort.record(pass, &buffers, count, &scratch))
        .unwrap();
    let timings = recorder.submit().unwrap().wait().unwrap();
    (
        timings.passes[0].barriers,
        timings.passes[0].invocations.expect("pipeline statistics"),
    )
}

#[test]
fn few_keys_take_one_dispatch() {
    with_gpu(|gpu| {
        let lanes_at_most = u64::from(gpu.caps().max_workgroup_invocations.min(256));
        let with_form = |form| {
            let options = RadixSortOptions {
                form,
                ..RadixSortOptions::new(KeyWidth::Bits32, false)
            };
            RadixSort::new(gpu, options).unwrap()
        };
        // In shared memory, and in the buffers where that is memory like any other.
        let of_buffers = if gpu.caps().kind == DeviceKind::Cpu {
            1 << 14
        } else {
            2048
        };
        for (form, most) in [(Form::Shared, 2048), (Form::Auto, of_buffers)] {
            let sort = with_form(form);
            let limit = sort.one_dispatch_up_to();
            assert!((256..=most).contains(&limit), "{form:?}: {limit}");
            let counts = words(gpu, "count", &[1]);
            let on_device = Count::Device {
                view: counts.view(),
                capacity: limit,
            };
            for count in [Count::Host(1), Count::Host(limit), on_device] {
                let (barriers, invocations) = barriers_and_invocations(gpu, &sort, count);
                assert!(
                    barriers == 0 && invocations <= lanes_at_most,
                    "{form:?}: {barriers} {invocations}"
                );
            }
            // More keys take three dispatches for each of four or eight digits, and a barrier between any two.
            for count in [limit + 1, 200_000] {
                let (barriers, _) = barriers_and_invocations(gpu, &sort, Count::Host(count));
                assert!([11, 23].contains(&barriers), "{form:?}, {count}: {barriers}");
            }
        }
        for form in [Form::Serial, Form::Subgroup] {
            assert_eq!(with_form(form).one_dispatch_up_to(), 0);
        }
    });
}

#[test]
fn sorts_about_the_limit_of_one_dispatch_are_as_by_std() {
    with_gpu(|gpu| {
        let mut random = Random(49);
        for (key, values, order, form) in [
            (KeyWidth::Bits32, false, Order::Descending, Form::Auto),
            (KeyWidth::Bits32, true, Order::Ascending, Form::Shared),
            (KeyWidth::Bits32, true, Order::Descending, Form::Auto),
            (KeyWidth::Bits64, false, Order::Ascending, Form::Auto),
            (KeyWidth::Bits64, true, Order::Descending, Form::Shared),
            (KeyWidth::Bits64, true, Order::Ascending, Form::Auto),
        ] {
            let options = RadixSortOptions {
                order,
                form,
                ..RadixSortOptions::new(key, values)
            };
            let sort = RadixSort::new(gpu, options).unwrap();
            let limit = sort.one_dispatch_up_to();
            for (i, size) in [limit - 1, limit, limit + 1].into_iter().enumerate() {
                for pattern in PATTERNS {
                    let keys = random_keys(&mut random, pattern, key, size);
                    check(gpu, &sort, &keys, i % 2 == 1, &format!("{pattern:?}"));
                }
            }
        }
    });
}

#[test]
fn bits_and_orders_are_those_asked_for() {
    with_gpu(|gpu| {
        let mut random = Random(42);
        let kinds = [
            (KeyWidth::Bits32, 0..30, Order::Descending),
            (KeyWidth::Bits32, 7..8, Order::Descending),
            (KeyWidth::Bits32, 3..20, Order::Ascending),
            (KeyWidth::Bits64, 25..41, Order::Descending),
            (KeyWidth::Bits64, 0..63, Order::Ascending),
        ];
        for form in FORMS.into_iter().chain([Form::Auto]) {
            for (key, bits, order) in kinds.clone() {
                let options = RadixSortOptions {
                    key,
                    values: true,
                    order,
                    bits,
                    form,
                };
                let sort = RadixSort::new(gpu, options).unwrap();
                for size in [1, 6, 1000, 3001] {
                    let keys = random_keys(&mut random, Pattern::Random, key, size);
                    check(gpu, &sort, &keys, false, "random");
                }
            }
        }
    });
}

#[test]
fn many_keys_take_the_other_plan() {
    with_gpu(|gpu| {
        let mut random = Random(43);
        for (key, values) in [(KeyWidth::Bits32, false), (KeyWidth::Bits64, true)] {
            let sort = RadixSort::new(gpu, RadixSortOptions::new(key, values)).unwrap();
            for size in [(1 << 17) - 1, 1 << 17, (1 << 17) + 1, (1 << 20) + 3] {
                let keys = random_keys(&mut random, Pattern::Random, key, size);
                check(gpu, &sort, &keys, size % 2 == 1, "random");
            }
        }
    });
}

/// 2²⁴ + 3 keys are more than 65,535 workgroups of 256 lanes could take one each, and blocks as long as the loop quota lets them be.
#[test]
#[ignore = "takes several seconds and much memory"]
fn sixteen_million_keys_are_as_by_std() {
    with_gpu(|gpu| {
        let sort = RadixSort::new(gpu, RadixSortOptions::new(KeyWidth::Bits32, true)).unwrap();
        let keys = random_keys(&mut Random(44), Pattern::Random, KeyWidth::Bits32, (1 << 24) + 3);
        check(gpu, &sort, &keys, true, "random");
    });
}

#[test]
fn repeated_sorts_give_the_same_bits_in_every_form() {
    with_gpu(|gpu| {
        let keys = random_keys(&mut Random(45), Pattern::FewBits, KeyWidth::Bits32, 20_000);
        let run_of = |form| {
            let options = RadixSortOptions {
                form,
                bits: 4..25,
                ..RadixSortOptions::new(KeyWidth::Bits32, true)
            };
            sorted(gpu, &RadixSort::new(gpu, options).unwrap(), &keys, false)
        };
        let first = run_of(Form::Serial);
        assert!(first == run_of(Form::Serial) && first == run_of(Form::Subgroup) && first == run_of(Form::Shared));
    });
}

#[test]
fn sorts_follow_each_other_in_one_pass() {
    with_gpu(|gpu| {
        let options = |bits| RadixSortOptions {
            bits,
            ..RadixSortOptions::new(KeyWidth::Bits32, false)
        };
        // By the high bits after the low ones: one stable sort by all of them.
        let halves = [options(0..16), options(16..32)].map(|options| RadixSort::new(gpu, options).unwrap());
        let keys = Pattern::Random.words(&mut Random(46), 3000);
        let sides = ["keys", "other keys"].map(|name| halves[0].keys(name, 3000).unwrap());
        gpu.upload(sides[0].buffer(), 0, &keys).unwrap();
        let scratch = empty(gpu, "scratch", halves[0].scratch_bytes(3000));
        let mut side = 0;
        run(gpu, |pass| {
            for sort in &halves {
                let keys = [&sides[side], &sides[1 - side]];
                side ^= sort.record(pass, &SortBuffers { keys, values: None }, Count::Host(3000), &scratch)?;
                pass.barrier(&[&scratch, sides[0].buffer(), sides[1].buffer()].map(rw_compute_to_compute));
            }
            Ok(())
        });
        let mut expected = keys;
        expected.sort();
        assert!(gpu.read::<u32>(sides[side].buffer().view(), 3000).unwrap() == expected);
    });
}

#[test]
fn more_keys_than_the_capacity_are_reported_and_left() {
    with_gpu(|gpu| {
        let sort = RadixSort::new(gpu, RadixSortOptions::new(KeyWidth::Bits32, false)).unwrap();
        let sides = ["keys", "other keys"].map(|name| sort.keys(name, 100).unwrap());
        gpu.upload(sides[0].buffer(), 0, &[7u32; 100]).unwrap();
        let scratch = empty(gpu, "scratch", sort.scratch_bytes(100));
        let counts = words(gpu, "count", &[101]);
        let buffers = SortBuffers {
            keys: [&sides[0], &sides[1]],
            values: None,
        };
        let count = Count::Device {
            view: counts.view(),
            capacity: 100,
        };
        run(gpu, |pass| sort.record(pass, &buffers, count, &scratch).map(drop));
        let status = StreamStatus::read(gpu, &scratch).unwrap();
        assert_eq!((status.count, status.wanted), (0, 101));
        assert!(matches!(
            status.check("sort", 100),
            Err(Error::Overflow {
                needed: 101,
                capacity: 100,
                ..
            })
        ));
        assert_eq!(gpu.read::<u32>(sides[0].buffer().view(), 100).unwrap(), [7; 100]);
    });
}

#[test]
fn what_does_not_fit_is_refused_before_it_is_recorded() {
    with_gpu(|gpu| {
        let options = RadixSortOptions::new(KeyWidth::Bits64, false);
        for bits in [0..0, 5..5, 0..65] {
            let options = RadixSortOptions {
                bits,
                ..options.clone()
            };
            assert!(matches!(RadixSort::new(gpu, options), Err(Error::Setting { .. })));
        }
        let sort = RadixSort::new(gpu, options).unwrap();
        let sides = ["keys", "other keys"].map(|name| sort.keys(name, 10).unwrap());
        let scratch = empty(gpu, "scratch", sort.scratch_bytes(10));
        let small = empty(gpu, "small", 16);
        let keys = [&sides[0], &sides[1]];
        let record = |buffers: SortBuffers<'_>, count, scratch| {
            let mut recorder = gpu.recorder("refused").unwrap();
            recorder.pass("refused", |pass| {
                sort.record(pass, &buffers, Count::Host(count), scratch)
            })
        };
        let none = SortBuffers { keys, values: None };
        let some = SortBuffers {
            keys,
            values: Some(keys),
        };
        assert!(matches!(
            record(none, 11, &scratch),
            Err(Error::LimitExceeded { value: 88, .. })
        ));
        assert!(matches!(record(none, 10, &small), Err(Error::LimitExceeded { .. })));
        assert!(matches!(
            record(none, u32::MAX, &scratch),
            Err(Error::LimitExceeded { limit: 0x8000_0000, .. })
        ));
        assert!(matches!(record(some, 10, &scratch), Err(Error::Setting { .. })));
        assert!(record(none, 10, &scratch).is_ok());
    });
}

#[test]
fn the_twin_sorts_as_std_does() {
    let mut random = Random(47);
    for (bits, order, digit_bits) in [
        (0..64, Order::Ascending, 11),
        (5..37, Order::Descending, 8),
        (0..1, Order::Ascending, 4),
    ] {
        for pattern in PATTERNS {
            let keys = random_keys(&mut random, pattern, KeyWidth::Bits64, 777);
            let (mut sorted, mut values) = (keys.clone(), (0..777).collect::<Vec<u32>>());
            radix_sort(&mut sorted, &mut values, bits.clone(), order, digit_bits);
            assert_eq!((sorted, values), expected(&keys, &bits, order));
        }
    }
}
