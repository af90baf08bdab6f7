//! Tone curves: from linear radiance to display values.
//!
//! Sources: the sRGB transfer function, IEC 61966-2-1:1999; PBR Neutral, the Khronos tone mapper specification (Khronos Group, 2024); E. Reinhard et al., "Photographic
//! Tone Reproduction for Digital Images", SIGGRAPH 2002.
//! Guarantees: evaluated in f64 and total: every input, NaN and infinity included, has a stated output; curves that are the same for all pixels are monotone.

use super::metrics::luminance;
use super::photographic::Adaptation;
use crate::catalogue::{Role, Row, sources};
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
    /// L/(1 + L) of each band: nothing is cut off, and what is bright loses its colour (PM-ST-7; B. Fabianowski, 2011, §7.3.4).
    Bands,
    /// By the picture's own brightness: the geometric mean of its luminances is scaled to 0.18, times 2 to the power of the exposure, and highlights roll off: L/(1 + L) but for the
    /// brightest, which are shown as 1 (SVO-P15; E. Reinhard et al., 2002, equation 4). A picture without highlights is scaled and nothing else.
    Photographic,
    /// The same, with highlights that roll off by what is around each pixel, which keeps the contrast of details (there, equation 9).
    PhotographicLocal,
}

/// An exposure and a tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct ToneMap {
    /// Stops: radiance is multiplied by 2^exposure; where the curve depends on the picture, what its middle is scaled to.
    pub exposure: f64,
    /// The curve.
    pub curve: ToneCurve,
}

/// What a pixel with a NaN in it looks like: magenta, so that it is seen.
pub const NAN_COLOR: [u8; 3] = [255, 0, 255];

impl ToneCurve {
    /// Whether it depends on the picture's own brightness.
    pub fn adapts(self) -> bool {
        matches!(self, Self::Photographic | Self::PhotographicLocal)
    }
}

impl ToneMap {
    /// A picture of linear RGB radiance, in rows of `width` pixels, to 8-bit sRGB: exposure, curve, transfer function, rounding to nearest. +∞ is shown as the curve's
    /// limit, −∞ as black, a NaN as [`NAN_COLOR`]; where the curve depends on the picture, pixels that are not finite change no others.
    pub fn display(&self, pixels: &[[f32; 3]], width: u32) -> Vec<[u8; 3]> {
        self.display_by(pixels, None, width)
    }

    /// The same of a picture that is shown beside another, whose brightness decides where the curve depends on one.
    pub fn display_beside(&self, pixels: &[[f32; 3]], reference: &[[f32; 3]], width: u32) -> Vec<[u8; 3]> {
        self.display_by(pixels, Some(reference), width)
    }

    fn display_by(&self, pixels: &[[f32; 3]], reference: Option<&[[f32; 3]]>, width: u32) -> Vec<[u8; 3]> {
        let is_local = self.curve == ToneCurve::PhotographicLocal;
        if !self.curve.adapts() {
            return pixels.iter().map(|radiance| self.of_pixel(*radiance, 1.0)).collect();
        }
        let known = |radiance: &[f32; 3]| match radiance.iter().all(|v| v.is_finite()) {
            true => luminance(radiance.map(|v| v.max(0.0))),
            false => f64::NAN,
        };
        let luminances: Vec<f64> = pixels.iter().map(known).collect();
        let of_reference: Option<Vec<f64>> = reference.map(|reference| reference.iter().map(known).collect());
        let scales = match Adaptation::to(of_reference.as_ref().unwrap_or(&luminances), self.exposure) {
            Some(adaptation) => adaptation.display_scales(&luminances, (width as usize).max(1), is_local),
            // Without light to go by.
            None => vec![self.exposure.exp2(); pixels.len()],
        };
        let pairs = pixels.iter().zip(scales);
        pairs.map(|(radiance, scale)| self.of_pixel(*radiance, scale)).collect()
    }

    /// [`ToneMap::display`] of a picture of one pixel, of which curves that depend on the picture make a middle grey.
    pub fn apply(&self, radiance: [f32; 3]) -> [u8; 3] {
        self.display(&[radiance], 1)[0]
    }

