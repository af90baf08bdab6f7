//! GLSL to SPIR-V with its interface, by shaderc.

use super::{Module, OwnBinding};
use crate::gpu::glsl::{self, Purpose};
use crate::gpu::interface::BindingKind;
use crate::gpu::reflect::{self, Resource, Type};
use crate::{Error, Result};

/// The module of a source.
pub(super) fn translate(name: &str, source: &str) -> Result<Module> {
    let compile = |purpose| glsl::compile_text(name, source, purpose).map_err(|error| placed(name, error));
    let mistake = |message: String| Error::KernelSource {
        kernel: name.into(),
        line: 0,
        column: 0,
        message,
    };
    let (reflected, spirv) = (compile(Purpose::Reflection)?, compile(Purpose::Execution)?);
    let interface = reflect::reflect(&reflected, &spirv).map_err(mistake)?;
    let mut local_size = [1; 3];
    for (size, found) in local_size.iter_mut().zip(interface.local_size) {
        *size = found.map_err(|id| {
            mistake(format!(
                "the workgroup's size is specialization constant {id}; write it in the source"
            ))
        })?;
    }
    let bindings = interface.bindings.iter().map(|binding| {
        let (kind, reads, writes, least_bytes) = match &binding.resource {
            Resource::Storage { reads, writes, block } => {
                let least = block
                    .members
                    .iter()
                    .map(|member| member.offset + least_of(&member.kind));
                (BindingKind::StorageBuffer, *reads, *writes, least.max().unwrap_or(0))
            }
            Resource::Uniform { block } => (BindingKind::UniformBuffer, true, false, block.size()),
            Resource::TexelBuffer => (BindingKind::TexelBuffer, true, false, 0),
            Resource::StorageImage { .. } | Resource::SampledImage | Resource::AccelerationStructure => {
                return Err(Error::Binding {
                    kernel: name.into(),
                    binding: binding.name.clone(),
                    cause: "is no buffer; a kernel of a host's own takes buffers".into(),
                });
            }
        };
        Ok(OwnBinding {
            name: binding.name.clone(),
            set: binding.set,
            binding: binding.binding,
            kind,
            reads,
            writes,
            least_bytes: u64::from(least_bytes),
            used: interface.used.contains(&(binding.set, binding.binding)),
        })
    });
    Ok(Module {
        entry: "main".into(),
        bindings: bindings.collect::<Result<_>>()?,
        push_bytes: interface
            .push
            .as_ref()
            .map_or(0, |push| push.size().next_multiple_of(4)),
        local_size,
        // Drivers refuse what is too much; the reflection does not say.
        shared_bytes: 0,
        spirv,
    })
}

/// Bytes of a member, of an array without a size those of one element.
fn least_of(kind: &Type) -> u32 {
    match kind {
        Type::Runtime(_, stride) => *stride,
        other => other.size(),
    }
}

/// The first `name:line: ` of what the compiler says becomes the error's line.
fn placed(name: &str, error: Error) -> Error {
    let Error::Shader { message, .. } = error else {
        return error;
    };
    let place = message.lines().find_map(|line| {
        let (_, rest) = line.split_once(':')?;
        let (number, rest) = rest.split_once(':')?;
        Some((number.trim().parse().ok()?, rest.trim().to_owned()))
    });
    let (line, text) = place.unwrap_or((0, message));
    Error::KernelSource {
        kernel: name.into(),
        line,
        column: 0,
        message: text,
    }
}
