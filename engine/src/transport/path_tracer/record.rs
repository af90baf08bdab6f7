//! The passes of a wave: what each stage reads, and the barriers between them.

use super::PathTracer;
use super::pipelines::TracePipelines;
use super::wave::{Status, Wave};
use crate::Result;
use crate::gpu::shaders::constants::{NO_MEDIUM, OUTSIDE};
use crate::gpu::shaders::transport::{
    path_camera, path_extend_alpha, path_extend_media, path_extend_media_alpha, path_medium, path_resolve, path_shade,
    path_shadow_alpha, path_shadow_media, path_shadow_media_alpha,
};
use crate::gpu::{Access, BufferView, Pass, Recorder};

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
    ) -> Result<()> {
        let p = &self.pipelines;
        let paths = self.buffers.set(parity);
        let (index, scene) = (self.scene.index_set(), self.scene.scene_set());
        let items = self.groups(std::mem::offset_of!(Status, item_groups));
        let path_media = self.buffers.media_set();
        let surrounding = self.scene.surrounding().unwrap_or(NO_MEDIUM);
        recorder.pass("path: extend", |pass| {
            match trace {
                TracePipelines::Opaque { extend, .. } => {
                    pass.dispatch_indirect(extend, &[&paths, &index], &(), items)?;
                }
                TracePipelines::Alpha { extend, .. } => {
                    let push = path_extend_alpha::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                    };
                    pass.dispatch_indirect(extend, &[&paths, &index, &scene], &push, items)?;
                }
                TracePipelines::Media { extend, .. } => {
                    let push = path_extend_media::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                        surrounding,
                    };
                    pass.dispatch_indirect(extend, &[&paths, &index, &path_media], &push, items)?;
                }
                TracePipelines::MediaAlpha { extend, .. } => {
                    let push = path_extend_media_alpha::Push {
                        first_pixel: wave.first_pixel,
                        first_sample: wave.first_sample,
                        sample_count: wave.samples,
                        seed: self.settings.seed,
                        surrounding,
                    };
                    pass.dispatch_indirect(extend, &[&paths, &index, &scene, &path_media], &push, items)?;
                }
            }
            stage_barrier(pass);
            Ok(())
        })?;
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
        recorder.pass("path: compact", |pass| {
            let chunks = self.groups(std::mem::offset_of!(Status, chunk_groups));
            let scatter = self.groups(std::mem::offset_of!(Status, scatter_groups));
            pass.dispatch_indirect(&p.count, &[&paths], &(), chunks)?;
            stage_barrier(pass);
            pass.dispatch(&p.scan, &[&paths], &(), [1, 1, 1])?;
            stage_barrier(pass);
            pass.dispatch_indirect(&p.scatter, &[&paths], &(), scatter)?;
            stage_barrier(pass);
            Ok(())
        })?;
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
        let rays = self.groups(std::mem::offset_of!(Status, shadow_groups));
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

    /// Indirect arguments at an offset of the status.
    fn groups(&self, offset: usize) -> BufferView<'_> {
        self.buffers.status.slice(offset as u64, size_of::<[u32; 3]>() as u64)
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

/// What every stage leaves behind is for the next one to read, write or take its arguments from.
fn stage_barrier(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE | Access::INDIRECT_READ,
        Access::COMPUTE | Access::INDIRECT_READ,
    );
}
