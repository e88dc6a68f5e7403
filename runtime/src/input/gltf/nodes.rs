//! The nodes of a glTF file's scene, where they are in the world at a time, and how their meshes are bent there.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashSet};

use glam::{DMat4, DVec3};
use gltf::scene::Transform;

use super::motion::{Moved, rotation};
use super::shape::Shape;
use super::{Buffers, Model};
use crate::error::SceneError;

/// Nodes within nodes that are followed.
pub(super) const MAX_DEPTH: usize = 256;

impl Model {
    /// The nodes of the scene that is shown: the default one, or the first, or all nodes that are nobody's children.
    fn roots(&self) -> Vec<gltf::Node<'_>> {
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

    /// The node of that number.
    pub(crate) fn node(&self, number: usize) -> Option<gltf::Node<'_>> {
        self.document.nodes().nth(number)
    }

    /// Is the mesh of the node another than the node's mesh where the node is: bent, or at other times elsewhere?
    pub(super) fn has_shape_of_its_own(&self, node: &gltf::Node<'_>) -> bool {
        let has_weights = node.weights().is_some() || self.motion.has(node.index(), Moved::Weights);
        node.skin().is_some() || has_weights || self.motion.moves(node.index())
    }

    /// Is the mesh of the node another at other times?
    pub(crate) fn moves(&self, node: &gltf::Node<'_>) -> bool {
        if self.motion.has(node.index(), Moved::Weights) {
            return true;
        }
        match node.skin() {
            Some(skin) => skin.joints().any(|joint| self.motion.moves(joint.index())),
            None => self.motion.moves(node.index()),
        }
    }
}

/// The nodes of a file at a time, in seconds.
pub(crate) struct Pose<'m> {
    pub(crate) model: &'m Model,
    pub(crate) buffers: Buffers<'m>,
    pub(super) seconds: f64,
    /// Where nodes are that somebody asked for.
    worlds: RefCell<BTreeMap<usize, DMat4>>,
}

impl<'m> Pose<'m> {
    pub(crate) fn new(model: &'m Model, seconds: f64) -> Self {
        Self {
            model,
            buffers: model.buffers(),
            seconds,
            worlds: RefCell::default(),
        }
    }

