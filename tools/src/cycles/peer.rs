//! Cycles in a process of its own, through `tools/cycles/reference.py`, which is part of this program.

use std::path::{Path, PathBuf};
use std::process::Command;

use clerestory::atomic;
use clerestory::{Error, Result};

use crate::experiments::watch::{Unwatched, Watch};
use crate::python;

/// The environment variable that names the Python.
pub const PYTHON_VARIABLE: &str = "CLERESTORY_CYCLES_PYTHON";

/// The script that renders with Cycles.
const SCRIPT: &str = include_str!("../../cycles/reference.py");
const SCRIPT_NAME: &str = "reference.py";
/// Prints the version; fails where there is no Blender.
const PROBE: &str = "import bpy, numpy; print(bpy.app.version_string)";
/// What a failure says is wanted.
const NEEDED: &str = "Blender's module bpy; see tools/cycles/README.md";

/// Forms of rough surfaces, by their names there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distribution {
    /// One scattering.
    Ggx,
    /// All orders of scattering.
    MultiGgx,
}

impl Distribution {
    /// As Cycles calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ggx => "GGX",
            Self::MultiGgx => "MULTI_GGX",
        }
    }
}

/// What to render.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The exporter's file.
    pub scene: &'a Path,
    /// Of the files that come of it, without their ending.
    pub prefix: &'a Path,
    /// How rough surfaces scatter.
    pub distribution: Distribution,
    /// Independent pictures.
    pub passes: u32,
    /// Samples per pixel in each.
    pub samples: u32,
    /// Of the first pass; the others count on from it.
    pub seed: u32,
}

/// What a run of it gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// RGB values, means of the passes.
    pub radiance: Vec<f32>,
    /// Variance of each mean.
    pub variance: Vec<f32>,
}

/// The part of the script's report that is needed here.
#[derive(Debug, serde::Deserialize)]
struct Answer {
    width: usize,
    height: usize,
    non_finite_values: u64,
}

impl Answer {
    /// The pictures in the raw file.
    fn pictures(&self, bytes: &[u8]) -> Result<Rendered, String> {
        if self.non_finite_values > 0 {
            return Err(format!("{} values are not finite", self.non_finite_values));
        }
        let values = self.width * self.height * 3;
        let wanted = 2 * values * size_of::<f32>();
        if values == 0 || bytes.len() != wanted {
            return Err(format!("{} bytes in place of {wanted}", bytes.len()));
        }
        let (words, _) = bytes.as_chunks();
        let all: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
        let (radiance, variance) = all.split_at(values);
        Ok(Rendered {
            radiance: radiance.to_vec(),
            variance: variance.to_vec(),
        })
    }
}

/// The version of Blender that a Python has.
///
/// # Errors
/// [`Error::Setting`] when it cannot be run or has no Blender.
pub fn cycles_version(python: &Path) -> Result<String> {
    let version = python::run(python, Command::new(python).args(["-c", PROBE]), NEEDED, &Unwatched)?;
    let version = version.unwrap_or_default();
    Ok(version.lines().last().unwrap_or("unknown").to_owned())
}

/// How to reach Cycles.
pub struct Peer {
    python: PathBuf,
    script: PathBuf,
}

impl Peer {
    /// By this Python; the script goes to `folder`, which is made if need be.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(python: &Path, folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|cause| Error::io(folder, cause))?;
        let script = folder.join(SCRIPT_NAME);
        atomic::write(&script, SCRIPT.as_bytes())?;
        Ok(Self {
            python: python.to_owned(),
            script,
        })
    }

    /// Renders and waits; `None` when `watch` says to stop before it ends.
    ///
    /// # Errors
    /// [`Error::Setting`] when it fails; [`Error::Picture`] for a picture with values that are not finite, or not whole; [`Error::Io`].
    pub fn render(&self, request: &Request<'_>, watch: &dyn Watch) -> Result<Option<Rendered>> {
        let mut command = Command::new(&self.python);
        command
            .arg(&self.script)
            .args([request.scene, request.prefix])
            .args(["--distribution", request.distribution.name()])
            .args(["--passes", &request.passes.to_string()])
            .args(["--spp", &request.samples.to_string()])
            .args(["--seed", &request.seed.to_string()]);
        if python::run(&self.python, &mut command, NEEDED, watch)?.is_none() {
            return Ok(None);
        }
        let file = |ending: &str| {
            // A name may hold a point, as roughnesses do.
            let mut path = request.prefix.as_os_str().to_owned();
            path.push(ending);
            PathBuf::from(path)
        };
        let (report, raw) = (file(".json"), file(".f32"));
        let read = |path: &Path| std::fs::read(path).map_err(|cause| Error::io(path, cause));
        let refused = |path: &Path, cause: String| Error::Picture {
            path: path.display().to_string(),
            cause,
        };
        let answer: Answer =
            serde_json::from_slice(&read(&report)?).map_err(|cause| refused(&report, cause.to_string()))?;
        let rendered = answer.pictures(&read(&raw)?);
        rendered.map(Some).map_err(|cause| refused(&raw, cause))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_come_before_variances_and_unsound_files_are_refused() {
        let answer = Answer {
            width: 2,
            height: 1,
            non_finite_values: 0,
        };
        let bytes: Vec<u8> = (0..12u8).flat_map(|i| f32::from(i).to_le_bytes()).collect();
        let rendered = answer.pictures(&bytes).unwrap();
        assert_eq!(rendered.radiance, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(rendered.variance[0], 6.0);
        assert!(
            answer
                .pictures(&bytes[4..])
                .unwrap_err()
                .contains("44 bytes in place of 48")
        );
        let broken = Answer {
            non_finite_values: 1,
            ..answer
        };
        assert!(broken.pictures(&bytes).unwrap_err().contains("not finite"));
    }

    #[test]
    fn distributions_have_the_names_that_the_script_takes() {
        for distribution in [Distribution::Ggx, Distribution::MultiGgx] {
            assert!(SCRIPT.contains(&format!("\"{}\"", distribution.name())));
        }
    }

    #[test]
    fn a_python_that_is_not_there_is_an_error() {
        let refused = cycles_version(Path::new("no/such/python")).unwrap_err().to_string();
        assert!(refused.contains("cannot be run"), "{refused}");
    }
}
