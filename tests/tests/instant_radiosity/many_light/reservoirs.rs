//! Reservoirs of virtual lights against the path tracer, against all lights, by exact counts and by their noise.

use super::*;

fn reservoirs(candidates: u32, neighbours: u32) -> ManyLightSettings {
    ManyLightSettings {
        gathering: Gathering::Reservoirs,
        candidates,
        neighbours,
        neighbour_reach: 3.0,
        ..exact()
    }
}

#[test]
fn reservoirs_are_the_path_tracers() {
    with_gpu(|gpu| {
        let pixels = u64::from(SIDE * SIDE);
        for (scene, lights) in [(hall(), 64), (furnished(), 128)] {
            let reference = render(gpu, &scene, SIZE, 2048, &paths(ALL));
            for neighbours in [0, 4] {
                let settings = ManyLightSettings {
                    lights,
                    ..reservoirs(4, neighbours)
                };
                let mut renderer = frames(gpu, &scene, SIZE, &settings);
                let found = passes_of(&mut renderer, SIZE, 1, 64);
                let what = format!("{}, {neighbours} neighbours", scene.name);
                found.expect_same_as(&what, &reference, 0.0);
                let counts = renderer.counts();
                assert!(
                    counts.visibility_tests > 0 && counts.visibility_tests <= 64 * pixels,
                    "{counts:?}"
                );
                // The candidates, and each that members keep at each of them: only itself, or with most of its neighbours.
                let compared = counts.connections as f64 / (64 * pixels) as f64 - 4.0;
                match neighbours {
                    0 => assert!(compared <= 1.0 && compared > 0.9, "{compared}"),
                    _ => assert!(compared <= 25.0 && compared > 9.0, "{compared}"),
                }
            }
        }
    });
}

/// One light is the only candidate, whoever draws it: what it brings is what it brings without reservoirs.
#[test]
fn one_light_is_kept_by_all() {
    with_gpu(|gpu| {
        let scene = hall();
        let with = |settings: ManyLightSettings| {
            let settings = ManyLightSettings {
                lights: 1,
                interleave: 1,
                // Begun at the floor.
                seed: 8,
                ..settings
            };
            picture(gpu, &scene, SIZE, &of(INDIRECT, settings), 4)
        };
        let all = with(exact());
        assert!(mean(&all, 1) > 0.0);
        for (candidates, neighbours) in [(1, 0), (5, 0), (3, 4)] {
            let found = with(reservoirs(candidates, neighbours));
            let error = rmse(&found, &all) / mean(&all, 1);
            assert!(
                error < 1e-6,
                "{candidates} candidates, {neighbours} neighbours: {error}"
            );
        }
    });
}

#[test]
fn candidates_and_neighbours_take_noise_away() {
    with_gpu(|gpu| {
        let scene = hall();
        // Pixels have the same lights, whatever they keep of them.
        let all = ManyLightSettings {
            interleave: 1,
            ..exact()
        };
        let all = picture(gpu, &scene, SIZE, &of(INDIRECT, all), 4);
        let noise = |candidates, neighbours| {
            let settings = of(INDIRECT, reservoirs(candidates, neighbours));
            rmse(&picture(gpu, &scene, SIZE, &settings, 4), &all)
        };
        let [one, many, shared] =
            [(1, 0), (16, 0), (16, 4)].map(|(candidates, neighbours)| noise(candidates, neighbours));
        println!("one {one}, of sixteen {many}, with neighbours {shared}");
        assert!(many < one && shared < many, "{one} {many} {shared}");
    });
}

#[test]
fn reservoirs_have_their_passes_alone() {
    with_gpu(|gpu| {
        let scene = hall();
        let has = |renderer: &ManyLight, name: &str| {
            renderer
                .pipelines()
                .iter()
                .any(|pipeline| pipeline.shader.contains(name))
        };
        let mut renderer = frames(gpu, &scene, [16, 8], &reservoirs(4, 2));
        let whole = bits(&advance(&mut renderer, 2)[0]);
        // Surfaces, direct light, candidates, reuse, film.
        assert_eq!(renderer.counts().passes, 2 * 5);
        assert!(!has(&renderer, "deferred_gather") && has(&renderer, "deferred_reuse"));
        // Positions and normals of neighbours; reservoirs of eight bytes.
        let alone = frames(gpu, &scene, [16, 8], &reservoirs(4, 0));
        assert_eq!(renderer.bytes() - alone.bytes(), 24 * 128);
        renderer.restart(99).expect("another seed");
        assert!(bits(&advance(&mut renderer, 2)[0]) != whole);
        renderer.restart(exact().seed).expect("the first seed");
        assert!(bits(&advance(&mut renderer, 2)[0]) == whole);
        let plain = frames(gpu, &scene, [16, 8], &exact());
        assert!(!has(&plain, "deferred_reuse") && !has(&plain, "deferred_resample"));
        // Without other light what was there before the frame is gone.
        let mut indirect = frames(gpu, &scene, [16, 8], &of(INDIRECT, reservoirs(4, 2)));
        let first = advance(&mut indirect, 1)[0].clone();
        indirect.restart(exact().seed).expect("the first seed");
        assert!(bits(&advance(&mut indirect, 1)[0]) == bits(&first));
        for visibility in [Visibility::Maps, Visibility::Imperfect] {
            let settings = ManyLightSettings {
                visibility,
                ..reservoirs(4, 2)
            };
            let error = ManyLight::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, settings).err();
            let text = error.map(|error| error.to_string()).unwrap_or_default();
            assert!(text.contains("visibility") && text.contains("reservoirs"), "{text}");
        }
    });
}
