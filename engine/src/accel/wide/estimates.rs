//! What other forms of the wide hierarchy would fetch, counted by the twin: nodes of four children, and packets of rays that share their nodes.
//!
//! Software drivers pay for fetches, lane by lane, not for arithmetic: so a form wins where it fetches fewer texels a ray.

use super::collapse::collapse;
use super::traverse::{wide_grid, wide_span};
use super::{MAX_DEPTH, SLOTS, WideBvh, WideSettings};
use crate::accel::box_test::BoxTest;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::{Hit, Ray, RayIndex, TraversalCounters, lbvh};
use crate::gpu::shaders::constants;
use crate::scene::{self, Projection, Scene};
use glam::{DVec3, Vec3};

const SCENES: [&str; 3] = [
    "builtin:conference",
    "builtin:box-city?n=2000",
    "builtin:sphere-flake?depth=2&frequency=4",
];

/// Pixels along a side of the picture whose rays are counted.
const SIZE: u32 = 128;

/// Rays that share their nodes: a subgroup of software drivers.
const PACKET: usize = 8;

/// Texels of a node of four children: frame and words as in wide nodes, and six planes of four bytes each, behind one another.
const TEXELS_OF_FOUR: u64 = 4;

fn triangles_of(scene: &Scene) -> Vec<[Vec3; 3]> {
    let of_instance = |instance: &scene::Instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let corner = |i: u32| mesh.positions[i as usize].as_dvec3();
        let place = |i: u32| instance.transform.transform_point3(corner(i)).as_vec3();
        mesh.triangles.iter().map(|t| t.map(place)).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of_instance).collect()
}

/// Rays through the pixels, row by row.
fn camera_rays(scene: &Scene) -> Vec<Ray> {
    let camera = &scene.cameras[0];
    let Projection::Perspective { fov_y } = camera.projection else {
        panic!("the cameras of these scenes are in perspective");
    };
    let half = (0.5 * f64::from(fov_y)).tan();
    let to_plane = |i: u32| half * (f64::from(2 * i + 1) / f64::from(SIZE) - 1.0);
    let origin = camera.transform.translation.as_vec3();
    let pixels = (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)));
    let ray = |(x, y)| {
        let direction = DVec3::new(to_plane(x), -to_plane(y), -1.0);
        Ray::new(origin, camera.transform.transform_vector3(direction).as_vec3())
    };
    pixels.map(ray).collect()
}

/// Rays from what camera rays meet to a point high in the scene, in the order of the pixels.
fn shadow_rays(bvh: &WideBvh, rays: &[Ray]) -> Vec<Ray> {
    let bounds = bvh.bounds();
    let light = bounds.lower + (bounds.upper - bounds.lower) * Vec3::new(0.4, 0.95, 0.55);
    let from_hit = |ray: &Ray| {
        let hit = bvh.closest_hit(ray);
        let origin = Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
        hit.is_hit().then(|| Ray {
            t_min: 1e-3,
            t_max: 1.0,
            ..Ray::new(origin, light - origin)
        })
    };
    rays.iter().filter_map(from_hit).collect()
}

fn count(bvh: &WideBvh, rays: &[Ray], any: bool) -> TraversalCounters {
    let mut counters = TraversalCounters::default();
    for ray in rays {
        if any {
            bvh.any_hit_filtered(ray, &mut |_, _| true, &mut counters);
        } else {
            bvh.closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
        }
    }
    counters
}

