//! Light of the frame before: noise and steps against closed forms, what was hidden against geometry, and exact counts of what is kept.
//!
//! Virtual lights that are kept make frames without noise, in which a history is all that changes.

use super::kept::{Moving, kept, lit_by, point, seeds, spot};
use super::*;
use clerestory::techniques::instant_radiosity::many_light::Gathering;

/// A history of one confidence, whatever changes.
fn constant(history: f32, settings: ManyLightSettings) -> ManyLightSettings {
    ManyLightSettings {
        history,
        history_position: 0.0,
        history_normal: 0.0,
        history_light: 0.0,
        history_bound: 0.0,
        ..settings
    }
}

/// Kept lights at all pixels, without noise and shadows.
fn even() -> ManyLightSettings {
    ManyLightSettings {
        interleave: 1,
        visibility: Visibility::None,
        ..of(INDIRECT, kept())
    }
}

const LAMP: Vec3 = Vec3::new(0.5, 1.7, 0.2);

/// A frame that begins a picture.
fn next(renderer: &mut ManyLight, camera: &Camera) -> Vec<f32> {
    renderer.set_camera(camera).expect("a camera");
    let [radiance, _] = advance(renderer, 1);
    radiance
}

/// Of frames with independent lights, the deviation is √((1 - c)/(1 + c)) of theirs. Each pixel has a light of its own, and is held against the mean that many lights have: of 160 frames of 256
/// pixels, of which 5 % and 10 % are as good as independent, the ratio has a deviation of 1.5 % at most, so that 5 % are no chance.
#[test]
fn noise_falls_as_the_closed_form_says() {
    const SIZE: [u32; 2] = [16; 2];
    const WARM: u32 = 48;
    const FRAMES: u32 = 160;
    with_gpu(|gpu| {
        let scene = hall();
        let camera = &scene.cameras[0];
        let base = ManyLightSettings {
            lights: 512,
            interleave: 16,
            visibility: Visibility::None,
            ..of(INDIRECT, exact())
        };
        let many = ManyLightSettings {
            lights: 1 << 16,
            interleave: 1,
            ..base.clone()
        };
        let mut many = frames(gpu, &scene, SIZE, &constant(1e-6, many));
        let mut truth = vec![0.0; 3 * 256];
        for _ in 0..4 {
            let radiance = next(&mut many, camera);
            truth
                .iter_mut()
                .zip(radiance)
                .for_each(|(sum, value)| *sum += f64::from(value) / 4.0);
        }
        // Green of all pixels about the truth.
        let squares = |history: f32| -> f64 {
            let mut renderer = frames(gpu, &scene, SIZE, &constant(history, base.clone()));
            let mut sum = 0.0;
            for number in 0..WARM + FRAMES {
                let radiance = next(&mut renderer, camera);
                if number >= WARM {
                    let green = radiance.iter().zip(&truth).skip(1).step_by(3);
                    sum += green
                        .map(|(value, truth)| (f64::from(*value) - truth).powi(2))
                        .sum::<f64>();
                }
            }
            sum
        };
        // As good as no history, with the same lights in each frame.
        let without = squares(1e-6);
        for (c, expected) in [(0.9f32, 0.229), (0.95, 0.160)] {
            let formula = ((1.0 - f64::from(c)) / (1.0 + f64::from(c))).sqrt();
            assert!((formula - expected).abs() < 5e-4, "{formula}");
            let found = (squares(c) / without).sqrt();
            println!("{c}: {found:.4} of the noise, by the formula {formula:.4}");
            assert!(
                (found / formula - 1.0).abs() < 0.05,
                "{c}: {found} instead of {formula}"
            );
        }
    });
}

