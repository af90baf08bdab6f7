//! Lights of a preview and their shadow maps.

use glam::Vec3;

use super::method::PreviewSettings;
use crate::gpu::shaders::constants::{PREVIEW_NO_SHADOW, PROBE_LEVELS_MAX};
use crate::gpu::shaders::types::{SceneLight, ShadowView};
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, DeviceKind, Gpu, PipelineInfo, Recorder, SOFTWARE_LOOP_CAP,
};
use crate::raster::{
    Coverage, DrawPart, OmniShadowDesc, OmniShadowMaps, SHADOW_MAPS_MAX, ShadowLayout, Surfaces, ViewShadowDesc,
    ViewShadowMaps, check_width, filter_iterations, shadow_view,
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
    /// Directional lights that have a shadow map: the first ones, further ones cast no shadows. A renderer's own are as many as its scene has.
    pub suns: u32,
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
        let LightRoom {
            all: lights,
            placed,
            suns,
        } = room;
        for (which, count) in [("that have a place", placed), ("that are directional", suns)] {
            if count > SHADOW_MAPS_MAX {
                let cause = format!("{which} are more than the {SHADOW_MAPS_MAX} that may have shadow maps");
                return Err(Error::setting("lights", count, cause));
            }
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
        if room.suns > 0 {
            self.desc_of_suns(room).check(gpu)?;
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

    const fn desc_of_suns(self, room: LightRoom) -> ViewShadowDesc {
        ViewShadowDesc {
            side: self.side,
            maps: room.suns,
        }
    }
}

/// How many lights there is room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::techniques) struct LightRoom {
    pub all: u32,
    /// Those of them that may have a place, and then a shadow map.
    pub placed: u32,
    /// Directional ones that may have a shadow map.
    pub suns: u32,
}

impl LightRoom {
    /// Loop iterations of a pixel with shadows' filters of that width, all loops together.
    fn iterations(self, width: u32) -> u64 {
        let shadowed = self.placed.saturating_add(self.suns).min(self.all);
        u64::from(self.all) + u64::from(shadowed) * filter_iterations(width) + PROBE_ITERATIONS
    }

    /// For these lights, in whatever order and place.
    pub fn of(lights: &[LightKind]) -> Self {
        let placed = lights.iter().filter(|light| place_of(light).is_some()).count() as u32;
        let all = lights.len() as u32;
        Self {
            all,
            placed,
            suns: all - placed,
        }
    }

    /// Whether none has a shadow map.
    pub fn is_without_maps(self) -> bool {
        self.placed == 0 && self.suns == 0
    }
}

/// Where a light's shadow map is seen from in all directions, metres; `None` for directional lights.
fn place_of(light: &LightKind) -> Option<Vec3> {
    match light {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(*position),
        LightKind::Directional { .. } => None,
    }
}

/// A light's shadow map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::techniques) struct LightMap {
    /// Among those of its kind.
    number: u32,
    from: MapFrom,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum MapFrom {
    /// In all directions about a place, metres.
    Place(Vec3),
    /// Along parallel rays of a direction.
    Direction(Vec3),
}

fn sun(direction: Vec3) -> LightKind {
    LightKind::Directional {
        direction,
        irradiance: Vec3::ZERO,
    }
}

/// Shadow maps of directional lights, and from where they are seen.
#[derive(Debug)]
struct SunShadows {
    maps: ViewShadowMaps,
    views: Buffer,
}

/// Records of lights on the device, and their shadow maps.
#[derive(Debug)]
pub struct PreviewLights {
    most: LightRoom,
    count: u32,
    records: Buffer,
    shadows: Option<OmniShadowMaps>,
    suns: Option<SunShadows>,
    width: u32,
    side: u32,
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
        let suns = |wanted: PreviewShadows| -> Result<SunShadows> {
            let bytes = u64::from(room.suns) * size_of::<ShadowView>() as u64;
            Ok(SunShadows {
                maps: ViewShadowMaps::new(gpu, surfaces, wanted.desc_of_suns(room))?,
                views: gpu.buffer(&BufferDesc::storage("views of suns", bytes, Category::Light))?,
            })
        };
        let bytes = u64::from(room.all.max(1)) * size_of::<SceneLight>() as u64;
        Ok(Self {
            most: room,
            count: 0,
            records: gpu.buffer(&BufferDesc::storage("preview lights", bytes, Category::Light))?,
            shadows: shadows.filter(|_| room.placed > 0).map(maps).transpose()?,
            suns: shadows.filter(|_| room.suns > 0).map(suns).transpose()?,
            width: shadows.map_or(0, |wanted| wanted.width),
            side: shadows.map_or(0, |wanted| wanted.side),
        })
    }

    /// Number of lights.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The shadow maps of lights that have a place, in their order.
    pub fn shadows(&self) -> Option<&OmniShadowMaps> {
        self.shadows.as_ref()
    }

    /// The shadow maps of directional lights, in their order.
    pub fn suns(&self) -> Option<&ViewShadowMaps> {
        self.suns.as_ref().map(|suns| &suns.maps)
    }

    /// From where the latter are seen.
    pub(super) fn sun_views(&self) -> Option<&Buffer> {
        self.suns.as_ref().map(|suns| &suns.views)
    }

    /// What draws shadow maps.
    pub(in crate::techniques) fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all: Vec<_> = self.shadows().map_or_else(Vec::new, OmniShadowMaps::pipelines);
        all.extend(self.suns().into_iter().flat_map(ViewShadowMaps::pipelines));
        all
    }

    /// Bytes of shadow maps.
    pub(super) fn bytes(&self) -> u64 {
        let suns = self.suns.as_ref();
        self.shadows().map_or(0, OmniShadowMaps::bytes) + suns.map_or(0, |suns| suns.maps.bytes() + suns.views.bytes())
    }

    /// Texels along a side of shadow maps.
    pub(super) fn side(&self) -> u32 {
        self.side
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
        for map in self.record_lights(recorder, surfaces, lights)? {
            self.record_map(recorder, surfaces, &map, &DrawPart::whole(surfaces))?;
        }
        Ok(())
    }

    /// The maps of these lights.
    pub(in crate::techniques) fn maps(&self, lights: &[LightKind]) -> Vec<LightMap> {
        let of = |number, from| LightMap { number, from };
        let placed = lights.iter().filter_map(place_of).filter(|_| self.shadows.is_some());
        let placed = (0..)
            .zip(placed)
            .map(|(number, place)| of(number, MapFrom::Place(place)));
        let directions = lights.iter().filter_map(|light| match light {
            LightKind::Directional { direction, .. } => Some(*direction),
            _ => None,
        });
        let suns = (0..self.suns().map_or(0, |maps| maps.desc().maps)).zip(directions);
        let suns = suns.map(|(number, direction)| of(number, MapFrom::Direction(direction)));
        placed.chain(suns).collect()
    }

    /// Parts that a map is drawn in. Waits for the device.
    pub(in crate::techniques) fn parts_of_map(
        &self,
        coverage: &Coverage,
        surfaces: &Surfaces<'_>,
        map: &LightMap,
    ) -> Result<Vec<DrawPart>> {
        let size = [self.side; 2];
        match (map.from, &self.shadows, &self.suns) {
            (MapFrom::Place(place), Some(shadows), _) => {
                coverage.parts(surfaces, &shadows.views(surfaces, place)?, size)
            }
            (MapFrom::Direction(direction), _, Some(suns)) => {
                coverage.parts(surfaces, &[suns.maps.view(surfaces, &sun(direction))?], size)
            }
            _ => Ok(Vec::new()),
        }
    }

    /// Records a part of a map, which is there after the last part.
    pub(in crate::techniques) fn record_map(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        map: &LightMap,
        part: &DrawPart,
    ) -> Result<()> {
        match (map.from, &self.shadows, &self.suns) {
            (MapFrom::Place(place), Some(shadows), _) => {
                shadows.record_part(recorder, surfaces, map.number, &shadows.views(surfaces, place)?, part)
            }
            (MapFrom::Direction(direction), _, Some(suns)) => {
                let view = suns.maps.view(surfaces, &sun(direction))?;
                suns.maps.record_part(recorder, surfaces, map.number, &view, part)
            }
            _ => Ok(()),
        }
    }

    /// As [`PreviewLights::record`] without the shadow maps, which are still to be drawn.
    pub(in crate::techniques) fn record_lights(
        &mut self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        lights: &[LightKind],
    ) -> Result<Vec<LightMap>> {
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
        let maps = self.maps(lights);
        // Lights of a kind have maps in their order, as far as there are some.
        let numbers = |is_sun: bool| {
            let of_kind = maps
                .iter()
                .filter(move |map| matches!(map.from, MapFrom::Direction(_)) == is_sun);
            of_kind.map(|map| map.number)
        };
        let (mut placed, mut suns) = (numbers(false), numbers(true));
        let mut records = Vec::with_capacity(lights.len());
        for light in lights {
            let mut record = light_record(light);
            let number = match light {
                LightKind::Directional { .. } => suns.next(),
                _ => placed.next(),
            };
            record.spare = number.unwrap_or(PREVIEW_NO_SHADOW);
            records.push(record);
        }
        let views = self.views_of_suns(surfaces, &maps)?;
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
            if let Some(suns) = self.suns.as_ref().filter(|_| !views.is_empty()) {
                pass.memory_barrier(Access::COMPUTE_READ, Access::TRANSFER_WRITE);
                pass.update(suns.views.view(), &views)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE_READ);
            }
            Ok(())
        })?;
        Ok(maps)
    }

    /// What kernels know of from where the maps of directional lights are seen.
    fn views_of_suns(&self, surfaces: &Surfaces<'_>, maps: &[LightMap]) -> Result<Vec<ShadowView>> {
        let Some(suns) = &self.suns else {
            return Ok(Vec::new());
        };
        let directions = maps.iter().filter_map(|map| match map.from {
            MapFrom::Direction(direction) => Some(direction),
            MapFrom::Place(_) => None,
        });
        directions
            .map(|direction| Ok(shadow_view(&suns.maps.view(surfaces, &sun(direction))?)))
            .collect()
    }
}
