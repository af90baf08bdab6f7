//! How evenly maps spread their texels: statistics beside the document's figures, ratios along great circles, pictures of densities.
//!
//! Oracle: exact solid angles of texels ([`clerestory::maps`]) and what T. Engelhardt's thesis states (2013, chapters 5 and 7), with its sums worked out.

use clerestory::Result;
use clerestory::film::{atomic, png};
use clerestory::maps::packed_direction::{pack_octahedral, pack_octahedral_nearest, packed_error, unpack_octahedral};
use clerestory::maps::statistics::anisotropy;
use clerestory::maps::{MapPoint, Parametrization};
use glam::{DVec2, DVec3, UVec2};

use super::heat;
use crate::experiments::lines::{self, Line};
use crate::experiments::measures::Context;
use crate::experiments::plot::Words;
use crate::experiments::table::Table;
use crate::random::Random;

/// Maps with what the thesis states: least and greatest ratio, RMS, greatest shear.
const STATED: [(Parametrization, [&str; 4]); 8] = [
    (Parametrization::LatLong, ["0", "1.571", "0.483", "∞"]),
    (Parametrization::Sphere, ["1", "1", "0", "∞"]),
    (Parametrization::Cube, ["0.368", "1.910", "0.380", "1.732"]),
    (Parametrization::DualParaboloid, ["0.5", "2.0", "0.408", "1.0"]),
    (Parametrization::Nusselt, ["0.5", "∞", "∞", "∞"]),
    (
        Parametrization::OctahedronQuadratic,
        ["0.318", "1.654", "0.327", "2.618"],
    ),
    (
        Parametrization::OctahedronRectangular,
        ["0.318", "1.654", "0.327", "2.618"],
    ),
    (Parametrization::EqualArea, ["1", "1", "0", "none"]),
];

/// The perspective family: c, and least ratio, greatest ratio and RMS as stated.
const FAMILY: [(f64, [&str; 3]); 5] = [
    (0.5, ["0.080", "2.149", "0.571"]),
    (std::f64::consts::FRAC_1_SQRT_2, ["0.159", "1.779", "0.403"]),
    (1.0, ["0.318", "1.654", "0.327"]),
    (std::f64::consts::SQRT_2, ["0.225", "1.801", "0.411"]),
    (2.0, ["0.159", "2.339", "0.621"]),
];

/// Pixels of a picture of the strip.
const SIDE: u32 = 192;
/// Points of a great circle.
const STEPS: u32 = 720;
/// Steps of plots, and the degrees of each.
const AXIS: (u32, f64) = (4, 45.0);
/// Where plots end: the ratio and the shear.
const TOPS: [f64; 2] = [2.7, 5.0];

fn statistics(context: &Context<'_>, size: u32) -> Table {
    let mut table = Table::new(
        "Density of maps against uniform sampling",
        &[
            "map",
            "texels",
            "of them used (%)",
            "least ratio",
            "stated",
            "greatest ratio",
            "stated",
            "greatest over least",
            "RMS of ratio − 1",
            "stated",
            "greatest shear",
            "stated",
            "error of Σ solid angles (sr)",
        ],
    );
    for (done, (map, [min, max, rms, shear])) in STATED.into_iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&map.to_string(), done, STATED.len());
        let size = UVec2::new(size * map.aspect(), size);
        let found = map.density_statistics(size);
        table.row([
            map.to_string().into(),
            u64::from(size.element_product() * map.layers()).into(),
            (100.0 * found.coverage).into(),
            found.min_ratio.into(),
            min.into(),
            found.max_ratio.into(),
            max.into(),
            (found.max_ratio / found.min_ratio).into(),
            found.rms.into(),
            rms.into(),
            found.anisotropy.into(),
            shear.into(),
            (found.solid_angle - map.solid_angle()).into(),
        ]);
    }
    table.note(format!(
        "Ratios of exact solid angles of texels, {size} rows a layer, to the mean of the part that holds directions; above 1 a texel is too coarse. \
         Stated extremes are those of points, which texels approach as they shrink: where those are 0 or ∞, the figure is that of this size. Shear \
         is the ratio of the axes of the ellipse that a small round spot on the map is on the sphere, at centres of texels."
    ));
    table.note(
        "The document calls the sphere map one that always undersamples: 4/π against its square, which is the unused corners alone. Its \
         area is even and its shape is not. The cube stays within a factor of two along great circles through edges only: at corners it oversamples 2.72 \
         times. A central projection onto an octahedron is the planar one (c = 1 below).",
    );
    table
}

