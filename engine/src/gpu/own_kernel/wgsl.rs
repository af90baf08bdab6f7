//! WGSL to SPIR-V with its interface, by naga.

use std::collections::{BTreeMap, BTreeSet};

use naga::back::{PipelineConstants, pipeline_constants, spv};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy, GlobalCtx};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, ShaderStage, StorageAccess, TypeInner};

use super::{Module, OwnBinding};
use crate::gpu::caps::Caps;
use crate::gpu::interface::BindingKind;
use crate::{Error, Result};

/// An error and what it rests on, in one line.
fn words(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        text = format!("{text}: {inner}");
        cause = inner.source();
    }
    text
}

fn has_subgroups(caps: &Caps) -> bool {
    let has = &caps.subgroup;
    has.basic && has.vote && has.arithmetic && has.ballot && has.shuffle
}

/// What modules may ask of a device: nothing that was not enabled.
fn module_capabilities(caps: &Caps) -> naga::FastHashSet<spv::Capability> {
    use spv::Capability as C;
    let subgroups = [
        C::GroupNonUniform,
        C::GroupNonUniformVote,
        C::GroupNonUniformArithmetic,
        C::GroupNonUniformBallot,
        C::GroupNonUniformShuffle,
    ];
    let all = [
        (true, &[C::Shader, C::Matrix][..]),
        (caps.float64, &[C::Float64]),
        (caps.int64, &[C::Int64]),
        (has_subgroups(caps), &subgroups),
    ];
    all.into_iter()
        .filter(|(has, _)| *has)
        .flat_map(|(_, some)| some.iter().copied())
        .collect()
}

/// What sources may use of a device.
fn capabilities(caps: &Caps) -> Capabilities {
    let of = |has: bool, capability| if has { capability } else { Capabilities::empty() };
    Capabilities::IMMEDIATES
        | Capabilities::SHADER_FLOAT16_IN_FLOAT32
        | of(caps.float64, Capabilities::FLOAT64)
        | of(caps.int64, Capabilities::SHADER_INT64)
        | of(
            has_subgroups(caps),
            Capabilities::SUBGROUP | Capabilities::SUBGROUP_BARRIER,
        )
}

