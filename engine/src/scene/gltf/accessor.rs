//! Accessors: strided, sparse, normalized and zero-filled, decoded with every bound checked ("glTF 2.0 Specification", §3.6.2).

use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::validation::{Checked, USize64};
use ::gltf::json::{Index, buffer};

use super::{MAX_ZERO_ELEMENTS, Reader};
use crate::Result;

/// A decoded accessor, component by component.
pub struct Floats {
    /// Components an element.
    pub width: usize,
    /// `width` values per element.
    pub values: Vec<f32>,
}

impl Floats {
    /// Elements as arrays; `N` must be the width.
    pub fn arrays<const N: usize>(&self) -> impl ExactSizeIterator<Item = [f32; N]> {
        self.values
            .chunks_exact(N.max(1))
            .map(|chunk| std::array::from_fn(|i| chunk[i]))
    }
}

/// One component as it is stored.
#[derive(Clone, Copy)]
struct Component {
    kind: ComponentType,
    normalized: bool,
}

impl Component {
    /// The value of `bytes`, which hold exactly one component.
    fn value(self, bytes: &[u8]) -> f32 {
        let (value, scale) = match (self.kind, bytes) {
            (ComponentType::I8, &[a]) => (f32::from(i8::from_le_bytes([a])), f32::from(i8::MAX)),
            (ComponentType::U8, &[a]) => (f32::from(a), f32::from(u8::MAX)),
            (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), f32::from(i16::MAX)),
            (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), f32::from(u16::MAX)),
            (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
            (ComponentType::U32, &[a, b, c, d]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
            _ => return 0.0,
        };
        if self.normalized {
            (value / scale).max(-1.0)
        } else {
            value
        }
    }

    fn index(self, bytes: &[u8]) -> u32 {
        match *bytes {
            [a] => u32::from(a),
            [a, b] => u32::from(u16::from_le_bytes([a, b])),
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            _ => 0,
        }
    }
}

/// A run of equally spaced elements inside a slice; every element is inside by construction.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn get(&self, i: usize) -> &'a [u8] {
        let start = i * self.stride;
        &self.bytes[start..start + self.size]
    }
}

impl<'a> Reader<'a> {
    /// The accessor of an index, counted against the file's budget.
    fn accessor(&mut self, index: Index<Accessor>, at: &str) -> Result<(&'a Accessor, Component, usize)> {
        let i = index.value();
        let accessor = self.get(&self.root.accessors, "accessor", i, at)?;
        let place = format!("accessors[{i}]");
        let Checked::Valid(kind) = accessor.component_type else {
            return self.fail(format!("{place}.componentType"), "is not one of the allowed types");
        };
        let Checked::Valid(shape) = accessor.type_ else {
            return self.fail(format!("{place}.type"), "is not one of the allowed types");
        };
        let width = match shape {
            Type::Scalar => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 => 4,
            Type::Mat2 | Type::Mat3 | Type::Mat4 => {
                return self.fail(at, format!("accessor {i} holds matrices"));
            }
        };
        let count = accessor.count.0;
        if count == 0 {
            return self.fail(format!("{place}.count"), "must be at least 1");
        }
        if accessor.buffer_view.is_none() && count > MAX_ZERO_ELEMENTS {
            return self.fail(
                format!("{place}.count"),
                format!("{count} zeros are more than the {MAX_ZERO_ELEMENTS} allowed without a buffer view"),
            );
        }
        self.elements = self.elements.saturating_add(count);
        if self.elements > self.element_budget {
            return self.fail(
                format!("{place}.count"),
                format!(
                    "the file's accessors are used for more than {} elements, too many for its size",
                    self.element_budget
                ),
            );
        }
        let component = Component {
            kind: kind.0,
            normalized: accessor.normalized,
        };
        Ok((accessor, component, width))
    }

