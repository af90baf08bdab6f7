//! Automatic choice on a device: predictions against what comes out, and reasons where nothing can be chosen.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use clerestory::film::metrics::{RELATIVE_MSE_OFFSET, relative_mse_epsilon};
use clerestory::film::{CompareOptions, NonFiniteSamples, Picture, PixelFormat, Step, compare};
use clerestory::gpu::{Buffer, Gpu, PipelineInfo};
use clerestory::plan::{ErrorModel, Goal, plan, plan_among, relative_mse_by_variance, relative_mse_of_pair};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::Camera;
use clerestory::settings::{Settings, SettingsDecl};
use clerestory::techniques::{self, Bias, Card, Foresight, FrameTarget, PathTracerSettings, Skipped, Technique, View};
use clerestory::transport::{GpuScene, PathSet};
use clerestory::{Error, Result, scene};
use clerestory_tests::with_gpu;

/// Predicted and true error may differ by this factor: both are means over small pictures whose pixels differ much in error.
const FACTOR: f64 = 1.5;

fn render(renderer: &Renderer, options: &RenderOptions) -> Rendered {
    let mut rendering = renderer.start(options).unwrap();
    while rendering.step().unwrap().is_some() {}
    rendering.finish().unwrap()
}

fn options() -> RenderOptions {
    RenderOptions {
        technique: Some("path".into()),
        size: [16, 16],
        ..RenderOptions::default()
    }
}

// How far pilots go depends on the clock; here they go as far in every run.
#[test]
fn predictions_come_true() {
    with_gpu(|gpu| {
        // The furnace needs no reference: its body, which absorbs nothing, vanishes. Nor is there anything bright beside its pixels.
        let vanished = Picture::from_radiance(16, 16, vec![1.0; 16 * 16 * 3]).unwrap();
        for (address, size, truth) in [
            ("builtin:cornell-box", [48, 48], None),
            ("builtin:furnace-medium", [16, 16], Some(vanished)),
        ] {
            let renderer = Renderer::new(gpu, &scene::load(address).unwrap()).unwrap();
            let picture = |spp, seed| {
                let options = RenderOptions {
                    size,
                    spp,
                    seed,
                    settings: serde_json::json!({ "sampler": "pcg" }).into(),
                    ..options()
                };
                render(&renderer, &options).picture
            };
            let mut model = ErrorModel::default();
            for (spp, seed) in [(4, 1), (16, 5)] {
                let pair = [picture(spp, seed), picture(spp, seed + 1)];
                let found = relative_mse_of_pair(&pair[0], &pair[1], RELATIVE_MSE_OFFSET).unwrap();
                // 7,000 values of a few degrees of freedom each.
                model.add(spp, found, 0.05 * found);
            }
            let predicted = model.relative_mse(64.0).sqrt();
            // The own noise of a reference that is rendered, a fifth of what is found, is subtracted from the squared error.
            let (reference, own) = match truth {
                Some(truth) => (truth, 0.0),
                None => {
                    let reference = picture(4 * 64, 3);
                    let own = relative_mse_by_variance(&reference, RELATIVE_MSE_OFFSET).unwrap();
                    (reference, own)
                }
            };
            let last = picture(64, 4);
            let error = compare(&last, &reference, &CompareOptions::default()).unwrap();
            let error = (error.relative_mse - own).sqrt();
            assert!(
                error < FACTOR * predicted && predicted < FACTOR * error,
                "{address}: {error}, predicted {predicted}"
            );
            let by_variance = relative_mse_by_variance(&last, RELATIVE_MSE_OFFSET).unwrap().sqrt();
            assert!(
                error < FACTOR * by_variance && by_variance < FACTOR * error,
                "{address}: {error}, by the variance layer {by_variance}"
            );
        }
    });
}

