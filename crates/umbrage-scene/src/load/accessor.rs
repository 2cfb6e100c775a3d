//! Reads typed arrays from a file, checked against the bytes that the file contains.

use super::document::Document;
use crate::error::SceneError;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, buffer};

type Id = Index<Accessor>;

impl Document<'_> {
    /// Reads vectors of `N` floats. Integers are scaled to [0, 1] or [−1, 1] if the accessor is
    /// normalized.
    pub(super) fn floats<const N: usize>(
        &self,
        id: Id,
        place: &str,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let normalized = self.get(id, place)?.normalized;
        self.read(id, place, |component, bytes| {
            let scale = |value: f32, max: f32| {
                if normalized { (value / max).max(-1.0) } else { value }
            };
            match component {
                ComponentType::F32 => f32::from_le_bytes(fixed(bytes)),
                ComponentType::I8 => scale(f32::from(bytes[0] as i8), 127.0),
                ComponentType::U8 => scale(f32::from(bytes[0]), 255.0),
                ComponentType::I16 => scale(f32::from(i16::from_le_bytes(fixed(bytes))), 32767.0),
                ComponentType::U16 => scale(f32::from(u16::from_le_bytes(fixed(bytes))), 65535.0),
                ComponentType::U32 => u32::from_le_bytes(fixed(bytes)) as f32,
            }
        })
    }

    /// Reads vectors of `N` unsigned integers.
    pub(super) fn integers<const N: usize>(
        &self,
        id: Id,
        place: &str,
    ) -> Result<Vec<[u32; N]>, SceneError> {
        let Checked::Valid(component) = self.get(id, place)?.component_type else {
            return Err(self.invalid(place, "componentType is unknown"));
        };
        if !matches!(component.0, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(self.invalid(place, "must be unsigned integers"));
        }
        self.read(id, place, unsigned)
    }

    fn read<T: Copy + Default, const N: usize>(
        &self,
        id: Id,
        place: &str,
        decode: impl Fn(ComponentType, &[u8]) -> T,
    ) -> Result<Vec<[T; N]>, SceneError> {
        let accessor = self.get(id, place)?;
        let place = format!("{place} (accessors[{}])", id.value());
        let fail = |problem: String| self.invalid(&place, problem);
        let (Checked::Valid(component), Checked::Valid(shape)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err(fail("type or componentType is unknown".into()));
        };
        let expected = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            16 => Type::Mat4,
            _ => Type::Vec4,
        };
        if shape != expected {
            return Err(fail(format!("is {shape:?}, should be {expected:?}")));
        }
        let component = component.0;
        let element = N * component.size();
        let decode = |bytes: &[u8]| -> [T; N] {
            std::array::from_fn(|i| decode(component, &bytes[i * component.size()..]))
        };
        let offset = accessor.byte_offset.map_or(0, |o| o.0);
        let count = accessor.count.0;
        let take = || self.budget.take(&place, count, "elements", size_of::<[T; N]>());
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let bytes = self.elements(view, offset, count, element, &place)?;
                take()?;
                bytes.map(decode).collect::<Vec<_>>()
            }
            None if accessor.sparse.is_none() => return Err(fail("has no bufferView".into())),
            None => {
                take()?;
                vec![[T::default(); N]; count as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(index_type) = sparse.indices.component_type else {
                return Err(fail("sparse.indices: componentType is unknown".into()));
            };
            let index_type = index_type.0;
            let (at, from) = (&sparse.indices, &sparse.values);
            let n = sparse.count.0;
            let indices =
                self.elements(at.buffer_view, at.byte_offset.0, n, index_type.size(), &place)?;
            let new = self.elements(from.buffer_view, from.byte_offset.0, n, element, &place)?;
            for (index, bytes) in indices.zip(new) {
                let index = unsigned(index_type, index) as usize;
                let slot = values.get_mut(index).ok_or_else(|| {
                    fail(format!(
                        "sparse index {index} is out of range, there are {count} elements"
                    ))
                })?;
                *slot = decode(bytes);
            }
        }
        Ok(values)
    }

    /// The bytes of each of `count` elements of a buffer view; each element is `element` bytes
    /// long.
    fn elements(
        &self,
        view: Index<buffer::View>,
        offset: u64,
        count: u64,
        element: usize,
        place: &str,
    ) -> Result<impl Iterator<Item = &[u8]>, SceneError> {
        let bytes = self.view(view, place)?;
        let stride = self.get(view, place)?.byte_stride.map_or(element, |s| s.0);
        if stride < element {
            let problem = format!("byteStride {stride} is less than an element's {element} bytes");
            return Err(self.invalid(place, problem));
        }
        let needs = match count {
            0 => Some(offset),
            n => (stride as u64)
                .checked_mul(n - 1)
                .and_then(|b| b.checked_add(element as u64))
                .and_then(|b| b.checked_add(offset)),
        };
        if needs.is_none_or(|needs| needs > bytes.len() as u64) {
            let has = bytes.len();
            return Err(self.invalid(
                place,
                format!(
                    "{count} elements from byte {offset} on do not fit into the view's {has} bytes"
                ),
            ));
        }
        let data = &bytes[offset as usize..];
        Ok((0..count as usize).map(move |i| &data[i * stride..i * stride + element]))
    }
}

fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U16 | ComponentType::I16 => u32::from(u16::from_le_bytes(fixed(bytes))),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes(fixed(bytes)),
        ComponentType::U8 | ComponentType::I8 => u32::from(bytes[0]),
    }
}

/// The first `N` bytes of an element that is known to have at least as many.
fn fixed<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}
