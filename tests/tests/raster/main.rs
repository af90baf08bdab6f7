//! Rendering: exact coverage, depth, kept contents, refused mistakes, and barriers of what vertex and fragment shaders read. The rest of the
//! raster floor has files of its own.

mod coverage;
mod cuts;
mod directions;
mod gbuffer;
mod layers;
mod normal_maps;
mod oracle;
mod parallel;
mod splat_atlas;
mod splats;
mod upsample;
mod view_shadows;

use clerestory::gpu::ash::vk;
use clerestory::gpu::{
    Access, Buffer, BufferDesc, Category, ColorTarget, DepthTarget, Gpu, GraphicsDesc, GraphicsPipeline, Image,
    ImageBarrier, ImageDesc, Targets,
};
use clerestory::{Error, Result};
use clerestory_tests::shaders::{quad_frag, quad_vert};
use clerestory_tests::with_gpu;

const SIZE: [u32; 2] = [16, 8];
const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

type Quad = GraphicsPipeline<quad_vert::Shader, quad_frag::Shader>;

fn image(gpu: &Gpu, name: &str, format: vk::Format, size: [u32; 2], usage: vk::ImageUsageFlags) -> Image {
    gpu.image(&ImageDesc {
        name,
        size,
        layers: 1,
        mips: 1,
        format,
        usage,
        category: Category::Film,
    })
    .unwrap()
}

struct Scene {
    color: Image,
    depth: Image,
    palette: Buffer,
    pixels: Buffer,
    pipeline: Quad,
}

impl Scene {
    fn new(gpu: &Gpu) -> Self {
        let attachment = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        Self {
            color: image(gpu, "colour", COLOR, SIZE, attachment),
            depth: image(gpu, "depth", DEPTH, SIZE, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
            palette: gpu
                .buffer_with(
                    "palette",
                    Category::Material,
                    &[[1.0f32, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]],
                )
                .unwrap(),
            pixels: gpu
                .buffer(&BufferDesc::readback("pixels", u64::from(4 * SIZE[0] * SIZE[1])))
                .unwrap(),
            pipeline: gpu
                .graphics_pipeline(&GraphicsDesc {
                    colors: &[COLOR],
                    depth: Some(DEPTH),
                    topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
                    ..GraphicsDesc::default()
                })
                .unwrap(),
        }
    }

    fn to_attachments(&self, pass: &mut clerestory::gpu::Pass<'_>) {
        let barrier = |image, to, new_layout| ImageBarrier {
            image,
            from: Access::NONE,
            to,
            old_layout: vk::ImageLayout::UNDEFINED,
            new_layout,
        };
        pass.image_barrier(&[
            barrier(
                &self.color,
                Access::COLOR_WRITE,
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            ),
            barrier(
                &self.depth,
                Access::DEPTH_WRITE,
                vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
            ),
        ]);
    }

    fn draw(&self, pass: &mut clerestory::gpu::Pass<'_>, clear: bool, quads: &[quad_vert::Push]) -> Result<()> {
        let targets = Targets {
            colors: &[Some(ColorTarget {
                image: &self.color,
                clear: clear.then_some([0.0, 0.0, 1.0, 1.0].into()),
            })],
            depth: Some(DepthTarget {
                image: &self.depth,
                clear: clear.then_some(1.0),
            }),
            ..Targets::default()
        };
        let set = quad_frag::Set0 {
            palette: self.palette.view(),
        };
        pass.render(&targets, |render| {
            quads
                .iter()
                .try_for_each(|push| render.draw(&self.pipeline, &[&set], push, 4, 1))
        })
    }
}

/// A rectangle of pixels `x0..x1`, `y0..y1`.
fn quad(x: [u32; 2], y: [u32; 2], depth: f32, color: u32) -> quad_vert::Push {
    let clip = |pixel: u32, size: u32| 2.0 * pixel as f32 / size as f32 - 1.0;
    quad_vert::Push {
        low: [clip(x[0], SIZE[0]), clip(y[0], SIZE[1])],
        high: [clip(x[1], SIZE[0]), clip(y[1], SIZE[1])],
        depth,
        color,
    }
}

#[test]
fn rectangles_cover_their_pixels_and_the_nearer_one_wins() {
    with_gpu(|gpu| {
        let scene = Scene::new(gpu);
        let mut recorder = gpu.recorder("raster").unwrap();
        recorder
            .pass("first", |pass| {
                scene.to_attachments(pass);
                scene.draw(
                    pass,
                    true,
                    &[quad([2, 10], [1, 5], 0.5, 0), quad([8, 14], [2, 7], 0.7, 1)],
                )
            })
            .unwrap();
        recorder
            .pass("second", |pass| {
                pass.image_barrier(&[
                    ImageBarrier {
                        image: &scene.color,
                        from: Access::COLOR_WRITE,
                        to: Access::COLOR_WRITE,
                        old_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                        new_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                    },
                    ImageBarrier {
                        image: &scene.depth,
                        from: Access::DEPTH_WRITE,
                        to: Access::DEPTH_WRITE,
                        old_layout: vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
                        new_layout: vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
                    },
                ]);
                scene.draw(pass, false, &[quad([0, 4], [0, 3], 0.2, 1)])
            })
            .unwrap();
        recorder
            .pass("copy", |pass| {
                pass.image_barrier(&[ImageBarrier {
                    image: &scene.color,
                    from: Access::COLOR_WRITE,
                    to: Access::TRANSFER_READ,
                    old_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                    new_layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                }]);
                pass.copy_image_to_buffer(&scene.color, scene.pixels.view())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let pixels: Vec<[u8; 4]> = scene.pixels.read(0, (SIZE[0] * SIZE[1]) as usize).unwrap();
        let inside =
            |x: u32, y: u32, xs: [u32; 2], ys: [u32; 2]| (xs[0]..xs[1]).contains(&x) && (ys[0]..ys[1]).contains(&y);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let expected = if inside(x, y, [0, 4], [0, 3]) {
                    [0, 255, 0, 255]
                } else if inside(x, y, [2, 10], [1, 5]) {
                    [255, 0, 0, 255]
                } else if inside(x, y, [8, 14], [2, 7]) {
                    [0, 255, 0, 255]
                } else {
                    [0, 0, 255, 255]
                };
                assert_eq!(pixels[(y * SIZE[0] + x) as usize], expected, "pixel {x}, {y}");
            }
        }
    });
}

#[test]
#[cfg(debug_assertions)]
fn a_fragment_shaders_reads_want_a_barrier() {
    with_gpu(|gpu| {
        let scene = Scene::new(gpu);
        let run = |to: Access| {
            let mut recorder = gpu.recorder("hazard")?;
            recorder.pass("fill", |pass| {
                scene.to_attachments(pass);
                pass.fill(scene.palette.view(), 0)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, to);
                Ok(())
            })?;
            recorder.pass("draw", |pass| scene.draw(pass, true, &[quad([0, 4], [0, 4], 0.5, 0)]))?;
            recorder.submit()?.wait()
        };
        run(Access::FRAGMENT_READ).unwrap();
        match run(Access::VERTEX_READ) {
            Err(Error::MissingBarrier { pass, buffer, .. }) => {
                assert_eq!((pass.as_str(), buffer.as_str()), ("draw", "palette"));
            }
            other => panic!("expected a missing barrier, got {other:?}"),
        }
    });
}

