//! Kernels compiled anew while the program runs, when their source changes.
//!
//! The source is looked at by its time of change; a new one is compiled by `glslc` (or in this process, with the feature `shaderc`) and
//! reflected by the same code as in the build. It takes the place of the pipeline only when it compiles and its interface is the one that
//! the program was built with; else the old one stays.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::device::Gpu;
use super::glsl::{self, Purpose, shader_error};
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
    ///
    /// # Safety
    /// Whatever stands in the folder while this lives, a kernel that compiles there stays inside its own arrays (those of an invocation and of a
    /// workgroup), as a [`ComputeShader`] promises: nobody else writes there.
    pub unsafe fn new(gpu: &Gpu, shaders: &Path, spec: K::Spec) -> Result<Self> {
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

    /// Searches includes in another folder than `include` beside the sources: that of the engine, for kernels of another crate.
    #[must_use]
    pub fn with_includes(mut self, folder: &Path) -> Self {
        self.includes = folder.to_owned();
        self
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
        let compile = |purpose| glsl::compile(info, &self.source, &self.includes, purpose);
        let (reflected, spirv) = (compile(Purpose::Reflection)?, compile(Purpose::Execution)?);
        let interface = reflect::reflect(&reflected, &spirv).map_err(|message| shader_error(info, message))?;
        // Layouts hold what the embedded module uses.
        let held: BTreeSet<_> = info.used_bindings().map(|b| (b.set, b.binding)).collect();
        if interface.fingerprint() != info.fingerprint || !interface.used.is_subset(&held) {
            return Err(shader_error(
                info,
                "the new source has another interface (bindings declared or used, blocks, constants or workgroup size); build the program \
                 anew"
                    .into(),
            ));
        }
        self.pipeline = ComputePipeline::from_spirv(&self.gpu, &spirv, &self.spec)?;
        Ok(true)
    }
}

fn changed(source: &Path) -> Result<SystemTime> {
    std::fs::metadata(source)
        .and_then(|data| data.modified())
        .map_err(|error| Error::io(source, error))
}
