//! Reads the interface of a SPIR-V module: bindings, blocks, push constants, specialization constants, workgroup size,
//! subgroup operations.
//!
//! Rests on `rspirv`; `third_party_notes/crates.md` says why.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Capability, Decoration, Dim, ExecutionMode, ExecutionModel, Op, StorageClass};

/// A type inside a buffer, as the device lays it out.
#[derive(Debug, Clone, PartialEq)]
pub enum Type {
    /// A scalar by its Rust name: `f32`, `u32`, `i32`, `u64` …
    Scalar(&'static str, u32),
    /// A vector or array: element, count, stride in bytes.
    Array(Box<Type>, u32, u32),
    /// A runtime array: element, stride in bytes.
    Runtime(Box<Type>, u32),
    /// A struct by name.
    Struct(Struct),
}

impl Type {
    /// Bytes from the first to the last byte used.
    pub fn size(&self) -> u32 {
        match self {
            Self::Scalar(_, size) => *size,
            Self::Array(_, count, stride) => count * stride,
            Self::Runtime(..) => 0,
            Self::Struct(layout) => layout.size(),
        }
    }

    /// Alignment of the Rust type that stands for it.
    pub fn alignment(&self) -> u32 {
        match self {
            Self::Scalar(_, size) => *size,
            Self::Array(element, ..) | Self::Runtime(element, _) => element.alignment(),
            Self::Struct(layout) => layout.members.iter().map(|m| m.kind.alignment()).max().unwrap_or(1),
        }
    }
}

/// A struct with explicit offsets. `stride` is its array stride where it is an array's element.
#[derive(Debug, Clone, PartialEq)]
pub struct Struct {
    pub name: String,
    pub members: Vec<Member>,
    pub stride: Option<u32>,
}

impl Struct {
    pub fn size(&self) -> u32 {
        let end = self.members.iter().map(|m| m.offset + m.kind.size()).max().unwrap_or(0);
        let alignment = self.members.iter().map(|m| m.kind.alignment()).max().unwrap_or(1);
        self.stride.unwrap_or_else(|| end.next_multiple_of(alignment))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    pub name: String,
    pub offset: u32,
    pub kind: Type,
}

/// What a binding holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Resource {
    Storage {
        reads: bool,
        writes: bool,
        block: Struct,
    },
    Uniform {
        block: Struct,
    },
    StorageImage {
        reads: bool,
        writes: bool,
    },
    SampledImage,
    /// A buffer read texel by texel (`utextureBuffer`).
    TexelBuffer,
    /// An acceleration structure (`accelerationStructureEXT`).
    AccelerationStructure,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    pub set: u32,
    pub binding: u32,
    pub name: String,
    pub resource: Resource,
    /// What an image is seen as, by its name in `gpu::interface::ViewKind`.
    pub view: Option<&'static str>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct SpecConstant {
    pub id: u32,
    pub name: String,
    /// `u32`, `i32`, `f32` or `bool`.
    pub kind: &'static str,
    /// Default, as bits.
    pub default: u32,
}

#[derive(Debug)]
pub struct Interface {
    pub stage: &'static str,
    pub bindings: Vec<Binding>,
    /// Set and number of the bindings that the optimized module touches.
    pub used: BTreeSet<(u32, u32)>,
    pub push: Option<Struct>,
    pub spec: Vec<SpecConstant>,
    /// Workgroup size; an entry that a specialization constant sets holds its id.
    pub local_size: [Result<u32, u32>; 3],
    /// It has subgroup operations.
    pub subgroups: bool,
    /// What it needs that not every device has, by its name in `gpu::interface::Capability`.
    pub capabilities: Vec<&'static str>,
}

struct Reader {
    module: Module,
    names: BTreeMap<u32, String>,
    member_names: BTreeMap<(u32, u32), String>,
    decorations: BTreeMap<u32, Vec<Instruction>>,
    member_decorations: BTreeMap<(u32, u32), Vec<Instruction>>,
    definitions: BTreeMap<u32, Instruction>,
}

impl Interface {
    /// A hash of all that the host's code is written against. The defaults of specialization constants are left out, since the host always
    /// sets them, and so is which bindings are used: a version of a shader that uses no more of them than another can stand in for it.
    pub fn fingerprint(&self) -> u64 {
        let spec: Vec<_> = self.spec.iter().map(|c| (c.id, &c.name, c.kind)).collect();
        let text = format!(
            "{} {:?} {:?} {spec:?} {:?} {} {:?}",
            self.stage, self.bindings, self.push, self.local_size, self.subgroups, self.capabilities
        );
        fnv1a(text.bytes())
    }
}

/// The 64-bit hash FNV-1a, which is the same on every machine and with every compiler.
pub fn fnv1a(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

/// Reflects a shader from its module that was compiled with all its names; the optimized one says which bindings are used.
pub fn reflect(module: &[u8], optimized: &[u8]) -> Result<Interface, String> {
    let reader = Reader::new(rspirv::dr::load_bytes(module).map_err(|error| error.to_string())?);
    let entry = reader.module.entry_points.first().ok_or("no entry point")?;
    let stage = match entry.operands[0] {
        Operand::ExecutionModel(ExecutionModel::GLCompute) => "Compute",
        Operand::ExecutionModel(ExecutionModel::Vertex) => "Vertex",
        Operand::ExecutionModel(ExecutionModel::Fragment) => "Fragment",
        Operand::ExecutionModel(ExecutionModel::Geometry) => "Geometry",
        ref other => return Err(format!("unsupported stage {other:?}")),
    };
    let spec = reader.spec_constants()?;
    let mut bindings = Vec::new();
    let mut push = None;
    for variable in reader
        .module
        .types_global_values
        .iter()
        .filter(|i| i.class.opcode == Op::Variable)
    {
        let (id, pointer) = (
            variable.result_id.ok_or("variable without id")?,
            variable.result_type.ok_or("no type")?,
        );
        let pointee = reader.id_operand(pointer, 1)?;
        match variable.operands[0] {
            Operand::StorageClass(StorageClass::PushConstant) => push = Some(reader.structure(pointee)?),
            Operand::StorageClass(
                class @ (StorageClass::StorageBuffer | StorageClass::Uniform | StorageClass::UniformConstant),
            ) => bindings.push(reader.binding(id, pointee, class)?),
            _ => {}
        }
    }
    bindings.sort_by_key(|b| (b.set, b.binding));
    let optimized = rspirv::dr::load_bytes(without_sources(optimized)).map_err(|error| error.to_string())?;
    let local_size = reader.local_size(&spec);
    let subgroups = reader.has_subgroup_operations();
    Ok(Interface {
        stage,
        bindings,
        used: used_bindings(&optimized),
        push,
        spec,
        local_size,
        subgroups,
        capabilities: capabilities(&optimized),
    })
}

/// The capabilities among those declared that the host asks devices for.
fn capabilities(module: &Module) -> Vec<&'static str> {
    let declared: BTreeSet<_> = module
        .capabilities
        .iter()
        .flat_map(|declared| &declared.operands)
        .filter_map(|operand| match operand {
            Operand::Capability(Capability::Geometry) => Some("Geometry"),
            Operand::Capability(Capability::ClipDistance) => Some("ClipDistance"),
            Operand::Capability(Capability::MultiView) => Some("MultiView"),
            Operand::Capability(Capability::ShaderViewportIndexLayerEXT | Capability::ShaderLayer) => {
                Some("VertexLayer")
            }
            Operand::Capability(Capability::RayQueryKHR) => Some("RayQuery"),
            _ => None,
        })
        .collect();
    declared.into_iter().collect()
}

/// The bindings that an instruction of a function refers to.
fn used_bindings(module: &Module) -> BTreeSet<(u32, u32)> {
    let touched: BTreeSet<u32> = module
        .functions
        .iter()
        .flat_map(|function| function.all_inst_iter())
        .flat_map(|instruction| &instruction.operands)
        .filter_map(|operand| match operand {
            Operand::IdRef(id) => Some(*id),
            _ => None,
        })
        .collect();
    let (mut sets, mut bindings) = (BTreeMap::new(), BTreeMap::new());
    for note in &module.annotations {
        if let [
            Operand::IdRef(id),
            Operand::Decoration(what),
            Operand::LiteralBit32(value),
        ] = note.operands.as_slice()
        {
            match what {
                Decoration::DescriptorSet => drop(sets.insert(*id, *value)),
                Decoration::Binding => drop(bindings.insert(*id, *value)),
                _ => {}
            }
        }
    }
    let used = bindings.into_iter().filter(|(id, _)| touched.contains(id));
    used.map(|(id, binding)| (sets.get(&id).copied().unwrap_or(0), binding))
        .collect()
}

/// A module without sources and line numbers: the compiler cuts its sources in the middle of multi-byte characters, which `rspirv` refuses.
fn without_sources(module: &[u8]) -> Vec<u8> {
    const HEADER_BYTES: usize = 20;
    const LEFT_OUT: [u16; 6] = [
        Op::SourceContinued as u16,
        Op::Source as u16,
        Op::String as u16,
        Op::Line as u16,
        Op::NoLine as u16,
        Op::ModuleProcessed as u16,
    ];
    let (header, mut rest) = module.split_at(HEADER_BYTES.min(module.len()));
    let mut kept = header.to_vec();
    while let [code_low, code_high, words_low, words_high, ..] = rest {
        let words = usize::from(u16::from_le_bytes([*words_low, *words_high]));
        let (instruction, after) = rest.split_at((4 * words.max(1)).min(rest.len()));
        if !LEFT_OUT.contains(&u16::from_le_bytes([*code_low, *code_high])) {
            kept.extend_from_slice(instruction);
        }
        rest = after;
    }
    kept
}

impl Reader {
    fn new(module: Module) -> Self {
        let mut reader = Self {
            names: BTreeMap::new(),
            member_names: BTreeMap::new(),
            decorations: BTreeMap::new(),
            member_decorations: BTreeMap::new(),
            definitions: BTreeMap::new(),
            module,
        };
        for name in &reader.module.debug_names {
            match (name.class.opcode, name.operands.as_slice()) {
                (Op::Name, [Operand::IdRef(id), Operand::LiteralString(text)]) => {
                    reader.names.insert(*id, text.clone());
                }
                (
                    Op::MemberName,
                    [
                        Operand::IdRef(id),
                        Operand::LiteralBit32(member),
                        Operand::LiteralString(text),
                    ],
                ) => {
                    reader.member_names.insert((*id, *member), text.clone());
                }
                _ => {}
            }
        }
        for note in &reader.module.annotations {
            match (note.class.opcode, note.operands.as_slice()) {
                (Op::Decorate, [Operand::IdRef(id), ..]) => {
                    reader.decorations.entry(*id).or_default().push(note.clone());
                }
                (Op::MemberDecorate, [Operand::IdRef(id), Operand::LiteralBit32(member), ..]) => {
                    reader
                        .member_decorations
                        .entry((*id, *member))
                        .or_default()
                        .push(note.clone());
                }
                _ => {}
            }
        }
        for definition in &reader.module.types_global_values {
            if let Some(id) = definition.result_id {
                reader.definitions.insert(id, definition.clone());
            }
        }
        reader
    }

