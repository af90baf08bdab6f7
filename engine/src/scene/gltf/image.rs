//! Images and the textures that use them ("glTF 2.0 Specification", §3.8; KHR_texture_transform).

use std::io::Cursor;
use std::path::Path;

use ::gltf::json::validation::Checked;
use ::gltf::json::{self, Index};
use ::image::ImageDecoder;
use serde_json::Value;

use super::{MAX_IMAGE_SIDE, MAX_TEXELS, Reader, uri};
use crate::scene::{Filter, Image, Texture, Wrap};
use crate::{Error, Result};

/// Bytes that the decoder may allocate for one image.
const MAX_DECODER_BYTES: u64 = 1 << 30;

/// How often every byte of the files may be decoded: views of one picture that differ in length are pictures of their own.
const ENCODED_PER_BYTE: u64 = 4;

/// Where a texture is used and how.
pub struct TextureUse<'u> {
    pub index: Index<json::Texture>,
    pub tex_coord: u32,
    pub transform: Option<&'u json::extensions::texture::TextureTransform>,
}

impl<'u> TextureUse<'u> {
    /// The use that a `textureInfo` describes.
    pub fn of(info: &'u json::texture::Info) -> Self {
        Self {
            index: info.index,
            tex_coord: info.tex_coord,
            transform: info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()),
        }
    }
}

/// Decodes a `KHR_texture_transform` that the crate left as JSON.
pub fn transform_from_json(value: &Value) -> Option<json::extensions::texture::TextureTransform> {
    serde_json::from_value(value.get("KHR_texture_transform")?.clone()).ok()
}

