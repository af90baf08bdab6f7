//! Errors of look-ups by every search, in rooms of boxes as cubes and octahedra of equal texels, and what a ray costs.
//!
//! Oracle: exact rays in the same rooms. What was published are errors of exact distances; here they are of texels, on the device.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::impostor::layouts::{ImpostorLayout, ImpostorLayouts};
use clerestory::maps::impostor::proxy_maps::{ProxyHit, ProxyMaps, ProxyShape};
use clerestory::maps::impostor::published::{
    BY_PROXIES, Figures, PROXY_RADII, Published, REFRACTED, SEEN_SHARES, name, searches,
};
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{
    Impostor, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, SearchMethod,
};
use clerestory::maps::{MapImage, Parametrization};
use glam::DVec3;

use super::mirrored_rooms;
use super::search_times::{self, Beside, Steps, Texels};
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
/// Of look-ups with their radiance, whose times are compared: pixels along a side of the view, and turns.
const TIMED_SIDE: u32 = 660;
const TIMED_TURNS: usize = 25;
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
        published_high: Option<f64> = "published: 95 % are below (°)",
        largest: f64 = "largest (°)",
        published_largest: Option<f64> = "published largest (°)",
        good: f64 = "rays below 1° (%)",
        published_good: Option<f64> = "published share below 1° (%)",
        seen_good: Option<f64> = "rays below 1° of those whose hit the map's place sees (%)",
        published_seen_good: Option<f64> = "published share of these below 1° (%)",
        missed: Option<f64> = "difference from what was published over what is allowed",
        time: Option<Measured> = "time of a ray's search on the device (ns)",
    }
}
rows! {
    /// A sphere beside an obstacle.
    struct Seen = "Rays whose hit the map's place sees" by [sphere] {
        sphere: String = "sphere",
        rays: u64 = "rays",
        share: f64 = "seen (%)",
        published: f64 = "published share (%)",
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
rows! {
    /// A shape in place of the room.
    struct Proxied = "Texels of look-ups by shapes" by [sphere, map, way] {
        sphere: String = "sphere",
        map: String = "map",
        way: String = "look-up",
        rays: u64 = "rays",
        same: f64 = "rays whose texel is the one in their direction (%)",
    }
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    look_ups: Vec<Row>,
    seen: Vec<Seen>,
    times: Vec<Time>,
    steps: Vec<Steps>,
    #[serde(default)]
    texels: Vec<Texels>,
    beside: Vec<Beside>,
    #[serde(default)]
    proxied: Vec<Proxied>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "errors are the published ones: difference over what is allowed",
        Bound::AtMost(1.0),
        |row: &Row| row.missed.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.missed.is_some())
    .because("a fifth of the published mean, 95 % or largest, or 0.03°; a point of a share"),
    Criterion::each(
        "spheres in place of the room are 2.51, 1.24 and 2.43° off at B: difference from these (°)",
        Bound::AtMost(0.005),
        |row: &Row| (row.mean - row.published.unwrap_or(f64::NAN)).abs().into(),
    )
    .among(|row| row.sphere == ShinySphere::B.name && row.way.starts_with(SPHERE))
    .because("half of the last published digit"),
    Criterion::each(
        "the box is its room: the largest error (°)",
        Bound::AtMost(1e-5),
        |row: &Row| row.largest.into(),
    )
    .among(|row| row.way == BOX)
    .in_every_form(),
];

const OF_SEEN: &[Criterion<Seen>] = &[Criterion::each(
    "as many hits are seen as published: difference of the shares (points)",
    Bound::AtMost(1.0),
    |row: &Seen| (row.share - row.published).abs().into(),
)];

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

const OF_PROXIED: &[Criterion<Proxied>] = &[Criterion::each(
    "shapes are looked up where they say: rays whose texel is the one in their direction (%)",
    Bound::AtLeast(99.9),
    |row: &Proxied| row.same.into(),
)
.because("on the border of two texels rounding chooses")];

const BOX: &str = "box in place of the room";
/// How the names of spheres in its place begin.
const SPHERE: &str = "sphere of radius";

/// The row of directions that were looked up; all but times.
fn row(sphere: &ShinySphere, map: String, way: String, rays: &[ImpostorRay], directions: &[DVec3]) -> Row {
    let (mut all, mut seen) = (Errors::default(), Errors::default());
    let (mut good, mut seen_good, mut seen_rays) = (0u64, 0u64, 0u64);
    for (ray, direction) in rays.iter().zip(directions) {
        let error = sphere.room.error(ray, *direction);
        let is_good = u64::from(error < 1.0);
        all.add(error);
        good += is_good;
        if sphere.room.sees_hit(ray) {
            seen.add(error);
            seen_good += is_good;
            seen_rays += 1;
        }
    }
    let share = |count: u64, of: u64| 100.0 * count as f64 / of.max(1) as f64;
    Row {
        sphere: sphere.name.into(),
        map,
        way,
        mean: all.mean(),
        published: None,
        seen: sphere.room.obstacle.map(|_| seen.mean()),
        published_seen: None,
        high: all.quantile(0.95),
        published_high: None,
        largest: all.worst(),
        published_largest: None,
        good: share(good, rays.len() as u64),
        published_good: None,
        seen_good: sphere.room.obstacle.map(|_| share(seen_good, seen_rays)),
        published_seen_good: None,
        missed: None,
        time: None,
    }
}

impl Row {
    /// The same beside what was published, with by how much it misses that over what is allowed.
    fn beside(self, published: &Figures) -> Self {
        let degrees = |found: f64, published: f64| (found - published).abs() / f64::max(0.2 * published, 0.03);
        let of_degrees = [
            (Some(self.mean), published.mean),
            (self.seen, published.seen),
            (Some(self.high), published.high),
            (Some(self.largest), published.largest),
        ];
        let of_shares = [(Some(self.good), published.good), (self.seen_good, published.seen_good)];
        let of_degrees = of_degrees
            .into_iter()
            .filter_map(|(found, published)| Some(degrees(found?, published?)));
        let of_shares = of_shares
            .into_iter()
            .filter_map(|(found, published)| Some((found? - published?).abs()));
        Self {
            published: published.mean,
            published_seen: published.seen,
            published_high: published.high,
            published_largest: published.largest,
            published_good: published.good,
            published_seen_good: published.seen_good,
            missed: of_degrees.chain(of_shares).reduce(f64::max),
            ..self
        }
    }
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
        let way = name(&search.settings, search.layers);
        rows.push(Row {
            time: Some(time.into()),
            ..row(sphere, map.to_string(), way, &rays, &directions).beside(&search.figures)
        });
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
    let times = context.in_turns(TIMED_TURNS, look_ups.len(), |i| {
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

/// What needs no distances, looked up on the device: shapes in place of the room, and several maps.
fn without_distances(gpu: &Gpu, map: Parametrization, side: u32, texels: f64) -> Result<(Vec<Row>, Vec<Proxied>)> {
    let (mut rows, mut proxied) = (Vec::new(), Vec::new());
    let size = map.size_for(texels);
    // Texels tell their number.
    let image = MapImage::from_fn(map, size, |texel| {
        DVec3::X * f64::from((texel.layer * size.y + texel.y) * size.x + texel.x)
    })?;
    let at_middle = ProxyMaps::new(gpu, &[(DVec3::ZERO, image.clone())])?;
    for (sphere, spheres) in BY_PROXIES {
        let rays = sphere.rays(side, None);
        let mut add = |way: String, published: Figures, shape: ProxyShape| -> Result<()> {
            let hits = at_middle.look_up(&rays, &shape, false)?;
            let directions: Vec<DVec3> = hits.iter().map(|hit| hit.direction).collect();
            let is_same = |hit: &&ProxyHit| {
                let texel = image.nearest(hit.direction);
                texel.is_some_and(|texel| texel.as_dvec3() == hit.radiance)
            };
            proxied.push(Proxied {
                sphere: sphere.name.into(),
                map: map.to_string(),
                way: way.clone(),
                rays: rays.len() as u64,
                same: 100.0 * hits.iter().filter(is_same).count() as f64 / rays.len().max(1) as f64,
            });
            rows.push(row(&sphere, map.to_string(), way, &rays, &directions).beside(&published));
            Ok(())
        };
        let of_box = ProxyShape::Box {
            low: DVec3::NEG_ONE,
            high: DVec3::ONE,
        };
        add(BOX.into(), Figures::NONE, of_box)?;
        for (radius, published) in PROXY_RADII.into_iter().zip(spheres) {
            let way = format!("{SPHERE} {radius} in place of the room");
            add(way, Figures::of_mean(published), ProxyShape::Sphere { radius })?;
        }
        let hemisphere = ProxyShape::Hemisphere {
            up: DVec3::Y,
            radius: 1.2,
        };
        add(
            "hemisphere of radius 1.2 above the ground".into(),
            Figures::NONE,
            hemisphere,
        )?;
    }
    // Each map shows what rays from its own place meet, as the direction of that from the middle.
    let sphere = ShinySphere::B;
    let rays = sphere.rays(side, None);
    let mut maps = Vec::new();
    for place in [DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0)] {
        let image = MapImage::from_fn(map, size, |texel| {
            let direction = map.texel_direction(size, texel).unwrap_or(DVec3::Z);
            (place + sphere.room.hit(place, direction) * direction).normalize()
        })?;
        maps.push((place, image));
    }
    let maps = ProxyMaps::new(gpu, &maps)?;
    for (way, blends) in [("nearest of two maps", false), ("blend of the two nearest maps", true)] {
        let hits = maps.look_up(&rays, &ProxyShape::None, blends)?;
        let directions: Vec<DVec3> = hits.iter().map(|hit| hit.radiance).collect();
        rows.push(row(&sphere, map.to_string(), way.into(), &rays, &directions));
    }
    Ok((rows, proxied))
}

/// Refracted rays of a glass sphere.
fn refracted(gpu: &Gpu, side: u32, texels: f64) -> Result<Vec<Row>> {
    let sphere = ShinySphere::B;
    let rays = sphere.rays(side, Some(GLASS));
    let map = Parametrization::Cube;
    let image = ImpostorImage::from_fn(map, map.size_for(texels), 1, true, |d| sphere.room.surfaces(d))?;
    let impostor = Impostor::new(gpu, &image)?;
    let mut rows = Vec::new();
    for (method, steps, published) in REFRACTED {
        let settings = ImpostorSettings::of(method, steps);
        let hits = impostor.search(&rays, &settings)?;
        let directions: Vec<DVec3> = hits.iter().map(|hit| hit.direction).collect();
        let way = format!("refracted, {}", name(&settings, 1));
        rows.push(row(&sphere, map.to_string(), way, &rays, &directions).beside(&Figures::of_mean(published)));
    }
    Ok(rows)
}

/// Shares of hits that the map's place sees.
fn seen(side: u32) -> Vec<Seen> {
    SEEN_SHARES
        .map(|(sphere, published)| {
            let rays = sphere.rays(side, None);
            let seen = rays.iter().filter(|ray| sphere.room.sees_hit(ray)).count();
            Seen {
                sphere: sphere.name.into(),
                rays: rays.len() as u64,
                share: 100.0 * seen as f64 / rays.len().max(1) as f64,
                published,
            }
        })
        .into()
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
        let mut proxied = Vec::new();
        for map in context.first(&maps, 1) {
            let (of_map, texels_of_map) = without_distances(&gpu, *map, side, texels)?;
            rows.extend(of_map);
            proxied.extend(texels_of_map);
        }
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
            let side = context.pick(TIMED_SIDE, side);
            let mut all = timed(context, &gpu, map, room, side, texels)?;
            all.extend(timed(context, &gpu, map, beside, side, texels)?);
            Ok(all)
        };
        let timed_maps = context.first(&maps, 1);
        Ok(Self {
            look_ups: rows,
            seen: seen(side),
            times: context.each(timed_maps, Parametrization::to_string, |map| times(*map))?,
            steps: context.each(timed_maps, Parametrization::to_string, |map| {
                search_times::by_steps(context, &gpu, *map, texels)
            })?,
            texels: context.each(timed_maps, Parametrization::to_string, |map| {
                search_times::by_texels(context, &gpu, *map, texels)
            })?,
            beside: search_times::beside_rays(context, &gpu, timed_maps, texels)?,
            proxied,
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
                 that copies directions. Shapes in place of the room and several maps are looked up on the device as well; of two maps, at the middle and at (0.5, 0, 0), errors are those of what \
                 their nearest texels show, as it is seen from the middle.",
            )
            .and(Findings::of(&self.seen, OF_SEEN))
            .and(Findings::of(&self.times, OF_TIMES))
            .note(
                "Each look-up ends with one fetch of radiance, so that the classical one is that fetch alone. Nearest texels without planes. Published times are those of whole pictures \
                 on a graphics processor of 2004, with all that they have besides; of which of the brackets is not said. One step looks up \
                 two distances before the radiance, three fetches for the classical one's, and what a ray's reading and writing take is shared. Both layouts look up the same, texel by texel, so that a buffer \
                 of its own saves no fetch: what it takes more does not grow with the steps, and without a search, where both fetch the radiance alone, it is nothing. That leaves the radiance behind a search: \
                 beside it, a distance's fetch reads the whole texel, sixteen bytes, and the last steps of a search go about the texel whose radiance comes next, which is in the processor's nearest \
                 cache by then; in a buffer of its own the radiance is met there for the first time. What the split saves on a graphics processor is the bandwidth of its small texture cache, and this \
                 processor's caches hold a map of 6 MiB whole.",
            )
            .and(Findings::of(&self.steps, search_times::OF_STEPS))
            .note(
                "False position half-way to a wall, with planes and without radiance. A driver may unroll loops of few turns, so that what the first steps add is not what later ones do.",
            )
            .and(Findings::of(&self.texels, search_times::OF_TEXELS))
            .note(
                "The hybrid of three steps half-way to a wall. Of a distance and a packed normal each look-up makes the plane: it decodes the direction of the texel's middle, unpacks the \
                 normal, and divides by both. A stored plane is one product of vectors.",
            )
            .and(Findings::of(&self.beside, search_times::OF_BESIDE))
            .note(
                "Rays of a mirror sphere of one metre about the map's place, in turns by the search and by the index that scenes have by default. The map has one layer with planes, found by rays; errors \
                 are angles at its place against closest hits, and rays whose hit it does not see are among them. The hybrid of three steps looks up six distances, and a seventh where the map's \
                 place does not see the ray's point, each with a direction that is encoded and a texel's plane; a closest hit meets few nodes here.",
            )
            .and(Findings::of(&self.proxied, OF_PROXIED))
            .note("Texels tell their number, and the direction is that of the device.");
        if self.look_ups.is_empty() {
            return findings;
        }
        findings.picture(mirrored_rooms::PICTURE, mirrored_rooms::WORDS)
    }
}