#[test]
fn mistakes_are_refused() {
    with_gpu(|gpu| {
        let scene = Scene::new(gpu);
        // A pipeline for other attachments than those rendered into.
        let other: Quad = gpu
            .graphics_pipeline(&GraphicsDesc {
                colors: &[COLOR],
                ..GraphicsDesc::default()
            })
            .unwrap();
        let set = quad_frag::Set0 {
            palette: scene.palette.view(),
        };
        let small = image(
            gpu,
            "small",
            DEPTH,
            [4, 4],
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        );
        let color = [Some(ColorTarget {
            image: &scene.color,
            clear: Some([0.0; 4].into()),
        })];
        let depth = |image| {
            Some(DepthTarget {
                image,
                clear: Some(1.0),
            })
        };
        let mut recorder = gpu.recorder("mistakes").unwrap();
        recorder
            .pass("all", |pass| {
                scene.to_attachments(pass);
                let targets = Targets {
                    colors: &color,
                    depth: depth(&scene.depth),
                    ..Targets::default()
                };
                let push = quad([0, 1], [0, 1], 0.0, 0);
                let result = pass.render(&targets, |render| render.draw(&other, &[&set], &push, 4, 1));
                assert!(matches!(result, Err(Error::Shader { .. })), "{result:?}");
                let result = pass.render(&targets, |render| render.draw(&scene.pipeline, &[], &push, 4, 1));
                assert!(matches!(&result, Err(Error::Shader { message, .. }) if message.contains("palette")));
                let sizes = Targets {
                    depth: depth(&small),
                    ..targets
                };
                let result = pass.render(&sizes, |_| Ok(()));
                assert!(
                    matches!(&result, Err(Error::Picture { path, .. }) if path == "small"),
                    "{result:?}"
                );
                let result = pass.render(&Targets::default(), |_| Ok(()));
                assert!(matches!(result, Err(Error::Picture { .. })), "{result:?}");
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
    });
}
