//! Levels of detail of look-ups in octahedron maps on a sphere that is painted by its normals, by quads of two by two pixels.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::maps::level::{
    level_of_derivatives, octahedron_level, octahedron_level_folded, octahedron_rectangular_level,
};
use clerestory::maps::octahedron::octahedron_encode;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DMat2, DVec2, DVec3, UVec2};

use super::sphere::Sphere;

/// Texels of the map's height.
pub const TEXELS: u32 = 512;
/// Squares of the pattern over the map's height.
pub const SQUARES: u32 = 32;
/// Where the sphere is seen from: below, one of the lower edges in the middle.
pub const EYE: DVec3 = DVec3::new(1.0, 0.25, -0.8);
/// Pixels farther out, where derivatives grow beyond all bounds, are left out of figures.
pub const RIM: f64 = 0.9;
/// The level that is white.
pub const WHITE_LEVEL: f64 = 6.0;

/// A quad's directions: of its pixel, the one across and the one below.
type Quad = [DVec3; 3];

/// How a level is found.
#[derive(Clone, Copy, PartialEq)]
pub enum Way {
    /// By differences of coordinates.
    Plain,
    /// By the lesser of those and of the mirrored directions'.
    Mirrored,
    /// The same, only where the whole quad is below the equator.
    Gated,
    /// By derivatives of the octant's own map.
    Octant,
}

/// The engine's way.
pub const BY_OCTANT: &str = "derivatives of the octant's map";
/// The document's repair, as printed and with its gate.
pub const MIRRORED: &str = "least of those and of the mirrored ones, as printed";
pub const GATED: &str = "the same where the whole quad has z < 0";

/// Ways in the square layout, with their names.
pub const SQUARE: [(Way, &str); 4] = [
    (Way::Plain, "differences of coordinates"),
    (Way::Mirrored, MIRRORED),
    (Way::Gated, GATED),
    (Way::Octant, BY_OCTANT),
];
/// Ways in the rectangle.
pub const RECTANGLE: [(Way, &str); 2] = [(Way::Plain, "differences of coordinates"), (Way::Octant, BY_OCTANT)];

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
pub fn levels(sphere: &Sphere, map: Parametrization, way: Way) -> Vec<Option<f64>> {
    let pixels = (0..sphere.rows).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
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
pub fn exact_levels(sphere: &Sphere, map: Parametrization) -> Vec<Option<f64>> {
    let texels = DVec2::new(f64::from(map.aspect() * TEXELS), f64::from(TEXELS));
    let pixels = (0..sphere.rows).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
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
pub fn checkers(map: Parametrization) -> Result<MapImage> {
    let side = TEXELS / SQUARES;
    MapImage::from_fn(map, UVec2::new(map.aspect() * TEXELS, TEXELS), |texel| {
        DVec3::splat(f64::from((texel.x / side + texel.y / side) % 2))
    })
}

fn grey(value: f64) -> [u8; 3] {
    [(255.0 * value.clamp(0.0, 1.0)).round() as u8; 3]
}

/// What look-ups see, and the levels themselves.
pub fn pictures(sphere: &Sphere, chain: &[MapImage], levels: &[Option<f64>]) -> [Rgb8; 2] {
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
        height: sphere.rows,
        bytes,
    })
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
