//! Writes a scene that is hard on some stage: `generate NAME SIZE FOLDER`; without words, the names there are.

use std::path::Path;
use std::process::ExitCode;

use impasto_fuzz::scenes::{self, HostileScene};

#[allow(clippy::print_stdout)]
fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, size, folder] = &words[..] else {
        for scene in scenes::all() {
            println!("{:<12} {:>7}  {}", scene.name, scene.size, scene.what);
        }
        return ExitCode::from(if words.is_empty() { 0 } else { 2 });
    };
    let (Some(scene), Ok(size)) = (HostileScene::named(name), size.parse()) else {
        eprintln!("`{name}` is no scene, or `{size}` no size");
        return ExitCode::from(2);
    };
    match scene.write(size, Path::new(folder)) {
        Ok(path) => println!("{}", path.display()),
        Err(error) => {
            eprintln!("cannot write into `{folder}`: {error}");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}
