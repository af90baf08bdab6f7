//! Mitsuba 3 in a process of its own, through `tools/mitsuba/reference.py`, which is part of this program.

use std::path::{Path, PathBuf};
use std::process::Command;

use clerestory::atomic;
use clerestory::scene::{Medium, Scene};
use clerestory::{Error, Result};

use super::{AgreementOptions, Fault};
use crate::experiments::watch::{Unwatched, Watch};
use crate::python;

/// The script that renders with Mitsuba.
const SCRIPT: &str = include_str!("../../mitsuba/reference.py");
const SCRIPT_NAME: &str = "reference.py";
/// Prints the version; fails where there is no Mitsuba.
const PROBE: &str = "import mitsuba, numpy; print(mitsuba.__version__)";

/// What a failure says is wanted.
const NEEDED: &str = "Mitsuba 3; see tools/mitsuba/README.md";

/// Which of Mitsuba's variants renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variant {
    /// LLVM where there is one.
    Auto,
    Scalar,
    Llvm,
}

impl Variant {
    /// As Mitsuba calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Scalar => "scalar_rgb",
            Self::Llvm => "llvm_ad_rgb",
        }
    }
}

/// How Mitsuba walks, and whether Russian roulette ends its paths.
///
/// `volpathmis` weighs each path to a light by the densities of both ways to find it, and counts the roulette's chance in one of them only: with
/// survival q and densities u and n the two parts sum to q·u / (q·u + n) + n / (u + n) < 1. That is a bias of up to 1 % for light that needs many
/// bounces (a white furnace around a cloud of albedo 1 shows it); without roulette there is none, and `volpath` has none. But `volpath`
/// follows one band at a time, so that media whose extinction has a colour are noisy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Integrator {
    /// Surfaces alone.
    Path,
    Volpath,
    VolpathMis,
    VolpathMisWithoutRoulette,
}

impl Integrator {
    /// As Mitsuba calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Volpath => "volpath",
            Self::VolpathMis | Self::VolpathMisWithoutRoulette => "volpathmis",
        }
    }

    /// Path length in edges from which on roulette may end a path.
    fn roulette_depth(self) -> u32 {
        match self {
            // No path is as long.
            Self::VolpathMisWithoutRoulette => 1_000_000_000,
            _ => super::ROULETTE_START,
        }
    }

    /// The one without bias for converged pictures.
    pub(super) fn of_reference(scene: &Scene) -> Self {
        match ExtinctionKind::of(scene) {
            ExtinctionKind::Surfaces => Self::Path,
            ExtinctionKind::Grey => Self::Volpath,
            ExtinctionKind::Coloured => Self::VolpathMisWithoutRoulette,
        }
    }

    /// Those that race, each with its samplers.
    pub(super) fn contenders(scene: &Scene) -> &'static [(Self, &'static str)] {
        const SAMPLERS: [&str; 2] = ["independent", "multijitter"];
        match ExtinctionKind::of(scene) {
            ExtinctionKind::Surfaces => &[(Self::Path, SAMPLERS[0]), (Self::Path, SAMPLERS[1])],
            ExtinctionKind::Grey => &[
                (Self::Volpath, SAMPLERS[0]),
                (Self::Volpath, SAMPLERS[1]),
                (Self::VolpathMis, SAMPLERS[1]),
            ],
            ExtinctionKind::Coloured => &[
                (Self::VolpathMis, SAMPLERS[0]),
                (Self::VolpathMis, SAMPLERS[1]),
                (Self::Volpath, SAMPLERS[1]),
            ],
        }
    }
}

/// What paths meet in a scene: whether media, and with what extinction.
enum ExtinctionKind {
    Surfaces,
    /// Media whose bands have one extinction.
    Grey,
    Coloured,
}

impl ExtinctionKind {
    fn of(scene: &Scene) -> Self {
        // Extinction is a sum of two coefficients, rounded band by band.
        const ROUNDING: f32 = 1e-6;
        let is_grey = |medium: &Medium| {
            let extinction = medium.sigma_t();
            extinction.max_element() - extinction.min_element() <= ROUNDING * extinction.max_element()
        };
        match scene.media.as_slice() {
            [] => Self::Surfaces,
            media if media.iter().all(is_grey) => Self::Grey,
            _ => Self::Coloured,
        }
    }
}

