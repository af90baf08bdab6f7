//! No ray is lost at the seams of a mesh: on the host and by the kernels, in every index.
//!
//! Rays from inside closed meshes are aimed at edges and vertices that triangles share. Each has to meet something: for the ray/triangle test
//! a zero is inside for all triangles of an edge, and they all see the same sheared vertices. Where a mesh ends there is nothing behind an
//! edge, so rays at outer edges may pass; they are counted by themselves.

use clerestory::accel::lbvh::{LbvhBuilder, LbvhSettings};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::wide::{WideBuilder, WideSettings};
use clerestory::accel::{DeviceTraversal, IndexKind, IndexOnDevice, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::Vec3;
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

/// Rays of a long test, all meshes together, in each index.
const MANY: usize = 10_000_000;
/// Rays that are traced at once in a long test.
const CHUNK: usize = 1 << 18;

/// Two ends of an edge, or a vertex twice.
type Place = [Vec3; 2];

struct Mesh {
    what: &'static str,
    triangles: Vec<[Vec3; 3]>,
    /// Centre and radius of a ball inside, where rays begin; `None` of an open mesh, which they meet from above.
    ball: Option<(Vec3, f32)>,
    /// Edges of two triangles, and vertices that lie on no outer edge.
    seams: Vec<Place>,
    /// Edges of one triangle, and their vertices.
    outer: Vec<Place>,
}

impl Mesh {
    fn new(what: &'static str, triangles: Vec<[Vec3; 3]>, ball: Option<(Vec3, f32)>) -> Self {
        // With one kind of zero.
        let bits = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut edges: BTreeMap<[[u32; 3]; 2], (u32, Place)> = BTreeMap::new();
        for triangle in &triangles {
            for i in 0..3 {
                let ends = [triangle[i], triangle[(i + 1) % 3]];
                let mut key = ends.map(bits);
                key.sort_unstable();
                edges.entry(key).or_insert((0, ends)).0 += 1;
            }
        }
        assert!(
            edges.values().all(|(sides, _)| *sides <= 2),
            "{what}: an edge of three triangles"
        );
        let of = |sides: u32| -> Vec<Place> {
            let some = edges.values().filter(|edge| edge.0 == sides);
            some.map(|(_, ends)| *ends).collect()
        };
        let vertices = |edges: &[Place]| -> BTreeMap<[u32; 3], Place> {
            let ends = edges.iter().flatten();
            ends.map(|end| (bits(*end), [*end; 2])).collect()
        };
        let (mut seams, mut outer) = (of(2), of(1));
        let outer_vertices = vertices(&outer);
        let mut inner_vertices = vertices(&seams);
        inner_vertices.retain(|key, _| !outer_vertices.contains_key(key));
        seams.extend(inner_vertices.into_values());
        outer.extend(outer_vertices.into_values());
        assert_eq!(ball.is_some(), outer.is_empty(), "{what}: closed, or not");
        Self {
            what,
            triangles,
            ball,
            seams,
            outer,
        }
    }

    /// Rays at some of its places.
    fn rays(&self, places: &[Place], count: usize, random: &mut Random) -> Vec<Ray> {
        let mut towards = |i: usize| {
            let [a, b] = random.choose(places);
            let target = a + (b - a) * random.range(0.05, 0.95);
            let Some((centre, radius)) = self.ball else {
                let beside = match i % 4 {
                    0 => Vec3::ZERO,
                    _ => Vec3::new(random.signed(), random.signed(), 0.0),
                };
                let origin = target + beside + 4.0 * Vec3::Z;
                return Ray::new(origin, target - origin);
            };
            let axis = random.below(3);
            // Below the target on an axis, where that is inside.
            let mut beneath = target;
            beneath[axis] = centre[axis];
            let is_inside = (beneath - centre).length() < 0.7 * radius;
            let along = Vec3::AXES[axis] * (target - centre)[axis].signum();
            match i % 4 {
                0 => Ray::new(centre, target - centre),
                1 if is_inside => Ray::new(beneath, along),
                _ => {
                    let origin = centre + 0.5 * radius * random.vector();
                    Ray::new(origin, target - origin)
                }
            }
        };
        (0..count).map(&mut towards).collect()
    }
}

/// A tessellated sphere with shared vertices.
fn sphere(stacks: usize, slices: usize, radius: f32, centre: Vec3) -> Vec<[Vec3; 3]> {
    let point = |i: usize, j: usize| {
        let (theta, phi) = (PI * i as f32 / stacks as f32, TAU * (j % slices) as f32 / slices as f32);
        // Poles are the same point for every slice.
        let sine = if i == 0 || i == stacks { 0.0 } else { theta.sin() };
        centre + radius * Vec3::new(sine * phi.cos(), theta.cos(), sine * phi.sin())
    };
    let mut triangles = Vec::new();
    for i in 0..stacks {
        for j in 0..slices {
            let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
            if i > 0 {
                triangles.push([a, b, c]);
            }
            if i + 1 < stacks {
                triangles.push([a, c, d]);
            }
        }
    }
    triangles
}

/// Both triangles of each cell of a grid.
fn cells(count: usize, at: impl Fn(usize, usize) -> Vec3) -> Vec<[Vec3; 3]> {
    let cell = |k: usize| {
        let (i, j) = (k % count, k / count);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    (0..count * count).flat_map(cell).collect()
}

/// The cube [−1, 1]³ with vertices on a lattice, so that edge values of rays along axes are zero to the bit.
fn cube(count: usize) -> Vec<[Vec3; 3]> {
    let along = |k: usize| 2.0 * k as f32 / count as f32 - 1.0;
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            triangles.extend(cells(count, |i, j| {
                let mut point = Vec3::splat(side);
                point[(axis + 1) % 3] = along(i);
                point[(axis + 2) % 3] = along(j);
                point
            }));
        }
    }
    triangles
}

