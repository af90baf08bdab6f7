//! Live maps of a place in a scene, milliseconds of their parts, and errors of look-ups in them.

use clerestory::gpu::{Gpu, Timings};
use clerestory::maps::MapImage;
use clerestory::maps::prefilter::{ggx_mean, weighted_texels};
use clerestory::raster::ShadowLayout;
use clerestory::scene::{LightKind, Scene};
use clerestory::techniques::preview::probe::probe_level;
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewShadows, ProbeMap, ReflectionMap, ReflectionMapDesc,
};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use crate::random::Random;

/// Texels along a side of the reference: the most that 128 MiB of a storage buffer hold, which some drivers end at.
pub const REFERENCE: u32 = 2048;
/// Means of the reference that lobes are summed over, texels along a side. A texel is 0.014 wide: wide lobes span many, the narrowest about one, whose
/// sums are blurred by as much.
pub const SUMMED: u32 = 256;
/// Widths of lobes with their names: irradiance, two of the levels' own, one between them, and narrower ones than the narrowest.
const LOBES: [(f64, &str); 7] = [
    (1.0, IRRADIANCE),
    (0.35355, "α = 0.35"),
    (0.125, "α = 0.125"),
    (0.2, "α = 0.2"),
    (0.06, "α = 0.06"),
    (0.03, "α = 0.03"),
    (0.01, "α = 0.01"),
];
/// The widest lobe.
pub const IRRADIANCE: &str = "irradiance";
/// The narrowest.
pub const MIRROR: &str = "mirror";
/// Directions of look-ups by lobes.
pub const DIRECTIONS: usize = 300;
/// Directions of mirrors, of which few meet an edge.
pub const MIRRORS: usize = 20_000;
/// The finest level that is filtered, texels along a side.
pub const FINEST: u32 = 128;
/// The same of the reference, which is asked for none.
const FINEST_OF_REFERENCE: u32 = 32;
/// The parts of a map's frame by the names of their passes.
pub const PARTS: [&str; 5] = [
    "raster: surfaces",
    "preview: shade live map",
    "probe: levels and borders",
    "probe: copy",
    "probe: filter",
];

fn lights(scene: &Scene) -> Vec<LightKind> {
    scene.lights.iter().map(|light| light.kind).collect()
}

/// A scene, and the place in it that maps are of.
pub struct Stage<'a> {
    gpu: &'a Gpu,
    scene: GpuScene,
    preview: Preview,
    place: Vec3,
}

impl<'a> Stage<'a> {
    /// That of a scene; `share` is the place in the box around it.
    ///
    /// # Errors
    /// Those of the scene and the device.
    pub fn new(gpu: &'a Gpu, address: &str, share: Vec3) -> Result<Self> {
        let source = scene::load(address)?;
        let lights = lights(&source);
        let scene = GpuScene::new(gpu, &source)?;
        let desc = PreviewDesc {
            size: [8, 8],
            samples: 1,
            lights: lights.len() as u32,
            shadows: (!lights.is_empty()).then_some(PreviewShadows {
                layout: ShadowLayout::Octahedron,
                side: 1024,
                width: 0,
                suns: 0,
            }),
            probes: None,
        };
        let mut preview = Preview::new(gpu, &scene, desc)?;
        let mut recorder = gpu.recorder("lights")?;
        preview.record_lights(&mut recorder, &scene.surfaces(), &lights)?;
        recorder.submit()?.wait()?;
        let [lower, upper] = scene.bounds();
        Ok(Self {
            gpu,
            preview,
            place: lower + share * (upper - lower),
            scene,
        })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        self.gpu
    }

    /// A map of the size, drawn once.
    ///
    /// # Errors
    /// Those of the device.
    pub fn live(&self, desc: LightProbeDesc) -> Result<LiveProbe> {
        let live = LiveProbe::new(self.gpu, &self.scene, &self.preview, desc, false)?;
        self.milliseconds(&live)?;
        Ok(live)
    }

