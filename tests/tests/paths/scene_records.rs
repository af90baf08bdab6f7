//! The records of a scene: kernels load them by texels, word for word as the host's structs have them.

use bytemuck::{Pod, Zeroable};
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::scene::records;
use clerestory::gpu::shaders::sets::{MediaSet, SceneSet};
use clerestory::gpu::{Access, BufferDesc, Category, Gpu, TexelView};
use clerestory::transport::light_tree::LightTree;
use clerestory_tests::with_gpu;

/// A record in which each word is another float, so that no word passes for its neighbour.
fn numbered<T: Pod>(first: u16) -> T {
    let mut record = T::zeroed();
    let words: &mut [u32] = bytemuck::cast_slice_mut(bytemuck::bytes_of_mut(&mut record));
    for (i, word) in (0u16..).zip(words) {
        *word = f32::from(first + i).to_bits();
    }
    record
}

fn texels<T: Pod>(gpu: &Gpu, record: T) -> TexelView {
    let format = vk::Format::R32G32B32A32_UINT;
    gpu.texels_with("record", Category::Staging, format, &[record]).unwrap()
}

#[test]
fn kernels_load_every_word_of_a_record() {
    with_gpu(|gpu| {
        let mut wanted = records::SceneRecords::zeroed();
        wanted.triangle = numbered(1);
        wanted.material = numbered(101);
        wanted.texture_record = numbered(201);
        wanted.light = numbered(301);
        wanted.environment = numbered(401);
        wanted.medium = numbered(501);
        wanted.light_node = numbered(601);
        // One node, which the trails of eight lights stand behind.
        wanted.light_node.node_count = 1;
        let trails: [u32; 8] = std::array::from_fn(|light| 700 + light as u32);
        wanted.trails = [trails[0], trails[5]];
        wanted.instance = numbered(801);
        let triangles = texels(gpu, wanted.triangle);
        let materials = texels(gpu, wanted.material);
        let textures = texels(gpu, wanted.texture_record);
        let lights = texels(gpu, wanted.light);
        let environment = texels(gpu, wanted.environment);
        let medium = texels(gpu, wanted.medium);
        let tree = LightTree {
            nodes: vec![wanted.light_node],
            trails: trails.to_vec(),
        };
        let format = vk::Format::R32G32B32A32_UINT;
        let tree = gpu
            .texels_with("tree", Category::Staging, format, &tree.bytes())
            .unwrap();
        let instance = texels(gpu, wanted.instance);
        let no_words = texels(gpu, [0u32; 4]);
        let no_floats = gpu
            .texels_with("none", Category::Staging, vk::Format::R32_SFLOAT, &[0.0f32])
            .unwrap();
        let scene = SceneSet {
            scene_triangles: &triangles,
            scene_vertices: &no_words,
            scene_normals: &no_floats,
            scene_uvs: &no_floats,
            scene_tangents: &no_floats,
            scene_colors: &no_floats,
            scene_materials: &materials,
            scene_textures: &textures,
            scene_texels: &no_words,
            scene_lights: &lights,
            scene_cdf: &no_floats,
            scene_environment: &environment,
            scene_albedo_table: &no_floats,
            scene_light_tree: &tree,
            scene_instances: &instance,
        };
        let media = MediaSet {
            media_records: &medium,
            media_densities: &no_floats,
            media_majorants: &no_floats,
        };
        let bytes = size_of::<records::SceneRecords>() as u64;
        let output = gpu
            .buffer(&BufferDesc::storage("records", bytes, Category::Staging))
            .unwrap();
        let kernel = gpu.compute_pipeline::<records::Kernel>(&()).unwrap();
        let mut recorder = gpu.recorder("records").unwrap();
        recorder
            .pass("load", |pass| {
                let set = records::Set0 { records: output.view() };
                pass.dispatch(&kernel, &[&set, &scene, &media], &(), [1, 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let got = gpu.read::<records::SceneRecords>(output.view(), 1).unwrap()[0];
        assert_eq!(got, wanted);
    });
}
