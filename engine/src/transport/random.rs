//! Counter-based random numbers: nothing is stored between draws but the four words of [`Sampler`].
//!
//! Method: PCG hashes of Jarzynski and Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020); shuffled and Owen-scrambled
//! Sobol' (0,2)-sequence padded by slots of two dimensions, Burley, "Practical Hash-based Owen Scrambling" (JCGT 10(4), 2020),
//! with the hash constants of Vegdahl (2021). Jointly stratified, the first slots of a stream are pairs of one sequence of sixteen dimensions
//! ([`super::sobol`]). Guarantees: a draw is a pure function of (seed, pixel, sample index, dimension);
//! values lie on the 2⁻²⁴ grid of [0, 1). Twin of `transport/random.glsl`, bit for bit.

use super::sobol::{SOBOL_INDEX_BITS, SOBOL_PAIRS, sobol_pair};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{JOINT_KEY, SAMPLER_JOINT_SOBOL, SAMPLER_PCG, SAMPLER_SOBOL, SEQUENCE_KEY};
use glam::{DVec2, UVec3, UVec4};

const PCG_MULTIPLIER: u32 = 1_664_525;
const PCG_INCREMENT: u32 = 1_013_904_223;

/// Which sequence the draws come from; the value of the shader constant `CLERESTORY_SAMPLER`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u32)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' pairs: stratified over the samples of a pixel.
    #[default]
    Sobol = SAMPLER_SOBOL,
    /// Independent hashes.
    Pcg = SAMPLER_PCG,
    /// The first eight slots jointly stratified by one Owen-scrambled Sobol' sequence of sixteen dimensions, the others as with
    /// [`SamplerKind::Sobol`]: of eye paths pixel, lens, and the first two bounces; of photons their point and direction on the light, and the first
    /// bounces. Runs of 2¹⁶ = 65,536 samples of a stream are jointly even each by itself; what photons of a larger pass gain ends there.
    JointSobol = SAMPLER_JOINT_SOBOL,
}

/// One stream of random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampler {
    /// Pixel (or photon) number.
    pub pixel: u32,
    /// Sample number within the pixel.
    pub sample_index: u32,
    /// Number of the next slot: each call of [`sample_1d`] or [`sample_2d`] uses one.
    pub dimension: u32,
    /// Seed of the whole picture.
    pub seed: u32,
}

/// Hash of three words to three words.
pub fn pcg3d(v: UVec3) -> UVec3 {
    let [mut x, mut y, mut z] = v
        .to_array()
        .map(|c| c.wrapping_mul(PCG_MULTIPLIER).wrapping_add(PCG_INCREMENT));
    let mut mix = |shift: bool| {
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        if shift {
            x ^= x >> 16;
            y ^= y >> 16;
            z ^= z >> 16;
        }
    };
    mix(true);
    mix(false);
    UVec3::new(x, y, z)
}

/// Hash of four words to four words.
pub fn pcg4d(v: UVec4) -> UVec4 {
    let [mut x, mut y, mut z, mut w] = v
        .to_array()
        .map(|c| c.wrapping_mul(PCG_MULTIPLIER).wrapping_add(PCG_INCREMENT));
    let mut mix = |shift: bool| {
        x = x.wrapping_add(y.wrapping_mul(w));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        w = w.wrapping_add(y.wrapping_mul(z));
        if shift {
            x ^= x >> 16;
            y ^= y >> 16;
            z ^= z >> 16;
            w ^= w >> 16;
        }
    };
    mix(true);
    mix(false);
    UVec4::new(x, y, z, w)
}

/// The upper 24 bits as a number in [0, 1); exact in f32 too.
pub fn unit_float(bits: u32) -> f64 {
    f64::from(bits >> 8) / f64::from(1u32 << 24)
}

