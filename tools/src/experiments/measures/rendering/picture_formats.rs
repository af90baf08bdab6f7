//! Pictures written and read back: what each format keeps, how large it is and how fast.
//!
//! Oracle: the picture before it was written.

use std::path::{Path, PathBuf};

use clerestory::film::{Picture, ToneMap, exr, hdr, png};
use clerestory::srgb::linear_from_srgb;
use clerestory::{Error, Result};

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::seconds;
use crate::experiments::measures::errors::Errors;
use crate::experiments::table::Table;
use crate::random::Random;

/// Radiances of a rendered look: large smooth parts, noise of a few per cent and highlights far above one.
fn picture(size: u32) -> Result<Picture> {
    let mut random = Random::new(9);
    let mut values = Vec::new();
    for y in 0..size {
        for x in 0..size {
            let [u, v] = [x, y].map(|at| f64::from(at) / f64::from(size));
            let glow = 1e4 * (-2e3 * ((u - 0.3).powi(2) + (v - 0.4).powi(2))).exp();
            let base = 1e-3 * 10_f64.powf(3.0 * u) + glow;
            let noise = 1.0 + 0.05 * random.range(-1.0, 1.0);
            values.extend([1.0, 0.7 + 0.3 * v, 0.2 + 0.5 * u].map(|tint| (base * tint * noise) as f32));
        }
    }
    Picture::from_radiance(size, size, values)
}

/// A folder that is gone when this is.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("clerestory-formats-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|error| Error::io(&path, error))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What stays is a few files in the system's folder for such.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn read_png(path: &Path) -> Result<Vec<f64>> {
    let picture = image::open(path).map_err(|error| Error::Picture {
        path: path.display().to_string(),
        cause: error.to_string(),
    })?;
    let bytes = picture.into_rgb8().into_raw();
    Ok(bytes
        .into_iter()
        .map(|byte| linear_from_srgb(f64::from(byte) / 255.0))
        .collect())
}

fn read_values(picture: Picture) -> Result<Vec<f64>> {
    Ok(picture.main_layer()?.values().iter().map(|v| f64::from(*v)).collect())
}

type Write = fn(&Path, &Picture) -> Result<()>;
type Read = fn(&Path) -> Result<Vec<f64>>;

const FORMATS: [(&str, &str, Write, Read); 3] = [
    (
        "OpenEXR, f32",
        "exr",
        |path, picture| exr::write(path, picture),
        |path| read_values(exr::read(path)?),
    ),
    (
        "Radiance HDR",
        "hdr",
        |path, picture| hdr::write(path, picture),
        |path| read_values(hdr::read(path)?),
    ),
    (
        "PNG, 8 bits, sRGB",
        "png",
        |path, picture| {
            let shown = png::tone_mapped(picture.main_layer()?, picture.width(), &ToneMap::default());
            png::write(path, &shown)
        },
        read_png,
    ),
];

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let size = if context.smoke { 32 } else { 1024 };
    let picture = picture(size)?;
    let values: Vec<f64> = read_values(picture.clone())?;
    let largest: Vec<f64> = values
        .chunks(3)
        .map(|pixel| pixel.iter().copied().fold(0.0, f64::max))
        .collect();
    let megabytes = values.len() as f64 * 4e-6;
    let folder = Folder::new()?;
    let mut table = Table::new(
        format!("Radiance of {size} × {size} pixels, written and read back"),
        &[
            "format",
            "values changed",
            "worst error over the pixel's largest channel",
            "worst relative error up to 1",
            "values above 1.01 that were cut",
            "bytes a pixel",
            "MB/s written",
            "MB/s read",
        ],
    );
    for (name, ending, write, read) in FORMATS {
        let path = folder.0.join(format!("picture.{ending}"));
        let writing = seconds(context.smoke, || write(&path, &picture))?;
        let mut back = Vec::new();
        let reading = seconds(context.smoke, || {
            back = read(&path)?;
            Ok::<(), Error>(())
        })?;
        let bytes = std::fs::metadata(&path).map_err(|error| Error::io(&path, error))?.len();
        let (mut of_pixel, mut shown) = (Errors::default(), Errors::default());
        let (mut changed, mut cut) = (0_u64, 0_u64);
        for (i, (before, after)) in values.iter().zip(&back).enumerate() {
            changed += u64::from(before != after);
            cut += u64::from(*before > 1.01 && *after <= 1.0);
            of_pixel.add((after - before) / largest[i / 3]);
            if *before <= 1.0 {
                shown.add((after - before) / before);
            }
        }
        if back.len() != values.len() {
            of_pixel.add(f64::INFINITY);
        }
        table.row([
            name.into(),
            changed.into(),
            of_pixel.worst().into(),
            shown.worst().into(),
            cut.into(),
            (bytes as f64 / f64::from(size * size)).into(),
            (megabytes / writing).into(),
            (megabytes / reading).into(),
        ]);
    }
    table.note(format!(
        "{} values; rates over their {megabytes:.1} MB of f32, files in the system's temporary folder. PNG is written with the curve that shows \
         [0, 1] exactly.",
        values.len()
    ));
    Ok(vec![table])
}
