//! Lights of a preview and their shadow maps.

use glam::Vec3;

use super::method::PreviewSettings;
use crate::gpu::shaders::constants::{PREVIEW_NO_SHADOW, PROBE_LEVELS_MAX};
use crate::gpu::shaders::types::SceneLight;
use crate::gpu::{Access, Buffer, BufferBarrier, BufferDesc, Category, DeviceKind, Gpu, Recorder, SOFTWARE_LOOP_CAP};
use crate::raster::{
    OmniShadowDesc, OmniShadowMaps, SHADOW_MAPS_MAX, ShadowLayout, Surfaces, check_width, filter_iterations,
};
use crate::scene::LightKind;
use crate::scene::check::light_is_sound;
use crate::techniques::Part;
use crate::transport::gpu_scene::light_record;
use crate::{Error, Result};

/// What an iteration of shading takes, as so many steps of a ray through an index.
const SHADING_WORK: u64 = 4;
/// Iterations of the loops over a probe's levels: two look-ups.
const PROBE_ITERATIONS: u64 = 2 * PROBE_LEVELS_MAX as u64;

/// Shadow maps of a preview.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PreviewShadows {
    /// How directions lie in them.
    pub layout: ShadowLayout,
    /// Texels across and down of each layer.
    pub side: u32,
    /// Texels that the filter is wide; 0 for none, [`SHADOW_WIDTH_MAX`](crate::raster::SHADOW_WIDTH_MAX) and `side` at most.
    pub width: u32,
}

impl Default for PreviewShadows {
    fn default() -> Self {
        PreviewSettings::default().shadows()
    }
}

impl PreviewShadows {
    /// Refuses filters that no look-up takes, and more lights than passes or the software driver's loops allow.
    fn check(&self, gpu: &Gpu, room: LightRoom) -> Result<()> {
        check_width(self.width, self.side)?;
        let LightRoom { all: lights, placed } = room;
        if placed > SHADOW_MAPS_MAX {
            let cause = format!("are more than the {SHADOW_MAPS_MAX} that may have shadow maps");
            return Err(Error::setting("lights", placed, cause));
        }
        let iterations = room.iterations(self.width);
        if gpu.caps().kind == DeviceKind::Cpu && iterations > u64::from(SOFTWARE_LOOP_CAP) {
            let width = self.width;
            let cause = format!(
                "with a shadow width of {width} take more iterations than the {SOFTWARE_LOOP_CAP} after which software devices end loops"
            );
            return Err(Error::setting("lights", lights, cause));
        }
        Ok(())
    }

    /// Refuses maps of so many lights that cannot be made.
    pub(in crate::techniques) fn fit(self, gpu: &Gpu, room: LightRoom) -> Result<()> {
        self.check(gpu, room)?;
        if room.placed > 0 {
            self.desc(room).check(gpu)?;
        }
        Ok(())
    }

    const fn desc(self, room: LightRoom) -> OmniShadowDesc {
        OmniShadowDesc {
            layout: self.layout,
            side: self.side,
            maps: room.placed,
        }
    }
}

/// How many lights there is room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::techniques) struct LightRoom {
    pub all: u32,
    /// Those of them that may have a place, and then a shadow map.
    pub placed: u32,
}

impl LightRoom {
    /// Loop iterations of a pixel with shadows' filters of that width, all loops together.
    fn iterations(self, width: u32) -> u64 {
        u64::from(self.all) + u64::from(self.placed) * filter_iterations(width) + PROBE_ITERATIONS
    }

    /// For these lights, in whatever order and place.
    pub fn of(lights: &[LightKind]) -> Self {
        let placed = lights.iter().filter(|light| place_of(light).is_some());
        Self {
            all: lights.len() as u32,
            placed: placed.count() as u32,
        }
    }
}

/// Where a light's shadow map is seen from, metres; `None` for lights without one.
fn place_of(light: &LightKind) -> Option<Vec3> {
    match light {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(*position),
        LightKind::Directional { .. } => None,
    }
}

