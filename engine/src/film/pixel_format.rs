//! In which order a displayed pixel has its bytes.

use ash::vk;

/// Four bytes per pixel, as screens take them: sRGB-encoded colours, and an alpha of 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PixelFormat {
    /// Red, green, blue, alpha: picture files, `VK_FORMAT_R8G8B8A8_*`.
    #[default]
    Rgba8,
    /// Blue, green, red, alpha: most windows, `VK_FORMAT_B8G8R8A8_*`.
    Bgra8,
}

impl PixelFormat {
    /// The order of an image's format, such as [`Surface::format`](crate::gpu::Surface::format); `None` for a format of other bytes.
    pub fn of(format: vk::Format) -> Option<Self> {
        match format {
            vk::Format::R8G8B8A8_UNORM | vk::Format::R8G8B8A8_SRGB => Some(Self::Rgba8),
            vk::Format::B8G8R8A8_UNORM | vk::Format::B8G8R8A8_SRGB => Some(Self::Bgra8),
            _ => None,
        }
    }

    /// Whether blue comes first, as kernels ask.
    pub(crate) fn blue_first(self) -> u32 {
        u32::from(self == Self::Bgra8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_byte_is_that_of_the_image_format() {
        let first = |format| PixelFormat::of(format).map(PixelFormat::blue_first);
        assert_eq!(first(vk::Format::B8G8R8A8_UNORM), Some(1));
        assert_eq!(first(vk::Format::R8G8B8A8_UNORM), Some(0));
        assert_eq!(first(vk::Format::R16G16B16A16_SFLOAT), None);
    }
}
