//! Compiles the kernels of this crate as the engine's build does its own.

#[path = "../engine/build/shaders.rs"]
mod shaders;

fn main() {
    shaders::build(
        "shaders",
        "../shaders",
        &shaders::Paths {
            gpu: "clerestory::gpu",
            shaders: "crate::shaders",
        },
    );
}
