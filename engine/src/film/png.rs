//! PNG files: tone-mapped pictures, difference pictures and false colours, 8-bit sRGB.
//!
//! False colours follow D. A. Green, *A colour scheme for the display of astronomical intensity images*, Bull. Astr. Soc. India 39 (2011), §3
//! ("cubehelix"): lightness grows evenly with the value, in colour, in grey print and for the colour-blind.
//! Guarantees: deterministic bytes; atomic writes. A text chunk, `Software`, names the engine.

use std::path::Path;

use image::ImageEncoder;

use super::mark::SOFTWARE;
use super::picture::Layer;
use super::tone::{NAN_COLOR, ToneMap};
use crate::srgb::quantize;
use crate::{Error, Result};

/// An 8-bit sRGB picture, the top row first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rgb8 {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width × height × 3` bytes.
    pub bytes: Vec<u8>,
}

/// A layer through a tone map. `width` is the width of the layer's picture.
pub fn tone_mapped(layer: &Layer, width: u32, tone: &ToneMap) -> Rgb8 {
    let pixels: Vec<[f32; 3]> = layer.pixels().collect();
    from_pixels(width, tone.display(&pixels, width).into_iter())
}

/// Signed difference of two layers of equal size: mean over the channels of `test − reference`, divided by `full_scale`; red is too
/// bright, blue too dark, white no difference, magenta a NaN.
///
/// # Errors
/// [`Error::Picture`] when the sizes differ or `full_scale` is not above zero.
pub fn difference(test: &Layer, reference: &Layer, width: u32, full_scale: f32) -> Result<Rgb8> {
    if test.pixels().len() != reference.pixels().len() || full_scale <= 0.0 || full_scale.is_nan() {
        return Err(Error::Picture {
            path: format!("difference of {:?} and {:?}", test.name(), reference.name()),
            cause: format!("needs equal sizes and a full scale above 0 (it is {full_scale})"),
        });
    }
    let mean = |p: [f32; 3]| p.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
    let pixels = test.pixels().zip(reference.pixels()).map(|(test, reference)| {
        let difference = (mean(test) - mean(reference)) / f64::from(full_scale);
        if difference.is_nan() {
            return NAN_COLOR;
        }
        let rest = quantize(1.0 - difference.abs().min(1.0));
        if difference > 0.0 {
            [255, rest, rest]
        } else {
            [rest, rest, 255]
        }
    });
    Ok(from_pixels(width, pixels))
}

/// Values as false colours: 0 is black, `full_scale` and more white, NaN magenta.
///
/// # Errors
/// [`Error::Picture`] when `width` does not divide the count of values or `full_scale` is not above zero.
pub fn false_color(values: &[f32], width: u32, full_scale: f32) -> Result<Rgb8> {
    if width == 0 || !values.len().is_multiple_of(width as usize) || full_scale <= 0.0 || full_scale.is_nan() {
        return Err(Error::Picture {
            path: "false-colour picture".into(),
            cause: format!("needs whole rows of {width} values and a full scale above 0 (it is {full_scale})"),
        });
    }
    let pixels = values.iter().map(|value| {
        if value.is_nan() {
            NAN_COLOR
        } else {
            cubehelix(f64::from(value / full_scale).clamp(0.0, 1.0)).map(quantize)
        }
    });
    Ok(from_pixels(width, pixels))
}

/// Green's scheme with start 0.5, −1.5 rotations, hue 1 and gamma 1: a value in [0, 1] to display RGB.
fn cubehelix(value: f64) -> [f64; 3] {
    let angle = std::f64::consts::TAU * (0.5 / 3.0 - 1.5 * value);
    let amplitude = value * (1.0 - value) / 2.0;
    let (sin, cos) = angle.sin_cos();
    let channel = |c: f64, s: f64| (value + amplitude * (c * cos + s * sin)).clamp(0.0, 1.0);
    [
        channel(-0.148_61, 1.782_77),
        channel(-0.292_27, -0.906_49),
        channel(1.972_94, 0.0),
    ]
}

fn from_pixels(width: u32, pixels: impl ExactSizeIterator<Item = [u8; 3]>) -> Rgb8 {
    let height = (pixels.len() / (width as usize).max(1)) as u32;
    Rgb8 {
        width,
        height,
        bytes: pixels.flatten().collect(),
    }
}

/// Writes an 8-bit picture as PNG, as a whole or not at all.
///
/// # Errors
/// [`Error::Picture`] when it cannot be encoded, [`Error::Io`] when it cannot be written.
pub fn write(path: impl AsRef<Path>, picture: &Rgb8) -> Result<()> {
    let path = path.as_ref();
    let bytes = to_bytes(picture, &path.display().to_string())?;
    crate::atomic::write(path, &bytes)
}

