//! What materials see of a hit: normals, tangents, coordinates and textures.

use std::path::Path;

use crate::support::light_scenes::dark_scene;
use crate::support::worlds::{kernel_parts, world};
use crate::support::{Random, Row, floats, row, run};
use glam::{Vec2, Vec3};
use image::{DynamicImage, ImageFormat, Rgb32FImage, RgbaImage};

use impasto_compiler::abi::{Emission, Input, InstanceInfo, TextureRef, TextureSpace};
use impasto_compiler::{MaterialRequest, MemoryLoader, compile};
use impasto_runtime::audit;
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::{Mesh, Scene};
use impasto_runtime::technique::Technique;
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::texture;

/// A mesh with one entry a triangle: corners, vertex normals, texture coordinates.
type Triangle = ([Vec3; 3], Option<[Vec3; 3]>, [Vec2; 3]);

/// Geometry and surface of triangles, each of an instance of its own, as kernels read them.
fn parts(triangles: &[Triangle]) -> [ShaderPart; 2] {
    let (scene, instances) = scene(Mesh {
        positions: triangles.iter().map(|t| t.0).collect(),
        normals: triangles.iter().map(|t| t.1).collect(),
        uvs: triangles.iter().map(|t| t.2).collect(),
        ..Mesh::default()
    });
    let technique = Technique::default();
    let parts = kernel_parts(&scene, &instances, &technique).expect("the parts build");
    [parts.geometry, parts.surface]
}

/// A scene of some corners, each triangle an instance of the one material.
fn scene(mesh: Mesh) -> (Scene, Vec<InstanceInfo>) {
    let triangles = mesh.positions.len();
    let instance = |index: usize| InstanceInfo {
        name: format!("i{index}"),
        material: 0,
        emission: Emission::None,
        medium: None,
    };
    let mesh = Mesh {
        materials: (0..triangles as u32).collect(),
        lights: vec![None; triangles],
        ..mesh
    };
    let scene = Scene {
        mesh,
        ..dark_scene()
    };
    (scene, (0..triangles).map(instance).collect())
}

/// The primitives that triangles are, which the corners' buffer tells by their instances.
fn primitives(geometry: &ShaderPart) -> Vec<u32> {
    let rows: &[[Row; 3]] = bytemuck::cast_slice(&geometry.buffers[0].bytes);
    let mut primitives = vec![0; rows.len()];
    for (primitive, [[.., instance], ..]) in (0..).zip(rows) {
        primitives[*instance as usize] = primitive;
    }
    primitives
}

/// What a kernel gets at barycentric coordinates of each triangle.
#[derive(Debug)]
struct Seen {
    position: Vec3,
    geometric: Vec3,
    normal: Vec3,
    tangent: Vec3,
    uv: Vec2,
}

fn look(triangles: &[Triangle], at: &[(u32, Vec2)]) -> Vec<Seen> {
    let [geometry, surface] = parts(triangles);
    let primitives = primitives(&geometry);
    let input: Vec<Row> = at
        .iter()
        .map(|(t, b)| [primitives[*t as usize], b.x.to_bits(), b.y.to_bits(), 0])
        .collect();
    let body = "
        let p = input[i].x;
        let b = bitcast<vec2<f32>>(input[i].yz);
        let uv = hit_uv(p, b);
        result[4u * i] = bitcast<vec4<u32>>(vec4<f32>(hit_position(p, b), uv.x));
        result[4u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(hit_geometric_normal(p), uv.y));
        result[4u * i + 2u] = bitcast<vec4<u32>>(vec4<f32>(hit_normal(p, b), 0.0));
        result[4u * i + 3u] = bitcast<vec4<u32>>(vec4<f32>(hit_tangent(p), 0.0));";
    let rows = run(&[&geometry, &surface], body, &input, at.len(), 4 * at.len());
    let seen = |rows: &[Row]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| floats(rows[k]));
        Seen {
            position: Vec3::from_slice(&a),
            geometric: Vec3::from_slice(&b),
            normal: Vec3::from_slice(&c),
            tangent: Vec3::from_slice(&d),
            uv: Vec2::new(a[3], b[3]),
        }
    };
    rows.chunks(4).map(seen).collect()
}

fn random_triangle(random: &mut Random, scale: f32) -> Triangle {
    let corners = [(); 3].map(|_| scale * random.point(-1.0, 1.0));
    let normal = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .normalize();
    let normals = [(); 3].map(|_| (normal + 0.5 * random.direction()).normalize());
    let uvs = [(); 3].map(|_| Vec2::new(random.range(-2.0, 2.0), random.range(-2.0, 2.0)));
    (corners, Some(normals), uvs)
}

