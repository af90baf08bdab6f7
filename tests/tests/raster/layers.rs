//! Layers, views, clip distances, parts of images and of targets, and the order of depths: what layered rendering rests on.

use clerestory::gpu::ash::vk;
use clerestory::gpu::interface::{FragmentShader, SampledView, VertexShader};
use clerestory::gpu::{
    Access, Area, BufferDesc, Category, ClearColor, ColorTarget, DepthBias, DepthTarget, GeometryStage, Gpu,
    GpuOptions, GraphicsDesc, GraphicsPipeline, Image, ImageBarrier, ImageDesc, ImagePart, Lesser, NoGeometry,
    OptionalFeatures, Pass, SamplerDesc, Targets,
};
use clerestory::{Error, Result};
use clerestory_tests::shaders::{clip_vert, cube_probe, layer_geom, layer_vert, value_frag, value_vert, view_vert};
use clerestory_tests::{gpu_with, with_gpu};

const SIZE: [u32; 2] = [8, 8];
const LAYERS: u32 = 6;
const NOTHING: u32 = 0xFFFF_FFFE;
const FORMAT: vk::Format = vk::Format::R32_UINT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const COLOR_LAYOUT: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;

type Pipeline<V, G = NoGeometry> = GraphicsPipeline<V, value_frag::Shader, G>;

fn image(gpu: &Gpu, name: &str, format: vk::Format, layers: u32, mips: u32, usage: vk::ImageUsageFlags) -> Image {
    gpu.image(&ImageDesc {
        name,
        size: SIZE,
        layers,
        mips,
        format,
        usage,
        category: Category::Film,
    })
    .unwrap()
}

fn numbers(gpu: &Gpu, layers: u32, mips: u32) -> Image {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    image(gpu, "numbers", FORMAT, layers, mips, usage)
}

