//! Texture look-ups of the shaders against their Rust twins, in the buffers of an uploaded scene: every wrap mode and filter, transforms,
//! both coordinate sets, borders, huge and impossible coordinates.
//!
//! Bounds: where every step of the coordinates is exact in f32, both sides must choose the same texels; elsewhere coordinates may differ
//! by a rounding unit for each operation. Values may differ by some units of filtering and, decoded from sRGB, by what Vulkan's precision
//! rules for pow allow.

use std::collections::BTreeSet;

use clerestory::gpu::Gpu;
use clerestory::scene::texture::{fetch_texel, sample_texture, texel_coordinates, wrap_texel};
use clerestory::scene::{Filter, Image, Material, Scene, Texture, Wrap};
use clerestory::srgb::linear_from_srgb;
use clerestory_tests::random::Random;
use clerestory_tests::render::{camera_down, floor, upload};
use clerestory_tests::shaders::twin_texture as shader;
use clerestory_tests::twin::{Case, Results, U, dispatch};
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3, DVec4};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// Bytes of tested images are below this; the guard images between them are white.
const BRIGHTEST: u8 = 200;
const CASES: usize = 20_000;
/// Values after filtering: three mixes of three operations each.
const FILTER_UNITS: f64 = 9.0;
/// x^2.4 as exp2(2.4 log2 x), x ≥ 0.09: log2 within 2⁻²¹ or 3 ULP of at most 3.5, times 2.4 ln 2, is 40 units; exp2 of at most 8.4 within
/// 3 + 2 · 8.4 ULP is 40; the linear steps before count 2.4-fold.
const SRGB_UNITS: f64 = 90.0;

/// A texture of the scene; its place in the list is the shader's index.
struct Slot {
    texture: Texture,
    srgb: bool,
}

/// A scene whose buffers hold tested images with a white guard image before and after each, and their textures.
struct Tested {
    scene: Scene,
    slots: Vec<Slot>,
}

impl Tested {
    fn new(random: &mut Random) -> Self {
        let mut tested = Self {
            scene: Scene {
                name: "textures".into(),
                ..Scene::default()
            },
            slots: Vec::new(),
        };
        for [width, height] in [[1, 1], [2, 2], [5, 3], [16, 8], [7, 1], [1, 6]] {
            tested.guard();
            let texels = (0..width * height)
                .map(|_| [0; 4].map(|_| random.below(usize::from(BRIGHTEST)) as u8))
                .collect();
            let image = tested.scene.add_image(Image {
                name: format!("{width} × {height}"),
                width,
                height,
                texels,
            });
            for (wrap_u, wrap_v) in WRAPS.iter().flat_map(|u| WRAPS.map(|v| (*u, v))) {
                for filter in [Filter::Linear, Filter::Nearest] {
                    let transforms = [
                        IDENTITY,
                        [[-2.0, 0.0, 0.5], [0.0, 4.0, -0.25]],
                        // A rotation by 0.7 radians with unequal scales.
                        [[1.300_231, -0.386_531, 0.3], [-1.095_17, -0.458_905, -7.1]],
                    ];
                    for transform in transforms {
                        let texture = Texture {
                            image,
                            uv_set: random.below(2) as u32,
                            wrap: [wrap_u, wrap_v],
                            filter,
                            transform,
                        };
                        tested.add(texture, random.below(2) == 0);
                    }
                }
            }
        }
        tested.guard();
        let material = Some(0);
        tested.scene.place(clerestory::scene::Mesh {
            material,
            ..floor("floor", 0, 1.0, 0.0)
        });
        tested.scene.cameras.push(camera_down(1.0, 1.0));
        tested
    }

    fn guard(&mut self) {
        let image = self.scene.add_image(Image {
            name: "guard".into(),
            width: 4,
            height: 4,
            texels: vec![[255; 4]; 16],
        });
        let texture = Texture {
            image,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Nearest,
            transform: IDENTITY,
        };
        self.add(texture, false);
    }

    fn add(&mut self, texture: Texture, srgb: bool) {
        let mut material = Material::default();
        if srgb {
            material.base_color_texture = Some(texture);
        } else {
            material.metallic_roughness_texture = Some(texture);
        }
        self.scene.add_material(material);
        self.slots.push(Slot { texture, srgb });
    }

    fn image(&self, slot: &Slot) -> &Image {
        &self.scene.images[slot.texture.image as usize]
    }

    fn run(&self, gpu: &Gpu, function: u32, cases: &[Case]) -> Vec<Results> {
        let scene = upload(gpu, &self.scene);
        let case_count = cases.len() as u32;
        dispatch::<shader::Kernel>(gpu, &(), cases, &[], |pass, pipeline, [inputs, outputs, table]| {
            let set = shader::Set0 {
                twin_inputs: inputs,
                twin_outputs: outputs,
                twin_table: table,
            };
            let push = shader::Push { function, case_count };
            let groups = [pipeline.groups_for(case_count), 1, 1];
            pass.dispatch(pipeline, &[&set, &scene.scene_set()], &push, groups)
        })
    }
}

