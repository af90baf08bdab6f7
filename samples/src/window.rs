//! A window on a scene with a camera that the hand leads around it: what programs that show pictures share.
//!
//! Drag to turn, drag with the right button or with shift to move, scroll to come nearer, R to go back to the scene's camera, Esc to
//! leave.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use clerestory::film::PixelFormat;
use clerestory::gpu::{Buffer, BufferDesc, Category, Gpu, GpuOptions, Presented, Surface};
use clerestory::scene::{self, Scene, SceneProfile};
use clerestory::{Error, Result};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

use crate::arguments::Arguments;
use crate::orbit::Orbit;

/// Height of the window at first; the scene's aspect gives the width.
const HEIGHT: u32 = 480;
/// Radians a pixel of dragging.
const TURN: f64 = 0.01;
/// Factor of distance a line of scrolling.
const ZOOM: f64 = 0.9;
/// Pixels that count as a line of scrolling.
const LINE: f64 = 40.0;
/// Seconds of rendering between two titles.
const TITLE: f64 = 0.5;
/// How long a window without area waits for the next look at it.
const HIDDEN: std::time::Duration = std::time::Duration::from_millis(50);

/// What a window shows.
pub trait Show {
    /// The next frame of a window of `size` pixels, seen from an orbit that it may move on.
    ///
    /// # Errors
    /// The engine's.
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown>;

    /// What the title says of the frames since it was last asked.
    fn title(&mut self) -> String;

    /// A key that the window has no use for.
    fn key(&mut self, key: &Key) {
        let _ = key;
    }

    /// After the last frame.
    fn end(&mut self) {}
}

/// A frame.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Pixels of four bytes, rows from top to bottom; finished, and may be copied from.
    pub pixels: Buffer,
    /// Seconds of rendering.
    pub seconds: f64,
}

impl Shown {
    /// Pixels whose rendering began then.
    pub fn since(begin: Instant, pixels: &Buffer) -> Self {
        Self {
            pixels: pixels.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        }
    }
}

/// Memory for a frame of so many pixels, four bytes each.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn pixels(gpu: &Gpu, size: [u32; 2]) -> Result<Buffer> {
    let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
    gpu.buffer(&BufferDesc::storage("shown pixels", bytes, Category::Film))
}

/// What a frame is made for.
#[derive(Debug)]
pub struct Canvas<'a> {
    /// The device that can show it.
    pub gpu: &'a Gpu,
    /// The scene.
    pub scene: &'a Scene,
    /// Name of its camera; `None` for the first.
    pub camera: Option<&'a str>,
    /// Exposure in stops.
    pub exposure: f32,
    /// Order of a shown pixel's bytes.
    pub format: PixelFormat,
}

/// The part of a command line that is about the window.
#[derive(Debug)]
pub struct Options {
    /// Path or address of the scene.
    scene: String,
    camera: Option<String>,
    exposure: Option<f32>,
    size: Option<[u32; 2]>,
    frames: Option<u32>,
    resize: Option<[u32; 2]>,
    /// Typed half-way.
    keys: String,
    screenshot: Option<PathBuf>,
}

impl Options {
    /// The options there are.
    pub const NAMES: [&str; 7] = [
        "--camera",
        "--exposure",
        "--size",
        "--frames",
        "--resize",
        "--keys",
        "--screenshot",
    ];

    /// Reads them; without a scene it is `scene`.
    ///
    /// # Errors
    /// [`Error::Setting`] for what does not parse.
    pub fn of(given: &Arguments, scene: &str) -> Result<Self> {
        Ok(Self {
            scene: given.alone(0).unwrap_or(scene).into(),
            camera: given.text("--camera").map(Into::into),
            exposure: given.value("--exposure")?,
            size: given.size("--size")?,
            frames: given.value("--frames")?,
            resize: given.size("--resize")?,
            keys: given.text("--keys").unwrap_or_default().into(),
            screenshot: given.text("--screenshot").map(Into::into),
        })
    }
}

