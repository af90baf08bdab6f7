//! The summary of a sweep: tables of slopes, of time to equal error and of every budget; CSV of every measurement.

use std::fmt::Write as _;

use super::results::Results;
use super::series::SceneSeries;
use super::slope::Slope;
use super::sweep::Budget;
use super::table::{Cell, Table};

const NONE: &str = "–";

/// A slope with its standard error.
pub fn slope_text(slope: Option<Slope>) -> String {
    let Some(slope) = slope else {
        return NONE.into();
    };
    let error = slope
        .standard_error
        .map_or(String::new(), |error| format!(" ± {error:.3}"));
    let hidden = match slope.hidden {
        0 => String::new(),
        hidden => format!(" ({hidden} lost in noise)"),
    };
    format!("{:.3}{error}{hidden}", slope.value)
}

/// How all of it was measured.
pub fn facts(results: &Results) -> Vec<String> {
    let mut facts = Vec::new();
    if results.interrupted {
        facts.push("**Interrupted**: the same command goes on where this stopped.".to_owned());
    }
    if results.smoke {
        facts.push(
            "**Smoke run** (`--smoke`): shows that everything works; its pictures are too small to judge speed by."
                .to_owned(),
        );
    }
    // Of measurements found from earlier runs, this run's load says nothing.
    let load = results
        .load
        .as_ref()
        .filter(|_| results.measured > 0)
        .map_or(String::new(), |load| format!("; load average {load} when it began"));
    facts.extend([
        format!("Device: {}; driver: {}.", results.device, results.driver),
        format!(
            "Machine: {}{load}. Clerestory {}.",
            results.machine, results.engine_version
        ),
    ]);
    facts.extend(method(results));
    facts
}

/// How a sweep's pictures were made and compared.
pub fn method(results: &Results) -> Vec<String> {
    let sweep = &results.sweep;
    let [width, height] = sweep.size;
    let mut facts = Vec::from_iter(left_out(results));
    facts.extend([
        format!(
            "{width} × {height} pixels, light paths: {}; {} pictures of each budget with seeds of their own.",
            sweep.path_set, sweep.repeats
        ),
        format!(
            "References: technique {}, {} samples per pixel, a seed of their own; their own variance is subtracted from every MSE.",
            sweep.reference.technique, sweep.reference.spp
        ),
        "Seconds: wall clock, medians, after a picture that warms the driver's cache; where criteria are of time to equal error, geometric means. \
         Errors: relative RMSE, the root of the repeats' mean relative MSE. Slopes: fitted on logarithms, with standard errors by the jackknife over \
         the repeats and by the reference's noise; independent samples give −½."
            .to_owned(),
    ]);
    if results.found > 0 {
        facts.push(format!(
            "Of all pictures {} were measured in this run and {} in earlier ones, whose load is not known.",
            results.measured, results.found
        ));
    }
    facts
}

/// What errors leave out; `None` where they leave out nothing.
fn left_out(results: &Results) -> Option<String> {
    let variants = results.scenes.iter().flat_map(|scene| &scene.variants);
    let points = variants.flat_map(|variant| &variant.points);
    let counts = points
        .flat_map(|point| &point.measurements)
        .map(|one| one.error.skipped);
    let (pixels, pictures) = counts.fold((0_u64, 0_u64), |(pixels, pictures), skipped| {
        (pixels + skipped, pictures + u64::from(skipped > 0))
    });
    (pixels > 0).then(|| {
        format!(
            "**{pixels} pixels left out** of the errors of {pictures} pictures: picture, reference or its variance is not finite there."
        )
    })
}

