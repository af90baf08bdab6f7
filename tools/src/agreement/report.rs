//! What a comparison found, as JSON and as a page of Markdown.

use std::fmt::Write;
use std::path::Path;

use clerestory::film::ZTest;
use clerestory::film::z_test::{ACCEPTED_FRACTION, Verdict};
use clerestory::gpu::Gpu;
use clerestory::input::read_text;
use clerestory::techniques::path::Adaptive;
use clerestory::{Error, Result};

use super::chosen::Chosen;
use super::race::{Contender, EqualError, Race};
use super::{AgreementOptions, mitsuba_version};
use crate::machine;

/// Most bytes of an earlier report.
const MOST_BYTES: u64 = 1 << 28;

/// What everything ran on.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
    fn read(gpu: &Gpu, options: &AgreementOptions) -> Result<Self> {
        let caps = gpu.caps();
        Ok(Self {
            processor: machine::processor(),
            threads: machine::threads(),
            device: caps.device.clone(),
            driver: caps.driver.clone(),
            mitsuba: format!("mitsuba {}", mitsuba_version(&options.python)?),
        })
    }
}

/// One scene's comparison.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
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
    /// Both renderers' time to equal error; `None` where nothing was timed and where pictures have no noise.
    pub race: Option<Race>,
    /// What the planner chooses for the error of our best picture; `None` where nothing was raced and in reports of earlier versions.
    #[serde(default)]
    pub chosen: Option<Chosen>,
}

impl SceneAgreement {
    /// What the z-tests say: that of values and that of blocks, of which the worse one counts.
    fn tested(&self) -> Verdict {
        let both = [self.values.verdict, self.blocks.verdict];
        [Verdict::Different, Verdict::HeavyTails]
            .into_iter()
            .find(|verdict| both.contains(verdict))
            .unwrap_or(Verdict::Same)
    }

    /// Whether neither values nor blocks differ, and every sample is finite. What heavy tails leave undecided is no difference, as long as no more values
    /// are rejected than [`ACCEPTED_FRACTION`] allows, and no agreement either.
    pub fn passes(&self) -> bool {
        self.tested() != Verdict::Different && self.values.passes() && self.non_finite == 0
    }

    /// Whether the z-tests show that both agree.
    pub fn agrees(&self) -> bool {
        self.tested() == Verdict::Same && self.non_finite == 0
    }

    /// Whether a finer look gives cause for another one: a block was rejected, which happens by chance in one picture of a hundred, or the whole picture's
    /// bias stands out.
    pub fn is_suspicious(&self) -> bool {
        self.blocks.accepted < self.blocks.tests || self.values.bias_z.abs() > BIAS_Z_MAX
    }

    /// In words.
    pub fn verdict(&self) -> &'static str {
        match (self.passes(), self.agrees(), self.values.bias_z.abs() > BIAS_Z_MAX) {
            (true, true, false) => "agrees",
            (true, true, true) => "agrees, look again",
            (true, false, false) => "undecided: heavy tails",
            (true, false, true) => "undecided: heavy tails, look again",
            (false, ..) => "**differs**",
        }
    }
}

/// |z| of a whole picture's bias that chance reaches once in about 100 pictures when the three channels of a pixel vary as one: √3 · 2.58.
pub(crate) const BIAS_Z_MAX: f64 = 4.5;

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

/// A scene that could not be compared.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Uncompared {
    /// Its name.
    pub name: String,
    /// Why, in words.
    pub cause: String,
}

/// All comparisons of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AgreementReport {
    /// What it ran on.
    pub machine: Machine,
    /// What was asked for.
    pub options: AgreementOptions,
    /// One entry per scene.
    pub scenes: Vec<SceneAgreement>,
    /// The scenes of which Mitsuba made a picture that is not finite.
    #[serde(default)]
    pub uncompared: Vec<Uncompared>,
}

impl AgreementReport {
    /// A report without scenes, of this machine.
    ///
    /// # Errors
    /// [`Error::Setting`] where the options' Python cannot be run or has no Mitsuba.
    pub fn begin(gpu: &Gpu, options: &AgreementOptions) -> Result<Self> {
        Ok(Self {
            machine: Machine::read(gpu, options)?,
            options: options.clone(),
            scenes: Vec::new(),
            uncompared: Vec::new(),
        })
    }