/// Owen scrambling of a bit-reversed word: each bit changes by a function of the bits below it only.
pub fn owen_hash_reversed(x: u32, seed: u32) -> u32 {
    let mut x = x ^ x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Owen scrambling of a fixed-point fraction (most significant bit first).
pub fn owen_scramble(x: u32, seed: u32) -> u32 {
    owen_hash_reversed(x.reverse_bits(), seed).reverse_bits()
}

/// The second Sobol' dimension before its bit reversal: multiplication by the Pascal matrix mod 2.
///
/// It is the shift x → x + 1 of the polynomial over GF(2) whose coefficients are the bits, done by halves because
/// (x + 1)^(2^k) = x^(2^k) + 1: five steps in place of a loop over 32 direction numbers.
pub fn sobol_pascal(index: u32) -> u32 {
    let mut p = index ^ (index >> 16);
    p ^= (p & 0xff00_ff00) >> 8;
    p ^= (p & 0xf0f0_f0f0) >> 4;
    p ^= (p & 0xcccc_cccc) >> 2;
    p ^ ((p & 0xaaaa_aaaa) >> 1)
}

/// The two random words of one of the first [`SOBOL_PAIRS`] slots of a joint sequence. Runs of 2^[`SOBOL_INDEX_BITS`] samples are scrambled each by
/// itself.
pub fn joint_sobol_bits(s: &Sampler) -> [u32; 2] {
    let run = SEQUENCE_KEY.wrapping_add(s.sample_index >> SOBOL_INDEX_BITS);
    let index = owen_scramble(s.sample_index, pcg4d(UVec4::new(s.pixel, run, JOINT_KEY, s.seed)).x);
    let key = pcg4d(UVec4::new(s.pixel, run, s.dimension, s.seed));
    let [x, y] = sobol_pair(index, s.dimension);
    [owen_scramble(x, key.y), owen_scramble(y, key.z)]
}

/// The two random words of the sampler's current slot.
pub fn sampler_bits(s: &Sampler, kind: SamplerKind) -> [u32; 2] {
    if kind == SamplerKind::JointSobol && s.dimension < SOBOL_PAIRS {
        return joint_sobol_bits(s);
    }
    let salt = match kind {
        SamplerKind::Sobol | SamplerKind::JointSobol => SEQUENCE_KEY,
        SamplerKind::Pcg => s.sample_index,
    };
    let key = pcg4d(UVec4::new(s.pixel, salt, s.dimension, s.seed));
    match kind {
        SamplerKind::Pcg => [key.x, key.y],
        SamplerKind::Sobol | SamplerKind::JointSobol => {
            let index = owen_scramble(s.sample_index, key.x);
            [
                owen_hash_reversed(index, key.y).reverse_bits(),
                owen_hash_reversed(sobol_pascal(index), key.z).reverse_bits(),
            ]
        }
    }
}

/// The next number of a stream, in [0, 1).
pub fn sample_1d(s: &mut Sampler, kind: SamplerKind) -> f64 {
    let [x, _] = sampler_bits(s, kind);
    s.dimension = s.dimension.wrapping_add(1);
    unit_float(x)
}

/// The next pair of a stream, in [0, 1)²; a (0,2)-sequence over the samples of a pixel with [`SamplerKind::Sobol`].
pub fn sample_2d(s: &mut Sampler, kind: SamplerKind) -> DVec2 {
    let [x, y] = sampler_bits(s, kind);
    s.dimension = s.dimension.wrapping_add(1);
    DVec2::new(unit_float(x), unit_float(y))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "CL-SOBOL",
        name: "Owen-scrambled Sobol' points by hashing",
        role: Role::PartOf("BG-3"),
        limits: "Even in pairs of dimensions only, or in the sixteen first ones, so the gain fades with the bounces.",
        sources: &[
            sources::BURLEY_2020.whole(),
            sources::LAINE_KARRAS_2011.whole(),
            sources::JOE_KUO_2008.at("direction numbers of the first sixteen dimensions"),
        ],
        shaders: &["shaders/transport/random.glsl", "shaders/transport/sobol.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/random.rs::pascal_steps_equal_the_direction_numbers",
            "engine/src/transport/random.rs::sobol_pairs_are_stratified_plain_and_scrambled",
            "engine/src/transport/random.rs::joint_points_are_stratified_across_slots",
            "engine/src/transport/random.rs::owen_hash_changes_a_bit_by_the_lower_bits_only",
            "tests/tests/paths/samplers.rs::sobol_samples_of_a_pixel_are_stratified",
            "tests/tests/twins/random.rs::random_numbers_are_equal_bit_for_bit",
        ],
        settings: &["sampler"],
        api: &["clerestory::transport::random"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-PCG",
        name: "counter-based random numbers by PCG hashes",
        role: Role::PartOf("BG-3"),
        limits: "Values on a grid of 2⁻²⁴; independent by statistical tests, not by proof.",
        sources: &[sources::JARZYNSKI_OLANO_2020.whole()],
        shaders: &["shaders/transport/random.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/random.rs::pcg_avalanche_and_means",
            "engine/src/transport/random.rs::floats_stay_below_one",
            "tests/tests/twins/random.rs::random_numbers_are_equal_bit_for_bit",
        ],
        experiment: "clerestory agreement",
        settings: &["sampler"],
        api: &["clerestory::transport::random"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval 2^-a × 2^-(m-a) of the unit square holds exactly one of the first 2^m points.
    fn is_stratified(points: &[[u32; 2]]) -> bool {
        let m = points.len().trailing_zeros();
        let cell = |word: u32, bits: u32| if bits == 0 { 0 } else { word >> (32 - bits) };
        (0..=m).all(|a| {
            let mut seen = vec![false; points.len()];
            points.iter().all(|p| {
                let at = ((cell(p[0], a) << (m - a)) | cell(p[1], m - a)) as usize;
                !std::mem::replace(&mut seen[at], true)
            })
        })
    }

    #[test]
    fn pascal_steps_equal_the_direction_numbers() {
        // Joe and Kuo's dimension 2: v_0 = 2^31, v_k = v_{k-1} ^ (v_{k-1} >> 1). Linear over GF(2), so the basis proves it.
        let mut v = 1u32 << 31;
        for k in 0..32 {
            assert_eq!(sobol_pascal(1 << k).reverse_bits(), v, "bit {k}");
            v ^= v >> 1;
        }
        for (a, b) in [(0x1234_5678, 0x9abc_def0), (7, 0xffff_ffff)] {
            assert_eq!(sobol_pascal(a ^ b), sobol_pascal(a) ^ sobol_pascal(b));
        }
    }

    #[test]
    fn sobol_pairs_are_stratified_plain_and_scrambled() {
        for m in 0..=10u32 {
            let plain: Vec<_> = (0..1u32 << m)
                .map(|i| [i.reverse_bits(), sobol_pascal(i).reverse_bits()])
                .collect();
            assert!(is_stratified(&plain), "plain, 2^{m}");
            for seed in 0..8 {
                let scrambled: Vec<_> = (0..1u32 << m)
                    .map(|sample_index| {
                        let s = Sampler {
                            pixel: 17 * seed,
                            sample_index,
                            dimension: seed,
                            seed,
                        };
                        sampler_bits(&s, SamplerKind::Sobol)
                    })
                    .collect();
                assert!(is_stratified(&scrambled), "scrambled, 2^{m}, seed {seed}");
            }
        }
        let independent: Vec<_> = (0..1024)
            .map(|i| [pcg4d(UVec4::new(i, 0, 0, 0)).x, pcg4d(UVec4::new(i, 0, 0, 0)).y])
            .collect();
        assert!(!is_stratified(&independent), "the check must be able to fail");
    }

    #[test]
    fn joint_points_are_stratified_across_slots() {
        let sample = |pixel: u32, sample_index: u32, dimension: u32| Sampler {
            pixel,
            sample_index,
            dimension,
            seed: 9,
        };
        for pixel in 0..8 {
            for slot in 0..SOBOL_PAIRS {
                // Each coordinate by itself, in any run of 2^m samples that begins at a multiple of it.
                for first in [0, 1024, 65_536, 3 * 65_536 + 512] {
                    let words: Vec<[u32; 2]> = (first..first + 256)
                        .map(|i| sampler_bits(&sample(pixel, i, slot), SamplerKind::JointSobol))
                        .collect();
                    for axis in 0..2 {
                        let mut cells: Vec<u32> = words.iter().map(|word| word[axis] >> 24).collect();
                        cells.sort_unstable();
                        assert!(
                            cells.iter().enumerate().all(|(i, cell)| i as u32 == *cell),
                            "{slot} {axis}"
                        );
                    }
                }
            }
            // The first coordinates of the pixel's and the first bounce's slot are dimensions 1 and 5, a (2,2)-sequence: of 2^9 points as many lie in
            // each of 8 × 8 cells.
            for kind in [SamplerKind::JointSobol, SamplerKind::Sobol] {
                let mut cells = [0_u32; 64];
                for i in 0..512 {
                    let [a, b] = [0, 2].map(|slot| sampler_bits(&sample(pixel, i, slot), kind)[0] >> 29);
                    cells[(a * 8 + b) as usize] += 1;
                }
                let even = cells.iter().all(|count| *count == 8);
                assert_eq!(even, kind == SamplerKind::JointSobol, "{kind:?}: {cells:?}");
            }
        }
    }

    #[test]
    fn owen_hash_changes_a_bit_by_the_lower_bits_only() {
        for i in 0..1000u32 {
            let [x, y, seed] = pcg3d(UVec3::new(i, 1, 2)).to_array();
            let bit = i % 32;
            let below = if bit == 0 { 0 } else { u32::MAX >> (32 - bit) };
            let agree = (x & below) | (y & !below);
            let flips_x = owen_hash_reversed(x, seed) ^ x;
            let flips_y = owen_hash_reversed(agree, seed) ^ agree;
            assert_eq!(flips_x & (below | 1 << bit), flips_y & (below | 1 << bit), "bit {bit}");
        }
    }

    /// Each of the 24 output bits that a draw keeps flips with probability ½ for each of the lower 24 bits of each input word: 2304
    /// rates of 4096 trials, all within 6 sigma (sigma = 1/128; false alarm 5e-6 for the whole table). Higher input bits reach only
    /// the output bits from their own number less 16 upwards: the one fold of the hash moves them no lower.
    #[test]
    fn pcg_avalanche_and_means() {
        const TRIALS: u32 = 4096;
        let bound = 6.0 / 128.0;
        let mut worst = vec![];
        for input_bit in 0..96u32 {
            let mut flips = [0u32; 32];
            for t in 0..TRIALS {
                let v = UVec4::new(t, t ^ 0x55, 3 * t, 7 + t);
                let (lane, bit) = ((input_bit / 24) as usize, input_bit % 24);
                let mut w = v;
                w[lane] ^= 1 << bit;
                let changed = pcg4d(v).x ^ pcg4d(w).x;
                for (k, f) in flips.iter_mut().enumerate() {
                    *f += (changed >> k) & 1;
                }
            }
            for (k, f) in flips.iter().enumerate().skip(8) {
                let rate = f64::from(*f) / f64::from(TRIALS);
                if (rate - 0.5).abs() >= bound {
                    worst.push((input_bit, k, rate));
                }
            }
        }
        assert!(worst.is_empty(), "{worst:?}");
        for kind in [SamplerKind::Sobol, SamplerKind::Pcg, SamplerKind::JointSobol] {
            let n = 1 << 16;
            let mut sum = DVec2::ZERO;
            for i in 0..n {
                let mut s = Sampler {
                    pixel: i,
                    sample_index: 3,
                    dimension: 2,
                    seed: 1,
                };
                sum += sample_2d(&mut s, kind);
                assert_eq!(s.dimension, 3);
            }
            let z = (sum / f64::from(n) - 0.5) * (12.0 * f64::from(n)).sqrt();
            assert!(z.abs().max_element() < 5.0, "{kind:?}: z = {z} (false alarm 1e-6)");
        }
    }

    #[test]
    fn floats_stay_below_one() {
        assert_eq!(unit_float(0), 0.0);
        assert!(unit_float(u32::MAX) < 1.0);
        #[expect(clippy::cast_possible_truncation, reason = "the claim is that the cast is exact")]
        let single = unit_float(u32::MAX) as f32;
        assert!(single < 1.0 && f64::from(single) == unit_float(u32::MAX));
    }
}