/// What to render.
pub(super) struct Request<'a> {
    pub(super) scene: &'a Path,
    /// Of the files that come of it.
    pub(super) name: &'a str,
    pub(super) variant: Variant,
    pub(super) sampler: &'a str,
    pub(super) integrator: Integrator,
    /// Independent pictures.
    pub(super) passes: u32,
    /// Samples per pixel in each.
    pub(super) samples: u32,
    /// Of the first pass; the others count on from it, and so does one more pass that is not counted.
    pub(super) seed: u32,
    /// Whether to return the passes.
    pub(super) each: bool,
}

/// How to reach Mitsuba, and where its files go.
pub(super) struct Peer<'a> {
    python: &'a Path,
    folder: &'a Path,
    script: PathBuf,
}

/// What a run of it gave.
pub(super) struct Rendered {
    /// Mean of the passes with its variance.
    pub(super) picture: PathBuf,
    pub(super) variant: String,
    /// Of each pass.
    pub(super) seconds_each: Vec<f64>,
    /// Processor seconds per pass, mean.
    pub(super) cpu_seconds_each: f64,
    /// RGB values of each pass, where they were asked for.
    pub(super) pictures: Vec<Vec<f32>>,
}

/// The part of `reference.json` that is needed here.
#[derive(Debug, serde::Deserialize)]
struct Answer {
    variant: String,
    width: usize,
    height: usize,
    passes: usize,
    seconds_each: Vec<f64>,
    cpu_seconds: f64,
    non_finite_values: u64,
}

impl Answer {
    /// Reads and checks it.
    fn parse(text: &str) -> Result<Self, String> {
        let answer: Self = serde_json::from_str(text).map_err(|cause| cause.to_string())?;
        if answer.passes == 0 || answer.seconds_each.len() != answer.passes {
            return Err(format!(
                "{} times for {} passes",
                answer.seconds_each.len(),
                answer.passes
            ));
        }
        Ok(answer)
    }

    /// The passes in the raw file.
    fn pictures(&self, bytes: &[u8]) -> Result<Vec<Vec<f32>>, String> {
        let values = self.width * self.height * 3;
        let wanted = self.passes * values * size_of::<f32>();
        if values == 0 || bytes.len() != wanted {
            return Err(format!("{} bytes in place of {wanted}", bytes.len()));
        }
        let (words, _) = bytes.as_chunks();
        let all: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
        Ok(all.chunks(values).map(<[f32]>::to_vec).collect())
    }
}

/// Runs Python and returns what it printed; [`Fault::Stopped`] when `watch` says to stop before it ends, which ends it.
fn run(python: &Path, command: &mut Command, watch: &dyn Watch) -> Result<String, Fault> {
    python::run(python, command, NEEDED, watch)?.ok_or(Fault::Stopped)
}

/// The version of Mitsuba that a Python has.
///
/// # Errors
/// [`Error::Setting`] when it cannot be run or has no Mitsuba.
pub fn mitsuba_version(python: &Path) -> Result<String> {
    let version = run(python, Command::new(python).args(["-c", PROBE]), &Unwatched);
    version.map_err(|fault| fault.into_error("python"))
}

impl<'a> Peer<'a> {
    /// Files go to `folder`, the script beside it.
    pub(super) fn new(options: &'a AgreementOptions, folder: &'a Path) -> Result<Self> {
        std::fs::create_dir_all(&options.output).map_err(|cause| Error::io(&options.output, cause))?;
        let script = options.output.join(SCRIPT_NAME);
        atomic::write(&script, SCRIPT.as_bytes())?;
        Ok(Self {
            python: &options.python,
            folder,
            script,
        })
    }

