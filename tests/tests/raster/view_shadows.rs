//! Shadow maps of spots and of parallel light: planes alone, the shadow of a square in closed form, and borders as wide as filters.

use std::f32::consts::FRAC_PI_2;

use clerestory::gpu::Gpu;
use clerestory::raster::{ShadowPlace, ViewShadowDesc, ViewShadowMaps};
use clerestory::scene::{LightKind, Material, Scene};
use clerestory::transport::GpuScene;
use clerestory_tests::random::Random;
use clerestory_tests::render::{builtin, floor};
use clerestory_tests::with_gpu;
use glam::Vec3;

const SIDE: u32 = 256;
/// Half of the floor's side, m.
const HALF: f32 = 3.0;

fn parallel(direction: Vec3) -> LightKind {
    LightKind::Directional {
        direction: direction.normalize(),
        irradiance: Vec3::ONE,
    }
}

fn spot(position: Vec3, direction: Vec3, outer: f32) -> LightKind {
    LightKind::Spot {
        position,
        direction: direction.normalize(),
        intensity: Vec3::ONE,
        inner: 0.5 * outer,
        outer,
    }
}

/// A floor, and a square of 1 m as far above its middle if asked for.
fn scene(has_square: bool) -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, HALF, 0.0));
    if has_square {
        scene.place(floor("square", white, 0.5, 1.0));
    }
    scene
}

/// Maps of these lights, drawn.
fn maps(gpu: &Gpu, scene: &GpuScene, lights: &[LightKind]) -> ViewShadowMaps {
    let desc = ViewShadowDesc {
        side: SIDE,
        maps: lights.len() as u32,
    };
    let surfaces = scene.surfaces();
    let maps = ViewShadowMaps::new(gpu, &surfaces, desc).expect("maps");
    let mut recorder = gpu.recorder("maps").expect("recorder");
    maps.record(&mut recorder, &surfaces, lights).expect("drawn");
    recorder.submit().and_then(|work| work.wait()).expect("submitted");
    maps
}

/// Places of the floor, so far from its middle at most along each side.
fn places(seed: u64, count: usize, reach: f32) -> Vec<ShadowPlace> {
    let mut random = Random(seed);
    let place = |_| ShadowPlace {
        position: Vec3::new(reach * random.signed(), 0.0, reach * random.signed()),
        normal: Vec3::Y,
        slack: 1e-6,
    };
    (0..count).map(place).collect()
}

#[test]
fn planes_alone_are_lit() {
    with_gpu(|gpu| {
        let on_device = GpuScene::new(gpu, &scene(false)).expect("scene");
        // From straight down to grazing.
        let tilted = |angle: f32| Vec3::new(angle.sin(), -angle.cos(), 0.3 * angle.sin());
        let lights: Vec<LightKind> = [0.0, 0.3, 0.8, 1.3, 1.5]
            .into_iter()
            .flat_map(|angle| {
                let direction = tilted(angle).normalize();
                let above = -2.0 * direction;
                [parallel(direction), spot(above, direction, 0.6)]
            })
            .collect();
        let maps = maps(gpu, &on_device, &lights);
        let places = places(3, 4000, HALF);
        for (map, light) in (0..).zip(&lights) {
            for width in [0, 1, 3, 5] {
                let shares = maps.look_up(&on_device.surfaces(), (map, light), width, &places);
                let dark = shares.expect("shares").iter().filter(|share| **share < 1.0).count();
                assert_eq!(dark, 0, "{light:?}, width {width}");
            }
        }
    });
}

