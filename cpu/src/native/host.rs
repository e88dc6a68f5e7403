//! Functions that native code calls: those of floats that processors have no instruction for, and the
//! host's answers.

use std::ffi::c_void;

use naga::MathFunction as Math;

use crate::arithmetic::Called;

/// Answers a call in place of the kernel's function: the words of its arguments are given, those of its
/// result are left.
pub(super) type Answer =
    unsafe extern "C" fn(data: *const c_void, arguments: *const u32, result: *mut u32);

/// A function of one float.
type One = extern "C" fn(f32) -> f32;

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

extern "C" fn remainder(x: f32, y: f32) -> f32 {
    x % y
}

extern "C" fn half_bits(x: f32) -> u32 {
    half::f16::from_f32(x).to_bits().into()
}

/// The address of a function that is called.
pub(super) fn address(function: Called) -> usize {
    let one: One = match function {
        Called::Remainder => return remainder as *const () as usize,
        Called::HalfBits => return half_bits as *const () as usize,
        Called::Two(Math::Pow) => return pow as *const () as usize,
        Called::Two(_) => return atan2 as *const () as usize,
        Called::One(Math::Cos) => cos,
        Called::One(Math::Cosh) => cosh,
        Called::One(Math::Sin) => sin,
        Called::One(Math::Sinh) => sinh,
        Called::One(Math::Tan) => tan,
        Called::One(Math::Tanh) => tanh,
        Called::One(Math::Acos) => acos,
        Called::One(Math::Asin) => asin,
        Called::One(Math::Atan) => atan,
        Called::One(Math::Asinh) => asinh,
        Called::One(Math::Acosh) => acosh,
        Called::One(Math::Atanh) => atanh,
        Called::One(Math::Exp) => exp,
        Called::One(Math::Exp2) => exp2,
        Called::One(Math::Log) => log,
        Called::One(Math::Log2) => log2,
        Called::One(_) => to_half_and_back,
    };
    one as usize
}