// The whole choice, with its last pair, and several pictures of what it chose. How many pilots there are is the clock's; the interval says what that
// costs. The six pictures share a prediction: half of them lie outside where that is off by more than 2.3 of its standard errors, in 2 of 100 runs.
// Then a second choice, of other pilots, decides.
#[test]
fn pictures_have_the_error_that_was_predicted() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:box-room").unwrap()).unwrap();
        let asked = 0.45;
        let of = |spp, seed| RenderOptions {
            size: [48, 48],
            spp,
            seed,
            settings: serde_json::json!({ "sampler": "pcg" }).into(),
            ..options()
        };
        let is_as_predicted = |seed| {
            let plan = plan(&renderer, &of(1, seed), goal(asked), &mut || true).unwrap();
            let choice = plan.choice();
            assert!(choice.last_pilot_spp >= 4 && plan.pilot_share > 0.0, "{plan:?}");
            let [low, high] = choice.error_interval.unwrap();
            assert!(
                low < choice.error && choice.error < high && high < 3.0 * low,
                "{choice:?}"
            );
            assert!(choice.error <= asked * 1.001, "{choice:?}");
            // Its own noise, a twelfth of theirs, is subtracted from squared errors.
            let reference = render(&renderer, &of(12 * choice.spp.max(16), seed + 99)).picture;
            let own = relative_mse_by_variance(&reference, RELATIVE_MSE_OFFSET).unwrap();
            let mut errors: Vec<f64> = (200..206)
                .map(|picture| {
                    let picture = render(&renderer, &plan.options(&of(1, seed + picture))).picture;
                    let error = compare(&picture, &reference, &CompareOptions::default()).unwrap();
                    (error.relative_mse - own).sqrt()
                })
                .collect();
            errors.sort_by(f64::total_cmp);
            println!("seed {seed}: {errors:?}, predicted {choice:?}");
            errors.iter().filter(|error| !(low..=high).contains(*error)).count() < 3
        };
        assert!(is_as_predicted(1) || is_as_predicted(1001));
    });
}

// Adaptive samples, which pilots have as the picture has them, and as much error as was asked for.
#[test]
fn adaptive_pictures_have_the_error_asked_for() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:box-room").unwrap()).unwrap();
        let asked = 0.3;
        let of = |spp, seed, adaptive: &str| RenderOptions {
            size: [40, 40],
            spp,
            seed,
            settings: serde_json::json!({ "sampler": "pcg", "roulette_start": 4, "adaptive": adaptive }).into(),
            technique: None,
            ..options()
        };
        let plan_of = |options: &RenderOptions| plan(&renderer, options, goal(asked), &mut || true).unwrap();
        let plan = plan_of(&of(1, 7, "relative"));
        let choice = plan.choice();
        assert_eq!(
            (choice.technique, &choice.settings["adaptive"], choice.reason.as_str()),
            ("path", &"relative".into(), ""),
            "{plan:?}"
        );
        assert!(choice.error <= asked * 1.001 && plan.shortfall.is_empty(), "{plan:?}");
        // Where rounds had as many, so has the last pair: a pilot as large a part of its samples as of the picture's.
        assert!(
            choice.spp >= 16 && choice.last_pilot_spp >= choice.pilot_spp.min(16),
            "{choice:?}"
        );
        for candidate in plan.candidates.iter().filter(|candidate| candidate.technique != "path") {
            assert!(candidate.reason.contains("no setting adaptive"), "{candidate:?}");
        }
        // Without adaptive samples; its own noise, an eighth of theirs, is subtracted from squared errors.
        let reference = render(
            &renderer,
            &RenderOptions {
                technique: Some("path".into()),
                ..of(8 * choice.spp, 99, "off")
            },
        );
        let own = relative_mse_by_variance(&reference.picture, RELATIVE_MSE_OFFSET).unwrap();
        for seed in [201, 202] {
            let rendered = render(&renderer, &plan.options(&of(1, seed, "relative")));
            let [fewest, most] = rendered.report.samples;
            assert!(fewest < choice.spp && choice.spp < most, "{fewest} to {most}");
            let error = compare(&rendered.picture, &reference.picture, &CompareOptions::default()).unwrap();
            let error = (error.relative_mse - own).sqrt();
            println!("seed {seed}: {error}, predicted {choice:?}");
            assert!(
                error < FACTOR * asked && asked < FACTOR * error,
                "{error} for {asked}, {choice:?}"
            );
        }
    });
}