/// On a film frames with a history are not independent, but where nothing moves but the place within a pixel their mean is the path tracer's, by Student's t over seeds; a hundredth is for light that is
/// looked up at one side of an edge alone.
#[test]
fn means_over_seeds_are_the_path_tracers() {
    with_gpu(|gpu| {
        let scene = hall();
        let reference = traced_set(gpu, &scene, 2048, INDIRECT);
        let settings = constant(0.9, of(INDIRECT, exact()));
        let found = seeds(gpu, &scene, &settings, 6, 48);
        found.expect_same_as("frames with a history", &reference, 0.01);
    });
}

/// A hall with a lamp that turns from its ceiling to a black plate, after which nothing sends light on.
fn with_plate() -> (Scene, [LightKind; 2]) {
    let mut scene = hall();
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    let (lower, upper) = (Vec3::new(1.2, 0.7, -0.6), Vec3::new(1.3, 1.7, 0.6));
    scene.place(cuboid("plate", black, lower, upper));
    let lamps = [Vec3::Y, Vec3::X].map(|direction| spot(Vec3::new(0.8, 1.2, 0.0), direction));
    (lit_by(scene, &lamps[..1]), lamps)
}

/// Without noise a still picture is the frame without a history to the bit; of a step of light 1 - cᵏ are there after k frames, and what comes back frame by frame is blended as
/// I = c I_before + (1 - c) I_now.
#[test]
fn steps_of_light_arrive_as_powers_of_the_confidence() {
    const C: f32 = 0.9;
    with_gpu(|gpu| {
        let (scene, [up, aside]) = with_plate();
        let mut plain = Moving::new(gpu, scene.clone(), [12, 8], even());
        let mut moving = Moving::new(gpu, scene, [12, 8], constant(C, even()));
        let mut frame = |lamp| (plain.frame(lamp).0, moving.frame(lamp).0);
        let (before, _) = frame(up);
        assert!(before.iter().any(|value| *value > 0.0));
        for _ in 0..4 {
            let (now, blended) = frame(up);
            assert!(bits(&now) == bits(&before) && bits(&blended) == bits(&before));
        }
        for k in 1..=24 {
            let (now, blended) = frame(aside);
            assert!(now.iter().all(|value| *value == 0.0), "the plate reflects");
            let left = f64::from(C).powi(k);
            for (value, before) in blended.iter().zip(&before) {
                let expected = left * f64::from(*before);
                assert!(
                    (f64::from(*value) - expected).abs() <= 1e-5 * f64::from(*before),
                    "{k}: {value} instead of {expected}"
                );
            }
        }
        let mut last = frame(aside).1;
        for k in 1..=20 {
            let (now, blended) = frame(up);
            for i in 0..now.len() {
                let expected = C * last[i] + (1.0 - C) * now[i];
                assert!(
                    (blended[i] - expected).abs() <= 1e-5 * before[i],
                    "{k}: {} instead of {expected}",
                    blended[i]
                );
            }
            last = blended;
        }
    });
}

/// Straight down from a place under the ceiling.
fn from_above(x: f64) -> Camera {
    let eye = DVec3::new(x, 1.85, 0.0);
    Camera::look_at("above", eye, eye - DVec3::Y, DVec3::NEG_Z, 1.0)
}

/// What a ray of [`from_above`] meets.
enum Met {
    Floor(DVec3),
    Slab(DVec3),
}

impl Met {
    fn is_slab(&self) -> bool {
        matches!(self, Self::Slab(_))
    }
}

/// The slab of the hall, its top wider by so much, hides a place of the floor from an eye above.
fn slab_hides(eye: DVec3, place: DVec3, wider: f64) -> bool {
    [0.9, 1.0].into_iter().any(|y| {
        let p = place + (eye - place) * (y / eye.y);
        p.x > -0.4 - wider && p.x < 0.3 + wider && p.z.abs() < 0.4 + wider
    })
}

