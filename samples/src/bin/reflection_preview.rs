//! A polished body that turns and wanders through a room and reflects it, drawn by rasterization alone.
//!
//! `reflection_preview [SCENE] [--shape sphere|ring|knot] [--metal mirror|NAME] [--roughness NUMBER] [--radius METRES] [--turn DEGREES]
//! [--map TEXELS] [--search STEPS] [--shadows cube|octahedron|none] [--shadow TEXELS] [--samples N] [--output FILE] [--camera NAME]
//! [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--screenshot FILE]`
//!
//! Each frame the body goes on by `--turn` degrees of its way. Lights without area cast shadows by omnidirectional shadow maps (`--shadow` texels
//! along a side); the scene without the body is drawn in all directions from the body's middle, into an octahedron map of `--map` texels per side, and
//! the body shows that map, filtered by how rough it is: in the direction of the mirrored ray, or with `--search` where so many steps through the map's distances find what that ray meets. What walls throw on one another is a second such map, drawn three times at the start, each lit by the one before.
//! `--samples` squared samples make a pixel. Metals are gold, silver, copper, aluminium, iron, chromium, titanium, nickel and cobalt. Space holds the
//! body. With `--output` there is no window: the last of `--frames` frames is written, and how long its parts took. Without a scene it is a room with two
//! lamps. Otherwise as the viewer.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clerestory::film::PixelFormat;
use clerestory::gpu::{Buffer, Gpu, GpuOptions, Recorder};
use clerestory::maps::impostor::ImpostorSettings;
use clerestory::raster::ShadowLayout;
use clerestory::scene::{self, LightKind, Material, Mesh, Scene, SceneProfile, metals};
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap, SearchedReflections,
};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::orbit::Orbit;
use clerestory_samples::showroom::showroom;
use clerestory_samples::window::{self, Show, Shown};
use clerestory_samples::{check_messages, save_png, solids};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use winit::keyboard::{Key, NamedKey};

/// Radius of the body as a share of the scene's least side, unless told otherwise.
const RADIUS: f64 = 0.2;
/// Radius of its way, as a share of the scene's lesser side on the ground.
const WAY: f64 = 0.13;
/// Degrees of its way per frame, unless told otherwise.
const TURN: f64 = 4.0;
/// Turns about itself for each round.
const SPIN: f64 = 3.0;
/// Bounces of light from wall to wall.
const BOUNCES: usize = 3;
/// Texels along a side of the map that lights the walls.
const WALLS: u32 = 128;
/// Size of pictures without a window.
const SIZE: [u32; 2] = [640, 480];

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = [
        "--shape",
        "--metal",
        "--roughness",
        "--radius",
        "--turn",
        "--map",
        "--search",
        "--shadows",
        "--shadow",
        "--samples",
        "--output",
    ];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let scene = match given.alone(0) {
        Some(address) => scene::load(address)?,
        None => showroom(),
    };
    let settings = Settings::of(&given)?;
    let (scene, body) = with_body(scene, &settings)?;
    if let Some(path) = given.text("--output") {
        return without_window(&given, &scene, body, settings, Path::new(path));
    }
    window::show_scene(window::Options::of(&given, "")?, scene, |canvas| {
        Stage::new(canvas.gpu, canvas.scene, body, settings, canvas.exposure, canvas.format)
    })
}

/// Renders frames headless and writes the last one.
fn without_window(given: &Arguments, scene: &Scene, body: Body, settings: Settings, path: &Path) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let log = gpu.validation_log();
    let camera = scene.require_camera(given.text("--camera"))?;
    let mut orbit = Orbit::new(camera, SceneProfile::of(scene).bounds);
    let exposure = given.value("--exposure")?.unwrap_or(scene.defaults.exposure);
    let size = given.size("--size")?.unwrap_or(SIZE);
    let frames: u32 = given.value("--frames")?.unwrap_or(1);
    let mut stage = Stage::new(&gpu, scene, body, settings, exposure, PixelFormat::Rgba8)?;
    let mut last = None;
    for _ in 0..frames.max(1) {
        last = Some(stage.frame(&mut orbit, size)?.pixels);
    }
    if let Some(pixels) = last {
        let bytes: Vec<u8> = gpu.read(pixels.view(), 4 * (size[0] * size[1]) as usize)?;
        save_png(path, size, &bytes)?;
        println!("wrote {}", path.display());
    }
    stage.end();
    drop((stage, gpu));
    check_messages(&log)
}

