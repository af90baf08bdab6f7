//! Pictures of the raster preview with live maps: how near they come to light that surfaces throw at each other, and what a frame of them costs.
//!
//! Sources: those of [`clerestory::techniques::preview`]. Oracle: the path tracer on the same light paths.

use clerestory::film::{CompareOptions, ErrorReport, Picture, compare};
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Scene};
use clerestory::techniques::preview::{LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows};
use clerestory::{Error, Result, scene};
use glam::Vec3;
use serde_json::json;

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::timing::{Spread, median, repeated};

/// Scenes that a point light alone lights.
const SCENES: [&str; 5] = [
    "builtin:cornell-box?source=point",
    "builtin:box-room?source=point",
    "builtin:atrium?source=point",
    "builtin:cathedral?source=point",
    "builtin:conference?source=point",
];
/// Pixels along a side, and samples a pixel of the references.
const SIZE: (u32, u32) = (128, 1024);
const SMOKE_SIZE: (u32, u32) = (16, 16);
/// Texels along a side of shadow maps, and samples along a side of a pixel.
const QUALITY: (u32, u32) = (2048, 4);
const SMOKE_QUALITY: (u32, u32) = (256, 1);
const MAP: LightProbeDesc = LightProbeDesc { side: 256, finest: 128 };
/// Places of live maps along each axis of the box around a scene, as shares of it: nine at half its height.
const SHARES: [f32; 3] = [0.25, 0.5, 0.75];
const REFERENCE_SEED: u32 = 2;
/// Light scattered twice at most.
const TWICE: &str = "bounces=0..2";

fn errors(picture: &Picture, reference: &Picture) -> Result<ErrorReport> {
    compare(picture, reference, &CompareOptions::default())
}

/// A scene for the preview and for the path tracer.
struct Subject<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    camera: Camera,
    lights: Vec<LightKind>,
}

impl<'a> Subject<'a> {
    fn new(gpu: &'a Gpu, scene: &Scene) -> Result<Self> {
        Ok(Self {
            gpu,
            renderer: Renderer::new(gpu, scene)?,
            camera: scene.require_camera(None)?.clone(),
            lights: scene.lights.iter().map(|light| light.kind).collect(),
        })
    }

    /// The path tracer's picture.
    fn traced(&self, (size, spp): (u32, u32), paths: &str) -> Result<Picture> {
        let rendered = self.renderer.render(&RenderOptions {
            technique: Some("path".into()),
            size: [size; 2],
            spp,
            seed: REFERENCE_SEED,
            settings: json!({"path_set": paths}).into(),
            ..RenderOptions::default()
        })?;
        Ok(rendered.picture)
    }

    /// A preview's picture, and seconds of the device: lights, the live map at a place, if one is asked for, and what the camera sees.
    fn previewed(&self, size: u32, (side, samples): (u32, u32), place: Option<Vec3>) -> Result<(Picture, f64)> {
        let scene = self.renderer.gpu_scene();
        let desc = PreviewDesc {
            size: [size; 2],
            samples,
            lights: self.lights.len() as u32,
            shadows: Some(PreviewShadows {
                layout: ShadowLayout::Octahedron,
                side,
                width: 0,
            }),
            has_probes: place.is_some(),
        };
        let mut preview = Preview::new(self.gpu, scene, desc)?;
        let live = place
            .map(|place| LiveProbe::new(self.gpu, scene, &preview, MAP, false).map(|live| (live, place)))
            .transpose()?;
        let surfaces = scene.surfaces();
        let ((), seconds) = repeated(1, || {
            let mut recorder = self.gpu.recorder("frame")?;
            preview.record_lights(&mut recorder, &surfaces, &self.lights)?;
            if let Some((live, place)) = &live {
                live.record(&mut recorder, scene, &surfaces, &preview, *place, None)?;
            }
            let part = PreviewPart {
                triangles: 0..surfaces.triangles,
                background: true,
                probe: live.as_ref().map(|(live, _)| live.probe()),
            };
            preview.record(&mut recorder, scene, &surfaces, &self.camera, &[part])?;
            let timings = recorder.submit()?.wait()?;
            Ok::<_, Error>(((), timings.seconds()))
        })?;
        Ok((preview.picture()?, median(seconds)))
    }

