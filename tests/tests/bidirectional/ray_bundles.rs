//! Ray-bundles: lists against all triangles, furnaces, the path tracer on equal path sets within what the width of texels makes, and equal bits however the work is done.
//!
//! All pixels of a frame have its directions, so that the film's variance says nothing of means over the picture: pictures of several seeds are independent, and means are tested by
//! Student's t over them.
//!
//! What texels cost: a line is off by half a texel at most across, so that ways from a strip by an edge begin beyond it. Of a face of a square of side a, weighted by the cosine, that is 3/4 w / a of
//! all ways for texels of width w: the mean of the shift along one side is w / 4, stretched by the slope of the surface to 3/8 w, and there are two sides.

use std::collections::BTreeMap;

use super::*;
use clerestory::Error;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{AlphaMode, Environment, Mesh};
use clerestory::techniques::ray_bundles::lists::{BundleLists, LIST_MAX, bundle_is_before};
use clerestory::techniques::ray_bundles::{RayBundleSettings, RayBundles};
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::floor;
use glam::DVec2;

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH";
const CHILD_TEST: &str = "ray_bundles::prints_its_hash_when_asked";

/// Pictures of a mean: enough for Student's t to be near to the normal law.
const SEEDS: u32 = 32;

const ALL: &str = "bounces=0..4,lobes=diffuse";
const TWICE: &str = "bounces=2,lobes=diffuse";

fn of(set: &str, raster: u32) -> RayBundleSettings {
    RayBundleSettings {
        raster,
        seed: 5,
        path_set: set.parse().expect("path set"),
        ..RayBundleSettings::default()
    }
}

fn bundles(gpu: &Gpu, scene: &Scene, settings: &RayBundleSettings) -> RayBundles {
    match RayBundles::new(gpu, upload(gpu, scene), &scene.cameras[0], SIZE, settings.clone()) {
        Ok(bundles) => bundles,
        Err(error) => panic!("{}: {error}", scene.name),
    }
}

/// The mean picture of several seeds, the variance of its values, and the means over the pictures of each, by channel.
struct Seeds {
    radiance: Vec<f64>,
    variance: Vec<f64>,
    means: [Vec<f64>; 3],
}

fn seeds(gpu: &Gpu, scene: &Scene, settings: &RayBundleSettings, count: u32, frames: u32) -> Seeds {
    let mut renderer = bundles(gpu, scene, settings);
    let n = f64::from(count);
    let values = 3 * (SIZE[0] * SIZE[1]) as usize;
    let (mut sums, mut squares) = (vec![0.0; values], vec![0.0; values]);
    let mut means = [const { Vec::new() }; 3];
    for seed in 0..count {
        renderer.restart(settings.seed + seed).expect("a seed");
        let [radiance, _] = advance(&mut renderer, frames);
        for (i, value) in radiance.iter().enumerate() {
            sums[i] += f64::from(*value);
            squares[i] += f64::from(*value).powi(2);
        }
        for (channel, means) in means.iter_mut().enumerate() {
            means.push(mean(&radiance, channel));
        }
    }
    let variance = |(sum, squares): (&f64, &f64)| ((squares - sum * sum / n) / (n * (n - 1.0))).max(0.0);
    Seeds {
        variance: sums.iter().zip(&squares).map(variance).collect(),
        radiance: sums.iter().map(|sum| sum / n).collect(),
        means,
    }
}

/// Width of a bundle's texels in a scene of these bounds, metres.
fn texel(lists: &BundleLists) -> f64 {
    2.0 * f64::from(lists.view.axes()[0].length()) / f64::from(lists.side)
}

/// How far inside a triangle a place lies, in the unit of places; below 0 outside of it. None for a triangle without area.
fn depth_inside(place: DVec2, corners: [DVec2; 3]) -> Option<f64> {
    let [a, b, c] = corners;
    let side = (b - a).perp_dot(c - a).signum();
    let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let along = to - from;
        side * along.perp_dot(place - from) / along.length()
    });
    let least = edges.into_iter().fold(f64::INFINITY, f64::min);
    edges.iter().all(|edge| edge.is_finite()).then_some(least)
}