    /// The scenes of the report at `prefix` (its files without their endings) that were compared on this machine with these options, whatever their
    /// selection; none where there is no such report.
    pub fn kept(prefix: &Path, machine: &Machine, options: &AgreementOptions) -> Vec<SceneAgreement> {
        let text = read_text(&prefix.with_extension("json"), MOST_BYTES).unwrap_or_default();
        let same = |report: &Self| {
            let of_all = |options: &AgreementOptions| {
                let scenes = Vec::new();
                serde_json::to_value(AgreementOptions {
                    scenes,
                    ..options.clone()
                })
            };
            let options = of_all(&report.options).ok().zip(of_all(options).ok());
            report.machine == *machine && options.is_some_and(|(theirs, ours)| theirs == ours)
        };
        let report = serde_json::from_str::<Self>(&text).ok().filter(same);
        report.map_or_else(Vec::new, |report| report.scenes)
    }

    /// How many scenes agree, of how many, and how many heavy tails leave undecided.
    fn counted(&self) -> String {
        let agreeing = self.scenes.iter().filter(|scene| scene.agrees()).count();
        let undecided = self
            .scenes
            .iter()
            .filter(|scene| scene.passes() && !scene.agrees())
            .count();
        let undecided = match undecided {
            0 => String::new(),
            count => format!(", and heavy tails leave {count} undecided"),
        };
        format!("{agreeing} of {} scenes agree{undecided}", self.scenes.len())
    }

    /// Whether every scene was compared and none differs.
    pub fn passes(&self) -> bool {
        self.uncompared.is_empty() && self.scenes.iter().all(SceneAgreement::passes)
    }

    /// The scenes that were not compared, in a sentence each.
    pub fn uncompared_lines(&self) -> Vec<String> {
        let line = |one: &Uncompared| format!("{} was not compared: {}.", one.name, one.cause);
        self.uncompared.iter().map(line).collect()
    }

    /// The report as JSON and as a page of Markdown.
    ///
    /// # Errors
    /// [`Error::Setting`] for what JSON cannot hold.
    pub fn texts(&self) -> Result<[String; 2]> {
        let json = serde_json::to_string_pretty(self)
            .map_err(|cause| Error::setting("report", "agreement", cause.to_string()))?;
        Ok([json + "\n", self.to_markdown()])
    }

