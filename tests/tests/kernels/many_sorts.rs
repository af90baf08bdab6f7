//! Many sorts of random sizes and patterns, by batches in one submission. `CLERESTORY_SORTS` sets their number; without it there are some
//! thousand.

use clerestory::gpu::{BufferDesc, DeviceKind, Gpu, compute_to_transfer, transfer_to_compute};
use clerestory::kernels::{Count, Form, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;

use super::{PATTERNS, empty};

/// Keys of a sort at most, and sorts of a submission.
const MOST: usize = 3000;
const BATCH: usize = 250;

/// A size: small ones are more often than large ones, the largest take several teams of every form.
fn size(random: &mut Random) -> usize {
    let scale = random.choose(&[2, 10, 70, 300, 600, 2, 10, MOST]);
    random.below(scale + 1)
}

fn batch(gpu: &Gpu, sort: &RadixSort, random: &mut Random, count: usize) {
    let cases: Vec<Vec<u32>> = (0..count)
        .map(|_| {
            let (pattern, size) = (random.choose(&PATTERNS), size(random));
            pattern.words(random, size as u32)
        })
        .collect();
    let all: Vec<u32> = cases.iter().flatten().copied().collect();
    let bytes = 4 * all.len() as u64;
    let upload = gpu.buffer(&BufferDesc::upload("all keys", bytes)).unwrap();
    upload.write(0, &all).unwrap();
    let results = ["sorted keys", "moved values"].map(|name| empty(gpu, name, bytes));
    let most = MOST as u32;
    let keys = ["keys", "other keys"].map(|name| sort.keys(name, most).unwrap());
    let values = ["values", "other values"].map(|name| sort.values(name, most).unwrap());
    gpu.upload(values[0].buffer(), 0, &(0..most).collect::<Vec<_>>())
        .unwrap();
    let numbers = super::words(gpu, "numbers", &(0..most).collect::<Vec<_>>());
    let scratch = empty(gpu, "scratch", sort.scratch_bytes(most));
    let buffers = SortBuffers {
        keys: [&keys[0], &keys[1]],
        values: Some([&values[0], &values[1]]),
    };
    let mut recorder = gpu.recorder("many sorts").unwrap();
    let recorded = recorder.pass("many sorts", |pass| {
        let mut first = 0;
        for case in &cases {
            let bytes = 4 * case.len() as u64;
            pass.copy(upload.slice(first, bytes), keys[0].buffer().view())?;
            pass.copy(numbers.slice(0, bytes), values[0].buffer().view())?;
            pass.barrier(&[keys[0].buffer(), values[0].buffer()].map(transfer_to_compute));
            let side = sort.record(pass, &buffers, Count::Host(case.len() as u32), &scratch)?;
            let touched = [&keys[0], &keys[1], &values[0], &values[1]].map(|view| view.buffer());
            pass.barrier(&touched.map(compute_to_transfer));
            pass.copy(keys[side].buffer().slice(0, bytes), results[0].slice(first, bytes))?;
            pass.copy(values[side].buffer().slice(0, bytes), results[1].slice(first, bytes))?;
            let all = [touched[0], touched[1], touched[2], touched[3], &results[0], &results[1]];
            pass.barrier(&all.map(|buffer| clerestory::gpu::BufferBarrier {
                buffer,
                from: clerestory::gpu::Access::TRANSFER,
                to: clerestory::gpu::Access::COMPUTE | clerestory::gpu::Access::TRANSFER,
            }));
            pass.barrier(&[clerestory::gpu::rw_compute_to_compute(&scratch)]);
            first += bytes;
        }
        Ok(())
    });
    recorded.unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let [sorted, moved] = results.map(|buffer| super::read(gpu, &buffer, all.len()));
    let mut first = 0;
    for case in &cases {
        let mut pairs: Vec<(u32, u32)> = case.iter().copied().zip(0..).collect();
        pairs.sort_by_key(|(key, _)| *key);
        let range = first..first + case.len();
        let found = sorted[range.clone()]
            .iter()
            .copied()
            .zip(moved[range.clone()].iter().copied());
        assert!(found.eq(pairs), "{} keys: {case:x?}", case.len());
        first = range.end;
    }
}

#[test]
fn sorts_of_random_sizes_and_patterns_are_as_by_std() {
    let wanted = match std::env::var("CLERESTORY_SORTS") {
        Ok(text) => text.parse().expect("CLERESTORY_SORTS is a number"),
        Err(_) => 4 * BATCH,
    };
    with_gpu(|gpu| {
        let mut random = Random(48);
        let sorts = [Form::Auto, Form::Serial, Form::Subgroup].map(|form| {
            let options = RadixSortOptions {
                form,
                ..RadixSortOptions::new(KeyWidth::Bits32, true)
            };
            RadixSort::new(gpu, options).unwrap()
        });
        let (mut done, mut turn) = (0, 0);
        while done < wanted {
            let count = BATCH.min(wanted - done);
            // The subgroup form takes long on software drivers: every tenth batch there.
            let is_rare = gpu.caps().kind == DeviceKind::Cpu && turn % 10 != 2;
            let form = if is_rare { turn % 2 } else { 2 };
            batch(gpu, &sorts[form], &mut random, count);
            (done, turn) = (done + count, turn + 1);
        }
    });
}
