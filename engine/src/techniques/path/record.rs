//! The passes of a wave: what each stage reads, and the barriers between them.

use super::pipelines::TracePipelines;
use super::stages::{WaveKey, indirect, stage_barrier};
use super::wave::{Status, Wave};
use super::{ArrivalStage, PathTracer, Places};
use crate::Result;
use crate::gpu::shaders::constants::{NO_MEDIUM, OUTSIDE};
use crate::gpu::shaders::transport::{
    path_camera, path_medium, path_resolve, path_shade, path_shadow_alpha, path_shadow_media, path_shadow_media_alpha,
};
use crate::gpu::{Access, Recorder};

impl PathTracer {
    pub(super) fn record_camera(&self, recorder: &mut Recorder, wave: &Wave) -> Result<()> {
        let v = &self.frame;
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
            first_pixel: wave.first_pixel,
            pixel_count: wave.pixels,
            first_sample: wave.first_sample,
            sample_count: wave.samples,
            seed: self.settings.seed,
            interior: self.scene.body_around(self.eye).unwrap_or(OUTSIDE),
        };
        recorder.pass("path: camera", |pass| {
            let groups = self.pipelines.camera.groups_for(wave.pixels * wave.samples);
            // Its output is the input of the first bounce, whose parity is 0.
            pass.dispatch(&self.pipelines.camera, &[&self.buffers.set(1)], &push, [groups, 1, 1])?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// One bounce: rays, what happens where they arrive, the next queue, and the shadow rays, which decide nothing but what is gathered.
    pub(super) fn record_bounce(
        &self,
        recorder: &mut Recorder,
        wave: &Wave,
        parity: usize,
        trace: &TracePipelines,
        arrival: Option<&dyn ArrivalStage>,
    ) -> Result<()> {
        let paths = self.buffers.set(parity);
        let items = indirect(&self.buffers, std::mem::offset_of!(Status, item_groups));
        let path_media = self.buffers.media_set();
        recorder.pass("path: extend", |pass| {
            trace.record_extend(pass, &self.scene, &paths, &path_media, self.key(wave), items)
        })?;
        self.record_arrivals(recorder, wave, parity, arrival)
    }

    /// What happens where the rays of a bounce have arrived, and the next queue.
    pub(super) fn record_arrivals(
        &self,
        recorder: &mut Recorder,
        wave: &Wave,
        parity: usize,
        arrival: Option<&dyn ArrivalStage>,
    ) -> Result<()> {
        let p = &self.pipelines;
        let paths = self.buffers.set(parity);
        let scene = self.scene.scene_set();
        let items = indirect(&self.buffers, std::mem::offset_of!(Status, item_groups));
        let path_media = self.buffers.media_set();
        let surrounding = self.scene.surrounding().unwrap_or(NO_MEDIUM);
        if let Some(arrival) = arrival {
            let chunks = indirect(&self.buffers, std::mem::offset_of!(Status, chunk_groups));
            arrival.record(recorder, &paths, Places { items, chunks })?;
        }
        let [lower, upper] = self.scene.bounds();
        if let (Some(medium), Some(media)) = (&p.medium, self.scene.media_set()) {
            let push = path_medium::Push {
                scene_lower: lower.to_array(),
                first_pixel: wave.first_pixel,
                scene_upper: upper.to_array(),
                first_sample: wave.first_sample,
                sample_count: wave.samples,
                seed: self.settings.seed,
                path_set: self.settings.path_set.packed(),
                roulette_start: self.settings.roulette_start,
                roulette_cap: self.settings.roulette_cap,
                surrounding,
                accepting: self.settings.path_set.accepting(),
                successors: self.settings.path_set.successors(),
            };
            recorder.pass("path: medium", |pass| {
                pass.dispatch_indirect(medium, &[&paths, &scene, &media, &path_media], &push, items)?;
                stage_barrier(pass);
                Ok(())
            })?;
        }
        let push = path_shade::Push {
            scene_lower: lower.to_array(),
            first_pixel: wave.first_pixel,
            scene_upper: upper.to_array(),
            first_sample: wave.first_sample,
            sample_count: wave.samples,
            seed: self.settings.seed,
            path_set: self.settings.path_set.packed(),
            roulette_start: self.settings.roulette_start,
            roulette_cap: self.settings.roulette_cap,
            accepting: self.settings.path_set.accepting(),
            successors: self.settings.path_set.successors(),
        };
        recorder.pass("path: shade", |pass| {
            pass.dispatch_indirect(&p.shade, &[&paths, &scene, &path_media], &push, items)?;
            stage_barrier(pass);
            Ok(())
        })?;
        recorder.pass("path: compact", |pass| p.compaction.record(pass, &self.buffers, &paths))?;
        self.record_shadow(recorder, wave, parity, &p.trace)
    }

    /// The shadow rays of the last bounce.
    pub(super) fn record_shadow(
        &self,
        recorder: &mut Recorder,
        wave: &Wave,
        parity: usize,
        trace: &TracePipelines,
    ) -> Result<()> {
        if !self.scene.has_lights() {
            return Ok(());
        }
        let paths = self.buffers.set(parity);
        let (index, scene) = (self.scene.index_set(), self.scene.scene_set());
        let rays = indirect(&self.buffers, std::mem::offset_of!(Status, shadow_groups));
        let path_media = self.buffers.media_set();
        let surrounding = self.scene.surrounding().unwrap_or(NO_MEDIUM);
        recorder.pass("path: shadow", |pass| {
            match trace {
                TracePipelines::Opaque { shadow, .. } => {
                    pass.dispatch_indirect(shadow, &[&paths, &index], &(), rays)?;
                }
                TracePipelines::Alpha { shadow, .. } => {
                    let push = path_shadow_alpha::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                    };
                    pass.dispatch_indirect(shadow, &[&paths, &index, &scene], &push, rays)?;
                }
                TracePipelines::Media { shadow, .. } => {
                    let push = path_shadow_media::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                        surrounding,
                    };
                    if let Some(media) = self.scene.media_set() {
                        pass.dispatch_indirect(shadow, &[&paths, &index, &scene, &media, &path_media], &push, rays)?;
                    }
                }
                TracePipelines::MediaAlpha { shadow, .. } => {
                    let push = path_shadow_media_alpha::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                        surrounding,
                    };
                    if let Some(media) = self.scene.media_set() {
                        pass.dispatch_indirect(shadow, &[&paths, &index, &scene, &media, &path_media], &push, rays)?;
                    }
                }
            }
            stage_barrier(pass);
            Ok(())
        })
    }

    fn key(&self, wave: &Wave) -> WaveKey {
        WaveKey {
            first_pixel: wave.first_pixel,
            first_sample: wave.first_sample,
            sample_count: wave.samples,
            seed: self.settings.seed,
        }
    }

    pub(super) fn record_resolve(&self, recorder: &mut Recorder, wave: &Wave) -> Result<()> {
        let band = &self.film.bands()[wave.band];
        let push = path_resolve::Push {
            first_film_pixel: wave.first_pixel - band.first_pixel(),
            pixel_count: wave.pixels,
            sample_count: wave.samples,
        };
        recorder.pass("path: resolve", |pass| {
            let groups = self.pipelines.resolve.groups_for(wave.pixels);
            pass.dispatch(
                &self.pipelines.resolve,
                &[&self.buffers.set(0), &band.set()],
                &push,
                [groups, 1, 1],
            )?;
            pass.memory_barrier(
                Access::COMPUTE,
                Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
            );
            Ok(())
        })
    }
}
