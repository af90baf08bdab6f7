//! What other forms of the wide hierarchy and of its traversal would fetch, counted by the twin: nodes of four children, and other
//! orders for shadow rays.
//!
//! Software drivers pay for fetches, lane by lane, not for arithmetic: so a form wins where it fetches fewer texels a ray.
//!
//! Counted on a hall, a city of boxes and a sphere flake, camera rays and shadow rays each: nodes of four children in 64 bytes are visited 1.4 to 1.6 times
//! as often as those of eight in 80, and fetch 0.96 to 1.23 times the texels, 1.12 times in the geometric mean, so there is no such form.
//!
//! Rays that any hit ends, to a lamp above, to one amid the scene, to the sun and to the sky: by the area of boxes, the largest first, they fetch 0.84 to 1.53
//! times the texels, 1.05 times in the geometric mean; back to front 0.78 to 1.62 times, 0.99 in the mean. So they take the order of other rays.

use super::collapse::collapse;
use super::traverse::{wide_grid, wide_span};
use super::{SLOTS, WideBvh, WideNode, WideSettings};
use crate::accel::box_test::BoxTest;
use crate::accel::triangle::{intersect_triangle, ray_shear};
use crate::accel::{Ray, RayIndex, TraversalCounters, lbvh};
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

/// Texels of a node of four children: frame and words as in wide nodes, and six planes of four bytes each, behind one another.
const TEXELS_OF_FOUR: u64 = 4;

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

/// Texels of nodes and of triangles.
fn texels(counters: TraversalCounters, of_node: u64) -> u64 {
    of_node * counters.nodes + u64::from(constants::WIDE_TRIANGLE_TEXELS) * counters.triangles
}

/// A scene's trees of eight and of four children, with camera and shadow rays, and whether any hit ends these.
fn each_scene(mut see: impl FnMut(&str, &[WideBvh; 2], &str, &[Ray], bool)) {
    let settings = WideSettings::default();
    for address in SCENES {
        let scene = scene::load(address).expect("builtin");
        let triangles: Vec<_> = scene.triangles().map(|(triangle, _)| triangle).collect();
        let binary = lbvh::build(&triangles, &settings.binary).expect("valid");
        let trees = [SLOTS, 4].map(|width| collapse(&binary, settings.triangle_cost, width).expect("valid"));
        let rays = camera_rays(&scene);
        see(address, &trees, "camera", &rays, false);
        see(address, &trees, "shadow", &shadow_rays(&trees[0], &rays), true);
    }
}

#[test]
fn nodes_of_four_children_would_fetch_more() {
    let mut sums = [0; 2];
    let mut ratios = Vec::new();
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
        sums = [0, 1].map(|form: usize| sums[form] + fetched[form]);
        ratios.push(fetched[1] as f64 / fetched[0] as f64);
    });
    let mean = (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp();
    println!("texels of nodes of four over those of eight: {ratios:.3?}, geometric mean {mean:.3}");
    assert!(sums[1] > sums[0], "{sums:?}, {ratios:?}");
}

/// Orders of children in which a shadow ray may visit a node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Order {
    /// As the kernels do, nearly front to back.
    Octant,
    /// The other way round.
    BackToFront,
    /// By the area of decoded boxes, the largest first.
    Area,
}

/// Surface area of a slot's decoded box, but for a factor that all have.
fn area(node: &WideNode, slot: usize) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let [lower, upper] = node.planes[axis].map(|planes| f32::from(planes[slot]));
        (upper - lower) * node.step(axis)
    });
    x * y + y * z + z * x
}

