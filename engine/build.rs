//! Compiles the shaders to SPIR-V and generates the Rust interface of every one from reflection: `build/shaders.rs`.

#[path = "build/shaders.rs"]
mod shaders;

fn main() {
    // A package carries the folder inside; in the repository it stands beside the crate, whatever the making of a package has left inside.
    let own = if std::path::Path::new("../tools/package").exists() {
        "../shaders"
    } else {
        "shaders"
    };
    shaders::build(
        own,
        own,
        &shaders::Paths {
            gpu: "crate::gpu",
            shaders: "crate::gpu::shaders",
        },
    );
}
