//! A kernel of the host's own, in WGSL, on a rendered picture: it darkens the corners and draws edges in ink.
//!
//! `own_kernel [FILE] [--size WxH] [--spp N] [--source KERNEL.wgsl]`
//!
//! The source is compiled while the program runs; a mistake in it is an error with its line. What it binds is checked by name.

use std::path::Path;
use std::process::ExitCode;

use clerestory::film::PixelFormat;
use clerestory::gpu::{Access, BufferDesc, Category, Gpu, GpuOptions, OwnKernel, OwnResource};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, scene};
use clerestory_samples::arguments::Arguments;

/// Pixels are words of four bytes, red lowest.
const INK_AND_VIGNETTE: &str = "
var<immediate> size: vec2u;
@group(0) @binding(0) var<storage, read> pixels: array<u32>;
@group(0) @binding(1) var<storage, read_write> result: array<u32>;
fn at(p: vec2u) -> vec3f { let q = min(p, size - 1u); return unpack4x8unorm(pixels[q.y * size.x + q.x]).rgb; }
@compute @workgroup_size(8, 8) fn ink(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= size) { return; }
    let edge = length(at(id.xy + vec2u(1u, 0u)) - at(id.xy)) + length(at(id.xy + vec2u(0u, 1u)) - at(id.xy));
    let corner = distance(vec2f(id.xy) / vec2f(size), vec2f(0.5));
    let shown = mix(at(id.xy), vec3f(0.05, 0.1, 0.4), smoothstep(0.1, 0.4, edge)) * (1.0 - corner * corner);
    result[id.y * size.x + id.x] = pack4x8unorm(vec4f(shown, 1.0));
}
";

fn main() -> ExitCode {
    clerestory_samples::run_with("own_kernel", &["--size", "--spp", "--source"], sample)
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    let options = RenderOptions {
        size: arguments.size("--size")?.unwrap_or([240, 240]),
        spp: arguments.value("--spp")?.unwrap_or(64),
        ..RenderOptions::default()
    };
    let source = match arguments.text("--source") {
        Some(file) => std::fs::read_to_string(file).map_err(|error| Error::io(file, error))?,
        None => INK_AND_VIGNETTE.into(),
    };
    let gpu = Gpu::headless(&GpuOptions::default())?;
    // A mistake in the source ends here, before any time is spent on the picture.
    let kernel = OwnKernel::wgsl(&gpu, "ink", &source)?;
    for binding in kernel.bindings() {
        let does = if binding.writes { "writes" } else { "reads" };
        println!(
            "the kernel {does} {} (at least {} bytes)",
            binding.name, binding.least_bytes
        );
    }

    let scene = scene::load("builtin:cornell-box?sphere=gold")?;
    let mut rendering = Renderer::new(&gpu, &scene)?.start(&options)?;
    while rendering.step()?.is_some() {}
    let [width, height] = options.size;
    let bytes = 4 * u64::from(width) * u64::from(height);
    let buffer = |name| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Film));
    let (pixels, result) = (buffer("displayed picture")?, buffer("picture in ink")?);
    rendering.display(&pixels, scene.defaults.exposure, PixelFormat::Rgba8)?;

    let mut recorder = gpu.recorder("own kernel")?;
    recorder.pass("ink", |pass| {
        let given = [
            ("pixels", OwnResource::ReadOnly(pixels.view())),
            ("result", result.view().into()),
        ];
        let groups = kernel.groups_for([width, height, 1]);
        pass.dispatch_own(&kernel, &given, bytemuck::cast_slice(&options.size), groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::TRANSFER);
        Ok(())
    })?;
    let timings = recorder.submit()?.wait()?;
    println!("the kernel took {:.3} ms", 1e3 * timings.seconds_of("ink"));
    let shown: Vec<u8> = gpu.read(result.view(), bytes as usize)?;
    clerestory_samples::save_png(path, options.size, &shown)?;
    clerestory_samples::check_messages(&gpu.validation_log())
}
