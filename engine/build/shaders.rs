//! What a build script with shaders does: compile them, reflect them, and write their Rust interfaces to `OUT_DIR/shaders.rs`.
//!
//! GLSL is the only place where a layout is written down: bindings, push constants, buffer structs and specialization constants reach
//! Rust through the file written here, so a renamed field is a compile error on the host side. The engine's build script uses it, and so do
//! those of crates with kernels of their own (the tests, the samples) through `#[path]`.

mod compile;
mod constants;
mod generate;
mod reflect;

use std::path::{Component, Path, PathBuf};

/// Where the generated code finds what it refers to.
pub struct Paths {
    /// The engine's module `gpu`: `clerestory::gpu` outside the engine.
    pub gpu: &'static str,
    /// The module that includes the generated file: `crate::shaders`.
    pub shaders: &'static str,
}

/// Compiles the folder of shaders `own`; `engine` is the engine's folder of shaders, whose includes all share. Both are seen from the
/// crate's manifest. A failure ends the build.
pub fn build(own: &str, engine: &str, paths: &Paths) {
    let folder = |name| PathBuf::from(std::env::var_os(name).unwrap_or_default());
    let (root, out) = (folder("CARGO_MANIFEST_DIR"), folder("OUT_DIR"));
    if let Err(message) = run(&root, &below(&root, own), &below(&root, engine), &out, paths) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// A path without `..` in it, so that it stands in the compiler's lists as it is here.
fn below(root: &Path, path: &str) -> PathBuf {
    let mut place = root.to_owned();
    for part in Path::new(path).components() {
        match part {
            Component::ParentDir => drop(place.pop()),
            other => place.push(other),
        }
    }
    place
}

fn run(root: &Path, own: &Path, engine: &Path, out: &Path, paths: &Paths) -> Result<(), String> {
    for folder in [own, engine] {
        println!("cargo::rerun-if-changed={}", folder.display());
    }
    println!("cargo::rerun-if-env-changed=GLSLC");
    let prebuilt = root.join("spirv");
    if prebuilt.exists() {
        println!("cargo::rerun-if-changed=spirv");
    }
    let compiler = compile::Compiler {
        program: std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into()),
        include: engine.to_owned(),
        debug_info: std::env::var("DEBUG").is_ok_and(|level| level != "false" && level != "0"),
        prebuilt,
    };
    let shaders = compiler.compile_all(own, out)?;
    let interfaces = shaders
        .iter()
        .map(|shader| {
            let read = |file| std::fs::read(file).map_err(|error| error.to_string());
            read(&shader.reflected)
                .and_then(|module| reflect::reflect(&module, &read(&shader.embedded)?))
                .map_err(|message| format!("{}: {message}", shader.name))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let rust = generate::generate(&shaders, &interfaces, paths)? + &constants::generate(own)?;
    std::fs::write(out.join("shaders.rs"), rust).map_err(|error| format!("cannot write shaders.rs: {error}"))
}