fn family(size: u32) -> Table {
    let mut table = Table::new(
        "The perspective family of octahedra",
        &[
            "c",
            "least ratio",
            "stated",
            "greatest ratio",
            "stated",
            "RMS of ratio − 1",
            "stated",
            "greatest shear",
        ],
    );
    for (c, [min, max, rms]) in FAMILY {
        let found = Parametrization::OctahedronPerspective { c }.density_statistics(UVec2::splat(size));
        table.row([
            c.into(),
            found.min_ratio.into(),
            min.into(),
            found.max_ratio.into(),
            max.into(),
            found.rms.into(),
            rms.into(),
            found.anisotropy.into(),
        ]);
    }
    table.note("(x, y)/(|x| + |y| + c|z|) an octant. The planar projection, c = 1, is the most balanced.");
    table
}

fn packed(count: u32) -> Table {
    let mut table = Table::new(
        "Directions in a word",
        &[
            "bits",
            "stated bound (rad)",
            "greatest error (rad)",
            "of the nearest of four (rad)",
            "greatest error (degrees)",
        ],
    );
    for bits in [8, 12, 13, 15, 16] {
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
            plain = plain.max(off(pack_octahedral(d.as_vec3(), bits)));
            nearest = nearest.max(off(pack_octahedral_nearest(d, bits)));
        }
        table.row([
            format!("2 × {bits}").into(),
            packed_error(bits).into(),
            plain.into(),
            nearest.into(),
            plain.to_degrees().into(),
        ]);
    }
    table.note(format!(
        "{count} directions, half of them in the middle of faces. Octahedron map, signed normalized integers."
    ));
    table
}

/// A function of places along the meridian of an azimuth, from the pole on.
fn meridian(map: Parametrization, azimuth: f64, value: impl Fn(MapPoint) -> f64) -> Line {
    let along = DVec2::from_angle(azimuth.to_radians());
    let point = |step: u32| {
        let degrees = 180.0 * (f64::from(step) + 0.5) / f64::from(STEPS);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let d: DVec3 = (sin * along).extend(cos);
        (degrees, map.encode(d).map_or(f64::NAN, &value))
    };
    Line {
        name: map.to_string(),
        points: (0..STEPS).map(point).collect(),
    }
}

fn plots(context: &Context<'_>) -> Result<()> {
    let maps = || STATED.iter().map(|(map, _)| *map);
    let x = "angle from the pole (degrees)";
    for azimuth in [0.0, 45.0] {
        let title = format!("Density along the meridian of azimuth {azimuth}°");
        let words = Words {
            title: &title,
            x,
            y: "solid angle of a texel over the mean",
        };
        let curves: Vec<Line> = maps()
            .map(|map| meridian(map, azimuth, |at| map.density_ratio(at)))
            .collect();
        let svg = lines::draw(words, AXIS, TOPS[0], &curves)?;
        atomic::write(&context.file(&format!("density-{azimuth}.svg"))?, svg.as_bytes())?;
        let title = format!("Shear along the meridian of azimuth {azimuth}°");
        let words = Words {
            title: &title,
            x,
            y: "ratio of the axes of a spot",
        };
        let shear = |map: Parametrization, at| anisotropy(map.texel_derivatives(UVec2::new(map.aspect(), 1), at));
        let curves: Vec<Line> = maps().map(|map| meridian(map, azimuth, |at| shear(map, at))).collect();
        let svg = lines::draw(words, AXIS, TOPS[1], &curves)?;
        atomic::write(&context.file(&format!("shear-{azimuth}.svg"))?, svg.as_bytes())?;
    }
    Ok(())
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (size, side, directions) = if context.smoke {
        (32, 16, 2000)
    } else {
        (512, SIDE, 1 << 20)
    };
    plots(context)?;
    let maps = STATED.map(|(map, _)| map);
    png::write(context.file("density.png")?, &heat::strip(&maps, side))?;
    let mut first = statistics(context, size);
    let names: Vec<String> = maps.iter().map(ToString::to_string).collect();
    first.note(format!(
        "Pictures beside this table: `density.png`, from left to right {}, above on the sphere, below on the map, red too coarse and blue too fine, \
         white as the mean, full colour at a factor of {}; `density-0.svg`, `density-45.svg`, `shear-0.svg` and `shear-45.svg` along meridians.",
        names.join(", "),
        heat::FULL_COLOR,
    ));
    Ok(vec![first, family(size), packed(directions)])
}
