//! The reference path tracer as a technique.

use std::collections::BTreeMap;

use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::techniques::path::{
    path_camera, path_medium, path_numbers, path_refill, path_resolve, path_resolve_shares, path_retire, path_shade,
};
use crate::gpu::shaders::walk::{compact_count, compact_scan, compact_scatter, extend, shadow};
use crate::settings::{Settings, SettingsDecl};
use crate::techniques::path::adaptive::LIKE_PILOTS;
use crate::techniques::path::unseen::unseen_by_eye_paths;
use crate::techniques::path::{Adaptive, PathTracer, PathTracerSettings};
use crate::techniques::skipped::skipped;
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant};
use crate::transport::{COMPENSATION, METAL_LOBES, PathSet, SURFACE_FEATURES};
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "path",
    summary: "unidirectional path tracing with next-event estimation and multiple importance sampling",
    rows: &[ROWS, super::ROWS, super::full::ROWS, super::adaptive::ROWS],
    bias: Bias::Unbiased,
    needs: &[],
    kernels: &[&KERNELS],
    path_set: PathSet::ALL,
    refusals: |_| Vec::new(),
    settings: SettingsDecl::of::<PathTracerSettings>(),
    variants: &[
        Variant::DEFAULTS,
        Variant {
            name: "independent samples",
            settings: || serde_json::json!({ "sampler": "pcg" }),
            ..Variant::DEFAULTS
        },
        Variant {
            name: "late roulette",
            settings: || serde_json::json!({ "roulette_start": 12 }),
            ..Variant::DEFAULTS
        },
        Variant {
            name: "early roulette",
            settings: || serde_json::json!({ "roulette_start": 1 }),
            ..Variant::DEFAULTS
        },
    ],
    foresight: Foresight {
        misses: unseen_by_eye_paths,
        law,
        ..Foresight::PLAIN
    },
    create: |gpu, scene, view, settings| {
        let mut settings: PathTracerSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(PathTracer::new(gpu, scene, view.camera, view.size, settings)?))
    },
};

/// With adaptive samples the error falls as that of independent ones does once pictures have a pilot that is a like part of their samples.
fn law(settings: &Settings) -> Result<Law> {
    let settings: PathTracerSettings = settings.read()?;
    Ok(Law {
        samples_least: match settings.adaptive {
            Adaptive::Off => 1,
            Adaptive::Relative | Adaptive::Absolute => LIKE_PILOTS,
        },
        ..Law::INDEPENDENT
    })
}

/// What a picture may take, of whatever scene.
pub(in crate::techniques) const KERNELS: [&ShaderInfo; 13] = [
    &path_camera::INFO,
    &path_refill::INFO,
    &path_retire::INFO,
    &extend::INFO,
    &path_medium::INFO,
    &path_shade::INFO,
    &compact_count::INFO,
    &compact_scan::INFO,
    &compact_scatter::INFO,
    &shadow::INFO,
    &path_resolve::INFO,
    &path_numbers::INFO,
    &path_resolve_shares::INFO,
];

/// Counters of what is fetched, by [`Fetches::STAGES`](crate::walk::Fetches::STAGES).
const FETCHED_TEXELS: [&str; 4] = ["extend_texels", "medium_texels", "shade_texels", "shadow_texels"];
const FETCHED_BYTES: [&str; 4] = ["extend_bytes", "medium_bytes", "shade_bytes", "shadow_bytes"];

impl Technique for PathTracer {
    forward_to_methods!(PathTracer);

    fn path_set(&self) -> PathSet {
        PathTracer::settings(self).path_set
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let c = PathTracer::counters(self);
        let mut all = BTreeMap::from([
            ("paths", c.paths),
            ("extend_rays", c.extend_rays),
            ("shadow_rays", c.shadow_rays),
            ("rays", c.extend_rays + c.shadow_rays),
            ("waves", c.waves),
            ("slots", self.slots().into()),
            ("stalls", c.stalls),
            ("postponed", c.postponed),
            ("medium_collisions", c.medium_collisions),
            ("null_collisions", c.null_collisions),
            ("density_lookups", c.density_lookups),
        ]);
        if PathTracer::settings(self).count_fetches {
            all.extend(FETCHED_TEXELS.into_iter().zip(c.fetches.texels));
            all.extend(FETCHED_BYTES.into_iter().zip(c.fetches.bytes));
        }
        all
    }

    fn skipped(&self) -> Vec<Skipped> {
        let mut skipped = skipped(&PathTracer::pipelines(self), path_shade::INFO.name, &SURFACE_FEATURES);
        let metal = !skipped.iter().any(|skipped| skipped.what == METAL_LOBES);
        if metal && !PathTracer::settings(self).multiple_scattering {
            let compensation = skipped.iter_mut().find(|skipped| skipped.what == COMPENSATION);
            if let Some(compensation) = compensation {
                compensation.why = "the setting multiple_scattering is off";
            }
        }
        skipped
    }
}

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "BG-3",
    name: "path tracer, surfaces and media: technique `path`",
    role: Role::Technique,
    limits: "Slow where light comes through small specular chains, and blind to those that end in a point or directional light, such as its caustics.",
    sources: &[
        sources::KAJIYA_1986.whole(),
        sources::VEACH_1997.at("chapters 9 and 10"),
        sources::LAINE_2013.whole(),
    ],
    shaders: &["shaders/techniques/path/", "shaders/walk/"],
    path_set: Some("all"),
    bias: Some(Bias::Unbiased),
    tests: &[
        "tests/tests/paths/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
        "tests/tests/paths/path_tracer.rs::a_light_in_a_lambert_sphere_fills_it_evenly",
        "tests/tests/paths/path_tracer.rs::white_objects_vanish_in_a_white_furnace",
        "tests/tests/paths/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
        "tests/tests/paths/path_tracer.rs::environments_light_a_plane_by_their_cosine_integral",
        "tests/tests/paths/determinism.rs::threads_of_the_driver_and_of_the_host_never_show",
        "tests/tests/accel/bounded_steps.rs::a_step_through_a_sparse_grid_is_one_submission_of_bounded_work",
        "tests/tests/accel/bounded_steps.rs::rays_through_equal_triangles_are_parted_and_none_is_lost",
        "tests/tests/paths/fetches.rs::stages_fetch_what_is_counted",
        "tests/tests/paths/fetches.rs::diffuse_scenes_fetch_few_texels_a_segment",
    ],
    experiment: "clerestory agreement",
    api: &["clerestory::techniques::PathTracer"],
    settings: &[
        "clerestory::techniques::PathTracerSettings",
        "clerestory render --technique path",
    ],
    ..Row::of("engine/src/techniques/path/mod.rs")
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_constants_of_the_shading_stage() {
        let constants: Vec<&str> = path_shade::INFO.spec_constants.iter().map(|c| c.name).collect();
        for (i, (name, ..)) in SURFACE_FEATURES.iter().enumerate() {
            assert!(constants.contains(name), "{name} is none of {constants:?}");
            assert!(
                SURFACE_FEATURES[..i].iter().all(|(other, ..)| other != name),
                "{name} is there twice"
            );
        }
        // And nothing that is left out goes unsaid.
        for name in constants.iter().filter(|name| name.starts_with("has_")) {
            assert!(
                SURFACE_FEATURES.iter().any(|(known, ..)| known == name),
                "{name} is not said"
            );
        }
    }
}
