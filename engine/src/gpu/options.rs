//! What a host may choose about its device.

use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use super::caps::DescriptorLimits;
use super::fault::FaultPlan;
use super::host::OptionalFeatures;
use super::instance::DeviceSummary;
use crate::{Error, Result};

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

    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
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
    /// As the environment variable `CLERESTORY_VALIDATION` says: `off`, `core` or `gpu`; off when it is unset or empty. Any other value is
    /// an [`Error::Setting`] when a device is made.
    #[default]
    Environment,
    /// None.
    Off,
    /// Core and synchronization checks.
    Core,
    /// GPU-assisted checks (out-of-bounds access in shaders), without the core checks.
    GpuAssisted,
}

/// The variable that [`Validation::Environment`] obeys.
const VALIDATION_VARIABLE: &str = "CLERESTORY_VALIDATION";

impl Validation {
    /// One of the others in place of [`Validation::Environment`].
    ///
    /// # Errors
    /// [`Error::Setting`] when the environment variable has an unknown value.
    pub fn resolve(self) -> Result<Self> {
        match self {
            Self::Environment => std::env::var_os(VALIDATION_VARIABLE)
                .map_or(Ok(Self::Off), |value| Self::of_variable(&value.to_string_lossy())),
            chosen => Ok(chosen),
        }
    }

    fn of_variable(value: &str) -> Result<Self> {
        match value {
            "core" => Ok(Self::Core),
            "gpu" => Ok(Self::GpuAssisted),
            "off" | "" => Ok(Self::Off),
            other => Err(Error::setting(
                VALIDATION_VARIABLE,
                other,
                "is not one of off, core and gpu",
            )),
        }
    }
}

/// How to make a device.
#[derive(Debug, Clone)]
pub struct GpuOptions {
    /// Which device.
    pub device: DeviceSelection,
    /// Validation layers; the default obeys the environment variable `CLERESTORY_VALIDATION`.
    pub validation: Validation,
    /// Folder of the pipeline cache; `None` keeps none. The default is the folder `clerestory` in `$XDG_CACHE_HOME`, else in `$HOME/.cache`, else in
    /// `%LOCALAPPDATA%`, the first of these that is an absolute path.
    ///
    /// A file there is trusted as the driver is: it reaches the driver once length, version, device and hash fit, which finds
    /// what is damaged, but not what somebody has forged who may write there. A folder that others may write to is not for this. What does not fit is
    /// removed with one warning and made anew. Processes may share a folder.
    pub cache_folder: Option<PathBuf>,
    /// Writes a marker before every pass, so that a lost device names the last one that was reached. Costs a pass a 4-byte fill between two
    /// barriers, so that passes do not overlap; off, they overlap as far as their own barriers allow.
    pub crash_markers: bool,
    /// Makes the n-th call of a Vulkan command fail, for tests. One device at a time has a plan: a second is an [`Error::Setting`].
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
    /// At most these optional features are enabled, and `robustBufferAccess` in any case where there is any.
    pub features: Option<OptionalFeatures>,
    /// At most as many workgroups of a dispatch, along each axis.
    pub max_workgroups: Option<[u32; 3]>,
    /// At most as many bytes in the device's heaps.
    pub heap_bytes: Option<u64>,
    /// At most as many bytes of a storage buffer.
    pub max_storage_buffer_range: Option<u64>,
    /// At most as many texels of a texel buffer.
    pub max_texel_buffer_elements: Option<u64>,
}

/// Where caches are kept, by the environment. What is empty or relative would depend on the folder that a program happens to run in.
fn default_cache_folder(variable: impl Fn(&'static str) -> Option<OsString>) -> Option<PathBuf> {
    let folder = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    folder("XDG_CACHE_HOME")
        .or_else(|| folder("HOME").map(|home| home.join(".cache")))
        .or_else(|| folder("LOCALAPPDATA"))
        .map(|caches| caches.join("clerestory"))
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self {
            device: DeviceSelection::default(),
            validation: Validation::default(),
            cache_folder: default_cache_folder(std::env::var_os),
            crash_markers: true,
            fault: None,
            lesser: Lesser::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caches_lie_in_the_first_absolute_folder() {
        let root = if cfg!(windows) { "C:/" } else { "/" };
        let folders = ["x", "h", "l"].map(|name| format!("{root}{name}"));
        let [x, h, l] = folders.each_ref().map(String::as_str);
        let cases = [
            ([Some(x), Some(h), None], Some("x/clerestory")),
            ([None, Some(h), Some(l)], Some("h/.cache/clerestory")),
            ([Some(""), Some(h), None], Some("h/.cache/clerestory")),
            ([Some("x"), Some(h), None], Some("h/.cache/clerestory")),
            ([Some("./x"), Some(".."), Some(l)], Some("l/clerestory")),
            ([Some(""), Some(""), Some("")], None),
            ([None, Some("h"), Some("l")], None),
            ([None; 3], None),
        ];
        for (values, expected) in cases {
            let variable = |wanted: &str| {
                let names = ["XDG_CACHE_HOME", "HOME", "LOCALAPPDATA"];
                let found = names.iter().position(|name| *name == wanted)?;
                values[found].map(OsString::from)
            };
            let expected = expected.map(|path| PathBuf::from(format!("{root}{path}")));
            assert_eq!(default_cache_folder(variable), expected, "{values:?}");
        }
    }

    #[test]
    fn an_unknown_value_of_the_variable_is_an_error() {
        let known = [
            ("", Validation::Off),
            ("off", Validation::Off),
            ("core", Validation::Core),
            ("gpu", Validation::GpuAssisted),
        ];
        for (value, expected) in known {
            assert_eq!(Validation::of_variable(value).ok(), Some(expected));
        }
        match Validation::of_variable("Core") {
            Err(Error::Setting { name, value, .. }) => {
                assert_eq!((name.as_str(), value.as_str()), ("CLERESTORY_VALIDATION", "Core"));
            }
            other => panic!("expected a refused setting, got {other:?}"),
        }
        assert_eq!(Validation::Core.resolve().ok(), Some(Validation::Core));
    }
}