    /// Calls `visit` for each node of the scene with its transform to the world.
    ///
    /// # Errors
    /// A node is within itself, a transform is no number, or keys are damaged.
    pub(crate) fn visit(
        &self,
        visit: &mut dyn FnMut(&gltf::Node<'m>, &DMat4),
    ) -> Result<(), SceneError> {
        let roots = self.model.roots().into_iter().rev();
        let mut pending: Vec<(gltf::Node<'m>, DMat4, usize)> =
            roots.map(|node| (node, DMat4::IDENTITY, 0)).collect();
        let mut visited = 0;
        let most = self.model.document.nodes().len();
        while let Some((node, parent, depth)) = pending.pop() {
            visited += 1;
            if depth > MAX_DEPTH || visited > most {
                return Err(self.wrong(&within_itself(&node)));
            }
            let transform = parent * self.local(&node).map_err(|why| self.wrong(&why))?;
            check(&node, &transform).map_err(|why| self.wrong(&why))?;
            visit(&node, &transform);
            let children: Vec<gltf::Node<'m>> = node.children().collect();
            let children = children.into_iter().rev();
            pending.extend(children.map(|child| (child, transform, depth + 1)));
        }
        Ok(())
    }

    /// Where the node is in the world.
    ///
    /// # Errors
    /// As [`Pose::visit`], in words.
    pub(crate) fn world(&self, node: &gltf::Node<'m>) -> Result<DMat4, String> {
        // From the node up to one whose place is known.
        let mut path = vec![node.clone()];
        let mut known = DMat4::IDENTITY;
        while let Some(last) = path.last() {
            let Some(parent) = self.model.motion.parent(last.index()) else {
                break;
            };
            if let Some(world) = self.worlds.borrow().get(&parent) {
                known = *world;
                break;
            }
            if path.len() > MAX_DEPTH {
                return Err(within_itself(node));
            }
            path.extend(self.model.node(parent));
        }
        for node in path.iter().rev() {
            known *= self.local(node)?;
            check(node, &known)?;
            self.worlds.borrow_mut().insert(node.index(), known);
        }
        Ok(known)
    }

    /// From the node to the one that it is a child of.
    fn local(&self, node: &gltf::Node<'m>) -> Result<DMat4, String> {
        let motion = &self.model.motion;
        let number = node.index();
        let all = [Moved::Translation, Moved::Rotation, Moved::Scale];
        let is_at_rest = !all.iter().any(|what| motion.has(number, *what));
        if let (Transform::Matrix { matrix }, true) = (node.transform(), is_at_rest) {
            let columns = matrix.map(|column| column.map(f64::from));
            return Ok(DMat4::from_cols_array_2d(&columns));
        }
        let (translation, turn, scale) = node.transform().decomposed();
        let (seconds, buffers) = (self.seconds, &self.buffers);
        let three = |what, given: [f32; 3]| -> Result<DVec3, String> {
            let moved = motion.at::<3>(number, what, seconds, buffers)?;
            Ok(moved.unwrap_or(given.map(f64::from)).into())
        };
        let translation = three(Moved::Translation, translation)?;
        let scale = three(Moved::Scale, scale)?;
        let turned = motion.at::<4>(number, Moved::Rotation, seconds, buffers)?;
        let turn = rotation(&turned.unwrap_or(turn.map(f64::from)));
        Ok(DMat4::from_scale_rotation_translation(
            scale,
            turn,
            translation,
        ))
    }

    /// The shape that the mesh of a node has in the world, where the node itself is at `transform`.
    ///
    /// # Errors
    /// The skin or its keys are damaged, in words.
    pub(crate) fn shape(
        &self,
        node: &gltf::Node<'m>,
        mesh: &gltf::Mesh<'m>,
        transform: &DMat4,
    ) -> Result<Shape, String> {
        let targets = mesh.primitives().map(|p| p.morph_targets().len());
        let targets = targets.max().unwrap_or(0);
        let motion = &self.model.motion;
        let moved = motion.weights(node.index(), targets, self.seconds, &self.buffers)?;
        let given = || {
            node.weights()
                .map(|w| w.iter().copied().map(f64::from).collect())
        };
        let mut shape = Shape::of_mesh(mesh, transform);
        if let Some(weights) = moved.or_else(given) {
            shape.weights = weights;
        }
        if let Some(skin) = node.skin() {
            shape.joints = Some(self.joints(&skin)?);
        }
        Ok(shape)
    }

    /// From corners to the world, by the joints of a skin.
    fn joints(&self, skin: &gltf::Skin<'m>) -> Result<Vec<DMat4>, String> {
        let number = skin.index();
        let inverses = match skin.inverse_bind_matrices() {
            Some(accessor) => self.buffers.floats::<16>(&accessor)?,
            None => Vec::new(),
        };
        let (has, count) = (inverses.len(), skin.joints().len());
        if skin.inverse_bind_matrices().is_some() && has < count {
            return Err(format!(
                "skin {number} has {has} inverse matrices for {count} joints"
            ));
        }
        let mut joints = Vec::with_capacity(count);
        for (index, joint) in skin.joints().enumerate() {
            let world = self.world(&joint)?;
            let inverse = inverses.get(index).map(|m| m.map(f64::from));
            let inverse = inverse.map_or(DMat4::IDENTITY, |m| DMat4::from_cols_array(&m));
            let matrix = world * inverse;
            if !matrix.is_finite() {
                return Err(format!(
                    "the matrix of joint {index} of skin {number} is no number"
                ));
            }
            joints.push(matrix);
        }
        Ok(joints)
    }

    fn wrong(&self, why: &str) -> SceneError {
        SceneError::in_file(&self.model.path, why)
    }
}

fn within_itself(node: &gltf::Node<'_>) -> String {
    format!("node `{}` is within itself", name(node))
}

fn check(node: &gltf::Node<'_>, transform: &DMat4) -> Result<(), String> {
    if transform.is_finite() {
        return Ok(());
    }
    let name = name(node);
    Err(format!("the transform of node `{name}` is no number"))
}

fn name(node: &gltf::Node<'_>) -> String {
    Model::named(node.name(), "node", node.index())
}
