//! Random numbers, bit for bit.

use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::transport::random::{
    Sampler, SamplerKind, owen_scramble, pcg3d, pcg4d, sample_1d, sample_2d, sampler_bits, sobol_pascal,
};
use clerestory_tests::random::Random;
use clerestory_tests::shaders::twin_random;
use clerestory_tests::shaders::types::{RandomCase, RandomWords};
use clerestory_tests::with_gpu;
use glam::{UVec3, UVec4};

#[test]
fn random_numbers_are_equal_bit_for_bit() {
    with_gpu(|gpu| {
        let mut random = Random(1);
        let words = [0, 1, 2, 63, 64, 0x7fff_ffff, 0x8000_0000, u32::MAX];
        let mut word = || {
            if random.below(4) == 0 {
                random.choose(&words)
            } else {
                random.word()
            }
        };
        let table: Vec<RandomCase> = (0..20_000)
            .map(|i| RandomCase {
                pixel: if i < 4096 { 5 } else { word() },
                sample_index: if i < 4096 { i } else { word() },
                dimension: if i < 4096 { 3 } else { word() },
                seed: if i < 4096 { 7 } else { word() },
            })
            .collect();
        for kind in [SamplerKind::Sobol, SamplerKind::Pcg] {
            for (c, r) in table.iter().zip(run_random(gpu, kind, &table)) {
                let mut s = Sampler {
                    pixel: c.pixel,
                    sample_index: c.sample_index,
                    dimension: c.dimension,
                    seed: c.seed,
                };
                let bits = sampler_bits(&s, kind);
                let (one, two) = (sample_1d(&mut s, kind), sample_2d(&mut s, kind));
                let expected = RandomWords {
                    bits,
                    pcg3: pcg3d(UVec3::new(c.pixel, c.sample_index, c.dimension)).to_array(),
                    pcg4: pcg4d(UVec4::new(c.pixel, c.sample_index, c.dimension, c.seed)).to_array(),
                    scrambled: owen_scramble(c.sample_index, c.seed),
                    pascal: sobol_pascal(c.sample_index),
                    one: one as f32,
                    two: [two.x as f32, two.y as f32],
                    next_dimension: s.dimension,
                };
                assert_eq!(r, expected, "{kind:?} {c:?}");
            }
        }
    });
}

fn run_random(gpu: &Gpu, kind: SamplerKind, table: &[RandomCase]) -> Vec<RandomWords> {
    let pipeline = gpu
        .compute_pipeline::<twin_random::Kernel>(&twin_random::Spec {
            sampler_kind: kind as u32,
        })
        .unwrap();
    let input = gpu.buffer_with("cases", Category::Work, table).unwrap();
    let bytes = (table.len() * size_of::<RandomWords>()) as u64;
    let output = gpu
        .buffer(&BufferDesc::storage("results", bytes, Category::Work))
        .unwrap();
    let mut recorder = gpu.recorder("random").unwrap();
    recorder
        .pass("random", |pass| {
            let set = twin_random::Set0 {
                random_cases: input.view(),
                random_results: output.view(),
            };
            let case_count = table.len() as u32;
            pass.dispatch(
                &pipeline,
                &[&set],
                &twin_random::Push { case_count },
                [pipeline.groups_for(case_count), 1, 1],
            )
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    gpu.read(output.view(), table.len()).unwrap()
}
