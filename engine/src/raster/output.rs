//! What can be asked for of each pixel.

use crate::gpu::ClearColor;
use crate::gpu::ash::vk;

/// A picture that a [`GBuffer`](super::GBuffer) makes; one that is not asked for has no memory and is not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Output {
    /// Number of the triangle, `R32_UINT`; all bits set where there is none.
    Triangle,
    /// Number of the object, `R32_UINT`; all bits set where there is none.
    Object,
    /// Number of the material, `R32_UINT`; all bits set where there is none.
    Material,
    /// Distance from where the pixel's ray begins, metres, `R32_SFLOAT`; infinite where there is nothing.
    Distance,
    /// World-space position, metres, and 1, `R32G32B32A32_SFLOAT`; all 0 where there is nothing.
    Position,
    /// Geometric and shading normal, to the front of the surface, each a word of
    /// [`pack_octahedral`](crate::maps::packed_direction::pack_octahedral) with 16 bits, `R32G32_UINT`. The shading normal is the interpolated one,
    /// on the geometric one's side, with the material's normal map, which may lead it to the
    /// other: who shades adapts it to the viewer.
    Normals,
    /// Weights of the triangle's corners 1 and 2, `R32G32_SFLOAT`.
    Weights,
    /// Texture coordinates of sets 0 and 1, `R32G32B32A32_SFLOAT`.
    TextureCoordinates,
}

impl Output {
    /// All of them, by the fragment shader's locations.
    pub const ALL: [Self; 8] = [
        Self::Triangle,
        Self::Object,
        Self::Material,
        Self::Distance,
        Self::Position,
        Self::Normals,
        Self::Weights,
        Self::TextureCoordinates,
    ];

    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Triangle => "G-buffer triangle",
            Self::Object => "G-buffer object",
            Self::Material => "G-buffer material",
            Self::Distance => "G-buffer distance",
            Self::Position => "G-buffer position",
            Self::Normals => "G-buffer normals",
            Self::Weights => "G-buffer weights",
            Self::TextureCoordinates => "G-buffer texture coordinates",
        }
    }

    /// Its format.
    pub const fn format(self) -> vk::Format {
        match self {
            Self::Triangle | Self::Object | Self::Material => vk::Format::R32_UINT,
            Self::Distance => vk::Format::R32_SFLOAT,
            Self::Position | Self::TextureCoordinates => vk::Format::R32G32B32A32_SFLOAT,
            Self::Normals => vk::Format::R32G32_UINT,
            Self::Weights => vk::Format::R32G32_SFLOAT,
        }
    }

    /// Bytes per pixel.
    pub const fn bytes(self) -> u64 {
        match self {
            Self::Triangle | Self::Object | Self::Material | Self::Distance => 4,
            Self::Normals | Self::Weights => 8,
            Self::Position | Self::TextureCoordinates => 16,
        }
    }

    /// What it holds where there is nothing.
    pub(super) const fn nothing(self) -> ClearColor {
        match self {
            Self::Triangle | Self::Object | Self::Material => ClearColor::Uint([u32::MAX; 4]),
            Self::Distance => ClearColor::Float([f32::INFINITY; 4]),
            Self::Normals => ClearColor::Uint([0; 4]),
            Self::Position | Self::Weights | Self::TextureCoordinates => ClearColor::Float([0.0; 4]),
        }
    }
}