// One round of pilots of one candidate, as many in every run.
#[test]
fn the_unit_of_radiance_changes_neither_choice_nor_error() {
    with_gpu(|gpu| {
        let of = |light: &str| {
            let renderer =
                Renderer::new(gpu, &scene::load(&format!("builtin:box-room?light={light}")).unwrap()).unwrap();
            let goal = Goal {
                error: Some(0.1),
                time: None,
            };
            let plan = plan(&renderer, &options(), goal, &mut || false).unwrap();
            let picture = |spp, seed| {
                let options = RenderOptions { spp, seed, ..options() };
                render(&renderer, &options).picture
            };
            let error = compare(&picture(16, 1), &picture(256, 2), &CompareOptions::default()).unwrap();
            (f64::from(plan.choice().spp), error.relative_mse)
        };
        let (spp, error) = of("12");
        assert!(spp > 10.0 && error > 0.0, "{spp}, {error}");
        for light in ["0.012", "12000"] {
            // Rounding alone differs.
            let (other_spp, other_error) = of(light);
            assert!((other_spp / spp - 1.0).abs() < 0.02, "{light}: {other_spp} for {spp}");
            assert!(
                (other_error / error - 1.0).abs() < 0.01,
                "{light}: {other_error} for {error}"
            );
        }
    });
}

#[test]
fn what_cannot_be_chosen_says_why() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:cornell-box").unwrap()).unwrap();
        // No picture in no time: one sample is rendered, and the plan says that it is late.
        let hasty = Goal {
            error: None,
            time: Some(Duration::from_micros(1)),
        };
        let late = plan(&renderer, &options(), hasty, &mut || true).unwrap();
        assert_eq!(late.choice().spp, 1);
        assert!(late.shortfall.contains("too short"), "{}", late.shortfall);
        assert!(
            late.candidates.iter().skip(1).all(|c| c.reason.contains("no time")),
            "{late:?}"
        );
        // An error beyond the time: the time is kept, and the plan says what can be had.
        let demanding = Goal {
            error: Some(1e-4),
            time: Some(Duration::from_secs(4)),
        };
        let plan_of = |options: &RenderOptions, goal| plan(&renderer, options, goal, &mut || true);
        let short = plan_of(&options(), demanding).unwrap();
        assert!(short.shortfall.contains("takes longer"), "{}", short.shortfall);
        assert!(short.choice().seconds + short.pilot_seconds <= 4.1, "{short:?}");
        // Without light nothing is known, and that is said.
        let dark = Renderer::new(gpu, &scene::load("builtin:cornell-box?light=0").unwrap()).unwrap();
        let goal = Goal {
            error: Some(0.1),
            time: None,
        };
        let dark = plan(&dark, &options(), goal, &mut || true).unwrap();
        assert!(dark.shortfall.contains("any light"), "{dark:?}");
        assert!(dark.choice().spp > 1, "{dark:?}");
        // What is fixed stays fixed.
        let fixed = RenderOptions {
            settings: serde_json::json!({ "sampler": "pcg", "path_set": "direct" }).into(),
            ..options()
        };
        let goal = Goal {
            error: Some(0.5),
            time: None,
        };
        let chosen = plan(&renderer, &fixed, goal, &mut || false).unwrap();
        for candidate in &chosen.candidates {
            assert_eq!(candidate.settings["sampler"], "pcg");
            assert_eq!(candidate.settings["path_set"], "direct");
        }
        let none = Goal::default();
        assert!(matches!(plan_of(&options(), none), Err(Error::Setting { .. })));
    });
}

/// A technique of a host's own that errs: the path tracer's pictures, too bright by a twentieth.
struct Bright {
    path: Box<dyn Technique>,
    /// Samples per pixel beyond which it has no room.
    most: u32,
}

