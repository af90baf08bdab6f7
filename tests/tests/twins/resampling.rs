//! Candidates of resampling: the device keeps those that the twin keeps, of weights whose sums are exact.

use super::*;
use clerestory::techniques::instant_radiosity::resampling::resample;
use clerestory_tests::with_gpu;

const RESAMPLE: u32 = 18;

#[test]
fn resampled_candidates_agree_with_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(78);
        let (mut table, mut expected) = (Vec::new(), Vec::new());
        for _ in 0..CASES {
            let (mut words, mut kept, mut sum) = (Vec::new(), Vec::new(), 0.0);
            for _ in 0..8 {
                // Small whole weights, none among them, and numbers of few bits: products are exact in f32, too.
                let (u, weight) = (random.below(256) as f32 / 256.0, random.below(6) as f32);
                words.extend([u, weight]);
                let is_kept = resample(f64::from(u), f64::from(weight), &mut sum);
                kept.push((u32::from(is_kept), sum));
            }
            table.push(Case::new(&words));
            expected.push(kept);
        }
        let results = twin_math(gpu, RESAMPLE, &table, &[]);
        let mut all = 0;
        for (result, kept) in results.iter().zip(&expected) {
            for (i, (is_kept, sum)) in kept.iter().enumerate() {
                assert_eq!(result.0[i].to_bits(), *is_kept);
                assert_eq!(f64::from(result.0[8 + i]), *sum);
                all += is_kept;
            }
        }
        // The first one that has a weight is always kept.
        assert!(all as usize > CASES, "{all}");
    });
}
