//! Pictures written and read back: what each format keeps, how large it is and how fast.
//!
//! Oracle: the picture before it was written.

use std::path::{Path, PathBuf};

use clerestory::film::{Picture, ToneMap, exr, hdr, png};
use clerestory::srgb::{linear_from_srgb, srgb_from_linear};
use clerestory::{Error, Result};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::{Errors, greatest};
use crate::random::Random;
use crate::timing::timed;

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

/// A format with its functions.
struct Format {
    name: &'static str,
    ending: &'static str,
    write: fn(&Path, &Picture) -> Result<()>,
    read: fn(&Path) -> Result<Vec<f64>>,
}

const EXR: &str = "OpenEXR, f32";
const HDR: &str = "Radiance HDR";
const PNG: &str = "PNG, 8 bits, sRGB";

const FORMATS: [Format; 3] = [
    Format {
        name: EXR,
        ending: "exr",
        write: |path, picture| exr::write(path, picture),
        read: |path| read_values(exr::read(path)?),
    },
    Format {
        name: HDR,
        ending: "hdr",
        write: |path, picture| hdr::write(path, picture),
        read: |path| read_values(hdr::read(path)?),
    },
    Format {
        name: PNG,
        ending: "png",
        write: |path, picture| {
            let shown = png::tone_mapped(picture.main_layer()?, picture.width(), &ToneMap::default());
            png::write(path, &shown)
        },
        read: read_png,
    },
];

/// A value that lies this far above 1 is cut where 1 comes back.
const CUT: f64 = 1.01;

rows! {
    /// A format.
    struct Row = "Radiance, written and read back" by [format] {
        format: String = "format",
        pixels: u64 = "pixels",
        changed: u64 = "values changed",
        of_pixel: f64 = "worst error over the pixel's largest channel",
        relative: f64 = "worst relative error up to 1",
        encoded: f64 = "worst error of the sRGB value up to 1 (1/255)",
        cut: u64 = "values above 1.01 that were cut",
        bytes: f64 = "bytes per pixel",
        written: Repeats = "written (MB/s)",
        read: Repeats = "read (MB/s)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "OpenEXR loses nothing: values changed",
        Bound::AtMost(0.0),
        |row: &Row| row.changed.into(),
    )
    .among(|row| row.format == EXR)
    .in_every_form(),
    Criterion::each(
        "Radiance HDR loses what 8 bits do, of the pixel's largest channel",
        Bound::AtMost(1.0 / 128.0),
        |row: &Row| row.of_pixel.into(),
    )
    .among(|row| row.format == HDR)
    .because("a step of 8 bits, which are cut, of which the largest channel fills half at least: what `clerestory::film::hdr` states")
    .in_every_form(),
    Criterion::each(
        "PNG loses what 8 bits do, of sRGB values up to 1 in 1/255",
        Bound::AtMost(0.501),
        |row: &Row| row.encoded.into(),
    )
    .among(|row| row.format == PNG)
    .because("half a step, and roundings of f32")
    .in_every_form(),
];

impl Row {
    /// All but times: what came back of a picture's values.
    fn of(format: &Format, values: &[f64], back: &[f64], bytes: u64) -> Self {
        let (mut of_pixel, mut relative, mut encoded) = (Errors::default(), Errors::default(), Errors::default());
        let (mut changed, mut cut) = (values.len().abs_diff(back.len()) as u64, 0);
        for (pixel, after) in values.chunks(3).zip(back.chunks(3)) {
            let largest = greatest(pixel.iter().copied());
            for (before, after) in pixel.iter().zip(after) {
                changed += u64::from(before != after);
                cut += u64::from(*before > CUT && *after <= 1.0);
                of_pixel.add((after - before) / largest);
                if *before <= 1.0 {
                    relative.add((after - before) / before);
                    encoded.add(255.0 * (srgb_from_linear(*after) - srgb_from_linear(*before)));
                }
            }
        }
        if values.len() != back.len() {
            of_pixel.add(f64::INFINITY);
        }
        let pixels = values.len() / 3;
        Self {
            format: format.name.into(),
            pixels: pixels as u64,
            changed,
            of_pixel: of_pixel.worst(),
            relative: relative.worst(),
            encoded: encoded.worst(),
            cut,
            bytes: bytes as f64 / pixels as f64,
            ..Self::default()
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let picture = picture(context.pick(1024, 32))?;
        let values: Vec<f64> = read_values(picture.clone())?;
        let folder = Folder::new()?;
        let paths = FORMATS.map(|format| folder.0.join("picture").with_extension(format.ending));
        // Of f32, a value.
        let megabytes = values.len() as f64 * 4e-6;
        let rate = |(result, seconds): (Result<()>, f64)| result.map(|()| megabytes / seconds);
        let written = context.in_turns(9, FORMATS.len(), |i| {
            rate(timed(|| (FORMATS[i].write)(&paths[i], &picture)))
        })?;
        let mut back = FORMATS.map(|_| Vec::new());
        let read = context.in_turns(9, FORMATS.len(), |i| {
            rate(timed(|| {
                back[i] = (FORMATS[i].read)(&paths[i])?;
                Ok(())
            }))
        })?;
        let mut rows = Vec::new();
        for (i, (written, read)) in written.into_iter().zip(read).enumerate() {
            let bytes = std::fs::metadata(&paths[i])
                .map_err(|error| Error::io(&paths[i], error))?
                .len();
            rows.push(Row {
                written: Repeats(written),
                read: Repeats(read),
                ..Row::of(&FORMATS[i], &values, &back[i], bytes)
            });
        }
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "bytes per pixel of OpenEXR",
                self.iter().find(|row| row.format == EXR).map(|row| row.bytes.into()),
            )
            .note(
                "Rates are over the values in f32, in turns, files in the system's temporary folder. PNG is written with the curve that shows \
                 [0, 1] exactly.",
            )
    }
}
