//! Numbers that a file has compressed: views of buffers by meshopt (EXT_meshopt_compression), and triangles by Draco
//! (KHR_draco_mesh_compression). Whoever asks for a view or an accessor is given what it stands for.

use std::collections::BTreeMap;
use std::rc::Rc;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointIndex};
use gltf::json::accessor::ComponentType;
use meshoptimizer_rs::codec::{BufferView, Filter, Mode};
use meshoptimizer_rs::{Limits, Workspace};
use serde_json::Value;

use super::Buffers;

pub(super) const MESHOPT: &str = "EXT_meshopt_compression";
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// Most bytes that one view or mesh may have when it is decompressed.
const MOST: usize = 1 << 30;

/// What of a file is compressed.
#[derive(Default)]
pub(super) struct Packed {
    /// By the number of the view.
    views: BTreeMap<usize, PackedView>,
    /// By the number of the accessor.
    accessors: BTreeMap<usize, PackedAccessor>,
}

/// A view that meshopt compressed.
struct PackedView {
    buffer: usize,
    offset: usize,
    length: usize,
    layout: BufferView,
}

/// An accessor that is a part of a mesh that Draco compressed.
#[derive(Clone, Copy)]
pub(super) struct PackedAccessor {
    /// The view with the mesh.
    view: usize,
    /// Which attribute of the mesh it is; none of indices.
    attribute: Option<u32>,
}

impl Packed {
    /// What is compressed in a file of this JSON, all of whose indices are within what it has.
    ///
    /// # Errors
    /// An extension does not say what it must, in words.
    pub(super) fn of(json: &Value) -> Result<Self, String> {
        let mut packed = Self::default();
        for (number, view) in items(&json["bufferViews"]).enumerate() {
            let said = &view["extensions"][MESHOPT];
            if said.is_object() {
                let own = packed_view(view, said);
                let own =
                    own.map_err(|what| wrong(&format!("bufferViews[{number}]"), MESHOPT, what))?;
                packed.views.insert(number, own);
            }
        }
        for (number, mesh) in items(&json["meshes"]).enumerate() {
            for (place, primitive) in items(&mesh["primitives"]).enumerate() {
                let said = &primitive["extensions"][DRACO];
                if said.is_object() {
                    let own = packed.take_mesh(json, primitive, said);
                    own.map_err(|what| {
                        wrong(
                            &format!("meshes[{number}].primitives[{place}]"),
                            DRACO,
                            what,
                        )
                    })?;
                }
            }
        }
        Ok(packed)
    }

    /// Takes the accessors of a primitive of which the extension says this; what of it is not there or illegal.
    fn take_mesh(
        &mut self,
        json: &Value,
        primitive: &Value,
        said: &Value,
    ) -> Result<(), &'static str> {
        let view = number(&said["bufferView"]).ok_or("bufferView")?;
        json["bufferViews"].get(view).ok_or("bufferView")?;
        let attributes = said["attributes"].as_object().ok_or("attributes")?;
        // A file that does not require the extension has its numbers uncompressed as well.
        let mut take = |accessor: &Value, attribute| {
            let accessor = number(accessor)?;
            if json["accessors"][accessor]["bufferView"].is_null() {
                let own = PackedAccessor { view, attribute };
                self.accessors.insert(accessor, own);
            }
            Some(())
        };
        for (semantic, id) in attributes {
            let id = number(id).and_then(|id| u32::try_from(id).ok());
            let id = id.ok_or("attributes")?;
            take(&primitive["attributes"][semantic.as_str()], Some(id)).ok_or("attributes")?;
        }
        take(&primitive["indices"], None).ok_or("indices")
    }

    /// The mesh that an accessor is a part of; none if it is not compressed.
    pub(super) fn accessor(&self, number: usize) -> Option<PackedAccessor> {
        self.accessors.get(&number).copied()
    }
}

fn items(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

fn number(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|n| usize::try_from(n).ok())
}

fn wrong(place: &str, extension: &str, what: &str) -> String {
    format!(
        "the glTF file is damaged: `{place}.extensions.{extension}`: `{what}` is missing or has no legal value"
    )
}

/// What the extension says of a view; else what of it is not there or illegal.
fn packed_view(view: &Value, said: &Value) -> Result<PackedView, &'static str> {
    let of = |key: &'static str| number(&said[key]).ok_or(key);
    let name = |key: &'static str| said[key].as_str().unwrap_or("NONE");
    let mode = Mode::parse(name("mode")).map_err(|_| "mode")?;
    let filter = Filter::parse(name("filter")).map_err(|_| "filter")?;
    let layout = BufferView::new(mode, filter, of("count")?, of("byteStride")?);
    let layout = layout.map_err(|_| "byteStride")?;
    if number(&view["byteLength"]) != Some(layout.byte_length()) {
        return Err("count");
    }
    Ok(PackedView {
        buffer: of("buffer")?,
        offset: number(&said["byteOffset"]).unwrap_or(0),
        length: of("byteLength")?,
        layout,
    })
}

