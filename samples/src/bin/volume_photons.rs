//! Photons in participating media: a window on a scene whose light moves, seen by one estimate after the other, or one picture.
//!
//! `volume_photons [SCENE] [--volume march|ray|beams|planes|unified] [--photons N] [--radius METRES] [--turn DEGREES] [--flight METRES]` and the viewer's options, or without a
//! window `volume_photons [SCENE] --picture FILE [--frames N] [--size WxH]` and these
//!
//! Each frame the light goes around the middle of the scene by `--turn`, its photons collide in media and land on surfaces, maps of both are built, and
//! rays from the eye find direct light, single scattering included, and in the maps everything else. E goes on to the next estimate of what is seen in media: marched
//! under balls, by disks across each ray, by disks and beams weighted together, and in homogeneous media by beams alone, the photons' whole ways, or by planes that two flights span. Space holds
//! what moves, and the picture converges.
//! `--flight` moves the camera as in the photon viewer, `--radius` is that of kernels in media; without it small pictures choose it, once where things move.
//! With `--picture` nothing moves unless it is told to, and the last of `--frames` frames is written.
//!
//! Sources: H. W. Jensen and P. H. Christensen, "Efficient Simulation of Light Transport in Scenes with Participating Media Using Photon Maps", SIGGRAPH 1998; W. Jarosz, M.
//! Zwicker and H. W. Jensen, "The Beam Radiance Estimate for Volumetric Photon Mapping", CGF 27(2), 2008; W. Jarosz, D. Nowrouzezahrai, I. Sadeghi and H. W.
//! Jensen, "A Comprehensive Theory of Volumetric Radiance Estimation Using Photon Points and Beams", ACM TOG 30(1), 2011; B. Bitterli and W. Jarosz, "Beyond Points and
//! Beams: Higher-Dimensional Photon Samples for Volumetric Light Transport", ACM TOG 36(4), 2017; J. Křivánek, I. Georgiev, T. Hachisuka, P. Vévoda, M. Šik, D. Nowrouzezahrai and W. Jarosz,
//! "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", ACM TOG 33(4), 2014.

use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::film::PixelFormat;
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::scene::{self, SceneProfile};
use clerestory::settings::TypedSettings;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_samples::arguments::Arguments;
use clerestory_samples::live_photons::{LivePhotons, Motion};
use clerestory_samples::orbit::Orbit;
use clerestory_samples::window::{self, Canvas, Show, Shown};
use winit::keyboard::Key;

const SCENE: &str = "builtin:fog-box?sphere=glass&source=point";
/// Photons per frame, unless told otherwise.
const PHOTONS: u32 = 1 << 14;
/// Degrees that the light goes around each frame of a window, unless told otherwise.
const TURN: f64 = 3.0;
/// Pixels of a picture and frames until it is written, unless told otherwise.
const SIZE: [u32; 2] = [256, 256];
const FRAMES: u32 = 32;
/// In the order of the key.
const ESTIMATES: [VolumeEstimate; 5] = [
    VolumeEstimate::March,
    VolumeEstimate::Ray,
    VolumeEstimate::Unified,
    VolumeEstimate::Beams,
    VolumeEstimate::Planes,
];

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = ["--volume", "--photons", "--radius", "--turn", "--flight", "--picture"];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let settings = PhotonSettings::from_json(&serde_json::json!({
        "photons": given.value("--photons")?.unwrap_or(PHOTONS),
        "volume": given.text("--volume").unwrap_or("ray"),
        "volume_radius": given.value("--radius")?.unwrap_or(0.0f32),
    }))?;
    let picture = given.text("--picture");
    let turn: f64 = given
        .value("--turn")?
        .unwrap_or(if picture.is_some() { 0.0 } else { TURN });
    let motion = Motion {
        turn: turn.to_radians(),
        flight: given.value("--flight")?.unwrap_or(0.0),
    };
    if let Some(path) = picture {
        return without_window(&given, settings, motion, Path::new(path));
    }
    window::show(window::Options::of(&given, SCENE)?, |canvas| {
        Ok(VolumePhotons(LivePhotons::new(canvas, settings, motion)?))
    })
}

/// Renders frames headless and writes the last one.
fn without_window(given: &Arguments, settings: PhotonSettings, motion: Motion, path: &Path) -> Result<()> {
    let scene = scene::load(given.alone(0).unwrap_or(SCENE))?;
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let log = gpu.validation_log();
    let camera = given.text("--camera");
    let mut orbit = Orbit::new(scene.require_camera(camera)?, SceneProfile::of(&scene).bounds);
    let size = given.size("--size")?.unwrap_or(SIZE);
    let frames: u32 = given.value("--frames")?.unwrap_or(FRAMES);
    let canvas = Canvas {
        gpu: &gpu,
        scene: &scene,
        camera,
        exposure: given.value("--exposure")?.unwrap_or(scene.defaults.exposure),
        format: PixelFormat::Rgba8,
    };
    let mut photons = VolumePhotons(LivePhotons::new(&canvas, settings, motion)?);
    let mut shown = photons.frame(&mut orbit, size)?;
    for _ in 1..frames {
        shown = photons.frame(&mut orbit, size)?;
    }
    let bytes: Vec<u8> = gpu.read(shown.pixels.view(), 4 * (size[0] * size[1]) as usize)?;
    clerestory_samples::save_png(path, size, &bytes)?;
    println!("wrote {}", path.display());
    photons.end();
    drop((shown, photons, gpu));
    clerestory_samples::check_messages(&log)
}

/// Photons with a key for the estimates.
struct VolumePhotons(LivePhotons);

impl VolumePhotons {
    /// The estimate after this one that the scene's media allow.
    fn next_estimate(&self) -> VolumeEstimate {
        let volume = self.0.settings().volume;
        let at = ESTIMATES.iter().position(|known| *known == volume).unwrap_or(0);
        match ESTIMATES[(at + 1) % ESTIMATES.len()] {
            VolumeEstimate::Beams if self.0.scene().profile().media.heterogeneous => ESTIMATES[0],
            next => next,
        }
    }

    /// Which estimate, and what rays have met by it.
    fn estimate(&self) -> String {
        let name = match self.0.settings().volume {
            VolumeEstimate::March => "march",
            VolumeEstimate::Ray => "ray",
            VolumeEstimate::Beams => "beams",
            VolumeEstimate::Planes => "planes",
            VolumeEstimate::Unified => "unified",
        };
        let Some((counts, radius)) = self.0.counts() else {
            return name.into();
        };
        let met = counts.beams.photons as f64 / counts.beams.queries.max(1) as f64;
        format!(
            "{name}, {met:.0} kernels a ray through media, {:.1} mm wide",
            1e3 * radius
        )
    }
}

impl Show for VolumePhotons {
    fn frame(&mut self, orbit: &mut Orbit, size: [u32; 2]) -> Result<Shown> {
        self.0.frame(orbit, size)
    }

    fn title(&mut self) -> String {
        format!("{}, {}", self.estimate(), self.0.title())
    }

    fn key(&mut self, key: &Key) {
        match key {
            Key::Character(text) if text.eq_ignore_ascii_case("e") => {
                let volume = self.next_estimate();
                self.0.set_settings(PhotonSettings {
                    volume,
                    ..self.0.settings().clone()
                });
            }
            other => self.0.key(other),
        }
    }

    fn end(&mut self) {
        println!("{}", self.estimate());
        self.0.end();
    }
}
