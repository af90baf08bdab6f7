//! The kernels that only tests use, with their interfaces, generated from reflection by the build.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
