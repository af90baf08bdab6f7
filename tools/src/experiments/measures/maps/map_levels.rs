//! Levels of detail of look-ups where quads of pixels straddle the seams of an octahedron map, by four ways to find them.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.4. Oracle: the level by the exact derivatives of each pixel's own
//! direction, through those of the map's decoding.

use clerestory::Result;
use clerestory::maps::Parametrization;

use super::seam_levels::{
    BY_OCTANT, EYE, GATED, MIRRORED, RECTANGLE, RIM, SQUARE, SQUARES, TEXELS, WHITE_LEVEL, Way, checkers, exact_levels,
    levels, pictures,
};
use super::sphere::{Sphere, sheet};
use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;

/// Pixels of the sphere's picture along a side.
const SIDE: u32 = 256;
/// Height over width of the pixels of another one: those that straddle the equator look finer, mirrored, than they are.
const TALL: u32 = 8;
/// Columns of it.
const TALL_SIDE: u32 = 512;
/// Ways to find levels with their names.
type Ways = &'static [(Way, &'static str)];

/// Maps with the ways of each, and where its picture goes.
const MAPS: [(Parametrization, Ways, &str); 2] = [
    (Parametrization::OctahedronQuadratic, &SQUARE, "levels.png"),
    (
        Parametrization::OctahedronRectangular,
        &RECTANGLE,
        "levels-rectangular.png",
    ),
];

rows! {
    /// A way to find levels, in a map.
    struct Row = "Levels of detail over seams" by [map, tall, way] {
        map: String = "map",
        tall: u64 = "height of pixels over their width",
        way: String = "level by",
        jump: f64 = "largest jump between neighbours (levels)",
        too_coarse: f64 = "too coarse by at most (levels)",
        too_fine: f64 = "too fine by at most (levels)",
        off: u64 = "pixels off by more than 1",
        pixels: u64 = "pixels",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "no jump above one level between neighbouring pixels",
        Bound::AtMost(1.0),
        |row: &Row| row.jump.into(),
    )
    .among(Row::is_the_engines),
    Criterion::each(
        "no line along the seams: pixels off by more than a level",
        Bound::AtMost(0.0),
        |row: &Row| row.off.into(),
    )
    .among(Row::is_the_engines),
    Criterion::each(
        "with its gate the repair by a mirrored direction is too fine by a level at most",
        Bound::AtMost(1.0),
        |row: &Row| row.too_fine.into(),
    )
    .among(|row| row.way == GATED),
    Criterion::each(
        "without it the repair is too fine by more than two levels where tall pixels straddle the equator",
        Bound::AtLeast(2.0),
        |row: &Row| row.too_fine.into(),
    )
    .among(|row| row.way == MIRRORED && row.tall > 1),
];

/// The level that a look-up samples, the finest at least; not a number of one that is none.
fn sampled(level: f64) -> f64 {
    level.clamp(0.0, f64::INFINITY)
}

impl Row {
    fn is_the_engines(&self) -> bool {
        self.way == BY_OCTANT
    }

    /// Adds how levels compare with the exact ones.
    fn compared(mut self, sphere: &Sphere, found: &[Option<f64>], exact: &[Option<f64>]) -> Self {
        let side = sphere.side as usize;
        let inside = |i: usize| sphere.place((i % side) as u32, (i / side) as u32).length() < RIM;
        for i in (0..found.len()).filter(|i| inside(*i)) {
            // All pixels inside have a level: one without is as wrong as one that is no number.
            let [here, right] = [found[i], exact[i]].map(|level| level.unwrap_or(f64::NAN));
            let is_near = (here - right).abs() <= 1.0;
            self.pixels += 1;
            self.too_coarse = greatest([self.too_coarse, here - right]);
            self.too_fine = greatest([self.too_fine, right - here]);
            self.off += u64::from(!is_near);
            let next = [i + 1, i + side].into_iter();
            for next in next.filter(|next| *next < found.len() && inside(*next)) {
                let [here, there] = [found[i], found[next]].map(|level| level.map_or(f64::NAN, sampled));
                self.jump = greatest([self.jump, (there - here).abs()]);
            }
        }
        self
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let side = context.pick(SIDE, 48);
        let tall = context.pick(TALL_SIDE, 256);
        let spheres = [[side, side], [tall, tall / TALL]].map(|pixels| Sphere::of_pixels(EYE, pixels));
        let name = |(map, ..): &(Parametrization, &[(Way, &str)], &str)| map.to_string();
        context.each(&MAPS, name, |(map, ways, file)| {
            let mut chain = vec![checkers(*map)?];
            while let Some(next) = chain.last().and_then(|last| last.coarser().ok()) {
                chain.push(next);
            }
            let (mut rows, mut seen, mut shown) = (Vec::new(), Vec::new(), Vec::new());
            for sphere in &spheres {
                let exact = exact_levels(sphere, *map);
                for (way, name) in *ways {
                    let found = levels(sphere, *map, *way);
                    let row = Row {
                        map: map.to_string(),
                        tall: u64::from(sphere.side / sphere.rows),
                        way: (*name).into(),
                        ..Row::default()
                    };
                    rows.push(row.compared(sphere, &found, &exact));
                    if sphere.side == sphere.rows {
                        let [a, b] = pictures(sphere, &chain, &found);
                        seen.push(a);
                        shown.push(b);
                    }
                }
            }
            context.picture(file, &sheet(&[seen, shown]));
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let pictures = MAPS
            .iter()
            .filter(|(map, ..)| self.iter().any(|row| row.map == map.to_string()));
        let found = Findings::of(self, CRITERIA).headline(
            "the largest jump of levels by derivatives of the octant's map (levels)",
            largest(self, Row::is_the_engines, |row| row.jump),
        );
        pictures
            .fold(found, |found, (_, _, file)| {
                found.picture(
                    file,
                    "Ways from left to right as in the table: the look-up above, the level below, brighter where it is coarser.",
                )
            })
            .note(format!(
                "A sphere of {SIDE} × {SIDE} pixels, and one of {TALL_SIDE} columns of pixels {TALL} times as high as wide, painted by its normals with a map of {TEXELS} rows and {SQUARES} squares over them, seen from \
                 below. Levels are found for quads of two by two pixels, as devices find them, with each pixel's own direction where a way takes \
                 one. The truth is the level by exact derivatives at each pixel's middle, through those of the map's decoding. Pixels farther than \
                 {RIM} of the radius from the middle do not count. Differences are finite: a quad sees about the mean of the derivatives over it, \
                 so all ways are off by a little everywhere. The rectangle's seam is its upper and lower edge, on the equator, where a mirrored \
                 direction is no other place. In pictures level {WHITE_LEVEL} is white."
            ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_that_are_none_are_jumps_and_off() {
        let sphere = Sphere::new(EYE, 4);
        let even = vec![Some(-1.0); 16];
        let right = Row::default().compared(&sphere, &even, &even);
        assert_eq!((right.jump, right.off), (0.0, 0));
        for broken in [None, Some(f64::NAN)] {
            // A pixel in the middle.
            let mut found = even.clone();
            found[5] = broken;
            let row = Row::default().compared(&sphere, &found, &even);
            assert!(row.jump.is_nan() && row.too_coarse.is_nan() && row.too_fine.is_nan());
            assert_eq!((row.off, row.pixels), (1, right.pixels));
        }
    }
}