#[test]
fn hits_interpolate_what_corners_have() {
    let mut random = Random::new(1);
    for scale in [1.0, 1e-6, 1e6] {
        let triangles: Vec<Triangle> = (0..300)
            .map(|_| random_triangle(&mut random, scale))
            .collect();
        let at: Vec<(u32, Vec2)> = (0..300)
            .map(|i| {
                let (u, v) = (random.uniform(), random.uniform());
                (
                    i,
                    if u + v > 1.0 {
                        Vec2::new(1.0 - u, 1.0 - v)
                    } else {
                        Vec2::new(u, v)
                    },
                )
            })
            .collect();
        for ((index, b), seen) in at.iter().zip(look(&triangles, &at)) {
            let (corners, normals, uvs) = &triangles[*index as usize];
            let weights = [1.0 - b.x - b.y, b.x, b.y];
            let blend = |values: &[Vec3; 3]| (0..3).map(|k| weights[k] * values[k]).sum::<Vec3>();
            assert!(
                seen.position.distance(blend(corners)) < 1e-6 * scale,
                "{seen:?}"
            );
            let uv: Vec2 = (0..3).map(|k| weights[k] * uvs[k]).sum();
            assert!(seen.uv.distance(uv) < 1e-5, "{seen:?}");
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let geometric = (b - a).cross(c - a).normalize().as_vec3();
            assert!(
                seen.geometric.distance(geometric) < 1e-3,
                "{seen:?} instead of {geometric}"
            );
            let normal = blend(&normals.expect("they have some")).normalize();
            // Normals are stored in twice 16 bits.
            assert!(
                seen.normal.distance(normal) < 1e-4,
                "{} instead of {normal}",
                seen.normal
            );
            // Along the tangent, the first coordinate grows and the second does not change.
            let (d1, d2) = ((b - a).as_vec3(), (c - a).as_vec3());
            let (duv1, duv2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
            let gram = glam::Mat2::from_cols(
                Vec2::new(d1.dot(d1), d1.dot(d2)),
                Vec2::new(d1.dot(d2), d2.dot(d2)),
            );
            let step = gram.inverse() * Vec2::new(seen.tangent.dot(d1), seen.tangent.dot(d2));
            let change = (step.x * duv1 + step.y * duv2) * scale;
            assert!((seen.tangent.length() - 1.0).abs() < 1e-5);
            assert!(
                change.x > 0.0 && change.y.abs() < 0.02 * (1.0 + change.x),
                "{change} {seen:?}"
            );
        }
    }
}

#[test]
fn unusable_attributes_fall_back() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let flat_uvs = [Vec2::ZERO, Vec2::X, 2.0 * Vec2::X];
    let cases: [Triangle; 5] = [
        (corners, None, uvs),
        // Vertex normals that cancel, and that point below the surface.
        (corners, Some([Vec3::X, Vec3::NEG_X, Vec3::X]), uvs),
        (corners, Some([Vec3::NEG_Z; 3]), uvs),
        // Coordinates that span no area, and none.
        (corners, None, flat_uvs),
        (corners, Some([Vec3::Z; 3]), [Vec2::ONE; 3]),
    ];
    let at: Vec<(u32, Vec2)> = (0..5).map(|i| (i, Vec2::new(0.5, 0.25))).collect();
    for (i, seen) in look(&cases, &at).iter().enumerate() {
        assert!(seen.normal.distance(Vec3::Z) < 1e-4, "{i}: {seen:?}");
        let tangent = if i < 3 { Vec3::X } else { Vec3::ZERO };
        assert_eq!(seen.tangent, tangent, "{i}");
    }
    // A mirrored chart: the first coordinate grows towards -x.
    let mirrored = (corners, None, [Vec2::ZERO, Vec2::NEG_X, Vec2::Y]);
    assert_eq!(
        look(&[mirrored], &[(0, Vec2::ZERO)])[0].tangent,
        Vec3::NEG_X
    );
}

