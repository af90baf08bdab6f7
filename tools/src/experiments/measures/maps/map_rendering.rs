//! Maps of directions rendered live: what each way costs, what it draws wrongly, and what shadows by it are worth.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.1, §7.3.2 and Table 7.1. Oracles: the ray through each texel's centre, and shadow
//! rays from points on surfaces to the map's middle.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::film::atomic;
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::cube::CUBE_FACES;
use clerestory::raster::splats::surfels_of;
use clerestory::raster::tessellation::{MAX_LEVEL, tessellation_point, tessellation_weights};
use clerestory::raster::{Layering, OctantCut};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

use super::filled_maps::{
    Filled, FilledScene, SPLATS_PER_TEXEL, Seen, Variant, Way, Work, texel_index, variant, variants,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::Errors;
use crate::experiments::plot::{self, Curve, PlotPoint, Words};
use crate::experiments::table::{Cell, Table};
use crate::timing::median;

/// Scenes, and the place in the box around each that the map is of.
const SCENES: [(&str, Vec3); 4] = [
    ("builtin:cornell-box", Vec3::new(0.52, 0.7, 0.44)),
    ("builtin:triangle-soup?n=1000", Vec3::new(0.51, 0.49, 0.52)),
    ("builtin:box-city?n=2000", Vec3::new(0.55, 1.5, 0.52)),
    ("builtin:sphere-flake?depth=3", Vec3::new(0.9, 0.9, 0.8)),
];
/// Scenes of the sweep over pieces: few triangles, and large ones.
const SWEPT: [(&str, Vec3); 2] = [SCENES[0], ("builtin:box-city?n=60", Vec3::new(0.55, 0.6, 0.52))];
const LEVEL: u32 = 4;

/// Points seen at a smaller cosine than this do not count: there the depth of a texel spans more than their distance over ten texels.
const LEAST_COSINE: f64 = 0.1;
/// Of distances, beside what the texel's width makes.
const ROUNDING_BIAS: f64 = 1e-4;

/// A point on a surface, for shadows.
struct ShadowPoint {
    direction: DVec3,
    distance: f64,
    /// Of the angle between the surface's normal and the direction.
    tangent: f64,
    is_lit: bool,
}

fn shadow_points(live: &FilledScene, count: u32) -> Vec<ShadowPoint> {
    let point = |surfel: &clerestory::gpu::shaders::types::Surfel| {
        let from = Vec3::from_array(surfel.position).as_dvec3() - live.origin.as_dvec3();
        let [a, b, c] = live.corners[surfel.number as usize].map(|corner| corner.as_dvec3());
        let direction = from.try_normalize()?;
        let cosine = (b - a).cross(c - a).try_normalize()?.dot(direction).abs();
        if cosine < LEAST_COSINE {
            return None;
        }
        let distance = from.length();
        let hit = live.index.closest_hit(&live.ray(direction));
        Some(ShadowPoint {
            direction,
            distance,
            tangent: (1.0 - cosine * cosine).max(0.0).sqrt() / cosine,
            is_lit: f64::from(hit.t) >= distance * (1.0 - ROUNDING_BIAS),
        })
    };
    surfels_of(&live.corners, count).par_iter().filter_map(point).collect()
}

/// Mean angle of a texel of a map.
fn texel_width(variant: &Variant) -> f64 {
    let texels = variant.size.element_product() * variant.map.layers();
    (4.0 * PI / f64::from(texels)).sqrt()
}

/// Shares of points that are lit wrongly and in shadow wrongly.
fn shadow_errors(variant: &Variant, filled: &Filled, points: &[ShadowPoint]) -> [f64; 2] {
    let width = texel_width(variant);
    let wrong = |point: &ShadowPoint| {
        let Some(at) = variant.map.encode(point.direction) else {
            return [0, 1];
        };
        let stored = f64::from(filled.distances[texel_index(variant.size, at)]);
        let bias = point.distance * (width * point.tangent + ROUNDING_BIAS);
        let is_lit = point.distance <= stored + bias;
        [
            usize::from(is_lit && !point.is_lit),
            usize::from(!is_lit && point.is_lit),
        ]
    };
    let sums = points
        .iter()
        .map(wrong)
        .fold([0, 0], |sum, wrong| [sum[0] + wrong[0], sum[1] + wrong[1]]);
    sums.map(|sum| sum as f64 / points.len().max(1) as f64)
}

/// What of a map differs from rays.
#[derive(Default)]
struct Quality {
    /// Share of texels with another triangle.
    wrong: f64,
    /// Share of texels with nothing where there is something.
    empty: f64,
    /// Mean and 99th percentile of the angles between texels and what they show, in texels' widths; none where nothing is interpolated.
    angles: Option<[f64; 2]>,
    /// Lit wrongly, and in shadow wrongly.
    shadow: [f64; 2],
}

fn quality(variant: &Variant, filled: &Filled, seen: &Seen, points: &[ShadowPoint]) -> Quality {
    let (mut held, mut wrong, mut empty) = (0, 0, 0);
    let mut angles = Errors::default();
    for (texel, direction) in seen.directions.iter().enumerate() {
        let Some(direction) = direction else { continue };
        held += 1;
        let (found, exact) = (filled.triangles[texel], seen.hits[texel].triangle);
        wrong += usize::from(found != exact);
        empty += usize::from(found == u32::MAX && found != exact);
        if let Some(position) = filled.positions[texel] {
            angles.add(position.angle_between(*direction) / texel_width(variant));
        }
    }
    let share = |count: usize| count as f64 / f64::from(held.max(1));
    Quality {
        wrong: share(wrong),
        empty: share(empty),
        angles: (variant.way != Way::Splats).then(|| [angles.mean(), angles.quantile(0.99)]),
        shadow: shadow_errors(variant, filled, points),
    }
}

/// Times of one way in milliseconds: the median and the middle half.
#[derive(Debug, Clone, Copy)]
struct Times {
    median: f64,
    low: f64,
    high: f64,
}

impl Times {
    fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let quarter = seconds.len() / 4;
        let at = |index: usize| seconds.get(index).map_or(f64::NAN, |value| 1e3 * value);
        Self {
            low: at(quarter),
            high: at(seconds.len().saturating_sub(1 + quarter)),
            median: 1e3 * median(seconds),
        }
    }

    /// Which is faster, where the middle halves do not meet.
    fn before(self, other: Self) -> &'static str {
        if self.high < other.low {
            "holds"
        } else if self.low > other.high {
            "is the reverse"
        } else {
            "is not told apart"
        }
    }
}

