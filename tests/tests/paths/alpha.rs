//! Alpha through the path tracer, against closed forms.
//!
//! A sample that sees an emitter through black surfaces is all or nothing, so pictures of such scenes are counts of known probability: the
//! mean over the picture is tested by z with the binomial variance, and the scatter among pixels by chi-square, each with a false-alarm
//! rate of 10⁻⁶. Other pictures: the mean by z with the picture's own variance (10⁻⁶ a channel), pixels by the z-test of `film::z_test`.

use clerestory::scene::{AlphaMode, Environment, Filter, Image, LightKind, Material, Mesh, Scene, Texture, Wrap};
use clerestory::techniques::PathTracerSettings;
use clerestory_tests::random::Random;
use clerestory_tests::render::{
    Rendered, builtin, camera_down, floor, floor_from_above, independent, paths, pixel_averages, point_triangle, render,
};
use clerestory_tests::statistics::{FALSE_ALARM, chi_square_p, expect_mean};
use clerestory_tests::with_gpu;
use glam::{Vec2, Vec3, Vec4};
use std::f64::consts::PI;

const SIZE: [u32; 2] = [16, 16];
const SAMPLES: u32 = 256;
const EMISSION: Vec3 = Vec3::new(2.0, 1.0, 0.5);
const FLOOR: Vec3 = Vec3::new(0.75, 0.5, 0.25);

/// A black surface with alpha.
fn black(alpha: f32, alpha_mode: AlphaMode) -> Material {
    Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, alpha),
        alpha_mode,
        ..Material::lambert("black", Vec3::ZERO)
    }
}

/// A black emitter of [`EMISSION`] that fills the picture, seen from above.
fn emitter() -> Scene {
    floor_from_above(clerestory_tests::render::lamp(EMISSION))
}

/// Adds a square facing up.
fn add(scene: &mut Scene, material: Material, half: f32, y: f32) {
    let material = scene.add_material(material);
    scene.place(floor("square", material, half, y));
}

/// Adds a square of 2 m × 2 m, of which the camera sees all, with texture coordinates from 0 to 1 along x and z.
fn add_mapped(scene: &mut Scene, material: Material, y: f32) {
    let material = scene.add_material(material);
    let mut mesh = floor("mapped", material, 1.0, y);
    mesh.uv0 = mesh
        .positions
        .iter()
        .map(|p| Vec2::new(p.x + 1.0, p.z + 1.0) * 0.5)
        .collect();
    scene.place(mesh);
}

/// A texture of alphas (0 to 255), repeated `times` along u and v.
fn alphas(scene: &mut Scene, size: [u32; 2], alphas: &[u8], filter: Filter, times: f32) -> Option<Texture> {
    let image = scene.add_image(Image {
        name: "alphas".into(),
        width: size[0],
        height: size[1],
        texels: alphas.iter().map(|a| [255, 255, 255, *a]).collect(),
    });
    Some(Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter,
        transform: [[times, 0.0, 0.0], [0.0, times, 0.0]],
    })
}

/// Fails unless pixels are means of `SAMPLES` samples that are [`EMISSION`] with probability `share` of that pixel and zero otherwise.
fn expect_shares(what: &str, picture: &Rendered, share: impl Fn(usize) -> f64) {
    let samples = f64::from(SAMPLES);
    let pixels = picture.radiance.len() / 3;
    let (mut mean, mut expected, mut variance, mut statistic) = (0.0, 0.0, 0.0, 0.0);
    for (i, pixel) in picture.radiance.chunks(3).enumerate() {
        let found = f64::from(pixel[0] / EMISSION.x);
        // Channels are the same share of the emission up to the rounding of the film's sums.
        for (value, emission) in pixel.iter().zip(EMISSION.to_array()) {
            let other = f64::from(value / emission);
            assert!(
                (other - found).abs() <= 4.0 * f64::from(f32::EPSILON) * found,
                "{what}, pixel {i}: {pixel:?}"
            );
        }
        let of_one = share(i) * (1.0 - share(i)) / samples;
        mean += found;
        expected += share(i);
        variance += of_one;
        statistic += (found - share(i)).powi(2) / of_one;
    }
    let n = pixels as f64;
    expect_mean(what, mean / n, variance / (n * n), expected / n, 0.0);
    let p = chi_square_p(statistic, pixels);
    let p = 2.0 * p.min(1.0 - p);
    assert!(
        p >= FALSE_ALARM,
        "{what}: chi-square of the pixels {statistic:.1} of {pixels}, p = {p:.3e}"
    );
}

