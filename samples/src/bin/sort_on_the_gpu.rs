//! A kernel used alone: random colours, sorted by brightness on the device with their places as values, against the standard library's sort.
//! The picture shows the colours before and after.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clerestory::gpu::{BufferDesc, Category, Gpu, GpuOptions};
use clerestory::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory::{Error, Result};

const SIZE: [u32; 2] = [512, 512];
/// Rows of one picture.
const ROWS: u32 = SIZE[1] / 2;
/// Pixels of a tile, whose colour is one element.
const TILE: u32 = 4;
const COUNT: u32 = SIZE[0] / TILE * (ROWS / TILE);

fn main() -> ExitCode {
    clerestory_samples::run("sort_on_the_gpu", sample)
}

fn sample(path: &Path) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    // Keys are unsigned integers: what is sorted by something else wants a map that keeps its order.
    let colours: Vec<[u8; 3]> = (0..COUNT).map(colour).collect();
    let keys: Vec<u32> = colours.iter().map(brightness).collect();
    let places: Vec<u32> = (0..COUNT).collect();

    let sort = RadixSort::new(&gpu, RadixSortOptions::new(KeyWidth::Bits32, true))?;
    // Each digit goes from one side of the buffers to the other.
    let keys_on_device = [sort.keys("keys", COUNT)?, sort.keys("other keys", COUNT)?];
    let values_on_device = [sort.values("places", COUNT)?, sort.values("other places", COUNT)?];
    let scratch = gpu.buffer(&BufferDesc::storage(
        "scratch",
        sort.scratch_bytes(COUNT),
        Category::Work,
    ))?;
    gpu.upload(keys_on_device[0].buffer(), 0, &keys)?;
    gpu.upload(values_on_device[0].buffer(), 0, &places)?;

    let buffers = SortBuffers {
        keys: [&keys_on_device[0], &keys_on_device[1]],
        values: Some([&values_on_device[0], &values_on_device[1]]),
    };
    // The sort goes into a command buffer of ours, in a pass that we name and that is timed.
    let mut recorder = gpu.recorder("sort")?;
    let side = recorder.pass("sort", |pass| sort.record(pass, &buffers, Count::Host(COUNT), &scratch))?;
    let timings = recorder.submit()?.wait()?;
    let order: Vec<u32> = gpu.read(values_on_device[side].buffer().view(), COUNT as usize)?;

    let mut expected = places;
    let start = Instant::now();
    expected.sort_by_key(|place| keys[*place as usize]);
    let seconds = start.elapsed().as_secs_f64();
    if order != expected {
        return Err(Error::Shader {
            name: "sort".into(),
            message: "the order is not that of the standard library".into(),
        });
    }
    println!("{COUNT} colours on {}", gpu.caps().device);
    println!("{:>10.3} ms  by the kernel", timings.seconds() * 1e3);
    println!("{:>10.3} ms  by the standard library", seconds * 1e3);

    let mut pixels = Vec::new();
    let sorted: Vec<[u8; 3]> = order.iter().map(|place| colours[*place as usize]).collect();
    for part in [&colours, &sorted] {
        for (y, x) in (0..ROWS).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
            let [red, green, blue] = part[(y / TILE * (SIZE[0] / TILE) + x / TILE) as usize];
            pixels.extend([red, green, blue, 255]);
        }
    }
    clerestory_samples::save_png(path, SIZE, &pixels)?;
    clerestory_samples::check_messages(&gpu.validation_log())
}

/// A colour from a hash of its number (a multiplicative one, mixed once).
fn colour(number: u32) -> [u8; 3] {
    let bits = number.wrapping_mul(0x9E37_79B1);
    let [red, green, blue, _] = (bits ^ bits >> 15).wrapping_mul(0x85EB_CA6B).to_le_bytes();
    [red, green, blue]
}

/// Rec. 709 luma in units of 1/10,000 of a step.
fn brightness([red, green, blue]: &[u8; 3]) -> u32 {
    2126 * u32::from(*red) + 7152 * u32::from(*green) + 722 * u32::from(*blue)
}