    /// Draws a map: milliseconds of its parts, and of all together.
    ///
    /// # Errors
    /// Those of the device.
    pub fn milliseconds(&self, live: &LiveProbe) -> Result<[f64; PARTS.len() + 1]> {
        let mut recorder = self.gpu.recorder("live map")?;
        let surfaces = self.scene.surfaces();
        live.record(&mut recorder, &self.scene, &surfaces, &self.preview, self.place, None)?;
        let timings = recorder.submit()?.wait()?;
        let [draw, shade, levels, copy, filter] = PARTS.map(|part| 1e3 * timings.seconds_of(part));
        Ok([draw, shade, levels, copy, filter, draw + shade + levels + copy + filter])
    }

    /// A reflection map, drawn once.
    ///
    /// # Errors
    /// Those of the device.
    pub fn reflection(&self, desc: ReflectionMapDesc) -> Result<ReflectionMap> {
        let reflection = ReflectionMap::new(self.gpu, &self.scene, &self.preview, desc, false)?;
        self.draw_reflection(&reflection)?;
        Ok(reflection)
    }

    /// Draws a reflection map.
    ///
    /// # Errors
    /// Those of the device.
    pub fn draw_reflection(&self, reflection: &ReflectionMap) -> Result<Timings> {
        let mut recorder = self.gpu.recorder("reflection map")?;
        let surfaces = self.scene.surfaces();
        reflection.record(&mut recorder, &self.scene, &surfaces, &self.preview, self.place, None)?;
        recorder.submit()?.wait()
    }
}

fn truth(map: &MapImage, directions: &[DVec3], alpha: f64) -> Vec<DVec3> {
    let texels = weighted_texels(map);
    directions.par_iter().map(|r| ggx_mean(&texels, *r, alpha)).collect()
}

/// RMS of differences over the mean.
pub fn error(values: &[Vec3], truth: &[DVec3]) -> f64 {
    let mean = truth.iter().sum::<DVec3>().element_sum() / (3 * truth.len()) as f64;
    let squares: f64 = values
        .iter()
        .zip(truth)
        .map(|(value, right)| (value.as_dvec3() - *right).length_squared())
        .sum();
    (squares / (3 * truth.len()) as f64).sqrt() / mean.max(f64::MIN_POSITIVE)
}

/// Look-ups in a far finer map of a place: means by lobes, and the map itself.
pub struct Reference {
    directions: Vec<DVec3>,
    lobes: Vec<Vec<DVec3>>,
    mirrors: Vec<DVec3>,
    sharp: Vec<DVec3>,
}

impl Reference {
    /// That of a place, by a map of so many texels along a side, and means of so many that lobes are summed over.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(stage: &Stage<'_>, (side, summed): (u32, u32)) -> Result<Self> {
        let mut random = Random::new(5);
        let mut draw = |count: usize| -> Vec<DVec3> { (0..count).map(|_| random.direction()).collect() };
        let (directions, mirrors) = (draw(DIRECTIONS), draw(MIRRORS));
        let finest = FINEST_OF_REFERENCE;
        let mirror = stage
            .live(LightProbeDesc {
                map: ProbeMap::Octahedron,
                side,
                finest,
            })?
            .probe()
            .map()
            .read(0)?;
        let mut image = mirror.clone();
        while image.size().x > summed {
            image = image.coarser()?;
        }
        Ok(Self {
            lobes: LOBES
                .iter()
                .map(|(alpha, _)| truth(&image, &directions, *alpha))
                .collect(),
            sharp: mirrors
                .iter()
                .map(|d| mirror.look_up(*d).unwrap_or(DVec3::NAN))
                .collect(),
            directions,
            mirrors,
        })
    }

    /// Errors of a map by the names of lobes.
    ///
    /// # Errors
    /// Those of the device.
    pub fn errors(&self, live: &LiveProbe) -> Result<Vec<(&'static str, f64)>> {
        let probe = live.probe();
        let of = |level: f32, directions: &[DVec3], right: &[DVec3]| -> Result<f64> {
            let queries: Vec<Vec4> = directions.iter().map(|d| d.as_vec3().extend(level)).collect();
            Ok(error(&probe.filtered().look_up(&queries)?, right))
        };
        let mut errors = Vec::new();
        for ((alpha, name), right) in LOBES.iter().zip(&self.lobes) {
            let level = probe_level(probe.alphas(), *alpha) as f32;
            errors.push((*name, of(level, &self.directions, right)?));
        }
        errors.push((MIRROR, of(0.0, &self.mirrors, &self.sharp)?));
        Ok(errors)
    }
}