/// Beyond a texel, and half of the filter, from the border a place is in the shadow or not as the closed form has it.
#[test]
fn shadows_of_a_square_are_closed_forms() {
    with_gpu(|gpu| {
        let on_device = GpuScene::new(gpu, &scene(true)).expect("scene");
        let [lower, upper] = on_device.bounds();
        // Width of a texel on the floor, straight down, and the shadow's middle and half side.
        let beam = (upper - lower).length() / SIDE as f32;
        let of_spot = |outer: f32, height: f32| 2.0 * (1.01 * outer).tan() * height / SIDE as f32;
        let slanted = Vec3::new(0.3, -1.0, 0.1);
        let cases = [
            (parallel(Vec3::NEG_Y), beam, Vec3::ZERO, 0.5),
            (parallel(slanted), 1.2 * beam, Vec3::new(0.3, 0.0, 0.1), 0.5),
            (
                spot(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y, 0.6),
                of_spot(0.6, 3.0),
                Vec3::ZERO,
                0.75,
            ),
            // From aside: the square is twice as large on the floor, about what lies behind its middle.
            (
                spot(Vec3::new(0.4, 2.0, 0.0), Vec3::new(-0.4, -1.0, 0.0), 0.9),
                3.0 * of_spot(0.9, 2.0),
                Vec3::new(-0.4, 0.0, 0.0),
                1.0,
            ),
        ];
        let lights = cases.map(|case| case.0);
        let maps = maps(gpu, &on_device, &lights);
        for (map, (light, texel, middle, half)) in (0..).zip(&cases) {
            let places = places(5, 20_000, 1.3);
            for width in [0, 2, 5] {
                let shares = maps.look_up(&on_device.surfaces(), (map, light), width, &places);
                let margin = texel * (1.0 + 0.5 * width as f32) * std::f32::consts::SQRT_2;
                let mut counts = [0; 2];
                for (place, share) in places.iter().zip(shares.expect("shares")) {
                    let off = (place.position - *middle).abs();
                    let beyond = off.x.max(off.z) - half;
                    if beyond.abs() > margin {
                        let expected = if beyond > 0.0 { 1.0 } else { 0.0 };
                        assert_eq!(share, expected, "{light:?}, width {width}: {place:?}");
                        counts[usize::from(beyond > 0.0)] += 1;
                    }
                }
                assert!(counts.into_iter().all(|count| count > 1000), "{light:?}: {counts:?}");
            }
        }
    });
}

/// Under light straight down the share of a filter is a ramp across the border, as wide as the filter, and at the middles of texels a multiple of one over its texels.
#[test]
fn filtered_borders_are_as_wide_as_the_filter() {
    const STEPS: i32 = 40;
    with_gpu(|gpu| {
        let on_device = GpuScene::new(gpu, &scene(true)).expect("scene");
        let [lower, upper] = on_device.bounds();
        let texel = (upper - lower).length() / SIDE as f32;
        let light = parallel(Vec3::NEG_Y);
        let maps = maps(gpu, &on_device, &[light]);
        let look_up = |width: u32, positions: &[Vec3]| {
            let places: Vec<ShadowPlace> = positions
                .iter()
                .map(|position| ShadowPlace {
                    position: *position,
                    normal: Vec3::Y,
                    slack: 1e-6,
                })
                .collect();
            maps.look_up(&on_device.surfaces(), (0, &light), width, &places)
                .expect("shares")
        };
        for width in [1, 2, 3, 5] {
            // Across the border at x = 0.5, by steps of a texel.
            let across: Vec<f32> = (-8 * STEPS..8 * STEPS)
                .map(|step| 0.5 + (step as f32 + 0.5) / STEPS as f32 * texel)
                .collect();
            let positions: Vec<Vec3> = across.iter().map(|x| Vec3::new(*x, 0.0, 0.1)).collect();
            let shares = look_up(width, &positions);
            assert!(
                shares.windows(2).all(|pair| pair[1] >= pair[0] - 1e-4),
                "{width}: {shares:?}"
            );
            let partly = shares
                .iter()
                .filter(|share| **share > 1e-3 && **share < 1.0 - 1e-3)
                .count();
            let wide = partly as f32 / STEPS as f32;
            assert!((wide - width as f32).abs() < 0.1, "{wide} texels for {width}");
            // As much light as a border half a texel off at most.
            let dark: f32 = shares.iter().map(|share| (1.0 - share) / STEPS as f32).sum();
            assert!((dark - 8.0).abs() <= 0.55, "{dark} texels before the border");
            // Middles of texels, about the middle of the scene.
            let middle = |texel_number: i32| (texel_number as f32 + 0.5) * texel;
            let border = (0.5 / texel) as i32;
            let positions: Vec<Vec3> = (border - 6..border + 6)
                .map(|i| Vec3::new(middle(i), 0.0, middle(3)))
                .collect();
            for share in look_up(width, &positions) {
                // Even filters cover halves of the texels at their rims.
                let parts = (width * width) as f32 * if width % 2 == 0 { 4.0 } else { 1.0 };
                assert!(
                    (share * parts - (share * parts).round()).abs() < 1e-2,
                    "{width}: {share}"
                );
            }
        }
    });
}