/// What is asked for.
#[derive(Debug, Clone)]
struct Settings {
    shape: String,
    metal: String,
    roughness: f32,
    radius: Option<f64>,
    /// Radians a frame.
    turn: f64,
    map: u32,
    /// In the map's distances; `None` for the mirrored ray's own direction.
    search: Option<ImpostorSettings>,
    shadows: Option<PreviewShadows>,
    samples: u32,
}

impl Settings {
    fn of(given: &Arguments) -> Result<Self> {
        let side = given.value("--shadow")?.unwrap_or(PreviewShadows::default().side);
        let layout = match given.text("--shadows") {
            Some("none") => None,
            Some("cube") => Some(ShadowLayout::Cube),
            None | Some("octahedron") => Some(ShadowLayout::Octahedron),
            Some(other) => {
                return Err(Error::setting(
                    "--shadows",
                    other,
                    "is not one of cube, octahedron and none",
                ));
            }
        };
        let radius = given.value("--radius")?;
        if let Some(wrong) = radius.filter(|radius: &f64| !(*radius > 0.0 && radius.is_finite())) {
            return Err(Error::setting("--radius", wrong, "is not a length above 0"));
        }
        Ok(Self {
            shape: given.text("--shape").unwrap_or("knot").into(),
            metal: given.text("--metal").unwrap_or("gold").into(),
            roughness: given.value("--roughness")?.unwrap_or(0.0),
            radius,
            turn: given.value("--turn")?.unwrap_or(TURN).to_radians(),
            map: given.value("--map")?.unwrap_or(256),
            search: given.value("--search")?.map(|steps| ImpostorSettings {
                steps,
                ..ImpostorSettings::default()
            }),
            shadows: layout.map(|layout| PreviewShadows {
                layout,
                side,
                ..PreviewShadows::default()
            }),
            samples: given.value("--samples")?.unwrap_or(2),
        })
    }

    /// The body's surface, of radius 1.
    fn mesh(&self) -> Result<Mesh> {
        match self.shape.as_str() {
            "sphere" => Ok(solids::sphere(1.0, 96)),
            "ring" => Ok(solids::knot([1, 0], 0.72, 0.0, 0.28, [160, 64])),
            "knot" => Ok(solids::knot([2, 3], 0.56, 0.26, 0.18, [384, 40])),
            other => Err(Error::setting("--shape", other, "is not one of sphere, ring and knot")),
        }
    }

    fn material(&self) -> Result<Material> {
        let conductor = metals::by_name(&self.metal);
        if conductor.is_none() && self.metal != "mirror" {
            let known: Vec<_> = metals::names().collect();
            let cause = format!("is neither mirror nor one of {}", known.join(", "));
            return Err(Error::setting("--metal", &self.metal, cause));
        }
        if !(0.0..=1.0).contains(&self.roughness) {
            return Err(Error::setting("--roughness", self.roughness, "is not from 0 to 1"));
        }
        Ok(Material {
            conductor,
            roughness: self.roughness,
            ..Material::mirror("polished", Vec3::splat(0.95))
        })
    }
}

/// The body and its way.
#[derive(Debug, Clone, Copy)]
struct Body {
    object: u32,
    middle: DVec3,
    radius: f64,
    /// Of its way, metres.
    way: f64,
}

impl Body {
    /// Its place after it has gone around by an angle, radians.
    fn at(&self, angle: f64) -> DAffine3 {
        let place = self.middle + self.way * DVec3::new(angle.sin(), 0.3 * (2.0 * angle).sin(), 0.5 * angle.cos());
        let turn = DQuat::from_rotation_y(SPIN * angle) * DQuat::from_rotation_x(1.1 + 0.5 * angle);
        DAffine3::from_scale_rotation_translation(DVec3::splat(self.radius), turn, place)
    }
}