fn meshes() -> Vec<Mesh> {
    let ball =
        |what, radius: f32, centre: Vec3| Mesh::new(what, sphere(24, 48, radius, centre), Some((centre, 0.9 * radius)));
    let height = |i: usize, j: usize| 0.2 * ((7 * i + 5 * j) % 8) as f32 / 8.0;
    vec![
        ball("sphere", 1.0, Vec3::ZERO),
        ball("sphere of 0.1 mm", 1e-4, Vec3::ZERO),
        ball("sphere of 100 km", 1e5, Vec3::ZERO),
        ball("sphere far from the origin", 100.0, Vec3::new(3e4, -1e5, 777.0)),
        Mesh::new("needles", sphere(3, 300, 1.0, Vec3::ZERO), Some((Vec3::ZERO, 0.8))),
        Mesh::new("cube", cube(8), Some((Vec3::ZERO, 1.0))),
        Mesh::new(
            "open patch",
            cells(12, |i, j| Vec3::new(i as f32, j as f32, height(i, j))),
            None,
        ),
    ]
}

fn kinds() -> impl Iterator<Item = IndexKind> {
    IndexKind::NAMES.iter().map(|name| name.parse().unwrap())
}

/// Rays that meet nothing, on all threads of the host.
fn lost_on_host(index: &dyn RayIndex, rays: &[Ray]) -> usize {
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get());
    let lost = |rays: &[Ray]| rays.iter().filter(|ray| !index.closest_hit(ray).is_hit()).count();
    let part = rays.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let parts: Vec<_> = rays.chunks(part).map(|part| scope.spawn(move || lost(part))).collect();
        parts.into_iter().map(|part| part.join().unwrap()).sum()
    })
}

/// The kernels of both models of execution: closest hits by one ray per thread, any hits by persistent threads, which the driver's structure has not.
fn tracers(gpu: &Gpu, index: &IndexOnDevice) -> [RayTracer; 2] {
    let threads = PersistentThreads {
        groups: 256,
        batch: gpu.caps().subgroup_size,
        fetches: 2,
        subgroups: 1,
    };
    let closest = TraceSettings {
        ray_quota: 500,
        ..TraceSettings::ray_per_thread()
    };
    let any = TraceSettings {
        query: Query::Any,
        execution: match index.traversal {
            DeviceTraversal::Driver => Execution::RayPerThread,
            _ => Execution::Persistent(threads),
        },
        ..closest
    };
    [closest, any].map(|settings| {
        let settings = settings.fitted(gpu.caps(), index.traversal);
        RayTracer::on_device(gpu, index, &settings).unwrap()
    })
}

