//! What a host may choose about its device.

use std::path::PathBuf;
use std::str::FromStr;

use super::caps::DescriptorLimits;
use super::fault::FaultPlan;
use super::instance::DeviceSummary;

/// Which device to take.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum DeviceSelection {
    /// The fastest kind there is: discrete, integrated, virtual, then software.
    #[default]
    Fastest,
    /// By index in the loader's order.
    Index(usize),
    /// By a part of its name, in any case. `lavapipe` also finds Mesa's name for it, `llvmpipe`.
    Name(String),
}

impl FromStr for DeviceSelection {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(text.parse().map_or_else(|_| Self::Name(text.to_owned()), Self::Index))
    }
}

impl DeviceSelection {
    /// True when the device is one of those meant.
    pub fn matches(&self, summary: &DeviceSummary) -> bool {
        match self {
            Self::Fastest => true,
            Self::Index(index) => summary.index == *index,
            Self::Name(name) => {
                let (name, device) = (
                    name.to_lowercase(),
                    format!("{} {}", summary.name, summary.driver).to_lowercase(),
                );
                device.contains(&name) || (name == "lavapipe" && device.contains("llvmpipe"))
            }
        }
    }
}

/// Which validation layers run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Validation {
    /// None.
    #[default]
    Off,
    /// Core and synchronization checks.
    Core,
    /// GPU-assisted checks (out-of-bounds access in shaders), without the core checks.
    GpuAssisted,
}

/// How to make a device.
#[derive(Debug, Clone)]
pub struct GpuOptions {
    /// Which device.
    pub device: DeviceSelection,
    /// Validation layers; the default obeys the environment variable `CLERESTORY_VALIDATION` (`off`, `core`, `gpu`).
    pub validation: Validation,
    /// Folder of the pipeline cache; `None` keeps none. The default is `$XDG_CACHE_HOME/clerestory`, else `~/.cache/clerestory`.
    pub cache_folder: Option<PathBuf>,
    /// Writes a marker before every pass, so that a lost device names the last one that was reached. Costs a pass a 4-byte fill between two
    /// barriers, so that passes do not overlap; off, they overlap as far as their own barriers allow.
    pub crash_markers: bool,
    /// Makes the n-th call of a Vulkan command fail, for tests.
    pub fault: Option<FaultPlan>,
    /// Makes the device look smaller than it is, for tests.
    pub lesser: Lesser,
}

/// A device made to look smaller than it is, so that what happens on lesser hardware can be tested on any.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lesser {
    /// Descriptor limits in place of the device's, none of them higher.
    pub descriptors: Option<DescriptorLimits>,
    /// At most as many bits of a timestamp count.
    pub timestamp_valid_bits: Option<u32>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        let validation = match std::env::var("CLERESTORY_VALIDATION").as_deref() {
            Ok("core") => Validation::Core,
            Ok("gpu") => Validation::GpuAssisted,
            Ok("off" | "") | Err(_) => Validation::Off,
            Ok(other) => {
                tracing::warn!("CLERESTORY_VALIDATION is {other:?}; it can be off, core or gpu");
                Validation::Off
            }
        };
        let cache = std::env::var_os("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")));
        Self {
            device: DeviceSelection::default(),
            validation,
            cache_folder: cache.map(|folder| folder.join("clerestory")),
            crash_markers: true,
            fault: None,
            lesser: Lesser::default(),
        }
    }
}
