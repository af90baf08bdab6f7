//! Maps of directions rendered live: what each way costs, what it draws wrongly, and what shadows by it are worth.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.1, §7.3.2 and Table 7.1. Oracles: the ray through each texel's centre, and shadow
//! rays from points on surfaces to the map's middle.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::cube::CUBE_FACES;
use clerestory::raster::tessellation::MAX_LEVEL;
use clerestory::raster::{Layering, OctantCut};
use glam::Vec3;

use super::fastest_ways::{Order, ways_of};
use super::filled_maps::{FilledScene, SPLATS_PER_TEXEL, Seen, Variant, Way, Work, variant, variants};
use super::filled_quality::{LEAST_COSINE, Quality, ROUNDING_BIAS, edge_length, quality, shadow_points};
use crate::experiments::findings::{
    Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_ratio_of_shares;
use crate::experiments::reference::short_name;
use crate::experiments::slope::least_squares;

/// Scenes, and the place in the box around each that the map is of.
const SCENES: [(&str, Vec3); 4] = [
    ("builtin:cornell-box", Vec3::new(0.52, 0.7, 0.44)),
    ("builtin:triangle-soup?n=1000", Vec3::new(0.51, 0.49, 0.52)),
    ("builtin:box-city?n=2000", Vec3::new(0.55, 1.5, 0.52)),
    ("builtin:sphere-flake?depth=3", Vec3::new(0.9, 0.9, 0.8)),
];
/// Scenes of the sweep over pieces: few triangles, and large ones.
const SWEPT: [(&str, Vec3); 2] = [SCENES[0], ("builtin:box-city?n=60", Vec3::new(0.55, 0.6, 0.52))];
/// Maps of the sweep.
const UNSPLIT: [(&str, Parametrization); 3] = [
    ("4e unsplit, square", Parametrization::OctahedronQuadratic),
    ("4e unsplit, rectangle", Parametrization::OctahedronRectangular),
    ("dual paraboloid", Parametrization::DualParaboloid),
];
/// The level of pieces of triangles.
pub const LEVEL: u32 = 4;
/// The root of a map's texels, and points for shadows.
const FULL: (u32, u32) = (512, 40_000);
const SMOKE: (u32, u32) = (64, 2_000);
const TURNS: usize = 9;
/// The yardstick of times and shadows.
const CUBE: Way = Way::Raster(Layering::Passes(CUBE_FACES));

rows! {
    /// A way to fill a map of a scene.
    struct Row = "Ways to render maps of directions" by [scene, way] {
        scene: String = "scene",
        way: String = "way",
        time: Repeats = "GPU time (ms)",
        over_cube: Repeats = "time over that of the cube by passes",
        vertices: u64 = "vertices shaded",
        primitives: u64 = "primitives emitted",
        corners: u64 = "corners emitted",
        fragments: u64 = "fragments shaded",
        wrong: f64 = "wrong triangles (%)",
        empty: f64 = "empty texels (%)",
        angle: Option<f64> = "attribute error, mean (texels)",
        most_angle: Option<f64> = "attribute error, 99th percentile (texels)",
        wrongly_lit: f64 = "points lit wrongly (%)",
        wrongly_dark: f64 = "points in shadow wrongly (%)",
        over_shadow: Option<f64> = "shadow error over that of the cube by passes",
    }
    beside "document (frames/s)" = |row| ways_of(&row.way).and_then(|way| way.stated).into();
}

rows! {
    /// A scene, and the work of cuts in it.
    struct Scene = "Work of cuts" by [scene] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        points: u64 = "points for shadows",
        lit: f64 = "lit points (%)",
        clip_vertices: f64 = "clip distances: vertices over the cube's",
        clip_fragments: f64 = "clip distances: fragments over the cube's",
        mask_fragments: f64 = "mask in rectangles: fragments over clip distances'",
        split_primitives: f64 = "split: primitives per triangle",
        split_vertices: f64 = "split: vertices over clip distances'",
    }
}

rows! {
    /// A map of unsplit pieces.
    struct Unsplit = "Unsplit maps by the length of edges" by [scene, map, level] {
        scene: String = "scene",
        map: String = "map",
        level: u64 = "level",
        edge: f64 = "mean edge (rad)",
        wrong: f64 = "wrong triangles (%)",
        empty: f64 = "empty texels (%)",
        angle: f64 = "attribute error, mean (texels)",
        shadow: f64 = "points shadowed wrongly (%)",
    }
}