/// Bytes of the signature and of the first chunk, IHDR, with its length, name and check sum (PNG specification, third edition, §5.2 and §11.2.1).
const BEFORE_CHUNKS: usize = 8 + 4 + 4 + 13 + 4;

/// The file's bytes; `name` is for messages.
///
/// # Errors
/// [`Error::Picture`] as for [`write()`].
pub fn to_bytes(picture: &Rgb8, name: &str) -> Result<Vec<u8>> {
    let expected = picture.width as usize * picture.height as usize * 3;
    let mut bytes = Vec::new();
    let encoded = if picture.bytes.len() == expected {
        image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(
                &picture.bytes,
                picture.width,
                picture.height,
                image::ExtendedColorType::Rgb8,
            )
            .map_err(|cause| cause.to_string())
    } else {
        Err(format!("holds {} bytes in place of {expected}", picture.bytes.len()))
    };
    encoded.map_err(|cause| Error::Picture {
        path: name.to_owned(),
        cause,
    })?;
    bytes.splice(BEFORE_CHUNKS..BEFORE_CHUNKS, text_chunk("Software", SOFTWARE));
    Ok(bytes)
}

/// A chunk tEXt, which holds a key and a text in Latin-1 (§11.3.3.2).
fn text_chunk(key: &str, text: &str) -> Vec<u8> {
    let content = [&b"tEXt"[..], key.as_bytes(), b"\0", text.as_bytes()].concat();
    let length = (content.len() - 4) as u32;
    let check = crc32(&content);
    [&length.to_be_bytes()[..], &content, &check.to_be_bytes()].concat()
}

/// The check sum of chunks (annex D).
fn crc32(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0xedb8_8320;
    let bit = |crc: u32, _| (crc >> 1) ^ (POLYNOMIAL & (crc & 1).wrapping_neg());
    !bytes
        .iter()
        .fold(!0u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), bit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Picture;

    #[test]
    fn a_written_file_reads_back_to_the_byte() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|e| Error::io("temporary folder", e))?;
        let path = folder.path().join("a.png");
        let values: Vec<f32> = (0..5 * 3 * 3).map(|i| i as f32 / 40.0).collect();
        let picture = Picture::from_radiance(5, 3, values)?;
        let mapped = tone_mapped(picture.main_layer()?, 5, &ToneMap::default());
        write(&path, &mapped)?;
        let read = image::open(&path)
            .map_err(|e| Error::Picture {
                path: "a.png".into(),
                cause: e.to_string(),
            })?
            .into_rgb8();
        assert_eq!((read.width(), read.height()), (5, 3));
        assert_eq!(read.into_raw(), mapped.bytes);
        Ok(())
    }

    #[test]
    fn check_sums_are_those_of_the_standard() {
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        // The last chunk of every PNG file.
        assert_eq!(crc32(b"IEND"), 0xae42_6082);
    }

    #[test]
    fn differences_are_coloured_by_sign() -> Result<()> {
        let test = Picture::from_radiance(4, 1, vec![1., 1., 1., 0., 0., 0., 2., 2., 2., f32::NAN, 0., 0.])?;
        let reference = Picture::from_radiance(4, 1, vec![1., 1., 1., 2., 2., 2., 0., 0., 0., 0., 0., 0.])?;
        let picture = difference(test.main_layer()?, reference.main_layer()?, 4, 1.0)?;
        assert_eq!(picture.bytes, [255, 255, 255, 0, 0, 255, 255, 0, 0, 255, 0, 255]);
        assert!(difference(test.main_layer()?, reference.main_layer()?, 4, 0.0).is_err());
        Ok(())
    }

    #[test]
    fn false_colours_grow_lighter_with_the_value() -> Result<()> {
        let values: Vec<f32> = (0..=100).map(|i| i as f32 / 100.0).collect();
        let picture = false_color(&values, 101, 1.0)?;
        assert_eq!(
            (&picture.bytes[..3], &picture.bytes[300..]),
            (&[0u8; 3][..], &[255u8; 3][..])
        );
        // Green's weights of perceived brightness; rounding to 8 bits moves each by at most half a step.
        let lightness = |p: &[u8]| 0.30 * f64::from(p[0]) + 0.59 * f64::from(p[1]) + 0.11 * f64::from(p[2]);
        let mut before = -1.0;
        for pixel in picture.bytes.chunks_exact(3) {
            assert!(lightness(pixel) > before - 0.5);
            before = lightness(pixel);
        }
        assert!(false_color(&values, 7, 1.0).is_err());
        Ok(())
    }
}
