//! Random numbers, bit for bit.

use clerestory::transport::random::{
    Sampler, SamplerKind, owen_scramble, pcg3d, pcg4d, sample_1d, sample_2d, sampler_bits, sobol_pascal,
};
use clerestory_tests::random::Random;
use clerestory_tests::shaders::types::{RandomCase, RandomWords};
use clerestory_tests::twin::random_words;
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
                // The slots of a joint sequence are the first eight: with indices of all bits, too.
                dimension: if i < 8192 { i % 16 } else { word() },
                seed: if i < 4096 { 7 } else { word() },
            })
            .collect();
        for kind in [SamplerKind::Sobol, SamplerKind::Pcg, SamplerKind::JointSobol] {
            for (c, r) in table.iter().zip(random_words(gpu, kind, &table)) {
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
