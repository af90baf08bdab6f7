//! Ray indexes against a search through all triangles, bit for bit, and against Möller and Trumbore's test in f64.

#[path = "../../../engine/src/accel/test_support/awkward.rs"]
mod awkward;

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdSettings, KdTree};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use clerestory::accel::wide::{WideBvh, WideSettings};
use clerestory::accel::yardstick::moller_trumbore;
use clerestory::accel::{Hit, MAX_COORDINATE, Ray, RayIndex};
use glam::{DVec3, Vec3};

use crate::Judgement;
use crate::random::Random;

/// Builds a ray index with default settings.
type Build = fn(&[[Vec3; 3]]) -> Result<Box<dyn RayIndex>>;

/// A kind of ray index, as a subject of the cases.
#[derive(Debug, Clone, Copy)]
pub struct IndexCase {
    /// Its name, as [`IndexKind::name`](clerestory::accel::IndexKind::name) has it.
    pub name: &'static str,
    /// Builds one with default settings.
    pub build: Build,
}

/// Every ray index of the engine; what the device builds is the tree of `lbvh`, which the tests of the builder hold it to.
pub const INDEXES: &[IndexCase] = &[
    IndexCase {
        name: "bvh2",
        build: |triangles| Ok(Box::new(Bvh2::build(triangles, &Bvh2Settings::default())?)),
    },
    IndexCase {
        name: "lbvh",
        build: |triangles| {
            let settings = LbvhSettings {
                quality: BuildQuality::Fast,
                ..LbvhSettings::default()
            };
            Ok(Box::new(lbvh::build(triangles, &settings)?))
        },
    },
    IndexCase {
        name: "lbvh-high",
        build: |triangles| Ok(Box::new(lbvh::build(triangles, &LbvhSettings::default())?)),
    },
    IndexCase {
        name: "kd",
        build: |triangles| Ok(Box::new(KdTree::build(triangles, &KdSettings::default())?)),
    },
    IndexCase {
        name: "wide",
        build: |triangles| Ok(Box::new(WideBvh::build(triangles, &WideSettings::default())?)),
    },
];

/// Rays to trace among triangles.
#[derive(Debug, Clone)]
pub struct RaySet {
    /// What it is, in few words.
    pub what: String,
    /// The triangles.
    pub triangles: Vec<[Vec3; 3]>,
    /// The rays.
    pub rays: Vec<Ray>,
}

/// Whether rays can meet a triangle: in range, and of an area in f64.
fn can_be_met(triangle: &[Vec3; 3]) -> bool {
    let in_range = triangle
        .iter()
        .all(|v| v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all());
    let [a, b, c] = triangle.map(|v| v.as_dvec3());
    in_range && (b - a).cross(c - a) != DVec3::ZERO
}

/// Tries all triangles in order with the kernels' test; of equal distances the first triangle counts.
fn closest_of_all(triangles: &[[Vec3; 3]], ray: &Ray) -> Hit {
    let mut hit = Hit::none(ray.t_max);
    if !ray.is_traceable() {
        return hit;
    }
    let shear = ray_shear(ray.origin.into(), ray.direction.into());
    for (i, triangle) in triangles.iter().enumerate().filter(|(_, t)| can_be_met(t)) {
        if let Some(found) = intersect_triangle(&shear, triangle, ray.t_min, hit.t)
            && (found.t < hit.t || !hit.is_hit())
        {
            hit = Hit {
                t: found.t,
                barycentrics: [found.u, found.v],
                triangle: i as u32,
            };
        }
    }
    hit
}

/// Triangles with edges of up to 1 m at random places within 10 m of the origin, and rays from within 12 m of it, of which every third one is bounded.
pub fn soup_with_rays(seed: u64, triangles: usize, rays: usize) -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    let mut random = Random(seed);
    let triangles = (0..triangles)
        .map(|_| {
            let centre = 10.0 * random.vector();
            [0; 3].map(|_| centre + 0.5 * random.vector())
        })
        .collect();
    let rays = (0..rays)
        .map(|i| {
            let mut ray = Ray::new(
                12.0 * random.vector(),
                random.direction() * random.choose(&[1.0, 1e-3, 1e4]),
            );
            if i % 3 == 0 {
                (ray.t_min, ray.t_max) = (random.range(0.0, 5.0), random.range(3.0, 20.0));
            }
            ray
        })
        .collect();
    (triangles, rays)
}

