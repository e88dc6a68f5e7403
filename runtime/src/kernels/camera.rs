//! The uniform `camera`: from where a picture is seen, which changes no kernel's text.

use glam::Vec3;

use crate::kernels::cones;
use crate::world::camera::CameraFrame;

/// How a number follows from a camera and columns and rows of a picture.
type Number = fn(&CameraFrame, [u32; 2]) -> f32;

/// How a vector follows from a camera.
type Vector = fn(&CameraFrame) -> Vec3;

/// The members of four words: a vector and a number, by their names, and how they follow from what is seen.
struct Row {
    vector: (&'static str, Vector),
    number: (&'static str, Number),
}

/// The members.
const ROWS: [Row; 4] = [
    Row {
        vector: ("position", |camera| camera.position),
        number: ("lens_radius", |camera, _| camera.lens()[0]),
    },
    Row {
        vector: ("forward", |camera| camera.forward),
        number: ("focus_distance", |camera, _| camera.lens()[1]),
    },
    Row {
        vector: ("right", |camera| camera.right),
        number: ("pixel_angle", |camera, [width, height]| {
            cones::pixel_angle(camera, width, height)
        }),
    },
    Row {
        vector: ("up", |camera| camera.up),
        number: ("none", |_, _| 0.0),
    },
];

/// The words of the uniform.
pub(crate) type Words = [u32; 4 * ROWS.len()];

/// Its size.
pub(crate) const BYTES: u64 = size_of::<Words>() as u64;

/// Its words for a camera and a picture of some size. Denormals, which hardware may make 0 of, are 0.
pub(crate) fn words(camera: &CameraFrame, width: u32, height: u32) -> Words {
    let mut words = [0; 4 * ROWS.len()];
    for (out, row) in words.chunks_exact_mut(4).zip(&ROWS) {
        let (vector, number) = (
            (row.vector.1)(camera),
            (row.number.1)(camera, [width, height]),
        );
        for (word, value) in out.iter_mut().zip(vector.extend(number).to_array()) {
            *word = if value.is_normal() {
                value.to_bits()
            } else {
                0
            };
        }
    }
    words
}

/// Its structure in WGSL.
pub(crate) fn declaration(name: &str) -> String {
    let members = ROWS.iter().map(|row| {
        let (vector, number) = (row.vector.0, row.number.0);
        format!("{vector}: vec3<f32>, {number}: f32")
    });
    let members: Vec<String> = members.collect();
    format!("struct {name} {{ {} }}\n", members.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words are where WGSL looks for members.
    #[test]
    fn members_lie_as_kernels_read_them() {
        let module = naga::front::wgsl::parse_str(&declaration("Camera")).expect("it parses");
        let (_, ty) = module.types.iter().next_back().expect("the structure");
        let naga::TypeInner::Struct { members, span } = &ty.inner else {
            panic!("no structure: {ty:?}");
        };
        assert_eq!(u64::from(*span), BYTES);
        for (index, member) in members.iter().enumerate() {
            let offset = 16 * (index / 2) + 12 * (index % 2);
            assert_eq!(member.offset as usize, offset, "{:?}", member.name);
        }
    }
}
