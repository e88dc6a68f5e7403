//! Good inputs to begin with, and the words that they are made of.

use std::path::{Path, PathBuf};

use impasto_compiler::ir::print;
use impasto_compiler::{MemoryLoader, check};

/// What inputs are made from.
pub struct Corpus {
    /// Good inputs.
    pub texts: Vec<Vec<u8>>,
    /// Words to put in.
    pub words: Vec<&'static str>,
}

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The files of a folder of the repository whose names end so, in order; none if it is not there.
pub fn files(folder: &str, end: &str) -> Vec<Vec<u8>> {
    let Ok(entries) = std::fs::read_dir(root().join(folder)) else {
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.retain(|p| p.to_string_lossy().ends_with(end));
    paths.sort();
    paths.iter().flat_map(std::fs::read).collect()
}

/// Materials, the library, and what was found before.
pub fn sources() -> Corpus {
    let mut texts = files("materials", ".impasto");
    texts.extend(files("tests/diagnostics", ".impasto"));
    texts.extend(files("compiler/tests/regressions", ".impasto"));
    texts.extend(impasto_stdlib::files().iter().map(|f| f.text.into()));
    Corpus {
        texts,
        words: SOURCE_WORDS.split_whitespace().collect(),
    }
}

/// The IR of materials, the cases of passes, and what was found before.
pub fn irs() -> Corpus {
    let mut texts = files("compiler/tests/passes", ".ir");
    texts.extend(files("compiler/tests/passes/cases", ".ir"));
    texts.extend(files("compiler/tests/regressions", ".ir"));
    texts.extend(files("materials", ".impasto").iter().map(|source| {
        let mut files = MemoryLoader::default();
        files.add("m.impasto", source.as_slice());
        let checked = check("m.impasto", &mut files);
        let materials: Vec<_> = checked.checked.iter().collect();
        print::reachable(&checked.ir, None, &materials).into_bytes()
    }));
    Corpus {
        texts,
        words: IR_WORDS.split_whitespace().collect(),
    }
}

const SOURCE_WORDS: &str = "
    material private none label soft group unit param let var fn bsdf edf delta struct const use if else for in while limit return
    break continue true false surface emission interior opacity layer mix medium position normal
    uv tangent exterior_ior bool int uint float length angle vec2 vec3 vec4 color point vector mat2 mat3 float[2] color[] count fill [ ]
    texture std :: ; , . .. : = == != < <= > >= + - * / % & | ^ << >> && || ! += -= *= /= %= &= |= ^= <<= >>= 7u 0xffu -> ( )
    { } [ ] /// //! /* */ // \" \" when diffuse mirror specular blinn_phong uniform flakes perlin
    sample eval pdf albedo emit wo wi u 0 1 2 0.5 1e38 1e-45 -1 65536 2147483648 0xff 1 mm 30 deg
    srgb( gradient( filter_width( image( hash( clamp( select( normalize( x y z xyz r g b _ a b m é \u{0}";

const IR_WORDS: &str = "
    fn struct texture bsdf edf delta material uniform var return if else for in loop limit while
    break continue load call when true false surface = emission = interior = opacity = medium( lobe
    layer mix weight add select normal tangent as turns bool int float vec2 vec3 vec4 mat3 %0 %1 %2
    %3 $0 $1 @0.x @1.i @0 : = .. . , ( ) { } -> 0 1 -1 2147483647 0.0 1.0 1e38 1e-300 (0.0,0.0,0.0)
    (1.0,2.0) .xyz .x .w neg add sub mul div rem mod min max clamp sqrt pow exp log hash dot cross
    normalize transform select lt eq and or not bit_and shift_left unsigned_shift_right unsigned_div unsigned_rem unsigned_to_float to_unsigned to_float to_int image
    filter_width image_data point wo a b x // \" \u{0}";