const BRIGHT: Card = Card {
    id: "bright",
    summary: "the path tracer's pictures, too bright",
    bias: Bias::Biased("everything is multiplied"),
    needs: &[],
    path_set: PathSet::ALL,
    refusals: |_| Vec::new(),
    settings: SettingsDecl::of::<PathTracerSettings>(),
    variants: &[],
    foresight: Foresight::PLAIN,
    rows: &[],
    kernels: &[],
    create: |gpu, scene, view, settings| bright(gpu, scene, view, settings, u32::MAX),
};

fn bright(
    gpu: &Gpu,
    scene: Arc<GpuScene>,
    view: &View<'_>,
    settings: &Settings,
    most: u32,
) -> Result<Box<dyn Technique>> {
    let path = (techniques::by_id("path")?.create)(gpu, scene, view, settings)?;
    Ok(Box::new(Bright { path, most }))
}

impl Technique for Bright {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if samples > self.most {
            return Err(Error::Overflow {
                kernel: "bright".into(),
                what: "samples".into(),
                needed: samples.into(),
                capacity: self.most.into(),
                instead: "choose another technique".into(),
            });
        }
        self.path.step(samples)
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        let (picture, non_finite) = self.path.picture()?;
        let values = picture.main_layer()?.values().iter().map(|value| value * 1.05);
        let bright = Picture::from_radiance(picture.width(), picture.height(), values.collect())?;
        Ok((bright, non_finite))
    }

    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.path.display(target, exposure, format)
    }

    fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.path.set_camera(camera)
    }

    fn path_set(&self) -> PathSet {
        self.path.path_set()
    }

    fn settings(&self) -> serde_json::Value {
        self.path.settings()
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        self.path.counters()
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        self.path.pipelines()
    }

    fn skipped(&self) -> Vec<Skipped> {
        self.path.skipped()
    }
}

fn goal(error: f64) -> Goal {
    Goal {
        error: Some(error),
        time: None,
    }
}

// Direct light of a point has next to no noise, so that the first pilots tell the bias whatever the clock says of further ones.
#[test]
fn a_bias_beyond_the_goal_is_refused_with_its_figure() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:cornell-box?source=point").unwrap()).unwrap();
        let options = RenderOptions {
            technique: None,
            settings: serde_json::json!({ "path_set": "direct", "sampler": "sobol" }).into(),
            ..options()
        };
        let among = |cards: &[&Card], error| plan_among(&renderer, cards, &options, goal(error), &mut || true).unwrap();
        // Alone it is taken, and what it lacks is said; it is judged by pilots of the path tracer that is not a candidate.
        let strict = among(&[&BRIGHT], 0.02);
        let choice = strict.choice();
        let bias = choice.bias.unwrap();
        // A twentieth of the radiance, by the metric's weights, which are small where the room is dark.
        let truth = render(
            &renderer,
            &RenderOptions {
                technique: Some("path".into()),
                spp: 1024,
                seed: 9,
                ..options.clone()
            },
        );
        let values = truth.picture.main_layer().unwrap().values();
        let epsilon = relative_mse_epsilon(values.iter().copied(), RELATIVE_MSE_OFFSET);
        let squares: Vec<f64> = values.iter().map(|value| f64::from(*value).powi(2)).collect();
        let weighted = squares.iter().map(|square| square / (square + epsilon)).sum::<f64>();
        let expected = 0.05 * (weighted / squares.len() as f64).sqrt();
        // How many pilots there are depends on the clock: fewer find it less exactly, and say so.
        let at_most = choice.bias_at_most.unwrap();
        assert!(
            expected < 1.05 * at_most && bias < 1.1 * expected,
            "{expected}: {choice:?}"
        );
        assert!(
            choice.reason.starts_with("bias ") && choice.reason.contains("the goal of 2 %"),
            "{choice:?}"
        );
        assert!(
            strict.shortfall.contains(&choice.reason) && choice.judged_by.contains("path, of"),
            "{strict:?}"
        );
        assert!(
            (choice.error - bias.hypot(choice.noise)).abs() < 1e-9 && choice.noise > 0.0,
            "{choice:?}"
        );
        assert_eq!(
            (strict.candidates.len(), strict.reference.as_ref().unwrap().technique),
            (1, "path")
        );
        let lenient = among(&[&BRIGHT], 0.1);
        assert!(
            lenient.shortfall.is_empty() && lenient.choice().reason.is_empty(),
            "{lenient:?}"
        );
        assert!(lenient.choice().error < 0.1 * 1.001, "{lenient:?}");
        // Beside the path tracer, which has no bias, it is not.
        let both = among(&[&BRIGHT, techniques::by_id("path").unwrap()], 0.02);
        assert_eq!(both.choice().technique, "path", "{both:?}");
        assert!(both.candidates[0].reason.contains("the goal of 2 %"), "{both:?}");
    });
}

