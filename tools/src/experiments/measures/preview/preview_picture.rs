//! Pictures of the raster preview beside the path tracer's: how wrong they are and what a frame of them costs, by shadow maps and samples, and how
//! near a live map comes to light that surfaces throw at each other.
//!
//! Sources: those of [`clerestory::techniques::preview`]. Oracle: the path tracer on the same light paths.

use clerestory::film::atomic;
use clerestory::film::{CompareOptions, ErrorReport, Picture, compare};
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Scene};
use clerestory::techniques::preview::{LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows};
use clerestory::{Error, Result, scene};
use glam::Vec3;
use serde_json::json;

use crate::experiments::equal_error::{Cost, cost_of};
use crate::experiments::measures::Context;
use crate::experiments::pareto;
use crate::experiments::plot::{self, Curve, PlotPoint, Words};
use crate::experiments::table::Table;
use crate::timing::{median, repeated};

/// Scenes lit by point lights, and the live map's place as a share of the box around each.
const SCENES: [(&str, Vec3); 5] = [
    ("builtin:cornell-box?source=point", Vec3::new(0.25, 0.5, 0.4)),
    ("builtin:box-room?source=point", Vec3::new(0.45, 0.4, 0.55)),
    ("builtin:atrium?source=point", Vec3::new(0.5, 0.3, 0.5)),
    ("builtin:cathedral?source=point", Vec3::new(0.5, 0.25, 0.55)),
    ("builtin:conference?source=point", Vec3::new(0.4, 0.5, 0.45)),
];
const SIZE: u32 = 128;
/// Texels along a side of an octahedron, cubes having as many in all, and samples along a side of a pixel.
const QUALITIES: [(u32, u32); 7] = [
    (256, 1),
    (512, 1),
    (1024, 1),
    (1024, 2),
    (2048, 2),
    (2048, 4),
    (4096, 4),
];
/// What the live map's pictures are drawn with.
const FINE: (u32, u32) = (2048, 4);
const MAP: LightProbeDesc = LightProbeDesc { side: 256, finest: 128 };
const SPP: [u32; 6] = [1, 2, 4, 8, 16, 32];
const REFERENCE_SPP: u32 = 1024;
const REPEATS: usize = 5;
const SEED: u32 = 1;
const REFERENCE_SEED: u32 = 2;
/// The last pass of a shadow map.
const SHADOWS_DRAWN: &str = "shadow maps: distances";
/// What lights alone make: emission, and light scattered once.
const ONCE: &str = "bounces=0..1";
const TWICE: &str = "bounces=0..2";

fn errors(picture: &Picture, reference: &Picture) -> Result<ErrorReport> {
    compare(picture, reference, &CompareOptions::default())
}

/// A picture and seconds of the device.
struct Frame {
    picture: Picture,
    seconds: f64,
    /// Those of its lights and shadow maps.
    shadows: f64,
}

/// A scene for both.
struct Subject<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    camera: Camera,
    lights: Vec<LightKind>,
    size: u32,
}

impl<'a> Subject<'a> {
    fn new(gpu: &'a Gpu, scene: &Scene, size: u32) -> Result<Self> {
        Ok(Self {
            gpu,
            renderer: Renderer::new(gpu, scene)?,
            camera: scene.require_camera(None)?.clone(),
            lights: scene.lights.iter().map(|light| light.kind).collect(),
            size,
        })
    }

    /// A path-traced picture, and seconds of the device.
    fn traced(&self, paths: &str, spp: u32, seed: u32) -> Result<(Picture, f64)> {
        let mut rendering = self.renderer.start(&RenderOptions {
            technique: Some("path".into()),
            size: [self.size; 2],
            spp,
            seed,
            settings: json!({"path_set": paths}),
            ..RenderOptions::default()
        })?;
        while rendering.step()?.is_some() {}
        let rendered = rendering.finish()?;
        Ok((rendered.picture, rendered.report.gpu_seconds))
    }

    /// A preview's picture: lights, the live map at a place, if one is asked for, and what the camera sees, all drawn anew each time.
    fn previewed(
        &self,
        layout: ShadowLayout,
        (side, samples): (u32, u32),
        place: Option<Vec3>,
        repeats: usize,
    ) -> Result<Frame> {
        let scene = self.renderer.gpu_scene();
        let texels = u64::from(side) * u64::from(side);
        let desc = PreviewDesc {
            size: [self.size; 2],
            samples,
            lights: self.lights.len() as u32,
            shadows: Some(PreviewShadows {
                layout,
                side: layout.side_for(texels),
                width: 0,
            }),
            has_probes: place.is_some(),
        };
        let mut preview = Preview::new(self.gpu, scene, desc)?;
        let live = place
            .map(|place| LiveProbe::new(self.gpu, scene, &preview, MAP, false).map(|live| (live, place)))
            .transpose()?;
        let surfaces = scene.surfaces();
        let mut shadows = Vec::new();
        let ((), seconds) = repeated(repeats, || {
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
            // Each light's ends with this pass, and those of the picture follow.
            let drawn = timings.passes.iter().rposition(|pass| pass.name == SHADOWS_DRAWN);
            let of_shadows = &timings.passes[..drawn.map_or(0, |last| last + 1)];
            let nanoseconds: u64 = of_shadows.iter().filter_map(|pass| pass.nanoseconds).sum();
            shadows.push(1e-9 * nanoseconds as f64);
            Ok::<_, Error>(((), timings.seconds()))
        })?;
        Ok(Frame {
            picture: preview.picture()?,
            seconds: median(seconds),
            // The first warms up.
            shadows: median(shadows[1.min(shadows.len() - 1)..].to_vec()),
        })
    }