fn integer(i: i32) -> f32 {
    f32::from_bits(i as u32)
}

fn value(result: &Results) -> DVec4 {
    DVec4::from_array([0, 1, 2, 3].map(|i| f64::from(result.0[i])))
}

fn units(srgb: bool) -> f64 {
    FILTER_UNITS + if srgb { SRGB_UNITS } else { 0.0 }
}

/// How far an f32 evaluation of one texel coordinate may be from the exact one: not at all where each step is exact in any order.
fn coordinate_error(row: [f32; 3], uv: DVec2, size: u32, linear: bool) -> f64 {
    let [a, b, c] = row.map(f64::from);
    let (x, y) = (a * uv.x, b * uv.y);
    let half = if linear { 0.5 } else { 0.0 };
    let p = (x + y + c) * f64::from(size);
    let limit = f64::from(1u32 << 24);
    let steps = [x, y, x + y, x + c, y + c, x + y + c, p, p.clamp(-limit, limit) - half];
    if steps.iter().all(|s| f64::from(*s as f32) == *s) {
        return 0.0;
    }
    5.0 * U * (x.abs() + y.abs() + c.abs()) * f64::from(size) + U * (p.abs().min(limit) + half)
}

/// A texture coordinate: inside, on texel borders and centres, far and very far away.
fn coordinate(random: &mut Random) -> f32 {
    match random.below(8) {
        0 => random.choose(&[
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            0.25,
            -0.25,
            2.0,
            1.0 - 1.0 / 16_777_216.0,
            -1e-9,
        ]),
        1 => (random.below(257) as f32 - 128.0) / 32.0,
        2 => (random.below(65) as f32 - 32.0) / 64.0 + random.choose(&[1024.0, -4096.0, 65_536.0, -262_144.0]),
        3 => random.choose(&[1e9, -1e9, 3e38, -3e38, f32::MAX, f32::MIN, 16_777_216.0, -16_777_217.0]),
        4 => random.range(-1000.0, 1000.0),
        _ => random.range(-2.0, 2.0),
    }
}

#[test]
fn look_ups_agree_with_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(41);
        let tested = Tested::new(&mut random);
        let cases: Vec<Case> = (0..CASES)
            .map(|_| {
                let slot = random.below(tested.slots.len());
                let mut numbers = vec![integer(slot as i32)];
                numbers.extend((0..4).map(|_| coordinate(&mut random)));
                Case::new(&numbers)
            })
            .collect();
        let (mut exact, mut worst) = (0, 0.0f64);
        for (case, result) in cases.iter().zip(tested.run(gpu, 0, &cases)) {
            let slot = &tested.slots[case.0[0].to_bits() as usize];
            let (texture, image) = (&slot.texture, tested.image(slot));
            let uvs = [1, 3].map(|i| DVec2::new(f64::from(case.0[i]), f64::from(case.0[i + 1])));
            let uv = uvs[texture.uv_set as usize];
            let linear = texture.filter == Filter::Linear;
            let error = DVec2::new(
                coordinate_error(texture.transform[0], uv, image.width, linear),
                coordinate_error(texture.transform[1], uv, image.height, linear),
            );
            exact += usize::from(error == DVec2::ZERO);
            let (got, bound) = (value(&result), units(slot.srgb) * U);
            let what = format!("{texture:?} of {} at {uv}: {got}", image.name);
            if linear {
                let twin = sample_texture(image, texture, slot.srgb, uvs);
                // Values lie in [0, 1], so a texel's step changes the result by less than 1.
                let allowed = twin * bound + DVec4::splat(error.element_sum() + f64::from(f32::MIN_POSITIVE));
                let share = ((got - twin).abs() / allowed).max_element();
                assert!(share <= 1.0, "{what}, twin {twin}, {share} of the allowed error");
                worst = worst.max(share);
            } else {
                let p = texel_coordinates(image, texture, uvs);
                let places = |p: f64, e: f64| [p - e, p, p + e].map(|p| p.floor() as i32);
                let near = places(p.x, error.x)
                    .into_iter()
                    .flat_map(|x| places(p.y, error.y).map(|y| [x, y]))
                    .collect::<BTreeSet<_>>();
                // Far away neighbours cannot be told apart; what is found has to be in the image.
                let any = error.max_element() >= 0.5;
                let agrees = |twin: DVec4| ((got - twin).abs() - twin * bound).max_element() <= 0.0;
                let found = if any {
                    all_texels(image).any(|place| agrees(fetch_texel(image, texture, slot.srgb, place)))
                } else {
                    near.iter()
                        .any(|place| agrees(fetch_texel(image, texture, slot.srgb, *place)))
                };
                assert!(found, "{what}, allowed error {error}");
            }
        }
        println!("{exact} of {CASES} look-ups are exact; the worst is {worst:.3} of what is allowed");
        assert!(exact * 4 > CASES, "{exact} exact look-ups");
    });
}