fn expect_all(what: &str, picture: &Rendered, expected: Vec3) {
    for (i, pixel) in picture.radiance.chunks(3).enumerate() {
        assert_eq!(pixel, expected.to_array(), "{what}, pixel {i}");
    }
}

#[test]
fn blended_surfaces_let_the_rest_through() {
    with_gpu(|gpu| {
        for (alpha, count) in [(0.3f32, 1), (0.9, 1), (0.25, 2), (0.5, 4)] {
            let mut scene = emitter();
            for i in 0..count {
                add(&mut scene, black(alpha, AlphaMode::Blend), 2.0, 1.0 + i as f32);
            }
            let picture = render(gpu, &scene, SIZE, SAMPLES, &independent());
            let through = (1.0 - f64::from(alpha)).powi(count);
            expect_shares(&format!("{count} of alpha {alpha}"), &picture, |_| through);
        }
        for (alpha, expected) in [(0.0, EMISSION), (1.0, Vec3::ZERO)] {
            let mut scene = emitter();
            add(&mut scene, black(alpha, AlphaMode::Blend), 2.0, 1.0);
            let picture = render(gpu, &scene, SIZE, 16, &independent());
            expect_all(&format!("alpha {alpha}"), &picture, expected);
        }
    });
}

#[test]
fn other_seeds_and_samplers_keep_the_share() {
    with_gpu(|gpu| {
        let mut scene = emitter();
        add(&mut scene, black(0.4, AlphaMode::Blend), 2.0, 1.0);
        for settings in [
            PathTracerSettings {
                seed: 8,
                ..independent()
            },
            PathTracerSettings::default(),
            PathTracerSettings {
                paths_in_flight: 1000,
                ..independent()
            },
            paths("emitted"),
        ] {
            let picture = render(gpu, &scene, SIZE, SAMPLES, &settings);
            expect_shares(&format!("{settings:?}"), &picture, |_| 1.0 - f64::from(0.4f32));
        }
    });
}

#[test]
fn masks_are_all_or_nothing() {
    with_gpu(|gpu| {
        for with_colors in [false, true] {
            for (alpha, cutoff, there) in [
                (0.5, 0.25, true),
                (0.5, 0.5, true),
                (0.5, 0.500_001, false),
                (0.5, 0.75, false),
                (1.0, 1.0, true),
                (0.0, 0.0, true),
            ] {
                let mut scene = emitter();
                add(&mut scene, black(alpha, AlphaMode::Mask { cutoff }), 2.0, 1.0);
                if with_colors {
                    // White vertex colours, though only of a mesh elsewhere, must not move alpha below an equal cutoff.
                    let place = scene.meshes.len();
                    point_triangle(&mut scene, Material::default(), Vec3::ONE);
                    scene.meshes[place].colors = vec![Vec4::ONE; 3];
                }
                let picture = render(gpu, &scene, SIZE, 64, &independent());
                let what = format!("alpha {alpha}, cutoff {cutoff}, vertex colours {with_colors}");
                expect_all(&what, &picture, if there { Vec3::ZERO } else { EMISSION });
            }
        }
    });
}

