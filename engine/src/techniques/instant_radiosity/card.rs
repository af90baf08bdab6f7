//! Virtual point lights as a technique.

use std::collections::BTreeMap;

use super::renderer::VirtualLights;
use super::settings::VirtualLightSettings;
use super::{cut_tree, gather, medium_gather, selection};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::techniques::instant_radiosity::{
    vpl_append, vpl_gather, vpl_medium, vpl_medium_append, vpl_medium_gather,
};
use crate::gpu::shaders::techniques::path::path_shade;
use crate::gpu::shaders::techniques::photon_mapping::{photon_emit, photon_glow, photon_scatter};
use crate::scene::SceneProfile;
use crate::settings::{Settings, SettingsDecl};
use crate::techniques::path::card as path;
use crate::techniques::skipped::skipped;
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant, reasons};
use crate::transport::{PathSet, SURFACE_FEATURES};
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "vpl",
    summary: "instant radiosity: indirect light as that of virtual point lights, new ones for each pass, with shadow rays and a compensated bound",
    rows: &[ROWS, gather::ROWS, medium_gather::ROWS, cut_tree::ROWS, selection::ROWS],
    bias: BIAS,
    needs: &[],
    kernels: &[&path::KERNELS, &KERNELS],
    path_set: PathSet::LIT_OFF_NO_MIRROR,
    refusals,
    settings: SettingsDecl::of::<VirtualLightSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight {
        law,
        ..Foresight::PLAIN
    },
    create: |gpu, scene, view, settings| {
        let mut settings: VirtualLightSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(VirtualLights::new(
            gpu,
            scene,
            view.camera,
            view.size,
            settings,
        )?))
    },
};

/// Passes are independent, and all pixels have the lights of one.
fn law(settings: &Settings) -> Result<Law> {
    let settings: VirtualLightSettings = settings.read()?;
    Ok(Law {
        samples_a_pass: settings.samples_per_pass,
        shares_noise: true,
        ..Law::INDEPENDENT
    })
}

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    let from_infinity = profile.has_environment() || profile.lights.directional > 0;
    reasons(&[
        (
            profile.media.emits_endlessly,
            "the scene has an endless participating medium that emits everywhere, more than walks carry",
        ),
        (
            profile.media.surrounding && from_infinity,
            "the scene has endless participating media and light from infinity, which no walk brings through them",
        ),
        (
            profile.has_unlit,
            "unlit surfaces send light that no walk from the lights brings",
        ),
    ])
}

/// What a picture may take with default settings, of whatever scene, beside what eye paths do.
const KERNELS: [&ShaderInfo; 8] = [
    &photon_emit::INFO,
    &photon_glow::INFO,
    &photon_scatter::INFO,
    &vpl_append::INFO,
    &vpl_gather::INFO,
    &vpl_medium::INFO,
    &vpl_medium_append::INFO,
    &vpl_medium_gather::INFO,
];

impl Technique for VirtualLights {
    forward_to_methods!(VirtualLights);

    fn path_set(&self) -> PathSet {
        VirtualLights::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let (eye, c) = (self.eye_counters(), self.counts());
        BTreeMap::from([
            ("paths", eye.paths),
            ("extend_rays", eye.extend_rays),
            ("shadow_rays", eye.shadow_rays + c.gather.shadow_rays),
            ("walk_rays", c.walks.rays),
            (
                "rays",
                eye.extend_rays + eye.shadow_rays + c.gather.shadow_rays + c.walks.rays,
            ),
            ("waves", eye.waves),
            ("stalls", eye.stalls),
            ("postponed", eye.postponed),
            ("passes", c.passes),
            ("walks", c.walks.emitted),
            ("walks_escaped", c.walks.escaped),
            ("walks_absorbed", c.walks.absorbed),
            ("walk_collisions", c.walks.collisions),
            ("virtual_lights", c.lights),
            ("gathers", c.gather.gathers),
            ("connections", c.gather.connections),
            ("light_nodes", c.gather.nodes),
        ])
    }

    fn skipped(&self) -> Vec<Skipped> {
        let pipelines = VirtualLights::pipelines(self);
        let mut skipped = skipped(&pipelines, path_shade::INFO.name, &SURFACE_FEATURES);
        if !self.has_lights() {
            skipped.push(Skipped {
                what: "virtual lights",
                why: "no light can be chosen, or the picture has nothing of theirs",
            });
        } else if let Some(why) = VirtualLights::settings(self).leaves_out() {
            skipped.push(Skipped {
                what: "light over edges shorter than the bound",
                why,
            });
        }
        if self.has_lights()
            && let Some(why) = VirtualLights::settings(self).passes_over()
        {
            skipped.push(Skipped {
                what: "virtual lights of little potential",
                why,
            });
        }
        skipped
    }
}

const BIAS: Bias = Bias::Unbiased;
/// [`PathSet::LIT_OFF_NO_MIRROR`] as path sets are written.
const DISPLAYED: &str = "L((.*V)?|(.*[^S])?[DG])S*E";

