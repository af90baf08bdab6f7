//! The passes of a wave of eye paths beside those of all walks: what each stage reads, and the barriers between them.

use super::adaptive::AdaptiveSamples;
use super::kept::KeptBySlot;
use super::pipelines::Pipelines;
use super::settings::PathTracerSettings;
use super::wave::Wave;
use crate::Result;
use crate::film::GpuFilm;
use crate::gpu::shaders::constants::{NO_MEDIUM, OUTSIDE};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::path::{path_camera, path_resolve, path_shade};
use crate::gpu::{Access, Recorder, TexelView};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::transport::edge_bound::EdgeBound;
use crate::walk::{ArrivalStage, Bounce, WalkStages, WaveBuffers, stage_barrier};
use glam::DVec3;

/// What the stages of eye paths need: all of a path tracer but its walker.
pub(super) struct EyeStages<'a> {
    pub scene: &'a GpuScene,
    pub settings: &'a PathTracerSettings,
    pub frame: &'a CameraFrame,
    pub eye: DVec3,
    pub pipelines: &'a Pipelines,
    pub film: &'a GpuFilm,
    pub adaptive: Option<&'a AdaptiveSamples>,
    pub kept: &'a KeptBySlot,
    pub light_tree: Option<&'a TexelView>,
    pub edge_bound: EdgeBound,
    pub wave: Wave,
    pub arrival: Option<&'a dyn ArrivalStage>,
    /// The last wave, until it has reached the film.
    pub pending: &'a mut Option<Wave>,
}

impl EyeStages<'_> {
    /// What the stages of a bounce are told, both the same.
    fn push(&self) -> path_shade::Push {
        let (scene, settings) = (self.scene, self.settings);
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        path_shade::Push {
            scene_lower: lower,
            path_set: settings.path_set.packed(),
            scene_upper: upper,
            roulette_cap: settings.roulette_cap,
            key: self.wave.key(settings.seed),
            roulette_start: settings.roulette_start,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            accepting: settings.path_set.accepting(),
            successors: settings.path_set.successors(),
            edge_bound: self.edge_bound.value(),
        }
    }
}

impl WalkStages for EyeStages<'_> {
    /// The last wave's way to the film.
    fn record_before(&mut self, recorder: &mut Recorder, buffers: &WaveBuffers) -> Result<()> {
        match &*self.pending {
            Some(pending) => {
                let target = ResolveTarget {
                    film: self.film,
                    adaptive: self.adaptive,
                };
                record_resolve(recorder, self.pipelines, target, buffers, self.kept, pending)
            }
            None => Ok(()),
        }
    }

    fn submitted(&mut self) {
        *self.pending = None;
    }

    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        if let Some(adaptive) = self.adaptive {
            adaptive.record_numbers(recorder, &self.film.bands()[self.wave.band], &self.wave)?;
        }
        let v = self.frame;
        let push = path_camera::Push {
            origin: v.origin,
            half_width: v.half_width,
            right: v.right,
            half_height: v.half_height,
            up: v.up,
            lens_radius: v.lens_radius,
            forward: v.forward,
            focus_distance: v.focus_distance,
            width: self.film.size()[0],
            height: self.film.size()[1],
            slot_count: self.wave.paths(),
            interior: self.scene.body_around(self.eye).unwrap_or(OUTSIDE),
            key: self.wave.key(self.settings.seed),
        };
        let camera = &self.pipelines.camera;
        recorder.pass("path: camera", |pass| {
            let groups = [camera.groups_for(self.wave.paths()), 1, 1];
            pass.dispatch(camera, &[wave, &self.kept.set()], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn arrival(&self) -> Option<&dyn ArrivalStage> {
        self.arrival
    }

    /// What happens on the way through media, and where paths have arrived.
    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let p = self.pipelines;
        let (scene, items, push) = (
            self.scene.light_tree_set(self.light_tree),
            bounce.places.items,
            self.push(),
        );
        if let Some(medium) = &p.medium {
            recorder.pass("path: medium", |pass| {
                let (media, push) = (self.scene.media_set(), bytemuck::cast(push));
                pass.dispatch_indirect(medium, &[&bounce.wave, &self.kept.set(), &scene, &media], &push, items)?;
                stage_barrier(pass);
                Ok(())
            })?;
        }
        recorder.pass("path: shade", |pass| {
            pass.dispatch_indirect(&p.shade, &[&bounce.wave, &scene, &self.kept.set()], &push, items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// The shadow rays, which decide nothing but what is gathered.
    fn record_waiting(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        if self.scene.has_lights() {
            bounce.record_shadow(recorder)
        } else {
            Ok(())
        }
    }
}

/// Where a wave's samples go.
#[derive(Clone, Copy)]
pub(super) struct ResolveTarget<'a> {
    pub film: &'a GpuFilm,
    pub adaptive: Option<&'a AdaptiveSamples>,
}

/// A wave's way to the film.
pub(super) fn record_resolve(
    recorder: &mut Recorder,
    pipelines: &Pipelines,
    target: ResolveTarget<'_>,
    buffers: &WaveBuffers,
    kept: &KeptBySlot,
    wave: &Wave,
) -> Result<()> {
    let band = &target.film.bands()[wave.band];
    let (walks, kept) = (buffers.set(0), kept.set());
    recorder.pass("path: resolve", |pass| {
        if let Some(adaptive) = target.adaptive {
            adaptive.resolve(pass, &walks, &kept, band, wave)?;
        } else {
            let push = path_resolve::Push {
                first_film_pixel: wave.first_pixel - band.first_pixel(),
                pixel_count: wave.pixels,
                sample_count: wave.samples,
            };
            let groups = [pipelines.resolve.groups_for(wave.pixels), 1, 1];
            pass.dispatch(&pipelines.resolve, &[&walks, &kept, &band.set()], &push, groups)?;
        }
        pass.memory_barrier(
            Access::COMPUTE,
            Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
        );
        Ok(())
    })
}
