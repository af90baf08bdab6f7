//! Compiles `shaders/` to SPIR-V and generates the Rust interface of every shader from reflection.
//!
//! GLSL is the only place where a layout is written down: bindings, push constants, buffer structs and specialization constants reach
//! Rust through the file that this script writes to `OUT_DIR/shaders.rs`, so a renamed field is a compile error on the host side.

#[path = "build/compile.rs"]
mod compile;
#[path = "build/constants.rs"]
mod constants;
#[path = "build/generate.rs"]
mod generate;
#[path = "build/reflect.rs"]
mod reflect;

use std::path::{Path, PathBuf};

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR"));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    if let Err(message) = run(&root, &out) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

fn run(root: &Path, out: &Path) -> Result<(), String> {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=GLSLC");
    let debug_info = std::env::var("DEBUG").is_ok_and(|level| level != "false" && level != "0");
    let shaders = compile::compile_all(&root.join("shaders"), out, debug_info)?;
    let interfaces = shaders
        .iter()
        .map(|shader| {
            std::fs::read(&shader.reflected)
                .map_err(|error| error.to_string())
                .and_then(|module| reflect::reflect(&module))
                .map_err(|message| format!("{}: {message}", shader.name))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let rust = generate::generate(&shaders, &interfaces)? + &constants::generate(&root.join("shaders"))?;
    std::fs::write(out.join("shaders.rs"), rust).map_err(|error| format!("cannot write shaders.rs: {error}"))
}
