//! Tone reproduction by a picture's own brightness: its middle becomes a middle grey, and highlights roll off, alike everywhere or by what is around.
//!
//! Source: E. Reinhard, M. Stark, P. Shirley and J. Ferwerda, "Photographic Tone Reproduction for Digital Images", SIGGRAPH 2002, equations 1 to 9. The middle is the
//! geometric mean of the luminances above 0, where the source adds a small number to all. The white is the brightest luminance, but no less than that which the middle's scale
//! takes to 1, so that a picture without highlights is scaled and nothing else: its middle is shown as 0.18, that of one with strong highlights as 0.18/1.18. Both forms
//! have the white, where the source's local one has none, so that they show an even picture alike.
//!
//! Guarantees: deterministic, on any number of threads; evaluated in f64; a picture scaled as a whole looks the same.

use rayon::prelude::*;

/// Scaled luminance of the middle of a picture, without an exposure.
const KEY: f64 = 0.18;
/// Width of the first Gaussian over its scale, the source's 1/(2√2), and of each scale over the one before.
const NARROWEST: f64 = 0.353_553_390_593_273_8;
const SCALE_RATIO: f64 = 1.6;
/// Scales that surroundings are compared at: from one pixel to 27.
const SCALES: usize = 8;
/// Sharpness: how much more contrast narrow surroundings may have than wide ones.
const SHARPNESS: f64 = 8.0;
/// Contrast of surroundings that ends their growth.
const CONTRAST: f64 = 0.05;
/// Reach of a Gaussian over its width: e⁻⁹ is left out.
const REACH: f64 = 3.0;

/// Brightness that a picture is shown by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Adaptation {
    /// Scaled luminance of the middle.
    key: f64,
    /// Of luminances, so that their middle is the key.
    scale: f64,
    /// Scaled luminance that becomes 1.
    white: f64,
}

impl Adaptation {
    /// To a picture of these luminances, of which those that are not finite have no part in it. `stops` are added to the brightness of the middle. `None` for a picture
    /// without light.
    pub fn to(luminances: &[f64], stops: f64) -> Option<Self> {
        let (mut sum, mut count, mut most) = (0.0, 0u64, 0.0f64);
        for l in luminances.iter().filter(|l| l.is_finite() && **l > 0.0) {
            sum += l.ln();
            count += 1;
            most = most.max(*l);
        }
        let key = KEY * stops.exp2();
        let scale = key / (sum / count as f64).exp();
        (count > 0).then(|| Self {
            key,
            scale,
            white: (scale * most).max(1.0),
        })
    }

    /// By what the bands of each pixel are multiplied for display. `luminances` are those of a picture's rows, `width` pixels each; those that are not finite have no part in
    /// what others are shown as, and 1.
    pub fn display_scales(&self, luminances: &[f64], width: usize, is_local: bool) -> Vec<f64> {
        let scaled: Vec<f64> = luminances.iter().map(|l| self.scale * l).collect();
        let around = if is_local {
            surroundings(&scaled, width, self.key)
        } else {
            scaled.clone()
        };
        let scale = |(l, around): (&f64, f64)| match l.is_finite() {
            true => self.scale * (1.0 + l / (self.white * self.white)) / (1.0 + around),
            false => 1.0,
        };
        scaled.iter().zip(around).map(scale).collect()
    }
}

/// Of each pixel, the mean of its largest surroundings that have no strong contrast.
fn surroundings(luminances: &[f64], width: usize, key: f64) -> Vec<f64> {
    let mut scale = 1.0;
    let mut center = blurred(luminances, width, NARROWEST * scale);
    // Where even the narrowest have contrast these stand.
    let mut found = center.clone();
    let mut grows: Vec<bool> = vec![true; luminances.len()];
    for _ in 0..SCALES {
        let surround = blurred(luminances, width, NARROWEST * SCALE_RATIO * scale);
        let floor = SHARPNESS.exp2() * key / (scale * scale);
        let pixels = found.iter_mut().zip(&mut grows).zip(center.iter().zip(&surround));
        for ((found, grows), (center, surround)) in pixels.filter(|((_, grows), _)| **grows) {
            *grows = ((center - surround) / (floor + center)).abs() < CONTRAST;
            if *grows {
                *found = *center;
            }
        }
        (center, scale) = (surround, SCALE_RATIO * scale);
    }
    found
}

