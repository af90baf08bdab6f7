//! What a comparison found, as JSON and as a page of Markdown.

use std::fmt::Write;
use std::path::Path;

use clerestory::film::{ZTest, atomic};
use clerestory::gpu::Caps;
use clerestory::{Error, Result};

use super::AgreementOptions;
use crate::machine;

/// What everything ran on.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Machine {
    /// Processor as the system names it.
    pub processor: String,
    /// Threads of the processor.
    pub threads: usize,
    /// Vulkan device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Mitsuba's name and version.
    pub mitsuba: String,
}

impl Machine {
    pub(super) fn read(caps: &Caps, mitsuba: &str) -> Self {
        Self {
            processor: machine::processor(),
            threads: machine::threads(),
            device: caps.device.clone(),
            driver: caps.driver.clone(),
            mitsuba: mitsuba.into(),
        }
    }
}

/// Camera paths a second, medians; `None` where nothing was measured. `…_cpu` are a processor second of all threads, which a busy machine changes less.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Speed {
    /// This engine.
    pub ours: Option<f64>,
    /// Mitsuba's `scalar_rgb`.
    pub scalar: Option<f64>,
    /// Mitsuba's `llvm_ad_rgb`.
    pub llvm: Option<f64>,
    /// This engine, a processor second.
    pub ours_cpu: Option<f64>,
    /// `scalar_rgb`, a processor second.
    pub scalar_cpu: Option<f64>,
    /// `llvm_ad_rgb`, a processor second.
    pub llvm_cpu: Option<f64>,
}

/// One scene's comparison.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SceneAgreement {
    /// Its name.
    pub name: String,
    /// What it puts to the test.
    pub shows: String,
    /// Triangles as exported.
    pub triangles: u64,
    /// Mitsuba's variant that rendered the reference.
    pub variant: String,
    /// z-test of every value.
    pub values: ZTest,
    /// z-test of the means of blocks of 8 × 8 pixels.
    pub blocks: ZTest,
    /// Mean of z² over the values that have noise; 1 is expected.
    pub mean_squared_z: f64,
    /// The same of the blocks' means: above 1 also where the noise of neighbouring pixels is correlated.
    pub mean_squared_z_blocks: f64,
    /// Relative MSE, all of it noise when the pictures agree.
    pub relative_mse: f64,
    /// Σ(ours − Mitsuba's) / Σ Mitsuba's.
    pub relative_bias: f64,
    /// Samples of ours that were left out because they were not finite.
    pub non_finite: u64,
    /// Both renderers' speed.
    pub speed: Option<Speed>,
}

impl SceneAgreement {
    /// Whether enough single values were accepted.
    pub fn passes(&self) -> bool {
        self.values.passes() && self.non_finite == 0
    }

    /// Whether a finer look gives cause for another one: a block was rejected, which happens by chance in one picture of a hundred, or the whole picture's
    /// bias stands out.
    pub fn is_suspicious(&self) -> bool {
        self.blocks.accepted < self.blocks.tests || self.values.bias_z.abs() > BIAS_Z_MAX
    }

    fn verdict(&self) -> &'static str {
        match (self.passes(), self.is_suspicious()) {
            (true, false) => "agrees",
            (true, true) => "agrees, look again",
            (false, _) => "**differs**",
        }
    }
}

/// |z| of a whole picture's bias that chance reaches once in about 100 pictures when the three channels of a pixel vary as one: √3 · 2.58.
const BIAS_Z_MAX: f64 = 4.5;

impl std::fmt::Display for SceneAgreement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "  {}: {:.3} % of values, {:.2} % of blocks accepted; worst z {:.2}, of blocks {:.2}; mean z² {:.3}; bias {:+.4} % (z {:.2})",
            self.verdict(),
            self.values.accepted_fraction * 100.0,
            self.blocks.accepted_fraction * 100.0,
            self.values.worst_z,
            self.blocks.worst_z,
            self.mean_squared_z,
            self.relative_bias * 100.0,
            self.values.bias_z,
        )
    }
}

/// All comparisons of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct AgreementReport {
    /// What it ran on.
    pub machine: Machine,
    /// What was asked for.
    pub options: AgreementOptions,
    /// One entry a scene.
    pub scenes: Vec<SceneAgreement>,
}

impl AgreementReport {
    /// Whether every scene agrees.
    pub fn passes(&self) -> bool {
        self.scenes.iter().all(SceneAgreement::passes)
    }

