//! How many samples each pixel gets of a budget, and which place of a round belongs to which pixel.

use super::noise::class_of;
use crate::gpu::shaders::types::PathShare;

/// Share of the samples that are spread evenly, pilot included: what the pilot has not seen is not starved. No pixel's variance is more than four times that of an
/// even spread.
pub(super) const EVEN_SHARE: f64 = 0.25;

/// Samples of each pixel, those that were `taken` included, that sum up to `samples` a pixel: a part even, the rest in proportion to `noise`. Either class of pixels
/// has its own part of the budget, so that the numbers of a class follow from its noise alone, which is the other one's. Where a class has more already, it
/// keeps what it has.
pub(super) fn shares(noise: &[f32], taken: &[u32], width: usize, samples: u32) -> Vec<u32> {
    let mut shares = taken.to_vec();
    for class in [0, 1] {
        let of_class = || (0..noise.len()).filter(move |pixel| class_of(*pixel, width) == class);
        let pixels = of_class().count();
        let sum: f64 = of_class().map(|pixel| f64::from(noise[pixel])).sum();
        let has: u64 = of_class().map(|pixel| u64::from(taken[pixel])).sum();
        let budget = (u64::from(samples) * pixels as u64).max(has);
        // What rounding takes from a pixel goes to the next.
        let (mut carry, mut given) = (0.0, 0);
        for pixel in of_class() {
            let relative = if sum > 0.0 {
                EVEN_SHARE + (1.0 - EVEN_SHARE) * f64::from(noise[pixel]) * pixels as f64 / sum
            } else {
                1.0
            };
            let wanted = relative * f64::from(samples) + carry;
            let share = wanted.floor();
            carry = wanted - share;
            shares[pixel] = (share as u32).max(taken[pixel]);
            given += u64::from(shares[pixel]);
        }
        settle(&mut shares, taken, of_class, given, budget);
    }
    shares
}

/// Makes the shares of a class, which sum up to `given`, sum up to `budget`: as many samples for each pixel that has room, and what does not divide one by one.
fn settle<I: Iterator<Item = usize>>(
    shares: &mut [u32],
    taken: &[u32],
    of_class: impl Fn() -> I,
    given: u64,
    budget: u64,
) {
    let room = |share: u32, taken: u32| {
        if given > budget {
            share - taken
        } else {
            u32::MAX - share
        }
    };
    let mut left = given.abs_diff(budget);
    while left > 0 {
        let pixels = of_class()
            .filter(|pixel| room(shares[*pixel], taken[*pixel]) > 0)
            .count() as u64;
        if pixels == 0 {
            return;
        }
        let each = u32::try_from((left / pixels).max(1)).unwrap_or(u32::MAX);
        for pixel in of_class() {
            let moved = each
                .min(room(shares[pixel], taken[pixel]))
                .min(u32::try_from(left).unwrap_or(u32::MAX));
            if given > budget {
                shares[pixel] -= moved;
            } else {
                shares[pixel] += moved;
            }
            left -= u64::from(moved);
        }
    }
}

/// The shares of a band's pixels in a round that takes them from `taken` samples to `shares`, and one behind the last.
pub(super) fn places(taken: &[u32], shares: &[u32]) -> Vec<PathShare> {
    let mut first_place = 0;
    let mut places = Vec::with_capacity(taken.len() + 1);
    for (taken, share) in taken.iter().zip(shares) {
        places.push(PathShare {
            first_place,
            first_sample: *taken,
        });
        first_place += share - taken;
    }
    places.push(PathShare {
        first_place,
        first_sample: 0,
    });
    places
}

/// Places of a round's shares.
pub(super) fn end_of(shares: &[PathShare]) -> u32 {
    shares.last().map_or(0, |end| end.first_place)
}

/// The pixel that a place belongs to, one of `pixels` from `first` on whose shares hold it.
pub(super) fn share_at(shares: &[PathShare], place: u32, first: u32, pixels: u32) -> u32 {
    let of_pixels = &shares[first as usize..(first + pixels) as usize];
    let behind = of_pixels.partition_point(|share| share.first_place <= place);
    first + behind.saturating_sub(1) as u32
}

#[cfg(test)]
mod tests {
    use super::super::noise::noise_of_neighbours;
    use super::*;
    use crate::film::z_test::two_sided_p;
    use crate::test_random::Random;

    // The most samples that can be asked for: pixels that would have more than fit give the rest to others, in few passes.
    #[test]
    fn shares_beyond_all_bounds_are_handed_on_at_once() {
        let noise: Vec<f32> = (0..4096).map(|i| if i == 99 { 1e6 } else { 1.0 }).collect();
        for samples in [u32::MAX, u32::MAX - 1, 1 << 30] {
            let given = shares(&noise, &[256; 4096], 64, samples);
            assert_eq!(total(&given), 4096 * u64::from(samples), "{samples}");
            assert_eq!(given[99], u32::MAX, "{samples}");
        }
    }

    fn total(shares: &[u32]) -> u64 {
        shares.iter().map(|share| u64::from(*share)).sum()
    }