/// Pixels of a camera's picture by where their rays end, which may be anywhere within them.
fn met_by_pixels(side: usize, eye: DVec3) -> Vec<Vec<Met>> {
    let half = 0.5f64.tan();
    let mut all = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let mut met = Vec::new();
            for [a, b] in [
                [0.0, 0.0],
                [0.5, 0.0],
                [1.0, 0.0],
                [0.0, 0.5],
                [0.5, 0.5],
                [1.0, 0.5],
                [0.0, 1.0],
                [0.5, 1.0],
                [1.0, 1.0],
            ] {
                let along = |i: usize, within: f64| (2.0 * (i as f64 + within) / side as f64 - 1.0) * half;
                let way = DVec3::new(along(x, a), -1.0, along(y, b));
                let place = eye + way * eye.y;
                met.push(if slab_hides(eye, place, 0.0) {
                    Met::Slab(eye + way * (eye.y - 1.0))
                } else {
                    Met::Floor(place)
                });
            }
            all.push(met);
        }
    }
    all
}

/// What the slab has hidden before, or the picture's border, has the confidence 0, and what was seen the whole; between them, where it depends on less than a pixel and a half, either is
/// right.
#[test]
fn what_was_hidden_has_no_confidence() {
    const SIDE: usize = 32;
    with_gpu(|gpu| {
        let lamp = point(LAMP);
        let settings = constant(0.9, even());
        let mut moving = Moving::new(gpu, lit_by(hall(), &[lamp]), [SIDE as u32; 2], settings);
        assert!(moving.renderer.confidence().expect("confidence").is_empty());
        let eyes = [-0.1, 0.1].map(|x| DVec3::new(x, 1.85, 0.0));
        moving.scene.cameras[0] = from_above(eyes[0].x);
        moving.frame(lamp);
        assert!(
            moving
                .renderer
                .confidence()
                .expect("confidence")
                .iter()
                .all(|c| *c == 0.0)
        );
        moving.scene.cameras[0] = from_above(eyes[1].x);
        moving.frame(lamp);
        let confidence = moving.renderer.confidence().expect("confidence");
        // A pixel at the slab's height and at the floor's.
        let half = 0.5f64.tan();
        let (near, far) = (2.0 * half * 0.85 / SIDE as f64, 2.0 * half * 1.85 / SIDE as f64);
        let (mut hidden, mut seen) = (0, 0);
        for (met, confidence) in met_by_pixels(SIDE, eyes[1]).iter().zip(&confidence) {
            let of = |wider: f64, border: f64| {
                let outside = move |place: &DVec3| (place.x - eyes[0].x).abs() > half * (eyes[0].y - place.y) + border;
                met.iter().map(move |met| match met {
                    Met::Floor(place) => outside(place) || slab_hides(eyes[0], *place, wider),
                    Met::Slab(place) => outside(place),
                })
            };
            let is_floor = !met.iter().any(Met::is_slab);
            if is_floor && of(-1.5 * near, 1.5 * far).all(|is_hidden| is_hidden) {
                hidden += 1;
                assert_eq!(*confidence, 0.0);
            } else if of(1.5 * near, -1.5 * far).all(|is_hidden| !is_hidden) {
                seen += 1;
                assert!((confidence - 0.9).abs() < 1e-6, "{confidence}");
            }
        }
        println!("{hidden} pixels hidden before, {seen} seen, of {}", SIDE * SIDE);
        assert!(hidden > 40 && seen > 400, "{hidden} {seen}");
    });
}

/// Energy of what differs from the truth over that of the picture, beyond two pixels about the slab's outline.
fn ghosts(side: usize, met: &[Vec<Met>], truth: &[f32], found: &[f32]) -> f64 {
    let is_mixed = |x: usize, y: usize| {
        let met = &met[y * side + x];
        let slab = met.iter().filter(|met| met.is_slab()).count();
        slab > 0 && slab < met.len()
    };
    let around = |i: usize| i.saturating_sub(2)..(i + 3).min(side);
    let (mut ghosts, mut energy, mut counted) = (0.0, 0.0, 0);
    for y in 0..side {
        for x in 0..side {
            if around(y).any(|y| around(x).any(|x| is_mixed(x, y))) {
                continue;
            }
            counted += 1;
            for i in 3 * (y * side + x)..3 * (y * side + x) + 3 {
                ghosts += f64::from(found[i] - truth[i]).powi(2);
                energy += f64::from(truth[i]).powi(2);
            }
        }
    }
    assert!(counted > 300, "{counted}");
    ghosts / energy
}