/// The module of a source, for a device.
pub(super) fn translate(name: &str, source: &str, caps: &Caps) -> Result<Module> {
    let mistake = |place: Option<naga::SourceLocation>, message: String| Error::KernelSource {
        kernel: name.into(),
        line: place.map_or(0, |place| place.line_number),
        column: place.map_or(0, |place| place.line_position),
        message,
    };
    let module = naga::front::wgsl::parse_str(source).map_err(|error| {
        let notes: Vec<_> = error.notes().map(|note| format!(" ({note})")).collect();
        mistake(error.location(source), format!("{}{}", error.message(), notes.concat()))
    })?;
    let validate = |module: &naga::Module| {
        Validator::new(ValidationFlags::all(), capabilities(caps))
            .validate(module)
            .map_err(|error| mistake(error.location(source), words(error.as_inner())))
    };
    let info = validate(&module)?;
    let compute: Vec<_> = module
        .entry_points
        .iter()
        .filter(|entry| entry.stage == ShaderStage::Compute)
        .collect();
    let [entry] = compute[..] else {
        let names: Vec<_> = compute.iter().map(|entry| entry.name.as_str()).collect();
        let message = format!(
            "a kernel has one compute entry point, and there are {}: {}",
            names.len(),
            names.join(", ")
        );
        return Err(mistake(None, message));
    };
    let entry = entry.name.clone();
    // Overrides become constants, and everything that the entry point has no use for goes.
    let none = PipelineConstants::default();
    let whole = interface_of(name, &module)?;
    let (module, info) =
        pipeline_constants::process_overrides(&module, &info, Some((ShaderStage::Compute, &entry)), &none)
            .map_err(|error| mistake(None, words(&error)))?;
    let used = interface_of(name, &module)?;
    let options = spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::DEBUG,
        // Sets and numbers are those of the source.
        fake_missing_bindings: true,
        capabilities: Some(module_capabilities(caps)),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::ReadZeroSkipWrite,
            buffer: BoundsCheckPolicy::ReadZeroSkipWrite,
            image_load: BoundsCheckPolicy::ReadZeroSkipWrite,
            binding_array: BoundsCheckPolicy::ReadZeroSkipWrite,
        },
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions {
        shader_stage: ShaderStage::Compute,
        entry_point: entry.clone(),
    };
    let words_of_module =
        spv::write_vec(&module, &info, &options, Some(&pipeline)).map_err(|error| mistake(None, words(&error)))?;
    let place = module
        .entry_points
        .iter()
        .position(|point| point.name == entry)
        .unwrap_or(0);
    let uses = info.get_entry_point(place);
    let is_used = |(handle, _): &(naga::Handle<naga::GlobalVariable>, _)| !uses[*handle].is_empty();
    let live: BTreeSet<(u32, u32)> = module
        .global_variables
        .iter()
        .filter(is_used)
        .filter_map(|(_, variable)| variable.binding.map(|at| (at.group, at.binding)))
        .collect();
    // Sizes of arrays may rest on overrides, so those of the processed module count where it still has the binding.
    let sizes: BTreeMap<_, _> = used
        .bindings
        .iter()
        .map(|b| ((b.set, b.binding), b.least_bytes))
        .collect();
    let bindings = whole.bindings.into_iter().map(|mut binding| {
        let at = (binding.set, binding.binding);
        binding.used = live.contains(&at);
        binding.least_bytes = sizes.get(&at).copied().unwrap_or(binding.least_bytes);
        binding
    });
    Ok(Module {
        spirv: bytemuck::cast_slice(&words_of_module).to_vec(),
        entry,
        bindings: bindings.collect(),
        push_bytes: used.push_bytes,
        local_size: module.entry_points[place].workgroup_size,
        shared_bytes: used.shared_bytes,
    })
}

struct Interface {
    bindings: Vec<OwnBinding>,
    push_bytes: u32,
    shared_bytes: u64,
}

/// What a module declares.
fn interface_of(name: &str, module: &naga::Module) -> Result<Interface> {
    let mut interface = Interface {
        bindings: Vec::new(),
        push_bytes: 0,
        shared_bytes: 0,
    };
    let context: GlobalCtx<'_> = module.to_ctx();
    for (_, variable) in module.global_variables.iter() {
        let inner: &TypeInner = &module.types[variable.ty].inner;
        let bytes = inner.try_size(context).unwrap_or(u32::MAX);
        let binding_name = variable.name.clone().unwrap_or_default();
        let (kind, access) = match variable.space {
            AddressSpace::Immediate => {
                interface.push_bytes = bytes.next_multiple_of(4);
                continue;
            }
            AddressSpace::WorkGroup => {
                interface.shared_bytes += u64::from(bytes);
                continue;
            }
            AddressSpace::Uniform => (BindingKind::UniformBuffer, StorageAccess::LOAD),
            AddressSpace::Storage { access } => (BindingKind::StorageBuffer, access),
            AddressSpace::Handle => {
                return Err(Error::Binding {
                    kernel: name.into(),
                    binding: binding_name,
                    cause: "is a texture or a sampler; a kernel of a host's own takes buffers".into(),
                });
            }
            _ => continue,
        };
        let Some(at) = variable.binding else { continue };
        interface.bindings.push(OwnBinding {
            name: binding_name,
            set: at.group,
            binding: at.binding,
            kind,
            reads: access.contains(StorageAccess::LOAD),
            writes: access.contains(StorageAccess::STORE),
            least_bytes: u64::from(bytes),
            used: true,
        });
    }
    interface.bindings.sort_by_key(|binding| (binding.set, binding.binding));
    Ok(interface)
}