#[test]
fn textures_and_vertex_colours_carry_alpha() {
    with_gpu(|gpu| {
        // Each of the 16 × 16 pixels holds 4 × 4 copies of the image.
        const TIMES: f32 = 64.0;
        // What each case lets through, from the share of the plane where the looked-up alpha is at least the cutoff, or its mean.
        let checker = [0, 255, 255, 0];
        let mask = |cutoff| AlphaMode::Mask { cutoff };
        for (what, size, texels, filter, mode, alpha, through) in [
            ("checker", [2, 2], &checker[..], Filter::Nearest, mask(0.5), 1.0, 0.5),
            (
                "one texel of three",
                [3, 1],
                &[255, 0, 0],
                Filter::Nearest,
                mask(0.5),
                1.0,
                2.0 / 3.0,
            ),
            // Bilinear between 0 and 1 across stripes: a triangle wave.
            ("stripes", [2, 1], &[0, 255], Filter::Linear, mask(0.25), 1.0, 0.25),
            (
                "stripes, alpha on top",
                [2, 1],
                &[0, 255],
                Filter::Linear,
                mask(0.25),
                0.5,
                0.5,
            ),
            (
                "blended checker",
                [2, 2],
                &[51, 204, 204, 51],
                Filter::Nearest,
                AlphaMode::Blend,
                1.0,
                0.5,
            ),
            (
                "blended stripes",
                [2, 1],
                &[0, 255],
                Filter::Linear,
                AlphaMode::Blend,
                0.5,
                0.75,
            ),
        ] {
            let mut scene = emitter();
            let mut material = black(alpha, mode);
            material.base_color_texture = alphas(&mut scene, size, texels, filter, TIMES);
            add_mapped(&mut scene, material, 1.0);
            let picture = render(gpu, &scene, SIZE, SAMPLES, &independent());
            expect_shares(what, &picture, |_| through);
        }
        // Vertex alpha from 0 at the left to 1 at the right; its mean over a pixel is that of the middle.
        let mut scene = emitter();
        add_mapped(&mut scene, black(1.0, AlphaMode::Blend), 1.0);
        let ramp: Vec<Vec4> = scene.meshes[1]
            .uv0
            .iter()
            .map(|uv| Vec4::new(1.0, 1.0, 1.0, uv.x))
            .collect();
        scene.meshes[1].colors = ramp;
        let picture = render(gpu, &scene, SIZE, SAMPLES, &independent());
        expect_shares("vertex colours", &picture, |i| 1.0 - (((i % 16) as f64) + 0.5) / 16.0);
    });
}

