//! A window on a scene, path-traced better and better while one looks.
//!
//! `viewer [SCENE] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--screenshot FILE]`
//!
//! Drag to turn, drag with the right button or with shift to move, scroll to come nearer, R to go back to the scene's camera, Esc to
//! leave. `--size` is the window's first size, `--frames N` leaves after N frames, `--resize WxH` resizes the window half-way,
//! `--screenshot FILE` writes the last frame as PNG.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clerestory::gpu::ash::vk;
use clerestory::gpu::{Buffer, Gpu, GpuOptions, Presented, Surface};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{self, Scene};
use clerestory::{Error, Result};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::orbit::Orbit;
use clerestory_samples::progressive::Progressive;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

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

fn main() -> ExitCode {
    clerestory_samples::report(Options::parse().and_then(run))
}

#[derive(Debug)]
struct Options {
    scene: String,
    camera: Option<String>,
    exposure: Option<f32>,
    size: Option<[u32; 2]>,
    frames: Option<u32>,
    resize: Option<[u32; 2]>,
    screenshot: Option<PathBuf>,
}

impl Options {
    fn parse() -> Result<Self> {
        let names = [
            "--camera",
            "--exposure",
            "--size",
            "--frames",
            "--resize",
            "--screenshot",
        ];
        let given = Arguments::of_process(&names, 1)?;
        Ok(Self {
            scene: given.alone(0).unwrap_or("builtin:cornell-box").into(),
            camera: given.text("--camera").map(Into::into),
            exposure: given.value("--exposure")?,
            size: given.size("--size")?,
            frames: given.value("--frames")?,
            resize: given.size("--resize")?,
            screenshot: given.text("--screenshot").map(Into::into),
        })
    }
}

fn run(options: Options) -> Result<()> {
    let scene = scene::load(&options.scene)?;
    for note in &scene.notes {
        println!("note: {} at {}: {}", note.feature, note.at, note.instead);
    }
    let events = EventLoop::new().map_err(no_window)?;
    events.set_control_flow(ControlFlow::Poll);
    let mut viewer = Viewer {
        options,
        scene,
        drag: None,
        shift: false,
        cursor: [0.0; 2],
        shown: 0,
        open: None,
        result: Ok(()),
    };
    events.run_app(&mut viewer).map_err(no_window)?;
    viewer.result?;
    viewer
        .open
        .map_or(Ok(()), |open| open.finish(viewer.options.screenshot))
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

struct Viewer {
    options: Options,
    scene: Scene,
    drag: Option<Drag>,
    shift: bool,
    cursor: [f64; 2],
    shown: u32,
    open: Option<Open>,
    result: Result<()>,
}

/// What exists once there is a window.
struct Open {
    picture: Progressive,
    orbit: Orbit,
    last: Option<(Buffer, [u32; 2])>,
    /// Rays and seconds since the last title.
    work: (u64, f64),
    surface: Surface,
    window: Arc<Window>,
    gpu: Gpu,
}

impl Open {
    fn new(events: &ActiveEventLoop, scene: &Scene, options: &Options) -> Result<Self> {
        let aspect = scene.defaults.aspect.unwrap_or(4.0 / 3.0).clamp(0.25, 4.0);
        let [width, height] = options.size.unwrap_or([(HEIGHT as f32 * aspect) as u32, HEIGHT]);
        let attributes = Window::default_attributes()
            .with_title(format!("Clerestory: {}", scene.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).map_err(no_window)?);
        let gpu = Gpu::for_window(&GpuOptions::default(), &window)?;
        let surface = gpu.surface(Arc::clone(&window))?;
        let renderer = Renderer::new(&gpu, scene)?;
        let render_options = RenderOptions {
            camera: options.camera.clone(),
            ..RenderOptions::default()
        };
        let camera = scene.require_camera(options.camera.as_deref())?;
        let orbit = Orbit::new(camera, renderer.gpu_scene().profile().bounds);
        let exposure = options.exposure.unwrap_or(scene.defaults.exposure);
        let bgra = surface.format() == vk::Format::B8G8R8A8_UNORM;
        Ok(Self {
            picture: Progressive::new(&gpu, renderer, render_options, exposure, bgra),
            orbit,
            last: None,
            work: (0, 0.0),
            surface,
            window,
            gpu,
        })
    }

    /// Renders and shows one frame; false when the window could not take it.
    fn frame(&mut self, name: &str) -> Result<bool> {
        let size = self.window.inner_size();
        let (picture, orbit, last) = (&mut self.picture, &self.orbit, std::cell::RefCell::new(None));
        let shown = self.surface.present(
            [size.width, size.height],
            |_, size| {
                *last.borrow_mut() = Some((picture.frame(orbit, size)?, size));
                Ok(())
            },
            |pass, image| match &*last.borrow() {
                Some((frame, _)) => pass.copy_buffer_to_image(frame.pixels.view(), image),
                None => Ok(()),
            },
        )?;
        if let Some((frame, size)) = last.into_inner() {
            self.work.0 += frame.rays;
            self.work.1 += frame.seconds;
            if self.work.1 >= TITLE {
                let speed = self.work.0 as f64 / self.work.1 * 1e-6;
                self.window.set_title(&format!(
                    "Clerestory: {name}, {:.0} samples per pixel, {speed:.2} M rays/s",
                    frame.samples
                ));
                self.work = (0, 0.0);
            }
            self.last = Some((frame.pixels, size));
        }
        Ok(shown != Presented::Skipped)
    }

    /// Writes the screenshot and says what the validation layers said.
    fn finish(self, screenshot: Option<PathBuf>) -> Result<()> {
        if let (Some(path), Some((pixels, size))) = (screenshot, &self.last) {
            let mut bytes: Vec<u8> = self.gpu.read(pixels.view(), 4 * (size[0] * size[1]) as usize)?;
            if self.surface.format() == vk::Format::B8G8R8A8_UNORM {
                bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
            }
            clerestory_samples::save_png(&path, *size, &bytes)?;
            println!("wrote {}", path.display());
        }
        let log = self.gpu.validation_log();
        drop(self);
        clerestory_samples::check_messages(&log)
    }
}

impl Viewer {
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
    }

    fn key(&mut self, events: &ActiveEventLoop, event: &KeyEvent) {
        match &event.logical_key {
            Key::Named(NamedKey::Escape) => self.leave(events, Ok(())),
            Key::Character(text) if text.eq_ignore_ascii_case("r") => {
                if let Some(open) = &mut self.open {
                    open.orbit.reset();
                }
            }
            _ => {}
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

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match Open::new(events, &self.scene, &self.options) {
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
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                self.key(events, &event);
            }
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
