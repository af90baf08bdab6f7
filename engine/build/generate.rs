//! Writes the Rust side of the shader interfaces.
//!
//! One module a shader, nested as the folders are; structs that blocks are made of go to `types`, and descriptor sets that a GLSL
//! include names (`// descriptor set 2: SceneSet`) go to `sets`, once, and must be the same in every shader that uses them. Two includes may
//! share a set: of one the line says so (`// descriptor set 3 from binding 8: PhotonBeamSet`), and each has a struct of its own.
//!
//! The variant `driver` of a shader is the same kernel by ray queries, for pipelines that the host makes as those of the shader: it must have the same
//! push constants, workgroup and sets but for that of the index, and no specialization constants that the shader lacks.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::Paths;
use super::compile::Shader;
use super::reflect::{Binding, Interface, Member, Resource, Struct, Type, snake_case};

const SET_MARK: &str = "// descriptor set ";
const FIRST_MARK: &str = " from binding ";

/// What stands for the paths of the crate in the text, until it is complete.
const GPU: &str = "@gpu@";
const SHADERS: &str = "@shaders@";

/// A node of the module tree.
#[derive(Default)]
struct Folder {
    folders: BTreeMap<String, Folder>,
    shaders: String,
}

/// The text of `shaders.rs`.
pub fn generate(shaders: &[Shader], interfaces: &[Interface], paths: &Paths) -> Result<String, String> {
    let mut types = BTreeMap::new();
    let mut sets: BTreeMap<String, (String, Vec<Binding>)> = BTreeMap::new();
    let mut root = Folder::default();
    let mut all = String::new();
    for (shader, interface) in shaders.iter().zip(interfaces) {
        let named = named_sets(shader)?;
        for (place, name) in &named {
            let of_name = |binding: &&Binding| named_place(&named, binding) == Some(place);
            let bindings: Vec<_> = interface.bindings.iter().filter(of_name).cloned().collect();
            if let Some((other, earlier)) = sets.get(name) {
                if *earlier != bindings {
                    return Err(format!(
                        "descriptor set {name} differs between {other} and {}",
                        shader.name
                    ));
                }
            } else if !bindings.is_empty() {
                sets.insert(name.clone(), (shader.name.clone(), bindings));
            }
        }
        collect_types(interface, &mut types).map_err(|message| format!("{}: {message}", shader.name))?;
        let (path, file) = shader.file.rsplit_once('/').unwrap_or(("", &shader.file));
        let mut folder = &mut root;
        for part in path.split('/').filter(|part| !part.is_empty()) {
            folder = folder.folders.entry(part.to_owned()).or_default();
        }
        let module = module_name(file, shader.variant);
        let _ = writeln!(
            all,
            "    &{}::INFO,",
            [&path.replace('/', "::"), &module]
                .map(String::as_str)
                .join("::")
                .trim_start_matches(':')
        );
        let ray_query = shaders
            .iter()
            .zip(interfaces)
            .find(|(other, _)| is_by_ray_queries(shader, other));
        if let Some((other, by_ray_queries)) = ray_query {
            check_stands_in(interface, by_ray_queries).map_err(|message| format!("{}: {message}", other.name))?;
        }
        folder.shaders += &shader_module(shader, interface, &module, &named, ray_query.is_some());
    }
    let mut text =
        String::from("/// Structs that shader blocks are made of, with the device's offsets.\npub mod types {\n");
    for layout in types.values() {
        text += &rust_struct(layout, &format!("`{}` as in GLSL.", layout.name));
    }
    text += "}\n/// Descriptor sets that several shaders share.\npub mod sets {\n";
    if !sets.is_empty() {
        let _ = writeln!(text, "use {GPU}::interface::*;");
    }
    for (name, (_, bindings)) in &sets {
        text += &rust_set(name, bindings[0].set, bindings);
    }
    text += "}\n";
    write_folder(&root, &mut text);
    let _ = write!(
        text,
        "/// Every shader of this crate.\npub static ALL: &[&{GPU}::interface::ShaderInfo] = &[\n{all}];\n"
    );
    Ok(text.replace(GPU, paths.gpu).replace(SHADERS, paths.shaders))
}

