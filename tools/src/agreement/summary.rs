//! What the races say, in words: how they were run, by the contenders that took part, and who was first.

use clerestory::film::metrics::RELATIVE_MSE_OFFSET;

use super::race::{Contender, EqualError, Lead, Race};
use super::report::AgreementReport;

impl AgreementReport {
    fn races(&self) -> impl Iterator<Item = &Race> {
        self.scenes.iter().filter_map(|scene| scene.race.as_ref())
    }

    /// How times to equal error were measured, in a paragraph.
    pub fn race_method(&self) -> String {
        if self.races().next().is_none() {
            return "Time to equal error was not measured.".into();
        }
        let o = &self.options;
        format!(
            "Time to equal error: every renderer takes turns with each of its samplers ({}), {} independent pictures each of {2} × {2} pixels × \
             {3} samples. Relative MSE is that of one such picture, by the variance between them over the squares of one converged picture + \
             {RELATIVE_MSE_OFFSET} of its squared mean; paths per second are of wall clock, medians. A contender's seconds to an error are its seconds per picture × its \
             relative MSE / that error, and the error to reach is that of our best picture. This takes the MSE to fall as 1/samples around \
             these pictures; where a stratified sampler's falls faster, it favours this engine if Mitsuba's picture has the larger error, and \
             Mitsuba if it has the smaller one. Compared are the samplers and variants of either side that are there first. Ratios are \
             Mitsuba's seconds over ours, above 1 this engine is faster, ± their standard error by the spread of the errors between pictures \
             and of the seconds between rounds; in brackets the ratio of processor seconds, which other work on the machine changes less.",
            self.contenders(),
            u64::from(o.timing_rounds) * u64::from(o.timing_pictures),
            o.size,
            o.timing_samples,
        )
    }

    /// Who raced, by the races themselves.
    fn contenders(&self) -> String {
        let all = || self.races().flat_map(|race| &race.contenders);
        let quoted = |name: &str| format!("`{name}`");
        let (ours, theirs): (Vec<&Contender>, Vec<&Contender>) = all().partition(|one| one.is_ours());
        let ours = listed(&distinct(ours.iter().map(|one| quoted(&one.sampler))));
        let variants = listed(&distinct(theirs.iter().map(|one| quoted(one.variant()))));
        // Scenes with and without media have different contenders.
        let ways = distinct(self.races().map(|race| {
            let theirs = race.contenders.iter().filter(|one| !one.is_ours());
            listed(&distinct(theirs.map(|one| quoted(&one.way()))))
        }));
        format!(
            "here {ours}; Mitsuba's {variants} with {}",
            ways.join(", in other scenes with ")
        )
    }

    /// In how many scenes this engine is first, the mean ratios, and what was not measured; nothing when nothing was timed.
    pub fn race_summary(&self) -> Vec<String> {
        let races: Vec<&Race> = self.races().collect();
        if races.is_empty() {
            return Vec::new();
        }
        let of = |races: usize| format!("{races} of {} scenes", self.races().count());
        let line = |whom: &str, compared: fn(&Race) -> &EqualError| {
            let count = |lead: Lead| races.iter().filter(|race| compared(race).lead() == lead).count();
            let logarithms: f64 = races.iter().map(|race| compared(race).ratio.ln()).sum();
            let mean = (logarithms / races.len() as f64).exp();
            format!(
                "Against {whom} this engine is faster to equal error in {}, slower in {}, undecided (within {} standard errors) in {}; \
                 geometric mean of the ratios {mean:.2}.",
                of(count(Lead::Faster)),
                count(Lead::Slower),
                EqualError::STANDARD_ERRORS,
                count(Lead::Undecided),
            )
        };
        let mut lines = vec![
            line("Mitsuba's best", |race| &race.against_best),
            line("its scalar variant", |race| &race.against_scalar),
        ];
        let without_llvm = races.iter().filter(|race| !race.has_llvm()).count();
        if without_llvm > 0 {
            lines.push(format!(
                "LLVM variant not measured in {}: there \"Mitsuba's best\" is the best of its scalar variant.",
                of(without_llvm)
            ));
        }
        for scene in &self.scenes {
            let left_out = scene.race.iter().flat_map(|race| &race.left_out);
            lines.extend(left_out.map(|cause| format!("{}: left out, {cause}.", scene.name)));
        }
        let knows_seconds = |race: &Race| race.contenders.iter().all(|one| one.seconds_error.is_some());
        let without_spread = races.iter().filter(|race| !knows_seconds(race)).count();
        if without_spread > 0 {
            lines.push(format!(
                "In {} the ± is that of the errors alone: no spread of the seconds was kept with these results.",
                of(without_spread)
            ));
        }
        lines
    }
}

/// Each once, in the order of their first places.
fn distinct(all: impl Iterator<Item = String>) -> Vec<String> {
    let mut kept = Vec::new();
    for one in all {
        if !kept.contains(&one) {
            kept.push(one);
        }
    }
    kept
}

/// a, b and c.
fn listed(all: &[String]) -> String {
    match all {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::race::tests::made_up_race;
    use super::super::report::tests::made_up;
    use super::*;

    #[test]
    fn leads_are_counted_with_what_is_undecided() {
        let lines = made_up().race_summary();
        assert_eq!(
            lines,
            [
                "Against Mitsuba's best this engine is faster to equal error in 0 of 1 scenes, slower in 1, undecided (within 2 standard \
                 errors) in 0; geometric mean of the ratios 0.50.",
                "Against its scalar variant this engine is faster to equal error in 1 of 1 scenes, slower in 0, undecided (within 2 standard \
                 errors) in 0; geometric mean of the ratios 3.00."
            ]
        );
    }

    #[test]
    fn the_method_names_those_that_raced() {
        let mut report = made_up();
        let method = report.race_method();
        let raced =
            "(here `sobol` and `pcg`; Mitsuba's `scalar_rgb` and `llvm_ad_rgb` with `independent` and `multijitter`)";
        assert!(method.contains(raced), "{method}");
        // Another scene with a medium.
        let mut in_medium = made_up_race();
        in_medium[2].renderer += " volpath";
        in_medium[3].renderer += " volpathmis";
        report.scenes[1].race = Race::new(in_medium[..4].to_vec());
        let method = report.race_method();
        let raced = "`multijitter`, in other scenes with `volpath independent` and `volpathmis multijitter`)";
        assert!(method.contains(raced), "{method}");
        report.scenes.clear();
        assert_eq!(report.race_method(), "Time to equal error was not measured.");
        assert!(report.race_summary().is_empty());
    }

    #[test]
    fn what_was_not_measured_is_said() {
        let mut report = made_up();
        let mut contenders = made_up_race();
        contenders.truncate(4);
        contenders[0].seconds_error = None;
        report.scenes[1].race = Race::new(contenders);
        let lines = report.race_summary();
        assert!(
            lines[2].starts_with("LLVM variant not measured in 1 of 2 scenes"),
            "{lines:?}"
        );
        assert!(
            lines[3].starts_with("In 1 of 2 scenes the ± is that of the errors alone"),
            "{lines:?}"
        );
        assert!(
            report
                .to_results_block()
                .contains("| scalar_rgb, independent (LLVM variant not measured) |")
        );
    }
}
