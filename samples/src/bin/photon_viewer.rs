//! A window on a scene whose light moves, photon-mapped anew for every frame.
//!
//! `photon_viewer [SCENE] [--photons N] [--shape fixed|isotropic|principal|skewed] [--spread FOOTPRINTS] [--radius METRES] [--turn DEGREES]
//! [--flight METRES] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--screenshot FILE]`
//!
//! Each frame the light goes around the middle of the scene by `--turn`, its photons are traced and their map is built, and rays from the eye
//! find direct light, specular chains and, in the map, everything else. Space holds the light, and the picture converges. `--flight` moves
//! the camera to its right each frame as far as that, and turns it by 2.5 degrees per metre. Photons, shape, spread and radius are the settings
//! of these names of the technique `photon`. Otherwise as the viewer.
//!
//! Source of the program's form: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.3, with flights of 10 cm
//! and 0.25 degrees per frame (appendix A).

use std::collections::VecDeque;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clerestory::Result;
use clerestory::film::PixelFormat;
use clerestory::gpu::{Buffer, Gpu};
use clerestory::settings::TypedSettings;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::transport::GpuScene;
use clerestory_samples::arguments::Arguments;
use clerestory_samples::carousel::Carousel;
use clerestory_samples::orbit::{Orbit, Pose};
use clerestory_samples::window::{self, Canvas, Show, Shown};
use winit::keyboard::{Key, NamedKey};

/// Photons per frame, unless told otherwise.
const PHOTONS: u32 = 1 << 15;
/// Size of kernels in footprints, unless told otherwise: less than finished pictures want, for the sake of speed.
const SPREAD: f32 = 8.0;
/// Degrees that the light goes around each frame, unless told otherwise.
const TURN: f64 = 3.0;
/// Degrees that the camera turns for each metre of its flight.
const FLIGHT_TURN: f64 = 2.5;
/// Frames that medians are taken of, at most.
const FRAMES: usize = 1000;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = ["--photons", "--shape", "--spread", "--radius", "--turn", "--flight"];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let settings = PhotonSettings::from_json(&serde_json::json!({
        "photons": given.value("--photons")?.unwrap_or(PHOTONS),
        "shape": given.text("--shape").unwrap_or("skewed"),
        "spread": given.value("--spread")?.unwrap_or(SPREAD),
        "radius": given.value("--radius")?.unwrap_or(0.0f32),
    }))?;
    let turn = given.value("--turn")?.unwrap_or(TURN);
    let flight = given.value("--flight")?.unwrap_or(0.0);
    window::show(window::Options::of(&given, "builtin:ring")?, |canvas| {
        PhotonViewer::new(canvas, settings, turn.to_radians(), flight)
    })
}

struct PhotonViewer {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PhotonSettings,
    exposure: f32,
    format: PixelFormat,
    light: Carousel,
    /// Where the light is, and by how much it goes on; radians.
    angle: f64,
    turn: f64,
    /// Metres a frame.
    flight: f64,
    held: bool,
    view: Option<View>,
    /// Of the last frames, but those that began with a new view.
    times: VecDeque<Times>,
    /// How many of them the title has not told of.
    untold: usize,
}

/// A picture of the window's size.
struct View {
    mapper: PhotonMapper,
    pixels: Buffer,
    size: [u32; 2],
    pose: Pose,
    /// Samples per pixel.
    samples: u32,
    /// When its last frame was done.
    done: Instant,
}

/// What a frame took, seconds.
#[derive(Debug, Clone, Copy)]
struct Times {
    /// Since the frame before was done.
    frame: f64,
    trace: f64,
    map: f64,
    render: f64,
}

impl PhotonViewer {
    fn new(canvas: &Canvas<'_>, settings: PhotonSettings, turn: f64, flight: f64) -> Result<Self> {
        let light = Carousel::new(canvas.scene)?;
        let scene = GpuScene::new(canvas.gpu, canvas.scene)?;
        scene.move_light(canvas.gpu, light.light(), &light.at(0.0))?;
        Ok(Self {
            gpu: canvas.gpu.clone(),
            scene: Arc::new(scene),
            settings,
            exposure: canvas.exposure,
            format: canvas.format,
            light,
            angle: 0.0,
            turn,
            flight,
            held: false,
            view: None,
            times: VecDeque::new(),
            untold: 0,
        })
    }