    /// Writes `prefix.json` and `prefix.md`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, prefix: &Path) -> Result<()> {
        let json = serde_json::to_string_pretty(self).map_err(|cause| Error::Picture {
            path: prefix.display().to_string(),
            cause: cause.to_string(),
        })?;
        for (suffix, text) in [("json", json + "\n"), ("md", self.to_markdown())] {
            let path = prefix.with_extension(suffix);
            atomic::write(&path, text.as_bytes())?;
        }
        Ok(())
    }

    /// The speed beside Mitsuba's with the errors of the same scenes, as a part of a page of results.
    pub fn to_results_block(&self) -> String {
        let (m, o) = (&self.machine, &self.options);
        let agreeing = self.scenes.iter().filter(|scene| scene.passes()).count();
        let mut text = format!(
            "- Device: {}; driver: {}. Machine: {}, {} threads. Reference: {}, both of its variants in the same run.\n",
            m.device, m.driver, m.processor, m.threads, m.mitsuba
        );
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "- {agreeing} of {} scenes agree with Mitsuba in a z-test of every value: {1} × {1} pixels, {2} samples a pixel on both sides. Relative \
             MSE and bias are between these pictures.",
            self.scenes.len(),
            o.size,
            o.passes * o.samples_per_pass
        );
        let _ = writeln!(
            text,
            "- Speed: millions of camera paths a second of wall clock, {0} × {0} pixels × {1} samples, medians of {2} rounds in which the \
             renderers take turns. Ratios are ours over theirs, above 1 this engine is faster; in brackets a processor second, which other \
             work on the machine changes less.\n\n\
             | scene | relative MSE | bias | | ours | `scalar_rgb` | `llvm_ad_rgb` | ratio to scalar | ratio to LLVM |\n\
             |---|---:|---:|---|---:|---:|---:|---:|---:|",
            o.timing_size, o.timing_samples, o.timing_rounds
        );
        for s in &self.scenes {
            let Some(v) = &s.speed else { continue };
            let _ = writeln!(
                text,
                "| {} | {:.2e} | {:+.3} % | {} | {} | {} | {} | {} ({}) | {} ({}) |",
                s.name,
                s.relative_mse,
                s.relative_bias * 100.0,
                s.verdict(),
                millions(v.ours),
                millions(v.scalar),
                millions(v.llvm),
                ratio(v.ours, v.scalar),
                ratio(v.ours_cpu, v.scalar_cpu),
                ratio(v.ours, v.llvm),
                ratio(v.ours_cpu, v.llvm_cpu),
            );
        }
        text
    }

    /// The report as a page.
    pub fn to_markdown(&self) -> String {
        let mut page = String::from("# Agreement with Mitsuba 3\n\n");
        let (m, o) = (&self.machine, &self.options);
        let agreeing = self.scenes.iter().filter(|scene| scene.passes()).count();
        let _ = writeln!(page, "{agreeing} of {} scenes agree.\n", self.scenes.len());
        let _ = writeln!(
            page,
            "- Processor: {}, {} threads. Device: {}, {}. Reference: {}.",
            m.processor, m.threads, m.device, m.driver, m.mitsuba
        );
        let _ = writeln!(
            page,
            "- Pictures of {0} × {0} pixels, {1} samples a pixel on both sides, Mitsuba's in {2} independent passes; independent (PCG) samples, single \
             scattering and separable masking here.",
            o.size,
            o.passes * o.samples_per_pass,
            o.passes,
        );
        if let Some(first) = self.scenes.first() {
            let _ = writeln!(
                page,
                "- z-test of every value (pixel × channel), α = {} for the whole picture with Šidák's correction: a value is accepted with p ≥ {:.2e}. A picture \
                 agrees when at least 99.75 % of its values are accepted. The means of its blocks of 8 × 8 pixels are tested alike (p ≥ {:.2e}): they \
                 show eight times smaller differences, and one picture in 100 has a rejected block by chance.",
                first.values.alpha, first.values.threshold, first.blocks.threshold
            );
        }
        page.push_str(
            "- mean z² is 1 for pictures that differ by noise alone. Bias is that of the whole picture, with its z; values of one pixel are \
             not independent, so |z| up to about 4.5 is no evidence.\n\n## Agreement\n\n\
             | scene | what it tests | values accepted | worst z | blocks accepted | worst z | mean z² | of blocks | bias | bias z | relative MSE | |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        for s in &self.scenes {
            let _ = writeln!(
                page,
                "| {} | {} | {:.3} % | {:.2} | {:.2} % | {:.2} | {:.3} | {:.3} | {:+.3} % | {:.2} | {:.2e} | {} |",
                s.name,
                s.shows,
                s.values.accepted_fraction * 100.0,
                s.values.worst_z,
                s.blocks.accepted_fraction * 100.0,
                s.blocks.worst_z,
                s.mean_squared_z,
                s.mean_squared_z_blocks,
                s.relative_bias * 100.0,
                s.values.bias_z,
                s.relative_mse,
                s.verdict(),
            );
        }
        if self.scenes.iter().any(|s| s.speed.is_some()) {
            let _ = writeln!(
                page,
                "\n## Speed\n\nMillions of camera paths a second at {0} × {0} pixels × {1} samples, medians of {2} rounds in which the renderers take turns; in \
                 brackets a processor second of all threads, which other work on the machine changes less. Ratios are ours over theirs.\n\n\
                 | scene | ours | scalar_rgb | llvm_ad_rgb | ratio to scalar | ratio to LLVM |\n|---|---|---|---|---|---|",
                o.timing_size, o.timing_samples, o.timing_rounds
            );
            for s in &self.scenes {
                if let Some(v) = &s.speed {
                    let _ = writeln!(
                        page,
                        "| {} | {} ({}) | {} ({}) | {} ({}) | {} ({}) | {} ({}) |",
                        s.name,
                        millions(v.ours),
                        millions(v.ours_cpu),
                        millions(v.scalar),
                        millions(v.scalar_cpu),
                        millions(v.llvm),
                        millions(v.llvm_cpu),
                        ratio(v.ours, v.scalar),
                        ratio(v.ours_cpu, v.scalar_cpu),
                        ratio(v.ours, v.llvm),
                        ratio(v.ours_cpu, v.llvm_cpu),
                    );
                }
            }
        }
        page
    }
}

fn millions(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| format!("{:.3}", v * 1e-6))
}

fn ratio(ours: Option<f64>, theirs: Option<f64>) -> String {
    ours.zip(theirs)
        .map_or("–".into(), |(ours, theirs)| format!("{:.2}", ours / theirs))
}
