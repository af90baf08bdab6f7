//! A scene whose light moves, photon-mapped anew for every frame: what programs that show photons share.
//!
//! Each frame the light goes on around the middle of the scene and the camera flies on, photons are traced and their maps are built, and rays from the eye find
//! the rest. While nothing moves the picture converges.
//!
//! Source of the form: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.3, with flights of 10 cm
//! and 0.25 degrees per frame (appendix A).

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use clerestory::Result;
use clerestory::film::PixelFormat;
use clerestory::gpu::{Buffer, Gpu};
use clerestory::techniques::photon_mapping::{MapperCounts, PhotonMapper, PhotonSettings};
use clerestory::transport::GpuScene;
use winit::keyboard::{Key, NamedKey};

use crate::carousel::Carousel;
use crate::orbit::{Orbit, Pose};
use crate::window::{self, Canvas, Show, Shown};

/// Degrees that the camera turns for each metre of its flight.
const FLIGHT_TURN: f64 = 2.5;
/// Frames that medians are taken of, at most.
const FRAMES: usize = 1000;

/// How far things go in a frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    /// Radians that the light goes around; without any it need not be one that can.
    pub turn: f64,
    /// Metres that the camera flies.
    pub flight: f64,
}

/// The scene and its picture. Space holds what moves.
pub struct LivePhotons {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PhotonSettings,
    exposure: f32,
    format: PixelFormat,
    /// None where it stands still.
    light: Option<Carousel>,
    /// Where the light is, radians.
    angle: f64,
    motion: Motion,
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

impl LivePhotons {
    /// # Errors
    /// The engine's, and [`Error::Scene`](clerestory::Error::Scene) for a scene without a light that can go around, where it is to.
    pub fn new(canvas: &Canvas<'_>, settings: PhotonSettings, motion: Motion) -> Result<Self> {
        let light = (motion.turn != 0.0).then(|| Carousel::new(canvas.scene)).transpose()?;
        let scene = GpuScene::new(canvas.gpu, canvas.scene)?;
        if let Some(light) = &light {
            scene.move_light(canvas.gpu, light.light(), &light.at(0.0))?;
        }
        Ok(Self {
            gpu: canvas.gpu.clone(),
            scene: Arc::new(scene),
            settings,
            exposure: canvas.exposure,
            format: canvas.format,
            light,
            angle: 0.0,
            motion,
            held: false,
            view: None,
            times: VecDeque::new(),
            untold: 0,
        })
    }

    /// The scene.
    pub fn scene(&self) -> &GpuScene {
        &self.scene
    }

    /// The settings.
    pub fn settings(&self) -> &PhotonSettings {
        &self.settings
    }

    /// Begins anew with other settings.
    pub fn set_settings(&mut self, settings: PhotonSettings) {
        self.settings = settings;
        self.view = None;
        self.times.clear();
        self.untold = 0;
    }

    /// Exact counts since the picture was begun, and the radius of kernels in media in its next pass, m.
    pub fn counts(&self) -> Option<(MapperCounts, f64)> {
        let view = self.view.as_ref()?;
        Some((view.mapper.counts(), view.mapper.event_radius(view.samples)))
    }

    /// A picture of another size. Where things move, kernels in media keep the radius that the first view has chosen, lest each frame choose its own.
    fn open(&self, orbit: &Orbit, size: [u32; 2]) -> Result<View> {
        let camera = orbit.camera();
        let of = |settings: &PhotonSettings| {
            PhotonMapper::new(&self.gpu, Arc::clone(&self.scene), &camera, size, settings.clone())
        };
        let mut mapper = of(&self.settings)?;
        let moves = self.motion.turn != 0.0 || self.motion.flight != 0.0;
        if moves && self.settings.volume_radius == 0.0 && self.scene.profile().media.any() {
            let volume_radius = mapper.event_radius(0) as f32;
            drop(mapper);
            mapper = of(&PhotonSettings {
                volume_radius,
                ..self.settings.clone()
            })?;
        }
        Ok(View {
            mapper,
            pixels: window::pixels(&self.gpu, size)?,
            size,
            pose: orbit.pose(),
            samples: 0,
            done: Instant::now(),
        })
    }

    /// Moves the light and, in flight, the camera, and lets the picture begin anew for what has moved.
    fn go_on(&mut self, view: &mut View, orbit: &mut Orbit) -> Result<()> {
        let Motion { turn, flight } = if self.held { Motion::default() } else { self.motion };
        if flight != 0.0 {
            orbit.fly(flight, (FLIGHT_TURN * flight).to_radians());
        }
        let light = self.light.as_ref().filter(|_| turn != 0.0);
        if let Some(light) = light {
            self.angle = (self.angle + turn) % std::f64::consts::TAU;
            self.scene.move_light(&self.gpu, light.light(), &light.at(self.angle))?;
        }
        if view.pose != orbit.pose() {
            view.mapper.set_camera(&orbit.camera())?;
            view.pose = orbit.pose();
            view.samples = 0;
        } else if light.is_some() {
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

impl Show for LivePhotons {
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
