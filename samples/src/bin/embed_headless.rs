//! The engine as a library, without a window: make a device, run a kernel of the engine's on it a few times, read the picture back.

use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory_samples::picture::{Gradient, Orbit, Picture};

const SIZE: [u32; 2] = [640, 360];
const FRAMES: u32 = 16;

fn main() -> ExitCode {
    clerestory_samples::run("embed_headless", sample)
}

fn sample(path: &Path) -> Result<()> {
    // The fastest device there is; CLERESTORY_VALIDATION=core adds the validation layers.
    let gpu = Gpu::headless(&GpuOptions::default())?;
    println!("on {} ({})", gpu.caps().device, gpu.caps().driver);

    let mut picture = Gradient::new(&gpu, false)?;
    let camera = Orbit::default();
    let mut pixels = picture.render(&camera, SIZE)?;
    for _ in 1..FRAMES {
        pixels = picture.render(&camera, SIZE)?;
    }

    for allocation in gpu.allocations() {
        println!("{:>10} bytes  {}", allocation.bytes, allocation.name);
    }
    let bytes: Vec<u8> = gpu.read(pixels.view(), 4 * (SIZE[0] * SIZE[1]) as usize)?;
    clerestory_samples::save_png(path, SIZE, &bytes)?;
    clerestory_samples::check_messages(&gpu.validation_log())
}