    /// A picture of another size.
    fn open(&self, orbit: &Orbit, size: [u32; 2]) -> Result<View> {
        Ok(View {
            mapper: PhotonMapper::new(
                &self.gpu,
                Arc::clone(&self.scene),
                &orbit.camera(),
                size,
                self.settings.clone(),
            )?,
            pixels: window::pixels(&self.gpu, size)?,
            size,
            pose: orbit.pose(),
            samples: 0,
            done: Instant::now(),
        })
    }

    /// Moves the light and, in flight, the camera, and lets the picture begin anew for what has moved.
    fn go_on(&mut self, view: &mut View, orbit: &mut Orbit) -> Result<()> {
        if !self.held && self.flight != 0.0 {
            orbit.fly(self.flight, (FLIGHT_TURN * self.flight).to_radians());
        }
        let light_moves = !self.held && self.turn != 0.0;
        if light_moves {
            self.angle = (self.angle + self.turn) % std::f64::consts::TAU;
            self.scene
                .move_light(&self.gpu, self.light.light(), &self.light.at(self.angle))?;
        }
        if view.pose != orbit.pose() {
            view.mapper.set_camera(&orbit.camera())?;
            view.pose = orbit.pose();
            view.samples = 0;
        } else if light_moves {
            // The same photons leave the light wherever it is, so that noise moves with it instead of flickering.
            view.mapper.restart(self.settings.seed)?;
            view.samples = 0;
        }
        Ok(())
    }

    /// Medians of the last so many frames.
    fn medians(&self, frames: usize) -> String {
        let of = |part: fn(&Times) -> f64| {
            let last = self.times.iter().rev().take(frames.max(1));
            let mut values: Vec<f64> = last.map(part).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let trace = of(|times| times.trace);
        format!(
            "{:.1} frames/s, {:.2} M photons/s, trace {:.1} ms, map {:.1} ms, render {:.1} ms",
            1.0 / of(|times| times.frame),
            f64::from(self.settings.photons) / trace * 1e-6,
            1e3 * trace,
            1e3 * of(|times| times.map),
            1e3 * of(|times| times.render),
        )
    }
}

impl Show for PhotonViewer {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let begin = Instant::now();
        // The old picture goes before a new one is made, so that they need no memory at once.
        let (mut view, is_new) = match self.view.take().filter(|view| view.size == size) {
            Some(view) => (view, false),
            None => (self.open(orbit, size)?, true),
        };
        if !is_new {
            self.go_on(&mut view, orbit)?;
        }
        let before = view.mapper.counts();
        view.samples += self.settings.samples_per_pass;
        while view.mapper.step(view.samples)?.is_some() {}
        view.mapper.display(&view.pixels, self.exposure, self.format)?;
        let (done, counts) = (Instant::now(), view.mapper.counts());
        let seconds = (done - begin).as_secs_f64();
        let [trace, map] = [
            counts.trace_seconds - before.trace_seconds,
            counts.map_seconds - before.map_seconds,
        ];
        if !is_new {
            if self.times.len() == FRAMES {
                self.times.pop_front();
            }
            self.times.push_back(Times {
                frame: (done - view.done).as_secs_f64(),
                trace,
                map,
                render: seconds - trace - map,
            });
            self.untold += 1;
        }
        view.done = done;
        let pixels = view.pixels.clone();
        self.view = Some(view);
        Ok(Shown { pixels, seconds })
    }

    fn title(&mut self) -> String {
        let untold = std::mem::take(&mut self.untold);
        self.medians(untold)
    }

    fn key(&mut self, key: &Key) {
        if *key == Key::Named(NamedKey::Space) {
            self.held = !self.held;
        }
    }

    fn end(&mut self) {
        if !self.times.is_empty() {
            println!("medians of {} frames: {}", self.times.len(), self.medians(FRAMES));
        }
    }
}