/// A Lambert floor of 2 m × 2 m in the picture and a light that reaches it only through the wall x = 1.5, which no camera ray meets.
fn shadowed(light: LightKind, walls: &[Material]) -> Scene {
    let mut scene = Scene {
        name: "shadow".into(),
        ..Scene::default()
    };
    add(&mut scene, Material::lambert("floor", FLOOR), 1.25, 0.0);
    for (i, wall) in walls.iter().enumerate() {
        let material = scene.add_material(wall.clone());
        let x = 1.5 + 0.25 * i as f32;
        scene.place(Mesh {
            name: "wall".into(),
            positions: [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
                .map(|[y, z]| Vec3::new(x, y, z))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: Some(material),
            ..Mesh::default()
        });
    }
    scene.add_light("light", light);
    scene.cameras.push(camera_down(1.0, 1.0));
    scene
}

#[test]
fn blended_walls_thin_out_the_light_behind_them() {
    with_gpu(|gpu| {
        let position = Vec3::new(3.0, 2.0, 0.5);
        let intensity = Vec3::splat(8.0);
        let light = LightKind::Point { position, intensity };
        let place = position.as_dvec3();
        let irradiance = pixel_averages(SIZE[0], 1.0, |x, z| {
            let to = place - glam::DVec3::new(x, 0.0, z);
            f64::from(intensity.x) * to.y / to.length().powi(3)
        });
        for (alphas, factor) in [(&[][..], 1.0), (&[0.4f32][..], 0.6), (&[0.25, 0.5][..], 0.375)] {
            let walls: Vec<Material> = alphas.iter().map(|a| black(*a, AlphaMode::Blend)).collect();
            let picture = render(gpu, &shadowed(light, &walls), SIZE, SAMPLES, &independent());
            let expected: Vec<f32> = irradiance
                .iter()
                .flat_map(|e| FLOOR.to_array().map(|rho| (f64::from(rho) * e * factor / PI) as f32))
                .collect();
            picture.expect_values(&format!("walls of alpha {alphas:?}"), &expected);
        }
        // Masked walls: the shadow is whole or none.
        let open = render(
            gpu,
            &shadowed(light, &[black(0.5, AlphaMode::Mask { cutoff: 0.75 })]),
            SIZE,
            16,
            &independent(),
        );
        let bare = render(gpu, &shadowed(light, &[]), SIZE, 16, &independent());
        assert_eq!(open.bits(), bare.bits());
        let shut = render(
            gpu,
            &shadowed(light, &[black(0.5, AlphaMode::Mask { cutoff: 0.5 })]),
            SIZE,
            16,
            &independent(),
        );
        expect_all("shut", &shut, Vec3::ZERO);
    });
}

#[test]
fn blended_surfaces_scatter_in_proportion_to_alpha() {
    with_gpu(|gpu| {
        // Over a black floor in parallel light: alpha · ρ/π · E; the floor below reflects nothing.
        let alpha = 0.35f32;
        let mut scene = Scene {
            name: "scatter".into(),
            ..Scene::default()
        };
        add(&mut scene, Material::lambert("black", Vec3::ZERO), 4.0, 0.0);
        let mut material = Material::lambert("blend", FLOOR);
        material.base_color.w = alpha;
        material.alpha_mode = AlphaMode::Blend;
        add(&mut scene, material, 2.0, 1.0);
        let irradiance = Vec3::splat(3.0);
        let direction = Vec3::NEG_Y;
        scene.add_light("sun", LightKind::Directional { direction, irradiance });
        scene.cameras.push(camera_down(1.0, 10.0));
        let picture = render(gpu, &scene, SIZE, SAMPLES, &independent());
        let expected = FLOOR.to_array().map(|rho| f64::from(alpha) * f64::from(rho) * 3.0 / PI);
        picture.expect_uniform("scatter", expected, 0.0);
    });
}

/// A floor under a lamp of emission `emission` that the camera does not see. Several lamps lie in one place.
fn lamp(roughness: f32, emission: Vec3, alpha_mode: AlphaMode, alpha: f32, count: usize) -> Scene {
    let mut scene = Scene {
        name: "lamp".into(),
        ..Scene::default()
    };
    let mut ground = Material::lambert("floor", FLOOR);
    if roughness < 1.0 {
        ground.metallic = 1.0;
        ground.roughness = roughness;
    }
    add(&mut scene, ground, 2.0, 0.0);
    let material = Material {
        emission,
        ..black(alpha, alpha_mode)
    };
    let material = scene.add_material(material);
    for _ in 0..count {
        scene.place(floor("lamp", material, 0.75, 1.5));
    }
    scene.cameras.push(camera_down(1.0, 1.0));
    scene
}

#[test]
fn blended_lamps_shine_in_proportion_to_alpha() {
    with_gpu(|gpu| {
        let alpha = 0.3f32;
        // A diffuse floor finds the lamp mostly by light sampling, a glossy one mostly by its own directions.
        for roughness in [1.0, 0.45, 0.2] {
            for set in ["all", "direct", "bounces=0..1"] {
                let settings = paths(set);
                let blend = lamp(roughness, EMISSION, AlphaMode::Blend, alpha, 1);
                let dimmed = lamp(roughness, EMISSION * alpha, AlphaMode::Opaque, 1.0, 1);
                let blend = render(gpu, &blend, SIZE, SAMPLES, &settings);
                let other = PathTracerSettings { seed: 99, ..settings };
                let dimmed = render(gpu, &dimmed, SIZE, SAMPLES, &other);
                assert!(dimmed.mean()[0].0 > 0.01);
                let what = format!("roughness {roughness}, {set}");
                blend.expect_same_as(&what, &dimmed.radiance, &dimmed.variance);
            }
        }
    });
}

#[test]
fn masked_lamps_shine_where_they_are() {
    with_gpu(|gpu| {
        // The left half of a lamp, cut by a mask or by its geometry.
        for roughness in [1.0, 0.3] {
            let mut masked = lamp(roughness, EMISSION, AlphaMode::Mask { cutoff: 0.5 }, 1.0, 1);
            let half: Vec<Vec2> = masked.meshes[1]
                .positions
                .iter()
                .map(|p| Vec2::new(p.x / 1.5 + 0.5, 0.5))
                .collect();
            masked.meshes[1].uv0 = half;
            masked.materials[1].base_color_texture = alphas(&mut masked, [2, 1], &[255, 0], Filter::Nearest, 1.0);
            let mut cut = lamp(roughness, EMISSION, AlphaMode::Opaque, 1.0, 1);
            for p in &mut cut.meshes[1].positions {
                p.x = p.x.min(0.0);
            }
            let masked = render(gpu, &masked, SIZE, SAMPLES, &independent());
            let cut = render(gpu, &cut, SIZE, SAMPLES, &paths("all"));
            assert!(cut.mean()[0].0 > 0.01);
            masked.expect_same_as(&format!("roughness {roughness}"), &cut.radiance, &cut.variance);
        }
    });
}

#[test]
fn blended_lamps_in_one_place_add_up() {
    with_gpu(|gpu| {
        let alpha = 0.4f32;
        let share = 1.0 - (1.0 - alpha).powi(2);
        for roughness in [1.0, 0.3] {
            let both = lamp(roughness, EMISSION, AlphaMode::Blend, alpha, 2);
            let dimmed = lamp(roughness, EMISSION * share, AlphaMode::Opaque, 1.0, 1);
            // A quarter of the light comes by rays that two covers let through: means of so many samples are normal.
            let samples = 16 * SAMPLES;
            let both = render(gpu, &both, SIZE, samples, &independent());
            let other = PathTracerSettings {
                seed: 99,
                ..independent()
            };
            let dimmed = render(gpu, &dimmed, SIZE, samples, &other);
            both.expect_same_as(&format!("roughness {roughness}"), &dimmed.radiance, &dimmed.variance);
        }
    });
}

#[test]
fn a_blended_cover_in_the_place_of_an_emitter_hides_its_share() {
    with_gpu(|gpu| {
        // The cover comes first, the emitter lies in the same place.
        let emitter = emitter();
        let mut scene = Scene {
            cameras: emitter.cameras.clone(),
            name: "cover".into(),
            ..Scene::default()
        };
        add(&mut scene, black(0.3, AlphaMode::Blend), 4.0, 0.0);
        add(&mut scene, emitter.materials[0].clone(), 4.0, 0.0);
        let picture = render(gpu, &scene, SIZE, SAMPLES, &independent());
        expect_shares("cover", &picture, |_| 1.0 - f64::from(0.3f32));
    });
}

#[test]
fn quotas_change_no_bit_of_pictures_with_alpha() {
    with_gpu(|gpu| {
        // Large thin triangles through each other: rays cross many that are not there, in traversal and shadow.
        let mut random = Random(5);
        let mut scene = Scene {
            name: "thicket".into(),
            ..Scene::default()
        };
        let mut material = Material::lambert("thin", Vec3::splat(0.5));
        material.base_color.w = 0.05;
        material.alpha_mode = AlphaMode::Blend;
        let material = scene.add_material(material);
        scene.place(Mesh {
            name: "thicket".into(),
            positions: (0..3 * 300).map(|_| random.vector()).collect(),
            triangles: (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material: Some(material),
            ..Mesh::default()
        });
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.cameras = builtin("builtin:white-furnace").cameras;
        let of = |ray_quota, paths_in_flight| {
            let settings = PathTracerSettings {
                ray_quota,
                paths_in_flight,
                ..independent()
            };
            render(gpu, &scene, SIZE, 4, &settings)
        };
        let whole = of(32_768, 0);
        let stopped = of(128, 0);
        assert_eq!(whole.counters.stalls, 0);
        assert!(stopped.counters.stalls > 0, "{:?}", stopped.counters);
        assert_eq!(stopped.bits(), whole.bits());
        assert_eq!(of(128, 300).bits(), whole.bits());
        assert_eq!(stopped.counters.shadow_rays, whole.counters.shadow_rays);
        assert!(whole.mean()[0].0 > 0.0);
    });
}

#[test]
fn opaque_surfaces_are_the_same_in_scenes_with_alpha() {
    with_gpu(|gpu| {
        for address in ["builtin:cornell-box", "builtin:white-furnace?frequency=4&roughness=0.4"] {
            let mut scene = builtin(address);
            // Alpha means nothing to an opaque material.
            let bare = render(gpu, &scene, SIZE, 16, &independent());
            for material in &mut scene.materials {
                material.base_color.w = 0.25;
            }
            let place = scene.meshes[0].positions[0];
            point_triangle(&mut scene, black(0.5, AlphaMode::Blend), place);
            point_triangle(&mut scene, black(0.5, AlphaMode::Mask { cutoff: 0.5 }), place);
            let with_alpha = render(gpu, &scene, SIZE, 16, &independent());
            assert_eq!(bare.bits(), with_alpha.bits(), "{address}");
        }
    });
}
