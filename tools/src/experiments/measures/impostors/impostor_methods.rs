//! Errors of look-ups by every search, in rooms of boxes as cubes and octahedra of equal texels, and what a ray costs.
//!
//! Oracle: exact rays in the same rooms. What was published are errors of exact distances; here they are of texels, on the device.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::impostor::places::blended_maps;
use clerestory::maps::impostor::proxy::{box_proxy, hemisphere_proxy, sphere_proxy};
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{Impostor, ImpostorImage, ImpostorRay, ImpostorSettings, SearchMethod};
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::Errors;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 220;
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
        time: Option<Measured> = "time of a ray on the device (ns)",
        over_classical: Option<Measured> = "time over the classical look-up's",
    }
}
/// What was found.
pub type Found = Vec<Row>;

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
    Criterion::each(
        "one step costs at most twice the classical look-up",
        Bound::AtMost(2.0),
        |row: &Row| row.over_classical.unwrap_or(Measured::exact(f64::NAN)),
    )
    .among(|row| {
        row.way == name(&ImpostorSettings::of(SearchMethod::SecantFromGuess, 0), 1) && row.over_classical.is_some()
    }),
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

fn name(settings: &ImpostorSettings, layers: u32) -> String {
    let ImpostorSettings { method, steps, .. } = settings;
    match layers {
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
    let mut add = |sphere: ShinySphere, method, steps, layers, figures: [Option<f64>; 3]| {
        let [mean, seen, good] = figures;
        all.push(Published {
            sphere,
            settings: ImpostorSettings::of(method, steps),
            layers,
            all: mean,
            seen,
            good,
        });
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
        add(sphere, SecantFromGuess, 10, 1, [None; 3]);
        add(sphere, Hybrid, 3, 1, [None; 3]);
    }
    add(ShinySphere::P2, FalsePosition, 10, 1, [None, Some(69.7), None]);
    add(ShinySphere::P2, Hybrid, 10, 1, [Some(31.1), Some(2.1), None]);
    for (sphere, good) in [(ShinySphere::P1, 98.7), (ShinySphere::P2, 99.1)] {
        add(sphere, March, 64, 1, [None; 3]);
        add(sphere, March, 64, 2, [None; 3]);
        add(sphere, March, 64, 3, [None, None, Some(good)]);
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
        over_classical: None,
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
    let times = context.in_turns(TURNS, all.len(), |i| {
        let (_, seconds) = of(&all[i]).search_timed(&rays, &all[i].settings)?;
        Ok(1e9 * seconds / rays.len().max(1) as f64)
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let classical = all
        .iter()
        .position(|search| search.settings.method == SearchMethod::Classical);
    let mut rows = Vec::new();
    for (search, time) in all.iter().zip(&times) {
        let hits = of(search).search(&rays, &search.settings)?;
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
        found.over_classical = classical.map(|i| (&time.over(&times[i])).into());
        rows.push(found);
    }
    Ok(rows)
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
        rows.extend(without_distances(side)?);
        rows.extend(refracted(&gpu, side, texels)?);
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let one = name(&ImpostorSettings::of(SearchMethod::SecantFromGuess, 0), 1);
        let of_b: Vec<&Row> = self.iter().filter(|row| row.sphere == "B" && row.way == one).collect();
        let worst = of_b.iter().map(|row| row.mean).reduce(f64::max);
        Findings::of(self, CRITERIA)
            .headline("mean error of one step half-way to a wall (°)", worst.map(Measured::exact))
            .note(
                "A, B and C stand in an empty room, the others beside a box or a pillar; +n is the number of steps after the first guess. Distances are \
                 nearest, with the texel's plane. Published means are those of exact distances.",
            )
    }
}