    fn definition(&self, id: u32) -> Result<&Instruction, String> {
        self.definitions.get(&id).ok_or_else(|| format!("%{id} is not defined"))
    }

    fn id_operand(&self, id: u32, index: usize) -> Result<u32, String> {
        match self.definition(id)?.operands.get(index) {
            Some(Operand::IdRef(found)) => Ok(*found),
            other => Err(format!("%{id} operand {index}: {other:?}")),
        }
    }

    fn literal(&self, id: u32, index: usize) -> Result<u32, String> {
        match self.definition(id)?.operands.get(index) {
            Some(Operand::LiteralBit32(value)) => Ok(*value),
            other => Err(format!("%{id} operand {index}: {other:?}")),
        }
    }

    /// The literal of a decoration of `id`; `Some(0)` for one without a literal.
    fn decoration(&self, id: u32, wanted: Decoration) -> Option<u32> {
        find_decoration(self.decorations.get(&id)?, 1, wanted)
    }

    fn member_decoration(&self, id: u32, member: u32, wanted: Decoration) -> Option<u32> {
        find_decoration(self.member_decorations.get(&(id, member))?, 2, wanted)
    }

    fn binding(&self, id: u32, pointee: u32, class: StorageClass) -> Result<Binding, String> {
        let set = self.decoration(id, Decoration::DescriptorSet).unwrap_or(0);
        let binding = self
            .decoration(id, Decoration::Binding)
            .ok_or_else(|| format!("%{id} has no binding"))?;
        let mut name = self.names.get(&id).cloned().unwrap_or_default();
        let resource = match (class, self.definition(pointee)?.class.opcode) {
            (StorageClass::StorageBuffer, Op::TypeStruct) => {
                let block = self.structure(pointee)?;
                // A block is read-only or write-only when all of its members are.
                let all = |wanted| {
                    (0..block.members.len() as u32).all(|m| self.member_decoration(pointee, m, wanted).is_some())
                        || self.decoration(id, wanted).is_some()
                };
                Resource::Storage {
                    reads: !all(Decoration::NonReadable),
                    writes: !all(Decoration::NonWritable),
                    block,
                }
            }
            (StorageClass::Uniform, Op::TypeStruct) => Resource::Uniform {
                block: self.structure(pointee)?,
            },
            (_, Op::TypeImage) if self.is_texel_buffer(pointee) => Resource::TexelBuffer,
            (_, Op::TypeImage) => Resource::StorageImage {
                reads: self.decoration(id, Decoration::NonReadable).is_none(),
                writes: self.decoration(id, Decoration::NonWritable).is_none(),
            },
            (_, Op::TypeSampledImage) => Resource::SampledImage,
            (_, Op::TypeAccelerationStructureKHR) => Resource::AccelerationStructure,
            (_, other) => return Err(format!("{name}: a binding of kind {other:?} is not supported")),
        };
        if name.is_empty() {
            name = match &resource {
                Resource::Storage { block, .. } | Resource::Uniform { block } => snake_case(&block.name),
                _ => return Err(format!("set {set} binding {binding} has no name")),
            };
        }
        let view = match &resource {
            Resource::StorageImage { .. } => Some(self.view_kind(pointee)?),
            Resource::SampledImage => Some(self.view_kind(self.id_operand(pointee, 0)?)?),
            _ => None,
        };
        Ok(Binding {
            set,
            binding,
            name,
            resource,
            view,
        })
    }