/// Fails unless the lists hold what the texels' lines meet of all triangles, in order. The rasterizer rounds the places of corners to parts of a texel, so that what lies so near to an
/// edge may be there or not.
fn check_lists(gpu: &Gpu, what: &str, lists: &BundleLists, triangles: &[[Vec3; 3]]) {
    // Across and down, and what the places themselves are rounded by.
    let rounded = 2f64.sqrt() * (-f64::from(gpu.caps().sub_pixel_bits)).exp2() + 1e-3;
    let side = lists.side;
    assert_eq!(lists.starts.len() as u32, side * side + 1, "{what}");
    assert!(lists.starts.windows(2).all(|pair| pair[0] <= pair[1]), "{what}");
    assert_eq!(
        *lists.starts.last().expect("an end") as usize,
        lists.entries.len(),
        "{what}"
    );
    let [right, _, forward] = lists.view.axes();
    let reach = 4.0 * f64::from(right.length());
    let mut may_be_there = BTreeMap::new();
    let mut must_be_there = 0;
    for (number, corners) in (0u32..).zip(triangles) {
        let clip = corners.map(|corner| lists.view.project(corner.as_dvec3()));
        let places = clip.map(|[x, y, ..]| (DVec2::new(x, y) + 1.0) * 0.5 * f64::from(side));
        let lower = places[0].min(places[1]).min(places[2]).floor() - 1.0;
        let upper = places[0].max(places[1]).max(places[2]).ceil() + 1.0;
        assert!(
            lower.min_element() >= -1.0 && upper.max_element() <= f64::from(side) + 1.0,
            "{what}"
        );
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let cosine = normal.dot(forward.as_dvec3());
        for y in lower.y.max(0.0) as u32..(upper.y as u32).min(side) {
            for x in lower.x.max(0.0) as u32..(upper.x as u32).min(side) {
                let middle = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let Some(inside) = depth_inside(middle, places) else {
                    continue;
                };
                let found = lists.list([x, y]).iter().find(|hit| hit.triangle == number);
                if inside > rounded {
                    must_be_there += 1;
                    let hit = found.unwrap_or_else(|| panic!("{what}: {number} is missing at {x}, {y}"));
                    let ray = lists.view.ray(middle.x as f32, middle.y as f32);
                    let from = Vec3::from_array(ray.origin).as_dvec3();
                    let depth = normal.dot(a - from) / cosine;
                    let off = (f64::from(hit.depth) - depth).abs() * cosine.abs();
                    assert!(off < 1e-6 * reach, "{what}: {number} at {x}, {y}: {hit:?}, {depth}");
                    assert!(hit.along == (cosine > 0.0) || cosine.abs() < 1e-5, "{what}: {hit:?}");
                }
                if inside > -rounded {
                    may_be_there.insert((y * side + x, number), ());
                }
            }
        }
    }
    assert!(must_be_there > 300, "{what}: {must_be_there}");
    for texel in 0..side * side {
        let list = lists.list([texel % side, texel / side]);
        assert!(
            list.windows(2).all(|pair| bundle_is_before(&pair[0], &pair[1])),
            "{what}: {list:?}"
        );
        for hit in list {
            // Slivers have no edge that a place is on one side of.
            let [a, b, c] = triangles[hit.triangle as usize];
            let has_area = (b - a).cross(c - a).length() > 0.0;
            assert!(
                !has_area || may_be_there.contains_key(&(texel, hit.triangle)),
                "{what}: {hit:?} at {texel}"
            );
        }
    }
}

/// A floor, and above it a triangle whose corners are one.
fn floor_and_point() -> Scene {
    let mut scene = Scene {
        name: "floor and point".into(),
        ..Scene::default()
    };
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, 1.0, 0.0));
    scene.place(Mesh {
        positions: vec![Vec3::Y; 3],
        triangles: vec![[0, 1, 2]],
        material: Some(white),
        ..Mesh::default()
    });
    scene
        .cameras
        .push(orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 1.0));
    add_point(&mut scene, Vec3::new(0.5, 1.7, 0.2), 2.0);
    scene
}

#[test]
fn lists_are_what_rays_meet_in_order() {
    with_gpu(|gpu| {
        for scene in [
            builtin("builtin:cornell-box"),
            room_with_point(),
            builtin("builtin:triangle-soup?n=300"),
            floor_and_point(),
        ] {
            let mut renderer = bundles(gpu, &scene, &of("bounces=3,lobes=diffuse", 64));
            assert!(renderer.lists().expect("lists").is_none());
            let triangles: Vec<_> = scene.triangles().map(|(corners, _)| corners).collect();
            let (mut entries, mut all) = (0, Vec::new());
            for frame in 1..=2 {
                // The second bundle of a frame is there when the frame is.
                advance(&mut renderer, frame);
                let lists = renderer.lists().expect("lists").expect("a bundle");
                check_lists(gpu, &scene.name, &lists, &triangles);
                entries += lists.entries.len() as u64;
                all.push(lists.view);
            }
            assert_ne!(all[0], all[1]);
            // Exact counts, those of the first bundles of both frames included.
            let counts = renderer.counts();
            assert_eq!((counts.frames, counts.bundles), (2, 4));
            assert!(counts.entries > entries && counts.enlarged >= 1, "{counts:?}");
            let mut one = bundles(gpu, &scene, &of(TWICE, 64));
            advance(&mut one, 1);
            let lists = one.lists().expect("lists").expect("a bundle");
            let longest = lists.starts.windows(2).map(|pair| pair[1] - pair[0]).max();
            let counts = one.counts();
            assert_eq!(counts.entries, lists.entries.len() as u64);
            assert_eq!(counts.longest, u64::from(longest.expect("a list")));
            // Of the next frame there is only what was counted.
            one.step(2).expect("a step");
            assert!(one.lists().expect("lists").is_none());
        }
    });
}

