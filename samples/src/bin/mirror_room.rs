//! A mirror in a room by distance impostors: pictures side by side, from the classical environment map to the search in distances, and the path tracer's.
//!
//! `mirror_room [FILE] [--scene SCENE] [--size WxH] [--spp N] [--map TEXELS] [--steps N]`, or in a window
//! `mirror_room --show METHOD [--scene SCENE] [--map TEXELS] [--steps N]` and the viewer's options
//!
//! From left to right: the map looked up in the direction of the reflected ray, as if all were infinitely far; with one step by distances; by the hybrid search
//! of `--steps` steps; and by rays. All have the same light paths: direct light, and direct light in a mirror. What each differs from the last one by is printed.
//!
//! The window begins with the method that `--show` names, as the setting `method` of the technique has it. M goes on to the next one and N back to the one before; D shows by how much the picture differs from rays,
//! black for nothing and white for a quarter of their mean, E how far from a surface each search has ended (its residual, dark for none and bright for a tenth), and P the picture again.
//!
//! Source: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::film::{Picture, PixelFormat, png};
use clerestory::gpu::{Buffer, Gpu, GpuOptions};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene;
use clerestory::techniques::impostors::{ImpostorReflections, ReflectionMethod, ReflectionSettings};
use clerestory::techniques::{self, PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::orbit::{Orbit, Pose};
use clerestory_samples::panels::{ERRORS, SEQUENTIAL, Scale, Sheet, color};
use clerestory_samples::window::{self, Canvas, Show, Shown};
use serde_json::{Value, json};
use winit::keyboard::Key;

const SCENE: &str = "builtin:divider-room?object=mirror";
/// Pixels of each picture, unless told otherwise.
const SIZE: [u32; 2] = [240, 240];
const SAMPLES: u32 = 64;
const STEPS: u32 = 8;
const TEXELS: u32 = 256;
/// Stops, for the default scene.
const EXPOSURE: f64 = 1.0;
/// Pictures side by side.
const PICTURES: u32 = 4;

/// What is white where differences are shown, as a share of the mean radiance by rays.
const DIFFERENCE: f64 = 0.25;
/// Paths whose searches are shown, at most: they are together in one wave.
const SEARCHES: u32 = 1 << 16;
/// What is brightest where residuals are shown.
const RESIDUAL: f64 = 0.1;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = ["--scene", "--spp", "--map", "--steps", "--show"];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let Some(name) = given.text("--show") else {
        let path = given
            .alone(0)
            .map_or_else(|| PathBuf::from("out/mirror_room.png"), PathBuf::from);
        strip(&path, &given)?;
        println!("wrote {}", path.display());
        return Ok(());
    };
    let method = method(name)?;
    let settings = ReflectionSettings {
        steps: given.value("--steps")?.unwrap_or(STEPS),
        side: given.value("--map")?.unwrap_or(TEXELS),
        ..ReflectionSettings::default()
    };
    let scene = scene::load(given.text("--scene").unwrap_or(SCENE))?;
    window::show_scene(window::Options::of(&given, "")?, scene, |canvas| {
        Mirrors::new(canvas, method, settings)
    })
}

/// The name of a method, as the technique's settings have it.
fn name_of(method: ReflectionMethod) -> String {
    let name = serde_json::to_value(method).ok();
    name.and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_default()
}

/// A method by its name.
fn method(name: &str) -> Result<ReflectionMethod> {
    let known = ReflectionMethod::ALL
        .into_iter()
        .find(|method| name_of(*method) == name);
    known.ok_or_else(|| {
        let all = ReflectionMethod::ALL.map(name_of).join(", ");
        Error::setting("--show", name, format!("is not one of {all}"))
    })
}

/// What of a method is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shows {
    Picture,
    Difference,
    Residual,
}

/// A window on the mirror by one method after the other.
struct Mirrors {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: ReflectionSettings,
    method: ReflectionMethod,
    shows: Shows,
    exposure: f32,
    format: PixelFormat,
    view: Option<View>,
}

/// Pictures of the window's size.
struct View {
    mirrors: ImpostorReflections,
    /// Once differences are asked for.
    rays: Option<PathTracer>,
    /// Once residuals are asked for, a path for each block of so many pixels across and down.
    searches: Option<(ImpostorReflections, u32)>,
    pixels: Buffer,
    size: [u32; 2],
    method: ReflectionMethod,
    pose: Pose,
    /// Samples per pixel.
    samples: u32,
}

