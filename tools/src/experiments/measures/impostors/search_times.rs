//! What a ray's search in a distance impostor costs on the device: by its steps, by what a texel holds, and beside a closest hit by the ray index of the same scene.
//!
//! Neither side fetches the radiance of what it finds. Oracle of directions: the closest hits.

use clerestory::accel::trace::{RayTracer, TraceSettings};
use clerestory::accel::{Hit, IndexKind, Ray};
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{
    Impostor, ImpostorHit, ImpostorImage, ImpostorRay, ImpostorSearch, ImpostorSettings, ImpostorTexels, SearchMethod,
};
use clerestory::{Result, scene};
use glam::{DVec3, UVec2, Vec3};

use super::exact_room::mean;
use crate::experiments::findings::{Bound, Criterion, Measured, Repeats, rows};
use crate::experiments::measures::Context;
use crate::geometry;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 440;
const SMOKE_SIDE: u32 = 12;
/// Differences of times are noisier than times.
const TURNS: usize = 9;

const MOST_STEPS: u32 = 64;
/// Steps that are timed.
const STEPS: &[u32] = &[0, 1, 2, 4, 16, MOST_STEPS];
/// Degrees by which directions are apart that rounding does not tell.
const APART: f64 = 0.01;
/// Place of the first of the three that the criterion asks of: drivers may unroll loops of fewer turns.
const FIRST_JUDGED: usize = 3;

const ATRIUM: &str = "builtin:atrium?source=point";
const SMOKE_SCENE: &str = "builtin:box-room?contents=empty&source=point";
/// The map's place as a share of the box about the scene: in the open, and on no plane of symmetry.
const PLACE: DVec3 = DVec3::new(0.43, 0.61, 0.37);
/// Whose rays are followed, about the map's place; metres.
const SPHERE: ShinySphere = ShinySphere {
    radius: 1.0,
    camera: DVec3::new(-4.0, 0.5, -2.0),
    ..ShinySphere::A
};

rows! {
    /// A number of steps.
    struct Steps = "Time of a search by its steps" by [map, steps] {
        map: String = "map",
        steps: u64 = "steps",
        time: Repeats = "time of a ray (ns)",
        added: Option<Repeats> = "what each step added since the row before (ns)",
        before: Option<Repeats> = "the same in that row (ns)",
    }
}
rows! {
    /// A map in both forms.
    struct Texels = "What a texel holds" by [map] {
        map: String = "map",
        planes_bytes: u64 = "planes (bytes)",
        normals_bytes: u64 = "distances and normals (bytes)",
        planes: Repeats = "time of a ray by planes (ns)",
        normals: Repeats = "time of a ray by distances and normals (ns)",
        share: Repeats = "planes over distances and normals",
        apart: f64 = "rays whose directions are more than 0.01° apart (%)",
    }
}
rows! {
    /// A map of a scene.
    struct Beside = "Hybrid of three steps beside closest hits by the ray index" by [scene, map] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        index: String = "ray index",
        map: String = "map",
        rays: u64 = "rays",
        mean: f64 = "mean error (°)",
        good: f64 = "rays below 1° (%)",
        search: Repeats = "time of a ray's search (ns)",
        closest: Repeats = "time of a ray's closest hit (ns)",
        share: Repeats = "search over closest hit",
    }
}

/// Criteria of times by steps.
pub const OF_STEPS: &[Criterion<Steps>] = &[Criterion::each(
    "time is linear in the steps: what a step adds from 16 to 64 over what one adds from 4 to 16",
    Bound::Between(0.75, 1.25),
    |row: &Steps| match (&row.added, &row.before) {
        (Some(added), Some(before)) => added.over(before).measured(),
        _ => Measured::exact(f64::NAN),
    },
)
.among(|row| row.steps == u64::from(MOST_STEPS))];

/// Criteria of what texels hold.
pub const OF_TEXELS: &[Criterion<Texels>] = &[
    Criterion::each(
        "planes cost no more than distances and normals: time over theirs",
        Bound::AtMost(1.0),
        |row: &Texels| (&row.share).into(),
    )
    .because("they take twice the memory"),
    Criterion::each(
        "planes and normals find the same: rays more than 0.01° apart (%)",
        Bound::AtMost(1.0),
        |row: &Texels| row.apart.into(),
    )
    .because("where a ray ends on the border of two texels, rounding chooses"),
];