#[test]
fn look_ups_are_their_twins() {
    with_gpu(|gpu| {
        let on_device = GpuScene::new(gpu, &builtin("builtin:box-city?n=60")).expect("scene");
        let [lower, upper] = on_device.bounds();
        let at = |x: f32, y: f32, z: f32| lower + Vec3::new(x, y, z) * (upper - lower);
        let lights = [
            parallel(Vec3::new(0.4, -1.0, 0.3)),
            spot(at(0.5, 2.0, 0.5), Vec3::new(0.1, -1.0, 0.0), 0.7),
        ];
        let maps = maps(gpu, &on_device, &lights);
        let mut random = Random(9);
        let places: Vec<ShadowPlace> = (0..6000)
            .map(|_| ShadowPlace {
                position: at(random.unit(), random.unit(), random.unit()),
                normal: random.direction(),
                slack: 1e-6,
            })
            .collect();
        for (map, light) in (0..).zip(&lights) {
            let twin = maps.read(&on_device.surfaces(), (map, light)).expect("a map");
            for width in [0, 1, 3] {
                let found = maps.look_up(&on_device.surfaces(), (map, light), width, &places);
                let found = found.expect("shares");
                let pairs = places.iter().zip(&found);
                let differing = pairs.filter(|(place, share)| {
                    let expected = twin.visibility(width, place);
                    // Weights are differences of places in texels, of 2⁻²⁴ · 256 each.
                    (f64::from(**share) - expected).abs() > 5e-4
                });
                let differing = differing.count();
                println!("{light:?}, width {width}: {differing} differ");
                // The comparisons are those of f32 against f64: different where a distance is within rounding of the threshold.
                assert!(differing <= places.len() / 500, "{light:?} {width}: {differing}");
                let dark = found.iter().filter(|share| **share < 0.5).count();
                assert!(dark > 100 && dark < 5700, "{dark}");
            }
        }
    });
}

#[test]
fn what_one_view_does_not_cover_is_refused() {
    with_gpu(|gpu| {
        let on_device = GpuScene::new(gpu, &scene(true)).expect("scene");
        let surfaces = on_device.surfaces();
        let made = |side, maps| ViewShadowMaps::new(gpu, &surfaces, ViewShadowDesc { side, maps });
        for (side, maps) in [(0, 1), (8, 0), (8, 257)] {
            assert!(made(side, maps).is_err(), "{side} {maps}");
        }
        let maps = made(8, 1).expect("maps");
        let wide = spot(Vec3::Y, Vec3::NEG_Y, 0.99 * FRAC_PI_2);
        let point = LightKind::Point {
            position: Vec3::Y,
            intensity: Vec3::ONE,
        };
        let down = parallel(Vec3::NEG_Y);
        for lights in [&[wide][..], &[point], &[down, down]] {
            let mut recorder = gpu.recorder("refused").expect("recorder");
            assert!(maps.record(&mut recorder, &surfaces, lights).is_err(), "{lights:?}");
        }
        let place = places(1, 1, 1.0);
        assert!(maps.look_up(&surfaces, (1, &down), 0, &place).is_err());
        assert!(maps.look_up(&surfaces, (0, &down), 9, &place).is_err());
        assert!(maps.look_up(&surfaces, (0, &point), 0, &place).is_err());
        // Nothing is in shadow before a map is drawn.
        assert_eq!(maps.look_up(&surfaces, (0, &down), 3, &place).expect("shares"), [1.0]);
        assert!(maps.look_up(&surfaces, (0, &down), 3, &[]).expect("shares").is_empty());
        assert_eq!(maps.bytes(), 8 * 8 * (4 + 4 + 4));
    });
}
