//! Shadow maps of virtual lights, some at a time: all triangles from each, in all directions, of which its surface hides one half.

use glam::Vec3;

use super::settings::ManyLightSettings;
use crate::Result;
use crate::gpu::shaders::constants::VIRTUAL_LIGHT_QUARTERS;
use crate::gpu::{Gpu, Recorder, TexelView};
use crate::raster::{Coverage, DrawPart, OmniShadowDesc, OmniShadowMaps, ShadowLayout, Surfaces, View};

/// Maps at the same time at most, and their bytes.
const MAPS_AT_ONCE: u32 = 64;
const BYTES_AT_ONCE: u64 = 32 << 20;
/// Triangles that a submission draws, about, each in every octant of a map.
const TRIANGLES_AT_ONCE: u64 = 1 << 18;

/// The maps that are there.
pub(super) struct Maps {
    maps: OmniShadowMaps,
    coverage: Coverage,
    /// Where the lights of the frame are, just off their surfaces.
    places: Vec<Vec3>,
}

/// A part of the map of a light.
pub(super) struct MapDrawing {
    light: u32,
    views: Vec<View>,
    part: DrawPart,
}

impl Maps {
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, settings: &ManyLightSettings) -> Result<Self> {
        let side = settings.map_side;
        let bytes = size_of::<f32>() as u64 * u64::from(side) * u64::from(side);
        let most = match settings.maps_at_once {
            0 => MAPS_AT_ONCE,
            wanted => wanted.min(MAPS_AT_ONCE),
        };
        let maps = (BYTES_AT_ONCE / bytes).clamp(1, u64::from(most.min(settings.lights))) as u32;
        let desc = OmniShadowDesc {
            layout: ShadowLayout::Octahedron,
            side,
            maps,
        };
        Ok(Self {
            maps: OmniShadowMaps::new(gpu, surfaces, desc)?,
            coverage: Coverage::new(gpu)?,
            places: Vec::new(),
        })
    }

    pub fn maps(&self) -> &OmniShadowMaps {
        &self.maps
    }

    /// How many there are at the same time.
    pub fn at_once(&self) -> u32 {
        self.maps.desc().maps
    }

    /// Reads where the lights of a frame are. Waits for the device.
    pub fn begin(&mut self, gpu: &Gpu, records: &TexelView, lights: u32) -> Result<()> {
        type Record = [[u32; 4]; VIRTUAL_LIGHT_QUARTERS as usize];
        let records: Vec<Record> = gpu.read(records.buffer().view(), lights as usize)?;
        let vector = |quarter: &[u32; 4]| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(quarter[i])));
        let place = |record: &Record| vector(&record[0]) + f32::from_bits(record[1][3]) * vector(&record[1]);
        self.places = records.iter().map(place).collect();
        Ok(())
    }

    /// What is drawn next of the lights before `end`, from a light's part on, as much as is a bounded piece of work, and which light and part then are next. May wait for
    /// the device.
    pub fn plan(
        &self,
        surfaces: &Surfaces<'_>,
        [mut light, part]: [u32; 2],
        end: u32,
    ) -> Result<(Vec<MapDrawing>, [u32; 2])> {
        let mut drawings: Vec<MapDrawing> = Vec::new();
        let most = TRIANGLES_AT_ONCE / u64::from(surfaces.triangles.max(1));
        while light < end && drawings.len() as u64 <= most {
            let place = self.places.get(light as usize).copied().unwrap_or_default();
            let views = self.maps.views(surfaces, place)?;
            let mut parts = self.coverage.parts(surfaces, &views, [self.maps.desc().side; 2])?;
            let count = parts.len() as u32;
            // What takes several parts has a submission for each.
            if count > 1 && !drawings.is_empty() {
                break;
            }
            let number = if count > 1 { part.min(count - 1) } else { 0 };
            drawings.push(MapDrawing {
                light,
                views,
                part: parts.swap_remove(number as usize),
            });
            if number + 1 < count {
                return Ok((drawings, [light, number + 1]));
            }
            light += 1;
            if count > 1 {
                break;
            }
        }
        Ok((drawings, [light, 0]))
    }

    /// Records drawings; the light `first` has the first map.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        first: u32,
        drawings: &[MapDrawing],
    ) -> Result<()> {
        drawings.iter().try_for_each(|drawing| {
            let MapDrawing { light, views, part } = drawing;
            self.maps.record_part(recorder, surfaces, light - first, views, part)
        })
    }
}