    fn at(&self, share: Vec3) -> Vec3 {
        let [lower, upper] = self.renderer.gpu_scene().bounds();
        lower + share * (upper - lower)
    }
}

/// A setting and what came of it.
struct Point {
    /// Texels a light; none for rays.
    texels: Option<u64>,
    /// A pixel.
    samples: u64,
    seconds: f64,
    shadows: Option<f64>,
    errors: ErrorReport,
}

impl Point {
    fn cost_and_error(&self) -> (f64, f64) {
        (self.seconds, self.errors.relative_mse)
    }
}

/// How long the path tracer takes for the errors of the preview's quickest setting and of its least error.
fn verdict(name: &str, previews: &[Point], traced: &[Point]) -> String {
    let curve: Vec<(f64, f64)> = traced.iter().map(Point::cost_and_error).collect();
    let beside = |point: &Point| {
        let (own, error) = point.cost_and_error();
        let times = match cost_of(&curve, error) {
            Some(Cost::Measured(seconds)) => format!("{:.2}", seconds / own),
            Some(Cost::AtMost(seconds)) => format!("at most {:.2}", seconds / own),
            Some(Cost::Above(seconds)) => format!("more than {:.2}", seconds / own),
            None => "unknown".to_owned(),
        };
        format!("{error:.2e} in {:.1} ms (rays: {times} times as long)", 1e3 * own)
    };
    let first = |by: fn(&Point) -> f64| previews.iter().min_by(|a, b| by(a).total_cmp(&by(b)));
    let both = [first(|point| point.seconds), first(|point| point.errors.relative_mse)];
    let [quickest, least] = both.map(|point| point.map_or_else(String::new, beside));
    format!("{name}: relative MSE of the quickest {quickest}, least {least}.")
}

/// What is measured of each scene.
struct Plan {
    size: u32,
    qualities: &'static [(u32, u32)],
    spp: &'static [u32],
    reference_spp: u32,
    repeats: usize,
}

impl Plan {
    /// Pictures by lights alone: each way's name and points, the path tracer last.
    fn by_lights(&self, subject: &Subject<'_>) -> Result<Vec<(String, Vec<Point>)>> {
        let (right, _) = subject.traced(ONCE, self.reference_spp, REFERENCE_SEED)?;
        let mut lines = Vec::new();
        for layout in ShadowLayout::ALL {
            let points = self.qualities.iter().map(|(side, samples)| {
                let frame = subject.previewed(layout, (*side, *samples), None, self.repeats)?;
                Ok(Point {
                    texels: Some(u64::from(side * side)),
                    samples: u64::from(samples * samples),
                    seconds: frame.seconds,
                    shadows: Some(frame.shadows),
                    errors: errors(&frame.picture, &right)?,
                })
            });
            lines.push((
                format!("preview, {}", layout.name()),
                points.collect::<Result<Vec<_>>>()?,
            ));
        }
        let points = self.spp.iter().map(|spp| {
            let (picture, seconds) = repeated(self.repeats, || subject.traced(ONCE, *spp, SEED))?;
            Ok(Point {
                texels: None,
                samples: u64::from(*spp),
                seconds: median(seconds),
                shadows: None,
                errors: errors(&picture, &right)?,
            })
        });
        lines.push(("path tracer".into(), points.collect::<Result<Vec<_>>>()?));
        Ok(lines)
    }

    /// Rows of pictures without and with a live map at a place, against light scattered twice at most and against all light.
    fn by_live_map(&self, subject: &Subject<'_>, place: Vec3) -> Result<[Lit; 2]> {
        let (twice, _) = subject.traced(TWICE, self.reference_spp, REFERENCE_SEED)?;
        let (all, _) = subject.traced("all", self.reference_spp, REFERENCE_SEED)?;
        let quality = if self.qualities.contains(&FINE) {
            FINE
        } else {
            self.qualities[0]
        };
        let lit = |way, place| {
            let frame = subject.previewed(ShadowLayout::Octahedron, quality, place, self.repeats)?;
            let both = [errors(&frame.picture, &twice)?, errors(&frame.picture, &all)?];
            Ok((way, frame.seconds, both))
        };
        Ok([lit("lights alone", None)?, lit("with a live map", Some(place))?])
    }
}

