//! Virtual lights of walks that go on: light of more bounces than two.

use super::*;

/// A closed room, so that much of the light is scattered often, with a glossy metal, seen from near the middle of the floor so that no virtual light is close to what is seen.
fn room() -> Scene {
    let mut scene = furnished();
    scene.name = "room".into();
    let walls = scene.add_material(Material::lambert("walls", Vec3::new(0.8, 0.7, 0.6)));
    let box_of = |low: Vec3, high: Vec3| cuboid("wall", walls, low, high);
    for (low, high) in [
        (Vec3::new(-1.6, 0.0, -1.5), Vec3::new(-1.5, 2.0, 1.5)),
        (Vec3::new(1.5, 0.0, -1.5), Vec3::new(1.6, 2.0, 1.5)),
        (Vec3::new(-1.5, 0.0, -1.6), Vec3::new(1.5, 2.0, -1.5)),
        (Vec3::new(-1.5, 0.0, 1.5), Vec3::new(1.5, 2.0, 1.6)),
    ] {
        scene.place(box_of(low, high));
    }
    scene
}

#[test]
fn further_bounces_are_the_path_tracers() {
    with_gpu(|gpu| {
        let scene = room();
        // Where little light is asked for, few lights a pixel would have heavy tails.
        for (set, placement, interleave, bias, bounces) in [
            (
                "bounces=0..4,lobes=diffuse+glossy",
                Placement::Walks,
                4,
                0.0,
                Some(0..3),
            ),
            ("bounces=3,lobes=diffuse+glossy", Placement::Walks, 1, 0.0, Some(1..2)),
            ("bounces=2..,lobes=diffuse+glossy", Placement::Walks, 1, 0.0, None),
            (
                "bounces=3..4,lobes=diffuse+glossy",
                Placement::Metropolis,
                1,
                0.02,
                Some(1..3),
            ),
        ] {
            let reference = render(gpu, &scene, SIZE, 4096, &paths(set));
            let settings = ManyLightSettings {
                placement,
                interleave,
                pool: 1024,
                ..exact()
            };
            let mut renderer = frames(gpu, &scene, SIZE, &of(set, settings));
            let found = passes_of(&mut renderer, SIZE, 1, 64);
            found.expect_same_as(set, &reference, bias);
            let lights = renderer.lights().expect("lights");
            let found: BTreeSet<u32> = lights.iter().map(|light| light.bounce).collect();
            match bounces {
                Some(bounces) => assert!(found.iter().copied().eq(bounces), "{set}: {found:?}"),
                None => assert!(found.len() > 4, "{set}: {found:?}"),
            }
        }
    });
}

/// Light that a mirror or clear glass has scattered on its way is of another path set, also where it would land on a rough surface behind.
#[test]
fn walks_go_on_by_rough_lobes_alone() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.name = "mirrors".into();
        // Of the slab.
        scene.materials[2] = Material {
            metallic: 1.0,
            roughness: 0.0,
            ..scene.materials[2].clone()
        };
        let glass = scene.add_material(Material {
            transmission: 1.0,
            roughness: 0.0,
            ior: 1.5,
            ..Material::lambert("glass", Vec3::ONE)
        });
        let lower = Vec3::new(0.2, 1.2, -0.6);
        scene.place(cuboid("glass", glass, lower, lower + Vec3::splat(0.4)));
        // A clear coat over what is scattered diffusely: walks go on by the latter.
        scene.materials[0].roughness = 0.0;
        let set = "bounces=3..4,lobes=diffuse+glossy";
        let reference = render(gpu, &scene, SIZE, 4096, &paths(set));
        let settings = ManyLightSettings {
            interleave: 1,
            ..exact()
        };
        let mut renderer = frames(gpu, &scene, SIZE, &of(set, settings));
        let found = passes_of(&mut renderer, SIZE, 1, 64);
        found.expect_same_as(&scene.name, &reference, 0.0);
    });
}

/// Virtual lights lie one bounce behind the other, so that a tile has few bounces in a frame; over as many frames as there are tiles it has had all of them.
#[test]
fn tiles_have_all_bounces_over_as_many_frames() {
    with_gpu(|gpu| {
        let scene = room();
        let set = "bounces=2..3,lobes=diffuse+glossy";
        let brightness = |interleave: u32, count: u32| {
            let settings = ManyLightSettings {
                interleave,
                lights: 256,
                bound: Bound::Geometry,
                ..exact()
            };
            picture(gpu, &scene, SIZE, &of(set, settings), count)
        };
        let all = brightness(1, 64);
        let tiles = brightness(4, 64);
        let by_tile = |radiance: &[f32]| -> Vec<f64> {
            let mut sums = vec![0.0; 16];
            for (pixel, values) in radiance.chunks_exact(3).enumerate() {
                let (x, y) = (pixel % SIZE[0] as usize, pixel / SIZE[0] as usize);
                sums[y % 4 * 4 + x % 4] += values.iter().map(|value| f64::from(*value)).sum::<f64>();
            }
            sums
        };
        let ratios: Vec<f64> = by_tile(&tiles).iter().zip(by_tile(&all)).map(|(a, b)| a / b).collect();
        println!("{ratios:?}");
        // One bounce alone would be off by a third or more.
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.12), "{ratios:?}");
    });
}

/// Frames of more lights than walks, in every form of visibility, whatever a submission holds.
#[test]
fn further_bounces_do_not_depend_on_how_work_is_shared_out() {
    with_gpu(|gpu| {
        let scene = room();
        let set = "bounces=0..5,lobes=diffuse+glossy";
        for visibility in [Visibility::Rays, Visibility::Maps, Visibility::Imperfect] {
            let settings = of(set, of_odd_sizes(visibility, exact()));
            let whole = bits(&picture(gpu, &scene, [13, 7], &settings, 2));
            let few = ManyLightSettings {
                lights_at_once: 3,
                maps_at_once: 7,
                submission_work: 1,
                ..settings
            };
            let mut renderer = frames(gpu, &scene, [13, 7], &few);
            assert!(bits(&advance(&mut renderer, 2)[0]) == whole, "{visibility:?}");
            let counts = renderer.counts();
            assert!(counts.lights > counts.walks.emitted, "{counts:?}");
        }
    });
}
