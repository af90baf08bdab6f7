//! Live maps that are drawn now and then, two in turn, with a cross-fade from one to the next.
//!
//! Sources: N. Greene, "Environment Mapping and Other Applications of World Projections", IEEE CG&A 6(11), 1986 (a map at the place of an object that moves); L. Szirmay-Kalos et al., "Specular Effects on
//! the GPU: State of the Art", CGF 28(6), 2009 (maps that are drawn less often than frames).
//!
//! Every so many frames the scene is drawn into the map that is not shown. In that frame and the next ones what is shown goes over to it in even parts: in the k-th of n
//! frames it is (1 − k/n) of the map before and k/n of the new one, and then the maps change places. Look-ups are linear in texels, so that mixed maps are mixed pictures. The way there is made in
//! place, by 1/(n − k + 1) of what is left each time: there is no third map.
//!
//! Guarantees: where old and new map are equal nothing changes, to the bit; frames without anything to do record nothing. Deterministic.
//!
//! Bias: that of [`LiveProbe`], of a place that was left up to a period and a fade before; what has moved shows twice while one map goes over to the other.

use glam::Vec3;

use super::Preview;
use super::live::LiveProbe;
use super::probe::{LightProbe, LightProbeDesc};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::techniques::preview::probe_fade as kernel;
use crate::gpu::{ComputePipeline, Gpu, PipelineInfo, Recorder, rw_compute_to_compute};
use crate::raster::Surfaces;
use crate::transport::GpuScene;
use crate::{Error, Result};

/// When maps are drawn, and how they come to be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refresh {
    /// Frames from one map to the next, 1 or more.
    pub period: u32,
    /// Frames of a cross-fade, 1 to the period; with one the new map is shown at once.
    pub fade: u32,
}

impl Default for Refresh {
    /// Every eighth frame, faded over three.
    fn default() -> Self {
        Self { period: 8, fade: 3 }
    }
}

/// What a frame does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefreshStep {
    /// Whether a map is drawn.
    pub draws: bool,
    /// Weights of the map before and of the new one in what is shown; they sum to 1.
    pub weights: [f32; 2],
    /// By how much of what is left the map that is shown goes towards the new one: 1 where they change places, `None` where nothing is under way.
    part: Option<f32>,
}

impl Refresh {
    fn check(self) -> Result<()> {
        if self.period == 0 {
            return Err(Error::setting("period", self.period, "is no frame"));
        }
        if !(1..=self.period).contains(&self.fade) {
            let cause = format!("is not 1 to the period, {}", self.period);
            return Err(Error::setting("fade", self.fade, cause));
        }
        Ok(())
    }

    /// What a frame does, by its number from 0 on. The first one draws a map and shows it.
    pub fn step(self, frame: u64) -> RefreshStep {
        let since = (frame % u64::from(self.period)) as u32;
        // There is nothing to come from.
        let fade = if frame < u64::from(self.period) { 1 } else { self.fade };
        let weight = (f64::from(since + 1) / f64::from(fade)).min(1.0) as f32;
        RefreshStep {
            draws: since == 0,
            weights: [1.0 - weight, weight],
            part: (since < fade).then(|| 1.0 / (fade - since) as f32),
        }
    }
}

/// A light probe of a scene that is drawn now and then, and fades from one state to the next.
#[derive(Debug)]
pub struct FadingProbe {
    refresh: Refresh,
    /// The one that is shown, and the one that comes.
    live: [LiveProbe; 2],
    fade: Option<ComputePipeline<kernel::Kernel>>,
    frame: u64,
}

impl FadingProbe {
    /// Allocates two probes and what draws them, as [`LiveProbe::new`].
    ///
    /// # Errors
    /// [`Error::Setting`] for a period or a fade that is none; as [`LiveProbe::new`].
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        preview: &Preview,
        (desc, has_probes): (LightProbeDesc, bool),
        refresh: Refresh,
    ) -> Result<Self> {
        refresh.check()?;
        let live = || LiveProbe::new(gpu, scene, preview, desc, has_probes);
        Ok(Self {
            refresh,
            live: [live()?, live()?],
            fade: (refresh.fade > 1).then(|| gpu.compute_pipeline(&())).transpose()?,
            frame: 0,
        })
    }

    /// What is shown.
    pub fn probe(&self) -> &LightProbe {
        self.live[0].probe()
    }

    /// Frames that were recorded.
    pub fn frames(&self) -> u64 {
        self.frame
    }

    /// The kernels that filter and fade, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.probe().pipelines();
        all.extend(self.fade.iter().map(ComputePipeline::info));
        all
    }

    /// Bytes of both maps and of their pictures.
    pub fn bytes(&self) -> u64 {
        self.live.iter().map(LiveProbe::bytes).sum()
    }

    /// Records what the next frame does, to be submitted in that order: where a map is due, the passes of [`LiveProbe::record`] from a place (metres), and a pass of the fade while one is under way.
    /// Afterwards [`probe`](Self::probe) is visible to compute shaders.
    ///
    /// # Errors
    /// As [`LiveProbe::record`]; nothing has changed then.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        preview: &Preview,
        place: Vec3,
        by: Option<&LightProbe>,
    ) -> Result<RefreshStep> {
        let step = self.refresh.step(self.frame);
        let [shown, coming] = &self.live;
        if step.draws {
            coming.record(recorder, scene, surfaces, preview, place, by)?;
        }
        match (step.part, &self.fade) {
            (Some(part), Some(fade)) if part < 1.0 => record_fade(recorder, fade, part, [shown, coming])?,
            (Some(_), _) => self.live.swap(0, 1),
            (None, _) => {}
        }
        self.frame += 1;
        Ok(step)
    }
}

