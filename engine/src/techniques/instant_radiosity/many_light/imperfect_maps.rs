//! Imperfect shadow maps of virtual lights: those of many lights in one pass, from points of the surfaces.

use std::ops::Range;

use super::maps::maps_at_once;
use super::settings::ManyLightSettings;
use crate::Result;
use crate::gpu::shaders::techniques::instant_radiosity::light_places;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, DeviceKind, Gpu, PipelineInfo, Recorder,
    TexelView,
};
use crate::raster::Surfaces;
use crate::raster::splat_atlas::{SplatAtlas, SplatAtlasDesc};

/// Points that a submission splats: a few tenths of a second of two cores.
const SOFTWARE_SPLATS: u64 = 1 << 22;
/// On other devices as many as dispatches number with ease.
const DEVICE_SPLATS: u64 = 1 << 26;

/// Bytes of the places of so many lights.
fn origins_bytes(lights: u32) -> u64 {
    u64::from(lights) * size_of::<[f32; 4]>() as u64
}

/// Room for the places of so many lights.
fn origins(gpu: &Gpu, lights: u32) -> Result<Buffer> {
    gpu.buffer(&BufferDesc::storage(
        "places of virtual lights",
        origins_bytes(lights),
        Category::Light,
    ))
}

/// Lights whose maps a submission draws.
pub(super) type Splatting = Range<u32>;

/// The maps that are there.
pub(super) struct ImperfectMaps {
    atlas: SplatAtlas,
    places: ComputePipeline<light_places::Kernel>,
    /// Of all lights of a frame.
    origins: Buffer,
    /// Maps of a submission.
    drawn_at_once: u32,
}

impl ImperfectMaps {
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, settings: &ManyLightSettings) -> Result<Self> {
        let mut desc = SplatAtlasDesc {
            side: settings.map_side,
            maps: 1,
            points: settings.map_points,
            fill_levels: settings.map_fill,
        };
        desc.maps = maps_at_once(settings, desc.map_bytes());
        let splats = match gpu.caps().kind {
            DeviceKind::Cpu => SOFTWARE_SPLATS,
            _ => DEVICE_SPLATS,
        };
        Ok(Self {
            atlas: SplatAtlas::new(gpu, surfaces, desc)?,
            places: gpu.compute_pipeline(&Default::default())?,
            origins: origins(gpu, settings.lights)?,
            drawn_at_once: (splats / u64::from(settings.map_points)).max(1) as u32,
        })
    }

    /// Makes room for the lights of a frame, of which walks may leave more than one each.
    pub fn begin(&mut self, gpu: &Gpu, lights: u32) -> Result<()> {
        let least = origins_bytes(lights);
        if self.origins.bytes() < least {
            self.origins = origins(gpu, lights)?;
        }
        Ok(())
    }

    pub fn atlas(&self) -> &SplatAtlas {
        &self.atlas
    }

    pub fn bytes(&self) -> u64 {
        self.atlas.bytes() + self.origins.bytes()
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.places.info()];
        all.extend(self.atlas.pipelines());
        all
    }

    /// The lights before `end`, from one on, whose maps are a bounded piece of work.
    pub fn plan(&self, light: u32, end: u32) -> Splatting {
        light..light.saturating_add(self.drawn_at_once).min(end)
    }

    /// Records the maps of some lights, before the first ones of a frame where all lights and points are; the light `first` has the first map.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        (records, lights): (&TexelView, u32),
        begins: bool,
        first: u32,
        drawn: &Splatting,
    ) -> Result<()> {
        if begins {
            self.atlas.record_surfels(recorder, surfaces)?;
            recorder.pass("many-light: places of lights", |pass| {
                let barrier = |from, to| BufferBarrier {
                    buffer: &self.origins,
                    from,
                    to,
                };
                pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE)]);
                let set = light_places::Set0 {
                    virtual_light_texels: records,
                    map_origins: self.origins.view(),
                };
                let groups = self.places.groups_over(lights);
                pass.dispatch(&self.places, &[&set], &light_places::Push { lights }, groups)?;
                pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE_READ)]);
                Ok(())
            })?;
        }
        let maps = drawn.end - drawn.start;
        self.atlas
            .record(recorder, &self.origins, [drawn.start, drawn.start - first, maps])
    }
}
