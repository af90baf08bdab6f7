//! Queries of one map, between the arrival and the scattering of a wave's paths.

use super::linear::{LINEAR_RECORDS, LinearParts};
use super::{Counters, Gather, Linear, NEAREST_QUOTA, Query};
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::sets::{PhotonMapSet, WaveSet};
use crate::gpu::shaders::techniques::photon_mapping::photon_gather;
use crate::gpu::shaders::types::AskSettings;
use crate::gpu::{Pass, Recorder};
use crate::techniques::photon_mapping::map::PhotonMap;
use crate::techniques::photon_mapping::volume::{Beam, BeamStage, SWEEPS_MAX};
use crate::transport::GpuScene;
use crate::walk::{ArrivalStage, Places, StoppedPlaces, stage_barrier};
use crate::{Error, Result};

/// Queries of one map, to be recorded with a wave.
pub(in crate::techniques::photon_mapping) struct GatherStage<'a> {
    pub(super) gather: &'a Gather,
    pub(super) scene: &'a GpuScene,
    /// None where no point asks.
    pub(super) map: Option<&'a PhotonMap>,
    /// Of stored fluxes, in W a photon.
    pub(super) scale: f32,
    pub(super) neighbors: u32,
    pub(super) radius: f32,
    /// Of the volume map, in scenes with media.
    pub(super) beam: Option<BeamStage<'a>>,
}

