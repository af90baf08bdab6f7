//! spirv-reflect's opinion on the interfaces that the build reads with rspirv.
//!
//! spirv-reflect understands the storage classes of SPIR-V 1.0 only, so every shader without subgroup operations and ray queries is compiled for Vulkan 1.0
//! here, and both readers must agree on sets, bindings, descriptor types, and the offsets, counts, strides and widths of all that is in blocks
//! and push constants. That the first reading is the one that the generated Rust code came from is shown by its fingerprint.

use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use clerestory::gpu::ash::vk;
use clerestory::gpu::interface::ShaderInfo;
use spirv_reflect::ffi;

use super::shader_build::build::reflect::{self, Member, Resource, Type};

fn folder(below: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(below)
}

/// The unoptimized module of a kernel for Vulkan 1.0. Where specialization constants set the size of the workgroup or of caches, all of them become plain
/// constants, since spirv-reflect cannot read modules whose arrays have such sizes. `None` for kernels with subgroup operations, which came with
/// Vulkan 1.1.
fn compiled_for_1_0(file: &Path) -> Result<Option<Vec<u8>>, String> {
    let source = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    if source.contains("GL_KHR_shader_subgroup") {
        return Ok(None);
    }
    let environment = "--target-env=vulkan1.0";
    if !["local_size_x_id", "#define KD_CACHES"]
        .iter()
        .any(|sized| source.contains(sized))
    {
        return compiled(file, &[environment]).map(Some);
    }
    let flat = String::from_utf8(compiled(file, &[environment, "-E"])?).map_err(|error| error.to_string())?;
    // The preprocessor leaves no space after the parenthesis.
    let plain: String = flat
        .replace("local_size_x_id = 0", "local_size_x = 64")
        .lines()
        .map(|line| match line.split_once(")const ") {
            Some((constant, rest)) if constant.starts_with("layout(constant_id") => format!("const {rest}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let copy = folder.path().join("plain.comp");
    std::fs::write(&copy, plain).map_err(|error| error.to_string())?;
    compiled(&copy, &[environment]).map(Some)
}

/// The unoptimized module of a kernel for a version of Vulkan.
fn compiled(file: &Path, environment: &[&str]) -> Result<Vec<u8>, String> {
    let output = Command::new(std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into()))
        .args(environment)
        .arg("-O0")
        .arg("-I")
        .arg(folder("shaders"))
        .arg(file)
        .args(["-o", "-"])
        .output()
        .map_err(|error| format!("glslc: {error}"))?;
    if output.status.success() {
        Ok(output.stdout)
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// Checks one kernel; the count of members and bindings that were compared.
fn check(root: &Path, info: &ShaderInfo) -> Result<usize, String> {
    let by_ray_queries = info.name.strip_suffix(" (driver)");
    let file = root.join(by_ray_queries.unwrap_or(info.name));
    let mut flags = vec!["--target-env=vulkan1.1", "--target-spv=spv1.3"];
    flags.extend(by_ray_queries.map(|_| "-DCLERESTORY_INDEX_DRIVER"));
    let named = compiled(&file, &flags)?;
    let ours = reflect::reflect(&named, info.spirv)?;
    if ours.fingerprint() != info.fingerprint {
        return Err("the generated code came from another interface".into());
    }
    let used: Vec<_> = info.used_bindings().map(|b| (b.set, b.binding)).collect();
    if !ours.used.iter().eq(&used) {
        return Err("the generated code came from another optimized module".into());
    }
    // Ray queries came after Vulkan 1.0.
    if by_ray_queries.is_some() {
        return Ok(0);
    }
    let Some(module) = compiled_for_1_0(&file)? else {
        return Ok(0);
    };
    let theirs = Reflected::new(&module)?;
    if theirs.bindings.len() != ours.bindings.len() {
        return Err(format!(
            "{} bindings, not {}",
            theirs.bindings.len(),
            ours.bindings.len()
        ));
    }
    let mut compared = ours.bindings.len();
    for (ours, (place, kind, block)) in ours.bindings.iter().zip(&theirs.bindings) {
        if [ours.set, ours.binding] != *place {
            return Err(format!("{} is {place:?}", ours.name));
        }
        let (expected, members) = match &ours.resource {
            Resource::Storage { block, .. } => (vk::DescriptorType::STORAGE_BUFFER, block.members.as_slice()),
            Resource::Uniform { block } => (vk::DescriptorType::UNIFORM_BUFFER, block.members.as_slice()),
            Resource::StorageImage { .. } => (vk::DescriptorType::STORAGE_IMAGE, [].as_slice()),
            Resource::SampledImage => (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, [].as_slice()),
            Resource::TexelBuffer => (vk::DescriptorType::UNIFORM_TEXEL_BUFFER, [].as_slice()),
            Resource::AccelerationStructure => (vk::DescriptorType::ACCELERATION_STRUCTURE_KHR, [].as_slice()),
        };
        if *kind != expected {
            return Err(format!("{}: {expected:?} is {kind:?}", ours.name));
        }
        compared += compare(&ours.name, members, block)?;
    }
    let push = ours
        .push
        .as_ref()
        .map(|push| push.members.as_slice())
        .unwrap_or_default();
    compared += compare("push constants", push, &theirs.push)?;
    Ok(compared)
}

/// A member of a block as spirv-reflect sees it.
#[derive(Debug)]
struct Theirs {
    name: String,
    offset: u32,
    /// Counts of arrays from the outermost inwards; runtime arrays are left out.
    counts: Vec<u32>,
    stride: u32,
    /// Columns, rows and stride of a matrix.
    matrix: [u32; 3],
    components: u32,
    bits: u32,
    members: Vec<Theirs>,
}

/// What is compared of a module: set and binding, type and block members of all bindings, and the members of the push constants. Read by the
/// C interface, since the crate's own wrapper makes slices of null pointers.
struct Reflected {
    bindings: Vec<([u32; 2], vk::DescriptorType, Vec<Theirs>)>,
    push: Vec<Theirs>,
}

#[expect(unsafe_code, reason = "a C library is called here")]
impl Reflected {
    fn new(module: &[u8]) -> Result<Self, String> {
        let mut raw = ffi::SpvReflectShaderModule::default();
        // SAFETY: the module is one that glslc has just made; the library copies it.
        let result = unsafe { ffi::spvReflectCreateShaderModule(module.len(), module.as_ptr().cast(), &mut raw) };
        if result != ffi::SpvReflectResult_SPV_REFLECT_RESULT_SUCCESS {
            return Err(format!("spirv-reflect fails with {result}"));
        }
        // SAFETY: the lists live until the module is destroyed below.
        let (bindings, push) = unsafe {
            (
                list(raw.descriptor_bindings, raw.descriptor_binding_count),
                list(raw.push_constant_blocks, raw.push_constant_block_count),
            )
        };
        let mut bindings: Vec<_> = bindings
            .iter()
            .map(|binding| {
                let kind = vk::DescriptorType::from_raw(binding.descriptor_type);
                ([binding.set, binding.binding], kind, members(&binding.block))
            })
            .collect();
        bindings.sort_by_key(|(place, ..)| *place);
        let push = push.iter().flat_map(members).collect();
        // SAFETY: it was made above, and nothing of it is used any more.
        unsafe { ffi::spvReflectDestroyShaderModule(&mut raw) };
        Ok(Self { bindings, push })
    }
}

/// # Safety
/// `first` points to `count` values that live as long as the result, unless `count` is 0.
#[expect(unsafe_code, reason = "a C library's list")]
unsafe fn list<'a, T>(first: *mut T, count: u32) -> &'a [T] {
    if first.is_null() {
        return &[];
    }
    // SAFETY: see above.
    unsafe { std::slice::from_raw_parts(first, count as usize) }
}

#[expect(unsafe_code, reason = "a C library's lists")]
fn members(block: &ffi::SpvReflectBlockVariable) -> Vec<Theirs> {
    // SAFETY: pointers and counts in a block belong together, and names end with NUL.
    let list = unsafe { list(block.members, block.member_count) };
    let member = |member: &ffi::SpvReflectBlockVariable| Theirs {
        // SAFETY: as above.
        name: unsafe { CStr::from_ptr(member.name) }.to_string_lossy().into_owned(),
        offset: member.offset,
        counts: member.array.dims[..member.array.dims_count as usize].to_vec(),
        stride: member.array.stride,
        matrix: [
            member.numeric.matrix.column_count,
            member.numeric.matrix.row_count,
            member.numeric.matrix.stride,
        ],
        components: member.numeric.vector.component_count,
        bits: member.numeric.scalar.width,
        members: members(member),
    };
    list.iter().map(member).collect()
}

fn compare(place: &str, ours: &[Member], theirs: &[Theirs]) -> Result<usize, String> {
    if ours.len() != theirs.len() {
        return Err(format!("{place}: {} members, not {}", theirs.len(), ours.len()));
    }
    let mut compared = ours.len();
    for (ours, theirs) in ours.iter().zip(theirs) {
        let place = format!("{place}.{}", ours.name);
        if (ours.name.as_str(), ours.offset) != (theirs.name.as_str(), theirs.offset) {
            return Err(format!(
                "{place} at {} is {} at {}",
                ours.offset, theirs.name, theirs.offset
            ));
        }
        compared += shape(&place, &ours.kind, theirs)?;
    }
    Ok(compared)
}

/// Compares counts and strides from the outermost array inwards, then what the elements are.
fn shape(place: &str, kind: &Type, theirs: &Theirs) -> Result<usize, String> {
    let (mut counts, mut strides, mut element) = (Vec::new(), Vec::new(), kind);
    loop {
        match element {
            // spirv-reflect says nothing about runtime arrays, and goes straight to the elements.
            Type::Runtime(inner, _) => element = inner,
            Type::Array(inner, count, stride) => {
                counts.push(*count);
                strides.push(*stride);
                element = inner;
            }
            Type::Scalar(..) | Type::Struct(_) => break,
        }
    }
    let [columns, rows, matrix_stride] = theirs.matrix;
    let mut expected = theirs.counts.clone();
    if columns > 0 {
        expected.extend([columns, rows]);
    } else if theirs.components > 0 {
        expected.push(theirs.components);
    }
    if counts != expected {
        return Err(format!("{place}: counts {counts:?} are {expected:?}"));
    }
    let arrays = theirs.counts.len();
    if arrays > 0 && strides[arrays - 1] != theirs.stride {
        return Err(format!("{place}: strides {strides:?} are {}", theirs.stride));
    }
    if columns > 0 && strides[arrays] != matrix_stride {
        return Err(format!("{place}: strides {strides:?} are {matrix_stride}"));
    }
    match element {
        Type::Struct(layout) => compare(place, &layout.members, &theirs.members),
        Type::Scalar(_, bytes) if 8 * bytes == theirs.bits => Ok(0),
        other => Err(format!("{place}: {other:?} has {} bits", theirs.bits)),
    }
}

/// Parts of all kernels, a test each, which take a core each.
const PARTS: usize = 4;
// Each has a test below.
const _: () = assert!(PARTS == 4);

/// Checks every fourth kernel from this one on.
fn check_part(part: usize) {
    let of_engine = clerestory::gpu::shaders::ALL.iter().map(|info| ("shaders", *info));
    let of_tests = clerestory_tests::shaders::ALL
        .iter()
        .map(|info| ("tests/shaders", *info));
    let of_samples = clerestory_samples::shaders::ALL
        .iter()
        .map(|info| ("samples/shaders", *info));
    let all = of_engine.chain(of_tests).chain(of_samples);
    let (mut wrong, mut compared) = (Vec::new(), 0);
    for (root, info) in all.skip(part).step_by(PARTS) {
        match check(&folder(root), info) {
            Ok(count) => compared += count,
            Err(reason) => wrong.push(format!("{}: {reason}", info.name)),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // The comparison does compare: there are hundreds of members.
    assert!(compared > 100, "{compared}");
}

#[test]
fn spirv_reflect_reads_the_same_interfaces_of_the_first_part() {
    check_part(0);
}

#[test]
fn spirv_reflect_reads_the_same_interfaces_of_the_second_part() {
    check_part(1);
}

#[test]
fn spirv_reflect_reads_the_same_interfaces_of_the_third_part() {
    check_part(2);
}

#[test]
fn spirv_reflect_reads_the_same_interfaces_of_the_last_part() {
    check_part(PARTS - 1);
}