impl Mirrors {
    fn new(canvas: &Canvas<'_>, method: ReflectionMethod, settings: ReflectionSettings) -> Result<Self> {
        Ok(Self {
            gpu: canvas.gpu.clone(),
            scene: Arc::new(GpuScene::new(canvas.gpu, canvas.scene)?),
            settings,
            method,
            shows: Shows::Picture,
            exposure: canvas.exposure,
            format: canvas.format,
            view: None,
        })
    }

    /// Reflections by the method that is shown.
    fn mirrors(&self, orbit: &Orbit, size: [u32; 2], keeps_look_ups: bool) -> Result<ImpostorReflections> {
        let settings = ReflectionSettings {
            method: self.method,
            keeps_look_ups,
            ..self.settings.clone()
        };
        let scene = Arc::clone(&self.scene);
        ImpostorReflections::new(&self.gpu, scene, &orbit.camera(), size, settings)
    }

    fn open(&self, orbit: &Orbit, size: [u32; 2]) -> Result<View> {
        Ok(View {
            mirrors: self.mirrors(orbit, size, false)?,
            rays: None,
            searches: None,
            pixels: window::pixels(&self.gpu, size)?,
            size,
            method: self.method,
            pose: orbit.pose(),
            samples: 0,
        })
    }

    /// By how much the picture differs from that by rays on the same light paths.
    fn difference(&self, view: &mut View, orbit: &Orbit) -> Result<Sheet> {
        let rays = match &mut view.rays {
            Some(rays) => rays,
            None => {
                let settings = PathTracerSettings {
                    path_set: view.mirrors.path_set(),
                    ..PathTracerSettings::default()
                };
                let scene = Arc::clone(&self.scene);
                let tracer = PathTracer::new(&self.gpu, scene, &orbit.camera(), view.size, settings)?;
                view.rays.insert(tracer)
            }
        };
        while rays.step(view.samples)?.is_some() {}
        let [found, expected] = [view.mirrors.picture()?.0, rays.picture()?.0];
        let (found, expected) = (found.main_layer()?, expected.main_layer()?);
        let sum: f64 = expected.values().iter().map(|value| f64::from(*value)).sum();
        let white = DIFFERENCE * sum / expected.values().len().max(1) as f64;
        let apart = |(a, b): ([f32; 3], [f32; 3])| (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum::<f64>() / 3.0;
        let shares: Vec<f64> = found
            .pixels()
            .zip(expected.pixels())
            .map(|pair| apart(pair) / white)
            .collect();
        Ok(sheet(view.size, ERRORS, |pixel| Some(shares[pixel])))
    }

    /// How far from a surface searches have ended; black where nothing is mirrored.
    fn residual(&self, view: &mut View, orbit: &Orbit) -> Result<Sheet> {
        let size = view.size;
        let (searches, block) = match &mut view.searches {
            Some(searches) => searches,
            None => {
                let fits =
                    |block: &u32| size.map(|side| side.div_ceil(*block)).into_iter().product::<u32>() <= SEARCHES;
                let block = (1..).find(fits).unwrap_or(1);
                let of_blocks = size.map(|side| side.div_ceil(block));
                view.searches.insert((self.mirrors(orbit, of_blocks, true)?, block))
            }
        };
        while searches.step(1)?.is_some() {}
        let [across, down] = size.map(|side| side.div_ceil(*block));
        let mut residuals = vec![None; (across * down) as usize];
        for look_up in searches.looked_up()? {
            if let Some(residual) = residuals.get_mut(look_up.slot as usize) {
                *residual = Some(f64::from(look_up.residual) / RESIDUAL);
            }
        }
        let of = |pixel: usize| {
            let [x, y] = [pixel % size[0] as usize, pixel / size[0] as usize].map(|place| place / *block as usize);
            residuals[y * across as usize + x]
        };
        Ok(sheet(size, SEQUENTIAL, of))
    }
}

/// A picture of shares of a scale, pixel by pixel.
fn sheet([width, height]: [u32; 2], scale: Scale, share: impl Fn(usize) -> Option<f64>) -> Sheet {
    let mut sheet = Sheet::new([width, height], [0; 3]);
    for pixel in 0..width * height {
        if let Some(share) = share(pixel as usize) {
            sheet.put(pixel % width, pixel / width, color(scale, share));
        }
    }
    sheet
}

impl Show for Mirrors {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let begin = Instant::now();
        let is_this = |view: &View| view.size == size && view.method == self.method;
        // The old pictures go before new ones are made, so that they need no memory at once.
        let mut view = match self.view.take().filter(is_this) {
            Some(view) => view,
            None => self.open(orbit, size)?,
        };
        if view.pose != orbit.pose() {
            view.mirrors.set_camera(&orbit.camera())?;
            if let Some(rays) = &mut view.rays {
                rays.set_camera(&orbit.camera())?;
            }
            if let Some((searches, _)) = &mut view.searches {
                searches.set_camera(&orbit.camera())?;
            }
            (view.pose, view.samples) = (orbit.pose(), 0);
        }
        view.samples += 1;
        while view.mirrors.step(view.samples)?.is_some() {}
        let sheet = match self.shows {
            Shows::Picture => None,
            Shows::Difference => Some(self.difference(&mut view, orbit)?),
            Shows::Residual => Some(self.residual(&mut view, orbit)?),
        };
        match sheet {
            Some(sheet) => self.gpu.upload(&view.pixels, 0, &sheet.bytes(self.format))?,
            None => view.mirrors.display(&view.pixels, self.exposure, self.format)?,
        }
        let shown = Shown::since(begin, &view.pixels);
        self.view = Some(view);
        Ok(shown)
    }