    /// Agreement and time to equal error, one row per scene, as a part of a page of results.
    pub fn to_results_block(&self) -> String {
        let (m, o) = (&self.machine, &self.options);
        let mut text = format!(
            "- Device: {}; driver: {}. Machine: {}, {} threads. Reference: {}.\n",
            m.device, m.driver, m.processor, m.threads, m.mitsuba
        );
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "- {} with Mitsuba in z-tests of every value and of blocks: {1} × {1} pixels, {2} samples per pixel on both sides{3}; bias is between \
             these pictures.",
            self.counted(),
            o.size,
            o.passes * o.samples_per_pass,
            sharing(o.adaptive)
        );
        for line in self.uncompared_lines() {
            let _ = writeln!(text, "- {line}");
        }
        let _ = writeln!(text, "- {}", self.race_method());
        for line in self.race_summary() {
            let _ = writeln!(text, "- {line}");
        }
        text.push_str(
            "\n| scene | agrees? | bias | ours | M paths/s | relative MSE | Mitsuba's best | M paths/s | relative MSE | ratio to best | ratio to scalar |\n\
             |---|---|---:|---|---:|---:|---|---:|---:|---:|---:|\n",
        );
        for s in &self.scenes {
            let _ = write!(
                text,
                "| {} | {} | {:+.3} % |",
                s.name,
                s.verdict(),
                s.relative_bias * 100.0
            );
            match &s.race {
                None => text.push_str(" – | – | – | – | – | – | – | – |\n"),
                Some(race) => {
                    let [ours, theirs] = race.pair(&race.against_best);
                    let _ = writeln!(
                        text,
                        " {} | {} | {:.2e} | {} | {} | {:.2e} | {} | {} |",
                        ours.sampler,
                        millions(ours),
                        ours.relative_mse,
                        race.their_best(),
                        millions(theirs),
                        theirs.relative_mse,
                        ratio(&race.against_best),
                        ratio(&race.against_scalar),
                    );
                }
            }
        }
        text
    }

    /// The report as a page.
    pub fn to_markdown(&self) -> String {
        let mut page = String::from("# Agreement with Mitsuba 3\n\n");
        let (m, o) = (&self.machine, &self.options);
        let _ = writeln!(page, "{}.\n", self.counted());
        for line in self.uncompared_lines() {
            let _ = writeln!(page, "- {line}");
        }
        let _ = writeln!(
            page,
            "- Processor: {}, {} threads. Device: {}, {}. Reference: {}.",
            m.processor, m.threads, m.device, m.driver, m.mitsuba
        );
        let _ = writeln!(
            page,
            "- Pictures of {0} × {0} pixels, {1} samples per pixel on both sides{3}, Mitsuba's in {2} independent passes; independent (PCG) samples, \
             single scattering and separable masking here.",
            o.size,
            o.passes * o.samples_per_pass,
            o.passes,
            sharing(o.adaptive)
        );
        if let Some(first) = self.scenes.first() {
            let _ = writeln!(
                page,
                "- z-test of every value (pixel × channel), α = {} for the whole picture with Šidák's correction: a value is accepted with p ≥ {:.2e}. A picture \
                 agrees when all of its values are, and the mean of z² is that of normal numbers; of pictures that are right, each fails once in 100. It \
                 differs when more values are rejected than tails as heavy as its z² shows explain, or more than {:.2} %. In between heavy tails leave it \
                 undecided. The means of its blocks of 8 × 8 pixels are tested alike (p ≥ {:.2e}): they show eight times smaller differences, and the worse \
                 verdict counts.",
                first.values.alpha,
                first.values.threshold,
                100.0 * (1.0 - ACCEPTED_FRACTION),
                first.blocks.threshold
            );
        }
        let _ = writeln!(
            page,
            "- mean z² is 1 for pictures that differ by noise alone, and more where variances are under-estimated. Bias is that of the whole picture, with its z; values of one pixel are \
             not independent, so |z| up to about {BIAS_Z_MAX} is not evidence.\n\n## Agreement\n"
        );
        page.push_str(
            "| scene | what it tests | values accepted | worst z | blocks accepted | worst z | mean z² | of blocks | bias | bias z | relative MSE | |\n\
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
        if self.scenes.iter().any(|s| s.race.is_some()) {
            page.push_str("\n## Time to equal error\n\n");
            page.push_str(&self.race_method());
            page.push_str("\n\n");
            for line in self.race_summary() {
                let _ = writeln!(page, "- {line}");
            }
            self.write_races(&mut page);
        }
        page
    }

    /// Tables of all contenders, a row per scene: seconds to the error of our best, and what they come of.
    fn write_races(&self, page: &mut String) {
        let races = || self.scenes.iter().filter_map(|s| s.race.as_ref().map(|race| (s, race)));
        page.push_str(
            "\n| scene | relative MSE to reach | our seconds | Mitsuba's best | its seconds | ratio to best | ratio to scalar |\n\
             |---|---:|---:|---|---:|---:|---:|\n",

        );
        for (s, race) in races() {
            let best = &race.against_best;
            let _ = writeln!(
                page,
                "| {} | {:.2e} | {:.3} | {} | {:.3} | {} | {} |",
                s.name,
                best.error,
                best.our_seconds,
                race.their_best(),
                best.their_seconds,
                ratio(best),
                ratio(&race.against_scalar),
            );
        }
        // Media have other integrators; a table for each list of contenders keeps columns full.
        let names = |race: &Race| race.contenders.iter().map(Contender::name).collect::<Vec<_>>();
        let mut lists: Vec<Vec<String>> = Vec::new();
        for (_, race) in races() {
            let list = names(race);
            if !lists.contains(&list) {
                lists.push(list);
            }
        }
        type Shown = fn(&Contender, f64) -> String;
        let tables: [(&str, Shown); 3] = [
            (
                "Seconds to the relative MSE to reach, in brackets processor seconds",
                |one, error| {
                    let cpu = one.cpu_seconds_to(error).map_or("–".into(), |cpu| format!("{cpu:.3}"));
                    format!("{:.3} ({cpu})", one.seconds_to(error))
                },
            ),
            ("Relative MSE of one picture with its standard error", |one, _| {
                format!("{:.2e} ± {:.0e}", one.relative_mse, one.relative_mse_error)
            }),
            ("Millions of camera paths per second", |one, _| millions(one)),
        ];
        for (title, shown) in tables {
            let _ = write!(page, "\n{title}:\n");
            for list in &lists {
                let _ = writeln!(page, "\n| scene | {} |", list.join(" | "));
                let _ = writeln!(page, "|---|{}", "---:|".repeat(list.len()));
                for (s, race) in races().filter(|(_, race)| names(race) == *list) {
                    let error = race.against_best.error;
                    let cells: Vec<String> = race.contenders.iter().map(|one| shown(one, error)).collect();
                    let _ = writeln!(page, "| {} | {} |", s.name, cells.join(" | "));
                }
            }
        }
    }
}

