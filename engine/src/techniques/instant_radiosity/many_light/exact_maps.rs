//! Exact shadow maps of virtual lights, some at a time: all triangles from each, in all directions, of which its surface hides one half.

use glam::Vec3;

use super::maps::maps_at_once;
use super::records::LightRecord;
use super::settings::{ManyLightSettings, Placement};
use crate::Result;
use crate::gpu::{Gpu, Recorder, TexelView};
use crate::raster::{
    Coverage, DrawPart, OmniShadowDesc, OmniShadowMaps, SHADOW_MAPS_MAX, ShadowLayout, Surfaces, View,
};

/// Maps at the same time at most, where they are drawn anew for each frame.
const MAPS_AT_ONCE: u32 = 64;
/// Triangles that a submission draws, about, each in every octant of a map.
const TRIANGLES_AT_ONCE: u64 = 1 << 18;

/// The maps that are there.
pub(super) struct ExactMaps {
    maps: OmniShadowMaps,
    coverage: Coverage,
    /// Where the lights of the frame are, just off their surfaces.
    places: Vec<Vec3>,
    /// The views and parts of the map of a light that is drawn in several.
    parted: Option<(u32, Vec<View>, Vec<DrawPart>)>,
}

/// A part of the map of a light.
pub(super) struct MapDrawing {
    light: u32,
    views: Vec<View>,
    part: DrawPart,
}

impl ExactMaps {
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, settings: &ManyLightSettings) -> Result<Self> {
        let side = settings.map_side;
        let bytes = size_of::<f32>() as u64 * u64::from(side) * u64::from(side);
        let most = match settings.placement {
            Placement::Incremental => SHADOW_MAPS_MAX,
            Placement::Walks | Placement::Rsm | Placement::Metropolis => MAPS_AT_ONCE,
        };
        let maps = maps_at_once(settings, bytes).min(most);
        let desc = OmniShadowDesc {
            layout: ShadowLayout::Octahedron,
            side,
            maps,
        };
        Ok(Self {
            maps: OmniShadowMaps::new(gpu, surfaces, desc)?,
            coverage: Coverage::new(gpu)?,
            places: Vec::new(),
            parted: None,
        })
    }

    pub fn maps(&self) -> &OmniShadowMaps {
        &self.maps
    }

    /// Reads where the lights of a frame are. Waits for the device.
    pub fn begin(&mut self, gpu: &Gpu, records: &TexelView, lights: u32) -> Result<()> {
        let records = LightRecord::read(gpu, records, lights)?;
        self.parted = None;
        self.places = records.iter().map(LightRecord::place).collect();
        Ok(())
    }

    /// What is drawn next of the lights before `end`, from a light's part on, as much as is a bounded piece of work, and which light and part then are next. May wait for
    /// the device.
    pub fn plan(
        &mut self,
        surfaces: &Surfaces<'_>,
        [mut light, part]: [u32; 2],
        end: u32,
    ) -> Result<(Vec<MapDrawing>, [u32; 2])> {
        let mut drawings: Vec<MapDrawing> = Vec::new();
        let most = TRIANGLES_AT_ONCE / u64::from(surfaces.triangles.max(1));
        while light < end && drawings.len() as u64 <= most {
            let (views, mut parts) = match self.parted.take().filter(|(parted, ..)| *parted == light) {
                Some((_, views, parts)) => (views, parts),
                None => {
                    let place = self.places.get(light as usize).copied().unwrap_or_default();
                    let views = self.maps.views(surfaces, place)?;
                    let parts = self.coverage.parts(surfaces, &views, [self.maps.desc().side; 2])?;
                    (views, parts)
                }
            };
            if parts.len() == 1 {
                let part = parts.swap_remove(0);
                drawings.push(MapDrawing { light, views, part });
                light += 1;
                continue;
            }
            // What takes several parts has a submission for each.
            if drawings.is_empty() {
                let number = part.min(parts.len() as u32 - 1);
                drawings.push(MapDrawing {
                    light,
                    views: views.clone(),
                    part: parts[number as usize].clone(),
                });
                if number + 1 == parts.len() as u32 {
                    return Ok((drawings, [light + 1, 0]));
                }
                self.parted = Some((light, views, parts));
                return Ok((drawings, [light, number + 1]));
            }
            self.parted = Some((light, views, parts));
            break;
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
