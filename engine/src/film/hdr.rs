//! Radiance HDR files (Ward, *Real Pixels*, Graphics Gems II, 1991): 8-bit mantissas with a shared exponent.
//!
//! Guarantees: what the format cannot say (negative and non-finite values) is refused in writing, not bent; a colour errs by at most 1/128
//! of its largest channel. Atomic writes.

use std::io::{BufRead, Seek, SeekFrom};
use std::path::Path;

use image::{ImageDecoder, ImageEncoder};

use super::mark::SOFTWARE;
use super::picture::Picture;
use crate::input::{InputLimits, open_regular};
use crate::{Error, Result};

/// The largest file content read, in pixels: 16384 × 8192, the largest environment maps in use.
const MAX_PIXELS: u64 = 1 << 27;
/// Bytes in memory for each byte of a file, beyond [`InputLimits::decoded_base`]: runs of up to 127 pixels take eight bytes in the file, and are 12 bytes each.
const MEMORY_PER_BYTE: u64 = 256;

/// Reads a Radiance HDR picture as the `radiance` layer.
///
/// # Errors
/// [`Error::Io`] when the file cannot be opened, is not a regular file or is longer than [`InputLimits::file`]; [`Error::Picture`] with the cause.
pub fn read(path: impl AsRef<Path>) -> Result<Picture> {
    let path = path.as_ref();
    let opened = open_regular(path, InputLimits::default().file);
    let (file, _) = opened.map_err(|cause| Error::io(path, cause))?;
    read_from(std::io::BufReader::new(file), &path.display().to_string())
}

/// Reads from memory or any other source; `name` is for messages.
///
/// # Errors
/// [`Error::Picture`] with the cause.
pub fn read_from(mut source: impl BufRead + Seek, name: &str) -> Result<Picture> {
    let wrong = |cause: String| Error::Picture {
        path: name.to_owned(),
        cause,
    };
    let length = source.seek(SeekFrom::End(0)).map_err(|e| wrong(e.to_string()))?;
    source.rewind().map_err(|e| wrong(e.to_string()))?;
    let decoder = image::codecs::hdr::HdrDecoder::new(source).map_err(|e| wrong(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(wrong(format!("{width}×{height} pixels are more than {MAX_PIXELS}")));
    }
    let limits = InputLimits {
        decoded_per_byte: MEMORY_PER_BYTE,
        ..InputLimits::default()
    };
    let memory = decoder.total_bytes();
    limits.check_decoded(memory, length).map_err(wrong)?;
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(|e| wrong(e.to_string()))?;
    Picture::from_radiance(width, height, decoded.into_rgb32f().into_raw())
}

/// Writes a picture's main layer as Radiance HDR.
///
/// # Errors
/// [`Error::Picture`] when a value is negative or not finite, [`Error::Io`] when the file cannot be written.
pub fn write(path: impl AsRef<Path>, picture: &Picture) -> Result<()> {
    let path = path.as_ref();
    let bytes = to_bytes(picture, &path.display().to_string())?;
    crate::atomic::write(path, &bytes)
}

/// The first line of files, the signature.
const SIGNATURE: &[u8] = b"#?RADIANCE\n";

/// The file's bytes; `name` is for messages.
///
/// # Errors
/// [`Error::Picture`] as for [`write()`].
pub fn to_bytes(picture: &Picture, name: &str) -> Result<Vec<u8>> {
    let wrong = |cause: String| Error::Picture {
        path: name.to_owned(),
        cause,
    };
    let values: Vec<f32> = picture.main_layer()?.pixels().flatten().collect();
    let bad = values.iter().filter(|v| !v.is_finite() || **v < 0.0).count();
    if bad > 0 {
        return Err(wrong(format!(
            "Radiance HDR cannot hold {bad} values that are negative or not finite; write EXR"
        )));
    }
    let mut bytes = Vec::new();
    let (width, height) = (picture.width(), picture.height());
    image::codecs::hdr::HdrEncoder::new(&mut bytes)
        .write_image(
            bytemuck::cast_slice(&values),
            width,
            height,
            image::ExtendedColorType::Rgb32F,
        )
        .map_err(|e| wrong(e.to_string()))?;
    if !bytes.starts_with(SIGNATURE) {
        return Err(wrong("the encoder wrote another signature than Radiance's".into()));
    }
    let line = format!("SOFTWARE={SOFTWARE}\n");
    bytes.splice(SIGNATURE.len()..SIGNATURE.len(), line.into_bytes());
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_errs_by_at_most_a_step_of_the_largest_channel() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|e| Error::io("temporary folder", e))?;
        let path = folder.path().join("a.hdr");
        // Widths below and above 8 take the flat and the run-length coded form.
        for (width, height) in [(3u32, 5u32), (37, 4)] {
            let values: Vec<f32> = (0..width * height * 3)
                .map(|i| ((i * 7919 % 1000) as f32 * 0.02 - 8.0).exp2())
                .collect();
            let picture = Picture::from_radiance(width, height, values)?;
            write(&path, &picture)?;
            let back = read(&path)?;
            for (a, b) in picture.main_layer()?.pixels().zip(back.main_layer()?.pixels()) {
                let step = a.iter().fold(0f32, |m, v| m.max(*v)) / 128.0;
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= step), "{a:?} {b:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn refuses_what_the_format_cannot_say() -> Result<()> {
        let path = Path::new("never-written.hdr");
        for value in [-1.0, f32::NAN, f32::INFINITY] {
            let picture = Picture::from_radiance(1, 1, vec![value, 0.0, 0.0])?;
            assert!(matches!(write(path, &picture), Err(Error::Picture { .. })));
        }
        Ok(())
    }

    #[test]
    fn malformed_files_are_errors() {
        let good = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80";
        assert!(read_from(std::io::Cursor::new(good), "good").is_ok());
        for end in 0..good.len() {
            assert!(read_from(std::io::Cursor::new(&good[..end]), "cut").is_err(), "{end}");
        }
        let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n";
        assert!(read_from(std::io::Cursor::new(huge), "huge").is_err());
        // As many pixels as a file may have, in one that cannot hold them.
        let large = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 8192\n";
        let error = read_from(std::io::Cursor::new(large), "large")
            .expect_err("large")
            .to_string();
        assert!(error.contains("takes 805306368 bytes of memory"), "{error}");
    }
}
