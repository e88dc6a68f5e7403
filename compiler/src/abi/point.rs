//! What code can be told of a surface point: the fields of `SurfacePoint`, each with who sees it, and how
//! it varies over what a ray sees.
//!
//! The struct itself is in `stdlib/core/material.impasto`, in the order of the rows here. A field that is
//! always there costs nothing where nobody reads it, since the renderer fills it with what is at hand.
//! The others are absent from modules that do not read them.

/// How a field changes over what a ray sees of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangents {
    /// Not at all, or it is taken as constant, as directions are.
    None,
    /// By the two fields with these names, along the two axes of the footprint.
    Fields([&'static str; 2]),
    /// As the first field, a matrix, maps the changes of position, which are the other two.
    Mapped(&'static str, [&'static str; 2]),
}

const POSITION_CHANGES: [&str; 2] = ["footprint_x", "footprint_y"];

macro_rules! inputs {
    ($($(#[doc = $doc:literal])+ $input:ident $fields:tt $seen:ident $presence:ident $tangents:expr;)+) => {
        /// Something that code can be told of a surface point: a row of the table, of one field or of two that
        /// belong together.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Input {
            $($(#[doc = $doc])+ $input,)+
        }

        const ROWS: [Row; [$(Input::$input),+].len()] = [$(Row {
            input: Input::$input,
            fields: &$fields,
            is_seen: inputs!(@seen $seen),
            is_optional: inputs!(@presence $presence),
            tangents: $tangents,
        }),+];
    };
    (@seen seen) => { true };
    (@seen hidden) => { false };
    (@presence always) => { false };
    (@presence optional) => { true };
}

struct Row {
    input: Input,
    fields: &'static [&'static str],
    /// Do materials see it by name?
    is_seen: bool,
    is_optional: bool,
    tangents: Tangents,
}

use Tangents::{Fields, Mapped, None as Constant};

inputs! {
    /// Where it is.
    Position ["position"] seen always Fields(POSITION_CHANGES);
    /// The shading normal.
    Normal ["normal"] seen always Constant;
    /// The normal of the geometry.
    GeometricNormal ["geometric_normal"] seen always Constant;
    /// The direction in which u grows.
    Tangent ["tangent"] seen always Constant;
    /// Texture coordinates.
    Uv ["uv"] seen always Fields(["footprint_uv_x", "footprint_uv_y"]);
    /// The index of refraction outside.
    ExteriorIor ["exterior_ior"] seen always Constant;
    /// How position varies over what a ray sees.
    Footprint ["footprint_x", "footprint_y"] hidden optional Constant;
    /// How texture coordinates do.
    FootprintUv ["footprint_uv_x", "footprint_uv_y"] hidden optional Constant;
    /// The direction to where it is seen from.
    View ["view"] seen optional Constant;
    /// Which placement it is on.
    InstanceId ["instance_id"] seen optional Constant;
    /// Where it is in its object.
    ObjectPosition ["object_position"] seen optional Mapped("object_from_world", POSITION_CHANGES);
    /// The size of its object's unit.
    ObjectScale ["object_scale"] seen optional Constant;
    /// From directions of the world to those of its object.
    ObjectFromWorld ["object_from_world"] hidden optional Constant;
    /// From directions of its object to those of the world.
    WorldFromObject ["world_from_object"] hidden optional Constant;
    /// A second set of texture coordinates.
    Uv1 ["uv1"] seen optional Fields(["footprint_uv1_x", "footprint_uv1_y"]);
    /// How these vary over what a ray sees.
    FootprintUv1 ["footprint_uv1_x", "footprint_uv1_y"] hidden optional Constant;
    /// The color that corners have.
    VertexColor ["vertex_color"] seen optional Fields(["footprint_color_x", "footprint_color_y"]);
    /// How it varies over what a ray sees.
    FootprintColor ["footprint_color_x", "footprint_color_y"] hidden optional Constant;
}

impl Input {
    /// Every row, in the order of the fields.
    pub fn all() -> impl Iterator<Item = Input> {
        ROWS.iter().map(|row| row.input)
    }

    /// The names that materials see, in the order of the fields.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let seen = ROWS.iter().filter(|row| row.is_seen);
        seen.flat_map(|row| row.fields).copied()
    }

    /// The row of a field.
    pub fn of_field(field: &str) -> Option<Input> {
        let row = ROWS.iter().find(|row| row.fields.contains(&field));
        row.map(|row| row.input)
    }

    /// Its fields.
    pub fn fields(self) -> &'static [&'static str] {
        self.row().fields
    }

    /// How its field changes over what a ray sees.
    pub fn tangents(self) -> Tangents {
        self.row().tangents
    }

    fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }
}

/// The inputs that code reads, so that the others need not be computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputSet(u32);

impl InputSet {
    /// Some inputs.
    pub fn of(inputs: &[Input]) -> Self {
        let mut set = Self::default();
        inputs.iter().for_each(|input| set.insert(*input));
        set
    }

    /// Adds one.
    pub fn insert(&mut self, input: Input) {
        self.0 |= 1 << input as u32;
    }

    /// Is it one of them?
    pub fn has(self, input: Input) -> bool {
        self.0 & 1 << input as u32 != 0
    }

    /// Is any of them among these?
    pub fn any(self, inputs: &[Input]) -> bool {
        inputs.iter().any(|input| self.has(*input))
    }

    /// What either has.
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether `SurfacePoint` has a field in code that reads these.
    pub fn declares(self, field: &str) -> bool {
        match Input::of_field(field) {
            Some(input) => !input.row().is_optional || self.has(input),
            None => true,
        }
    }

    /// The fields that `SurfacePoint` has in code that reads these, in their order.
    pub fn declared(self) -> impl Iterator<Item = &'static str> {
        let fields = ROWS.iter().flat_map(|row| row.fields).copied();
        fields.filter(move |field| self.declares(field))
    }
}
