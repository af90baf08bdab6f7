//! Texture records and the texels of the images that they use.

use crate::gpu::shaders::constants::{
    NO_TEXTURE, TEXTURE_NEAREST, TEXTURE_SRGB, TEXTURE_UV1, TEXTURE_WRAP_U_SHIFT, TEXTURE_WRAP_V_SHIFT, WRAP_CLAMP,
    WRAP_MIRRORED, WRAP_REPEAT,
};
use crate::gpu::shaders::types::SceneTexture;
use crate::scene::{Filter, Scene, Texture, Wrap};

/// Texture records and the texels of the images that they use, each image once.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) records: Vec<SceneTexture>,
    pub(super) texels: Vec<[u8; 4]>,
    first_texel: Vec<Option<u32>>,
}

impl Textures {
    /// The index of a texture's record; `srgb` says that its colours are encoded.
    pub(super) fn record(&mut self, scene: &Scene, texture: Option<Texture>, srgb: bool) -> u32 {
        let Some(texture) = texture else { return NO_TEXTURE };
        let image = &scene.images[texture.image as usize];
        self.first_texel.resize(scene.images.len(), None);
        let first_texel = *self.first_texel[texture.image as usize].get_or_insert_with(|| {
            let first = self.texels.len() as u32;
            self.texels.extend_from_slice(&image.texels);
            first
        });
        let wrap = |mode| match mode {
            Wrap::Repeat => WRAP_REPEAT,
            Wrap::MirroredRepeat => WRAP_MIRRORED,
            Wrap::ClampToEdge => WRAP_CLAMP,
        };
        let flags = if srgb { TEXTURE_SRGB } else { 0 }
            | if texture.filter == Filter::Nearest {
                TEXTURE_NEAREST
            } else {
                0
            }
            | if texture.uv_set == 1 { TEXTURE_UV1 } else { 0 }
            | wrap(texture.wrap[0]) << TEXTURE_WRAP_U_SHIFT
            | wrap(texture.wrap[1]) << TEXTURE_WRAP_V_SHIFT;
        let record = SceneTexture {
            transform_u: texture.transform[0],
            first_texel,
            transform_v: texture.transform[1],
            size: image.width | image.height << 16,
            flags,
            spare: [0; 3],
        };
        let known = self.records.iter().position(|other| *other == record);
        known.unwrap_or_else(|| {
            self.records.push(record);
            self.records.len() - 1
        }) as u32
    }
}
