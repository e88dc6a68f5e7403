//! Casts by the processor against the WGSL that they stand for, which the interpreter runs without fusing anything:
//! the bits of hits are equal.

use std::borrow::Cow;

use impasto_cpu::KernelError;
use impasto_cpu::interpret::{Host, Machine};
use impasto_runtime::scene::{Mesh, Placement, Transform};
use impasto_runtime::technique::{Technique, Tree};
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::bvh::{Bvh, Caster, Hit, Trees};
use impasto_runtime::world::surface::geometry_part;
use impasto_runtime::world::{Placed, Split};

/// A host that looks at nothing.
struct Nobody;

impl Host for Nobody {
    fn enter(&mut self, _: usize, _: &[u64], _: &mut Vec<u64>) -> Result<(), KernelError> {
        Ok(())
    }
    fn leave(&mut self, _: usize, _: &[u64], _: &[u64]) {}
}

/// A small generator: SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 32) as u32
    }

    /// Between -1 and 1, every eighth at a place of a grid.
    fn number(&mut self) -> f32 {
        let x = (self.bits() >> 8) as f32 / (1 << 23) as f32 - 1.0;
        if self.bits().is_multiple_of(8) {
            (4.0 * x).round() / 4.0
        } else {
            x
        }
    }

    fn point(&mut self) -> [f32; 3] {
        [(); 3].map(|()| self.number())
    }
}

fn soup(random: &mut Random, count: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let center = random.point();
        let corner = |random: &mut Random| {
            let offset = random.point();
            [0, 1, 2].map(|i| center[i] + 0.4 * offset[i]).into()
        };
        mesh.positions.push([(); 3].map(|()| corner(random)));
        mesh.materials.push(0);
        mesh.lights.push(None);
    }
    mesh
}

/// Small triangles, and among them large ones.
fn with_large_ones(random: &mut Random, count: usize) -> Mesh {
    let mut mesh = soup(random, count);
    for (index, corners) in mesh.positions.iter_mut().enumerate() {
        let [a, b, c] = *corners;
        *corners = if index % 8 == 0 {
            // Long and thin.
            [a, a + 2.0 * (b - a), a + 0.05 * (c - a)]
        } else {
            [a, a + 0.1 * (b - a), a + 0.1 * (c - a)]
        };
    }
    mesh
}

/// The tree over a mesh; that of large triangles in pieces has them.
fn one_level(mesh: &Mesh, technique: &Technique) -> [ShaderPart; 2] {
    let bvh = Bvh::build(mesh, technique);
    assert_eq!(bvh.is_split(), technique.tree == Tree::Split);
    let geometry = geometry_part(mesh, bvh.order(), &vec![u32::MAX; mesh.len()], &[0]);
    [geometry, bvh.part(&Technique::default())]
}

fn two_levels(random: &mut Random, technique: &Technique) -> [ShaderPart; 2] {
    let placement = |index: u32, random: &mut Random| Placement {
        object: index % 2,
        transform: Transform::new(
            random
                .point()
                .map(|x| if x.abs() < 0.2 { 0.5 } else { x })
                .into(),
            random.point().map(|x| 180.0 * x).into(),
            random.point().into(),
        ),
        materials: [0].into(),
        place: 0,
    };
    let world = soup(random, 12);
    let split = Split {
        bounds: world.bounds(),
        world: Cow::Owned(world),
        objects: [60, 5]
            .map(|count| Cow::Owned(with_large_ones(random, count)))
            .to_vec(),
        placements: (0..14).map(|index| placement(index, random)).collect(),
        first_objects: vec![0; 14],
    };
    let placed = Placed::build(&split, 1, technique, &Trees::default()).expect("it fits");
    let geometry = placed.geometry_part(&[u32::MAX; 12], &[0]);
    [geometry, placed.levels().part(&Technique::default())]
}

/// Origin and limit, direction and what is skipped.
type Ray = [[u32; 4]; 2];

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let ray = |index: usize| {
        let origin = random.point().map(|x| 2.0 * x);
        let target = random.point();
        let mut way = [0, 1, 2].map(|i| target[i] - origin[i]);
        if index.is_multiple_of(9) {
            way[index % 3] = 0.0;
        }
        let length = way.iter().map(|x| x * x).sum::<f32>().sqrt().max(1e-3);
        let [dx, dy, dz] = way.map(|x| (x / length).to_bits());
        let [x, y, z] = origin.map(f32::to_bits);
        let t_max = if index.is_multiple_of(5) {
            1.5f32
        } else {
            3e38
        };
        let skip = if index.is_multiple_of(3) {
            random.bits() % 16
        } else {
            u32::MAX
        };
        [[x, y, z, t_max.to_bits()], [dx, dy, dz, skip]]
    };
    (0..count).map(ray).collect()
}

