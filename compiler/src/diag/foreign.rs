//! What people type who come from another shading language, and what it is called here.
//!
//! One table, [`TABLE`]. A row is looked at only where a name or word means nothing, so a row whose
//! name becomes a real one never answers again, and a test asks for its removal. Another test
//! compiles what each row says to write.

use super::Fix;
use crate::source::Span;

/// Where a word of the table stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Where a value is: `let a = P;`
    Value,
    /// Called: `let a = lerp(0.0, 1.0, 0.5);`
    Call,
    /// Assigned: `Ci = 0.5;`
    Output,
    /// The module of a name: `df::specular_bsdf()`
    Module,
    /// Where a type is: `fn f(a: float3) -> float`
    Type,
    /// At the start of a statement: `return 1.0;`
    Statement,
    /// At the start of a definition: `uniform float a;`
    Definition,
    /// Behind `#`.
    Directive,
}

/// A word of other languages.
#[derive(Clone, Copy, Debug)]
pub struct Foreign {
    /// As it is written there, in one language or another.
    pub names: &'static [&'static str],
    /// Where it stands.
    pub used: Use,
    /// The languages and programs that have it.
    pub from: &'static str,
    /// What to write here; empty where no one expression does it.
    pub instead: &'static str,
    /// The names to import for that, as paths.
    pub imports: &'static [&'static str],
    /// What else to know.
    pub note: &'static str,
}

impl Foreign {
    /// The hint of a diagnostic about `name`, which is one of its names.
    pub fn hint(&self, name: &str) -> String {
        let word = match self.used {
            Use::Directive => format!("`#{name}`"),
            _ => format!("`{name}`"),
        };
        let mut hint = match self.instead {
            "" => format!("{word} of {}", self.from),
            instead => format!("{word} of {} is written `{instead}`", self.from),
        };
        for (i, path) in self.imports.iter().enumerate() {
            hint += if i == 0 {
                ", after `use "
            } else {
                " and `use "
            };
            hint += path;
            hint += ";`";
        }
        if !self.note.is_empty() {
            hint += ": ";
            hint += self.note;
        }
        hint
    }

    /// What to write in the place of the word at `span`, where one word or value does it.
    pub fn fix(&self, name: &str, span: Span) -> Option<Fix> {
        let text = match self.used {
            Use::Value | Use::Type => self.instead,
            // Arguments are the author's; the callee is what has another name.
            Use::Call => self.instead.split_once('(')?.0,
            _ => return None,
        };
        let is_call = self.used == Use::Call;
        let is_name = |c: char| c == '_' || c.is_alphanumeric();
        if text.is_empty() || (is_call && !text.chars().all(is_name)) {
            return None;
        }
        Some(Fix {
            title: format!("write `{text}`"),
            span,
            was: Some(name.to_owned()),
            text: text.to_owned(),
            imports: self.imports.iter().map(|p| (*p).to_owned()).collect(),
        })
    }
}

/// The hint for a word that stands in one of `places` and means nothing there.
pub fn hint(name: &str, places: &[Use]) -> Option<String> {
    Some(row(name, places)?.hint(name))
}

/// The row of a word that stands in one of `places`.
pub fn row(name: &str, places: &[Use]) -> Option<&'static Foreign> {
    let mut rows = TABLE.iter();
    rows.find(|row| row.names.contains(&name) && places.contains(&row.used))
}

macro_rules! table {
    ($($used:ident { $($($name:literal)|+, $from:literal => $instead:literal
        $(, use [$($path:literal)+])? $(; $note:literal)?)* })*) => {
        /// Every row.
        pub const TABLE: &[Foreign] = &[$($(Foreign {
            names: &[$($name),+],
            used: Use::$used,
            from: $from,
            instead: $instead,
            imports: table!(@imports $($($path)+)?),
            note: table!(@note $($note)?),
        },)*)*];
    };
    (@imports) => { &[] };
    (@imports $($path:literal)+) => { &[$($path),+] };
    (@note) => { "" };
    (@note $note:literal) => { $note };
}

