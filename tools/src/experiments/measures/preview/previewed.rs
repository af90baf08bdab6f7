//! Pictures of a scene by the raster preview, with a live map at a place or without one, and by the path tracer.

use clerestory::Result;
use clerestory::film::Picture;
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowLayout;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, LightKind, Scene};
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, PreviewShadows, ProbeMap,
};
use glam::Vec3;
use serde_json::json;

/// The live map.
pub const MAP: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Octahedron,
    side: 256,
    finest: 128,
};
/// Places of live maps along each axis of the box around a scene, as shares of it: nine at half its height.
const SHARES: [f32; 3] = [0.25, 0.5, 0.75];
/// Seed of the path tracer, which no preview has.
pub const REFERENCE_SEED: u32 = 2;

/// A scene for the preview and for the path tracer.
pub struct Subject<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    camera: Camera,
    lights: Vec<LightKind>,
}

/// Pixels along a side, texels along a side of shadow maps, and samples along a side of a pixel.
pub type Quality = (u32, u32, u32);

/// A preview, with a live map or without one.
pub struct Previewed<'a> {
    subject: &'a Subject<'a>,
    preview: Preview,
    live: Option<LiveProbe>,
}

impl<'a> Subject<'a> {
    /// That of a scene.
    ///
    /// # Errors
    /// Those of the scene and the device.
    pub fn new(gpu: &'a Gpu, scene: &Scene) -> Result<Self> {
        Ok(Self {
            gpu,
            renderer: Renderer::new(gpu, scene)?,
            camera: scene.require_camera(None)?.clone(),
            lights: scene.lights.iter().map(|light| light.kind).collect(),
        })
    }

    /// The path tracer's picture of so many pixels along a side, and samples of each.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn traced(&self, (size, spp): (u32, u32), paths: &str) -> Result<Picture> {
        let rendered = self.renderer.render(&RenderOptions {
            technique: Some("path".into()),
            size: [size; 2],
            spp,
            seed: REFERENCE_SEED,
            settings: json!({"path_set": paths}).into(),
            ..RenderOptions::default()
        })?;
        Ok(rendered.picture)
    }

    /// The preview, with a live map where one is asked for.
    ///
    /// # Errors
    /// Those of the device.
    pub fn previewed(&'a self, (size, side, samples): Quality, has_live_map: bool) -> Result<Previewed<'a>> {
        let scene = self.renderer.gpu_scene();
        let desc = PreviewDesc {
            size: [size; 2],
            samples,
            lights: self.lights.len() as u32,
            shadows: Some(PreviewShadows {
                layout: ShadowLayout::Octahedron,
                side,
                width: 0,
                suns: 0,
            }),
            probes: has_live_map.then_some(ProbeMap::Octahedron),
        };
        let preview = Preview::new(self.gpu, scene, desc)?;
        let live = has_live_map
            .then(|| LiveProbe::new(self.gpu, scene, &preview, MAP, false))
            .transpose()?;
        Ok(Previewed {
            subject: self,
            preview,
            live,
        })
    }

    /// Where live maps are drawn.
    pub fn places(&self) -> Vec<(String, Vec3)> {
        let [lower, upper] = self.renderer.gpu_scene().bounds();
        let shares = SHARES
            .iter()
            .flat_map(|x| SHARES.iter().map(|z| Vec3::new(*x, 0.5, *z)));
        let place = |share: Vec3| (format!("{}, {}", share.x, share.z), lower + share * (upper - lower));
        shares.map(place).collect()
    }
}

impl Previewed<'_> {
    /// Draws a frame: lights, the live map, if there is one, at the place, and what the camera sees. Seconds of the device.
    ///
    /// # Errors
    /// Those of the device.
    pub fn frame(&mut self, place: Vec3) -> Result<f64> {
        let Subject {
            gpu,
            renderer,
            camera,
            lights,
        } = self.subject;
        let scene = renderer.gpu_scene();
        let surfaces = scene.surfaces();
        let mut recorder = gpu.recorder("frame")?;
        self.preview.record_lights(&mut recorder, &surfaces, lights)?;
        if let Some(live) = &self.live {
            live.record(&mut recorder, scene, &surfaces, &self.preview, place, None)?;
        }
        let part = PreviewPart {
            triangles: 0..surfaces.triangles,
            background: true,
            probe: self.live.as_ref().map(LiveProbe::probe),
        };
        self.preview.record(&mut recorder, scene, &surfaces, camera, &[part])?;
        Ok(recorder.submit()?.wait()?.seconds())
    }

    /// The picture of the last frame.
    ///
    /// # Errors
    /// Those of the device.
    pub fn picture(&self) -> Result<Picture> {
        self.preview.picture()
    }
}