/// While the camera goes on by about a pixel a frame, what is left of other frames is less than a hundredth of the energy beyond two pixels about the slab's outline.
#[test]
fn ghosts_stay_near_what_was_hidden() {
    const SIDE: usize = 32;
    with_gpu(|gpu| {
        let lamp = point(LAMP);
        let size = [SIDE as u32; 2];
        let mut plain = Moving::new(gpu, lit_by(hall(), &[lamp]), size, even());
        let with = ManyLightSettings {
            history: 0.95,
            ..even()
        };
        let mut moving = Moving::new(gpu, lit_by(hall(), &[lamp]), size, with);
        let mut worst = 0.0f64;
        for step in 0..16 {
            let eye = DVec3::new(-0.3 + 0.04 * f64::from(step), 1.85, 0.0);
            let [truth, found] = [&mut plain, &mut moving].map(|moving| {
                moving.scene.cameras[0] = from_above(eye.x);
                moving.frame(lamp).0
            });
            worst = worst.max(ghosts(SIDE, &met_by_pixels(SIDE, eye), &truth, &found));
        }
        println!("ghosts have {worst:.2e} of the energy");
        assert!(worst > 0.0 && worst < 0.01, "{worst}");
    });
}

/// The same while the slab slides on by more than a pixel a frame, and with it its shadow, under a camera that stands still. The lights stay where they are, since their lamp does.
#[test]
fn ghosts_stay_near_what_moves() {
    const SIDE: usize = 32;
    with_gpu(|gpu| {
        let lamp = point(LAMP);
        let base = ManyLightSettings {
            visibility: Visibility::Rays,
            ..even()
        };
        let with = ManyLightSettings {
            history: 0.95,
            ..base.clone()
        };
        let made = |settings| {
            let mut moving = Moving::new(gpu, lit_by(hall(), &[lamp]), [SIDE as u32; 2], settings);
            moving.scene.cameras[0] = from_above(0.0);
            moving
        };
        let (mut plain, mut moving) = (made(base), made(with));
        let slab = moving.scene.instances.len() - 1;
        let (mut worst, mut trusted) = (0.0f64, f32::INFINITY);
        for step in 0..16 {
            let to = DVec3::X * (0.04 * f64::from(step) - 0.3);
            let [truth, found] = [&mut plain, &mut moving].map(|moving| {
                moving.put(slab, to);
                moving.frame(lamp).0
            });
            // To the slab the camera is what moves.
            let met = met_by_pixels(SIDE, from_above(0.0).transform.translation - to);
            worst = worst.max(ghosts(SIDE, &met, &truth, &found));
            let confidence = moving.renderer.confidence().expect("confidence");
            let average = confidence.iter().sum::<f32>() / confidence.len() as f32;
            if step > 0 {
                trusted = trusted.min(average);
            }
        }
        println!("ghosts have {worst:.2e} of the energy, and histories a mean confidence of {trusted} or more");
        assert!(worst > 0.0 && worst < 0.01, "{worst}");
        // Light of the frame before is there nearly everywhere.
        assert!(trusted > 0.7, "{trusted}");
    });
}

