//! Picture strips: the reference beside each variant's picture, with signed differences and FLIP errors below.

use std::path::Path;

use clerestory::film::metrics::{CompareOptions, flip_map};
use clerestory::film::png::{self, Rgb8};
use clerestory::film::{Picture, compare};
use clerestory::{Error, Result};
use image::ImageEncoder;

use super::reference::{short_name, slug};
use super::results::{SceneResults, VariantResults};

/// Pixels between the pictures of a strip.
const GAP: u32 = 4;
/// The FLIP error that is white.
const FLIP_FULL_SCALE: f32 = 1.0;

/// A variant's pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// The variant's name.
    pub name: String,
    /// As it looks.
    pub picture: Rgb8,
    /// Red too bright, blue too dark, white equal.
    pub difference: Rgb8,
    /// FLIP error from 0 (black) to 1 (white).
    pub flip: Rgb8,
}

/// The pictures of one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// The reference as it looks.
    pub reference: Rgb8,
    /// Radiance difference that is full colour.
    pub full_scale: f32,
    /// By variant, those without a picture left out.
    pub columns: Vec<Column>,
}

/// The strip of a scene with all of its variants; `None` of results that were read back, which have no pictures.
///
/// # Errors
/// [`Error::Picture`] for pictures that do not fit each other.
pub fn of(results: &SceneResults) -> Result<Option<Strip>> {
    among(results, |_| true)
}

/// The strip of a scene with those of its variants that a page of results keeps, by name; `None` without any, and of results that were read back.
///
/// # Errors
/// As [`of`].
pub fn kept(results: &SceneResults, names: &[String]) -> Result<Option<Strip>> {
    let strip = among(results, |variant| names.contains(&variant.name))?;
    Ok(strip.filter(|strip| !strip.columns.is_empty()))
}

/// The file of [`kept`], in the experiment's folder.
pub fn file(results: &SceneResults) -> String {
    format!("{}-strip.png", slug(&results.address))
}

/// What [`kept`] shows, in words, of results that were read back too; `None` where it has no variant. Its full colour is the greatest of the errors that the
/// measurements of its pictures hold.
pub fn words(results: &SceneResults, names: &[String]) -> Option<String> {
    let shown = results.variants.iter().filter(|variant| names.contains(&variant.name));
    let measured = shown.filter_map(|variant| {
        let picture = variant.points.last()?.measurements.first()?;
        Some((variant.name.as_str(), picture.quantile_999 as f32))
    });
    let (shown, errors): (Vec<&str>, Vec<f32>) = measured.unzip();
    (!shown.is_empty()).then(|| {
        format!(
            "{}, from the left: reference, {}; below them, red too bright and blue too dark: full colour is a difference of radiance of {:.3e}",
            short_name(&results.address),
            shown.join(", "),
            full_scale(errors)
        )
    })
}

/// The radiance difference that is full colour, of the pictures' greatest errors: one scale for all, so that the variants can be compared by eye.
fn full_scale(errors: impl IntoIterator<Item = f32>) -> f32 {
    let greatest = errors.into_iter().fold(0.0, f32::max);
    if greatest > 0.0 && greatest.is_finite() {
        greatest
    } else {
        1.0
    }
}

fn among(results: &SceneResults, is_shown: impl Fn(&VariantResults) -> bool) -> Result<Option<Strip>> {
    let Some(reference) = &results.reference_picture else {
        return Ok(None);
    };
    let tone = results.tone;
    let options = CompareOptions {
        tone,
        ..CompareOptions::default()
    };
    let shown = |picture: &Picture| Ok::<_, Error>(png::tone_mapped(picture.main_layer()?, picture.width(), &tone));
    let variants = results.variants.iter().filter(|variant| is_shown(variant));
    let pictures: Vec<(&String, &Picture)> = variants
        .filter_map(|variant| Some((&variant.name, variant.picture.as_ref()?)))
        .collect();
    let mut errors = Vec::new();
    for (_, picture) in &pictures {
        errors.push(compare(picture, reference, &options)?.quantile_999 as f32);
    }
    let full_scale = full_scale(errors);
    let columns = pictures.into_iter().map(|(name, picture)| {
        let flip = flip_map(picture, reference, &options)?;
        Ok(Column {
            name: name.clone(),
            picture: shown(picture)?,
            difference: png::difference(
                picture.main_layer()?,
                reference.main_layer()?,
                picture.width(),
                full_scale,
            )?,
            flip: png::false_color(&flip, picture.width(), FLIP_FULL_SCALE)?,
        })
    });
    Ok(Some(Strip {
        reference: shown(reference)?,
        full_scale,
        columns: columns.collect::<Result<_>>()?,
    }))
}

impl Strip {
    /// All in one picture: a column for the reference and each variant; rows for pictures, differences and FLIP errors.
    pub fn composed(&self) -> Rgb8 {
        self.in_rows(|column| vec![&column.picture, &column.difference, &column.flip])
    }