/// Of corners that have neither normals nor coordinates, materials that read both are given the
/// geometric normal and zeros, and kernels have neither buffers nor functions for more.
#[test]
fn a_scene_without_attributes_has_no_buffers_for_them() {
    let mut files = MemoryLoader::default();
    files.add(
        "a.impasto",
        "use std::bsdf::diffuse;\n\
         material bent { surface = diffuse(color(uv.x, uv.y, tangent.x), normal: normalize(normal + 0.1 * tangent)); }",
    );
    let compilation = compile(&[MaterialRequest::new("bent", "a.impasto")], &mut files);
    let program = compilation
        .program
        .unwrap_or_else(|| panic!("{:?}", compilation.diagnostics));
    let materials = program.infos();
    let read = materials[0].inputs;
    assert!(
        read.has(Input::Normal) && read.has(Input::Uv) && read.has(Input::Tangent),
        "{read:?}"
    );

    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let (scene, instances) = scene(Mesh {
        positions: vec![corners],
        ..Mesh::default()
    });
    let technique = Technique::default();
    let world = world(&scene, &materials, &instances, &technique).expect("the parts build");
    let parts = world.kernel_parts(&materials, &technique);
    assert!(parts.surface.buffers.is_empty());

    let kernels = audit::kernels(&world, &program, technique).expect("they are composed");
    for name in [
        "hit_normal(",
        "hit_uv(",
        "hit_tangent(",
        "vertex_normals",
        "vertex_uvs",
    ] {
        let having = kernels.iter().find(|kernel| kernel.wgsl.contains(name));
        assert!(having.is_none(), "`{name}` in {having:?}");
    }
    let evaluates = |text: &str| text.contains("fn surface_point(");
    let kernel = kernels.iter().find(|kernel| evaluates(&kernel.wgsl));
    let kernel = &kernel.expect("a kernel of the material").wgsl;
    let items = ["struct PathHit", "struct SurfacePoint", "fn surface_point"];
    let point = ShaderPart {
        wgsl: items.map(|start| item(kernel, start)).concat(),
        buffers: Vec::new(),
    };
    let body = "
        let seen = surface_point(PathHit(1.0, 0.2, 0.2, 0u), 1.0);
        result[0] = bitcast<vec4<u32>>(vec4<f32>(seen.normal, seen.uv.x));
        result[1] = bitcast<vec4<u32>>(vec4<f32>(seen.tangent, seen.uv.y));";
    let rows = run(&[&parts.geometry, &parts.surface, &point], body, &[], 1, 2);
    assert_eq!(floats(rows[0]), [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(floats(rows[1]), [0.0; 4]);
}

/// The item of a kernel that begins so.
fn item(kernel: &str, start: &str) -> String {
    let begin = kernel.find(start).unwrap_or_else(|| panic!("no `{start}`"));
    let text = &kernel[begin..];
    let end = match text.lines().next() {
        Some(line) if line.ends_with('}') => line.len(),
        _ => text.find("\n}").expect("an end") + 2,
    };
    text[..end].to_owned() + "\n"
}

/// The texture part of files in a folder of their own.
fn texture_part(files: &[(&str, Vec<u8>, TextureSpace)]) -> Result<ShaderPart, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes, _) in files {
        std::fs::write(folder.path().join(name), bytes).expect("it is written");
    }
    let texture = |(name, _, space): &(&str, Vec<u8>, TextureSpace)| TextureRef {
        path: (*name).into(),
        space: *space,
        lookups: Default::default(),
    };
    let textures: Vec<TextureRef> = files.iter().map(texture).collect();
    Ok(texture::part(&textures, folder.path())?.expect("there are textures"))
}

fn encode(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .into()
        .write_to(&mut bytes, format)
        .expect("it is encoded");
    bytes.into_inner()
}

fn fetch(part: &ShaderPart, at: &[(u32, Vec2)]) -> Vec<[f32; 4]> {
    let input: Vec<Row> = at
        .iter()
        .map(|(s, uv)| [*s, uv.x.to_bits(), uv.y.to_bits(), 0])
        .collect();
    let body = "result[i] = bitcast<vec4<u32>>(texture_fetch(input[i].x, bitcast<vec2<f32>>(input[i].yz)));";
    let rows = run(&[part], body, &input, at.len(), at.len());
    rows.into_iter().map(floats).collect()
}