fn write_folder(folder: &Folder, text: &mut String) {
    *text += &folder.shaders;
    for (name, inner) in &folder.folders {
        let _ = writeln!(text, "/// Shaders of `shaders/…/{name}/`.\npub mod {name} {{");
        write_folder(inner, text);
        *text += "}\n";
    }
}

/// `trace_rays.comp` → `trace_rays`; graphics stages keep their stage as a suffix, and variants their name.
fn module_name(file: &str, variant: Option<&str>) -> String {
    let (stem, stage) = file.rsplit_once('.').unwrap_or((file, ""));
    let suffix = Some(stage).filter(|stage| *stage != "comp");
    let parts = [Some(stem), suffix, variant];
    parts.into_iter().flatten().collect::<Vec<_>>().join("_")
}

/// Names of sets, by the set and the first binding that each is of.
type NamedSets = BTreeMap<(u32, u32), String>;

/// Sets that the shader's sources give a name to.
fn named_sets(shader: &Shader) -> Result<NamedSets, String> {
    let mut named = BTreeMap::new();
    for (path, text) in &shader.sources {
        for mark in text.lines().filter_map(|line| line.strip_prefix(SET_MARK)) {
            let (place, name) = mark.split_once(": ").ok_or_else(|| format!("{path}: {mark}"))?;
            let (set, first) = place.split_once(FIRST_MARK).unwrap_or((place, "0"));
            let number = |digits: &str| digits.parse::<u32>().map_err(|_| format!("{path}: {mark}"));
            let place = (number(set)?, number(first)?);
            let name = name
                .split_whitespace()
                .next()
                .unwrap_or_default()
                .trim_end_matches(['.', ','])
                .to_owned();
            named.insert(place, name);
        }
    }
    Ok(named)
}

/// Where the name of a binding's set stands, if it has one.
fn named_place<'a>(named: &'a NamedSets, binding: &Binding) -> Option<&'a (u32, u32)> {
    let before = named.range((binding.set, 0)..=(binding.set, binding.binding));
    before.map(|(place, _)| place).next_back()
}

type Types = BTreeMap<String, Struct>;

fn collect_types(interface: &Interface, types: &mut Types) -> Result<(), String> {
    for binding in &interface.bindings {
        if let Resource::Storage { block, .. } | Resource::Uniform { block } = &binding.resource {
            block
                .members
                .iter()
                .try_for_each(|member| collect_type(&member.kind, types))?;
        }
    }
    interface
        .push
        .iter()
        .flat_map(|push| &push.members)
        .try_for_each(|member| collect_type(&member.kind, types))
}

fn collect_type(kind: &Type, types: &mut Types) -> Result<(), String> {
    match kind {
        Type::Scalar(..) => Ok(()),
        Type::Array(element, ..) | Type::Runtime(element, _) => collect_type(element, types),
        Type::Struct(layout) => {
            layout
                .members
                .iter()
                .try_for_each(|member| collect_type(&member.kind, types))?;
            match types.get(&layout.name) {
                Some(earlier) if earlier.members != layout.members || earlier.size() != layout.size() => {
                    Err(format!("struct {} has another layout in another shader", layout.name))
                }
                Some(_) => Ok(()),
                None => {
                    types.insert(layout.name.clone(), layout.clone());
                    Ok(())
                }
            }
        }
    }
}

/// The set of the ray index, which ray queries have otherwise.
const INDEX_SET: u32 = 1;

/// Whether `other` is the kernel `shader` by ray queries.
fn is_by_ray_queries(shader: &Shader, other: &Shader) -> bool {
    shader.variant.is_none() && other.variant == Some("driver") && shader.file == other.file
}

/// Fails for a module that cannot be given what the host gives another one.
fn check_stands_in(of: &Interface, by_ray_queries: &Interface) -> Result<(), String> {
    let constants = |interface: &Interface| -> Vec<_> {
        let all = interface.spec.iter();
        all.map(|constant| (constant.id, constant.name.clone(), constant.kind))
            .collect()
    };
    let sets = |interface: &Interface| -> Vec<_> {
        let all = interface.bindings.iter().filter(|binding| binding.set != INDEX_SET);
        all.cloned().collect()
    };
    let known = constants(of);
    let differs = if of.push != by_ray_queries.push {
        "push constants"
    } else if of.local_size != by_ray_queries.local_size {
        "workgroup"
    } else if sets(of) != sets(by_ray_queries) {
        "sets"
    } else if !constants(by_ray_queries)
        .iter()
        .all(|constant| known.contains(constant))
    {
        "specialization constants"
    } else {
        return Ok(());
    };
    Err(format!(
        "its {differs} are not those of the kernel that it stands in for"
    ))
}

