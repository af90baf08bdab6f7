//! Compiles `shaders/` to SPIR-V and generates the Rust interface of every shader from reflection: `build/shaders.rs`.

#[path = "build/shaders.rs"]
mod shaders;

fn main() {
    shaders::build(
        "",
        &shaders::Paths {
            gpu: "crate::gpu",
            shaders: "crate::gpu::shaders",
        },
    );
}
