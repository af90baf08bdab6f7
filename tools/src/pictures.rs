//! Reading pictures of any kind that can be compared.

use std::path::Path;

use clerestory::film::{Picture, exr, hdr};
use clerestory::srgb::linear_from_srgb;
use clerestory::{Error, Result};

/// A path's ending in lower case.
pub fn extension(path: &Path) -> String {
    path.extension()
        .map(|extension| extension.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// Reads an EXR, Radiance HDR or PNG picture. PNG values are taken as sRGB and become linear; alpha is dropped.
///
/// # Errors
/// [`Error::Io`] and [`Error::Picture`] with the cause.
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

fn read_png(path: &Path) -> Result<Picture> {
    let wrong = |cause: image::ImageError| Error::Picture {
        path: path.display().to_string(),
        cause: cause.to_string(),
    };
    let mut reader = image::ImageReader::open(path).map_err(|cause| Error::io(path, cause))?;
    reader.set_format(image::ImageFormat::Png);
    let decoded = reader.decode().map_err(wrong)?.into_rgb32f();
    let (width, height) = decoded.dimensions();
    let values = decoded
        .into_raw()
        .into_iter()
        .map(|value| linear_from_srgb(f64::from(value)) as f32);
    Picture::from_radiance(width, height, values.collect())
}