#[test]
fn textures_are_bilinear_wrap_and_have_v_up() {
    // 4 x 2 texels of different reds, the top row first; greens tell the second texture.
    let reds = RgbaImage::from_fn(4, 2, |x, y| {
        image::Rgba([(x + 4 * y) as u8 * 30, 0, 0, 255])
    });
    let green = RgbaImage::from_pixel(1, 1, image::Rgba([0, 255, 0, 128]));
    let files = [
        (
            "reds.png",
            encode(reds, ImageFormat::Png),
            TextureSpace::Data,
        ),
        (
            "green.png",
            encode(green, ImageFormat::Png),
            TextureSpace::Color,
        ),
    ];
    let part = texture_part(&files).expect("they load");
    let red = |x: u32, y: u32| (x % 4 + 4 * (y % 2)) as f32 * 30.0 / 255.0;
    let center = |x: f32, y: f32| Vec2::new((x + 0.5) / 4.0, 1.0 - (y + 0.5) / 2.0);
    let cases = [
        (center(0.0, 0.0), red(0, 0)),
        (center(3.0, 1.0), red(3, 1)),
        (center(1.5, 0.0), 0.5 * (red(1, 0) + red(2, 0))),
        (center(2.0, 0.5), 0.5 * (red(2, 0) + red(2, 1))),
        (center(3.5, 1.0), 0.5 * (red(3, 1) + red(0, 1))),
        (center(0.0, -0.5), 0.5 * (red(0, 0) + red(0, 1))),
        (center(0.0, 0.0) + Vec2::new(-3.0, 7.0), red(0, 0)),
        (center(2.0, 1.0) + Vec2::new(1000.0, -1000.0), red(2, 1)),
        (
            Vec2::new(0.0, 0.0),
            0.25 * (red(0, 0) + red(3, 0) + red(0, 1) + red(3, 1)),
        ),
        (
            Vec2::new(-1e-9, 1.0),
            0.25 * (red(0, 0) + red(3, 0) + red(0, 1) + red(3, 1)),
        ),
    ];
    let at: Vec<(u32, Vec2)> = cases.iter().map(|c| (0, c.0)).collect();
    for ((uv, expected), [r, g, b, a]) in cases.iter().zip(fetch(&part, &at)) {
        assert!(
            (r - expected).abs() < 1e-3,
            "{r} instead of {expected} at {uv}"
        );
        assert_eq!([g, b, a], [0.0, 0.0, 1.0]);
    }
    let [r, g, b, a] = fetch(&part, &[(1, Vec2::new(0.3, 12.7))])[0];
    assert_eq!([r, g, b], [0.0, 1.0, 0.0]);
    assert!(
        (a - 128.0 / 255.0).abs() < 1e-3,
        "alpha is linear in any case"
    );
}

#[test]
fn colors_are_decoded_and_data_is_not() {
    let grey = RgbaImage::from_pixel(1, 1, image::Rgba([188, 10, 255, 255]));
    let bytes = encode(grey, ImageFormat::Png);
    let float = Rgb32FImage::from_pixel(1, 1, image::Rgb([150.0, 300.0, 0.0]));
    let files = [
        ("c.png", bytes.clone(), TextureSpace::Color),
        ("d.png", bytes, TextureSpace::Data),
        (
            "f.exr",
            encode(float.clone(), ImageFormat::OpenExr),
            TextureSpace::Color,
        ),
        (
            "h.hdr",
            encode(float, ImageFormat::Hdr),
            TextureSpace::Color,
        ),
    ];
    let part = texture_part(&files).expect("they load");
    let at: Vec<(u32, Vec2)> = (0..4).map(|slot| (slot, Vec2::splat(0.5))).collect();
    let expected = [
        [0.502_886, 0.003_035_27, 1.0],
        [188.0 / 255.0, 10.0 / 255.0, 1.0],
        [150.0, 300.0, 0.0],
        [150.0, 300.0, 0.0],
    ];
    for (texel, expected) in fetch(&part, &at).iter().zip(expected) {
        for (value, expected) in texel.iter().zip(expected) {
            // Half floats have 11 bits, shared exponents of HDR files 8.
            let tolerance = 5e-4 * expected + if expected < 1.0 { 5e-3 * expected } else { 2.0 };
            assert!(
                (value - expected).abs() <= tolerance,
                "{texel:?} instead of {expected:?}"
            );
        }
    }
}

