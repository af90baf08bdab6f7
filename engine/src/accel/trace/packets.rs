//! Rays in wide hierarchies by packets of a subgroup, for rays that lie beside each other in a buffer and go nearly the same way: those of a camera through
//! neighbouring pixels, and from what these meet to a light.
//!
//! Guarantees: hits of [`RayTracer`], to the bit, of queries for the closest one; no ray is lost, since what a quota stops is traced by itself.

use super::{Query, RayTracer, TraceBuffers, TraceSettings, Traced};
use crate::accel::{DeviceTraversal, Ray};
use crate::gpu::shaders::accel::trace_packets;
use crate::gpu::shaders::sets::IndexSet;
use crate::gpu::{Access, ComputePipeline, Gpu, Recorder, TexelView};
use crate::{Error, Result};

/// A wide hierarchy on a device, the kernel that traces packets in it, and the one for what is left.
#[derive(Debug)]
pub struct PacketTracer {
    packets: ComputePipeline<trace_packets::Kernel>,
    alone: RayTracer,
}

impl PacketTracer {
    /// Over the texels of a wide hierarchy. Of the settings the execution is of what packets leave.
    ///
    /// # Errors
    /// As [`RayTracer::new`]; [`Error::MissingFeature`] where subgroups have no reductions, broadcasts or votes.
    pub fn new(gpu: &Gpu, index: TexelView, settings: &TraceSettings) -> Result<Self> {
        let caps = gpu.caps();
        let operations = caps.subgroup;
        if !(operations.vote && operations.arithmetic && operations.ballot) {
            return Err(Error::MissingFeature {
                feature: "subgroup votes, arithmetic and ballots in compute shaders".into(),
                needed_by: "packets of rays".into(),
                device: caps.device.clone(),
                instead: "trace rays by themselves".into(),
            });
        }
        let alone = RayTracer::with_texels(gpu, index, DeviceTraversal::Wide, settings)?;
        let packets = gpu.compute_pipeline(&trace_packets::Spec {
            index_quota: settings.ray_quota,
            index_count: settings.count,
            index_kind: DeviceTraversal::Wide.kind(),
            trace_any: settings.query == Query::Any,
            wide_packet_lanes: caps.subgroup_size,
            ..Default::default()
        })?;
        Ok(Self { packets, alone })
    }

    /// What traces rays by themselves.
    pub fn alone(&self) -> &RayTracer {
        &self.alone
    }

    /// Records a round of packets; passes and barriers as of [`RayTracer::record`], whose other rounds ([`RayTracer::record_on`] of
    /// [`PacketTracer::alone`]) go on with what it leaves.
    ///
    /// # Errors
    /// As [`RayTracer::record`].
    pub fn record(&self, recorder: &mut Recorder, buffers: &TraceBuffers) -> Result<()> {
        self.alone.record_begin(recorder, buffers, true, true)?;
        recorder.pass(super::TRACE_PASS, |pass| {
            let index = IndexSet {
                index_texels: &self.alone.index,
            };
            let set = trace_packets::Set0 {
                trace_rays: buffers.rays.view(),
                trace_hits: buffers.hits.view(),
                trace_resume: buffers.resume.view(),
                trace_status: buffers.status.view(),
            };
            let most = self.alone.gpu.caps().max_workgroups[0];
            let most = u64::from(most) * u64::from(self.packets.group_size());
            let mut first_ray = 0;
            while first_ray < buffers.count {
                let ray_count = u64::from(buffers.count - first_ray).min(most) as u32;
                let push = trace_packets::Push { first_ray, ray_count };
                let groups = [self.packets.groups_for(ray_count), 1, 1];
                pass.dispatch(&self.packets, &[&set, &index], &push, groups)?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
                first_ray += ray_count;
            }
            Ok(())
        })
    }

    /// Traces rays to the end. Work of packets counts once for each packet.
    ///
    /// # Errors
    /// As [`RayTracer::trace`].
    pub fn trace(&self, rays: &[Ray]) -> Result<Traced> {
        self.alone.trace_with(rays, |traced, buffers| {
            let mut recorder = self.alone.gpu.recorder("trace packets")?;
            self.record(&mut recorder, buffers)?;
            let timings = recorder.submit()?.wait()?;
            traced.timings.untimed = timings.untimed;
            traced.timings.passes.extend(timings.passes);
            traced.dispatches += 1;
            Ok(())
        })
    }
}
