//! Live maps: what a frame's map costs by its size and its parts, and how wrong reflections of several widths by it are.
//!
//! Sources: T. Engelhardt and C. Dachsbacher, VMV 2008; B. Karis, SIGGRAPH 2013. Oracle: sums of the lobes over a map of 1024² texels in f64.

use clerestory::gpu::Gpu;
use clerestory::maps::MapImage;
use clerestory::maps::prefilter::{ggx_mean, weighted_texels};
use clerestory::raster::ShadowLayout;
use clerestory::scene::{LightKind, Scene};
use clerestory::techniques::preview::probe::probe_level;
use clerestory::techniques::preview::{LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewShadows};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::random::Random;
use crate::timing::{median, repeated};

/// Scenes, and the map's place as a share of the box around each.
const SCENES: [(&str, Vec3); 4] = [
    ("builtin:box-room?source=point", Vec3::new(0.45, 0.4, 0.55)),
    ("builtin:conference?source=point", Vec3::new(0.4, 0.5, 0.45)),
    ("builtin:cathedral?source=point", Vec3::new(0.5, 0.25, 0.55)),
    ("builtin:divider-room", Vec3::new(0.3, 0.5, 0.4)),
];
const SIDES: [u32; 3] = [128, 256, 512];
const REFERENCE: u32 = 1024;
/// Means of the reference that lobes are summed over, texels along a side: lobes are many times wider.
const SUMMED: u32 = 256;
/// Widths of lobes: irradiance, two of the levels' own, one between them, and narrower ones than the narrowest.
const ALPHAS: [f64; 7] = [1.0, 0.35355, 0.125, 0.2, 0.06, 0.03, 0.01];
const DIRECTIONS: usize = 300;
const REPEATS: usize = 5;
/// The parts of a map's frame by the names of their passes.
const PARTS: [&str; 5] = [
    "raster: surfaces",
    "preview: shade live map",
    "probe: levels and borders",
    "probe: copy",
    "probe: filter",
];

fn lights(scene: &Scene) -> Vec<LightKind> {
    scene.lights.iter().map(|light| light.kind).collect()
}

struct Stage<'a> {
    gpu: &'a Gpu,
    scene: GpuScene,
    preview: Preview,
    place: Vec3,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a Gpu, address: &str, share: Vec3) -> Result<Self> {
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
            }),
            has_probes: false,
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

    /// A map of the size, and milliseconds of its parts.
    fn draw(&self, desc: LightProbeDesc, repeats: usize) -> Result<(LiveProbe, [f64; PARTS.len()])> {
        let live = LiveProbe::new(self.gpu, &self.scene, &self.preview, desc, false)?;
        let mut times: [Vec<f64>; PARTS.len()] = Default::default();
        repeated(repeats, || {
            let mut recorder = self.gpu.recorder("live map")?;
            live.record(
                &mut recorder,
                &self.scene,
                &self.scene.surfaces(),
                &self.preview,
                self.place,
                None,
            )?;
            let timings = recorder.submit()?.wait()?;
            for (time, part) in times.iter_mut().zip(PARTS) {
                time.push(1e3 * timings.seconds_of(part));
            }
            Ok::<_, clerestory::Error>(((), 0.0))
        })?;
        // The first warms up.
        let times = times.map(|time| median(time[1.min(time.len() - 1)..].to_vec()));
        Ok((live, times))
    }
}

fn truth(map: &MapImage, directions: &[DVec3], alpha: f64) -> Vec<DVec3> {
    let texels = weighted_texels(map);
    directions.par_iter().map(|r| ggx_mean(&texels, *r, alpha)).collect()
}