/// One row for each scene and variant: slopes and the cost of equal error.
pub fn overview(scenes: &[SceneSeries]) -> Table {
    let mut table = Table::new(
        "Slopes and time to equal error",
        &[
            "scene",
            "variant",
            "slope against samples",
            "slope of absolute RMSE",
            "slope against time",
            "relative RMSE",
            "seconds to it",
            "million rays to it",
            "speed-up",
        ],
    );
    for scene in scenes {
        let base = scene
            .series
            .first()
            .and_then(|series| series.seconds_to_error?.measured());
        for series in &scene.series {
            let text = |text: String| Cell::Text(text);
            if let Some(cause) = &series.refused {
                let row = [scene.address.clone(), series.name.clone(), format!("refused: {cause}")];
                table.row(row.map(Cell::Text).into_iter().chain((0..6).map(|_| NONE.into())));
                continue;
            }
            let seconds = series.seconds_to_error.and_then(|cost| cost.measured());
            table.row([
                text(format!("`{}`", scene.address)),
                text(series.name.clone()),
                text(slope_text(series.slope)),
                text(slope_text(series.absolute_slope)),
                text(slope_text(series.time_slope)),
                scene.common_error.map_or(NONE.into(), Cell::Number),
                text(series.seconds_to_error.map_or(NONE.into(), |cost| cost.to_string())),
                text(
                    series
                        .rays_to_error
                        .map_or(NONE.into(), |cost| million(cost).to_string()),
                ),
                text(
                    base.zip(seconds)
                        .map_or(NONE.into(), |(base, seconds)| format!("{:.2}", base / seconds)),
                ),
            ]);
        }
    }
    table.note(
        "Lost in noise: budgets whose mean MSE is not above 3 standard errors, by the repeats and the reference together. Equal error: the least that \
         all variants of a scene reach, read off straight lines between budgets in logarithms. Speed-up: over the first variant.",
    );
    table
}

fn million(cost: super::equal_error::Cost) -> super::equal_error::Cost {
    use super::equal_error::Cost;
    match cost {
        Cost::Measured(rays) => Cost::Measured(rays * 1e-6),
        Cost::AtMost(rays) => Cost::AtMost(rays * 1e-6),
        Cost::Above(rays) => Cost::Above(rays * 1e-6),
    }
}

/// One row for each budget of a scene.
pub fn budgets(scene: &SceneSeries) -> Table {
    let mut table = Table::new(
        format!("`{}` ({} triangles)", scene.address, scene.triangles),
        &[
            "variant",
            "budget",
            "samples per pixel",
            "seconds",
            "million rays",
            "relative MSE",
            "relative RMSE",
            "least … greatest",
            "relative bias",
            "FLIP",
            "reference's share",
            "front",
        ],
    );
    for series in &scene.series {
        for point in &series.points {
            let [least, greatest] = point.relative_rmse_range;
            let share = point.reference_relative_mse / (point.relative_mse + point.reference_relative_mse);
            table.row([
                series.name.as_str().into(),
                point.budget.to_string().into(),
                point.samples.into(),
                point.seconds.into(),
                point.rays.map_or(NONE.into(), |rays| Cell::Number(rays * 1e-6)),
                point.relative_mse.into(),
                point.relative_rmse.into(),
                format!("{} … {}", Cell::Number(least), Cell::Number(greatest)).into(),
                point
                    .relative_bias
                    .map_or(NONE.into(), |bias| Cell::Text(format!("{bias:+.1e}"))),
                point.flip.into(),
                Cell::Text(format!("{:.1} %", 100.0 * share)),
                if point.on_front { "yes" } else { "" }.into(),
            ]);
        }
    }
    table
}

