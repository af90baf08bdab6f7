//! The passes of a wave of eye paths beside those of all walks: what each stage reads, and the barriers between them.

use super::adaptive::AdaptiveSamples;
use super::in_order::{Piece, SamplesInOrder};
use super::kept::KeptBySlot;
use super::pipelines::{CameraStage, Pipelines};
use super::refill::RefillStage;
use super::settings::PathTracerSettings;
use super::shared_light::SharedLight;
use super::wave::Wave;
use crate::Result;
use crate::film::GpuFilm;
use crate::gpu::shaders::constants::{NO_MEDIUM, OUTSIDE};
use crate::gpu::shaders::sets::{PathSlotSet, WaveSet};
use crate::gpu::shaders::techniques::path::{path_camera, path_resolve, path_shade};
use crate::gpu::shaders::types::CameraView;
use crate::gpu::{Access, ComputePipeline, Pass, Recorder, TexelView};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::walk::{ArrivalStage, Bounce, Refill, WalkKey, WalkStages, WaveBuffers, stage_barrier};
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
    pub shared_light: SharedLight,
    pub arrival: Option<&'a dyn ArrivalStage>,
    pub under_way: UnderWay<'a>,
}

/// The samples of a submission.
pub(super) enum UnderWay<'a> {
    Whole {
        wave: Wave,
        /// The last wave, until it has reached the film.
        pending: &'a mut Option<Wave>,
    },
    Full {
        refill: &'a RefillStage,
        samples: &'a mut SamplesInOrder,
        /// Those that begin.
        begins: Vec<Piece>,
    },
}

impl EyeStages<'_> {
    /// What random numbers are keyed by; the seed alone where slots have numbers of their own.
    fn key(&self) -> WalkKey {
        match &self.under_way {
            UnderWay::Whole { wave, .. } => wave.key(self.settings.seed),
            UnderWay::Full { .. } => seed_alone(self.settings.seed),
        }
    }

    fn view(&self) -> CameraView {
        let v = self.frame;
        CameraView {
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
            interior: self.scene.body_around(self.eye).unwrap_or(OUTSIDE),
        }
    }

    /// What the stages of a bounce are told, both the same.
    fn push(&self) -> path_shade::Push {
        let (scene, settings) = (self.scene, self.settings);
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        path_shade::Push {
            scene_lower: lower,
            path_set: settings.path_set.packed(),
            scene_upper: upper,
            roulette_cap: settings.roulette_cap,
            key: self.key(),
            roulette_start: settings.roulette_start,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            accepting: settings.path_set.accepting(),
            successors: settings.path_set.successors(),
            edge_bound: self.shared_light.bound_or_photons(),
            beam_radius: self.shared_light.radii.beams as f32,
        }
    }
}

impl WalkStages for EyeStages<'_> {
    /// The way of samples that have ended to the film.
    fn record_before(&mut self, recorder: &mut Recorder, buffers: &WaveBuffers) -> Result<()> {
        match &self.under_way {
            UnderWay::Whole { pending, .. } => match &**pending {
                Some(pending) => {
                    let target = ResolveTarget {
                        film: self.film,
                        adaptive: self.adaptive,
                    };
                    record_resolve(recorder, self.pipelines, target, buffers, self.kept, pending)
                }
                None => Ok(()),
            },
            UnderWay::Full {
                refill,
                samples,
                begins,
            } if samples.are_pending() || !begins.is_empty() => {
                let pending = samples.pending();
                refill.record_turnover(recorder, self.pipelines, self.film, buffers, self.kept, &pending)
            }
            UnderWay::Full { .. } => Ok(()),
        }
    }

    fn submitted(&mut self) {
        match &mut self.under_way {
            UnderWay::Whole { pending, .. } => **pending = None,
            UnderWay::Full { samples, .. } => samples.resolve(),
        }
    }

    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        let UnderWay::Whole { wave: samples, .. } = &self.under_way else {
            return Ok(());
        };
        if let Some(adaptive) = self.adaptive {
            adaptive.record_numbers(recorder, &self.film.bands()[samples.band], samples)?;
        }
        let camera = match &self.pipelines.camera {
            CameraStage::Whole(camera) => camera,
            CameraStage::Directions(stage) => {
                return recorder.pass("path: directions", |pass| {
                    stage.record(pass, wave, self.key(), samples.paths())?;
                    stage_barrier(pass);
                    Ok(())
                });
            }
            CameraStage::Refilled(_) => return Ok(()),
        };
        let push = path_camera::Push {
            view: self.view(),
            key: self.key(),
            slot_count: samples.paths(),
        };
        recorder.pass("path: camera", |pass| {
            let groups = [camera.groups_for(samples.paths()), 1, 1];
            pass.dispatch(camera, &[wave, &self.kept.set()], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_refill(
        &self,
        recorder: &mut Recorder,
        buffers: &WaveBuffers,
        wave: &WaveSet<'_>,
        at: Refill,
    ) -> Result<()> {
        let UnderWay::Full { refill, begins, .. } = &self.under_way else {
            return Ok(());
        };
        let (camera, view, seed) = (&self.pipelines.camera, self.view(), self.settings.seed);
        refill.record_begin(recorder, camera, view, seed, buffers, wave, self.kept, begins, at)
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

/// The key of walks that have numbers of their own.
pub(super) fn seed_alone(seed: u32) -> WalkKey {
    WalkKey {
        first_sequence: 0,
        first_index: 0,
        indices: 0,
        seed,
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
    let (walks, kept) = (buffers.set(0), kept.set());
    let Some(adaptive) = target.adaptive else {
        let piece = Piece {
            wave: *wave,
            first: 0,
            count: wave.paths(),
            result: 0,
        };
        let from = FilmPieces {
            walks,
            kept,
            pieces: &[piece],
        };
        return record_pieces(recorder, &pipelines.resolve, target.film, &from);
    };
    recorder.pass("path: resolve", |pass| {
        adaptive.resolve(pass, &walks, &kept, &target.film.bands()[wave.band], wave)?;
        leave_film(pass);
        Ok(())
    })
}

/// Samples for the film, and what has them: `walk_gathered` and `path_aovs`, by result.
pub(super) struct FilmPieces<'a> {
    pub walks: WaveSet<'a>,
    pub kept: PathSlotSet<'a>,
    pub pieces: &'a [Piece],
}

/// The way of consecutive samples to the film, piece by piece, each of which may end within a pixel.
pub(super) fn record_pieces(
    recorder: &mut Recorder,
    resolve: &ComputePipeline<path_resolve::Kernel>,
    film: &GpuFilm,
    from: &FilmPieces<'_>,
) -> Result<()> {
    if from.pieces.is_empty() {
        return Ok(());
    }
    recorder.pass("path: resolve", |pass| {
        for Piece {
            wave,
            first,
            count,
            result,
        } in from.pieces
        {
            let band = &film.bands()[wave.band];
            let (pixel, end) = (first / wave.samples, (first + count).div_ceil(wave.samples));
            let push = path_resolve::Push {
                first_film_pixel: wave.first_pixel - band.first_pixel() + pixel,
                pixel_count: end - pixel,
                sample_count: wave.samples,
                first_sample: first % wave.samples,
                slot_count: *count,
                first_slot: *result,
            };
            let groups = [resolve.groups_for(end - pixel), 1, 1];
            pass.dispatch(resolve, &[&from.walks, &from.kept, &band.set()], &push, groups)?;
            // The next piece may go on within the pixel.
            leave_film(pass);
        }
        Ok(())
    })
}

/// The barrier behind samples that were added.
fn leave_film(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE,
        Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
    );
}
