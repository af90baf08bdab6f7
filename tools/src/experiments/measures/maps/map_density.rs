//! How evenly maps spread their texels: statistics beside the document's figures, ratios along great circles, pictures of densities.
//!
//! Oracle: exact solid angles of texels ([`clerestory::maps`]) and what T. Engelhardt's thesis states (2013, chapters 5 and 7), with its sums worked out.

use clerestory::Result;
use clerestory::maps::Parametrization;
use clerestory::maps::packed_direction::{pack_octahedral, pack_octahedral_nearest, packed_error, unpack_octahedral};

use super::heat;
use super::meridians::with_plots;
use super::stated_densities::{FAMILY, Figure, OF_FIGURES, STATED, of_document, of_family, statistics};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;

/// Pixels of a picture of the strip.
const SIDE: u32 = 192;
/// Bits of each coordinate of packed directions.
const BITS: [u32; 5] = [8, 12, 13, 15, 16];
/// Rows of a layer.
const ROWS: u32 = 512;

rows! {
    /// A map.
    struct Density = "Density of maps against uniform sampling" by [map] {
        map: String = "map",
        texels: u64 = "texels",
        used: f64 = "used texels (%)",
        least: f64 = "least ratio",
        greatest: f64 = "greatest ratio",
        spread: f64 = "greatest ratio over the least",
        rms: f64 = "RMS of ratio − 1",
        shear: f64 = "greatest shear",
        sum_error: f64 = "error of Σ solid angles (sr)",
    }
    beside "document: least ratio" = |row| of_document(&row.map, 0).into();
    beside "document: greatest ratio" = |row| of_document(&row.map, 1).into();
    beside "document: RMS of ratio − 1" = |row| of_document(&row.map, 2).into();
    beside "document: greatest shear" = |row| of_document(&row.map, 3).into();
}

rows! {
    /// An octahedron of the perspective family.
    struct Member = "The perspective family of octahedra" by [c] {
        c: f64 = "c",
        least: f64 = "least ratio",
        greatest: f64 = "greatest ratio",
        rms: f64 = "RMS of ratio − 1",
        shear: f64 = "greatest shear",
    }
    beside "document: least ratio" = |row| of_family(row.c, 0).into();
    beside "document: greatest ratio" = |row| of_family(row.c, 1).into();
    beside "document: RMS of ratio − 1" = |row| of_family(row.c, 2).into();
}