    /// As [`Strip::composed`], without FLIP errors.
    pub fn of_differences(&self) -> Rgb8 {
        self.in_rows(|column| vec![&column.picture, &column.difference])
    }

    /// The reference, and the rows of each variant, from the top.
    fn in_rows(&self, rows: impl Fn(&Column) -> Vec<&Rgb8>) -> Rgb8 {
        let (width, height) = (self.reference.width, self.reference.height);
        let across = self.columns.len() as u32 + 1;
        let down = self.columns.first().map_or(1, |column| rows(column).len() as u32);
        let mut whole = Rgb8 {
            width: across * width + (across - 1) * GAP,
            height: down * height + (down - 1) * GAP,
            bytes: Vec::new(),
        };
        whole.bytes = vec![u8::MAX; whole.width as usize * whole.height as usize * 3];
        place(&mut whole, &self.reference, 0, 0);
        for (index, column) in self.columns.iter().enumerate() {
            let x = (index as u32 + 1) * (width + GAP);
            for (row, picture) in (0..).zip(rows(column)) {
                place(&mut whole, picture, x, row * (height + GAP));
            }
        }
        whole
    }
}

/// Copies the part of a picture that fits.
fn place(whole: &mut Rgb8, part: &Rgb8, x: u32, y: u32) {
    let stride = whole.width as usize * 3;
    let rows = part.bytes.chunks_exact((part.width as usize * 3).max(1));
    let targets = whole.bytes.chunks_exact_mut(stride.max(1)).skip(y as usize);
    for (target, row) in targets.zip(rows) {
        let start = x as usize * 3;
        if let Some(slot) = target.get_mut(start..start + row.len()) {
            slot.copy_from_slice(row);
        }
    }
}

/// The bytes of a PNG file.
///
/// # Errors
/// [`Error::Picture`] when it cannot be encoded.
pub fn png_bytes(picture: &Rgb8, name: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(
            &picture.bytes,
            picture.width,
            picture.height,
            image::ExtendedColorType::Rgb8,
        )
        .map_err(|cause| Error::Picture {
            path: name.display().to_string(),
            cause: cause.to_string(),
        })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::series::tests::made_up_scene;
    use super::*;

    #[test]
    fn every_variant_has_its_column() {
        let strip = of(&made_up_scene()).unwrap().unwrap();
        assert_eq!(strip.columns.len(), 2);
        assert_eq!(strip.full_scale, 0.25);
        assert_eq!(
            strip.columns[0].difference.bytes,
            [255, 0, 0, 255, 0, 0],
            "twice too bright"
        );
        let whole = strip.composed();
        assert_eq!((whole.width, whole.height), (3 * 2 + 2 * GAP, 3 + 2 * GAP));
        let at = |x: u32, y: u32| {
            let i = ((y * whole.width + x) * 3) as usize;
            &whole.bytes[i..i + 3]
        };
        assert_eq!(at(0, 0), &strip.reference.bytes[..3]);
        assert_eq!(at(2 + GAP, 0), &strip.columns[0].picture.bytes[..3]);
        assert_eq!(at(2 * (2 + GAP) + 1, 1 + GAP), [255, 0, 0]);
        assert_eq!(at(0, 2 + 2 * GAP), [255; 3], "nothing below the reference");
        assert!(png_bytes(&whole, Path::new("strip")).unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_page_of_results_keeps_named_variants_and_says_the_same_without_their_pictures() {
        let mut scene = made_up_scene();
        for variant in &mut scene.variants {
            variant.points[2].measurements[0].quantile_999 = 0.25;
        }
        let names = ["slow".to_owned()];
        let strip = kept(&scene, &names).unwrap().unwrap();
        assert_eq!((strip.columns.len(), strip.full_scale), (1, 0.25));
        let whole = strip.of_differences();
        assert_eq!((whole.width, whole.height), (2 * 2 + GAP, 2 + GAP));
        assert_eq!(file(&scene), "ring-strip.png");
        let with_pictures = words(&scene, &names).unwrap();
        assert!(
            with_pictures.contains("reference, slow;") && with_pictures.contains("2.500e-1"),
            "{with_pictures}"
        );
        scene.reference_picture = None;
        for variant in &mut scene.variants {
            variant.picture = None;
        }
        assert_eq!(words(&scene, &names), Some(with_pictures));
        assert_eq!(kept(&scene, &names).unwrap(), None);
        assert_eq!(words(&scene, &[]), None);
        assert_eq!(kept(&made_up_scene(), &[]).unwrap(), None);
    }

    #[test]
    fn a_variant_without_a_picture_has_no_column() {
        let mut results = made_up_scene();
        results.variants[0].picture = None;
        assert_eq!(of(&results).unwrap().map(|strip| strip.columns.len()), Some(1));
        results.reference_picture = None;
        assert_eq!(of(&results).unwrap(), None);
    }
}