/// A point of an object is looked up where it is now: a slab that has risen by more than neighbours of one surface may lie apart has no history, and the floor beside it all of it.
#[test]
fn what_leaves_its_own_surface_has_no_confidence() {
    const SIDE: usize = 32;
    const RISE: f64 = 0.15;
    with_gpu(|gpu| {
        let lamp = point(LAMP);
        let settings = constant(0.9, even());
        // Of the scene's diagonal, m.
        let apart = f64::from(settings.filter_plane) * DVec3::new(6.0, 2.0, 6.0).length();
        assert!(apart < RISE);
        let mut moving = Moving::new(gpu, lit_by(hall(), &[lamp]), [SIDE as u32; 2], settings);
        moving.scene.cameras[0] = from_above(0.0);
        let slab = moving.scene.instances.len() - 1;
        (0..2).for_each(|_| drop(moving.frame(lamp)));
        let confidence = moving.renderer.confidence().expect("confidence");
        assert!(confidence.iter().all(|c| (c - 0.9).abs() < 1e-6), "{confidence:?}");
        moving.put(slab, DVec3::Y * RISE);
        moving.frame(lamp);
        let confidence = moving.renderer.confidence().expect("confidence");
        // The slab's top as it is seen from a height, over which it is seen the wider the nearer it is: from a pixel and a half within where it was, to as much beyond where it is.
        let eye = from_above(0.0).transform.translation;
        let half = 0.5f64.tan();
        let pixel = 2.0 * half / SIDE as f64;
        let (mut on_slab, mut on_floor) = (0, 0);
        for (i, confidence) in confidence.iter().enumerate() {
            let along = |i: usize| 2.0 * half * ((i as f64 + 0.5) / SIDE as f64 - 0.5);
            let (x, z) = (along(i % SIDE), along(i / SIDE));
            let within = |depth: f64, wider: f64| {
                let border = wider * pixel;
                x > -0.4 / depth - border && x < 0.3 / depth + border && z.abs() < 0.4 / depth + border
            };
            if within(eye.y - 1.0, -1.5) {
                on_slab += 1;
                assert_eq!(*confidence, 0.0, "pixel {i}");
            } else if !within(eye.y - 1.0 - RISE, 1.5) {
                on_floor += 1;
                assert!((confidence - 0.9).abs() < 1e-6, "pixel {i}: {confidence}");
            }
        }
        println!("{on_slab} pixels of the slab, {on_floor} of the floor");
        assert!(on_slab > 100 && on_floor > 40, "{on_slab} {on_floor}");
    });
}

/// Light that goes out is gone at once, light that stays has the whole confidence, and the noise of a few hundred lights takes little of it.
#[test]
fn changes_of_light_lower_the_confidence() {
    with_gpu(|gpu| {
        let (scene, [up, aside]) = with_plate();
        let with = ManyLightSettings {
            history: 0.95,
            ..even()
        };
        let mut moving = Moving::new(gpu, scene, [12, 8], with);
        (0..3).for_each(|_| drop(moving.frame(up)));
        let (lit, _) = moving.frame(up);
        let confidence = moving.renderer.confidence().expect("confidence");
        assert!(confidence.iter().all(|c| (c - 0.95).abs() < 1e-6), "{confidence:?}");
        let (dark, _) = moving.frame(aside);
        assert!(dark.iter().all(|value| *value == 0.0));
        let confidence = moving.renderer.confidence().expect("confidence");
        // What was black already, as the plate is, has not changed.
        let changed = confidence
            .iter()
            .zip(lit.chunks_exact(3))
            .filter(|(_, light)| light[1] > 0.0);
        let changed: Vec<f32> = changed.map(|(c, _)| *c).collect();
        assert!(
            changed.len() > 80 && changed.iter().all(|c| *c == 0.0),
            "{confidence:?}"
        );

        let noisy = ManyLightSettings {
            lights: 256,
            history: 0.95,
            filter: true,
            ..of(INDIRECT, exact())
        };
        let scene = hall();
        let mut renderer = frames(gpu, &scene, [24; 2], &noisy);
        (0..12).for_each(|_| drop(next(&mut renderer, &scene.cameras[0])));
        let confidence = renderer.confidence().expect("confidence");
        let average = confidence.iter().sum::<f32>() / confidence.len() as f32;
        println!("mean confidence {average} under noise");
        assert!(average > 0.85, "{average}");
        // A frame without virtual lights ends it.
        let lamps = [Vec3::Y, Vec3::X].map(|direction| spot(Vec3::new(2.8, 1.0, 0.0), direction));
        let settings = ManyLightSettings {
            history: 0.9,
            ..of(INDIRECT, exact())
        };
        let mut moving = Moving::new(gpu, lit_by(hall(), &lamps[..1]), [12, 8], settings);
        moving.frame(lamps[0]);
        moving.frame(lamps[0]);
        assert!(
            moving
                .renderer
                .confidence()
                .expect("confidence")
                .iter()
                .any(|c| *c > 0.0)
        );
        assert!(moving.frame(lamps[1]).0.iter().all(|value| *value == 0.0));
        assert!(moving.renderer.confidence().expect("confidence").is_empty());
    });
}

