//! Where objects are placed, as materials see it: which place a primitive is at, and the way between the
//! coordinates of its object and those of the world.
//!
//! A place is an entry or placement of the scene. Where objects are stored once, a placement knows its place;
//! triangles in the world have a place each. `surface_places.wgsl` is the other half of this file.

use glam::{DMat3, DVec3};
use impasto_compiler::abi::{Input, InputSet};

use crate::scene::{Mesh, Scene, Transform};
use crate::wgsl;
use crate::wgsl::template::{Template, template};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::needs::{Need, Needs};

const PLACES: Template = template!("surface_places.wgsl");

/// Says of a placement that its triangles are at places of their own.
const NO_PLACE: u32 = u32::MAX;

/// What code reads of corners and objects.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reads {
    pub uvs: bool,
    pub uvs1: bool,
    pub colors: bool,
    pub places: bool,
}

impl Reads {
    /// Of code that reads some inputs.
    pub fn of(inputs: InputSet) -> Self {
        Self {
            uvs: inputs.any(&[Input::Uv, Input::Tangent, Input::FootprintUv]),
            uvs1: inputs.any(&[Input::Uv1, Input::FootprintUv1]),
            colors: inputs.any(&[Input::VertexColor, Input::FootprintColor]),
            places: inputs.any(&OF_PLACES),
        }
    }
}

/// The inputs that tell objects apart.
pub(super) const OF_PLACES: [Input; 5] = [
    Input::InstanceId,
    Input::ObjectPosition,
    Input::ObjectScale,
    Input::ObjectFromWorld,
    Input::WorldFromObject,
];

/// Those of them that say where something is in its object.
pub(super) const OF_SPACES: [Input; 4] = [
    Input::ObjectPosition,
    Input::ObjectScale,
    Input::ObjectFromWorld,
    Input::WorldFromObject,
];

/// The buffers by which kernels find places.
#[derive(Clone, Debug)]
pub struct Places {
    of_triangle: BufferData,
    /// Absent where all is in the world.
    of_placement: BufferData,
    spaces: BufferData,
}

impl Places {
    /// Of triangles in the world, each with the index of its object, and of placements each with its place or,
    /// where it is the world, none.
    pub(super) fn new(
        scene: &Scene,
        of_triangle: impl Iterator<Item = u32>,
        of_placement: impl Iterator<Item = Option<u32>>,
    ) -> Self {
        let of_objects = scene.places_of_objects();
        let place = |object: u32| of_objects.get(object as usize).copied().unwrap_or(0);
        let of_triangle: Vec<u32> = of_triangle.map(place).collect();
        let of_placement: Vec<u32> = of_placement.map(|p| p.unwrap_or(NO_PLACE)).collect();
        let places = scene.places.iter();
        let spaces: Vec<[[f32; 4]; 6]> = places.map(|p| space(p, scene.origin)).collect();
        Self::of_rows(&of_triangle, &of_placement, &spaces)
    }

    /// Of a mesh, whose triangles are read in `order`.
    pub(super) fn of_mesh(scene: &Scene, mesh: &Mesh, order: &[u32]) -> Self {
        let object = |t: &u32| mesh.objects.get(*t as usize).copied().unwrap_or(0);
        Self::new(scene, order.iter().map(object), std::iter::empty())
    }

    /// All at one place, where nothing is moved.
    pub(super) fn nowhere(triangles: usize) -> Self {
        Self::of_rows(&vec![0; triangles], &[], &[])
    }

    fn of_rows(of_triangle: &[u32], of_placement: &[u32], spaces: &[[[f32; 4]; 6]]) -> Self {
        let home = [space(&Transform::default(), DVec3::ZERO)];
        let spaces = if spaces.is_empty() { &home } else { spaces };
        let words = |rows: &[u32], other: u32| match rows {
            [] => vec![other],
            rows => rows.to_vec(),
        };
        Self {
            of_triangle: BufferData::new("triangle_places", "array<u32>", &words(of_triangle, 0)),
            of_placement: BufferData::new(
                "placement_places",
                "array<u32>",
                &words(of_placement, 0),
            ),
            spaces: BufferData::new("place_spaces", "array<vec4<f32>>", spaces),
        }
    }

    /// The functions that `needs` asks for.
    pub(super) fn written(&self, needs: Needs, placed: bool) -> ShaderPart {
        let spaces = needs.has(Need::Spaces);
        let mut buffers = vec![self.of_triangle.clone()];
        if placed {
            buffers.push(self.of_placement.clone());
        }
        if spaces {
            buffers.push(self.spaces.clone());
        }
        ShaderPart {
            wgsl: wgsl::constant_u32("NO_PLACE", NO_PLACE)
                + &PLACES.wgsl(&[("placed", placed), ("spaces", spaces)]),
            buffers,
        }
    }

    pub(super) fn buffers_mut(&mut self) -> [&mut BufferData; 3] {
        [
            &mut self.of_triangle,
            &mut self.of_placement,
            &mut self.spaces,
        ]
    }
}

/// The words of a place; see `surface_places.wgsl`. Coordinates of the world count from `origin`.
fn space(place: &Transform, origin: DVec3) -> [[f32; 4]; 6] {
    let inverse = place.matrix.inverse();
    let translation = (place.translation - origin).as_vec3();
    let row = |i: usize| {
        let [x, y, z] = inverse.row(i).as_vec3().to_array();
        [x, y, z, translation[i]]
    };
    let column = |i: usize, word: f64| {
        let [x, y, z] = place.matrix.col(i).as_vec3().to_array();
        [x, y, z, word as f32]
    };
    let scale = DMat3::determinant(&place.matrix).abs().cbrt();
    [
        row(0),
        row(1),
        row(2),
        column(0, scale),
        column(1, 0.0),
        column(2, 0.0),
    ]
}
