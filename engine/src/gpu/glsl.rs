//! GLSL to SPIR-V while the program runs.
//!
//! By shaderc's own program `glslc` as in the build; with the feature `shaderc` by the library of that name inside this process, so that the
//! machine needs no compiler installed. Both get the flags of the build.

use std::path::Path;

use super::interface::ShaderInfo;
use crate::{Error, Result};

/// What a module is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To be read by reflection: unoptimized, so that unused bindings and all names stay.
    Reflection,
    /// To be run.
    Execution,
}

/// Compiles a source file that has taken the place of the one `info` came from.
///
/// # Errors
/// [`Error::Shader`] with the compiler's words, [`Error::Io`] when the file cannot be read or there is no compiler.
#[cfg(not(feature = "shaderc"))]
pub(super) fn compile(info: &ShaderInfo, source: &Path, includes: &Path, purpose: Purpose) -> Result<Vec<u8>> {
    let program = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
    let output = std::process::Command::new(&program)
        .args(["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3"])
        .args(match purpose {
            Purpose::Reflection => ["-O0"],
            Purpose::Execution => ["-O"],
        })
        .arg("-I")
        .arg(includes)
        .arg(source)
        .args(["-o", "-"])
        .output()
        .map_err(|error| Error::io(&program, error))?;
    if output.status.success() {
        Ok(output.stdout)
    } else {
        Err(shader_error(
            info,
            String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        ))
    }
}

/// Compiles a compute shader given as text.
///
/// # Errors
/// [`Error::Shader`] with the compiler's words, [`Error::Io`] when there is no compiler.
#[cfg(not(feature = "shaderc"))]
pub(super) fn compile_text(name: &str, text: &str, purpose: Purpose) -> Result<Vec<u8>> {
    use std::io::Write;
    use std::process::{Command, Stdio};

    let program = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
    let failed = |error| Error::io(&program, error);
    let mut child = Command::new(&program)
        .args([
            "-Werror",
            "--target-env=vulkan1.1",
            "--target-spv=spv1.3",
            "-fshader-stage=compute",
        ])
        .arg(match purpose {
            Purpose::Reflection => "-O0",
            Purpose::Execution => "-O",
        })
        .args(["-", "-o", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    // The compiler reads all of its input before it writes. One that ends early says why on its error stream.
    if let Some(mut input) = child.stdin.take() {
        let _ = input.write_all(text.as_bytes());
    }
    let output = child.wait_with_output().map_err(failed)?;
    if output.status.success() {
        return Ok(output.stdout);
    }
    Err(Error::Shader {
        name: name.into(),
        message: String::from_utf8_lossy(&output.stderr).trim().to_owned(),
    })
}

/// Compiles a compute shader given as text.
///
/// # Errors
/// [`Error::Shader`] with the compiler's words.
#[cfg(feature = "shaderc")]
pub(super) fn compile_text(name: &str, text: &str, purpose: Purpose) -> Result<Vec<u8>> {
    let wrong = |message: String| Error::Shader {
        name: name.into(),
        message,
    };
    if text.contains('\0') || name.contains('\0') {
        return Err(wrong("holds a NUL".into()));
    }
    let failed = |error: shaderc::Error| wrong(error.to_string());
    let compiler = shaderc::Compiler::new().map_err(failed)?;
    let options = options_for(purpose).map_err(failed)?;
    compiler
        .compile_into_spirv(text, shaderc::ShaderKind::Compute, name, "main", Some(&options))
        .map(|module| module.as_binary_u8().to_vec())
        .map_err(failed)
}

/// Compiles a source file that has taken the place of the one `info` came from.
///
/// # Errors
/// [`Error::Shader`] with the compiler's words, [`Error::Io`] when the file cannot be read.
#[cfg(feature = "shaderc")]
pub(super) fn compile(info: &ShaderInfo, source: &Path, includes: &Path, purpose: Purpose) -> Result<Vec<u8>> {
    use super::interface::Stage;

    let failed = |error: shaderc::Error| shader_error(info, error.to_string());
    let text = read(source).map_err(|error| Error::io(source, error))?;
    let compiler = shaderc::Compiler::new().map_err(failed)?;
    let mut options = options_for(purpose).map_err(failed)?;
    // A file beside the includer is asked for first; what is not there is asked for again as standard.
    options.set_include_callback(|name, kind, includer, _| {
        let folder = match kind {
            shaderc::IncludeType::Relative => Path::new(includer).parent().unwrap_or(includes),
            shaderc::IncludeType::Standard => includes,
        };
        let path = folder.join(name);
        Ok(shaderc::ResolvedInclude {
            content: read(&path).map_err(|error| format!("{}: {error}", path.display()))?,
            resolved_name: path.to_string_lossy().into_owned(),
        })
    });
    let kind = match info.stage {
        Stage::Compute => shaderc::ShaderKind::Compute,
        Stage::Vertex => shaderc::ShaderKind::Vertex,
        Stage::Geometry => shaderc::ShaderKind::Geometry,
        Stage::Fragment => shaderc::ShaderKind::Fragment,
    };
    compiler
        .compile_into_spirv(&text, kind, &source.to_string_lossy(), "main", Some(&options))
        .map(|module| module.as_binary_u8().to_vec())
        .map_err(failed)
}

/// The flags of the build's own modules.
#[cfg(feature = "shaderc")]
fn options_for(purpose: Purpose) -> std::result::Result<shaderc::CompileOptions<'static>, shaderc::Error> {
    let mut options = shaderc::CompileOptions::new()?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_1 as u32);
    options.set_target_spirv(shaderc::SpirvVersion::V1_3);
    options.set_warnings_as_errors();
    options.set_optimization_level(match purpose {
        Purpose::Reflection => shaderc::OptimizationLevel::Zero,
        Purpose::Execution => shaderc::OptimizationLevel::Performance,
    });
    Ok(options)
}

/// A file as text that a C string can hold.
#[cfg(feature = "shaderc")]
fn read(path: &Path) -> std::io::Result<String> {
    let text = std::fs::read_to_string(path)?;
    if text.contains('\0') {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidData, "holds a NUL"));
    }
    Ok(text)
}

/// The error of a shader.
pub(super) fn shader_error(info: &ShaderInfo, message: String) -> Error {
    Error::Shader {
        name: info.name.into(),
        message,
    }
}