/// The scene with the body as its last object, and with a lamp if it has none.
fn with_body(mut scene: Scene, settings: &Settings) -> Result<(Scene, Body)> {
    let bounds = SceneProfile::of(&scene).bounds;
    let [low, high] = bounds
        .ok_or_else(|| Error::scene(&scene.source, "instances", "place nothing to reflect"))?
        .map(DVec3::from_array);
    let size = high - low;
    let radius = settings.radius.unwrap_or(RADIUS * size.min_element());
    let body = Body {
        object: scene.instances.len() as u32,
        middle: low.midpoint(high) - 0.1 * size.y * DVec3::Y,
        radius,
        way: WAY * size.x.min(size.z),
    };
    let material = scene.add_material(settings.material()?);
    scene.place(Mesh {
        material: Some(material),
        ..settings.mesh()?
    });
    if let Some(instance) = scene.instances.last_mut() {
        instance.transform = body.at(0.0);
    }
    if scene.lights.is_empty() {
        let position = low.midpoint(high) + 0.35 * size.y * DVec3::Y;
        // As bright as a white room of this size wants.
        let intensity = Vec3::splat((0.25 * size.length_squared()) as f32);
        scene.add_light(
            "lamp",
            LightKind::Point {
                position: position.as_vec3(),
                intensity,
            },
        );
    }
    Ok((scene, body))
}

/// The error of a setting with the name of the option that gives it.
fn by_option(mut error: Error) -> Error {
    if let Error::Setting { name, .. } | Error::LimitExceeded { name, .. } = &mut error {
        let option = match name.as_str() {
            "probe side" | "directional map: texels" => "--map",
            "shadow maps" | "shadow width" => "--shadow",
            "samples" | "preview: samples" => "--samples",
            "impostor steps" => "--search",
            _ => return error,
        };
        *name = option.into();
    }
    error
}

/// All that is drawn.
struct Stage {
    gpu: Gpu,
    scene: Scene,
    on_device: GpuScene,
    lights: Vec<LightKind>,
    body: Body,
    settings: Settings,
    exposure: f32,
    format: PixelFormat,
    angle: f64,
    held: bool,
    view: Option<View>,
    /// Milliseconds by pass of the last frame.
    times: BTreeMap<String, f64>,
    frames: u32,
}

/// What depends on the window's size.
struct View {
    preview: Preview,
    /// Light among the walls, without the body.
    walls: [LiveProbe; 2],
    /// What the body sees.
    around: LiveProbe,
    /// Where that is searched.
    searched: Option<SearchedReflections>,
    pixels: Buffer,
    size: [u32; 2],
}