/// On a floor alone light enters up to so many times as bright as the mean of what is around, whose windows are as wide as those of the tiles.
#[test]
fn single_bright_pixels_are_bounded() {
    const SIDE: usize = 16;
    const BOUND: f32 = 1.25;
    with_gpu(|gpu| {
        let mut scene = hall();
        // Without the slab.
        scene.instances.pop();
        let base = ManyLightSettings {
            lights: 64,
            interleave: 4,
            ..of(INDIRECT, exact())
        };
        let camera = &scene.cameras[0];
        let size = [SIDE as u32; 2];
        let raw = next(&mut frames(gpu, &scene, size, &base), camera);
        // To the bit, since nothing was there before.
        let unbounded = next(&mut frames(gpu, &scene, size, &constant(0.9, base.clone())), camera);
        assert_eq!(bits(&unbounded), bits(&raw));
        let bounded = ManyLightSettings {
            history_bound: BOUND,
            ..constant(0.9, base)
        };
        let found = next(&mut frames(gpu, &scene, size, &bounded), camera);
        let mut lowered = 0;
        for y in 0..SIDE {
            for x in 0..SIDE {
                let around = |i: usize| i.saturating_sub(2)..(i + 3).min(SIDE);
                let (mut sum, mut count) = (0.0, 0.0);
                for (there_x, there_y) in around(y).flat_map(|y| around(x).map(move |x| (x, y))) {
                    if (there_x, there_y) != (x, y) {
                        sum += raw[3 * (there_y * SIDE + there_x) + 1];
                        count += 1.0;
                    }
                }
                let value = raw[3 * (y * SIDE + x) + 1];
                let expected = value.min(BOUND * sum / count);
                lowered += u32::from(expected < value);
                let got = found[3 * (y * SIDE + x) + 1];
                assert!((got - expected).abs() <= 1e-5 * expected, "{got} instead of {expected}");
            }
        }
        assert!(lowered > 16 && lowered < 200, "{lowered}");
    });
}