/// A way to light a picture, seconds of a frame, and errors against light scattered twice at most and against all light.
type Lit = (&'static str, f64, [ErrorReport; 2]);

/// Whether a live map brings a picture nearer to all light.
fn of_live_map(scene: &str, [(_, _, [_, alone]), (_, _, [_, with])]: &[Lit; 2]) -> String {
    let nearer = |without: f64, with: f64| if with < without { "nearer to" } else { "farther from" };
    format!(
        "{scene}: a live map brings the mean {} that of all light, and the pixels {} theirs by relative MSE.",
        nearer(alone.relative_bias.abs(), with.relative_bias.abs()),
        nearer(alone.relative_mse, with.relative_mse)
    )
}

/// The measure.
///
/// # Errors
/// Those of scenes, rendering and files.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let plan = if context.smoke {
        Plan {
            size: 16,
            qualities: &QUALITIES[..2],
            spp: &SPP[..2],
            reference_spp: 16,
            repeats: 1,
        }
    } else {
        Plan {
            size: SIZE,
            qualities: &QUALITIES,
            spp: &SPP,
            reference_spp: REFERENCE_SPP,
            repeats: REPEATS,
        }
    };
    let own: Vec<(String, Vec3)> = if context.scenes.is_empty() {
        let count = if context.smoke { 1 } else { SCENES.len() };
        let of = |(address, share): &(&str, Vec3)| ((*address).to_owned(), *share);
        SCENES[..count].iter().map(of).collect()
    } else {
        let middle = Vec3::splat(0.5);
        context.scenes.iter().map(|address| (address.clone(), middle)).collect()
    };
    let mut pictures = Table::new(
        "Pictures by lights alone",
        &[
            "scene",
            "way",
            "texels a light",
            "samples a pixel",
            "GPU time (ms)",
            "of it lights and shadow maps (ms)",
            "relative MSE",
            "relative bias",
            "FLIP",
            "on the front",
        ],
    );
    let mut interreflection = Table::new(
        "Light between surfaces, by a live map",
        &[
            "scene",
            "way",
            "GPU time (ms)",
            "relative MSE, light scattered twice at most",
            "relative bias",
            "relative MSE, all light",
            "relative bias of it",
        ],
    );
    for (done, (address, share)) in own.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(address, done, own.len());
        let subject = Subject::new(&gpu, &scene::load(address)?, plan.size)?;
        let lines = plan.by_lights(&subject)?;
        let all = lines.iter().flat_map(|(_, points)| points);
        let mut on_front = pareto::front(&all.map(Point::cost_and_error).collect::<Vec<_>>()).into_iter();
        let mut curves = Vec::new();
        for (name, points) in &lines {
            let mut drawn = Vec::new();
            for (point, ringed) in points.iter().zip(on_front.by_ref()) {
                let (x, y) = point.cost_and_error();
                drawn.push(PlotPoint {
                    x,
                    y,
                    y_range: [y; 2],
                    ringed,
                });
                pictures.row([
                    address.as_str().into(),
                    name.as_str().into(),
                    point.texels.into(),
                    point.samples.into(),
                    (1e3 * x).into(),
                    point.shadows.map(|seconds| 1e3 * seconds).into(),
                    y.into(),
                    point.errors.relative_bias.into(),
                    point.errors.flip.into(),
                    (if ringed { "yes" } else { "no" }).into(),
                ]);
            }
            curves.push(Curve {
                name: name.clone(),
                points: drawn,
            });
        }
        if let Some(((_, traced), previews)) = lines.split_last() {
            for (name, points) in previews {
                pictures.note(verdict(&format!("{address}, {name}"), points, traced));
            }
        }
        let words = Words {
            title: address,
            x: "GPU time (s)",
            y: "relative MSE",
        };
        if let Some(svg) = plot::log_log(words, &curves)? {
            std::fs::create_dir_all(context.folder).map_err(|error| Error::io(context.folder, error))?;
            atomic::write(&context.folder.join(format!("{}.svg", done + 1)), svg.as_bytes())?;
        }
        let ways = plan.by_live_map(&subject, subject.at(*share))?;
        interreflection.note(of_live_map(address, &ways));
        for (way, seconds, [of_twice, of_all]) in ways {
            interreflection.row([
                address.as_str().into(),
                way.into(),
                (1e3 * seconds).into(),
                of_twice.relative_mse.into(),
                of_twice.relative_bias.into(),
                of_all.relative_mse.into(),
                of_all.relative_bias.into(),
            ]);
        }
    }
    pictures.note(format!(
        "Pictures of {SIZE}² against path-traced ones of {REFERENCE_SPP} samples a pixel of the same light paths: emission, and light of the scene's point lights scattered \
         once. A frame is drawn whole, shadow maps included, whose part does not grow with the picture; cubes have as many texels as octahedra. Times are of the \
         device's timestamps, medians of {REPEATS}; the path tracer's are of all its passes. The front is that of error and time in this scene; `1.svg` and so on beside \
         this table are its plots."
    ));
    interreflection.note(format!(
        "A live map of {}² at one place of each scene, of light scattered once, lights all surfaces; nothing stands in its way, and it comes from infinity. \
         {} samples a pixel, shadow maps of {}².",
        MAP.side,
        FINE.1 * FINE.1,
        FINE.0
    ));
    Ok(vec![pictures, interreflection])
}
