//! A window on a scene whose lamp moves, lit anew in every frame by many virtual lights.
//!
//! `many_lights [SCENE] [--lights N] [--placement walks|rsm|incremental|metropolis] [--visibility none|imperfect|maps|rays] [--bound none|geometry|distance] [--interleave TILES]
//! [--history SHARE] [--turn DEGREES] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--keys KEYS] [--screenshot FILE]`
//!
//! Each frame the lamp goes around the middle of the scene by `--turn`, its virtual lights are left anew where its light lands, and every pixel gathers the light
//! of its part of them; with `--placement incremental` those that the lamp still sees stay where they are, with `metropolis` chains choose them among more. Space holds the lamp, and the picture converges. V goes on
//! to the next way to tell who sees a virtual light (nothing, imperfect shadow maps, exact ones, rays), B to the next bound of its brightness up close, + and - double and halve the lights, F shows the tiles without
//! their filter, H blends the light of virtual lights with that of the frame before or no longer, P goes on to the next part of the light: all, what lamps send directly, or what virtual lights bring. G goes on to the next
//! of a frame's buffers: places of what is seen in the box about the scene, its normals, direct light, indirect light before the filter and behind it, and the picture again. Otherwise as the viewer.
//!
//! Source of the program's form: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clerestory::Result;
use clerestory::film::PixelFormat;
use clerestory::gpu::shaders::constants::SHADING_NORMAL_BITS;
use clerestory::gpu::{Area, Buffer, Gpu};
use clerestory::maps::packed_direction::unpack_octahedral;
use clerestory::raster::{self, GBuffer, GBufferDesc, Layering, Output};
use clerestory::settings::TypedSettings;
use clerestory::techniques::instant_radiosity::Bound;
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings, Placement, Visibility};
use clerestory::transport::{GpuScene, PathSet};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::carousel::Carousel;
use clerestory_samples::orbit::{Orbit, Pose};
use clerestory_samples::panels::Sheet;
use clerestory_samples::window::{self, Canvas, Show, Shown};
use glam::{Vec3, Vec4};
use winit::keyboard::{Key, NamedKey};

const SCENE: &str = "builtin:cornell-box?source=point";
/// Walks per frame, unless told otherwise.
const LIGHTS: u32 = 256;
/// Walks per frame that keys go to at most and at least; kept lights, and those that chains choose, are fewer.
const LIGHTS_MAX: u32 = 1 << 14;
const PLACED_MAX: u32 = 1 << 12;
const LIGHTS_MIN: u32 = 16;
/// The greatest share of the frame before that key H goes to.
const HISTORY: f32 = 0.9;
/// Degrees that the lamp goes around each frame, unless told otherwise.
const TURN: f64 = 3.0;
/// From the cheapest to the exact one.
const VISIBILITIES: [Visibility; 4] = [
    Visibility::None,
    Visibility::Imperfect,
    Visibility::Maps,
    Visibility::Rays,
];
const BOUNDS: [Bound; 3] = [Bound::Geometry, Bound::Distance, Bound::None];
const DIRECT: &str = "bounces=1,lobes=diffuse+glossy";
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";
/// Parts of the light, with what a title calls them.
const PARTS: [(&str, &str); 3] = [
    ("all light", "bounces=0..2,lobes=diffuse+glossy"),
    ("light of lamps", "bounces=0..1,lobes=diffuse+glossy"),
    ("light of virtual lights", INDIRECT),
];

/// What of a frame the window shows.
#[derive(Clone, Copy, PartialEq)]
enum Shows {
    Picture,
    Places,
    Normals,
    Direct,
    /// Indirect light of the tiles back at their pixels.
    Merged,
    Filtered,
}

impl Shows {
    const ALL: [Self; 6] = [
        Self::Picture,
        Self::Places,
        Self::Normals,
        Self::Direct,
        Self::Merged,
        Self::Filtered,
    ];
}

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = [
        "--lights",
        "--placement",
        "--visibility",
        "--bound",
        "--interleave",
        "--history",
        "--turn",
    ];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let standard = ManyLightSettings::default();
    let settings = ManyLightSettings::from_json(&serde_json::json!({
        "lights": given.value("--lights")?.unwrap_or(LIGHTS),
        "placement": given.text("--placement").unwrap_or("walks"),
        "visibility": given.text("--visibility").unwrap_or("rays"),
        "bound": given.text("--bound").unwrap_or("geometry"),
        "interleave": given.value("--interleave")?.unwrap_or(standard.interleave),
        "history": given.value("--history")?.unwrap_or(standard.history),
    }))?;
    let turn: f64 = given.value("--turn")?.unwrap_or(TURN);
    window::show(window::Options::of(&given, SCENE)?, |canvas| {
        ManyLights::new(canvas, settings, turn.to_radians())
    })
}