/// An order from the fastest, and what its pairs of neighbours are.
fn judged(order: &[(String, Times)]) -> String {
    let named = order
        .iter()
        .map(|(name, times)| format!("{name} {:.3} ms", times.median));
    let pairs = order
        .windows(2)
        .map(|pair| format!("{} before {} {}", pair[0].0, pair[1].0, pair[0].1.before(pair[1].1)));
    format!(
        "{}: {}",
        named.collect::<Vec<_>>().join(", "),
        pairs.collect::<Vec<_>>().join("; ")
    )
}

/// The fastest of some ways.
fn fastest<'a>(ways: impl Iterator<Item = &'a Measured>) -> Option<(String, Times)> {
    let fastest = ways.min_by(|a, b| a.times.median.total_cmp(&b.times.median))?;
    Some((fastest.variant.name.clone(), fastest.times))
}

/// The document's order, by the fastest of the ways that each of its figures stands for, and where the ways without a figure are.
fn orders(address: &str, measured: &[Measured]) -> [String; 2] {
    let mut stated: Vec<f64> = measured.iter().filter_map(|one| one.variant.stated).collect();
    stated.sort_by(|a, b| b.total_cmp(a));
    stated.dedup();
    let of = |figure: &f64| fastest(measured.iter().filter(|one| one.variant.stated == Some(*figure)));
    let order: Vec<_> = stated.iter().filter_map(of).collect();
    let figures: Vec<_> = stated.iter().map(f64::to_string).collect();
    let by_clip_distances =
        |one: &&Measured| one.variant.way == Way::Raster(Layering::Octants(OctantCut::ClipDistances));
    let clip = fastest(measured.iter().filter(by_clip_distances));
    // The engine's own expectation: behind the cube and before all else.
    let expected: Vec<_> = order
        .iter()
        .take(1)
        .cloned()
        .chain(clip)
        .chain(order.get(1).cloned())
        .collect();
    [
        format!(
            "{address}: the document's order from the fastest, by its {} frames/s. {}.",
            figures.join(", "),
            judged(&order)
        ),
        format!(
            "{address}: the document has no figure for clip distances (4g); the engine expects them between its two fastest. {}.",
            judged(&expected)
        ),
    ]
}

