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
use crate::timing::{Spread, median, repeated};

/// Scenes that a point light alone lights.
const SCENES: [&str; 5] = [
    "builtin:cornell-box?source=point",
    "builtin:box-room?source=point",
    "builtin:atrium?source=point",
    "builtin:cathedral?source=point",
    "builtin:conference?source=point",
];
/// Texels along a side of an octahedron, cubes having as many in all, and samples along a side of a pixel.
type Quality = (u32, u32);
/// What the live maps' pictures are drawn with.
const FINE: Quality = (2048, 4);
const MAP: LightProbeDesc = LightProbeDesc { side: 256, finest: 128 };
/// Places of live maps along each axis of the box around a scene, as shares of it: nine at half its height.
const SHARES: [f32; 3] = [0.25, 0.5, 0.75];
const REPEATS: usize = 5;
const SEED: u32 = 1;
const REFERENCE_SEED: u32 = 2;
/// The last pass of a shadow map.
const SHADOWS_DRAWN: &str = "shadow maps: distances";
/// What point lights alone make: emission, and light scattered once.
const ONCE: &str = "bounces=0..1";
const TWICE: &str = "bounces=0..2";

/// Pictures of one size.
#[derive(Clone, Copy)]
struct Plan {
    /// Pixels along a side.
    size: u32,
    qualities: &'static [Quality],
    /// Samples a pixel of the path tracer.
    spp: &'static [u32],
    reference_spp: u32,
    repeats: usize,
}

const PLANS: [Plan; 2] = [
    Plan {
        size: 128,
        qualities: &[
            (256, 1),
            (512, 1),
            (1024, 1),
            (1024, 2),
            (2048, 2),
            (2048, 4),
            (4096, 4),
        ],
        spp: &[1, 2, 4, 8, 16, 32],
        reference_spp: 1024,
        repeats: REPEATS,
    },
    Plan {
        size: 384,
        qualities: &[(512, 1), (1024, 2), (2048, 4)],
        spp: &[1, 4, 16],
        reference_spp: 256,
        repeats: 3,
    },
];
const SMOKE: Plan = Plan {
    size: 16,
    qualities: &[(256, 1), (512, 1)],
    spp: &[1, 2],
    reference_spp: 16,
    repeats: 1,
};

fn errors(picture: &Picture, reference: &Picture) -> Result<ErrorReport> {
    compare(picture, reference, &CompareOptions::default())
}

/// A picture and seconds of the device.
struct Frame {
    picture: Picture,
    seconds: f64,
    /// Those of its lights and shadow maps.
    shadows: Option<f64>,
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

    /// A path-traced picture, and seconds of the device.
    fn traced(&self, size: u32, paths: &str, spp: u32, seed: u32) -> Result<(Picture, f64)> {
        let rendered = self.renderer.render(&RenderOptions {
            technique: Some("path".into()),
            size: [size; 2],
            spp,
            seed,
            settings: json!({"path_set": paths}).into(),
            ..RenderOptions::default()
        })?;
        Ok((rendered.picture, rendered.report.gpu_seconds))
    }

