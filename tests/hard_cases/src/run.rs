//! Runs cases on subjects and gives verdicts.

use clerestory::gpu::Gpu;
use clerestory::settings::Settings;
use clerestory::techniques::{self, Bias, Card};
use clerestory::transport::PathSet;
use clerestory::{Error, Result};

use crate::easel::{OTHER_TOLERANCE, PASSES, photon_tolerance, shares_noise};
use crate::{Easel, Figure, HardCase, INDEXES, IndexCase, Judgement, LOBES};

/// Photons of a pass, of techniques that have them, and samples of a pixel that ask them: one pass for nearly all pictures, whose noise is a
/// hundredth in closed rooms.
const PHOTONS: u32 = 1 << 14;
const SAMPLES_PER_PASS: u32 = 1024;
/// The same with an estimate of media beside the default one: some store more than one record of each collision.
const PHOTONS_BESIDE: u32 = PHOTONS / 2;
/// Walks of a pass, of techniques that have virtual lights: pictures have several passes.
const WALKS: u32 = 32;

/// Texels along a side of light probes, of techniques that have them, and of their finest level that is filtered: none of the cases has a sky with
/// details.
const PROBE_SIDE: u32 = 64;
const PROBE_FINEST: u32 = 32;
/// And of maps that are captured for a scene.
const MAP_SIDE: u32 = 64;

/// What helps where a technique refuses a case.
pub(crate) const WAY_ROUND: &str = "; choose another technique or change the scene";

/// What a case is run against.
#[derive(Debug, Clone, Copy)]
pub enum Subject {
    /// A technique with one of its samplers, or of its estimates of light in media, where it has a choice.
    Technique {
        /// The technique.
        info: &'static Card,
        /// Value of its setting `sampler`.
        sampler: Option<&'static str>,
        /// Value of its setting `volume`, where it is not the default: such a subject is judged in media alone.
        volume: Option<&'static str>,
    },
    /// A ray index, by the twin of its kernels; the tests of the kernels hold them to it bit for bit.
    Index(&'static IndexCase),
    /// All of [`LOBES`].
    Lobes,
}

impl Subject {
    /// Its name: `path (sobol)`, `bvh2`, `lobes`.
    pub fn name(&self) -> String {
        match self {
            Self::Technique { info, sampler, volume } => match sampler.or(*volume) {
                Some(choice) => format!("{} ({choice})", info.id),
                None => info.id.to_owned(),
            },
            Self::Index(kind) => kind.name.to_owned(),
            Self::Lobes => "lobes".to_owned(),
        }
    }

    /// Whether it is a technique whose pictures have a bias.
    pub fn has_bias(&self) -> bool {
        matches!(self, Self::Technique { info, .. } if !matches!(info.bias, Bias::Unbiased))
    }

    /// Whether it is a technique of whose pictures all pixels share the noise of a pass, with its defaults.
    pub fn shares_noise(&self) -> bool {
        matches!(self, Self::Technique { info, .. } if shares_noise(info, &Settings::default()).unwrap_or(false))
    }

    /// A technique's subjects: one for each sampler that its setting `sampler` offers; those with a bias, which are not judged by their noise, and those
    /// whose pixels share the noise of a pass, have their default sampler alone; and one for each further estimate that its setting `volume` offers. Cards of a host's own are as
    /// good as the engine's.
    pub fn of(info: &'static Card) -> Vec<Self> {
        let infos = info.settings.infos();
        let shares_noise = shares_noise(info, &Settings::default()).unwrap_or(false);
        let mut all: Vec<Self> = match infos.iter().find(|setting| setting.name == "sampler") {
            Some(setting) if matches!(info.bias, Bias::Unbiased) && !shares_noise => {
                let subject = |sampler: &&'static str| Self::Technique {
                    info,
                    sampler: Some(*sampler),
                    volume: None,
                };
                setting.names.iter().map(subject).collect()
            }
            _ => vec![Self::Technique {
                info,
                sampler: None,
                volume: None,
            }],
        };
        if let Some(setting) = infos.iter().find(|setting| setting.name == "volume") {
            let others = setting.names.iter().filter(|name| setting.default != **name);
            all.extend(others.map(|volume| Self::Technique {
                info,
                sampler: None,
                volume: Some(*volume),
            }));
        }
        all
    }