table! {
    Value {
        "P", "OSL and RenderMan" => "position"; "a point in metres, so divide it by the size of a feature: `position / 3 cm`"
        "N", "OSL and RenderMan" => "normal"
        "Ng", "OSL and RenderMan" => "geometric_normal"
        "u" | "s", "OSL and RenderMan" => "uv.x"
        "v" | "t", "OSL and RenderMan" => "uv.y"
        "dPdu", "OSL and RenderMan" => "tangent"
        "dPdv", "OSL and RenderMan" => "cross(normal, tangent)"
        "bitangent" | "binormal" | "Bitangent", "game engines and MaterialX" => "cross(normal, tangent)"
        "st" | "texcoord" | "vUv" | "TexCoord", "GLSL and RenderMan" => "uv"
        "gl_FragCoord" | "fragCoord" | "SV_Position", "GLSL and HLSL" => "position";
            "materials do not know the pixel; patterns stand on the surface, by `position` or `uv`"
        "I" | "wo" | "viewDir" | "viewDirection" | "Incoming" | "Vworld", "OSL, GLSL, Blender and MaterialX" => "view";
            "it points from the surface to the viewer"
        "iTime" | "u_time", "GLSL" => "time"; "in seconds; `frame` counts frames"
        "Pobject" | "Object" | "Generated" | "generated", "MaterialX and Blender" => "object_position"; "in the units of the geometry file"
        "Nobject", "MaterialX" => "object_normal"
        "Pworld", "MaterialX" => "position"
        "Nworld" | "worldNormal", "MaterialX and HLSL" => "normal"
        "facing_ratio" | "facingratio", "Arnold and Maya" => "facing"
        "instanceId" | "objectId", "HLSL and others" => "instance_id"; "`instance_random(1)` is a random number of it"
        "uv2" | "st2" | "UV2", "game engines" => "uv1"; "the second set; sets are counted from 0"
        "vertexColor" | "geomcolor", "GLSL and MaterialX" => "vertex_color"
        "Ci", "OSL and RenderMan" => ""; "a material assigns `surface = ...;`, and `emission` where it glows"
        "Cs", "RenderMan" => ""; "declare the color as `param base_color: color = 0.8;`"
        "Cd", "Houdini" => "vertex_color"; "the color of the geometry"
        "NdotV" | "nDotV" | "ndotv", "HLSL and GLSL" => "facing"
        "M_PI" | "pi" | "Pi", "C and OSL" => "PI"
        "M_2PI", "OSL" => "2.0 * PI"
    }
    Call {
        "lerp", "HLSL and MDL" => "mix(0.0, 1.0, 0.5)"
        "frac", "HLSL and MDL" => "fract(1.5)"
        "mad" | "fma", "HLSL and GLSL" => "1.0 * 2.0 + 3.0"; "the compiler fuses where it pays"
        "radians", "GLSL, HLSL and OSL" => "90 deg"; "angles have units; `x * 1 deg` gives a number one"
        "degrees", "GLSL, HLSL and OSL" => "PI / 2.0 * 1 rad"; "angles have units"
        "transform", "OSL" => "object_from_world(position)"; "and back by `world_from_object`; normals and vectors alike"
        "half" | "double" | "f32", "HLSL and WGSL" => "float(1)"
        "rsqrt" | "inversesqrt" | "inverseSqrt", "HLSL, GLSL and WGSL" => "inverse_sqrt(2.0)"
        "fmod", "C, HLSL and OSL" => "mod(5.0, 3.0)"
        "ddx" | "ddy" | "dFdx" | "dFdy" | "fwidth" | "Dx" | "Dy" | "filterwidth", "HLSL, GLSL and OSL" => "filter_width(uv)";
            "how far a value goes within a pixel; its slope along the surface is `gradient(x)`"
        "texture2D" | "tex2D" | "textureSample" | "sample" | "Sample" | "textureLod",
            "GLSL, HLSL and OSL" => "";
            "declare `param map: texture = \"file.png\";` and write `image(map, uv)`"
        "noise", "OSL and GLSL" => "perlin(position / 3 cm)", use ["std::noise::perlin"]
        "pnoise", "OSL" => "";
            "noise that repeats is made of cells, as in `perlin(vec3(mod(uv.x, 4.0), uv.y, 0.0))`"
        "snoise", "OSL and GLSL" => "simplex(position / 3 cm)", use ["std::noise::simplex"]
        "cellnoise" | "hashnoise", "OSL and RenderMan" => "cell(position / 3 cm)", use ["std::noise::cell"]
        "hash21" | "rand", "OSL and GLSL" => "white(position / 3 cm)", use ["std::noise::white"]
        "fbm", "GLSL and RenderMan" => "fractal(position / 3 cm)", use ["std::noise::fractal"]
        "Musgrave" | "musgrave", "Blender" => "fractal(position / 3 cm)", use ["std::noise::fractal"]
        "Voronoi", "Blender" => "voronoi(position / 3 cm)", use ["std::noise::voronoi"]
        "ColorRamp" | "color_ramp_node", "Blender" => "", use ["std::pattern::color_ramp"]; "stops are arguments"
        "LayerWeight" | "layer_weight" | "Layer_Weight" | "Fresnel", "Blender" => "layer(dielectric(ior: 1.5), diffuse(0.5))",
            use ["std::bsdf::dielectric" "std::bsdf::diffuse"]; "`layer` weighs both by what the upper one reflects"
        "atan2d" | "atan_2", "other languages" => "atan2(1.0, 2.0)"
        "emission" | "Emission", "OSL and Blender" => "uniform(3.0)", use ["std::edf::uniform"]; "assign it to `emission`"
        "uniform_edf" | "diffuse_edf", "MaterialX and MDL" => "uniform(3.0)", use ["std::edf::uniform"]; "assign it to `emission`"
        "oren_nayar" | "oren_nayar_diffuse_brdf", "OSL" => "oren_nayar_diffuse(0.5)", use ["std::bsdf::oren_nayar_diffuse"]
        "oren_nayar_diffuse_bsdf", "MaterialX and OSL" => "oren_nayar_diffuse(0.5)", use ["std::bsdf::oren_nayar_diffuse"]
        "burley_diffuse_bsdf", "MaterialX and OSL" => "burley_diffuse(0.5)", use ["std::bsdf::burley_diffuse"]
        "microfacet" | "ggx", "OSL" => "conductor()", use ["std::bsdf::conductor"]; "`dielectric` of the same folder is glass, `metal` takes a color"
        "reflection", "OSL" => "mirror()", use ["std::bsdf::mirror"]
        "refraction", "OSL" => "dielectric_transmission()", use ["std::bsdf::dielectric_transmission"]
        "dielectric_bsdf", "MaterialX and OSL" => "dielectric()", use ["std::bsdf::dielectric"]
        "conductor_bsdf", "MaterialX and OSL" => "conductor()", use ["std::bsdf::conductor"]
        "generalized_schlick_bsdf", "MaterialX and OSL" => "generalized_schlick()", use ["std::bsdf::generalized_schlick"]
        "translucent_bsdf", "MaterialX and OSL" => "translucent(0.5)", use ["std::bsdf::translucent"]
        "subsurface_bsdf", "MaterialX and OSL" => "subsurface()", use ["std::bsdf::subsurface"]
        "sheen_bsdf", "MaterialX and OSL" => "sheen_zeltner()", use ["std::bsdf::sheen_zeltner"]
        "diffuse_bsdf" | "lambert" | "Diffuse", "Blender and Arnold" => "diffuse(0.5)", use ["std::bsdf::diffuse"]
        "diffuse_reflection_bsdf", "MDL" => "diffuse(0.5)", use ["std::bsdf::diffuse"]
        "principled_bsdf" | "Principled" | "PrincipledBSDF" | "PrincipledBsdf" | "principled", "Blender" => "open_pbr().surface",
            use ["std::surface::open_pbr"]; "its parameters are inputs of the node, and `materials/principled.impasto` has them all by Blender's names; `disney_principled` is the model of 2012"
        "material_surface" | "ND_standard_surface_surfaceshader", "MDL and MaterialX" => "";
            "assign a bsdf to `surface`, an edf to `emission`"
        "geomprop" | "geompropvalue" | "primvar", "MaterialX and USD" => "";
            "a material reads `position`, `normal`, `tangent`, `uv`, `uv1` and `vertex_color` by name"
        "float3" | "half3" | "ivec3" | "int3" | "dvec3", "HLSL and GLSL" => "vec3(0.0)"
        "float2" | "half2" | "ivec2" | "int2" | "dvec2", "HLSL and GLSL" => "vec2(0.0)"
        "float4" | "half4" | "ivec4" | "int4" | "dvec4", "HLSL and GLSL" => "vec4(0.0)"
        "rgb" | "color3" | "Color", "MaterialX and Blender" => "color(0.5, 0.2, 0.1)"
        "mat4" | "float3x3" | "matrix", "GLSL, HLSL and OSL" => "mat3(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0))";
            "from three columns; `object_from_world(position)` changes spaces"
    }
    Output {
        "Ci" | "gl_FragColor" | "fragColor" | "out_surface" | "BSDF", "OSL, GLSL and Blender" => ""; "a material assigns `surface = ...;`, and `emission` where it glows"
        "Oi" | "alpha" | "Alpha" | "cutout_opacity", "RenderMan, Blender and MDL" => ""; "a surface with holes assigns `opacity = ...;`"
    }
    Module {
        "df", "MDL" => ""; "bsdfs are imported by name, as in `use std::bsdf::diffuse;`, and called without a path: `diffuse(0.5)`"
        "math" | "state" | "base" | "tex", "MDL" => ""; "functions and inputs such as `sin(x)`, `normal` and `uv` are there without an import or a path"
    }
    Type {
        "f32" | "f64" | "double" | "half" | "real", "GLSL, HLSL and WGSL" => "float"
        "i32" | "integer", "WGSL" => "int"
        "u32" | "unsigned" | "uint32_t", "WGSL and C" => "uint"
        "mat2x2" | "mat2x2f" | "float2x2", "WGSL and HLSL" => "mat2"
        "float3" | "half3" | "vec3f" | "double3" | "dvec3" | "Vec3", "HLSL, GLSL and MDL" => "vec3"
        "float2" | "half2" | "vec2f" | "double2" | "dvec2" | "Vec2" | "vector2", "HLSL, GLSL and MaterialX" => "vec2"
        "float4" | "half4" | "vec4f" | "double4" | "dvec4" | "Vec4" | "vector4", "HLSL, GLSL and MaterialX" => "vec4"
        "int3" | "ivec3" | "uvec3" | "uint3", "HLSL and GLSL" => "vec3"; "there are no vectors of ints"
        "int2" | "ivec2" | "uvec2" | "uint2", "HLSL and GLSL" => "vec2"; "there are no vectors of ints"
        "int4" | "ivec4" | "uvec4" | "uint4", "HLSL and GLSL" => "vec4"; "there are no vectors of ints"
        "vector3", "MaterialX" => "vector"
        "mat4" | "matrix" | "matrix33" | "float3x3" | "mat3x3" | "mat3x3f" | "float4x4", "GLSL, HLSL, WGSL and OSL" => "mat3"; "the largest matrix"
        "rgb" | "spectrum" | "Color" | "colour" | "color3" | "color4", "MaterialX and others" => "color"
        "boolean", "MaterialX" => "bool"
        "closure" | "BSDF" | "brdf", "OSL and MaterialX" => "bsdf"
        "EDF", "MaterialX" => "edf"
        "sampler2D" | "texture_2d" | "texture2D" | "Texture2D" | "filename" | "string", "GLSL, HLSL, OSL and MaterialX" => "texture"; "the one type with texts, which name files"
        "void", "GLSL, HLSL and OSL" => ""; "every function has a value; state its type"
    }
    Statement {
        "return", "other languages" => ""; "there is no `return`; the last expression of a block is its value"
        "discard", "GLSL and HLSL" => ""; "a surface with holes assigns `opacity = 0.0;` where they are"
        "float3" | "half3" | "float2" | "half2" | "float4" | "half4" | "half" | "double" | "ivec3" | "int3"
            | "string" | "mat4" | "sampler2D", "GLSL, HLSL and OSL" => "";
            "values are named by `let name = value;`, variables by `var name = value;`"
        "uniform" | "varying" | "out" | "inout" | "attribute" | "output", "GLSL and OSL" => "";
            "what a scene sets is declared `param name: float = 0.5;`"
    }
    Definition {
        "void" | "float3" | "float2" | "float4" | "half" | "half3" | "double", "GLSL, HLSL and OSL" => "";
            "functions are written `fn name(a: float) -> float { ... }`"
        "uniform" | "varying" | "in" | "out" | "inout" | "attribute" | "sampler2D", "GLSL and HLSL" => "";
            "what a scene sets is declared in the material, as `param name: float = 0.5;`"
        "surface" | "shader" | "volume" | "displacement", "OSL and RenderMan" => "";
            "materials are written `material name { surface = ...; }`"
        "mdl" | "annotation", "MDL" => ""; "files state no version; imports are written `use std::bsdf::diffuse;`"
    }
    Directive {
        "include" | "import" | "pragma", "C, GLSL and OSL" => ""; "imports are written `use std::bsdf::diffuse;`"
        "define", "C, GLSL and OSL" => ""; "constants are written `const NAME: float = 1.0;`, macros `fn name(a: float) -> float { ... }`"
        "version" | "extension" | "precision", "GLSL" => ""; "files state no version; leave the line out"
        "if" | "ifdef" | "ifndef" | "else" | "endif", "C, GLSL and HLSL" => ""; "there is no preprocessor; write `if condition { a } else { b }`"
    }
}