#[test]
fn histories_cost_what_they_keep_and_nothing_where_there_are_none() {
    with_gpu(|gpu| {
        let scene = hall();
        let once = |settings: &ManyLightSettings| {
            let mut renderer = frames(gpu, &scene, [16, 8], settings);
            advance(&mut renderer, 1);
            let has_kernel = renderer
                .pipelines()
                .iter()
                .any(|pipeline| pipeline.shader.contains("deferred_history"));
            (renderer.counts().passes, renderer.bytes(), has_kernel)
        };
        let history = |history: f32, settings: ManyLightSettings| once(&ManyLightSettings { history, ..settings });
        // Positions, normals and objects of 16 · 8 pixels; colours of 16 tiles with 64 places each; light of a frame, and what two of them leave.
        let (passes, bytes, has_kernel) = once(&exact());
        assert_eq!((passes, has_kernel), (6, false));
        let colors = 12 * 16 * 64 - 16;
        assert_eq!(
            history(0.9, exact()),
            (7, bytes + (16 + 8 + 4) * 128 + colors + (12 + 2 * 36) * 128, true)
        );
        // Where a filter reads the same there is less to add.
        let filtered = ManyLightSettings {
            filter: true,
            ..exact()
        };
        let (_, bytes, has_kernel) = once(&filtered);
        assert!(!has_kernel);
        assert_eq!(history(0.9, filtered), (7, bytes + (4 + 12 + 2 * 36) * 128, true));
        // A first frame is what it is without.
        for settings in [
            exact(),
            ManyLightSettings {
                filter: true,
                ..exact()
            },
        ] {
            let frame = |settings: &ManyLightSettings| bits(&picture(gpu, &scene, [16, 8], settings, 1));
            assert!(frame(&constant(0.9, settings.clone())) == frame(&settings));
        }
        // Where nothing of virtual lights is shown nothing is kept.
        let without = once(&of(UP_TO_ONCE, exact()));
        assert_eq!(history(0.9, of(UP_TO_ONCE, exact())), without);

        let refused = |settings: ManyLightSettings| {
            let made = ManyLight::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, settings);
            made.err().map(|error| error.to_string()).unwrap_or_default()
        };
        let discs = ManyLightSettings {
            history: 0.9,
            placement: Placement::Rsm,
            gathering: Gathering::Disc,
            ..exact()
        };
        assert!(refused(discs).contains("history"));
        assert!(
            refused(ManyLightSettings {
                history: 1.0,
                ..exact()
            })
            .contains("history")
        );
    });
}

/// Frames of a camera and a lamp that move, with all that lowers the confidence.
fn moving_frames(gpu: &Gpu, settings: ManyLightSettings) -> Vec<Vec<u32>> {
    let at = |step: u32| point(Vec3::new(0.5 - 0.1 * step as f32, 1.7, 0.2));
    let settings = ManyLightSettings {
        history: 0.9,
        filter: true,
        interleave: 3,
        lights: 50,
        ..settings
    };
    let mut moving = Moving::new(gpu, lit_by(hall(), &[at(0)]), [13, 7], settings);
    let mut frame = |step: u32| {
        moving.scene.cameras[0] = from_above(0.02 * f64::from(step));
        bits(&moving.frame(at(step)).0)
    };
    (0..4).map(&mut frame).collect()
}

pub(super) fn bits_of_frames(gpu: &Gpu) -> Vec<u32> {
    moving_frames(gpu, exact()).concat()
}

#[test]
fn histories_do_not_depend_on_how_work_is_shared_out() {
    with_gpu(|gpu| {
        for placement in [Placement::Walks, Placement::Incremental] {
            let base = ManyLightSettings { placement, ..exact() };
            let whole = moving_frames(gpu, base.clone());
            let parted = ManyLightSettings {
                lights_at_once: 3,
                submission_work: 1,
                ..base.clone()
            };
            assert!(moving_frames(gpu, parted) == whole, "{placement:?}");
            let without = ManyLightSettings {
                filter: true,
                interleave: 3,
                ..base.clone()
            };
            // Begun anew with the first seed, and given up in the middle of a frame.
            let with = ManyLightSettings {
                history: 0.9,
                ..without
            };
            let scene = lit_by(hall(), &[point(LAMP)]);
            let camera = &scene.cameras[0];
            let mut renderer = frames(gpu, &scene, [13, 7], &with);
            let three = |renderer: &mut ManyLight| [0, 1, 2].map(|_| bits(&next(renderer, camera)));
            let first = three(&mut renderer);
            assert!(first[1] != first[0] || placement == Placement::Incremental);
            assert!(three(&mut renderer) != first || placement == Placement::Incremental);
            renderer.restart(base.seed).expect("the first seed");
            assert!(three(&mut renderer) == first, "{placement:?}");
            renderer.restart(base.seed).expect("the first seed");
            next(&mut renderer, camera);
            renderer.set_camera(camera).expect("a camera");
            renderer.step(1).expect("a part of a frame");
            assert!(bits(&next(&mut renderer, camera)) == first[1], "{placement:?}");
        }
    });
}