/// Nodes and triangles that rays visit together: a node or a triangle is fetched once where any of them meets its box.
fn count_packet(bvh: &WideBvh, rays: &[Ray], any: bool) -> TraversalCounters {
    struct One {
        boxes: BoxTest,
        octant: u32,
        shear: RayShear,
        hit: Hit,
    }
    let bounds = bvh.bounds();
    let mut ones: Vec<One> = rays
        .iter()
        .map(|ray| {
            let boxes = BoxTest::new(&bounds, ray);
            One {
                boxes,
                octant: (0..3).fold(0, |octant, axis| octant | u32::from(boxes.inverse[axis] < 0.0) << axis),
                shear: ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction)),
                hit: Hit::none(ray.t_max),
            }
        })
        .collect();
    let mut counters = TraversalCounters::default();
    let mut stack = Vec::with_capacity(SLOTS * MAX_DEPTH as usize);
    stack.push(0u32);
    while let Some(place) = stack.pop() {
        if any && ones.iter().all(|one| one.hit.is_hit()) {
            break;
        }
        counters.nodes += 1;
        let node = &bvh.nodes()[place as usize];
        let mut met = 0u32;
        for (one, ray) in ones.iter().zip(rays).filter(|(one, _)| !any || !one.hit.is_hit()) {
            let grid = wide_grid(&one.boxes, node);
            for slot in 0..SLOTS {
                let (near, far) = wide_span(&grid, node, one.octant, slot);
                met |= u32::from(near.max(ray.t_min) <= far.min(one.hit.t)) << slot;
            }
        }
        for slot in (0..SLOTS).filter(|slot| met >> slot & 1 != 0) {
            let (first, held) = node.leaf(slot);
            for triangle in &bvh.triangles()[first as usize..][..held as usize] {
                counters.triangles += 1;
                for (one, ray) in ones.iter_mut().zip(rays) {
                    if let Some(found) = intersect_triangle(&one.shear, &triangle.corners, ray.t_min, one.hit.t) {
                        (one.hit.t, one.hit.triangle) = (found.t, triangle.index);
                    }
                }
            }
        }
        // The first ray's order.
        let octant = ones[0].octant as usize;
        let slots = (0..SLOTS).rev().map(|place| place ^ octant);
        stack.extend(
            slots
                .filter(|slot| met >> slot & 1 != 0)
                .filter_map(|slot| node.child(slot)),
        );
    }
    counters
}

/// Texels of nodes and of triangles.
fn texels(counters: TraversalCounters, of_node: u64) -> u64 {
    of_node * counters.nodes + u64::from(constants::WIDE_TRIANGLE_TEXELS) * counters.triangles
}

/// A scene's trees of eight and of four children, with camera and shadow rays, and whether any hit ends these.
fn each_scene(mut see: impl FnMut(&str, &[WideBvh; 2], &str, &[Ray], bool)) {
    let settings = WideSettings::default();
    for address in SCENES {
        let scene = scene::load(address).expect("builtin");
        let binary = lbvh::build(&triangles_of(&scene), &settings.binary).expect("valid");
        let trees = [SLOTS, 4].map(|width| collapse(&binary, settings.triangle_cost, width).expect("valid"));
        let rays = camera_rays(&scene);
        see(address, &trees, "camera", &rays, false);
        see(address, &trees, "shadow", &shadow_rays(&trees[0], &rays), true);
    }
}

#[test]
fn nodes_of_four_children_would_fetch_more() {
    each_scene(|address, [eight, four], kind, rays, any| {
        let (of_eight, of_four) = (count(eight, rays, any), count(four, rays, any));
        let fetched = [
            texels(of_eight, constants::WIDE_NODE_TEXELS.into()),
            texels(of_four, TEXELS_OF_FOUR),
        ];
        let each = |count: u64| count as f64 / rays.len() as f64;
        println!(
            "{address}, {kind}: nodes {:.2} and {:.2}, triangles {:.2} and {:.2}, texels {:.1} and {:.1} a ray",
            each(of_eight.nodes),
            each(of_four.nodes),
            each(of_eight.triangles),
            each(of_four.triangles),
            each(fetched[0]),
            each(fetched[1])
        );
        assert!(fetched[1] > fetched[0], "{address}, {kind}: {fetched:?}");
    });
}

#[test]
fn packets_visit_fewer_nodes_than_their_rays() {
    each_scene(|address, [bvh, _], kind, rays, any| {
        let alone = count(bvh, rays, any);
        let mut together = TraversalCounters::default();
        for packet in rays.chunks(PACKET) {
            let counters = count_packet(bvh, packet, any);
            together.nodes += counters.nodes;
            together.triangles += counters.triangles;
        }
        println!(
            "{address}, {kind}: nodes {} of {} (1/{:.2}), triangles {} of {}",
            together.nodes,
            alone.nodes,
            alone.nodes as f64 / together.nodes as f64,
            together.triangles,
            alone.triangles
        );
        assert!(together.nodes < alone.nodes, "{address}, {kind}");
    });
}