/// Whether anything is hit, with children in this order, and leaves' triangles tested before.
fn any_hit_in(bvh: &WideBvh, ray: &Ray, order: Order, counters: &mut TraversalCounters) -> bool {
    let boxes = BoxTest::new(&bvh.bounds(), ray);
    let octant = (0..3).fold(0, |octant, axis| octant | u32::from(boxes.inverse[axis] < 0.0) << axis);
    let shear = ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction));
    let mut stack = vec![0u32];
    while let Some(node) = stack.pop() {
        counters.nodes += 1;
        let node = &bvh.nodes()[node as usize];
        let grid = wide_grid(&boxes, node);
        let met = |slot: &usize| {
            let (near, far) = wide_span(&grid, node, octant, *slot);
            near.max(ray.t_min) <= far.min(ray.t_max)
        };
        for (first, count) in (0..SLOTS).filter(met).map(|slot| node.leaf(slot)) {
            for tested in &bvh.triangles()[first as usize..][..count as usize] {
                counters.triangles += 1;
                if intersect_triangle(&shear, &tested.corners, ray.t_min, ray.t_max).is_some() {
                    return true;
                }
            }
        }
        let mut children: Vec<usize> = (0..SLOTS)
            .filter(|slot| node.inner() >> slot & 1 != 0)
            .filter(met)
            .collect();
        match order {
            Order::Octant => children.sort_by_key(|slot| *slot as u32 ^ octant),
            Order::BackToFront => children.sort_by_key(|slot| *slot as u32 ^ octant ^ 7),
            Order::Area => children.sort_by(|a, b| area(node, *b).total_cmp(&area(node, *a))),
        }
        stack.extend(children.iter().rev().map(|slot| {
            let before = node.inner() & ((1 << slot) - 1);
            node.children + before.count_ones()
        }));
    }
    false
}

/// Rays that any hit ends, from what camera rays meet: to a lamp above, to one amid the scene, to the sun, and to all sides as to a sky.
fn rays_to_lights(bvh: &WideBvh, rays: &[Ray]) -> [(&'static str, Vec<Ray>); 4] {
    let bounds = bvh.bounds();
    let at = |share: Vec3| bounds.lower + (bounds.upper - bounds.lower) * share;
    let [above, amid] = [Vec3::new(0.4, 0.95, 0.55), Vec3::new(0.45, 0.3, 0.6)].map(at);
    let places: Vec<Vec3> = rays
        .iter()
        .filter_map(|ray| {
            let hit = bvh.closest_hit(ray);
            hit.is_hit()
                .then(|| Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction))
        })
        .collect();
    let toward = |origin: Vec3, direction: Vec3, t_max: f32| Ray {
        t_min: 1e-3 / direction.length().max(1.0),
        t_max,
        ..Ray::new(origin, direction)
    };
    let to_place = |light: Vec3| places.iter().map(|place| toward(*place, light - *place, 1.0)).collect();
    let sun = Vec3::new(0.5, 0.7, 0.3);
    let to_sky = |(i, place): (usize, &Vec3)| {
        let turn = 2.399_963 * i as f32;
        let up = (i as f32 * 0.618_034).fract();
        let across = (1.0 - up * up).sqrt();
        toward(
            *place,
            Vec3::new(across * turn.cos(), up, across * turn.sin()),
            f32::INFINITY,
        )
    };
    [
        ("lamp above", to_place(above)),
        ("lamp amid", to_place(amid)),
        (
            "sun",
            places.iter().map(|place| toward(*place, sun, f32::INFINITY)).collect(),
        ),
        ("sky", places.iter().enumerate().map(to_sky).collect()),
    ]
}

#[test]
fn no_other_order_has_shadow_rays_fetch_less_by_a_twentieth() {
    let mut logarithms = [Vec::new(), Vec::new()];
    each_scene(|address, [eight, _], _, rays, any| {
        if any {
            return;
        }
        for (kind, rays) in rays_to_lights(eight, rays) {
            let in_order = |order| {
                let mut counters = TraversalCounters::default();
                let hit: Vec<bool> = rays
                    .iter()
                    .map(|ray| any_hit_in(eight, ray, order, &mut counters))
                    .collect();
                (hit, counters)
            };
            let all = [Order::Octant, Order::BackToFront, Order::Area].map(in_order);
            assert!(all.iter().all(|(hit, _)| *hit == all[0].0));
            let fetched = all
                .each_ref()
                .map(|(_, counters)| texels(*counters, constants::WIDE_NODE_TEXELS.into()));
            let hits = all[0].0.iter().filter(|hit| **hit).count();
            let ratios = [1, 2].map(|other: usize| fetched[other] as f64 / fetched[0] as f64);
            println!(
                "{address}, {kind}: {hits} of {} rays are blocked; texels {fetched:?}, {ratios:.3?}",
                rays.len()
            );
            for (all, ratio) in logarithms.iter_mut().zip(ratios) {
                all.push(ratio.ln());
            }
        }
    });
    let mean = |all: &Vec<f64>| (all.iter().sum::<f64>() / all.len() as f64).exp();
    let means = logarithms.each_ref().map(mean);
    println!("texels back to front and by area over those in the order of octants: {means:.3?}");
    assert!(means.iter().all(|mean| *mean > 0.95), "{means:?}");
}