    #[test]
    fn shares_follow_the_noise_and_spend_the_budget() {
        let width = 8;
        let noise: Vec<f32> = (0..64).map(|i| if i % 8 < 4 { 1.0 } else { 3.0 }).collect();
        let given = shares(&noise, &[4; 64], width, 16);
        assert_eq!(total(&given), 16 * 64);
        // 16 · (1/4 + 3/4 · 1/2) and 16 · (1/4 + 3/4 · 3/2).
        assert!(
            given
                .iter()
                .zip(&noise)
                .all(|(n, s)| *n == if *s == 1.0 { 10 } else { 22 })
        );
        // Whatever does not divide goes to some pixel; more samples later keep those that are there.
        let mut random = Random(5);
        let noise: Vec<f32> = (0..77).map(|_| random.unit()).collect();
        let mut taken = vec![2; 77];
        for samples in [3, 9, 10, 11, 40, 1000] {
            let given = shares(&noise, &taken, 11, samples);
            assert_eq!(total(&given), 77 * u64::from(samples));
            assert!(
                given.iter().zip(&taken).all(|(given, taken)| given >= taken),
                "{samples}"
            );
            assert_eq!(shares(&noise, &given, 11, samples), given, "{samples}");
            taken = given;
        }
        // Fewer than there are: nothing changes.
        assert_eq!(shares(&noise, &taken, 11, 5), taken);
    }

    #[test]
    fn without_noise_samples_are_even() {
        assert_eq!(shares(&[0.0; 12], &[1; 12], 4, 7), [7; 12]);
        assert_eq!(shares(&[0.0], &[1], 1, 7), [7]);
        // One class without noise, the other with some in one pixel.
        let given = shares(&[0.0, 1.0, 0.0, 0.0], &[0; 4], 4, 8);
        assert_eq!(given, [8, 14, 8, 2]);
    }

    #[test]
    fn no_pixel_starves() {
        let mut noise = [0.0; 100];
        noise[37] = 1e30;
        let given = shares(&noise, &[0; 100], 10, 64);
        assert!(given.iter().all(|share| *share >= 15), "{given:?}");
        assert_eq!(total(&given), 6400);
    }

    #[test]
    fn every_place_belongs_to_one_pixel() {
        let mut random = Random(9);
        let taken: Vec<u32> = (0..200).map(|_| (random.unit() * 9.0) as u32).collect();
        let more: Vec<u32> = taken.iter().map(|n| n + (random.unit() * 4.0) as u32).collect();
        let places = places(&taken, &more);
        let mut place = 0;
        for (pixel, (taken, more)) in taken.iter().zip(&more).enumerate() {
            assert_eq!(places[pixel].first_sample, *taken);
            for _ in *taken..*more {
                assert_eq!(share_at(&places, place, 0, 200), pixel as u32);
                assert_eq!(share_at(&places, place, pixel as u32, 1), pixel as u32);
                place += 1;
            }
        }
        assert_eq!(places[200].first_place, place);
    }

    /// How far the mean of many pictures of rare bright samples lies from the truth, in standard errors. Of a picture of 8 × 8 pixels a sample is 20 with
    /// probability 1/20 and 0 otherwise; a pilot of 4 a pixel, then 12 more on average by the noise that `steer` makes of the pilot's variances.
    fn z_of_mean(steer: impl Fn(&[f64]) -> Vec<f32>) -> f64 {
        const SIDE: usize = 8;
        const PIXELS: usize = SIDE * SIDE;
        const PICTURES: u32 = 4000;
        let mut random = Random(31);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..PICTURES {
            let mut sample = || if random.unit() < 0.05 { 20.0 } else { 0.0 };
            let pilot: Vec<[f64; 4]> = (0..PIXELS).map(|_| [(); 4].map(|()| sample())).collect();
            let variances: Vec<f64> = pilot
                .iter()
                .map(|samples| {
                    let mean = samples.iter().sum::<f64>() / 4.0;
                    samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 3.0
                })
                .collect();
            let given = shares(&steer(&variances), &[4; PIXELS], SIDE, 16);
            let means = pilot.iter().zip(&given).map(|(pilot, share)| {
                let more: f64 = (4..*share).map(|_| sample()).sum();
                (pilot.iter().sum::<f64>() + more) / f64::from(*share)
            });
            let mean = means.sum::<f64>() / PIXELS as f64;
            sum += mean;
            squares += mean * mean;
        }
        let n = f64::from(PICTURES);
        let mean = sum / n;
        (mean - 1.0) / ((squares / n - mean * mean) / n).sqrt()
    }

    // False alarms: 10⁻⁶. The pilot's own noise as the weight of what it found makes pictures too dark, by far more than the test needs to see it.
    #[test]
    fn means_are_unbiased_unless_samples_steer_their_own_weight() {
        let z = z_of_mean(|variances| noise_of_neighbours(variances, 8));
        assert!(two_sided_p(z) > 1e-6, "{z}");
        let own = z_of_mean(|variances| variances.iter().map(|variance| variance.sqrt() as f32).collect());
        assert!(own < -20.0, "{own}");
    }
}