fn pipeline<V: VertexShader, G: GeometryStage>(
    gpu: &Gpu,
    change: impl FnOnce(&mut GraphicsDesc<'_, V, value_frag::Shader, G>),
) -> Result<Pipeline<V, G>> {
    let mut desc = GraphicsDesc {
        colors: &[FORMAT],
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        ..GraphicsDesc::default()
    };
    change(&mut desc);
    gpu.graphics_pipeline(&desc)
}

/// Corners in clip space of the rectangle of pixels `x0..x1`, `y0..y1` of a picture of `SIZE`.
fn corners(x: [u32; 2], y: [u32; 2]) -> ([f32; 2], [f32; 2]) {
    let clip = |pixel: u32, size: u32| 2.0 * pixel as f32 / size as f32 - 1.0;
    (
        [clip(x[0], SIZE[0]), clip(y[0], SIZE[1])],
        [clip(x[1], SIZE[0]), clip(y[1], SIZE[1])],
    )
}

macro_rules! rectangle {
    ($shader:ident, $x:expr, $y:expr, $depth:expr, $value:expr) => {{
        let (low, high) = corners($x, $y);
        $shader::Push {
            low,
            high,
            depth: $depth,
            value: $value,
        }
    }};
}

fn to_layout(pass: &mut Pass<'_>, image: &Image, old: vk::ImageLayout, new: vk::ImageLayout, uses: [Access; 2]) {
    pass.image_barrier(&[ImageBarrier {
        image,
        from: uses[0],
        to: uses[1],
        old_layout: old,
        new_layout: new,
    }]);
}

/// Runs `draw` between the layouts that it and the copy want, and reads all layers of the first mip level of `image`.
fn picture(gpu: &Gpu, image: &Image, draw: impl FnOnce(&mut Pass<'_>) -> Result<()>) -> Vec<Vec<u32>> {
    let [width, height] = image.size();
    let texels = (width * height) as usize;
    let count = texels * image.layers() as usize;
    let pixels = gpu.buffer(&BufferDesc::readback("pixels", 4 * count as u64)).unwrap();
    let mut recorder = gpu.recorder("layers").unwrap();
    recorder
        .pass("draw", |pass| {
            let (undefined, uses) = (vk::ImageLayout::UNDEFINED, [Access::NONE, Access::COLOR_WRITE]);
            to_layout(pass, image, undefined, COLOR_LAYOUT, uses);
            draw(pass)?;
            let (source, uses) = (
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                [Access::COLOR_WRITE, Access::TRANSFER_READ],
            );
            to_layout(pass, image, COLOR_LAYOUT, source, uses);
            pass.copy_image_to_buffer(image, pixels.view())
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let all: Vec<u32> = pixels.read(0, count).unwrap();
    all.chunks(texels).map(<[u32]>::to_vec).collect()
}

fn cleared(image: &Image) -> Option<ColorTarget<'_>> {
    Some(ColorTarget {
        image,
        clear: Some([NOTHING; 4].into()),
    })
}

/// A picture of `size` with a value in a rectangle.
fn expected(size: [u32; 2], x: [u32; 2], y: [u32; 2], value: u32) -> Vec<u32> {
    let covered = |i: u32| (x[0]..x[1]).contains(&(i % size[0])) && (y[0]..y[1]).contains(&(i / size[0]));
    (0..size[0] * size[1])
        .map(|i| if covered(i) { value } else { NOTHING })
        .collect()
}

#[test]
fn three_ways_to_several_layers_give_one_picture() {
    with_gpu(|gpu| {
        let caps = gpu.caps();
        assert!(caps.vertex_layer && caps.geometry_shader && caps.max_views >= LAYERS);
        let target = numbers(gpu, LAYERS, 1);
        let (x, y, first) = ([1, 7], [2, 5], 40);
        let expected: Vec<_> = (0..LAYERS).map(|layer| expected(SIZE, x, y, first + layer)).collect();
        let colors = [cleared(&target)];
        let targets = Targets {
            colors: &colors,
            ..Targets::default()
        };
        let by_vertex = pipeline(gpu, |_| ()).unwrap();
        let push = rectangle!(layer_vert, x, y, 0.5, first);
        let found = picture(gpu, &target, |pass| {
            pass.render(&targets, |render| {
                render.draw::<layer_vert::Shader, _, NoGeometry>(&by_vertex, &[], &push, 4, LAYERS)
            })
        });
        assert_eq!(found, expected, "layers by vertex shader");
        let by_geometry = pipeline::<value_vert::Shader, layer_geom::Shader>(gpu, |desc| {
            desc.geometry = layer_geom::Spec { layers: LAYERS as i32 };
        })
        .unwrap();
        let push = rectangle!(value_vert, x, y, 0.5, first);
        let found = picture(gpu, &target, |pass| {
            pass.render(&targets, |render| render.draw(&by_geometry, &[], &push, 4, 1))
        });
        assert_eq!(found, expected, "layers by geometry shader");
        let view_mask = (1 << LAYERS) - 1;
        let by_view: Pipeline<view_vert::Shader> = pipeline(gpu, |desc| desc.view_mask = view_mask).unwrap();
        let push = rectangle!(view_vert, x, y, 0.5, first);
        let views = Targets { view_mask, ..targets };
        let found = picture(gpu, &target, |pass| {
            pass.render(&views, |render| render.draw(&by_view, &[], &push, 4, 1))
        });
        assert_eq!(found, expected, "views");
        // The pipeline's views must be those of the rendering, and the images must have the layers.
        let few = numbers(gpu, 2, 1);
        picture(gpu, &target, |pass| {
            let result = pass.render(&targets, |render| render.draw(&by_view, &[], &push, 4, 1));
            assert!(matches!(result, Err(Error::Shader { .. })), "{result:?}");
            let colors = [cleared(&few)];
            let result = pass.render(
                &Targets {
                    colors: &colors,
                    ..views
                },
                |_| Ok(()),
            );
            assert!(matches!(result, Err(Error::Picture { .. })), "{result:?}");
            Ok(())
        });
    });
}

/// Whether the driver puts primitives that it clips into other views than their own: Mesa's software driver of version 22.3 does, which keeps
/// them for later and then takes the view that it is at.
pub fn clipped_primitives_change_views(gpu: &Gpu) -> bool {
    let target = numbers(gpu, LAYERS, 1);
    let colors = [cleared(&target)];
    let view_mask = (1 << LAYERS) - 1;
    let pipeline: Pipeline<view_vert::Shader> = pipeline(gpu, |desc| desc.view_mask = view_mask).unwrap();
    let targets = Targets {
        colors: &colors,
        view_mask,
        ..Targets::default()
    };
    // Far beyond any guard band.
    let push = view_vert::Push {
        low: [-1e6; 2],
        high: [1e6; 2],
        depth: 0.5,
        value: 1,
    };
    let found = picture(gpu, &target, |pass| {
        pass.render(&targets, |render| render.draw(&pipeline, &[], &push, 4, 1))
    });
    let right = (0..LAYERS).map(|layer| vec![1 + layer; (SIZE[0] * SIZE[1]) as usize]);
    println!(
        "clipped primitives by views: {:?}",
        found.iter().map(|layer| layer[0]).collect::<Vec<_>>()
    );
    !right.eq(found)
}

#[test]
fn clipped_primitives_stay_in_their_views_but_on_a_driver_with_a_defect() {
    with_gpu(|gpu| {
        let is_known = gpu.caps().driver.contains("Mesa 22.3");
        assert_eq!(clipped_primitives_change_views(gpu), is_known, "{}", gpu.caps().driver);
    });
}

#[test]
fn clip_distances_cut_and_areas_confine() {
    with_gpu(|gpu| {
        let target = numbers(gpu, 1, 1);
        let colors = [cleared(&target)];
        let targets = Targets {
            colors: &colors,
            ..Targets::default()
        };
        let clipped: Pipeline<clip_vert::Shader> = pipeline(gpu, |_| ()).unwrap();
        let push = rectangle!(clip_vert, [0, 8], [1, 4], 0.5, 7);
        let found = picture(gpu, &target, |pass| {
            pass.render(&targets, |render| render.draw(&clipped, &[], &push, 4, 1))
        });
        assert_eq!(found, [expected(SIZE, [4, 8], [1, 4], 7)]);
        // Two tiles of an atlas in one rendering, then a part alone, whose surroundings keep what they have.
        let plain: Pipeline<value_vert::Shader> = pipeline(gpu, |_| ()).unwrap();
        let area = |x: u32, y: u32, width: u32, height: u32| Area {
            offset: [x, y],
            size: [width, height],
        };
        let found = picture(gpu, &target, |pass| {
            pass.render(&targets, |render| {
                for (tile, value) in [(area(0, 0, 4, 4), 1), (area(4, 2, 2, 6), 2)] {
                    render.set_area(tile)?;
                    // More than all of the tile.
                    let push = value_vert::Push {
                        low: [-2.0; 2],
                        high: [2.0; 2],
                        depth: 0.5,
                        value,
                    };
                    render.draw(&plain, &[], &push, 4, 1)?;
                }
                let result = render.set_area(area(4, 4, 5, 1));
                assert!(matches!(result, Err(Error::Picture { .. })), "{result:?}");
                Ok(())
            })?;
            pass.image_barrier(&[ImageBarrier {
                image: &target,
                from: Access::COLOR_WRITE,
                to: Access::COLOR_WRITE,
                old_layout: COLOR_LAYOUT,
                new_layout: COLOR_LAYOUT,
            }]);
            let colors = [Some(ColorTarget {
                image: &target,
                clear: Some(ClearColor::Uint([3; 4])),
            })];
            let part = Targets {
                colors: &colors,
                area: Some(area(6, 0, 2, 2)),
                ..Targets::default()
            };
            pass.render(&part, |_| Ok(()))?;
            let outside = Targets {
                area: Some(area(6, 0, 3, 2)),
                ..part
            };
            let result = pass.render(&outside, |_| Ok(()));
            assert!(matches!(result, Err(Error::Picture { .. })), "{result:?}");
            Ok(())
        });
        let tiles = [([0, 4], [0, 4], 1), ([4, 6], [2, 8], 2), ([6, 8], [0, 2], 3)];
        for (i, value) in (0..).zip(&found[0]) {
            let (x, y) = (i % SIZE[0], i / SIZE[0]);
            let tile = tiles
                .iter()
                .find(|(xs, ys, _)| (xs[0]..xs[1]).contains(&x) && (ys[0]..ys[1]).contains(&y));
            assert_eq!(*value, tile.map_or(NOTHING, |(.., value)| *value), "pixel {x}, {y}");
        }
    });
}

#[test]
fn an_area_of_what_every_device_renders_needs_no_image() {
    with_gpu(|gpu| {
        let area = |x, y, width, height| Area {
            offset: [x, y],
            size: [width, height],
        };
        let mut recorder = gpu.recorder("nothing").expect("recorder");
        let recorded = recorder.pass("without an image", |pass| {
            let of = |area, view_mask| Targets {
                area,
                view_mask,
                ..Targets::default()
            };
            pass.render(&of(Some(area(3, 0, 4093, 4096)), 0), |_| Ok(()))?;
            for refused in [
                of(None, 0),
                of(Some(area(0, 0, 4097, 1)), 0),
                of(Some(area(0, 1, 1, 4096)), 0),
                of(Some(area(0, 0, 0, 1)), 0),
                of(Some(area(0, 0, 1, 1)), 1),
            ] {
                let result = pass.render(&refused, |_| Ok(()));
                assert!(matches!(result, Err(Error::Picture { .. })), "{refused:?}: {result:?}");
            }
            Ok(())
        });
        recorded.expect("recorded");
        recorder
            .submit()
            .and_then(|submission| submission.wait())
            .expect("device");
    });
}

#[test]
fn depths_compare_as_told_and_counts_come_from_buffers() {
    with_gpu(|gpu| {
        let target = numbers(gpu, 1, 1);
        let depth = image(gpu, "depth", DEPTH, 1, 1, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
        let arguments = gpu.buffer_with("counts", Category::Work, &[4u32, 1, 0, 0]).unwrap();
        let colors = [cleared(&target)];
        let run = |compare, cleared_to, bias, depths: [f32; 2]| {
            let pipeline: Pipeline<value_vert::Shader> = pipeline(gpu, |desc| {
                desc.depth = Some(DEPTH);
                desc.depth_compare = compare;
                desc.depth_bias = bias;
            })
            .unwrap();
            let targets = Targets {
                colors: &colors,
                depth: Some(DepthTarget {
                    image: &depth,
                    clear: Some(cleared_to),
                }),
                ..Targets::default()
            };
            let found = picture(gpu, &target, |pass| {
                let uses = [Access::NONE, Access::DEPTH_WRITE];
                let layout = vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL;
                to_layout(pass, &depth, vk::ImageLayout::UNDEFINED, layout, uses);
                pass.render(&targets, |render| {
                    for (value, depth) in (1..).zip(depths) {
                        let push = rectangle!(value_vert, [0, 8], [0, 8], depth, value);
                        render.draw_indirect(&pipeline, &[], &push, arguments.view())?;
                    }
                    Ok(())
                })
            });
            found[0][0]
        };
        use vk::CompareOp as Compare;
        assert_eq!(run(Compare::LESS_OR_EQUAL, 1.0, None, [0.25, 0.75]), 1);
        assert_eq!(run(Compare::LESS_OR_EQUAL, 1.0, None, [0.25, 0.25]), 2);
        assert_eq!(run(Compare::LESS, 1.0, None, [0.25, 0.25]), 1);
        assert_eq!(run(Compare::GREATER, 0.0, None, [0.25, 0.75]), 2);
        assert_eq!(run(Compare::GREATER, 0.5, None, [0.25, 0.25]), NOTHING);
        // A bias of two steps carries an equal depth over the other.
        let bias = |constant| Some(DepthBias { constant, slope: 0.0 });
        assert_eq!(run(Compare::LESS, 0.5, bias(-2.0), [0.75, 0.5]), 2);
        assert_eq!(run(Compare::LESS, 0.5, bias(2.0), [0.75, 0.5]), NOTHING);
    });
}

#[test]
fn layers_and_mips_are_images_and_six_layers_a_cube() {
    with_gpu(|gpu| {
        let plain: Pipeline<value_vert::Shader> = pipeline(gpu, |_| ()).unwrap();
        let whole = numbers(gpu, 2, 3);
        for (layer, mip, size) in [(1, 0, [8, 8]), (0, 2, [2, 2])] {
            let part = whole.part(&ImagePart::layer(layer, mip)).unwrap();
            assert_eq!((part.size(), part.layers(), part.mips()), (size, 1, 1));
            let colors = [cleared(&part)];
            let targets = Targets {
                colors: &colors,
                ..Targets::default()
            };
            let push = rectangle!(value_vert, [0, 4], [0, 8], 0.5, layer + 10 * mip);
            let found = picture(gpu, &part, |pass| {
                pass.render(&targets, |render| render.draw(&plain, &[], &push, 4, 1))
            });
            assert_eq!(
                found,
                [expected(size, [0, size[0] / 2], [0, size[1]], layer + 10 * mip)]
            );
        }
        let cube_kind = ImagePart {
            layers: 0..2,
            mips: 0..1,
            kind: vk::ImageViewType::CUBE,
        };
        for part in [
            cube_kind,
            ImagePart::layer(2, 0),
            ImagePart::layer(0, 3),
            ImagePart {
                layers: 0..2,
                ..ImagePart::layer(0, 0)
            },
        ] {
            let refused = whole.part(&part);
            assert!(matches!(refused, Err(Error::Picture { .. })), "{part:?}");
        }
        // Each face of a cube gets a colour, one of its own.
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
        let faces = image(gpu, "faces", vk::Format::R32G32B32A32_SFLOAT, LAYERS, 1, usage);
        let cube = faces
            .part(&ImagePart {
                layers: 0..LAYERS,
                mips: 0..1,
                kind: vk::ImageViewType::CUBE,
            })
            .unwrap();
        let sampler = gpu
            .sampler(&SamplerDesc {
                name: "nearest",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })
            .unwrap();
        let seen = gpu
            .buffer_with("seen", Category::Work, &[[0.0f32; 4]; LAYERS as usize])
            .unwrap();
        let probe = gpu.compute_pipeline::<cube_probe::Kernel>(&()).unwrap();
        let color = |face: u32| [face as f32, 0.5, -1.0, 1.0];
        let mut recorder = gpu.recorder("cube").unwrap();
        recorder
            .pass("fill and look", |pass| {
                to_layout(
                    pass,
                    &faces,
                    vk::ImageLayout::UNDEFINED,
                    COLOR_LAYOUT,
                    [Access::NONE, Access::COLOR_WRITE],
                );
                for face in 0..LAYERS {
                    let part = faces.part(&ImagePart::layer(face, 0))?;
                    let colors = [Some(ColorTarget {
                        image: &part,
                        clear: Some(color(face).into()),
                    })];
                    let targets = Targets {
                        colors: &colors,
                        ..Targets::default()
                    };
                    pass.render(&targets, |_| Ok(()))?;
                }
                let uses = [Access::COLOR_WRITE, Access::COMPUTE_READ];
                to_layout(
                    pass,
                    &faces,
                    COLOR_LAYOUT,
                    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
                    uses,
                );
                let set = cube_probe::Set0 {
                    cube: SampledView {
                        image: &cube,
                        sampler: &sampler,
                    },
                    seen: seen.view(),
                };
                pass.dispatch(&probe, &[&set], &(), [1, 1, 1])
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let seen: Vec<[f32; 4]> = gpu.read(seen.view(), LAYERS as usize).unwrap();
        assert_eq!(seen, (0..LAYERS).map(color).collect::<Vec<_>>());
    });
}

/// What making a pipeline of these shaders says on a device that lacks all that is optional.
fn refusal<V: VertexShader, G: GeometryStage>(gpu: &Gpu, view_mask: u32) -> (String, String, String)
where
    value_frag::Shader: FragmentShader,
{
    match pipeline::<V, G>(gpu, |desc| desc.view_mask = view_mask) {
        Err(Error::MissingFeature {
            feature,
            needed_by,
            instead,
            ..
        }) => (feature, needed_by, instead),
        other => panic!("expected a missing feature, got {:?}", other.map(|_| ())),
    }
}

#[test]
fn what_a_device_lacks_is_named_with_a_way_round() {
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let caps = gpu.caps();
    assert!(!caps.geometry_shader && !caps.vertex_layer && caps.max_views == 0 && caps.max_clip_distances == 0);
    for ((feature, needed_by, instead), expected) in [
        (
            refusal::<layer_vert::Shader, NoGeometry>(&gpu, 0),
            ["shaderOutputLayer", "layer.vert", "geometry shader"],
        ),
        (
            refusal::<value_vert::Shader, layer_geom::Shader>(&gpu, 0),
            ["geometryShader", "layer.geom", "views"],
        ),
        (
            refusal::<clip_vert::Shader, NoGeometry>(&gpu, 0),
            ["shaderClipDistance", "clip.vert", "discard"],
        ),
        (
            refusal::<view_vert::Shader, NoGeometry>(&gpu, 1),
            ["multiview", "view.vert", "once for each view"],
        ),
        (
            refusal::<value_vert::Shader, NoGeometry>(&gpu, 1),
            ["maxMultiviewViewCount", "value.vert", "once for each view"],
        ),
    ] {
        let found = [feature, needed_by, instead];
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.contains(expected), "{found:?} says nothing of {expected:?}");
        }
    }
    clerestory_tests::assert_no_messages(&gpu);
}
