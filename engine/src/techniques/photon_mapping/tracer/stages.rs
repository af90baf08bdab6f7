//! The stages of a wave of photons: emission, media, scattering, and what is made of deposits.

use super::{Kit, flux_scale};
use crate::Result;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::photon_mapping::{photon_emit, photon_scatter};
use crate::gpu::shaders::types;
use crate::gpu::{Pass, Recorder};
use crate::techniques::photon_mapping::collisions::CollisionPass;
use crate::techniques::photon_mapping::glow::GlowStage;
use crate::techniques::photon_mapping::kernel::KernelSettings;
use crate::techniques::photon_mapping::volume::footprint::EventKernelSettings;
use crate::techniques::photon_mapping::volume::{Room, VolumePass};
use crate::walk::{Bounce, WalkKey, WalkStages, stage_barrier};

/// Length of the pieces that ways are stored in, as a share of the diagonal of the scene's box: boxes of long ones hold much beside them.
const WAY_PIECE_SHARE: f32 = 1.0 / 16.0;
/// Scatterings that photons are followed through at most, so that none is followed for ever between lossless surfaces.
const BOUNCES_MAX: u32 = 4096;

/// The stages of a wave of photons.
pub(super) struct PhotonStages<'a> {
    pub kit: &'a Kit,
    pub key: WalkKey,
    /// Record of the wave's first deposit on a surface, and of its first one in a medium.
    pub first: u32,
    pub first_event: u32,
    pub kernel: Option<&'a KernelSettings>,
    pub event_kernel: Option<&'a EventKernelSettings>,
    pub path_share: f64,
    pub plane_share: f64,
}

impl PhotonStages<'_> {
    /// Photons leave the lights, which send that share of them.
    fn record_lights(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, share: f64) -> Result<()> {
        let kit = self.kit;
        let [lower, upper] = kit.scene.bounds();
        let push = photon_emit::Push {
            scene_lower: lower.to_array(),
            radius: 0.5 * (upper - lower).length(),
            scene_upper: upper.to_array(),
            key: self.key,
            photons: kit.photons,
            share: share as f32,
            weight: (1.0 / share) as f32,
            placeless2: kit.placeless2(),
        };
        recorder.pass("photon: emit", |pass| {
            let groups = [kit.emit.groups_for(self.key.indices), 1, 1];
            let (scene, own) = (kit.scene.emission_set(kit.emission.as_ref()), kit.wave_set());
            pass.dispatch(&kit.emit, &[wave, &scene, &own], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }
}

impl WalkStages for PhotonStages<'_> {
    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        self.kit.volume.as_ref().map_or(Ok(()), |volume| volume.reset(pass))?;
        let collisions = self.kit.append.collisions();
        collisions.map_or(Ok(()), |stage| stage.reset(pass))?;
        pass.fill(self.kit.counters.view(), 0)
    }

    /// Photons leave the lights, or start in media that emit.
    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        let kit = self.kit;
        let share = 1.0 - kit.glow.as_ref().map_or(0.0, GlowStage::share);
        if share > 0.0 {
            self.record_lights(recorder, wave, share)?;
        }
        let Some(glow) = &kit.glow else { return Ok(()) };
        recorder.pass("photon: glow", |pass| {
            glow.record(pass, wave, &kit.scene, &kit.differentials, self.key, kit.placeless2())
        })
    }

    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let (kit, kernel) = (self.kit, self.kernel);
        let [lower, upper] = kit.scene.bounds();
        if let Some(volume) = &kit.volume {
            let told = VolumePass {
                key: self.key,
                first_deposit: kit.stored.first_bounce,
                last_bounce: kit.stored.last_bounce.min(BOUNCES_MAX),
                flux_scale: flux_scale(&kit.scene) as f32,
                piece: WAY_PIECE_SHARE * (upper - lower).length(),
                body_reach: (upper - lower).length(),
                classes: kit.classes.as_ref().map_or([0; 2], |(_, in_media)| *in_media),
                kernel: self.event_kernel.copied(),
                path_share: self.path_share as f32,
                plane_share: self.plane_share as f32,
            };
            recorder.pass("photon: medium", |pass| {
                volume.record_medium(pass, bounce, &kit.scene, &kit.differentials, told)
            })?;
        }
        if let Some(collisions) = kit.append.collisions() {
            let told = CollisionPass {
                key: self.key,
                first_deposit: kit.stored.first_bounce,
                last_bounce: kit.stored.last_bounce.min(BOUNCES_MAX),
            };
            recorder.pass("photon: medium", |pass| {
                collisions.record(pass, bounce, &kit.scene, told)
            })?;
        }
        let push = photon_scatter::Push {
            scene_lower: lower.to_array(),
            last_bounce: kit.stored.last_bounce.min(BOUNCES_MAX),
            scene_upper: upper.to_array(),
            first_deposit: kit.stored.first_bounce,
            key: self.key,
            flux_scale: flux_scale(&kit.scene) as f32,
            kernel: kernel.map_or_else(Default::default, |kernel| types::KernelSettings {
                shape: kernel.shape as u32,
                spread: kernel.spread as f32,
                exponent: kernel.exponent as f32,
                unit_length: kernel.unit_length as f32,
                length_min: kernel.length_min as f32,
                length_max: kernel.length_max as f32,
                flatness: kernel.flatness as f32,
                widens_flat: u32::from(kernel.widens_flat),
            }),
        };
        recorder.pass("photon: scatter", |pass| {
            let (scene, own) = (kit.scene.scene_set(), kit.wave_set());
            let sets: [&dyn BindingSet<'_>; 3] = [&bounce.wave, &scene, &own];
            pass.dispatch_indirect(&kit.scatter, &sets, &push, bounce.places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// The deposits become records.
    fn record_waiting(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let kit = self.kit;
        recorder.pass("photon: append", |pass| {
            let own = kit.wave_set();
            if let Some(volume) = &kit.volume {
                let rooms = [
                    Room {
                        first: self.first,
                        capacity: kit.capacity,
                    },
                    Room {
                        first: self.first_event,
                        capacity: volume.capacity(),
                    },
                ];
                return volume.record_append(pass, bounce, &kit.differentials, &own, rooms);
            }
            kit.append
                .append(pass, bounce, &kit.scene, &own, self.first, kit.capacity)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        self.kit
            .volume
            .as_ref()
            .map_or(Ok(()), |volume| volume.read_back(pass))?;
        let collisions = self.kit.append.collisions();
        collisions.map_or(Ok(()), |stage| stage.read_back(pass))?;
        pass.copy(self.kit.counters.view(), self.kit.counters_readback.view())
    }
}