#[test]
fn textures_that_cannot_be_read_are_explained() {
    let message = |files: &[(&str, Vec<u8>, TextureSpace)]| match texture_part(files) {
        Ok(_) => panic!("it loads"),
        Err(error) => error.to_string(),
    };
    let data = TextureSpace::Data;
    let text = message(&[("a.png", b"hello, this is no picture".to_vec(), data)]);
    assert!(
        text.contains("a.png: the texture is no picture, whatever its name says"),
        "{text}"
    );
    let text = message(&[("a.tga", b"hello, this is no picture".to_vec(), data)]);
    assert!(
        text.contains("a.tga: the texture is in a format that is not read here"),
        "{text}"
    );
    assert!(text.contains("PNG, JPEG"), "{text}");
    let bright = Rgb32FImage::from_fn(2, 2, |x, y| {
        image::Rgb([0.0, if x + y == 2 { 1e5 } else { 1.0 }, 0.0])
    });
    let text = message(&[("a.exr", encode(bright, ImageFormat::OpenExr), data)]);
    assert!(
        text.contains("a.exr: the texel in column 1, row 1 is") && text.contains("65504"),
        "{text}"
    );
    let missing = TextureRef {
        path: "none.png".into(),
        space: data,
        lookups: Default::default(),
    };
    let text = texture::part(&[missing], Path::new("."))
        .expect_err("it is missing")
        .to_string();
    assert!(text.contains("none.png: cannot read the texture"), "{text}");
    assert_eq!(
        texture::part(&[], Path::new(".")).expect("nothing to read"),
        None
    );
}

#[test]
fn pictures_that_are_cut_short_never_panic() {
    let color = RgbaImage::from_fn(24, 17, |x, y| {
        image::Rgba([(x * 9) as u8, (y * 11) as u8, (x * y) as u8, 200])
    });
    let float = Rgb32FImage::from_fn(24, 17, |x, y| image::Rgb([x as f32, y as f32 * 0.3, 7.0]));
    let opaque = DynamicImage::from(color.clone()).into_rgb8();
    let files = [
        ("a.png", encode(color, ImageFormat::Png)),
        ("a.jpg", encode(opaque, ImageFormat::Jpeg)),
        ("a.hdr", encode(float.clone(), ImageFormat::Hdr)),
        ("a.exr", encode(float, ImageFormat::OpenExr)),
    ];
    let mut random = Random::new(9);
    for (name, bytes) in files {
        assert!(
            texture_part(&[(name, bytes.clone(), TextureSpace::Color)]).is_ok(),
            "{name}"
        );
        for end in (0..bytes.len()).step_by(1 + bytes.len() / 200) {
            let cut = bytes[..end].to_vec();
            // JPEG decoders may fill in what is missing; all others must notice.
            let result = texture_part(&[(name, cut, TextureSpace::Color)]);
            assert!(
                result.is_err() || name == "a.jpg" || end + 16 > bytes.len(),
                "{name} of {end} bytes loads"
            );
        }
        for _ in 0..200 {
            let mut changed = bytes.clone();
            let place = random.bits() as usize % changed.len();
            changed[place] ^= 1 << (random.bits() % 8);
            let _ = texture_part(&[(name, changed, TextureSpace::Color)]);
        }
    }
}

#[test]
fn material_code_and_scene_parts_share_no_names() {
    let mut files = MemoryLoader::default();
    files.add(
        "a.impasto",
        "use std::bsdf::diffuse;\n\
         material across { param bytes: texture = \"a.png\";\n\
         let Triangle = image(bytes, uv); surface = diffuse(Triangle); }",
    );
    let compilation = compile(&[MaterialRequest::new("texel", "a.impasto")], &mut files);
    let program = compilation
        .program
        .unwrap_or_else(|| panic!("{:?}", compilation.diagnostics));
    let dot = RgbaImage::from_pixel(1, 1, image::Rgba([9; 4]));
    let texture = texture_part(&[("a.png", encode(dot, ImageFormat::Png), TextureSpace::Color)]);
    let [geometry, surface] = parts(&[random_triangle(&mut Random::new(2), 1.0)]);
    let material = ShaderPart {
        wgsl: program.wgsl(&[0]),
        buffers: Vec::new(),
    };
    let all = [&geometry, &surface, &texture.expect("it loads"), &material];
    let body = "
        let point = SurfacePoint(vec3<f32>(0.0), vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.0), vec2<f32>(0.0), 1.0);
        let s = evaluate_material(0u, point, vec3<f32>(0.0, 0.6, 0.8), vec3<f32>(0.0), vec4<f32>(0.5));
        result[0] = bitcast<vec4<u32>>(vec4<f32>(s.throughput, s.pdf));";
    let [r, g, b, pdf] = floats(run(&all, body, &[], 1, 1)[0]);
    assert!(
        r > 0.0 && g > 0.0 && b > 0.0 && pdf > 0.0,
        "{r} {g} {b} {pdf}"
    );
}