    fn title(&mut self) -> String {
        let counts = self.view.as_ref().map(|view| view.mirrors.counts()).unwrap_or_default();
        let share = 100.0 * counts.unfound as f64 / counts.reflections.max(1) as f64;
        format!("{}, {share:.1} % of searches end beside surfaces", name_of(self.method))
    }

    fn key(&mut self, key: &Key) {
        let Key::Character(text) = key else { return };
        let all = ReflectionMethod::ALL;
        let at = all.iter().position(|method| *method == self.method).unwrap_or(0);
        match text.to_lowercase().as_str() {
            "m" => self.method = all[(at + 1) % all.len()],
            "n" => self.method = all[(at + all.len() - 1) % all.len()],
            "d" => self.shows = Shows::Difference,
            "e" => self.shows = Shows::Residual,
            "p" => self.shows = Shows::Picture,
            _ => {}
        }
    }

    fn end(&mut self) {
        println!("{}", self.title());
    }
}

/// The pictures side by side.
fn strip(path: &Path, arguments: &Arguments) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let renderer = Renderer::new(&gpu, &scene::load(arguments.text("--scene").unwrap_or(SCENE))?)?;
    let size = arguments.size("--size")?.unwrap_or(SIZE);
    let spp = arguments.value("--spp")?.unwrap_or(SAMPLES);
    let steps: u32 = arguments.value("--steps")?.unwrap_or(STEPS);
    let texels: u32 = arguments.value("--map")?.unwrap_or(TEXELS);
    let paths = techniques::by_id("impostor")?.path_set.to_string();
    let by = |method: &str| json!({ "method": method, "steps": steps, "side": texels });
    let columns: [(&str, &str, Value); PICTURES as usize] = [
        ("the map alone", "impostor", by("classical")),
        ("one step", "impostor", by("one_step")),
        ("the search", "impostor", by("hybrid")),
        ("rays", "path", json!({ "path_set": paths })),
    ];
    let mut pictures = Vec::new();
    for (name, technique, settings) in columns {
        let rendered = renderer.render(&RenderOptions {
            technique: Some(technique.into()),
            size,
            spp,
            settings: settings.into(),
            ..RenderOptions::default()
        })?;
        pictures.push((name, rendered.picture.main_layer()?.values().to_vec()));
    }
    if let Some(((_, rays), others)) = pictures.split_last() {
        for (name, values) in others {
            println!(
                "{name}: differs from rays by {:.1} % of their mean",
                100.0 * difference(values, rays)
            );
        }
    }
    let [width, height] = size;
    let mut strip = Vec::new();
    let row = 3 * width as usize;
    for y in 0..height as usize {
        for (_, values) in &pictures {
            strip.extend_from_slice(&values[y * row..(y + 1) * row]);
        }
    }
    let strip = Picture::from_radiance(PICTURES * width, height, strip)?;
    let tone = ToneMap {
        exposure: EXPOSURE,
        curve: ToneCurve::PbrNeutral,
    };
    clerestory_samples::make_folder(path)?;
    png::write(path, &png::tone_mapped(strip.main_layer()?, strip.width(), &tone))?;
    clerestory_samples::check_messages(&gpu.validation_log())
}

/// Mean size of the differences over the mean of what is expected.
fn difference(found: &[f32], expected: &[f32]) -> f64 {
    let sizes = found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs()));
    sizes.sum::<f64>() / expected.iter().map(|value| f64::from(*value)).sum::<f64>()
}
