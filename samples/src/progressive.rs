//! What the viewer shows: a picture that grows better with every frame, by any technique that can render the scene.

use std::time::{Duration, Instant};

use clerestory::Result;
use clerestory::film::PixelFormat;
use clerestory::gpu::{Buffer, Gpu};
use clerestory::render::{RenderOptions, Renderer, Rendering};
use clerestory::settings::Settings;
use clerestory::techniques::{self, Card};

use crate::orbit::{Orbit, Pose};
use crate::window;

/// Time of work for one frame.
const FRAME: Duration = Duration::from_millis(50);
/// Samples per pixel after which a picture is left as it is.
const SAMPLES: u32 = 1 << 20;

/// A picture that follows a camera and a window's size.
pub struct Progressive {
    gpu: Gpu,
    renderer: Renderer,
    options: RenderOptions,
    exposure: f32,
    format: PixelFormat,
    state: Option<State>,
    /// Techniques that can render the scene on the device, and the number of the one at work.
    able: Vec<&'static Card>,
    at: usize,
}

struct State {
    rendering: Rendering,
    pixels: Buffer,
    size: [u32; 2],
    pose: Pose,
    samples: f64,
    rays: u64,
}

/// A picture as it is now.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Pixels of four bytes, rows from top to bottom; finished, and may be copied from.
    pub pixels: Buffer,
    /// Samples per pixel so far, on average.
    pub samples: f64,
    /// Rays traced for this frame.
    pub rays: u64,
    /// Seconds of rendering for this frame.
    pub seconds: f64,
}

impl Progressive {
    /// A picture of the renderer's scene, by the camera and with the settings of `options` (size and samples are the window's matter);
    /// with bytes in the order of `format`. `exposure` is in stops.
    pub fn new(gpu: &Gpu, renderer: Renderer, options: RenderOptions, exposure: f32, format: PixelFormat) -> Self {
        let offered = |card: &Card| {
            let mut needs = card.needs.iter();
            needs.all(|need| techniques::offers(gpu.caps(), need) == Some(true))
        };
        let able: Vec<_> = techniques::all()
            .iter()
            .filter(|card| offered(card) && (card.refusals)(renderer.gpu_scene().profile()).is_empty())
            .collect();
        let wanted = options.technique.as_deref();
        let at = able.iter().position(|card| Some(card.id) == wanted).unwrap_or(0);
        Self {
            able,
            at,
            gpu: gpu.clone(),
            renderer,
            options: RenderOptions {
                spp: SAMPLES,
                ..options
            },
            exposure,
            format,
            state: None,
        }
    }

    /// The technique's id.
    pub fn technique(&self) -> &str {
        self.options
            .technique
            .as_deref()
            .or(self.able.get(self.at).map(|card| card.id))
            .unwrap_or_default()
    }

    /// Goes on to the next technique that can render the scene, with its default settings.
    pub fn next_technique(&mut self) {
        self.at = (self.at + 1) % self.able.len().max(1);
        if let Some(card) = self.able.get(self.at) {
            self.options.technique = Some(card.id.into());
            self.options.settings = Settings::default();
            self.state = None;
        }
    }

    /// Renders for a twentieth of a second, and until every pixel has a sample; starts anew when camera or size changed.
    ///
    /// # Errors
    /// The engine's.
    pub fn frame(&mut self, orbit: &Orbit, size: [u32; 2]) -> Result<Frame> {
        let begin = Instant::now();
        // The old picture goes before a new one is made, so that they need no memory at once.
        let mut state = match self.state.take().filter(|state| state.size == size) {
            Some(state) => state,
            None => self.start(orbit, size)?,
        };
        if state.pose != orbit.pose() {
            state.rendering.set_camera(&orbit.camera())?;
            (state.pose, state.samples) = (orbit.pose(), 0.0);
        }
        let rays_before = state.rays;
        while state.samples < 1.0 || begin.elapsed() < FRAME {
            let Some(progress) = state.rendering.step()? else { break };
            state.samples = progress.fraction * f64::from(SAMPLES);
            state.rays = progress.rays;
        }
        let frame = Frame {
            pixels: state.pixels.clone(),
            samples: state.samples,
            rays: state.rays - rays_before,
            seconds: begin.elapsed().as_secs_f64(),
        };
        state.rendering.display(&state.pixels, self.exposure, self.format)?;
        self.state = Some(state);
        Ok(frame)
    }

    fn start(&self, orbit: &Orbit, size: [u32; 2]) -> Result<State> {
        let mut rendering = self.renderer.start(&RenderOptions {
            size,
            ..self.options.clone()
        })?;
        rendering.set_camera(&orbit.camera())?;
        Ok(State {
            rendering,
            pixels: window::pixels(&self.gpu, size)?,
            size,
            pose: orbit.pose(),
            samples: 0.0,
            rays: 0,
        })
    }
}
