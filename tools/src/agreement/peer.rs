//! Mitsuba 3 in a process of its own, through `tools/mitsuba/reference.py`.

use std::path::{Path, PathBuf};
use std::process::Command;

use clerestory::{Error, Result};

use super::AgreementOptions;

/// Which of Mitsuba's variants renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variant {
    /// LLVM where there is one.
    Auto,
    Scalar,
    Llvm,
}

/// How to reach Mitsuba, and where its files go.
pub(super) struct Peer<'a> {
    options: &'a AgreementOptions,
    folder: &'a Path,
}

/// What a run of it gave.
pub(super) struct Rendered {
    pub(super) picture: PathBuf,
    /// Name and version.
    pub(super) renderer: String,
    pub(super) variant: String,
    /// Of each pass.
    pub(super) paths_per_second: Vec<f64>,
    pub(super) paths_per_cpu_second: f64,
}

/// The part of `reference.json` that is needed here.
#[derive(serde::Deserialize)]
struct Answer {
    renderer: String,
    variant: String,
    width: u32,
    height: u32,
    passes: u32,
    spp_per_pass: u32,
    seconds_each: Vec<f64>,
    cpu_seconds: f64,
    non_finite_values: u64,
}

impl<'a> Peer<'a> {
    pub(super) fn new(options: &'a AgreementOptions, folder: &'a Path) -> Self {
        Self { options, folder }
    }

    /// Renders and waits.
    pub(super) fn render(
        &self,
        scene: &Path,
        name: &str,
        variant: Variant,
        passes: u32,
        samples: u32,
    ) -> Result<Rendered> {
        let prefix = self.folder.join(name);
        let variant = match variant {
            Variant::Auto => "auto",
            Variant::Scalar => "scalar_rgb",
            Variant::Llvm => "llvm_ad_rgb",
        };
        let output = Command::new(&self.options.python)
            .arg(&self.options.script)
            .arg(scene)
            .arg(&prefix)
            .args(["--variant", variant])
            .args(["--passes", &passes.to_string(), "--spp", &samples.to_string()])
            .args(["--seed", &self.options.seed.to_string()])
            .output();
        let failed = |cause: String| Error::Setting {
            name: "python".into(),
            value: self.options.python.display().to_string(),
            cause,
        };
        let output = output.map_err(|cause| failed(format!("cannot be run: {cause}")))?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            let last = text.trim().lines().last().unwrap_or("no message").to_string();
            return Err(failed(format!(
                "did not render with Mitsuba 3 ({}): {last}; see tools/mitsuba/README.md",
                output.status
            )));
        }
        let path = prefix.with_extension("json");
        let text = std::fs::read_to_string(&path).map_err(|cause| Error::io(&path, cause))?;
        let wrong = |cause: String| Error::Picture {
            path: path.display().to_string(),
            cause,
        };
        let answer: Answer = serde_json::from_str(&text).map_err(|cause| wrong(cause.to_string()))?;
        if answer.non_finite_values > 0 {
            return Err(wrong(format!(
                "Mitsuba's picture has {} values that are not finite",
                answer.non_finite_values
            )));
        }
        let paths = f64::from(answer.width) * f64::from(answer.height) * f64::from(answer.spp_per_pass);
        Ok(Rendered {
            picture: prefix.with_extension("exr"),
            renderer: answer.renderer,
            variant: answer.variant,
            paths_per_second: answer.seconds_each.iter().map(|seconds| paths / seconds).collect(),
            paths_per_cpu_second: paths * f64::from(answer.passes) / answer.cpu_seconds,
        })
    }
}
