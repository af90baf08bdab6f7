//! What the build generates for each shader is written in these terms.

pub use crate::gpu::{AccelerationStructure, BufferView, Image, Sampler, TexelView};

/// A shader module with its reflected interface.
#[derive(Debug)]
pub struct ShaderInfo {
    /// Path below `shaders/`, and the variant, if it is one: `walk/extend.comp (driver)`.
    pub name: &'static str,
    /// Pipeline stage.
    pub stage: Stage,
    /// The module, little-endian words.
    pub spirv: &'static [u8],
    /// Size of the push-constant block.
    pub push_constant_bytes: u32,
    /// A hash of everything the generated Rust code depends on; the build's, over names, offsets and kinds.
    pub fingerprint: u64,
    /// Workgroup size (compute).
    pub local_size: [LocalSize; 3],
    /// It has subgroup operations. Such a compute shader runs in full subgroups where [`Caps::full_subgroups`](crate::gpu::Caps) says so
    /// and its workgroup along x is a multiple of a subgroup.
    pub subgroups: bool,
    /// What it needs that not every device has.
    pub capabilities: &'static [Capability],
    /// The same kernel by ray queries, for [`Gpu::ray_query_pipeline`](crate::gpu::Gpu::ray_query_pipeline): of the same push constants, workgroup and sets
    /// but for set 1, and of no other specialization constants.
    pub ray_query: Option<&'static ShaderInfo>,
    /// Bindings by set and number, those included that the shader declares and does not use.
    pub bindings: &'static [BindingInfo],
    /// Specialization constants by id.
    pub spec_constants: &'static [SpecInfo],
}

/// A pipeline stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Compute.
    Compute,
    /// Vertex.
    Vertex,
    /// Geometry.
    Geometry,
    /// Fragment.
    Fragment,
}

/// What a shader may need of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Capability {
    /// It is a geometry shader, or reads what only such a stage writes.
    Geometry,
    /// `gl_ClipDistance`.
    ClipDistance,
    /// `gl_ViewIndex`.
    MultiView,
    /// `gl_Layer` written by a vertex shader.
    VertexLayer,
    /// Ray queries, in whatever shader.
    RayQuery,
}

/// One axis of a workgroup's size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalSize {
    /// Written in the shader.
    Fixed(u32),
    /// Set by the specialization constant of this id.
    Spec(u32),
}

/// One binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BindingInfo {
    /// Descriptor set.
    pub set: u32,
    /// Binding number.
    pub binding: u32,
    /// Instance name, or the block's name in snake case.
    pub name: &'static str,
    /// Descriptor type.
    pub kind: BindingKind,
    /// Not declared `writeonly`.
    pub reads: bool,
    /// Not declared `readonly`.
    pub writes: bool,
    /// The optimized module touches it. Only used bindings take part in layouts, limits and barrier checks.
    pub used: bool,
    /// What an image is seen as; `None` for what is no image.
    pub view: Option<ViewKind>,
    /// Bytes of a block up to its array without a size, or to its end; 0 for what is no block.
    pub fixed_bytes: u32,
}

/// What a shader sees an image as. It is given one whose view is of that kind: a whole image, or a part by its
/// [`ImagePart::kind`](crate::gpu::ImagePart).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewKind {
    /// One layer: `TYPE_2D`.
    Plane,
    /// Layers by number: `TYPE_2D_ARRAY`.
    Layers,
    /// Six layers by direction: `CUBE`.
    Cube,
}

impl ShaderInfo {
    /// The bindings that the shader uses.
    pub fn used_bindings(&self) -> impl Iterator<Item = &'static BindingInfo> + use<> {
        self.bindings.iter().filter(|binding| binding.used)
    }
}

/// Descriptor types in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// Storage buffer.
    StorageBuffer,
    /// Uniform buffer.
    UniformBuffer,
    /// Storage image.
    StorageImage,
    /// Combined image and sampler.
    SampledImage,
    /// Uniform texel buffer.
    TexelBuffer,
    /// Acceleration structure.
    AccelerationStructure,
}

/// One specialization constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpecInfo {
    /// `constant_id`.
    pub id: u32,
    /// Lower-case name.
    pub name: &'static str,
    /// Default value as bits.
    pub default: u32,
}

