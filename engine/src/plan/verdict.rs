//! Which prediction is the best, and what it lacks.

use std::time::Duration;

use super::{Candidate, Goal};

/// Relative difference of two predictions that is none.
const TOLERANCE: f64 = 1e-3;
/// Score of a missed goal, beyond every number of seconds, and of those of which still less is known.
const MISSED: f64 = 1e12;
const UNKNOWN_BIAS: f64 = 1e15;
const UNLIT: f64 = 1e18;

/// Smaller is better: seconds where an error is to be reached, the error where only the time counts.
pub fn score(candidate: &Candidate, goal: Goal) -> f64 {
    let late = |time: Duration| candidate.seconds > time.as_secs_f64();
    let Some(bias) = candidate.bias_at_most else {
        return if candidate.lit { UNKNOWN_BIAS } else { UNLIT };
    };
    // A bias that noise may hide counts.
    let error = candidate.noise.hypot(bias);
    let misses = |wanted: f64| {
        !candidate.reason.is_empty() || goal.time.is_some_and(late) || candidate.error > wanted * (1.0 + TOLERANCE)
    };
    match goal.error {
        _ if !candidate.lit => UNLIT,
        // What misses the error because of the time is judged by how far.
        Some(wanted) if misses(wanted) => MISSED * error,
        Some(_) => candidate.seconds,
        None => error,
    }
}

/// Why the choice does not meet the goal.
pub fn shortfall(choice: &Candidate, goal: Goal, pilot_seconds: f64) -> String {
    if !choice.lit {
        return "no pilot has met any light: nothing is known of the error".into();
    }
    let all = choice.seconds + pilot_seconds;
    if let Some(time) = goal.time.map(|time| time.as_secs_f64())
        && all > time * (1.0 + TOLERANCE)
    {
        return format!("{time:.3} s are too short: one sample per pixel and the pilots take about {all:.3} s");
    }
    if choice.bias.is_none() && !choice.misses.is_empty() {
        return format!(
            "the error is that of the light that {} finds; it misses {}",
            choice.technique, choice.misses
        );
    }
    if !choice.reason.is_empty() {
        return format!("{}: {}", choice.technique, choice.reason);
    }
    match (goal.error, goal.time) {
        (Some(error), Some(time)) if choice.error > error * (1.0 + TOLERANCE) => format!(
            "an error of {error} takes longer than {:.3} s; {:.4} can be had in that time",
            time.as_secs_f64(),
            choice.error
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques;

    #[test]
    fn what_cannot_be_had_is_said() {
        let path = techniques::by_id("path").unwrap();
        let mut choice = Candidate {
            lit: true,
            spp: 10,
            noise: 0.3,
            bias: Some(0.0),
            bias_at_most: Some(0.0),
            error: 0.3,
            seconds: 1.0,
            ..Candidate::of(path, "defaults", serde_json::Value::Null)
        };
        let goal = |error, seconds: Option<f64>| Goal {
            error,
            time: seconds.map(Duration::from_secs_f64),
        };
        assert!(shortfall(&choice, goal(Some(0.3), None), 0.5).is_empty());
        assert!(shortfall(&choice, goal(None, Some(1.5)), 0.5).is_empty());
        assert!(shortfall(&choice, goal(None, Some(1.2)), 0.5).contains("too short"));
        assert!(shortfall(&choice, goal(Some(0.1), Some(2.0)), 0.5).contains("0.3"));
        let goal = goal(Some(0.1), Some(2.0));
        let far = score(&choice, goal);
        choice.error = 0.09;
        let near = score(&choice, goal);
        assert!(near < far);
        // A refusal, a bias that is not known and a picture without light, one worse than the other.
        choice.reason = "bias 12 % exceeds the goal of 10 %".into();
        assert!(shortfall(&choice, goal, 0.5).contains("path: bias 12 %"));
        choice.bias_at_most = Some(0.12);
        let refused = score(&choice, goal);
        (choice.bias, choice.bias_at_most) = (None, None);
        choice.misses = "what the point light \"lamp\" gives by way of mirrors".into();
        assert!(shortfall(&choice, goal, 0.5).contains("\"lamp\""));
        let unknown = score(&choice, goal);
        choice.lit = false;
        assert!(near < refused && refused < unknown && unknown < score(&choice, goal));
    }
}