    /// What an image type is seen as: its operands are the sampled type, the dimension, depth or not, and arrayed or not.
    fn view_kind(&self, image: u32) -> Result<&'static str, String> {
        let operands = &self.definition(image)?.operands;
        match (operands.get(1), operands.get(3)) {
            (Some(Operand::Dim(Dim::Dim2D)), Some(Operand::LiteralBit32(0))) => Ok("Plane"),
            (Some(Operand::Dim(Dim::Dim2D)), Some(Operand::LiteralBit32(1))) => Ok("Layers"),
            (Some(Operand::Dim(Dim::DimCube)), Some(Operand::LiteralBit32(0))) => Ok("Cube"),
            other => Err(format!("an image of kind {other:?} is not supported")),
        }
    }

    /// An image of dimension `Buffer` that is read through texel fetches.
    fn is_texel_buffer(&self, image: u32) -> bool {
        self.definition(image)
            .is_ok_and(|definition| definition.operands.contains(&Operand::Dim(Dim::DimBuffer)))
    }

    fn structure(&self, id: u32) -> Result<Struct, String> {
        let mut members = Vec::new();
        for (index, operand) in self.definition(id)?.operands.iter().enumerate() {
            let (Operand::IdRef(member_type), index) = (operand, index as u32) else {
                continue;
            };
            let name = self
                .member_names
                .get(&(id, index))
                .cloned()
                .unwrap_or_else(|| format!("member_{index}"));
            let offset = self
                .member_decoration(id, index, Decoration::Offset)
                .ok_or_else(|| format!("member {name} has no offset"))?;
            let stride = self.member_decoration(id, index, Decoration::MatrixStride);
            members.push(Member {
                name,
                offset,
                kind: self.kind(*member_type, stride)?,
            });
        }
        let name = self.names.get(&id).cloned().unwrap_or_default();
        Ok(Struct {
            name,
            members,
            stride: None,
        })
    }