/// The values of a shader's specialization constants.
pub trait SpecConstants: Default {
    /// Pairs of `constant_id` and value as bits.
    fn values(&self) -> Vec<(u32, u32)>;
}

impl SpecConstants for () {
    fn values(&self) -> Vec<(u32, u32)> {
        Vec::new()
    }
}

/// A compute shader as a type; implemented by the generated modules.
///
/// ```compile_fail,E0200
/// use clerestory::gpu::interface::{ComputeShader, ShaderInfo};
///
/// enum Mine {}
///
/// impl ComputeShader for Mine {
///     type Push = ();
///     type Spec = ();
///     fn info() -> &'static ShaderInfo {
///         &clerestory::gpu::shaders::film::display::INFO
///     }
/// }
/// ```
///
/// # Safety
/// Drivers trust modules, and nothing here reads them again:
/// - [`ComputeShader::info`] is always the same one. Its module is valid SPIR-V for Vulkan 1.1 and of that stage, and all else that the info says is
///   so: bindings with what is read, written and used, the size of the push constants' block, the constants, the workgroup, subgroup operations and
///   capabilities.
/// - The module asks for no other capabilities than those of Vulkan 1.0, of what every [`Gpu`](crate::gpu::Gpu) enables, and of what its info says.
/// - Given what its documentation allows in push constants, specialization constants, buffers and images, no invocation leaves its own arrays or
///   those of its workgroup. Those of buffers the device keeps it in where [`Caps::robust_buffer_access`](crate::gpu::Caps) says so.
pub unsafe trait ComputeShader {
    /// Push constants, `()` for none.
    type Push: PushConstants;
    /// Specialization constants, `()` for none.
    type Spec: SpecConstants;
    /// The reflected interface.
    fn info() -> &'static ShaderInfo;
}

/// A vertex shader as a type; implemented by the generated modules.
///
/// # Safety
/// As of a [`ComputeShader`].
pub unsafe trait VertexShader {
    /// Push constants, `()` for none.
    type Push: PushConstants;
    /// Specialization constants, `()` for none.
    type Spec: SpecConstants;
    /// The reflected interface.
    fn info() -> &'static ShaderInfo;
}

/// A geometry shader as a type; implemented by the generated modules.
///
/// # Safety
/// As of a [`ComputeShader`].
pub unsafe trait GeometryShader {
    /// Push constants, `()` for none.
    type Push: PushConstants;
    /// Specialization constants, `()` for none.
    type Spec: SpecConstants;
    /// The reflected interface.
    fn info() -> &'static ShaderInfo;
}

/// A fragment shader as a type; implemented by the generated modules.
///
/// # Safety
/// As of a [`ComputeShader`].
pub unsafe trait FragmentShader {
    /// Push constants, `()` for none.
    type Push: PushConstants;
    /// Specialization constants, `()` for none.
    type Spec: SpecConstants;
    /// The reflected interface.
    fn info() -> &'static ShaderInfo;
}

/// A push-constant block.
pub trait PushConstants {
    /// The bytes to push. A dispatch or draw refuses another number of them than its shader's block has.
    fn bytes(&self) -> &[u8];
}

impl PushConstants for () {
    fn bytes(&self) -> &[u8] {
        &[]
    }
}

/// A descriptor set's worth of resources; implemented by the generated modules. What it gives is checked against what the shaders declare where it
/// is bound.
pub trait BindingSet<'a> {
    /// Descriptor set number.
    fn set(&self) -> u32;
    /// Binding numbers and what they hold.
    fn resources(&self) -> Vec<(u32, BoundResource<'a>)>;
}

/// A resource at a binding.
#[derive(Debug, Clone, Copy)]
pub enum BoundResource<'a> {
    /// Storage or uniform buffer.
    Buffer(BufferView<'a>),
    /// Storage image, in `GENERAL` layout.
    StorageImage(&'a Image),
    /// Combined image and sampler, in `SHADER_READ_ONLY_OPTIMAL` layout.
    Sampled(SampledView<'a>),
    /// Texel buffer.
    Texels(&'a TexelView),
    /// Acceleration structure.
    Structure(&'a AccelerationStructure),
}

/// An image with the sampler to read it by.
#[derive(Debug, Clone, Copy)]
pub struct SampledView<'a> {
    /// The image.
    pub image: &'a Image,
    /// The sampler.
    pub sampler: &'a Sampler,
}
