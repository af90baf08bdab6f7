//! A window on a picture that grows better while one looks: drag to turn, scroll to come nearer, Esc to leave.
//!
//! `--frames N` leaves after N frames, `--resize WxH` resizes the window half-way, `--screenshot FILE` writes the last frame as PNG.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clerestory::gpu::ash::vk;
use clerestory::gpu::{Buffer, Gpu, GpuOptions, Presented, Surface};
use clerestory::{Error, Result};
use clerestory_samples::picture::{Gradient, Orbit, Picture};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

const SIZE: [u32; 2] = [640, 480];
/// Radians a pixel of dragging.
const TURN: f32 = 0.01;
/// Factor of distance a line of scrolling.
const ZOOM: f32 = 0.9;
/// Pixels that count as a line of scrolling.
const LINE: f64 = 40.0;

fn main() -> ExitCode {
    clerestory_samples::report(Options::parse(std::env::args().skip(1)).and_then(run))
}

#[derive(Debug, Default)]
struct Options {
    frames: Option<u32>,
    resize: Option<[u32; 2]>,
    screenshot: Option<PathBuf>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut options = Self::default();
        while let Some(name) = arguments.next() {
            let value = arguments.next().unwrap_or_default();
            let wrong = |cause: &str| Error::Setting {
                name: name.clone(),
                value: value.clone(),
                cause: cause.into(),
            };
            match name.as_str() {
                "--frames" => options.frames = Some(value.parse().map_err(|_| wrong("is not a number of frames"))?),
                "--resize" => {
                    let size = value
                        .split_once('x')
                        .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
                    options.resize = Some(size.ok_or_else(|| wrong("is not a size such as 800x600"))?);
                }
                "--screenshot" => options.screenshot = Some(value.into()),
                _ => return Err(wrong("is unknown; there are --frames, --resize and --screenshot")),
            }
        }
        Ok(options)
    }
}

fn run(options: Options) -> Result<()> {
    let events = EventLoop::new().map_err(no_window)?;
    events.set_control_flow(ControlFlow::Poll);
    let mut viewer = Viewer {
        options,
        camera: Orbit::default(),
        dragging: false,
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

struct Viewer {
    options: Options,
    camera: Orbit,
    dragging: bool,
    cursor: [f64; 2],
    shown: u32,
    open: Option<Open>,
    result: Result<()>,
}

/// What exists once there is a window.
struct Open {
    picture: Box<dyn Picture>,
    last: Option<(Buffer, [u32; 2])>,
    surface: Surface,
    window: Arc<Window>,
    gpu: Gpu,
}

impl Open {
    fn new(events: &ActiveEventLoop) -> Result<Self> {
        let attributes = Window::default_attributes()
            .with_title("Clerestory")
            .with_inner_size(PhysicalSize::new(SIZE[0], SIZE[1]));
        let window = Arc::new(events.create_window(attributes).map_err(no_window)?);
        let gpu = Gpu::for_window(&GpuOptions::default(), &window)?;
        let surface = gpu.surface(Arc::clone(&window))?;
        let bgra = surface.format() == vk::Format::B8G8R8A8_UNORM;
        Ok(Self {
            picture: Box::new(Gradient::new(&gpu, bgra)?),
            last: None,
            surface,
            window,
            gpu,
        })
    }

    /// Renders and shows one frame; false when the window could not take it.
    fn frame(&mut self, camera: &Orbit) -> Result<bool> {
        let size = self.window.inner_size();
        let (picture, last) = (&mut self.picture, std::cell::RefCell::new(None));
        let shown = self.surface.present(
            [size.width, size.height],
            |_, size| {
                *last.borrow_mut() = Some((picture.render(camera, size)?, size));
                Ok(())
            },
            |pass, image| match &*last.borrow() {
                Some((pixels, _)) => pass.copy_buffer_to_image(pixels.view(), image),
                None => Ok(()),
            },
        )?;
        self.last = last.into_inner();
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
        match open.frame(&self.camera) {
            Ok(shown) => self.shown += u32::from(shown),
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
}

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match Open::new(events) {
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
            WindowEvent::KeyboardInput { event, .. } if event.logical_key == Key::Named(NamedKey::Escape) => {
                self.leave(events, Ok(()));
            }
            WindowEvent::RedrawRequested => self.redraw(events),
            WindowEvent::MouseInput {
                state,
                button: MouseButton::Left,
                ..
            } => {
                self.dragging = state == ElementState::Pressed;
            }
            WindowEvent::CursorMoved { position, .. } => {
                let moved = [position.x - self.cursor[0], position.y - self.cursor[1]];
                self.cursor = [position.x, position.y];
                if self.dragging {
                    self.camera.turn(-TURN * moved[0] as f32, TURN * moved[1] as f32);
                }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, lines) => lines,
                    MouseScrollDelta::PixelDelta(pixels) => (pixels.y / LINE) as f32,
                };
                self.camera.zoom(ZOOM.powf(lines));
            }
            _ => {}
        }
    }
}