#[test]
fn furnaces_are_uniform_but_for_a_strip_by_their_edges() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-box?rho=0.5&emission=1");
        // What is missing of light that is scattered twice.
        let missing = |raster: u32| {
            let found = seeds(gpu, &scene, &of(TWICE, raster), SEEDS, 16);
            let mut renderer = bundles(gpu, &scene, &of(TWICE, raster));
            advance(&mut renderer, 1);
            let width = texel(&renderer.lists().expect("lists").expect("a bundle"));
            let strip = width / 2.0;
            let expected = 0.25;
            // All of what may leave by the edges, with a third more, on the low side of what is expected: a half of it is passed over, since it is met from behind.
            let bias = expected * strip / 2.0;
            for means in &found.means {
                expect_mean_of("a furnace", means, expected - bias, 0.0, bias);
            }
            for value in &found.radiance {
                let off = value / expected - 1.0;
                // Noise; and an edge through a pixel of a sixth of a metre takes as much of it as a texel and a half are wide.
                assert!(off < 0.1 && off > -0.1 - 1.5 * width, "{raster}: {value}");
            }
            1.0 - found.means[0].iter().sum::<f64>() / f64::from(SEEDS) / expected
        };
        let [coarse, fine] = [32, 128].map(missing);
        println!("missing: {coarse:.4} of 32 texels, {fine:.4} of 128");
        // A quarter, up to noise.
        assert!(coarse > 2.0 * fine && coarse > 0.01, "{coarse} {fine}");
        // All light: 1 + ρ + ρ² + ρ³ + ρ⁴, of which three terms come by bundles, the last by three of them.
        let found = seeds(gpu, &scene, &of(ALL, 64), SEEDS, 8);
        let strip = 3f64.sqrt() / 62.0;
        let expected = 31.0 / 16.0;
        let bias = strip * (0.25 + 2.0 * 0.125 + 3.0 * 0.0625) / 2.0;
        expect_mean_of("all light", &found.means[0], expected - bias, 0.0, bias);
        // A sphere is concave everywhere, by a texel or two in the depth of a texel's width; without what is passed over from behind it would lose a sixth.
        let sphere = builtin("builtin:furnace-sphere?rho=0.5&emission=1");
        let found = seeds(gpu, &sphere, &of(TWICE, 64), SEEDS, 8);
        let expected = 0.25;
        expect_mean_of("a sphere", &found.means[0], expected * 0.98, 0.0, expected * 0.02);
    });
}

/// A closed box with a block in a corner and a point light.
fn room_with_point() -> Scene {
    let mut scene = room();
    scene.name = "room with a point".into();
    add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), 2.0);
    scene
}

/// A floor, a ceiling 2 m above it, and between them a slab that hides one from the other, under a blue sky, with a glossy floor of which the diffuse lobe alone counts.
fn hall() -> Scene {
    let mut scene = Scene {
        name: "hall".into(),
        ..Scene::default()
    };
    let ground = scene.add_material(Material {
        specular: 1.0,
        roughness: 0.5,
        ..Material::lambert("ground", Vec3::new(0.7, 0.5, 0.3))
    });
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    let blue = scene.add_material(Material::lambert("blue", Vec3::new(0.2, 0.4, 0.8)));
    scene.place(floor("floor", ground, 3.0, 0.0));
    scene.place(floor("ceiling", white, 3.0, 2.0));
    scene.place(cuboid(
        "slab",
        blue,
        Vec3::new(-0.4, 0.9, -0.4),
        Vec3::new(0.3, 1.0, 0.4),
    ));
    scene
        .cameras
        .push(orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 1.0));
    add_point(&mut scene, Vec3::new(0.5, 1.7, 0.2), 2.0);
    scene.environment = Some(Environment::uniform(Vec3::new(0.2, 0.3, 0.5)));
    scene
}

