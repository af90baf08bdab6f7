//! Errors of look-ups by every search, in rooms of boxes as cubes and octahedra of equal texels, and what a ray costs.
//!
//! Oracle: exact rays in the same rooms. What was published are errors of exact distances; here they are of texels, on the device.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::impostor::layouts::{ImpostorLayout, ImpostorLayouts};
use clerestory::maps::impostor::places::blended_maps;
use clerestory::maps::impostor::proxy::{box_proxy, hemisphere_proxy, sphere_proxy};
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{
    Impostor, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, SearchMethod,
};
use clerestory::maps::{MapImage, Parametrization};
use glam::DVec3;

use super::mirrored_rooms;
use super::search_times::{self, Beside, Steps};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::Errors;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 220;
/// The same of pictures.
const PICTURED: u32 = 96;
/// Texels of a cube of 256² a face.
const TEXELS: f64 = 6.0 * 256.0 * 256.0;
const TURNS: usize = 5;
/// Index of glass.
const GLASS: f64 = 1.5;

rows! {
    /// A way to look a sphere's rays up.
    struct Row = "Errors of look-ups" by [sphere, map, way] {
        sphere: String = "sphere",
        map: String = "map",
        way: String = "look-up",
        mean: f64 = "mean error (°)",
        published: Option<f64> = "published mean (°)",
        seen: Option<f64> = "mean error of rays whose hit the map's place sees (°)",
        published_seen: Option<f64> = "published mean of these (°)",
        high: f64 = "95 % of rays are below (°)",
        largest: f64 = "largest (°)",
        good: f64 = "rays below 1° (%)",
        published_good: Option<f64> = "published share below 1° (%)",
        missed: Option<f64> = "difference from what was published over what is allowed",
        time: Option<Measured> = "time of a ray's search on the device (ns)",
    }
}
rows! {
    /// What a ray costs with the fetch of its radiance.
    struct Time = "Time of look-ups with their radiance" by [sphere, map, way] {
        sphere: String = "sphere",
        map: String = "map",
        way: String = "look-up",
        split: Measured = "time of a ray, distances in a buffer of their own (ns)",
        packed: Measured = "time of a ray, distances beside radiance (ns)",
        of_packed: Measured = "a buffer of their own over beside radiance",
        over_classical: Measured = "a buffer of their own: time over the classical look-up's",
        published: Option<f64> = "published time over the classical look-up's",
    }
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    look_ups: Vec<Row>,
    times: Vec<Time>,
    steps: Vec<Steps>,
    beside: Vec<Beside>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "errors are the published ones: difference over what is allowed",
        Bound::AtMost(1.0),
        |row: &Row| row.missed.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.missed.is_some())
    .because("a fifth of the published value, or 0.03°; a point of a share"),
    Criterion::each(
        "the box is its room: the largest error (°)",
        Bound::AtMost(1e-5),
        |row: &Row| row.largest.into(),
    )
    .among(|row| row.way == BOX)
    .in_every_form(),
];

const OF_TIMES: &[Criterion<Time>] = &[
    Criterion::each(
        "one step costs at most twice the classical look-up",
        Bound::AtMost(2.0),
        |row: &Time| row.over_classical,
    )
    .among(|row| row.way == name(&ImpostorSettings::of(SearchMethod::SecantFromGuess, 0), 1)),
    Criterion::each(
        "distances in a buffer of their own are no slower than beside radiance: time over theirs",
        Bound::AtMost(1.0),
        |row: &Time| row.of_packed,
    )
    .among(|row| row.way != name(&ImpostorSettings::of(SearchMethod::Classical, 0), 1))
    .because("a fifth more pictures a second was published"),
];

const BOX: &str = "box in place of the room";

/// What was published of a sphere's rays: all, those whose hit is seen, and the share below a degree.
struct Published {
    sphere: ShinySphere,
    settings: ImpostorSettings,
    layers: u32,
    all: Option<f64>,
    seen: Option<f64>,
    good: Option<f64>,
}

/// Above it no crossing is passed over.
const ANY: f32 = 0.999;

fn name(settings: &ImpostorSettings, layers: u32) -> String {
    let ImpostorSettings { method, steps, .. } = settings;
    match layers {
        1 if settings.tolerance == ANY => format!("{method} to the first crossing +{steps}"),
        1 => format!("{method} +{steps}"),
        _ => format!("{method} +{steps}, {layers} layers"),
    }
}

