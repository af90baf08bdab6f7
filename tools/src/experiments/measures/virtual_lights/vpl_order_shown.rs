//! How a page shows rules by which points take lights: panels of light, of errors and of points that were sorted, and plots of time and error.

use clerestory::srgb::srgb_byte;
use clerestory::transport::environment::luminance;
use glam::DVec3;

use super::vpl_order::{LIMITS, PERIODS, Row};
use crate::experiments::findings::{Axes, Findings, Measured, Repeats, curves};
use crate::experiments::measures::pictures::Panel;

/// Error that is white in a panel.
const WHITE: f64 = 0.2;

/// Relative errors of points, from black to white.
pub fn errors_shown(found: &[DVec3], whole: &[DVec3]) -> Panel {
    let shown = |(found, whole): (&DVec3, &DVec3)| {
        let error = (luminance(*found - *whole) / luminance(*whole).max(f64::MIN_POSITIVE)).abs();
        [(255.0 * (error / WHITE).min(1.0)) as u8; 3]
    };
    found.iter().zip(whole).map(shown).collect()
}

/// Black for white.
pub fn inverted(panel: Panel) -> Panel {
    panel.into_iter().map(|color| color.map(|value| 255 - value)).collect()
}

/// White points that were sorted.
pub fn sorts_shown(sorted: &[bool]) -> Panel {
    sorted.iter().map(|sorted| [if *sorted { 255 } else { 0 }; 3]).collect()
}

/// Light of points, up to what is white.
pub fn light_shown(found: &[DVec3], white: f64) -> Panel {
    let shown = |radiance: &DVec3| radiance.to_array().map(|value| srgb_byte(value / white));
    found.iter().map(shown).collect()
}

/// Time over that of all lights by a number that each of some rules has; all of them take 90 % of the potential.
fn times_by(rules: &[Row], numbers: &[(&str, f64)]) -> Vec<(f64, Measured)> {
    let time = |(rule, number): &(&str, f64)| {
        let row = rules.iter().find(|row| row.is(rule, 90.0))?;
        let over = row.speed_up.0.iter().map(|speed| 1.0 / speed);
        Some((*number, over.collect::<Repeats>().measured()))
    };
    numbers.iter().filter_map(time).collect()
}

/// Time over that of all lights and error of the same rules, the fastest first.
fn errors_by_time(rules: &[Row], name: &str, numbers: &[(&str, f64)]) -> Vec<(String, f64, f64)> {
    let point = |(rule, _): &(&str, f64)| {
        let row = rules.iter().find(|row| row.is(rule, 90.0))?;
        Some((name.to_owned(), 1.0 / row.speed_up.measured().value, row.error))
    };
    let mut points: Vec<(String, f64, f64)> = numbers.iter().filter_map(point).collect();
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points
}

/// The plots of rules.
pub fn plots(found: Findings, rules: &[Row]) -> Findings {
    let (of_periods, of_limits) = ("a period", "a limit of misplaced lights");
    let scatter = [
        errors_by_time(rules, of_periods, &PERIODS),
        errors_by_time(rules, of_limits, &LIMITS),
    ]
    .concat();
    let times = |numbers: &[(&str, f64)]| {
        curves(
            &times_by(rules, numbers),
            |_| "90 % of the potential".into(),
            |(number, time)| (*number, *time),
        )
    };
    found
        .curves(
            "period",
            "Time against how many points share an order, 90 % of the potential",
            Axes::even(
                "points from sort to sort",
                "time over that of all lights",
                1.0,
                (5, 10.0),
            ),
            times(&PERIODS),
        )
        .curves(
            "limit",
            "Time against the limit of misplaced lights, 90 % of the potential",
            Axes::even("misplaced lights (%)", "time over that of all lights", 1.0, (6, 5.0)),
            times(&LIMITS),
        )
        .curves(
            "errors",
            "Errors against time, orders kept for a period or up to a limit, 90 % of the potential",
            Axes::even(
                "time over that of all lights",
                "mean relative error (%)",
                3.0,
                (10, 0.1),
            ),
            curves(
                &scatter,
                |(name, ..)| name.clone(),
                |(_, time, error)| (*time, (*error).into()),
            ),
        )
}
