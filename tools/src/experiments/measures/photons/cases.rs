//! Scenes of whole photon mappings: the settings that the source has for their counterparts, and what it found there.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Tables 5.1 and 6.6.

use std::sync::Arc;

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::render::Renderer;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::kernel::{KernelProfile, KernelShape};
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};

use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Photons land twice after they were scattered first, as the source's: light of two bounces before the eye's.
const PATHS: &str = "bounces=0..3";
/// The source's greatest axis and unit of the dampening, m.
const LENGTH: f32 = 1.0;
/// Photons of smoke forms are that many times fewer.
const SMOKE_SHARE: u32 = 64;

/// What the source says of a scene.
pub struct Published {
    /// Name.
    pub name: &'static str,
    /// Photons stored.
    pub interactions: u64,
    /// Photons without a kernel, %.
    pub discarded: f64,
    /// Kernels with a clamped axis, %.
    pub clamped: f64,
    /// Kernels about a query, by variable kernels and by nearest neighbours.
    pub contributions: [f64; 2],
    /// Milliseconds of photon tracing, of the map's construction and of rendering, and frames a second.
    pub frame: [f64; 4],
}

/// A scene and its settings.
pub struct Case {
    /// Its address.
    pub scene: &'static str,
    /// Photons of a pass.
    pub photons: u32,
    /// Spread of the kernels.
    pub spread: f32,
    /// Its counterpart.
    pub published: Published,
}

/// Stand-ins for the source's seven scenes, in its order.
pub static CASES: [Case; 7] = [
    Case {
        scene: "builtin:box-room?source=point",
        photons: 1 << 17,
        spread: 20.0,
        published: Published {
            name: "Scene 6",
            interactions: 163_286,
            discarded: 0.15,
            clamped: 0.0,
            contributions: [337.6, 301.0],
            frame: [10.53, 10.75, 264.77, 3.50],
        },
    },
    Case {
        scene: "builtin:atrium?source=point",
        photons: 1 << 18,
        spread: 40.0,
        published: Published {
            name: "Sponza",
            interactions: 300_339,
            discarded: 0.15,
            clamped: 2.94,
            contributions: [199.1, 155.0],
            frame: [55.95, 18.29, 201.51, 3.63],
        },
    },
    Case {
        scene: "builtin:cathedral?source=point",
        photons: 1 << 19,
        spread: 55.0,
        published: Published {
            name: "Sibenik",
            interactions: 417_649,
            discarded: 0.16,
            clamped: 7.19,
            contributions: [192.2, 201.0],
            frame: [102.47, 26.24, 197.08, 3.07],
        },
    },
    Case {
        scene: "builtin:forest?source=point",
        photons: 1 << 17,
        spread: 25.0,
        published: Published {
            name: "Fairy",
            interactions: 9_478,
            discarded: 0.86,
            clamped: 2.83,
            contributions: [36.0, 75.0],
            frame: [14.93, 2.63, 34.27, 19.30],
        },
    },
    Case {
        scene: "builtin:conference?source=point",
        photons: 1 << 17,
        spread: 25.0,
        published: Published {
            name: "Conference",
            interactions: 83_003,
            discarded: 0.16,
            clamped: 0.22,
            contributions: [256.9, 201.0],
            frame: [29.14, 6.38, 228.89, 3.78],
        },
    },
    Case {
        scene: "builtin:passage",
        photons: 1 << 17,
        spread: 15.0,
        published: Published {
            name: "Passage",
            interactions: 69_201,
            discarded: 0.17,
            clamped: 0.0,
            contributions: [459.6, 451.0],
            frame: [3.98, 5.84, 208.63, 4.58],
        },
    },
    Case {
        scene: "builtin:ring",
        photons: 1 << 17,
        spread: 10.0,
        published: Published {
            name: "Ring",
            interactions: 75_876,
            discarded: 0.46,
            clamped: 0.0,
            contributions: [186.6, 51.0],
            frame: [7.29, 6.46, 156.45, 5.88],
        },
    },
];

/// All cases, or those with these counterparts in a smoke run.
pub fn cases(context: &Context<'_>, smoke: &[&str]) -> Vec<&'static Case> {
    let is_in = |case: &&Case| !context.smoke || smoke.contains(&case.published.name);
    CASES.iter().filter(is_in).collect()
}

/// What the source says of a scene by its name there.
pub fn published(counterpart: &str) -> Option<&'static Published> {
    let mut all = CASES.iter().map(|case| &case.published);
    all.find(|published| published.name == counterpart)
}

impl Case {
    /// The scene's name.
    pub fn name(&self) -> &'static str {
        short_name(self.scene)
    }

    /// The source's settings. Smoke forms have fewer photons with kernels of the same size.
    pub fn settings(&self, smoke: bool) -> Result<PhotonSettings> {
        settings(self.photons, self.spread, smoke)
    }
}

/// The source's settings with so many photons. Smoke forms have fewer, with kernels of the same size.
pub fn settings(photons: u32, spread: f32, smoke: bool) -> Result<PhotonSettings> {
    let share = if smoke { SMOKE_SHARE } else { 1 };
    Ok(PhotonSettings {
        path_set: PATHS.parse()?,
        photons: photons / share,
        shape: KernelShape::Skewed,
        profile: KernelProfile::Uniform,
        radius: LENGTH,
        unit_length: LENGTH,
        widen_flat: false,
        spread: spread / (share as f32).sqrt(),
        ..PhotonSettings::default()
    })
}

/// A mapping of a scene's first view.
///
/// # Errors
/// Those of scenes and techniques.
pub fn mapper(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: PhotonSettings) -> Result<PhotonMapper> {
    let renderer = Renderer::new(gpu, scene)?;
    let camera = scene.require_camera(None)?;
    PhotonMapper::new(gpu, Arc::clone(renderer.gpu_scene()), camera, size, settings)
}