/// All that is searched, with the means that were published.
fn searches() -> Vec<Published> {
    use SearchMethod::{
        Classical, FalsePosition, FixedPoint, Hybrid, March, Mixed, Perpendicular, SecantFromGuess, SecantFromPoint,
    };
    let mut all = Vec::new();
    let mut add_with = |sphere: ShinySphere, settings, layers, figures: [Option<f64>; 3]| {
        let [mean, seen, good] = figures;
        all.push(Published {
            sphere,
            settings,
            layers,
            all: mean,
            seen,
            good,
        });
    };
    let first = ImpostorSettings {
        tolerance: ANY,
        ..ImpostorSettings::of(March, 64)
    };
    add_with(ShinySphere::BOX, first, 1, [0.21, 0.017, 98.1].map(Some));
    add_with(ShinySphere::P1, first, 1, [7.5, 0.003, 70.2].map(Some));
    add_with(ShinySphere::P2, first, 1, [None; 3]);
    let mut add = |sphere, method, steps, layers, figures| {
        add_with(sphere, ImpostorSettings::of(method, steps), layers, figures);
    };
    let convex: [(SearchMethod, u32, [f64; 3]); 14] = [
        (Classical, 0, [9.75, 11.96, 30.88]),
        (Perpendicular, 0, [0.64, 0.87, 5.60]),
        (SecantFromPoint, 0, [0.95, 2.13, 17.9]),
        (SecantFromGuess, 0, [0.008, 0.010, 0.712]),
        (SecantFromPoint, 1, [0.241, 0.568, 21.1]),
        (SecantFromPoint, 10, [0.0, 0.0, 18.7]),
        (SecantFromGuess, 1, [0.0, 0.0, 0.028]),
        (SecantFromGuess, 3, [0.0, 0.0, 0.0]),
        (FalsePosition, 1, [0.029, 0.052, 4.08]),
        (FalsePosition, 3, [0.001, 0.001, 0.419]),
        (FalsePosition, 10, [0.0, 0.0, 0.005]),
        (Mixed, 1, [0.001, 0.001, 0.250]),
        (Mixed, 3, [0.0, 0.0, 0.045]),
        (Mixed, 10, [0.0, 0.0, 0.001]),
    ];
    for (i, sphere) in [ShinySphere::A, ShinySphere::B, ShinySphere::C].into_iter().enumerate() {
        for (method, steps, means) in convex {
            add(sphere, method, steps, 1, [Some(means[i]), None, None]);
        }
        for steps in [0, 3, 10] {
            add(sphere, FixedPoint, steps, 1, [None; 3]);
        }
        add(sphere, Hybrid, 3, 1, [None; 3]);
        add(sphere, March, 64, 1, [None; 3]);
    }
    let hidden: [(SearchMethod, u32, [f64; 4]); 6] = [
        (Classical, 0, [21.1, 21.2, 30.9, 23.8]),
        (SecantFromGuess, 0, [1.95, 1.50, 15.9, 1.19]),
        (FalsePosition, 3, [0.39, 0.19, 8.3, 0.52]),
        (FalsePosition, 10, [0.23, 0.042, 7.9, 0.064]),
        (Mixed, 3, [0.40, 0.20, 12.7, 0.35]),
        (Mixed, 10, [0.33, 0.136, 11.9, 0.072]),
    ];
    for (i, sphere) in [ShinySphere::BOX, ShinySphere::P1].into_iter().enumerate() {
        for (method, steps, means) in hidden {
            add(
                sphere,
                method,
                steps,
                1,
                [Some(means[2 * i]), Some(means[2 * i + 1]), None],
            );
        }
        add(sphere, Hybrid, 3, 1, [None; 3]);
    }
    add(ShinySphere::BOX, SecantFromGuess, 10, 1, [0.84, 0.65, 97.1].map(Some));
    add(ShinySphere::P1, SecantFromGuess, 10, 1, [15.6, 0.024, 70.2].map(Some));
    add(ShinySphere::P2, FalsePosition, 10, 1, [None, Some(69.7), None]);
    add(ShinySphere::P2, Hybrid, 10, 1, [Some(31.1), Some(2.1), None]);
    for (sphere, shares) in [
        (ShinySphere::P1, [69.9, 79.1, 98.7]),
        (ShinySphere::P2, [30.8, 50.3, 99.1]),
    ] {
        for (layers, share) in (1..).zip(shares) {
            add(sphere, March, 64, layers, [None, None, Some(share)]);
        }
    }
    all
}