    fn kind(&self, id: u32, matrix_stride: Option<u32>) -> Result<Type, String> {
        let definition = self.definition(id)?;
        Ok(match definition.class.opcode {
            Op::TypeFloat => match self.literal(id, 0)? {
                32 => Type::Scalar("f32", 4),
                64 => Type::Scalar("f64", 8),
                bits => return Err(format!("{bits}-bit floats in blocks are not supported")),
            },
            Op::TypeInt => match (self.literal(id, 0)?, self.literal(id, 1)?) {
                (8, 0) => Type::Scalar("u8", 1),
                (16, 0) => Type::Scalar("u16", 2),
                (32, 0) => Type::Scalar("u32", 4),
                (32, _) => Type::Scalar("i32", 4),
                (64, 0) => Type::Scalar("u64", 8),
                (64, _) => Type::Scalar("i64", 8),
                other => return Err(format!("integers of kind {other:?} in blocks are not supported")),
            },
            Op::TypeVector => {
                let element = self.kind(self.id_operand(id, 0)?, None)?;
                let stride = element.size();
                Type::Array(Box::new(element), self.literal(id, 1)?, stride)
            }
            Op::TypeMatrix => {
                let column = self.kind(self.id_operand(id, 0)?, None)?;
                let stride = matrix_stride.ok_or("a matrix without stride")?;
                if stride != column.size() {
                    return Err("a matrix with padded columns: use the scalar layout".into());
                }
                Type::Array(Box::new(column), self.literal(id, 1)?, stride)
            }
            Op::TypeArray | Op::TypeRuntimeArray => {
                let stride = self
                    .decoration(id, Decoration::ArrayStride)
                    .ok_or("an array without stride")?;
                let mut element = self.kind(self.id_operand(id, 0)?, matrix_stride)?;
                if let Type::Struct(layout) = &mut element {
                    layout.stride = Some(stride);
                }
                if element.size() != stride {
                    return Err(format!(
                        "an array stride of {stride} for elements of {} bytes",
                        element.size()
                    ));
                }
                if definition.class.opcode == Op::TypeRuntimeArray {
                    Type::Runtime(Box::new(element), stride)
                } else {
                    Type::Array(Box::new(element), self.literal(self.id_operand(id, 1)?, 0)?, stride)
                }
            }
            Op::TypeStruct => Type::Struct(self.structure(id)?),
            other => return Err(format!("{other:?} in a block is not supported")),
        })
    }

