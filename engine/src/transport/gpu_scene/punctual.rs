//! The scene's lights without area and their records in the lights' table, so that a light can move without a new scene.

use std::sync::Mutex;

use super::lights::light_record;
use crate::gpu::shaders::types::SceneLight;
use crate::scene::LightKind;
use crate::scene::check::light_is_sound;
use crate::transport::environment::luminance;
use crate::transport::lights::light_power;
use crate::{Error, Result};

/// Where the records of [`Scene::lights`](crate::scene::Scene::lights) are.
#[derive(Debug)]
pub(super) struct PunctualLights {
    lights: Vec<Placed>,
    /// As they are now.
    kinds: Mutex<Vec<LightKind>>,
    /// Of the scene's bounding sphere, m.
    radius: f64,
}

#[derive(Debug)]
struct Placed {
    /// Index of its record; a light without power has none.
    record: Option<u32>,
    /// [`SceneLight::kind`].
    kind: u32,
    /// W of luminance.
    power: f64,
}

impl PunctualLights {
    pub fn new(radius: f64) -> Self {
        Self {
            lights: Vec::new(),
            kinds: Mutex::default(),
            radius,
        }
    }

    /// Takes the scene's next light, whose record would be the one of that index; its power, W of luminance, with which it has a record.
    pub fn add(&mut self, kind: &LightKind, record: usize) -> f64 {
        let power = luminance(light_power(kind, self.radius));
        self.kinds().push(*kind);
        self.lights.push(Placed {
            record: (power > 0.0).then_some(record as u32),
            kind: light_record(kind).kind,
            power,
        });
        power
    }

    fn kinds(&self) -> std::sync::MutexGuard<'_, Vec<LightKind>> {
        // The list is whole whatever its last user did.
        self.kinds.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Those with power.
    pub fn shining(&self) -> Vec<LightKind> {
        let kinds = self.kinds();
        let all = kinds.iter().zip(&self.lights);
        all.filter(|(_, placed)| placed.record.is_some())
            .map(|(kind, _)| *kind)
            .collect()
    }

    /// Keeps what a light has become.
    pub fn keep(&self, light: usize, kind: &LightKind) {
        if let Some(kept) = self.kinds().get_mut(light) {
            *kept = *kind;
        }
    }

    /// The record of a light that has become `kind`, and its index.
    pub fn moved(&self, light: usize, kind: &LightKind) -> Result<(SceneLight, u32)> {
        let refused = |cause: String| Err(Error::setting("light", light, cause));
        let Some(placed) = self.lights.get(light) else {
            return refused(format!("does not exist: the scene has {}", self.lights.len()));
        };
        let Some(index) = placed.record else {
            return refused("has no power, so it is not one of the lights to choose among".into());
        };
        if !light_is_sound(kind) {
            return refused(
                "would hold a number that is not finite, a negative intensity or a direction of another length than 1"
                    .into(),
            );
        }
        let record = light_record(kind);
        if record.kind != placed.kind {
            return refused("would be of another kind: the scene must be uploaded again".into());
        }
        let power = luminance(light_power(kind, self.radius));
        if power.to_bits() != placed.power.to_bits() {
            return refused(format!(
                "would have {power} W instead of {} W, but lights are chosen by power: the scene must be uploaded again",
                placed.power
            ));
        }
        Ok((record, index))
    }
}
