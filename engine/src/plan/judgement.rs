//! What is known of a technique's bias, and by what.
//!
//! An unbiased technique that misses nothing has none, and is the reference: others are held against two independent pilots of it. A consistent one is
//! also asked how far its own pictures still move as it works on; that counts where the reference misses paths, or where its noise hides
//! what its pilots would show. What an unbiased technique misses makes it a biased one: it is held against a consistent one's pilots.

use super::bias::{BiasEstimate, relative_bias_of_pairs, relative_drift_of_pairs};
use super::model::BiasModel;
use super::trial::Trial;
use crate::Result;
use crate::film::metrics::RELATIVE_MSE_OFFSET;
use crate::techniques::Bias;

/// Pilot rounds of a consistent technique that show how its bias falls, and by how far its pictures move.
const CONSISTENT_ROUNDS: usize = 3;

/// A bias, and how it was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    /// `None` where nothing is known.
    pub bias: Option<BiasModel>,
    /// What it was found by, in words; empty for what has none.
    pub by: String,
    /// Whether more pilots could still show it, where they now do not.
    pub may_be_seen: bool,
    /// Relative MSE of an unbiased technique's last pilots by light that they have not met, but a consistent technique has.
    pub unseen: f64,
}

impl Judgement {
    fn unknown(why: &str, may_be_seen: bool) -> Self {
        Self {
            bias: None,
            by: why.into(),
            may_be_seen,
            unseen: 0.0,
        }
    }

    /// Why that error cannot be reached by it; `None` where it can.
    pub fn refusal(&self, goal: Option<f64>, reaches: bool) -> Option<String> {
        let Some(bias) = &self.bias else {
            return Some(format!("its bias is not known: {}", self.by));
        };
        let goal = goal.filter(|_| !reaches)?;
        // Of a falling bias what is left after the most samples.
        let last = f64::from(u32::MAX);
        let (found, upper) = if bias.exponent() == 0.0 {
            (bias.square(1.0), bias.upper(1.0))
        } else {
            (bias.square(last), bias.upper(last))
        };
        Some(if found.sqrt() >= goal {
            format!("bias {} exceeds the goal of {}", percent(found.sqrt()), percent(goal))
        } else {
            format!(
                "bias may be as much as {}, beyond the goal of {}: {} is found, and noise of the pilots hides the rest",
                percent(upper.sqrt()),
                percent(goal),
                percent(found.sqrt())
            )
        })
    }
}

/// Two digits: `3.1 %`, `12 %`, `0.45 %`.
pub fn percent(share: f64) -> String {
    let value = share * 100.0;
    let text = match value {
        10.0.. => format!("{value:.0}"),
        1.0.. => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    };
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    format!("{text} %")
}

/// The trial that others are held against: of the unbiased ones that which misses nothing, has the most samples, and then the least noise.
pub fn reference_trial<'a, 't>(trials: &'a [Option<Trial<'t>>]) -> Option<&'a Trial<'t>> {
    let able = trials
        .iter()
        .flatten()
        .filter(|trial| trial.card.bias == Bias::Unbiased && trial.lit);
    able.min_by(|a, b| {
        let misses = |trial: &Trial<'_>| !trial.misses.is_empty();
        let more = || b.spp.cmp(&a.spp).then(a.noise().total_cmp(&b.noise()));
        misses(a).cmp(&misses(b)).then_with(more)
    })
}