impl GatherStage<'_> {
    fn ask(&self) -> AskSettings {
        let [lower, upper] = self.scene.bounds();
        AskSettings {
            scene_lower: lower.to_array(),
            states: self.gather.gather_states,
            scene_upper: upper.to_array(),
            most_bounces: self.gather.bounces[1],
        }
    }

    /// Of queries; those that go through records say besides which ones, and of which places.
    fn push(&self) -> photon_gather::Push {
        photon_gather::Push {
            ask: self.ask(),
            caustic_states: self.gather.caustic_states,
            least_bounces: self.gather.bounces[0],
            scale: self.scale,
            neighbors: self.neighbors,
            radius: self.radius,
            classes: self.gather.classes,
            ..Default::default()
        }
    }

    fn set<'a>(&'a self, map: &'a PhotonMap) -> PhotonMapSet<'a> {
        PhotonMapSet {
            photon_pairs: &map.pairs,
            photon_map_records: &map.records,
            gather_counters: self.gather.counters.view(),
            photon_map_root: map.root.view(),
            photon_beam_ways: self
                .gather
                .beam
                .as_ref()
                .map_or(self.gather.counters.view(), Beam::ways),
        }
    }

    /// Records what comes behind queries of the volume map: rays towards planes, and queries on surfaces.
    fn record_behind_beams(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        let gather = self.gather;
        if let Some(planes) = self.beam.as_ref().and_then(BeamStage::planes) {
            recorder.pass("photon: plane rays", |pass| {
                planes.record(pass, self.scene, wave, places)
            })?;
        }
        let Some(map) = self.map else { return Ok(()) };
        let (scene, map, queue) = (
            self.scene.scene_set(),
            self.set(map),
            gather.queue.set(&gather.counters),
        );
        let mut groups = places.items;
        if gather.queue.collects() {
            recorder.pass("photon: gather queue", |pass| {
                groups = gather
                    .queue
                    .record(pass, self.scene, wave, places, self.ask(), &queue)?;
                Ok(())
            })?;
        }
        recorder.pass("photon: gather", |pass| {
            let (sets, push): ([&dyn BindingSet<'_>; 4], _) = ([wave, &scene, &queue, &map], self.push());
            match &gather.query {
                Query::None => {}
                Query::Single(kernel) => pass.dispatch_indirect(kernel, &sets, &push, groups)?,
                Query::Packet(kernel) => pass.dispatch_indirect(kernel, &sets, &bytemuck::cast(push), groups)?,
            }
            stage_barrier(pass);
            Ok(())
        })
    }
}

impl ArrivalStage for GatherStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        if let Some(beam) = &self.beam {
            beam.record(recorder, self.scene, wave, places)?;
        }
        self.record_behind_beams(recorder, wave, places)
    }

    fn finds_hits(&self) -> bool {
        self.beam.as_ref().is_some_and(BeamStage::finds_hits)
    }

    fn record_with_hits(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        if let Some(beam) = &self.beam {
            beam.record_with_hits(recorder, self.scene, wave, places)?;
        }
        self.record_behind_beams(recorder, wave, places)
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        self.beam.as_ref().map_or(Ok(()), |beam| beam.reset(pass))?;
        pass.update(self.gather.counters.view(), &[Counters::default()])
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        self.beam.as_ref().map_or(Ok(()), |beam| beam.read_back(pass))?;
        pass.copy(self.gather.counters.view(), self.gather.counters_readback.view())
    }

    fn prepare_stopped(&self) -> Result<()> {
        self.beam.as_ref().map_or(Ok(()), BeamStage::prepare_stopped)?;
        if let Linear::Records(spec, made) = &self.gather.linear
            && made.get().is_none()
        {
            let linear = self.gather.gpu.compute_pipeline(spec.as_ref())?;
            made.get_or_init(|| linear);
        }
        Ok(())
    }

    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>> {
        let gather = self.gather;
        // Those of beams come first.
        let beams = self
            .beam
            .as_ref()
            .map(|beam| (beam, LinearParts::new(gather.quota, beam.map.count, stopped)));
        let of_beams = beams.as_ref().map_or(0, |(_, parts)| parts.count());
        if let Some((beam, parts)) = beams.filter(|_| part < of_beams) {
            let (mut part, mut taken) = (part, 0);
            recorder.pass("photon: beams all", |pass| {
                while part < of_beams && (taken == 0 || taken + parts.cost() <= LINEAR_RECORDS) {
                    let places = [parts.first_place(part), parts.places];
                    beam.record_linear(pass, self.scene, wave, stopped.key, places, parts.records(part))?;
                    taken += parts.cost();
                    part += 1;
                }
                Ok(())
            })?;
            return Ok(Some(part));
        }
        let mut first_part = of_beams;
        if let Some(planes) = self.beam.as_ref().and_then(BeamStage::planes) {
            // However many sweeps there are, what comes behind has the same number.
            first_part = of_beams + SWEEPS_MAX + 2;
            let sweep = part - of_beams;
            if part < first_part && (sweep == 0 || planes.remain()?) {
                recorder.pass("photon: plane rays all", |pass| {
                    planes.record_sweep(pass, self.scene, wave, stopped, sweep)
                })?;
                return Ok(Some(part + 1));
            }
        }
        let stopped_points = gather.counters_readback.read::<Counters>(0, 1)?[0].stopped;
        let Some(map) = self.map.filter(|_| stopped_points > 0) else {
            // Beams alone have stopped.
            return Ok(None);
        };
        let Linear::Records(_, made) = &gather.linear else {
            return Err(Error::Overflow {
                kernel: "photon_gather".into(),
                what: "steps of a query for neighbours".into(),
                needed: u64::from(NEAREST_QUOTA) + 1,
                capacity: u64::from(NEAREST_QUOTA),
                instead: "look for neighbours within a smaller radius, trace fewer photons per pass, or ask point by point (\"query\": \"single\")"
                    .into(),
            });
        };
        let linear = made.get().ok_or_else(|| Error::Internal {
            what: "photon map".into(),
            fault: "has stopped queries without the kernel for them".into(),
        })?;
        let parts = LinearParts::new(gather.quota, map.count, stopped);
        let (scene, map, queue) = (
            self.scene.scene_set(),
            self.set(map),
            gather.queue.set(&gather.counters),
        );
        let (mut part, mut taken) = (part.saturating_sub(first_part), 0);
        recorder.pass("photon: gather all", |pass| {
            while part < parts.count() && (taken == 0 || taken + parts.cost() <= LINEAR_RECORDS) {
                let [first, last] = parts.records(part);
                let push = photon_gather::Push {
                    first_place: parts.first_place(part),
                    first,
                    last,
                    ..self.push()
                };
                let groups = linear.groups_for(parts.places);
                pass.dispatch(linear, &[wave, &scene, &queue, &map], &push, [groups, 1, 1])?;
                stage_barrier(pass);
                taken += parts.cost();
                part += 1;
            }
            Ok(())
        })?;
        Ok((part < parts.count()).then_some(first_part + part))
    }
}
