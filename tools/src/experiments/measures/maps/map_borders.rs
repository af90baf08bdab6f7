//! What look-ups jump by over the seams of an octahedron map, against the width of its border and the level of detail; and what levels lose.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.5. Oracle: seamless look-ups, which do not jump, and ∫ L dω of level 0.

use clerestory::Result;
use clerestory::maps::{MapImage, Parametrization};

use super::seams::{ASIDE, LOBES, clamped, deviation, image, jump, lost, pairs};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Study, curves, rows};
use crate::experiments::measures::Context;

const TEXELS: u32 = 128;
/// Maps whose levels are compared.
const MAPS: [Parametrization; 4] = [
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::EqualArea,
    Parametrization::LatLong,
];
/// Widths of the border at level 0, from which those of coarser levels are halved.
const BORDERS: [u32; 6] = [0, 1, 2, 4, 8, 16];
/// In place of a width: a border of one texel that each level has.
const AT_EACH_LEVEL: &str = "1 at each level";
/// Pairs of directions beside seams.
const PAIRS: u32 = 20_000;
/// Height of the plot over the greatest value.
const ROOM: f64 = 1.1;

rows! {
    /// Seams of a level of a map with a border.
    struct Seam = "Jump over seams against border and level" by [border, level] {
        border: String = "border at level 0 (texels)",
        level: u64 = "level",
        jump: f64 = "RMS jump over the field's deviation",
    }
}

rows! {
    /// A level of a map.
    struct Level = "Energy through levels" by [map, level] {
        map: String = "map",
        level: u64 = "level",
        texels: String = "texels",
        plain: f64 = "change by means of four",
        weighted: f64 = "change by means by solid angle",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    seams: Vec<Seam>,
    levels: Vec<Level>,
}

const STEEPEST: &str = "the field's slope over the distance of a pair, of 2·10⁻⁷, and roundings of f32";
const OF_SEAMS: &[Criterion<Seam>] = &[
    Criterion::each(
        "no jump up to the level log₂ of the border's width",
        Bound::AtMost(1e-5),
        |row: &Seam| row.jump.into(),
    )
    .among(Seam::has_a_halved_border)
    .because(STEEPEST),
    Criterion::each(
        "no jump with a border at each level",
        Bound::AtMost(1e-5),
        |row: &Seam| row.jump.into(),
    )
    .among(|row| row.border == AT_EACH_LEVEL)
    .because(STEEPEST),
];
const OF_LEVELS: &[Criterion<Level>] = &[Criterion::each(
    "means by solid angle lose nothing of the integral",
    Bound::AtMost(1e-6),
    |row: &Level| row.weighted.into(),
)
.because("a few roundings of f32 for each level")];

impl Seam {
    /// Whether a texel is left at this level of a border that is halved with each.
    fn has_a_halved_border(&self) -> bool {
        let width = self.border.parse::<u64>();
        width.is_ok_and(|width| width >> self.level > 0)
    }
}

/// Jumps of all levels by the border of each.
fn seams(context: &Context<'_>, rows: u32) -> Result<Vec<Seam>> {
    let mut chain = vec![image(Parametrization::OctahedronQuadratic, rows)?];
    while let Some(next) = chain.last().and_then(|last| last.coarser().ok()) {
        if next.size().x < 2 {
            break;
        }
        chain.push(next);
    }
    let deviation = deviation(&chain[0]);
    let pairs = pairs(context.pick(PAIRS, 200));
    let halved = BORDERS.map(Some);
    let borders: Vec<Option<u32>> = halved.into_iter().chain([None]).collect();
    let name = |border: &Option<u32>| border.map_or_else(|| AT_EACH_LEVEL.to_owned(), |width| width.to_string());
    context.each(&borders, name, |border| {
        let seam = |(level, image): (usize, &MapImage)| {
            let left = border.map_or(1, |width| width >> level);
            Seam {
                border: name(border),
                level: level as u64,
                jump: jump(&pairs, |d| clamped(image, left, d)) / deviation,
            }
        };
        Ok(chain.iter().enumerate().map(seam).collect())
    })
}

/// What levels of a map lose.
fn levels(map: Parametrization, rows: u32) -> Result<Vec<Level>> {
    let first = image(map, rows)?;
    let before = first.integral();
    let (mut plain, mut weighted) = (first.clone(), first);
    let mut levels = Vec::new();
    while let Ok(next) = weighted.coarser() {
        weighted = next;
        plain = MapImage::from_fn(map, plain.size() / 2, |texel| {
            let taps = map.children(plain.size(), texel);
            taps.iter().map(|tap| 0.25 * plain.at(tap.texel).as_dvec3()).sum()
        })?;
        let size = weighted.size();
        levels.push(Level {
            map: map.to_string(),
            level: levels.len() as u64 + 1,
            texels: format!("{} × {}", size.x, size.y),
            plain: lost(&plain, before),
            weighted: lost(&weighted, before),
        });
    }
    Ok(levels)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let rows = context.pick(TEXELS, TEXELS / 4);
        let seams = seams(context, rows)?;
        let levels = context.each(&MAPS, Parametrization::to_string, |map| levels(*map, rows))?;
        Ok(Self { seams, levels })
    }

    fn findings(&self) -> Findings {
        let without = self.seams.iter().find(|row| row.border == "0" && row.level == 0);
        let top = self.seams.iter().map(|row| row.jump).fold(0.0, f64::max);
        let last = self.seams.iter().map(|row| row.level).max().unwrap_or(0);
        Findings::pivoted(&self.seams, "level", OF_SEAMS)
            .headline(
                "RMS jump at level 0 without a border, over the field's deviation",
                without.map(|row| Measured::exact(row.jump)),
            )
            .curves(
                "seams",
                "Jump of bilinear look-ups over seams",
                Axes::even("level of detail", "RMS jump over the field's deviation", ROOM * top, (last as u32, 1.0)),
                curves(
                    &self.seams,
                    |row| row.border.clone(),
                    |row| (row.level as f64, row.jump.into()),
                ),
            )
            .note(format!(
                "RMS difference of bilinear look-ups at both sides of seams ({PAIRS} pairs of directions, {ASIDE:e} beside the planes x = 0 and y = 0 \
                 below the equator), over the field's deviation. The map has {TEXELS} × {TEXELS} texels of {LOBES} lobes a twelfth wide; levels are means \
                 by solid angle. Where no border is left, look-ups stop at the last texel. What is left with a border is the slope over the distance."
            ))
            .and(Findings::of(&self.levels, OF_LEVELS))
            .note("Relative change of ∫ L dω against level 0, the worst of three channels, of the same field.")
    }
}
