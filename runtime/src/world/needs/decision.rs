//! What a world needs, decided: everything that is written afterwards follows from it.

use super::{Need, NeedInputs, Needs, OF_MATERIALS, OF_WAVEFRONTS};

/// The rows that are on for a world, its materials and a technique.
#[derive(Clone, Debug)]
pub(crate) struct Decision {
    /// The rows that are on in a wavefront.
    pub needs: Needs,
    /// Those of them that nobody forced.
    pub natural: Needs,
    /// For each material the rows among `OF_MATERIALS` that are on if it is alone.
    of_material: Vec<Needs>,
}

impl Decision {
    /// What is needed, and what is `forced` beside what the scene needs by itself.
    pub(crate) fn of(inputs: &NeedInputs<'_>, forced: impl FnOnce(Needs) -> Needs) -> Self {
        let natural = Needs::judged(inputs, Needs::default());
        let alone = inputs.materials.iter().map(|material| {
            let alone = inputs.with_materials(std::slice::from_ref(material));
            Needs::judged(&alone, Needs::default()).and(OF_MATERIALS)
        });
        Self {
            needs: Needs::judged(inputs, forced(natural)),
            natural,
            of_material: alone.collect(),
        }
    }

    /// The rows of a plan, whose stages are kernels of their own if it is a wavefront.
    pub(crate) fn of_plan(&self, wavefront: bool) -> Needs {
        if wavefront {
            self.needs
        } else {
            self.needs.minus(OF_WAVEFRONTS)
        }
    }

    /// Of the rows of a plan, those of a kernel that evaluates `members` only: a condition on materials
    /// holds for several if it does for one of them.
    pub(crate) fn of_members(&self, of_plan: Needs, members: &[usize]) -> Needs {
        let own = members.iter().filter_map(|m| self.of_material.get(*m));
        let forced = self.needs.minus(self.natural);
        let own = own.fold(forced, |all, one| all.or(*one));
        let mut needs = of_plan.minus(OF_MATERIALS.minus(own));
        if !needs.has(Need::ShadowRays) {
            needs = needs.without(Need::Absorption);
        }
        if !needs.any(&[Need::Absorption, Need::MediumChanges, Need::ExteriorIor]) {
            needs = needs.without(Need::Media);
        }
        needs
    }
}

#[cfg(test)]
mod tests {
    use impasto_compiler::abi::{Input, InputSet, MaterialInfo};

    use super::*;
    use crate::technique::{CameraRays, LastRays, RayData, RayFetch, RayKernels, RayOrder};
    use crate::world::needs::{LightTraits, MediaTraits, SurfaceTraits};

    fn material(change: fn(&mut MaterialInfo)) -> MaterialInfo {
        let mut material = MaterialInfo {
            name: "m".into(),
            delta_only: false,
            crosses: false,
            walks: false,
            transmissive: false,
            varying_emission: false,
            inputs: InputSet::default(),
            textures: Vec::new(),
            lobes: 1,
        };
        change(&mut material);
        material
    }

    fn materials() -> [MaterialInfo; 6] {
        [
            material(|_| {}),
            material(|m| m.delta_only = true),
            material(|m| (m.transmissive, m.delta_only) = (true, true)),
            material(|m| (m.varying_emission, m.lobes) = (true, 2)),
            material(|m| m.inputs = InputSet::of(&[Input::ExteriorIor, Input::Normal])),
            material(|m| {
                m.inputs = InputSet::of(&[Input::Uv, Input::Position, Input::FootprintUv])
            }),
        ]
    }

    fn inputs(materials: &[MaterialInfo], sampled: bool, followed: bool) -> NeedInputs<'_> {
        NeedInputs {
            lights: LightTraits {
                sampled,
                weighted: true,
                ..LightTraits::default()
            },
            media: MediaTraits {
                followed,
                absorb: followed,
                ..MediaTraits::default()
            },
            surface: SurfaceTraits {
                normals: true,
                uvs: true,
                ..SurfaceTraits::default()
            },
            lens: false,
            max_depth: 4,
            roulette_start: 9,
            materials,
            ray_order: RayOrder::Coarse,
            ray_data: RayData::Slots,
            ray_fetch: RayFetch::Persistent,
            ray_kernels: RayKernels::One,
            camera_rays: CameraRays::AtOnce,
            last_rays: LastRays::Lights,
            outputs: Default::default(),
        }
    }

    #[test]
    fn rows_of_materials_are_those_of_each_alone() {
        let all = materials();
        for (sampled, followed) in [(false, false), (false, true), (true, false), (true, true)] {
            let inputs = inputs(&all, sampled, followed);
            let decision = Decision::of(&inputs, |_| Needs::default());
            for set in 0..1u32 << all.len() {
                let members: Vec<usize> = (0..all.len()).filter(|m| set >> m & 1 == 1).collect();
                let some: Vec<MaterialInfo> = members.iter().map(|m| all[*m].clone()).collect();
                let judged = Needs::judged(&inputs.with_materials(&some), Needs::default());
                let alone = members.iter().map(|m| decision.of_material[*m]);
                let alone = alone.fold(Needs::default(), Needs::or);
                assert_eq!(alone, judged.and(OF_MATERIALS), "{members:?}");
            }
        }
    }

    #[test]
    fn a_kernel_has_the_rows_of_its_materials_and_those_that_are_forced() {
        let all = materials();
        let inputs = inputs(&all, true, true);
        let decision = Decision::of(&inputs, |_| Needs::default());
        let mirror = decision.of_members(decision.needs, &[1]);
        assert!(!mirror.any(&[Need::ShadowRays, Need::Absorption, Need::Media, Need::Uvs]));
        assert!(mirror.has(Need::Order) && !decision.of_plan(false).has(Need::Order));
        let glass = decision.of_members(decision.needs, &[1, 2]);
        assert!(glass.has(Need::Media) && !glass.any(&[Need::Absorption, Need::ExteriorIor]));
        let natural = Decision::of(&inputs, |_| Needs::default()).needs;
        let forced = Decision::of(&inputs, |_| Needs::of_rows(&[Need::Tangents]));
        assert_eq!(forced.needs, natural.with(Need::Tangents));
        assert_eq!(forced.natural, natural);
        assert!(forced.of_members(forced.needs, &[1]).has(Need::Tangents));
    }
}
