//! Many sorts of random kinds, sizes and patterns, by batches of one kind in one submission. `CLERESTORY_SORTS` sets their number; without
//! it there are a thousand.

use clerestory::gpu::{
    Access, BufferBarrier, BufferDesc, DeviceKind, Gpu, compute_to_transfer, rw_compute_to_compute, transfer_to_compute,
};
use clerestory::kernels::{Count, Form, KeyWidth, Order, RadixSort, RadixSortOptions, SortBuffers};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;

use super::sort::{expected, random_keys, to_words};
use super::{PATTERNS, empty};

/// Keys of a sort at most: beyond 2¹⁷ software devices have another plan.
const MOST: usize = 150_000;
/// Sorts of a batch.
const BATCH: usize = 125;
/// Sorts of which one may be of the largest size.
const RARE: usize = 150;
/// On software devices, batches of which one has the subgroup form, which takes long there; and its turn among them.
const SUBGROUP_BATCHES: usize = 8;
const SUBGROUP_TURN: usize = 2;

/// A size: small ones are more often than large ones, those of thousands take several teams of every form.
fn size(random: &mut Random) -> usize {
    let scale = if random.below(RARE) == 0 {
        MOST
    } else {
        random.choose(&[2, 10, 70, 300, 600, 2, 10, 3000])
    };
    random.below(scale + 1)
}

/// What to sort by: half of the sorts go by all bits, the others by any range of them.
fn kind(random: &mut Random, form: Form) -> RadixSortOptions {
    let key = random.choose(&[KeyWidth::Bits32, KeyWidth::Bits64]);
    let width = 32 * key.words();
    let ends = [0, 1].map(|_| random.below(width as usize) as u32);
    RadixSortOptions {
        key,
        values: random.choose(&[true, true, false]),
        order: random.choose(&[Order::Ascending, Order::Descending]),
        bits: if random.below(2) == 0 {
            0..width
        } else {
            ends[0].min(ends[1])..ends[0].max(ends[1]) + 1
        },
        form,
    }
}

fn batch(gpu: &Gpu, options: RadixSortOptions, random: &mut Random, count: usize) {
    let sort = RadixSort::new(gpu, options.clone()).unwrap();
    let cases: Vec<Vec<u64>> = (0..count)
        .map(|_| {
            let (pattern, size) = (random.choose(&PATTERNS), size(random));
            random_keys(random, pattern, options.key, size as u32)
        })
        .collect();
    let all = to_words(&cases.concat(), options.key);
    let most = cases.iter().map(Vec::len).max().unwrap_or(0).max(1) as u32;
    let key_words = options.key.words() as usize;
    let key_bytes = 4 * all.len() as u64;
    let upload = gpu.buffer(&BufferDesc::upload("all keys", key_bytes)).unwrap();
    upload.write(0, &all).unwrap();
    let results = ["sorted keys", "moved values"].map(|name| empty(gpu, name, key_bytes));
    let keys = ["keys", "other keys"].map(|name| sort.keys(name, most).unwrap());
    let values = ["values", "other values"].map(|name| sort.values(name, most).unwrap());
    let numbers = super::words(gpu, "numbers", &(0..most).collect::<Vec<_>>());
    let scratch = empty(gpu, "scratch", sort.scratch_bytes(most));
    let buffers = SortBuffers {
        keys: [&keys[0], &keys[1]],
        values: options.values.then_some([&values[0], &values[1]]),
    };
    let mut recorder = gpu.recorder("many sorts").unwrap();
    let recorded = recorder.pass("many sorts", |pass| {
        let mut first = 0;
        for case in &cases {
            let (bytes, key_bytes) = (4 * case.len() as u64, 4 * (key_words * case.len()) as u64);
            pass.copy(
                upload.slice(4 * (key_words * first) as u64, key_bytes),
                keys[0].buffer().view(),
            )?;
            pass.copy(numbers.slice(0, bytes), values[0].buffer().view())?;
            pass.barrier(&[keys[0].buffer(), values[0].buffer()].map(transfer_to_compute));
            let side = sort.record(pass, &buffers, Count::Host(case.len() as u32), &scratch)?;
            let touched = [&keys[0], &keys[1], &values[0], &values[1]].map(|view| view.buffer());
            pass.barrier(&touched.map(compute_to_transfer));
            let to = results[0].slice(4 * (key_words * first) as u64, key_bytes);
            pass.copy(keys[side].buffer().slice(0, key_bytes), to)?;
            if options.values {
                let to = results[1].slice(4 * first as u64, bytes);
                pass.copy(values[side].buffer().slice(0, bytes), to)?;
            }
            let all = [touched[0], touched[1], touched[2], touched[3], &results[0], &results[1]];
            pass.barrier(&all.map(|buffer| BufferBarrier {
                buffer,
                from: Access::TRANSFER,
                to: Access::COMPUTE | Access::TRANSFER,
            }));
            pass.barrier(&[rw_compute_to_compute(&scratch)]);
            first += case.len();
        }
        Ok(())
    });
    recorded.unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let [sorted, moved] = results.map(|buffer| super::read(gpu, &buffer, all.len()));
    let mut first = 0;
    for case in &cases {
        let range = first..first + case.len();
        let (keys, values) = expected(case, &options.bits, options.order);
        let found = &sorted[key_words * range.start..key_words * range.end];
        let what = || {
            let shown: Vec<u64> = case.iter().copied().take(RARE).collect();
            format!("{} keys, {options:?}: {shown:x?}", case.len())
        };
        assert!(found == to_words(&keys, options.key), "keys of {}", what());
        assert!(
            !options.values || moved[range.clone()] == values,
            "values of {}",
            what()
        );
        first = range.end;
    }
}

#[test]
fn sorts_of_random_sizes_and_patterns_are_as_by_std() {
    let wanted = match std::env::var("CLERESTORY_SORTS") {
        Ok(text) => text.parse().expect("CLERESTORY_SORTS is a number"),
        Err(_) => 8 * BATCH,
    };
    with_gpu(|gpu| {
        let mut random = Random(48);
        let plain = [Form::Auto, Form::Serial, Form::Shared];
        let (mut done, mut turn) = (0, 0);
        while done < wanted {
            let count = BATCH.min(wanted - done);
            let form = match gpu.caps().kind {
                DeviceKind::Cpu if turn % SUBGROUP_BATCHES == SUBGROUP_TURN => Form::Subgroup,
                DeviceKind::Cpu => plain[turn % plain.len()],
                _ => random.choose(&[Form::Auto, Form::Serial, Form::Shared, Form::Subgroup]),
            };
            let options = kind(&mut random, form);
            batch(gpu, options, &mut random, count);
            (done, turn) = (done + count, turn + 1);
        }
    });
}