    /// What of an error says that it refuses a case by its setting `volume`.
    fn refusal_by_estimate(&self, error: &Error) -> Option<String> {
        match (self, error) {
            (Self::Technique { volume: Some(_), .. }, Error::Setting { name, cause, .. }) if name == "volume" => {
                // Reasons of a refusal are parted by semicolons.
                Some(format!("its estimates of light in media {}", cause.replace(';', ",")))
            }
            _ => None,
        }
    }

    /// What pictures of a technique lack by its own word, where that is a part of the light: such pictures are judged by whether they are whole,
    /// finite and the same each time, and by values as far as the path tracer's of the same light paths are right, or, of a technique with a bias, as far as
    /// its own are.
    pub fn limits(&self) -> Option<String> {
        let Self::Technique { info, .. } = self else {
            return None;
        };
        let bias = match info.bias {
            Bias::Unbiased => String::new(),
            Bias::Consistent(cause) | Bias::Biased(cause) => format!("; {cause}"),
        };
        let of_parts = info.path_set != PathSet::ALL;
        of_parts.then(|| format!("its pictures hold only the light paths {}{bias}", info.path_set))
    }

    /// What its pictures are judged by beside their own variance, in words: from the bias that its card states. `None` for what is no technique.
    pub fn promise(&self) -> Option<String> {
        let Self::Technique { info, .. } = self else {
            return None;
        };
        if !self.has_bias() {
            return Some(if self.shares_noise() {
                format!(
                    "unbiased: means over pictures have what is expected, but for their noise, by Student's t over {PASSES} passes at most; \
                     single pixels promise nothing, since all share the noise of a pass"
                )
            } else {
                "unbiased: pixels and means have what is expected, but for their noise".to_owned()
            });
        }
        let percent = |tolerance: f64| format!("{:.1} %", 100.0 * tolerance);
        let allowed = if info.settings.has("photons") {
            format!(
                "single pixels promise nothing; means over pictures may err by {} beside their variance, which does not tell of photons that \
                 all pixels share: five standard deviations of a pass of {PHOTONS}; of n passes √n times less",
                percent(photon_tolerance(f64::from(PHOTONS)))
            )
        } else {
            format!(
                "single pixels promise nothing; means over pictures may err by {} beside their variance",
                percent(OTHER_TOLERANCE)
            )
        };
        Some(format!("{}; {allowed}", info.bias))
    }

    /// Whether a case concerns it.
    pub fn concerns(&self, case: &HardCase) -> bool {
        match self {
            Self::Technique { volume, .. } => case.techniques.is_some() && (volume.is_none() || case.of_media),
            Self::Index(_) => case.rays.is_some(),
            Self::Lobes => case.lobes.is_some(),
        }
    }
}

/// All subjects: the engine's techniques ([`Subject::of`]), ray indexes, scattering functions.
pub fn subjects() -> Vec<Subject> {
    let mut all = Vec::new();
    all.extend(techniques::all().iter().flat_map(Subject::of));
    all.extend(INDEXES.iter().map(Subject::Index));
    all.push(Subject::Lobes);
    all
}

/// How a case came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it has to.
    Pass,
    /// As documented.
    Degrades,
    /// The subject has refused the case beforehand, with its reasons.
    Refused,
    /// Worse.
    Fails,
}

impl Verdict {
    /// The verdict as a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Degrades => "degrades",
            Self::Refused => "refused",
            Self::Fails => "FAILS",
        }
    }
}

/// The outcome of a case on a subject.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Outcome {
    /// The case's name.
    pub case: &'static str,
    /// The subject's name.
    pub subject: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The figure that is worst for its bound; empty where nothing was measured.
    pub measured: String,
    /// Why it does not pass and what can be done; `None` for what passes.
    pub reason: Option<String>,
    /// Everything that was measured.
    pub figures: Vec<Figure>,
}