#[test]
fn offsets_are_outward_and_relative_to_the_place() {
    let triangles = [(
        [Vec3::ZERO, 10.0 * Vec3::X, 10.0 * Vec3::Y],
        None,
        [Vec2::ZERO; 3],
    )];
    let [geometry, surface] = parts(&triangles);
    let places = [Vec3::ZERO, Vec3::ONE, Vec3::new(-1e4, 3.0, 0.0)];
    let input: Vec<Row> = places
        .iter()
        .map(|p| row(p.extend(0.0).to_array()))
        .collect();
    let body = "
        let p = bitcast<vec3<f32>>(input[i].xyz);
        result[i] = bitcast<vec4<u32>>(vec4<f32>(offset_origin(p, vec3<f32>(0.0, 0.0, 1.0)), 0.0));";
    let rows = run(
        &[&geometry, &surface],
        body,
        &input,
        places.len(),
        places.len(),
    );
    for (place, row) in places.iter().zip(rows) {
        let moved = Vec3::from_slice(&floats(row)) - *place;
        let size = place.abs().max_element().max(1.0);
        assert!(
            moved.z > 1e-7 * size && moved.z < 1e-5 * size,
            "{moved} at {place}"
        );
        assert_eq!((moved.x, moved.y), (0.0, 0.0));
    }
}

#[test]
fn textures_in_tiles_have_a_picture_a_unit_square() {
    let grey = |value: u8| {
        let picture = RgbaImage::from_pixel(2, 2, image::Rgba([value, 7, 9, 255]));
        encode(picture, ImageFormat::Png)
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, bytes: Vec<u8>| {
        std::fs::create_dir_all(folder.path().join("maps")).expect("a folder");
        std::fs::write(folder.path().join(name), bytes).expect("it is written");
    };
    file("plain.png", grey(10));
    for (number, value) in [(1001, 50), (1002, 100), (1010, 150), (1021, 200)] {
        file(&format!("maps/wood.{number}.png"), grey(value));
    }
    // What only looks like a tile is none.
    for name in [
        "maps/wood.999.png",
        "maps/wood.10011.png",
        "maps/wood.1003.jpg",
        "maps/stone.1003.png",
    ] {
        file(name, b"no picture".to_vec());
    }
    let texture = |path: &str| TextureRef {
        path: path.into(),
        space: TextureSpace::Data,
        lookups: Default::default(),
    };
    let textures = [texture("maps/wood.<UDIM>.png"), texture("plain.png")];
    let part = texture::part(&textures, folder.path());
    let part = part.expect("it loads").expect("there are textures");
    // Tiles end where they end: nothing of the picture's other side, or of the next, shows at their edges.
    let cases = [
        (0, [0.5, 0.5], Some(50)),
        (0, [0.0, 0.0], Some(50)),
        (0, [0.999, 0.999], Some(50)),
        (0, [1.0, 0.5], Some(100)),
        (0, [1.999, 0.001], Some(100)),
        (0, [9.5, 0.5], Some(150)),
        (0, [0.5, 2.5], Some(200)),
        (0, [2.5, 0.5], None),
        (0, [0.5, 1.5], None),
        (0, [10.5, 0.5], None),
        (0, [-0.5, 0.5], None),
        (0, [0.5, -0.001], None),
        (0, [0.5, 3.0], None),
        (0, [1e30, 1e30], None),
        (1, [0.5, 0.5], Some(10)),
        (1, [5.5, 7.5], Some(10)),
    ];
    let at: Vec<(u32, Vec2)> = cases.iter().map(|c| (c.0, Vec2::from(c.1))).collect();
    for ((slot, uv, expected), [r, g, _, a]) in cases.iter().zip(fetch(&part, &at)) {
        let value = expected.unwrap_or(0) as f32 / 255.0;
        assert!(
            (r - value).abs() < 1e-3,
            "{slot} at {uv:?}: {r}, not {value}"
        );
        let covered = f32::from(u8::from(expected.is_some()));
        assert_eq!((a, g > 0.0), (covered, covered > 0.0), "{slot} at {uv:?}");
    }
}

#[test]
fn tiles_that_are_not_there_are_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, said) in [
        ("wood.<UDIM>.png", "`wood.1001.png`"),
        ("maps/wood.<UDIM>.png", "cannot read the folder"),
        ("<UDIM>/wood.png", "not of a folder"),
    ] {
        let texture = TextureRef {
            path: path.into(),
            space: TextureSpace::Color,
            lookups: Default::default(),
        };
        let error = texture::part(&[texture], folder.path()).expect_err(path);
        assert!(error.to_string().contains(said), "{path}: {error}");
        assert!(error.to_string().contains("UDIM"), "{path}: {error}");
    }
}
