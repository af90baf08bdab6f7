//! Kernels compiled anew while the program runs, when their source changes.
//!
//! The source is looked at by its time of change; a new one is compiled by `glslc` and reflected by the same code as in the build. It takes
//! the place of the pipeline only when it compiles and its interface is the one that the program was built with; else the old one stays.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use super::device::Gpu;
use super::interface::ComputeShader;
use super::pipeline::ComputePipeline;
use super::reflect;
use crate::{Error, Result};

/// A kernel that follows its source file.
pub struct HotReload<K: ComputeShader> {
    gpu: Gpu,
    spec: K::Spec,
    source: PathBuf,
    includes: PathBuf,
    /// When the source had changed last at the last look.
    seen: Option<SystemTime>,
    pipeline: ComputePipeline<K>,
}

impl<K: ComputeShader> HotReload<K> {
    /// Starts with the embedded module. `shaders` is the folder that holds the kernel's source under the name it was built by, and the
    /// `include` folder. A source that is newer than the program is taken at the first change after this call.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`]; [`Error::Io`] when there is no such source.
    pub fn new(gpu: &Gpu, shaders: &Path, spec: K::Spec) -> Result<Self> {
        let source = shaders.join(K::info().name);
        Ok(Self {
            seen: Some(changed(&source)?),
            pipeline: gpu.compute_pipeline::<K>(&spec)?,
            gpu: gpu.clone(),
            spec,
            includes: shaders.join("include"),
            source,
        })
    }

    /// The newest pipeline that works.
    pub fn pipeline(&self) -> &ComputePipeline<K> {
        &self.pipeline
    }

    /// Looks at the source, and takes it when it has changed. True when there is a new pipeline. Work that was submitted goes on with the
    /// old one.
    ///
    /// # Errors
    /// [`Error::Shader`] with the compiler's words, or when the new source has another interface; [`Error::Io`] when it cannot be read. The
    /// old pipeline stays, and the same source is not tried again.
    pub fn poll(&mut self) -> Result<bool> {
        let now = changed(&self.source)?;
        if self.seen == Some(now) {
            return Ok(false);
        }
        self.seen = Some(now);
        let info = K::info();
        let reflected = self.compile(&["-g", "-O0"])?;
        let interface = reflect::reflect(&reflected).map_err(shader_error(info.name))?;
        if interface.fingerprint() != info.fingerprint {
            return Err(shader_error(info.name)(
                "the new source has another interface (bindings, blocks, constants or workgroup size); build the program anew".into(),
            ));
        }
        let spirv = self.compile(&["-O"])?;
        self.pipeline = ComputePipeline::from_spirv(&self.gpu, &spirv, &self.spec)?;
        Ok(true)
    }

    fn compile(&self, flags: &[&str]) -> Result<Vec<u8>> {
        let program = std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into());
        let output = Command::new(&program)
            .args(["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3"])
            .args(flags)
            .arg("-I")
            .arg(&self.includes)
            .arg(&self.source)
            .args(["-o", "-"])
            .output()
            .map_err(|error| Error::io(&program, error))?;
        if output.status.success() {
            Ok(output.stdout)
        } else {
            Err(shader_error(K::info().name)(
                String::from_utf8_lossy(&output.stderr).trim().to_owned(),
            ))
        }
    }
}

fn changed(source: &Path) -> Result<SystemTime> {
    std::fs::metadata(source)
        .and_then(|data| data.modified())
        .map_err(|error| Error::io(source, error))
}

fn shader_error(name: &str) -> impl Fn(String) -> Error {
    move |message| Error::Shader {
        name: name.into(),
        message,
    }
}
