//! Settings of photon kernels, and pictures with them in turns: errors against a reference by the path tracer, and seconds.

use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Result, scene};
use serde_json::{Value, json};

use crate::experiments::measures::Context;
use crate::experiments::reference::SEED;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

/// Pixels on a side; in a smoke run, also the samples per pixel of references, and photons of a pass whatever settings say.
const SIDE: u32 = 20;
const SMOKE_PICTURE: (u32, u32) = (8, 256);
const SMOKE_PHOTONS: u32 = 1 << 12;
const TURNS: usize = 5;
/// Passes that say how long one takes.
const FEW_PASSES: u32 = 2;
/// Curves count as at least that steep where they are read off beyond their budgets.
const FLATTEST: f64 = -0.1;

/// Kernels of one radius.
pub const FIXED: &str = "fixed";
/// Kernels from footprints.
pub const FOOTPRINTS: &str = "footprints";
/// What default settings are called.
pub const DEFAULTS: &str = "defaults";

/// Radii as shares of the scene's diagonal, spreads, dampenings, and photons of a pass that are tried.
const RADII: [f64; 4] = [0.005, 0.01, 0.02, 0.04];
const SPREADS: [f64; 4] = [5.0, 10.0, 20.0, 40.0];
const DAMPENINGS: [f64; 2] = [0.25, 1.0];
const PHOTONS: [u32; 2] = [1 << 14, 1 << 16];

/// Settings of one kind of kernels, in words and, given the scene's diagonal, m, for the technique.
pub struct Candidate {
    /// Kind of kernels.
    pub kernels: &'static str,
    /// Settings in words.
    pub words: String,
    settings: Box<dyn Fn(f64) -> Value>,
}

impl Candidate {
    /// As they are shipped.
    pub fn defaults(kernels: &'static str) -> Self {
        let shape = if kernels == FIXED { "fixed" } else { "principal" };
        Self {
            kernels,
            words: DEFAULTS.into(),
            settings: Box::new(move |_| json!({ "path_set": "indirect", "shape": shape })),
        }
    }

    fn fixed(share: f64, photons: u32) -> Self {
        Self {
            kernels: FIXED,
            words: format!("radius {share} of the diagonal, {photons} photons"),
            settings: Box::new(
                move |diagonal| json!({ "path_set": "indirect", "shape": "fixed", "radius": share * diagonal, "photons": photons }),
            ),
        }
    }

    fn footprints(spread: f64, dampening: f64, photons: u32) -> Self {
        Self {
            kernels: FOOTPRINTS,
            words: format!("spread {spread}, dampening {dampening}, {photons} photons"),
            settings: Box::new(
                move |_| json!({ "path_set": "indirect", "shape": "principal", "spread": spread, "dampening": dampening, "photons": photons }),
            ),
        }
    }

    /// All that are tried; in a smoke run one of each kind.
    pub fn all(context: &Context<'_>) -> Vec<Self> {
        let mut all = Vec::new();
        for photons in context.first(&PHOTONS, 1) {
            let radii = context.first(&RADII, 1).iter();
            all.extend(radii.map(|share| Self::fixed(*share, *photons)));
            for dampening in context.first(&DAMPENINGS, 1) {
                let spreads = context.first(&SPREADS, 1).iter();
                all.extend(spreads.map(|spread| Self::footprints(*spread, *dampening, *photons)));
            }
        }
        all
    }
}

/// A picture's relative RMSE, its seconds, and the reference's own error over that RMSE.
pub type Scored = [f64; 3];

/// A scene with its reference.
pub struct Stage {
    renderer: Renderer,
    reference: Rendered,
    base: RenderOptions,
    diagonal: f64,
}

impl Stage {
    /// Renders the reference with so many samples per pixel; `None` when it was stopped.
    ///
    /// # Errors
    /// Those of scenes and techniques.
    pub fn new(context: &Context<'_>, gpu: &Gpu, address: &str, reference_spp: u32) -> Result<Option<Self>> {
        let renderer = Renderer::new(gpu, &scene::load(address)?)?;
        let (side, spp) = context.pick((SIDE, reference_spp), SMOKE_PICTURE);
        let base = RenderOptions {
            size: [side; 2],
            ..RenderOptions::default()
        };
        let of_reference = RenderOptions {
            technique: Some("path".into()),
            spp,
            seed: SEED,
            settings: json!({ "path_set": "indirect", "sampler": "pcg" }).into(),
            ..base.clone()
        };
        let Some(reference) = render(&renderer, &of_reference, context.watch)? else {
            return Ok(None);
        };
        let [lower, upper] = renderer.gpu_scene().bounds();
        let diagonal = f64::from((upper - lower).length());
        Ok(Some(Self {
            renderer,
            reference,
            base,
            diagonal,
        }))
    }

