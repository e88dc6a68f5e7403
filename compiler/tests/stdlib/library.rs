//! Walks the BSDFs of the library and makes test cases of them, as `impasto_verify::closure` does for any: each BSDF
//! with each of the parameter values that its documentation asks to try.

use std::sync::LazyLock;

use impasto_compiler::MemoryLoader;
use impasto_verify::closure::cases::{self, Source};

pub use impasto_verify::closure::cases::{Documented, arguments_of};
pub use impasto_verify::closure::{Bsdf, Case};

/// Every BSDF of `std::bsdf`, with its cases. They are compiled once.
pub fn bsdfs() -> &'static [Bsdf] {
    static ALL: LazyLock<Vec<Bsdf>> = LazyLock::new(|| bsdfs_with(&[]));
    &ALL
}

/// Every BSDF of `std::bsdf`; its float parameters also try `values`.
pub fn bsdfs_with(values: &[&str]) -> Vec<Bsdf> {
    let files: Vec<_> = impasto_stdlib::folder("bsdf").collect();
    assert!(files.len() >= 8, "only {} files in bsdf/", files.len());
    files
        .into_iter()
        .map(|file| {
            let documented = documented(file.name, file.text, values);
            build(&documented, &documented.calls)
        })
        .collect()
}

/// The BSDF `name` with one set of arguments.
pub fn bsdf_with(name: &str, call: &str) -> Bsdf {
    let file = impasto_stdlib::file("bsdf", name);
    let file = file.unwrap_or_else(|| panic!("no std::bsdf::{name}"));
    let documented = documented(name, file.text, &[]);
    build(&documented, &[call.to_owned()])
}

/// Reads a file of the library; its float parameters also try `extremes`.
pub fn documented(name: &str, text: &str, extremes: &[&str]) -> Documented {
    let read = cases::documented(name, text, extremes);
    read.unwrap_or_else(|why| panic!("{name}: {why}"))
}

/// Has the compiler evaluate the argument lists, each in a material of its own.
fn build(documented: &Documented, calls: &[String]) -> Bsdf {
    let name = &documented.name;
    let source = Source {
        path: "cases.impasto",
        text: &format!("use std::bsdf::{name};"),
    };
    let built = cases::build(source, documented, calls, &mut MemoryLoader::default());
    let bsdf = built.unwrap_or_else(|why| panic!("{name}:\n{why}"));
    assert!(
        bsdf.albedo_within.is_finite(),
        "{name}: its documentation must say `Albedo: exact.` or `Albedo: within X.`"
    );
    bsdf
}
