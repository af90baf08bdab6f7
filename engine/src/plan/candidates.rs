//! What can be chosen: techniques with their variants, under the settings that are fixed.

use serde_json::Value;

use super::Candidate;
use crate::scene::SceneProfile;
use crate::techniques::Card;

/// The setting that gives pixels differing numbers of samples, and its value without.
const ADAPTIVE: &str = "adaptive";
const ADAPTIVE_OFF: &str = "off";

/// Every technique with each of its variants that suits the scene. What is fixed is fixed; variants that it makes equal are listed once, and those that it excludes are not.
pub(super) fn candidates<'a>(cards: &[&'a Card], fixed: &Value, profile: &SceneProfile) -> Vec<(&'a Card, Candidate)> {
    let mut found: Vec<(&Card, Candidate)> = Vec::new();
    for &card in cards {
        let defaults = [("defaults", serde_json::json!({}))];
        let variants: Vec<(&'static str, Value)> = if card.variants.is_empty() {
            defaults.into()
        } else {
            let each = card.variants.iter().filter(|variant| (variant.suits)(profile));
            each.map(|variant| (variant.name, (variant.settings)())).collect()
        };
        for (place, (name, settings)) in variants.into_iter().enumerate() {
            let settings = merged(settings, fixed, card);
            let there = |(_, other): &(&Card, Candidate)| other.technique == card.id && other.settings == settings;
            // What is wrong by itself is the first one's to tell.
            let is_sound = place == 0 || card.settings.check(&settings).is_ok();
            if is_sound && !found.iter().any(there) {
                found.push((card, Candidate::of(card, name, settings)));
            }
        }
    }
    found
}

/// Why a technique cannot be chosen where adaptive samples are asked for: its pictures would be another thing, without a word. `None` where they are not, or
/// where it has them.
pub(super) fn lacks_adaptive(card: &Card, fixed: &Value) -> Option<String> {
    let kind = fixed.get(ADAPTIVE)?.as_str()?;
    let asked = kind != ADAPTIVE_OFF && !card.settings.has(ADAPTIVE);
    asked.then(|| format!("it has no setting {ADAPTIVE}, which was asked for as {kind}"))
}

/// A variant's settings under what is fixed; keys that the technique does not have are none of its business.
pub(super) fn merged(mut settings: Value, fixed: &Value, card: &Card) -> Value {
    if let (Some(settings), Some(fixed)) = (settings.as_object_mut(), fixed.as_object()) {
        for (key, value) in fixed.iter().filter(|(key, _)| card.settings.has(key)) {
            settings.insert(key.clone(), value.clone());
        }
    }
    settings
}

impl Candidate {
    /// Before anything is known.
    pub(super) fn of(card: &Card, variant: &'static str, settings: Value) -> Self {
        Self {
            technique: card.id,
            variant,
            settings,
            reason: String::new(),
            misses: String::new(),
            pilot_spp: 0,
            last_pilot_spp: 0,
            pilot_noise: 0.0,
            slope: 0.0,
            lit: false,
            seconds_a_sample: 0.0,
            spp: 0,
            noise: 0.0,
            bias: None,
            bias_at_most: None,
            judged_by: String::new(),
            error: 0.0,
            error_interval: None,
            seconds: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques;

    #[test]
    fn fixed_settings_leave_fewer_candidates() {
        let path = [techniques::by_id("path").unwrap()];
        let profile = SceneProfile::of(&crate::scene::load("builtin:cornell-box").unwrap());
        let free = candidates(&path, &Value::Null, &profile);
        assert!(free.len() > 1, "{free:?}");
        let settings = serde_json::json!({ "sampler": "pcg", "path_set": "direct" });
        let fixed = candidates(&path, &settings, &profile);
        assert!(fixed.len() < free.len(), "{fixed:?}");
        for (_, candidate) in fixed {
            assert_eq!(candidate.settings["sampler"], "pcg");
            assert_eq!(candidate.settings["path_set"], "direct");
        }
    }

    #[test]
    fn variants_that_do_not_suit_the_scene_are_not_tried() {
        let photon = [techniques::by_id("photon").unwrap()];
        let of = |address: &str, fixed: &Value| {
            let profile = SceneProfile::of(&crate::scene::load(address).unwrap());
            let found = candidates(&photon, fixed, &profile).into_iter();
            found.map(|(_, candidate)| candidate.variant).collect::<Vec<_>>()
        };
        assert_eq!(of("builtin:cornell-box", &Value::Null), ["defaults"]);
        let in_fog = of("builtin:fog-box", &Value::Null);
        assert!(in_fog.len() > 1 && in_fog[0] == "defaults", "{in_fog:?}");
        // What is asked for is tried, and as often as it differs.
        let asked = serde_json::json!({ "volume": "march" });
        assert_eq!(of("builtin:fog-box", &asked), ["defaults"]);
        // Beams have no kernels that follow footprints.
        let asked = serde_json::json!({ "volume_kernel": "footprint" });
        assert_eq!(of("builtin:fog-box", &asked), ["defaults"]);
    }

    #[test]
    fn adaptive_samples_are_asked_of_every_technique() {
        let [path, photon] = ["path", "photon"].map(|id| techniques::by_id(id).unwrap());
        for kind in ["relative", "absolute"] {
            let fixed = serde_json::json!({ "adaptive": kind });
            assert_eq!(lacks_adaptive(path, &fixed), None);
            let reason = lacks_adaptive(photon, &fixed).unwrap_or_default();
            assert!(reason.contains("adaptive") && reason.contains(kind), "{reason}");
        }
        for fixed in [
            Value::Null,
            serde_json::json!({}),
            serde_json::json!({ "adaptive": "off" }),
        ] {
            assert_eq!(lacks_adaptive(photon, &fixed), None, "{fixed}");
        }
    }
}
