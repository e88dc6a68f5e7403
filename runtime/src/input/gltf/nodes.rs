//! The nodes of a glTF file's scene, and where they are in the world.

use std::collections::HashSet;

use glam::DMat4;

use super::Model;
use crate::error::SceneError;

/// Nodes within nodes that are followed.
const MAX_DEPTH: usize = 256;

/// A mesh where a node has it.
pub(crate) struct Placed<'m> {
    pub(crate) mesh: gltf::Mesh<'m>,
    pub(crate) transform: DMat4,
}

impl Model {
    /// The nodes of the scene that is shown: the default one, or the first, or all nodes that are nobody's children.
    pub(crate) fn roots(&self) -> Vec<gltf::Node<'_>> {
        let document = &self.document;
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        match scene {
            Some(scene) => scene.nodes().collect(),
            None => {
                let children = document.nodes().flat_map(|node| node.children());
                let children: HashSet<usize> = children.map(|node| node.index()).collect();
                let nodes = document.nodes();
                nodes
                    .filter(|node| !children.contains(&node.index()))
                    .collect()
            }
        }
    }

    /// Calls `visit` for each node of the scene with its transform to the world.
    ///
    /// # Errors
    /// A node is within itself, or a transform is no number.
    pub(crate) fn visit<'m>(
        &'m self,
        visit: &mut dyn FnMut(&gltf::Node<'m>, &DMat4),
    ) -> Result<(), SceneError> {
        let mut pending: Vec<(gltf::Node<'m>, DMat4, usize)> = self
            .roots()
            .into_iter()
            .rev()
            .map(|node| (node, DMat4::IDENTITY, 0))
            .collect();
        let mut visited = 0;
        let most = self.document.nodes().len();
        while let Some((node, parent, depth)) = pending.pop() {
            visited += 1;
            let name = Self::named(node.name(), "node", node.index());
            let wrong = |message: String| SceneError::in_file(&self.path, message);
            if depth > MAX_DEPTH || visited > most {
                return Err(wrong(format!("node `{name}` is within itself")));
            }
            let own = node.transform().matrix();
            let own = DMat4::from_cols_array_2d(&own.map(|column| column.map(f64::from)));
            let transform = parent * own;
            if !transform.is_finite() {
                return Err(wrong(format!(
                    "the transform of node `{name}` is no number"
                )));
            }
            visit(&node, &transform);
            let children: Vec<gltf::Node<'m>> = node.children().collect();
            let children = children.into_iter().rev();
            pending.extend(children.map(|child| (child, transform, depth + 1)));
        }
        Ok(())
    }

    /// The meshes of the scene.
    pub(crate) fn placed(&self) -> Result<Vec<Placed<'_>>, SceneError> {
        let mut all = Vec::new();
        self.visit(&mut |node, transform| {
            if let Some(mesh) = node.mesh() {
                all.push(Placed {
                    mesh,
                    transform: *transform,
                });
            }
        })?;
        Ok(all)
    }
}