fn shader_module(
    shader: &Shader,
    interface: &Interface,
    module: &str,
    named: &NamedSets,
    has_ray_query: bool,
) -> String {
    let mut text = String::new();
    for line in &shader.head {
        let _ = writeln!(text, "/// {line}");
    }
    if let Some(variant) = shader.variant {
        let _ = writeln!(text, "///\n/// This is the variant `{variant}`.");
    }
    let _ = writeln!(text, "pub mod {module} {{\nuse {GPU}::interface::*;");
    let embedded = shader.embedded.display().to_string();
    let local_size = interface.local_size.map(|size| match size {
        Ok(fixed) => format!("LocalSize::Fixed({fixed})"),
        Err(id) => format!("LocalSize::Spec({id})"),
    });
    let push_bytes = interface.push.as_ref().map_or(0, Struct::size);
    let _ = writeln!(
        text,
        "/// What the module holds, by reflection.\npub static INFO: ShaderInfo = ShaderInfo {{\n    name: {:?},\n    stage: Stage::{},\n    \
         spirv: include_bytes!({embedded:?}),\n    push_constant_bytes: {push_bytes},\n    fingerprint: {},\n    local_size: [{}],\n    \
         subgroups: {},\n    capabilities: &[{}],\n    ray_query: {},\n    bindings: &[",
        shader.name,
        interface.stage,
        interface.fingerprint(),
        local_size.join(", "),
        interface.subgroups,
        interface
            .capabilities
            .iter()
            .map(|name| format!("Capability::{name}"))
            .collect::<Vec<_>>()
            .join(", "),
        if has_ray_query {
            format!("Some(&super::{module}_driver::INFO)")
        } else {
            "None".into()
        },
    );
    for binding in &interface.bindings {
        let kind = match &binding.resource {
            Resource::Storage { .. } => "StorageBuffer",
            Resource::Uniform { .. } => "UniformBuffer",
            Resource::StorageImage { .. } => "StorageImage",
            Resource::SampledImage => "SampledImage",
            Resource::TexelBuffer => "TexelBuffer",
            Resource::AccelerationStructure => "AccelerationStructure",
        };
        let (reads, writes) = access(&binding.resource);
        let _ = writeln!(
            text,
            "        BindingInfo {{ set: {}, binding: {}, name: {:?}, kind: BindingKind::{kind}, reads: {reads}, writes: {writes}, used: {}, \
             view: {}, fixed_bytes: {} }},",
            binding.set,
            binding.binding,
            binding.name,
            interface.used.contains(&(binding.set, binding.binding)),
            binding
                .view
                .map_or("None".into(), |view| format!("Some(ViewKind::{view})")),
            fixed_bytes(&binding.resource)
        );
    }
    text += "    ],\n    spec_constants: &[\n";
    for constant in &interface.spec {
        let _ = writeln!(
            text,
            "        SpecInfo {{ id: {}, name: {:?}, default: {} }},",
            constant.id, constant.name, constant.default
        );
    }
    text += "    ],\n};\n";
    if let Some(push) = &interface.push {
        let renamed = Struct {
            name: "Push".into(),
            ..push.clone()
        };
        text += &rust_struct(&renamed, "Push constants.");
        text += "impl PushConstants for Push {\n    fn bytes(&self) -> &[u8] {\n        bytemuck::bytes_of(self)\n    }\n}\n";
    }
    text += &rust_spec(interface);
    let sets: std::collections::BTreeSet<u32> = interface.bindings.iter().map(|b| b.set).collect();
    for set in sets {
        let bindings: Vec<_> = interface.bindings.iter().filter(|b| b.set == set).cloned().collect();
        let places: std::collections::BTreeSet<_> = bindings.iter().filter_map(|b| named_place(named, b)).collect();
        for place in places {
            let _ = writeln!(text, "pub use {SHADERS}::sets::{};", named[place]);
        }
        let own = bindings.iter().filter(|b| named_place(named, b).is_none());
        let own: Vec<_> = own.cloned().collect();
        if !own.is_empty() {
            text += &rust_set(&format!("Set{set}"), set, &own);
        }
        for binding in &bindings {
            text += &block_header(binding);
        }
    }
    let push = if interface.push.is_some() { "Push" } else { "()" };
    let (kind, word) = if interface.stage == "Compute" {
        ("Kernel", "kernel")
    } else {
        ("Shader", "shader")
    };
    let _ = writeln!(
        text,
        "/// The {word} as a type: its push constants and specialization constants.\n#[derive(Debug)]\npub enum {kind} {{}}\n\
         // SAFETY: all is the module's by reflection.\n#[allow(unsafe_code)]\nunsafe impl {}Shader for {kind} {{\n    type Push = {push};\n    type Spec = Spec;\n    fn info() -> &'static ShaderInfo {{ &INFO }}\n}}",
        interface.stage
    );
    text += "}\n";
    text
}