struct ManyLights {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: ManyLightSettings,
    /// Index into [`PARTS`].
    part: usize,
    shows: Shows,
    exposure: f32,
    format: PixelFormat,
    lamp: Carousel,
    /// Where the lamp is, and by how much it goes on; radians.
    angle: f64,
    turn: f64,
    held: bool,
    view: Option<View>,
    /// Seconds of the frames that the title has not told of, and how many they are.
    untold: (f64, u32),
}

/// A picture of the window's size.
struct View {
    content: Content,
    pixels: Buffer,
    size: [u32; 2],
    pose: Pose,
    /// Samples per pixel.
    samples: u32,
}

/// What a picture is made by.
enum Content {
    Light(Box<ManyLight>),
    /// Places and normals alone.
    Surfaces(Box<GBuffer>),
}

/// What follows an entry in a list, the first one after the last.
fn next<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let at = all
        .iter()
        .position(|one| *one == now)
        .map_or(0, |at| (at + 1) % all.len());
    all[at]
}

impl ManyLights {
    fn new(canvas: &Canvas<'_>, settings: ManyLightSettings, turn: f64) -> Result<Self> {
        let lamp = Carousel::new(canvas.scene)?;
        let scene = GpuScene::new(canvas.gpu, canvas.scene)?;
        scene.move_light(canvas.gpu, lamp.light(), &lamp.at(0.0))?;
        Ok(Self {
            gpu: canvas.gpu.clone(),
            scene: Arc::new(scene),
            settings,
            part: 0,
            shows: Shows::Picture,
            exposure: canvas.exposure,
            format: canvas.format,
            lamp,
            angle: 0.0,
            turn,
            held: false,
            view: None,
            untold: (0.0, 0),
        })
    }

    /// Settings of the light that is shown.
    fn settings_shown(&self) -> Result<ManyLightSettings> {
        let of = |path_set: &str, filter| -> Result<ManyLightSettings> {
            Ok(ManyLightSettings {
                path_set: path_set.parse()?,
                filter,
                ..self.settings.clone()
            })
        };
        match self.shows {
            Shows::Direct => of(DIRECT, self.settings.filter),
            Shows::Merged => of(INDIRECT, false),
            Shows::Filtered => of(INDIRECT, true),
            Shows::Picture | Shows::Places | Shows::Normals => Ok(self.settings.clone()),
        }
    }

    /// A picture of another size, or with other settings.
    fn open(&self, orbit: &Orbit, size: [u32; 2]) -> Result<View> {
        let content = match self.shows {
            Shows::Places | Shows::Normals => {
                let desc = GBufferDesc {
                    size,
                    layering: Layering::One,
                    outputs: &[Output::Position, Output::Normals],
                };
                Content::Surfaces(Box::new(GBuffer::new(&self.gpu, &self.scene.surfaces(), &desc)?))
            }
            Shows::Picture | Shows::Direct | Shows::Merged | Shows::Filtered => {
                let (scene, settings) = (Arc::clone(&self.scene), self.settings_shown()?);
                let renderer = ManyLight::new(&self.gpu, scene, &orbit.camera(), size, settings)?;
                Content::Light(Box::new(renderer))
            }
        };
        Ok(View {
            content,
            pixels: window::pixels(&self.gpu, size)?,
            size,
            pose: orbit.pose(),
            samples: 0,
        })
    }

    /// What the camera sees, as colours: places in the box about the scene, or normals.
    fn surfaces(&self, gbuffer: &GBuffer, orbit: &Orbit, size: [u32; 2]) -> Result<Sheet> {
        let surfaces = self.scene.surfaces();
        let view = raster::View::of_camera(&orbit.camera(), &surfaces, Area::whole(size))?;
        let mut recorder = self.gpu.recorder("what is seen")?;
        gbuffer.record(&mut recorder, &surfaces, &[view])?;
        recorder.submit()?.wait()?;
        let places: Vec<[f32; 4]> = gbuffer.read(&self.gpu, Output::Position)?;
        let normals: Vec<[u32; 2]> = gbuffer.read(&self.gpu, Output::Normals)?;
        let [lower, upper] = self.scene.bounds();
        let mut sheet = Sheet::new(size, [0; 3]);
        for (pixel, (place, words)) in (0..).zip(places.iter().zip(&normals)) {
            // Zero where there is nothing.
            if place[3] == 0.0 {
                continue;
            }
            let color: Vec3 = match self.shows {
                Shows::Normals => 0.5 + 0.5 * unpack_octahedral(words[1], SHADING_NORMAL_BITS).as_vec3(),
                _ => (Vec4::from_array(*place).truncate() - lower) / (upper - lower),
            };
            let bytes = color
                .to_array()
                .map(|share| (255.0 * share.clamp(0.0, 1.0)).round() as u8);
            sheet.put(pixel % size[0], pixel / size[0], bytes);
        }
        Ok(sheet)
    }