/// Goes a part of the way from what one probe has filtered to what another one has.
fn record_fade(
    recorder: &mut Recorder,
    fade: &ComputePipeline<kernel::Kernel>,
    part: f32,
    live: [&LiveProbe; 2],
) -> Result<()> {
    let [shown, coming] = live.map(|live| live.probe().filtered().texels());
    recorder.pass("probe: fade", |pass| {
        let set = kernel::Set0 {
            shown: shown.view(),
            coming: coming.view(),
        };
        let count = (shown.bytes() / size_of::<f32>() as u64) as u32;
        // What looked the frame before up has ended.
        pass.barrier(&[rw_compute_to_compute(shown)]);
        pass.dispatch(fade, &[&set], &kernel::Push { count, part }, fade.groups_over(count))?;
        pass.barrier(&[rw_compute_to_compute(shown)]);
        Ok(())
    })
}

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[Row {
    id: "MET-E2",
    name: "a map drawn anew at the place of an object that moves, each frame or now and then, with a cross-fade from one map to the next",
    role: Role::PartOf("CL-LIVE-MAP"),
    limits: "A fresh map leaves a sphere of a third of a room's half width ten degrees of parallax; what moves shows twice during a fade, which takes a second map.",
    sources: &[sources::GREENE_1986.whole(), sources::SZIRMAY_KALOS_2009.whole()],
    shaders: &["shaders/techniques/preview/probe_fade.comp"],
    bias: Some(Bias::Biased(
        "no parallax beside its place, which may have been left a period before",
    )),
    tests: &[
        "engine/src/techniques/preview/fading.rs::weights_sum_to_one_and_fades_go_evenly",
        "tests/tests/preview/fading.rs::a_scene_at_rest_shows_no_change",
        "tests/tests/preview/fading.rs::pictures_go_over_in_even_steps",
        "tests/tests/preview/fading.rs::refreshes_that_cannot_be_are_refused",
        "tests/tests/preview/bits.rs::threads_of_the_driver_never_show",
        "tests/tests/preview/live.rs::deviations_beside_the_middle_are_parallax",
        "engine/src/maps/impostor/tests/searches.rs::a_fresh_map_leaves_parallax",
    ],
    api: &["clerestory::techniques::preview::FadingProbe"],
    settings: &["clerestory::techniques::preview::Refresh"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_fades_go_evenly() {
        for (period, fade) in [(1, 1), (4, 1), (4, 3), (4, 4), (9, 7)] {
            let refresh = Refresh { period, fade };
            refresh.check().expect("a refresh");
            // The share of the newest map in what is shown, as the parts make it.
            let mut newest = 0.0f64;
            for frame in 0..u64::from(3 * period) {
                let step = refresh.step(frame);
                assert_eq!(step.weights[0] + step.weights[1], 1.0);
                assert_eq!(step.draws, frame % u64::from(period) == 0);
                if step.draws {
                    newest = 0.0;
                }
                newest += f64::from(step.part.unwrap_or(0.0)) * (1.0 - newest);
                assert!(
                    (newest - f64::from(step.weights[1])).abs() < 1e-6,
                    "{frame}: {newest} {step:?}"
                );
                let since = (frame % u64::from(period)) as u32;
                let of = if frame < u64::from(period) { 1 } else { fade };
                let expected = f64::from((since + 1).min(of)) / f64::from(of);
                assert!((newest - expected).abs() < 1e-6, "{frame}: {newest}, not {expected}");
            }
        }
        for (period, fade, name) in [(0, 1, "period"), (3, 0, "fade"), (3, 4, "fade")] {
            let error = Refresh { period, fade }.check().expect_err(name).to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