rows! {
    /// Directions of so many bits.
    struct Word = "Directions in a word" by [bits] {
        bits: u64 = "bits of each coordinate",
        bound: f64 = "stated bound (rad)",
        worst: f64 = "greatest error (rad)",
        nearest: f64 = "greatest error of the nearest of four (rad)",
        degrees: f64 = "greatest error (degrees)",
        directions: u64 = "directions",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    maps: Vec<Density>,
    family: Vec<Member>,
    figures: Vec<Figure>,
    words: Vec<Word>,
}

const OF_WORDS: &[Criterion<Word>] = &[Criterion::each(
    "packed directions are within their stated bound: the greatest error over it",
    Bound::AtMost(1.0),
    |row: &Word| (row.worst / row.bound).into(),
)
.in_every_form()];

/// A map's row.
fn density(map: Parametrization, rows: u32) -> Density {
    let found = statistics(map, rows);
    Density {
        map: map.to_string(),
        texels: u64::from(rows * rows * map.aspect() * map.layers()),
        used: 100.0 * found.coverage,
        least: found.min_ratio,
        greatest: found.max_ratio,
        spread: found.max_ratio / found.min_ratio,
        rms: found.rms,
        shear: found.anisotropy,
        sum_error: found.solid_angle - map.solid_angle(),
    }
}

/// Greatest errors of directions in a word.
fn word(bits: u32, count: u32) -> Word {
    let mut random = Random::new(bits);
    let (mut plain, mut nearest) = (0.0f64, 0.0f64);
    for i in 0..count {
        let d = random.direction();
        // Every second one near the middle of a face, where the map stretches most.
        let d = if i % 2 == 0 {
            (d.signum() + 0.05 * random.vector()).normalize()
        } else {
            d
        };
        let off = |word| (unpack_octahedral(word, bits) - d).length();
        plain = greatest([plain, off(pack_octahedral(d.as_vec3(), bits))]);
        nearest = greatest([nearest, off(pack_octahedral_nearest(d, bits))]);
    }
    Word {
        bits: bits.into(),
        bound: packed_error(bits),
        worst: plain,
        nearest,
        degrees: plain.to_degrees(),
        directions: count.into(),
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (rows, side, directions) = context.pick((ROWS, SIDE, 1 << 20), (32, 16, 2000));
        context.picture("density.png", &heat::strip(&STATED.map(|(map, _)| map), side));
        let mut figures = Vec::new();
        let maps = context.each(
            &STATED,
            |(map, _)| map.to_string(),
            |(map, stated)| {
                figures.extend(Figure::all(&map.to_string(), *map, rows, stated));
                Ok(vec![density(*map, rows)])
            },
        )?;
        let family = context.each(
            &FAMILY,
            |(c, _)| format!("c = {c}"),
            |(c, stated)| {
                let map = Parametrization::OctahedronPerspective { c: *c };
                figures.extend(Figure::all(&format!("perspective, c = {c:.3}"), map, rows, stated));
                let found = statistics(map, rows);
                Ok(vec![Member {
                    c: *c,
                    least: found.min_ratio,
                    greatest: found.max_ratio,
                    rms: found.rms,
                    shear: found.anisotropy,
                }])
            },
        )?;
        let words = context.each(
            &BITS,
            |bits| format!("{bits} bits"),
            |bits| Ok(vec![word(*bits, directions)]),
        )?;
        Ok(Self {
            maps,
            family,
            figures,
            words,
        })
    }

    fn findings(&self) -> Findings {
        let quadratic = Parametrization::OctahedronQuadratic.to_string();
        let quadratic = self.maps.iter().find(|row| row.map == quadratic);
        let names = STATED.map(|(map, _)| map.to_string()).join(", ");
        let full = heat::FULL_COLOR;
        let maps = Findings::of(&self.maps, &[])
            .headline(
                "RMS deviation of solid angles of the square octahedron's texels, of their mean",
                quadratic.map(|row| Measured::exact(row.rms)),
            )
            .note(format!(
                "Ratios of exact solid angles of texels, {ROWS} rows a layer, to the mean of the part that holds directions; above 1 a texel is too \
                 coarse. Extremes of the document are those of points, which texels approach as they shrink: where those are 0 or ∞, the figure is \
                 that of this size. Shear is the ratio of the axes of the ellipse that a small round spot on the map is on the sphere, at centres of \
                 texels. In the picture, from left to right {names}, full colour is a factor of {full}."
            ))
            .note(
                "The document calls the sphere map one that always undersamples: 4/π against its square, which is the unused corners alone. Its \
                 area is even and its shape is not. The cube stays within a factor of two along great circles through edges only: at corners it \
                 oversamples 2.72 times. A central projection onto an octahedron is the planar one (c = 1 below).",
            );
        let maps = if self.maps.is_empty() {
            maps
        } else {
            with_plots(maps.picture(
                "density.png",
                "Maps from left to right: above on the sphere, below on the map. Red is too coarse, blue too fine, white the mean.",
            ))
        };
        maps.and(Findings::of(&self.family, &[]))
            .note("(x, y)/(|x| + |y| + c|z|) an octant. The planar projection is c = 1.")
            .and(Findings::of(&self.figures, OF_FIGURES).long())
            .and(Findings::of(&self.words, OF_WORDS))
            .note("Half of the directions are in the middle of faces. Octahedron map, signed normalized integers.")
    }
}
