//! What a narrower form of the wide hierarchy would fetch, counted by the twin: nodes of four children.
//!
//! Software drivers pay for fetches, lane by lane, not for arithmetic: so a form wins where it fetches fewer texels a ray.
//!
//! Counted on a hall, a city of boxes and a sphere flake, camera rays and shadow rays each: nodes of four children in 64 bytes are visited 1.4 to 1.6 times
//! as often as those of eight in 80, and fetch 0.96 to 1.23 times the texels, 1.12 times in the geometric mean, so there is no such form.

use super::collapse::collapse;
use super::{SLOTS, WideBvh, WideSettings};
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