impl Stage {
    fn new(
        gpu: &Gpu,
        scene: &Scene,
        body: Body,
        settings: Settings,
        exposure: f32,
        format: PixelFormat,
    ) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            on_device: GpuScene::new(gpu, scene)?,
            lights: scene.lights.iter().map(|light| light.kind).collect(),
            scene: scene.clone(),
            body,
            settings,
            exposure,
            format,
            angle: 0.0,
            held: false,
            view: None,
            times: BTreeMap::new(),
            frames: 0,
        })
    }

    fn open(&self, size: [u32; 2]) -> Result<View> {
        let (gpu, scene) = (&self.gpu, &self.on_device);
        let is_sun = |light: &&LightKind| matches!(light, LightKind::Directional { .. });
        let suns = self.lights.iter().filter(is_sun).count() as u32;
        let mut preview = Preview::new(
            gpu,
            scene,
            PreviewDesc {
                size,
                samples: self.settings.samples,
                lights: self.lights.len() as u32,
                shadows: self.settings.shadows.map(|shadows| PreviewShadows { suns, ..shadows }),
                probes: Some(ProbeMap::Octahedron),
            },
        )
        .map_err(by_option)?;
        let probe = |side, finest| {
            LiveProbe::new(
                gpu,
                scene,
                &preview,
                LightProbeDesc {
                    map: ProbeMap::Octahedron,
                    side,
                    finest,
                },
                true,
            )
        };
        let walls = [probe(WALLS, 64)?, probe(WALLS, 64)?];
        let desc = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: self.settings.map,
            finest: 128,
        };
        let make = match self.settings.search {
            Some(_) => LiveProbe::with_distances,
            None => LiveProbe::new,
        };
        let around = make(gpu, scene, &preview, desc, true).map_err(by_option)?;
        let search = self.settings.search.as_ref();
        let searched = search.map(|search| SearchedReflections::new(gpu, scene, around.probe(), search));
        let searched = searched.transpose().map_err(by_option)?;
        let surfaces = scene.surfaces();
        let bare = surfaces.before(self.body.object);
        let mut recorder = gpu.recorder("light among the walls")?;
        preview.record_lights(&mut recorder, &bare, &self.lights)?;
        let middle = self.body.middle.as_vec3();
        for bounce in 0..BOUNCES {
            let by = (bounce > 0).then(|| walls[(bounce + 1) % 2].probe());
            walls[bounce % 2].record(&mut recorder, scene, &bare, &preview, middle, by)?;
        }
        recorder.submit()?.wait()?;
        Ok(View {
            preview,
            walls,
            around,
            searched,
            pixels: window::pixels(gpu, size)?,
            size,
        })
    }

    fn record(&self, view: &mut View, orbit: &Orbit, recorder: &mut Recorder) -> Result<()> {
        let scene = &self.on_device;
        let surfaces = scene.surfaces();
        let object = surfaces.triangles_of(self.body.object);
        let walls = view.walls[(BOUNCES + 1) % 2].probe();
        view.preview.record_lights(recorder, &surfaces, &self.lights)?;
        let place = self.body.at(self.angle).translation.as_vec3();
        let others = surfaces.before(self.body.object);
        view.around
            .record(recorder, scene, &others, &view.preview, place, Some(walls))?;
        let parts = [
            PreviewPart {
                triangles: 0..object.start,
                background: true,
                probe: Some(walls),
            },
            PreviewPart {
                triangles: object.clone(),
                background: false,
                probe: Some(view.around.probe()),
            },
        ];
        let camera = orbit.camera();
        view.preview.record(recorder, scene, &surfaces, &camera, &parts)?;
        if let Some(searched) = &view.searched {
            searched.record(recorder, scene, &view.preview, &camera, object, (&view.around, place))?;
        }
        view.preview
            .record_display(recorder, &view.pixels, self.exposure, self.format)
    }
}

impl Show for Stage {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        let begin = Instant::now();
        // The old picture goes before a new one is made, so that they need no memory at once.
        let mut view = match self.view.take().filter(|view| view.size == size) {
            Some(view) => view,
            None => self.open(size)?,
        };
        if self.frames > 0 && !self.held {
            self.angle = (self.angle + self.settings.turn) % (4.0 * std::f64::consts::TAU);
            self.on_device.move_object(
                &self.gpu,
                &self.scene,
                self.body.object as usize,
                self.body.at(self.angle),
            )?;
        }
        let mut recorder = self.gpu.recorder("frame")?;
        self.record(&mut view, orbit, &mut recorder)?;
        let timings = recorder.submit()?.wait()?;
        self.times.clear();
        for pass in timings.passes {
            *self.times.entry(pass.name).or_default() += 1e-6 * pass.nanoseconds.unwrap_or_default() as f64;
        }
        self.frames += 1;
        let shown = Shown::since(begin, &view.pixels);
        self.view = Some(view);
        Ok(shown)
    }

    fn title(&mut self) -> String {
        let whole: f64 = self.times.values().sum();
        if whole > 0.0 {
            format!("GPU {whole:.1} ms per frame")
        } else {
            "no timestamps".into()
        }
    }

    fn key(&mut self, key: &Key) {
        if *key == Key::Named(NamedKey::Space) {
            self.held = !self.held;
        }
    }

    fn end(&mut self) {
        let parts: Vec<_> = self
            .times
            .iter()
            .map(|(name, time)| format!("{name} {time:.1} ms"))
            .collect();
        println!("frame {}: {}", self.frames, parts.join(", "));
    }
}