/// Loads the scene and shows it until the window is closed or the wanted frames are over; then writes the last one, if that is wanted.
///
/// # Errors
/// [`Error::MissingFeature`] without a window system, what `make` and frames return, and what the validation layers said.
pub fn show<S: Show>(options: Options, make: impl FnOnce(&Canvas<'_>) -> Result<S>) -> Result<()> {
    let scene = scene::load(&options.scene)?;
    show_scene(options, scene, make)
}

/// As [`show`], of a scene that is there already.
///
/// # Errors
/// As [`show`].
pub fn show_scene<S: Show>(options: Options, scene: Scene, make: impl FnOnce(&Canvas<'_>) -> Result<S>) -> Result<()> {
    for note in &scene.notes {
        println!("note: {} at {}: {}", note.feature, note.at, note.instead);
    }
    let events = EventLoop::new().map_err(no_window)?;
    events.set_control_flow(ControlFlow::Poll);
    let mut program = Program {
        options,
        scene,
        make: Some(make),
        drag: None,
        shift: false,
        cursor: [0.0; 2],
        shown: 0,
        open: None,
        result: Ok(()),
    };
    events.run_app(&mut program).map_err(no_window)?;
    program.result?;
    program
        .open
        .map_or(Ok(()), |open| open.finish(program.options.screenshot))
}

fn no_window(error: impl std::fmt::Display) -> Error {
    Error::MissingFeature {
        feature: "a window".into(),
        needed_by: "the viewer".into(),
        device: "this machine's window system".into(),
        instead: format!("run embed_headless, or the viewer under xvfb-run ({error})"),
    }
}

/// What the hand does while a button is down.
#[derive(Debug, Clone, Copy)]
enum Drag {
    Turn,
    Pan,
}

struct Program<S, M> {
    options: Options,
    scene: Scene,
    /// Until there is a window.
    make: Option<M>,
    drag: Option<Drag>,
    shift: bool,
    cursor: [f64; 2],
    shown: u32,
    open: Option<Open<S>>,
    result: Result<()>,
}

/// What exists once there is a window.
struct Open<S> {
    show: S,
    orbit: Orbit,
    last: Option<(Buffer, [u32; 2])>,
    /// Seconds of rendering since the last title.
    untitled: f64,
    surface: Surface,
    window: Arc<Window>,
    gpu: Gpu,
}

impl<S: Show> Open<S> {
    fn new(
        events: &ActiveEventLoop,
        scene: &Scene,
        options: &Options,
        make: impl FnOnce(&Canvas<'_>) -> Result<S>,
    ) -> Result<Self> {
        let aspect = scene.defaults.aspect.unwrap_or(4.0 / 3.0).clamp(0.25, 4.0);
        let [width, height] = options.size.unwrap_or([(HEIGHT as f32 * aspect) as u32, HEIGHT]);
        let attributes = Window::default_attributes()
            .with_title(format!("Clerestory: {}", scene.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).map_err(no_window)?);
        let gpu = Gpu::for_window(&GpuOptions::default(), &window)?;
        let surface = gpu.surface(Arc::clone(&window))?;
        let camera = scene.require_camera(options.camera.as_deref())?;
        let show = make(&Canvas {
            gpu: &gpu,
            scene,
            camera: options.camera.as_deref(),
            exposure: options.exposure.unwrap_or(scene.defaults.exposure),
            format: PixelFormat::of(surface.format()).unwrap_or_default(),
        })?;
        Ok(Self {
            show,
            orbit: Orbit::new(camera, SceneProfile::of(scene).bounds),
            last: None,
            untitled: 0.0,
            surface,
            window,
            gpu,
        })
    }

    /// Renders and shows one frame; false when the window could not take it.
    fn frame(&mut self, name: &str) -> Result<bool> {
        let size = self.window.inner_size();
        let (show, orbit, last) = (&mut self.show, &mut self.orbit, std::cell::RefCell::new(None));
        let shown = self.surface.present(
            [size.width, size.height],
            |_, size| {
                *last.borrow_mut() = Some((show.frame(orbit, size)?, size));
                Ok(())
            },
            |pass, image| match &*last.borrow() {
                Some((frame, _)) => pass.copy_buffer_to_image(frame.pixels.view(), image),
                None => Ok(()),
            },
        )?;
        if let Some((frame, size)) = last.into_inner() {
            self.untitled += frame.seconds;
            if self.untitled >= TITLE {
                self.window
                    .set_title(&format!("Clerestory: {name}, {}", self.show.title()));
                self.untitled = 0.0;
            }
            self.last = Some((frame.pixels, size));
        }
        Ok(shown != Presented::Skipped)
    }

    /// Writes the screenshot and says what the validation layers said.
    fn finish(mut self, screenshot: Option<PathBuf>) -> Result<()> {
        self.show.end();
        if let (Some(path), Some((pixels, size))) = (screenshot, &self.last) {
            let mut bytes: Vec<u8> = self.gpu.read(pixels.view(), 4 * (size[0] * size[1]) as usize)?;
            if PixelFormat::of(self.surface.format()) == Some(PixelFormat::Bgra8) {
                bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
            }
            crate::save_png(&path, *size, &bytes)?;
            println!("wrote {}", path.display());
        }
        let log = self.gpu.validation_log();
        drop(self);
        crate::check_messages(&log)
    }
}

impl<S: Show, M> Program<S, M> {
    fn leave(&mut self, events: &ActiveEventLoop, result: Result<()>) {
        if self.result.is_ok() {
            self.result = result;
        }
        events.exit();
    }

    fn redraw(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        match open.frame(&self.scene.name) {
            Ok(true) => self.shown += 1,
            Ok(false) => std::thread::sleep(HIDDEN),
            Err(error) => return self.leave(events, Err(error)),
        }
        if let Some(frames) = self.options.frames {
            if self.shown >= frames {
                return self.leave(events, Ok(()));
            }
            if self.shown >= frames / 2
                && let Some([width, height]) = self.options.resize.take()
            {
                // A new size comes as an event, or at once where the window system needs no asking.
                let _ = open.window.request_inner_size(PhysicalSize::new(width, height));
            }
        }
        open.window.request_redraw();
        if self.options.frames.is_some_and(|frames| self.shown >= frames / 2) {
            for key in std::mem::take(&mut self.options.keys).chars() {
                self.key(events, &Key::Character(key.to_string().into()));
            }
        }
    }

    fn key(&mut self, events: &ActiveEventLoop, key: &Key) {
        let Some(open) = &mut self.open else { return };
        match key {
            Key::Named(NamedKey::Escape) => self.leave(events, Ok(())),
            Key::Character(text) if text.eq_ignore_ascii_case("r") => open.orbit.reset(),
            other => open.show.key(other),
        }
    }

    fn cursor_moved(&mut self, to: [f64; 2]) {
        let [right, down] = [to[0] - self.cursor[0], to[1] - self.cursor[1]];
        self.cursor = to;
        let Some(open) = &mut self.open else { return };
        match self.drag {
            Some(Drag::Turn) => open.orbit.turn(-TURN * right, TURN * down),
            Some(Drag::Pan) => {
                // The scene follows the hand, so the camera goes the other way.
                let height = f64::from(open.window.inner_size().height.max(1));
                open.orbit.pan(-right / height, down / height);
            }
            None => {}
        }
    }
}

impl<S: Show, M: FnOnce(&Canvas<'_>) -> Result<S>> ApplicationHandler for Program<S, M> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(make) = self.make.take() else { return };
        match Open::new(events, &self.scene, &self.options, make) {
            Ok(open) => {
                open.window.request_redraw();
                self.open = Some(open);
            }
            Err(error) => self.leave(events, Err(error)),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => self.leave(events, Ok(())),
            WindowEvent::KeyboardInput {
                event:
                    KeyEvent {
                        logical_key,
                        state: ElementState::Pressed,
                        ..
                    },
                ..
            } => self.key(events, &logical_key),
            WindowEvent::ModifiersChanged(modifiers) => self.shift = modifiers.state().shift_key(),
            WindowEvent::RedrawRequested => self.redraw(events),
            WindowEvent::MouseInput { state, button, .. } => {
                self.drag = match (state, button) {
                    (ElementState::Pressed, MouseButton::Left) if !self.shift => Some(Drag::Turn),
                    (ElementState::Pressed, MouseButton::Left | MouseButton::Right) => Some(Drag::Pan),
                    _ => None,
                };
            }
            WindowEvent::CursorMoved { position, .. } => self.cursor_moved([position.x, position.y]),
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / LINE,
                };
                if let Some(open) = &mut self.open {
                    open.orbit.zoom(ZOOM.powf(lines));
                }
            }
            _ => {}
        }
    }
}
