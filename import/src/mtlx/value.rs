//! What a node gives: an expression, and what else is known of it.

use crate::mtlx::types::{Literal, Type};

/// The value of an output or of an input.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Value {
    pub ty: Type,
    /// The expression; empty for shaders and media, which [`Extra`] has.
    pub text: String,
    /// The number or text that it is, if it is known.
    pub literal: Option<Literal>,
    /// Is it a point, vector or normal of the language, and no vec3?
    pub is_geometric: bool,
    pub extra: Extra,
}

/// What an expression does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Extra {
    #[default]
    None,
    /// Of a pair of microfacet widths: roughness and anisotropy as the library's bsdfs take them.
    Roughness(String, String),
    /// Of a volume, or a bsdf that lets light into the object.
    Medium(Medium),
    /// Of an edf that is even in all directions.
    Radiance(String),
    Shader(Shader),
}

/// What fills an object, as arguments of `medium`; empty ones are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Medium {
    pub absorption: String,
    pub scattering: String,
    pub anisotropy: String,
    pub ior: String,
}

impl Medium {
    /// The call.
    pub fn text(&self) -> String {
        let parts = [
            ("absorption", &self.absorption),
            ("ior", &self.ior),
            ("scattering", &self.scattering),
            ("anisotropy", &self.anisotropy),
        ];
        let parts = parts.iter().filter(|(_, text)| !text.is_empty());
        let parts: Vec<String> = parts
            .map(|(name, text)| format!("{name}: {text}"))
            .collect();
        format!("medium({})", parts.join(", "))
    }

    /// This medium, with what only the other says.
    pub fn or(self, other: &Self) -> Self {
        let or = |a: String, b: &String| if a.is_empty() { b.clone() } else { a };
        Self {
            absorption: or(self.absorption, &other.absorption),
            scattering: or(self.scattering, &other.scattering),
            anisotropy: or(self.anisotropy, &other.anisotropy),
            ior: or(self.ior, &other.ior),
        }
    }
}

/// A surface shader.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shader {
    /// A call of a material.
    Call(String),
    Outputs(Outputs),
}

/// The outputs of a material; those that are missing are not assigned.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Outputs {
    pub surface: Option<String>,
    pub emission: Option<String>,
    pub opacity: Option<String>,
    pub interior: Option<String>,
}

impl Value {
    pub fn new(ty: Type, text: impl Into<String>) -> Self {
        Self {
            ty,
            text: text.into(),
            literal: None,
            is_geometric: false,
            extra: Extra::None,
        }
    }

    /// A value that is known.
    pub fn of(ty: Type, literal: Literal) -> Self {
        Self {
            literal: Some(literal.clone()),
            ..Self::new(ty, literal.written(ty))
        }
    }

    /// A point, vector or normal of the language.
    pub fn geometric(text: impl Into<String>) -> Self {
        Self {
            is_geometric: true,
            ..Self::new(Type::Vector3, text)
        }
    }

    pub fn with(mut self, extra: Extra) -> Self {
        self.extra = extra;
        self
    }

    /// The expression for arithmetic, which points and directions take part in as vectors.
    pub fn plain(&self) -> String {
        if self.is_geometric {
            format!("vec3({})", self.text)
        } else {
            self.text.clone()
        }
    }

    /// The number that all its components are, if it is known.
    pub fn single(&self) -> Option<f64> {
        self.literal.as_ref().and_then(Literal::single)
    }

    /// Is it known to be zero? So documents write directions that are not given.
    pub fn is_zero(&self) -> bool {
        self.single() == Some(0.0)
    }

    /// The medium that light enters.
    pub fn medium(&self) -> Option<&Medium> {
        match &self.extra {
            Extra::Medium(medium) => Some(medium),
            _ => None,
        }
    }
}