fn access(resource: &Resource) -> (bool, bool) {
    match resource {
        Resource::Storage { reads, writes, .. } | Resource::StorageImage { reads, writes } => (*reads, *writes),
        _ => (true, false),
    }
}

/// Bytes of a block up to the end of its last member that has a size; 0 for what is no block.
fn fixed_bytes(resource: &Resource) -> u32 {
    let (Resource::Storage { block, .. } | Resource::Uniform { block }) = resource else {
        return 0;
    };
    let fixed = block.members.iter().filter(|m| !matches!(m.kind, Type::Runtime(..)));
    fixed
        .map(|member| member.offset + member.kind.size())
        .max()
        .unwrap_or(0)
}

/// The fixed part of a block: the whole block when it has no runtime array.
fn block_header(binding: &Binding) -> String {
    let (Resource::Storage { block, .. } | Resource::Uniform { block }) = &binding.resource else {
        return String::new();
    };
    let fixed: Vec<Member> = block
        .members
        .iter()
        .filter(|m| !matches!(m.kind, Type::Runtime(..)))
        .cloned()
        .collect();
    if fixed.is_empty() {
        return String::new();
    }
    let layout = Struct {
        name: block.name.clone(),
        members: fixed,
        stride: None,
    };
    rust_struct(&layout, &format!("Fixed part of block `{}`.", block.name))
}

fn rust_spec(interface: &Interface) -> String {
    if interface.spec.is_empty() {
        return "/// Specialization constants: none.\npub type Spec = ();\n".into();
    }
    // Clippy asks for a derived default where it is all zeros.
    let derived = interface.spec.iter().all(|constant| constant.default == 0);
    let traits = if derived {
        "Debug, Clone, Copy, PartialEq, Default"
    } else {
        "Debug, Clone, Copy, PartialEq"
    };
    let mut text = format!(
        "/// Specialization constants; the default is the shader's own.\n#[derive({traits})]\npub struct Spec {{\n"
    );
    for constant in &interface.spec {
        let _ = writeln!(
            text,
            "    /// `constant_id = {}`.\n    pub {}: {},",
            constant.id, constant.name, constant.kind
        );
    }
    text += "}\n";
    if !derived {
        text += &spec_default(interface);
    }
    text += "impl SpecConstants for Spec {\n    fn values(&self) -> Vec<(u32, u32)> {\n        vec![\n";
    for constant in &interface.spec {
        let bits = match constant.kind {
            "bool" | "i32" => format!("self.{} as u32", constant.name),
            "f32" => format!("self.{}.to_bits()", constant.name),
            _ => format!("self.{}", constant.name),
        };
        let _ = writeln!(text, "            ({}, {bits}),", constant.id);
    }
    text += "        ]\n    }\n}\n";
    text
}

fn spec_default(interface: &Interface) -> String {
    let mut text = String::from("impl Default for Spec {\n    fn default() -> Self {\n        Self {\n");
    for constant in &interface.spec {
        let value = match constant.kind {
            "bool" => (constant.default != 0).to_string(),
            "f32" => format!("f32::from_bits({})", constant.default),
            "i32" => format!("{}", constant.default as i32),
            _ => constant.default.to_string(),
        };
        let _ = writeln!(text, "            {}: {value},", constant.name);
    }
    text + "        }\n    }\n}\n"
}

