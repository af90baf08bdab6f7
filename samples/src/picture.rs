//! What the viewer shows: an orbit camera, and pictures that grow better with every frame.

use clerestory::Result;
use clerestory::gpu::shaders::samples::gradient;
use clerestory::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, rw_compute_to_compute};
use glam::Vec3;

/// Nearest and farthest distance of the eye, metres.
const DISTANCE: [f32; 2] = [0.5, 200.0];
/// Lowest and highest elevation of the eye, radians: above the floor and below the zenith, where the view has no up.
const ELEVATION: [f32; 2] = [0.02, 1.55];

/// A camera that turns around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// What it looks at, metres.
    pub target: Vec3,
    /// Angle around the vertical, radians.
    pub azimuth: f32,
    /// Angle above the horizon, radians.
    pub elevation: f32,
    /// From target to eye, metres.
    pub distance: f32,
    /// Tangent of half the vertical field of view.
    pub half_height: f32,
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            target: Vec3::new(0.0, 1.0, 0.0),
            azimuth: 0.6,
            elevation: 0.25,
            distance: 6.0,
            half_height: 0.5,
        }
    }
}

impl Orbit {
    /// Turns by angles in radians.
    pub fn turn(&mut self, azimuth: f32, elevation: f32) {
        self.azimuth = (self.azimuth + azimuth) % std::f32::consts::TAU;
        self.elevation = (self.elevation + elevation).clamp(ELEVATION[0], ELEVATION[1]);
    }

    /// Moves the eye: the distance is multiplied by `factor`.
    pub fn zoom(&mut self, factor: f32) {
        self.distance = (self.distance * factor).clamp(DISTANCE[0], DISTANCE[1]);
    }

    /// Where the eye is.
    pub fn eye(&self) -> Vec3 {
        let (sin, cos) = self.azimuth.sin_cos();
        let (up, out) = self.elevation.sin_cos();
        self.target + self.distance * Vec3::new(out * sin, up, out * cos)
    }
}

/// Something that renders what a camera sees, a little better with every call.
pub trait Picture {
    /// Adds a frame to the average of what the camera sees, or starts anew when camera or size changed. Returns a device buffer of
    /// `size[0] * size[1]` pixels of four bytes, rows from top to bottom, that is finished and may be copied from.
    ///
    /// # Errors
    /// The engine's.
    fn render(&mut self, camera: &Orbit, size: [u32; 2]) -> Result<Buffer>;
}

/// A sky over a chequered floor.
pub struct Gradient {
    gpu: Gpu,
    pipeline: ComputePipeline<gradient::Kernel>,
    bgra: bool,
    state: Option<State>,
}

struct State {
    camera: Orbit,
    size: [u32; 2],
    frame: u32,
    sums: Buffer,
    pixels: Buffer,
}

impl Gradient {
    /// The picture, with bytes in the order blue, green, red, alpha where `bgra` says so, else red first.
    ///
    /// # Errors
    /// The engine's.
    pub fn new(gpu: &Gpu, bgra: bool) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            pipeline: gpu.compute_pipeline::<gradient::Kernel>(&())?,
            bgra,
            state: None,
        })
    }
}

impl Picture for Gradient {
    fn render(&mut self, camera: &Orbit, size: [u32; 2]) -> Result<Buffer> {
        let (gpu, pixels) = (&self.gpu, u64::from(size[0]) * u64::from(size[1]));
        let kept = self.state.take().filter(|state| state.size == size);
        let mut state = match kept {
            Some(state) if state.camera == *camera => state,
            Some(state) => State {
                camera: *camera,
                frame: 0,
                ..state
            },
            None => State {
                camera: *camera,
                size,
                frame: 0,
                sums: gpu.buffer(&BufferDesc::storage("sums", pixels * 12, Category::Film))?,
                pixels: gpu.buffer(&BufferDesc::storage("pixels", pixels * 4, Category::Film))?,
            },
        };
        let eye = camera.eye();
        let forward = (camera.target - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let push = gradient::Push {
            eye: eye.to_array(),
            right: (right * camera.half_height).to_array(),
            down: (forward.cross(right) * camera.half_height).to_array(),
            forward: forward.to_array(),
            size,
            frame: state.frame,
            bgra: self.bgra.into(),
        };
        let mut recorder = gpu.recorder("gradient")?;
        recorder.pass("gradient", |pass| {
            let set = gradient::Set0 {
                sums: state.sums.view(),
                pixels: state.pixels.view(),
            };
            let groups = [size[0].div_ceil(8), size[1].div_ceil(8), 1];
            pass.dispatch(&self.pipeline, &[&set], &push, groups)?;
            pass.barrier(&[rw_compute_to_compute(&state.sums)]);
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        state.frame += 1;
        let pixels = state.pixels.clone();
        self.state = Some(state);
        Ok(pixels)
    }
}
