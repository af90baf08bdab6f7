//! The engine's one error type, by cause.
//!
//! Every variant says what went wrong, where, and, when there is one, the way round it.

use std::path::PathBuf;

/// What an engine call returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader or a driver is not installed.
    #[error("no Vulkan loader: {0}; install one (Debian: libvulkan1 and mesa-vulkan-drivers)")]
    NoVulkan(String),
    /// No device answers the selection.
    #[error("no Vulkan device matches {wanted:?}; there is: {found}")]
    NoDevice {
        /// The selection as given.
        wanted: String,
        /// The devices that exist, as one line.
        found: String,
    },
    /// A device lacks what a technique or a kernel needs.
    #[error("{needed_by} needs {feature}, which {device} lacks; {instead}")]
    MissingFeature {
        /// The feature, extension or limit by its Vulkan name.
        feature: String,
        /// The technique, kernel or call that needs it.
        needed_by: String,
        /// The device's name.
        device: String,
        /// The way round it.
        instead: String,
    },
    /// An allocation did not fit.
    #[error("out of {memory} memory for {name:?} ({bytes} bytes): {cause}")]
    OutOfMemory {
        /// `device` or `host`.
        memory: &'static str,
        /// The allocation's name.
        name: String,
        /// Bytes asked for.
        bytes: u64,
        /// What the driver or the allocator said.
        cause: String,
    },
    /// Something is larger than a limit of the device or of the engine allows. Buffers are in bytes; else the limit's name says what counts.
    #[error("{name:?} needs {value}, more than {limit_name} = {limit}")]
    LimitExceeded {
        /// The buffer's or image's name.
        name: String,
        /// What was asked for, in the unit of the limit: bytes, texels, groups or elements.
        value: u64,
        /// The limit's name, that of Vulkan where it is one of a device.
        limit_name: &'static str,
        /// Its value.
        limit: u64,
    },
    /// The device was lost while it worked.
    #[error("the device was lost in or after pass {last_pass:?}; the Gpu must be created again")]
    DeviceLost {
        /// The last pass that the crash markers saw begin.
        last_pass: String,
    },
    /// A Vulkan call failed with a code that has no variant of its own.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The Vulkan command.
        call: &'static str,
        /// Its result code.
        result: ash::vk::Result,
    },
    /// A pass reads or writes what an earlier one wrote, with no barrier between (debug builds).
    #[error("pass {pass:?} {access} buffer {buffer:?} with no barrier after pass {earlier:?}")]
    MissingBarrier {
        /// The pass that was recorded last.
        pass: String,
        /// `reads` or `writes`.
        access: &'static str,
        /// The buffer's name.
        buffer: String,
        /// The pass that touched it before.
        earlier: String,
    },
    /// A wait passed its time limit; the work goes on and can be waited for again.
    #[error("the device did not finish {what:?} within {seconds} s")]
    TimedOut {
        /// The submission's name.
        what: String,
        /// Seconds waited.
        seconds: f64,
    },
    /// A kernel reported that a bounded buffer or quota was too small, and growing it did not help.
    #[error("{kernel}: {what} needed {needed}, had {capacity}; {instead}")]
    Overflow {
        /// The kernel.
        kernel: String,
        /// What overflowed.
        what: String,
        /// Needed count.
        needed: u64,
        /// Available count.
        capacity: u64,
        /// The way round it.
        instead: String,
    },
    /// Something that holds for every input does not: a fault of the engine itself.
    #[error("{what} {fault}; this is a fault of the engine")]
    Internal {
        /// What was made.
        what: String,
        /// What is wrong with it.
        fault: String,
    },
    /// A shader did not compile or reflect (run-time compilation only).
    #[error("shader {name}: {message}")]
    Shader {
        /// Path below `shaders/`.
        name: String,
        /// The compiler's words.
        message: String,
    },
    /// The source of a kernel that came in at run time holds a mistake.
    #[error("kernel {kernel}: line {line}, column {column}: {message}")]
    KernelSource {
        /// The kernel's name.
        kernel: String,
        /// From 1; 0 where the mistake has no place.
        line: u32,
        /// In bytes, from 1; 0 where the compiler does not say.
        column: u32,
        /// What is wrong.
        message: String,
    },
    /// What was given to a kernel that came in at run time is not what its source asks for.
    #[error("kernel {kernel}: {binding} {cause}")]
    Binding {
        /// The kernel's name.
        kernel: String,
        /// The binding as the source names it, or as it was given; `push constants` for these.
        binding: String,
        /// What is wrong.
        cause: String,
    },
    /// A scene file or address holds something wrong.
    #[error("{file}: {at}: {cause}")]
    Scene {
        /// File or `builtin:` address.
        file: String,
        /// Where inside (`meshes[3].primitives[0]`, `line 4`, `key "lights"`).
        at: String,
        /// What is wrong.
        cause: String,
    },
    /// A technique cannot model what the scene needs.
    #[error("technique {technique} cannot render this scene: {}", reasons.join("; "))]
    Unsupported {
        /// The technique's id.
        technique: String,
        /// One sentence a reason.
        reasons: Vec<String>,
    },
    /// A setting is out of its range.
    #[error("setting {name}: {value} {cause}")]
    Setting {
        /// The setting's name.
        name: String,
        /// The value as given.
        value: String,
        /// Why not.
        cause: String,
    },
    /// A picture could not be read, written or compared.
    #[error("{path}: {cause}")]
    Picture {
        /// The file, or a description of the picture.
        path: String,
        /// What is wrong.
        cause: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's word.
        source: std::io::Error,
    },
}

impl Error {
    /// A file error with its path.
    pub fn io(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io {
            path: path.into(),
            source,
        }
    }

    /// An error of a setting: the value as given, and why it cannot be.
    pub fn setting(name: impl Into<String>, value: impl ToString, cause: impl Into<String>) -> Self {
        Self::Setting {
            name: name.into(),
            value: value.to_string(),
            cause: cause.into(),
        }
    }

    /// A scene error with its place.
    pub fn scene(file: impl Into<String>, at: impl Into<String>, cause: impl Into<String>) -> Self {
        Self::Scene {
            file: file.into(),
            at: at.into(),
            cause: cause.into(),
        }
    }
}
