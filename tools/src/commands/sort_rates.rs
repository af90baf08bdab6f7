//! `clerestory bench --sort`: keys per second of the radix sort beside the standard library's sorts, in the same run.

use std::time::Instant;

use clerestory::Result;
use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory_tools::machine::median;

use crate::output::{self, Table};

/// Sizes as powers of two.
const SIZES: [u32; 8] = [10, 12, 14, 16, 18, 20, 22, 24];

/// Keys per second of one size, medians.
#[derive(Debug, serde::Serialize)]
pub struct SortRates {
    /// Number of keys.
    keys: u32,
    /// 32-bit keys by the kernel: by wall clock from submission to the end of waiting.
    kernel: f64,
    /// `sort_unstable` of the standard library.
    std_unstable: f64,
    /// `sort` of the standard library.
    std_stable: f64,
    /// Keys with values by the kernel.
    kernel_pairs: f64,
    /// `sort_by_key` of pairs.
    std_pairs: f64,
}

/// Measures all sizes; one run before the measured ones compiles the kernels.
pub fn measure(gpu: &Gpu, repeat: u32) -> Result<Vec<SortRates>> {
    SIZES.map(|size| rates(gpu, 1 << size, repeat)).into_iter().collect()
}

/// Keys of a SplitMix64 stream.
fn random_keys(count: u32) -> Vec<u32> {
    let mut state = 0u64;
    (0..count)
        .map(|_| {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 32) as u32
        })
        .collect()
}

fn rates(gpu: &Gpu, count: u32, repeat: u32) -> Result<SortRates> {
    let keys = random_keys(count);
    let pairs: Vec<(u32, u32)> = keys.iter().copied().zip(0..).collect();
    let rate = |seconds: Vec<f64>| f64::from(count) / median(seconds);
    let of_std = |sort: &dyn Fn() -> f64| rate((0..repeat).map(|_| sort()).collect());
    Ok(SortRates {
        keys: count,
        kernel: rate(by_kernel(gpu, &keys, false, repeat)?),
        std_unstable: of_std(&|| timed(&keys, <[u32]>::sort_unstable)),
        std_stable: of_std(&|| timed(&keys, <[u32]>::sort)),
        kernel_pairs: rate(by_kernel(gpu, &keys, true, repeat)?),
        std_pairs: of_std(&|| timed(&pairs, |pairs| pairs.sort_by_key(|pair| pair.0))),
    })
}

fn timed<T: Clone>(data: &[T], sort: impl Fn(&mut [T])) -> f64 {
    let mut data = data.to_vec();
    let start = Instant::now();
    sort(&mut data);
    let seconds = start.elapsed().as_secs_f64();
    std::hint::black_box(data);
    seconds
}

fn by_kernel(gpu: &Gpu, keys: &[u32], values: bool, repeat: u32) -> Result<Vec<f64>> {
    let count = keys.len() as u32;
    let sort = RadixSort::new(gpu, RadixSortOptions::new(KeyWidth::Bits32, values))?;
    let sides = [sort.keys("keys", count)?, sort.keys("other keys", count)?];
    let values_of = [sort.values("values", count)?, sort.values("other values", count)?];
    let scratch = gpu.buffer(&BufferDesc::storage(
        "scratch",
        sort.scratch_bytes(count),
        Category::Work,
    ))?;
    let buffers = SortBuffers {
        keys: [&sides[0], &sides[1]],
        values: values.then_some([&values_of[0], &values_of[1]]),
    };
    let mut seconds = Vec::new();
    for _ in 0..=repeat {
        gpu.upload(sides[0].buffer(), 0, keys)?;
        let mut recorder = gpu.recorder("sort")?;
        recorder.pass("sort", |pass| sort.record(pass, &buffers, Count::Host(count), &scratch))?;
        let start = Instant::now();
        recorder.submit()?.wait()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok(seconds.split_off(1))
}

/// The rates as a table.
pub fn table(rates: &[SortRates]) -> String {
    let head = [
        "keys",
        "kernel",
        "std unstable",
        "std stable",
        "kernel, pairs",
        "std, pairs",
    ];
    let mut table = Table::new(&head, &[]);
    for row in rates {
        let rates = [
            row.kernel,
            row.std_unstable,
            row.std_stable,
            row.kernel_pairs,
            row.std_pairs,
        ];
        let [a, b, c, d, e] = rates.map(output::metric);
        table.row([row.keys.to_string(), a, b, c, d, e]);
    }
    table.text()
}
