//! Automatic choice on a device: predictions against what comes out, and reasons where nothing can be chosen.

use std::time::Duration;

use clerestory::film::metrics::RELATIVE_MSE_OFFSET;
use clerestory::film::{CompareOptions, compare};
use clerestory::plan::{ErrorModel, Goal, plan, relative_mse_by_variance, relative_mse_of_pair};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Error, scene};
use clerestory_tests::with_gpu;

/// Predicted and true error may differ by this factor: both are means over 16² pixels whose errors differ much.
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
        for address in ["builtin:cornell-box", "builtin:furnace-medium"] {
            let renderer = Renderer::new(gpu, &scene::load(address).unwrap()).unwrap();
            let picture = |spp, seed| {
                let options = RenderOptions {
                    spp,
                    seed,
                    settings: serde_json::json!({ "sampler": "pcg" }).into(),
                    ..options()
                };
                render(&renderer, &options).picture
            };
            let mut model = ErrorModel::default();
            for spp in [16, 64] {
                let pair = [picture(spp, 1), picture(spp, 2)];
                model.add(
                    spp,
                    relative_mse_of_pair(&pair[0], &pair[1], RELATIVE_MSE_OFFSET).unwrap(),
                );
            }
            let (predicted, reference) = (model.relative_mse(256.0).sqrt(), picture(8192, 3));
            let last = picture(256, 4);
            let error = compare(&last, &reference, &CompareOptions::default()).unwrap();
            let error = error.relative_mse.sqrt();
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
            time: Some(Duration::from_secs(20)),
        };
        let plan_of = |options: &RenderOptions, goal| plan(&renderer, options, goal, &mut || true);
        let short = plan_of(&options(), demanding).unwrap();
        assert!(short.shortfall.contains("takes longer"), "{}", short.shortfall);
        assert!(short.choice().seconds + short.pilot_seconds <= 20.1, "{short:?}");
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
        let chosen = plan_of(&fixed, goal).unwrap();
        assert_eq!(chosen.choice().settings["sampler"], "pcg");
        assert_eq!(chosen.choice().settings["path_set"], "direct");
        let none = Goal::default();
        assert!(matches!(plan_of(&options(), none), Err(Error::Setting { .. })));
    });
}
