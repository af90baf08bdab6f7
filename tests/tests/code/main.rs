//! What the sources, shaders and pages say of themselves.

mod house;
mod licences;
mod second_opinion;
mod shader_build;
mod shaders;