/// Records of lights on the device, and shadow maps of those that have a place.
#[derive(Debug)]
pub struct PreviewLights {
    most: LightRoom,
    count: u32,
    records: Buffer,
    shadows: Option<OmniShadowMaps>,
    width: u32,
}

impl PreviewLights {
    pub(in crate::techniques) fn new(
        gpu: &Gpu,
        surfaces: &Surfaces<'_>,
        room: LightRoom,
        shadows: Option<PreviewShadows>,
    ) -> Result<Self> {
        if let Some(wanted) = shadows {
            wanted.check(gpu, room)?;
        }
        let maps = |wanted: PreviewShadows| OmniShadowMaps::new(gpu, surfaces, wanted.desc(room));
        let bytes = u64::from(room.all.max(1)) * size_of::<SceneLight>() as u64;
        Ok(Self {
            most: room,
            count: 0,
            records: gpu.buffer(&BufferDesc::storage("preview lights", bytes, Category::Light))?,
            shadows: shadows.filter(|_| room.placed > 0).map(maps).transpose()?,
            width: shadows.map_or(0, |wanted| wanted.width),
        })
    }

    /// Number of lights.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The shadow maps, in the order of the lights that have a place.
    pub fn shadows(&self) -> Option<&OmniShadowMaps> {
        self.shadows.as_ref()
    }

    /// Texels that the shadows' filter is wide.
    pub(super) fn width(&self) -> u32 {
        self.width
    }

    /// The records.
    pub(super) fn records(&self) -> &Buffer {
        &self.records
    }

    /// Parts that so many pixels are shaded in.
    pub(in crate::techniques) fn shading_parts(&self, gpu: &Gpu, pixels: u64) -> u32 {
        Part::count(gpu, pixels * self.most.iterations(self.width) * SHADING_WORK)
    }

    /// Records shadow maps and records of these lights. Afterwards all is visible to compute shaders.
    pub(in crate::techniques) fn record(
        &mut self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        lights: &[LightKind],
    ) -> Result<()> {
        let places = self.record_lights(recorder, lights)?;
        match &self.shadows {
            Some(shadows) => shadows.record(recorder, surfaces, &places),
            None => Ok(()),
        }
    }

    /// Where each map is seen from, for these lights.
    pub(super) fn places(&self, lights: &[LightKind]) -> Vec<Vec3> {
        let places = lights.iter().filter_map(place_of);
        places.filter(|_| self.shadows.is_some()).collect()
    }

    /// As [`PreviewLights::record`] without the shadow maps; from where these are seen.
    pub(in crate::techniques) fn record_lights(
        &mut self,
        recorder: &mut Recorder,
        lights: &[LightKind],
    ) -> Result<Vec<Vec3>> {
        let refuse = |value: usize, cause: String| Err(Error::setting("lights", value, cause));
        if lights.len() > self.most.all as usize {
            return refuse(lights.len(), format!("are more than the preview's {}", self.most.all));
        }
        if let Some(wrong) = lights.iter().position(|light| !light_is_sound(light)) {
            return refuse(
                wrong,
                "holds a number that is not finite, a negative intensity or a direction of another length than 1"
                    .into(),
            );
        }
        let places = self.places(lights);
        let mut maps = 0;
        let mut records = Vec::with_capacity(lights.len());
        for light in lights {
            let mut record = light_record(light);
            record.spare = PREVIEW_NO_SHADOW;
            if self.shadows.is_some() && place_of(light).is_some() {
                record.spare = maps;
                maps += 1;
            }
            records.push(record);
        }
        self.count = records.len() as u32;
        recorder.pass("preview: lights", |pass| {
            let barrier = |from, to| BufferBarrier {
                buffer: &self.records,
                from,
                to,
            };
            pass.barrier(&[barrier(Access::COMPUTE_READ, Access::TRANSFER_WRITE)]);
            pass.update(self.records.view(), &records)?;
            pass.barrier(&[barrier(Access::TRANSFER_WRITE, Access::COMPUTE_READ)]);
            Ok(())
        })?;
        Ok(places)
    }
}