/// One way in one scene.
struct Measured {
    variant: Variant,
    quality: Quality,
    times: Times,
    work: Work,
}

/// Rows of a scene, and its ways by their times.
fn compare(
    gpu: &Gpu,
    (address, share): (&str, Vec3),
    (side, repeats, points): (u32, usize, u32),
    table: &mut Table,
) -> Result<()> {
    let live = FilledScene::load(gpu, address, share)?;
    let points = shadow_points(&live, points);
    let mut seen: Vec<(Parametrization, Seen)> = Vec::new();
    let (mut measured, mut fillings) = (Vec::new(), Vec::new());
    for variant in variants(side, LEVEL) {
        if !seen.iter().any(|(map, _)| *map == variant.map) {
            seen.push((variant.map, live.seen(variant.map, variant.size)));
        }
        let filled = live.fill(gpu, &variant)?;
        let of_rays = seen.iter().find(|(map, _)| *map == variant.map).map(|(_, seen)| seen);
        let quality = of_rays.map_or_else(Quality::default, |seen| quality(&variant, &filled, seen, &points));
        let (filling, work) = live.filling(gpu, &variant)?;
        fillings.push((filling, Vec::new()));
        measured.push((variant, quality, work));
    }
    // In turn: a change of load affects all ways alike.
    for _ in 0..repeats {
        for (filling, seconds) in &mut fillings {
            seconds.push(filling.seconds()?);
        }
    }
    let mut measured: Vec<Measured> = measured
        .into_iter()
        .zip(fillings)
        .map(|((variant, quality, work), (_, seconds))| Measured {
            variant,
            quality,
            times: Times::of(seconds),
            work,
        })
        .collect();
    let by = |way: Way| measured.iter().find(|one| one.variant.way == way);
    let cube = by(Way::Raster(Layering::Passes(CUBE_FACES)));
    let yardstick = cube.map_or([f64::NAN; 2], |cube| {
        [cube.times.median, cube.quality.shadow.iter().sum()]
    });
    for Measured {
        variant,
        quality,
        times,
        work,
    } in &measured
    {
        let error: f64 = quality.shadow.iter().sum();
        let ratio = |value: f64, of: f64| {
            if of > 0.0 {
                Cell::from(value / of)
            } else {
                "none".into()
            }
        };
        table.row([
            address.into(),
            variant.name.as_str().into(),
            variant.stated.into(),
            times.median.into(),
            times.low.into(),
            times.high.into(),
            ratio(times.median, yardstick[0]),
            work.vertices.into(),
            work.primitives.into(),
            work.emitted_corners.into(),
            work.fragments.into(),
            (100.0 * quality.wrong).into(),
            (100.0 * quality.empty).into(),
            quality.angles.map(|angles| angles[0]).into(),
            quality.angles.map(|angles| angles[1]).into(),
            (100.0 * quality.shadow[0]).into(),
            (100.0 * quality.shadow[1]).into(),
            ratio(error, yardstick[1]),
        ]);
    }
    for line in orders(address, &measured) {
        table.note(line);
    }
    let octants = |cut| by(Way::Raster(Layering::Octants(cut)));
    let counted = [
        cube,
        octants(OctantCut::ClipDistances),
        octants(OctantCut::MaskInRectangles),
        octants(OctantCut::Split),
    ];
    if let [Some(cube), Some(clip), Some(mask), Some(split)] = counted.map(|one| one.map(|one| one.work)) {
        let ratio = |a: u64, b: u64| a as f64 / b.max(1) as f64;
        table.note(format!(
            "{address}: clip distances take {:.2} times the cube's vertices and {:.2} times its fragments; the mask in rectangles shades {:.2} \
             times the fragments of clip distances; the split emits {:.2} primitives a triangle and shades {:.2} times the vertices of clip distances.",
            ratio(clip.vertices, cube.vertices),
            ratio(clip.fragments, cube.fragments),
            ratio(mask.fragments, clip.fragments),
            ratio(split.primitives, live.corners.len() as u64),
            ratio(split.vertices, clip.vertices),
        ));
    }
    measured.sort_by(|a, b| a.times.median.total_cmp(&b.times.median));
    let order: Vec<_> = measured
        .iter()
        .map(|one| format!("{} {:.3}", one.variant.name, one.times.median))
        .collect();
    table.note(format!(
        "{address}: {} triangles, {} points of which {:.1} % are lit. From the fastest, in ms: {}.",
        live.corners.len(),
        points.len(),
        100.0 * points.iter().filter(|point| point.is_lit).count() as f64 / points.len().max(1) as f64,
        order.join("; ")
    ));
    Ok(())
}