    /// The elements of a buffer view, checked to lie inside it.
    fn elements(
        &self,
        view: Index<buffer::View>,
        offset: Option<USize64>,
        count: u64,
        size: usize,
        tight: bool,
        at: &str,
    ) -> Result<Elements<'_>> {
        let (bytes, stride) = self.view(view, at)?;
        let stride = stride.filter(|_| !tight).unwrap_or(size);
        if stride < size {
            return self.fail(
                at,
                format!("byteStride {stride} is less than an element's {size} bytes"),
            );
        }
        let offset = offset.unwrap_or_default().0;
        let end = (count - 1)
            .checked_mul(stride as u64)
            .and_then(|span| span.checked_add(size as u64))
            .and_then(|span| span.checked_add(offset));
        match (end, usize::try_from(offset)) {
            (Some(end), Ok(start)) if end <= bytes.len() as u64 => Ok(Elements {
                bytes: &bytes[start..],
                stride,
                size,
                count: count as usize,
            }),
            _ => self.fail(
                at,
                format!(
                    "{count} elements of {size} bytes at offset {offset} and stride {stride} leave their buffer view of {} bytes",
                    bytes.len()
                ),
            ),
        }
    }

    /// Decodes an accessor of one of the given widths to floats.
    pub fn floats(&mut self, index: Index<Accessor>, widths: &[usize], at: &str) -> Result<Floats> {
        let (accessor, component, width) = self.accessor(index, at)?;
        if !widths.contains(&width) {
            return self.fail(
                at,
                format!("accessor {} has {width} components, not {widths:?}", index.value()),
            );
        }
        if matches!(component.kind, ComponentType::U32) {
            return self.fail(
                at,
                format!(
                    "accessor {} is of 32-bit integers, which are for indices",
                    index.value()
                ),
            );
        }
        let place = format!("accessors[{}]", index.value());
        let values = self.decode(accessor, component, width, &place, 0.0, Component::value)?;
        Ok(Floats { width, values })
    }

    /// Decodes an accessor of indices, without a look at their range.
    pub fn indices(&mut self, index: Index<Accessor>, at: &str) -> Result<Vec<u32>> {
        let (accessor, component, width) = self.accessor(index, at)?;
        let unsigned = matches!(
            component.kind,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        );
        if width != 1 || !unsigned {
            return self.fail(at, format!("accessor {} is not of unsigned scalars", index.value()));
        }
        let place = format!("accessors[{}]", index.value());
        self.decode(accessor, component, 1, &place, 0, Component::index)
    }

    /// Reads every component by `read`; where there is no buffer view, elements begin as `zero`.
    fn decode<T: Copy>(
        &self,
        accessor: &Accessor,
        component: Component,
        width: usize,
        place: &str,
        zero: T,
        read: fn(Component, &[u8]) -> T,
    ) -> Result<Vec<T>> {
        let mut values = Vec::new();
        let part = component.kind.size();
        let size = part * width;
        let count = accessor.count.0;
        match accessor.buffer_view {
            Some(view) => {
                let elements = self.elements(view, accessor.byte_offset, count, size, false, place)?;
                values.reserve_exact(elements.count * width);
                for i in 0..elements.count {
                    values.extend(elements.get(i).chunks_exact(part).map(|bytes| read(component, bytes)));
                }
            }
            None => values.resize(count as usize * width, zero),
        }
        let Some(sparse) = &accessor.sparse else {
            return Ok(values);
        };
        let place = format!("{place}.sparse");
        if sparse.count.0 == 0 || sparse.count.0 > count {
            return self.fail(
                format!("{place}.count"),
                format!("{} is not in 1 … {count}", sparse.count.0),
            );
        }
        let Checked::Valid(index_kind) = sparse.indices.component_type else {
            return self.fail(
                format!("{place}.indices.componentType"),
                "is not one of the allowed types",
            );
        };
        let index_component = Component {
            kind: index_kind.0,
            normalized: false,
        };
        let indices = self.elements(
            sparse.indices.buffer_view,
            Some(sparse.indices.byte_offset),
            sparse.count.0,
            index_kind.0.size(),
            true,
            &format!("{place}.indices"),
        )?;
        let replaced = self.elements(
            sparse.values.buffer_view,
            Some(sparse.values.byte_offset),
            sparse.count.0,
            size,
            true,
            &format!("{place}.values"),
        )?;
        let mut last = None;
        for i in 0..indices.count {
            let target = index_component.index(indices.get(i));
            if u64::from(target) >= count || last.is_some_and(|last| target <= last) {
                return self.fail(
                    format!("{place}.indices"),
                    format!("index {target} is not increasing or not below {count}"),
                );
            }
            last = Some(target);
            let start = target as usize * width;
            for (value, bytes) in values[start..start + width]
                .iter_mut()
                .zip(replaced.get(i).chunks_exact(part))
            {
                *value = read(component, bytes);
            }
        }
        Ok(values)
    }
}
