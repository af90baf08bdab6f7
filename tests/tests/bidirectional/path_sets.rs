//! Parts of the light by expressions, against the path tracer's pictures of the same.

use super::media::{cloud, fog_room};
use super::*;
use clerestory::scene::Phase;

fn of(set: &str) -> BidirectionalSettings {
    BidirectionalSettings {
        path_set: set.parse().unwrap_or_else(|error| panic!("{error}")),
        ..settings()
    }
}

/// The room with a lamp, a coated block that both lobes scatter at, and a glass ball.
fn coated_room() -> Scene {
    let mut scene = room();
    scene.name = "coats".into();
    add_lamp(&mut scene, 3.0);
    let coated = scene.add_material(Material {
        specular: 1.0,
        roughness: 0.6,
        ..Material::lambert("coated", Vec3::new(0.3, 0.3, 0.6))
    });
    scene.place(cuboid(
        "coated",
        coated,
        Vec3::new(0.2, -0.99, -0.6),
        Vec3::new(0.8, -0.3, -0.1),
    ));
    add_sphere(&mut scene, "glass", DVec3::new(-0.3, -0.6, 0.3));
    scene
}

#[test]
fn expressions_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let coats = coated_room();
        for set in ["LDE|LGE", "LS+DE"] {
            let what = format!("{}, {set}", coats.name);
            passes(gpu, &coats, &of(set), 128).expect_same_as(&what, &traced(gpu, &coats, set, 4096));
        }
        // What coats throw on walls the path tracer has by few and bright samples.
        let set = "L[DG]DGE|LGDE";
        let what = format!("{}, {set}", coats.name);
        passes(gpu, &coats, &of(set), 512).expect_mean_as(&what, &traced(gpu, &coats, set, 16384));
        let mut fog = fog_room(Phase::HenyeyGreenstein { g: 0.6 });
        add_sphere(&mut fog, "glass", DVec3::new(-0.3, -0.6, 0.3));
        for set in ["LVE", "LV+SE|LVS+E", "LS+VE"] {
            let what = format!("{}, {set}", fog.name);
            passes(gpu, &fog, &of(set), 128).expect_same_as(&what, &traced(gpu, &fog, set, 4096));
        }
        // Collisions near walls and lamps.
        let set = "LDVE|LVDE";
        let what = format!("{}, {set}", fog.name);
        passes(gpu, &fog, &of(set), 128).expect_mean_as(&what, &traced(gpu, &fog, set, 4096));
    });
}

/// A grid beside a homogeneous medium: flights whose collisions no path of the set has pass through.
#[test]
fn expressions_in_grids_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let scene = cloud(true);
        let what = format!("{}, LVE|LDVE", scene.name);
        let reference = traced(gpu, &scene, "LVE|LDVE", 1024);
        passes(gpu, &scene, &of("LVE|LDVE"), 128).expect_same_as(&what, &reference);
    });
}

/// By means over the picture: diffuse and glossy reflections, which a vertex has side by side, and those in fog.
#[test]
fn parts_of_the_light_sum_to_the_whole() {
    with_gpu(|gpu| {
        for (scene, whole, parts) in [
            (coated_room(), "bounces=1..3", ["LD.{0,2}E", "L[GS].{0,2}E"]),
            (
                fog_room(Phase::Isotropic),
                "bounces=1..3",
                ["L.{0,2}VE", "L.{0,2}[DGS]E"],
            ),
        ] {
            let all = passes(gpu, &scene, &of(whole), 256);
            let parts = parts.map(|set| passes(gpu, &scene, &of(set), 256));
            for channel in 0..3 {
                let of_all = &all.means[channel];
                let n = of_all.len() as f64;
                let expected = of_all.iter().sum::<f64>() / n;
                let variance = of_all.iter().map(|value| (value - expected).powi(2)).sum::<f64>() / (n * (n - 1.0));
                let sums: Vec<f64> = (parts[0].means[channel].iter().zip(&parts[1].means[channel]))
                    .map(|(a, b)| a + b)
                    .collect();
                let what = format!("{}, channel {channel}", scene.name);
                expect_mean_of(&what, &sums, expected, variance.sqrt(), 0.0);
            }
        }
    });
}
