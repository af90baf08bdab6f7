//! A window on a scene, rendered better and better while one looks.
//!
//! `viewer [SCENE] [--technique ID] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--keys KEYS] [--screenshot FILE]`
//!
//! Drag to turn, drag with the right button or with shift to move, scroll to come nearer, R to go back to the scene's camera, T to go on to the next
//! technique that can render the scene, Esc to leave. `--size` is the window's first size, `--frames N` leaves after N frames, `--resize WxH` resizes
//! the window half-way, `--keys KEYS` types these letters then, `--screenshot FILE` writes the last frame as PNG.

use std::process::ExitCode;

use clerestory::Result;
use clerestory::render::{RenderOptions, Renderer};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::orbit::Orbit;
use clerestory_samples::progressive::Progressive;
use clerestory_samples::window::{self, Canvas, Show, Shown};
use winit::keyboard::Key;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let names = [&window::Options::NAMES[..], &["--technique"]].concat();
    let given = Arguments::of_process(&names, 1)?;
    let technique = given.text("--technique").map(str::to_owned);
    window::show(window::Options::of(&given, "builtin:cornell-box")?, |canvas| {
        Viewer::new(canvas, technique)
    })
}

struct Viewer {
    picture: Progressive,
    /// Rays and seconds since the last title.
    work: (u64, f64),
    /// Samples per pixel.
    samples: f64,
}

impl Viewer {
    fn new(canvas: &Canvas<'_>, technique: Option<String>) -> Result<Self> {
        let own = || canvas.scene.defaults.technique.clone();
        let options = RenderOptions {
            technique: technique.or_else(own),
            camera: canvas.camera.map(Into::into),
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(canvas.gpu, canvas.scene)?;
        Ok(Self {
            picture: Progressive::new(canvas.gpu, renderer, options, canvas.exposure, canvas.format),
            work: (0, 0.0),
            samples: 0.0,
        })
    }
}

impl Show for Viewer {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let frame = self.picture.frame(orbit, size)?;
        self.work.0 += frame.rays;
        self.work.1 += frame.seconds;
        self.samples = frame.samples;
        Ok(Shown {
            pixels: frame.pixels,
            seconds: frame.seconds,
        })
    }

    fn title(&mut self) -> String {
        let (rays, seconds) = std::mem::take(&mut self.work);
        let mut text = format!("{}, {:.0} samples per pixel", self.picture.technique(), self.samples);
        if rays > 0 {
            text += &format!(", {:.2} M rays/s", rays as f64 / seconds * 1e-6);
        }
        text
    }

    fn key(&mut self, key: &Key) {
        if matches!(key, Key::Character(text) if text.eq_ignore_ascii_case("t")) {
            self.picture.next_technique();
        }
    }

    fn end(&mut self) {
        println!("{}", self.title());
    }
}