/// RMS of differences over the mean.
fn error(values: &[Vec3], truth: &[DVec3]) -> f64 {
    let mean = truth.iter().sum::<DVec3>().element_sum() / (3 * truth.len()) as f64;
    let squares: f64 = values
        .iter()
        .zip(truth)
        .map(|(value, right)| (value.as_dvec3() - *right).length_squared())
        .sum();
    (squares / (3 * truth.len()) as f64).sqrt() / mean.max(f64::MIN_POSITIVE)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let (sides, reference, summed) = if context.smoke {
        (&SIDES[..1], 256, 64)
    } else {
        (&SIDES[..], REFERENCE, SUMMED)
    };
    let repeats = if context.smoke { 1 } else { REPEATS };
    let own: Vec<(String, Vec3)> = if context.scenes.is_empty() {
        let count = if context.smoke { 1 } else { SCENES.len() };
        SCENES[..count]
            .iter()
            .map(|(address, share)| ((*address).to_owned(), *share))
            .collect()
    } else {
        context
            .scenes
            .iter()
            .map(|address| (address.clone(), Vec3::splat(0.5)))
            .collect()
    };
    let mut found = Table::new(
        "Live maps",
        &[
            "scene",
            "texels a side",
            "draw (ms)",
            "shade (ms)",
            "levels, borders (ms)",
            "copy (ms)",
            "filter (ms)",
            "MiB",
            "error of irradiance",
            "of α = 0.35",
            "of α = 0.125",
            "of α = 0.2",
            "of α = 0.06",
            "of α = 0.03",
            "of α = 0.01",
            "of the mirror",
        ],
    );
    let mut random = Random::new(5);
    let directions: Vec<DVec3> = (0..DIRECTIONS).map(|_| random.direction()).collect();
    for (done, (address, share)) in own.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(address, done, own.len());
        let stage = Stage::new(&gpu, address, *share)?;
        let finest = LightProbeDesc {
            side: reference,
            finest: 32,
        };
        let (right, _) = stage.draw(finest, 0)?;
        let mirror = right.probe().map().read(0)?;
        let mut image = mirror.clone();
        while image.size().x > summed {
            image = image.coarser()?;
        }
        let truths: Vec<Vec<DVec3>> = ALPHAS.iter().map(|alpha| truth(&image, &directions, *alpha)).collect();
        let sharp: Vec<DVec3> = directions.iter().filter_map(|d| mirror.look_up(*d)).collect();
        for side in sides {
            let desc = LightProbeDesc {
                side: *side,
                finest: 128,
            };
            let (live, times) = stage.draw(desc, repeats)?;
            let probe = live.probe();
            let errors: Vec<f64> = ALPHAS
                .iter()
                .zip(&truths)
                .map(|(alpha, truth)| {
                    let level = probe_level(probe.alphas(), *alpha) as f32;
                    let queries: Vec<Vec4> = directions.iter().map(|d| d.as_vec3().extend(level)).collect();
                    Ok(error(&probe.filtered().look_up(&queries)?, truth))
                })
                .collect::<Result<_>>()?;
            let queries: Vec<Vec4> = directions.iter().map(|d| d.as_vec3().extend(0.0)).collect();
            let of_mirror = error(&probe.filtered().look_up(&queries)?, &sharp);
            found.row(
                [address.as_str().into(), u64::from(*side).into()]
                    .into_iter()
                    .chain(times.map(Into::into))
                    .chain([(live.bytes() as f64 / f64::from(1 << 20)).into()])
                    .chain(errors.into_iter().chain([of_mirror]).map(Into::into)),
            );
        }
    }
    found.note(format!(
        "One map a frame at a place in each scene, lit by the scene's lights through octahedron shadow maps of 1024², as an octahedron of that many texels a \
         side. Times are of the device's timestamps, medians of {REPEATS}. Errors are RMS over {DIRECTIONS} directions, over the mean: of look-ups filtered by lobes of width α \
         (irradiance is α = 1; 0.2 lies between two levels, and from 0.06 down between the finest filtered one and mirrors) against the sum of the lobe over a map of {REFERENCE}² texels, by means of {SUMMED}² in f64; \
         of unfiltered ones against that map itself, where edges of surfaces lie between texels. The divider room's panel is no light of the preview: its map is dark but \
         for that, the hardest light for lobes. Maps of 128² have no level between α = 0.35 and mirrors."
    ));
    Ok(vec![found])
}
