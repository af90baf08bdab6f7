//! Shadow maps of virtual lights, some at a time, exact or imperfect.

use super::exact_maps::{ExactMaps, MapDrawing};
use super::imperfect_maps::{ImperfectMaps, Splatting};
use super::settings::{ManyLightSettings, Placement, Visibility};
use crate::Result;
use crate::gpu::shaders::sets::OmniShadowSet;
use crate::gpu::{Gpu, PipelineInfo, Recorder, TexelView};
use crate::raster::{ShadowLayout, Surfaces};

/// Bytes of maps at the same time, and of those that stay from frame to frame: what a buffer of the least devices holds.
const BYTES_AT_ONCE: u64 = 32 << 20;
const BYTES_KEPT: u64 = 128 << 20;

/// How directions lie in the maps of virtual lights.
pub(super) const LAYOUT: ShadowLayout = ShadowLayout::Octahedron;

/// The maps that are there.
pub(super) enum Maps {
    Exact(ExactMaps),
    Imperfect(ImperfectMaps),
}

/// What a submission draws.
pub(super) enum Drawing {
    Exact(Vec<MapDrawing>),
    Imperfect(Splatting),
}

/// Maps of so many bytes that are there at the same time.
pub(super) fn maps_at_once(settings: &ManyLightSettings, bytes: u64) -> u32 {
    let most = match settings.maps_at_once {
        0 => settings.lights,
        wanted => wanted.min(settings.lights),
    };
    let all = match settings.placement {
        Placement::Incremental => BYTES_KEPT,
        Placement::Walks | Placement::Rsm | Placement::Metropolis => BYTES_AT_ONCE,
    };
    (all / bytes.max(1)).clamp(1, u64::from(most)) as u32
}

impl Maps {
    /// Those that the settings ask for, if any.
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, settings: &ManyLightSettings) -> Result<Option<Self>> {
        Ok(match settings.visibility {
            Visibility::None | Visibility::Rays => None,
            Visibility::Maps => Some(Self::Exact(ExactMaps::new(gpu, surfaces, settings)?)),
            Visibility::Imperfect => Some(Self::Imperfect(ImperfectMaps::new(gpu, surfaces, settings)?)),
        })
    }

    /// What look-ups read.
    pub fn set(&self) -> OmniShadowSet<'_> {
        match self {
            Self::Exact(exact) => exact.maps().set(),
            Self::Imperfect(imperfect) => imperfect.atlas().set(),
        }
    }

    /// Texels along a side.
    pub fn side(&self) -> u32 {
        match self {
            Self::Exact(exact) => exact.maps().desc().side,
            Self::Imperfect(imperfect) => imperfect.atlas().desc().side,
        }
    }

    /// How many there are at the same time.
    pub fn at_once(&self) -> u32 {
        match self {
            Self::Exact(exact) => exact.maps().desc().maps,
            Self::Imperfect(imperfect) => imperfect.atlas().desc().maps,
        }
    }

    /// Points that are splatted into a map; none into exact ones.
    pub fn points(&self) -> u32 {
        match self {
            Self::Exact(_) => 0,
            Self::Imperfect(imperfect) => imperfect.atlas().points(),
        }
    }

    pub fn bytes(&self) -> u64 {
        match self {
            Self::Exact(exact) => exact.maps().bytes(),
            Self::Imperfect(imperfect) => imperfect.bytes(),
        }
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        match self {
            Self::Exact(exact) => exact.maps().pipelines(),
            Self::Imperfect(imperfect) => imperfect.pipelines(),
        }
    }

    /// Begins a frame of so many lights. May wait for the device.
    pub fn begin(&mut self, gpu: &Gpu, records: &TexelView, lights: u32) -> Result<()> {
        match self {
            Self::Exact(exact) => exact.begin(gpu, records, lights),
            Self::Imperfect(imperfect) => imperfect.begin(gpu, lights),
        }
    }

    /// What is drawn next of the lights before `end`, from a light's part on, as much as is a bounded piece of work, and which light and part then are next. May wait for
    /// the device.
    pub fn plan(&mut self, surfaces: &Surfaces<'_>, from: [u32; 2], end: u32) -> Result<(Drawing, [u32; 2])> {
        match self {
            Self::Exact(exact) => {
                let (drawings, next) = exact.plan(surfaces, from, end)?;
                Ok((Drawing::Exact(drawings), next))
            }
            Self::Imperfect(imperfect) => {
                let lights = imperfect.plan(from[0], end);
                let next = lights.end;
                Ok((Drawing::Imperfect(lights), [next, 0]))
            }
        }
    }

    /// Records a drawing; the light `first` has the first map. `records` are those of the frame's `lights`, and `begins` is for its first drawing.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        (records, lights): (&TexelView, u32),
        begins: bool,
        first: u32,
        drawing: &Drawing,
    ) -> Result<()> {
        match (self, drawing) {
            (Self::Exact(exact), Drawing::Exact(drawings)) => exact.record(recorder, surfaces, first, drawings),
            (Self::Imperfect(imperfect), Drawing::Imperfect(range)) => {
                imperfect.record(recorder, surfaces, (records, lights), begins, first, range)
            }
            // Drawings are those of these maps.
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of 128² texels has 64 KiB: 512 of them are as many as are there at once, 2,048 of kept lights fill a buffer of the least devices.
    #[test]
    fn maps_are_shared_out_by_what_a_buffer_holds() {
        const BYTES: u64 = 4 * 128 * 128;
        assert_eq!(BYTES, 65_536);
        let at_once = |placement, lights, wanted, bytes| {
            let settings = ManyLightSettings {
                placement,
                lights,
                maps_at_once: wanted,
                ..ManyLightSettings::default()
            };
            maps_at_once(&settings, bytes)
        };
        for placement in [Placement::Walks, Placement::Rsm, Placement::Metropolis] {
            assert_eq!(at_once(placement, 2048, 0, BYTES), 512, "{placement:?}");
            assert_eq!(at_once(placement, 511, 0, BYTES), 511, "{placement:?}");
        }
        for lights in [2047, 2048] {
            assert_eq!(at_once(Placement::Incremental, lights, 0, BYTES), lights);
        }
        assert_eq!(at_once(Placement::Incremental, 2049, 0, BYTES), 2048);
        assert_eq!(2048 * BYTES, 128 << 20);
        // As many as are asked for, of the lights and of what there is room for; one that is larger than all of it, and maps of nothing.
        assert_eq!(at_once(Placement::Walks, 2048, 7, BYTES), 7);
        assert_eq!(at_once(Placement::Walks, 5, 7, BYTES), 5);
        assert_eq!(at_once(Placement::Walks, 2048, 1024, BYTES), 512);
        assert_eq!(at_once(Placement::Walks, 2048, 0, 1 << 40), 1);
        assert_eq!(at_once(Placement::Walks, 2048, 0, 0), 2048);
    }
}
