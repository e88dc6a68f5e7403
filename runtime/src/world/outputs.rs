//! The outputs that a render was asked for, as its scene has them: what exists, what it is called, and the
//! buffers by which kernels find names and groups.

use impasto_compiler::abi::{Emission, InstanceInfo};
use impasto_compiler::diag::nearest;

use crate::error::SceneError;
use crate::film::layers::{Layer, Layers};
use crate::film::outputs::{self, ALL_GROUPS, Ask, At, GROUP_PREFIX, Kind, Output, group_of};
use crate::scene::{Mesh, Scene};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::lights::groups::{self, Groups};
use crate::world::needs::Needs;

/// The outputs of a world's film.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// Which.
    pub layers: Layers,
    /// What kernels find objects by; absent if they are not asked for.
    pub(crate) objects: Option<ShaderPart>,
    /// What they find groups of lights by, likewise.
    pub(crate) groups: Option<Groups>,
}

impl Recorded {
    /// All that is looked up, as a kernel with some needs has it.
    pub(crate) fn written(&self, needs: Needs) -> Option<ShaderPart> {
        let groups = self.groups.as_ref().map(|groups| groups.written(needs));
        let parts = self.objects.clone().into_iter().chain(groups);
        parts.reduce(|mut a, b| {
            a.wgsl += &b.wgsl;
            a.buffers.extend(b.buffers);
            a
        })
    }

    /// The same without the contents of buffers.
    pub(crate) fn without_contents(&self) -> Self {
        let mut outputs = self.clone();
        let objects = outputs
            .objects
            .iter_mut()
            .flat_map(|part| &mut part.buffers);
        let groups = outputs.groups.iter_mut().flat_map(|g| &mut g.buffers);
        objects.chain(groups).for_each(BufferData::drop_contents);
        outputs
    }
}

/// The outputs of some names in `scene`, whose bindings compiled to `instances`; `has_looks` says whether their
/// materials were compiled with what says how they look.
///
/// # Errors
/// There is no such output, or the scene cannot have it.
pub(crate) fn layers(
    names: &[String],
    scene: &Scene,
    instances: &[InstanceInfo],
    has_looks: bool,
) -> Result<Layers, SceneError> {
    let mut layers = Vec::new();
    for name in names {
        outputs::check_name(name).map_err(SceneError::new)?;
        let emits = |i: usize| {
            instances
                .get(i)
                .is_some_and(|i| i.emission != Emission::None)
        };
        let all = groups::names(scene, emits);
        if name == ALL_GROUPS {
            layers.extend(
                all.iter()
                    .filter_map(|g| plain(&format!("{GROUP_PREFIX}{g}"))),
            );
            continue;
        }
        let Some(mut layer) = plain(name) else {
            continue;
        };
        let output = layer.output;
        if output.at == At::Light {
            check_group(name, &all)?;
        }
        for ask in output.asks {
            check(name, *ask, scene, has_looks)?;
        }
        if output.kind == Kind::Ids {
            layer.names = if output.asks.contains(&Ask::Objects) {
                scene.object_names()
            } else {
                instances.iter().map(|i| i.name.clone()).collect()
            };
        }
        layers.push(layer);
    }
    Ok(Layers::new(layers))
}

/// A layer without names.
fn plain(name: &str) -> Option<Layer> {
    Some(Layer {
        output: Output::named(name)?,
        name: name.to_owned(),
        names: Vec::new(),
    })
}

fn check_group(name: &str, all: &[String]) -> Result<(), SceneError> {
    let group = group_of(name).unwrap_or(name);
    if all.iter().any(|known| known == group) {
        return Ok(());
    }
    let known: Vec<String> = all.iter().map(|g| format!("{GROUP_PREFIX}{g}")).collect();
    let near = nearest(group, all.iter().map(String::as_str));
    let near = near.map_or(String::new(), |near| {
        format!("did you mean `{GROUP_PREFIX}{near}`? ")
    });
    let message =
        format!("no light of the scene is in the group `{group}`, which `{name}` asks for");
    Err(SceneError::new(message).hint(format!("{near}there are {}", known.join(", "))))
}

/// Fails if a scene has not what an output asks for.
fn check(name: &str, ask: Ask, scene: &Scene, has_looks: bool) -> Result<(), SceneError> {
    let meshes = || scene.objects.iter().map(|o| &o.mesh).chain([&scene.mesh]);
    let fail = |message: &str, hint: &str| {
        Err(SceneError::new(format!("`{name}` cannot be recorded: {message}")).hint(hint))
    };
    let is_named = |mesh: &Mesh| mesh.is_empty() || !mesh.objects.is_empty();
    match ask {
        Ask::Uvs if meshes().all(|m| m.uvs.is_empty()) => fail(
            "no triangle of the scene has texture coordinates",
            "OBJ files have them in `vt` lines, which faces name as in `1/2/3`",
        ),
        Ask::Objects if !meshes().all(is_named) => fail(
            "the scene's triangles are of no objects",
            "scenes that are read from files have them",
        ),
        Ask::Looks if !has_looks => fail(
            "the materials were compiled without what says how they look",
            "compile them with `compile_with_looks`",
        ),
        _ => Ok(()),
    }
}

/// Which object a primitive is of, for the triangles of a mesh in `order`.
pub(crate) fn objects_part(mesh: &Mesh, order: &[u32]) -> ShaderPart {
    let objects = order.iter().map(|&t| mesh.objects.get(t as usize));
    let objects: Vec<u32> = objects.map(|o| o.copied().unwrap_or(0)).collect();
    ShaderPart {
        wgsl: "fn primitive_object(primitive: u32) -> u32 {\n    \
               return triangle_objects[primitive];\n}\n"
            .to_owned(),
        buffers: vec![BufferData::new("triangle_objects", "array<u32>", &objects)],
    }
}