    /// Renders and waits.
    pub(super) fn render(&self, request: &Request<'_>, watch: &dyn Watch) -> Result<Rendered, Fault> {
        let prefix = self.folder.join(request.name);
        let mut command = Command::new(self.python);
        command
            .arg(&self.script)
            .arg(request.scene)
            .arg(&prefix)
            .args(["--variant", request.variant.name(), "--sampler", request.sampler])
            .args(["--integrator", request.integrator.name()])
            .args(["--rr-depth", &request.integrator.roulette_depth().to_string()])
            .args(["--passes", &request.passes.to_string()])
            .args(["--spp", &request.samples.to_string()])
            .args(["--seed", &request.seed.to_string()])
            .args(request.each.then_some("--each"));
        run(self.python, &mut command, watch)?;
        let read = |suffix: &str| {
            let path = prefix.with_extension(suffix);
            let bytes = std::fs::read(&path).map_err(|cause| Error::io(&path, cause))?;
            Ok::<_, Error>((bytes, path.display().to_string()))
        };
        let (bytes, path) = read("json")?;
        let answer = Answer::parse(&String::from_utf8_lossy(&bytes)).map_err(|cause| Error::Picture { path, cause })?;
        if answer.non_finite_values > 0 {
            return Err(Fault::NotFinite(format!(
                "Mitsuba's picture by {} {} with {} samples has {} values that are not finite",
                answer.variant,
                request.integrator.name(),
                request.sampler,
                answer.non_finite_values
            )));
        }
        let mut pictures = Vec::new();
        if request.each {
            let (bytes, path) = read("f32")?;
            pictures = answer
                .pictures(&bytes)
                .map_err(|cause| Error::Picture { path, cause })?;
        }
        Ok(Rendered {
            picture: prefix.with_extension("exr"),
            cpu_seconds_each: answer.cpu_seconds / answer.passes as f64,
            variant: answer.variant,
            seconds_each: answer.seconds_each,
            pictures,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(passes: usize, non_finite: u64) -> String {
        format!(
            "{{\"renderer\": \"mitsuba 3\", \"variant\": \"scalar_rgb\", \"width\": 2, \"height\": 1, \"passes\": {passes}, \
             \"seconds_each\": [0.5, 0.25], \"cpu_seconds\": 1.5, \"non_finite_values\": {non_finite}, \"spp\": 4}}"
        )
    }

    #[test]
    fn references_are_walked_without_bias() {
        let integrator = |colour| {
            let mut scene = Scene::default();
            scene.media.extend(colour);
            Integrator::of_reference(&scene)
        };
        let medium = |sigma_s: [f32; 3], sigma_a: [f32; 3]| Medium {
            sigma_s: sigma_s.into(),
            sigma_a: sigma_a.into(),
            ..Medium::default()
        };
        assert_eq!(integrator(None), Integrator::Path);
        // One extinction by rounded sums.
        let grey = medium([0.9, 0.88, 0.85], [0.1, 0.12, 0.15]);
        assert_eq!(integrator(Some(grey)), Integrator::Volpath);
        let coloured = integrator(Some(medium([1.0, 2.0, 3.0], [0.0; 3])));
        assert_eq!(coloured, Integrator::VolpathMisWithoutRoulette);
        assert!(coloured.roulette_depth() > Integrator::VolpathMis.roulette_depth());
    }

    #[test]
    fn answers_are_read_and_unsound_ones_refused() {
        let answer = Answer::parse(&text(2, 0)).unwrap();
        assert_eq!(
            (answer.width, answer.seconds_each.len(), answer.cpu_seconds),
            (2, 2, 1.5)
        );
        assert!(Answer::parse(&text(3, 0)).unwrap_err().contains("2 times for 3 passes"));
        assert_eq!(Answer::parse(&text(2, 7)).unwrap().non_finite_values, 7);
        assert!(Answer::parse("{}").unwrap_err().contains("variant"));
    }

    #[test]
    fn raw_passes_are_split_in_order() {
        let answer = Answer::parse(&text(2, 0)).unwrap();
        let bytes: Vec<u8> = (0..12u8).flat_map(|i| f32::from(i).to_le_bytes()).collect();
        let pictures = answer.pictures(&bytes).unwrap();
        assert_eq!(
            pictures,
            [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]]
        );
        assert!(
            answer
                .pictures(&bytes[1..])
                .unwrap_err()
                .contains("47 bytes in place of 48")
        );
    }

    #[test]
    fn a_python_that_is_not_there_is_an_error() {
        let refused = mitsuba_version(Path::new("no/such/python")).unwrap_err().to_string();
        assert!(refused.contains("cannot be run"), "{refused}");
    }
}