/// Every measurement, all digits.
pub fn measurements(results: &Results) -> Table {
    let mut table = Table::new(
        "Measurements",
        &[
            "scene",
            "variant",
            "technique",
            "budget (spp)",
            "budget (s)",
            "seed",
            "samples per pixel",
            "seconds",
            "GPU seconds",
            "paths",
            "rays",
            "MSE",
            "relative MSE",
            "reference MSE",
            "reference relative MSE",
            "relative bias",
            "FLIP",
            "99.9 % quantile",
            "not finite",
            "pixels left out",
            "time",
            "key",
        ],
    );
    for scene in &results.scenes {
        for variant in &scene.variants {
            for one in variant.points.iter().flat_map(|point| &point.measurements) {
                let (spp, seconds) = match one.budget {
                    Budget::Spp(spp) => (Cell::Count(u64::from(spp)), "".into()),
                    Budget::Seconds(seconds) => ("".into(), Cell::Number(seconds)),
                };
                let count = |name: &str| Cell::Count(one.counters.get(name).copied().unwrap_or(0));
                table.row([
                    scene.address.as_str().into(),
                    variant.name.as_str().into(),
                    variant.technique.as_str().into(),
                    spp,
                    seconds,
                    Cell::Count(u64::from(one.seed)),
                    one.samples.into(),
                    one.seconds.into(),
                    one.gpu_seconds.into(),
                    count("paths"),
                    count("rays"),
                    one.error.mse.into(),
                    one.error.relative_mse.into(),
                    one.error.reference_mse.into(),
                    one.error.reference_relative_mse.into(),
                    one.relative_bias.map_or("".into(), Cell::Number),
                    one.flip.into(),
                    one.quantile_999.into(),
                    Cell::Count(one.non_finite),
                    Cell::Count(one.error.skipped),
                    one.time.as_str().into(),
                    one.key.as_str().into(),
                ]);
            }
        }
    }
    table
}

/// Facts and tables as Markdown, without a heading of the page.
pub fn markdown(results: &Results, scenes: &[SceneSeries]) -> String {
    let mut text = String::new();
    for fact in facts(results) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "- {fact}");
    }
    let _ = write!(text, "\n{}", overview(scenes).markdown());
    for scene in scenes {
        let _ = write!(text, "\n{}", budgets(scene).markdown());
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::series::{self, tests::made_up_scene};
    use super::super::sweep::Sweep;
    use super::*;

    pub(in super::super) fn made_up_results() -> Results {
        let sweep: Sweep = toml::from_str(
            "scenes = [\"builtin:ring\"]\nsize = [2, 1]\nspp = [4, 16, 64]\nrepeats = 3\nreference = { spp = 1024 }\n[[variant]]\nname = \"a\"\n",
        )
        .unwrap();
        Results {
            experiment: "made-up".into(),
            title: "Numbers <without> pictures".into(),
            about: "Compares <nothing> with nothing.".into(),
            systems: vec!["BG-3".into()],
            smoke: true,
            sweep,
            engine_version: "0".into(),
            device: "none".into(),
            driver: "none".into(),
            machine: "none".into(),
            load: Some("0.5".into()),
            interrupted: false,
            measured: 18,
            found: 0,
            scenes: vec![made_up_scene()],
        }
    }

    #[test]
    fn tables_hold_slopes_costs_and_every_measurement() {
        let results = made_up_results();
        let scenes = series::of(&results);
        let text = markdown(&results, &scenes);
        for word in [
            "-0.500 ± 0.000 | -0.500 ± 0.000 |",
            "| 6.400 |",
            "| 2.00 |",
            "Smoke run",
            "load average 0.5",
            "`builtin:ring` (138 triangles)",
        ] {
            assert!(text.contains(word), "{word}: {text}");
        }
        let csv = measurements(&results).csv();
        assert_eq!(csv.lines().count(), 1 + 18);
        assert!(csv.contains("\"<fast> & \"\"good\"\"\""), "{csv}");
    }

    #[test]
    fn pixels_left_out_are_said() {
        let mut results = made_up_results();
        assert!(!facts(&results).iter().any(|fact| fact.contains("left out")));
        results.scenes[0].variants[1].points[0].measurements[0].error.skipped = 7;
        results.scenes[0].variants[0].points[1].measurements[2].error.skipped = 1;
        for facts in [facts(&results), method(&results)] {
            let text = facts.join("\n");
            assert!(
                text.contains("**8 pixels left out** of the errors of 2 pictures"),
                "{text}"
            );
        }
    }
}
