//! Writes the queries of each editor: `cargo run -p tree-sitter-impasto --example queries`. A test says when they are old.

use std::fs;
use std::path::Path;

#[path = "../tests/editors.rs"]
mod editors;

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for (path, text) in editors::EDITORS.iter().flat_map(editors::files) {
        let file = folder.join(path);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(file, text)?;
    }
    Ok(())
}