/// Convolved with exp(−(x/width)²), over what is finite and within the picture.
fn blurred(values: &[f64], width: usize, gaussian: f64) -> Vec<f64> {
    let reach = (REACH * gaussian).ceil() as usize;
    let weights: Vec<f64> = (0..=reach).map(|x| (-(x as f64 / gaussian).powi(2)).exp()).collect();
    let height = values.len() / width;
    let pairs: Vec<[f64; 2]> = values
        .iter()
        .map(|value| if value.is_finite() { [*value, 1.0] } else { [0.0; 2] })
        .collect();
    let along = |pairs: &[[f64; 2]], i: usize, place: usize, count: usize, step: usize| {
        let mut sum = [0.0; 2];
        for other in place.saturating_sub(reach)..(place + reach + 1).min(count) {
            let [value, weight] = pairs[i + other * step - place * step];
            let by = weights[place.abs_diff(other)];
            sum = [sum[0] + by * value, sum[1] + by * weight];
        }
        sum
    };
    let pixels = 0..values.len();
    let across: Vec<[f64; 2]> = pixels
        .clone()
        .into_par_iter()
        .map(|i| along(&pairs, i, i % width, width, 1))
        .collect();
    pixels
        .into_par_iter()
        .map(|i| {
            let [sum, weight] = along(&across, i, i / width, height, width);
            if weight > 0.0 { sum / weight } else { 0.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display_scales(luminances: &[f64], width: usize, stops: f64, is_local: bool) -> Vec<f64> {
        let adaptation = Adaptation::to(luminances, stops).expect("light");
        adaptation.display_scales(luminances, width, is_local)
    }

    fn displayed(luminances: &[f64], width: usize, stops: f64, is_local: bool) -> Vec<f64> {
        let scales = display_scales(luminances, width, stops, is_local);
        luminances.iter().zip(scales).map(|(l, scale)| l * scale).collect()
    }

    #[test]
    fn the_middle_becomes_middle_grey_and_highlights_roll_off() {
        // Without highlights the curve is a scale: geometric mean 2.
        let plain = displayed(&[1.0, 2.0, 4.0, 2.0], 2, 0.0, false);
        for (found, expected) in plain.iter().zip([0.09, 0.18, 0.36, 0.18]) {
            assert!((found - expected).abs() < 1e-12, "{plain:?}");
        }
        // A stop more, and black stays black.
        let brighter = displayed(&[1.0, 2.0, 4.0, 2.0, 0.0], 5, 1.0, false);
        assert!((brighter[1] - 0.36).abs() < 1e-12 && brighter[4] == 0.0, "{brighter:?}");
        // Equation 4 at the brightest luminance is 1, below it L (1 + L/w²)/(1 + L).
        let mut values = vec![1.0; 63];
        values.push(1e4);
        let found = displayed(&values, 8, 0.0, false);
        assert!((found[63] - 1.0).abs() < 1e-12, "{}", found[63]);
        let middle = (1e4f64.ln() / 64.0).exp();
        let (l, white) = (0.18 / middle, 0.18e4 / middle);
        assert!(
            (found[0] - l * (1.0 + l / (white * white)) / (1.0 + l)).abs() < 1e-12,
            "{}",
            found[0]
        );
    }

    /// Luminances over sixty stops, without those that have no part in it: the middle of a geometric sequence is that of its ends.
    #[test]
    fn the_middle_of_a_large_picture_is_its_geometric_mean() {
        const COUNT: u32 = 1 << 20;
        // In an order that has bright and dark ones all over.
        let order = (0..COUNT).map(|i| i.wrapping_mul(0x9e37_79b1) % COUNT);
        let stops = |i: u32| 60.0 * f64::from(i) / f64::from(COUNT - 1) - 20.0;
        let mut luminances: Vec<f64> = order.map(|i| stops(i).exp2()).collect();
        luminances.extend([0.0, f64::NAN, f64::INFINITY]);
        let adaptation = Adaptation::to(&luminances, 0.0).expect("light");
        let middle = KEY / adaptation.scale;
        assert!((middle / 10f64.exp2() - 1.0).abs() < 1e-9, "{middle}");
        // A stop more.
        let doubled: Vec<f64> = luminances.iter().map(|l| 2.0 * l).collect();
        let doubled = KEY / Adaptation::to(&doubled, 0.0).expect("light").scale;
        assert!((doubled / middle - 2.0).abs() < 1e-9, "{doubled}");
    }

    #[test]
    fn even_pictures_look_alike_and_brighter_is_never_darker() {
        for value in [1e-6, 1.0, 1e9] {
            for is_local in [false, true] {
                let found = displayed(&[value; 64], 8, 0.0, is_local);
                assert!(
                    found.iter().all(|shown| (shown - KEY).abs() < 1e-12),
                    "{value}: {found:?}"
                );
            }
        }
        let values: Vec<f64> = (0..400).map(|i| (0.1 * f64::from(i) - 20.0).exp2()).collect();
        let found = displayed(&values, 20, 0.0, false);
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
        assert!((found[399] - 1.0).abs() < 1e-12, "{}", found[399]);
    }

    /// What stops do is to scale, also for what is around.
    #[test]
    fn surroundings_are_the_same_at_every_exposure() {
        let values: Vec<f64> = (0..1024u32)
            .map(|i| f64::from(i * 37 % 101) + if i % 32 < 16 { 0.1 } else { 300.0 })
            .collect();
        let middle = surroundings(&values, 32, KEY);
        for stops in [-3.0f64, 2.0] {
            let scaled: Vec<f64> = values.iter().map(|value| value * stops.exp2()).collect();
            for (found, middle) in surroundings(&scaled, 32, KEY * stops.exp2()).iter().zip(&middle) {
                assert!(
                    (found / stops.exp2() - middle).abs() < 1e-9 * middle,
                    "{found} {middle}"
                );
            }
        }
    }

    #[test]
    fn scaled_pictures_look_the_same() {
        let values: Vec<f64> = (0..256u32).map(|i| f64::from(i * 37 % 101).exp2() * 1e-9).collect();
        for is_local in [false, true] {
            let one = displayed(&values, 16, 0.0, is_local);
            let scaled: Vec<f64> = values.iter().map(|v| v * 1024.0).collect();
            for (a, b) in one.iter().zip(displayed(&scaled, 16, 0.0, is_local)) {
                assert!((a - b).abs() <= 1e-12 * a.abs().max(1e-300), "{a} {b}");
            }
        }
    }

    /// A dark half with a faint pattern beside a bright one: of what is around each pixel only its own half counts, so that the pattern keeps more contrast than under the
    /// curve for all pixels, and far from the border each is as in a picture of its half.
    #[test]
    fn surroundings_end_at_strong_contrast() {
        let side = 96;
        let value = |x: usize, y: usize| {
            let pattern = if (x / 2 + y / 2).is_multiple_of(2) { 1.1 } else { 0.9 };
            if x < side / 2 { 0.02 * pattern } else { 50.0 * pattern }
        };
        let values: Vec<f64> = (0..side * side).map(|i| value(i % side, i / side)).collect();
        let scale = KEY / (values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64).exp();
        let scaled: Vec<f64> = values.iter().map(|v| scale * v).collect();
        let found = surroundings(&scaled, side, KEY);
        for y in 0..side {
            for (x, bright) in [(side / 2 - 3, 0.02), (side / 2 + 3, 50.0)] {
                let own = scale * bright;
                let there = found[y * side + x];
                // One more is what divides.
                assert!(
                    ((1.0 + there) / (1.0 + own) - 1.0).abs() < 0.2,
                    "{x} {y}: {there}, {own}"
                );
            }
        }
        let contrast = |is_local| {
            let shown = displayed(&values, side, 0.0, is_local);
            let at = |x: usize| shown[(side / 2) * side + x];
            at(side - 8) / at(side - 10)
        };
        let (global, local) = (contrast(false).ln().abs(), contrast(true).ln().abs());
        println!("contrast {global} {local}");
        assert!(local > 1.5 * global, "{local} {global}");
    }

    #[test]
    fn what_is_not_finite_has_no_part() {
        let clean = vec![0.5; 64];
        for strange in [f64::NAN, f64::INFINITY] {
            let mut values = clean.clone();
            values[20] = strange;
            for is_local in [false, true] {
                let scales = display_scales(&values, 8, 0.0, is_local);
                assert_eq!(scales[20], 1.0);
                let expected = display_scales(&clean, 8, 0.0, is_local);
                for (i, (a, b)) in scales.iter().zip(&expected).enumerate() {
                    assert!(i == 20 || (a - b).abs() < 1e-12, "{i}: {a} {b}");
                }
            }
        }
        for dark in [&[0.0, f64::NAN][..], &[]] {
            assert_eq!(Adaptation::to(dark, 0.0), None);
        }
    }

    #[test]
    fn blurs_keep_a_constant_and_the_sum() {
        let constant = vec![3.0; 5 * 7];
        for width in [0.3, 2.0, 15.0] {
            assert!(blurred(&constant, 5, width).iter().all(|v| (v - 3.0).abs() < 1e-12));
        }
        // Of a point far from the borders.
        let mut point = vec![0.0; 41 * 41];
        point[20 * 41 + 20] = 1.0;
        let found = blurred(&point, 41, 3.0);
        assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-3);
        let ratio = found[20 * 41 + 23] / found[20 * 41 + 20];
        assert!((ratio - (-1.0f64).exp()).abs() < 1e-12, "{ratio}");
    }
}