/// A technique with the settings that all cases begin with.
fn easel_of<'a>(gpu: &'a Gpu, info: &'static Card) -> Easel<'a> {
    let easel = Easel::new(gpu, info, serde_json::Map::new())
        .with("photons", PHOTONS)
        .with("walks", WALKS)
        .with("probe_side", PROBE_SIDE)
        .with("probe_finest", PROBE_FINEST)
        .with("side", MAP_SIDE);
    if easel.has("photons") {
        easel.with("samples_per_pass", SAMPLES_PER_PASS)
    } else {
        easel
    }
}

/// What a technique's pictures lack, where that is why they are wrong: of an unbiased technique the path tracer's of the same light paths have to be wrong as well.
fn lack(gpu: &Gpu, case: &HardCase, subject: &Subject, judgement: &Judgement) -> Result<Option<String>> {
    let (Subject::Technique { info, .. }, Some(limits), Some(judge)) = (subject, subject.limits(), case.techniques)
    else {
        return Ok(None);
    };
    if !judgement.has_sound_pictures() {
        return Ok(None);
    }
    let lacks = subject.has_bias() || {
        let same = easel_of(gpu, techniques::by_id("path")?).with("path_set", info.path_set.to_string());
        judgement.errs_where(&judge(&same)?)
    };
    Ok(lacks.then_some(limits))
}

/// Runs a case on a subject; `None` when it does not concern it.
pub fn judge(gpu: &Gpu, case: &HardCase, subject: &Subject) -> Option<Outcome> {
    if !subject.concerns(case) {
        return None;
    }
    let judged = match subject {
        Subject::Technique { info, sampler, volume } => {
            let mut easel = easel_of(gpu, info);
            if let Some(sampler) = sampler {
                easel = easel.with("sampler", *sampler);
            }
            if let Some(volume) = volume {
                easel = easel.with("volume", *volume).with("photons", PHOTONS_BESIDE);
            }
            (case.techniques?)(&easel)
        }
        Subject::Index(kind) => crate::rays::judge(kind, &(case.rays?)()),
        Subject::Lobes => {
            let judge_lobe = case.lobes?;
            let mut judgement = Judgement::default();
            LOBES.iter().for_each(|lobe| judge_lobe(lobe, &mut judgement));
            Ok(judgement)
        }
    };
    Some(outcome(gpu, case, subject, judged))
}

fn outcome(gpu: &Gpu, case: &HardCase, subject: &Subject, judged: Result<Judgement>) -> Outcome {
    let mut outcome = Outcome {
        case: case.name,
        subject: subject.name(),
        verdict: Verdict::Fails,
        measured: String::new(),
        reason: None,
        figures: Vec::new(),
    };
    match judged {
        Ok(judgement) => {
            outcome.figures = judgement.figures().to_vec();
            let Some(worst) = judgement.worst() else {
                outcome.reason = Some("nothing was measured".into());
                return outcome;
            };
            outcome.measured = worst.to_string();
            if worst.passes() {
                outcome.verdict = Verdict::Pass;
            } else if let (true, Some(documented)) = (worst.is_documented(), case.documented_of(subject)) {
                outcome.verdict = Verdict::Degrades;
                outcome.reason = Some(documented.to_owned());
            } else {
                match lack(gpu, case, subject, &judgement) {
                    Ok(Some(limits)) => {
                        outcome.verdict = Verdict::Degrades;
                        outcome.reason = Some(limits);
                    }
                    Ok(None) => {
                        outcome.reason = Some(format!(
                            "{worst}: worse than is documented; avoid such scenes on this device and report the output of \
                             `clerestory stability {} --json`",
                            case.name
                        ));
                    }
                    Err(error) => outcome.reason = Some(error.to_string()),
                }
            }
        }
        Err(Error::Unsupported { reasons, .. }) => {
            outcome.verdict = Verdict::Refused;
            outcome.reason = Some(reasons.join("; ") + WAY_ROUND);
        }
        Err(error) => match subject.refusal_by_estimate(&error) {
            Some(reason) => {
                outcome.verdict = Verdict::Refused;
                outcome.reason = Some(reason + WAY_ROUND);
            }
            None => {
                outcome.measured = "error".into();
                outcome.reason = Some(error.to_string());
            }
        },
    }
    outcome
}