/// Millions of camera paths per second.
fn millions(one: &Contender) -> String {
    format!("{:.3}", one.paths_per_second * 1e-6)
}

fn ratio(of: &EqualError) -> String {
    let cpu = of.cpu_ratio.map_or("–".into(), |cpu| format!("{cpu:.2}"));
    format!("{:.2} ± {:.2} ({cpu})", of.ratio, of.ratio_error)
}

/// How this engine shares its samples out, where not evenly.
fn sharing(adaptive: Adaptive) -> &'static str {
    match adaptive {
        Adaptive::Off => "",
        Adaptive::Relative => ", this engine's shared out by relative noise",
        Adaptive::Absolute => ", this engine's shared out by absolute noise",
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use clerestory::film::z_test;

    use super::super::race::tests::made_up_race;
    use super::*;

    /// Two scenes that nobody has rendered, one without times.
    pub(crate) fn made_up() -> AgreementReport {
        let values = z_test(&[1.0], &[1.0], &[1.0], &[1.0], 0.01).unwrap();
        let scene = |name: &str, race| SceneAgreement {
            name: name.into(),
            shows: "nothing".into(),
            triangles: 12,
            variant: "llvm_ad_rgb".into(),
            values: values.clone(),
            blocks: values.clone(),
            mean_squared_z: 1.0,
            mean_squared_z_blocks: 1.0,
            relative_mse: 1e-3,
            relative_bias: -0.001,
            non_finite: 0,
            race,
            chosen: None,
        };
        AgreementReport {
            machine: Machine {
                processor: "none".into(),
                threads: 2,
                device: "none".into(),
                driver: "none".into(),
                mitsuba: "mitsuba 3".into(),
            },
            options: AgreementOptions::default(),
            uncompared: Vec::new(),
            scenes: vec![scene("raced", Race::new(made_up_race())), scene("not raced", None)],
        }
    }

    #[test]
    fn the_block_has_one_row_a_scene_and_names_both_bests() {
        let text = made_up().to_results_block();
        assert!(
            text.contains(
                "| raced | agrees | -0.100 % | sobol | 0.500 | 5.00e-1 | llvm_ad_rgb, independent | 2.000 | 1.00e0 | 0.50 ± 0.04 (0.50) | 3.00 ± 0.21 (3.00) |"
            ),
            "{text}"
        );
        assert!(text.contains("| not raced | agrees | -0.100 % | – |"), "{text}");
        let columns: Vec<usize> = text
            .lines()
            .filter(|line| line.starts_with('|'))
            .map(|line| line.matches('|').count())
            .collect();
        assert_eq!(columns, [12; 4]);
    }

    #[test]
    fn the_page_has_every_contender() {
        let text = made_up().to_markdown();
        assert!(
            text.contains("| raced | 5.00e-1 | 2.000 | llvm_ad_rgb, independent | 1.000 | 0.50"),
            "{text}"
        );
        for contender in [
            "clerestory, sobol",
            "clerestory, pcg",
            "scalar_rgb, multijitter",
            "llvm_ad_rgb, multijitter",
        ] {
            assert_eq!(text.matches(contender).count(), 3, "{contender}");
        }
        let thresholds = ["agrees when all of its values are", "|z| up to about 4.5 is"];
        assert!(thresholds.iter().all(|one| text.contains(one)), "{text}");
        assert!(text.contains("| 2.000 (4.000) | 3.800 (7.600) |"), "{text}");
    }

    #[test]
    fn heavy_tails_agree_with_nothing_and_ten_wrong_pixels_differ() {
        let values = 3 * 4096;
        // Evenly spread between ±1.7, with the variance of normal numbers.
        let even: Vec<f32> = (0..values).map(|i| ((i % 64) as f32 - 31.5) / 18.5).collect();
        let (one, zero) = (vec![1.0; values], vec![0.0; values]);
        let of = |z: &[f32]| z_test(z, &one, &zero, &zero, 0.01).unwrap();
        let with = |count: usize, value: f32| {
            let mut z = even.clone();
            z[..count].fill(value);
            z
        };
        let mut report = made_up();
        let verdict = |report: &mut AgreementReport, values: ZTest| {
            report.scenes[0].values = values;
            (report.scenes[0].verdict(), report.passes())
        };
        assert_eq!(verdict(&mut report, of(&even)), ("agrees", true));
        assert_eq!(verdict(&mut report, of(&with(30, -6.0))), ("**differs**", false));
        // Three values of one pixel, as far off as chance rejects one in a hundred pictures.
        assert_eq!(
            verdict(&mut report, of(&with(3, -5.18))),
            ("undecided: heavy tails", true)
        );
        let text = report.to_markdown();
        assert!(
            text.contains("1 of 2 scenes agree, and heavy tails leave 1 undecided."),
            "{text}"
        );
        // Tails heavy enough to explain half a per cent of rejected values do not excuse as many.
        let mut heavy: Vec<f32> = even.iter().map(|z| z * 1.15).collect();
        heavy[..60].fill(6.0);
        let heavy = of(&heavy);
        assert_eq!(heavy.verdict, Verdict::HeavyTails, "{heavy}");
        assert_eq!(verdict(&mut report, heavy), ("**differs**", false));
        // The blocks alone.
        report.scenes[0].blocks = of(&with(300, 9.0));
        assert_eq!(verdict(&mut report, of(&even)), ("**differs**", false));
    }

    #[test]
    fn a_scene_that_was_not_compared_is_named_and_no_pass() {
        let mut report = made_up();
        assert!(report.passes());
        report.uncompared.push(Uncompared {
            name: "broken".into(),
            cause: "7 values are not finite".into(),
        });
        assert!(!report.passes());
        let line = "- broken was not compared: 7 values are not finite.\n";
        assert!(report.to_markdown().contains(line) && report.to_results_block().contains(line));
    }

    #[test]
    fn reports_without_the_newer_fields_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let (report, prefix) = (made_up(), folder.path().join("report"));
        let mut json = serde_json::to_value(&report).unwrap();
        json.as_object_mut().unwrap().remove("uncompared").unwrap();
        for contender in json["scenes"][0]["race"]["contenders"].as_array_mut().unwrap() {
            contender.as_object_mut().unwrap().remove("seconds_error").unwrap();
        }
        std::fs::write(prefix.with_extension("json"), json.to_string()).unwrap();
        let kept = AgreementReport::kept(&prefix, &report.machine, &report.options);
        assert_eq!(kept.len(), 2);
        let race = kept[0].race.as_ref().unwrap();
        assert!(race.contenders.iter().all(|one| one.seconds_error.is_none()));
    }

    #[test]
    fn reports_of_the_same_options_and_machine_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (report, prefix) = (made_up(), folder.path().join("report"));
        let kept = |options: &AgreementOptions| AgreementReport::kept(&prefix, &report.machine, options).len();
        assert_eq!(kept(&report.options), 0);
        let [json, _] = report.texts().unwrap();
        std::fs::write(prefix.with_extension("json"), json).unwrap();
        assert_eq!(kept(&report.options), report.scenes.len());
        let mut others = report.options.clone();
        others.scenes = vec!["one".into()];
        assert_eq!(kept(&others), report.scenes.len());
        others.size += 8;
        assert_eq!(kept(&others), 0);
        let elsewhere = Machine {
            threads: 3,
            ..report.machine.clone()
        };
        assert!(AgreementReport::kept(&prefix, &elsewhere, &report.options).is_empty());
    }
}
