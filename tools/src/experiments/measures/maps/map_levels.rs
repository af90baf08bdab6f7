//! Levels of detail of look-ups where quads of pixels straddle the seams of an octahedron map, by four ways to find them.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.4. Oracle: the level by the exact derivatives of each pixel's own
//! direction, through those of the map's decoding.

use clerestory::Result;
use clerestory::film::png::{self, Rgb8};
use clerestory::maps::level::{
    level_of_derivatives, octahedron_level, octahedron_level_folded, octahedron_rectangular_level,
};
use clerestory::maps::octahedron::octahedron_encode;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DMat2, DVec2, DVec3, UVec2};

use super::sphere::{Sphere, sheet};
use crate::experiments::measures::Context;
use crate::experiments::table::Table;

/// Texels of the map's height.
const TEXELS: u32 = 512;
/// Squares of the pattern over the map's height.
const SQUARES: u32 = 32;
/// Where the sphere is seen from: below, one of the lower edges in the middle.
const EYE: DVec3 = DVec3::new(1.0, 0.25, -0.8);
/// Pixels farther out, where derivatives grow beyond all bounds, are left out of figures.
const RIM: f64 = 0.9;
/// The level that is white.
const WHITE_LEVEL: f64 = 6.0;

/// A quad's directions: of its pixel, the one across and the one below.
type Quad = [DVec3; 3];

/// How a level is found.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Plain,
    Mirrored,
    Gated,
    Octant,
}

const SQUARE: [(Way, &str); 4] = [
    (Way::Plain, "differences of coordinates"),
    (Way::Mirrored, "least of those and of the mirrored ones, as printed"),
    (Way::Gated, "the same where the whole quad has z < 0"),
    (Way::Octant, "derivatives of the octant's map"),
];
const RECTANGLE: [(Way, &str); 2] = [
    (Way::Plain, "differences of coordinates"),
    (Way::Octant, "derivatives of the octant's map"),
];

fn differences(map: Parametrization, quad: Quad) -> f64 {
    let texels = DVec2::new(f64::from(map.aspect() * TEXELS), f64::from(TEXELS));
    let at = |d: DVec3| map.encode(d).map_or(DVec2::NAN, |at| at.uv * texels);
    let [here, across, down] = quad.map(at);
    level_of_derivatives(across - here, down - here)
}

/// The level of a lane of a quad, whose own direction is `own`.
fn level(map: Parametrization, way: Way, quad: Quad, own: DVec3) -> f64 {
    let n = f64::from(TEXELS);
    let [d, across, down] = quad;
    let mirrored = || {
        let at = |d: DVec3| 0.5 * n * octahedron_encode(DVec3::new(d.x, d.y, d.z.abs()));
        level_of_derivatives(at(across) - at(d), at(down) - at(d))
    };
    match (way, map) {
        (Way::Plain, _) => differences(map, quad),
        (Way::Mirrored, _) => differences(map, quad).min(mirrored()),
        (Way::Gated, _) => octahedron_level_folded(d, across, down, n),
        (Way::Octant, Parametrization::OctahedronRectangular) => {
            octahedron_rectangular_level(own, [across - d, down - d], n)
        }
        (Way::Octant, _) => octahedron_level(own, [across - d, down - d], n),
    }
}

/// Levels of all pixels, as quads of two by two find them.
fn levels(sphere: &Sphere, map: Parametrization, way: Way) -> Vec<Option<f64>> {
    let pixels = (0..sphere.side).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let at = |x: u32, y: u32| sphere.normal(sphere.place(x, y));
            let own = at(x, y)?;
            let (x, y) = (x & !1, y & !1);
            Some(level(map, way, [at(x, y)?, at(x + 1, y)?, at(x, y + 1)?], own))
        })
        .collect()
}

/// How coordinates in \[0, 1\]² move with the direction, by the map's decoding: least squares, of a vector in the tangent plane exact.
fn moved([along, down]: [DVec3; 2], v: DVec3) -> DVec2 {
    let gram = DMat2::from_cols(
        DVec2::new(along.length_squared(), along.dot(down)),
        DVec2::new(along.dot(down), down.length_squared()),
    );
    gram.inverse() * DVec2::new(along.dot(v), down.dot(v))
}

/// Levels of all pixels by the derivatives of the sphere's normal at their middles.
fn exact_levels(sphere: &Sphere, map: Parametrization) -> Vec<Option<f64>> {
    let texels = DVec2::new(f64::from(map.aspect() * TEXELS), f64::from(TEXELS));
    let pixels = (0..sphere.side).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let p = sphere.place(x, y);
            let at = map.encode(sphere.normal(p)?)?;
            let by_map = map.derivatives(at);
            let [across, below] = sphere.normal_derivatives(p)?.map(|v| texels * moved(by_map, v));
            Some(level_of_derivatives(across, below))
        })
        .collect()
}

/// Black and white squares.
fn checkers(map: Parametrization) -> Result<MapImage> {
    let side = TEXELS / SQUARES;
    MapImage::from_fn(map, UVec2::new(map.aspect() * TEXELS, TEXELS), |texel| {
        DVec3::splat(f64::from((texel.x / side + texel.y / side) % 2))
    })
}

struct Found {
    jump: f64,
    too_coarse: f64,
    too_fine: f64,
    off: u64,
    pixels: u64,
}