    /// Moves the lamp, and lets the picture begin anew for what has moved.
    fn go_on(&mut self, view: &mut View, orbit: &Orbit) -> Result<()> {
        let lamp_moves = !self.held && self.turn != 0.0;
        if lamp_moves {
            self.angle = (self.angle + self.turn) % std::f64::consts::TAU;
            self.scene
                .move_light(&self.gpu, self.lamp.light(), &self.lamp.at(self.angle))?;
        }
        let Content::Light(renderer) = &mut view.content else {
            return Ok(());
        };
        // What is kept from frame to frame, lights or their light.
        let keeps = self.settings.placement == Placement::Incremental || self.settings.history > 0.0;
        if view.pose != orbit.pose() || (lamp_moves && keeps) {
            renderer.set_camera(&orbit.camera())?;
            (view.pose, view.samples) = (orbit.pose(), 0);
        } else if lamp_moves {
            // The same walks leave the lamp wherever it is, so that virtual lights move with it instead of flickering.
            renderer.restart(self.settings.seed)?;
            view.samples = 0;
        }
        Ok(())
    }

    /// Goes on to the next part of the light.
    fn next_part(&mut self) {
        let part = (self.part + 1) % PARTS.len();
        if let Ok(path_set) = PARTS[part].1.parse::<PathSet>() {
            (self.part, self.settings.path_set) = (part, path_set);
            self.shows = Shows::Picture;
        }
    }
}

impl Show for ManyLights {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let begin = Instant::now();
        // The old picture goes before a new one is made, so that they need no memory at once.
        let mut view = match self.view.take().filter(|view| view.size == size) {
            Some(mut view) => {
                self.go_on(&mut view, orbit)?;
                view
            }
            None => self.open(orbit, size)?,
        };
        view.samples += 1;
        match &mut view.content {
            Content::Light(renderer) => {
                while renderer.step(view.samples)?.is_some() {}
                renderer.display(&view.pixels, self.exposure, self.format)?;
            }
            Content::Surfaces(gbuffer) => {
                let sheet = self.surfaces(gbuffer, orbit, size)?;
                self.gpu.upload(&view.pixels, 0, &sheet.bytes(self.format))?;
            }
        }
        let shown = Shown::since(begin, &view.pixels);
        self.view = Some(view);
        self.untold = (self.untold.0 + shown.seconds, self.untold.1 + 1);
        Ok(shown)
    }

    fn title(&mut self) -> String {
        let (seconds, frames) = std::mem::take(&mut self.untold);
        let s = &self.settings;
        let shown = match self.shows {
            Shows::Picture => PARTS[self.part].0,
            Shows::Places => "places",
            Shows::Normals => "normals",
            Shows::Direct => "direct light",
            Shows::Merged => "indirect light before the filter",
            Shows::Filtered => "indirect light after the filter",
        };
        format!(
            "{shown}: {} lights, visibility {:?}, bound {:?}, filter {}, history {}, {:.1} frames/s",
            s.lights,
            s.visibility,
            s.bound,
            match self.shows {
                Shows::Merged => "off",
                Shows::Filtered => "on",
                _ if s.filter => "on",
                _ => "off",
            },
            if s.history > 0.0 { "on" } else { "off" },
            f64::from(frames) / seconds,
        )
    }

    fn key(&mut self, key: &Key) {
        let s = &mut self.settings;
        match key {
            Key::Named(NamedKey::Space) => {
                self.held = !self.held;
                return;
            }
            Key::Character(text) => match text.to_lowercase().as_str() {
                "v" => s.visibility = next(&VISIBILITIES, s.visibility),
                "b" => s.bound = next(&BOUNDS, s.bound),
                "+" | "=" => {
                    let most = match s.placement {
                        Placement::Walks | Placement::Rsm => LIGHTS_MAX,
                        Placement::Incremental | Placement::Metropolis => PLACED_MAX,
                    };
                    s.lights = (2 * s.lights).min(most);
                }
                "-" => s.lights = (s.lights / 2).max(LIGHTS_MIN),
                "f" => s.filter = !s.filter,
                "h" => s.history = if s.history > 0.0 { 0.0 } else { HISTORY },
                "p" => self.next_part(),
                "g" => self.shows = next(&Shows::ALL, self.shows),
                _ => return,
            },
            _ => return,
        }
        self.view = None;
    }

    fn end(&mut self) {
        println!("last: {}", self.title());
    }
}