/// The row of directions that were looked up; all but times.
fn row(sphere: &ShinySphere, map: String, way: String, rays: &[ImpostorRay], directions: &[DVec3]) -> Row {
    let (mut all, mut seen, mut good) = (Errors::default(), Errors::default(), 0u64);
    for (ray, direction) in rays.iter().zip(directions) {
        let error = sphere.room.error(ray, *direction);
        all.add(error);
        good += u64::from(error < 1.0);
        if sphere.room.sees_hit(ray) {
            seen.add(error);
        }
    }
    Row {
        sphere: sphere.name.into(),
        map,
        way,
        mean: all.mean(),
        published: None,
        seen: sphere.room.obstacle.map(|_| seen.mean()),
        published_seen: None,
        high: all.quantile(0.95),
        largest: all.worst(),
        good: 100.0 * good as f64 / rays.len().max(1) as f64,
        published_good: None,
        missed: None,
        time: None,
    }
}

/// By how much the row misses what was published, over what is allowed.
fn missed(row: &Row) -> Option<f64> {
    let degrees = |found: f64, published: f64| (found - published).abs() / f64::max(0.2 * published, 0.03);
    let mean = row.published.map(|published| degrees(row.mean, published));
    let seen = row
        .published_seen
        .zip(row.seen)
        .map(|(published, seen)| degrees(seen, published));
    let good = row.published_good.map(|published| (row.good - published).abs());
    [mean, seen, good].into_iter().flatten().reduce(f64::max)
}