    /// A pixel that a curve which depends on the picture multiplies by a scale.
    fn of_pixel(&self, radiance: [f32; 3], scale: f64) -> [u8; 3] {
        if radiance.iter().any(|v| v.is_nan()) {
            return NAN_COLOR;
        }
        let scale = if self.curve.adapts() {
            scale
        } else {
            self.exposure.exp2()
        };
        // Below 2¹²⁸ nothing in f32 is cut off; the bound keeps the curves' differences of large numbers finite.
        let limit = f64::from(f32::MAX);
        let exposed = radiance.map(|v| (f64::from(v) * scale).clamp(0.0, limit));
        let display = match self.curve {
            ToneCurve::Srgb | ToneCurve::Photographic | ToneCurve::PhotographicLocal => exposed,
            ToneCurve::PbrNeutral => pbr_neutral(exposed),
            ToneCurve::Bands => exposed.map(|v| v / (1.0 + v)),
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

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "SVO-P15",
        name: "tone reproduction by a picture's own brightness, for all pixels alike or by what is around each",
        role: Role::Service,
        limits: "Of pictures in files alone, not of windows: the mean of logarithms and what is around are found on the host, in f64, and no kernel reduces them on the device; scales are those of pixels, so that pictures of other sizes look somewhat different.",
        sources: &[sources::REINHARD_2002.whole(), sources::SUN_2015.at("§4.12")],
        tests: &[
            "engine/src/film/photographic.rs::the_middle_becomes_middle_grey_and_highlights_roll_off",
            "engine/src/film/photographic.rs::the_middle_of_a_large_picture_is_its_geometric_mean",
            "engine/src/film/photographic.rs::even_pictures_look_alike_and_brighter_is_never_darker",
            "engine/src/film/photographic.rs::surroundings_are_the_same_at_every_exposure",
            "engine/src/film/photographic.rs::scaled_pictures_look_the_same",
            "engine/src/film/photographic.rs::surroundings_end_at_strong_contrast",
            "engine/src/film/photographic.rs::what_is_not_finite_has_no_part",
            "engine/src/film/photographic.rs::blurs_keep_a_constant_and_the_sum",
            "engine/src/film/tone.rs::photographic_curves_show_a_picture_by_its_own_brightness",
        ],
        api: &["clerestory::film::ToneCurve"],
        settings: &["clerestory render --tone photographic"],
        experiment: "clerestory render builtin:cornell-box --tone photographic",
        ..Row::of("engine/src/film/photographic.rs")
    },
    Row {
        id: "PM-ST-7",
        name: "tone curve L/(1 + L) of each band",
        role: Role::Service,
        limits: "What is bright loses its colour; of pictures in files alone, not of windows.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.3.4")],
        tests: &["engine/src/film/tone.rs::bands_go_to_one_without_a_limit"],
        api: &["clerestory::film::ToneCurve"],
        settings: &["clerestory render --tone bands"],
        experiment: "clerestory render builtin:cornell-box --tone bands",
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ToneCurve; 5] = [
        ToneCurve::Srgb,
        ToneCurve::PbrNeutral,
        ToneCurve::Bands,
        ToneCurve::Photographic,
        ToneCurve::PhotographicLocal,
    ];

    #[test]
    fn bands_go_to_one_without_a_limit() {
        let tone = ToneMap {
            curve: ToneCurve::Bands,
            ..ToneMap::default()
        };
        // 0, 1/2 and 1 through the transfer function.
        assert_eq!(tone.apply([0.0, 1.0, 1e9]), [0, 188, 255]);
        assert_eq!(tone.apply([1.0 / 3.0, 3.0, f32::INFINITY]), [137, 225, 255]);
    }

    #[test]
    fn photographic_curves_show_a_picture_by_its_own_brightness() {
        let picture: Vec<[f32; 3]> = (0..64).map(|i| if i % 8 < 4 { [1e-3; 3] } else { [4e-3; 3] }).collect();
        for curve in [ToneCurve::Photographic, ToneCurve::PhotographicLocal] {
            let tone = ToneMap { exposure: 0.0, curve };
            let shown = tone.display(&picture, 8);
            // The geometric mean 2e-3 becomes 0.18; what is half and twice that is shown as 0.09 and 0.36, or somewhat less where what is around counts.
            let [dark, bright] = [shown[24][0], shown[31][0]];
            assert!(
                (78..=85).contains(&dark) && (140..=162).contains(&bright),
                "{curve:?}: {dark} {bright}"
            );
            assert!(shown.iter().all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]));
            // A pixel that is not finite changes no others, and colours keep their ratios.
            let mut strange = picture.clone();
            (strange[0], strange[1]) = ([f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]);
            strange[2] = [0.002, 0.000_5, 0.001];
            let found = tone.display(&strange, 8);
            assert_eq!((found[0], found[1]), (NAN_COLOR, [255, 0, 0]));
            assert!(found[2][0] > found[2][2] && found[2][2] > found[2][1]);
            assert!(found[31][0].abs_diff(bright) <= 3, "{:?}", found[31]);
        }
    }

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
        for curve in ALL {
            let tone = ToneMap { exposure: 3.0, curve };
            assert_eq!(tone.apply([f32::NAN, 0.0, 0.0]), NAN_COLOR);
            assert_eq!(tone.apply([f32::INFINITY; 3]), [255; 3]);
            assert_eq!(tone.apply([f32::NEG_INFINITY, -1.0, 0.0]), [0; 3]);
            assert!(curve.adapts() || tone.apply([f32::MAX; 3]) == [255; 3], "{curve:?}");
        }
        let stops = ToneMap {
            exposure: -1.0,
            curve: ToneCurve::Srgb,
        };
        assert_eq!(stops.apply([2.0, 0.36, 0.0]), [255, 118, 0]);
    }
}