    fn spec_constants(&self) -> Result<Vec<SpecConstant>, String> {
        let mut constants = Vec::new();
        for definition in &self.module.types_global_values {
            let Some(id) = definition.result_id else { continue };
            let Some(spec_id) = self.decoration(id, Decoration::SpecId) else {
                continue;
            };
            let (kind, default) = match definition.class.opcode {
                Op::SpecConstantTrue => ("bool", 1),
                Op::SpecConstantFalse => ("bool", 0),
                _ => {
                    let kind = match self.kind(definition.result_type.ok_or("a constant without type")?, None)? {
                        Type::Scalar(kind @ ("u32" | "i32" | "f32"), 4) => kind,
                        other => return Err(format!("a specialization constant of type {other:?}")),
                    };
                    (kind, self.literal(id, 0)?)
                }
            };
            let name = match self.names.get(&id) {
                Some(name) if !name.is_empty() => name.to_lowercase(),
                _ => self
                    .unnamed_local_size(id)
                    .ok_or_else(|| format!("specialization constant {spec_id} has no name"))?,
            };
            constants.push(SpecConstant {
                id: spec_id,
                name,
                kind,
                default,
            });
        }
        constants.sort_by_key(|constant| constant.id);
        Ok(constants)
    }

    /// The components of the `WorkgroupSize` built-in, where the module has one.
    fn workgroup_size(&self) -> Option<Vec<u32>> {
        let is_size = |id: &u32| self.decoration(*id, Decoration::BuiltIn) == Some(BuiltIn::WorkgroupSize as u32);
        let id = *self.decorations.keys().find(|id| is_size(id))?;
        let parts = self.definitions.get(&id)?.operands.iter();
        Some(
            parts
                .filter_map(|o| {
                    if let Operand::IdRef(part) = o {
                        Some(*part)
                    } else {
                        None
                    }
                })
                .collect(),
        )
    }

    fn unnamed_local_size(&self, id: u32) -> Option<String> {
        let axis = self.workgroup_size()?.iter().position(|part| *part == id)?;
        Some(format!("local_size_{}", ["x", "y", "z"][axis]))
    }

    /// Whether any of the capabilities of subgroup operations is declared.
    fn has_subgroup_operations(&self) -> bool {
        let mut capabilities = self.module.capabilities.iter().flat_map(|declared| &declared.operands);
        capabilities
            .any(|operand| matches!(operand, Operand::Capability(c) if format!("{c:?}").starts_with("GroupNonUniform")))
    }

    fn local_size(&self, spec: &[SpecConstant]) -> [Result<u32, u32>; 3] {
        let mut size = [Ok(1); 3];
        for mode in &self.module.execution_modes {
            if let [_, Operand::ExecutionMode(ExecutionMode::LocalSize), sizes @ ..] = mode.operands.as_slice() {
                for (axis, operand) in sizes.iter().enumerate().take(3) {
                    if let Operand::LiteralBit32(value) = operand {
                        size[axis] = Ok(*value);
                    }
                }
            }
        }
        for (axis, part) in self.workgroup_size().unwrap_or_default().iter().enumerate().take(3) {
            if let Some(id) = self.decoration(*part, Decoration::SpecId)
                && spec.iter().any(|constant| constant.id == id)
            {
                size[axis] = Err(id);
            }
        }
        size
    }
}

fn find_decoration(list: &[Instruction], at: usize, wanted: Decoration) -> Option<u32> {
    let found = list
        .iter()
        .find(|i| i.operands.get(at) == Some(&Operand::Decoration(wanted)))?;
    Some(match found.operands.get(at + 1) {
        Some(Operand::LiteralBit32(value)) => *value,
        Some(Operand::BuiltIn(value)) => *value as u32,
        _ => 0,
    })
}

/// `PathStates` → `path_states`.
pub fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    for (index, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && index > 0 {
            snake.push('_');
        }
        snake.extend(letter.to_lowercase());
    }
    snake
}
