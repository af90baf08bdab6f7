//! The engine's shaders with their interfaces, generated from reflection by the build.
//!
//! # How to add a kernel
//!
//! 1. **Write the entry file** `shaders/<floor>/<name>.comp`. It begins with `#version 460` and a comment block, which becomes the
//!    documentation of the generated module. Mathematics goes to `shaders/<floor>/`, with include guards, as functions of
//!    the same names as their Rust twins. Keep the file short: software drivers compile about a hundred lines per second.
//!
//!    ```glsl
//!    #version 460
//!    // Multiplies numbers by a factor.
//!    #extension GL_EXT_scalar_block_layout : require
//!    layout(local_size_x = 64) in;
//!    layout(constant_id = 0) const bool NEGATE = false;
//!    layout(push_constant, scalar) uniform Push { uint count; float factor; };
//!    layout(set = 0, binding = 0, scalar) restrict buffer Numbers { float numbers[]; };
//!
//!    void main() {
//!        uint i = gl_GlobalInvocationID.x;
//!        if (i < count) {
//!            numbers[i] *= NEGATE ? -factor : factor;
//!        }
//!    }
//!    ```
//!
//! 2. **Build.** The build script compiles every entry file (`.comp`, `.vert`, `.geom`, `.frag`) with warnings as errors, reflects it, and
//!    writes a module of the file's path: `gpu::shaders::<floor>::<name>`. It holds
//!    - `Kernel` (`Shader` for the graphics stages), the shader as a type;
//!    - `Push`, the push constants, and `Spec`, the specialization constants by their lower-case names, with the shader's own defaults;
//!    - `Set0` …, one struct a descriptor set, with one field a binding: buffers by the block's name in snake case;
//!    - a struct for the fixed part of each block; structs that blocks are made of are in [`types`], checked to the byte;
//!    - `INFO`, the reflected interface.
//!
//!    A set that several shaders share is declared in one include whose line `// descriptor set 1: SceneSet` names it; it is then in
//!    [`sets`], and the build fails when two shaders disagree on it. Two includes may share a set, the second from a binding on that its line
//!    says (`// descriptor set 3 from binding 8: PhotonBeamSet`): a dispatch is given both structs. An entry file with the line `// variant: driver` among its first, of a kernel that
//!    traverses the ray index, is compiled once more, for ray queries: the module `<name>_driver`, which
//!    [`Gpu::ray_query_pipeline`](super::Gpu::ray_query_pipeline) loads on devices that have them. `readonly` and `writeonly` are taken at their word by the barrier
//!    checks, so declare them.
//!
//! 3. **Record it.** Debug builds refuse a pass that misses a barrier.
//!
//!    ```ignore
//!    let pipeline = gpu.compute_pipeline::<scale::Kernel>(&scale::Spec { negate: true })?;
//!    recorder.pass("scale", |pass| {
//!        let set = scale::Set0 { numbers: buffer.view() };
//!        let push = scale::Push { count, factor: 2.0 };
//!        pass.dispatch(&pipeline, &[&set], &push, [pipeline.groups_for(count), 1, 1])?;
//!        pass.barrier(&[rw_compute_to_compute(&buffer)]);
//!        Ok(())
//!    })?;
//!    ```
//!
//! 4. **Mind the limits** of small devices: a pipeline has [`Caps::descriptors`](super::Caps) to live with (Vulkan promises
//!    no more than 4 descriptor sets, so that theirs are 0 to 3, and 4 storage buffers per stage), where the bindings count that the optimized module uses; loops end in silence after 65,535 iterations on the software driver; a
//!    submission must be over within seconds, so split work by the [`Timings`](super::Timings) of the last.
//!
//! 5. **Test it** against its twin, like `tests/tests/twins/`; every module is also read by
//!    `spirv-val`, spirv-reflect reads it compiled for Vulkan 1.0, and naga what it can (no texel buffers, for one; the test lists the rest).
//!
//! Kernels that only tests or samples use are in those crates' own folders `shaders/`, whose build scripts share `engine/build/shaders.rs`
//! and may include the engine's GLSL; a host's crate can do the same.
//! What is generated implements `unsafe` traits ([`ComputeShader`](super::interface::ComputeShader)): such a crate may deny unsafe code, and cannot
//! forbid it.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