/// Beyond the first samples, and beyond the first round.
const SHORT: [Card; 2] = [
    Card {
        create: |gpu, scene, view, settings| bright(gpu, scene, view, settings, 1),
        ..BRIGHT
    },
    Card {
        create: |gpu, scene, view, settings| bright(gpu, scene, view, settings, 4),
        ..BRIGHT
    },
];

const HUNGRY: Card = Card {
    id: "hungry",
    create: |_, _, _, _| {
        Err(Error::OutOfMemory {
            memory: "device",
            name: "maps".into(),
            bytes: 1 << 50,
            cause: "there is less".into(),
        })
    },
    ..BRIGHT
};

/// Of other light paths than are asked for.
const ELSEWHERE: Card = Card {
    id: "elsewhere",
    path_set: PathSet::EMITTED,
    settings: SettingsDecl::NONE,
    create: |_, _, _, _| panic!("made in spite of its paths"),
    ..BRIGHT
};

const FRAMES: Card = Card {
    id: "frames",
    foresight: Foresight::FRAMES,
    create: |_, _, _, _| panic!("made in spite of its size"),
    ..BRIGHT
};

#[test]
fn what_cannot_be_made_is_no_end_of_the_choice() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:cornell-box?source=point").unwrap()).unwrap();
        let options = RenderOptions {
            technique: None,
            settings: serde_json::json!({ "path_set": "direct", "sampler": "sobol" }).into(),
            ..options()
        };
        let among = |cards: &[&Card]| plan_among(&renderer, cards, &options, goal(0.1), &mut || true);
        let path = techniques::by_id("path").unwrap();
        let plan = among(&[&HUNGRY, &ELSEWHERE, &SHORT[0], path]).unwrap();
        assert_eq!((plan.choice().technique, plan.choice().reason.as_str()), ("path", ""));
        for (candidate, words) in plan
            .candidates
            .iter()
            .zip(["out of device memory", "light paths", "bright: samples"])
        {
            assert!(candidate.reason.contains(words), "{words}: {candidate:?}");
        }
        // One that fails as its pilots go on, however good they were; and nothing else is left.
        let error = among(&[&SHORT[1]]).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains("bright: samples"), "{error}");
    });
}

#[test]
fn frames_too_large_for_the_device_are_no_candidates() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &scene::load("builtin:cornell-box").unwrap()).unwrap();
        let side = 1 << 14;
        let rows = gpu.caps().max_storage_buffer_range / FrameTarget::bytes([side, 1]) + 1;
        let large = RenderOptions {
            size: [side, rows as u32],
            ..options()
        };
        // The first that can is tried, and nothing more.
        let cards = [&FRAMES, techniques::by_id("path").unwrap()];
        let plan = plan_among(&renderer, &cards, &large, goal(0.5), &mut || false).unwrap();
        let reason = &plan.candidates[0].reason;
        assert!(reason.contains("maxStorageBufferRange"), "{reason}");
        assert_eq!(plan.choice().technique, "path");
    });
}

