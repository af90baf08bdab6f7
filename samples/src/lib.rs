//! Small programs that each show one use of the Clerestory rendering engine; here is what they share.

pub mod arguments;
pub mod orbit;
pub mod picture;
pub mod progressive;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clerestory::gpu::ValidationLog;
use clerestory::{Error, Result};

/// Runs a sample: its path of output is the first argument, or `out/<name>.png`. An error goes to the standard error stream.
pub fn run(name: &str, sample: impl FnOnce(&Path) -> Result<()>) -> ExitCode {
    let path = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from(format!("out/{name}.png")), PathBuf::from);
    report(sample(&path).map(|()| println!("wrote {}", path.display())))
}

/// The exit code of a result; an error goes to the standard error stream.
pub fn report(result: Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Fails when the validation layers (`CLERESTORY_VALIDATION=core`) have said anything.
///
/// # Errors
/// [`Error::Shader`] with the first message.
pub fn check_messages(log: &ValidationLog) -> Result<()> {
    match log.take().into_iter().next() {
        None => Ok(()),
        Some(message) => Err(Error::Shader {
            name: message.id,
            message: message.text,
        }),
    }
}

/// Writes rows of red, green, blue, alpha bytes as a PNG file, and makes the folder if there is none.
///
/// # Errors
/// [`Error::Io`] for the folder, [`Error::Picture`] for the file.
pub fn save_png(path: &Path, size: [u32; 2], pixels: &[u8]) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    }
    image::save_buffer_with_format(
        path,
        pixels,
        size[0],
        size[1],
        image::ColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(|error| Error::Picture {
        path: path.display().to_string(),
        cause: error.to_string(),
    })
}