/// Criteria of searches beside closest hits.
pub const OF_BESIDE: &[Criterion<Beside>] = &[Criterion::each(
    "the hybrid of three steps costs at most a quarter of a closest hit: time over its",
    Bound::AtMost(0.25),
    |row: &Beside| (&row.share).into(),
)];

/// Times of false position by its steps, half-way to a wall of an empty room.
///
/// # Errors
/// Those of the device.
pub fn by_steps(context: &Context<'_>, gpu: &Gpu, map: Parametrization, texels: f64) -> Result<Vec<Steps>> {
    let sphere = ShinySphere::B;
    let rays = sphere.rays(context.pick(SIDE, SMOKE_SIDE), None);
    let image = ImpostorImage::from_fn(map, map.size_for(texels), 1, true, |d| sphere.room.surfaces(d))?;
    let impostor = Impostor::new(gpu, &image)?;
    let steps = context.pick(STEPS, &STEPS[FIRST_JUDGED..]);
    let mut searches = Vec::new();
    for steps in steps {
        let settings = ImpostorSettings::of(SearchMethod::FalsePosition, *steps);
        searches.push(ImpostorSearch::new(gpu, &impostor, &settings)?);
    }
    let times = context.in_turns(TURNS, steps.len(), |i| {
        let (_, seconds) = searches[i].search_timed(&impostor, &rays)?;
        Ok(1e9 * seconds / rays.len().max(1) as f64)
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let added = |i: usize| -> Option<Repeats> {
        let before = i.checked_sub(1)?;
        let more = f64::from(steps[i] - steps[before]);
        let turns = times[i].0.iter().zip(&times[before].0);
        Some(turns.map(|(time, before)| (time - before) / more).collect())
    };
    let row = |(i, time): (usize, &Repeats)| Steps {
        map: map.to_string(),
        steps: steps[i].into(),
        time: time.clone(),
        added: added(i),
        before: i.checked_sub(1).and_then(added),
    };
    Ok(times.iter().enumerate().map(row).collect())
}

/// Times of the hybrid of three steps half-way to a wall of an empty room, by planes in turns with distances and normals.
///
/// # Errors
/// Those of the device.
pub fn by_texels(context: &Context<'_>, gpu: &Gpu, map: Parametrization, texels: f64) -> Result<Vec<Texels>> {
    let sphere = ShinySphere::B;
    let rays = sphere.rays(context.pick(SIDE, SMOKE_SIDE), None);
    let image = ImpostorImage::from_fn(map, map.size_for(texels), 1, true, |d| sphere.room.surfaces(d))?;
    let hybrid = ImpostorSettings::of(SearchMethod::Hybrid, 3);
    let (mut impostors, mut searches, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for holds in [ImpostorTexels::Planes, ImpostorTexels::Normals] {
        let impostor = Impostor::with_texels(gpu, &image, holds)?;
        let search = ImpostorSearch::new(gpu, &impostor, &hybrid)?;
        found.push(search.search_timed(&impostor, &rays)?.0);
        impostors.push(impostor);
        searches.push(search);
    }
    let pairs = found[0].iter().zip(&found[1]);
    let apart = pairs.filter(|(a, b)| a.direction.angle_between(b.direction).to_degrees() > APART);
    let apart = 100.0 * apart.count() as f64 / rays.len().max(1) as f64;
    let times = context.in_turns(TURNS, searches.len(), |i| {
        let (_, seconds) = searches[i].search_timed(&impostors[i], &rays)?;
        Ok(1e9 * seconds / rays.len().max(1) as f64)
    })?;
    let [planes, normals] = [0, 1].map(|i: usize| Repeats(times.get(i).cloned().unwrap_or_default()));
    Ok(vec![Texels {
        map: map.to_string(),
        planes_bytes: impostors[0].bytes(),
        normals_bytes: impostors[1].bytes(),
        share: planes.over(&normals),
        planes,
        normals,
        apart,
    }])
}

/// Times of the hybrid of three steps in turns with those of closest hits of the same rays, in the atrium.
///
/// # Errors
/// Those of the scene and of the device.
pub fn beside_rays(context: &Context<'_>, gpu: &Gpu, maps: &[Parametrization], texels: f64) -> Result<Vec<Beside>> {
    let address = context.pick(ATRIUM, SMOKE_SCENE);
    let triangles = geometry::triangles(&scene::load(address)?);
    let index = IndexKind::default().build_for(gpu, &triangles)?;
    let settings = TraceSettings::ray_per_thread().fitted(gpu.caps(), index.traversal);
    let tracer = RayTracer::on_device(gpu, &index, &settings)?;
    let place = place(&triangles);
    let searched = SPHERE.rays(context.pick(SIDE, SMOKE_SIDE), None);
    let of = |ray: &ImpostorRay| Ray::new((place + ray.origin).as_vec3(), ray.direction.as_vec3());
    let rays: Vec<Ray> = searched.iter().map(of).collect();
    let hits = tracer.trace(&rays)?.hits;
    let hybrid = ImpostorSettings::of(SearchMethod::Hybrid, 3);
    context.each(maps, Parametrization::to_string, |map| {
        let image = captured(&tracer, &triangles, place, *map, map.size_for(texels))?;
        let impostor = Impostor::new(gpu, &image)?;
        let search = ImpostorSearch::new(gpu, &impostor, &hybrid)?;
        let (found, _) = search.search_timed(&impostor, &searched)?;
        let pairs = searched.iter().zip(hits.iter().zip(&found));
        let errors: Vec<f64> = pairs.map(|(ray, (hit, found))| error(ray, hit, found)).collect();
        let times = context.in_turns(TURNS, 2, |contender| {
            let seconds = if contender == 0 {
                search.search_timed(&impostor, &searched)?.1
            } else {
                tracer.trace(&rays)?.seconds()
            };
            Ok(1e9 * seconds / rays.len().max(1) as f64)
        })?;
        let [search, closest] =
            [0, 1].map(|contender: usize| Repeats(times.get(contender).cloned().unwrap_or_default()));
        Ok(vec![Beside {
            scene: address.into(),
            triangles: triangles.len() as u64,
            index: index.report.kind.into(),
            map: map.to_string(),
            rays: rays.len() as u64,
            mean: mean(&errors),
            good: 100.0 * errors.iter().filter(|error| **error < 1.0).count() as f64 / errors.len().max(1) as f64,
            share: search.over(&closest),
            search,
            closest,
        }])
    })
}

/// Where the map is seen from.
fn place(triangles: &[[Vec3; 3]]) -> DVec3 {
    let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [low, high] = triangles
        .iter()
        .flatten()
        .fold(none, |[low, high], p| [low.min(*p), high.max(*p)]);
    low.as_dvec3() + PLACE * (high - low).as_dvec3()
}

/// What a place sees along the middles of a map's texels, by rays.
fn captured(
    tracer: &RayTracer,
    triangles: &[[Vec3; 3]],
    place: DVec3,
    map: Parametrization,
    size: UVec2,
) -> Result<ImpostorImage> {
    let directions: Vec<DVec3> = map
        .texels(size)
        .map(|texel| map.texel_direction(size, texel).unwrap_or(DVec3::Z))
        .collect();
    let rays: Vec<Ray> = directions
        .iter()
        .map(|direction| Ray::new(place.as_vec3(), direction.as_vec3()))
        .collect();
    let hits = tracer.trace(&rays)?.hits;
    let nothing = ImpostorImage::NOTHING;
    let distance = |hit: &Hit| {
        if hit.is_hit() {
            hit.t.clamp(ImpostorImage::LEAST, nothing)
        } else {
            nothing
        }
    };
    let normal = |(hit, direction): (&Hit, &DVec3)| {
        let corners = triangles.get(hit.triangle as usize);
        corners.map_or(-*direction, |corners| {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            (b - a).cross(c - a).normalize_or(-*direction)
        })
    };
    let distances = hits.iter().map(distance).collect();
    let normals: Vec<DVec3> = hits.iter().zip(&directions).map(normal).collect();
    ImpostorImage::new(map, size, 1, distances, Some(&normals))
}

/// Angle at the map's place between what a search found and a ray's closest hit, in degrees; a ray that meets nothing leaves in its own direction.
fn error(ray: &ImpostorRay, hit: &Hit, found: &ImpostorHit) -> f64 {
    let exact = if hit.is_hit() {
        ray.origin + f64::from(hit.t) * ray.direction
    } else {
        ray.direction
    };
    let across = exact.cross(found.direction).length();
    across.atan2(exact.dot(found.direction)).to_degrees()
}
