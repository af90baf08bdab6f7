//! Walks from a lamp and the virtual lights that they leave: how many, with how much power after each scattering, by roulette and by number.
//!
//! Oracle: a geometric series, since all surfaces reflect alike. Sources of what this follows: A. Keller, "Instant Radiosity", SIGGRAPH 1997; the chapter on virtual
//! light sources of a doctoral thesis on metals and reflections on graphics hardware, figure 6.1.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::techniques::instant_radiosity::selection::{SurfaceLight, Survival};

use super::unit_box::{RHO, UnitBox};
use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows};
use crate::experiments::measures::Context;

/// Walks of a pass, and passes, each with a seed of its own; the same of a smoke run.
const WORK: [(u32, u32); 2] = [(20, 256), (20, 32)];
/// Scatterings whose power is told.
const BOUNCES: u32 = 8;
/// Lights of a picture, its size, and half of a dot's sides.
const SHOWN: &str = "vpl-walks.png";
const SIZE: [u32; 2] = [384, 240];
const DOT: i32 = 2;

rows! {
    /// A way to end walks.
    struct Row = "Lights that walks leave" by [survival] {
        survival: String = "walks end",
        walks: u64 = "walks of a pass",
        passes: u64 = "passes",
        lights: f64 = "lights of a walk",
        expected: f64 = "lights of a walk, exact",
        off: f64 = "lights of a walk, off by (standard errors)",
        spread: f64 = "standard deviation of a pass's power (%)",
    }
}
rows! {
    /// Lights after so many scatterings.
    struct Power = "Power after each scattering" by [survival, bounce] {
        survival: String = "walks end",
        bounce: u64 = "scatterings",
        power: f64 = "power over the lamp's",
        expected: f64 = "exact",
        off: f64 = "off by (standard errors)",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
    power: Vec<Power>,
}

const ROULETTE: &str = "by roulette";
const FRACTIONAL: &str = "by number";
const WAYS: [(&str, Survival); 2] = [(ROULETTE, Survival::Roulette), (FRACTIONAL, Survival::Fractional)];

const OF_ROWS: &[Criterion<Row>] = &[Criterion::each(
    "a walk leaves 1 + 1 / (1 − ρ) = 6 lights: off by (standard errors)",
    Bound::Between(-4.0, 4.0),
    |row: &Row| row.off.into(),
)];
const OF_POWER: &[Criterion<Power>] = &[Criterion::each(
    "the power after k scatterings is ρᵏ of the lamp's: off by (standard errors)",
    Bound::Between(-4.5, 4.5),
    |row: &Power| row.off.into(),
)];

/// The mean of independent values, and how many of its standard errors it is off; 0 where they do not spread and are right to rounding.
fn off(values: &[f64], expected: f64) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = (squares / (n * (n - 1.0))).sqrt();
    let difference = mean - expected;
    let is_rounding = difference.abs() < 1e-9;
    (mean, if is_rounding { 0.0 } else { difference / error })
}

fn power_after(lights: &[SurfaceLight], bounce: u32) -> f64 {
    lights
        .iter()
        .filter(|light| light.bounce == bounce)
        .map(|light| light.power.x)
        .sum()
}

/// The view of the box, bright where its surfaces face the eye, with lights as dots: black of the lamp's own points, and darker the earlier they are.
fn picture(unit_box: &UnitBox, lights: &[SurfaceLight]) -> Result<Rgb8> {
    let [width, height] = SIZE;
    let mut shown = Rgb8 {
        width,
        height,
        bytes: Vec::new(),
    };
    for point in unit_box.points(SIZE)? {
        let lit = 0.55 + 0.25 * point.normal.y.abs() + 0.15 * point.normal.x.abs();
        shown.bytes.extend([(255.0 * lit) as u8; 3]);
    }
    for light in lights {
        let Some(pixel) = unit_box.pixel_of(light.position, SIZE) else {
            continue;
        };
        let (x, y) = ((pixel as u32 % width) as i32, (pixel as u32 / width) as i32);
        let value = (24 * light.bounce).min(160) as u8;
        for (dx, dy) in (-DOT..=DOT).flat_map(|dy| (-DOT..=DOT).map(move |dx| (dx, dy))) {
            let (x, y) = (x + dx, y + dy);
            if (0..width as i32).contains(&x) && (0..height as i32).contains(&y) {
                let byte = 3 * (y * width as i32 + x) as usize;
                shown.bytes[byte..byte + 3].fill(value);
            }
        }
    }
    Ok(shown)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let unit_box = UnitBox::load()?;
        let (walks, passes) = context.pick(WORK[0], WORK[1]);
        let mut found = Self::default();
        for (name, survival) in WAYS {
            let all: Vec<Vec<SurfaceLight>> = (0..passes).map(|seed| unit_box.lights(walks, seed, survival)).collect();
            let counts: Vec<f64> = all
                .iter()
                .map(|lights| lights.len() as f64 / f64::from(walks))
                .collect();
            let expected = 1.0 + 1.0 / (1.0 - RHO);
            // Of the lamp's own light and all that is scattered.
            let powers: Vec<f64> = all
                .iter()
                .map(|lights| lights.iter().map(|light| light.power.x).sum())
                .collect();
            let (lights, lights_off) = off(&counts, expected);
            let mean = powers.iter().sum::<f64>() / powers.len() as f64;
            let squares: f64 = powers.iter().map(|power| (power / mean - 1.0).powi(2)).sum();
            found.rows.push(Row {
                survival: name.into(),
                walks: walks.into(),
                passes: passes.into(),
                lights,
                expected,
                off: lights_off,
                spread: 100.0 * (squares / powers.len() as f64).sqrt(),
            });
            for bounce in 0..=BOUNCES {
                let values: Vec<f64> = all.iter().map(|lights| power_after(lights, bounce)).collect();
                let expected = RHO.powi(bounce as i32);
                let (power, off) = off(&values, expected);
                found.power.push(Power {
                    survival: name.into(),
                    bounce: bounce.into(),
                    power,
                    expected,
                    off,
                });
            }
            if survival == Survival::Roulette
                && let Some(lights) = all.first()
            {
                context.picture(SHOWN, &picture(&unit_box, lights)?);
            }
        }
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let spread = |name: &str| self.rows.iter().find(|row| row.survival == name).map(|row| row.spread);
        let ratio = spread(FRACTIONAL).zip(spread(ROULETTE)).map(|(a, b)| (a / b).into());
        let rows = Findings::of(&self.rows, OF_ROWS)
            .headline("spread of a pass's power by number over that by roulette", ratio)
            .note("The unit box, reflectance 0.8 everywhere, a lamp of one watt whose own points are lights; each pass has a seed of its own.");
        let rows = if self.rows.is_empty() {
            rows
        } else {
            rows.picture(
                SHOWN,
                "The virtual lights of twenty walks as dots, darker the less often their light was scattered.",
            )
        };
        rows.and(Findings::of(&self.power, OF_POWER))
    }
}