// Photons' ways and planes are candidates in fog; in a grid they are none, and no end of the choice where they were asked for.
#[test]
fn estimates_in_media_are_candidates_where_they_can_be_made() {
    with_gpu(|gpu| {
        let [path, photon] = ["path", "photon"].map(|id| techniques::by_id(id).unwrap());
        let plan_of = |address: &str, cards: &[&Card], settings: serde_json::Value| {
            let renderer = Renderer::new(gpu, &scene::load(address).unwrap()).unwrap();
            let options = RenderOptions {
                technique: None,
                settings: settings.into(),
                size: [8, 8],
                ..options()
            };
            // The first that can is tried, and nothing more.
            plan_among(&renderer, cards, &options, goal(0.5), &mut || false).unwrap()
        };
        let estimates = |plan: &clerestory::plan::Plan| {
            let photons = plan
                .candidates
                .iter()
                .filter(|candidate| candidate.technique == "photon");
            photons
                .map(|candidate| candidate.settings.get("volume").cloned().unwrap_or_default())
                .collect::<Vec<_>>()
        };
        let settings = serde_json::json!({ "photons": 1024 });
        let in_fog = plan_of("builtin:fog-box?boxes=none", &[photon], settings.clone());
        assert_eq!(
            estimates(&in_fog),
            [
                serde_json::Value::Null,
                "beams".into(),
                "planes".into(),
                "unified".into()
            ]
        );
        let in_a_grid = plan_of("builtin:smoke?size=8", &[photon], settings);
        assert_eq!(estimates(&in_a_grid), [serde_json::Value::Null]);
        for volume in ["beams", "planes"] {
            let settings =
                serde_json::json!({ "photons": 1024, "volume": volume, "sampler": "pcg", "roulette_start": 4 });
            let plan = plan_of("builtin:smoke?size=8", &[photon, path], settings);
            assert_eq!(plan.choice().technique, "path", "{plan:?}");
            let reason = &plan.candidates[0].reason;
            assert!(reason.contains("volume") && reason.contains("homogeneous"), "{reason}");
        }
    });
}

#[test]
fn the_path_tracer_does_not_win_by_what_it_misses() {
    with_gpu(|gpu| {
        let address = "builtin:cornell-box?sphere=glass&boxes=none&source=point";
        let renderer = Renderer::new(gpu, &scene::load(address).unwrap()).unwrap();
        let of = |technique: Option<&str>, settings: serde_json::Value, goes_on: bool| {
            let options = RenderOptions {
                technique: technique.map(Into::into),
                settings: settings.into(),
                ..options()
            };
            plan(&renderer, &options, goal(0.2), &mut || goes_on).unwrap()
        };
        // All variants of the path tracer miss the same: one of them stands for all.
        let cards = ["path", "photon"].map(|id| techniques::by_id(id).unwrap());
        let one = RenderOptions {
            settings: serde_json::json!({ "sampler": "sobol", "roulette_start": 4 }).into(),
            ..options()
        };
        let free = plan_among(&renderer, &cards, &one, goal(0.2), &mut || true).unwrap();
        let choice = free.choice();
        assert_eq!((choice.technique, choice.reason.as_str()), ("photon", ""), "{free:?}");
        assert!(
            choice.judged_by.contains("its own pictures") && choice.judged_by.contains("path misses"),
            "{choice:?}"
        );
        // What is found of it may be none, where noise hides the rest.
        assert!(
            choice.bias_at_most.unwrap() > 0.0 && choice.error <= 0.2 * 1.001,
            "{choice:?}"
        );
        for path in free.candidates.iter().filter(|candidate| candidate.technique == "path") {
            assert!(
                path.misses.contains("point light \"light\"") && path.judged_by.contains("photon"),
                "{path:?}"
            );
            assert!(path.reason.contains("the goal of 20 %"), "{path:?}");
        }
        // Where there is nothing else, it says so, whatever further pilots find.
        let alone = of(Some("path"), serde_json::json!({ "sampler": "sobol" }), false);
        assert!(
            alone.shortfall.contains("misses") && alone.shortfall.contains("point light \"light\""),
            "{alone:?}"
        );
        assert_eq!(alone.choice().bias, None);
        // And nothing where those paths were not asked for.
        let direct = of(
            Some("path"),
            serde_json::json!({ "path_set": "direct", "sampler": "sobol" }),
            false,
        );
        assert!(
            direct.shortfall.is_empty() && direct.choice().misses.is_empty(),
            "{direct:?}"
        );
    });
}