/// Rays that meet nothing, by kernels.
fn lost_on_device(tracer: &RayTracer, rays: &[Ray]) -> usize {
    let traced = tracer.trace(rays).unwrap();
    assert_eq!(traced.hits.len(), rays.len());
    traced.hits.iter().filter(|hit| !hit.is_hit()).count()
}

/// Traces the rays of all meshes in all indexes of the host, so many at each mesh's seams, in parts.
fn check_host(count: usize, part: usize) {
    let mut random = Random(81);
    for mesh in meshes() {
        let on_host = kinds().filter(|kind| *kind != IndexKind::Driver);
        let indexes: Vec<_> = on_host
            .map(|kind| (kind, kind.build(&mesh.triangles).unwrap()))
            .collect();
        for (kind, index) in &indexes {
            let met = index.statistics().triangles as usize;
            assert_eq!(met, mesh.triangles.len(), "{}, {kind}: left out", mesh.what);
        }
        for first in (0..count).step_by(part) {
            let rays = mesh.rays(&mesh.seams, part.min(count - first), &mut random);
            for (kind, index) in &indexes {
                assert_eq!(
                    lost_on_host(index.as_ref(), &rays),
                    0,
                    "{}, {kind}: lost at seams",
                    mesh.what
                );
            }
        }
        if !mesh.outer.is_empty() {
            let rays = mesh.rays(&mesh.outer, part.min(count), &mut random);
            let past = lost_on_host(indexes[0].1.as_ref(), &rays);
            println!("{}: {past} of {} rays pass outer edges", mesh.what, rays.len());
            assert!(past > 0 && past < rays.len(), "{past}");
        }
    }
}

/// The same by the kernels.
fn check_device(gpu: &Gpu, count: usize, part: usize) {
    let mut random = Random(82);
    // Kept, so that all builds and all traces share their pipelines.
    let _binary = LbvhBuilder::new(gpu, &LbvhSettings::default()).unwrap();
    let _wide = WideBuilder::new(gpu, &WideSettings::default()).unwrap();
    let mut kept = Vec::new();
    for mesh in meshes() {
        let mut all = Vec::new();
        for kind in kinds().filter(|kind| kind.is_offered_by(gpu.caps())) {
            let index = kind.build_for(gpu, &mesh.triangles).unwrap();
            assert_eq!(index.report.host_because, None, "{}, {kind}", mesh.what);
            all.push((kind, tracers(gpu, &index)));
        }
        for first in (0..count).step_by(part) {
            let rays = mesh.rays(&mesh.seams, part.min(count - first), &mut random);
            for (kind, tracers) in &all {
                for tracer in tracers {
                    let what = format!("{}, {kind}, {:?}", mesh.what, tracer.settings().query);
                    assert_eq!(lost_on_device(tracer, &rays), 0, "{what}: lost at seams");
                }
            }
        }
        if !mesh.outer.is_empty() {
            let rays = mesh.rays(&mesh.outer, part.min(count), &mut random);
            let past = lost_on_device(&all[0].1[0], &rays);
            assert!(past > 0 && past < rays.len(), "{past}");
        }
        kept.push(all);
    }
}

#[test]
fn no_ray_is_lost_at_seams_in_any_index() {
    check_host(2000, 2000);
}

#[test]
fn kernels_lose_no_ray_at_seams_in_any_index() {
    with_gpu(|gpu| check_device(gpu, 1024, 1024));
}

#[test]
#[ignore = "ten million rays in each index take minutes"]
fn no_ray_of_ten_million_is_lost_at_seams() {
    check_host(MANY.div_ceil(meshes().len()), CHUNK);
}

#[test]
#[ignore = "ten million rays in each index take minutes"]
fn kernels_lose_no_ray_of_ten_million_at_seams() {
    with_gpu(|gpu| check_device(gpu, MANY.div_ceil(meshes().len()), CHUNK));
}
