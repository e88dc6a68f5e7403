//! Pieces of WGSL with the buffers they read, which the GPU side assembles into kernels.
//!
//! A part never declares bindings: its text uses the names of its buffers, and the side that
//! builds a kernel declares `@group(0) @binding(i) var<storage, read> NAME: TYPE;` for exactly
//! the buffers of the parts that the kernel includes. What a scene lacks is absent from both
//! text and buffers, so a kernel pays for what it uses.

use std::sync::Arc;

use impasto_compiler::abi::Table;

/// Contents of one read-only storage buffer.
///
/// Integers and floats that share a buffer are stored as `u32` and bit-cast in WGSL, since the
/// bit pattern of a small integer is a denormal float, which hardware may flush to zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BufferData {
    /// The WGSL variable; unique among all parts of a scene.
    pub name: &'static str,
    /// Its WGSL type, such as `array<vec4<u32>>`.
    pub wgsl_type: &'static str,
    /// The contents, which clones share; never empty, and a multiple of the element's size.
    pub bytes: Arc<[u8]>,
}

impl BufferData {
    /// A buffer that holds `values`.
    pub fn new<T: bytemuck::NoUninit>(
        name: &'static str,
        wgsl_type: &'static str,
        values: &[T],
    ) -> Self {
        Self {
            name,
            wgsl_type,
            bytes: bytemuck::cast_slice(values).into(),
        }
    }
}

impl BufferData {
    /// Forgets the contents.
    pub(crate) fn drop_contents(&mut self) {
        self.bytes = Arc::default();
    }
}

impl From<&Table> for BufferData {
    fn from(table: &Table) -> Self {
        Self::new(table.name, table.wgsl_type, &table.words)
    }
}

/// A piece of WGSL and what it reads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShaderPart {
    /// Functions, structs and constants at module scope.
    pub wgsl: String,
    /// The buffers that the text names.
    pub buffers: Vec<BufferData>,
}
