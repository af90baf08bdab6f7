//! The first triangle, without a window: vertices pulled from a storage buffer, drawn into an image, copied to a PNG file.

use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::gpu::ash::vk;
use clerestory::gpu::{
    Access, BufferDesc, Category, ColorTarget, Gpu, GpuOptions, GraphicsDesc, GraphicsPipeline, ImageBarrier,
    ImageDesc, Targets,
};
use clerestory_samples::shaders::types::TriangleVertex;
use clerestory_samples::shaders::{triangle_frag, triangle_vert};

const SIZE: [u32; 2] = [512, 512];
const BACKGROUND: [f32; 4] = [0.05, 0.05, 0.08, 1.0];

/// The pipeline of the sample's two shaders.
type Pipeline = GraphicsPipeline<triangle_vert::Shader, triangle_frag::Shader>;

fn main() -> ExitCode {
    clerestory_samples::run("hello_triangle_offscreen", sample)
}

fn sample(path: &Path) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let format = vk::Format::R8G8B8A8_SRGB;
    let image = gpu.image(&ImageDesc {
        name: "picture",
        size: SIZE,
        layers: 1,
        mips: 1,
        format,
        usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
        category: Category::Film,
    })?;
    // The structs come from the shader by reflection: a renamed field would not compile here.
    let corner = |position, color| TriangleVertex { position, color };
    let vertices = gpu.buffer_with(
        "vertices",
        Category::Geometry,
        &[
            corner([0.0, -0.8], [1.0, 0.0, 0.0]),
            corner([0.8, 0.6], [0.0, 1.0, 0.0]),
            corner([-0.8, 0.6], [0.0, 0.0, 1.0]),
        ],
    )?;
    let pipeline: Pipeline = gpu.graphics_pipeline(&GraphicsDesc {
        colors: &[format],
        ..GraphicsDesc::default()
    })?;
    let pixels = gpu.buffer(&BufferDesc::storage(
        "pixels",
        u64::from(4 * SIZE[0] * SIZE[1]),
        Category::Film,
    ))?;

    let mut recorder = gpu.recorder("triangle")?;
    recorder.pass("draw", |pass| {
        pass.image_barrier(&[ImageBarrier {
            image: &image,
            from: Access::NONE,
            to: Access::COLOR_WRITE,
            old_layout: vk::ImageLayout::UNDEFINED,
            new_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        }]);
        let targets = Targets {
            colors: &[Some(ColorTarget {
                image: &image,
                clear: Some(BACKGROUND.into()),
            })],
            ..Targets::default()
        };
        let set = triangle_vert::Set0 {
            vertices: vertices.view(),
        };
        let push = triangle_vert::Push { rotation: [1.0, 0.0] };
        pass.render(&targets, |render| render.draw(&pipeline, &[&set], &push, 3, 1))
    })?;
    recorder.pass("copy", |pass| {
        pass.image_barrier(&[ImageBarrier {
            image: &image,
            from: Access::COLOR_WRITE,
            to: Access::TRANSFER_READ,
            old_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            new_layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        }]);
        pass.copy_image_to_buffer(&image, pixels.view())
    })?;
    for pass in recorder.submit()?.wait()?.passes {
        println!("{:>8} ns  {}", pass.nanoseconds.unwrap_or(0), pass.name);
    }

    let bytes: Vec<u8> = gpu.read(pixels.view(), (4 * SIZE[0] * SIZE[1]) as usize)?;
    clerestory_samples::save_png(path, SIZE, &bytes)?;
    clerestory_samples::check_messages(&gpu.validation_log())
}