fn rust_set(name: &str, set: u32, bindings: &[Binding]) -> String {
    let mut text = format!("/// Descriptor set {set}.\n#[derive(Debug, Clone, Copy)]\npub struct {name}<'a> {{\n");
    for binding in bindings {
        let (kind, what) = match &binding.resource {
            Resource::Storage { block, .. } => ("BufferView<'a>", element_name(block)),
            Resource::Uniform { block } => ("BufferView<'a>", block.name.clone()),
            Resource::StorageImage { .. } => ("&'a Image", "storage image".into()),
            Resource::SampledImage => ("SampledView<'a>", "sampled image".into()),
            Resource::TexelBuffer => ("&'a TexelView", "texel buffer".into()),
            Resource::AccelerationStructure => ("&'a AccelerationStructure", "acceleration structure".into()),
        };
        let mode = match access(&binding.resource) {
            (true, false) => "read",
            (false, true) => "written",
            _ => "read and written",
        };
        let _ = writeln!(
            text,
            "    /// Binding {}, {mode}: `{what}`.\n    pub {}: {kind},",
            binding.binding, binding.name
        );
    }
    let _ = write!(
        text,
        "}}\nimpl<'a> BindingSet<'a> for {name}<'a> {{\n    fn set(&self) -> u32 {{\n        {set}\n    }}\n    \
         fn resources(&self) -> Vec<(u32, BoundResource<'a>)> {{\n        vec![\n"
    );
    for binding in bindings {
        let variant = match &binding.resource {
            Resource::Storage { .. } | Resource::Uniform { .. } => "Buffer",
            Resource::StorageImage { .. } => "StorageImage",
            Resource::SampledImage => "Sampled",
            Resource::TexelBuffer => "Texels",
            Resource::AccelerationStructure => "Structure",
        };
        let _ = writeln!(
            text,
            "            ({}, BoundResource::{variant}(self.{})),",
            binding.binding, binding.name
        );
    }
    text += "        ]\n    }\n}\n";
    text
}

/// `Ray[]` for a block that ends in a runtime array, else the block's name.
fn element_name(block: &Struct) -> String {
    match block.members.last().map(|m| &m.kind) {
        Some(Type::Runtime(element, _)) => format!("{}[]", rust_type(element).rsplit("::").next().unwrap_or_default()),
        _ => block.name.clone(),
    }
}

fn rust_struct(layout: &Struct, doc: &str) -> String {
    let mut text = format!(
        "/// {doc} {} bytes.\n#[repr(C)]\n#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\npub struct {} {{\n",
        layout.size(),
        layout.name
    );
    let mut end = 0;
    let mut checks = String::new();
    let pad = |text: &mut String, from: u32, to: u32| {
        if to > from {
            let _ = writeln!(text, "    /// Padding.\n    pub _pad_{from}: [u8; {}],", to - from);
        }
    };
    for member in &layout.members {
        pad(&mut text, end, member.offset);
        let name = snake_case(&member.name);
        let _ = writeln!(
            text,
            "    /// Offset {}.\n    pub {name}: {},",
            member.offset,
            rust_type(&member.kind)
        );
        let _ = writeln!(
            checks,
            "    assert!(std::mem::offset_of!({}, {name}) == {});",
            layout.name, member.offset
        );
        end = member.offset + member.kind.size();
    }
    pad(&mut text, end, layout.size());
    let _ = write!(
        text,
        "}}\nconst _: () = {{\n{checks}    assert!(size_of::<{0}>() == {1});\n}};\nimpl Default for {0} {{\n    fn default() -> Self {{\n        \
         bytemuck::Zeroable::zeroed()\n    }}\n}}\n",
        layout.name,
        layout.size()
    );
    text
}

fn rust_type(kind: &Type) -> String {
    match kind {
        Type::Scalar(name, _) => (*name).to_owned(),
        Type::Array(element, count, _) => format!("[{}; {count}]", rust_type(element)),
        Type::Runtime(element, _) => format!("[{}]", rust_type(element)),
        Type::Struct(layout) => format!("{SHADERS}::types::{}", layout.name),
    }
}
