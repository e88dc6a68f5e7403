//! Functions that native code calls: those of floats that processors have no instruction for, and the
//! host's answers.

use std::ffi::c_void;

use naga::MathFunction as Math;

/// Answers a call in place of the kernel's function: the words of its arguments are given, those of its
/// result are left.
pub type Answer =
    unsafe extern "C" fn(data: *const c_void, arguments: *const u32, result: *mut u32);

/// A function of one float.
pub(super) type One = extern "C" fn(f32) -> f32;
/// A function of two floats.
pub(super) type Two = extern "C" fn(f32, f32) -> f32;

macro_rules! functions {
    ($($name:ident: $function:path),+ $(,)?) => {
        $(extern "C" fn $name(x: f32) -> f32 {
            $function(x)
        })+
    };
}

functions! {
    cos: f32::cos, cosh: f32::cosh, sin: f32::sin, sinh: f32::sinh, tan: f32::tan, tanh: f32::tanh,
    acos: f32::acos, asin: f32::asin, atan: f32::atan, asinh: f32::asinh, acosh: f32::acosh,
    atanh: f32::atanh, exp: f32::exp, exp2: f32::exp2, log: f32::ln, log2: f32::log2,
}

extern "C" fn to_half_and_back(x: f32) -> f32 {
    half::f16::from_f32(x).to_f32()
}

extern "C" fn atan2(y: f32, x: f32) -> f32 {
    y.atan2(x)
}

extern "C" fn pow(x: f32, y: f32) -> f32 {
    x.powf(y)
}

pub(super) extern "C" fn remainder(x: f32, y: f32) -> f32 {
    x % y
}

pub(super) extern "C" fn half_bits(x: f32) -> u32 {
    half::f16::from_f32(x).to_bits().into()
}

/// The function of one float that is called for a function of WGSL.
pub(super) fn one(function: Math) -> Option<One> {
    Some(match function {
        Math::Cos => cos,
        Math::Cosh => cosh,
        Math::Sin => sin,
        Math::Sinh => sinh,
        Math::Tan => tan,
        Math::Tanh => tanh,
        Math::Acos => acos,
        Math::Asin => asin,
        Math::Atan => atan,
        Math::Asinh => asinh,
        Math::Acosh => acosh,
        Math::Atanh => atanh,
        Math::Exp => exp,
        Math::Exp2 => exp2,
        Math::Log => log,
        Math::Log2 => log2,
        Math::QuantizeToF16 => to_half_and_back,
        _ => return None,
    })
}

/// The same of two.
pub(super) fn two(function: Math) -> Option<Two> {
    Some(match function {
        Math::Atan2 => atan2,
        Math::Pow => pow,
        _ => return None,
    })
}