    /// `None` when it was stopped.
    fn picture(&self, context: &Context<'_>, of: &Candidate, passes: u32, seed: u32) -> Result<Option<Scored>> {
        let mut settings = (of.settings)(self.diagonal);
        if let Some(photons) = context.pick(None, Some(SMOKE_PHOTONS)) {
            settings["photons"] = photons.into();
        }
        let options = RenderOptions {
            technique: Some("photon".into()),
            spp: passes,
            seed,
            settings: settings.into(),
            ..self.base.clone()
        };
        let Some(rendered) = render(&self.renderer, &options, context.watch)? else {
            return Ok(None);
        };
        let found = unbiased::measure(&rendered.picture, &self.reference.picture)?;
        let error = unbiased::relative_rmse(&found);
        let of_reference = found.reference_relative_mse.sqrt() / error;
        Ok(Some([error, rendered.report.render_seconds, of_reference]))
    }

    /// Pictures of each candidate at each budget, seconds, in turns; by candidate, then budget. `None` when it was stopped.
    ///
    /// # Errors
    /// Those of techniques.
    pub fn pictures(
        &self,
        context: &Context<'_>,
        of: &[&Candidate],
        budgets: &[f64],
    ) -> Result<Option<Vec<Vec<Vec<Scored>>>>> {
        let mut tasks = Vec::new();
        for (i, candidate) in of.iter().enumerate() {
            // The first one compiles the kernels.
            let mut seconds = 0.0;
            for _ in 0..2 {
                let Some([_, taken, _]) = self.picture(context, candidate, FEW_PASSES, 0)? else {
                    return Ok(None);
                };
                seconds = taken / f64::from(FEW_PASSES);
            }
            let passes =
                |budget: &f64| context.pick((budget / seconds).round().max(1.0), (10.0 * budget).ceil()) as u32;
            tasks.extend(budgets.iter().map(|budget| (i, passes(budget))));
        }
        let mut seed = 0;
        let turns = context.in_turns(TURNS, tasks.len(), |task| {
            let (candidate, passes) = tasks[task];
            seed += 1;
            self.picture(context, of[candidate], passes, seed)
        })?;
        let turns: Option<Vec<Vec<Scored>>> = turns.into_iter().map(|turns| turns.into_iter().collect()).collect();
        Ok(turns.map(|all| all.chunks(budgets.len()).map(<[_]>::to_vec).collect()))
    }
}

/// Time to an error on the line in logarithms through the two budgets next to it, which goes on beyond them.
pub fn time_to(error: f64, curve: &[[f64; 2]]) -> f64 {
    let crossing = curve.windows(2).find(|pair| pair[1][0] <= error);
    let Some([[e0, s0], [e1, s1]]) = crossing.or(curve.windows(2).last()) else {
        return f64::NAN;
    };
    let slope = ((e1 / e0).ln() / (s1 / s0).ln()).min(FLATTEST);
    s1 * (error / e1).powf(1.0 / slope)
}

/// Error and seconds at each budget, of one turn.
pub fn curve(budgets: &[Vec<Scored>], turn: usize) -> Vec<[f64; 2]> {
    budgets.iter().map(|turns| [turns[turn][0], turns[turn][1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_off_power_laws_within_and_beyond_budgets() {
        let curve = [0.1, 0.4, 1.2].map(|s: f64| [s.powf(-1.0 / 3.0), s]);
        for seconds in [0.05, 0.1, 0.2, 1.0, 1.2, 2.0_f64] {
            let found = time_to(seconds.powf(-1.0 / 3.0), &curve);
            // Before the first budget the line is that through the first two.
            assert!((found / seconds - 1.0).abs() < 1e-12, "{seconds}: {found}");
        }
        assert!(time_to(0.5, &[]).is_nan());
    }
}