rows! {
    /// How errors of unsplit maps fall.
    struct Fall = "Powers of the length of edges by which errors of unsplit maps grow" by [scene, map] {
        scene: String = "scene",
        map: String = "map",
        wrong: f64 = "power of wrong triangles",
        angle: Option<f64> = "power of the mean attribute error",
    }
}

rows! {
    /// Shadows by a whole octahedron beside those by the cube.
    struct Shadow = "Shadow errors of octahedra over the cube's" by [scene, way] {
        scene: String = "scene",
        way: String = "way",
        ratio: Measured = "shadow error over that of the cube by passes",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    ways: Vec<Row>,
    scenes: Vec<Scene>,
    unsplit: Vec<Unsplit>,
}

const OF_ORDERS: &[Criterion<Order>] = &[
    Criterion::each(
        "the document's order: time of each over that of its slower neighbour",
        Bound::AtMost(1.0),
        |row: &Order| row.ratio,
    )
    .among(|row| !row.has_clip_distances()),
    Criterion::each(
        "clip distances stand next to the cube: time of each over that of its slower neighbour",
        Bound::AtMost(1.0),
        |row: &Order| row.ratio,
    )
    .among(Order::has_clip_distances),
];
const OF_SHADOWS: &[Criterion<Shadow>] = &[Criterion::each(
    "shadows of octahedra are within a fifth of the cube's error: their ratio",
    Bound::Between(0.8, 1.2),
    |row: &Shadow| row.ratio,
)
.because("intervals of 95 % by the number of points")];
const OF_FALLS: &[Criterion<Fall>] = &[Criterion::each(
    "errors of unsplit maps fall with the length of edges: the power of wrong triangles",
    Bound::AtLeast(0.5),
    |row: &Fall| row.wrong.into(),
)
.because("by more than single texels that change sides")];

impl Row {
    /// Whether all that its directions see is drawn into an octahedron; pieces over seams are left out of unsplit ones.
    fn is_a_whole_octahedron(&self) -> bool {
        ways_of(&self.way).is_some_and(|way| {
            let is_unsplit = matches!(way.way, Way::Raster(Layering::Octants(OctantCut::Unsplit { .. })));
            let is_octahedron = !matches!(way.map, Parametrization::Cube | Parametrization::DualParaboloid);
            is_octahedron && !is_unsplit
        })
    }

    fn of(scene: &str, variant: &Variant, quality: &Quality, work: Work, time: Vec<f64>) -> Self {
        Self {
            scene: scene.into(),
            way: variant.name.clone(),
            time: Repeats(time).scaled(1e3),
            vertices: work.vertices,
            primitives: work.primitives,
            corners: work.emitted_corners,
            fragments: work.fragments,
            wrong: 100.0 * quality.wrong,
            empty: 100.0 * quality.empty,
            angle: quality.angles.map(|angles| angles[0]),
            most_angle: quality.angles.map(|angles| angles[1]),
            wrongly_lit: 100.0 * quality.shadow[0],
            wrongly_dark: 100.0 * quality.shadow[1],
            ..Self::default()
        }
    }

    fn is_the_cube(&self) -> bool {
        ways_of(&self.way).is_some_and(|way| way.way == CUBE)
    }

    /// Points whose shadow is wrong, %.
    fn shadow_error(&self) -> f64 {
        self.wrongly_lit + self.wrongly_dark
    }

    /// The same beside the cube by passes.
    fn beside(self, cube: &Self) -> Self {
        let over_shadow = match [self.shadow_error(), cube.shadow_error()] {
            [0.0, 0.0] => Some(1.0),
            [_, 0.0] => None,
            [own, of_cube] => Some(own / of_cube),
        };
        Self {
            over_cube: self.time.over(&cube.time),
            over_shadow,
            ..self
        }
    }
}

/// All ways in a scene, which take turns.
fn compare(context: &Context<'_>, gpu: &Gpu, (address, share): (&str, Vec3)) -> Result<(Vec<Row>, Scene)> {
    let (side, points) = context.pick(FULL, SMOKE);
    let live = FilledScene::load(gpu, address, share)?;
    let points = shadow_points(&live, points);
    let scene = short_name(address).to_owned();
    let mut seen: Vec<(Parametrization, Seen)> = Vec::new();
    let (mut drawn, mut fillings) = (Vec::new(), Vec::new());
    for variant in variants(side, LEVEL) {
        if !seen.iter().any(|(map, _)| *map == variant.map) {
            seen.push((variant.map, live.seen(variant.map, variant.size)));
        }
        let filled = live.fill(gpu, &variant)?;
        let of_rays = seen.iter().find(|(map, _)| *map == variant.map).map(|(_, seen)| seen);
        let quality = of_rays.map_or_else(Quality::default, |seen| quality(&variant, &filled, seen, &points));
        let (filling, work) = live.filling(gpu, &variant)?;
        fillings.push(filling);
        drawn.push((variant, quality, work));
    }
    let times = context.in_turns(TURNS, fillings.len(), |way| fillings[way].seconds())?;
    let rows = drawn.iter().zip(times);
    let rows: Vec<Row> = rows
        .map(|((variant, quality, work), time)| Row::of(&scene, variant, quality, *work, time))
        .collect();
    let work = |way: Way| {
        let found = drawn.iter().find(|(variant, ..)| variant.way == way);
        found.map_or_else(Work::default, |(.., work)| *work)
    };
    let octants = |cut| work(Way::Raster(Layering::Octants(cut)));
    let [cube, clip] = [work(CUBE), octants(OctantCut::ClipDistances)];
    let [mask, split] = [octants(OctantCut::MaskInRectangles), octants(OctantCut::Split)];
    let ratio = |a: u64, b: u64| a as f64 / b.max(1) as f64;
    let summary = Scene {
        triangles: live.corners.len() as u64,
        points: points.len() as u64,
        lit: 100.0
            * ratio(
                points.iter().filter(|point| point.is_lit).count() as u64,
                points.len() as u64,
            ),
        clip_vertices: ratio(clip.vertices, cube.vertices),
        clip_fragments: ratio(clip.fragments, cube.fragments),
        mask_fragments: ratio(mask.fragments, clip.fragments),
        split_primitives: ratio(split.primitives, live.corners.len() as u64),
        split_vertices: ratio(split.vertices, clip.vertices),
        scene,
    };
    let cube = rows.iter().find(|row| row.is_the_cube()).cloned().unwrap_or_default();
    Ok((rows.into_iter().map(|row| row.beside(&cube)).collect(), summary))
}

/// Pieces from whole triangles on: errors of maps whose edges are not split.
fn unsplit(context: &Context<'_>, gpu: &Gpu, (address, share): (&str, Vec3)) -> Result<Vec<Unsplit>> {
    let (side, points) = context.pick(FULL, SMOKE);
    let live = FilledScene::load(gpu, address, share)?;
    let points = shadow_points(&live, points);
    let levels: Vec<u32> = (0..=MAX_LEVEL.ilog2()).map(|power| 1 << power).collect();
    let mut rows = Vec::new();
    for (name, map) in UNSPLIT {
        for level in context.first(&levels, 3).iter().copied() {
            let layering = if map == Parametrization::DualParaboloid {
                Layering::Paraboloids { level }
            } else {
                Layering::Octants(OctantCut::Unsplit { level })
            };
            let variant = variant(name, map, Way::Raster(layering), side);
            let seen = live.seen(map, variant.size);
            let quality = quality(&variant, &live.fill(gpu, &variant)?, &seen, &points);
            rows.push(Unsplit {
                scene: short_name(address).to_owned(),
                map: name.into(),
                level: level.into(),
                edge: edge_length(&live, level),
                wrong: 100.0 * quality.wrong,
                empty: 100.0 * quality.empty,
                angle: quality.angles.map_or(0.0, |angles| angles[0]),
                shadow: 100.0 * quality.shadow.iter().sum::<f64>(),
            });
        }
    }
    Ok(rows)
}

/// Shadows of whole octahedra beside those of the cube, by the points of each scene.
fn shadows(ways: &[Row], scenes: &[Scene]) -> Vec<Shadow> {
    let shadow = |row: &Row| {
        let cube = ways
            .iter()
            .find(|other| other.scene == row.scene && other.is_the_cube());
        let scene = scenes.iter().find(|scene| scene.scene == row.scene);
        let pair = cube.zip(scene).map(|(cube, scene)| {
            let shares = [row, cube].map(|row| 0.01 * row.shadow_error());
            (shares, scene.points)
        });
        Shadow {
            scene: row.scene.clone(),
            way: row.way.clone(),
            ratio: mean_ratio_of_shares(pair),
        }
    };
    ways.iter()
        .filter(|row| row.is_a_whole_octahedron())
        .map(shadow)
        .collect()
}

/// Powers of the length of edges, over all levels with an error; not a number of fewer than two of these.
fn falls(unsplit: &[Unsplit]) -> Vec<Fall> {
    let power = |rows: &[Unsplit], error: fn(&Unsplit) -> f64| {
        let points = rows.iter().filter(|row| error(row) != 0.0);
        least_squares(&points.map(|row| (row.edge.ln(), error(row).ln())).collect::<Vec<_>>())
    };
    let fall = |rows: &[Unsplit]| {
        Some(Fall {
            scene: rows.first()?.scene.clone(),
            map: rows.first()?.map.clone(),
            wrong: power(rows, |row| row.wrong).unwrap_or(f64::NAN),
            angle: power(rows, |row| row.angle),
        })
    };
    let of_a_map = unsplit.chunk_by(|a, b| (&a.scene, &a.map) == (&b.scene, &b.map));
    of_a_map.filter_map(fall).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut scenes = Vec::new();
        let ways = context.each(
            context.first(&SCENES, 1),
            |(address, _)| short_name(address).to_owned(),
            |scene| {
                let (rows, summary) = compare(context, &gpu, *scene)?;
                scenes.push(summary);
                Ok(rows)
            },
        )?;
        let name = |(address, _): &(&str, Vec3)| format!("unsplit maps of {}", short_name(address));
        let unsplit = context.each(context.first(&SWEPT, 1), name, |scene| unsplit(context, &gpu, *scene))?;
        Ok(Self { ways, scenes, unsplit })
    }

    fn findings(&self) -> Findings {
        let times: Vec<(&str, &str, &Repeats)> = self
            .ways
            .iter()
            .map(|row| (row.scene.as_str(), row.way.as_str(), &row.time))
            .collect();
        let cube = self.ways.iter().filter(|row| row.is_the_cube());
        let first = self
            .unsplit
            .chunk_by(|a, b| a.scene == b.scene)
            .next()
            .unwrap_or_default();
        let side = FULL.0;
        let sizes = [
            ("square", Parametrization::OctahedronQuadratic),
            ("rectangle", Parametrization::OctahedronRectangular),
            ("cube", Parametrization::Cube),
            ("paraboloids", Parametrization::DualParaboloid),
        ];
        let sizes = sizes.map(|(name, map)| {
            let size = variant(name, map, CUBE, side).size;
            format!("{name} {} × {} × {}", map.layers(), size.x, size.y)
        });
        let sizes = sizes.join(", ");
        Findings::of(&Order::all(&times), OF_ORDERS)
            .headline(
                "GPU time of the cube by passes (ms, geometric mean over scenes)",
                geometric_mean(cube.map(|row| Measured::from(&row.time))),
            )
            .curves(
                "unsplit",
                "Octahedron and paraboloid maps of unsplit pieces, the first scene",
                Axes::rates("mean edge of pieces (rad)", "texels with wrong triangles (%)"),
                curves(first, |row| row.map.clone(), |row| (row.edge, row.wrong.into())),
            )
            .note(
                "The fastest of the ways that each figure of the document stands for, beside the fastest of the next figure; and the fastest by clip \
                 distances, of which it has no figure, between its two fastest. Ratios are of the same turns. The document's figures are of other \
                 machines, scenes and pictures: their order counts.",
            )
            .and(Findings::of(&self.ways, &[]).judged(&shadows(&self.ways, &self.scenes), OF_SHADOWS))
            .note(format!(
                "In a full run about {side} × {side} texels in all: {sizes}; the corners of paraboloids hold nothing. A pass draws depth \
                 and distances, which the rasterizer interpolates. Shadow errors: points spread evenly over all \
                 surfaces but those seen at a cosine below {LEAST_COSINE}; a point is lit when its distance d is at most the texel's and a bias of \
                 d (w tan θ + {ROUNDING_BIAS:e}), w being the mean width of the map's texels in radians, θ the angle to the normal; the truth is a \
                 ray; intervals of ratios take points and both maps' errors as independent. Wrong triangles: against the ray through the \
                 texel's centre; of points also where holes were filled. Attribute error: the angle \
                 between a texel and the interpolated position that it holds. {SPLATS_PER_TEXEL} points per texel are splatted, evenly over all surfaces."
            ))
            .and(Findings::of(&self.scenes, &[]))
            .and(Findings::of(&falls(&self.unsplit), OF_FALLS))
            .and(Findings::of(&self.unsplit, &[]))
            .note("Triangles are drawn as level² pieces; those over a seam of the octahedron map are left out.")
    }
}
