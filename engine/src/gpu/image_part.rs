//! Parts of images: some of their layers and mip levels, or their layers as the faces of a cube.
//!
//! A part is an image itself, so that it is rendered into, read, copied and put between barriers as one; it keeps the whole alive. Barriers
//! and layouts of a part are those of its own layers and levels alone.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::image::{CUBE_FACES, Image, ImageInner, Owner};
use crate::{Error, Result};

/// Which part of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImagePart {
    /// Array layers.
    pub layers: Range<u32>,
    /// Mip levels.
    pub mips: Range<u32>,
    /// What shaders see it as: `TYPE_2D` for one layer, `TYPE_2D_ARRAY`, or `CUBE` for six layers in the order +x, -x, +y, -y, +z, -z of a
    /// square image that is sampled.
    pub kind: vk::ImageViewType,
}

impl ImagePart {
    /// One layer at one mip level.
    pub fn layer(layer: u32, mip: u32) -> Self {
        Self {
            layers: layer..layer.saturating_add(1),
            mips: mip..mip.saturating_add(1),
            kind: vk::ImageViewType::TYPE_2D,
        }
    }
}

impl Image {
    /// A part of the image as an image.
    ///
    /// # Errors
    /// [`Error::Picture`] when the image does not have these layers or levels, or not as that kind; [`Error::OutOfMemory`].
    pub fn part(&self, part: &ImagePart) -> Result<Self> {
        let whole = &self.inner;
        let refuse = |cause: &str| {
            Err(Error::Picture {
                path: whole.name.clone(),
                cause: format!("has no {part:?}: {cause}"),
            })
        };
        let (layers, mips) = (part.layers.len() as u32, part.mips.len() as u32);
        if layers == 0 || part.layers.end > self.layers() || mips == 0 || part.mips.end > self.mips() {
            return refuse(&format!("its layers are {}, its levels {}", self.layers(), self.mips()));
        }
        let fits = match part.kind {
            vk::ImageViewType::TYPE_2D => layers == 1,
            vk::ImageViewType::TYPE_2D_ARRAY => true,
            vk::ImageViewType::CUBE => layers == CUBE_FACES && whole.cubes,
            _ => false,
        };
        if !fits {
            return refuse("the kind does not fit");
        }
        let halved = |size: u32| (size >> part.mips.start).max(1);
        let mut inner = ImageInner {
            gpu: Arc::clone(&whole.gpu),
            raw: whole.raw,
            view: vk::ImageView::null(),
            name: whole.name.clone(),
            size: whole.size.map(halved),
            format: whole.format,
            usage: whole.usage,
            kind: part.kind,
            cubes: whole.cubes,
            range: vk::ImageSubresourceRange {
                base_mip_level: whole.range.base_mip_level + part.mips.start,
                level_count: mips,
                base_array_layer: whole.range.base_array_layer + part.layers.start,
                layer_count: layers,
                ..whole.range
            },
            owner: Owner::Whole(Arc::clone(whole)),
        };
        if whole.view != vk::ImageView::null() {
            inner.make_view()?;
        }
        Ok(Self { inner: Arc::new(inner) })
    }
}