/// Rows of one sphere in one map.
fn searched(
    context: &Context<'_>,
    gpu: &Gpu,
    map: Parametrization,
    sphere: &ShinySphere,
    side: u32,
    texels: f64,
) -> Result<Vec<Row>> {
    let rays = sphere.rays(side, None);
    let all: Vec<Published> = searches()
        .into_iter()
        .filter(|search| search.sphere.name == sphere.name)
        .collect();
    let mut impostors = Vec::new();
    for layers in 1..=3 {
        let image = ImpostorImage::from_fn(map, map.size_for(texels), layers, true, |d| sphere.room.surfaces(d))?;
        impostors.push(Impostor::new(gpu, &image)?);
    }
    let of = |search: &Published| &impostors[search.layers as usize - 1];
    let mut kernels = Vec::new();
    for search in &all {
        kernels.push(ImpostorSearch::new(gpu, of(search), &search.settings)?);
    }
    let times = context.in_turns(TURNS, all.len(), |i| {
        let (_, seconds) = kernels[i].search_timed(of(&all[i]), &rays)?;
        Ok(1e9 * seconds / rays.len().max(1) as f64)
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let mut rows = Vec::new();
    for ((search, kernel), time) in all.iter().zip(&kernels).zip(&times) {
        let (hits, _) = kernel.search_timed(of(search), &rays)?;
        let directions: Vec<DVec3> = hits.iter().map(|hit| hit.direction).collect();
        let mut found = row(
            sphere,
            map.to_string(),
            name(&search.settings, search.layers),
            &rays,
            &directions,
        );
        (found.published, found.published_seen, found.published_good) = (search.all, search.seen, search.good);
        found.missed = missed(&found);
        found.time = Some(time.into());
        rows.push(found);
    }
    Ok(rows)
}

/// Times of look-ups with their radiance, in both layouts.
fn timed(
    context: &Context<'_>,
    gpu: &Gpu,
    map: Parametrization,
    (sphere, published): (&ShinySphere, [Option<f64>; 4]),
    side: u32,
    texels: f64,
) -> Result<Vec<Time>> {
    let (rays, size) = (sphere.rays(side, None), map.size_for(texels));
    let image = ImpostorImage::from_fn(map, size, 1, false, |d| sphere.room.surfaces(d))?;
    let radiance = MapImage::from_fn(map, size, |texel| {
        map.texel_direction(size, texel).unwrap_or_default().abs()
    })?;
    let layouts = ImpostorLayouts::new(gpu, &radiance, &image)?;
    let ways = [
        (SearchMethod::Classical, 0),
        (SearchMethod::SecantFromGuess, 0),
        (SearchMethod::FalsePosition, 1),
        (SearchMethod::FalsePosition, 8),
    ]
    .map(|(method, steps)| ImpostorSettings::of(method, steps));
    let each = [ImpostorLayout::Split, ImpostorLayout::Packed];
    let mut look_ups = Vec::new();
    for way in &ways {
        for layout in each {
            look_ups.push(layouts.look_up(way, layout)?);
        }
    }
    let times = context.in_turns(TURNS, look_ups.len(), |i| {
        let (_, seconds) = look_ups[i].look_up_timed(&rays)?;
        Ok(1e9 * seconds / rays.len().max(1) as f64)
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let row = |(i, way): (usize, &ImpostorSettings)| {
        let [split, packed] = [&times[2 * i], &times[2 * i + 1]];
        Time {
            sphere: sphere.name.into(),
            map: map.to_string(),
            way: name(way, 1),
            split: split.into(),
            packed: packed.into(),
            of_packed: (&split.over(packed)).into(),
            over_classical: (&split.over(&times[0])).into(),
            published: published[i],
        }
    };
    Ok(ways.iter().enumerate().map(row).collect())
}

/// What needs no distances: shapes in place of the room, several maps, refraction of the classical look-up.
fn without_distances(side: u32) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let published: [(ShinySphere, [f64; 3]); 2] = [
        (ShinySphere::B, [2.51, 1.24, 2.43]),
        (ShinySphere::C, [6.90, 3.43, 7.21]),
    ];
    for (sphere, spheres) in published {
        let rays = sphere.rays(side, None);
        let mut add = |way: String, published: Option<f64>, of: &dyn Fn(DVec3, DVec3) -> DVec3| {
            let directions: Vec<DVec3> = rays.iter().map(|ray| of(ray.origin, ray.direction)).collect();
            let mut found = row(&sphere, "none".into(), way, &rays, &directions);
            found.published = published;
            found.missed = missed(&found);
            rows.push(found);
        };
        add(BOX.into(), None, &|x, r| {
            x + box_proxy(x, r, DVec3::NEG_ONE, DVec3::ONE) * r
        });
        for (radius, published) in [1.0, 1.2, 1.5].into_iter().zip(spheres) {
            let of = |x: DVec3, r: DVec3| x + sphere_proxy(x, r, radius) * r;
            add(
                format!("sphere of radius {radius} in place of the room"),
                Some(published),
                &of,
            );
        }
        add("hemisphere of radius 1.2 above the ground".into(), None, &|x, r| {
            x + hemisphere_proxy(x, DVec3::Y, 1.2) * r
        });
    }
    // Directions from each map's own place, brought back to the origin as what they meet.
    let places = [DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0)];
    let sphere = ShinySphere::B;
    let rays = sphere.rays(side, None);
    for (way, is_blended) in [("nearest of two maps", false), ("blend of the two nearest maps", true)] {
        let mut directions = Vec::new();
        for ray in &rays {
            let blend = blended_maps(&places, ray.origin)?;
            let met = blend.maps.map(|map| {
                let place = places[map as usize];
                (place + sphere.room.hit(place, ray.direction) * ray.direction).normalize()
            });
            let weight = if is_blended { blend.weight } else { 0.0 };
            directions.push(met[0].lerp(met[1], weight));
        }
        rows.push(row(&sphere, "none".into(), way.into(), &rays, &directions));
    }
    Ok(rows)
}

/// Refracted rays of a glass sphere.
fn refracted(gpu: &Gpu, side: u32, texels: f64) -> Result<Vec<Row>> {
    let sphere = ShinySphere::B;
    let rays = sphere.rays(side, Some(GLASS));
    let map = Parametrization::Cube;
    let image = ImpostorImage::from_fn(map, map.size_for(texels), 1, true, |d| sphere.room.surfaces(d))?;
    let impostor = Impostor::new(gpu, &image)?;
    let mut rows = Vec::new();
    for (method, steps, published) in [
        (SearchMethod::Classical, 0, 17.28),
        (SearchMethod::SecantFromGuess, 0, 0.073),
        (SearchMethod::FalsePosition, 3, 0.004),
    ] {
        let settings = ImpostorSettings::of(method, steps);
        let hits = impostor.search(&rays, &settings)?;
        let directions: Vec<DVec3> = hits.iter().map(|hit| hit.direction).collect();
        let mut found = row(
            &sphere,
            map.to_string(),
            format!("refracted, {}", name(&settings, 1)),
            &rays,
            &directions,
        );
        found.published = Some(published);
        found.missed = missed(&found);
        rows.push(found);
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (side, texels) = context.pick((SIDE, TEXELS), (12, 6.0 * 32.0 * 32.0));
        let spheres = [
            ShinySphere::A,
            ShinySphere::B,
            ShinySphere::C,
            ShinySphere::BOX,
            ShinySphere::P1,
            ShinySphere::P2,
        ];
        let maps = [Parametrization::Cube, Parametrization::OctahedronQuadratic];
        let cases: Vec<(Parametrization, ShinySphere)> = spheres
            .into_iter()
            .flat_map(|sphere| maps.map(|map| (map, sphere)))
            .collect();
        // A smoke run has the middle of the room and the sphere that is hidden.
        let cases: Vec<_> = cases
            .into_iter()
            .filter(|(map, sphere)| {
                !context.smoke || *map == Parametrization::Cube && ["B", "P2"].contains(&sphere.name)
            })
            .collect();
        let name = |(map, sphere): &(Parametrization, ShinySphere)| format!("{}, {map}", sphere.name);
        let mut rows = context.each(&cases, name, |(map, sphere)| {
            searched(context, &gpu, *map, sphere, side, texels)
        })?;
        mirrored_rooms::draw(context, context.pick(PICTURED, 8), texels)?;
        rows.extend(without_distances(side)?);
        rows.extend(refracted(&gpu, side, texels)?);
        // Pictures a second: 642, 447 and 323 in an empty room; 630, 430, 323 and 108 beside a box.
        let times = |map| -> Result<Vec<Time>> {
            let room = (
                &ShinySphere::B,
                [Some(1.0), Some(642.0 / 447.0), Some(642.0 / 323.0), None],
            );
            let beside = (
                &ShinySphere::BOX,
                [1.0, 630.0 / 430.0, 630.0 / 323.0, 630.0 / 108.0].map(Some),
            );
            let mut all = timed(context, &gpu, map, room, side, texels)?;
            all.extend(timed(context, &gpu, map, beside, side, texels)?);
            Ok(all)
        };
        let timed_maps = context.first(&maps, 1);
        Ok(Self {
            look_ups: rows,
            times: context.each(timed_maps, Parametrization::to_string, |map| times(*map))?,
            steps: context.each(timed_maps, Parametrization::to_string, |map| {
                search_times::by_steps(context, &gpu, *map, texels)
            })?,
            beside: search_times::beside_rays(context, &gpu, timed_maps, texels)?,
        })
    }

    fn findings(&self) -> Findings {
        let one = name(&ImpostorSettings::of(SearchMethod::SecantFromGuess, 0), 1);
        let of_b = self.look_ups.iter().filter(|row| row.sphere == "B" && row.way == one);
        let worst = of_b.map(|row| row.mean).reduce(f64::max);
        let findings = Findings::of(&self.look_ups, CRITERIA)
            .headline("mean error of one step half-way to a wall (°)", worst.map(Measured::exact))
            .note(
                "A, B and C stand in an empty room, the others beside a box or a pillar; +n is the number of steps after the first guess. Distances are \
                 nearest, with the texel's plane. Published means are those of exact distances. The published march takes the first crossing of the surface's distance, be it a \
                 jump at a silhouette; the engine's goes on to the next one that is a surface, which is farther from the truth at P1 and nearer to it at P2, \
                 and which several layers need. Times are those of the search alone; of the classical look-up, which searches for nothing, of a kernel \
                 that copies directions.",
            )
            .and(Findings::of(&self.times, OF_TIMES))
            .note(
                "Each look-up ends with one fetch of radiance, so that the classical one is that fetch alone. Nearest texels without planes. Published times are those of whole pictures \
                 on a graphics processor of 2004, with all that they have besides; of which of the brackets is not said.",
            )
            .and(Findings::of(&self.steps, search_times::OF_STEPS))
            .note(
                "False position half-way to a wall, with planes and without radiance. A driver may unroll loops of few turns, so that what the first steps add is not what later ones do.",
            )
            .and(Findings::of(&self.beside, search_times::OF_BESIDE))
            .note(
                "Rays of a mirror sphere of one metre about the map's place, in turns by the search and by the index that scenes have by default. The map has one layer with planes, found by rays; errors \
                 are angles at its place against closest hits, and rays whose hit it does not see are among them.",
            );
        if self.look_ups.is_empty() {
            return findings;
        }
        findings.picture(mirrored_rooms::PICTURE, mirrored_rooms::WORDS)
    }
}
