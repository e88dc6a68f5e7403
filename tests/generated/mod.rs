//! Example scenes whose geometry is generated: made anew in a folder of the test's own.

use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Generates what belongs to a scene in `out`.
pub(crate) fn generate(name: &str, out: &Path) {
    impasto_scenes::write(name, out).unwrap_or_else(|why| panic!("{name}: {why}"));
}

/// A scene generated anew in `out`, beside copies of the scene file and of the materials: the path of
/// the scene file.
pub(crate) fn generated(name: &str, out: &Path) -> String {
    generate(name, out);
    for folder in ["materials", "materials/textures"] {
        std::fs::create_dir_all(out.join(folder)).expect("a folder");
        for entry in std::fs::read_dir(root().join(folder))
            .expect(folder)
            .flatten()
        {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), out.join(folder).join(entry.file_name()))
                    .expect("it is copied");
            }
        }
    }
    let scene = format!("examples/{name}/scene.toml");
    std::fs::copy(root().join(&scene), out.join(&scene)).expect("it is copied");
    out.join(&scene).display().to_string()
}
