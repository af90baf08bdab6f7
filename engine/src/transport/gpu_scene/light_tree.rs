//! The tree of a scene's lights, made when a technique first asks for it: what it is made of, and its copy on the device.

use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DVec3, Vec3};

use crate::Result;
use crate::gpu::ash::vk;
use crate::gpu::{Category, Gpu, TexelView};
use crate::scene::LightKind;
use crate::transport::environment::luminance;
use crate::transport::light_tree::{FixedLight, LightBounds, LightCone, NearLight, build_light_tree};

/// What a tree of a scene's lights is made of.
#[derive(Debug, Default)]
pub(super) struct TreeOfLights {
    state: Mutex<State>,
    /// Weight of the choice of a light that has a place.
    near_weight: f64,
    fixed: Vec<FixedLight>,
    /// Of all records.
    light_count: usize,
}

#[derive(Debug, Default)]
struct State {
    near: Vec<NearLight>,
    /// With whether lights have moved since it was made.
    on_device: Option<(TexelView, bool)>,
}

/// A triangle that emits `radiance`, luminance, from its front or from both sides.
pub(super) fn triangle_bounds([a, b, c]: [DVec3; 3], radiance: f64, double_sided: bool) -> LightBounds {
    let normal = (b - a).cross(c - a);
    let cone = match normal.try_normalize() {
        Some(normal) if !double_sided => LightCone::of_front(normal),
        _ => LightCone::ALL,
    };
    LightBounds {
        lower: a.min(b).min(c),
        upper: a.max(b).max(c),
        cone,
        strength: radiance * 0.5 * normal.length(),
    }
}

/// Those of a light without area; `None` for one without a place.
pub(super) fn punctual_bounds(kind: &LightKind) -> Option<LightBounds> {
    let at = |position: Vec3, cone, intensity: Vec3| LightBounds {
        lower: position.as_dvec3(),
        upper: position.as_dvec3(),
        cone,
        strength: luminance(intensity.as_dvec3()),
    };
    match *kind {
        LightKind::Point { position, intensity } => Some(at(position, LightCone::ALL, intensity)),
        LightKind::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
        } => {
            let cone = LightCone {
                axis: direction.as_dvec3(),
                spread: inner.into(),
                reach: (f64::from(outer) - f64::from(inner)).max(0.0),
            };
            Some(at(position, cone, intensity))
        }
        LightKind::Directional { .. } => None,
    }
}

impl TreeOfLights {
    /// Of the lights whose `bounds`, or `None` for distant ones, and weights of the choice these are.
    pub fn new(bounds: &[Option<LightBounds>], weights: &[f64]) -> Self {
        let (mut near, mut fixed) = (Vec::new(), Vec::new());
        let mut near_weight = 0.0;
        for (light, (bounds, &weight)) in (0u32..).zip(bounds.iter().zip(weights)) {
            if let Some(bounds) = *bounds {
                near.push(NearLight { light, bounds });
                near_weight += weight;
            } else {
                fixed.push(FixedLight { light, weight });
            }
        }
        Self {
            state: Mutex::new(State { near, on_device: None }),
            near_weight,
            fixed,
            light_count: bounds.len(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Each change is one assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lights that have a place.
    pub fn near_count(&self) -> usize {
        self.state().near.len()
    }

    /// Keeps what a light of the scene has become.
    pub fn moved(&self, light: u32, kind: &LightKind) {
        let mut state = self.state();
        let found = state.near.binary_search_by_key(&light, |near| near.light);
        if let (Ok(place), Some(bounds)) = (found, punctual_bounds(kind)) {
            state.near[place].bounds = bounds;
            if let Some((_, is_stale)) = &mut state.on_device {
                *is_stale = true;
            }
        }
    }

    /// The tree on the device, made or brought up to date; `None` where no light has a place.
    pub fn on_device(&self, gpu: &Gpu) -> Result<Option<TexelView>> {
        let mut state = self.state();
        if let Some((texels, false)) = &state.on_device {
            return Ok(Some(texels.clone()));
        }
        if state.near.is_empty() {
            return Ok(None);
        }
        let tree = build_light_tree(&state.near, self.near_weight, &self.fixed, self.light_count).bytes();
        let texels = match &state.on_device {
            // As many nodes as before, in the place where kernels read them.
            Some((texels, _)) => {
                gpu.upload(texels.buffer(), 0, &tree)?;
                texels.clone()
            }
            None => gpu.texels_with("light tree", Category::Light, vk::Format::R32G32B32A32_UINT, &tree)?,
        };
        state.on_device = Some((texels.clone(), false));
        Ok(Some(texels))
    }
}
