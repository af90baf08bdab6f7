//! Parallel views, alone and in layers, against rays: what maps of directional lights and of plans are drawn by.

use clerestory::accel::bvh2::Bvh2;
use clerestory::gpu::Area;
use clerestory::raster::{GBuffer, GBufferDesc, Layering, Output, View};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

use crate::gbuffer::{corners, draw, hits, triangles};
use crate::layers::clipped_primitives_change_views;
use crate::oracle::{Oracle, compare};

const SIZE: [u32; 2] = [40, 32];
const PIXELS: usize = (SIZE[0] * SIZE[1]) as usize;
const OUTPUTS: [Output; 2] = [Output::Triangle, Output::Distance];

/// Six parallel views from one place, into all directions and at several widths.
fn directions() -> [(DVec3, f32); 6] {
    [
        (DVec3::new(0.3, -1.0, 0.2), 1.0),
        (DVec3::new(1.0, 0.1, -0.2), 0.5),
        (DVec3::NEG_Z, 0.7),
        (DVec3::NEG_X, 0.3),
        (DVec3::new(-0.2, 0.4, 1.0), 1.2),
        (DVec3::new(0.1, 1.0, 0.1), 0.6),
    ]
}

#[test]
fn parallel_layers_are_as_rays_see_them_in_every_way() {
    with_gpu(|gpu| {
        let has_defect = clipped_primitives_change_views(gpu);
        for address in [
            "builtin:cornell-box",
            "builtin:triangle-soup?n=300&slivers=0.3",
            "builtin:box-city?n=60",
        ] {
            let scene = builtin(address);
            let on_device = GpuScene::new(gpu, &scene).unwrap();
            let surfaces = on_device.surfaces();
            let [lower, upper] = surfaces.bounds;
            let extent = (upper - lower).max_element();
            // Within the scene, so that there is something on both sides of where rays begin.
            let eye = (lower + Vec3::new(0.52, 0.61, 0.47) * (upper - lower)).as_dvec3();
            let area = Area::whole(SIZE);
            let views: Vec<View> = directions()
                .iter()
                .map(|(towards, width)| {
                    let up = if towards.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
                    let camera = orthographic(eye, eye + *towards, up, width * 0.5 * extent);
                    View::of_camera(&camera, &surfaces, area).unwrap()
                })
                .collect();
            let [passes, others @ ..] = [
                Layering::Passes(6),
                Layering::Instances(6),
                Layering::Geometry(6),
                Layering::Views(6),
            ]
            .map(|layering| {
                let desc = GBufferDesc {
                    size: SIZE,
                    layering,
                    outputs: &OUTPUTS,
                };
                let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
                draw(gpu, &gbuffer, &on_device, &views);
                OUTPUTS.map(|output| gbuffer.read::<u32>(gpu, output).unwrap())
            });
            for (way, other) in ["instances", "geometry", "views"].iter().zip(&others) {
                let may_differ = *way == "views" && has_defect;
                assert!(*other == passes || may_differ, "{address}: by {way}, equal bits");
            }
            let corners = corners(&triangles(gpu, &on_device));
            let index = Bvh2::build(&corners, &Default::default()).unwrap();
            let layers = passes[0].chunks(PIXELS).zip(passes[1].chunks(PIXELS));
            let mut covered = 0;
            for ((layer, (seen, distances)), view) in layers.enumerate().zip(&views) {
                let mut oracle = Oracle::new(SIZE, gpu.caps().sub_pixel_bits);
                oracle.add(view, area, &corners);
                let hits = hits(&index, view, SIZE);
                let rays: Vec<u32> = hits.iter().map(|hit| hit.triangle).collect();
                covered += compare(&format!("{address}, layer {layer}"), &oracle, seen, &rays).covered;
                for ((triangle, distance), hit) in seen.iter().zip(distances).zip(&hits) {
                    // The direction of a parallel ray is a unit vector, so that its parameter is the distance.
                    if *triangle == hit.triangle && hit.t.is_finite() {
                        let off = (f32::from_bits(*distance) / hit.t - 1.0).abs();
                        assert!(off < 4.0 * f32::EPSILON, "{address}, layer {layer}: {off}");
                    }
                }
            }
            // A tenth of six layers; the soup is thin.
            assert!(covered > 6 * PIXELS / 10, "{address}: {covered}");
        }
    });
}

/// The camera's own picture is its layer, to the bit, and what is behind it is not in it.
#[test]
fn a_parallel_view_is_alone_what_it_is_in_layers() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:box-city?n=60");
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let surfaces = on_device.surfaces();
        let [lower, upper] = surfaces.bounds;
        let middle = (0.5 * (lower + upper)).as_dvec3();
        let area = Area::whole(SIZE);
        let from = |height: f64| {
            let eye = middle.with_y(f64::from(lower.y) + height * f64::from(upper.y - lower.y));
            let camera = orthographic(eye, eye - DVec3::Y, DVec3::X, 0.4 * (upper - lower).max_element());
            View::of_camera(&camera, &surfaces, area).unwrap()
        };
        let views = [from(1.5), from(0.4)];
        let picture = |layering, views: &[View]| {
            let desc = GBufferDesc {
                size: SIZE,
                layering,
                outputs: &OUTPUTS,
            };
            let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
            draw(gpu, &gbuffer, &on_device, views);
            OUTPUTS.map(|output| gbuffer.read::<u32>(gpu, output).unwrap())
        };
        let both = picture(Layering::Instances(2), &views);
        for (layer, view) in views.iter().enumerate() {
            let alone = picture(Layering::One, &[*view]);
            for (all, one) in both.iter().zip(&alone) {
                assert!(all[layer * PIXELS..][..PIXELS] == one[..], "layer {layer}");
            }
        }
        // From below the roofs the highest ones are behind the eye.
        assert_ne!(both[0][..PIXELS], both[0][PIXELS..]);
        let greatest = |layer: usize| {
            let all = both[1][layer * PIXELS..][..PIXELS]
                .iter()
                .map(|bits| f32::from_bits(*bits));
            all.filter(|distance| distance.is_finite()).fold(0.0, f32::max)
        };
        assert!((greatest(0) - greatest(1) - 1.1 * (upper.y - lower.y)).abs() < 1e-3 * greatest(0));
    });
}
