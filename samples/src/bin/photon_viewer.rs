//! A window on a scene whose light moves, photon-mapped anew for every frame.
//!
//! `photon_viewer [SCENE] [--photons N] [--shape fixed|isotropic|principal|skewed] [--spread FOOTPRINTS] [--radius METRES] [--turn DEGREES]
//! [--flight METRES] [--camera NAME] [--exposure STOPS] [--size WxH] [--frames N] [--resize WxH] [--screenshot FILE]`
//!
//! Each frame the light goes around the middle of the scene by `--turn`, its photons are traced and their map is built, and rays from the eye
//! find direct light, specular chains and, in the map, everything else. Space holds the light, and the picture converges. `--flight` moves
//! the camera to its right each frame as far as that, and turns it by 2.5 degrees per metre. Photons, shape, spread and radius are the settings
//! of these names of the technique `photon`. Otherwise as the viewer.
//!
//! Source of the program's form: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.3, with flights of 10 cm
//! and 0.25 degrees per frame (appendix A).

use std::process::ExitCode;

use clerestory::Result;
use clerestory::settings::TypedSettings;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory_samples::arguments::Arguments;
use clerestory_samples::live_photons::{LivePhotons, Motion};
use clerestory_samples::window;

/// Photons per frame, unless told otherwise.
const PHOTONS: u32 = 1 << 15;
/// Size of kernels in footprints, unless told otherwise: less than finished pictures want, for the sake of speed.
const SPREAD: f32 = 8.0;
/// Degrees that the light goes around each frame, unless told otherwise.
const TURN: f64 = 3.0;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let own = ["--photons", "--shape", "--spread", "--radius", "--turn", "--flight"];
    let given = Arguments::of_process(&[&own[..], &window::Options::NAMES].concat(), 1)?;
    let settings = PhotonSettings::from_json(&serde_json::json!({
        "photons": given.value("--photons")?.unwrap_or(PHOTONS),
        "shape": given.text("--shape").unwrap_or("skewed"),
        "spread": given.value("--spread")?.unwrap_or(SPREAD),
        "radius": given.value("--radius")?.unwrap_or(0.0f32),
    }))?;
    let motion = Motion {
        turn: given.value("--turn")?.unwrap_or(TURN).to_radians(),
        flight: given.value("--flight")?.unwrap_or(0.0),
    };
    window::show(window::Options::of(&given, "builtin:ring")?, |canvas| {
        LivePhotons::new(canvas, settings, motion)
    })
}
