//! Tone curves: from linear radiance to display values.
//!
//! Sources: the sRGB transfer function, IEC 61966-2-1:1999; PBR Neutral, the Khronos tone mapper specification (Khronos Group, 2024).
//! Guarantees: evaluated in f64, monotone and total: every input, NaN and infinity included, has a stated output.

use crate::srgb::srgb_byte;

/// How linear values become display values in [0, 1], before the sRGB transfer function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneCurve {
    /// Values are clipped to [0, 1]: what lies inside is shown exactly. The curve for comparing pictures.
    #[default]
    Srgb,
    /// Khronos PBR Neutral: keeps base colours up to 0.8 and rolls highlights off towards white. The curve for looking at pictures.
    PbrNeutral,
}

/// An exposure and a tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct ToneMap {
    /// Stops: radiance is multiplied by 2^exposure.
    pub exposure: f64,
    /// The curve.
    pub curve: ToneCurve,
}

/// What a pixel with a NaN in it looks like: magenta, so that it is seen.
pub const NAN_COLOR: [u8; 3] = [255, 0, 255];

impl ToneMap {
    /// Linear RGB radiance to 8-bit sRGB: exposure, curve, transfer function, rounding to nearest. +∞ is shown as the curve's limit, −∞ as
    /// black, a NaN as [`NAN_COLOR`].
    pub fn apply(&self, radiance: [f32; 3]) -> [u8; 3] {
        if radiance.iter().any(|v| v.is_nan()) {
            return NAN_COLOR;
        }
        let scale = self.exposure.exp2();
        // Below 2¹²⁸ nothing in f32 is cut off; the bound keeps the curves' differences of large numbers finite.
        let limit = f64::from(f32::MAX);
        let exposed = radiance.map(|v| (f64::from(v) * scale).clamp(0.0, limit));
        let display = match self.curve {
            ToneCurve::Srgb => exposed,
            ToneCurve::PbrNeutral => pbr_neutral(exposed),
        };
        display.map(srgb_byte)
    }
}

/// Khronos PBR Neutral tone mapper: linear RGB ≥ 0 to linear RGB in [0, 1].
///
/// With F90 = 0.04 the least channel x gives the offset x − x²/(4·F90) below 2·F90 and F90 above, which takes a dielectric's specular base off; a peak p over
/// 0.8 − F90 is compressed to 1 − d²/(p + d − (0.8 − F90)), d = 1 − (0.8 − F90), and blended to white by 1 − 1/(0.15 (p − p') + 1).
pub fn pbr_neutral(color: [f64; 3]) -> [f64; 3] {
    const FRESNEL: f64 = 0.04;
    const START: f64 = 0.8 - FRESNEL;
    const DESATURATION: f64 = 0.15;
    let least = color[0].min(color[1]).min(color[2]);
    let offset = if least < 2.0 * FRESNEL {
        least - least * least / (4.0 * FRESNEL)
    } else {
        FRESNEL
    };
    let color = color.map(|v| v - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let range = 1.0 - START;
    let compressed = 1.0 - range * range / (peak + range - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    color.map(|v| {
        let scaled = v * (compressed / peak);
        scaled + (compressed - scaled) * white
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pbr_neutral_keeps_base_colours_and_is_monotone() {
        // A grey below the compression start, after the specular base is taken off.
        for grey in [0.08, 0.3, 0.79] {
            assert!(pbr_neutral([grey; 3]).iter().all(|v| (v - (grey - 0.04)).abs() < 1e-15));
        }
        let mut before = 0.0;
        for step in 0..4000 {
            let v = pbr_neutral([(f64::from(step) * 0.01 - 20.0).exp2(); 3])[1];
            assert!((before..=1.0).contains(&v), "{step}: {v} after {before}");
            before = v;
        }
        // Saturated highlights go to white.
        let bright = pbr_neutral([1e6, 1.0, 0.0]);
        assert!(bright.iter().all(|v| *v > 0.999), "{bright:?}");
    }

    #[test]
    fn every_input_has_a_colour() {
        for curve in [ToneCurve::Srgb, ToneCurve::PbrNeutral] {
            let tone = ToneMap { exposure: 3.0, curve };
            assert_eq!(tone.apply([f32::NAN, 0.0, 0.0]), NAN_COLOR);
            assert_eq!(tone.apply([f32::INFINITY; 3]), [255; 3]);
            assert_eq!(tone.apply([f32::NEG_INFINITY, -1.0, 0.0]), [0; 3]);
            assert_eq!(tone.apply([f32::MAX; 3]), [255; 3]);
        }
        let stops = ToneMap {
            exposure: -1.0,
            curve: ToneCurve::Srgb,
        };
        assert_eq!(stops.apply([2.0, 0.36, 0.0]), [255, 118, 0]);
    }
}