impl Reader<'_> {
    /// A texture, or `None` with a note when it cannot be used.
    pub fn texture(&mut self, usage: &TextureUse<'_>, folder: &Path, at: &str) -> Result<Option<Texture>> {
        let i = usage.index.value();
        let texture = self.get(&self.root.textures, "texture", i, &format!("{at}.index"))?;
        let place = format!("textures[{i}]");
        let other = texture
            .extensions
            .as_ref()
            .and_then(|e| e.others.keys().next().cloned());
        // The crate marks a missing source by the greatest index.
        if texture.source.value() == u32::MAX as usize {
            let feature = other.unwrap_or_else(|| "texture without an image".into());
            self.note(feature, place, format!("{at} is left out"));
            return Ok(None);
        }
        if let Some(name) = other {
            self.note(name, &place, "the texture's plain image is used");
        }
        let Some(image) = self.image(texture.source.value(), folder, &format!("{place}.source"))? else {
            return Ok(None);
        };
        let (wrap, filter) = match texture.sampler {
            None => ([Wrap::Repeat; 2], Filter::Linear),
            Some(sampler) => self.sampler(sampler.value(), &format!("{place}.sampler"))?,
        };
        let uv_set = usage.transform.and_then(|t| t.tex_coord).unwrap_or(usage.tex_coord);
        if uv_set > 1 {
            self.note(
                format!("TEXCOORD_{uv_set}"),
                at,
                "the texture is left out; sets 0 and 1 are supported",
            );
            return Ok(None);
        }
        let transform = match usage.transform {
            None => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            Some(t) => transform_rows(t.offset.0, t.rotation.0, t.scale.0),
        };
        Ok(Some(Texture {
            image,
            uv_set,
            wrap,
            filter,
            transform,
        }))
    }

    fn sampler(&mut self, i: usize, at: &str) -> Result<([Wrap; 2], Filter)> {
        use json::texture::{MagFilter, WrappingMode};
        let sampler = self.get(&self.root.samplers, "sampler", i, at)?;
        let wrap = |mode: &Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
            Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::MirroredRepeat),
            Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::ClampToEdge),
            Checked::Invalid => self.fail(format!("samplers[{i}]"), "has a wrap mode that is not allowed"),
        };
        let wraps = [wrap(&sampler.wrap_s)?, wrap(&sampler.wrap_t)?];
        let filter = match sampler.mag_filter {
            Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
            None | Some(Checked::Valid(MagFilter::Linear)) => Filter::Linear,
            Some(Checked::Invalid) => {
                return self.fail(format!("samplers[{i}].magFilter"), "is not one of the allowed filters");
            }
        };
        Ok((wraps, filter))
    }

    /// The scene's index of a glTF image, decoded at its first use; `None` with a note for an unknown format.
    fn image(&mut self, i: usize, folder: &Path, at: &str) -> Result<Option<u32>> {
        if let Some(known) = self.images.get(&i) {
            return Ok(*known);
        }
        let image = self.get(&self.root.images, "image", i, at)?;
        let place = format!("images[{i}]");
        let name = image
            .name
            .clone()
            .or_else(|| image.uri.clone().filter(|uri| !uri.starts_with("data:")));
        let external;
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                external = uri::read(uri, folder, self.files, self.source, &format!("{place}.uri"))?;
                &external[..]
            }
            (None, Some(view)) => self.view(view, &format!("{place}.bufferView"))?.0,
            (None, None) => return self.fail(place, "has neither uri nor bufferView"),
        };
        // Buffers and files stay in memory; what a data URI holds does not, and its place may be another's later.
        let is_kept = image.uri.as_ref().is_none_or(|uri| !uri.starts_with("data:"));
        let content = is_kept.then_some((bytes.as_ptr() as usize, bytes.len()));
        if let Some(&known) = content.and_then(|content| self.decoded.get(&content)) {
            self.images.insert(i, Some(known));
            return Ok(Some(known));
        }
        let fail = |cause: String| Error::scene(self.source, &place, cause);
        let format = ::image::guess_format(bytes);
        if !matches!(format, Ok(::image::ImageFormat::Png | ::image::ImageFormat::Jpeg)) {
            let what = match format {
                Ok(format) => format!("image format {format:?}"),
                Err(_) => "unknown image format".into(),
            };
            self.note(
                what,
                place,
                "textures that use it are left out; PNG and JPEG are supported",
            );
            self.images.insert(i, None);
            return Ok(None);
        }
        let (encoded, read) = (self.encoded.saturating_add(bytes.len() as u64), self.files.bytes_read());
        if encoded > read.saturating_mul(ENCODED_PER_BYTE) {
            let cause = format!("images of {encoded} bytes are to be decoded from files of {read} bytes");
            return self.fail(place, cause);
        }
        let mut reader = ::image::ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| fail(error.to_string()))?;
        let mut limits = ::image::Limits::default();
        limits.max_image_width = Some(MAX_IMAGE_SIDE);
        limits.max_image_height = Some(MAX_IMAGE_SIDE);
        limits.max_alloc = Some(MAX_DECODER_BYTES);
        reader.limits(limits);
        // Nothing of the picture's size is allocated before its size is known to be allowed.
        let decoder = reader.into_decoder().map_err(|error| fail(error.to_string()))?;
        let (width, height) = decoder.dimensions();
        let texels = self.texels + u64::from(width) * u64::from(height);
        if texels > MAX_TEXELS {
            return self.fail(place, format!("the file's images have more than {MAX_TEXELS} texels"));
        }
        let is_jpeg = matches!(format, Ok(::image::ImageFormat::Jpeg));
        let (peak, kept) = memory_of([width, height], decoder.total_bytes(), is_jpeg);
        self.files.reserve(peak, kept).map_err(fail)?;
        let decoded = ::image::DynamicImage::from_decoder(decoder).map_err(|error| fail(error.to_string()))?;
        (self.texels, self.encoded) = (texels, encoded);
        let rgba = decoded.into_rgba8();
        let index = self.scene.add_image(Image {
            name: name.unwrap_or(place),
            width: rgba.width(),
            height: rgba.height(),
            texels: rgba.pixels().map(|p| p.0).collect(),
        });
        self.images.insert(i, Some(index));
        if let Some(content) = content {
            self.decoded.insert(content, index);
        }
        Ok(Some(index))
    }
}

/// Bytes that decoding a picture takes at its peak, and those that stay; the decoder's output has `output` bytes.
///
/// A JPEG that is progressive, or has a scan for each component, is decoded from the coefficients of the whole picture: 16 bits for each of up
/// to four components, in blocks of up to 32² pixels.
fn memory_of([width, height]: [u32; 2], output: u64, is_jpeg: bool) -> (u64, u64) {
    const COEFFICIENTS: u64 = 4 * 2;
    const BLOCK: u64 = 32;
    let (width, height) = (u64::from(width), u64::from(height));
    let kept = 4 * width * height;
    let coefficients = if is_jpeg {
        COEFFICIENTS * width.next_multiple_of(BLOCK) * height.next_multiple_of(BLOCK)
    } else {
        0
    };
    // Then RGBA stands beside the output, and the scene's texels beside RGBA.
    let peak = output.saturating_add(coefficients.max(kept)).max(2 * kept);
    (peak, kept)
}

/// Translation · rotation · scale as in KHR_texture_transform; its rotation is counter-clockwise with v downwards.
///
/// So say the extension's text and its example; its GLSL listing turns the other way, an erratum of the listing (KhronosGroup/glTF 1563).
pub fn transform_rows(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> [[f32; 3]; 2] {
    let (sin, cos) = rotation.sin_cos();
    [
        [cos * scale[0], sin * scale[1], offset[0]],
        [-sin * scale[0], cos * scale[1], offset[1]],
    ]
}