/// What the WGSL hits, and whether it hits any.
fn interpret(parts: &[ShaderPart; 2], rays: &[Ray]) -> Vec<[u32; 5]> {
    let scene = parts.iter().flat_map(|part| &part.buffers);
    let mut text = String::from(
        "@group(0) @binding(0) var<storage, read> input: array<vec4<u32>>;
         @group(0) @binding(1) var<storage, read_write> result: array<atomic<u32>>;\n",
    );
    for (index, buffer) in scene.clone().enumerate() {
        let (binding, name, ty) = (index + 2, buffer.name, buffer.wgsl_type);
        text += &format!("@group(0) @binding({binding}) var<storage, read> {name}: {ty};\n");
    }
    text.extend(parts.iter().map(|part| part.wgsl.as_str()));
    text += &format!(
        "const WORKGROUP_SIZE: u32 = 1u;
        @compute @workgroup_size(1) fn main() {{
            for (var i = 0u; i < {}u; i++) {{
                let origin = bitcast<vec4<f32>>(input[2u * i]);
                let direction = bitcast<vec3<f32>>(input[2u * i + 1u].xyz);
                let skip = input[2u * i + 1u].w;
                let hit = trace_closest(origin.xyz, direction, origin.w, skip);
                atomicStore(&result[5u * i], bitcast<u32>(hit.t));
                atomicStore(&result[5u * i + 1u], bitcast<u32>(hit.u));
                atomicStore(&result[5u * i + 2u], bitcast<u32>(hit.v));
                atomicStore(&result[5u * i + 3u], hit.primitive);
                let any = trace_any(origin.xyz, direction, origin.w, skip);
                atomicStore(&result[5u * i + 4u], select(0u, 1u, any));
            }}
        }}",
        rays.len()
    );
    let module = naga::front::wgsl::parse_str(&text).expect("WGSL");
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::all());
    let info = validator.validate(&module).expect("valid WGSL");
    let code = impasto_cpu::lower(&module, &info, &[], &[]).expect("it is known");
    let words = |name: &String| match name.as_str() {
        "input" => rays.as_flattened().as_flattened().to_vec(),
        "result" => vec![0; 5 * rays.len()],
        name => {
            let buffer = scene.clone().find(|b| b.name == name).expect("a buffer");
            let words = buffer.bytes.chunks_exact(4);
            words
                .map(|w| u32::from_ne_bytes([w[0], w[1], w[2], w[3]]))
                .collect()
        }
    };
    let mut machine = Machine::<f32>::new(&code, code.buffers.iter().map(words).collect(), 1 << 32)
        .expect("it is known");
    machine.run(&mut Nobody).expect("it ends");
    let at = code.buffers.iter().position(|name| name == "result");
    let result = &machine.buffers[at.expect("results")];
    result
        .chunks_exact(5)
        .map(|r| [r[0], r[1], r[2], r[3], r[4]])
        .collect()
}

#[test]
fn native_casts_have_the_bits_of_the_wgsl() {
    let mut random = Random(3);
    let [whole, split] = [Tree::Whole, Tree::Split].map(|tree| Technique {
        tree,
        ..Technique::default()
    });
    let mut worlds =
        Vec::from([1, 7, 300].map(|count| one_level(&soup(&mut random, count), &whole)));
    worlds.push(two_levels(&mut random, &whole));
    worlds.push(one_level(&with_large_ones(&mut random, 300), &split));
    let [geometry, bvh] = two_levels(&mut random, &split);
    assert!(bvh.wgsl.contains("fn primitive_of"));
    worlds.push([geometry, bvh]);
    let mut hits = 0;
    for parts in &worlds {
        let rays = rays(&mut random, 800);
        let expected = interpret(parts, &rays);
        let caster = || Caster::new(&parts[0], &parts[1]).expect("a wide tree");
        for caster in [caster(), caster().portable()] {
            for (ray, expected) in rays.iter().zip(&expected) {
                let [[x, y, z, t_max], [dx, dy, dz, skip]] = *ray;
                let origin = [x, y, z].map(f32::from_bits);
                let direction = [dx, dy, dz].map(f32::from_bits);
                let t_max = f32::from_bits(t_max);
                let Hit { t, u, v, primitive } = caster.closest(origin, direction, t_max, skip);
                let any = caster.any(origin, direction, t_max, skip);
                let [t, u, v] = [t, u, v].map(f32::to_bits);
                let found = [t, u, v, primitive, u32::from(any)];
                assert_eq!(found, *expected, "{:?}", caster.instructions());
                hits += u32::from(any);
            }
        }
    }
    assert!(hits > 1800, "{hits} hits");
}
