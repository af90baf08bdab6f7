//! Normal maps in the G-buffer against the twin of the path tracer's own.

use clerestory::gpu::shaders::constants::SHADING_NORMAL_BITS;
use clerestory::gpu::{Area, Gpu};
use clerestory::maps::packed_direction::unpack_octahedral;
use clerestory::raster::{GBuffer, GBufferDesc, Layering, Output, SurfaceFeatures, View};
use clerestory::scene::normal_map::mapped_normal;
use clerestory::scene::{Filter, Image, Material, Scene, Texture, Wrap};
use clerestory::transport::GpuScene;
use clerestory_tests::render::{camera_down, floor};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::gbuffer::{draw, looking};

const SIZE: [u32; 2] = [32, 32];
/// Four texels, each leaning another way, and one that is null.
const TEXELS: [[u8; 4]; 4] = [
    [255, 128, 128, 255],
    [128, 255, 200, 255],
    [40, 60, 230, 255],
    [128, 128, 255, 255],
];

/// A floor seen from above, two squares wide, whose normals lean as well.
fn scene(scale: f32, handedness: f32, mapped: bool) -> Scene {
    let mut scene = looking(camera_down(1.0, 3.0));
    let image = scene.add_image(Image {
        name: "bumps".into(),
        width: 2,
        height: 2,
        texels: TEXELS.to_vec(),
    });
    let texture = Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::ClampToEdge; 2],
        filter: Filter::Nearest,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    };
    let material = scene.add_material(Material {
        normal_texture: mapped.then_some(texture),
        normal_scale: scale,
        ..Material::lambert("bumps", Vec3::splat(0.5))
    });
    let mut mesh = floor("bumps", material, 1.0, 0.0);
    mesh.uv0 = mesh
        .positions
        .iter()
        .map(|p| Vec2::new(p.x + 1.0, p.z + 1.0) * 0.5)
        .collect();
    mesh.normals = vec![normal(); mesh.positions.len()];
    mesh.tangents = vec![tangent(handedness); mesh.positions.len()];
    scene.place(mesh);
    scene
}

fn normal() -> Vec3 {
    Vec3::new(0.3, 0.9, -0.1).normalize()
}

fn tangent(handedness: f32) -> Vec4 {
    Vec3::new(0.8, 0.1, 0.4).normalize().extend(handedness)
}

fn shading_normals(gpu: &Gpu, scene: &Scene) -> (Vec<DVec3>, SurfaceFeatures) {
    let on_device = GpuScene::new(gpu, scene).unwrap();
    let surfaces = on_device.surfaces();
    let desc = GBufferDesc {
        size: SIZE,
        layering: Layering::One,
        outputs: &[Output::Normals],
    };
    let gbuffer = GBuffer::new(gpu, &surfaces, &desc).unwrap();
    let view = View::of_camera(&scene.cameras[0], &surfaces, Area::whole(SIZE)).unwrap();
    draw(gpu, &gbuffer, &on_device, &[view]);
    let words: Vec<[u32; 2]> = gbuffer.read(gpu, Output::Normals).unwrap();
    let both = words
        .iter()
        .map(|pair| pair.map(|word| unpack_octahedral(word, SHADING_NORMAL_BITS)));
    let normals = both.map(|[geometric, shading]| {
        assert!((geometric - DVec3::Y).length() < 1e-4, "{geometric}");
        shading
    });
    (normals.collect(), surfaces.features)
}

#[test]
fn normal_maps_lead_shading_normals() {
    with_gpu(|gpu| {
        for (scale, handedness) in [(1.0f32, 1.0f32), (1.0, -1.0), (0.4, 1.0), (0.0, 1.0)] {
            let (normals, features) = shading_normals(gpu, &scene(scale, handedness, true));
            assert!(features.normal_maps);
            let mut seen = std::collections::BTreeSet::new();
            for (pixel, found) in (0..).zip(&normals) {
                // Sixteen pixels to a texel: the picture shows u to the right and v downwards.
                let texel = (pixel / SIZE[0] / 16 * 2 + pixel % SIZE[0] / 16) as usize;
                let rgb = TEXELS[texel].map(|byte| f64::from(byte) / 255.0);
                let expected = mapped_normal(
                    normal().as_dvec3(),
                    tangent(handedness).as_dvec4(),
                    DVec3::new(rgb[0], rgb[1], rgb[2]),
                    scale.into(),
                );
                // The packing's bound, 6.6·10⁻⁵, and some roundings.
                assert!(
                    (*found - expected).length() < 8e-5,
                    "pixel {pixel}, texel {texel}: {found} {expected}"
                );
                seen.insert(found.to_array().map(f64::to_bits));
            }
            assert_eq!(seen.len(), if scale == 0.0 { 1 } else { 4 }, "{scale}");
        }
        // Without a map the interpolated normal, to the bit what a map that is switched off leaves of it but for two roundings.
        let (plain, features) = shading_normals(gpu, &scene(1.0, 1.0, false));
        assert!(!features.normal_maps);
        assert!(plain.iter().all(|n| (*n - normal().as_dvec3()).length() < 8e-5));
    });
}
