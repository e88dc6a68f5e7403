//! Files that were parsed and are likely to be asked again: a scene asks a file for each of its meshes, sources and
//! pictures.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Choice, Model, file, unreadable};
use crate::error::SceneError;
use crate::input::stamp::Stamp;

/// How many files are kept.
const KEPT: usize = 8;

/// The files, the last one asked for at the end.
static KNOWN: Mutex<Vec<Arc<Model>>> = Mutex::new(Vec::new());

impl Model {
    /// The file at `path`, which is parsed unless it is known, with what is chosen of it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn read(path: &Path, choice: &Choice) -> Result<Arc<Self>, SceneError> {
        let open = || {
            let file = file::open(path)?;
            let stamp = Stamp::of(&file.metadata()?);
            Ok((file, stamp))
        };
        let (file, stamp) = open().map_err(|e| unreadable(path, &e))?;
        // Who asks meanwhile waits, and finds it known.
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |m: &Arc<Self>| m.path == path && m.choice == *choice;
        let found = known.iter().position(is_it);
        if let Some(model) = found.map(|at| known.remove(at))
            && model.stamp == stamp
        {
            known.push(Arc::clone(&model));
            return Ok(model);
        }
        let is_settled = stamp.is_settled();
        let model = Arc::new(Self::parse(path, file, stamp, choice)?);
        if is_settled {
            known.push(Arc::clone(&model));
            let more = known.len().saturating_sub(KEPT);
            known.drain(..more);
        }
        Ok(model)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{file_of, packed, save, square};
    use super::*;

    fn model(path: &Path) -> Arc<Model> {
        Model::read(path, &Choice::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn a_file_is_parsed_once_a_save() {
        let (mut json, binary) = square();
        let (_folder, path) = file_of(&[]);
        save(&path, &packed(&json, &binary), 60);
        let first = model(&path);
        assert!(Arc::ptr_eq(&first, &model(&path)));
        json["materials"][0]["name"] = "New Paint".into();
        save(&path, &packed(&json, &binary), 30);
        let second = model(&path);
        assert_eq!(second.material_names, ["New Paint"]);
        assert!(Arc::ptr_eq(&second, &model(&path)));
        // What was saved just now may be saved again at once, with as many bytes.
        save(&path, &packed(&json, &binary), 0);
        assert!(!Arc::ptr_eq(&model(&path), &model(&path)));
        // Few are kept. It is in this test, since it drives out what other tests read.
        let folder = tempfile::tempdir().expect("a folder");
        let paths = (0..2 * KEPT).map(|i| folder.path().join(format!("{i}.glb")));
        let paths: Vec<_> = paths.collect();
        for path in &paths {
            save(path, &packed(&json, &binary), 60);
            model(path);
        }
        let known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        assert!(known.len() <= KEPT);
    }

    #[test]
    fn what_is_saved_meanwhile_is_not_mixed() {
        let (json, mut binary) = square();
        let (_folder, path) = file_of(&packed(&json, &binary));
        let model = model(&path);
        let accessor = model.document.accessors().next().expect("positions");
        assert!(model.buffers().floats::<3>(&accessor).is_ok());
        let buffers = model.buffers();
        assert!(buffers.floats::<3>(&accessor).is_ok());
        binary.extend([0; 4]);
        save(&path, &packed(&json, &binary), 60);
        // Neither who opens it now nor who has it open.
        for buffers in [model.buffers(), buffers] {
            let error = buffers.floats::<3>(&accessor).expect_err("another file");
            assert!(error.contains("saved while it was read"), "{error}");
        }
    }
}
