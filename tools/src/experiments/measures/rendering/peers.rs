//! What comparisons with other renderers share: pictures of turns, their errors and times, and LuxCore in a process of its own.

use std::path::Path;
use std::process::Command;

use clerestory::film::picture;
use clerestory::input::read_file;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result};

use crate::agreement::spread;
use crate::experiments::findings::{Measured, Repeats};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;
use crate::experiments::measures::pictures::mean_of;
use crate::python;
use crate::timing::{median, timed};

/// LuxCore's scripts, by the names under which they lie beside each other; the first is used by the second.
pub(super) const LUXCORE_SCRIPTS: [(&str, &str); 2] = [
    ("photons.py", include_str!("../../../../mitsuba/photons.py")),
    (LUXCORE_SCRIPT, include_str!("../../../../mitsuba/bidirectional.py")),
];
const LUXCORE_SCRIPT: &str = "bidirectional.py";
const NEEDED: &str = "pyluxcore; see tools/mitsuba/README.md";
/// Bytes of a turn's pictures at most.
pub(super) const FILE_MAX: u64 = 1 << 28;
/// Standard errors to each side of an interval.
const MARGIN: f64 = 2.0;

/// Pictures of a turn, with the seconds of each.
pub(super) type Turn = Vec<(Vec<f32>, f64)>;

/// Milliseconds of a picture's passes, by name.
pub(super) type PassTimes = Vec<(String, f64)>;

/// One renderer's turns.
#[derive(Clone)]
pub(super) struct Contender {
    pub(super) seconds: Repeats,
    pub(super) error: Measured,
    /// Relative standard error of the time to an error.
    uncertainty: f64,
    pub(super) mean: f64,
    /// Standard error of the mean.
    mean_error: f64,
}

impl Contender {
    /// None where there are too few pictures.
    pub(super) fn of(turns: Vec<Turn>) -> Option<Self> {
        let of_turn = |turn: &Turn| median(turn.iter().map(|(_, seconds)| *seconds).collect());
        let seconds: Repeats = turns.iter().filter(|turn| !turn.is_empty()).map(of_turn).collect();
        let pictures: Vec<Vec<f32>> = turns.into_iter().flatten().map(|(picture, _)| picture).collect();
        let count = pictures.len() as f32;
        let values = pictures.first()?.len();
        let mean: Vec<f32> = (0..values)
            .map(|i| pictures.iter().map(|one| one[i]).sum::<f32>() / count)
            .collect();
        let found = spread::measure(&pictures, &mean)?;
        let middle = median(seconds.0.clone());
        let deviation = seconds.0.iter().map(|s| (s / middle - 1.0).powi(2)).sum::<f64>();
        let means: Vec<f64> = pictures.iter().map(|one| mean_of(one)).collect();
        let [of_all, mean_error] = mean_with_error(&means);
        let of_seconds = (deviation / (seconds.0.len() as f64 - 1.0).max(1.0) / seconds.0.len() as f64).sqrt();
        Some(Self {
            mean: of_all,
            mean_error,
            error: Measured::within(found.relative_mse, MARGIN * found.standard_error),
            uncertainty: (found.standard_error / found.relative_mse).hypot(of_seconds),
            seconds,
        })
    }

    /// Seconds to a relative MSE of 1, as that falls with one over time.
    fn cost(&self) -> f64 {
        median(self.seconds.0.clone()) * self.error.value
    }

    /// Another one's time to equal error over this one's.
    pub(super) fn time_of(&self, other: &Self) -> Measured {
        let ratio = other.cost() / self.cost();
        Measured::within(ratio, MARGIN * ratio * self.uncertainty.hypot(other.uncertainty))
    }

    /// The mean over another one's.
    pub(super) fn brightness_over(&self, other: &Self) -> Measured {
        let ratio = self.mean / other.mean;
        let error = (self.mean_error / self.mean).hypot(other.mean_error / other.mean);
        Measured::within(ratio, MARGIN * ratio * error)
    }
}

/// So many pictures of ours, with seeds from that of the options on, and the passes of the last one.
pub(super) fn our_turn(renderer: &Renderer, options: &RenderOptions, pictures: u32) -> Result<(Turn, PassTimes)> {
    let (mut turn, mut passes) = (Turn::new(), PassTimes::new());
    for place in 0..pictures {
        let options = RenderOptions {
            seed: options.seed + place,
            ..options.clone()
        };
        let (rendered, seconds) = timed(|| renderer.render(&options));
        let rendered = rendered?;
        passes = rendered
            .report
            .passes
            .iter()
            .filter_map(|pass| Some((pass.name.clone(), pass.gpu_ms?)))
            .collect();
        let radiance = rendered.picture.require(picture::RADIANCE)?.values().to_vec();
        turn.push((radiance, seconds));
    }
    Ok((turn, passes))
}

/// Pictures of so many pixels a side from a file of 32-bit floats.
pub(super) fn pictures_of(file: &Path, side: u32) -> Result<Vec<Vec<f32>>> {
    let bytes = read_file(file, FILE_MAX)?;
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word))
        .collect();
    let pictures = values.chunks_exact(3 * (side * side) as usize);
    Ok(pictures.map(<[f32]>::to_vec).collect())
}

/// What LuxCore is asked for.
pub(super) struct Asked<'a> {
    pub(super) python: &'a Path,
    /// `BIDIRCPU` or `PATHCPU`.
    pub(super) engine: &'a str,
    /// The exported scene; the pictures lie beside it.
    pub(super) scene: &'a Path,
    pub(super) side: u32,
    /// Samples of a pixel.
    pub(super) samples: u32,
    /// Of a turn.
    pub(super) pictures: u32,
    /// Further arguments of the script.
    pub(super) further: &'a [&'a str],
}

/// What the script prints.
#[derive(serde::Deserialize)]
struct Answer {
    version: String,
    seconds: Vec<f64>,
}

/// A turn of LuxCore's, and its version.
pub(super) fn luxcore_turn(context: &Context<'_>, asked: &Asked<'_>, seed: u32) -> Result<(Turn, String)> {
    let file = asked.scene.with_file_name("luxcore.f32");
    let mut command = Command::new(asked.python);
    command
        .arg(context.folder.join(LUXCORE_SCRIPT))
        .args([asked.scene.as_os_str(), file.as_os_str()])
        .args(["--size", &asked.side.to_string()])
        .args(["--samples", &asked.samples.to_string()])
        .args(["--pictures", &asked.pictures.to_string()])
        .args(["--engine", asked.engine])
        .args(asked.further)
        // Seeds of engines are above 0.
        .args(["--seed", &(seed + 1).to_string()]);
    let Some(text) = python::run(asked.python, &mut command, NEEDED, context.watch)? else {
        return Ok((Turn::new(), String::new()));
    };
    let answer: Answer =
        serde_json::from_str(&text).map_err(|cause| Error::setting("luxcore", text, cause.to_string()))?;
    let pictures = pictures_of(&file, asked.side)?;
    Ok((pictures.into_iter().zip(answer.seconds).collect(), answer.version))
}