/// Rows of the catalogue.
const ROWS: &[Row] = &[
    Row {
        id: "SVO-G0",
        name: "technique `vpl`: direct light and mirrors by rays, all else from virtual point lights, new for each pass (instant radiosity)",
        role: Role::Technique,
        limits: "Refuses scenes with unlit surfaces, and with endless media that emit or have light from infinity; light off a mirror or through smooth glass onto the first rough surface is no part of the picture, and light that a mirror sends into a medium is found by eye paths alone; biased where a bound is not compensated, by a limited number of steps, or by lights of little potential that are left out; walks that go on over surfaces with interpolated or mapped normals scatter otherwise than eye paths, which bend these normals towards the eye; virtual lights within rounding of an edge shine past it; all pixels of a pass share its noise; of emitters that light sampling leaves out, slivers and those behind others in one place, only what comes directly is there.",
        sources: &[
            sources::KELLER_1997.whole(),
            sources::KOLLIG_KELLER_2006.whole(),
            sources::SUN_2015.at("§2.1"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/",
            "shaders/techniques/path/",
            "shaders/techniques/photon_mapping/photon_emit.comp",
            "shaders/techniques/photon_mapping/photon_scatter.comp",
            "shaders/walk/",
        ],
        path_set: Some(DISPLAYED),
        bias: Some(BIAS),
        tests: &[
            "tests/tests/instant_radiosity/agreement.rs::unbounded_lights_agree_with_the_path_tracer_in_a_sphere",
            "tests/tests/instant_radiosity/agreement.rs::materials_of_all_kinds_agree_with_the_path_tracer",
            "tests/tests/instant_radiosity/agreement.rs::bodies_that_absorb_agree_with_the_path_tracer",
            "tests/tests/instant_radiosity/edge_cases.rs::parts_of_the_light_sum_to_the_whole",
            "tests/tests/instant_radiosity/edge_cases.rs::parts_of_the_light_are_whole_with_a_compensated_bound",
            "tests/tests/instant_radiosity/edge_cases.rs::waves_shrink_until_gathering_fits_beside_them",
            "tests/tests/instant_radiosity/edge_cases.rs::scenes_without_lights_or_reflection_have_no_virtual_light",
            "tests/tests/instant_radiosity/edge_cases.rs::lights_beyond_a_buffer_are_refused_with_their_number",
            "tests/tests/instant_radiosity/edge_cases.rs::what_cannot_be_modelled_is_refused_by_name",
            "tests/tests/instant_radiosity/many_light/scales.rs::virtual_lights_know_no_lengths",
            "tests/tests/instant_radiosity/media.rs::lights_at_collisions_agree_with_the_path_tracer",
        ],
        api: &["clerestory::techniques::instant_radiosity::VirtualLights"],
        settings: &[
            "clerestory::techniques::instant_radiosity::VirtualLightSettings",
            "clerestory render --technique vpl",
        ],
        ..Row::of("engine/src/techniques/instant_radiosity/renderer.rs")
    },
    Row {
        id: "MET-V1",
        name: "virtual lights by random or fractional walks: power that arrives, its way and the surface, in records of 64 bytes in a fixed order",
        role: Role::PartOf("SVO-G0"),
        limits: "Light sources are no virtual lights themselves: their light is direct light, which has shadow rays of its own.",
        sources: &[sources::KELLER_1997.whole(), sources::ENGELHARDT_2013.at("§4.5")],
        shaders: &[
            "shaders/transport/emission.glsl",
            "shaders/techniques/photon_mapping/photon_emit.comp",
            "shaders/techniques/photon_mapping/photon_scatter.comp",
            "shaders/techniques/instant_radiosity/vpl_append.comp",
            "shaders/techniques/instant_radiosity/virtual_light.glsl",
        ],
        tests: &[
            "tests/tests/instant_radiosity/walks.rs::power_falls_by_the_albedo_with_each_bounce",
            "tests/tests/instant_radiosity/walks.rs::fractional_walks_survive_by_number_and_bring_the_same_power",
            "tests/tests/instant_radiosity/walks.rs::lights_are_the_same_on_every_run_and_others_in_every_pass",
            "tests/tests/instant_radiosity/walks.rs::every_kind_of_light_leaves_virtual_lights",
            "tests/tests/instant_radiosity/scattering.rs::alpha_is_drawn_anew_for_every_place_and_pass",
            "tests/tests/instant_radiosity/scattering.rs::leaning_normals_send_light_to_whoever_sees_them_from_behind",
            "tests/tests/instant_radiosity/scattering.rs::walks_go_on_over_leaning_normals_as_eye_paths_do",
            "tests/tests/instant_radiosity/scattering.rs::sun_and_sky_agree_with_the_path_tracer",
        ],
        settings: &["walks", "fractional", "sampler"],
        ..Row::of("engine/src/techniques/instant_radiosity/append.rs")
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_set_is_that_of_its_expression() {
        assert_eq!(CARD.path_set, "!L.*S[DG]S*E".parse().unwrap());
        assert_eq!(CARD.path_set, DISPLAYED.parse().unwrap());
    }
}
