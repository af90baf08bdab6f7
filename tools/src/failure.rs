//! How the program fails: an exit code that scripts can use, one line that says what is wrong, and a second line that helps where there is one.

use std::io::Write;
use std::process::ExitCode;

use clerestory::Error;

use crate::output;

/// The exit codes, as the help names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// The run failed: device lost, out of memory, a file that cannot be read or written.
    Run = 1,
    /// The command line asks for the impossible, pictures of different sizes to compare included.
    Usage = 2,
    /// The scene cannot be read, or the technique cannot render it.
    Scene = 3,
    /// Pictures differ beyond a threshold, or a hard case fails.
    Differ = 4,
    /// No Vulkan device, or none that can do it.
    NoDevice = 5,
    /// Stopped by Ctrl-C (128 + SIGINT).
    Interrupted = 130,
}

impl From<Code> for ExitCode {
    fn from(code: Code) -> Self {
        ExitCode::from(code as u8)
    }
}

/// A failure with its exit code.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub code: Code,
    /// What is wrong, as one line.
    pub message: String,
    /// What may help.
    pub hint: Option<String>,
}

/// What the commands return.
pub type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    /// A command line that asks for the impossible.
    pub fn usage(message: impl Into<String>) -> Self {
        Self {
            code: Code::Usage,
            message: message.into(),
            hint: None,
        }
    }

    /// An error met while a scene was read: a missing file is then a scene error too.
    pub fn scene(error: Error) -> Self {
        let unread = matches!(error, Error::Io { .. });
        let mut failure = Self {
            code: Code::Scene,
            ..Self::from(error)
        };
        if unread {
            failure.hint =
                Some("`clerestory scenes` lists the generated scenes; files may be gltf, glb, ply, obj, toml".into());
        }
        failure
    }

    /// The same failure with a hint.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Prints the failure to the error output.
    pub fn report(&self) {
        // A closed error output leaves nobody to tell.
        let mut stderr = std::io::stderr().lock();
        let _ = writeln!(
            stderr,
            "{} {}",
            output::red("error:", output::Stream::Error),
            output::one_line(&self.message)
        );
        if let Some(hint) = &self.hint {
            let _ = writeln!(stderr, "hint: {}", output::one_line(hint));
        }
    }
}

/// How the causes of settings begin that are read from text by themselves.
const WITHIN: &str = "does not fit: setting ";

/// What a setting names, for those whose values are names.
fn called(setting: &str) -> Option<&'static str> {
    match setting {
        "technique" => Some("technique"),
        "camera" => Some("camera"),
        "scenes" => Some("scene"),
        _ => None,
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match &error {
            Error::NoVulkan(_) | Error::NoDevice { .. } | Error::MissingFeature { .. } => Code::NoDevice,
            Error::Scene { .. } | Error::Unsupported { .. } => Code::Scene,
            Error::Setting { .. } => Code::Usage,
            _ => Code::Run,
        };
        let text = match &error {
            Error::NoDevice { wanted, .. } if wanted == "Fastest" => "there is no Vulkan device".into(),
            Error::NoDevice { wanted, found } => {
                let wanted = wanted.trim_end_matches(')');
                let wanted = wanted.split_once('(').map_or(wanted, |(_, what)| what);
                format!("no Vulkan device is called or numbered {wanted}; there is {found}")
            }
            Error::Setting { name, value, cause } if called(name).is_some() && cause.contains("; ") => {
                let (_, there_is) = cause.split_once("; ").unwrap_or_default();
                format!("no {} is called {value}; {there_is}", called(name).unwrap_or(name))
            }
            Error::Setting { name, value, cause } if cause.starts_with(WITHIN) => {
                // A setting that is read from text by itself repeats its name and value.
                let inner = cause.strip_prefix(WITHIN).and_then(|inner| inner.split_once(": "));
                let inner = inner.map_or(cause.as_str(), |(_, inner)| inner);
                let repeated = [value.as_str(), value.trim_matches('"')];
                let rest = repeated.iter().find_map(|value| inner.strip_prefix(value));
                let inner = rest.unwrap_or(inner).trim_start();
                format!("setting {name}: {value} {inner}")
            }
            // The settings as a whole are long; the cause names the one that is wrong.
            Error::Setting { name, cause, .. } if name == "settings" => format!("--settings: {cause}"),
            _ => error.to_string(),
        };
        // Most errors of the engine say the way round after the first semicolon.
        let (message, hint) = match &error {
            Error::Unsupported { .. } => (
                text,
                Some("`clerestory info SCENE` says which techniques can render a scene".into()),
            ),
            Error::OutOfMemory { .. } | Error::LimitExceeded { .. } => (
                text,
                Some(
                    "a smaller picture (--size) or scene takes less; `clerestory info` lists the limits of each device"
                        .into(),
                ),
            ),
            Error::Vulkan { .. } | Error::Io { .. } | Error::Picture { .. } | Error::Shader { .. } => (text, None),
            _ => match text.split_once("; ") {
                Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
                None => (text, None),
            },
        };
        Self { code, message, hint }
    }
}