/// Mean angle, in radians, that edges of pieces are seen at.
fn edge_length(live: &FilledScene, level: u32) -> f64 {
    let origin = live.origin;
    let of = |triangle: &[Vec3; 3]| -> [f64; 2] {
        let pieces = (0..level * level).map(|piece| {
            let corner = |i| tessellation_point(tessellation_weights(level, piece, i), level, *triangle) - origin;
            let [a, b, c] = [0, 1, 2].map(|i| corner(i).as_dvec3());
            a.angle_between(b) + b.angle_between(c) + c.angle_between(a)
        });
        [pieces.filter(|sum| sum.is_finite()).sum(), f64::from(3 * level * level)]
    };
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let [sum, count] = live.corners.par_iter().map(of).reduce(|| [0.0; 2], add);
    sum / count.max(1.0)
}

/// Pieces from whole triangles on: errors of maps whose edges are not split.
fn sweep(gpu: &Gpu, context: &Context<'_>, side: u32, points: u32, curves: &mut Vec<Curve>) -> Result<Table> {
    let mut table = Table::new(
        "Unsplit maps by the length of edges",
        &[
            "scene",
            "map",
            "level",
            "mean edge (rad)",
            "wrong triangles (%)",
            "order of them",
            "empty (%)",
            "attribute error, mean (texels)",
            "order of it",
            "points shadowed wrongly (%)",
        ],
    );
    let levels: Vec<u32> = (0..=MAX_LEVEL.ilog2()).map(|power| 1 << power).collect();
    let levels = if context.smoke { &levels[..3] } else { &levels };
    let scenes = &SWEPT[..if context.smoke { 1 } else { SWEPT.len() }];
    for (done, (address, share)) in scenes.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context
            .watch
            .begin(&format!("unsplit maps of {address}"), done, scenes.len());
        let live = FilledScene::load(gpu, address, *share)?;
        let points = shadow_points(&live, points);
        for (name, map) in [
            ("4e unsplit, square", Parametrization::OctahedronQuadratic),
            ("4e unsplit, rectangle", Parametrization::OctahedronRectangular),
            ("dual paraboloid", Parametrization::DualParaboloid),
        ] {
            let mut curve = Vec::new();
            let mut last: Option<[f64; 3]> = None;
            for level in levels {
                let level = *level;
                let layering = if map == Parametrization::DualParaboloid {
                    Layering::Paraboloids { level }
                } else {
                    Layering::Octants(OctantCut::Unsplit { level })
                };
                let variant = variant(name, map, Way::Raster(layering), side);
                let seen = live.seen(map, variant.size);
                let quality = quality(&variant, &live.fill(gpu, &variant)?, &seen, &points);
                let edge = edge_length(&live, level);
                let mean = quality.angles.map_or(0.0, |angles| angles[0]);
                let order = |at: usize, now: f64| {
                    let last: [f64; 3] = last?;
                    let order = (now / last[at]).ln() / (edge / last[0]).ln();
                    order.is_finite().then_some(order)
                };
                let orders = [order(1, quality.wrong), order(2, mean)];
                last = Some([edge, quality.wrong, mean]);
                table.row([
                    (*address).into(),
                    name.into(),
                    u64::from(level).into(),
                    edge.into(),
                    (100.0 * quality.wrong).into(),
                    orders[0].into(),
                    (100.0 * quality.empty).into(),
                    mean.into(),
                    orders[1].into(),
                    (100.0 * quality.shadow.iter().sum::<f64>()).into(),
                ]);
                curve.push(PlotPoint {
                    x: edge,
                    y: 100.0 * quality.wrong,
                    y_range: [100.0 * quality.wrong; 2],
                    ringed: false,
                });
            }
            if curves.len() < 3 {
                curves.push(Curve {
                    name: name.into(),
                    points: curve,
                });
            }
        }
    }
    table.note(
        "Triangles are drawn as level² pieces; those over a seam of the octahedron map are left out. Orders are exponents of the \
         length of edges, from the row before. Plot of the first scene's wrong triangles beside this \
         table: `unsplit.svg`.",
    );
    Ok(table)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (side, repeats, points, scenes) = if context.smoke {
        (64, 1, 2_000, 1)
    } else {
        (512, 9, 40_000, SCENES.len())
    };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Ways to render maps of directions",
        &[
            "scene",
            "way",
            "document (frames/s)",
            "GPU time, median (ms)",
            "middle half from",
            "to",
            "of the cube by passes",
            "vertices shaded",
            "primitives emitted",
            "corners emitted",
            "fragments shaded",
            "wrong triangles (%)",
            "empty (%)",
            "attribute error, mean (texels)",
            "attribute error, 99th percentile (texels)",
            "points lit wrongly (%)",
            "points in shadow wrongly (%)",
            "shadow error of the cube's",
        ],
    );
    table.note(format!(
        "About {side} × {side} texels in all: square 512², rectangle 724 × 362, cube 6 × 209², paraboloids 2 × 362² at full size, whose \
         corners hold nothing. A pass draws depth and distances, which the rasterizer interpolates. Shadow errors: points spread evenly \
         over all surfaces but those seen at a cosine below {LEAST_COSINE}; a point is lit when its distance d is at most the texel's and a \
         bias of d (w tan θ + {ROUNDING_BIAS:e}), w being the mean width of the map's texels in radians, θ the angle to the normal; the truth \
         is a ray. Wrong triangles: against the ray through the texel's centre; of points also where holes were filled. Attribute error: the \
         angle between a texel and the interpolated position that it holds. {SPLATS_PER_TEXEL} points a texel are splatted, evenly over all \
         surfaces. An order of two ways counts as told apart where the middle halves of their times do not meet. The document's figures are of \
         other machines, scenes and pictures: their order counts."
    ));
    for (done, scene) in SCENES[..scenes].iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(scene.0, done, scenes);
        compare(&gpu, *scene, (side, repeats, points), &mut table)?;
    }
    let mut curves = Vec::new();
    let swept = sweep(&gpu, context, side, points, &mut curves)?;
    let words = Words {
        title: "Octahedron and paraboloid maps of unsplit pieces",
        x: "mean edge of pieces (rad)",
        y: "texels with wrong triangles (%)",
    };
    if let Some(svg) = plot::log_log_of_rates(words, &curves)? {
        atomic::write(&context.file("unsplit.svg")?, svg.as_bytes())?;
    }
    Ok(vec![table, swept])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_hold_where_middle_halves_do_not_meet() {
        let of = |from: f64| Times::of((0..9).map(|i| 1e-3 * (from + f64::from(i))).collect());
        let first = of(1.0);
        assert!(
            [(first.median, 5.0), (first.low, 3.0), (first.high, 7.0)]
                .iter()
                .all(|(found, right)| (found - right).abs() < 1e-12)
        );
        assert_eq!(first.before(of(6.0)), "holds");
        assert_eq!(first.before(of(4.0)), "is not told apart");
        assert_eq!(of(6.0).before(first), "is the reverse");
        assert_eq!(Times::of(Vec::new()).before(first), "is not told apart");
    }
}
