//! A game in which a mirror sphere moves through a room, drawn by the raster preview with a map about it now and then, and by the path tracer.

use clerestory::gpu::Gpu;
use clerestory::maps::impostor::{ImpostorSettings, SearchMethod};
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Scene};
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap, SearchedReflections,
};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DAffine3, DVec3, Vec3};
use serde_json::json;

use crate::experiments::measures::preview::previewed::REFERENCE_SEED;

/// A room whose last object is a mirror sphere, lit by points.
const SCENE: &str = "builtin:game-room";
/// What the preview shows of it: direct light, and what the mirror shows of that.
const PATHS: &str = "LE|L.E|L.SE";
/// The sphere's radius, the middle of its way, and how far that goes from there along x and z, m.
const RADIUS: f64 = 0.5;
const MIDDLE: DVec3 = DVec3::new(0.4, 1.3, 0.2);
const WAY: [f64; 2] = [0.7, 0.5];
/// Radians of the way a frame: 1.2 to 1.8 cm, a metre in a second of 66 frames.
const TURN: f64 = 0.025;
/// Who looks at the middle of the way, and how wide the view is, radians.
const EYE: DVec3 = DVec3::new(2.9, 1.8, 2.2);
const FOV: f32 = 0.8;
/// Share of the sphere's radius within which a pixel shows nothing else.
const RIM: f64 = 0.95;

/// Steps of the hybrid search.
pub const STEPS: u32 = 3;
/// Texels along a side of the finest filtered level; mirrors look none of these up.
const FINEST: u32 = 32;

/// How much is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Quality {
    /// Frames of a trace.
    pub frames: u32,
    /// Pixels along a side.
    pub size: u32,
    /// Samples along a side of a pixel.
    pub samples: u32,
    /// Texels along a side of the map's octahedron.
    pub map: u32,
    /// Texels along a side of shadow maps.
    pub shadows: u32,
    /// Samples of a pixel of the path tracer's.
    pub spp: u32,
}

/// The sphere's middle at a frame.
fn place(frame: u32) -> DVec3 {
    let (sine, cosine) = (TURN * f64::from(frame)).sin_cos();
    MIDDLE + DVec3::new(WAY[0] * sine, 0.0, WAY[1] * cosine)
}

/// By how much the sphere's pixels are off.
pub struct Deviation {
    /// Three a pixel; 0 beside the sphere.
    values: Vec<f64>,
    /// Values of the sphere, and the mean of what they are to be.
    count: f64,
    mean: f64,
}

impl Deviation {
    /// Of a picture beside what it is to be; three values a pixel.
    pub fn of(found: &[f32], truth: &[f32], mask: &[bool]) -> Self {
        let (mut count, mut sum) = (0.0, 0.0);
        let is_of_sphere = mask.iter().flat_map(|is_of_sphere| [*is_of_sphere; 3]);
        let pairs = found.iter().zip(truth).zip(is_of_sphere);
        let values = pairs.map(|((found, truth), is_of_sphere)| {
            if !is_of_sphere {
                return 0.0;
            }
            count += 1.0;
            sum += f64::from(*truth);
            f64::from(*found) - f64::from(*truth)
        });
        let values: Vec<f64> = values.collect();
        Self {
            values,
            count,
            mean: sum / f64::max(count, 1.0),
        }
    }

    /// RMS over the mean.
    pub fn size(&self) -> f64 {
        self.relative(self.values.iter().map(|value| value * value).sum())
    }

    /// The same of what has changed since another one.
    pub fn since(&self, before: &Self) -> f64 {
        let pairs = self.values.iter().zip(&before.values);
        self.relative(pairs.map(|(now, before)| (now - before) * (now - before)).sum())
    }

    fn relative(&self, squares: f64) -> f64 {
        (squares / self.count.max(1.0)).sqrt() / self.mean.max(f64::MIN_POSITIVE)
    }
}

/// The scene, and all that draws it.
pub struct Game<'a> {
    gpu: &'a Gpu,
    quality: Quality,
    scene: Scene,
    on_device: GpuScene,
    camera: Camera,
    lights: Vec<LightKind>,
    /// The sphere's number.
    object: u32,
    preview: Preview,
    live: LiveProbe,
    searched: SearchedReflections,
    /// Where the map was drawn last.
    place: Vec3,
}

