//! Reading pictures of any kind that can be compared.

use std::io::Cursor;
use std::path::Path;

use clerestory::film::{Picture, exr, hdr};
use clerestory::input::{InputLimits, read_file};
use clerestory::srgb::linear_from_srgb;
use clerestory::{Error, Result};
use image::ImageDecoder;

/// A path's ending in lower case.
pub fn extension(path: &Path) -> String {
    path.extension()
        .map(|extension| extension.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// Reads an EXR, Radiance HDR or PNG picture. PNG values are taken as sRGB and become linear; alpha is dropped.
///
/// # Errors
/// [`Error::Io`] for what cannot be read, is not a regular file or is too long, and [`Error::Picture`] with the cause.
pub fn read(path: &Path) -> Result<Picture> {
    match extension(path).as_str() {
        "exr" => exr::read(path),
        "hdr" | "pic" => hdr::read(path),
        "png" => read_png(path),
        other => Err(Error::Picture {
            path: path.display().to_string(),
            cause: match other {
                "" => "has no ending; pictures are read by it: .exr, .hdr or .png".into(),
                _ => format!(".{other} pictures cannot be read; .exr, .hdr and .png can"),
            },
        }),
    }
}

/// Bytes in memory for each byte of a file, beyond [`InputLimits::decoded_base`]: the deflate format packs no more than 1032 into one, and f32 values take four
/// times the file's bytes.
const MEMORY_PER_BYTE: u64 = 8192;

fn read_png(path: &Path) -> Result<Picture> {
    let wrong = |cause: String| Error::Picture {
        path: path.display().to_string(),
        cause,
    };
    let limits = InputLimits {
        decoded_per_byte: MEMORY_PER_BYTE,
        ..InputLimits::default()
    };
    let bytes = read_file(path, limits.file)?;
    let length = bytes.len() as u64;
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png);
    let mut decoder_limits = image::Limits::default();
    decoder_limits.max_alloc = Some(limits.decoded(length));
    reader.limits(decoder_limits);
    let decoder = reader.into_decoder().map_err(|cause| wrong(cause.to_string()))?;
    let (width, height) = decoder.dimensions();
    // The values as f32 beside the decoder's, and once more as linear ones.
    let floats = (u64::from(width) * u64::from(height)).saturating_mul(12);
    let memory = decoder.total_bytes().max(floats).saturating_add(floats);
    let allowed = limits.decoded(length);
    if memory > allowed {
        return Err(wrong(format!(
            "decoded, takes {memory} bytes of memory, more than the {allowed} that a file of {length} bytes may take"
        )));
    }
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(|cause| wrong(cause.to_string()))?;
    let values = decoded
        .into_rgb32f()
        .into_raw()
        .into_iter()
        .map(|value| linear_from_srgb(f64::from(value)) as f32);
    Picture::from_radiance(width, height, values.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn pipes_and_devices_are_no_pictures() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|cause| Error::io("temporary folder", cause))?;
        for ending in ["exr", "hdr", "png"] {
            // Opening a pipe would wait for a writer.
            let pipe = folder.path().join(format!("pipe.{ending}"));
            let made = std::process::Command::new("mkfifo").arg(&pipe).status();
            assert!(made.map_err(|cause| Error::io("mkfifo", cause))?.success());
            let device = folder.path().join(format!("device.{ending}"));
            std::os::unix::fs::symlink("/dev/zero", &device).map_err(|cause| Error::io(&device, cause))?;
            for path in [pipe, device] {
                let message = read(&path).map(|_| ()).expect_err("no picture").to_string();
                assert!(message.contains("not a regular file"), "{message}");
            }
        }
        Ok(())
    }

    #[test]
    fn pngs_are_read_and_those_that_cannot_hold_their_size_are_refused() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|cause| Error::io("temporary folder", cause))?;
        let path = folder.path().join("a.png");
        let mut bytes = Vec::new();
        let gray = image::GrayImage::from_pixel(3, 2, image::Luma([255]));
        let written = gray.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png);
        assert!(written.is_ok());
        let with = |bytes: &[u8]| {
            std::fs::write(&path, bytes).map_err(|cause| Error::io(&path, cause))?;
            read(&path)
        };
        assert_eq!(with(&bytes)?.main_layer()?.values(), [1.0; 18]);
        // The header's width and height, and the header's checksum.
        bytes[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        let checksum = crc(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        let message = with(&bytes).map(|_| ()).expect_err("huge").to_string();
        assert!(message.contains("takes 6442450944 bytes of memory"), "{message}");
        // The largest that the format knows, of one bit each, so that a row fits; the values would be more bytes than a number holds.
        bytes[16..24].copy_from_slice(&[0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF]);
        bytes[24] = 1;
        let checksum = crc(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        assert!(matches!(with(&bytes), Err(Error::Picture { .. })));
        Ok(())
    }

    /// The checksum of a PNG chunk, CRC-32 (ISO 3309).
    fn crc(bytes: &[u8]) -> u32 {
        let step = |crc: u32| {
            if crc & 1 == 1 {
                0xEDB8_8320 ^ (crc >> 1)
            } else {
                crc >> 1
            }
        };
        !bytes
            .iter()
            .fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)))
    }
}
