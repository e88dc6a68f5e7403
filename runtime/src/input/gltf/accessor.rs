//! Numbers out of buffers: typed, strided, normalised and sparse, and never behind an end.

use gltf::accessor::{DataType, Dimensions};
use gltf::json::accessor::ComponentType;

use super::Buffers;

impl<'m> Buffers<'m> {
    /// The elements of an accessor of `N` floats, or of integers that stand for floats where they are normalised or
    /// `quantized`.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(crate) fn floats<const N: usize>(
        &self,
        accessor: &gltf::Accessor<'m>,
    ) -> Result<Vec<[f32; N]>, String> {
        if components(accessor.dimensions()) != N {
            return Err(format!(
                "accessor {} has not {N} components",
                accessor.index()
            ));
        }
        let kind = accessor.data_type();
        let is_normalized = accessor.normalized();
        let element = |bytes: &[u8]| {
            std::array::from_fn(|i| float(component(bytes, kind, i), kind, is_normalized))
        };
        self.elements(accessor, element, [0.0; N])
    }

    /// As [`Buffers::floats`], of the accessor of that number.
    ///
    /// # Errors
    /// As there, or there is no such accessor.
    pub(super) fn floats_of<const N: usize>(&self, number: usize) -> Result<Vec<[f32; N]>, String> {
        let accessor = self.model.document.accessors().nth(number);
        let missing = || format!("there is no accessor {number}");
        self.floats(&accessor.ok_or_else(missing)?)
    }

    /// The elements of an accessor of `N` unsigned integers of up to 16 bits.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn whole<const N: usize>(
        &self,
        accessor: &gltf::Accessor<'m>,
    ) -> Result<Vec<[u16; N]>, String> {
        let kind = accessor.data_type();
        let is_whole = matches!(kind, DataType::U8 | DataType::U16);
        if !is_whole || components(accessor.dimensions()) != N {
            let number = accessor.index();
            return Err(format!("accessor {number} has not {N} integers"));
        }
        let element = |bytes: &[u8]| std::array::from_fn(|i| component(bytes, kind, i) as u16);
        self.elements(accessor, element, [0; N])
    }

    /// The elements of an accessor of unsigned integers.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(crate) fn indices(&self, accessor: &gltf::Accessor<'m>) -> Result<Vec<u32>, String> {
        let kind = accessor.data_type();
        let is_index = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
        if !is_index || accessor.dimensions() != Dimensions::Scalar {
            return Err(format!("accessor {} has no indices", accessor.index()));
        }
        self.elements(accessor, |bytes| component(bytes, kind, 0) as u32, 0)
    }

    fn elements<T: Clone>(
        &self,
        accessor: &gltf::Accessor<'m>,
        element: impl Fn(&[u8]) -> T,
        zero: T,
    ) -> Result<Vec<T>, String> {
        let (number, count) = (accessor.index(), accessor.count());
        let outside = || format!("accessor {number} reaches behind its buffer");
        let size = accessor.size();
        let packed = self.model.packed.accessor(number);
        let mut all = match accessor.view() {
            _ if let Some(packed) = packed => {
                let bytes = self.drawn(accessor, packed)?;
                bytes.chunks_exact(size).map(&element).collect()
            }
            Some(view) => {
                let stride = view.stride().unwrap_or(size).max(1);
                self.each(&view, accessor.offset(), [stride, size, count], &element)?
                    .ok_or_else(outside)?
            }
            // Zeros, which sparse values may replace; so many as there can be of these, and no more memory.
            None if count <= MOST_ZEROS => vec![zero; count],
            None => {
                return Err(format!(
                    "accessor {number} has {count} elements and no buffer"
                ));
            }
        };
        let Some(sparse) = accessor.sparse() else {
            return Ok(all);
        };
        let count = sparse.count();
        let indices = sparse.indices();
        let kind = match indices.index_type() {
            gltf::accessor::sparse::IndexType::U8 => DataType::U8,
            gltf::accessor::sparse::IndexType::U16 => DataType::U16,
            gltf::accessor::sparse::IndexType::U32 => DataType::U32,
        };
        let place = |bytes: &[u8]| component(bytes, kind, 0) as usize;
        let packed = [kind.size(), kind.size(), count];
        let places = self.each(&indices.view(), indices.offset(), packed, place)?;
        let places = places.ok_or_else(outside)?;
        let values = sparse.values();
        let packed = [size, size, count];
        let values = self.each(&values.view(), values.offset(), packed, &element)?;
        for (place, value) in places.into_iter().zip(values.ok_or_else(outside)?) {
            *all.get_mut(place).ok_or_else(outside)? = value;
        }
        Ok(all)
    }

    /// `count` elements of `size` bytes, `stride` bytes apart, of a view from an offset on; none if there are fewer.
    fn each<T>(
        &self,
        view: &gltf::buffer::View<'m>,
        offset: usize,
        [stride, size, count]: [usize; 3],
        element: impl Fn(&[u8]) -> T,
    ) -> Result<Option<Vec<T>>, String> {
        let Some(last) = count.checked_sub(1) else {
            return Ok(Some(Vec::new()));
        };
        let length = last.checked_mul(stride).and_then(|l| l.checked_add(size));
        let Some(length) = length else {
            return Ok(None);
        };
        let bytes = self.bytes(view, offset, length)?;
        let elements = |bytes: Vec<u8>| {
            let places = (0..count).map(|i| i * stride);
            places.map(|at| element(&bytes[at..at + size])).collect()
        };
        Ok(bytes.map(elements))
    }
}

/// Most elements of an accessor that no buffer holds.
const MOST_ZEROS: usize = 1 << 24;

fn components(dimensions: Dimensions) -> usize {
    dimensions.multiplicity()
}

/// Component `i` of an element, as a number.
fn component(bytes: &[u8], kind: DataType, i: usize) -> f64 {
    let size = kind.size();
    let own = &bytes[i * size..(i + 1) * size];
    match (kind, own) {
        (ComponentType::I8, [a]) => f64::from(*a as i8),
        (ComponentType::U8, [a]) => f64::from(*a),
        (ComponentType::I16, [a, b]) => f64::from(i16::from_le_bytes([*a, *b])),
        (ComponentType::U16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
        (ComponentType::U32, [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
        (ComponentType::F32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        _ => 0.0,
    }
}

/// A component as a float: normalised integers go from 0, or -1, to 1 (glTF 2.0, section 3.11).
fn float(value: f64, kind: DataType, is_normalized: bool) -> f32 {
    let most = match kind {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32767.0,
        ComponentType::U16 => 65535.0,
        ComponentType::U32 | ComponentType::F32 => 1.0,
    };
    if is_normalized && most > 1.0 {
        (value / most).max(-1.0) as f32
    } else {
        value as f32
    }
}