    /// Where live maps are drawn.
    fn places(&self) -> Vec<Vec3> {
        let [lower, upper] = self.renderer.gpu_scene().bounds();
        let shares = SHARES
            .iter()
            .flat_map(|x| SHARES.iter().map(|z| Vec3::new(*x, 0.5, *z)));
        shares.map(|share| lower + share * (upper - lower)).collect()
    }
}

/// A picture by lights alone, and those with a live map at each of the places.
fn by_live_map(subject: &Subject<'_>, size: (u32, u32), quality: (u32, u32)) -> Result<[Vec<Lit>; 2]> {
    let (twice, all) = (subject.traced(size, TWICE)?, subject.traced(size, "all")?);
    let lit = |place| {
        let (picture, seconds) = subject.previewed(size.0, quality, place)?;
        Ok(Lit {
            seconds,
            twice: errors(&picture, &twice)?,
            all: errors(&picture, &all)?,
        })
    };
    let with: Result<Vec<Lit>> = subject.places().into_iter().map(|place| lit(Some(place))).collect();
    Ok([vec![lit(None)?], with?])
}

/// A picture's seconds, and its errors against light scattered twice at most and against all light.
struct Lit {
    seconds: f64,
    twice: ErrorReport,
    all: ErrorReport,
}

fn spread(all: &[Lit], of: impl Fn(&Lit) -> f64) -> Spread {
    Spread::of(all.iter().map(of).collect())
}

/// At how many places a live map brings a picture nearer to all light.
fn of_live_maps(scene: &str, alone: &[Lit], with: &[Lit]) -> String {
    let nearer = |of: fn(&Lit) -> f64| {
        let without = spread(alone, of).median;
        with.iter().filter(|lit| of(lit) < without).count()
    };
    format!(
        "{scene}: of {} places, a live map brings the mean nearer to that of all light at {}, and the relative MSE down at {}.",
        with.len(),
        nearer(|lit| lit.all.relative_bias.abs()),
        nearer(|lit| lit.all.relative_mse)
    )
}

/// The measure.
///
/// # Errors
/// Those of scenes, rendering and files.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let (size, quality, scenes) = if context.smoke {
        (SMOKE_SIZE, SMOKE_QUALITY, &SCENES[..1])
    } else {
        (SIZE, QUALITY, &SCENES[..])
    };
    let mut interreflection = Table::new(
        "Light between surfaces, by a live map",
        &[
            "scene",
            "way",
            "GPU time (ms)",
            "relative MSE, light scattered twice at most",
            "its least of the places",
            "its greatest",
            "relative bias, light scattered twice at most",
            "relative MSE, all light",
            "least of the places",
            "greatest",
            "relative bias, all light",
        ],
    );
    for (done, address) in scenes.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(address, done, scenes.len());
        let subject = Subject::new(&gpu, &scene::load(address)?)?;
        let [alone, with] = by_live_map(&subject, size, quality)?;
        for (way, all) in [("lights alone", &alone), ("with a live map", &with)] {
            let [twice, of_all] = [
                spread(all, |lit| lit.twice.relative_mse),
                spread(all, |lit| lit.all.relative_mse),
            ];
            interreflection.row([
                (*address).into(),
                way.into(),
                (1e3 * spread(all, |lit| lit.seconds).median).into(),
                twice.median.into(),
                twice.least.into(),
                twice.greatest.into(),
                spread(all, |lit| lit.twice.relative_bias).median.into(),
                of_all.median.into(),
                of_all.least.into(),
                of_all.greatest.into(),
                spread(all, |lit| lit.all.relative_bias).median.into(),
            ]);
        }
        interreflection.note(of_live_maps(address, &alone, &with));
    }
    let side = MAP.side;
    interreflection.note(format!(
        "A live map of {side}², of light scattered once, lights all surfaces; nothing stands in its way, and it comes from infinity. It is drawn at nine places at half \
         the height of the box around the scene, at a quarter, a half and three quarters of its other sides; those inside bodies see nothing. Columns without a name \
         of their own are medians of the places. {0}² pixels against path-traced ones of {1} samples a pixel; shadow maps of {2}², and {3}² samples a pixel.",
        size.0, size.1, quality.0, quality.1
    ));
    Ok(vec![interreflection])
}