/// What makes two hits the same to the bit.
pub fn hit_bits(hit: &Hit) -> [u32; 4] {
    let [u, v] = hit.barycentrics;
    [hit.t.to_bits(), u.to_bits(), v.to_bits(), hit.triangle]
}

/// Whether a hit misses something that is clearly nearer in f64, by more than the rounding of the triangle test.
pub fn misses(triangles: &[[Vec3; 3]], ray: &Ray, hit: &Hit) -> bool {
    let direction = Vec3::from(ray.direction);
    let reach = reach(triangles, ray);
    // 44u of the reach is what boxes are grown for (accel/bvh2.rs), in metres; edges that a ray passes within that may go either way.
    let rounding = reach * 64.0 / 16_777_216.0;
    // The same as a ray parameter.
    let slack = rounding / f64::from(direction.abs().max_element());
    let nearest = triangles.iter().filter_map(|triangle| {
        let found = moller_trumbore(ray, triangle)?;
        let [a, b, c] = triangle.map(|v| v.as_dvec3());
        let normal = (b - a).cross(c - a);
        let longest = [b - a, c - b, a - c].map(DVec3::length).into_iter().fold(0.0, f64::max);
        let cosine = normal.normalize().dot(direction.as_dvec3().normalize()).abs();
        // Clear of the edges by the slack, and not so thin or grazing that the plane itself is uncertain.
        let margin = found.u.min(found.v).min(1.0 - found.u - found.v) * normal.length() / longest * cosine;
        // Neither so near to an end of the ray that it may lie beyond.
        let inside = found.t > f64::from(ray.t_min) + 100.0 * slack && found.t < f64::from(ray.t_max) - 100.0 * slack;
        (margin > 4.0 * rounding && cosine > 0.01 && inside).then_some(found.t)
    });
    let nearest = nearest.fold(f64::INFINITY, f64::min);
    nearest.is_finite() && !(hit.is_hit() && f64::from(hit.t) <= nearest + 100.0 * slack)
}

/// Largest component distance from a ray's origin to a vertex.
fn reach(triangles: &[[Vec3; 3]], ray: &Ray) -> f64 {
    let distances = triangles
        .iter()
        .flatten()
        .map(|v| (*v - Vec3::from(ray.origin)).abs().max_element());
    f64::from(distances.filter(|d| d.is_finite()).fold(0.0f32, f32::max))
}

/// Judges an index on sets of rays.
pub(crate) fn judge(kind: &IndexCase, sets: &[RaySet]) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for RaySet { what, triangles, rays } in sets {
        let index = (kind.build)(triangles)?;
        let excluded = index.statistics().excluded_degenerate + index.statistics().excluded_range;
        let unfit = triangles.iter().filter(|triangle| !can_be_met(triangle)).count();
        judgement.holds(
            format!("{what}: {excluded} instead of {unfit} triangles left out"),
            excluded == unfit as u64,
        );
        let (mut differ, mut disagree, mut missed) = (0, 0, 0);
        let mut first = String::new();
        for ray in rays {
            let hit = index.closest_hit(ray);
            differ += usize::from(hit_bits(&hit) != hit_bits(&closest_of_all(triangles, ray)));
            disagree += usize::from(index.any_hit(ray) != hit.is_hit());
            if misses(triangles, ray, &hit) {
                missed += 1;
                first = format!(", the last of them {ray:?} with {hit:?}");
            }
        }
        let count = rays.len();
        judgement.none(
            format!("{what}: of {count} rays other hits than a search finds"),
            differ,
        );
        judgement.none(format!("{what}: of {count} rays with other shadows"), disagree);
        judgement.none(
            format!("{what}: of {count} rays that miss what f64 meets{first}"),
            missed,
        );
    }
    Ok(judgement)
}

/// Rays of every awkward kind about triangles.
pub fn awkward_rays(seed: u64, triangles: &[[Vec3; 3]], count: usize) -> Vec<Ray> {
    let sound: Vec<_> = triangles
        .iter()
        .filter(|triangle| can_be_met(triangle))
        .copied()
        .collect();
    let sound = if sound.is_empty() {
        vec![[Vec3::ZERO, Vec3::X, Vec3::Y]]
    } else {
        sound
    };
    awkward::rays(&mut Random(seed), count, |random| random.choose(&sound))
}