#[test]
fn pictures_are_the_path_tracers_but_for_the_width_of_texels() {
    with_gpu(|gpu| {
        for scene in [builtin("builtin:cornell-box"), room_with_point(), hall()] {
            let reference = traced(gpu, &scene, ALL, 2048);
            let found = seeds(gpu, &scene, &of(ALL, 96), SEEDS, 4);
            for (channel, (expected, variance)) in reference.mean().into_iter().enumerate() {
                let what = format!("{}, channel {channel}", scene.name);
                // Texels are as wide as a fiftieth of the rooms, and of their bundles' light 3/4 of that is lost at most; half of all light comes by one or two of these. The hall's texels
                // are wider, but most of its light comes from the sky, and past edges that are far from each other.
                expect_mean_of(&what, &found.means[channel], expected, variance.sqrt(), 0.02 * expected);
            }
            // No pixel is off by more than its strips, a tenth of itself, and noise, of which five standard deviations.
            let scale = reference.mean()[0].0;
            for (i, value) in found.radiance.iter().enumerate() {
                let expected = f64::from(reference.radiance[i]);
                let noise = (found.variance[i] + f64::from(reference.variance[i])).sqrt();
                let off = (value - expected).abs();
                assert!(
                    off < 0.1 * expected + 5.0 * noise + 0.02 * scale,
                    "{}: {i}: {value} {expected}",
                    scene.name
                );
            }
        }
    });
}

#[test]
fn errors_fall_with_the_square_root_of_the_directions() {
    with_gpu(|gpu| {
        let scene = room_with_point();
        let reference = traced(gpu, &scene, TWICE, 4096);
        let settings = RayBundleSettings {
            sampler: SamplerKind::Pcg,
            ..of(TWICE, 96)
        };
        let mut renderer = bundles(gpu, &scene, &settings);
        let mut squares = [0.0; 2];
        const FRAMES: [u32; 2] = [4, 32];
        for seed in 0..36 {
            renderer.restart(seed).expect("a seed");
            for (sum, frames) in squares.iter_mut().zip(FRAMES) {
                let [radiance, _] = advance(&mut renderer, frames);
                let off = radiance.iter().zip(&reference.radiance);
                *sum += off
                    .map(|(found, expected)| f64::from(found - expected).powi(2))
                    .sum::<f64>();
            }
        }
        let slope = 0.5 * (squares[1] / squares[0]).ln() / f64::from(FRAMES[1] / FRAMES[0]).ln();
        println!("slope {slope:.3}");
        // 36 seeds, each of some independent directions: a standard deviation of 0.045, of which three.
        assert!((slope + 0.5).abs() < 0.15, "{slope}");
    });
}

#[test]
fn how_work_is_shared_out_never_shows() {
    with_gpu(|gpu| {
        let scene = room_with_point();
        let base = of(ALL, 48);
        let bits = |radiance: &[f32]| -> Vec<u32> { radiance.iter().map(|value| value.to_bits()).collect() };
        let mut renderer = bundles(gpu, &scene, &base);
        let whole = bits(&advance(&mut renderer, 2)[0]);
        let parted = RayBundleSettings {
            parts: 7,
            ..base.clone()
        };
        let mut parted = bundles(gpu, &scene, &parted);
        assert!(bits(&advance(&mut parted, 2)[0]) == whole);
        let counts = |renderer: &RayBundles| (renderer.counts().entries, renderer.counts().bundles);
        assert_eq!(counts(&parted), counts(&renderer));
        assert!(parted.counts().passes > renderer.counts().passes);
        // Begun anew in the middle of a frame, and with another seed.
        renderer.step(3).expect("a step");
        renderer.set_camera(&scene.cameras[0]).expect("a camera");
        assert!(bits(&advance(&mut renderer, 2)[0]) == whole);
        renderer.restart(6).expect("another seed");
        assert!(bits(&advance(&mut renderer, 2)[0]) != whole);
    });
}