impl<'m> Buffers<'m> {
    /// All of a view that is compressed; none if it is not.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn unpacked(&self, view: usize) -> Result<Option<Rc<Vec<u8>>>, String> {
        let Some(packed) = self.model.packed.views.get(&view) else {
            return Ok(None);
        };
        if let Some(known) = self.views.borrow().get(&view) {
            return Ok(Some(Rc::clone(known)));
        }
        let damaged = |why: &dyn std::fmt::Display| {
            format!("view {view}, which meshopt compressed, is damaged: {why}")
        };
        let buffer = self.model.document.buffers().nth(packed.buffer);
        let buffer = buffer.ok_or_else(|| damaged(&"there is no such buffer"))?;
        let source = self.range(&buffer, packed.offset, packed.length)?;
        let source = source.ok_or_else(|| damaged(&"it reaches behind its buffer"))?;
        let mut workspace = Workspace::new(Limits {
            max_bytes: MOST,
            ..Limits::default()
        });
        let bytes = packed.layout.decode(&source, &mut workspace);
        let bytes = Rc::new(bytes.map_err(|e| damaged(&e))?);
        self.views.borrow_mut().insert(view, Rc::clone(&bytes));
        Ok(Some(bytes))
    }

    /// The bytes of an accessor's elements, one after the other, where Draco compressed them.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn drawn(
        &self,
        accessor: &gltf::Accessor<'m>,
        packed: PackedAccessor,
    ) -> Result<Vec<u8>, String> {
        let mesh = self.mesh(packed.view)?;
        let kind = accessor.data_type();
        let (number, count) = (accessor.index(), accessor.count());
        let fewer =
            |has: usize| format!("accessor {number} has {count} elements, and Draco's mesh {has}");
        let mut bytes = Vec::new();
        let Some(id) = packed.attribute else {
            let has = 3 * mesh.num_faces();
            if has < count {
                return Err(fewer(has));
            }
            let corners = mesh.faces().iter().flatten();
            for point in corners.take(count) {
                put(&mut bytes, kind, f64::from(point.0));
            }
            return Ok(bytes);
        };
        let attribute = mesh.attribute_by_unique_id(id).ok_or_else(|| {
            format!(
                "accessor {number} is attribute {id} of Draco's mesh, which has none of that number"
            )
        })?;
        if mesh.num_points() < count {
            return Err(fewer(mesh.num_points()));
        }
        let components = accessor.dimensions().multiplicity();
        if usize::from(attribute.num_components()) != components {
            return Err(format!(
                "accessor {number} has not as many components as attribute {id} of Draco's mesh"
            ));
        }
        let own = attribute.data_type();
        let width = own.byte_length();
        let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
        let data = attribute.buffer().data();
        for point in 0..count {
            let index = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
            let at = index.saturating_mul(stride);
            let element = data
                .get(at..)
                .and_then(|rest| rest.get(..components * width));
            let element = element.ok_or_else(|| fewer(attribute.size()))?;
            for component in element.chunks_exact(width.max(1)) {
                put(&mut bytes, kind, value(component, own));
            }
        }
        Ok(bytes)
    }

    /// The mesh that is in a view. Accessors of a primitive are read one after the other, so that the last one is kept.
    fn mesh(&self, view: usize) -> Result<Rc<Mesh>, String> {
        if let Some((_, known)) = self.mesh.borrow().as_ref().filter(|(own, _)| *own == view) {
            return Ok(Rc::clone(known));
        }
        let damaged = |why: &dyn std::fmt::Display| {
            format!("view {view}, which Draco compressed, is damaged: {why}")
        };
        let own = self.model.document.views().nth(view);
        let own = own.ok_or_else(|| damaged(&"there is no such view"))?;
        let source = self.bytes(&own, 0, own.length())?;
        let source = source.ok_or_else(|| damaged(&"it reaches behind its buffer"))?;
        let limits = DecodeLimits::default();
        let limits = limits.with_max_decoded_bytes(MOST as u64);
        let mut source = DecoderBuffer::new(&source).with_limits(limits);
        let mut mesh = Mesh::new();
        let decoded = MeshDecoder::new().decode(&mut source, &mut mesh);
        decoded.map_err(|e| damaged(&e))?;
        let mesh = Rc::new(mesh);
        *self.mesh.borrow_mut() = Some((view, Rc::clone(&mesh)));
        Ok(mesh)
    }
}

/// A component of Draco's mesh as a number.
fn value(bytes: &[u8], kind: DataType) -> f64 {
    match (kind, bytes) {
        (DataType::Int8, [a]) => f64::from(*a as i8),
        (DataType::Uint8 | DataType::Bool, [a]) => f64::from(*a),
        (DataType::Int16, [a, b]) => f64::from(i16::from_le_bytes([*a, *b])),
        (DataType::Uint16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
        (DataType::Int32, [a, b, c, d]) => f64::from(i32::from_le_bytes([*a, *b, *c, *d])),
        (DataType::Uint32, [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
        (DataType::Float32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        _ => 0.0,
    }
}

/// Adds a number as a component of an accessor.
fn put(bytes: &mut Vec<u8>, kind: ComponentType, value: f64) {
    match kind {
        ComponentType::I8 => bytes.extend((value as i8).to_le_bytes()),
        ComponentType::U8 => bytes.extend((value as u8).to_le_bytes()),
        ComponentType::I16 => bytes.extend((value as i16).to_le_bytes()),
        ComponentType::U16 => bytes.extend((value as u16).to_le_bytes()),
        ComponentType::U32 => bytes.extend((value as u32).to_le_bytes()),
        ComponentType::F32 => bytes.extend((value as f32).to_le_bytes()),
    }
}
