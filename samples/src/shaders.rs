//! The shaders of the samples with their interfaces, generated from reflection by the build.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