#[test]
fn what_is_not_needed_is_not_recorded() {
    with_gpu(|gpu| {
        let once = |scene: &Scene, set: &str| {
            let mut renderer = bundles(gpu, scene, &of(set, 32));
            advance(&mut renderer, 1);
            let counts = renderer.counts();
            (counts.passes, counts.bundles, renderer.has_surface_light())
        };
        let scene = room_with_point();
        // Eye, shade, film; and for each bundle count, scan, write, sort, hop, shade.
        assert_eq!(once(&scene, "bounces=1,lobes=diffuse"), (3, 0, true));
        assert_eq!(once(&scene, TWICE), (9, 1, true));
        assert_eq!(once(&scene, ALL), (21, 3, true));
        // Nothing that is seen emits.
        assert_eq!(once(&scene, "emitted"), (2, 0, false));
        assert_eq!(once(&room(), ALL), (2, 0, false));
        let lamp = builtin("builtin:furnace-box?rho=0.5&emission=1");
        assert_eq!(once(&lamp, "emitted"), (3, 0, true));
    });
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    with_gpu(|gpu| {
        let mut unlit = hall();
        unlit.materials[0].unlit = true;
        let mut masked = hall();
        masked.materials[0].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        masked.materials[0].base_color.w = 0.4;
        for (scene, word) in [
            (builtin("builtin:fog-box"), "media"),
            (unlit, "unlit"),
            (masked, "let light through"),
            (builtin("builtin:cornell-box?sphere=glass"), "let light through"),
        ] {
            let options = RenderOptions {
                technique: Some("ray-bundles".into()),
                size: SIZE,
                spp: 1,
                ..RenderOptions::default()
            };
            let rendered = Renderer::new(gpu, &scene).and_then(|renderer| renderer.render(&options));
            let Err(error) = rendered else {
                panic!("{} was rendered", scene.name);
            };
            assert!(
                matches!(&error, Error::Unsupported { technique, .. } if technique == "ray-bundles"),
                "{error}"
            );
            assert!(error.to_string().contains(word), "{error}");
        }
        let scene = upload(gpu, &hall());
        let camera = &hall().cameras[0];
        for (settings, word) in [
            (of("all", 32), "path_set"),
            (of(ALL, 15), "raster"),
            (
                RayBundleSettings {
                    skipped: f32::NAN,
                    ..of(ALL, 32)
                },
                "skipped",
            ),
        ] {
            let error = RayBundles::new(gpu, scene.clone(), camera, SIZE, settings).err();
            let text = error.map(|error| error.to_string()).unwrap_or_default();
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(RayBundles::new(gpu, scene, camera, [0, 4], of(ALL, 32)).is_err());
        // Longer lists than the sort takes: sheets upon sheets, which nearly every line goes through.
        let mut sheets = Scene {
            name: "sheets".into(),
            ..Scene::default()
        };
        let matte = sheets.add_material(Material::lambert("matte", Vec3::splat(0.5)));
        let count = LIST_MAX + 1000;
        let at = |number: u32, x: f32, z: f32| Vec3::new(x, number as f32 / count as f32, z);
        sheets.place(Mesh {
            positions: (0..count)
                .flat_map(|number| [at(number, -4.0, -4.0), at(number, 8.0, -4.0), at(number, -4.0, 8.0)])
                .collect(),
            triangles: (0..count).map(|number| [0, 1, 2].map(|i| 3 * number + i)).collect(),
            material: Some(matte),
            ..Mesh::default()
        });
        sheets
            .cameras
            .push(orthographic(DVec3::Y * 2.0, DVec3::ZERO, -DVec3::Z, 1.0));
        add_point(&mut sheets, Vec3::Y * 2.0, 1.0);
        let mut renderer = bundles(gpu, &sheets, &of(TWICE, 16));
        let failed = loop {
            match renderer.step(64) {
                Ok(Some(_)) => {}
                Ok(None) => panic!("all frames were drawn: {:?}", renderer.counts()),
                Err(error) => break error,
            }
        };
        assert!(matches!(failed, Error::Overflow { .. }), "{failed}");
        assert!(failed.to_string().contains("along a line"), "{failed}");
    });
}

#[test]
fn threads_and_widths_of_the_driver_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "2")]);
    for variables in [
        [("LP_NUM_THREADS", "1"), ("LP_NATIVE_VECTOR_WIDTH", "128")],
        [("LP_NUM_THREADS", "2"), ("LP_NATIVE_VECTOR_WIDTH", "512")],
    ] {
        assert_eq!(hash(&variables), truth, "{variables:?}");
    }
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    with_gpu(|gpu| {
        let mut all = Vec::new();
        for scene in [room_with_point(), hall()] {
            let mut renderer = bundles(gpu, &scene, &of(ALL, 64));
            all.extend(advance(&mut renderer, 2)[0].iter().map(|value| value.to_bits()));
            let lists = renderer.lists().expect("lists").expect("a bundle");
            all.extend(&lists.starts);
            all.extend(lists.entries.iter().flat_map(|hit| [hit.depth.to_bits(), hit.triangle]));
        }
        print_hash(all);
    });
}
