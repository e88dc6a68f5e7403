//! Groups of lights: tables that say which output of the film records the light of what.

use super::table::Share;
use super::{Kinds, Source};
use crate::film::layers::Layers;
use crate::film::outputs::{At, DEFAULT_GROUP, group_of};
use crate::scene::Scene;
use crate::wgsl;
use crate::wgsl::template::{Flag, Template};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::needs::Needs;

/// Light of which no output is asked for.
const NOWHERE: u32 = u32::MAX;

/// The names of a scene's groups, in order, if what emits nothing has none.
pub(crate) fn names(scene: &Scene, emits: impl Fn(usize) -> bool) -> Vec<String> {
    let labels = &scene.labels;
    let list = |groups: &[Option<String>], at: usize| groups.get(at).cloned().flatten();
    let lights = (0..scene.lights.len()).map(|i| list(&labels.lights, i));
    let environment = scene.environment.iter().map(|_| labels.environment.clone());
    let materials = (0..scene.materials.len()).filter(|i| emits(*i));
    let materials = materials.map(|i| list(&labels.materials, i));
    let all = lights.chain(environment).chain(materials);
    let mut names: Vec<String> = all
        .map(|group| group.unwrap_or_else(|| DEFAULT_GROUP.into()))
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// What kernels find the group of light by.
#[derive(Clone, Debug)]
pub(crate) struct Groups {
    pub(crate) buffers: Vec<BufferData>,
    constants: String,
    /// What tells lights at infinity apart.
    shares: Vec<Template>,
    escape: String,
}

impl Groups {
    /// The functions, for kernels with some needs.
    pub(crate) fn written(&self, needs: Needs) -> ShaderPart {
        let mut wgsl = self.constants.clone() + include_str!("groups.wgsl");
        let flags: Vec<Flag> = needs.flags().collect();
        wgsl.extend(self.shares.iter().map(|share| share.wgsl(&flags)));
        ShaderPart {
            wgsl: wgsl + &self.escape,
            buffers: self.buffers.clone(),
        }
    }
}

impl Kinds {
    /// What finds the group of light; nothing if no group is asked for.
    pub(crate) fn groups(&self, scene: &Scene, layers: &Layers) -> Option<Groups> {
        let layers: Vec<&str> = layers
            .iter()
            .filter(|l| l.output.at == At::Light)
            .filter_map(|l| group_of(&l.name))
            .collect();
        layers.first()?;
        let labels = &scene.labels;
        let index = |group: Option<&Option<String>>| {
            let name = group.and_then(|g| g.as_deref()).unwrap_or(DEFAULT_GROUP);
            let found = layers.iter().position(|group| *group == name);
            found.map_or(NOWHERE, |index| index as u32)
        };
        let environment = index(Some(&labels.environment));
        let of_light = |source: Source| match source {
            Source::Environment => environment,
            Source::Light(light) => index(labels.lights.get(light as usize)),
            Source::Material(material) => index(labels.materials.get(material as usize)),
        };
        let lights = self.kinds.iter().flat_map(|kind| &kind.lights);
        let lights: Vec<u32> = lights.map(|light| of_light(light.source)).collect();
        let instances = (0..scene.materials.len()).map(|i| index(labels.materials.get(i)));
        let instances: Vec<u32> = instances.collect();
        Some(Groups {
            constants: wgsl::constant_u32("GROUPED_LIGHTS", lights.len() as u32),
            shares: self.escaping().filter_map(|(_, s)| Some(s?.wgsl)).collect(),
            escape: self.escape(environment),
            buffers: vec![
                BufferData::new("light_groups", "array<u32>", &never_empty(lights)),
                BufferData::new("instance_groups", "array<u32>", &never_empty(instances)),
            ],
        })
    }

    /// The functions of kinds at infinity, with what tells their lights apart.
    fn escaping(&self) -> impl Iterator<Item = (&'static str, Option<Share>)> {
        let kinds = self.kinds.iter();
        kinds.filter_map(|kind| Some((kind.escape?, kind.share)))
    }

    /// Records what arrives from infinity, the environment and every disc for itself.
    fn escape(&self, environment: u32) -> String {
        let mut body = String::new();
        for (escape, share) in self.escaping() {
            if let Some(Share {
                function,
                first,
                count,
                ..
            }) = share
            {
                body += &format!(
                    "    for (var i = 0u; i < {count}; i += 1u) {{\n        \
                     let light = {function}(i, direction, bsdf_pdf);\n        \
                     record_light(pixel, light_group({first} + i), throughput * light);\n    }}\n"
                );
            } else {
                body += &format!(
                    "    record_light(pixel, {environment}u, throughput * {escape}(direction, bsdf_pdf));\n"
                );
            }
        }
        format!(
            "\nfn record_escape(pixel: u32, throughput: vec3<f32>, direction: vec3<f32>, bsdf_pdf: f32) {{\n{body}}}\n"
        )
    }
}

/// A buffer has an element at least.
fn never_empty(mut words: Vec<u32>) -> Vec<u32> {
    if words.is_empty() {
        words.push(NOWHERE);
    }
    words
}