/// Of every trial, in order. `error` is the one that is asked for.
pub fn judgements(trials: &[Option<Trial<'_>>], error: Option<f64>) -> Result<Vec<Judgement>> {
    let reference = reference_trial(trials);
    let consistent = trials
        .iter()
        .flatten()
        .filter(|trial| matches!(trial.card.bias, Bias::Consistent(_)) && trial.lit);
    let consistent = consistent.min_by(|a, b| b.spp.cmp(&a.spp).then(a.noise().total_cmp(&b.noise())));
    trials
        .iter()
        .map(|trial| match trial {
            Some(trial) => judgement_of(trial, reference, consistent, error),
            None => Ok(Judgement::default()),
        })
        .collect()
}

fn judgement_of(
    trial: &Trial<'_>,
    reference: Option<&Trial<'_>>,
    consistent: Option<&Trial<'_>>,
    error: Option<f64>,
) -> Result<Judgement> {
    let blind = !trial.misses.is_empty();
    match trial.card.bias {
        // Without light nothing is known anyway.
        Bias::Unbiased if !blind || !trial.lit => Ok(Judgement {
            bias: Some(BiasModel::default()),
            unseen: match consistent {
                Some(consistent) if trial.lit => unseen(consistent, trial)?.unwrap_or(0.0),
                _ => 0.0,
            },
            ..Judgement::default()
        }),
        Bias::Unbiased => match consistent {
            Some(consistent) => {
                let found = against(trial, consistent)?;
                Ok(Judgement {
                    bias: found.last().map(|(_, found)| BiasModel::constant(*found)),
                    by: format!(
                        "{}, of {} samples per pixel: it misses {}",
                        consistent.card.id, consistent.spp, trial.misses
                    ),
                    ..Judgement::default()
                })
            }
            None => Ok(Judgement::unknown(&format!("it misses {}", trial.misses), false)),
        },
        Bias::Biased(_) => {
            // Where the reference misses light, a consistent technique stands in for it.
            let Some(other) = reference.filter(|reference| reference.misses.is_empty()).or(consistent) else {
                return Ok(Judgement::unknown(
                    "there is no technique here to hold it against",
                    false,
                ));
            };
            let found = against(trial, other)?;
            let last = found.last().map(|(_, found)| *found).unwrap_or_default();
            Ok(Judgement {
                bias: found.last().map(|(_, found)| BiasModel::constant(*found)),
                by: format!("{}, of {} samples per pixel", other.card.id, other.spp),
                // Neither within the goal nor beyond it.
                may_be_seen: error.is_some_and(|e| last.square < e * e && last.upper() > e * e),
                unseen: 0.0,
            })
        }
        Bias::Consistent(_) => judgement_of_consistent(trial, reference),
    }
}

fn judgement_of_consistent(trial: &Trial<'_>, reference: Option<&Trial<'_>>) -> Result<Judgement> {
    let moved = moved(trial)?;
    let own = BiasModel::settling(&trial.law, &moved);
    let spp = f64::from(trial.spp);
    let may_be_seen = trial.stages.len() < CONSISTENT_ROUNDS;
    let mut has_unseen = false;
    let by_reference = match reference {
        Some(reference) if reference.misses.is_empty() => {
            has_unseen = unseen(trial, reference)?.is_some();
            Some((against(trial, reference)?, reference))
        }
        _ => None,
    };
    let told_apart = |found: &[(u32, BiasEstimate)]| {
        let last = found.last().map(|(_, found)| *found).unwrap_or_default();
        last.is_resolved() || own.as_ref().is_none_or(|own| last.upper() <= own.upper(spp))
    };
    if let Some((found, reference)) = by_reference.filter(|(found, _)| !has_unseen && told_apart(found)) {
        let bias = BiasModel::falling(&trial.law, &found);
        let law = bias.map_or_else(String::new, |bias| law(&bias));
        return Ok(Judgement {
            bias,
            by: format!("{}, of {} samples per pixel; {law}", reference.card.id, reference.spp),
            may_be_seen,
            unseen: 0.0,
        });
    }
    let why = match reference {
        Some(reference) if !reference.misses.is_empty() => format!("{} misses {}", reference.card.id, reference.misses),
        Some(reference) if has_unseen => {
            format!(
                "{} has not met all light in {} samples per pixel",
                reference.card.id, reference.spp
            )
        }
        Some(reference) => format!(
            "{} is too noisy in {} samples per pixel",
            reference.card.id, reference.spp
        ),
        None => "nothing else can".into(),
    };
    let stages: Vec<String> = trial.stages.iter().map(|stage| stage.spp.to_string()).collect();
    Ok(match own {
        Some(own) => Judgement {
            by: format!(
                "its own pictures of {} samples per pixel, since {why}; {}",
                stages.join(", "),
                law(&own)
            ),
            bias: Some(own),
            may_be_seen,
            unseen: 0.0,
        },
        None if trial.law.bias_exponent <= 0.0 => Judgement::unknown(
            &format!("with these settings it stays, so that its own pictures do not show it, and {why}"),
            may_be_seen,
        ),
        None if trial.spp <= trial.law.samples_a_pass => Judgement::unknown(
            &format!(
                "its own pictures of up to {} samples per pixel are of one pass, and {why}",
                trial.spp
            ),
            may_be_seen,
        ),
        None if moved.is_empty() => Judgement::unknown("there was no time for pictures of two budgets", may_be_seen),
        None => Judgement::unknown(
            &format!(
                "its own pictures of {} samples per pixel do not settle, and {why}",
                stages.join(", ")
            ),
            may_be_seen,
        ),
    })
}

fn law(bias: &BiasModel) -> String {
    let falls = if bias.is_assumed() { "is taken to fall" } else { "falls" };
    format!("bias {falls} as samples^(-{:.2})", bias.exponent() / 2.0)
}

/// What an unbiased technique's pilots have not met: they are darker than a consistent one's, by more than that one still moves. `None` where
/// nothing shows it.
fn unseen(consistent: &Trial<'_>, unbiased: &Trial<'_>) -> Result<Option<f64>> {
    let Some(own) = BiasModel::settling(&consistent.law, &moved(consistent)?) else {
        return Ok(None);
    };
    let found = against(consistent, unbiased)?
        .last()
        .map(|(_, found)| *found)
        .unwrap_or_default();
    let rest = found.lower() - own.upper(f64::from(consistent.spp));
    Ok((found.brighter && rest > 0.0).then_some(rest))
}

/// Bias of each of a trial's stages against the last one of another technique.
fn against(trial: &Trial<'_>, other: &Trial<'_>) -> Result<Vec<(u32, BiasEstimate)>> {
    let Some(last) = other.stages.last() else {
        return Ok(Vec::new());
    };
    let [p, q] = &last.pictures;
    let stages = trial.stages.iter().map(|stage| {
        let [a, b] = &stage.pictures;
        Ok((stage.spp, relative_bias_of_pairs([a, b], [p, q], RELATIVE_MSE_OFFSET)?))
    });
    stages.collect()
}

/// How far a trial's expectation has moved from each stage to the next.
fn moved(trial: &Trial<'_>) -> Result<Vec<(u32, u32, BiasEstimate)>> {
    let pairs = trial.stages.windows(2).map(|stages| {
        let [early, late] = [&stages[0], &stages[1]];
        let ([a, b], [c, d]) = (&early.pictures, &late.pictures);
        let moved = relative_drift_of_pairs([a, b], [c, d], RELATIVE_MSE_OFFSET)?;
        Ok((early.spp, late.spp, moved))
    });
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals_name_the_bias_and_the_goal() {
        assert_eq!(
            [0.031, 0.02, 0.12, 0.0045, 0.1].map(percent),
            ["3.1 %", "2 %", "12 %", "0.45 %", "10 %"]
        );
        let of = |square, deviation| Judgement {
            bias: Some(BiasModel::constant(BiasEstimate {
                square,
                deviation,
                brighter: true,
            })),
            ..Judgement::default()
        };
        let seen = of(0.031 * 0.031, 1e-6);
        assert_eq!(
            seen.refusal(Some(0.02), false).unwrap(),
            "bias 3.1 % exceeds the goal of 2 %"
        );
        assert_eq!(seen.refusal(Some(0.05), true), None);
        assert_eq!(seen.refusal(None, false), None);
        let hidden = of(0.01 * 0.01, 0.0004).refusal(Some(0.02), false).unwrap();
        assert!(
            hidden.starts_with("bias may be as much as 3 %") && hidden.contains("1 % is found"),
            "{hidden}"
        );
        let unknown = Judgement::unknown("no pilots", false);
        assert!(unknown.refusal(None, true).unwrap().contains("no pilots"));
    }
}
