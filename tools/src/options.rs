//! Options that several commands share, and the reading of sizes and times.

use std::time::Duration;

use clap::{Args, ValueEnum};
use clerestory::gpu::{DeviceSelection, Gpu, GpuOptions, Validation};

use crate::failure::Outcome;

/// Validation layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ValidationMode {
    /// None.
    Off,
    /// Core and synchronization checks.
    Core,
    /// Checks of every access to memory in shaders.
    Gpu,
}

/// By which error adaptive samples are shared out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Adaptive {
    /// That of the relative MSE.
    Relative,
    /// That of the MSE.
    Absolute,
    /// Every pixel gets as many.
    Off,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Global options")]
pub struct Global {
    /// Prints more to the error output; give it twice for everything
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

/// Which device, and whether the validation layers watch it: options of every command that opens one.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceOptions {
    /// Device, by its index or a part of its name (`lavapipe` is Mesa's software device); by default the fastest kind. `clerestory
    /// info` lists them
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Vulkan validation layers, whose errors fail the run; by default the value of CLERESTORY_VALIDATION, else off
    #[arg(long, value_name = "MODE")]
    pub validation: Option<ValidationMode>,
}

impl DeviceOptions {
    /// The device that is meant.
    pub fn selection(&self) -> DeviceSelection {
        self.device.as_deref().map_or(DeviceSelection::Fastest, |text| {
            text.parse().unwrap_or_else(|never| match never {})
        })
    }

    /// How to make the device.
    pub fn options(&self) -> GpuOptions {
        let mut options = GpuOptions {
            device: self.selection(),
            ..GpuOptions::default()
        };
        if let Some(mode) = self.validation {
            options.validation = match mode {
                ValidationMode::Off => Validation::Off,
                ValidationMode::Core => Validation::Core,
                ValidationMode::Gpu => Validation::GpuAssisted,
            };
        }
        options
    }

    /// Opens the device.
    pub fn open(&self) -> Outcome<Gpu> {
        Ok(Gpu::headless(&self.options())?)
    }
}

/// A picture's size on the command line: `WIDTHxHEIGHT`, or the height alone, which takes its width from the scene's aspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels across, when given.
    pub width: Option<u32>,
    /// Pixels down.
    pub height: u32,
}

/// Longest side of a picture, pixels.
const SIDE_MAX: u32 = 65_535;

impl Size {
    /// Height of pictures without a given size.
    pub const DEFAULT: Self = Self {
        width: None,
        height: 512,
    };

    /// Pixels across and down, for a scene composed for `aspect`.
    pub fn pixels(self, aspect: Option<f32>) -> [u32; 2] {
        let by_aspect = || {
            (self.height as f32 * aspect.unwrap_or(1.0))
                .round()
                .clamp(1.0, SIDE_MAX as f32) as u32
        };
        [self.width.unwrap_or_else(by_aspect), self.height]
    }
}

/// Reads `WxH` or `H`.
pub fn parse_size(text: &str) -> Result<Size, String> {
    let side = |text: &str| {
        let value: u32 = text.trim().parse().ok()?;
        (1..=SIDE_MAX).contains(&value).then_some(value)
    };
    let size = match text.split_once(['x', 'X', '×']) {
        Some((width, height)) => side(width).zip(side(height)).map(|(width, height)| Size {
            width: Some(width),
            height,
        }),
        None => side(text).map(|height| Size { width: None, height }),
    };
    size.ok_or_else(|| format!("write WIDTHxHEIGHT or a height alone, each from 1 to {SIDE_MAX}"))
}

/// Reads a time such as `10s`, `500ms`, `2.5min`, `1h`; a number alone means seconds.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let split = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit.trim() {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("units are ms, s, min and h".into()),
    };
    let seconds = number.trim().parse::<f64>().ok().filter(|value| *value > 0.0);
    seconds
        .and_then(|value| Duration::try_from_secs_f64(value * scale).ok())
        .ok_or_else(|| "write a time above 0, such as 10s, 500ms or 2min".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_a_height_or_both_sides_within_their_range() {
        let size = |text| parse_size(text).map(|size| size.pixels(Some(1.5)));
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(size("1X65535"), Ok([1, 65_535]));
        assert_eq!(size("512"), Ok([768, 512]));
        assert_eq!(Size::DEFAULT.pixels(None), [512, 512]);
        for wrong in ["", "0x4", "4x0", "-1x4", "65536x1", "4x4x4", "axb", "x", "4.5"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn durations_are_numbers_with_a_unit_or_in_seconds() {
        for (text, milliseconds) in [
            ("10s", 10_000),
            ("500ms", 500),
            ("2.5min", 150_000),
            ("1h", 3_600_000),
            ("3", 3000),
        ] {
            assert_eq!(parse_duration(text), Ok(Duration::from_millis(milliseconds)), "{text}");
        }
        for wrong in ["", "s", "0", "-1s", "10d", "nan", "inf", "1e400s", "1s1"] {
            assert!(parse_duration(wrong).is_err(), "{wrong}");
        }
    }
}
