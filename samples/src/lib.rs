//! Small programs that each show one use of the Clerestory rendering engine; here is what they share.

pub mod arguments;
pub mod carousel;
pub mod lettering;
pub mod live_map;
pub mod live_photons;
pub mod orbit;
pub mod panels;
pub mod progressive;
pub mod shaders;
pub mod showroom;
pub mod small_gltf;
pub mod solids;
pub mod window;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clerestory::gpu::ValidationLog;
use clerestory::{Error, Result};

use arguments::Arguments;

/// Runs a sample: its path of output is the first argument, or `out/<name>.png`. An error goes to the standard error stream.
pub fn run(name: &str, sample: impl FnOnce(&Path) -> Result<()>) -> ExitCode {
    run_with(name, &[], |path, _| sample(path))
}

/// As [`run`], for a sample with options of these names.
pub fn run_with(name: &str, options: &[&str], sample: impl FnOnce(&Path, &Arguments) -> Result<()>) -> ExitCode {
    report(Arguments::of_process(options, 1).and_then(|arguments| {
        let path = arguments
            .alone(0)
            .map_or_else(|| PathBuf::from(format!("out/{name}.png")), PathBuf::from);
        sample(&path, &arguments)?;
        println!("wrote {}", path.display());
        Ok(())
    }))
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

/// Makes the folder that a file is to lie in.
///
/// # Errors
/// [`Error::Io`] for the folder.
pub fn make_folder(file: &Path) -> Result<()> {
    match file.parent() {
        Some(folder) => std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error)),
        None => Ok(()),
    }
}

/// Writes rows of red, green, blue, alpha bytes as a PNG file, and makes the folder if there is none.
///
/// # Errors
/// [`Error::Io`] for the folder, [`Error::Picture`] for the file.
pub fn save_png(path: &Path, size: [u32; 2], pixels: &[u8]) -> Result<()> {
    make_folder(path)?;
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
