//! What of a graphics pipeline a device lacks, and where its shaders and its state do not go together: known before it is made.

use ash::vk;

use super::{GeometryStage, GraphicsDesc};
use crate::gpu::device::Inner;
use crate::gpu::image::texel_bytes;
use crate::gpu::interface::{Capability, FragmentShader, ShaderInfo, Stage, VertexShader};
use crate::{Error, Result};

/// Fails for what [`Gpu::graphics_pipeline`](crate::gpu::Gpu::graphics_pipeline) refuses, of shaders in the order of the stages.
pub(super) fn check<V: VertexShader, F: FragmentShader, G: GeometryStage>(
    gpu: &Inner,
    shaders: &[&'static ShaderInfo],
    desc: &GraphicsDesc<'_, V, F, G>,
) -> Result<()> {
    let name = shaders[0].name;
    check_shaders(gpu, shaders)?;
    check_attachments(gpu, name, desc.colors, desc.view_mask)?;
    check_state(gpu, name, desc)?;
    check_topology(desc.topology, G::info())
}

fn missing(gpu: &Inner, feature: impl Into<String>, needed_by: &str, instead: &str) -> Error {
    Error::MissingFeature {
        feature: feature.into(),
        needed_by: needed_by.into(),
        device: gpu.caps.device.clone(),
        instead: instead.into(),
    }
}

fn check_shaders(gpu: &Inner, shaders: &[&'static ShaderInfo]) -> Result<()> {
    let vertex = shaders[0];
    if !gpu.caps.graphics {
        let instead = "choose a device that has one";
        return Err(missing(gpu, "a graphics queue", vertex.name, instead));
    }
    for shader in shaders {
        for capability in shader.capabilities {
            check_capability(gpu, shader, *capability)?;
        }
        let (stores, feature) = match shader.stage {
            Stage::Fragment => (gpu.caps.fragment_stores, "fragmentStoresAndAtomics"),
            _ => (gpu.caps.vertex_stores, "vertexPipelineStoresAndAtomics"),
        };
        if !stores && shader.used_bindings().any(|binding| binding.writes) {
            return Err(missing(gpu, feature, shader.name, "write from a compute shader"));
        }
        let disagree = |message| {
            Err(Error::Shader {
                name: shader.name.into(),
                message,
            })
        };
        if shader.push_constant_bytes > 0 && shader.push_constant_bytes != vertex.push_constant_bytes {
            return disagree(format!(
                "its push constants have {} bytes, those of {} have {}",
                shader.push_constant_bytes, vertex.name, vertex.push_constant_bytes
            ));
        }
        for binding in shader.bindings {
            let place = (binding.set, binding.binding);
            let same_place = |other: &&'static ShaderInfo| {
                let found = other.bindings.iter().find(|b| (b.set, b.binding) == place)?;
                (found.kind != binding.kind).then_some(other.name)
            };
            if let Some(other) = shaders.iter().find_map(same_place) {
                return disagree(format!(
                    "binding {} is a {:?} here and another thing in {other}",
                    binding.name, binding.kind
                ));
            }
        }
    }
    Ok(())
}

fn check_capability(gpu: &Inner, shader: &ShaderInfo, capability: Capability) -> Result<()> {
    let (offered, feature, instead) = match capability {
        Capability::Geometry => (
            gpu.caps.geometry_shader,
            "geometryShader",
            "render once for each layer, or by views",
        ),
        Capability::ClipDistance => (
            gpu.caps.max_clip_distances > 0,
            "shaderClipDistance",
            "discard fragments by the distance instead",
        ),
        Capability::MultiView => (
            gpu.caps.max_views > 0,
            "multiview",
            "render once for each view, with the view's number in the push constants",
        ),
        Capability::VertexLayer => (
            gpu.caps.vertex_layer,
            "shaderOutputLayer with VK_EXT_shader_viewport_index_layer",
            "choose the layer in a geometry shader, or render once for each layer",
        ),
        Capability::RayQuery => (
            gpu.caps.ray_query,
            "VK_KHR_ray_query",
            "query rays in a compute shader by an index of the engine's own",
        ),
    };
    if offered {
        Ok(())
    } else {
        Err(missing(gpu, feature, shader.name, instead))
    }
}

fn check_attachments(gpu: &Inner, name: &str, colors: &[vk::Format], view_mask: u32) -> Result<()> {
    let views = u32::BITS - view_mask.leading_zeros();
    for (wanted, offered, limit, instead) in [
        (
            colors.len() as u32,
            gpu.caps.max_color_attachments,
            "maxColorAttachments",
            "render in several passes",
        ),
        (
            views,
            gpu.caps.max_views,
            "maxMultiviewViewCount",
            "render once for each view",
        ),
    ] {
        if wanted > offered {
            return Err(missing(gpu, format!("{limit} >= {wanted}"), name, instead));
        }
    }
    Ok(())
}

/// Fails for formats, topologies and comparisons that the device, or no device, has pipelines of.
fn check_state<V: VertexShader, F: FragmentShader, G: GeometryStage>(
    gpu: &Inner,
    name: &str,
    desc: &GraphicsDesc<'_, V, F, G>,
) -> Result<()> {
    let blended = if desc.additive {
        vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND
    } else {
        vk::FormatFeatureFlags::empty()
    };
    let colors = desc.colors.iter().filter(|format| **format != vk::Format::UNDEFINED);
    let colors = colors.map(|format| (*format, vk::FormatFeatureFlags::COLOR_ATTACHMENT | blended));
    let depth = desc
        .depth
        .map(|format| (format, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT));
    for (format, wanted) in colors.chain(depth) {
        // Others have no image here, and drivers need not know what to answer.
        let known = texel_bytes(format).is_some();
        // SAFETY: the physical device belongs to the instance.
        let offered = known.then(|| unsafe {
            gpu.instance
                .raw
                .get_physical_device_format_properties(gpu.physical_device, format)
        });
        if !offered.is_some_and(|offered| offered.optimal_tiling_features.contains(wanted)) {
            let feature = format!("{wanted:?} for format {format:?}");
            return Err(missing(gpu, feature, name, "choose another format"));
        }
    }
    let topologies = [
        vk::PrimitiveTopology::POINT_LIST,
        vk::PrimitiveTopology::LINE_LIST,
        vk::PrimitiveTopology::LINE_STRIP,
        vk::PrimitiveTopology::TRIANGLE_LIST,
        vk::PrimitiveTopology::TRIANGLE_STRIP,
        vk::PrimitiveTopology::TRIANGLE_FAN,
    ];
    let comparisons = vk::CompareOp::NEVER.as_raw()..=vk::CompareOp::ALWAYS.as_raw();
    for (setting, value, known) in [
        (
            "topology",
            format!("{:?}", desc.topology),
            topologies.contains(&desc.topology),
        ),
        (
            "depth_compare",
            format!("{:?}", desc.depth_compare),
            comparisons.contains(&desc.depth_compare.as_raw()),
        ),
    ] {
        if !known {
            let cause = format!("is not one that the pipeline of {name} can have");
            return Err(Error::setting(setting, value, cause));
        }
    }
    Ok(())
}

/// Fails for primitives that are not those that the geometry shader takes, by its module's own word.
fn check_topology(topology: vk::PrimitiveTopology, geometry: Option<&'static ShaderInfo>) -> Result<()> {
    let Some(shader) = geometry else {
        return Ok(());
    };
    let input = match topology {
        vk::PrimitiveTopology::POINT_LIST => INPUT_POINTS,
        vk::PrimitiveTopology::LINE_LIST | vk::PrimitiveTopology::LINE_STRIP => INPUT_LINES,
        _ => INPUT_TRIANGLES,
    };
    if execution_modes(shader.spirv).any(|mode| mode == input) {
        return Ok(());
    }
    let cause = format!("is not what the geometry shader {} takes", shader.name);
    Err(Error::setting("topology", format!("{topology:?}"), cause))
}

/// Execution modes of SPIR-V that say what a geometry shader takes ("SPIR-V Specification", "Execution Mode").
const INPUT_POINTS: u32 = 19;
const INPUT_LINES: u32 = 20;
const INPUT_TRIANGLES: u32 = 22;

/// The execution modes of a module ("SPIR-V Specification", §2.3, and OpExecutionMode).
fn execution_modes(spirv: &[u8]) -> impl Iterator<Item = u32> {
    const HEADER_WORDS: usize = 5;
    const OP_EXECUTION_MODE: u32 = 16;
    let word = move |index: usize| {
        let bytes = spirv.get(4 * index..4 * index + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let mut at = HEADER_WORDS;
    let instructions = std::iter::from_fn(move || {
        let first = word(at)?;
        let mode = word(at + 2);
        // No instruction has no words; a module that says so ends here.
        let length = (first >> 16) as usize;
        at = if length == 0 { usize::MAX / 8 } else { at + length };
        Some((first & 0xFFFF, mode))
    });
    instructions.filter_map(|(operation, mode)| mode.filter(|_| operation == OP_EXECUTION_MODE))
}