fn all_texels(image: &Image) -> impl Iterator<Item = [i32; 2]> {
    let (width, height) = (image.width as i32, image.height as i32);
    (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
}

#[test]
fn texels_at_the_ends_of_the_integers_are_those_of_the_twin() {
    with_gpu(|gpu| {
        let mut random = Random(42);
        let tested = Tested::new(&mut random);
        let ends = [
            i32::MIN,
            i32::MIN + 1,
            i32::MAX,
            i32::MAX - 1,
            -1,
            0,
            1,
            1 << 24,
            -(1 << 24),
        ];
        let mut place = || match random.below(3) {
            0 => random.choose(&ends),
            1 => random.below(64) as i32 - 32,
            _ => random.word() as i32,
        };
        let cases: Vec<Case> = (0..tested.slots.len() * 16)
            .map(|i| Case::new(&[integer((i / 16) as i32), integer(place()), integer(place())]))
            .collect();
        for (case, result) in cases.iter().zip(tested.run(gpu, 1, &cases)) {
            let [index, x, y] = [0, 1, 2].map(|i| case.0[i].to_bits() as i32);
            let slot = &tested.slots[index as usize];
            let twin = fetch_texel(tested.image(slot), &slot.texture, slot.srgb, [x, y]);
            let difference = (value(&result) - twin).abs();
            assert!(
                (difference - twin * (units(slot.srgb) * U)).max_element() <= 0.0,
                "{:?} at {x}, {y}: {} {twin}",
                slot.texture,
                value(&result)
            );
        }
    });
}

#[test]
fn coordinates_that_are_no_numbers_stay_inside_the_image() {
    with_gpu(|gpu| {
        let tested = Tested::new(&mut Random(43));
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.3];
        let cases: Vec<Case> = (0..tested.slots.len())
            .flat_map(|slot| {
                odd.iter()
                    .flat_map(move |u| odd.map(|v| Case::new(&[integer(slot as i32), *u, v, *u, v])))
            })
            .collect();
        for (case, result) in cases.iter().zip(tested.run(gpu, 0, &cases)) {
            let slot = &tested.slots[case.0[0].to_bits() as usize];
            let (image, got) = (tested.image(slot), value(&result));
            if image.name == "guard" {
                continue;
            }
            // White is in the neighbouring images only.
            let most = f64::from(BRIGHTEST) / 255.0 * (1.0 + units(slot.srgb) * U);
            let inside = got.to_array().iter().all(|c| c.is_nan() || (0.0..=most).contains(c));
            let what = format!(
                "{:?} of {} at {}, {}: {got}",
                slot.texture, image.name, case.0[1], case.0[2]
            );
            assert!(inside, "{what}");
            if slot.texture.filter == Filter::Nearest {
                let texels = all_texels(image).map(|place| fetch_texel(image, &slot.texture, slot.srgb, place));
                let found = texels
                    .into_iter()
                    .any(|t| ((got - t).abs() - t * (units(slot.srgb) * U)).max_element() <= 0.0);
                assert!(found, "{what}");
            }
        }
    });
}

#[test]
fn wrap_modes_and_srgb_agree_with_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(44);
        let tested = Tested::new(&mut Random(45));
        let ends = [i32::MIN, i32::MIN + 1, i32::MAX, -1, 0, 1];
        let cases: Vec<Case> = (0..4096)
            .map(|i| {
                let size = random.choose(&[1u32, 2, 3, 7, 64, 65_535]);
                let border = size as i32 * (random.below(9) as i32 - 4) + random.below(3) as i32 - 1;
                let places = [border, random.choose(&ends), random.word() as i32];
                let place = random.choose(&places);
                let byte = (i % 256) as f32 / 255.0;
                let (size, mode) = (f32::from_bits(size), f32::from_bits(i % 3));
                Case::new(&[integer(place), size, mode, byte, random.unit(), 1.0])
            })
            .collect();
        for (case, result) in cases.iter().zip(tested.run(gpu, 2, &cases)) {
            let [place, size, mode] = [0, 1, 2].map(|i| case.0[i].to_bits());
            let twin = wrap_texel(place as i32, size, WRAPS[mode as usize]);
            assert_eq!(result.bits(0), twin, "{} of {size}, {mode}", place as i32);
            let encoded = DVec3::from_array([3, 4, 5].map(|i| f64::from(case.0[i])));
            let twin = encoded.map(linear_from_srgb);
            let difference = (result.vector(1) - twin).abs() - twin * (SRGB_UNITS * U);
            assert!(
                difference.max_element() <= 0.0,
                "{encoded}: {} {twin}",
                result.vector(1)
            );
        }
    });
}