fn compare(sphere: &Sphere, found: &[Option<f64>], exact: &[Option<f64>]) -> Found {
    let side = sphere.side as usize;
    let inside = |i: usize| sphere.place((i % side) as u32, (i / side) as u32).length() < RIM;
    let mut result = Found {
        jump: 0.0,
        too_coarse: 0.0,
        too_fine: 0.0,
        off: 0,
        pixels: 0,
    };
    for i in (0..found.len()).filter(|i| inside(*i)) {
        let (Some(here), Some(right)) = (found[i], exact[i]) else {
            continue;
        };
        result.pixels += 1;
        result.too_coarse = result.too_coarse.max(here - right);
        result.too_fine = result.too_fine.max(right - here);
        result.off += u64::from((here - right).abs() > 1.0);
        for next in [i + 1, i + side]
            .into_iter()
            .filter(|next| *next < found.len() && inside(*next))
        {
            if let Some(there) = found[next] {
                // What is sampled: levels are clamped to the finest.
                result.jump = result.jump.max((there.max(0.0) - here.max(0.0)).abs());
            }
        }
    }
    result
}

fn grey(value: f64) -> [u8; 3] {
    [(255.0 * value.clamp(0.0, 1.0)).round() as u8; 3]
}

/// What look-ups see, and the levels themselves.
fn pictures(sphere: &Sphere, chain: &[MapImage], levels: &[Option<f64>]) -> [Rgb8; 2] {
    let (mut seen, mut shown) = (Vec::new(), Vec::new());
    for (i, level) in levels.iter().enumerate() {
        let d = sphere.normal(sphere.place(i as u32 % sphere.side, i as u32 / sphere.side));
        let (Some(d), Some(level)) = (d, level) else {
            seen.extend([255; 3]);
            shown.extend([255; 3]);
            continue;
        };
        let last = chain.len() - 1;
        let clamped = level.clamp(0.0, last as f64);
        let at = |level: usize| chain[level.min(last)].look_up(d).map_or(f64::NAN, |value| value.x);
        let fine = clamped as usize;
        let value = at(fine) + clamped.fract() * (at(fine + 1) - at(fine));
        seen.extend(grey(clerestory::srgb::srgb_from_linear(value)));
        shown.extend(grey(clamped / WHITE_LEVEL));
    }
    [seen, shown].map(|bytes| Rgb8 {
        width: sphere.side,
        height: sphere.side,
        bytes,
    })
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let sphere = Sphere::new(EYE, if context.smoke { 48 } else { 256 });
    let mut table = Table::new(
        "Levels of detail over seams",
        &[
            "map",
            "level by",
            "largest jump between neighbours",
            "too coarse by at most",
            "too fine by at most",
            "pixels off by more than 1",
            "of",
        ],
    );
    let maps = [
        (Parametrization::OctahedronQuadratic, &SQUARE[..], "levels.png"),
        (
            Parametrization::OctahedronRectangular,
            &RECTANGLE[..],
            "levels-rectangular.png",
        ),
    ];
    for (done, (map, ways, file)) in maps.into_iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&map.to_string(), done, maps.len());
        let mut chain = vec![checkers(map)?];
        while let Some(next) = chain.last().and_then(|last| last.coarser().ok()) {
            chain.push(next);
        }
        let exact = exact_levels(&sphere, map);
        let (mut seen, mut shown) = (Vec::new(), Vec::new());
        for (way, name) in ways {
            let found = levels(&sphere, map, *way);
            let figures = compare(&sphere, &found, &exact);
            table.row([
                map.to_string().into(),
                (*name).into(),
                figures.jump.into(),
                figures.too_coarse.into(),
                figures.too_fine.into(),
                figures.off.into(),
                figures.pixels.into(),
            ]);
            let [a, b] = pictures(&sphere, &chain, &found);
            seen.push(a);
            shown.push(b);
        }
        png::write(context.file(file)?, &sheet(&[seen, shown]))?;
    }
    table.note(format!(
        "A sphere of {0} × {0} pixels painted by its normals with a map of {TEXELS} rows and {SQUARES} squares over them, seen from below; quads of \
         two by two pixels, as devices find levels, each pixel with its own direction where a way takes one. The truth is the level by exact derivatives \
         at each pixel's middle, through the derivatives of the map's decoding. Figures leave out what is farther than {RIM} of the radius from the \
         middle. Differences are finite: a quad sees about the mean of the derivatives over it, so all ways are off by a little everywhere. The rectangle's seam is its upper \
         and lower edge, on the equator, where a mirrored direction is no other place. Pictures beside this table, ways from left to right, the look-up \
         above and the level below, white at {WHITE_LEVEL}: `levels.png`, `levels-rectangular.png`.",
        sphere.side,
    ));
    Ok(vec![table])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact derivatives against differences over a thousandth of a pixel, off folds.
    #[test]
    fn exact_levels_are_limits_of_differences() {
        let (coarse, fine) = (Sphere::new(EYE, 32), 1e-3);
        for map in [
            Parametrization::OctahedronQuadratic,
            Parametrization::OctahedronRectangular,
        ] {
            let exact = exact_levels(&coarse, map);
            let mut compared = 0;
            for (i, exact) in exact.iter().enumerate() {
                let p = coarse.place(i as u32 % 32, i as u32 / 32);
                let Some(exact) = exact.filter(|_| p.length() < RIM) else {
                    continue;
                };
                let step = 2.0 / 32.0 * fine;
                let places = [p, p + DVec2::new(step, 0.0), p - DVec2::new(0.0, step)];
                let quad = places.map(|p| coarse.normal(p).unwrap());
                if quad[0].abs().min_element() < 0.01 {
                    continue;
                }
                let found = differences(map, quad) - fine.log2();
                assert!((found - exact).abs() < 0.01, "{map} {p}: {found} {exact}");
                compared += 1;
            }
            assert!(compared > 500, "{compared}");
        }
    }
}