    /// A preview's picture: lights, the live map at a place, if one is asked for, and what the camera sees, all drawn anew each time.
    fn previewed(
        &self,
        size: u32,
        layout: ShadowLayout,
        (side, samples): Quality,
        place: Option<Vec3>,
        repeats: usize,
    ) -> Result<Frame> {
        let scene = self.renderer.gpu_scene();
        let texels = u64::from(side) * u64::from(side);
        let desc = PreviewDesc {
            size: [size; 2],
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
            if let Some(last) = timings.passes.iter().rposition(|pass| pass.name == SHADOWS_DRAWN) {
                let nanoseconds = timings.passes[..=last].iter().filter_map(|pass| pass.nanoseconds);
                shadows.push(1e-9 * nanoseconds.sum::<u64>() as f64);
            }
            Ok::<_, Error>(((), timings.seconds()))
        })?;
        Ok(Frame {
            picture: preview.picture()?,
            seconds: median(seconds),
            // The first warms up.
            shadows: shadows.get(1..).map(|timed| median(timed.to_vec())),
        })
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

/// How long the path tracer takes for the errors of each of the preview's settings, over the preview's own time: the least and the greatest.
fn verdict(name: &str, previews: &[Point], traced: &[Point]) -> String {
    let curve: Vec<(f64, f64)> = traced.iter().map(Point::cost_and_error).collect();
    let mut ratios: Vec<(f64, String)> = previews
        .iter()
        .filter_map(|point| {
            let (own, error) = point.cost_and_error();
            let (bound, seconds) = match cost_of(&curve, error)? {
                Cost::Measured(seconds) => ("", seconds),
                Cost::AtMost(seconds) => ("at most ", seconds),
                Cost::Above(seconds) => ("more than ", seconds),
            };
            let ratio = seconds / own;
            let (texels, samples) = (point.texels.unwrap_or_default(), point.samples);
            let words =
                format!("{bound}{ratio:.2} (relative MSE {error:.2e}, {texels} texels, {samples} samples a pixel)");
            Some((ratio, words))
        })
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    match (ratios.first(), ratios.last()) {
        (Some((_, least)), Some((_, most))) => {
            format!("{name}: for equal error the path tracer takes, of the preview's time, from {least} to {most}.")
        }
        _ => format!("{name}: nothing to compare."),
    }
}

impl Plan {
    /// Pictures by lights alone: each way's name and points, the path tracer last.
    fn by_lights(&self, subject: &Subject<'_>) -> Result<Vec<(String, Vec<Point>)>> {
        let (right, _) = subject.traced(self.size, ONCE, self.reference_spp, REFERENCE_SEED)?;
        let mut lines = Vec::new();
        for layout in ShadowLayout::ALL {
            let points = self.qualities.iter().map(|(side, samples)| {
                let frame = subject.previewed(self.size, layout, (*side, *samples), None, self.repeats)?;
                Ok(Point {
                    texels: Some(u64::from(side * side)),
                    samples: u64::from(samples * samples),
                    seconds: frame.seconds,
                    shadows: frame.shadows,
                    errors: errors(&frame.picture, &right)?,
                })
            });
            lines.push((
                format!("preview, {}", layout.name()),
                points.collect::<Result<Vec<_>>>()?,
            ));
        }
        let points = self.spp.iter().map(|spp| {
            let (picture, seconds) = repeated(self.repeats, || subject.traced(self.size, ONCE, *spp, SEED))?;
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

    /// A picture by lights alone, and those with a live map at each of the places.
    fn by_live_map(&self, subject: &Subject<'_>) -> Result<[Vec<Lit>; 2]> {
        let (twice, _) = subject.traced(self.size, TWICE, self.reference_spp, REFERENCE_SEED)?;
        let (all, _) = subject.traced(self.size, "all", self.reference_spp, REFERENCE_SEED)?;
        let quality = if self.qualities.contains(&FINE) {
            FINE
        } else {
            self.qualities[0]
        };
        let lit = |place| {
            let frame = subject.previewed(self.size, ShadowLayout::Octahedron, quality, place, 1)?;
            Ok(Lit {
                seconds: frame.seconds,
                twice: errors(&frame.picture, &twice)?,
                all: errors(&frame.picture, &all)?,
            })
        };
        let with: Result<Vec<Lit>> = subject.places().into_iter().map(|place| lit(Some(place))).collect();
        Ok([vec![lit(None)?], with?])
    }
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
    let (plans, scenes) = if context.smoke {
        (&[SMOKE][..], &SCENES[..1])
    } else {
        (&PLANS[..], &SCENES[..])
    };
    let mut pictures = Table::new(
        "Pictures by lights alone",
        &[
            "scene",
            "pixels a side",
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
        for plan in plans {
            let curves = compared(&mut pictures, address, plan, &subject)?;
            let title = format!("{address}, {} × {} pixels", plan.size, plan.size);
            let words = Words {
                title: &title,
                x: "GPU time (s)",
                y: "root of the relative MSE",
            };
            if let Some(svg) = plot::log_log(words, &curves)? {
                let file = context.file(&format!("{}-{}.svg", done + 1, plan.size))?;
                atomic::write(&file, svg.as_bytes())?;
            }
        }
        let [alone, with] = plans[0].by_live_map(&subject)?;
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
    let [of_references, sizes] = [
        plans
            .iter()
            .map(|plan| plan.reference_spp.to_string())
            .collect::<Vec<_>>(),
        plans.iter().map(|plan| format!("{}²", plan.size)).collect(),
    ]
    .map(|words| words.join(" and "));
    pictures.note(format!(
        "Pictures of {sizes} pixels against path-traced ones of {of_references} samples a pixel of the same light paths: emission, and light of the scene's point \
         light scattered once. A frame is drawn whole, shadow maps included, whose part does not grow with the picture; the mean of a pixel's samples is taken \
         after it. Cubes have as many texels as octahedra. Times are of the device's timestamps, medians; the path tracer's are of all its passes. The front is that of \
         error and time in this scene and size, whose plots are beside this table (`1-128.svg` and so on)."
    ));
    interreflection.note(format!(
        "A live map of {}², of light scattered once, lights all surfaces; nothing stands in its way, and it comes from infinity. It is drawn at nine places at half \
         the height of the box around the scene, at a quarter, a half and three quarters of its other sides; those inside bodies see nothing. Columns without a name \
         of their own are medians of the places. {}² pixels, and as shadow maps and samples {}² and {} a pixel (in the smallest form the coarsest).",
        MAP.side,
        plans[0].size,
        FINE.0,
        FINE.1 * FINE.1
    ));
    Ok(vec![pictures, interreflection])
}

/// Adds the rows and verdicts of a scene in one size: the curves of all ways.
fn compared(pictures: &mut Table, address: &str, plan: &Plan, subject: &Subject<'_>) -> Result<Vec<Curve>> {
    let lines = plan.by_lights(subject)?;
    let all = lines.iter().flat_map(|(_, points)| points);
    let mut on_front = pareto::front(&all.map(Point::cost_and_error).collect::<Vec<_>>()).into_iter();
    let mut curves = Vec::new();
    for (name, points) in &lines {
        let mut drawn = Vec::new();
        for (point, ringed) in points.iter().zip(on_front.by_ref()) {
            let (x, y) = point.cost_and_error();
            drawn.push(PlotPoint {
                x,
                y: y.sqrt(),
                y_range: [y.sqrt(); 2],
                ringed,
            });
            pictures.row([
                address.into(),
                u64::from(plan.size).into(),
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
            pictures.note(verdict(
                &format!("{address}, {}² pixels, {name}", plan.size),
                points,
                traced,
            ));
        }
    }
    Ok(curves)
}