impl<'a> Game<'a> {
    /// All of it; nothing is drawn yet.
    ///
    /// # Errors
    /// Those of the scene and the device.
    pub fn new(gpu: &'a Gpu, quality: Quality) -> Result<Self> {
        let mut scene = scene::load(SCENE)?;
        let camera = Camera::look_at("main", EYE, MIDDLE, DVec3::Y, FOV);
        scene.cameras = vec![camera.clone()];
        let object = (scene.instances.len() as u32).saturating_sub(1);
        let lights: Vec<LightKind> = scene.lights.iter().map(|light| light.kind).collect();
        let on_device = GpuScene::new(gpu, &scene)?;
        let desc = PreviewDesc {
            size: [quality.size; 2],
            samples: quality.samples,
            lights: lights.len() as u32,
            shadows: Some(PreviewShadows {
                layout: ShadowLayout::Octahedron,
                side: quality.shadows,
                width: 0,
                suns: 0,
            }),
            probes: Some(ProbeMap::Octahedron),
        };
        let preview = Preview::new(gpu, &on_device, desc)?;
        let map = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: quality.map,
            finest: FINEST,
        };
        let live = LiveProbe::with_distances(gpu, &on_device, &preview, map, false)?;
        let search = ImpostorSettings::of(SearchMethod::Hybrid, STEPS);
        Ok(Self {
            searched: SearchedReflections::new(gpu, &on_device, live.probe(), &search)?,
            gpu,
            quality,
            scene,
            on_device,
            camera,
            lights,
            object,
            preview,
            live,
            place: Vec3::ZERO,
        })
    }

    /// Draws a frame, after the map where it is due, each in submissions of its own: milliseconds of the device for the map, and for all else.
    fn frame(&mut self, number: u32, period: u32, searches: bool) -> Result<[f64; 2]> {
        let at = place(number);
        let transform = DAffine3::from_translation(at);
        self.on_device
            .move_object(self.gpu, &self.scene, self.object as usize, transform)?;
        let scene = &self.on_device;
        let surfaces = scene.surfaces();
        let mut recorder = self.gpu.recorder("shadows")?;
        self.preview.record_lights(&mut recorder, &surfaces, &self.lights)?;
        let mut rest = recorder.submit()?.wait()?.seconds();
        let mut map = 0.0;
        if number.is_multiple_of(period) {
            self.place = at.as_vec3();
            let mut recorder = self.gpu.recorder("map")?;
            let others = surfaces.before(self.object);
            self.live
                .record(&mut recorder, scene, &others, &self.preview, self.place, None)?;
            map = recorder.submit()?.wait()?.seconds();
        }
        let body = surfaces.triangles_of(self.object);
        let parts = [
            PreviewPart {
                triangles: 0..body.start,
                background: true,
                probe: None,
            },
            PreviewPart {
                triangles: body.clone(),
                background: false,
                probe: Some(self.live.probe()),
            },
        ];
        let mut recorder = self.gpu.recorder("picture")?;
        self.preview
            .record(&mut recorder, scene, &surfaces, &self.camera, &parts)?;
        if searches {
            let around = (&self.live, self.place);
            self.searched
                .record(&mut recorder, scene, &self.preview, &self.camera, body, around)?;
        }
        rest += recorder.submit()?.wait()?.seconds();
        Ok([map, rest].map(|seconds| 1e3 * seconds))
    }

    /// All frames, searched: milliseconds of each, for the map and for all else.
    ///
    /// # Errors
    /// Those of the device.
    pub fn trace(&mut self, period: u32) -> Result<Vec<[f64; 2]>> {
        let frames = 0..self.quality.frames;
        frames.map(|number| self.frame(number, period, true)).collect()
    }

    /// The picture of a frame; where no map is due at it, by the one that was drawn last.
    ///
    /// # Errors
    /// Those of the device.
    pub fn picture(&mut self, number: u32, period: u32, searches: bool) -> Result<Vec<f32>> {
        self.frame(number, period, searches)?;
        Ok(self.preview.picture()?.main_layer()?.values().to_vec())
    }

    /// The path tracer's picture of a frame.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn traced(&self, number: u32) -> Result<Vec<f32>> {
        let mut scene = self.scene.clone();
        if let Some(sphere) = scene.instances.last_mut() {
            sphere.transform = DAffine3::from_translation(place(number));
        }
        let rendered = Renderer::new(self.gpu, &scene)?.render(&RenderOptions {
            technique: Some("path".into()),
            size: [self.quality.size; 2],
            spp: self.quality.spp,
            seed: REFERENCE_SEED,
            settings: json!({"path_set": PATHS}).into(),
            ..RenderOptions::default()
        })?;
        Ok(rendered.picture.main_layer()?.values().to_vec())
    }

    /// Whether pixels show the sphere and nothing else at a frame.
    pub fn mask(&self, frame: u32) -> Vec<bool> {
        let size = self.quality.size;
        let half = f64::from(0.5 * FOV).tan();
        let at = |i: u32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(size) - 1.0);
        let to_middle = place(frame) - EYE;
        let is_of_sphere = |pixel: u32| {
            let ray = DVec3::new(at(pixel % size), -at(pixel / size), -1.0);
            let direction = self.camera.transform.transform_vector3(ray).normalize();
            to_middle.reject_from(direction).length() < RIM * RADIUS
        };
        (0..size * size).map(is_of_sphere).collect()
    }
}
