//! The build of shaders: what is compiled anew, what is used as it is, and that a package needs no compiler.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The part of the build script that is tested, with what it rests on.
#[path = "../../../engine/build"]
pub(super) mod build {
    pub mod compile;
    pub mod generate;
    pub mod reflect;

    /// Where the generated code finds what it refers to.
    pub struct Paths {
        pub gpu: &'static str,
        pub shaders: &'static str,
    }
}

use build::compile::{Compiler, Shader};

const INCLUDED: &str = "#ifndef VALUE\n#define VALUE 7u\n#endif\n";
const KERNEL: &str = "#version 460\n// Writes a word.\n#extension GL_GOOGLE_include_directive : require\n#include \"part/value.glsl\"\n\
    #ifdef NEVER\n#include \"part/unused.glsl\"\n#endif\n\
    layout(local_size_x = 1) in;\nlayout(set = 0, binding = 0) buffer Words { uint words[]; };\nvoid main() { words[0] = VALUE; }\n";

/// A folder of shaders, with a space in its name, and where modules go.
struct Tree(tempfile::TempDir);

impl Tree {
    fn new() -> Self {
        let tree = Self(tempfile::tempdir().unwrap());
        for below in ["my shaders/part", "my shaders/kernels", "out", "spirv"] {
            std::fs::create_dir_all(tree.path(below)).unwrap();
        }
        tree.write("my shaders/part/value.glsl", INCLUDED);
        tree.write("my shaders/part/unused.glsl", "");
        tree.write("my shaders/kernels/write.comp", KERNEL);
        tree
    }

    fn path(&self, below: &str) -> PathBuf {
        self.0.path().join(below)
    }

    fn write(&self, below: &str, text: &str) {
        std::fs::write(self.path(below), text).unwrap();
    }

    fn build(&self, program: &str) -> Result<Vec<Shader>, String> {
        let program = match program {
            "glslc" => std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into()),
            other => OsString::from(other),
        };
        let compiler = Compiler {
            program,
            include: self.path("my shaders"),
            debug_info: false,
            prebuilt: self.path("spirv"),
        };
        compiler.compile_all(&self.path("my shaders"), &self.path("out"))
    }

    /// What a package is made with: the modules and stamps of a build, and nothing left of the build.
    fn pack(&self) {
        for entry in std::fs::read_dir(self.path("out")).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|end| end == "spv" || end == "stamp") {
                std::fs::copy(&path, self.path("spirv").join(path.file_name().unwrap())).unwrap();
            }
            std::fs::remove_file(path).unwrap();
        }
    }
}

const NOWHERE: &str = "/nowhere/glslc";

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .map(|path| (path.clone(), std::fs::read(path).unwrap()))
        .collect()
}

#[test]
fn a_package_needs_no_compiler_until_its_shaders_change() {
    let tree = Tree::new();
    let error = tree.build(NOWHERE).map(|_| ()).unwrap_err();
    assert!(
        error.contains(NOWHERE) && error.contains("apt-get install glslc"),
        "{error}"
    );

    let made = tree.build("glslc").unwrap();
    let bytes = std::fs::read(&made[0].embedded).unwrap();
    assert_eq!(made[0].head, ["Writes a word."]);
    let used: Vec<_> = made[0].sources.keys().map(String::as_str).collect();
    assert_eq!(
        used,
        ["kernels/write.comp", "part/value.glsl"],
        "the unused include is left out"
    );
    tree.pack();

    let packed = tree.build(NOWHERE).unwrap();
    assert!(packed[0].embedded.starts_with(tree.path("spirv")));
    assert_eq!(std::fs::read(&packed[0].embedded).unwrap(), bytes);
    assert_eq!(packed[0].sources, made[0].sources);
    let read = |file| std::fs::read(file).unwrap();
    let interface = build::reflect::reflect(&read(&packed[0].reflected), &read(&packed[0].embedded)).unwrap();
    let paths = build::Paths {
        gpu: "engine::gpu",
        shaders: "own::shaders",
    };
    let rust = build::generate::generate(&packed, &[interface], &paths).unwrap();
    assert!(
        rust.contains("pub mod write {") && rust.contains("use engine::gpu::interface::*;"),
        "{rust}"
    );

    tree.write("my shaders/part/value.glsl", &INCLUDED.replace('7', "8"));
    let error = tree.build(NOWHERE).map(|_| ()).unwrap_err();
    assert!(error.contains(NOWHERE), "a module of other sources was used: {error}");
    let changed = tree.build("glslc").unwrap();
    assert!(changed[0].embedded.starts_with(tree.path("out")));
    assert_ne!(std::fs::read(&changed[0].embedded).unwrap(), bytes);
}

#[test]
fn only_what_changed_is_compiled_and_what_is_gone_is_removed() {
    let tree = Tree::new();
    tree.write("my shaders/kernels/other.comp", &KERNEL.replace("VALUE;", "1u;"));
    assert_eq!(tree.build("glslc").unwrap().len(), 2);
    let before = files(&tree.path("out"));
    tree.build(NOWHERE).unwrap();
    assert_eq!(files(&tree.path("out")), before);

    std::fs::remove_file(tree.path("my shaders/kernels/other.comp")).unwrap();
    assert_eq!(tree.build(NOWHERE).unwrap().len(), 1);
    assert!(
        files(&tree.path("out"))
            .keys()
            .all(|path| !path.ends_with("kernels__other.comp.spv"))
    );

    tree.write("my shaders/kernels/write.comp", &KERNEL.replace("VALUE;", "MISSING;"));
    let error = tree.build("glslc").map(|_| ()).unwrap_err();
    assert!(error.contains("MISSING") && error.contains("write.comp"), "{error}");
}

#[test]
fn a_binding_is_used_when_the_optimized_module_touches_it() {
    let tree = Tree::new();
    let unused = KERNEL.replace(
        "void main",
        "layout(set = 1, binding = 3) readonly buffer Other { uint other[]; };\nvoid main",
    );
    let used = |text: &str| {
        tree.write("my shaders/kernels/write.comp", text);
        let made = tree.build("glslc").unwrap();
        let read = |file| std::fs::read(file).unwrap();
        let interface = build::reflect::reflect(&read(&made[0].reflected), &read(&made[0].embedded)).unwrap();
        let declared: Vec<_> = interface.bindings.iter().map(|b| (b.set, b.binding)).collect();
        assert_eq!(declared, [(0, 0), (1, 3)]);
        (interface.fingerprint(), interface.used.into_iter().collect::<Vec<_>>())
    };
    let (without, only_first) = used(&unused);
    assert_eq!(only_first, [(0, 0)]);
    // Loaded, and dropped by the optimizer.
    let (dropped, still_first) = used(&unused.replace("words[0] =", "uint never = other[2]; words[0] ="));
    assert_eq!(still_first, [(0, 0)]);
    let (with, both) = used(&unused.replace("= VALUE", "= other[VALUE]"));
    assert_eq!(both, [(0, 0), (1, 3)]);
    // What is used is not part of the declared interface.
    assert_eq!([without, without], [dropped, with]);
}

#[test]
fn the_package_carries_licences_and_readme() {
    let output = std::process::Command::new(env!("CARGO"))
        .args(["package", "--list", "--allow-dirty", "--offline", "-p", "clerestory"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .unwrap();
    let list = String::from_utf8_lossy(&output.stdout);
    for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md", "build.rs", "src/lib.rs"] {
        assert!(list.lines().any(|line| line == file), "{file} is not in {list}");
    }
}
